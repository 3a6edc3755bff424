"""Statements as text: Python's spelling, the book's (Unicode or ASCII, juxtaposition and a postfix star), or LaTeX.

Both readings are tried, Python's (``*`` and ``@`` multiply, ``.T`` transposes) and the book's (juxtaposition multiplies, a postfix ``*``
transposes); the one whose names and spaces fit is taken. Where both fit and differ, the error shows both.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
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

_BOOK = r"""
start: side (("==" | "=") side)?
side: sum
sum: (PLUS | MINUS)? term ((PLUS | MINUS) term)*
term: factor (_TIMES? factor)* ("/" NUMBER)?
factor: NUMBER "*"? -> number
      | postfix
postfix: atom suffix*
suffix: "*" -> star
      | "^*" -> star
      | "^T" -> star
      | ".T" -> star
      | "'" -> star
      | "⁻¹" -> inverse
      | "^-1" -> inverse
      | "**-1" -> inverse
      | ".inv()" -> inverse
      | "²" -> square
      | "^" INT -> power
atom: NAME -> name
    | FUNCTION "(" sum ")" -> function
    | INDEXED "(" ARGUMENT ("," ARGUMENT)* ")" -> indexed
    | "(" sum ")" -> group
    | "[" sum "]" -> group
    | "{" sum "}" -> group
PLUS: "+"
MINUS: "-"
_TIMES: "@" | "·"
NUMBER: /\d+(\.\d*)?([eE][+-]?\d+)?/
INT: /\d+/
ARGUMENT: /[A-Za-z_][\w.\/-]*|\d+/
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
            except (ParseError, _core.SpaceError, _core.ModelError) as error:
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
        if name in _WITH_ARGUMENTS or name not in _NAMES:
            raise ParseError(f"no operator is called {name!r}")
        return getattr(self._operators, name)

    def _evaluate(self, node: ast.AST) -> Any:
        match node:
            case ast.Constant(value=int() | float() as value):
                return float(value)
            case ast.Name(id=name):
                return self._name(name)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -self._evaluate(inner)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                exponent = self._evaluate(right)
                if exponent != int(exponent):
                    raise ParseError("an operator's power is a whole number")
                return self._evaluate(left) ** int(exponent)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                return _combine(_BINARY[type(op)], self._evaluate(left), self._evaluate(right))
            case ast.Attribute(value=inner, attr="T"):
                return self._evaluate(inner).T
            case ast.Call(func=ast.Attribute(value=inner, attr=("inv" | "sqrt" | "trace" | "logdet" | "norm") as method), args=[]):
                return getattr(self._evaluate(inner), method)()
            case ast.Call(func=ast.Name(id=name), args=[inner]) if name in _FUNCTIONS:
                return _FUNCTIONS[name](self._evaluate(inner))
            case ast.Call(func=ast.Name(id=name), args=arguments) if name in _WITH_ARGUMENTS:
                return _indexed(self._operators, name, [ast.unparse(a).strip("'\"") for a in arguments])
        raise ParseError(f"{ast.unparse(node)!r} is no operator expression")

    # ------------------------------------------------------------------ the book's reading
    def _read_book(self, source: str) -> list[Any]:
        names = tuple(sorted({*(_NAMES - set(_WITH_ARGUMENTS)), *self._extra}))
        try:
            return _Evaluate(self._operators, self._extra).transform(_parser(names).parse(source))
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


def _indexed(operators: Any, name: str, arguments: list[str]) -> Any:
    if name == "Delta":
        return operators.Delta(int(arguments[0]) if arguments[0].isdigit() else arguments[0])
    return getattr(operators, name)(arguments)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, _core.Operator) and isinstance(b, _core.Operator):
        return a == b or _core.equal_by_theorems(a, b) and a.text() == b.text()
    return type(a) is type(b) and a == b


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
        lhs - rhs  # raises where the spaces differ
    elif not isinstance(lhs, _core.Scalar) and not isinstance(rhs, _core.Scalar):
        raise ParseError("a statement about numbers alone")


@lru_cache(maxsize=4)
def _parser(names: tuple[str, ...]) -> Lark:
    longest_first = sorted(names, key=lambda n: (-len(n), n))
    grammar = _BOOK % {
        "functions": "|".join(sorted(_FUNCTIONS, key=len, reverse=True)),
        "indexed": "|".join(_WITH_ARGUMENTS),
        "names": "(" + "|".join(re.escape(n) for n in longest_first) + ")",
    }
    return Lark(grammar, parser="earley", lexer="dynamic")


