"""Functions that users gave: their errors stay what they are, and say whose function it was. Numbers that are none are named."""

import re

import numpy as np
import pytest

import pycraft as pc

E = pc.effects


def raising(*_):
    raise KeyError("no data")


def test_what_a_function_raises_is_its_own_with_its_name():
    def coupled():
        model = pc.chain(3)
        model.add_coupling(["hinge0", "hinge2"], function=raising, name="gear")
        return model.loops.residual()

    def framed():
        model = pc.chain(2)
        model.add_frame("odd", motion=raising)
        return model.frame("odd").pose()

    def by_effect():
        return pc.Scene(pc.chain(2)).add(raising).evaluate([0, 0], [0, 0])

    def by_event():
        return pc.Scene(pc.chain(2)).simulate(0.1, [0.1, 0.2], [0, 0], events=raising)

    def outside():
        soa = pc.chain(2).soa
        return pc._core.external(raising, raising, soa.Theta, soa.Theta, "theirs") @ np.ones(2)

    for call, name in (
        (coupled, "the function of coupling 'gear'"),
        (framed, "the motion of frame 'odd' at t = 0"),
        (by_effect, "the forces function of effect '.*' at t = 0"),
        (by_event, "event '.*' at t = 0"),
        (outside, "the operator from outside 'theirs'"),
    ):
        with pytest.raises(KeyError, match="no data") as caught:
            call()
        (note,) = caught.value.__notes__
        assert re.fullmatch(f"raised by {name}.*", note)


def test_what_stops_a_program_is_left_alone():
    def stop(*_):
        raise KeyboardInterrupt

    model = pc.chain(3)
    model.add_coupling(["hinge0", "hinge2"], function=stop, name="gear")
    with pytest.raises(KeyboardInterrupt) as caught:
        model.loops.residual()
    assert not getattr(caught.value, "__notes__", [])


def test_an_operator_from_outside_that_gives_no_number():
    soa = pc.chain(2).soa
    broken = pc._core.external(lambda x: x * np.nan, None, soa.Theta, soa.Theta, "theirs")
    with pytest.raises(pc.EvaluationError, match="'theirs', an operator from outside, has an entry that is no finite number"):
        (soa.MM + broken) @ np.ones(2)


def test_moments_about_a_point_beyond_the_range():
    model = pc.chain(3)
    model.gravity = (0, -9.81, 0)
    with pytest.raises(pc.EvaluationError, match="moments of '.*' about that point are beyond the range"):
        model.interbody_forces(about=(1e308, 1e308, 1e308))
    q = np.array([[0.0, 0, 0], [0, 0, 0], [0.1, 0.2, 0.3]])
    assert np.isfinite(model.interbody_forces(q, about=(1e6, 0, 0))).all()
    with pytest.raises(pc.EvaluationError, match=r"too far from the hinges \(state \d of a batch of 3\)"):
        model.interbody_forces(q, about=(1e308, 1e308, 1e308))
    with pytest.raises(pc.EvaluationError, match="beyond the range"):
        model.base_reaction(about=(1e308, 1e308, 1e308))


def nan_at(shape, *place):
    made = np.zeros(shape)
    made[place] = np.nan
    return made


@pytest.mark.parametrize("axis", ["q", "v", "tau"])
def test_a_nan_in_a_batch_is_named_with_its_state(axis):
    model = pc.chain(3)
    given = {name: np.zeros((5, 3)) for name in ("q", "v", "tau")} | {axis: nan_at((5, 3), 2, 1)}
    calls = {
        "forward_dynamics": 3,
        "inverse_dynamics": 3,
        "interbody_forces": 3,
        "bias_forces": 2,
        "mass_matrix": 1,
        "mass_matrix_inverse": 1,
    }
    for call, takes in calls.items():
        chosen = list(given.values())[:takes]
        if axis not in list(given)[:takes]:
            continue
        with pytest.raises(pc.ModelError, match=r"of hinge 'hinge1': entry 0 is nan \(state 2 of a batch of 5\)"):
            getattr(model, call)(*chosen)
        with pytest.raises(pc.ModelError, match=r"entry 0 is nan$"):  # one state
            getattr(model, call)(*(x[2] for x in chosen))
    if axis != "tau":
        with pytest.raises(pc.ModelError, match=r"of hinge 'hinge1': entry 0 is nan \(state 2 of a batch of 5\)"):
            model.soa.MM.at(given["q"], given["v"])


