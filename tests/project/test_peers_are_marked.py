"""Tests that need a package of the extra [peers] are marked: unmarked, they are skipped without those packages, and excluded with them."""

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
PEERS = ("pinocchio", "mujoco", "example_robot_data")


def needs_a_peer(function, fixtures):
    calls = (node for node in ast.walk(function) if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("importorskip"))
    asked = {argument.arg for argument in function.args.args}
    return any(ast.literal_eval(call.args[0]).split(".")[0] in PEERS for call in calls) or bool(asked & fixtures)


def is_fixture(function):
    return any("fixture" in ast.unparse(decorator) for decorator in function.decorator_list)


def unmarked(text):
    """Tests of a file that ask for a peer, themselves or by a fixture, and are not marked."""
    tree = ast.parse(text)
    marks = [node for node in tree.body if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "pytestmark"]
    if any("mark.peers" in ast.unparse(node.value) for node in marks):
        return []
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    fixtures = {f.name for f in functions if is_fixture(f) and needs_a_peer(f, set())}
    tests = [f for f in functions if f.name.startswith("test") and needs_a_peer(f, fixtures)]
    top = ast.Module([node for node in tree.body if isinstance(node, (ast.Assign, ast.Expr, ast.If))], [])
    whole = [call for call in ast.walk(top) if isinstance(call, ast.Call) and ast.unparse(call.func).endswith("importorskip")]
    if any(ast.literal_eval(call.args[0]).split(".")[0] in PEERS for call in whole):
        tests = [f for f in functions if f.name.startswith("test")]
    return [f.name for f in tests if not any("mark.peers" in ast.unparse(decorator) for decorator in f.decorator_list)]


@pytest.mark.parametrize("path", sorted(TESTS.rglob("test_*.py")), ids=lambda path: path.stem)
def test_who_needs_a_peer_is_marked(path):
    assert unmarked(path.read_text()) == []


def test_the_rule_sees_what_is_unmarked():
    start = "import pytest\n"
    own = "def test_a():\n    pytest.importorskip('mujoco')\n"
    fixture = "@pytest.fixture\ndef pin():\n    return pytest.importorskip('pinocchio')\ndef test_b(pin): ...\n"
    assert unmarked(start + own) == ["test_a"] and unmarked(start + fixture) == ["test_b"]
    assert unmarked(start + "m = pytest.importorskip('mujoco')\ndef test_c(): ...\n") == ["test_c"]
    assert unmarked(start + "@pytest.mark.peers\n" + own) == [] and unmarked(start + "pytestmark = pytest.mark.peers\n" + own) == []
