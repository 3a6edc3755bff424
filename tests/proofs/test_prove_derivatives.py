"""∂Υ by its recursion, and derivatives along a coordinate and time in one statement: typed and as expressions."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.proofs import derivative, prove

CONSTANT, SINGLE = "constant H", "single-DOF hinges"


@pytest.fixture(scope="module")
def arm():
    return pc.tree([-1, 0, 0, 1], ["universal", "ball", "slider", "pin"], seed=1, rotor_inertia=True)


RECURSION = "∂{0}Υ = blockdiag(E_ψ* ∂{0}Υ E_ψ + ∂{0}E_ψ* Υ E_ψ + E_ψ* Υ ∂{0}E_ψ) - H* D⁻¹ ∂{0}D D⁻¹ H"


@pytest.mark.parametrize("along", ["_i", "_t"])
def test_the_books_recursion_of_the_derivative_of_upsilon(arm, along):
    text = RECURSION.format(along)
    proof = prove(text, arm)
    assert proof and proof.hypotheses == [CONSTANT] and proof.recheck()
    whole = text + f" + ∂{along}H* D⁻¹ H + H* D⁻¹ ∂{along}H" if along == "_i" else text + " + ∂_t(H*) D⁻¹ H + H* D⁻¹ ∂_tH"
    assert prove(whole, arm) and prove(whole, arm).hypotheses == []
    assert pc.check(whole, arm, states=1, search=False)
    if along == "_i":
        assert not prove(text.replace("- H*", "+ H*"), arm)


def test_it_is_the_derivative_of_the_typed_recursion(arm):
    E_psi, H, D, Y = arm.soa("E_psi H D Upsilon")
    inside = E_psi.T @ derivative(Y, 2) @ E_psi + derivative(E_psi, 2).T @ Y @ E_psi + E_psi.T @ Y @ derivative(E_psi, 2)
    proof = prove(derivative(Y, 2), inside.blockdiag() + derivative(H.T @ D.inv() @ H, 2))
    assert proof and proof.hypotheses == []


MIXED = [
    ("∂_t ∂_i φ = ∂_i ∂_t φ", [SINGLE]),
    ("d/dt (∂_i φ) = ∂_i (d/dt φ)", [SINGLE]),
    ("∂_t ∂_i φ = ∂_t(φ̃ Δ_i φ)", []),
    ("∂_t ∂_i φ = ∂_t φ̃ Δ_i φ + φ̃ Δ_i ∂_t φ", [CONSTANT]),
    ("∂_t ∂_i (φ Mφ*) = ∂_t(φ̃ Δ_i φ M φ* + φ M φ* Δ_i* φ̃*)", []),
    ("∂_i ∂_t (Hφ) = H ∂_i(φ̃ Δ_t φ)", [CONSTANT]),
]


@pytest.mark.parametrize(("text", "hypotheses"), MIXED)
def test_derivatives_along_a_coordinate_and_time(text, hypotheses):
    single = pc.tree([-1, 0, 0, 1], ["pin", "slider", "screw", "pin"], seed=2)
    proof = prove(text, single)
    assert proof and proof.hypotheses == hypotheses and proof.recheck()
    assert pc.check(text, single, states=1, search=False)
    if not hypotheses:
        assert pc.check(text, pc.tree([-1, 0], ["universal", "ball"], seed=2), states=1, search=False)


def test_mixed_derivatives_do_not_commute_where_axes_are_several():
    ball = pc.tree([-1, 0], ["ball", "ball"], seed=2)
    assert not pc.check("∂_t ∂_i φ = ∂_i ∂_t φ", ball, states=1, search=False)


def test_mixed_derivatives_are_what_the_core_makes_of_them():
    chain = pc.chain(3)
    soa, vdot = chain.soa, pc.vector("vdot", chain.soa.Theta)
    proof = prove(derivative(derivative(soa.phi, 1), "t"), soa.phi.diff(1).dot(vdot=vdot))
    assert proof and set(proof.hypotheses) <= {CONSTANT, SINGLE}
    assert not prove(derivative(derivative(soa.phi, 1), "t"), soa.phi.diff(1))
    assert "∂_t" in str(prove(derivative(derivative(soa.phi, 1), "t"), derivative(derivative(soa.phi, "t"), 1)))
    state = chain.random_state(seed=1)
    h = 1e-6
    moved = [chain.integrate(state.q, s * h * state.v) for s in (1, -1)]
    differenced = (soa.phi.diff(1).at(moved[0]).dense() - soa.phi.diff(1).at(moved[1]).dense()) / (2 * h)
    exact = soa.phi.diff(1).dot(vdot=np.zeros(chain.nv)).at(state.q, state.v).dense()
    np.testing.assert_allclose(differenced, exact, atol=1e-8)  # h² times third derivatives, of order one, and eps / h
    for many in ([1, 2, "t"], ["t", 1, 2]):
        with pytest.raises(pc.EvaluationError, match="at most two coordinates, or along one and time|first and second derivatives"):
            prove(sum_of(soa.phi, many), soa.phi)


def sum_of(x, many):
    first, *rest = (derivative(x, i) for i in many)
    for other in rest:
        first = first + other
    return first
