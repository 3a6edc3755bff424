"""Source built by the system's C++ compiler, once: libraries are kept in a folder of the user's, by what they are made of.

The folder is `PYCRAFT_CACHE` where that is set, else `pycraft` in `XDG_CACHE_HOME` or `~/.cache`; it may be deleted at any time.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from .. import _core

_NATIVE = "-mcpu=native" if platform.machine() in ("arm64", "aarch64") else "-march=native"
FLAGS = ("-std=c++20", "-O2", _NATIVE, "-ffp-contract=fast", "-fno-math-errno", "-fno-tree-slp-vectorize", "-fPIC", "-shared")
"""Products are contracted with sums where the machine has such an instruction; nothing else of IEEE 754 is given up.
Neighbours in a formula are not made vectors of: what shuffles them costs more than it brings."""


def compiler() -> list[str]:
    """The command of a C++ compiler: `CXX` where it is set, else the first of c++, g++, clang++. EvaluationError where there is none."""
    named = shlex.split(os.environ.get("CXX", ""))
    for command in [named] if named else [["c++"], ["g++"], ["clang++"]]:
        found = shutil.which(command[0])
        if found:
            return [found, *command[1:]]
    raise _core.EvaluationError(
        (f"CXX={shlex.join(named)!r} is no command" if named else "no C++ compiler is on the path (c++, g++, clang++)")
        + ": compile() needs one that knows C++20; install it, or name it by the environment variable CXX. "
        "Without one, prepare() gives the fastest calls"
    )


def folder() -> Path:
    """Where libraries are kept."""
    chosen = os.environ.get("PYCRAFT_CACHE")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "pycraft"


@cache
def _machine(command: tuple[str, ...]) -> bytes:
    """What a compiler knows of itself and of this machine: its macros."""
    macros = subprocess.run([*command, *FLAGS, "-dM", "-E", "-x", "c++", os.devnull], capture_output=True, check=False)
    return macros.stdout


def built(source: str) -> Path:
    """The library of a source, built where the folder does not hold it. EvaluationError with what the compiler says where it fails."""
    command = compiler()
    key = hashlib.sha256(b"\0".join([source.encode(), shlex.join([*command, *FLAGS]).encode(), _machine(tuple(command))])).hexdigest()[:32]
    place = folder()
    library = place / f"{key}.so"
    if library.exists():
        return library
    try:
        place.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=place) as work:
            written, made = Path(work, "source.cpp"), Path(work, "library.so")
            written.write_text(source, encoding="utf-8")
            done = subprocess.run([*command, *FLAGS, "-o", str(made), str(written)], capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise _core.EvaluationError(f"{shlex.join(command)} does not build the source:\n{done.stderr[:2000]}")
            os.replace(made, library)  # at once, so that no one loads half of it
    except OSError as error:
        raise _core.EvaluationError(
            f"libraries cannot be kept in {place}: {error}; set PYCRAFT_CACHE to a folder that can be written"
        ) from error
    return library
