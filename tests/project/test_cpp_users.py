"""C++ users: the program of docs/cpp.md, configured, built and run against the installed package, gives Python's numbers."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import pycraft as pc

PAGE = (Path(__file__).parents[2] / "docs" / "cpp.md").read_text(encoding="utf-8")
BESIDE_PYTHON = str(Path(sys.executable).parent)
CMAKE = shutil.which("cmake", path=BESIDE_PYTHON) or shutil.which("cmake")


def block(language):
    return re.search(rf"```{language}\n(.*?)```", PAGE, re.S).group(1)


def configure(folder, *options):
    """CMake on the page's project; what it said."""
    (folder / "CMakeLists.txt").write_text(block("cmake"), encoding="utf-8")
    (folder / "pendulum.cpp").write_text(block("cpp"), encoding="utf-8")
    ninja = shutil.which("ninja", path=BESIDE_PYTHON)
    generator = ["-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={ninja}"] if ninja else []
    program = [CMAKE, "-S", str(folder), "-B", str(folder / "build"), f"-Dpycraft_DIR={pc.cmake_dir()}", *generator, *options]
    return subprocess.run(program, capture_output=True, text=True)


pytestmark = pytest.mark.skipif(CMAKE is None, reason="needs CMake")


def test_the_package_names_its_headers():
    folder = Path(pc.cmake_dir())
    assert (folder / "pycraftConfig.cmake").is_file() and (folder.parents[2] / "include/pycraft/algebra/language/expression.h").is_file()
    targets = (folder / "pycraftTargets.cmake").read_text()
    assert 'INTERFACE_COMPILE_FEATURES "cxx_std_20"' in targets


def test_headers_include_each_other_under_pycraft():
    """So that a header of another package in a folder `model` is not taken for ours."""
    include = Path(pc.cmake_dir()).parents[2] / "include"
    assert [folder.name for folder in include.iterdir()] == ["pycraft"]
    folders = {folder.name for folder in (include / "pycraft").iterdir()}
    assert {"algebra", "model", "dynamics", "simulation"} <= folders
    for header in include.rglob("*.h"):
        for named in re.findall(r'^#include "([^"]+)"', header.read_text(encoding="utf-8"), re.M):
            assert named.startswith("pycraft/") and (include / named).is_file(), (header.name, named)
    targets = (Path(pc.cmake_dir()) / "pycraftTargets.cmake").read_text()
    assert 'INTERFACE_INCLUDE_DIRECTORIES "${_IMPORT_PREFIX}/include"' in targets


def test_what_is_missing_is_named(tmp_path):
    """Without the headers the error says what to do. The copy has no Python packages beside it."""
    elsewhere = tmp_path / "lib/cmake/pycraft"
    shutil.copytree(pc.cmake_dir(), elsewhere)
    run = configure(
        tmp_path, f"-Dpycraft_DIR={elsewhere}", "-DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON", "-DCMAKE_DISABLE_FIND_PACKAGE_Boost=ON"
    )
    said = " ".join(run.stderr.split())
    assert run.returncode and "pycraft needs the headers of Eigen3 and Boost: pip install 'pycraft-soa[cpp]'" in said


@pytest.mark.slow
def test_the_example_of_the_page_runs(tmp_path):
    made = configure(tmp_path)
    assert made.returncode == 0, made.stderr
    built = subprocess.run([CMAKE, "--build", str(tmp_path / "build")], capture_output=True, text=True)
    assert built.returncode == 0 and "warning" not in built.stdout, built.stdout[-3000:]
    printed = subprocess.run([str(tmp_path / "build" / "pendulum")], capture_output=True, text=True, check=True).stdout.splitlines()
    shown, *numbers = printed
    assert [line.split()[:-2] for line in printed[1:]] == [line.split()[:-2] for line in block("text").splitlines()[1:]]
    for line, on_the_page in zip(printed[1:], block("text").splitlines()[1:], strict=True):
        assert np.allclose(*([float(x) for x in text.split()[-2:]] for text in (line, on_the_page)), rtol=1e-13, atol=0)
    pendulum = pc.chain(2)
    pendulum.gravity = (0, -9.81, 0)
    H, phi, M = pendulum.soa("H phi M")
    inverse = (H @ phi @ M @ phi.T @ H.T).inv()
    q, forces = [0.4, 1.1], np.array([1.0, 0.5])
    assert shown == inverse.text()
    expected = [inverse.at(q) @ forces, pendulum.forward_dynamics(q, [0, 0], forces)]
    pendulum.gravity = (0, -1.62, 0)
    expected.append(pendulum.forward_dynamics([0, 0], [0, 0], forces + [2, 0]))  # 2 N across the lower rod's hinge, 1 m from the upper's
    for line, value in zip(numbers, expected, strict=True):
        assert np.allclose([float(x) for x in line.split()[-2:]], value, rtol=1e-12, atol=0)
