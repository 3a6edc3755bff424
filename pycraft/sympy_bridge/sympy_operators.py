r"""Operators as SymPy matrix expressions: the classes of the bridge (`sympy_bridge`).

A letter is an `OperatorSymbol`, a SymPy `MatrixSymbol` that prints as in the book; sums, products, inverses and powers are SymPy's own
`MatAdd`, `MatMul`, `Inverse`, `MatPow`, so `expand`, `doit`, `subs`, `.T` and the printers work on them. The star is `Star`, a
`Transpose` printed \(A^*\). Spaces become symbolic dimensions; a space and its dual share one, so that transposes fit.
"""

from __future__ import annotations

import itertools
import json
from typing import Any

import sympy
from sympy.core.symbol import Str
from sympy.matrices.expressions import Identity, MatAdd, MatMul, MatrixExpr, MatrixSymbol, Transpose, ZeroMatrix
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.pretty.stringpict import prettyForm

from .. import _core

# Objects that exist only in this process: constants, vectors, letters bound to a state, by the token in the symbol's arguments.
_KEPT: dict[str, _core.Operator] = {}
_TOKEN_OF: dict[_core.Operator, str] = {}
_TOKENS = itertools.count(1)


def _shaped(cls: type, *args: Any) -> Any:
    return sympy.Basic.__new__(cls, *(Str(a) if isinstance(a, str) else sympy.sympify(a) for a in args))


class OperatorSymbol(MatrixSymbol):
    """A letter, vector or constant. `.operator(operators)` is the pycraft operator: letters by name, the others as they were given."""

    def __new__(cls, name: Any, rows: Any, columns: Any, token: Any = "", latex: Any = "", text: Any = "") -> OperatorSymbol:
        return _shaped(cls, *(str(x) if isinstance(x, Str) else x for x in (name, rows, columns, token, latex, text)))

    @property
    def token(self) -> str:
        return self.args[3].name

    def operator(self, operators: Any) -> _core.Operator:
        """Return the operator of the set `operators` (or a stored one) that this symbol stands for."""
        said = json.loads(self.token) if self.token else {"name": self.name}
        if "kept" in said:
            if self.token not in _KEPT:
                raise _core.EvaluationError(
                    f"{self.name} was made in another process: a constant or vector is known only where it was made"
                )
            return _KEPT[self.token]
        return operators._source._symbol_again(said["name"], _tuples(said.get("arguments", ())), said.get("text", ""))

    def _eval_transpose(self) -> Star:
        return Star(self)

    def _latex(self, printer: Any) -> str:
        return self.args[4].name or printer._print_MatrixSymbol(self)

    def _pretty(self, printer: Any) -> prettyForm:
        return prettyForm(self.args[5].name or self.name)

    def _sympystr(self, printer: Any) -> str:
        return self.name

    _sympyrepr = _sympystr


def _tuples(data: Any) -> Any:
    """Return JSON's lists as the original tuples."""
    return tuple(map(_tuples, data)) if isinstance(data, list | tuple) else data


def symbol_of(e: _core.Operator, name: str, rows: Any, columns: Any) -> OperatorSymbol:
    """Return the symbol of a leaf: a letter that can be found again by name, or a stored operator."""
    letter = e.letter if e.kind == "symbol" else None
    if letter is not None and letter.binding is None:
        token = json.dumps({"name": letter.name, "arguments": letter.arguments, "text": letter.text})
    else:
        token = keep(e)
    return OperatorSymbol(name, rows, columns, token, e.latex(), e.text())


class Star(Transpose):
    """The book's transpose: printed with a star."""

    def _latex(self, printer: Any) -> str:
        inside = printer.parenthesize(self.arg, PRECEDENCE["Pow"])
        return rf"\left({inside}\right)^{{*}}" if "^" in inside and not inside.startswith(r"\left(") else f"{{{inside}}}^{{*}}"

    def _pretty(self, printer: Any) -> prettyForm:
        inside = printer._print(self.arg)
        return prettyForm(*inside.parens() if self.arg.args and not isinstance(self.arg, OperatorSymbol) else inside) ** prettyForm("*")


class OperatorSum(MatAdd):
    """A sum that prints its terms in the order in which they were typed."""

    def _joined(self, printer: Any) -> str:
        terms = [printer._print(a) for a in self.args]
        return terms[0] + "".join(f" - {t[1:].lstrip()}" if t.startswith("-") else f" + {t}" for t in terms[1:])

    _latex = _joined
    _sympystr = _joined


class OperatorProduct(MatMul):
    """A product with at most one number in front, printed as typed."""

    def _latex(self, printer: Any) -> str:
        number, *matrices = self.args if not self.args[0].is_Matrix else (sympy.S.One, *self.args)
        opened = matrices[0].args[0] if len(matrices) == 1 and isinstance(matrices[0], MatMul) else sympy.S.NegativeOne
        alone = opened.is_Matrix or number == -1 and opened.is_positive
        shown = " ".join(printer._print(m) if alone else printer.parenthesize(m, PRECEDENCE["Mul"]) for m in matrices)
        return shown if number == 1 else f"-{shown}" if number == -1 else rf"{printer._print(number)}\,{shown}"


