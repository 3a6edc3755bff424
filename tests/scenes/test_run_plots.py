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
    assert titles(run.plot("q", "balance", coordinates="pivot")) == ["angles", "kinetic + potential - work, minus its first value"]
    figure = run.plot("q", "vdot")
    assert titles(figure) == ["angles", "travels", "accelerations", "accelerations"] and figure.axes[3].get_ylabel() == "m/s²"
    assert figure.axes[0].lines[0].get_label() == "pivot"


def test_what_there_is_not():
    run = pc.mechanisms.pendulum().simulate(0.1)
    with pytest.raises(pc.EvaluationError, match="plot: no plot is called 'x'; there are 'q', 'v', 'vdot', 'energy', 'balance', 'forces'"):
        run.plot("x")
    with pytest.raises(pc.ModelError, match="plot: no hinge or coordinate of 'pendulum' is called 'bib'; did you mean 'bob'"):
        run.plot(coordinates="bib")
    with pytest.raises(pc.EvaluationError, match="plot: this run has no data for 'forces'"):
        pc.Scene(run.model).simulate(0.1, [0.0], [1.0]).plot("forces")


def test_many_events_are_thinned():
    """A plot with a line for each of some thousand events is black: those nearest to even times stand for all, as the heading reports."""
    from pycraft.scenes.run_plots import MARKS, event_marks

    scene = pc.mechanisms.double_pendulum()
    few = scene.simulate(1.0, q=[1.0, 2.0], events={"turn": lambda t, s: s.v[-1]})
    times = sorted(t for event in few.events.values() for t in event.t)
    assert event_marks(few) == (times, "") and len(times) < MARKS
    many = scene.simulate(1.0, q=[1.0, 2.0], max_step=1e-3, events={"ring": lambda t, s: np.sin(500 * t)})
    times = many.events["ring"].t
    marks, said = event_marks(many)
    assert len(times) > 2 * MARKS and len(marks) <= MARKS and said == f"vertical lines: {len(marks)} of {len(times)} events"
    assert set(marks) <= set(times) and marks == sorted(marks) and marks[0] == times[0] and marks[-1] == times[-1]
    widest = np.diff(times).max()
    assert np.diff(marks).max() <= (times[-1] - times[0]) / (MARKS - 1) + widest  # even, except where no event is
    figure = many.plot("energy")
    assert said in figure.get_suptitle() and sum(len(line.get_xdata()) == 2 for line in figure.axes[0].lines) == len(marks)
    assert said in many.to_html().html and said not in few.to_html().html
