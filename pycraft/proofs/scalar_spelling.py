"""Scalar expressions written out as sums of words of numbers: ln|det| of products by their factors, traces by their words."""

from __future__ import annotations

import functools
from typing import Any

from .expand import Problem, Spelling, exact, square
from .presuppositions import Void
from .scalar_words import product_of, reciprocal_of, trace_of, trace_word
from .walk import GaveUp
from .words import NUMBER, ONE, Polynomial, combine, monomial, ratio


class ScalarSpelling(Spelling):
    """The step from a scalar expression as typed to words."""

    def holds(self) -> bool:
        return scalar_words(self.problem, self.expression) == self.before

    def reversed(self) -> ScalarSpelling:
        return ScalarSpelling(self.problem, self.expression, self.before, self.definitions, not self.backwards)


def expand(problem: Problem, e: Any) -> ScalarSpelling:
    """Return a scalar expression in words, with the step that states it. Raises GaveUp."""
    problem._used = []
    p = scalar_words(problem, e)
    return ScalarSpelling(problem, e, p, list(dict.fromkeys(problem._used)))


def scalar_words(problem: Problem, e: Any) -> Polynomial:
    """The words of a scalar expression."""
    value, operand, parts = e.number, e.operand, e.terms
    match e.kind:
        case "number":
            return {NUMBER: exact(value)} if value else {}
        case "sum":
            return combine(*((1, scalar_words(problem, part)) for part in parts))
        case "scaled":
            return {w: exact(value) * c for w, c in scalar_words(problem, parts[0]).items()}
        case "product":
            return functools.reduce(product_of, (scalar_words(problem, part) for part in parts))
        case "reciprocal":
            p = scalar_words(problem, parts[0])
            if not p:
                raise Void(f"1/({parts[0].text()}) is a reciprocal of zero")
            return reciprocal_of(p) or {("1/", f"⟨{problem.alphabet.text(p)}⟩"): ONE}
        case "trace":
            return trace_of(problem.words(operand), problem.alphabet, operand.codomain.name)
        case "logdet":
            return _log_determinant(problem, operand)
        case "norm":
            return {("norm", problem.operand(operand)): ONE}
    raise GaveUp


def _log_determinant(problem: Problem, e: Any) -> Polynomial:
    """Return ln|det| of products by their factors, of inverses and transposes by their operands."""
    match e.kind:
        case "identity":
            return {}
        case "transpose":
            return _log_determinant(problem, e.children[0])
        case "inverse":
            return combine((-1, _log_determinant(problem, e.children[0])))
        case "scaled" if e.coefficient:
            size = abs(exact(e.coefficient))
            space = trace_word((), problem.alphabet, e.codomain.name)[1]
            more = monomial("ln", str(size), space) if size != 1 else {}
            return combine((1, _log_determinant(problem, e.children[0])), (1, more))
        case "product" if all(map(square, e.children)):
            return combine(*((1, _log_determinant(problem, f)) for f in e.children))
        case "sqrt":
            return {w: ratio(c, 2) for w, c in _log_determinant(problem, e.children[0]).items()}
    name = problem.operand(e)
    problem.determinants.add(name)
    return {("ln det", name): ONE}
