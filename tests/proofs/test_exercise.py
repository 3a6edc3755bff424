"""Exercises: what is left out, and that answers are accepted by proof and by nothing else."""

import pytest

import pycraft as pc
from pycraft.proofs import Exercise, exercise, grading, prove
from pycraft.proofs.equations import chain_holds
from pycraft.proofs.models_tried import example

INNOVATIONS = "HψMψ*H* == D"
WITH_J = "innovations covariance with J"


@pytest.fixture(scope="module")
def innovations():
    return exercise(INNOVATIONS, blank=2)


# ---------------------------------------------------------------------- what is shown
def test_the_gap_is_shown_and_its_reason_is_not(innovations):
    text = str(innovations)
    assert text.splitlines()[0] == "H ψ M ψ* H* = D, where J = 0"
    assert "   2. = ?\n" in text and innovations.lines[2] == "?" and innovations.lines[-1] == "D"
    assert "[H P H* = D]" not in text and "H ψ P H* + H P ψ* H* − D" not in text
    assert innovations.solution() == "H ψ P H* + H P ψ* H* − D   [H P H* = D]"


def test_latex_has_a_box_for_the_gap(innovations):
    latex = innovations._repr_latex_()
    assert latex.count("\\boxed") == 1 and latex.startswith("$$") and latex.count("\\begin{aligned}") == latex.count("\\end{aligned}") == 1
    assert "\\psi M \\psi^*" in latex and "H P H^* = \\mathcal{D}" not in latex
    right_side = exercise("φ̃ is φ-I")
    latex = right_side._repr_latex_()
    assert right_side.statement == "φ̃ = ?" and latex.count("\\boxed") == 2 and "\\phi - I" not in latex


def test_hints_say_more_and_more(innovations):
    assert [innovations.hint(level) for level in (1, 2, 3, 4)] == [
        "use H P H* = D",
        "replace H P H*",
        "3 terms, beginning with H ψ P H*",
        innovations.solution(),
    ]
    assert innovations.hint() == innovations.hint(1)
    backwards = exercise("Ω decomposed with siblings", blank=2)
    assert backwards.hint().endswith("read backwards") and backwards.hint(2).endswith(" appear")


def test_the_gap_is_drawn_from_the_seed_or_given():
    drawn = {exercise(INNOVATIONS, seed=s).blank for s in range(12)}
    assert drawn == {1, 2, 3, 4} and exercise(INNOVATIONS, seed=3).blank == exercise(INNOVATIONS, seed=3).blank
    assert exercise(INNOVATIONS, blank=5).lines[-1] == "?"
    for blank in (0, 6, -1):
        with pytest.raises(pc.EvaluationError, match=f"no line {blank} to leave out: the derivation has lines 1 to 5"):
            exercise(INNOVATIONS, blank=blank)


@pytest.mark.parametrize("name", [t.name for t in example().soa.theorems()])
def test_every_proof_of_the_catalogue_is_an_exercise_whose_solution_is_right(name):
    """The line left out, typed as it is shown, is accepted: also where a lemma is opened to find a line."""
    try:
        task = exercise(name)
    except pc.EvaluationError as error:
        assert "no proof" in str(error) and name in str(error)
        return
    assert isinstance(task, Exercise) and task.lines.count("?") == 1
    assert chain_holds(task.steps, *(p.full()[i] for p, i in ((task.proof.steps[0], 0), (task.proof.steps[-1], 1))))
    line = task.solution().partition("   [")[0]
    unseen = ("S ", "∂", "Z", "⟨", "½", "_r", "e1", "h(", "crf", "vdot", "X ", "Δ", "₂", "₃")
    if any(letter in line for letter in unseen):  # not on the keyboard
        return
    judgement = task.answer(line)
    assert judgement and judgement.verdict == "right", (str(task), line, judgement)


# ---------------------------------------------------------------------- what is accepted
@pytest.mark.parametrize(
    "line",
    [
        "HψPH* + HPψ*H* - D",
        "= H ψ P H* + H P ψ* H* − D",
        "H@psi@P@H.T + H@P@psi.T@H.T - D",
        r"H\psi P H^* + H P \psi^* H^* - \mathcal{D}",
        "Hψ(PH*) - (D - HPψ*H*)",
    ],
)
def test_the_line_is_read_in_every_spelling(innovations, line):
    judgement = innovations.answer(line)
    assert judgement.verdict == "right" and judgement and str(judgement) == "right: by H P H* = D"
    assert judgement.proof and judgement.proof.recheck() and judgement.proof.hypotheses == ["J = 0"]


