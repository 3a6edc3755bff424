"""The command line: what it prints, and how it ends."""

import csv
import json
import re
from importlib import import_module

import pytest
from typer.testing import CliRunner

import pycraft as pc
from pycraft.cli.commands import app

runner = CliRunner()


@pytest.fixture
def few_theorems(monkeypatch):
    """Every fifth of them and what waits: what the command shows does not depend on how many there are."""
    theorems = pc.OperatorSet.theorems
    monkeypatch.setattr(pc.OperatorSet, "theorems", lambda self: [t for i, t in enumerate(theorems(self)) if i % 5 == 0 or t.waiting])


def test_check_passes_on_a_robot():
    result = runner.invoke(app, ["check", "ur5", "--states", "0"])
    assert result.exit_code == 0, result.output
    assert "ur5" in result.output.lower() and "largest residual of what holds" in result.output


def test_check_as_json(few_theorems):
    result = runner.invoke(app, ["check", "panda", "--states", "1", "--json"])
    assert result.exit_code == 0, result.output
    report = json.loads(result.output)
    verdicts = {f["verdict"] for f in report["findings"]}
    assert "fails" not in verdicts and "holds" in verdicts
    one = next(f for f in report["findings"] if f["verdict"] == "holds")
    assert one["residual"] <= one["bound"] and one["states"] == 2 and one["seconds"] > 0
    assert any(f["verdict"] == "waiting" and f["note"] for f in report["findings"])


def test_check_ends_with_one_where_a_theorem_fails(monkeypatch):
    from pycraft.identities.report import Finding, Report
    from pycraft.operators.operator_set import OperatorSet

    made = Report("arm", {}, [Finding(name, "group", "a = b", "a = b", [], [], "holds") for name in "ab"])
    monkeypatch.setattr(OperatorSet, "check", lambda self, **_: made)
    for verdict, status in [("holds", 0), ("expected to fail", 0), ("fails", 1), ("undecided", 3), ("undefined", 3)]:
        made.findings[0].verdict = verdict
        for options in ([], ["--all"], ["--json"]):
            result = runner.invoke(app, ["check", "panda", *options])
            assert result.exit_code == status and verdict in result.output + " holds", (verdict, options)


def test_check_has_a_line_for_each_theorem_and_the_long_form_by_all(few_theorems, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    short, full = (runner.invoke(app, ["check", "puma560", "--states", "0", *more]).output for more in ([], ["--all"]))
    verdicts = ("holds ", "fails ", "expected to fail ", "waiting ")
    lines = [line for line in short.splitlines() if line.startswith(verdicts)]
    assert any(line.split(None, 1) == ["holds", "φ = I + E_φ φ"] for line in lines) and "bound" not in lines[-1]
    assert len(lines) == sum(int(n) for n in re.findall(r"(\d+) (?:holds|expected|waiting)", short.splitlines()[0]))
    assert short.splitlines()[0] == full.splitlines()[0] and re.search(r"φ = I \+ E_φ φ +\S+e[+-]\d+ +\S+e-\d+ \w+ +holds", full)


def test_precision_that_is_not_there_is_named():
    result = runner.invoke(app, ["check", "panda", "--precision", "single"])
    assert result.exit_code == 2
    assert "precision 'single' is not wider than double" in result.output


def test_a_missing_file_is_an_error_not_a_traceback():
    result = runner.invoke(app, ["check", "nowhere.urdf"])
    assert result.exit_code == 2
    assert "error:" in result.output and "nowhere.urdf" in result.output and "Traceback" not in result.output


def test_tour():
    result = runner.invoke(app, ["tour", "puma560"])
    assert result.exit_code == 0, result.output
    parts = ["The operators, typed as on paper", "Factor and invert", "Beyond the theorems", "Every theorem"]
    for part in (*parts, "smallest counterexample", "Cost: chains of rods"):
        assert part in result.output
    typed = [line.rstrip() for line in result.output.splitlines() if ">>>" in line]
    assert typed and max(map(len, typed)) <= 80  # what is to be typed goes on in no second line


def test_bench_holds_its_bounds():
    """The figures are taken and checked; times are judged by `pycraft bench`, not here."""
    from pycraft.cli.bench import per_link
    from pycraft.cli.bench_expressions import expressions

    figures = per_link(seconds=0.005)
    assert {f.name for f in figures} >= {"phi", "psi*", "Upsilon", "MM^-1", "forward_dynamics"}
    assert all(f.value > 0 and f.bound == 1.5 for f in figures)
    figures = expressions(seconds=0.01)
    assert len(figures) > 30 and all(f.value > 0 for f in figures if "beyond" not in f.name)
    assert figures[0].value < 500


# ---------------------------------------------------------------------- what is refused before anything is measured
@pytest.fixture
def nothing_measured(monkeypatch):
    """Measuring is a failure."""
    for module, name in (("tables.table", "accuracy"), ("tables.work_precision", "work_precision"), ("hard_cases.stability", "run")):
        monkeypatch.setattr(import_module(f"pycraft.accuracy.{module}"), name, lambda *_, **__: pytest.fail("measured"))


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("accuracy panda --csv {tmp}/no/a.csv", "--csv {tmp}/no/a.csv: there is no folder"),
        ("accuracy panda --json {tmp}", "--json {tmp}: a folder"),
        ("accuracy panda --csv {tmp}/a --json {tmp}/a", "--csv and --json name the same file"),
        ("check none.tex --precision banana", "no precision is called 'banana'"),
        ("accuracy panda --plot {tmp}/a.foo", "there are"),
        ("accuracy panda --plot {tmp}/a", "a picture has the extension of its format"),
        ("accuracy panda --seed -1", "--seed -1: a whole number, 0 or more"),
        ("accuracy panda --seconds -1", "--seconds -1.0: a finite number of seconds"),
        ("accuracy panda --seconds nan", "--seconds nan"),
        ("accuracy panda --duration 2", "--duration belongs to --integration"),
        ("accuracy panda --integration --duration inf", "--duration inf"),
        ("accuracy panda --integration --form ud", "--form and --precision belong to the table of forms"),
        ("accuracy panda --integration --front", "--front belongs to the table of forms"),
        ("accuracy panda --error 0", "--error 0.0: a relative error, above zero"),
        ("accuracy panda --root sideways", "root='sideways': there are 'fixed', 'free'"),
        ("accuracy panda --mimic sometimes", "mimic='sometimes': there are"),
        ("accuracy pandaa", "robots of the package: puma560, panda"),
        ("stability --seeds 0", "--seeds 0: a whole number, 1 or more"),
        ("stability --seeds -1", "--seeds -1"),
        ("stability --steps 0", "--steps 0"),
        ("stability --output {tmp}/no/a.md", "there is no folder {tmp}/no"),
        ("stability --case nowhere", "no hard case has 'nowhere'"),
    ],
)
def test_options_are_checked_before_measuring(nothing_measured, tmp_path, command, words):
    result = runner.invoke(app, command.format(tmp=tmp_path).split())
    assert result.exit_code == 2, result.output
    text = " ".join(result.output.split())
    assert text.startswith("error:") and words.format(tmp=tmp_path) in text and not list(tmp_path.iterdir())


