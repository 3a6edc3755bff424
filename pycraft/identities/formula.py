"""Formulas as they were typed, whether their spaces fit or not: a small syntax tree, from text and back to it, with dense values.

`Statements` reads expressions, which exist only where spaces fit. A formula with a star too few may fit nowhere; it still has an
arrangement of letters, which can be changed (`edits`).
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from .. import _core
from .spelling import spelled
from .vocabulary import ParseError, decimal

SYMBOLS = {name: shown for name, shown, *_ in _core.symbol_table()} | {"MM": "ℳ", "I": "I", "N": "N"}
FUNCTIONS = ("inv", "blockdiag", "sqrt", "trace", "tr", "logdet", "norm")
_INDEXED = ("B", "Jacobian", "Lambda", "Delta")


class Misfit(Exception):
    """Spaces that do not fit, or an inverse that does not exist."""


@dataclass(frozen=True)
class Node:
    """A part of a formula."""

    @property
    def children(self) -> tuple[Node, ...]:
        return ()


@dataclass(frozen=True)
class Letter(Node):
    name: str
    arguments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Number(Node):
    value: Fraction


@dataclass(frozen=True)
class Suffixed(Node):
    """What a suffix makes of one formula."""

    inner: Node

    @property
    def children(self) -> tuple[Node, ...]:
        return (self.inner,)


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
class Product(Node):
    factors: tuple[Node, ...]

    @property
    def children(self) -> tuple[Node, ...]:
        return self.factors


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
    """A product, flat, without an I beside other factors."""
    flat = [f for factor in factors for f in (factor.factors if isinstance(factor, Product) else (factor,))]
    flat = [f for f in flat if f != Letter("I")] if any(not isinstance(f, Number) and f != Letter("I") for f in flat) else flat
    return flat[0] if len(flat) == 1 else Product(tuple(flat))


def total(terms: list[tuple[int, Node]]) -> Node:
    """A sum, flat; a 0 where nothing is left."""
    if not terms:
        return Number(Fraction(0))
    flat: list[tuple[int, Node]] = []
    for sign, term in terms:
        flat += [(sign * s, t) for t, s in zip(term.terms, term.signs, strict=True)] if isinstance(term, Sum) else [(sign, term)]
    if len(flat) == 1 and flat[0][0] > 0:
        return flat[0][1]
    return Sum(tuple(t for _, t in flat), tuple(s for s, _ in flat))


def starred(node: Node) -> Node:
    """The transpose: a second star takes the first away."""
    return node.inner if isinstance(node, Star) else Star(node)


def inverted(node: Node) -> Node:
    """The inverse: a second takes the first away."""
    return node.inner if isinstance(node, Power) and node.exponent == -1 else Power(node, -1)


def rebuilt(node: Node, children: list[Node]) -> Node:
    """The same node over other children."""
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


def parts(node: Node) -> Iterator[Node]:
    """The node and all under it."""
    yield node
    for child in node.children:
        yield from parts(child)


# ---------------------------------------------------------------------- text to formula
def read_formula(text: str) -> Formula:
    """Both sides of a statement. Python's reading where the text has `@`, `.T` or a call of `inv`, else the book's.

    Raises ParseError where it is no statement.
    """
    source = spelled(text).text
    is_python = re.search(r"@|\.T\b|\.inv\(|\binv\(", source) and "^" not in source
    sides = re.split(r"==?", source)
    if len(sides) != 2:
        raise ParseError(f"{text!r} has {'one side' if len(sides) == 1 else 'more than two sides'}; a statement is lhs == rhs")
    left, right = (_python(side) if is_python else _Book(side).whole() for side in sides)
    return left, right


def _python(source: str) -> Node:
    try:
        return _from_ast(ast.parse(source.strip(), mode="eval").body)
    except SyntaxError as error:
        raise ParseError(f"not understood: {source.strip()!r}") from error


def _from_ast(node: ast.AST) -> Node:
    match node:
        case ast.Constant(value=int() | float() as value):
            return Number(decimal(str(value)))
        case ast.Name(id=name) if name in SYMBOLS:
            return Letter(name)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return total([(-1, _from_ast(inner))])
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return total([(1, _from_ast(left)), (1, _from_ast(right))])
        case ast.BinOp(left=left, op=ast.Sub(), right=right):
            return total([(1, _from_ast(left)), (-1, _from_ast(right))])
        case ast.BinOp(left=left, op=ast.Mult() | ast.MatMult(), right=right):
            return product(_from_ast(left), _from_ast(right))
        case ast.BinOp(left=left, op=ast.Div(), right=ast.Constant(value=int() | float() as value)):
            return product(Number(1 / decimal(str(value))), _from_ast(left))
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return Power(_from_ast(left), int(ast.literal_eval(right)))
        case ast.Attribute(value=inner, attr="T"):
            return Star(_from_ast(inner))
        case ast.Call(func=ast.Attribute(value=inner, attr=method), args=[]) if method in FUNCTIONS:
            return _call(method, _from_ast(inner))
        case ast.Call(func=ast.Name(id=name), args=[inner]) if name in FUNCTIONS:
            return _call(name, _from_ast(inner))
        case ast.Call(func=ast.Name(id=name), args=arguments) if name in _INDEXED:
            return Letter(name, tuple(ast.unparse(a) for a in arguments))
    raise ParseError(f"{ast.unparse(node)!r} is no operator expression")


def _call(function: str, inner: Node) -> Node:
    return Power(inner, -1) if function == "inv" else Call({"tr": "trace"}.get(function, function), inner)


@lru_cache(maxsize=1)
def _tokens() -> re.Pattern[str]:
    names = "|".join(re.escape(n) for n in sorted((set(SYMBOLS) - set(_INDEXED)) | {"X", "V"}, key=lambda n: (-len(n), n)))
    functions = "|".join(FUNCTIONS)
    return re.compile(
        rf"\s*(?:(?P<number>\d+\.?\d*(?:[eE][+-]?\d+)?)|(?P<function>(?:{functions})\b|√)|(?P<indexed>(?:{'|'.join(_INDEXED)})\s*\([^()]*\))"
        rf"|(?P<name>{names})|(?P<power>\^\s*-?\d+|\*\*\s*-?\d+)|(?P<star>\^\*|\^T|\.T|'|\*)|(?P<inverse>\.inv\(\))|(?P<root>\^½|\.sqrt\(\))"
        rf"|(?P<other>[-+()\[\]{{}}@·/]))"
    )


class _Book:
    """The book's reading: juxtaposition multiplies, a postfix star transposes."""

    def __init__(self, source: str):
        self._tokens: list[tuple[str, str]] = []
        at = 0
        while source[at:].strip():
            found = _tokens().match(source, at)
            if found is None:
                raise ParseError(f"not understood at {source[at : at + 12].strip()!r}")
            kind = str(found.lastgroup)
            self._tokens.append((kind, found[kind]))
            at = found.end()

    def whole(self) -> Node:
        node = self._sum()
        if self._tokens:
            raise ParseError(f"not understood at {self._tokens[0][1]!r}")
        return node

    def _next(self) -> tuple[str, str]:
        return self._tokens[0] if self._tokens else ("end", "")

    def _sum(self) -> Node:
        terms = []
        while True:
            sign = 1
            while self._next()[1] in ("+", "-"):
                sign = -sign if self._tokens.pop(0)[1] == "-" else sign
            terms.append((sign, self._product()))
            if self._next()[1] not in ("+", "-"):
                return total(terms)

    def _product(self) -> Node:
        factors: list[Node] = []
        while True:
            kind, text = self._next()
            if text in ("@", "·"):
                self._tokens.pop(0)
            elif text == "/":
                self._tokens.pop(0)
                factors.insert(0, Number(1 / decimal(self._tokens.pop(0)[1])))
            elif kind in ("number", "function", "indexed", "name") or text in ("(", "[", "{"):
                factors.append(self._postfix())
            else:
                break
        if not factors:
            raise ParseError(f"not understood at {text!r}" if text else "not understood at its end")
        return product(*factors)

    def _postfix(self) -> Node:
        node = self._atom()
        while self._next()[0] in ("star", "power", "inverse", "root"):
            kind, text = self._tokens.pop(0)
            if kind == "star":
                node = starred(node)
            elif kind == "power":
                exponent = int(text.lstrip("^*").strip())
                node = inverted(node) if exponent == -1 else Power(node, exponent)
            else:
                node = Power(node, -1) if kind == "inverse" else Call("sqrt", node)
        return node

    def _atom(self) -> Node:
        kind, text = self._tokens.pop(0)
        if kind == "number":
            return Number(decimal(text))
        if kind == "name":
            return Letter({"X": "X_world", "V": "velocity"}.get(text, text))
        if kind == "indexed":
            name, _, arguments = text.partition("(")
            return Letter(name.strip(), tuple(a.strip().strip("'\"") for a in arguments[:-1].split(",")))
        if kind == "function":
            if self._next()[1] not in ("(", "[", "{"):  # tr ΥM, ln det D: what follows; √D: the one factor
                return _call("sqrt", self._postfix()) if text == "√" else _call(text, self._product())
            self._tokens.pop(0)
            node = self._sum()
            self._close()
            return _call({"√": "sqrt"}.get(text, text), node)
        node = self._sum()
        self._close()
        return node

    def _close(self) -> None:
        if self._next()[1] not in (")", "]", "}"):
            raise ParseError("a bracket is not closed")
        self._tokens.pop(0)


