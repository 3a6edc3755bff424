"""Coefficients are the numbers that were given, constants the doubles, and what becomes of them is exact in the precision of the run."""

import pickle
from decimal import Decimal
from fractions import Fraction

import mpmath
import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.parse import Statement, Statements
from pycraft.identities.statement_text import statement_text

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


@pytest.mark.parametrize("exact_rank", [True, False], ids=["rank one", "rank one up to rounding"])
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


@pytest.mark.parametrize("precision", ["double", DIGITS])
def test_every_precision_takes_one_number(arm, precision):
    """A reciprocal is one coefficient: no block is made for it."""
    plan = (0.1 * arm.soa.D).inv().at(arm.q, precision=precision).plan()
    assert len(plan.steps) == len((0.5 * arm.soa.D).inv().at(arm.q, precision=precision).plan().steps)


@pytest.mark.parametrize("digits", [50, 100])
def test_ratios_are_exact(arm, digits):
    """D/3 is a third of D; whole numbers, Fraction and Decimal are what they say, a float is the double that it is."""
    D = arm.soa.D
    with mpmath.workdps(digits + 20):
        third, tenth = mpmath.mpf(1) / 3, mpmath.mpf(1) / 10
        whole = mpmath.matrix(np.asarray(D.at(arm.q, precision=digits).dense(dtype=object)).tolist())
        cases = [
            (D / 3, third), (Fraction(1, 3) * D, third), (D / 3 + D / 3, 2 * third), ((3 * D).inv().inv() / 9, third),
            (D / Decimal(3), third),
            (Decimal("0.1") * D, tenth), (D / 10, tenth), (0.1 * D, mpmath.mpf(0.1)), (10**30 * D, mpmath.mpf(10) ** 30),
            (D / 3.0, third), ((D / 7) * 7, mpmath.mpf(1)),
        ]  # fmt: skip
        for op, factor in cases:
            made = mpmath.matrix(np.asarray(op.at(arm.q, precision=digits).dense(dtype=object)).tolist())
            assert mpmath.mnorm(made - factor * whole, mpmath.inf) <= mpmath.mpf(10) ** (2 - digits) * mpmath.mnorm(
                factor * whole, mpmath.inf
            ), op
        n = arm.nv
        shift = (D / 3).logdet() - D.logdet()
        assert abs(mpmath.mpf(float(shift.at(arm.q, precision=digits))) + n * mpmath.log(3)) <= 2 * n * np.finfo(float).eps


def test_what_text_says_is_decimal(arm):
    for text in (
        "0.3 D = 0.1 D + 0.2 D",
        "0.3*D == 0.1*D + 0.2*D",
        "D/3 + 2/3 D = D",
        "1e-3 D = D/1000",
        r"\frac{1}{3} D = D/3",
        "tr(D)/3 = tr(D/3)",
    ):
        assert pc.check(text, arm, states=2) and pc.prove(text, arm), text
    for text in ("0.3 D = 0.1 D + 0.20000000000000001 D", "D/3 = 0.3333333333333333 D"):
        assert not pc.check(text, arm, states=2, search=False) and not pc.prove(text, arm), text
    assert not pc.prove("D/3 = 0.33333333333333333333333333333333333333 D", arm)
    with pytest.raises(pc.EvaluationError, match="beyond the range"):
        pc.check("1e999999 D = D", arm)


def test_floats_are_doubles(arm):
    """Python's 0.1 and 0.2 are no decimals, and their sum is not Python's 0.3."""
    D = arm.soa.D
    assert not pc.prove(0.3 * D, 0.1 * D + 0.2 * D)
    assert pc.prove(Fraction(3, 10) * D, Fraction(1, 10) * D + Fraction(2, 10) * D)
    assert pc.prove(0.75 * D, 0.25 * D + 0.5 * D)
    assert not pc.check((0.3 * D, 0.1 * D + 0.2 * D), arm, states=1, search=False)


@pytest.mark.parametrize("number", [Fraction(1, 3), Fraction(3, 10), 0.1, Fraction(2**80 + 1, 3**40), -Fraction(7, 3)])
def test_coefficients_are_shown_kept_and_read_again(arm, number):
    op = number * arm.soa.D
    assert op.coefficient == number and type(op.coefficient) is type(number)
    again = pickle.loads(pickle.dumps((op, op.trace() / 7)))
    assert again[0].coefficient == number and repr(again[1]) == repr(op.trace() / 7)
    assert eval(op.python(), {"Fraction": Fraction, "D": arm.soa.D}) == op


def test_a_statement_of_doubles_is_carried_over_as_it_is(arm):
    """For the search of a counterexample a statement is written out and read again on other models."""
    D = arm.soa.D
    read = Statement(0.1 * D, Fraction(1, 3) * D, "", "expressions")
    again = Statements(arm.soa).read(statement_text(read))
    assert again.lhs == 0.1 * D and again.rhs == Fraction(1, 3) * D


@pytest.mark.parametrize("bad", [Decimal("nan"), Decimal("inf"), Decimal("-inf")])
def test_what_is_no_number_is_refused(arm, bad):
    with pytest.raises(pc.EvaluationError, match="no number to reckon with"):
        bad * arm.soa.D
