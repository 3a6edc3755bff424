"""Inputs and results of `prove`: inverses of sums, diagonal parts, roots, vectors, states, large models; how proofs are shown."""

import functools
import operator

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.terminal_report import wrapped
from pycraft.proofs import Proof, derivative, prove, prove_derivative
from pycraft.proofs.blocks import diagonal_blocks
from pycraft.proofs.models_tried import example
from pycraft.proofs.values import NoValue, Values
from pycraft.proofs.words import Alphabet, parse
from support.formulas import blocks_only
from support.random_identities import CHAIN, CONSTANT, J0, ROUNDING, SINGLE, meeting, random_word, tree


@pytest.fixture(scope="module")
def arm():
    return tree()


# ---------------------------------------------------------------------- inverses, roots, numbers, states


def test_inverses_of_sums(arm):
    H, phi, psi, K, M, D, J, I = arm.soa("H phi psi K M D J I")
    MM = H @ phi @ M @ phi.T @ H.T
    n = len(arm.soa.Theta)
    U = pc.constant(np.random.default_rng(0).normal(size=(n, 2)), pc.euclidean(2), arm.soa.Theta, "U")
    C = pc.constant(np.array([[2.0, 0.3], [0.3, 1.0]]), pc.euclidean(2), pc.euclidean(2), "C")
    B = MM + J
    shifted = (MM + 0.1 * I).inv()
    proof = prove(shifted @ MM, I - 0.1 * shifted)
    assert proof and proof.presupposes == [] and proof.hypotheses == []
    woodbury = B.inv() - B.inv() @ U @ (C.inv() + U.T @ B.inv() @ U).inv() @ U.T @ B.inv()
    proof = prove((B + U @ C @ U.T).inv(), woodbury)
    assert proof and proof.presupposes == [] and proof.worst < 1e-9
    assert not prove((B + U @ C @ U.T).inv(), B.inv() - B.inv() @ U @ (C + U.T @ B.inv() @ U).inv() @ U.T @ B.inv())
    A, S = I + H @ phi @ K, I - H @ psi @ K
    for lhs, rhs in (
        ((A @ D @ A.T).inv(), B.inv()),
        ((2 * B).inv(), 0.5 * S.T @ D.inv() @ S),
        (B.inv().inv(), B),
        (B.T.inv(), B.inv()),
        ((phi @ M @ phi.T).inv(), (I - arm.soa.E).T @ M.inv() @ (I - arm.soa.E)),
        ((S.T @ D.inv() @ S).inv(), B),
        ((I - arm.soa.E + K @ H).inv(), psi),
        ((D - J + J).inv(), D.inv()),
        (A.T.inv() @ D.inv() @ A.inv() @ H @ phi, B.inv() @ H @ phi),
        (shifted - shifted.T, 0 * B),
        ((MM + 0.1 * I).inv() @ B, B @ (MM + 0.1 * I).inv() + shifted @ (J @ MM - MM @ J) @ shifted),
    ):
        assert prove(lhs, rhs), prove(lhs, rhs)


def test_the_inverse_is_shown_from_both_sides(arm):
    proof = prove("(MM + J)⁻¹ = [I-HψK]*D⁻¹[I-HψK]", arm)
    product, lemma = proof.lemmas
    assert "whose factors have inverses" in str(product)
    assert "both products are I between equal spaces" in str(lemma)
    halves = [x.statement for x in lemma.all_lemmas() if " Z = I" in x.statement or x.statement.startswith("Z ")]
    assert len(halves) == 2 and not proof.presupposes


def test_what_cannot_be_inverted_proves_nothing(arm):
    """τ̄ has no inverse where J = 0, E_φ never: what would follow from one is not said."""
    tau_bar, E, phi, H = arm.soa("tau_bar E phi H")
    assert not prove(tau_bar.inv(), 2 * tau_bar.inv())
    assert not prove(E.inv() @ phi, phi)
    assert not prove(H @ tau_bar.inv(), H)


def test_diagonal_parts_and_roots(arm):
    for text in (
        "blockdiag(ΩM) = ΥM", "blockdiag(φ) = I", "blockdiag(φ̃R) = 0", "blockdiag(E D_x E*) = E D_x E*", "blockdiag(MM) = HRH*",
        "blockdiag(ψRφ*) = blockdiag(φRψ*)*", "sqrt(M) sqrt(M)* = R - ERE*", "sqrt(P)⁻¹ P = sqrt(P)*", "blockdiag(φMφ* + KDK*) = R + KDK*",
    ):  # fmt: skip
        assert prove(text.replace("D_x", "P"), arm), text
    assert not prove("blockdiag(E*ΥE) = E*ΥE", arm) or prove("blockdiag(E*ΥE) = E*ΥE", arm).hypotheses == [CHAIN]
    assert not prove("blockdiag(φMφ*) = φMφ*", arm)