class OperatorUnit(Identity):
    """I: of a named space ("F", ...), or of one inferred from the context."""

    def __new__(cls, dimension: Any, token: Any = "") -> OperatorUnit:
        return _shaped(cls, dimension, str(token))

    @property
    def token(self) -> str:
        return self.args[1].name

    def _eval_transpose(self) -> OperatorUnit:
        return self

    def _latex(self, printer: Any) -> str:
        return "I"

    def _pretty(self, printer: Any) -> prettyForm:
        return prettyForm("I")

    def _sympystr(self, printer: Any) -> str:
        return "I"


class OperatorZero(ZeroMatrix):
    """A zero operator with its spaces."""

    def __new__(cls, rows: Any, columns: Any, token: Any = "") -> OperatorZero:
        return _shaped(cls, rows, columns, str(token))

    @property
    def token(self) -> str:
        return self.args[2].name

    def _latex(self, printer: Any) -> str:
        return "0"


def keep(e: _core.Operator) -> str:
    """Return a token that finds an operator again in this process: the same for equal operators."""
    if e not in _TOKEN_OF:
        token = _TOKEN_OF[e] = json.dumps({"kept": next(_TOKENS)})
        _KEPT[token] = e
    return _TOKEN_OF[e]


def kept(token: str) -> _core.Operator | None:
    return _KEPT.get(token)


class _Function(MatrixExpr):
    """A function of an operator, of the shape of its argument."""

    def __new__(cls, arg: Any) -> Any:
        return _shaped(cls, arg)

    @property
    def arg(self) -> Any:
        return self.args[0]

    @property
    def shape(self) -> Any:
        return self.arg.shape

    def _entry(self, i: Any, j: Any, **kwargs: Any) -> Any:
        return sympy.MatrixElement(self, i, j)

    def _written(self, printer: Any) -> str:
        return printer._print(self.arg)


class BlockDiagonal(_Function):
    """The diagonal blocks of an operator, body by body."""

    def _eval_transpose(self) -> BlockDiagonal:
        return BlockDiagonal(sympy.transpose(self.arg))

    def _latex(self, printer: Any) -> str:
        return rf"\operatorname{{blockdiag}}\left({self._written(printer)}\right)"

    def _sympystr(self, printer: Any) -> str:
        return f"blockdiag({self._written(printer)})"


class Root(_Function):
    """L with A = LL*, body by body."""

    def _eval_transpose(self) -> Star:
        return Star(self)

    def _latex(self, printer: Any) -> str:
        inside = self._written(printer)
        return f"{{{inside}}}^{{1/2}}" if isinstance(self.arg, OperatorSymbol) and "^" not in inside else rf"\left({inside}\right)^{{1/2}}"

    def _sympystr(self, printer: Any) -> str:
        return f"sqrt({self._written(printer)})"


class BlockFunction(MatrixExpr):
    """A function that derivatives introduce: crm, crf, mcross of a vector, the lower half of a block-diagonal operator."""

    def __new__(cls, name: Any, arg: Any, dimension: Any, token: Any = "") -> Any:
        return _shaped(cls, str(name), arg, dimension, str(token))

    @property
    def arg(self) -> Any:
        return self.args[1]

    @property
    def token(self) -> str:
        return self.args[3].name

    @property
    def shape(self) -> Any:
        return self.args[2], self.args[2]

    def _eval_transpose(self) -> Star:
        return Star(self)

    def _entry(self, i: Any, j: Any, **kwargs: Any) -> Any:
        return sympy.MatrixElement(self, i, j)

    def _latex(self, printer: Any) -> str:
        name = self.args[0].name
        shown = r"\operatorname{lower}_{1/2}" if name == "lower_half" else rf"\operatorname{{{name}}}"
        return rf"{shown}\left({printer._print(self.arg)}\right)"

    def _sympystr(self, printer: Any) -> str:
        return f"{self.args[0].name}({printer._print(self.arg)})"


class _Reduction(sympy.Expr):
    """A scalar function of an operator."""

    is_commutative = True
    is_real = True

    def __new__(cls, arg: Any) -> Any:
        return _shaped(cls, arg)

    @property
    def arg(self) -> Any:
        return self.args[0]

    def _sympystr(self, printer: Any) -> str:
        return f"{type(self).__name__.removeprefix('Operator').lower()}({printer._print(self.arg)})"


class OperatorTrace(_Reduction):
    """The trace."""

    def _latex(self, printer: Any) -> str:
        return rf"\operatorname{{tr}}\left({printer._print(self.arg)}\right)"


class OperatorLogDet(_Reduction):
    """ln|det A|."""

    def _latex(self, printer: Any) -> str:
        return rf"\ln\det\left({printer._print(self.arg)}\right)"


class OperatorNorm(_Reduction):
    """The Frobenius norm."""

    def _latex(self, printer: Any) -> str:
        return rf"\left\Vert{{{printer._print(self.arg)}}}\right\Vert"
