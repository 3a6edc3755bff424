"""The tool of mutants: its places are where it says, and what it writes is a program. (`make mutants` runs it.)"""

import ast
import random
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from mutants import building, cpp_places, known, listed, python_places, running, switches

ROOT = Path(__file__).parents[2]


def test_every_change_listed_by_hand_is_of_a_text_that_is_there():
    assert [listed.found(ROOT, changes)[1] for changes in (listed.CPP, listed.PYTHON)] == [[], []]


@pytest.mark.parametrize("places", [cpp_places, python_places])
def test_every_pattern_of_places_finds_files(places):
    assert [pattern for pattern in places.TARGETS if not any(ROOT.glob(pattern))] == []


def test_areas_and_the_dozen_name_tests_and_sources_that_are_there():
    tests = {*known.DOZEN_TESTS, *(name for names in known.AREAS.values() for name in names)}
    assert [name for name in sorted(tests) if not (ROOT / "tests" / name).is_file()] == []
    assert [name for name in known.AREAS if not (ROOT / name).is_file()] == []


def test_what_is_left_out_would_be_in():
    files = {path.relative_to(ROOT).as_posix() for pattern in python_places.TARGETS for path in ROOT.glob(pattern)}
    assert python_places.LEFT_OUT <= files


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


@pytest.mark.slow
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


@pytest.fixture(scope="module")
def small_build(tmp_path_factory):
    """A tree with a package and tests of its own; the tool's plugin is that of here."""
    tree = tmp_path_factory.mktemp("tree")
    for name, text in {
        "pyproject.toml": "[tool.pytest.ini_options]\nmarkers = ['slow', 'peers']",
        "pycraft/__init__.py": "",
        "tests/test_some.py": "def test_right(): pass\ndef test_wrong(): assert 0\ndef test_wrong_too(): assert 0\n",
        "tests/test_end.py": "import os\ndef test_end(): os.abort()\n",
    }.items():
        (tree / name).parent.mkdir(exist_ok=True)
        (tree / name).write_text(text, encoding="utf-8")
    (tree / "tests/mutants").symlink_to(ROOT / "tests/mutants")
    return SimpleNamespace(tree=tree)


@pytest.mark.parametrize(
    ("tests", "by"),
    [
        (["test_some.py::test_right", "test_some.py::test_gone", "test_gone.py::test_gone"], ""),
        (["test_some.py::test_right", "test_some.py::test_wrong_too", "test_some.py::test_wrong"], "tests/test_some.py::test_wrong_too"),
        (["test_some.py::test_right", "test_end.py::test_end"], "crash: tests/test_end.py::test_end"),
    ],
)
def test_a_mutant_is_killed_by_a_test_that_fails_and_not_by_one_that_is_gone(small_build, tests, by):
    tests = [f"tests/{name}" for name in tests]
    files = [name for name in dict.fromkeys(t.split("::")[0] for t in tests) if (small_build.tree / name).exists()]
    assert running.pytest_run(small_build, files, 60, tests, first=True).by() == by


@pytest.mark.parametrize(
    ("status", "lines", "by"),
    [
        (pytest.ExitCode.OK, ["began a", "began b"], ""),
        (pytest.ExitCode.USAGE_ERROR, [], ""),  # a file that is gone
        (pytest.ExitCode.NO_TESTS_COLLECTED, [], ""),
        (pytest.ExitCode.TESTS_FAILED, ["began a", "began b", "red b"], "b"),
        (pytest.ExitCode.USAGE_ERROR, ["red tests/test_a.py"], "tests/test_a.py"),  # it cannot be imported
        (-11, ["began a", "began b"], "crash: b"),
        (None, ["began a"], "no end: a"),
        (3, ["began a"], "exit status 3: a"),
        (running.NOT_IMPORTED, [], "import pycraft"),
    ],
)
def test_what_turned_red(status, lines, by):
    assert running.Run(status, "", lines).by() == by


def test_a_copy_of_the_tree_keeps_no_test_that_is_gone(tmp_path):
    gone = tmp_path / "tests/test_gone.py"
    gone.parent.mkdir()
    gone.touch()
    building.copy_of_tree(ROOT, tmp_path)
    assert not gone.exists() and (tmp_path / "tests/project/test_mutants.py").is_file()


def test_the_table_names_tests_and_no_place_of_this_machine():
    text = (ROOT / "tests/mutation.md").read_text(encoding="utf-8")
    killers = [row.split(" | ")[1].removesuffix(" |") for row in text.split("## Listed by hand")[1].splitlines()[4:]]
    assert killers and "/tree/" not in text
    for by in killers:
        file = re.match(r"(?:[a-z -]+: )?([\w/]+\.(?:py|cpp))", by)
        assert by in ("survived", "not executed", "import pycraft") or (file and (ROOT / file[1]).is_file()), by