# ---------------------------------------------------------------------- formula to text
def written(node: Node, shown: bool = False) -> str:
    """As text that reads in one way only; `shown`: as the book prints it."""
    match node:
        case Letter(name=name, arguments=arguments):
            return (SYMBOLS[name] if shown else name) + (f"({', '.join(arguments)})" if arguments else "")
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
    """A decimal where that is it exactly, else a ratio."""
    near = repr(float(value)).removesuffix(".0")
    return near if Fraction(near) == value else str(value)


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def _bracketed(node: Node, shown: bool) -> str:
    text = written(node, shown)
    return (
        text if isinstance(node, (Letter, Call)) or isinstance(node, (Star, Power)) and not shown else f"({text})" if " " in text else text
    )


def written_statement(formula: Formula, shown: bool = False) -> str:
    """Both sides, see `written`."""
    return f"{written(formula[0], shown)} {'=' if shown else '=='} {written(formula[1], shown)}"


# ---------------------------------------------------------------------- values
@dataclass(frozen=True)
class Value:
    """A dense array (a number where the spaces are None), its codomain and domain; those of an I that has none yet are "any"."""

    array: np.ndarray
    codomain: str | None
    domain: str | None


class DenseLetters(Mapping[str, Value]):
    """The letters of a model at its state, as dense arrays; the duals of their spaces."""

    def __init__(self, model: Any):
        self._operators = model.soa
        self._values: dict[Any, Value] = {}
        self.dual: dict[str | None, str | None] = {None: None, "any": "any"}
        self._plain = [name for name in SYMBOLS if name not in (*_INDEXED, "MM", "I", "N")]
        H, phi, M = model.soa("H phi M")
        self._store("MM", H @ phi @ M @ phi.T @ H.T)
        self._values["I"] = Value(np.eye(1), "any", "any")
        self._values["N"] = Value(np.array(float(model.nv)), None, None)
        for name in self._plain:
            self._store(name, getattr(model.soa, name))

    def _store(self, key: Any, operator: _core.Operator) -> None:
        self._values[key] = Value(np.asarray(operator.dense(), float), operator.codomain.name, operator.domain.name)
        turned = operator.T
        self.dual |= {operator.codomain.name: turned.domain.name, operator.domain.name: turned.codomain.name}

    def of(self, letter: Letter) -> Value:
        """The value of a letter, with arguments or without."""
        if not letter.arguments:
            return self[letter.name]
        key = (letter.name, *letter.arguments)
        if key not in self._values:
            try:
                made = getattr(self._operators, letter.name)
                self._store(key, made(letter.arguments[0]) if letter.name == "Delta" else made(list(letter.arguments)))
            except (_core.Error, ArithmeticError) as error:
                raise Misfit from error
        return self._values[key]

    def __getitem__(self, name: str) -> Value:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(["MM", "I", *self._plain])

    def __len__(self) -> int:
        return len(self._plain) + 2


