"""Statements as text: Python's spelling, the book's (Unicode or ASCII, juxtaposition and a postfix star), or LaTeX.

Both readings are tried, Python's (``*`` and ``@`` multiply, ``.T`` transposes) and the book's (juxtaposition multiplies, a postfix ``*``
transposes); the one whose names and spaces fit is taken. Where both fit and differ, the error shows both. In both ``**`` is Python's power.
In the book's reading the numbers in front of a product scale the whole of it: 2 D D is 2 (D D), as it is shown.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any

from lark import Lark, Token, Transformer, exceptions

from .. import _core

_FUNCTIONS = {
    "inv": lambda x: x.inv(),
    "blockdiag": _core.blockdiag,
    "sqrt": lambda x: x.sqrt(),
    "trace": lambda x: x.trace(),
    "tr": lambda x: x.trace(),
    "logdet": lambda x: x.logdet(),
    "norm": lambda x: x.norm(),
}
_WITH_ARGUMENTS = ("B", "Jacobian", "Lambda", "Delta")
# Symbols in the order of the core's table: (ascii, unicode, latex, domain, codomain, meaning).
_TABLE = _core.symbol_table()
_NAMES = {entry[0] for entry in _TABLE}

# What stands for a letter in ASCII where its own name is another: X, V.
_ALIASES = {shown: name for name, shown, *_ in _TABLE if shown != name and shown.isascii()}
_LARGEST_POWER = 1000

_BOOK = r"""
start: side (("==" | "=") side)?
side: sum
sum: (PLUS | MINUS)? term ((PLUS | MINUS) term)*
term: (number* product | number+) ("/" NUMBER)?
number: NUMBER ("*" | _TIMES)?
product: postfix (_TIMES? postfix)*
postfix: atom suffix*
suffix: (_STAR | "^*" | "^T" | ".T" | "'") -> star
      | ("^" EXPONENT | "**" POWER) -> power
      | ".inv()" -> inverse
      | ("^½" | ".sqrt()") -> root
      | "^-½" -> inverse_root
atom: NAME -> name
    | FUNCTION "(" sum ")" -> function
    | INDEXED "(" ARGUMENT ("," ARGUMENT)* ")" -> indexed
    | "(" sum ")" -> group
    | "[" sum "]" -> group
    | "{" sum "}" -> group
