"""Inverses as presuppositions: shown to exist, or said beside the proof; and no proof where they exist nowhere."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.proofs import exercise, prove
from pycraft.proofs.equations import Equation
from pycraft.proofs.presuppositions import is_positive_definite, is_triangular, presupposed
from pycraft.proofs.words import Alphabet, Letter, parse
from support.random_identities import J0, meeting, tree


@pytest.fixture(scope="module")
def arm():
    return tree()


def void(soa):
    """Statements that would follow from the inverse of something singular, or the root of something negative."""
    D, J, H, psi, G, E, phi, K, M, E_psi, phi_tilde, I = soa("D J H psi G E phi K M E_psi phi_tilde I")
    n = len(soa.Theta)
    thin = pc.constant(np.ones((n, 2)), pc.euclidean(2), soa.Theta, "U")
    singular = pc.constant(np.ones((n, n)), soa.Theta, soa.Theta, "C")
    root = (-1.0 * D).sqrt()
    return {
        "zero": ((D - D).inv(), J),
        "zero, written otherwise": ((phi - I - E @ phi).inv() @ M, 2 * M),
        "zero where J = 0": ((I - H @ psi @ G).inv(), D @ D),
        "nilpotent": (E.inv() @ E, I),
        "nilpotent, of the tree with gains": (E_psi.inv() @ E_psi @ phi, phi),
        "strictly triangular": (phi_tilde @ phi_tilde.inv() @ M, M),
        "of low rank": ((thin @ thin.T).inv() @ (thin @ thin.T), I),
        "a constant": (singular.inv() @ singular, I),
        "a difference of letters": ((phi - psi).inv() @ (phi - psi), I),
        "inside another inverse": ((D + (H @ E @ K - H @ E @ E @ G).inv()).inv(), J),
        "a root of what is negative": (root @ root.T, -1.0 * D),
    }


@pytest.mark.parametrize("name", void(tree().soa))
def test_nothing_is_proved_from_an_inverse_that_exists_nowhere(arm, name):
    lhs, rhs = void(arm.soa)[name]
    proof = prove(lhs, rhs)
    assert not proof and not proof.steps
    if name not in ("zero where J = 0", "inside another inverse"):
        assert "no inverse" in proof.note or "exists on no model" in proof.note


def test_what_is_regular_is_shown_to_be(arm):
    """Nothing is presupposed of sums of congruences, triangular operators, constants with regular numbers, proved inverses."""
    H, phi, psi, K, M, D, J, R, E, I = arm.soa("H phi psi K M D J R E I")
    n, MM = len(arm.soa.Theta), H @ phi @ M @ phi.T @ H.T
    C = pc.constant(np.diag(np.arange(1.0, n + 1)), arm.soa.Theta, arm.soa.Theta, "C")
    skew = pc.constant(np.eye(n) + np.triu(np.ones((n, n)), 1), arm.soa.Theta, arm.soa.Theta, "A")
    regular = [
        MM + J,
        MM + 0.1 * I,
        MM + J + C,
        D + H @ R @ H.T,
        I - 0.3 * E - 0.2 * E @ E,
        I + 2 * H @ phi @ K,
        3 * psi - I,
        C,
        skew,
        phi + psi,
    ]
    for X in [*regular, (MM + I).inv() + D, C.inv() + (MM + J).inv()]:
        proof = prove(X.inv() @ X, I)
        assert proof and proof.presupposes == [], X.text()
        assert proof.worst is None or proof.worst < 1e-9


@pytest.mark.parametrize("text", ["M M⁻¹ = I", "J J⁻¹ = I", "Υ⁻¹Υ = I", "inv(D - J) (D - J) = I", "inv(HR H*) HRH* = I"])
def test_what_is_not_shown_is_said(arm, text):
    proof = prove(text, arm)
    assert proof and len(proof.presupposes) == 1 and "presupposes " + proof.presupposes[0] in str(proof)


def test_a_letter_is_regular_by_others_only_where_these_are():
    needs = {"A": {"B"}, "B": {"C"}, "X": {"Y"}, "Y": {"X"}, "Z": set()}
    assert presupposed({"A"}, {"C"}, needs) == []
    assert presupposed({"A"}, set(), needs) == ["A", "B"]
    assert presupposed({"X"}, {"C"}, needs) == ["X", "Y"]  # a circle shows nothing
    assert presupposed({"Z", "W"}, set(), needs) == ["W"]


def test_definite_and_triangular_words():
    a = Alphabet()
    a.add(Letter("C", "C", "C", True))
    for text, definite in {
        "D": True, "M": False, "I": True, "H M H* + 2 D": True, "H M H* − 2 D": False, "H φ M φ* H* + J": True, "H φ M φ* H*": False,
        "M⁻¹ + φ* Υ φ": True, "φ* M⁻¹ φ + Υ": True, "H M⁻¹ H*": False, "K* φ* H*": False, "J + H R H*": False, "D J D": False, "C": False,
    }.items():  # fmt: skip
        assert is_positive_definite(parse(text), a) is definite, text
    assert is_positive_definite(parse("H φ M φ* H*"), a, ["J = 0"]) and is_positive_definite(parse("C"), a, [], ["C"])
    for text, triangular in {
        "I − E_φ": True, "2 I + H φ K": True, "I + K* φ* H*": True, "E_φ": False, "I + E_φ + E_φ*": False, "I + H φ G": False,
        "I + φ": True, "ψ − φ": False, "φ* + 2 ψ* φ*": True, "φ + ψ*": False, "φ P": False,
    }.items():  # fmt: skip
        assert is_triangular(parse(text), a) is triangular, text


@pytest.mark.parametrize(
    "answer", ["inv(D - D)", "D + inv(D - D)", "D inv(I - HψG) (I - HψG)", "HψPH* inv(E*) E*", "D sqrt(-D)⁻¹ sqrt(-D)"]
)
def test_no_answer_rests_on_an_inverse_that_exists_nowhere(answer):
    """Not under the theorem's hypotheses: (I - HψG)⁻¹ exists where J is regular, and HψMψ*H* = D is said where J = 0."""
    judgement = exercise("HψMψ*H* == D", blank=2).answer(answer)
    assert not judgement and judgement.verdict in ("wrong", "unreadable")
    assert judgement.verdict == "unreadable" or "exists on no model that was tried where J = 0" in judgement.text


