"""Statements as text: Python's spelling, the book's (Unicode or ASCII, juxtaposition and a postfix star), or LaTeX.

Both readings are tried, Python's (``*`` and ``@`` multiply, ``.T`` transposes) and the book's (juxtaposition multiplies, a postfix ``*``
transposes); the one whose names and spaces fit is taken. Where both fit and differ, the error shows both. In both ``**`` is Python's power.
In the book's reading the numbers in front of a product scale the whole of it: 2 D D is 2 (D D), as it is shown. Numbers are what is
typed: 0.3 is 3/10 and D/3 a third, exactly.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from .. import _core
from .block_reading import is_by_block, refuse_by_block
from .book import read_book
from .definitions import Definition, meant, shown_text
from .determinant_equations import as_logarithms
from .dialects import divided
from .inequalities import check_comparable, related
from .spelling import Spelled, spelled, stars_behind_nodes
from .vocabulary import FUNCTIONS, WITH_ARGUMENTS, Misread, ParseError, SpacesError, Vocabulary, decimal, is_number, is_operator, power

__all__ = ["ParseError", "Statement", "Statements", "check_has_space"]


@dataclass
class Statement:
    """Two sides, as expressions of one model, and the text they were read from. A lone expression has no right side.

    `relation` is =, or the sign of an inequality. `letters` are those that were defined around it, or stand for others, and what they
    stand for, as they are shown.
    """

    lhs: Any
    rhs: Any
    text: str
    reading: str
    letters: dict[str, str] = field(default_factory=dict)
    relation: str = "="
    _shown: Callable[[], Statement] | None = None

    @property
    def understood(self) -> str:
        """The statement as it was read, in the package's own letters, and what other letters in it stand for."""
        at = self
        if self._shown is not None:
            try:
                at = self._shown()
            except (_core.Error, ArithmeticError, TypeError, ValueError, AttributeError):
                pass  # a letter that stands for itself has no inverse, root or rate that could be shown
        text = _text(at.lhs) + ("" if at.rhs is None else f" {self.relation} {_text(at.rhs)}")
        where = "; ".join(f"{name} = {what}" for name, what in self.letters.items()) if at is not self else ""
        return (f"{text}, where {where}" if where else text).replace("vdot", "θ̈")


