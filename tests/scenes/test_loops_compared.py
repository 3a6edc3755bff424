"""Loops of a scene kept and held, compared: numbers that are known, what is refused, the table and the picture.

What each row has to be is that of its kind: loops that are kept are on their rows to rounding, springs are off by what pulls them, as 1/ω².
"""

import re

import matplotlib as mpl
import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy.tables.work_precision import WorkPrecisionTable
from pycraft.models import linkages
from support.closed_models import function, rover

mpl.use("Agg")
E, M = pc.effects, pc.mechanisms


@pytest.fixture(autouse=True)
def terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")


@pytest.fixture(scope="module")
def table():
    return pc.loops_compared(M.slider_crank(), T=0.2, tolerances=[1e-5, 1e-8], frequencies=[1e3, 4e3], seconds=0)


def test_rows(table):
    ways = list(dict.fromkeys((row["method"], row["integrator"]) for row in table))
    assert ways == [
        ("augment", "dopri5"), ("augment", "dop853"), ("embed", "dopri5"), ("embed", "dop853"), ("penalty", "dopri5"),
        ("penalty", "rosenbrock4"),
    ]  # fmt: skip
    assert len(table) == 12 and isinstance(table, WorkPrecisionTable) and not any(row["refused"] for row in table)
    assert all(row["seconds"] > 0 and row["evaluations"] > 0 for row in table)
    assert all((row["frequency"] is None) == (row["method"] != "penalty") for row in table)
    assert table.about["loops"] == ["wrist"] and table.about["rows"] == 5
    assert table.reference == "augment by dop853 in extended precision, tolerance 1e-13" and table.reference_error < 1e-10


def test_what_is_kept_is_on_its_rows_and_springs_are_off_them(table):
    """Both errors fall as 1/ω²: sixteen, by tolerances a tenth of that."""
    kept = [row for row in table if row["method"] != "penalty"]
    assert all(row["drift"] < 1e-14 and row["velocity drift"] < 1e-12 for row in kept)
    assert all(row["error"] < 1e3 * row["tolerance"] and row["energy error"] < 1e3 * row["tolerance"] for row in kept)
    for integrator in ("dopri5", "rosenbrock4"):
        soft, stiff = (row for row in table if (row["method"], row["integrator"]) == ("penalty", integrator))
        assert soft["tolerance"] == pytest.approx(0.1 * (table.about["rate"] / 1e3) ** 2)
        for key in ("error", "drift", "velocity drift", "energy error"):
            assert 10 < soft[key] / stiff[key] < 25, key
        assert soft["drift"] > 1e-5


def test_numbers_are_those_of_runs(table):
    """One row of each kind by hand, energy of springs without what they hold and take."""
    times = np.linspace(0, 0.2, 9)
    for row in (table[1], next(row for row in table if row["method"] == "penalty")):
        springs = {"frequency": row["frequency"]} if row["frequency"] else {}
        scene = pc.Scene(M.slider_crank().model).add(E.Loop(method=row["method"], **springs))
        model, v = scene.model, M.slider_crank().model.v
        run = scene.simulate(0.2, model.q, v, t_eval=times, rtol=row["tolerance"], atol=row["tolerance"], progress=False)
        rows = model.loops.residual(run.q), np.einsum("trj,tj->tr", model.loops.jacobian(run.q), run.v)
        assert row["drift"] == np.abs(rows[0]).max() and row["velocity drift"] == pytest.approx(np.abs(rows[1]).max())
        energy = run.energy["kinetic"]  # no gravity: nothing else has any
        assert row["energy error"] == pytest.approx(np.abs(energy - energy[0]).max() / energy.max(), rel=1e-3)


