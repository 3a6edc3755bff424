"""Inequalities: numbers, and symmetric operators by definiteness; true, false, refused, and shown with a counterexample."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.inequalities import least_pivot, related
from pycraft.identities.parse import ParseError

TRUE = [
    "MM > 0", "ℳ + J ≥ ℳ", r"\mathcal M \succ 0", "M ≥ 0", "0 < D", "P ≥ P⁺", "P ≥ M", "R ≥ P", "Ω >= 0", "Υ ≥ 0", "J ≥ 0", "-M ≺ 0",
    "inv(MM + J) > 0", "ℳ ≤ ℳ", "θ̇*ℳθ̇ ≥ 0", "tr ℳ > 0", "tr(ΥM) ≤ N", r"\mathrm{tr}\,\mathcal M \geq 0", "x ∈ Θ; x*(ℳ + J)x ≥ x*ℳx",
    "A : Θ → Θ; AᵀA ≥ 0",
]  # fmt: skip
FALSE = ["P > P⁺", "M > P", "Ω > 0", "ℳ < 0", "ℳ > ℳ", "tr ℳ < 0", "tr ℳ < tr ℳ", "D ≥ ℳ", "M ≥ R", "ℳ ≥ ℳ + J", "𝓑V V*𝓑* - M ≥ 0"]


@pytest.mark.parametrize("text", TRUE)
def test_true_inequalities_hold(text):
    found = pc.check(text, states=6, search=False)
    assert found.verdict == "holds" and found, repr(found)


@pytest.mark.parametrize("text", FALSE)
def test_false_inequalities_fail(text):
    model = pc.tree([-1, 0, 0, 1], ["pin", "ball", "slider", "universal"], seed=1, rotor_inertia=True)
    assert pc.check(text, model, states=2, search=False).verdict == "fails"


def test_a_false_one_has_its_smallest_counterexample():
    found = pc.check("ℳ ≥ ℳ + J", states=4)
    assert found.true_where == [{"J = 0"}] and found.counterexample.bodies == 1 and found.counterexample.rotor_inertia
    assert pc.truth("ℳ ≥ ℳ + J", smallest_case=False).verdict == "TRUE where J = 0"


def test_a_difference_below_double_is_seen():
    """Of 1e-20 D there is nothing left in double beside D."""
    model = pc.chain(3)
    assert pc.check("D + 1e-20 D > D", model, states=2)
    assert pc.check("D - 1e-20 D ≥ D", model, states=2, search=False).verdict == "fails"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("φ > 0", "φ maps F → F: > is said of numbers and, as definiteness, of symmetric operators"),
        ("H ≥ 0", "H maps F → Θ"),
        ("θ̇ > 0", "is a vector"),
        ("D > 1", "one is an operator, the other a number"),
        ("A : Θ → Θ; A ≥ 0", "is not symmetric"),
        ("0 < ℳ < D", "two sides and one sign"),
    ],
)
def test_what_has_no_order_is_refused_by_name(text, says):
    with pytest.raises(pc.Error, match=says):
        pc.check(text, pc.chain(3), states=1, search=False)


def test_what_takes_equations_alone_says_so():
    with pytest.raises(ParseError, match=r"is an inequality: pycraft.check"):
        pc.repair("MM > 0")


def test_the_least_pivot_is_that_of_the_signs():
    """Sylvester: the signs of the pivots are those of the eigenvalues."""
    rng = np.random.default_rng(0)
    for signs in ([1, 1, 1, 1], [1, 1, 1, -1], [1, 0, 0, 0], [0, 0, 0, 0], [1, 1, 0, -1]):
        x = rng.normal(size=(4, 4))
        a = x @ np.diag(signs) @ x.T
        found = least_pivot((a + a.T) / 2, 1e-12)
        assert found > 1e-6 if min(signs) > 0 else abs(found) < 1e-12 if min(signs) == 0 else found < -1e-6


def test_an_inequality_has_one_sign_outside_of_brackets():
    assert related("a = b") == ("=", [("a = b", 0)]) and related("M ≥ 0") == ("≥", [("M ", 0), (" 0", 3)])
    with pytest.raises(ParseError):
        related("a > b = c")