def evaluate(node: Node, letters: DenseLetters) -> Value:
    """The value of a formula; raises Misfit where spaces do not fit."""
    match node:
        case Letter():
            return letters.of(node)
        case Number(value=value):
            return Value(np.array(float(value)), None, None)
        case Star(inner=inner):
            value = evaluate(inner, letters)
            if value.domain is None:
                raise Misfit
            return Value(value.array.T, letters.dual[value.domain], letters.dual[value.codomain])
        case Power(inner=inner, exponent=exponent):
            return _power(evaluate(inner, letters), exponent, letters)
        case Call(function=function, inner=inner):
            return _function(function, evaluate(inner, letters), inner)
        case Product(factors=factors):
            value = evaluate(factors[0], letters)
            for factor in factors[1:]:
                value = _times(value, evaluate(factor, letters))
            return value
        case Sum(terms=terms, signs=signs):
            values = [evaluate(term, letters) for term in terms]
            return _sum(values, signs)
    raise AssertionError(node)


def _times(a: Value, b: Value) -> Value:
    if a.domain is None or b.domain is None:
        return Value(a.array * b.array, a.codomain or b.codomain, a.domain or b.domain)
    if "any" in (a.domain, b.domain):
        made = a if b.domain == "any" else b
        return Value(a.array[0, 0] * b.array if made is b else a.array * b.array[0, 0], made.codomain, made.domain)
    if a.domain != b.codomain:
        raise Misfit
    return Value(a.array @ b.array, a.codomain, b.domain)