def test_the_rate_is_that_of_the_motion():
    """A pendulum of two gears turning at rest in a spring: v̇ and v in kinetic energy are ω of the swing, at its largest."""
    model = pc.Multibody("gears")
    for name in ("a", "b"):
        model.add_body(name, None, "pin", axis=(0, 0, 1), mass=1.0, inertia=np.eye(3))
    model.add_coupling({"a": 1.0, "b": -1.0}, name="gear")
    scene = pc.Scene(model).add(E.Spring(stiffness=2 * 7.0**2, hinges="a"), E.Loop())
    table = pc.loops_compared(scene, [0.1, 0.1], T=2 * np.pi / 7, methods="embed", integrators="rk4", steps=[0.01], seconds=0)
    assert table.about["rate"] == pytest.approx(7.0, rel=1e-6)
    assert [row["step"] for row in table] == [0.01] and table[0]["tolerance"] is None


def test_couplings_rows_of_velocities_and_functions():
    for model, reference in ((rover(), "extended"), (function(), "double")):
        scene = pc.Scene(model).add(E.Gravity(model.gravity), E.Loop())
        table = pc.loops_compared(scene, T=0.2, integrators="dopri5", tolerances=1e-8, frequencies=1e3, seconds=0)
        assert [row["refused"] for row in table] == ["", "", ""] and reference in table.reference
        kept, embedded, held = table
        assert kept["velocity drift"] < 1e-12 and embedded["velocity drift"] < 1e-12 < held["velocity drift"]
        assert max(kept["error"], embedded["error"]) < 1e-6 < held["error"] < 0.1


def test_other_effects_stay():
    """Springs, loops that are off, and loops by two effects."""
    model = linkages.n_four_bar(2, 1.0)
    scene = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Damping(0.3), E.Loop("loop1"), E.Loop("loop2", alpha=5.0))
    table = pc.loops_compared(scene, T=0.3, integrators="dopri5", tolerances=1e-9, frequencies=3e3, seconds=0)
    assert table.about["loops"] == ["loop1", "loop2"] and scene.effects["loop"].method == "augment"  # as it was
    kept, embedded, held = table
    assert kept["error"] < 1e-7 and embedded["error"] < 1e-7 and embedded["drift"] < 1e-14 and 0 < held["error"] < 1e-2
    assert kept["energy error"] < 1e-6 and embedded["energy error"] < 1e-6  # the damper's work is in it
    half = pc.Scene(model).add(E.Gravity((0, -9.81, 0)), E.Loop("loop1")).disable("loop").add(E.Loop("loop1"))
    only = pc.loops_compared(half, T=0.1, methods="embed", integrators="dopri5", tolerances=1e-8, seconds=0)  # what is off stays off
    assert only.about["loops"] == ["loop1"] and not only[0]["refused"] and only[0]["drift"] < 1e-14


def test_bodies_without_mass_are_embedded_alone():
    bars = pc.Multibody("bars")
    bars.add_body("crank", hinge="pin", axis=(0, 0, 1))
    bars.add_body("coupler", "crank", "pin", axis=(0, 0, 1), position=(1, 0, 0), mass=2.0, com=(0.5, 0, 0), inertia=0.1 * np.eye(3))
    bars.add_body("rocker", "coupler", "pin", axis=(0, 0, 1), position=(1, 0, 0))
    bars.add_loop("rocker", hinge="pin", axis=(0, 0, 1), point=(1, 0, 0), position=(1, 0, 0), name="closure")
    bars.q = bars.assemble([1.0, -1.0, -2.1]).q
    scene = pc.Scene(bars).add(E.Gravity((0, -9.81, 0)), E.Loop(method="embed"))
    table = pc.loops_compared(scene, T=0.2, integrators="dopri5", tolerances=1e-8, frequencies=1e3, seconds=0)
    assert table.reference.startswith("embed")
    refused = {row["method"]: row["refused"] for row in table}
    assert not refused["embed"] and all("no inertia" in refused[name] for name in ("augment", "penalty"))
    assert "refused" in repr(table) and table[1]["error"] < 1e-6


