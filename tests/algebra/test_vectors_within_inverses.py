"""Named vectors inside what is made dense: an inverse of ℳ + uu* takes u as it is at each run.

Rounding: a solve with a matrix of condition κ in six coordinates, 100 κ ε.
"""

import numpy as np
import pytest

import pycraft as pc

EPS = np.finfo(float).eps


@pytest.fixture
def arm():
    model = pc.chain(4, seed=1)
    model.q = model.random_state(1).q
    return model


def test_a_rank_one_update_by_a_named_vector(arm):
    soa, rng = arm.soa, np.random.default_rng(0)
    u, w = pc.vector("u", soa.Theta), pc.vector("w", soa.Theta)
    M = soa.MM.dense()
    for refine in (0, 1):
        solve = ((soa.MM + u @ u.T).inv() @ w).at(arm.q, refine=refine)
        nested = ((soa.MM + (soa.MM + u @ u.T).inv()).inv() @ w).at(arm.q, refine=refine)
        for _ in range(3):  # one plan, other vectors
            x, y = rng.normal(size=(2, 4))
            updated = M + np.outer(x, x)
            allowed = 100 * np.linalg.cond(updated) * EPS
            wanted = np.linalg.solve(updated, y)
            np.testing.assert_allclose(solve.value(u=x, w=y), wanted, atol=allowed * np.abs(wanted).max())
            wanted = np.linalg.solve(M + np.linalg.inv(updated), y)
            np.testing.assert_allclose(nested.value(u=x, w=y), wanted, atol=allowed * np.abs(wanted).max())


def test_its_determinant_trace_and_batches(arm):
    soa, x = arm.soa, np.array([1.0, -2.0, 0.5, 3.0])
    u = pc.vector("u", soa.Theta)
    q = np.array([arm.random_state(seed).q for seed in range(70)])
    w = pc.vector("w", soa.Theta)
    batch = ((soa.MM + u @ u.T).inv() @ w).at(q)
    M = soa.MM.at(q).dense()
    for y in (np.ones(4), np.arange(4.0)):
        wanted = np.linalg.solve(M + np.outer(x, x), np.broadcast_to(y, (70, 4))[..., None])[..., 0]
        found = np.asarray(batch.value(u=x, w=y)).reshape(70, 4)
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e5 * EPS * np.abs(wanted).max())


def test_a_vector_without_a_value_is_asked_for(arm):
    u, w = (pc.vector(name, arm.soa.Theta) for name in "uw")
    with pytest.raises(pc.EvaluationError, match="vector 'u' has no value"):
        ((arm.soa.MM + u @ u.T).inv() @ w).value(w=np.ones(4))