PLUS: "+"
MINUS: "-"
_TIMES: "@" | "·"
_STAR: /\*(?!\*[\w(\[{-])/
NUMBER: /\d+(\.\d*)?([eE][+-]?\d+)?/
EXPONENT: /-?\d+/
POWER: /-?\d+(?!\d|\s*\*\*)/
ARGUMENT: /[^(),]+/
FUNCTION.3: /(%(functions)s)(?=\s*\()/
INDEXED.3: /(%(indexed)s)(?=\s*\()/
NAME.2: /%(names)s/
%%import common.WS
%%ignore WS
"""


class ParseError(_core.EvaluationError):
    """A statement that cannot be read, or that can be read in two ways."""


@dataclass
class Statement:
    """Two sides, as expressions of one model, and the text they were read from. A lone expression has no right side."""

    lhs: Any
    rhs: Any
    text: str
    reading: str


class Statements:
    """Reads statements on the letters of one model."""

    def __init__(self, operators: Any, extra: Mapping[str, Any] | None = None):
        H, phi, M = operators("H phi M")
        self._extra = {"MM": H @ phi @ M @ phi.T @ H.T, "I": operators.I, "N": operators.Theta.dimension, **(extra or {})}
        self._operators = operators

    def read(self, text: str) -> Statement:
        """The statement, by the one reading whose names and spaces fit.

        Raises
        ------
        ParseError
            Nothing fits (the reasons of both readings are shown), or both do.
        """
        found: list[Statement] = []
        reasons: list[str] = []
        for reading in ("python", "book"):
            try:
                found.append(self._read(text, reading))
            # The core's errors of names, spaces and models are TypeErrors and ValueErrors; what Python finds wrong reads no better.
            except (TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
                reasons.append(f"  read as {'Python' if reading == 'python' else 'the book'}: {error}")
        if not found:
            raise ParseError(f"{text!r} does not read as a statement of operators.\n" + "\n".join(dict.fromkeys(reasons)))
        first = found[0]
        if len(found) == 2 and not (_same(first.lhs, found[1].lhs) and _same(first.rhs, found[1].rhs)):
            shown = "\n".join(f"  {s.reading}: {_text(s.lhs)} = {_text(s.rhs)}" for s in found)
            raise ParseError(f"{text!r} reads in two ways and both fit:\n{shown}\nwrite .T for a transpose, or juxtapose to multiply")
        return first

    def _read(self, text: str, reading: str) -> Statement:
        source = book_text(text)
        sides = self._read_python(source) if reading == "python" else self._read_book(source)
        lhs, rhs = sides if len(sides) == 2 else (sides[0], None)
        lhs, rhs = _balance(lhs, rhs), _balance(rhs, lhs) if rhs is not None else None
        if rhs is not None:
            _check_same_spaces(lhs, rhs)
        return Statement(lhs, rhs, text, "Python" if reading == "python" else "the book")

    # ------------------------------------------------------------------ Python's reading: Python's own parser
    def _read_python(self, source: str) -> list[Any]:
        try:
            tree = ast.parse(re.sub(r"(?<![=<>!])=(?!=)", "==", source), mode="eval").body
        except SyntaxError as error:
            raise ParseError(f"not understood at {source[max(0, (error.offset or 1) - 1) :][:12]!r}") from None
        if isinstance(tree, ast.Compare):
            if len(tree.ops) != 1 or not isinstance(tree.ops[0], ast.Eq):
                raise ParseError("a statement is lhs == rhs")
            return [self._evaluate(tree.left), self._evaluate(tree.comparators[0])]
        return [self._evaluate(tree)]

    def _name(self, name: str) -> Any:
        if name in self._extra:
            return self._extra[name]
        if name in _WITH_ARGUMENTS or name not in _NAMES and name not in _ALIASES:
            raise ParseError(f"no operator is called {name!r}")
        return getattr(self._operators, _ALIASES.get(name, name))

    def _evaluate(self, node: ast.AST) -> Any:
        match node:
            case ast.Constant(value=int() | float() as value):
                return float(value)
            case ast.Name(id=name):
                return self._name(name)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -self._evaluate(inner)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return _power(self._evaluate(left), self._evaluate(right))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                return _combine(_BINARY[type(op)], self._evaluate(left), self._evaluate(right))
            case ast.Attribute(value=inner, attr="T"):
                return self._evaluate(inner).T
            case ast.Call(func=ast.Attribute(value=inner, attr=("inv" | "sqrt" | "trace" | "logdet" | "norm") as method), args=[]):
                return getattr(self._evaluate(inner), method)()
            case ast.Call(func=ast.Name(id=name), args=[inner]) if name in _FUNCTIONS:
                return _FUNCTIONS[name](self._evaluate(inner))
            case ast.Call(func=ast.Name(id=name), args=arguments) if name in _WITH_ARGUMENTS:
                return _indexed(self._operators, name, [ast.unparse(a) for a in arguments])
        raise ParseError(f"{ast.unparse(node)!r} is no operator expression")

    # ------------------------------------------------------------------ the book's reading
    def _read_book(self, source: str) -> list[Any]:
        names = tuple(sorted({*(_NAMES - set(_WITH_ARGUMENTS)), *_ALIASES, *self._extra}))
        try:
            return _Evaluate(self).transform(_parser(names).parse(source))
        except exceptions.VisitError as error:
            if isinstance(error.orig_exc, (_core.Error, ParseError)):
                raise error.orig_exc from None
            raise ParseError(str(error.orig_exc)) from None
        except exceptions.UnexpectedInput as error:
            at = getattr(error, "pos_in_stream", None)
            raise ParseError(
                f"not understood at {source[at : at + 12]!r}" if at is not None and at < len(source) else "not understood at its end"
            ) from None


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


def _power(base: Any, exponent: Any) -> Any:
    if not isinstance(exponent, (int, float)) or not abs(exponent) <= _LARGEST_POWER or exponent != int(exponent):
        raise ParseError(f"a power is a whole number up to {_LARGEST_POWER}")
    return base ** int(exponent)


def _indexed(operators: Any, name: str, arguments: list[str]) -> Any:
    arguments = [a.strip().strip("'\"") for a in arguments]
    if name == "Delta":
        return operators.Delta(int(arguments[0]) if arguments[0].isdigit() else arguments[0])
    return getattr(operators, name)(arguments)


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
    return "" if side is None else side.text() if hasattr(side, "text") else f"{side:g}"


def _balance(side: Any, other: Any) -> Any:
    """0 and I take the spaces of the other side; numbers beside a scalar become scalars."""
    if isinstance(other, _core.Operator) and other.domain is not None:
        if isinstance(side, (int, float)) and side == 0:
            return _core.zero(other.domain, other.codomain)
        if isinstance(side, _core.Operator) and side.domain is None:
            return side @ _core.identity(other.domain)
    if isinstance(other, _core.Scalar) and isinstance(side, (int, float)):
        return _core.scalar(float(side))
    return side


def _check_same_spaces(lhs: Any, rhs: Any) -> None:
    if isinstance(lhs, _core.Operator) != isinstance(rhs, _core.Operator):
        raise _core.SpaceError(f"{_text(lhs)} and {_text(rhs)}: one is an operator, the other a number")
    if isinstance(lhs, _core.Operator):
        check_has_space(lhs, rhs)
        lhs - rhs  # raises where the spaces differ
    elif not isinstance(lhs, _core.Scalar) and not isinstance(rhs, _core.Scalar):
        raise ParseError("a statement about numbers alone")


def check_has_space(lhs: _core.Operator, rhs: _core.Operator) -> None:
    """Raises where neither side says on which space its I acts."""
    if lhs.domain is None and rhs.domain is None:
        raise _core.SpaceError(f"{lhs.text()} = {rhs.text()} is said of no space: an I takes its space from an operator beside it")


@lru_cache(maxsize=4)
def _parser(names: tuple[str, ...]) -> Lark:
    longest_first = sorted(names, key=lambda n: (-len(n), n))
    grammar = _BOOK % {
        "functions": "|".join(sorted(_FUNCTIONS, key=len, reverse=True)),
        "indexed": "|".join(_WITH_ARGUMENTS),
        "names": "(" + "|".join(re.escape(n) for n in longest_first) + ")",
    }
    return Lark(grammar, parser="earley", lexer="dynamic")


def _symbol_patterns() -> list[tuple[str, str]]:
    """LaTeX of every letter of the core's table, as it is shown, to its ASCII name: the longest first."""
    entries = [(latex, name) for name, _, latex, *_ in _TABLE if not latex.isalnum()]
    ends = r"(?![A-Za-z])"
    return [
        (re.escape(latex) + (ends if latex[-1].isalpha() else ""), f" {name} ")
        for latex, name in sorted(entries, key=lambda entry: -len(entry[0]))
    ]


def _with_arguments(found: re.Match[str]) -> str:
    r"""Γ_{\mathrm{a\_b, c}} as Γ(a_b, c)."""
    return "(" + re.sub(r"\\(.)", r"\1", found[1]) + ")"


_LATEX: list[tuple[str, Any]] = [
    (r"_\{\\mathrm\{((?:[^{}\\]|\\.)*)\}\}", _with_arguments),
    (r"(\d)\s*\\cdot\s*10\^\{(-?\d+)\}", r"\1e\2"),
    (r"\\cdot(?![A-Za-z])", "·"),
    (r"\\left|\\right|\\displaystyle|\\mathrm|\\!|\\,|\\;|\\:|\\ |\\quad|\$|&|~", " "),
    (r"\\operatorname\{(\w+)\}", r" \1 "),
    (r"\\ln\s*\\det", " logdet "),
    (r"\{\s*(\\[A-Za-z]+)\s*\}", r"\1"),  # \tilde{\phi}, \mathcal{E}_{\phi}
    (r"\\(tilde|bar)\\mathcal\{V\}", r" V_\1 "),
    (r"\\mathcal\{M\}|\\mathscr\{M\}", " MM "),
    (r"P\^\+", " P_plus "),
    *_symbol_patterns(),
    (r"\\mathcal\{(\w)\}", r" \1 "),
    (r"\^\{\s*\*\s*\}|\^\s*\*|\^\{\s*\\top\s*\}|\^\\top|\^\{T\}", " ^* "),
    (r"\^\{\s*(-?)\s*1\s*/\s*2\s*\}", r" ^\1½ "),
    (r"\^\{\s*(-?)\s*(\d+)\s*\}", r" ^\1\2 "),
    (r"\^\s*-\s*1", " ^-1 "),
]
_LETTERS = [
    *sorted(((shown, f" {name} ") for name, shown, *_ in _TABLE if not shown.isascii()), key=lambda entry: -len(entry[0])),
    ("ℳ", " MM "), ("−", "-"), ("×", "@"), ("⁻¹", "^-1"), ("²", "^2"), ("ᵀ", " ^* "), ("∗", "*"), ("ln det", "logdet"),
]  # fmt: skip


def book_text(text: str) -> str:
    """Unicode and LaTeX brought to the ASCII names that the grammar knows."""
    import unicodedata

    text = unicodedata.normalize("NFC", text)
    if "\\" in text or "{" in text:
        for pattern, replacement in _LATEX:
            text = re.sub(pattern, replacement, text)
    for letter, name in _LETTERS:
        text = text.replace(unicodedata.normalize("NFC", letter), name)
    text = re.sub(r"\s+(\*\*|\^)", r"\1", text)
    # A star, an inverse or a transpose belongs to what stands before it.
    text = re.sub(r"\s+(\*(?=\s*($|[)\]}=+\-*])))", r"\1", text)
    return text.strip()


class _Evaluate(Transformer):
    """From the syntax tree to expressions."""

    def __init__(self, statements: Statements):
        super().__init__()
        self._statements = statements

    def start(self, sides):
        return sides

    def side(self, parts):
        return parts[0]

    def group(self, parts):
        return parts[0]

    def sum(self, parts):
        total, negative = None, False
        for part in parts:
            if isinstance(part, Token):
                negative = part == "-"
                continue
            numbers, operators, divisor = part
            # A sign in front belongs to the number after it, as in Python: -2φ is (-2)φ, but ψ - 2φ is ψ - (2φ).
            if negative and total is None and numbers:
                numbers, negative = [-numbers[0], *numbers[1:]], False
            value = reduce(operator.matmul, operators) if operators else numbers.pop()
            for number in reversed(numbers):
                value = number * value
            value = value if divisor is None else value / divisor
            value = -value if negative else value
            total = value if total is None else total + value
            negative = False
        return total

    def term(self, parts):
        """Numbers, operators, divisor: the numbers scale the whole product."""
        divisor = float(parts.pop()) if isinstance(parts[-1], Token) else None
        factors = parts.pop() if isinstance(parts[-1], list) else []
        operators = [f for f in factors if isinstance(f, _core.Operator)]
        return [*parts, *(f for f in factors if not isinstance(f, _core.Operator))], operators, divisor

    def number(self, parts):
        return float(parts[0])

    def product(self, parts):
        return list(parts)

    def postfix(self, parts):
        value = parts[0]
        for suffix in parts[1:]:
            value = suffix(value)
        return value

    def star(self, _):
        return lambda x: x.T

    def inverse(self, _):
        return lambda x: x.inv()

    def power(self, parts):
        return lambda x: _power(x, int(parts[0]))

    def root(self, _):
        return lambda x: x.sqrt()

    def inverse_root(self, _):
        return lambda x: x.sqrt().inv()

    def name(self, parts):
        return self._statements._name(str(parts[0]))

    def function(self, parts):
        return _FUNCTIONS[str(parts[0])](parts[1])

    def indexed(self, parts):
        return _indexed(self._statements._operators, str(parts[0]), [str(a) for a in parts[1:]])