def test_nothing_moves():
    gears = pc.chain(2)
    gears.add_coupling({"hinge0": 1.0, "hinge1": -1.0}, name="gear")
    table = pc.loops_compared(pc.Scene(gears).add(E.Loop()), T=0.5, integrators="dopri5", tolerances=1e-6, seconds=0)
    assert all(row["energy error"] is None and row["error"] == 0 for row in table) and table.about["rate"] == 2.0
    assert table.plot()[2].texts[0].get_text() == "nothing moves here"


def test_refusals():
    def says(text, scene=None, error=pc.Error, **given):
        with pytest.raises(error, match=re.escape(text)):
            pc.loops_compared(M.slider_crank() if scene is None else scene, **given)

    model = M.slider_crank().model
    says("loops_compared takes a scene", model, pc.ModelError)
    says("keeps no loops: add effects.Loop()", pc.Scene(model), pc.ModelError)
    says("keeps no loops", pc.Scene(model).add(E.Loop(method="penalty", frequency=10.0)), pc.ModelError)
    says("method 'springs' is not there", methods="springs")
    says("integrator 'rk5' is not there", integrators="rk5")
    says("is not a positive, finite tolerance", tolerances=-1)
    says("is not a positive, finite number of rad/s", frequencies=0)
    says("a run lasts a positive number", T=0.0)
    says("seconds='long'", seconds="long")
    says("is off row", q=[1.0, 0.0, 0.0], error=pc.ModelError)
    says("damping_ratio", T=0.1, methods="penalty", damping_ratio=-1.0, frequencies=100.0)


def test_a_run_that_is_refused_is_a_row():
    table = pc.loops_compared(
        M.slider_crank(), T=0.05, integrators=["dopri5", "variational2"], tolerances=1e-8, steps=1e-4, frequencies=300.0, seconds=0
    )
    refused = {(row["method"], row["integrator"]): row["refused"] for row in table}
    assert "keeps loops" in refused["augment", "variational2"] and "keeps loops" in refused["embed", "variational2"]
    assert not refused["penalty", "variational2"] and not refused["augment", "dopri5"]  # springs are forces as others


def test_front_and_cheapest(table):
    front = table.front
    assert front and [row["seconds"] for row in front] == sorted(row["seconds"] for row in front)
    assert table.fastest(1e-6)["error"] <= 1e-6
    assert table.label(table[0]) == "augment, dopri5 at 1e-05" and table.label(table[-1]) == "penalty, rosenbrock4 at 2e-06, 4e+03 rad/s"


def test_table_and_files(table, monkeypatch, tmp_path):
    assert "Pareto front" in repr(table)
    monkeypatch.setenv("COLUMNS", "80")
    lines = repr(table).split("\n")
    assert max(map(len, lines)) <= 80 and any("* Pareto front" in line for line in lines[-4:])
    table.to_csv(tmp_path / "loops.csv")
    assert (tmp_path / "loops.csv").read_text().splitlines()[0].split(",") == list(table.columns)


def test_picture(table):
    """Three panels, a line a method and integrator, told apart by colour and marker; the reference's own error is a band."""
    axes = table.plot()
    assert len(axes) == 3
    lines = {line.get_label(): line for line in axes[0].lines}
    assert list(lines) == list(dict.fromkeys(f"{row['method']}, {row['integrator']}" for row in table))
    assert len({(line.get_color(), line.get_marker()) for line in lines.values()}) == 3
    assert lines["embed, dopri5"].get_ydata().tolist() == [row["error"] for row in table if table.cell("way", row) == "embed, dopri5"]
    assert all((np.asarray(line.get_ydata()) > 0).all() for ax in axes for line in ax.lines)
    figure = axes[0].figure
    figure.canvas.draw()
    for left, right in zip(axes, axes[1:], strict=False):  # no axis' numbers and words reach into the panel before
        assert left.get_window_extent().x1 < right.yaxis.get_tightbbox(figure.canvas.get_renderer()).x0


def test_everything_refused_has_no_picture():
    table = pc.loops_compared(M.slider_crank(), T=0.05, methods="embed", integrators="variational2", steps=1e-3, seconds=0)
    axes = table.plot()
    assert "every row is refused" in axes[0].texts[0].get_text() and not table.front
