"""Convert operator expressions to SymPy: one rule per kind of node."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy.matrices.expressions import Inverse

from .. import _core
from .sympy_operators import (
    BlockDiagonal,
    BlockFunction,
    OperatorLogDet,
    OperatorNorm,
    OperatorProduct,
    OperatorSum,
    OperatorTrace,
    OperatorUnit,
    OperatorZero,
    Root,
    Star,
    keep,
    symbol_of,
)

# A space and its dual have the same dimension: names by the space.
_DIMENSIONS = {"Θ": "N", "V": "n", "F": "n", "W": "n"}


def number(x: float | Fraction) -> sympy.Expr:
    """Return a Fraction, and a double equal to one with a denominator up to 1000, exactly; any other double as a Float of 53 bits."""
    value = Fraction(x)
    if isinstance(x, Fraction) or value.denominator <= 1000:
        return sympy.Rational(value.numerator, value.denominator)
    return sympy.Float(x, precision=53)


def dimension(space: _core.Space | None) -> sympy.Expr:
    """Return the symbol for a space's dimension; numbers stay numbers for a user's own R^n."""
    if space is None:
        return sympy.Symbol("d", integer=True, positive=True)
    name = space.name
    if name in _DIMENSIONS:
        return sympy.Symbol(_DIMENSIONS[name], integer=True, positive=True)
    if name.startswith("Nodes"):
        return sympy.Symbol("n" + name[len("NodesV") :], integer=True, positive=True)
    return sympy.Integer(space.dimension)


def operator(e: _core.Operator) -> Any:
    """Return the matrix expression of an operator expression."""
    return _of(e, dimension(e.domain))


def _of(e: _core.Operator, fits: sympy.Expr) -> Any:
    """Convert an expression; `fits`: the dimension of an I without a space here."""
    kind, children = e.kind, e.children
    if kind in ("symbol", "vector", "constant", "external"):
        name = e.name if kind == "vector" else e.text() if kind in ("constant", "external") else _ascii(e)
        return symbol_of(e, name, dimension(e.codomain), dimension(e.domain))
    if kind == "identity":
        return OperatorUnit(fits) if e.domain is None else OperatorUnit(dimension(e.domain), keep(e))
    if kind == "zero":
        return OperatorZero(dimension(e.codomain), dimension(e.domain), keep(e))
    if kind == "sum":
        return OperatorSum(*(_of(c, fits) for c in children))
    if kind == "product":
        made: list[Any] = []
        for child in reversed(children):  # from the right: the next factor gives the space of an I
            if child.domain is not None:
                made.insert(0, _of(child, dimension(child.domain)))
                fits = dimension(child.codomain)
            else:
                made.insert(0, _of(child, fits))
        return OperatorProduct(*made)
    if kind == "scaled":
        return OperatorProduct(number(e.coefficient), _of(children[0], fits))
    if kind == "function":
        token = keep(e) if e.letter is not None and e.letter.binding is not None else ""
        return BlockFunction(e.name, _of(children[0], dimension(children[0].domain)), dimension(e.domain), token)
    rules = {"transpose": Star, "inverse": Inverse, "blockdiag": BlockDiagonal, "sqrt": Root}
    if kind not in rules:
        raise _core.EvaluationError(f"{e.text()}: an expression of kind {kind!r} has no SymPy form")
    return rules[kind](_of(children[0], fits))


def _ascii(e: _core.Operator) -> str:
    """Return a letter's name with its arguments: B(tool)."""
    return f"{e.name}({e.letter.text})" if e.letter.arguments else e.name


def scalar(s: _core.Scalar) -> Any:
    """Return the SymPy expression of a scalar expression, sums and multiples unevaluated."""
    name, value, operand, terms = s.kind, s.number, s.operand, s.terms
    if name == "number":
        return number(value)
    if name == "sum":
        first = scalar(terms[0])
        opened = first.args if first.is_Add else (first,)
        return sympy.Add(*opened, *(scalar(t) for t in terms[1:]), evaluate=False)
    if name == "scaled":
        return sympy.Mul(number(value), scalar(terms[0]), evaluate=False)
    if name == "product":
        return sympy.Mul(*(scalar(t) for t in terms), evaluate=False)
    if name == "reciprocal":
        return sympy.Pow(scalar(terms[0]), -1, evaluate=False)
    return {"trace": OperatorTrace, "logdet": OperatorLogDet, "norm": OperatorNorm}[name](operator(operand))
