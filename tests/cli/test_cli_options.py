"""Every option of every command changes something: what is measured, or what comes out. A new option needs a line here."""

import json
from importlib import import_module

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from pycraft.cli.commands import app

runner = CliRunner()
COMMANDS = typer.main.get_command(app).commands

MIMICKING = """<robot name="mimicking"><link name="base"/>
{links}
<joint name="a" type="revolute"><parent link="base"/><child link="first"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="b" type="revolute"><parent link="first"/><child link="second"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/><mimic joint="a"/></joint></robot>"""
LINK = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'

# What is measured with an option and without: the option's values that must each differ from the default and from one another.
BEFORE = {
    "tour": {"model": [["ur5"], ["puma560"]], "root": [["--root", "free"]], "mimic": [["--mimic", "lock"], ["--mimic", "free"]]},
    "check": {
        "model": [["ur5"], ["puma560"]],
        "states": [["--states", "1"], ["--states", "2"]],
        "seed": [["--seed", "1"], ["--seed", "2"]],
        "precision": [["--precision", "quad"], ["--precision", "50"]],
        "root": [["--root", "free"]],
        "mimic": [["--mimic", "lock"], ["--mimic", "free"]],
    },
    "bench": {"seconds": [["--seconds", "0.5"], ["--seconds", "0.25"]]},
    "accuracy": {
        "model": [["ur5"], ["puma560"]],
        "integration": [["--integration"]],
        "form": [["--form", "ud"], ["--form", "fast", "--form", "ud"]],
        "precision": [["--precision", "quad"], ["--precision", "50"]],
        "method": [["--method", "ldl"], ["--method", "cholesky"]],
        "seconds": [["--seconds", "0.5"], ["--seconds", "0.25"]],
        "duration": [["--integration", "--duration", "2"], ["--integration", "--duration", "3"]],
        "seed": [["--seed", "1"], ["--seed", "2"]],
        "root": [["--root", "free"]],
        "mimic": [["--mimic", "lock"], ["--mimic", "free"]],
    },
    "stability": {
        "seeds": [["--seeds", "2"], ["--seeds", "3"]],
        "steps": [["--steps", "10"], ["--steps", "20"]],
        "case": [["--case", "wrist"], ["--case", "gimbal"]],
        "peers": [["--no-peers"]],
    },
    "peers": {"states": [["--states", "1"], ["--states", "2"]], "seed": [["--seed", "1"], ["--seed", "2"]]},
}
# What changes the output of one measurement is tested below, or where it says.
AFTER = {
    "check": {"json", "every", "dialect"},  # dialect: tests/identities
    "accuracy": {"error", "front", "csv", "json", "plot"},  # also test_cli.py
    "stability": {"output", "csv", "json"},
    "bench": {"peers", "quick", "json", "plot", "page"},  # test_speed.py
    "peers": {"output"},  # test_peers.py: `make test-peers`
}


def test_every_option_is_here():
    """Of the commands that measure; others have tests of their own."""
    for name, measured in BEFORE.items():
        known = {*measured, *AFTER.get(name, ()), "help"}
        assert {p.name for p in COMMANDS[name].params} <= known, name


@pytest.fixture
def measured(monkeypatch):
    """Calls of what measures, as text; nothing is measured."""
    calls = []

    def described(x):
        if hasattr(x, "random_state"):
            return f"{x.name}: {x.nv}, {[h.kind for h in x.hinges.values()]}, {list(x.loops)}"
        if hasattr(x, "tobytes"):
            return np.array(x).tolist()
        if callable(x) or "Console" in type(x).__name__:
            return ""
        return [described(y) for y in x] if isinstance(x, (list, tuple)) else getattr(x, "name", repr(x))

    def recorded(*args, **options):
        calls.append(([described(a) for a in args], {k: described(v) for k, v in options.items() if k != "progress"}))
        raise typer.Exit(0)

    def checked(operators, **options):
        recorded(operators._model, **options)

    for module, name in (
        ("pycraft.cli.tour", "run"), ("pycraft.cli.bench", "run"), ("pycraft.accuracy.tables.table", "accuracy"),
        ("pycraft.accuracy.tables.work_precision", "work_precision"), ("pycraft.accuracy.hard_cases.stability", "run"),
        ("pycraft.peers.peers", "compare_all"),
    ):  # fmt: skip
        monkeypatch.setattr(import_module(module), name, recorded)
    monkeypatch.setattr("pycraft.operators.OperatorSet.check", checked)
    return calls


NEEDS = {"peers": pytest.mark.peers}


