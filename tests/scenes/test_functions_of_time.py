"""Words about times, and about what names hinges where a state is given; what linear models hold."""

import numpy as np
import pytest

import pycraft as pc

E, P = pc.effects, dict(progress=False)


@pytest.mark.parametrize(
    ("t_eval", "said"),
    [
        ([0.1, 0.065], r"t_eval: entry 1 is 0.065 s after 0.1 s; times rise: np.unique\(t_eval\) sorts them"),
        ([0.1, 0.1], "entry 1 is 0.1 s after 0.1 s"),
        ([0.1, np.nan], "entry 1 is nan; times are finite"),
        ([], r"one at least, not an array \(0,\)"),
        ([[0.1, 0.2]], r"times \(K,\) in seconds, one at least, not an array \(1, 2\)"),
    ],
)
def test_times_that_are_asked_for(t_eval, said):
    with pytest.raises(pc.EvaluationError, match=said):
        pc.mechanisms.pendulum().simulate(1.0, t_eval=t_eval, **P)


@pytest.mark.parametrize("state", [np.zeros(2), [0.1, 0.2], pc.chain(2).random_state(1)])
def test_a_state_in_the_place_of_hinges(state):
    scene = pc.Scene(pc.chain(2)).add(E.Damping(0.1))
    with pytest.raises(pc.ModelError, match=r"the first argument names hinges, .* write interbody_forces\(q=q, v=v\)"):
        scene.interbody_forces(state, np.zeros(2))


def test_what_linear_models_hold():
    """A sampled controller's force is a constant between samples: of no part in A."""
    arm = pc.chain(1)
    held = pc.Scene(arm).add(E.Sampled(lambda t, state: -5.0 * state.q, 0.1))
    free = pc.Scene(arm)
    assert np.array_equal(held.linearize([0.3], [0.2]).A[:2, :2], free.linearize([0.3], [0.2]).A)
