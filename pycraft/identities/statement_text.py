"""Conversion of a statement to text, and the numbers in it that a check must distinguish."""

from __future__ import annotations

import re
from fractions import Fraction
from itertools import pairwise
from typing import Any

from .. import _core
from .judge import DECIDES
from .parse import Statement
from .vocabulary import decimal, is_number

TELLS = 1e-3
"""A bound below this fraction of the distance of two numbers distinguishes them, also in a small term of the sides."""


def statement_text(read: Statement) -> str:
    """Return the statement in Python's spelling, to be read on another model."""
    if read.reading != "expressions":
        return read.text
    return " == ".join(map(_side_text, (read.lhs, read.rhs)))


def _side_text(side: Any) -> str:
    """Return a side as text; doubles that are not equal to their decimals are written as ratios."""
    if is_number(side):
        return str(Fraction(side))
    in_python = isinstance(side, _core.Operator)

    def exactly(found: re.Match[str]) -> str:
        double = Fraction(float(found[0]))
        if double == Fraction(found[0]):
            return found[0]
        return f"Fraction({double.numerator}, {double.denominator})" if in_python else f"({double.numerator}/{double.denominator})"

    text = side.python() if in_python else side.text()
    return re.sub(r"(?<![\w.])\d+(\.\d+)?(e[+-]?\d+)?(?=[* ])", exactly, text)


def telling(*texts: str) -> float:
    """Return the largest bound that decides a statement with these texts: one that distinguishes its numbers from each other, from 0
    and from 1, the implied number of other terms. For a and b by |a - b| / max(1, a, b), because most terms have no number."""
    found = {Fraction(0), Fraction(1)}
    for text in texts:
        found |= {decimal(number) for number in re.findall(r"(?<![\w.])[0-9]+\.?[0-9]*(?:[eE][+-]?[0-9]+)?", text)}
    return min(DECIDES, TELLS * float(min((b - a) / max(Fraction(1), b) for a, b in pairwise(sorted(found)))))


def telling_of(read: Statement) -> float:
    """Return `telling` of a statement as typed and as read: 10**-40 is 1e-40."""
    return telling(statement_text(read), *(str(side) if is_number(side) else side.text() for side in (read.lhs, read.rhs)))