def test_a_nan_in_wrenches_of_a_batch():
    model = pc.chain(3)
    with pytest.raises(pc.ModelError, match=r"wrench on 'body1' has an entry that is not finite \(state 3 of a batch of 5\)"):
        model.interbody_forces(np.zeros((5, 3)), wrenches={"body1": nan_at((5, 6), 3, 1)})
    with pytest.raises(pc.ModelError, match=r"wrench on 'body1' has an entry that is not finite \(state 3 of a batch of 5\)"):
        model.constrained_dynamics(np.zeros((5, 3)), wrenches={"body1": nan_at((5, 6), 3, 1)})
    with pytest.raises(pc.ModelError, match=r"wrench on 'body1' has an entry that is not finite$"):
        model.constrained_dynamics(np.zeros(3), wrenches={"body1": nan_at(6, 1)})


def geared(part):
    """A coupling of which one part is NaN where the first coordinate is 2."""

    def function(q):
        parts = [q[0] - q[1], np.array([1.0, -1.0]), np.zeros((2, 2)), np.zeros((2, 2, 2))]
        if q[0] == 2:
            parts[part] = parts[part] * np.nan
        return tuple(parts)

    model = pc.chain(3)
    model.add_coupling(["hinge0", "hinge2"], function=function, name="gear")
    return model


PARTS = (
    "r of the function of coupling 'gear' is nan",
    "the gradient of the function of coupling 'gear' has an entry that is nan",
    "the second derivatives of the function of coupling 'gear' has an entry that is nan",
)


@pytest.mark.parametrize("part", range(3))
def test_a_coupling_that_gives_no_number_is_named_with_its_state(part):
    """In every call that asks for rows, of one state and of a batch."""
    model = geared(part)
    q = np.array([[1.0, 0.5, 1.0], [2.0, 0.5, 0.25], [1.0, 0.0, 1.0]])
    calls = {
        "residual": lambda q: model.loops.residual(q),
        "jacobian": lambda q: model.loops.jacobian(q),
        "bias": lambda q: model.loops.bias(q, np.zeros(3)),
        "augmented": lambda q: model.constrained_dynamics(q, np.zeros(3)),
        "embedded": lambda q: model.constrained_dynamics(q, np.zeros(3), method="embed"),
        "velocities": lambda q: model.constrained_velocities(q, np.zeros(3)),
        "operator": lambda q: model.soa.Q.at(q, np.zeros_like(q)).dense(),
    }
    for call in calls.values():
        with pytest.raises(pc.EvaluationError, match=rf"{PARTS[part]} at q = \(2, 0\.25\) \(state 1 of a batch of 3\)"):
            call(q)
        with pytest.raises(pc.EvaluationError, match=rf"{PARTS[part]} at q = \(2, 0\.25\)$"):
            call(q[1])


def test_third_derivatives_that_are_no_numbers():
    model = geared(3)
    v = np.ones(3)
    with pytest.raises(pc.EvaluationError, match=r"the third derivatives of .*'gear' has an entry that is nan at q = \(2, 2\)"):
        model.soa.Q.diff(0).diff(0).at([2.0, 0.0, 2.0], v).dense()


def test_what_a_coupling_raises_tells_where():
    model = pc.chain(3)
    model.add_coupling(["hinge0", "hinge2"], function=raising, name="gear")
    with pytest.raises(KeyError) as caught:
        model.loops.residual(np.array([[2.0, 0.0, 0.25]]))
    assert caught.value.__notes__ == ["raised by the function of coupling 'gear' at q = (2, 0.25)"]


def test_results_beyond_the_range_are_named_with_their_state():
    model = pc.chain(3)
    fast = np.zeros((4, 3))
    fast[2] = 1e200
    for call in (
        lambda: model.interbody_forces(np.zeros((4, 3)), fast),
        lambda: model.inverse_dynamics(np.zeros((4, 3)), fast),
        lambda: model.forward_dynamics(np.zeros((4, 3)), fast),
        lambda: model.bias_forces(np.zeros((4, 3)), fast),
        lambda: model.interbody_forces_derivatives(np.zeros((4, 3)), fast),
        lambda: model.inverse_dynamics_derivatives(np.zeros((4, 3)), fast, fast),
        lambda: model.forward_dynamics_derivatives(np.zeros((4, 3)), fast, fast),
    ):
        with pytest.raises(pc.EvaluationError, match=r"beyond the range of its numbers.*\(state 2 of a batch of 4\)"):
            call()