@pytest.mark.parametrize("model", [tree(3), meeting([CHAIN], 2)], ids=["tree", "chain"])
def test_diagonal_parts_of_words_are_those_of_numbers(model):
    """Diagonal blocks of a word as implied by its letters, against NumPy."""
    model.q = model.random_state(1).q
    alphabet, spaces = Alphabet(), {"F": model.soa.F, "V": model.soa.V, "Θ": model.soa.Theta}
    values, known = Values(alphabet, model.soa), 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        ends = [("F", "F"), ("F", "V"), ("V", "F"), ("Θ", "Θ"), ("V", "V"), ("F", "Θ"), ("Θ", "F")][rng.integers(7)]
        word = random_word(rng, *ends, rng.integers(1, 6))
        whole = functools.reduce(operator.matmul, map(values.letter, word))
        found = diagonal_blocks(word, alphabet, model.soa._source.traits["serial chain"])
        known += not any(alphabet.letters[x.rstrip("*⁻¹")].word for w in found for x in w)
        got = sum(float(c) * functools.reduce(operator.matmul, map(values.letter, w)) for w, c in found.items() if w)
        got = got + float(found.get((), 0)) * np.eye(*whole.shape)
        want = blocks_only(whole, spaces[ends[0]].blocks, spaces[ends[1]].blocks)
        assert np.abs(got - want).max() < 1e-9 * max(1.0, np.abs(whole).max()), word
    assert known > 100


def test_vectors_and_numbers(arm):
    soa = arm.soa
    H, phi, M, D, J, I, theta_dot = soa("H phi M D J I theta_dot")
    MM, T = H @ phi @ M @ phi.T @ H.T, pc.vector("T", soa.Theta)
    assert prove(T.T @ MM @ theta_dot, theta_dot.T @ MM @ T) and prove("V = φ*H*θ̇", arm)
    assert not prove(T.T @ MM @ theta_dot, theta_dot.T @ D @ T)
    clash = pc.vector("φ", soa.F)  # a user's own name is a letter of its own
    assert prove(phi @ clash, clash + soa.E @ phi @ clash) and not prove(clash @ T.T @ H, phi @ clash @ T.T @ H)
    A, S = I + H @ phi @ soa.K, I - H @ soa.psi @ soa.K
    xi = A.T @ theta_dot
    assert prove(soa.velocity.T @ M @ soa.velocity + theta_dot.T @ J @ theta_dot, xi.T @ D @ xi)
    assert prove(T.T @ (MM + J).inv() @ T, (S @ T).T @ D.inv() @ S @ T)


def test_nodes(arm):
    soa = arm.soa
    B, Jacobian, Lambda = soa.B(["body2", "body3"]), soa.Jacobian(["body2", "body3"]), soa.Lambda(["body2", "body3"])
    H, phi, M, J = soa("H phi M J")
    MM = H @ phi @ M @ phi.T @ H.T
    proof = prove(Jacobian @ (MM + J).inv() @ Jacobian.T, B.T @ soa.Omega @ B)
    assert proof and "𝒥 = B* φ* H*" in str(proof)
    assert prove(Lambda, (Jacobian @ (MM + J).inv() @ Jacobian.T).inv()) and prove(Lambda.inv(), B.T @ soa.Omega @ B)
    assert not prove(B.T @ soa.Omega @ B, B.T @ soa.Upsilon @ B)


def test_states_are_kept_apart(arm):
    phi, E, I = arm.soa("phi E I")
    q, r = arm.random_state(1).q, arm.random_state(2).q
    assert prove(phi.at(q), (I - E).inv().at(q)) and prove(phi.at(q), phi.at(q))
    assert not prove(phi.at(q), phi.at(r)) and not prove(phi.at(q), phi)
    proof = prove((phi - I).at(q) @ phi.at(r), (E @ phi).at(q) @ phi.at(r))
    assert proof and proof.worst < ROUNDING


def test_models_of_matrices():
    soa = pc.sko_model([-1, 0], [None, np.eye(2)], [np.eye(1, 2)] * 2, [np.eye(2)] * 2)
    assert prove(soa.psi.inv(), soa.phi.inv() + soa.K @ soa.H).worst < ROUNDING


def test_a_large_model_costs_no_more(arm):
    """No number decides, and beyond some size none is computed without being asked."""
    chain = pc.chain(3000)
    proof = prove("HψMψ*H* == D", chain)
    assert proof and not proof.unmet and proof.worst < ROUNDING


# ---------------------------------------------------------------------- how it is shown and asked for


