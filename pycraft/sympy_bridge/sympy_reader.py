"""Convert SymPy expressions back to operator expressions: structure is kept node by node."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import reduce
from operator import add, matmul, mul
from typing import Any

import sympy
from sympy.matrices.expressions import Identity, Inverse, MatAdd, MatMul, MatPow, Transpose, ZeroMatrix
from sympy.matrices.expressions.matexpr import MatrixExpr

from .. import _core
from ..operators.operator_set import OperatorSet
from .sympy_operators import (
    BlockDiagonal,
    BlockFunction,
    OperatorLogDet,
    OperatorNorm,
    OperatorSymbol,
    OperatorTrace,
    OperatorUnit,
    OperatorZero,
    Root,
    kept,
)


class Reader:
    """Reads SymPy expressions as expressions of one operator set."""

    def __init__(self, operators: OperatorSet, values: Mapping[Any, float], like: _core.Operator | None):
        self._operators, self._like = operators, like
        self._values = {sympy.sympify(k): v for k, v in values.items()}

    def read(self, e: Any) -> Any:
        """Return the operator, or the scalar, that the expression stands for."""
        if isinstance(e, MatrixExpr):
            made = self._operator(e)
            if made is None:
                made = self._like_zero(e)
            if made.domain is None and self._like is not None and self._like.domain is not None:
                return made @ _core.identity(self._like.domain)
            return made
        if isinstance(e, sympy.Expr):
            made = self._scalar(e)
            return _core.scalar(made) if isinstance(made, float) else made
        raise _core.EvaluationError(f"{e!r} is not a SymPy expression of operators")

    def _like_zero(self, e: Any) -> _core.Operator:
        if self._like is None or self._like.domain is None:
            raise _core.EvaluationError("the expression is zero, and SymPy does not know its spaces: give like=, an operator that has them")
        return _core.zero(self._like.domain, self._like.codomain)

    # ------------------------------------------------------------------ operators; None is a zero of any matching spaces
    def _operator(self, e: Any) -> _core.Operator | None:
        if isinstance(e, OperatorSymbol):
            return e.operator(self._operators)
        if isinstance(e, OperatorUnit):
            return (kept(e.token) if e.token else None) or _core.identity()
        if isinstance(e, Identity):
            return _core.identity()
        if isinstance(e, OperatorZero):
            return kept(e.token)
        if isinstance(e, ZeroMatrix):
            return None
        if isinstance(e, MatAdd):
            terms = [made for made in map(self._operator, e.args) if made is not None]
            return reduce(add, terms) if terms else None
        if isinstance(e, MatMul):
            return self._product(e)
        if isinstance(e, Inverse):
            return self._nonzero(e.arg).inv()
        if isinstance(e, MatPow):
            return self._power(e)
        if isinstance(e, Transpose):
            inside = self._operator(e.arg)
            return None if inside is None else inside.T
        if isinstance(e, BlockDiagonal):
            inside = self._operator(e.arg)
            return None if inside is None else _core.blockdiag(inside)
        if isinstance(e, Root):
            return self._nonzero(e.arg).sqrt()
        if isinstance(e, BlockFunction):
            return self._function(e)
        raise _core.EvaluationError(f"{e} ({type(e).__name__}) is not an operator expression")

    def _nonzero(self, e: Any) -> _core.Operator:
        made = self._operator(e)
        if made is None:
            raise _core.EvaluationError("the inverse or root of zero")
        return made

    def _product(self, e: Any) -> _core.Operator | None:
        numbers = [a for a in e.args if not getattr(a, "is_Matrix", False)]
        found = [self._operator(a) for a in e.args if getattr(a, "is_Matrix", False)]
        matrices = [m for m in found if m is not None]
        if len(matrices) < len(found):
            return None
        made: _core.Operator = reduce(matmul, matrices)
        return made if not numbers else self._number(sympy.Mul(*numbers)) * made

    def _power(self, e: Any) -> _core.Operator:
        base, exponent = self._nonzero(e.base), e.exp
        if exponent == sympy.Rational(1, 2):
            return base.sqrt()
        if not exponent.is_Integer:
            raise _core.EvaluationError(f"{e}: powers of operators are whole numbers")
        return base ** int(exponent) if exponent != 0 else _core.identity(base.domain)

    def _function(self, e: BlockFunction) -> _core.Operator:
        found = kept(e.token) if e.token else None
        if found is not None:
            return found
        inside, name = self._nonzero(e.arg), e.args[0].name
        if name == "lower_half":
            return _core._make("function", [inside], 1.0)
        return _core._function(self._operators._source, name, None, inside)  # type: ignore[arg-type]  # not "gravity"

    # ------------------------------------------------------------------ numbers and scalars
    def _number(self, x: Any) -> float | Fraction:
        """Return a ratio as it is, anything else as a double."""
        value = x.subs(self._values)
        if not value.is_number or not value.is_real:
            unknown = ", ".join(sorted(map(str, value.free_symbols))) or str(value)
            raise _core.EvaluationError(f"{unknown} is not a real number: give values={{{unknown}: ...}}")
        return Fraction(int(value.p), int(value.q)) if value.is_Rational else float(value)

    def _scalar(self, e: Any) -> Any:
        """Return a number, or a scalar expression."""
        if isinstance(e, OperatorTrace | OperatorLogDet | OperatorNorm):
            inside = self._nonzero(e.arg)
            return {OperatorTrace: inside.trace, OperatorLogDet: inside.logdet, OperatorNorm: inside.norm}[type(e)]()
        if isinstance(e, sympy.Trace):
            return self._nonzero(e.arg).trace()
        if not e.has(OperatorTrace, OperatorLogDet, OperatorNorm, sympy.Trace):
            return self._number(e)
        if e.is_Add:
            return reduce(add, map(self._scalar, e.args))
        if e.is_Mul:
            return reduce(mul, map(self._scalar, e.args))
        if e.is_Pow and e.exp.is_Integer:
            return self._scalar(e.base) ** int(e.exp)
        raise _core.EvaluationError(f"{e}: scalar expressions are sums, products and whole powers of traces, ln det and norms")
