"""The committed stubs match the compiled core."""

import importlib.util
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_stubs_match_the_core():
    spec = importlib.util.spec_from_file_location("stubs", ROOT / "cpp" / "bindings" / "stubs.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.stubs() == (ROOT / "pycraft" / "_core.pyi").read_text(), "run python cpp/bindings/stubs.py"
