"""The tool of mutants: its places are where it says, and what it writes is a program. (`make mutants` runs it.)"""

import ast
import random
from pathlib import Path

import pytest
from mutants import building, cpp_places, listed, python_places, switches

ROOT = Path(__file__).parent.parent


def test_every_change_listed_by_hand_is_of_a_text_that_is_there():
    assert [listed.found(ROOT, changes)[1] for changes in (listed.CPP, listed.PYTHON)] == [[], []]


def test_places_of_cpp():
    found = building.without_overlaps([*listed.found(ROOT, listed.CPP)[0], *cpp_places.everything(ROOT)])
    assert len(found) > 400 and len({m.key for m in found}) == len(found)
    by_file = {}
    for number, m in enumerate(found):
        by_file.setdefault(m.file, []).append((number, m))
    for file, mutants in by_file.items():
        text = (ROOT / file).read_text(encoding="utf-8")
        written = switches.instrumented(text, mutants)
        for number, _ in mutants:
            assert f"({number})" in written or f"({number}," in written, (file, number)
        for opening, closing in ("()", "{}", "[]"):
            assert written.count(opening) - written.count(closing) == text.count(opening) - text.count(closing), file


def test_places_of_python():
    found = python_places.everything(ROOT)
    assert len(found) > 1000
    for m in random.Random(0).sample([*found, *listed.found(ROOT, listed.PYTHON)[0]], 60):
        text = (ROOT / m.file).read_text(encoding="utf-8")
        assert text[m.begin : m.end] == m.before != m.after
        ast.parse(text[: m.begin] + m.after + text[m.end :])


@pytest.mark.parametrize(
    ("right", "wrong", "switched"),
    [
        ("a != b", "false", " (PYCRAFT_MUTANT({i}) ? (false) : (a != b))"),
        ("s = sqrt(x / y);", "s = S(1);", "s = (PYCRAFT_MUTANT({i}) ? (S(1)) : (sqrt(x / y)));"),
        ("p < 2", "p < 1", " (PYCRAFT_MUTANT({i}) ? (p < 1) : (p < 2))"),
    ],
)
def test_an_expression_becomes_a_switch(right, wrong, switched):
    assert listed.switched(right, wrong) == switched
