r"""The bridge to SymPy: operator expressions as SymPy matrix expressions and back, and expressions from text or LaTeX.

`to_sympy` changes nothing: SymPy shows the expression as typed, and `from_sympy` returns the same expression. In between SymPy may
`expand`, `doit`, `subs`, collect or print; it knows that operators do not commute, but none of the theorems. SymPy is imported on first
use.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .. import _core
from ..identities.parse import ParseError, Statements, as_text
from ..operators.operator_set import OperatorSet
from ..proofs.nesting import within_reach


@within_reach("parse")
def parse(text: str, model: Any, **names: _core.Operator) -> Any:
    r"""Return an operator (or scalar) expression from text: Python's spelling, the book's, or LaTeX.

    Parameters
    ----------
    text : str
        "H @ phi @ M @ phi.T @ H.T", "HφMφ*H*", r"H\phi M\phi^*H^*"; see `docs/notation.md` for the letters and functions
    model : a model or an operator set
        The owner of the letters.
    names : operators by name
        Additional names: constants, vectors, expressions.

    Raises
    ------
    ParseError
        No reading fits, two different ones fit, or the text is an equation (`pycraft.check` takes those).

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.sympy_bridge.sympy_bridge import parse
    >>> parse(r"[I - H\psi\mathcal{K}]^*\mathcal{D}^{-1}[I - H\psi\mathcal{K}]", pc.chain(3))
    <(I − H ψ K)* D⁻¹ (I − H ψ K) : Θ (3) → Θ (3)>
    """
    statement = Statements(_operators(model), names).read(as_text(text))
    if statement.rhs is not None:
        raise ParseError(f"{text!r} is an equation; parse takes one expression, pycraft.check equations")
    return statement.lhs


@within_reach("to_sympy")
def to_sympy(expression: Any) -> Any:
    r"""Return an operator or scalar expression as a SymPy expression that prints as in the book.

    Parameters
    ----------
    expression : Operator or Scalar

    Returns
    -------
    sympy.MatrixExpr, or sympy.Expr for a scalar
        Letters, constants and vectors are `OperatorSymbol` (SymPy's MatrixSymbol) with a symbolic dimension per space, stars `Star` (its
        Transpose); sums, products and inverses are SymPy's own, unevaluated, so nothing is combined or cancelled until SymPy is asked to
        (`.doit()`, `.expand()`). Numbers are exact: fractions if one equals the double, else Floats of 53 bits.

    Notes
    -----
    A space and its dual have the same dimension there, so SymPy does not see that φφ* is meaningless; `from_sympy` does. Constants, vectors
    and letters bound to a state are stored, for the life of the process, under a token in the symbol.

    Examples
    --------
    >>> import sympy, pycraft as pc
    >>> from pycraft.sympy_bridge.sympy_bridge import from_sympy, to_sympy
    >>> soa = pc.chain(3).soa
    >>> e = (soa.I + soa.H @ soa.phi @ soa.K) @ soa.D
    >>> print(sympy.latex(to_sympy(e)))
    \left(I + H \phi \mathcal{K}\right) \mathcal{D}
    >>> from_sympy(sympy.expand(to_sympy(e)), soa)
    <H φ K D + D : Θ (3) → Θ (3)>
    """
    from .sympy_writer import operator, scalar

    if isinstance(expression, _core.Scalar):
        return scalar(expression)
    if isinstance(expression, _core.Operator):
        return operator(expression)
    raise TypeError(f"to_sympy takes operator and scalar expressions, not {type(expression).__name__}")


@within_reach("from_sympy")
def from_sympy(expression: Any, model: Any, values: Mapping[Any, float] | None = None, like: _core.Operator | None = None) -> Any:
    """Return the pycraft expression of a SymPy expression built from results of `to_sympy`.

    Parameters
    ----------
    expression : SymPy matrix or scalar expression
    model : a model or an operator set
        The owner of the letters: they are found by name, so it may be another model than the original one. Constants and vectors are those
        given to `to_sympy`.
    values : mapping
        Values of additional scalar symbols.
    like : Operator
        Gives the spaces of a lone zero or I.

    Returns
    -------
    Operator or Scalar

    Raises
    ------
    EvaluationError
        A SymPy object that is not an operator expression, a symbol without a value, a zero without spaces.
    SpaceError
        A product or sum with spaces that do not match.
    """
    from .sympy_reader import Reader

    return Reader(_operators(model), values or {}, like).read(expression)


def _operators(model: Any) -> OperatorSet:
    operators = model if isinstance(model, OperatorSet) else getattr(model, "soa", None)
    if not isinstance(operators, OperatorSet):
        raise _core.ModelError(f"letters belong to a model or an operator set, not to {type(model).__name__}")
    return operators