_LATEX = [
    (r"\\left|\\right|\\displaystyle|\\mathrm|\\!|\\,|\\;|\\:|\\ |\\quad|\$|&|~", " "),
    (r"\\operatorname\{(\w+)\}", r" \1 "),
    (r"\\ln\s*\\det", " logdet "),
    (r"\\mathcal\{M\}|\\mathscr\{M\}", " MM "),
    (r"\\mathscr\{B\}", " momentum_cross "),
    (r"\\mathcal\{E\}_\{?\\phi\}?", " E "),
    (r"\\mathcal\{E\}_\{?\\psi\}?", " E_psi "),
    (r"\\mathcal\{E\}", " E "),
    (r"\\(tilde|bar)\{?\\(phi|psi|tau)\}?", r" \2_\1 "),
    (r"\\(tilde|bar)\{?\\mathcal\{V\}\}?", r" V_\1 "),
    (r"\\Delta_\{\\dot\\theta\}", " Delta_theta_dot "),
    (r"\\(phi|psi|tau|Upsilon|Omega|Lambda|Delta)", r" \1 "),
    (r"\\mathcal\{(\w)\}", r" \1 "),
    (r"P\^\{\+\}|P\^\+", " P_plus "),
    (r"\^\{\s*\*\s*\}|\^\s*\*|\^\{\s*\\top\s*\}|\^\\top|\^\{T\}", " ^* "),
    (r"\^\{\s*-1\s*\}|\^\s*-\s*1", " ^-1 "),
    (r"\^\{1/2\}", " .sqrt() "),
]
_LETTERS = [
    ("E_φ", " E "), ("E_ψ", " E_psi "), ("φ̃", " phi_tilde "), ("ψ̃", " psi_tilde "), ("τ̄", " tau_bar "),
    ("P⁺", " P_plus "), ("Δ_θ̇", " Delta_theta_dot "), ("Ṽ", " V_tilde "), ("V̄", " V_bar "),
    ("𝓑", " momentum_cross "), ("𝒥", " Jacobian "), ("φ", " phi "), ("ψ", " psi "), ("τ", " tau "),
    ("Υ", " Upsilon "), ("Ω", " Omega "), ("Λ", " Lambda "), ("Δ", " Delta "), ("ℳ", " MM "), ("−", "-"), ("×", "@"),
    ("⁻¹", "^-1"), ("ᵀ", " ^* "), ("∗", "*"), ("ln det", "logdet"),
]  # fmt: skip


def book_text(text: str) -> str:
    """Unicode and LaTeX brought to the ASCII names that the grammar knows."""
    import unicodedata

    text = unicodedata.normalize("NFC", text)
    if "\\" in text:
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

    def __init__(self, operators: Any, extra: Mapping[str, Any]):
        super().__init__()
        self._operators, self._extra = operators, extra

    def start(self, sides):
        return sides

    def side(self, parts):
        return parts[0]

    def group(self, parts):
        return parts[0]

    def sum(self, parts):
        total, sign = None, 1
        for part in parts:
            if isinstance(part, Token):
                sign = -1 if part == "-" else 1
                continue
            value = part if sign == 1 else -part
            total = value if total is None else total + value
            sign = 1
        return total

    def term(self, parts):
        product = parts[0]
        for part in parts[1:]:
            if isinstance(part, Token):
                product = product / float(part)
            elif isinstance(product, _core.Operator) and isinstance(part, _core.Operator):
                product = product @ part
            else:
                product = product * part
        return product

    def factor(self, parts):
        return parts[0]

    def number(self, parts):
        return float(parts[0])

    def postfix(self, parts):
        value = parts[0]
        for suffix in parts[1:]:
            value = suffix(value)
        return value

    def star(self, _):
        return lambda x: x.T

    def inverse(self, _):
        return lambda x: x.inv()

    def square(self, _):
        return lambda x: x**2

    def power(self, parts):
        return lambda x: x ** int(parts[0])

    def name(self, parts):
        name = str(parts[0])
        return self._extra[name] if name in self._extra else getattr(self._operators, name)

    def function(self, parts):
        return _FUNCTIONS[str(parts[0])](parts[1])

    def indexed(self, parts):
        return _indexed(self._operators, str(parts[0]), [str(a) for a in parts[1:]])
