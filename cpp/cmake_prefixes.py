"""Prints, as a CMake list, the folders in which Python packages keep their CMake files: `cmeel.prefix` and pybind11's own."""

import sys
from pathlib import Path

folders = [Path(entry) / "cmeel.prefix" for entry in sys.path]
folders += [Path(entry) / "pybind11" / "share" / "cmake" / "pybind11" for entry in sys.path]
print(";".join(folder.as_posix() for folder in folders if folder.is_dir()))
