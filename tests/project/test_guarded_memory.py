"""The library that guards the core's memory in campaigns ends a process at each fault that it is for; a small core has them all."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CORE = """
#include <cstddef>
double* block;
extern "C" void take(size_t n) { block = new double[n]; }
extern "C" void give() { delete[] block; }
extern "C" double read(long i) { return block[i]; }
extern "C" void write(long i) { block[i] = 1; }
"""
USE = """
import ctypes, faulthandler, sys
core = ctypes.CDLL(sys.argv[1])
core.read.restype = ctypes.c_double
ctypes.CDLL(None).guarded_memory_begin()
core.take(5)
exec(sys.argv[2])
print("passed")
"""
FAULTS = {
    "read past the end": "core.read(5)",
    "written past the end": "core.write(5)",
    "read after the release": "core.give(); core.read(0)",
    "written before the begin": "core.write(-1); core.give()",
    "released twice": "core.give(); core.give()",
}
SOUND = {
    "the whole block": "[core.write(i) for i in range(5)]; assert core.read(4) == 1; core.give()",
    "an unwritten value is NaN": "value = core.read(2); assert value != value; core.give()",
    "many blocks": "core.give(); [(core.take(n), core.write(n - 1), core.give()) for n in range(1, 2000)]",
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    if not sys.platform.startswith("linux") or not shutil.which("g++"):
        pytest.skip("needs Linux and g++")
    folder = tmp_path_factory.mktemp("pycraft")
    source, core, guard = folder / "core.cpp", folder / "_core.test.so", folder / "guarded_memory.so"
    source.write_text(CORE)
    for made, of in ((core, source), (guard, ROOT / "tests" / "campaigns" / "guarded_memory.cpp")):
        subprocess.run(["g++", "-std=c++20", "-O1", "-shared", "-fPIC", "-o", made, of], check=True)

    def call(what):
        return subprocess.run(
            [sys.executable, "-S", "-c", USE, core, what], env=os.environ | {"LD_PRELOAD": str(guard)}, capture_output=True, text=True
        )

    return call


@pytest.mark.parametrize("what", FAULTS.values(), ids=FAULTS)
def test_a_fault_ends_the_process(run, what):
    ended = run(what)
    assert ended.returncode < 0 and "passed" not in ended.stdout, ended


@pytest.mark.parametrize("what", SOUND.values(), ids=SOUND)
def test_sound_use_passes(run, what):
    ended = run(what)
    assert ended.returncode == 0 and "passed" in ended.stdout, ended