def test_a_proof_reads_well(arm):
    proof = prove("HψMψ*H* == D", tree(rotor_inertia=False))
    text = str(proof)
    residual = text.rsplit(" ", 1)[1]
    expected = f"""H ψ M ψ* H* = D
  proved where J = 0
      H ψ M ψ* H*
   1. = H ψ P H* + H P ψ* H* − H P H*   [ψ M ψ* = ψ P + P ψ* − P]
   2. = H ψ P H* + H P ψ* H* − D        [H P H* = D]
   3. = H ψ G D + D G* ψ* H* − D        [G D = P H*, at 2 places]
   4. = H G D + D G* H* − D             [ψ G = G, at 2 places]
   5. = D                               [H G = I, at 2 places]
{wrapped("  rests on " + "; ".join(proof.axioms))}
  largest residual of a step at a random state: {residual}"""
    assert text == expected
    first = proof.steps[0]
    assert first.before_text() == "H ψ M ψ* H*" and first.reason == "ψ M ψ* = ψ P + P ψ* − P" and first.kind == "lemma"
    assert first.positions == [("H ψ M ψ* H*", 1, "ψ M ψ*")] and repr(first).endswith("[ψ M ψ* = ψ P + P ψ* − P]")
    assert first.before_latex() == r"H \psi M \psi^* H^*" and first.after == parse("H ψ P H* + H P ψ* H* − H P H*")
    whole = str(proof.full())
    assert whole.index("τ̄ = I − G H\n") < whole.index("E_ψ = E_φ − K H\n") < whole.index("ψ M ψ* = ψ P + P ψ* − P, where J = 0\n")
    latex = proof._repr_latex_()
    assert latex.startswith("$$") and latex.count("{") == latex.count("}") and r"\begin{aligned}" in latex and "where J = 0" in latex
    assert len(proof.lemmas) == 4 and all(lemma for lemma in proof.lemmas) and "0" not in str(len(proof.lemmas[0].steps) == 0)
    assert repr(proof) == text
    failed = prove("ψ = φ", arm)
    assert str(failed) == "ψ = φ\n  no proof found\n  left side:  ψ\n  right side: φ\n  difference: ψ − φ"
    assert failed.normal_forms == ("ψ", "φ") and r"\psi \ne \phi" in failed._repr_latex_()


def test_ways_to_ask(arm):
    phi, E, I, M = arm.soa("phi E I M")
    assert prove("φ", "I + Eφ", arm) and prove("φ = I + Eφ", arm.soa) and prove("φ = I + Eφ") and prove("phi == I + E@phi", model=arm)
    assert prove(phi @ (I - E), I) and prove(I, phi @ (I - E)) and prove(phi - phi, 0) and prove(0, phi - phi)
    assert isinstance(prove(phi, phi), Proof) and prove(phi, phi).steps[0].reason == "collect terms"
    with pytest.raises(pc.SpaceError):
        prove(phi, M)
    with pytest.raises(pc.EvaluationError, match="two sides"):
        prove(phi)
    with pytest.raises(pc.EvaluationError, match="one side"):
        prove("φ", arm)
    with pytest.raises(pc.ModelError, match="no coordinate is called"):
        prove_derivative(phi, phi, "elbow")
    with pytest.raises(pc.EvaluationError, match="first and second derivatives"):
        prove(derivative(derivative(derivative(phi, 1), 1), 2), 0)
    with pytest.raises(pc.EvaluationError, match="at most two coordinates"):
        prove(derivative(phi, 1) + derivative(phi, 2), derivative(phi, 3))
    assert not prove(derivative(phi, 1), derivative(phi, 2))
    with pytest.raises(pc.SpaceError):
        prove(derivative(phi, 1), M)


def test_derivatives_are_shown(arm):
    phi, H = arm.soa("phi H")
    shown = 2 * derivative(phi, 1) @ phi - (H @ phi).T @ derivative(H @ phi, 1)
    assert shown.text() == "(2 ∂φ) φ − (H φ)* ∂(H φ)" and "partial" in shown.latex() and repr(shown).startswith("<")
    assert derivative(phi, arm.coordinate_names[1]) == derivative(phi, 1) != derivative(phi, 2)
    assert derivative(H, 1).T.domain == H.T.domain and (derivative(H, 1) / 2).codomain == H.codomain


def test_verify_names_what_a_model_does_not_meet(arm):
    proof = prove("HG = I", arm)
    assert proof.unmet == [J0] and proof.worst < ROUNDING  # evaluated on an example that meets it
    assert proof.verify(arm) > 1e-3 and proof.unmet == [J0]
    assert proof.verify(tree(rotor_inertia=False)) < ROUNDING and proof.unmet == []
    constant = pc.constant(np.eye(len(arm.soa.Theta)), arm.soa.Theta, arm.soa.Theta, "C")
    own = prove(constant @ arm.soa.H @ arm.soa.phi_tilde, constant @ arm.soa.H @ (arm.soa.phi - arm.soa.I))
    assert own and own.worst < ROUNDING
    with pytest.raises(NoValue, match="belongs to its own model"):
        own.verify(tree(3))


def test_examples_meet_what_they_are_asked_for():
    for hypotheses in ([], [J0], [CHAIN], [SINGLE, CONSTANT], [J0, CHAIN, CONSTANT]):
        traits = example(hypotheses).soa._source.traits
        assert all(traits[h] for h in hypotheses)
        assert not any(traits[h] for h in (J0, CHAIN) if h not in hypotheses)