class Statements:
    """Reads statements on the letters of one model; `vector(name, space)` makes the vectors of which a statement says no more."""

    def __init__(
        self, operators: Any, extra: Mapping[str, Any] | None = None, *, vector: Callable[[str, Any], Any] = _core.vector, **options: Any
    ):
        self._operators, self._vector = operators, vector
        self._vocabulary = Vocabulary(operators, extra, read=self._meaning, **options)

    def read(self, text: str, before: Sequence[Definition] = (), *, inequalities: bool = False) -> Statement:
        """The statement, by the one reading whose names and spaces fit, with the definitions around it and those before.

        `inequalities` says whether it may be one; what handles equations alone refuses them by name.

        Raises
        ------
        ParseError
            Nothing fits (the reasons of both readings are shown), or both do. SpacesError where only the spaces do not fit.
        """
        definitions, claim = divided(text, self._is_by_block)
        definitions = [*before, *definitions]
        refuse_by_block(claim, self._vocabulary.own | {d.name for d in definitions})
        source = self._spelled(claim)
        if not inequalities and related(source.text)[0] != "=":
            raise ParseError(f"{text!r} is an inequality: pycraft.check, pycraft.truth and pycraft.prove take it")
        vocabulary = self._with(definitions)
        refusal: ParseError | None = None
        for choice in vocabulary.choices(" ".join([source.text, *(spelled(d.what).text for d in definitions)])):
            try:
                return self._fitting(source, text, claim, self._with(definitions, choice))
            except ParseError as error:
                refusal = refusal or error
        assert refusal is not None
        raise refusal

    def letter(self, name: str, definitions: Sequence[Definition]) -> Any:
        """Return the meaning of a letter under these definitions. Raises ParseError."""
        return self._with(definitions).operator(name)

    def _spelled(self, text: str) -> Spelled:
        source, model = spelled(text), self._operators._model
        if re.search(r"(?<![A-Za-z_])(?:B|Jacobian|Lambda)\s*[\^*'.]", source.text):
            stars_behind_nodes(source, [*getattr(model, "nodes", ()), *getattr(model, "bodies", ())])
        return source

    def _is_by_block(self, claim: str, own: Iterable[str]) -> bool:
        return is_by_block(claim, own=self._vocabulary.own | {*own})

    def _with(self, definitions: Sequence[Definition], choice: Mapping[str, int] | None = None) -> Vocabulary:
        return self._vocabulary.with_letters(definitions, choice or {})

    def _meaning(self, what: str, vocabulary: Vocabulary, name: str) -> Any:
        """What a definition says, in the words that it sees."""

        def expression(text: str) -> Any:
            found = self._fitting(self._spelled(text), text, text, vocabulary)
            if found.rhs is not None:
                raise ParseError(f"{name} := {text} is a statement: a letter stands for one expression")
            return found.lhs

        return meant(Definition(name, what, f"{name} := {what}"), self._operators, expression, self._vector)

    def _fitting(self, source: Spelled, text: str, claim: str, vocabulary: Vocabulary) -> Statement:
        """The one of both readings that fits."""
        found: list[Statement] = []
        reasons: dict[str, str] = {}
        place, misfits = "", False
        for reading in ("Python", "the book"):
            try:
                found.append(self._read(source, text, reading, vocabulary))
            # The core's errors of names, spaces and models are TypeErrors and ValueErrors; what Python finds wrong reads no better.
            except (TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
                reasons[reading] = "it divides by zero" if isinstance(error, ZeroDivisionError) else str(error)
                misfits = misfits or isinstance(error, _core.SpaceError) and not isinstance(error, _NoSpaceError)
                place = error.place(source) if isinstance(error, Misread) else ""
        if not found:
            if not _looks_like_python(source.text) or reasons["Python"] == reasons["the book"]:
                del reasons["Python"]
            why = "\n".join(f"  read as {reading}: {reason}" if len(reasons) == 2 else f"  {reason}" for reading, reason in reasons.items())
            kind = SpacesError if misfits else ParseError
            raise kind(f"{claim!r} does not read as a statement of operators.\n{why}{place}")
        first = found[0]
        if len(found) == 2 and not (_same(first.lhs, found[1].lhs) and _same(first.rhs, found[1].rhs)):
            shown = "\n".join(f"  {s.reading}: {_text(s.lhs)} {s.relation} {_text(s.rhs)}" for s in found)
            raise ParseError(f"{claim!r} reads in two ways and both fit:\n{shown}\nwrite .T for a transpose, or juxtapose to multiply")
        if vocabulary.used:
            used = reversed(vocabulary.used.items())
            first.letters = {shown_text(n): shown_text(what) for n, (what, _) in used if shown_text(what) != shown_text(n)}
            reading, themselves = first.reading, vocabulary.standing_for_themselves()
            first._shown = lambda: self._read(source, text, reading, themselves)
        return first

    def _read(self, source: Spelled, text: str, reading: str, vocabulary: Vocabulary) -> Statement:
        read_sides = self._read_python if reading == "Python" else read_book
        relation, parts = related(source.text)
        if relation == "=":
            sides = read_sides(as_logarithms(source.text), vocabulary)
        else:
            sides = [_side(read_sides, part, at, vocabulary) for part, at in parts]
        lhs, rhs = sides if len(sides) == 2 else (sides[0], None)
        lhs, rhs = _balance(lhs, rhs), _balance(rhs, lhs) if rhs is not None else None
        if rhs is not None:
            _check_same_spaces(lhs, rhs)
        if relation != "=":
            check_comparable(lhs, rhs, relation)
        return Statement(lhs, rhs, text, reading, relation=relation)

    # ------------------------------------------------------------------ Python's reading: Python's own parser
    def _read_python(self, source: str, vocabulary: Vocabulary) -> list[Any]:
        source = source.lstrip()
        try:
            source = _comparison(source)
            tree = ast.parse(source, mode="eval").body
        except (SyntaxError, ValueError) as error:  # ValueError: a NUL in the text
            raise ParseError(f"not understood at {source[max(0, (getattr(error, 'offset', 1) or 1) - 1) :][:12]!r}") from None
        if isinstance(tree, ast.Compare):
            if len(tree.ops) != 1 or not isinstance(tree.ops[0], ast.Eq):
                raise ParseError("a statement is lhs == rhs, or one of >, ≥, <, ≤ between two sides")
            return [self._evaluate(tree.left, source, vocabulary), self._evaluate(tree.comparators[0], source, vocabulary)]
        return [self._evaluate(tree, source, vocabulary)]

    def _evaluate(self, node: ast.AST, source: str, vocabulary: Vocabulary) -> Any:
        match node:
            case ast.Constant(value=int() as value):
                return Fraction(value)
            case ast.Constant(value=float()):
                return decimal(ast.get_source_segment(source, node) or "")
            case ast.Call(func=ast.Name(id="Fraction"), args=[ast.Constant(value=int() as a), ast.Constant(value=int() as b)]) if b:
                return Fraction(a, b)
            case ast.Name(id=name):
                return vocabulary.operator(name)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -self._evaluate(inner, source, vocabulary)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return power(self._evaluate(left, source, vocabulary), self._evaluate(right, source, vocabulary))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                return _combine(_BINARY[type(op)], self._evaluate(left, source, vocabulary), self._evaluate(right, source, vocabulary))
            case ast.Attribute(value=inner, attr="T"):
                return self._evaluate(inner, source, vocabulary).T
            case ast.Call(func=ast.Attribute(value=inner, attr=("inv" | "sqrt" | "trace" | "logdet" | "norm") as method), args=[]):
                return getattr(self._evaluate(inner, source, vocabulary), method)()
            case ast.Call(func=ast.Name(id=name), args=[inner]) if name in FUNCTIONS:
                return FUNCTIONS[name](self._evaluate(inner, source, vocabulary))
            case ast.Call(func=ast.Name(id=name), args=arguments) if name in WITH_ARGUMENTS:
                return vocabulary.indexed(name, [ast.unparse(a) for a in arguments])
        raise ParseError(f"{ast.unparse(node)!r} is no operator expression")


def _side(read_sides: Callable[..., list[Any]], part: str, begin: int, vocabulary: Vocabulary) -> Any:
    """One side of an inequality, which begins at a character of the spelled text."""
    try:
        (side,) = read_sides(part, vocabulary)
    except Misread as error:
        raise Misread(error.message, error.at + begin) from None
    return side


def _comparison(source: str) -> str:
    """A single = as Python's ==."""
    return re.sub(r"(?<![=<>!])=(?!=)", "==", source)


def _looks_like_python(source: str) -> bool:
    """Whether the spelled text parses as Python, whatever its names: then Python's objection is worth reading beside the book's."""
    try:
        ast.parse(_comparison(source.strip()), mode="eval")
    except (SyntaxError, ValueError):
        return False
    return True


_BINARY = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.MatMult: operator.matmul,
    ast.Div: operator.truediv,
}


