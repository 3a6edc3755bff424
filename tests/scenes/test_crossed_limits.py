"""Limits that a run crosses and no effect holds."""

import warnings

import numpy as np
import pytest

import pycraft as pc
from pycraft.models.warning import ModelWarning

E = pc.effects
QUIET = {"progress": False}


def sliders(*limits):
    """Sliders of 1 kg along x beside each other, each with its limits or none."""
    model = pc.Multibody("sliders")
    for i, each in enumerate(limits):
        model.add_body(f"s{i}", None, "slider", axis=(1, 0, 0), mass=1.0, limits=each)
    return model


def test_each_coordinate_that_left_its_limits_is_named():
    scene = pc.Scene(sliders((-1, 1), (-1, 1), None, (-10, 10)))
    with pytest.warns(
        ModelWarning, match=r"coordinates of 'sliders' left their limits, and no effect of this scene holds them: s0 reached 3"
    ):
        run = scene.simulate(3.0, np.zeros(4), [1.0, -0.5, 9.0, 0.1], t_eval=np.linspace(0, 3, 31), max_step=0.1, **QUIET)
    first, second = run.crossed_limits
    assert (first.coordinate, first.limit, first.upper) == ("s0", 1.0, True)
    assert first.farthest == pytest.approx(3.0) and 1.0 < first.first <= 1.1 + 1e-9
    assert (second.coordinate, second.limit, second.upper) == ("s1", -1.0, False)
    assert second.farthest == pytest.approx(-1.5) and 2.0 < second.first <= 2.1 + 1e-9
    assert repr(run).endswith("; beyond limits: s0, s1>")


def test_it_is_said_once_for_a_scene():
    scene = pc.Scene(sliders((-1, 1)))
    with pytest.warns(ModelWarning, match="s0 reached 3"):
        run = scene.simulate(3.0, [0.0], [1.0], **QUIET)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert scene.simulate(3.0, [0.0], [1.0], **QUIET).crossed_limits == run.crossed_limits


@pytest.mark.parametrize("held", [E.Limits(1e4), E.Limits()])
def test_limits_that_an_effect_holds_are_not_crossed(held):
    scene = pc.Scene(sliders((-1, 1))).add(held)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = scene.simulate(3.0, [0.0], [1.0], **QUIET)
    assert run.q.max() > 1.0 and not run.crossed_limits and "limits" not in repr(run)
    with pytest.warns(ModelWarning, match="s0"):
        assert scene.disable("limits").simulate(3.0, [0.0], [1.0], **QUIET).crossed_limits


def test_stops_hold_the_coordinates_that_they_name_alone():
    scene = pc.Scene(sliders((-1, 1), (-1, 1))).add(E.Limits(1e4, hinges="s0"))
    with pytest.warns(ModelWarning, match="s1 reached"):
        run = scene.simulate(3.0, np.zeros(2), np.ones(2), **QUIET)
    assert [one.coordinate for one in run.crossed_limits] == ["s1"]


def test_a_coordinate_at_its_limit_has_not_left_it():
    run = pc.Scene(sliders((-1, 1), (1e6, 2e6))).simulate(1.0, [1.0, 1e6], np.zeros(2), **QUIET)
    assert not run.crossed_limits


def test_both_limits_may_be_crossed_and_kept_times_alone_do():
    scene = pc.Scene(sliders((-1, 1))).add(E.Spring(1.0))
    with pytest.warns(ModelWarning):
        run = scene.simulate(7.0, [0.0], [2.0], dense=False, t_eval=np.linspace(0, 7, 50), **QUIET)
    assert [(one.upper, round(one.farthest, 1)) for one in run.crossed_limits] == [(False, -2.0), (True, 2.0)]


@pytest.mark.parametrize("hinge", ["ball", "free", "planar", "weld"])
def test_hinges_of_other_kinds(hinge):
    model = pc.Multibody("m")
    model.add_body("b", None, hinge, mass=1.0, inertia=np.eye(3))
    model.add_body("pin", "b", mass=1.0, com=(1, 0, 0), limits=(-0.1, 0.1))
    with pytest.warns(ModelWarning, match="pin reached"):
        run = pc.Scene(model).simulate(1.0, model.zero_q(), np.r_[np.zeros(model.nv - 1), 1.0], **QUIET)
    assert [one.coordinate for one in run.crossed_limits] == ["pin"]


def test_nothing_is_crossed_without_coordinates():
    model = pc.Multibody("m")
    model.add_body("b", None, "weld", mass=1.0)
    assert pc.Scene(model).simulate(1.0, **QUIET).crossed_limits == []


def test_the_many_runs_of_a_comparison_say_nothing():
    scene = pc.Scene(sliders((-1, 1))).add(E.Damping(0.01), E.Spring(0.001))
    with warnings.catch_warnings():
        warnings.simplefilter("error", ModelWarning)
        scene.compare(T=3.0, q=[0.0], v=[1.0], seconds=0.001)
    with pytest.warns(ModelWarning, match="s0 reached"):
        scene.simulate(3.0, [0.0], [1.0], **QUIET)
