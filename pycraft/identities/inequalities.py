"""Inequalities in statements, of numbers and of symmetric operators by definiteness (ℳ > 0, P ≥ P⁺), in wider and wider scalars.

Of numbers the sign of the difference counts. Of operators the difference is eliminated, the largest diagonal entry first: A > 0 where all
pivots are above what rounding can make of A, A ≥ 0 where those that are not, and the block that is left, fall with epsilon; a pivot below
zero that stays refutes both.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

from .. import _core
from .extended_numbers import as_extended
from .judge import DECIDES, FAILS, HOLDS, SCATTER, UNDECIDED, BoundState, Judgement, Taken, judge, ladder
from .residual_bounds import EPSILON, Roundings
from .vocabulary import ParseError, is_number

SIGNS = {">": ">", "<": ">", "≥": "≥", "≤": "≥"}
"""The signs, each by the one that is said of the sides in its order, or in the other one."""
_DIGITS = 120


def related(text: str) -> tuple[str, list[tuple[str, int]]]:
    """(the sign, the sides and where they begin) of an inequality; ("=", the whole) of any other text.

    Raises
    ------
    ParseError
        There is more than one sign.
    """
    depth, found = 0, []
    for i, c in enumerate(text):
        depth += (c in "([{") - (c in ")]}")
        if depth == 0 and c in SIGNS and text[i - 1 : i] != "-":
            found.append(i)
    if not found:
        return "=", [(text, 0)]
    if len(found) > 1 or "=" in re.sub(r"\([^()]*\)", "", text):
        raise ParseError("an inequality has two sides and one sign: lhs > rhs, ≥, < or ≤")
    at = found[0]
    return text[at], [(text[:at], 0), (text[at + 1 :], at + 1)]


def check_comparable(lhs: Any, rhs: Any, sign: str) -> None:
    """Raises ParseError where two sides have no order: operators that are no quadratic forms."""
    for side in (lhs, rhs):
        if is_number(side) or isinstance(side, _core.Scalar):
            continue
        if not isinstance(side, _core.Operator):
            raise ParseError(f"{side.text()} is written and not worked out: {sign} is said of operators with values")
        if side.domain is not None and side.codomain != side.domain.dual:
            what = "is a vector" if side.domain.name == "R^1" else f"maps {side.domain.name} → {side.codomain.name}"
            raise ParseError(
                f"{side.text()} {what}: {sign} is said of numbers and, as definiteness, of symmetric operators X → X*, such as ℳ, M or Ω"
            )


@dataclass(frozen=True)
class _Margin:
    """The least pivot of a difference (the difference itself, of numbers), what rounding can make of it, the largest entry."""

    value: float
    bound: float
    scale: float


def judge_read(read: Any, at: BoundState, vectors: dict[str, np.ndarray] | None = None, **options: Any) -> Judgement:
    """`judge` of a statement as it was read: an equation, or an inequality."""
    if read.relation == "=":
        return judge(read.lhs, read.rhs, at, vectors, **options)
    return _judge_inequality(read, at, vectors, options.get("precisions"))


def _judge_inequality(
    read: Any, at: BoundState, vectors: dict[str, np.ndarray] | None, precisions: Iterable[str | int] | None
) -> Judgement:
    strict = SIGNS[read.relation] == ">"
    larger, smaller = (read.lhs, read.rhs) if read.relation in (">", "≥") else (read.rhs, read.lhs)
    values = {name: [float(x) for x in value] for name, value in (vectors or {}).items()}
    found, margins = Judgement(state=at.state), []
    refusal: Exception | None = None
    for precision in precisions or ladder():
        try:
            margin = _margin(larger, smaller, at, precision, values)
        except (_core.SingularOperatorError, _core.SingularHingeError) as error:
            refusal = error
            continue
        margins.append((precision, margin))
        scale = margin.scale or 1.0
        found.taken.append(Taken(precision, max(0.0, -margin.value / scale), margin.bound / scale))
        found.verdict = _decided(margins, strict)
        if found.verdict != UNDECIDED:
            break
    if not found.taken:
        assert refusal is not None
        raise refusal
    return found


def _decided(margins: list[tuple[str | int, _Margin]], strict: bool) -> str:
    precision, last = margins[-1]
    if last.value > last.bound:
        return HOLDS
    if len(margins) < 2:
        return UNDECIDED
    before, narrow = margins[-2]
    if last.value < -last.bound and last.value <= narrow.value / 2:
        return FAILS
    seen = max(abs(narrow.value) / EPSILON[before], narrow.scale)
    falls = abs(last.value) <= SCATTER * EPSILON[precision] * seen
    if abs(last.value) <= last.bound and falls and last.bound <= DECIDES * (last.scale or 1.0):
        return FAILS if strict else HOLDS  # it is zero
    return UNDECIDED


def _margin(larger: Any, smaller: Any, at: BoundState, precision: str | int, values: dict[str, list[float]]) -> _Margin:
    bound = Roundings(larger, smaller, at.sizes("double", values)).absolute(precision)
    if isinstance(larger, _core.Scalar):
        sides = [abs(float(at.bind(side, precision))) for side in (larger, smaller)]
        return _Margin(float(at.bind(larger - smaller, precision)), bound, max(sides))
    if larger.shape == (1, 1):
        more, less = at.bind(larger, precision), at.bind(smaller, precision)
        over, *sides = _core.residual(more, less, values, False, True)
        return _Margin(over - _core.residual(less, more, values, False, True)[0], bound, max(sides))
    if values:
        raise _core.EvaluationError("an inequality of operators has no vectors: write the numbers x*Ax")
    difference = larger - smaller
    dense = at.bind(difference, precision)
    if precision == "double":
        matrix = np.asarray(dense.dense(), float)
    else:
        matrix = np.asarray(dense.dense(dtype=object))
        matrix = as_extended(matrix) if precision == "extended" else matrix
    with mpmath.workdps(_DIGITS):
        scale = _largest(matrix)
        if _largest(matrix - matrix.T) > max(2 * bound, 1e-9 * scale):
            raise _core.EvaluationError(f"{difference.text()} is not symmetric: > and ≥ say of symmetric operators that they are definite")
        return _Margin(least_pivot(matrix, bound), bound, scale)


def least_pivot(matrix: Any, bound: float) -> float:
    """The least pivot of a symmetric matrix, the largest diagonal entry first; where all that is left is below the bound or negative, its
    least diagonal entry, or minus the largest entry beside the diagonal."""
    left, least = matrix.copy(), np.inf
    while len(left):
        diagonal = [float(x) for x in np.diag(left)]
        k = int(np.argmax(diagonal))
        if diagonal[k] <= bound:
            beside = _largest(left - np.diag(np.diag(left)))
            return min(least, *diagonal, -beside if beside > max(map(abs, diagonal)) else np.inf)
        least = min(least, diagonal[k])
        column = left[:, k]
        left = left - np.outer(column, column) / left[k, k]
        left = np.delete(np.delete(left, k, 0), k, 1)
    return float(least)


def _largest(array: Any) -> float:
    return max((abs(float(x)) for x in np.ravel(array)), default=0.0)
