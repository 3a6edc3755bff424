"""Accuracy and cost in a scene: integrators, arithmetic and effects against one reference, errors that are known."""

import re

import matplotlib as mpl
import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy.tables.work_precision import WorkPrecisionTable
from pycraft.scenes.scene_accuracy import SceneAccuracyTable

mpl.use("Agg")
E = pc.effects


@pytest.fixture(autouse=True)
def terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")


@pytest.fixture(scope="module")
def pendulum():
    model = pc.Multibody("pendulum")
    model.add_body("rod", axis=(0, 1, 0), mass=1.0, com=(0, 0, -1.0), inertia=np.zeros((3, 3)))
    return pc.Scene(model).add(E.Gravity(), E.Damping(0.1), E.TorqueSource(1e-5))


@pytest.fixture(scope="module")
def table(pendulum):
    return pendulum.accuracy([0.0], [2.0], T=2.0, tolerances=[1e-4, 1e-8], steps=[0.02, 0.01], seconds=0)


def test_rows_by_what_is_varied(table):
    ways = [(row["varied"], table.label(row)) for row in table]
    assert ways == [
        ("integrator", "dopri5 at 1e-04"), ("integrator", "dopri5 at 1e-08"),
        ("integrator", "dop853 at 1e-04"), ("integrator", "dop853 at 1e-08"),
        ("integrator", "rkmk4 at 0.02 s"), ("integrator", "rkmk4 at 0.01 s"),
        *(("arithmetic", form + way) for form in ("fast", "ud", "square-root") for way in ("", " + 1 refinement, wider residual")),
        ("arithmetic", "fast, extended"),
        ("effects", "without gravity"), ("effects", "without damping"), ("effects", "without torque_source"),
    ]  # fmt: skip
    assert isinstance(table, WorkPrecisionTable) and not any(row["refused"] for row in table)
    assert all(row["seconds"] > 0 and row["evaluations"] > 0 and row["drift"] is None for row in table)


def test_errors_are_those_of_the_integrators(table):
    """rkmk4 is of order 4; tolerances are kept to about a thousand times; nothing is better than the reference knows."""
    errors = {table.label(row): row["error"] for row in table}
    assert 13 < errors["rkmk4 at 0.02 s"] / errors["rkmk4 at 0.01 s"] < 19
    assert 1e-8 < errors["dopri5 at 1e-04"] < 0.1 and errors["dopri5 at 1e-08"] < 1e-5
    assert table.reference_error < 1e-14 and errors["fast"] < 1e-11 and errors["fast, extended"] < 1e-14


def test_errors_are_those_of_the_effects(table, pendulum):
    """Without an effect the error is the difference of the motions, for any integrator; 10⁻⁵ N m is seen in its eighth figure."""
    errors = {table.label(row): row["error"] for row in table}
    without = pc.Scene(pendulum.model).add(E.Gravity(), E.TorqueSource(1e-5))
    times = np.linspace(0, 2, 9)
    runs = [scene.simulate(2.0, [0.0], [2.0], t_eval=times, rtol=1e-12, atol=1e-14) for scene in (pendulum, without)]
    assert errors["without damping"] == pytest.approx(np.abs(runs[0].q - runs[1].q).max(), rel=1e-6)
    assert 1e-7 < errors["without torque_source"] < 1e-4 < 0.01 < errors["without damping"] < errors["without gravity"]


def test_front_and_cheapest(table):
    front = table.front
    assert [row["seconds"] for row in front] == sorted(row["seconds"] for row in front)
    errors = [max(row["error"], table.reference_error) for row in front]
    assert all(a > b for a, b in zip(errors, errors[1:], strict=False))
    assert table.fastest(1e-6)["error"] <= 1e-6
    with pytest.raises(ValueError, match=r"no row of 'What accuracy costs .*' has an error of at most -1: the best is "):
        table.fastest(-1)


