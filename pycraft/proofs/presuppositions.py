"""Inverses as presuppositions: which inverses of a proof are shown to exist, and which exist on no model.

X⁻¹ may be used as XX⁻¹ = I = X⁻¹X; if X is singular, these are contradictory and prove anything. So a proof names every X whose
regularity it assumes. These are regular: φ, ψ and D (the hinges are); X with a proved inverse, XZ = ZX = I; c I + a strictly triangular
part; a sum of congruences A S A* with S ≥ 0, one of them definite; a constant, by its values. The others are presuppositions of the
statement: they are listed with the proof, and a proof whose presuppositions hold on no model that meets its hypotheses is
void and is not returned.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from .. import _core
from .blocks import moves
from .equations import Equation, foundations
from .models_tried import examples
from .values import LARGEST, SINGULAR, NoValue, Values, is_singular
from .walk import GaveUp
from .words import Alphabet, Polynomial, Word, inverted, parse, plain, split

ALWAYS = ("φ", "ψ", "X", "D")
"""Letters that have an inverse on every tree with regular hinges; X are changes of frames."""
SEMIDEFINITE = ("M", "P", "P⁺", "R", "J", "Υ", "Ω")
_MASS_MATRIX, _WITH_J = parse("H φ M φ* H*"), parse("H φ M φ* H* + J")


class Void(GaveUp):
    """The operand of an inverse is zero."""


# ---------------------------------------------------------------------- by structure
def is_triangular(p: Polynomial, alphabet: Alphabet) -> bool:
    """Return True for c I, c ≠ 0, plus a part that leads from every body only outboard, or only inboard: φ and ψ are of this form."""
    for star in ("", "*"):
        unit, along = "unit" + star, {"step" + star, "down" + star}
        ways = {word: {moves(x, alphabet) for x in word} for word in p}
        if all(w <= {unit} or w <= {*along, unit, "diagonal"} and w & along for w in ways.values()):
            return sum(c for word, c in p.items() if ways[word] <= {unit}) != 0
    return False


def is_positive_definite(p: Polynomial, alphabet: Alphabet, hypotheses: Iterable[str] = (), definite: Iterable[str] = ()) -> bool:
    """Return True for a sum of terms c A S A*, c > 0, S semidefinite, with one definite term, or with ℳ + J among them."""
    signs = {word: _sign(word, alphabet, frozenset(definite)) for word in p}
    if any(c <= 0 or not signs[word] for word, c in p.items()):
        return False
    whole = _MASS_MATRIX if "J = 0" in hypotheses else _WITH_J
    share = min((p.get(word, 0) for word in whole), default=0)
    return share > 0 or any(sign == "definite" for sign in signs.values())


def _sign(word: Word, alphabet: Alphabet, definite: frozenset[str]) -> str:
    """Return "definite", "semidefinite" or "". Definite operators are symmetric."""
    plainly = lambda w: tuple(x.replace("*", "¹" if inverted(x) else "") if split(x)[0] in definite else x for x in w)
    if plainly(word) != plainly(alphabet.star_word(word)):
        return ""
    half = len(word) // 2
    center = word[half : len(word) - half]
    if not center:
        kind = "definite"
    elif center[0] in ("D", "D⁻¹") or split(center[0])[0] in definite:
        kind = "definite"
    elif plain(center[0]) in SEMIDEFINITE:
        kind = "definite" if inverted(center[0]) else "semidefinite"
    else:
        return ""
    return kind if all(plain(x) in ALWAYS or inverted(x) for x in word[:half]) else "semidefinite"


def is_regular_constant(e: Any) -> bool:
    """Return True if a user's constant has an inverse, by its values."""
    return _numbers(e) and e.shape[0] == e.shape[1] and not is_singular(np.asarray(e.dense()))


def is_positive_constant(e: Any) -> bool:
    """Return True if a user's constant is symmetric and positive definite, by its values, with a margin for rounding."""
    if not _numbers(e) or not e.is_symmetric:
        return False
    values = np.linalg.eigvalsh(np.asarray(e.dense()))
    return bool(values.size) and bool(values[0] > SINGULAR * np.abs(values).max())


def _numbers(e: Any) -> bool:
    return isinstance(e, _core.Operator) and e.kind == "constant" and max(e.shape) <= LARGEST


# ---------------------------------------------------------------------- of a proof
def presupposed(used: Iterable[str], regular: Iterable[str], needs: dict[str, set[str]]) -> list[str]:
    """Return the letters whose inverse is used and that are not shown to be regular.

    `needs` names, for letters whose regularity depends on others, these others.
    """
    shown, needed = {*regular}, {*used}
    while more := {name for name, others in needs.items() if name not in shown and others <= shown}:
        shown |= more
    return sorted(needed.union(*(needs.get(name, set()) for name in needed)) - shown)


def inverses_used(equations: Iterable[Equation]) -> set[str]:
    """Return the letters whose inverses are used by the equations and all their premises."""
    return {split(word[0])[0] for e in foundations(equations) if e.kind == "inverse" for word in e.lhs} - {*ALWAYS}


def nowhere(inverses: Sequence[str], roots: Sequence[str], alphabet: Alphabet, hypotheses: Sequence[str], contexts: Any, own: Any) -> str:
    """Return the first of these letters that, as an inverse or a root, exists on none of the tried models that meet the hypotheses.

    Empty if each exists on some model, or has no value on any.
    """
    family = list(_family(alphabet, hypotheses, contexts, own)) if inverses or roots else []
    for name in (*inverses, *roots):
        found = [there for values in family if (there := _exists(name, values, name in inverses)) is not None]
        if found and not any(found):
            return name
    return ""


def _family(alphabet: Alphabet, hypotheses: Sequence[str], contexts: Any, own: Any) -> Iterator[Values]:
    """Yield letters at states of the given model, if it meets the hypotheses, and of trees that do."""
    if own is not None and len(own.F) <= LARGEST and all(own._source.traits.get(h, True) for h in hypotheses):
        mine = contexts and contexts[0][0] is own._source
        yield Values(alphabet, own, None if own._model is None else own._model.random_state(1), contexts if mine else ())
    for model in examples(hypotheses):
        yield Values(alphabet, model.soa, model.random_state(1))


def _exists(name: str, values: Values, inverted: bool) -> bool | None:
    e = values.alphabet.letters[name].expression
    try:
        value = values.letter(name) if e is None or e.sources else np.asarray(e.dense(rules=False))
        return not (inverted and is_singular(value))
    except NoValue:
        return None
    except ArithmeticError:
        return False
