"""The whole catalogue: how much of it is derived; velocities, world axes, locked hinges, traces and determinants; how proofs are shown."""

import pickle
import re

import numpy as np
import pytest

import pycraft as pc
from pycraft.proofs import mechanics, prove
from pycraft.proofs.axioms import theory
from pycraft.proofs.equations import Equation, Step, Use
from pycraft.proofs.relations import _axioms_are_carried, _one_block_less
from pycraft.proofs.scalar_steps import ScalarStep, TraceUse
from pycraft.proofs.scalar_words import trace_word
from pycraft.proofs.values import Values
from pycraft.proofs.words import Alphabet, parse_equation
from support.random_identities import J0, ROUNDING, meeting, tree

NOT_DERIVED = {
    "perturbed inertias, relative error in the ℳ norm",  # an inequality
    "two-filter form",
    "bodies grouped in pairs: the same mass matrix",
    "derivative of inverse dynamics",
    "quasi-derivatives do not commute",
    "C is the Christoffel matrix",
    "∂P_w and ∂P",
    "articulated inertia with a body for root",  # of two trees
    "compliance between two bodies knows no root",
    "ln det ℳ knows no root",
}
MODELS = [
    ([-1, 0, 1, 1], ["free", "universal", "ball", "pin"], True),
    ([-1, 0, 1, 1, 0], ["free", "ball", "pin", "slider", "pin"], True),
    ([-1, 0, 1, 2], ["free", "ball", "pin", "pin"], False),
    ([-1, 0, 1, 2], ["pin", "pin", "slider", "pin"], False),
]


def test_most_of_the_catalogue_is_derived_under_no_more_than_their_hypotheses():
    derived, waiting, worst = {}, set(), 0.0
    for parents, kinds, rotors in MODELS:
        for theorem in pc.tree(parents, kinds, seed=1, rotor_inertia=rotors).soa.theorems():
            waiting |= {theorem.name} if theorem.waiting else set()
            if theorem.waiting or derived.get(theorem.name):
                continue
            proof = prove(theorem.lhs, theorem.rhs)
            stated = {*theorem.hypotheses, *(["serial chain"] if theorem.on_one_path else [])}
            derived[theorem.name] = bool(proof) and set(proof.hypotheses) <= stated
            if derived[theorem.name]:
                assert proof.recheck()
                worst = max(worst, proof.worst or 0.0)
    assert {name for name, found in derived.items() if not found} <= NOT_DERIVED
    assert sum(derived.values()) >= 141 and waiting == {"modal blocks and their calculus"}
    assert worst < ROUNDING


# ---------------------------------------------------------------------- velocities
@pytest.mark.parametrize("text", [*mechanics.AXIOMS, *mechanics.DEFINITIONS, *(text for text, _ in mechanics.LEMMAS)])
def test_axioms_of_motion_hold_in_numbers(text):
    """On moving trees with hinges of several subhinges, free, ball and single ones; a turned sign is seen."""

    def residual(equation, seed):
        model = meeting([], seed)
        model.gravity = [1.0, -2.0, 3.0]
        state = model.random_state(seed)
        values = Values(Alphabet(), model.soa, state, seed=seed)
        return values.residual(Step(*parse_equation(equation), [], Alphabet()))

    assert max(residual(text, seed) for seed in (1, 2, 3)) < ROUNDING
    lhs, rhs = text.split(" = ")
    for i, token in enumerate(rhs.split(" ")):
        if token in ("−", "+"):
            turned = rhs.split(" ")
            turned[i] = "+" if token == "−" else "−"
            assert max(residual(f"{lhs} = {' '.join(turned)}", seed) for seed in (1, 2, 3)) > 1e-4, (text, turned)


MOTION = ["V̄ = -Ṽ*", "ṼV = 0", "𝓑V = V̄MV", "𝓑 = -𝓑*", "γ = -φ*a₀", "V = φ*H*θ̇", "V*V̄MV = 0", "φ*Δ_θ̇*φ̃* = φ*Ṽ - Ṽφ*", "𝓑V = b"]


@pytest.mark.parametrize("text", MOTION)
def test_velocities_are_derived(text):
    proof = prove(text)
    assert proof and not proof.hypotheses and proof.worst < ROUNDING


@pytest.mark.parametrize("text", ["V̄ = Ṽ*", "𝓑 = 𝓑*", "γ = φ*a₀", "𝓑V = -V̄MV", "φ*Δ_θ̇*φ̃* = Ṽφ* - φ*Ṽ", "𝓑 = V̄M"])
def test_false_statements_of_velocities_are_not(text):
    assert not prove(text)


