"""Coefficients and constants are the doubles that were given, and what becomes of them is exact in the precision of the run."""

import mpmath
import numpy as np
import pytest

import pycraft as pc

DIGITS = 50
TOLERANCE = mpmath.mpf(10) ** -44


@pytest.fixture(scope="module")
def arm():
    model = pc.tree([-1, 0, 1, 1], ["pin", "ball", "slider", "pin"], seed=2)
    model.q = model.random_state(seed=1).q
    return model


def wide(op, arm):
    """The operator's matrix in 50 digits, as mpmath's."""
    with mpmath.workdps(70):
        return mpmath.matrix(np.asarray(op.at(arm.q, precision=DIGITS).dense(dtype=object)).tolist())


def off(found, exact):
    with mpmath.workdps(70):
        return mpmath.mnorm(found - exact, mpmath.inf) / mpmath.mnorm(exact, mpmath.inf)


def test_reciprocals_sums_and_products_of_coefficients(arm):
    H, phi, M, J, D = arm.soa("H phi M J D")
    MM = H @ phi @ M @ phi.T @ H.T + J
    x = mpmath.mpf
    exact_D, exact_MM = wide(D, arm), wide(MM, arm)
    with mpmath.workdps(70):
        cases = {
            "(0.1 D)⁻¹": ((0.1 * D).inv(), (x(0.1) * exact_D) ** -1),
            "(0.1 ℳ)⁻¹": ((0.1 * MM).inv(), (x(0.1) * exact_MM) ** -1),
            "0.1 D + 0.2 D": (0.1 * D + 0.2 * D, (x(0.1) + x(0.2)) * exact_D),
            "0.1 (0.3 D)": (0.1 * (0.3 * D), x(0.1) * x(0.3) * exact_D),
            "(0.1 D)(0.3 D)": ((0.1 * D) @ (0.3 * D), x(0.1) * x(0.3) * exact_D * exact_D),
            "0.1 (0.3 ℳ + 0.7 D)": (0.1 * (0.3 * MM + 0.7 * D), x(0.1) * (x(0.3) * exact_MM + x(0.7) * exact_D)),
            "(0.3 (0.1 D)⁻¹)⁻¹": ((0.3 * (0.1 * D).inv()).inv(), x(0.1) / x(0.3) * exact_D),
        }
        for name, (op, exact) in cases.items():
            assert off(wide(op, arm), exact) <= TOLERANCE, name


@pytest.mark.parametrize("exact_rank", [True, False], ids=["rank one", "rank one but for rounding"])
def test_constants_of_low_rank(arm, exact_rank):
    """Kept as entries of themselves where they have that rank; numbers that have it only to a double's rounding are taken as they are."""
    H, phi, M = arm.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    n = arm.nv
    u = np.arange(1.0, n + 1) if exact_rank else np.linspace(0.1, 1.3, n)
    numbers = np.outer(u, u[::-1] + 0.5 if exact_rank else u[::-1])
    C = pc.constant(numbers, arm.soa.Theta, arm.soa.Theta)
    with mpmath.workdps(70):
        exact = (wide(MM, arm) + mpmath.matrix(numbers.tolist())) ** -1
        assert off(wide((MM + C).inv(), arm), exact) <= TOLERANCE
    assert np.allclose((MM + C).inv().dense(), np.linalg.inv(np.asarray(MM.dense()) + numbers), rtol=1e-9, atol=1e-12)
    if exact_rank:
        assert not (MM + C).inv().at(arm.q, precision=DIGITS).plan().has_dense_step


def test_products_of_constants(arm):
    n = arm.nv
    rng = np.random.default_rng(0)
    A, B = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    C1, C2 = (pc.constant(X, arm.soa.Theta, arm.soa.Theta) for X in (A, B))
    with mpmath.workdps(70):
        exact = mpmath.matrix(A.tolist()) * mpmath.matrix(B.tolist()) + wide(arm.soa.D, arm)
        assert off(wide(C1 @ C2 + arm.soa.D, arm), exact) <= TOLERANCE


def test_double_precision_takes_one_number(arm):
    """In double precision a reciprocal is one coefficient: no block is made for it."""
    assert not any("0.1 I" in step["text"] for step in (0.1 * arm.soa.D).inv().plan().steps)
    wide_plan = (0.1 * arm.soa.D).inv().at(arm.q, precision=DIGITS).plan()
    assert any("0.1 I" in step["text"] for step in wide_plan.steps), wide_plan
