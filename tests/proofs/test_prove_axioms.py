"""Foundations of proofs: axioms that hold numerically, lemmas proved from earlier ones, rules whose overlaps all resolve."""

import numpy as np
import pytest

from pycraft.proofs import Proof
from pycraft.proofs.axioms import AXIOMS, LEMMAS, SYMMETRIC, Theory, theory
from pycraft.proofs.equations import SYMMETRY, Equation, Step, foundations
from pycraft.proofs.normal_form import Setting, normal_form, overlaps, rules_for, weight
from pycraft.proofs.values import Values
from pycraft.proofs.words import Alphabet, add_to, parse, parse_equation
from support.random_identities import J0, ROUNDING, meeting, tree


def test_the_axioms_are_those_of_the_rulings():
    assert set(AXIOMS) == {
        "φ⁻¹ = I − E_φ", "ψ⁻¹ = I − E_ψ", "τ = G H", "τ̄ = I − τ", "E_ψ = E_φ τ̄", "K = E_φ G", "D = H P H* + J", "G D = P H*",
        "M = P − E_ψ P E_φ*", "M = R − E_φ R E_φ*", "Ω = ψ* H* D⁻¹ H ψ", "Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H",
    }  # fmt: skip
    assert SYMMETRIC == ("M", "P", "R", "D", "J")


@pytest.mark.parametrize("text", [text for text, _ in LEMMAS])
def test_every_lemma_is_proved_from_what_stands_above_it(text):
    lemma = theory()(text)
    proof = Proof.of_lemma(lemma, theory().alphabet)
    assert proof and not proof.hypotheses and proof.steps and proof.axioms
    assert lemma not in foundations(p for p in lemma.premises())
    order = [t for t, _ in LEMMAS]
    assert all(order.index(lemma.statement) < order.index(text) for lemma in proof.all_lemmas())
    for seed in (1, 2):
        assert proof.verify(meeting([], seed), seed) < ROUNDING


def test_a_lemma_that_cites_itself_or_a_later_one_is_refused(monkeypatch):
    for word, cited in (("φ E_φ", "φ E_φ = φ − I"), ("E_φ", "E_ψ = E_φ − K H")):
        fresh = Theory()
        fresh._lemmas = {**fresh._lemmas, "φ E_φ = φ − I": [(word, cited)]}
        with pytest.raises(AssertionError, match="is not an earlier lemma"):
            fresh("φ E_φ = φ − I")
    a = Equation("lemma", "a", parse("φ"), parse("ψ"))
    b = Equation("lemma", "b", parse("ψ"), parse("φ"), uses=[a])
    a.uses = [b]
    with pytest.raises(RecursionError, match="rests on itself"):
        foundations([a])


def test_a_lemma_whose_proof_does_not_close_is_refused():
    fresh = Theory()
    fresh._lemmas["φ K H ψ = φ + ψ"] = fresh._lemmas["φ K H ψ = φ − ψ"]
    fresh._order["φ K H ψ = φ + ψ"] = len(fresh._order)
    with pytest.raises(AssertionError, match="does not close"):
        fresh("φ K H ψ = φ + ψ")


def mutations(text):
    """The equation with a sign turned, a star dropped or set, a letter exchanged."""
    lhs, rhs = text.split(" = ")
    if "−" in rhs:
        yield f"{lhs} = {rhs.replace('−', '+', 1)}"
    if "+" in rhs:
        yield f"{lhs} = {rhs.replace('+', '−', 1)}"
    tokens = rhs.split(" ")
    for i, token in enumerate(tokens):
        exchanged = {"G": "K", "K": "G", "P": "R", "R": "P", "E_φ": "E_ψ", "E_ψ": "E_φ", "E_φ*": "E_ψ*", "E_ψ*": "E_φ*", "ψ": "φ"}
        if token in exchanged:
            yield f"{lhs} = {' '.join([*tokens[:i], exchanged[token], *tokens[i + 1 :]])}"


@pytest.mark.parametrize("text", AXIOMS)
def test_axioms_hold_in_numbers_and_mutated_ones_do_not(text):
    def residual(equation, seed):
        model = tree(seed)
        lhs, rhs = parse_equation(equation)
        return Values(Alphabet(), model.soa, model.random_state(seed), seed=seed).residual(Step(lhs, rhs, [], Alphabet()))

    assert max(residual(text, seed) for seed in (1, 2, 3)) < ROUNDING
    mutants = set(mutations(text)) - {text}
    if "M = " in text:  # both forms of the Riccati equation hold
        mutants -= {"M = P − E_φ P E_ψ*"}
    for mutant in mutants:
        if mutant in ("E_ψ = E_ψ τ̄",):
            continue
        assert max(residual(mutant, seed) for seed in (1, 2, 3)) > 1e-4, mutant
    assert mutants or text == "τ = G H"


def test_symmetries_hold_in_numbers():
    model = tree(2)
    for name in SYMMETRY:
        X = getattr(model.soa, {"Υ": "Upsilon"}.get(name, name)).dense()
        assert np.abs(X - X.T).max() < ROUNDING * np.abs(X).max()


SETTINGS = [Setting(frozenset(h), composite) for h in ((), (J0,)) for composite in (False, True)]


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_the_normal_form_does_not_depend_on_where_one_begins(setting):
    """All overlaps of rules resolve, so that they decide what follows from the axioms; all lower the order, so that they end."""
    rules, alphabet = rules_for(setting), theory().alphabet
    count = 0
    for first in rules.all():
        if first.word != ("S",):  # in favour of Υ, which no rule leads back
            assert all(weight(w) < weight(first.word) for w, _ in first.to), first
        for second in rules.all():
            for k in overlaps(first.word, second.word):
                p = {}
                for w, c in first.to:
                    add_to(p, w + second.word[k:], c)
                for w, c in second.to:
                    add_to(p, first.word[:-k] + w, -c)
                count += 1
                assert not normal_form(p, rules, alphabet), (first.word, second.word)
            n = len(second.word)
            for i in range(len(first.word) - n + 1) if first is not second else ():
                if first.word[i : i + n] == second.word:
                    p = dict(first.to)
                    for w, c in second.to:
                        add_to(p, first.word[:i] + w + first.word[i + n :], -c)
                    assert not normal_form(p, rules, alphabet), (first.word, second.word)
    assert count > 100
