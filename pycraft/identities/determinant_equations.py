"""Equations of determinants as equations of their logarithms: det ℳ = det D is read as ln|det ℳ| = ln|det D|.

Both sides are products and quotients of determinants, or 1. Signs are not compared.
"""

from __future__ import annotations

import re

_DET = re.compile(r"(?<![A-Za-z_])det(?![A-Za-z_])")


def as_logarithms(source: str) -> str:
    """Return the text with products of determinants as sums of logarithms; any other text unchanged."""
    if not _DET.search(source):
        return source
    sides = re.split(r"==?", source)
    found = [_logarithm(side) for side in sides]
    return " = ".join(f for f in found if f is not None) if len(sides) == 2 and None not in found else source


def _logarithm(side: str) -> str | None:
    """Return ln|side| for 1 and for products and quotients of determinants; None for anything else."""
    if side.strip() == "1":
        return "0"
    terms: list[str] = []
    first, *rest = _DET.split(side)
    if not rest:
        return None
    sign = "-" if re.fullmatch(r"\s*1\s*/\s*", first) else "" if not first.strip(" ·@") else None
    for operand in rest:
        divides = re.search(r"/\s*$", operand)
        operand = re.sub(r"[\s·@/]+$", "", operand)
        inner = _operand(operand)
        if sign is None or inner is None:
            return None
        terms.append(f"{sign or '+'} logdet({inner})")
        sign = "-" if divides else ""
    return " ".join(terms).removeprefix("+ ")


def _operand(text: str) -> str | None:
    """Return the operand of a determinant: a bracket, or factors up to the next determinant; None for a sum outside brackets."""
    depth = 0
    for i, c in enumerate(text):
        depth += (c in "([{") - (c in ")]}")
        if depth == 0 and c in "+-" and (i == 0 or text[i - 1] != "^"):
            return None
    return text.strip() or None
