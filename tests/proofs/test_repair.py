"""`repair`: the nearest true formulas to a wrong one, in words; and the syntax tree that it changes."""

import re
import sys

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.budget import Budget
from pycraft.identities.edits import changed
from pycraft.identities.family import Spec
from pycraft.identities.formula import written_statement
from pycraft.identities.formula_reading import read_formula
from pycraft.identities.formula_values import DenseLetters, Misfit, evaluate, residual
from pycraft.identities.parse import Statements
from pycraft.proofs import prove
from pycraft.proofs.repair import Repair, nearest, small_models
from support.wrong_formulas import WRONG

module = sys.modules[Repair.__module__]  # by its name: the function is called as the module is


def letters(seed=5):
    spec = Spec((-1, 0, 1), ("pin", "ball", "slider"), False, seed)
    model = spec.model()
    state = spec.states(model, 1)[0]
    model.q, model.v = state.q, state.v
    return model, DenseLetters(model)


@pytest.fixture(scope="module")
def models():
    return small_models()


def explained(text, words, models):
    """The slip is among the five likeliest that lead to a formula true on small chains."""
    near, tried, whole = nearest(read_formula(text), models)
    assert whole
    assert any(words in slip.words for _, slip in near[:5]), (text, [slip.words for _, slip in near[:8]])
    assert tried >= 1 and all(residual(new, models[0]) < 1e-9 for new, _ in near)


@pytest.mark.parametrize(("text", "words"), WRONG[::4])
def test_some_wrong_formulas(text, words, models):
    explained(text, words, models)


@pytest.mark.slow
@pytest.mark.parametrize(("text", "words"), WRONG)
def test_wrong_formulas_of_the_field(text, words, models):
    explained(text, words, models)


def test_there_are_forty_of_them():
    assert len(WRONG) >= 40 and len({text for text, _ in WRONG}) == len(WRONG)


def test_the_true_one_is_the_nearest_and_proved():
    found = pc.repair("ψ⁻¹ = φ⁻¹ - KH")
    assert found[0].slip == "sign of K H" and found[0].where == [frozenset()] and found[0].proof and found.tried > 50
    assert "proved" in repr(found) and "<ol>" in found._repr_html_() and max(map(len, repr(found).splitlines())) <= 80
    book = pc.repair("D = HPH", most=1)
    assert book[0].where == [{"J = 0"}] and "true where J = 0; proved" in repr(book)


def test_what_is_nearly_true_is_false(models):
    """A thousandth is as far from true as a wrong letter."""
    for text, close in (("ψ⁻¹ = φ⁻¹ + KH", True), ("ψ⁻¹ = φ⁻¹ + 1.001KH", False), ("φ = φ + 1e-6 ψ", False)):
        assert module._is_close(read_formula(text), models) == close


def test_what_holds_on_the_first_model_alone_is_left_out(models):
    """The second has rotor inertia, where D is not HPH*."""
    rotors = module._letters(Spec((-1, 0, 1), ("screw", "pin", "pin"), True, 6))
    for others, found in (([models[1]], True), ([rotors], False)):
        near, _, _ = nearest(read_formula("D = HPH"), [models[0], *others])
        assert any("star missing on H" in slip.words for _, slip in near) == found


def test_few_hypotheses_come_first_and_no_more_than_are_asked_for(monkeypatch):
    """A slip that is a little likelier is no reason to suppose two hypotheses more."""
    needs = {"one": (1.0, {"J = 0", "serial chain"}), "two": (1.2, set()), "three": (1.3, {"J = 0"})}
    monkeypatch.setattr(module, "nearest", lambda *_: ([(name, None) for name in needs], 3, True))
    monkeypatch.setattr(module, "_is_close", lambda *_: False)
    monkeypatch.setattr(module, "_found", lambda name, *_: Repair(name, name, "", needs[name][0], [frozenset(needs[name][1])]))
    assert [r.statement for r in pc.repair("φ = ψ")] == ["two", "three", "one"]
    assert [r.statement for r in pc.repair("φ = ψ", most=1)] == ["two"]


def test_a_true_formula_needs_none():
    found = pc.repair("HψMψ*H* = D")
    assert not len(found) and "needs no repair: TRUE where J = 0" in repr(found)
    assert "needs no repair: TRUE on every tree" in repr(pc.repair("ψ⁻¹ = φ⁻¹ + KH"))


def test_the_budget_is_cpu_time_and_its_end_is_said(monkeypatch):
    found = pc.repair("ψ⁻¹ = φ⁻¹ - KH", budget=0)
    assert not len(found) and "not every change was tried" in found.ended and found.ended in found._repr_html_()
    assert "after 0 s of CPU time (budget=0)" in " ".join(repr(found).split())
    assert not pc.repair("D = HPH", most=1).ended
    monkeypatch.setattr(Budget, "left", 1e9)
    monkeypatch.setattr(Budget, "over", True)
    assert re.search(r": [1-9]\d* formulas that hold on small chains were not examined", pc.repair("D = HPH").ended)


