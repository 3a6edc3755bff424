"""Pictures of runs: what is drawn, with names and units."""

import matplotlib
import numpy as np
import pytest

import pycraft as pc
from support.runs import CASES

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402 - after the backend is chosen


@pytest.fixture(autouse=True)
def close():
    yield
    pyplot.close("all")


def titles(figure):
    return [ax.get_title(loc="left") for ax in figure.axes]


def test_what_is_drawn():
    run = CASES["damped"]().simulate(0.5, events={"turn": lambda t, s: s.v[-1]})
    figure = run.plot()
    of_effects = [f"forces of {name}" for name in ("gravity", "gravity", "spring", "spring", "damping", "damping", "torque_source")]
    assert titles(figure) == ["travels", "quaternions", "velocities", "velocities", "energies", *of_effects]
    by_axis = [ax.get_ylabel() for ax in figure.axes]
    assert by_axis == ["m", "1", "rad/s", "m/s", "J", "N m", "N", "N m", "N", "N m", "N", "N"] and figure.axes[-1].get_xlabel() == "time, s"
    energies = {line.get_label(): line.get_ydata() for line in figure.axes[4].lines if not line.get_label().startswith("_")}
    assert list(energies) == ["kinetic", "potential", "work of damping", "work of torque_source", "kinetic + potential - work"]
    assert np.array_equal(energies["kinetic"], run.energy["kinetic"])


def test_a_choice():
    run = pc.mechanisms.cart_pole().simulate(0.5)
    assert titles(run.plot("q", "balance", coordinates="pivot")) == ["angles", "kinetic + potential - work, less its first value"]
    figure = run.plot("q", "vdot")
    assert titles(figure) == ["angles", "travels", "accelerations", "accelerations"] and figure.axes[3].get_ylabel() == "m/s²"
    assert figure.axes[0].lines[0].get_label() == "pivot"


def test_what_there_is_not():
    run = pc.mechanisms.pendulum().simulate(0.1)
    with pytest.raises(
        pc.EvaluationError, match="plot: no picture is called 'x'; there are 'q', 'v', 'vdot', 'energy', 'balance', 'forces'"
    ):
        run.plot("x")
    with pytest.raises(pc.ModelError, match="plot: no hinge or coordinate of 'pendulum' is called 'bib'; did you mean 'bob'"):
        run.plot(coordinates="bib")
    with pytest.raises(pc.EvaluationError, match="plot: there is nothing to see of 'forces' in this run"):
        pc.Scene(run.model).simulate(0.1, [0.0], [1.0]).plot("forces")