def test_world_axes_and_locked_hinges_follow_their_model():
    assert _axioms_are_carried()
    model = pc.tree([-1, 0, 1, 1, 0], ["free", "ball", "pin", "slider", "pin"], seed=1)
    theorems = {t.name: t for t in model.soa.theorems()}
    proof = prove(theorems["P_w = XPX*"].lhs, theorems["P_w = XPX*"].rhs)
    assert proof and "P₂ = X P X*" in str(proof) or "P = X₂ P₂ X₂*" in str(proof)
    wrong = prove(theorems["P_w = XPX*"].lhs, 2 * theorems["P_w = XPX*"].rhs)
    assert not wrong
    theorem = theorems["generalized Jacobian"]
    assert prove(theorem.lhs, theorem.rhs) and not prove(theorem.lhs, -theorem.rhs)


def test_what_is_so_of_a_cut_tree():
    """One block of E less: what is behind it is the whole's, what is before it is not, and two blocks less are none."""
    model = pc.tree([-1, 0, 1, 1, 0, 4], ["free", "ball", "pin", "slider", "pin", "pin"], seed=1)
    soa, base = model.soa, pc._core.operators_of(model)
    cut = pc._core._derived_operators(base, ("cut", 4))
    E, phi, R, P, H = (cut.symbol(name) for name in ("E", "phi", "R", "P", "H"))
    X = soa.E - E
    assert np.linalg.matrix_rank(X.dense()) == 6 and prove(H, soa.H) and cut.derived_from == ("cut tree", base)
    for lhs, rhs in [
        (X @ R, X @ soa.R),
        (X @ P, X @ soa.P),
        (phi + phi @ X @ phi, soa.phi),
        (soa.H @ phi @ X @ phi, soa.H @ (soa.phi - phi)),
    ]:
        proof = prove(lhs, rhs)
        assert proof and proof.recheck() and not prove(lhs, 2 * rhs)
    assert not prove(R, soa.R) and not prove(P @ X.T, soa.R @ X.T) and not prove(phi + phi @ X, soa.phi)
    assert (
        _one_block_less([-1, 0, -1], [-1, 0, 1])
        and not _one_block_less([-1, -1, -1], [-1, 0, 1])
        and not _one_block_less([-1, 0, 0], [-1, 0, 1])
    )
    again = pickle.loads(pickle.dumps(X))
    assert np.array_equal(again.at(model.zero_q()).dense(), X.at(model.zero_q()).dense())


def test_constants_at_the_roots_see_no_ancestors():
    model = pc.tree([-1, 0, 0], ["pin", "ball", "pin"], seed=2)
    soa = model.soa
    for body, found in ((0, True), (1, False)):
        numbers = np.zeros((6, 18))
        numbers[:, 6 * body : 6 * body + 6] = np.eye(6)
        pick = pc.constant(numbers, soa.F, pc.euclidean(6), "pick")
        assert bool(prove(pick @ soa.M @ soa.phi.T, pick @ soa.M)) is found
        assert bool(prove(pick @ soa.R @ soa.psi.T @ soa.H.T, pick @ soa.R @ soa.H.T)) is found


# ---------------------------------------------------------------------- scalars
SCALARS = {
    "ln det(MM + J) = ln det D": [],
    "logdet(MM) = logdet(D)": [J0],
    "logdet(2 (MM + J)) = logdet(2*D)": [],
    "logdet(inv(MM + J)) = -logdet(D)": [],
    "logdet(I + HφK) = 0": [],
    "logdet(φ) = logdet(ψ)": [],
    "logdet(φMφ*) = logdet(M)": [],
    "logdet(D^½) = 0.5 logdet(D)": [],
    "tr(ΥM) = N": [J0],
    "tr(τ) = N": [J0],
    "tr(HψG) = N": [J0],
    "tr(MM) = tr(HRH*)": [],
    "tr(φ) = tr(ψ)": [],
    "tr(ΩP) = tr(ΥP)": [],
    "tr(HφK) = 0": [],
    "2 tr(D) - tr(D) = tr(H*HP) + tr(J)": [],
    "norm(φ - I) = norm(Eφ)": [],
    "norm(2 φ*) = 2 norm(φ)": [],
    "norm(φ - I - Eφ) = 0": [],
    "tr(D) - logdet(MM + J) = tr(J) + tr(HPH*) - logdet(D)": [],
}


@pytest.mark.parametrize("text", SCALARS)
def test_traces_determinants_and_norms_are_derived(text):
    proof = prove(text)
    assert proof, proof
    assert proof.hypotheses == SCALARS[text] and proof.recheck() and not proof.presupposes
    assert proof.worst is not None and proof.worst < ROUNDING
    assert proof.verify(meeting(SCALARS[text], 4), 2) < ROUNDING


@pytest.mark.parametrize(
    "text",
    [
        "logdet(2*D) = logdet(D)",
        "logdet(MM + J) = 2 logdet(D)",
        "logdet(D) = 0",
        "logdet(MM + J) = logdet(D) + 1",
        "tr(ΥP) = tr(ΥM)",
        "tr(D) = tr(J)",
        "tr(ΥM) = 2 N",
        "tr(MM) = tr(HPH*)",
        "tr(ψM) = tr(φP)",
        "norm(φ) = norm(ψ)",
        "norm(2 φ) = norm(φ)",
        "tr(P H* H) = tr(R H* H)",
        "tr(Ω R) = tr(Ω M)",
        "tr(φ) = 0",
    ],
)
def test_false_statements_of_numbers_are_not_derived(text):
    proof = prove(text)
    assert not proof and "no proof found" in str(proof)


