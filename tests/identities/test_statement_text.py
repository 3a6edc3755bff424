"""Numbers of a statement that are near each other are distinguished, or the check is undecided: never true for lack of digits."""

import pytest

import pycraft as pc
from pycraft.identities.judge import DECIDES
from pycraft.identities.statement_text import TELLS, telling


@pytest.mark.parametrize(
    "statement",
    [
        "φ = φ + 1e-40φ", "phi == phi + 10**-40*phi", "phi == phi + (1/10**40)*phi", "phi == phi + 1e-20*1e-20*phi",
        "phi = 1.0000000000000000000000000000000000000001*phi", "0.1 phi = 0.1000000000000000000000000000000000000001 phi",
        "tr(M) = tr(M) + 1e-40", "MM = MM + 1e-13*MM", "ψ⁻¹ = φ⁻¹ + 𝒦H + 1e-30 I", "D(k) = D(k) + 1e-40 D(k)",
    ],
)  # fmt: skip
def test_small_numbers_are_seen(statement):
    report = pc.check(statement, pc.chain(2), states=2, search=False)
    assert report.verdict == "fails" and not report


def test_expressions_and_random_trees_see_them_too():
    phi = pc.chain(2).soa.phi
    assert pc.check((phi, phi + 1e-40 * phi), pc.chain(2), states=2, search=False).verdict == "fails"
    assert pc.check("phi = phi + 1e-40*phi", states=2, search=False).verdict == "fails"


@pytest.mark.parametrize("statement", ["phi = phi + 1e-200*phi", "phi = phi + 1e-60*phi", "D(k) = D(k) + 1e-200 D(k)"])
def test_what_no_scalar_tells_apart_is_undecided(statement):
    """Extended, quad and 50 digits see a difference of zero, three times running: that is no proof of it."""
    report = pc.check(statement, pc.chain(2), states=2)
    assert report.verdict == "undecided"
    with pytest.raises(pc.UndecidedError):
        bool(report)


@pytest.mark.parametrize(
    "statement", ["1e-40*phi = 1e-40*phi", "ψ⁻¹ + 1e-30 I = φ⁻¹ + 𝒦H + 1e-30 I", "2 D = D + D", "1e-40 D(k) = 1e-40 D(k)"]
)
def test_what_is_true_with_such_numbers_holds(statement):
    assert pc.check(statement, pc.chain(2), states=2)


def test_the_bound_that_decides_follows_the_nearest_numbers():
    assert telling("phi = psi") == telling("2 D = D + D") == telling("phi2 = 0.5 psi**-1") == DECIDES
    assert telling("phi = phi + 1e-20 phi") == pytest.approx(TELLS * 1e-20, rel=1e-15)
    assert telling("1.00000000000000000001 phi = phi") == pytest.approx(TELLS * 1e-20, rel=1e-15)
    assert telling("3e9 phi = 3000000000.00000000003 phi") == pytest.approx(TELLS * 1e-20, rel=1e-15)  # relative to the larger
    assert telling("phi = phi", "1e-30 phi") == pytest.approx(TELLS * 1e-30, rel=1e-15)
