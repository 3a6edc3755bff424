"""Loops in proofs: rows by their ends, and compound bodies by their groups of bodies.

Embedded loops (₂) have the E and M of the groups. With θ̇ = X_r θ̇₂, X_r = [1; -Q_d⁻¹Q_r],

    H₂ = X_r* H,   J₂ = X_r* J X_r,   a₂ = a + H* Ẋ_r θ̇₂,   Q X_r = 0,   Q Ẋ_r = -Q̇ X_r

at states on the loops, the only states at which these letters have values. Rows of loops with two ends are Q = A B* φ* H*.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from .. import _core
from .equations import Equation
from .words import FURTHER, ONE, Polynomial, Word, of_model

Rule = tuple[Equation, Word]
"""An equation, and the word that it replaces."""


def of_rows(problem: Any) -> Iterator[Rule]:
    """Q, all rows of a model, by the motions of their ends."""
    for source, binding, word in _rows(problem):
        reach = _core._rows_by_ends(source)
        if reach is not None:
            yield _definition(problem, word, problem.words(_bound(reach, binding)))


def of_embedded(problem: Any) -> Iterator[Rule]:
    """Yield rules for letters of embedded loops, in letters of the groups."""
    for mark, how, base in problem.relations:
        if how != "embedded loops":
            continue
        source, binding = problem.contexts[["", *FURTHER].index(mark)]
        X, rate = (problem.letter(_bound(source.symbol(name), binding)) for name in ("X_r", "X_r_dot"))
        yield _definition(problem, (of_model("H", mark),), {(problem.alphabet.star(X), of_model("H", base)): ONE})
        yield _definition(problem, (of_model("J", mark),), {(problem.alphabet.star(X), of_model("J", base), X): ONE})
        more = (of_model("H*", base), rate, of_model("θ̇", mark))
        yield _definition(problem, (of_model("a", mark),), {(of_model("a", base),): ONE, more: ONE})
        for rows, at, (sums, Q) in _rows(problem):
            if rows.derived_from[1] is source.grouped.derived_from[1] and at is binding:
                moved = problem.letter(problem.alphabet.letters[Q].expression.dot())
                yield _definition(problem, (sums, Q, X), {})
                yield _definition(problem, (sums, Q, rate), {(sums, moved, X): -ONE})


def _rows(problem: Any) -> Iterator[tuple[Any, Any, Word]]:
    """Yield (source, binding, the word of all rows) for every Q in a statement."""
    letters = list(problem.alphabet.letters.items())
    for name, known in letters:
        e = known.expression
        if not isinstance(e, _core.Operator) or e.kind != "symbol" or e.name != "Q":
            continue
        source = e.letter.source
        sums = _core._whole_rows(source, "Q").children[0]
        found = next((n for n, x in letters if x.expression is not None and x.expression == sums), None)
        if found is not None:
            yield source, e.letter.binding, (found, name)


def _bound(e: Any, binding: Any) -> Any:
    return e if binding is None else e._bound(binding)


def _definition(problem: Any, word: Word, rhs: Polynomial) -> Rule:
    text = f"{problem.alphabet.word_text(word)} = {problem.alphabet.text(rhs)}"
    return Equation("definition", text, {word: ONE}, rhs), word
