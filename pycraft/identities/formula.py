"""Formulas as typed, even if their spaces do not match: a small syntax tree, and its text.

`Statements` reads expressions, which exist only if spaces match. A formula with a missing star may not match at all; it still has an
arrangement of letters, which can be changed (`edits`). `formula_reading` builds it from text, `formula_values` evaluates it densely.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from .. import _core
from ..formula_nodes import Node, Product, Suffixed, flat
from .standard_letters import STANDARD

SYMBOLS = {s.name: s.text for s in _core.symbols} | {"MM": "ℳ", "I": "I", "N": "N"}
_SHOWN = {name: known.text for name, known in STANDARD.items()} | SYMBOLS | {"vdot": "θ̈"}
FUNCTIONS = ("inv", "blockdiag", "sqrt", "trace", "tr", "logdet", "det", "norm")
INDEXED = tuple(s.name for s in _core.symbols if s.takes != "nothing")


@dataclass(frozen=True)
class Letter(Node):
    name: str
    arguments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Number(Node):
    value: Fraction


@dataclass(frozen=True)
class Star(Suffixed):
    """X*."""


@dataclass(frozen=True)
class Power(Suffixed):
    exponent: int


@dataclass(frozen=True)
class Call(Node):
    function: str
    inner: Node

    @property
    def children(self) -> tuple[Node, ...]:
        return (self.inner,)


@dataclass(frozen=True)
class Sum(Node):
    """Terms with their signs, 1 and -1."""

    terms: tuple[Node, ...]
    signs: tuple[int, ...]

    @property
    def children(self) -> tuple[Node, ...]:
        return self.terms


Formula = tuple[Node, Node]
"""Both sides of a statement."""


# ---------------------------------------------------------------------- made simply
def product(*factors: Node) -> Node:
    """Return a flat product, without I beside other factors."""
    made = flat(factors)
    made = [f for f in made if f != Letter("I")] if any(not isinstance(f, Number) and f != Letter("I") for f in made) else made
    return made[0] if len(made) == 1 else Product(tuple(made))


def total(terms: list[tuple[int, Node]]) -> Node:
    """Return a flat sum; 0 if it is empty."""
    if not terms:
        return Number(Fraction(0))
    flat: list[tuple[int, Node]] = []
    for sign, term in terms:
        flat += [(sign * s, t) for t, s in zip(term.terms, term.signs, strict=True)] if isinstance(term, Sum) else [(sign, term)]
    if len(flat) == 1 and flat[0][0] > 0:
        return flat[0][1]
    return Sum(tuple(t for _, t in flat), tuple(s for s, _ in flat))


def starred(node: Node) -> Node:
    """Return the transpose; a second star cancels the first."""
    return node.inner if isinstance(node, Star) else Star(node)


def inverted(node: Node) -> Node:
    """Return the inverse; a second one cancels the first."""
    return node.inner if isinstance(node, Power) and node.exponent == -1 else Power(node, -1)


def rebuilt(node: Node, children: list[Node]) -> Node:
    """Return the same node with other children."""
    match node:
        case Star():
            return starred(children[0])
        case Power(exponent=exponent):
            return inverted(children[0]) if exponent == -1 else Power(children[0], exponent)
        case Call(function=function):
            return Call(function, children[0])
        case Product():
            return product(*children)
        case Sum(signs=signs):
            return total(list(zip(signs, children, strict=True)))
    return node


# ---------------------------------------------------------------------- formula to text
def written(node: Node, shown: bool = False) -> str:
    """Return unambiguous text; with `shown`, the book's notation."""
    match node:
        case Letter(name=name, arguments=arguments):
            return (_SHOWN.get(name, name) if shown else name) + (f"({', '.join(arguments)})" if arguments else "")
        case Number(value=value):
            return _number(value)
        case Star(inner=inner):
            return _bracketed(inner, shown) + ("*" if shown else "^*")
        case Power(inner=inner, exponent=exponent):
            return _bracketed(inner, shown) + (str(exponent).translate(_RAISED) if shown else f"^{exponent}")
        case Call(function=function, inner=inner):
            return f"{function}({written(inner, shown)})"
        case Product(factors=factors):
            return " ".join(written(f, shown) if not isinstance(f, Sum) else f"({written(f, shown)})" for f in factors)
        case Sum(terms=terms, signs=signs):
            pieces = [
                ("" if i == 0 and s > 0 else "+ " if s > 0 else "- ") + written(t, shown)
                for i, (t, s) in enumerate(zip(terms, signs, strict=True))
            ]
            return " ".join(pieces)
    raise AssertionError(node)


def _number(value: Fraction) -> str:
    """Return a decimal if it is exact, else a ratio."""
    near = repr(float(value)).removesuffix(".0")
    return near if Fraction(near) == value else str(value)


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def _bracketed(node: Node, shown: bool) -> str:
    text = written(node, shown)
    return (
        text if isinstance(node, (Letter, Call)) or isinstance(node, (Star, Power)) and not shown else f"({text})" if " " in text else text
    )


def written_statement(formula: Formula, shown: bool = False) -> str:
    """Return both sides as text, see `written`."""
    return f"{written(formula[0], shown)} {'=' if shown else '=='} {written(formula[1], shown)}"