def test_forms_of_the_scene_itself(pendulum):
    """Integrators run the scene in its own form and precision; other rows vary one thing."""
    scene = pc.Scene(pendulum.model, form="ud", refine=1).add(E.Gravity())
    table = scene.accuracy(
        [0.3], integrators="dopri5", tolerances=1e-6, forms=["fast"], refinements=[0], precisions=["extended"], T=0.5, seconds=0
    )
    ways = [(row["varied"], row["form"], row["refine"], row["precision"]) for row in table]
    assert ways == [
        ("integrator", "ud", 1, "double"), ("arithmetic", "fast", 0, "double"), ("arithmetic", "ud", 1, "extended"),
        ("effects", "ud", 1, "double"),
    ]  # fmt: skip
    assert table.about["reference"] == "dop853 in extended precision, tolerance 1e-16"


def test_what_does_not_run_is_refused(pendulum):
    table = pendulum.accuracy(
        [0.0], [2.0], T=1.0, integrators="dopri5", tolerances=[1e-6, 1e-30], forms="fast", precisions="double", seconds=0
    )
    refused = [row for row in table if row["refused"]]
    assert len(refused) == 1 and "1e-30" in refused[0]["refused"] and refused[0]["pareto"] is False
    assert "refused" in repr(table)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"integrators": "rk5"}, "integrator 'rk5' is not there"),
        ({"forms": ["slow"]}, "form 'slow' is not there"),
        ({"precisions": ["half"]}, "precision 'half' is not there"),
        ({"tolerances": -1}, "tolerances: -1 is not a positive, finite tolerance"),
        ({"without": "drag"}, "has no effect 'drag'"),
        ({"seconds": "long"}, "seconds='long'"),
    ],
)
def test_refusals(pendulum, given, text):
    with pytest.raises(pc.Error, match=re.escape(text)):
        pendulum.accuracy(**given)


def test_picture(table):
    """A line an integrator, a marker for each way of computing, a named cross for each scene that lacks an effect."""
    axes = table.plot()
    assert sorted(text.get_text() for text in axes.texts) == ["without damping", "without gravity", "without torque_source"]
    lines = {line.get_label(): line for line in axes.lines}
    assert lines["rkmk4"].get_ydata().tolist() == [row["error"] for row in table if row["integrator"] == "rkmk4"]
    crosses = [(line.get_xdata()[0], line.get_ydata()[0]) for line in axes.lines if line.get_marker() == "x"]
    assert crosses == [(row["seconds"], row["error"]) for row in table if row["varied"] == "effects"]
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend[:3] == ["dopri5", "dop853", "rkmk4"] and "extended" in legend and "Pareto front" in legend
    empty = SceneAccuracyTable("Nothing", [], {"reference_error": 0.0}).plot()
    assert "there are no rows" in empty.texts[0].get_text()


def test_implicit_effects_are_what_they_come_to_in_small_steps():
    """The reference has plain damping and springs: integrators that take them implicitly converge to it."""
    model = pc.tree([-1, 0, 1], ["pin", "ball", "slider"], seed=2)
    scene = pc.Scene(model).add(E.Gravity(), E.ImplicitDamping(0.5), E.ImplicitSpring(20.0, rest=0.1), E.Spring({"hinge1": 3.0}))
    table = scene.accuracy(
        T=0.3, integrators=["rosenbrock4", "semi-implicit-euler", "dopri5"], tolerances=[1e-4, 1e-9], steps=[1e-3, 1e-4], seconds=0
    )
    errors = {(row["integrator"], row["tolerance"] or row["step"]): row["error"] for row in table if row["varied"] == "integrator"}
    assert errors["rosenbrock4", 1e-9] < 1e-9 and 5 < errors["semi-implicit-euler", 1e-3] / errors["semi-implicit-euler", 1e-4] < 20
    refused = {row["integrator"] for row in table if row["refused"]}
    assert refused == {"dopri5"}
    without = [row for row in table if row["varied"] == "effects"]
    assert [row["integrator"] for row in without] == ["rosenbrock4"] * 4 and all(row["error"] > 1e-4 for row in without)
    alone = pc.Scene(model).add(E.Gravity(), E.ImplicitDamping(0.5)).accuracy(T=0.2, integrators="rosenbrock4", tolerances=1e-6, seconds=0)
    assert {row["left out"][0]: row["integrator"] for row in alone if row["varied"] == "effects"} == {
        "gravity": "rosenbrock4", "implicit_damping": "dopri5",
    }  # fmt: skip
