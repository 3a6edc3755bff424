"""`pycraft bench --peers`: what it makes of a run. That figures are fast is measured, not tested."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import pycraft as pc
from pycraft.cli import speed_page
from pycraft.cli.commands import app
from pycraft.peers import speed


def row(call="forward_dynamics", model="chain of 100", nv=100, kernel=2.0, theirs=7.0):
    return speed.Row(model, nv, call, kernel, kernel + 1, {"Pinocchio": theirs}, theirs - 1)


def test_ratios_are_the_others_over_ours():
    one = row()
    assert (one.ratio, one.python_ratio) == (3.0, 7.0 / 3.0)
    one.peers["MuJoCo"] = 4.5
    assert one.python_ratio == 1.5
    assert speed.Row("m", 1, "mass_matrix", 1.0, 1.0).ratio is None


def test_exponents_are_those_of_powers():
    rows = [
        row(call, f"chain of {n}", n, 1e-3 * n**p)
        for call, p in (("mass_matrix", 2.0), ("inverse_dynamics", 1.0))
        for n in (10, 100, 300, 1000)
    ]
    rows.append(row("inverse_dynamics", "panda", 7, 1e9))
    assert speed.exponents(rows) == pytest.approx({"mass_matrix": 2.0, "inverse_dynamics": 1.0})


def test_the_page_says_what_was_measured():
    found = speed.Measured(
        {"processor": "P", "instruction set": "avx2"},
        [row(), row("mass_matrix", kernel=9.0)],
        [speed.BatchRow("panda", 0.5, 0.4, (5.0, 12.0))],
        ["one"],
    )
    text = speed_page.page(found, [speed_page.Figure("ud over fast", 5.0, "x", 3.5, "note"), speed_page.Figure("single", 0.5, "x")])
    assert "| chain of 100 | 100 | forward dynamics | 2 | 6 | 3 | 3 | 7 |  | 2.3 |" in text
    assert "| 0.67 ✗ |" in text, "a goal that is missed is marked"
    assert "| panda | 0.5 | 5 ✗ | 0.4 | 12 |" in text
    assert "| ud over fast | 5 | 3.5 ✗ | note |" in text
    assert "Left out: one." in text


def test_a_plot_is_drawn(tmp_path):
    rows = [row(call, f"chain of {n}", n, n * 1.0) for call in speed.GOALS for n in (10, 100, 300)]
    speed_page.plot(speed.Measured({}, rows), tmp_path / "cost.png")
    assert (tmp_path / "cost.png").read_bytes()[:4] == b"\x89PNG"


def test_elapsed_is_a_time():
    assert 0 < speed.elapsed(lambda: sum(range(100)), 0.01) < 1e-3


def test_no_peer_is_said(monkeypatch):
    def missing(*_):
        raise pc.interop.MissingPackageError(
            "comparison with Pinocchio needs the package pinocchio, which is not installed: pip install 'x[peers]'"
        )

    monkeypatch.setattr(speed, "required", missing)
    done = CliRunner().invoke(app, ["bench", "--peers"])
    assert done.exit_code != 0


@pytest.mark.parametrize("options", [["--json", "x.json"], ["--plot", "x.png"], ["--page", "x.md"]])
def test_files_are_of_peers(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["bench", *options])
    assert done.exit_code != 0
    assert not list(tmp_path.iterdir())


@pytest.mark.peers
def test_a_quick_run(tmp_path):
    found = speed.measure(0.01, quick=True)
    assert {r.model for r in found.rows} == {"ur5", "panda", "chain of 10", "chain of 30"}
    assert {r.call for r in found.rows} == set(speed.GOALS)
    assert all(r.kernel > 0 and r.python > 0 and r.peers["Pinocchio"] > 0 and r.error < 1e-9 for r in found.rows)
    assert all(r.double > 0 and r.single > 0 for r in found.batches)
    assert json.loads(json.dumps(found.as_json()))["rows"][0]["ratio"] > 0


@pytest.mark.peers
def test_a_wrong_result_is_not_timed(monkeypatch):
    model = pc.chain(4, seed=1)
    peer = speed.Pinocchio(model, None)
    model.gravity = (0, 0, -5.0)  # the peer's is none
    with pytest.raises(pc.EvaluationError, match="inverse_dynamics of chain of 4 is not Pinocchio's"):
        speed._row(model, "inverse_dynamics", peer, dict.fromkeys(speed.GOALS, 0.0), 0.01)
    assert np.isfinite(model.gravity).all()