def test_expressions_of_any_model_are_answers(innovations):
    for model in (pc.chain(3), pc.tree([-1, 0, 0], ["ball", "pin", "slider"], seed=1)):
        H, psi, P, D = model.soa("H psi P D")
        assert innovations.answer(H @ psi @ P @ H.T + H @ P @ psi.T @ H.T - D).verdict == "right"
        assert exercise((H @ psi @ model.soa.M @ psi.T @ H.T, D), blank=2).answer("HψPH* + HPψ*H* - D").verdict == "right"
        assert exercise(INNOVATIONS, model, 2).answer(H @ psi @ P @ H.T + H @ P @ psi.T @ H.T - D).verdict == "right"


def test_another_line_between_the_same_neighbours_is_right(innovations):
    judgement = innovations.answer("HψGD + DG*ψ*H* - HPH*")
    assert judgement.verdict == "right" and "by G D = P H*; on to the next by H P H* = D" in judgement.text
    assert judgement.proof


@pytest.mark.parametrize("line", ["D - J", "HPH*", "HG(HψPH* + HPψ*H* - D)", "HψPH*(HG)* + HPψ*H* - D - 3J"])
def test_another_road_is_accepted_with_its_proof(innovations, line):
    judgement = innovations.answer(line)
    assert judgement and judgement.verdict == "another road" and judgement.proof.recheck()
    assert set(judgement.proof.hypotheses) <= set(innovations.proof.hypotheses)


def test_what_an_answer_presupposes_is_said(innovations):
    judgement = innovations.answer("HψPM⁻¹MH* + HPψ*H* - D")
    assert judgement and "it presupposes M⁻¹" in judgement.text


def test_a_hypothesis_of_the_theorem_may_be_used():
    task = exercise("Ω decomposed by Υ", blank=2)
    assert task.answer("ψ*Υ + Υψ - Υ").verdict == "right"
    assert task.answer("ψ*Υ + Υψ - Υ + ψ*(E_ψ*ΥE_ψ - blockdiag(E_ψ*ΥE_ψ))ψ").verdict == "another road"


def test_what_stands_on_the_page_is_no_step(innovations):
    for line, says in {"D": "line 5", "HψMψ*H*": "the left side", "2D - D": "line 5", "HψPH* + HPψ*H* - HPH*": "line 1"}.items():
        judgement = innovations.answer(line)
        assert not judgement and judgement.verdict == "no step" and says in judgement.text


def test_the_abbreviations_of_the_page_can_be_typed():
    task = exercise("Ω by the mass matrix", blank=4)
    assert "X₁" in task.solution() and task.answer("φ*H*X₁⁻¹Hφ").verdict == "right"


# ---------------------------------------------------------------------- what is not
@pytest.mark.parametrize(
    "line, says",
    [
        ("HψPH* + HPψ*H* + D", "the sign of D"),
        ("HψPH* - HPψ*H* - D", "the sign of H P ψ* H*"),
        ("HφPH* + HPψ*H* - D", "in H φ P H* φ should be ψ"),
        ("HψPH* + HPψ*H* - D⁻¹", "in D⁻¹ D⁻¹ should be D"),
        ("HψMH* + HPψ*H* - D", "in H ψ M H* M should be P"),
        ("HψPH* + HPψ*H*", "one term is missing"),
        ("HψPH* + HPψ*H* - 3D", "the coefficient of D should be −1"),
        ("HψPH* + HPψ*H* - D + HRH*", "H R H* should not be there"),
        ("I", "the line comes by H P H* = D"),
    ],
)
def test_slips_are_named_with_how_much_they_are_off(innovations, line, says):
    judgement = innovations.answer(line)
    assert not judgement and judgement.verdict == "wrong" and judgement.proof is None
    assert says in judgement.text and judgement.residual > 1e-4 and f"off by {judgement.residual:.1e}" in judgement.text