@pytest.mark.parametrize(
    ("command", "option"), [pytest.param(c, o, marks=NEEDS.get(c, ())) for c, options in BEFORE.items() for o in options]
)
def test_an_option_reaches_what_is_measured(command, option, measured, tmp_path):
    model = tmp_path / "mimicking.urdf"
    model.write_text(MIMICKING.format(links=LINK.format("first") + LINK.format("second")))
    takes_model = any(p.name == "model" for p in COMMANDS[command].params) and option != "model"
    # Without --mimic the joint is coupled, which is another outcome.
    start = [command, *([str(model), *([] if option == "mimic" else ["--mimic", "free"])] if takes_model else [])]
    if option == "model":
        variants = BEFORE[command][option]
    elif option == "duration":
        variants = [["--integration"], *BEFORE[command][option]]
    else:
        variants = [[], *BEFORE[command][option]]
    outcomes = []
    for given in variants:
        measured.clear()
        result = runner.invoke(app, [*start, *given])
        assert measured or option == "mimic", result.output
        outcomes.append(json.dumps([measured, result.exit_code], default=str))
    assert len(set(outcomes)) == len(outcomes)


def test_options_reach_the_check_of_a_paper(monkeypatch, tmp_path):
    from pycraft.identities import paper

    calls = []
    monkeypatch.setattr(paper, "check_paper", lambda path, **options: calls.append(options) or paper.PaperReport(path, []))
    for given in ([], ["--states", "1"], ["--seed", "2"], ["--precision", "quad"], ["--precision", "50"]):
        assert runner.invoke(app, ["check", "p.tex", *given]).exit_code == 1
    assert len({str({k: v for k, v in c.items() if k != "progress"}) for c in calls}) == 5
    for given in (["--all"], ["--root", "free"], ["--mimic", "lock"]):
        result = runner.invoke(app, ["check", "p.tex", *given])
        assert result.exit_code == 2 and f"{given[0]} belongs to models" in result.output and len(calls) == 5


def test_json_is_json_and_follows_its_seed(monkeypatch):
    """--json --seed: other states, other residuals."""
    from pycraft.operators.operator_set import OperatorSet

    some = OperatorSet.theorems
    monkeypatch.setattr(OperatorSet, "theorems", lambda self: some(self)[:12])
    text = {}
    for seed in ("1", "2"):
        result = runner.invoke(app, ["check", "ur5", "--states", "1", "--json", "--seed", seed])
        text[seed] = [f["residual"] for f in json.loads(result.stdout)["findings"]]
    assert text["1"] != text["2"]


def test_bench_ends_with_one_where_a_bound_is_missed(monkeypatch):
    from pycraft.cli.bench import Figure

    def figures(value):
        return lambda seconds: {"heading": [Figure("a figure", value, "x", 1.0), Figure("without a bound", 9.0, "x")]}

    for value, status in ((0.5, 0), (1.0, 0), (1.5, 1), (float("nan"), 1)):
        monkeypatch.setattr("pycraft.cli.bench.run", figures(value))
        result = runner.invoke(app, ["bench"])
        assert result.exit_code == status, value
        assert ("a figure: " in result.output and "is over its bound, 1 x" in result.output) == bool(status)


def test_every_figure_of_what_accuracy_costs_has_its_bound(monkeypatch):
    """With clocks that say ten times too much for every way but `fast`, no bound holds by being absent."""
    import pycraft.cli.bench as bench
    from pycraft import _core

    def slow(*_, **options):
        return dict.fromkeys(("median", "minimum"), 1e-6 if options in ({}, {"form": "fast"}) else 1e-3)

    monkeypatch.setattr(_core, "time_forward", slow)
    monkeypatch.setattr(_core, "time_packs", lambda *_, **__: {"median": 1e-6})
    figures = {f.name: f for f in bench.accuracy(0)}
    ways = {name: f for name, f in figures.items() if " over fast" in name and "packs" not in name}
    assert len(ways) == 3 * len(bench.WAYS) + 4 + 3 * 4 + 4  # `ud` at its worst, heavy tips, loads under rotors
    for name, figure in ways.items():
        assert figure.bound is not None and figure.bound < 1000 and not figure.passed, name


def test_tables_are_written_where_the_options_say(tmp_path, monkeypatch):
    from pycraft.accuracy.hard_cases import stability

    chosen = [c for c in stability.catalogue() if "wrist" in c.name.lower()][:1]
    results = stability.run(1, 1, cases=chosen, peers=False)
    monkeypatch.setattr(stability, "run", lambda *_, **__: results)
    for option in ("output", "csv", "json"):
        path = tmp_path / f"table.{option}"
        result = runner.invoke(app, ["stability", "--case", "wrist", f"--{option}", str(path)])
        assert path.is_file() and result.exit_code == (0 if results else 1), result.output
    assert json.loads((tmp_path / "table.json").read_text()) and "|" in (tmp_path / "table.output").read_text()
    path = tmp_path / "rows.json"
    options = f"accuracy ur5 --seconds 0 --method articulated --form fast --precision double --json {path}"
    assert runner.invoke(app, options.split()).exit_code == 0 and json.loads(path.read_text())
