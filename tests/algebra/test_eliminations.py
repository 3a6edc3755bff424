"""Eliminations over a tree: what is lost is found and mended, and corrections are made as many as are asked for."""

import numpy as np
import pytest

import pycraft as pc

X = np.linspace(-1, 1, 6)


def relative(found, exact):
    return np.abs(found - exact).max() / np.abs(exact).max()


def chain():
    arm = pc.chain(6, seed=5)
    arm.q = np.random.default_rng(0).uniform(-1, 1, 6)
    return arm


def test_corrections_go_on_while_they_shrink():
    """ℳ − λ I beside an eigenvalue, in single: an elimination with three digits."""
    arm = chain()
    H, phi, M, I = arm.soa("H phi M I")
    MM = H @ phi @ M @ phi.T @ H.T
    op = (MM - float(np.linalg.eigvalsh(MM.dense())[0]) * (1 + 2e-4) * I).inv()
    exact = op.at(arm.q, precision=50) @ X
    errors = {n: relative(op.at(arm.q, precision="single", refine=n, residual="wider") @ X, exact) for n in (0, 1, 3, "auto")}
    assert errors.pop(0) > 1e-4 and max(errors.values()) <= 2.0**-23, errors


@pytest.mark.parametrize("share", [1 - 1e-9, 1 - 1e-13, 1 - 4e-16])
def test_small_pivot_blocks_of_a_regular_operator(share):
    """N + N* + D − C, C nearly D: body by body the pivots are rounding, and fronts are merged until none is."""
    arm = chain()
    H, E, G, D = arm.soa("H E G D")
    N = H @ E @ G
    C = pc.constant(share * D.dense(), D.domain, D.codomain)
    op = (N + N.T + D - C).inv()
    exact = op.at(arm.q, precision=50) @ X
    dense = (N + N.T + D - C).dense()
    assert relative(op @ X, exact) <= 64 * np.finfo(float).eps * np.linalg.cond(dense)
    assert abs(float(op.logdet()) + np.linalg.slogdet(dense)[1]) <= 1e-12 * np.linalg.cond(dense)


@pytest.mark.parametrize(("ratio", "seed"), [(1e-5, 1), (1e-7, 3), (1e-9, 2)])
def test_states_that_are_lost_as_a_whole_are_found(ratio, seed):
    """N + N* + Z, Z of the body k as small as ratioᵏ: well conditioned by N, and body by body each pivot is noise beside the next. What is
    left of a state is zero or a few units of rounding, which the product with it gives back as it is."""
    arm = pc.chain(6, seed=seed)
    arm.q = np.random.default_rng(seed).uniform(-1, 1, 6)
    H, E, G, D = arm.soa("H E G D")
    N = H @ E @ G
    Z = pc.constant(np.diag(ratio ** np.arange(1.0, 7.0)), D.domain, D.codomain)
    op = (N + N.T + Z).inv()
    condition = np.linalg.cond((N + N.T + Z).dense())
    assert condition < 2000
    assert relative(op @ X, op.at(arm.q, precision=50) @ X) <= 8 * np.finfo(float).eps * condition


def test_every_state_of_a_batch_has_residuals_of_its_own():
    arm = chain()
    H, phi, M, I = arm.soa("H phi M I")
    MM = H @ phi @ M @ phi.T @ H.T
    Q = np.random.default_rng(1).uniform(-1, 1, (3, 6))
    for op in ((MM + 0.1 * I).inv(), MM.inv()):
        together = op.at(Q, precision="single", refine=2, residual="wider") @ X
        for q, row in zip(Q, together, strict=True):
            assert np.array_equal(op.at(q, precision="single", refine=2, residual="wider") @ X, row)
            assert relative(row, op.at(q, precision=50) @ X) <= 2.0**-22


@pytest.mark.parametrize("seed", range(4))
def test_signs_that_cancel_in_a_probe_are_no_loss(seed):
    """Three free bodies: the states lie 18 apart, and right sides whose signs repeat with that distance left a state as zero."""
    model = pc.tree([-1, 0, 0], ["free"] * 3, seed=seed, rotor_inertia=False)
    model.q = model.random_state(seed).q
    H, phi, M = model.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    exact = pc.blockdiag(MM.inv()).dense()
    bound = 64 * np.finfo(float).eps * np.linalg.cond(MM.dense()) * np.abs(exact).max()
    assert np.abs(pc.blockdiag(MM.inv()).dense(rules=False) - exact).max() <= bound
