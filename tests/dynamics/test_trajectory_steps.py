"""Steps that output times cut short, lengths of quaternions, and costs: what a wrong line in the integrators would change."""

import numpy as np
import pytest

import pycraft as pc

CONTROLLED = ["dopri5", "cash-karp54", "dop853", "bulirsch-stoer"]


@pytest.fixture(scope="module")
def swing():
    model = pc.chain(2)
    model.gravity = (0, -9.81, 0)
    return model


@pytest.mark.parametrize("integrator", CONTROLLED)
def test_a_step_cut_short_does_not_shorten_the_next(swing, integrator):
    """An output time 1e-9 s after the first step costs one step, not the twenty that growing from 1e-9 s again would take."""
    options = dict(integrator=integrator, rtol=1e-7, atol=1e-9)
    plain = swing.integrate_ode([0.3, 0.2], [0, 0], [0.0, 1.0], **options)
    times = [0.0, *(x for t in np.linspace(0.1, 0.9, 9) for x in (t, t + 1e-9)), 1.0]
    cut = swing.integrate_ode([0.3, 0.2], [0, 0], times, **options)
    assert cut.steps <= plain.steps + 3 * len(times)
    assert np.allclose(cut.q[-1], plain.q[-1], atol=1e-5)


def test_lengths_of_quaternions_are_kept():
    """A Lie group method keeps |q| of a quaternion that is not 1, to rounding; the motion is that of q/|q|."""
    model = pc.tree([-1, 0], ["free", "ball"], seed=1)
    state = model.random_state(3)
    q = state.q.copy()
    q[:4] *= 3.0
    slices = [model.hinges[name].q_slice for name in model.hinges]
    motion = model.integrate_ode(q, state.v, np.linspace(0, 0.2, 101), integrator="rkmk4", step=1e-4)
    unit = model.integrate_ode(state.q, state.v, [0, 0.2], integrator="rkmk4", step=1e-3)
    for s, length in zip(slices, (3.0, 1.0), strict=True):
        assert np.abs(np.linalg.norm(motion.q[:, s][:, :4], axis=1) / length - 1).max() <= 4.5e-16  # all along the way
    assert np.allclose(motion.q[-1][:4] / 3, unit.q[-1][:4], atol=1e-13) and np.allclose(motion.v[-1], unit.v[-1], atol=1e-11)


def test_moves_keep_the_length():
    """2000 moves one after the other: no drift, where each alone rounds."""
    model = pc.tree([-1, 0], ["ball", "free"], seed=1)
    q, dv = model.random_state(3).q, np.random.default_rng(0).normal(size=model.nv)
    q[:4] *= 2.0
    for _ in range(2000):
        q = model.integrate(q, dv)
    assert np.linalg.norm(q[:4]) == pytest.approx(2.0, rel=1e-15) and np.linalg.norm(q[4:8]) == pytest.approx(1.0, rel=1e-15)
