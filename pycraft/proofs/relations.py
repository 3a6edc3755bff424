"""Trees derived from another: the same bodies with some hinges locked, cut at a hinge, and the same model in world axes.

With locked hinges, E_φ and M are the model's own, and so are all letters built only from these. Cut at a hinge, E_φ lacks one block, and M,
H and J are the model's own; a path crosses the cut at most once, and sweeps from the tips reach the body behind the cut before the cut. In
world axes every letter is the model's, transformed by X = blockdiag φ(0,k): E_φ' = XE_φX⁻¹, H' = HX⁻¹, M' = XMX*, J' = J. The letters
that the axioms determine from these transform alike, because the axioms keep their form.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Any, TypeGuard

import numpy as np

from .. import _core
from .axioms import AXIOMS, theory
from .blocks import diagonal_part
from .equations import Equation
from .normal_form import Setting, normal_form, rules_for
from .values import LARGEST
from .words import FURTHER, Polynomial, Word, add_to, monomial, of_model, parse, plain, split

_GIVEN = ("E_φ", "H", "M", "J")
"""Letters that define a tree; the axioms determine the others."""
_FORCES = dict.fromkeys(["E_φ", "φ", "φ̃", "E_ψ", "ψ", "ψ̃", "τ", "τ̄"], (("X",), ("X⁻¹",)))
_INERTIAS = dict.fromkeys(["M", "P", "P⁺", "R"], (("X",), ("X*",)))
_COMPLIANCES = dict.fromkeys(["Υ", "Ω", "S"], (("X⁻*",), ("X⁻¹",)))
_FRAMES: dict[str, tuple[Word, Word]] = {
    **_FORCES, **_INERTIAS, **_COMPLIANCES,
    **{"H": ((), ("X⁻¹",)), "G": (("X",), ()), "K": (("X",), ()), "D": ((), ()), "J": ((), ())},
}  # fmt: skip


def in_world(letter: str, mark: str, base: str) -> Equation | None:
    """Return a letter of the tree in world axes in its model's letters, P' = XPX*; None for a letter of another tree."""
    name = plain(letter)
    if name not in _FRAMES or split(letter)[0] != name + mark:
        return None
    own = name + split(letter)[1]
    word = tuple(of_model(x, base) for x in _carried((own,)))
    lhs, rhs = monomial(letter), monomial(*word)
    if own in _GIVEN:
        return Equation("definition", f"{letter} = {' '.join(word)}", lhs, rhs)
    note = "the axioms of the letters in world axes are the model's axioms between X and X⁻¹, or X*"
    return Equation("structure", f"{letter} = {' '.join(word)}", lhs, rhs, note=note, check=_axioms_are_carried)


def _carried(word: Word) -> Word:
    """Return a word in world axes in the model's letters."""
    done: list[str] = []
    for letter in word:
        name, mark = split(letter)
        left, right = _FRAMES[name]
        if mark in ("⁻¹", "⁻*"):
            left, right = (tuple(map(_inverse, reversed(x))) for x in (right, left))
        if mark in ("*", "⁻*"):
            left, right = (tuple(map(theory().alphabet.star, reversed(x))) for x in (right, left))
        for x in (*left, letter, *right):
            if done and done[-1] == _inverse(x):
                done.pop()
            else:
                done.append(x)
    return tuple(done)


def _inverse(letter: str) -> str:
    name, mark = split(letter)
    return name + {"": "⁻¹", "⁻¹": "", "*": "⁻*", "⁻*": "*"}[mark] if name == "X" else ""


@lru_cache(maxsize=1)
def _axioms_are_carried() -> bool:
    """Return True if every axiom, transformed to world axes, is the same axiom between X's."""
    alphabet = theory().alphabet
    rules = rules_for(Setting(composite=True, compliance=True))
    for text in AXIOMS:
        bare: Polynomial = {}
        ends = set()
        for word, c in theory()(text).difference.items():
            left, inner, right = _without_ends(_carried(word))
            ends |= {(left, right)} if word else set()  # X I X⁻¹ is I
            add_to(bare, inner, c)
        if len(ends) > 1 or normal_form(bare, rules, alphabet):
            return False
    return True