def test_HG_is_I_was_used_where_J_is_not_zero():
    """True without J, and every number of a model without J agrees: refused all the same, with what was missed."""
    task = exercise(WITH_J, blank=7)
    assert task.proof.hypotheses == [] and "H G = I − J D⁻¹" in task.hint()
    judgement = task.answer("D + D - D + 2J")
    assert not judgement and judgement.verdict == "wrong" and judgement.residual > 1e-3
    assert judgement.missed == ["J = 0", "H G = I"] and "true only where J = 0" in judgement.text
    assert "H G = I there, H G = I − J D⁻¹ in general" in judgement.text and "J ≠ 0" in judgement.text
    on_chain = exercise(WITH_J, pc.chain(3), 7)  # without J: nothing is off there
    assert on_chain.answer("D + D - D + 2J").verdict == "wrong"
    assert exercise(INNOVATIONS, blank=4).answer("D + 0I").verdict == "no step"


def test_the_siblings_are_missed_on_a_tree():
    judgement = exercise("Ω decomposed with siblings", blank=2).answer("ψ*Υ + Υψ - Υ")
    assert (
        judgement.verdict == "wrong"
        and judgement.missed[0] == "serial chain"
        and "siblings" in judgement.text
        and judgement.residual > 1e-3
    )
    assert judgement.proof and judgement.proof.hypotheses == ["serial chain"]


def test_what_is_false_on_deep_trees_alone_is_refuted():
    """The two terms cancel wherever no path has more than three bodies."""
    task = exercise("φK[I-HψK] = ψK")
    judgement = task.answer("φK + φE_ψφK - φEψK")
    assert pc.check("φK + φE_ψφK - φEψK == ψK", example().soa, search=False)
    assert judgement.verdict == "wrong" and "tree of 7" in judgement.text


def test_numbers_alone_are_never_enough():
    """On one body every line of this is numerically true: K = 0 there. The axioms must decide."""
    one = pc.chain(1)
    task = exercise("[I+HφK]⁻¹ = I - HψK", one, 1)
    judgement = task.answer("I - HφK")
    assert pc.check("I - HψK == I - HφK", one, search=False) and not prove("I - HψK == I - HφK", one)
    assert not judgement and judgement.verdict == "wrong" and "tree of 4" in judgement.text


def test_what_is_neither_proved_nor_refuted_is_not_accepted(innovations, monkeypatch):
    monkeypatch.setattr(grading, "prove", lambda *_: None)
    judgement = innovations.answer("HPH*")
    assert not judgement and judgement.verdict == "unproved" and judgement.residual is None and "not accepted" in judgement.text


@pytest.mark.parametrize(
    "line, says",
    [
        ("HψPH* + ", "does not read"),
        ("blah", "does not read"),
        ("", "does not read"),
        ("HψPH* + HPψH*", "does not read"),
        ("HψPH* == D", "is a statement"),
        ("3", "a line must be an operator"),
        (2.5, "a line must be an operator"),
        (None, "a line must be an operator"),
    ],
)
def test_what_cannot_be_read_is_said(innovations, line, says):
    judgement = innovations.answer(line)
    assert not judgement and judgement.verdict == "unreadable" and says in judgement.text


def test_a_line_between_other_spaces_is_wrong(innovations):
    judgement = innovations.answer("φ")
    assert judgement.verdict == "wrong" and judgement.text == "the lines of this derivation map Θ → Θ, and φ maps F → F"


@pytest.mark.parametrize(
    "theorem, says",
    [
        ("HψM = 0", "no proof to leave a line out of: H ψ M = 0"),
        ("det of the innovations factor is 1", "a statement between scalars"),
        ("Ω decomposed by Υ, blocks on one path", "blocks on one path"),
        ("modal blocks and their calculus", "features that do not exist yet"),
        ("mass matrix invers", "near it: 'mass matrix inverse'"),
        ("HψM", "no theorem is called"),
        ("HψM == == D", "does not read"),
    ],
)
def test_what_has_no_proof_is_a_clear_error(theorem, says):
    with pytest.raises(pc.EvaluationError) as raised:
        exercise(theorem)
    assert says in str(raised.value)
