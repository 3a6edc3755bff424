"""A failing statement makes a report false, whatever else is in it, and ends the command with 1."""

import pytest
from typer.testing import CliRunner

import pycraft as pc
from pycraft.cli.commands import app
from pycraft.identities.report import Finding, Report


def finding(verdict):
    return Finding(f"a theorem that {verdict}", "group", "a = b", "a = b", [], [], verdict, states=1)


@pytest.mark.parametrize("others", [[], ["holds"], ["holds", "expected to fail", "holds anyway", "waiting"]])
def test_one_that_fails_is_enough(others):
    good = Report("model", {}, [finding(v) for v in others])
    assert bool(good) == bool(others) and good.failed == []  # what shows nothing is not true
    for at in range(len(others) + 1):
        verdicts = [*others[:at], "fails", *others[at:]]
        report = Report("model", {}, [finding(v) for v in verdicts])
        assert not report and [f.verdict for f in report.failed] == ["fails"]
        assert [f.passed for f in report.findings] == [v != "fails" for v in verdicts]


def test_the_command_ends_with_one(monkeypatch):
    monkeypatch.setattr("pycraft.operators.OperatorSet.check", lambda self, **_: Report("model", {}, [finding("holds"), finding("fails")]))
    for options in ([], ["--json"]):
        assert CliRunner().invoke(app, ["check", "ur5", *options]).exit_code == 1
    monkeypatch.setattr("pycraft.operators.OperatorSet.check", lambda self, **_: Report("model", {}, [finding("holds")]))
    assert CliRunner().invoke(app, ["check", "ur5"]).exit_code == 0


def test_a_false_statement_is_false_and_says_so():
    arm = pc.chain(3)
    report = pc.check("H φ G == 2 I", arm, search=False, states=2)
    assert not report and "FALSE" in repr(report).upper() and report.worst > 0.1