def _without_ends(word: Word) -> tuple[Word, Word, Word]:
    left = word[:1] if word[:1] in (("X",), ("X⁻*",)) else ()
    right = word[-1:] if word[-1:] in (("X⁻¹",), ("X*",)) else ()
    return left, word[len(left) : len(word) - len(right)], right


_CUT = [
    ("φ₂ E_φ φ₂ = φ + φ₂ E_φ₂ φ₂ − φ₂", "a path between the two parts crosses the cut exactly once: φ = φ₂ + φ₂(E_φ − E_φ₂)φ₂"),
    ("E_φ R₂ = E_φ R + E_φ₂ R₂ − E_φ₂ R", "R is summed from the tips: behind the cut it is the same, and E_φ − E_φ₂ is read only there"),
    ("E_φ P₂ = E_φ P + E_φ₂ P₂ − E_φ₂ P", "P is swept from the tips: behind the cut it is the same, and E_φ − E_φ₂ is read only there"),
]
"""Equations, with reasons, of a tree (₂) derived from another by removing one block of E_φ."""


def of_a_cut(problem: Any) -> Iterator[tuple[Equation, Word]]:
    """Yield rules for letters of a tree cut at a hinge, in its model's letters: (equation, the word that it replaces)."""
    for mark, how, base in problem.relations:
        if how != "cut tree":
            continue
        for x in ("H", "M", "J"):
            own, of_base = of_model(x, mark), of_model(x, base)
            yield Equation("definition", f"{own} = {of_base}", monomial(own), monomial(of_base)), (own,)
        cut, whole = (problem.contexts[["", *FURTHER].index(m)][0].parents for m in (mark, base))
        for text, note in _CUT:
            lhs, rhs = (_of_two(side, mark, base) for side in text.split(" = "))
            (word,) = lhs
            shown = f"{problem.alphabet.text(lhs)} = {problem.alphabet.text(rhs)}"
            yield Equation("structure", shown, lhs, rhs, note=note, check=functools.partial(_one_block_less, cut, whole)), word


def _of_two(text: str, mark: str, base: str) -> Polynomial:
    """Return a sum of words for two trees, where ₂ marks the letters of the cut tree."""
    found: Polynomial = {}
    sign = 1
    word: list[str] = []
    for x in [*text.split(), "+"]:
        if x in "+−":
            add_to(found, tuple(word), sign)
            sign, word = (1 if x == "+" else -1), []
        else:
            word.append(of_model(x[:-1], mark) if x.endswith("₂") else of_model(x, base))
    return found


def _one_block_less(cut: Sequence[int], whole: Sequence[int]) -> bool:
    """Return True if a tree equals the other except for at most one body, which has become a root."""
    other = [c for c, w in zip(cut, whole, strict=True) if c != w]
    return not other or other == [-1]


def at_the_roots(letter: str, e: Any, source: Any) -> Iterator[tuple[Equation, Word]]:
    """Yield rules for constants that are zero except at bodies on the base: (equation, word), c B φ* = c B for block diagonal B.

    A root has no parent: φ* leads from it only to itself.
    """
    space = e.domain
    if source is None or space not in (source.F, source.V) or max(e.shape) > LARGEST:
        return
    inner = [s for (_, s, _), parent in zip(space.blocks, source.parents, strict=True) if parent >= 0]
    X = np.asarray(e.dense())
    if not _is_zero(X, inner):
        return
    for B in ((), ("M",), ("P",), ("R",)) if space == source.F else ((),):
        for x in ("φ*", "ψ*") if bool(B) == (space == source.F) else ():
            word, rest = (letter, *B, x), (letter, *B)
            text = f"{e.text()} {' '.join((*B, x))} = {' '.join((e.text(), *B))}"
            note = f"{e.text()} is zero except at bodies on the base"
            empty = functools.partial(_is_zero, X, inner)
            yield Equation("structure", text, monomial(*word), monomial(*rest), note=note, check=empty), word


