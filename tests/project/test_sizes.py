"""Files and functions that a reader takes in: no file above 400 lines, no function of Python above a screen."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = sorted(p for pattern in ("cpp/**/*.h", "cpp/**/*.cpp", "pycraft/**/*.py") for p in ROOT.glob(pattern))
SCREEN = 66


def test_files():
    long = {p.relative_to(ROOT).as_posix(): n for p in SOURCES if (n := len(p.read_text().splitlines())) > 400}
    assert len(SOURCES) > 300 and not long


@pytest.mark.parametrize("room", sorted({p.relative_to(ROOT).parts[1] for p in SOURCES if p.suffix == ".py"}))
def test_functions(room):
    long = []
    for path in SOURCES:
        if path.suffix != ".py" or path.relative_to(ROOT).parts[1] != room:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                first = node.body[0]
                said = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
                lines = node.end_lineno - (first.end_lineno if said else node.lineno)  # a docstring is not what is taken in at a glance
                if lines > SCREEN:
                    long.append(f"{path.relative_to(ROOT)}: {node.name}, {lines} lines")
    assert not long
