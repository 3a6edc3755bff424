"""The command line: what it prints, and how it ends."""

import json

import pytest
from typer.testing import CliRunner

from pycraft.cli import app

runner = CliRunner()


def test_check_passes_on_a_robot():
    result = runner.invoke(app, ["check", "ur5", "--states", "1"])
    assert result.exit_code == 0, result.output
    assert "ur5" in result.output.lower() and "worst residual of what holds" in result.output


def test_check_as_json():
    result = runner.invoke(app, ["check", "panda", "--states", "1", "--json"])
    assert result.exit_code == 0, result.output
    report = json.loads(result.output)
    verdicts = {f["verdict"] for f in report["findings"]}
    assert "fails" not in verdicts and "holds" in verdicts
    one = next(f for f in report["findings"] if f["verdict"] == "holds")
    assert one["residual"] <= one["bound"] and one["states"] == 2 and one["seconds"] > 0
    assert any(f["verdict"] == "waiting" and f["note"] for f in report["findings"])


def test_check_ends_with_one_where_a_theorem_fails(monkeypatch):
    from pycraft.identities.report import Report

    monkeypatch.setattr(Report, "__bool__", lambda self: False)
    assert runner.invoke(app, ["check", "panda", "--states", "1"]).exit_code == 1


def test_precision_that_is_not_there_is_named():
    result = runner.invoke(app, ["check", "panda", "--precision", "single"])
    assert result.exit_code == 2
    assert "precision 'single' is not wider than double" in result.output


def test_a_missing_file_is_an_error_not_a_traceback():
    result = runner.invoke(app, ["check", "nowhere.urdf"])
    assert result.exit_code == 2
    assert "error:" in result.output and "nowhere.urdf" in result.output and "Traceback" not in result.output


@pytest.mark.parametrize("robot", ["puma560", "panda"])
def test_tour(robot):
    result = runner.invoke(app, ["tour", robot])
    assert result.exit_code == 0, result.output
    parts = ["The operators, typed as on paper", "Factor and invert", "Beyond the theorems", "Every theorem"]
    for part in (*parts, "smallest counterexample", "What it costs"):
        assert part in result.output


def test_bench_holds_its_bounds():
    """The figures are taken and checked; times are judged by `pycraft bench`, not here."""
    from pycraft.bench import building, per_link

    figures = per_link(seconds=0.005)
    assert {f.name for f in figures} >= {"phi", "psi*", "Upsilon", "MM^-1", "forward_dynamics"}
    assert all(f.value > 0 and f.bound == 1.5 for f in figures)
    assert building(200).value < 500