def _is_zero(X: np.ndarray, columns: Sequence[slice]) -> bool:
    return not any(X[:, s].any() for s in columns)


def compliance_facts(problem: Any, hypotheses: Iterable[str]) -> Iterator[tuple[Equation, Word]]:
    """Yield facts from the diagonal blocks of Ω: ΥG = H*D⁻¹ if J = 0, and B*ΩB = B*ΥB for nodes on one body."""
    letters = {x for p in problem.polynomials() for word in p for x in word}
    marks = [mark for mark in problem.marks if of_model("Υ", mark) in letters]
    for mark in marks if "J = 0" in hypotheses else ():
        lhs, rhs = (tuple(of_model(x, mark) for x in word) for word in (("Υ", "G"), ("H*", "D⁻¹")))
        note = "Υ = blockdiag(E_ψ*ΥE_ψ) + H*D⁻¹H, and blockdiag(X) B = blockdiag(X B) for B = PH*, with E_ψPH* = KJ = 0"
        uses = [theory()(text) for text in ("Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H", "E_ψ P H* = K J", "J = 0")]
        text = f"{' '.join(lhs)} = {' '.join(rhs)}"
        yield Equation("structure", text, monomial(*lhs), monomial(*rhs), uses=uses, note=note, check=_nothing_along_the_hinge), lhs
    for name, known in problem.alphabet.letters.items():
        e = known.expression
        if not _is_of_kind("symbol", e) or e.name != "B" or len(e.letter.arguments) != 2 or not marks:
            continue
        star, mark = problem.alphabet.star(name), marks[0]
        whole = (star, *(of_model(x, mark) for x in ("ψ*", "H*", "D⁻¹", "H", "ψ")), name)
        inner = (star, of_model("Υ", mark), name)
        text = f"{known.text}* Ω {known.text} = {known.text}* Υ {known.text}"
        lemma = theory()("ψ* H* D⁻¹ H ψ = ψ* Υ + Υ ψ − Υ + ψ* S ψ")
        note = "for a node on one body only that body's block of Ω counts, and Υ = blockdiag(Ω)"
        yield Equation("structure", text, monomial(*whole), monomial(*inner), uses=[lemma], note=note, check=_blocks_of_compliance), whole


def _is_of_kind(kind: str, e: Any) -> TypeGuard[_core.Operator]:
    return isinstance(e, _core.Operator) and e.kind == kind


def _nothing_along_the_hinge() -> bool:
    return not normal_form(parse("E_ψ P H*"), rules_for(Setting(frozenset({"J = 0"}))), theory().alphabet)


def _blocks_of_compliance() -> bool:
    return diagonal_part(parse("ψ* Υ + Υ ψ − Υ + ψ* S ψ"), theory().alphabet) == parse("Υ")


def crosses_with_axes(problem: Any) -> Iterator[tuple[Equation, Word]]:
    """h_i* crf(y) = −y* Δ_i, for a coordinate's axis h_i and a vector y: the cross product is antisymmetric, and Δ_i = crf(h_i)."""
    letters = list(problem.alphabet.letters.items())
    symbols = [(name, x.expression) for name, x in letters if _is_of_kind("symbol", x.expression)]
    for name, known in letters:
        e = known.expression
        if not _is_of_kind("function", e) or e.name != "crf":
            continue
        y = problem.words(e.children[0])
        for axis, h in symbols:
            for delta, d in symbols if h.name == "h" else ():
                if d.name != "Delta" or d.letter.arguments != h.letter.arguments:
                    continue
                a = problem.alphabet
                star, lhs = a.star_of(y), (a.star(axis), name)
                text = f"{a.word_text(lhs)} = −({a.text(star)}) {a.letter_text(delta)}"
                yield Equation("axiom", text, monomial(*lhs), {(*w, delta): -c for w, c in star.items()}), lhs