def test_an_answer_may_presuppose_what_exists_and_says_so():
    judgement = exercise("HψMψ*H* == D", blank=2).answer("HψPH* + HPψ*H* - D M⁻¹M".replace("D M⁻¹M", "H M M⁻¹ P H*"))
    assert judgement and "it presupposes M⁻¹" in judgement.text


def test_the_number_of_coordinates_is_no_number_of_one_model(arm):
    for model in (None, arm):
        with pytest.raises(pc.EvaluationError, match="differs between models"):
            prove("N*D == 7*D", model)


def test_false_statements_with_vectors_are_refuted_at_once(arm):
    soa = arm.soa
    T, f = pc.vector("T", soa.Theta), pc.vector("f", soa.F)
    report = pc.check((soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T @ T, soa.D @ T), arm)
    assert not report and report.counterexample is not None and report.counterexample.bodies <= 2
    assert prove(soa.phi @ f, soa.psi @ f).search_counterexample().bodies == 2
    own = pc.vector("x", pc.euclidean(2))
    U = pc.constant(np.ones((len(soa.Theta), 2)), pc.euclidean(2), soa.Theta, "U")
    assert prove(U @ own, 2 * U @ own).search_counterexample() is None  # on its own model alone, and said at once


@pytest.mark.parametrize("depth", [4000])
def test_no_expression_is_too_deep(arm, depth):
    D, J = arm.soa("D J")
    flat, nested = D, D
    for k in range(depth):
        flat = (flat + (J if k % 3 else D)).T
        nested = D + nested.inv()
    assert prove(flat, flat.T)
    for e in (nested, power_by_hand(D, depth)):
        assert "too large" in prove(e, e).note


def power_by_hand(D, n):
    e = D
    for _ in range(n):
        e = e @ D
    return e


def test_a_proof_that_was_voided_says_under_which_hypotheses():
    """τ̄⁻¹ exists where J is regular, not where J = 0."""
    model = meeting([J0], 1)
    tau_bar, I = model.soa("tau_bar I")
    proof = prove(tau_bar.inv() @ tau_bar, I)
    assert proof and proof.presupposes == ["(τ̄)⁻¹"] and proof.hypotheses == []
    assert "where J = 0" in proof.void_where([J0]) and proof.void_where([]) == ""
    assert isinstance(proof.rests_on[0], Equation)