QUICK = "--seconds 0 --method articulated --form fast --precision double"


def test_the_accuracy_table_and_its_cheapest_row(tmp_path):
    options = f"accuracy ur5 {QUICK} --error 1e-10 --csv {tmp_path}/a.csv --plot {tmp_path}/a.png"
    result = runner.invoke(app, options.split())
    assert result.exit_code == 0, result.output
    assert "6 degrees of freedom" in result.output and "cheapest for 1e-10: fast" in result.output
    assert {p.name for p in tmp_path.iterdir()} == {"a.csv", "a.png"}
    result = runner.invoke(app, f"accuracy ur5 {QUICK} --root free --error 1e-40".split())
    assert result.exit_code == 1 and "12 degrees of freedom" in result.output and "the best is" in result.output


def test_the_front_of_the_accuracy_table(tmp_path):
    """The terminal shows its rows alone, the files hold all."""
    result = runner.invoke(app, f"accuracy ur5 {QUICK} --front --csv {tmp_path}/a.csv".split())
    assert result.exit_code == 0, result.output
    with open(tmp_path / "a.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    front = [row["way"] for row in rows if row["pareto"] == "True"]
    shown = [line for line in result.output.splitlines() if line.startswith("fast")]
    assert len(shown) == len(front) < len(rows)


def test_every_row_refused():
    result = runner.invoke(app, "accuracy ur5 --seconds 0 --method articulated --form ud --precision 100".split())
    assert result.exit_code == 1
    assert "refused: ud, 100 digits: nothing is wider than 100 digits to measure it against" in result.output


def test_the_table_of_integrators_says_what_was_integrated():
    result = runner.invoke(app, "accuracy panda --integration --seconds 0 --method dopri5 --duration 0.05 --seed 3".split())
    assert result.exit_code == 0, result.output
    for words in ("0.05 s, gravity (0, 0, -9.81) m/s²", "of seed 3, at rest", "reference: dop853", "the model has no gravity"):
        assert words in result.output


def test_brackets_of_help_are_kept():
    assert "(extra [peers])" in runner.invoke(app, ["peers", "--help"]).output
    assert "[lab]" in runner.invoke(app, ["--help"]).output


def test_version():
    from importlib.metadata import version

    result = runner.invoke(app, ["--version"])
    assert result.exit_code == 0 and result.output.strip() == f"pycraft {version('pycraft-soa')}" == f"pycraft {pc.__version__}"