def test_a_false_statement_is_not_searched_in_silence():
    arm = pc.chain(2)
    x = pc.vector("x", arm.soa.F)
    report = pc.check((arm.soa.phi @ x, arm.soa.psi @ x), arm, states=1, budget=0)
    assert not report and "ended after 0 s of CPU time (budget=0)" in " ".join(repr(report).split())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pycraft.identities.search.refutation", lambda *_, **__: pytest.fail("searched without a budget"))
        prove(arm.soa.phi @ x, arm.soa.psi @ x).search_counterexample(budget=0)


def test_what_is_no_statement_is_said():
    for text in ("HψMψ*H*", "D = ", "D = H?H", "D = (HP"):
        with pytest.raises(pc.EvaluationError):
            pc.repair(text)
    assert "no true formula one change away" in repr(pc.repair("φMψ = Ωφ"))


# ---------------------------------------------------------------------- the syntax tree


TEXTS = [
    "HψMψ*H* = D",
    "H@psi@M@psi.T@H.T == D",
    "inv(psi) == inv(phi) + K@H",
    "ln det ℳ = ln det D",
    "tr ΥM = N",
    r"\mathcal{M} = H\phi M\phi^*H^*",
    "ℳ⁻¹ = [I-HψK]* D⁻¹ [I-HψK]",
    "φMφ* = R + φ̃R + Rφ̃*",
    "-(E φ) = -φ + I",
    "blockdiag(Ω) = Υ",
    "τ² = τ",
    "2 D D = D D + D D",
    "sqrt(D) sqrt(D)* = D",
    "velocity = φ* H* theta_dot",
    "B(node1)* φ* H* = 𝒥(node1)",
    "D/4 + 3D/4 = D",
    "phi@M/5 + 4*phi@M/5 == phi@M",
    "φ - (φ - (ψ - φ)) = ψ - φ",
]


@pytest.mark.parametrize("text", TEXTS)
def test_a_formula_is_what_the_statement_is(text):
    """Read as a tree, written, read as a statement: the same values; and the dense value equals the expression's."""
    model, dense = letters()
    formula = read_formula(text)
    typed, again = Statements(model.soa).read(text), Statements(model.soa).read(written_statement(formula))
    assert read_formula(written_statement(formula)) == formula and read_formula(written_statement(formula, shown=True)) == formula
    for side, one, other in zip(formula, (typed.lhs, typed.rhs), (again.lhs, again.rhs), strict=True):
        value = evaluate(side, dense)
        values = [x if isinstance(x, float) else float(x) if isinstance(x, pc.Scalar) else x.dense() for x in (one, other)]
        np.testing.assert_allclose(values[0], values[1], rtol=1e-12, atol=1e-12)
        if value.domain != "any":
            np.testing.assert_allclose(value.array, values[0], rtol=1e-9, atol=1e-9)
    assert residual(formula, dense) < 1e-10


def test_no_change_makes_both_sides_the_same():
    """φ = ψ with a letter exchanged is φ = φ, which says nothing."""
    for text in ("φ = ψ", "G* = H"):
        assert all(left != right for (left, right), _ in changed(read_formula(text)))


def test_a_number_is_turned_upside_down_and_no_more():
    turned = [new for new, slip in changed(read_formula("2 φ = ψ")) if "number 2 upside down" in slip.words]
    assert turned == [read_formula("φ/2 = ψ")]


def test_one_slip_at_all_places_is_less_likely_than_at_one():
    found = {slip.words: slip.cost for _, slip in changed(read_formula("[I-HφK]* D⁻¹ [I-HφK] = ℳ⁻¹"))}
    everywhere = {words: cost for words, cost in found.items() if ", at all 2 places" in words}
    assert everywhere
    for words, cost in everywhere.items():
        assert cost > min((c for w, c in found.items() if w.startswith(words.removesuffix(", at all 2 places")) and w != words), default=0)


def test_inverses_that_exist_by_rounding_alone_are_none():
    _, dense = letters()
    for text in ("(E + 1e-14 I)⁻¹ = φ", "(HMH* - HMH*)⁻¹ = D"):
        with pytest.raises(Misfit):
            residual(read_formula(text), dense)


def test_spaces_that_do_not_fit_are_seen():
    """Where the tree says that spaces fit, the statement reads; where it says that they do not, it does not."""
    model, dense = letters()
    checked = 0
    for text in ("HψMψ*H* = D", "ψ⁻¹ = φ⁻¹ + KH"):
        for i, (formula, _) in enumerate(changed(read_formula(text))):
            if i % 23:
                continue
            try:
                residual(formula, dense)
                fits = True
            except Misfit:
                fits = False
            try:
                read = Statements(model.soa).read(written_statement(formula))
            except pc.Error:
                read = None
            if fits:
                assert read is not None, written_statement(formula)
            elif read is not None:  # fits, and an inverse does not exist
                with pytest.raises((ArithmeticError, pc.Error)):
                    [side.dense() for side in (read.lhs, read.rhs)]
            checked += 1
    assert checked > 40