def _combine(f: Any, a: Any, b: Any) -> Any:
    try:
        return f(a, b)
    except TypeError as error:
        if isinstance(error, _core.SpaceError):
            raise
        raise ParseError(str(error)) from None


def _same(a: Any, b: Any) -> bool:
    """Whether two readings are one: also where a number scales one factor in Python, (2 D) D, and the product in the book, 2 (D D)."""
    if isinstance(a, _core.Operator) and isinstance(b, _core.Operator):
        return a == b or _unscaled(a) == _unscaled(b) and _core.equal_by_theorems(a, b)
    return type(a) is type(b) and a == b


def _unscaled(side: _core.Operator) -> Any:
    """What an expression is made of, whatever the numbers in it."""
    if not side.children:
        return side
    if side.kind == "scaled":
        return _unscaled(side.children[0])
    parts: list[Any] = []
    for part in map(_unscaled, side.children):
        nested = isinstance(part, tuple) and part[0] == side.kind == "product"
        parts += part[1:] if nested else [part]
    return (side.kind, *parts)


def _text(side: Any) -> str:
    return "" if side is None else str(side) if is_number(side) else side.text()


def _balance(side: Any, other: Any) -> Any:
    """0 and I take the spaces of the other side; numbers beside a scalar become scalars."""
    if is_operator(other) and other.domain is not None:
        if is_number(side) and side == 0:
            return _core.zero(other.domain, other.codomain)
        if isinstance(side, _core.Operator) and side.domain is None:
            own = _core.identity(other.domain)
            return own if side.kind == "identity" else side @ own
    if isinstance(other, _core.Scalar) and is_number(side):
        return _core.scalar(side)
    return side


def _check_same_spaces(lhs: Any, rhs: Any) -> None:
    if is_operator(lhs) != is_operator(rhs):
        raise _core.SpaceError(f"{_text(lhs)} and {_text(rhs)}: one is an operator, the other a number")
    if isinstance(lhs, _core.Operator) and isinstance(rhs, _core.Operator):
        check_has_space(lhs, rhs)
        lhs - rhs  # raises where the spaces differ
    elif is_operator(lhs):  # a formula with derivatives
        for a, b in ((lhs.domain, rhs.domain), (lhs.codomain, rhs.codomain)):
            if a is not None and b is not None and a != b:
                raise _core.SpaceError(f"{_text(lhs)} and {_text(rhs)} do not act between the same spaces")
    elif not isinstance(lhs, _core.Scalar) and not isinstance(rhs, _core.Scalar):
        raise ParseError("a statement about numbers alone")


def as_text(statement: Any) -> str:
    """A statement that is given as text. EvaluationError where it is none."""
    if not isinstance(statement, str):
        raise _core.EvaluationError(f"a statement is text, such as 'ψ⁻¹ = φ⁻¹ + KH', not {statement!r:.80}")
    return statement


class _NoSpaceError(_core.SpaceError):
    """Neither side says on which space its I acts."""


def check_has_space(lhs: _core.Operator, rhs: _core.Operator) -> None:
    """Raises where neither side says on which space its I acts."""
    if lhs.domain is None and rhs.domain is None:
        raise _NoSpaceError(f"{lhs.text()} = {rhs.text()} is said of no space: an I takes its space from an operator beside it")