def _sum(values: list[Value], signs: tuple[int, ...]) -> Value:
    known = {(v.codomain, v.domain) for v in values if v.domain != "any"}
    if len(known) > 1:
        raise Misfit
    if not known:
        return Value(np.sum([s * v.array for v, s in zip(values, signs, strict=True)], axis=0), "any", "any")
    ((codomain, domain),) = known
    shape = next(v.array.shape for v in values if v.domain != "any")
    if any(v.domain == "any" for v in values) and (domain is None or codomain != domain):
        raise Misfit
    arrays = [v.array if v.domain != "any" else v.array[0, 0] * np.eye(shape[0]) for v in values]
    return Value(np.sum([s * a for a, s in zip(arrays, signs, strict=True)], axis=0), codomain, domain)


def _power(value: Value, exponent: int, letters: DenseLetters) -> Value:
    if value.domain is None or value.array.shape[0] != value.array.shape[1] or abs(exponent) > 50:
        raise Misfit
    if exponent != -1 and value.codomain != value.domain:
        raise Misfit
    try:
        made = np.linalg.matrix_power(value.array, exponent)
    except np.linalg.LinAlgError as error:
        raise Misfit from error
    if exponent < 0 and not np.linalg.cond(value.array) < 1e12:
        raise Misfit
    return Value(made, value.domain, value.codomain)


def _function(function: str, value: Value, inner: Node) -> Value:
    if value.domain in (None, "any"):
        raise Misfit
    square = value.array.shape[0] == value.array.shape[1]
    if function == "norm":
        return Value(np.array(np.linalg.norm(value.array)), None, None)
    if not square:
        raise Misfit
    if function == "trace":
        return Value(np.array(np.trace(value.array)), None, None)
    if function == "logdet":
        return Value(np.array(np.linalg.slogdet(value.array)[1]), None, None)
    if function == "blockdiag" and len(value.array) % 6 == 0:
        blocks = np.kron(np.eye(len(value.array) // 6), np.ones((6, 6)))
        return Value(value.array * blocks, value.codomain, value.domain)
    if function == "sqrt":
        try:
            return Value(np.linalg.cholesky(value.array), value.codomain, value.domain)
        except np.linalg.LinAlgError as error:
            raise Misfit from error
    raise Misfit


def residual(formula: Formula, letters: DenseLetters) -> float:
    """How far both sides are apart relative to the larger; infinite where both are zero, or one is and is not said to be.

    Raises Misfit where spaces do not fit.
    """
    left, right = evaluate(formula[0], letters), evaluate(formula[1], letters)
    said_zero = [side == Number(Fraction(0)) for side in formula]
    if not any(said_zero):
        both = _sum([left, right], (1, -1))
        size = max(np.abs(left.array).max(initial=0.0), np.abs(right.array).max(initial=0.0))
        return float(np.abs(both.array).max(initial=0.0) / size) if 1e-9 < size < np.inf else np.inf
    other = right if said_zero[0] else left
    return float(np.abs(other.array).max(initial=0.0))
