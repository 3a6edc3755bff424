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
    """ℳ − λ I beside an eigenvalue, in single: an elimination with two digits, and one correction by residuals in double leaves four."""
    arm = chain()
    H, phi, M, I = arm.soa("H phi M I")  # noqa: E741
    MM = H @ phi @ M @ phi.T @ H.T
    op = (MM - float(np.linalg.eigvalsh(MM.dense())[0]) * (1 + 2.5e-5) * I).inv()
    exact = op.at(arm.q, precision=50) @ X
    errors = {n: relative(op.at(arm.q, precision="single", refine=n, residual="wider") @ X, exact) for n in (0, 1, 3, "auto")}
    assert errors.pop(0) > 1e-3 and max(errors.values()) <= 2.0**-23, errors


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
