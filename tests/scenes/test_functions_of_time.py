"""Harmonic functions of several numbers, words about times, and what names hinges where a state is given."""

import numpy as np
import pytest

import pycraft as pc

E, P = pc.effects, dict(progress=False)


def test_several_harmonics():
    """Number by number, one number for all where there is one."""
    both = E.Harmonic([1.0, 2.0], 0.7, [0.1, -0.4], 0.25)
    for t in (-0.3, 0.0, 1.7):
        expected = [0.25 + a * np.sin(2 * np.pi * 0.7 * t + p) for a, p in ((1.0, 0.1), (2.0, -0.4))]
        assert np.abs(both(t) - expected).max() < 4 * np.finfo(float).eps
    arm = pc.chain(2)
    one = pc.Scene(arm).add(E.Servo(9.0, 1.0, target=both))
    apart = pc.Scene(arm)
    for i, name in enumerate(arm.hinges):
        apart.add(E.Servo(9.0, 1.0, target=E.Harmonic(both.amplitude[i], 0.7, both.phase[i], 0.25), hinges=name))
    a, b = (scene.evaluate([0.1, 0.2], [0.3, 0.4], 0.6).vdot for scene in (one, apart))
    assert np.abs(a - b).max() < 1e-13
    again = pc.Scene.from_dict(one.to_dict())
    assert np.array_equal(again.evaluate([0.1, 0.2], [0.3, 0.4], 0.6).vdot, a)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            ([1.0, 2.0], [1.0, 2.0, 3.0]),
            r"one number for each parameter, or \(n,\), not amplitude \(2,\), frequency \(3,\), phase \(\), offset \(\)",
        ),
        (([[1.0]], 2.0), r"not amplitude \(1, 1\)"),
        (([], 2.0), "as many amplitudes, frequencies, phases and offsets"),
        (("much", 2.0), "amplitude is not an array of numbers"),
        (([1.0, np.nan], 2.0), "is nan"),
    ],
)
def test_harmonics_that_are_none(given, said):
    with pytest.raises(pc.ModelError, match=said):
        E.Harmonic(*given).in_core()


@pytest.mark.parametrize(
    ("t_eval", "said"),
    [
        ([0.1, 0.065], r"t_eval: entry 1 is 0.065 s after 0.1 s; times must rise: np.unique\(t_eval\) sorts them"),
        ([0.1, 0.1], "entry 1 is 0.1 s after 0.1 s"),
        ([0.1, np.nan], "entry 1 is nan; times must be finite"),
        ([], r"at least one time, .*not an array \(0,\)"),
        ([[0.1, 0.2]], r"at least one time, \(K,\) in seconds, not an array \(1, 2\)"),
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
