"""Results written into the memory of their arguments: see `campaigns.overlaps`, of which a part runs here."""

import numpy as np
import pytest

import pycraft as pc
from campaigns import overlaps


def test_a_part_of_the_campaign():
    assert not overlaps.run(range(3))


@pytest.mark.slow
def test_the_campaign():
    assert not overlaps.run(range(100, 400))


@pytest.mark.parametrize("method", ["articulated", "cholesky", "realization"])
@pytest.mark.parametrize("shift", [0, 1, -1])
def test_forces_that_become_accelerations(method, shift):
    """The result over the forces of the same batch, shifted by a number or not: each state read before it is written."""
    arm = pc.chain(4, seed=1)
    states = [arm.random_state(i) for i in range(9)]
    q, v = np.array([s.q for s in states]), np.array([s.v for s in states])
    memory = np.zeros(9 * 4 + 2)
    tau = memory[1:37].reshape(9, 4)
    tau[:] = np.random.default_rng(0).normal(size=(9, 4))
    expected = arm.forward_dynamics(q, v, tau.copy(), method=method)
    out = memory[1 + shift : 37 + shift].reshape(9, 4)
    assert arm.forward_dynamics(q, v, tau, method=method, out=out) is out
    assert np.array_equal(out, expected)


def test_refinement_reads_the_forces_as_they_were():
    arm = pc.chain(3, seed=2)
    state, tau = arm.random_state(1), np.array([0.5, -0.3, 0.8])
    for options in ({"refine": 1}, {"refine": "auto", "residual": "wider"}, {"form": "ud", "refine": 2}):
        expected = arm.forward_dynamics(state.q, state.v, tau, **options)
        for kind in range(3):
            given = [state.q.copy(), state.v.copy(), tau.copy()]
            found = arm.forward_dynamics(*given, **options, out=given[kind])
            assert np.array_equal(found, expected), (options, kind)


def test_arrays_that_are_not_aligned():
    """As NumPy's frombuffer makes them at an odd offset: read as any other, not written to."""
    arm = pc.chain(3, seed=2)
    raw = bytearray(1 + 3 * 8)
    odd = np.frombuffer(raw, float, 3, 1)
    odd[:] = [0.1, 0.2, 0.3]
    assert np.array_equal(arm.mass_matrix(odd), arm.mass_matrix([0.1, 0.2, 0.3]))
    with pytest.raises(pc.ModelError, match="out= takes"):
        arm.forward_dynamics(odd, odd, odd, out=odd)