def test_a_step_between_numbers_is_what_its_equations_add_up_to():
    a = Alphabet()
    e = theory()("G D = P H*")
    before, after = {trace_word(("H", "P", "H*"), a, "Θ"): 2}, {trace_word(("H", "G", "D"), a, "Θ"): 2}
    use = TraceUse(-2, ("H",), e, (), (), False, "Θ")
    assert ScalarStep(before, after, [use], a).holds() and ScalarStep(before, after, [use], a).reversed().holds()
    for wrong in (TraceUse(2, ("H",), e, (), (), False, "Θ"), TraceUse(-2, ("H", "D"), e, (), (), False, "Θ"), Use(-2, ("H",), e, ())):
        assert not ScalarStep(before, after, [wrong], a).holds()
    assert trace_word(("D", "J"), a, "Θ") == trace_word(("J", "D"), a, "Θ")
    assert trace_word(("φ", "M"), a, "F") == trace_word(("φ*", "M"), a, "F")
    assert trace_word((), a, "V") == trace_word((), a, "F") != trace_word((), a, "Θ")


# ---------------------------------------------------------------------- how proofs read
CITED = [
    "φKHψ = φ - ψ",
    "HG = I",
    "blockdiag(Ω) = Υ",
    "[I+HφK]⁻¹ = I - HψK",
    "MM⁻¹ = [I-HψK]*D⁻¹[I-HψK]",
    "ψMψ* = P + ψ̃P + Pψ̃*",
    "E_φφ = φ - I",
]


@pytest.mark.parametrize("text", CITED)
def test_no_step_cites_what_is_proved(text):
    proof = prove(text)
    assert proof and proof.recheck()
    lhs, rhs = (s.before for s in proof._spellings)
    claim = {w: c for w, c in Equation("", "", lhs, rhs).difference.items()}
    for step in proof.steps:
        for equation in step.equations:
            opposite = {w: -c for w, c in equation.difference.items()}
            assert equation.kind in ("axiom", "definition") or claim not in (equation.difference, opposite), (text, equation)
    for lemma in proof.all_lemmas():
        assert lemma.recheck()


def test_the_inverse_of_the_mass_matrix_reads_as_in_the_book():
    proof = prove("MM⁻¹ = [I-HψK]*D⁻¹[I-HψK]")
    assert [s.after_text() for s in proof.steps][1] == "[I + H φ K]⁻* D⁻¹ [I + H φ K]⁻¹"
    product, factor = proof.lemmas
    assert product.statement == "ℳ⁻¹ = [I + H φ K]⁻* D⁻¹ [I + H φ K]⁻¹" and factor.statement == "[I + H φ K]⁻¹ = I − H ψ K"
    assert any(x.statement == "ℳ = [I + H φ K] D [I + H φ K]*" for x in product.all_lemmas())


def test_a_proof_unfolds_down_to_its_axioms():
    proof = prove("MM⁻¹ = [I-HψK]*D⁻¹[I-HψK]")
    full = proof.full()
    text = str(full)
    assert len(full) > 3 * len(proof.steps) and len(full.lemmas) > 10
    numbers = {int(n): text.index(f"\n({n}) ") if n != "1" else 0 for n in re.findall(r"^\((\d+)\) ", text, re.M)}
    assert sorted(numbers) == list(range(1, len(full.lemmas) + 1))
    for cited in re.finditer(r"by \((\d+)\)", text):
        assert numbers[int(cited[1])] < cited.start()  # each lemma stands before what cites it
    page = full._repr_html_()
    assert page.count("<li>") == len(full) and "overflow-wrap" in page and "<script" not in page
    assert proof._repr_html_().count("<li>") == len(proof.steps)
    latex = full.latex()
    assert latex.count("\\begin{aligned}") == len(full.lemmas) + 1 and latex.count("{") == latex.count("}")
    text = str(full)
    for said in (", by (", "(transposed)", ", at 2 places"):  # LaTeX cited no lemma by its number
        assert latex.count(said) == text.count(said) > 0, said
    assert "$$" not in latex
    failed = prove("ψ = φ")
    assert "no proof found" in str(failed.full()) and "no proof found" in failed._repr_html_()


def test_what_is_shown_is_escaped():
    model = tree()
    vector = pc.vector("<b>x</b>", model.soa.F)
    page = prove(model.soa.phi @ vector, vector + model.soa.E @ model.soa.phi @ vector)._repr_html_()
    assert "<b>x" not in page and "&lt;b&gt;x" in page
