"""Assumptions and definitions in a proof, and statements about compliances, diagonal blocks, nodes and roots."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.proofs import derivative, prove, prove_derivative
from pycraft.proofs.relations import at_the_roots
from support.random_identities import CHAIN, CONSTANT, J0, ROUNDING, SINGLE, meeting, tree

# (text, what is assumed, the hypotheses of the proof, what it presupposes)
ASSUMED = [
    ("C : Θ → Θ; C = C*", ["C = C*"], ["C = C*"], 0),
    ("C : Θ → Θ; inv(MM + C)* = inv(MM + C)", ["C = C*"], ["C = C*"], 1),
    ("C : Θ → Θ; C D⁻¹ = D⁻¹ C", ["C D = D C"], ["C D = D C"], 0),
    ("C : Θ → Θ; C inv(C) = I", ["C > 0"], ["C > 0"], 0),
    ("C : Θ → Θ; inv(MM + J + C) (MM + J + C) = I", ["C > 0"], ["C > 0"], 0),
    ("C : Θ → Θ; inv(C + D)* = inv(C + D)", ["C > 0"], ["C > 0"], 0),
    ("X : V → Θ; K X = 0", ["G X = 0"], ["G X = 0"], 0),
    ("X : V → Θ; X = 0", ["G X = 0"], [J0, "G X = 0"], 0),
    ("X : V → Θ; τ̄ P H* D⁻¹ X = G X", ["J D⁻¹ X = X"], ["J D⁻¹ X = X"], 0),
    ("J inv(J) D = D", ["J > 0"], ["J > 0"], 0),
    ("HG = I", ["J = 0"], [J0], 0),
    ("HψG = I", ["HG = I"], ["HG = I"], 0),
    ("φ = I + Eφ", ["serial chain"], [], 0),
]


@pytest.mark.parametrize("text, assume, hypotheses, presupposed", ASSUMED)
def test_what_is_assumed_is_used_and_said(text, assume, hypotheses, presupposed):
    proof = prove(text, assume=assume)
    assert proof, proof
    assert proof.hypotheses == hypotheses and len(proof.presupposes) == presupposed and proof.recheck()
    assert all(h in str(proof) for h in hypotheses)
    if hypotheses and hypotheses != [J0]:
        bare = prove(text)
        assert not bare or bare.hypotheses == [J0] or bare.presupposes


@pytest.mark.parametrize(
    "text, assume, says",
    [
        ("φ = ψ", ["D = 0"], "the assumption D = 0 holds on no model"),
        ("φ = ψ", ["H = 0"], "holds on no model"),
        ("E_φ⁻¹ E_φ = I", ["E_φ > 0"], "(E_φ)⁻¹, which exists on no model"),
        ("C : Θ → Θ; C = C*", [], "no proof found"),
        ("C : Θ → Θ; C D = D C", ["C = C*"], "no proof found"),
        ("X : V → F; X = 0", ["H X = 0"], "no proof found"),
    ],
)
def test_what_cannot_be_or_does_not_help_proves_nothing(text, assume, says):
    proof = prove(text, assume=assume)
    assert not proof and says in str(proof)


def test_letters_of_ones_own():
    assert prove("x ∈ Θ; A := I + HφK; x*(MM + J)x = (A*x)* D A*x").worst < ROUNDING
    assert not prove("x ∈ Θ; A := I + HφK; x*(MM + J)x = (A x)* D A x")
    assert prove("A := I + HφK; B := A D A*; MM + J = B") and not prove("A := I + HψK; MM + J = A D A*")
    woodbury = "inv(B + U W U*) = inv(B) - inv(B) U inv(inv(W) + U* inv(B) U) U* inv(B)"
    proof = prove(f"U : R2 → Θ; W : R2 → R2; B := MM + J; {woodbury}")
    assert proof and len(proof.presupposes) == 3 and proof.worst < 1e-9
    assert not prove(f"U : R2 → Θ; W : R2 → R2; B := MM + J; {woodbury.replace('inv(inv(W)', 'inv(W')}")
    arm = tree()
    H, phi, K = arm.soa("H phi K")
    assert prove("MM + J == A D A*", arm, define={"A": pc.identity(arm.soa.Theta) + H @ phi @ K})
    assert prove("MM + J == A D A*", define={"A": "I + HφK"})
    assert prove("T*MM*T == 0 + T*MM T", define={"T": "Θ"}) or prove("T*ℳT = T*ℳ*T", define={"T": "Θ"})


def test_only_a_constant_of_bodies_on_the_base_does_not_see_the_tree():
    arm = pc.chain(2).soa
    for stands, steps in ((slice(0, 6), 6), (slice(None), 0)):
        numbers = np.zeros((2, 12))
        numbers[:, stands] = 1.0
        C = pc.constant(numbers, arm.F, pc.euclidean(2), "C")
        assert bool(prove(C @ arm.M @ arm.phi.T, C @ arm.M)) == bool(steps)
        assert len([*at_the_roots("C", C, arm._source)]) == steps


@pytest.mark.parametrize(
    "text, options, says",
    [
        ("A = I; φ = ψ", {}, "is no definition"),
        ("2a := φ; φ = φ", {}, "no name for a letter"),
        ("A := φ = ψ; A = A", {}, "is a statement"),
        ("φ = φ", {"assume": ["φ"]}, "assumption 'φ': write"),
        ("φ = φ", {"assume": "J"}, "assumption 'J': write"),
        ("A := H φ P; A A = A", {}, "cannot follow"),
        ("φ", {}, "one side"),
    ],
)
def test_what_does_not_read_is_said(text, options, says):
    with pytest.raises((pc.EvaluationError, pc.SpaceError), match=says):
        prove(text, **options)


STATEMENTS = {
    "ΥPH* = H*": [J0],
    "ΥG = H*D⁻¹": [J0],
    "blockdiag(inv(MM)) = D⁻¹ + K*ΥK": [J0, CHAIN],
    "blockdiag(inv(MM + J)) = D⁻¹ + K*ΥK": [CHAIN],
    "inv(Λ(body2)) = B(body2)*ΥB(body2)": [],
    "Λ(body2) = inv(B(body2)*ΥB(body2))": [],
    "sqrt(4*D) = 2*sqrt(D)": [],
    "sqrt(D) = 4 sqrt(D/16)": [],
    "blockdiag(ψ*ΥKHψ) = blockdiag(ψ* blockdiag(E*ΥK) Hψ) - blockdiag(ψ* H* blockdiag(K*ΥK) Hψ)": [],
}


@pytest.mark.parametrize("text", STATEMENTS)
def test_statements_of_blocks_nodes_and_roots(text):
    proof = prove(text)
    assert proof, proof
    assert proof.hypotheses == STATEMENTS[text] and proof.recheck()
    assert proof.worst is not None and proof.worst < ROUNDING
    if "Λ(" not in text:
        assert proof.verify(meeting(proof.hypotheses, 2), 1) < ROUNDING


@pytest.mark.parametrize(
    "text",
    [
        "ΥPH* = H",
        "ΥP = I",
        "ΥG = 2 H*D⁻¹",
        "blockdiag(inv(MM)) = D⁻¹ - K*ΥK",
        "blockdiag(inv(MM)) = D⁻¹",
        "inv(Λ(body2, body3)) = B(body2, body3)*ΥB(body2, body3)",
        "sqrt(2*D) = 2*sqrt(D)",
        "sqrt(4*D) = 4*sqrt(D)",
        "blockdiag(φ*ΥEφ) = φ* blockdiag(E*ΥE) φ",
    ],
)
def test_false_statements_of_blocks_nodes_and_roots(text):
    try:
        proof = prove(text)
    except pc.SpaceError:
        return
    except pc.EvaluationError as error:
        assert "does not read" in str(error)
        return
    assert not proof


def test_the_books_derivatives_are_typed_with_their_diagonal_blocks():
    """∂P = blockdiag(E(τ̄∂Pτ̄* + ΔP⁺ + P⁺Δ*)E*), ∂R likewise, and ∂V of a velocity."""
    model = meeting([CONSTANT, SINGLE], 4)
    i = 2
    E, tau_bar, P_plus, P, R, phi, H, V, phi_tilde, theta_dot = model.soa("E tau_bar P_plus P R phi H velocity phi_tilde theta_dot")
    Delta, dP, dR = model.soa.Delta(i), derivative(P, i), derivative(R, i)
    inside = tau_bar @ dP @ tau_bar.T + Delta @ P_plus
    proof = prove_derivative(P, (E @ (inside + P_plus @ Delta.T) @ E.T).blockdiag(), i)
    assert proof.worst < ROUNDING
    assert proof and proof.hypotheses == [CONSTANT] and "blockdiag(E_φ (τ̄ ∂P τ̄*" in proof.statement
    assert not prove_derivative(P, (E @ inside @ E.T).blockdiag(), i)
    assert prove_derivative(R, (E @ (dR + Delta @ R + R @ Delta.T) @ E.T).blockdiag(), i).hypotheses == []
    assert prove_derivative(V, phi.T @ Delta.T @ phi_tilde.T @ H.T @ theta_dot, i).worst < ROUNDING
    assert not prove_derivative(V, 2 * phi.T @ Delta.T @ phi_tilde.T @ H.T @ theta_dot, i)


@pytest.mark.parametrize("text", ["logdet(E) - logdet(E) = 0", "logdet(E E) = 2 logdet(E)", "logdet(φ - ψ) = logdet(ψ - φ)"])
def test_the_logarithm_of_a_determinant_presupposes_that_it_is_not_zero(text):
    proof = prove(text)
    assert not proof and "ln|det" in proof.note


# ---------------------------------------------------------------------- cases
@pytest.mark.parametrize(
    "text, assume",
    [
        ("HψMψ*H* + [I-HψK]J[I-HψK]* = D", "J > 0 or J = 0"),
        ("C : Θ → Θ; C J = J C", "C J⁻¹ = J⁻¹ C or J = 0"),
        ("HG = I - J D⁻¹", "J regular or J = 0"),
    ],
)
def test_cases_are_proved_one_by_one(text, assume):
    proof = prove(text, assume=[assume])
    assert proof and proof.recheck() and len(proof.cases) == 2 and all(proof.cases)
    assert proof.hypotheses == [assume] and assume in str(proof) and "Where" in proof._repr_html_()


@pytest.mark.parametrize(
    "text, assume, where",
    [
        ("HG = I", "J > 0 or J = 0", "J > 0"),  # true in the second case only
        ("HG = I", "J = 0 or J > 0", "J > 0"),
        ("J inv(J) D = D", "J > 0 or J = 0", "J = 0"),  # in which J⁻¹ does not exist
        ("φ = ψ", "serial chain or J = 0", "serial chain"),
    ],
)
def test_a_case_that_fails_is_named(text, assume, where):
    proof = prove(text, assume=assume)
    assert not proof and f"no proof found where {where}" in str(proof)


# ---------------------------------------------------------------------- numbers
@pytest.mark.parametrize(
    "text, hypotheses",
    [
        ("tr(D) tr(M) = tr(M) tr(D)", []),
        ("tr(ℳ) tr(ΥM) = tr(MΥ) tr(HφMφ*H*)", []),
        ("tr(P) ln det(ℳ+J) = tr(P) ln det D", []),
        ("tr(P)^2 ln det ℳ = tr(P) tr(P) ln det D", [J0]),
        ("ln det ℳ/tr(P) = ln det D/tr(P)", [J0]),
        ("norm(ψMψ*)/tr(D) - norm(P + ψ̃P + Pψ̃*)/tr(D) = 0", [J0]),
        ("(tr(D) + tr(M)) (tr(D) - tr(M)) = tr(D)^2 - tr(M)^2", []),
        ("1/(1/tr(D)) = tr(D)", []),
    ],
)
def test_products_and_quotients_of_numbers(text, hypotheses):
    proof = prove(text)
    assert proof and proof.hypotheses == hypotheses and proof.recheck() and (proof.worst or 0) < ROUNDING, proof
    assert pc.check(text, meeting(hypotheses, 1), states=2)


@pytest.mark.parametrize(
    "text", ["tr(D) tr(D) = tr(D D)", "tr(P)^2 = tr(P)", "1/tr(D) = tr(D⁻¹)", "tr(D)/tr(D) = 2", "1/(tr(D) - tr(D)) = 1/(tr(D) - tr(D))"]
)
def test_no_false_product_is_proved(text):
    proof = prove(text)
    assert not proof
    if "- tr(D)" in text:
        assert "reciprocal of zero" in str(proof)


# ---------------------------------------------------------------------- derivatives in text
@pytest.mark.parametrize(
    "text, hypotheses",
    [
        ("∂E = E Δ_i", []),
        ("∂ℳ = Hφ̃Δ_iφMφ*H* + Hφ M φ*Δ_i*φ̃*H*", [CONSTANT]),
        ("∂ℳ = Hφ[Δ_iφM + Mφ*Δ_i*]φ*H*", [SINGLE]),
        ("∂P = blockdiag(E_φ(τ̄ ∂P τ̄* + Δ_iP⁺ + P⁺Δ_i*)E_φ*)", [CONSTANT]),
        (r"\partial_i\psi = \psi\,\partial_i E_\psi\,\psi", []),
        ("∂(ℳ⁻¹) = -ℳ⁻¹ ∂ℳ ℳ⁻¹", []),
        ("∂_t φ = φ̃ Δ_θ̇ φ", []),
        ("d/dt ℳ = Hφ̃Δ_θ̇φMφ*H* + Hφ M φ*Δ_θ̇*φ̃*H* + Ḣφ M φ*H* + HφMφ*Ḣ*", []),
        ("d/dt(Dθ̇) = ∂_tD θ̇ + D θ̈", []),
        ("∂_j∂_i φ = φ̃Δ_jφ̃Δ_iφ + φ̃Δ_iφ̃Δ_jφ", []),
        ("∂_i∂_i φ = 2 φ̃Δ_iφ̃Δ_iφ + φ̃Δ_iΔ_iφ", []),
        ("∂_j∂_i(ℳ⁻¹) = ℳ⁻¹∂_iℳℳ⁻¹∂_jℳℳ⁻¹ + ℳ⁻¹∂_jℳℳ⁻¹∂_iℳℳ⁻¹ - ℳ⁻¹∂_j∂_iℳ ℳ⁻¹", []),
        pytest.param("∂_j∂_i D = H ∂_j∂_iP H*", [CONSTANT], marks=pytest.mark.slow),
    ],
)
def test_derivatives_are_typed(text, hypotheses):
    proof = prove(text)
    assert proof and proof.hypotheses == hypotheses and proof.recheck() and (proof.worst or 0) < ROUNDING, proof
    if len(text) < 60:
        assert pc.check(text, meeting(hypotheses, 1), states=1)


@pytest.mark.parametrize(
    "text",
    [
        "∂D = 0",
        "∂φ = φΔ_iφ",
        "∂_tH = 0",
        *(
            pytest.param(text, marks=pytest.mark.slow)
            for text in (
                "∂_tφ = φ̃Δ_iφ",
                "∂_j∂_iφ = φ̃Δ_jφ̃Δ_iφ",
                "∂_i∂_iφ = 2φ̃Δ_iφ̃Δ_iφ",
                "∂_jφ = ∂_iφ",
                "∂ℳ = Hφ̃Δ_iφMφ*H*",
            )
        ),
    ],
)
def test_no_false_derivative_is_proved(text):
    proof = prove(text)
    assert not proof or proof.hypotheses == [CONSTANT] and text == "∂_tH = 0"


@pytest.mark.parametrize(
    "text, says",
    [
        ("∂_t φ + ∂_iφ = ∂_jφ", "along one and time"),
        ("∂∂∂φ = φ", "first and second derivatives"),
        ("∂3 φ = φ", "not understood"),
    ],
)
def test_derivatives_that_are_not_read(text, says):
    with pytest.raises(pc.EvaluationError, match=says):
        prove(text)
