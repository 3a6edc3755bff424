"""An expression in a notebook: its formula in lines, and below it spaces, structure and cost."""

from __future__ import annotations

from typing import Any

from .. import _core
from .latex_lines import aligned, in_lines, lines_of
from .latex_text import escaped

_SEMIDEFINITE = {"M", "J", "P", "P_plus", "D", "R", "Upsilon", "Omega", "Lambda"}
"""Letters with x*Xx ≥ 0 in every model: inertias, and projections, sums and A X A* of them."""
_FACTORS = 500
"""Largest number of characters of a formula with a search for structure: the rules read it part by part."""


def formula_latex(latex: str) -> str:
    """Return a formula for Jupyter, broken into lines if it is long."""
    return f"$\\displaystyle {in_lines(latex)}$"


def expression_latex(expression: Any, latex: str) -> str:
    """Implement `Operator._repr_latex_`: the formula; below it its spaces, its known structure, and the cost of applying it once."""
    rows = lines_of(latex)
    about = ",\\;\\,".join(filter(None, (_spaces(expression), _text(", ".join(structure(expression))), _cost(expression))))
    if about:
        rows = [*rows[:-1], f"{rows[-1]}\\\\[2pt]\n& {{\\small {about}}}"]
    return f"$\\displaystyle {rows[0] if len(rows) == 1 and not about else aligned(rows)}$"


def structure(expression: Any) -> list[str]:
    """Return the structure of an operator known from its form, in words: "symmetric", "positive semidefinite", "upper triangular", ...

    Triangles are those of rows and columns from base to tip, as `blocks()` shows them. Properties that are not listed may still hold.
    Formulas of more than some hundred characters are not searched. Cost: proportional to the formula.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.operators.shown_expression import structure
    >>> soa = pc.chain(3).soa
    >>> structure(soa.MM), structure(soa.psi), structure(soa.D)
    (['symmetric', 'positive semidefinite'], ['upper triangular'], ['block diagonal', 'symmetric', 'positive semidefinite'])
    """
    if expression.domain is None or len(repr(expression)) > _FACTORS:
        return []
    words = ["block diagonal"] if expression.is_block_diagonal else []
    if not words:
        words += ["upper triangular"] if expression.is_upper_triangular else ["lower triangular"] if expression.is_lower_triangular else []
    if expression.is_symmetric:
        words.append("symmetric")
        words += ["positive semidefinite"] if _semidefinite(expression) else []
    return words


def _semidefinite(e: Any) -> bool:
    """Check by the form of e that x*(e x) ≥ 0 for every x."""
    parts = e.children
    match e.kind:
        case "symbol":
            return e.name in _SEMIDEFINITE
        case "identity":
            return True
        case "transpose" | "inverse" | "blockdiag":  # no root, which is a triangle
            return _semidefinite(parts[0])
        case "scaled":
            return e.coefficient > 0 and _semidefinite(parts[0])
        case "sum":
            return all(map(_semidefinite, parts))
        case "product":
            middle = len(parts) // 2
            paired = all(parts[i].T == parts[-1 - i] or parts[i] == parts[-1 - i].T for i in range(middle))
            return paired and (len(parts) % 2 == 0 or _semidefinite(parts[middle]))
    return False


def cost_words(plan: Any) -> tuple[str, str]:
    """Return (order, flops) of a plan: "O(N)", "3.8 kflop"."""
    return "O(N³)" if plan.has_dense_step else "O(N)", flops_text(plan.flops)


def flops_text(flops: float) -> str:
    """Return a number of operations with its unit: 890 flop, 2.9 kflop.

    Examples
    --------
    >>> from pycraft.operators.shown_expression import flops_text
    >>> flops_text(890.4), flops_text(2888.3), flops_text(4.1e6), flops_text(1.3e13)
    ('890 flop', '2.9 kflop', '4.1 Mflop', '13.0 Tflop')
    >>> flops_text(999.7), flops_text(99_960), flops_text(999_900)
    ('1.0 kflop', '100 kflop', '1.0 Mflop')
    """
    for unit, size in (("Tflop", 1e12), ("Gflop", 1e9), ("Mflop", 1e6), ("kflop", 1e3)):
        if flops >= 0.9995 * size:
            return f"{flops / size:.0f} {unit}" if flops >= 99.95 * size else f"{flops / size:.1f} {unit}"
    return f"{flops:.0f} flop"


def _spaces(expression: Any) -> str:
    if expression.domain is None:
        return ""
    if expression.domain.name == "R^1":  # a vector
        return f"\\in {_space(expression.codomain)}"
    return f"{_space(expression.domain)}\\to {_space(expression.codomain)}"


def _space(space: Any) -> str:
    if space.name.startswith("R^"):
        return f"\\mathbb{{R}}^{{{space.dimension}}}"
    return f"\\text{{{escaped(space.name)}}}\\,({space.dimension})"


def _cost(expression: Any) -> str:
    """Return the cost of applying it to one vector; empty without a plan: for I without a space, or a model that has changed since."""
    if expression.domain is None or len(repr(expression)) > _FACTORS:
        return ""
    try:
        order, flops = cost_words(expression.plan("apply"))
    except (_core.Error, ArithmeticError, RuntimeError):
        return ""
    return f"{order.replace('³', '^3')},\\;\\text{{{flops}}}"


def _text(words: str) -> str:
    return f"\\text{{{words}}}" if words else ""
