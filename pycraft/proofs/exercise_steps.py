"""Steps of exercises: the equations that one step of a derivation may use, and steps from line to line by a single equation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from .axioms import AXIOMS, DEFINITIONS, INVERSES, find, replaced_everywhere, solved, theory
from .derivation import DerivativeProblem
from .equations import Equation, Step, foundations
from .normal_form import corollary
from .proof import Proof
from .words import Alphabet, Polynomial, Word, of_model, plain, split


def candidates(problem: DerivativeProblem, allowed: frozenset[str], steps: Sequence[Step]) -> Iterator[tuple[Equation, Word]]:
    """Return (equation, word) that one step may use: the derivation's equations, axioms, lemmas, and corollaries by the hypotheses."""
    facts = theory()
    known = [e.root for s in steps for e in s.premises()]
    known += [facts(text) for text in (*AXIOMS, *DEFINITIONS, *INVERSES)] + facts.lemmas
    zeros = [("J", "J = 0")] * ("J = 0" in allowed) + [("S", "S = 0")] * ("serial chain" in allowed)
    for equation in dict.fromkeys(known):
        for word, c in equation.difference.items():
            others = [w for w in equation.difference if w != word]
            if not word or abs(c) != 1 or any(find(w, word) >= 0 for w in others):
                continue
            yield equation, word
            for letter, zero in zeros if equation.kind in ("axiom", "lemma") else ():
                if any(letter in w for w in others) and letter not in word:
                    yield corollary(equation, word, letter, zero), word


def single_equation(p: Polynomial, q: Polynomial, candidates: Sequence[tuple[Equation, Word]], alphabet: Alphabet) -> str | None:
    """Return a single equation that, with its transpose, makes p and q equal; None if there is none."""
    words = {x for w in (*p, *q) for x in w}
    if p == q:
        return "collecting terms"
    for mark in ("", *sorted({_mark(x) for x in words} - {""})):
        for equation, word in candidates:
            e, w = equation.copied(mark), tuple(of_model(x, mark) for x in word) if mark else word
            star = alphabet.star_word(w)
            if not any(find(x, part) >= 0 for x in (*p, *q) for part in (w, star)):
                continue
            try:
                if _replaced(p, e, w, star, alphabet) == _replaced(q, e, w, star, alphabet):
                    return equation.text
            except (AssertionError, ValueError):  # the replacement does not end
                continue
    return None


def _mark(letter: str) -> str:
    """Return the mark of a letter's model, if it is not the first."""
    name = split(letter)[0]
    return name[len(plain(letter)) :]


def _replaced(p: Polynomial, equation: Equation, word: Word, star: Word, alphabet: Alphabet) -> Polynomial:
    starred = equation.transposed(alphabet)
    for _ in range(4):
        before = p
        for e, w in ((equation, word), (starred, star)):
            step = replaced_everywhere(p, *solved(e, w), alphabet)
            p = step.after if step is not None else p
        if p == before:
            break
    return p


def used(proof: Proof, hypothesis: str) -> dict[str, str]:
    """Return equations of a proof that hold only under this hypothesis, each with its general form."""
    found: dict[str, str] = {}
    for e in (e for step in proof.steps for e in step.equations):
        general = next((x for s in e.steps[:1] for x in s.equations), None)
        if e.kind == "lemma" and general is not None and any(x.hypothesis == hypothesis for x in foundations([e])):
            if not any(x.hypothesis for x in foundations([general])):
                found.setdefault(e.text, general.text)
    return found
