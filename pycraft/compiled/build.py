"""Source built once by the system's C++ compiler: libraries are cached in a folder of the user, keyed by source, compiler and machine.

The folder is `PYCRAFT_CACHE` if set, else `pycraft` in `XDG_CACHE_HOME` or `~/.cache`; it may be deleted at any time.
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
"""Products are fused with sums if the machine has such an instruction; otherwise IEEE 754 is respected.
Neighbouring terms of a formula are not vectorized: the shuffles cost more than they save."""


def compiler() -> list[str]:
    """Return the command of a C++ compiler: `CXX` if set, else the first of c++, g++, clang++. Raises EvaluationError if there is none."""
    named = shlex.split(os.environ.get("CXX", ""))
    for command in [named] if named else [["c++"], ["g++"], ["clang++"]]:
        found = shutil.which(command[0])
        if found:
            return [found, *command[1:]]
    raise _core.EvaluationError(
        (f"CXX={shlex.join(named)!r} is not a command" if named else "no C++ compiler is on the path (c++, g++, clang++)")
        + ": compile() needs a C++20 compiler; install one, or name it in the environment variable CXX. "
        "Without one, prepare() gives the fastest calls"
    )


def folder() -> Path:
    """Return the folder of cached libraries."""
    chosen = os.environ.get("PYCRAFT_CACHE")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "pycraft"


@cache
def _machine(command: tuple[str, ...]) -> bytes:
    """Return a compiler's predefined macros, which identify it and the machine."""
    macros = subprocess.run([*command, *FLAGS, "-dM", "-E", "-x", "c++", os.devnull], capture_output=True, check=False)
    return macros.stdout


def built(source: str) -> Path:
    """Return the library of a source, built if it is not cached. If the build fails, EvaluationError has the compiler's message."""
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
                raise _core.EvaluationError(f"{shlex.join(command)} failed to build the source:\n{done.stderr[:2000]}")
            os.replace(made, library)  # atomic, so that nobody loads an incomplete file
    except OSError as error:
        raise _core.EvaluationError(f"libraries cannot be cached in {place}: {error}; set PYCRAFT_CACHE to a writable folder") from error
    return library
