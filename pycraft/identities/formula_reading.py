"""Text to formulas: the syntax tree of a statement, in Python's reading or the book's, whether its spaces fit or not."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from functools import lru_cache

from .determinant_equations import as_logarithms
from .formula import FUNCTIONS, INDEXED, SYMBOLS, Call, Formula, Letter, Node, Number, Power, Star, inverted, product, starred, total
from .inequalities import related
from .part_letters import HYBRID, OF_ROTORS, OF_TREES
from .spelling import spelled
from .standard_letters import GUARDED, STANDARD
from .vocabulary import ParseError, decimal

_PLAIN = (set(SYMBOLS) - set(INDEXED)) | {"X", "V", "vdot", *STANDARD, *HYBRID, *OF_TREES, *OF_ROTORS}
LETTERS = frozenset(_PLAIN | {f"{name}_dot" for name in _PLAIN - {"I", "N"} if not name.endswith("dot")})
"""Letters that formulas have without definitions."""


def read_formula(text: str, own: Iterable[str] = ()) -> Formula:
    """Both sides of a statement, `own` the names of letters that were defined for it.

    Python's reading where the text has `@`, `.T` or a call of `inv`, else the book's.

    Raises ParseError where it is no statement.
    """
    source = as_logarithms(spelled(text).text)
    is_python = re.search(r"@|\.T\b|\.inv\(|\binv\(", source) and "^" not in source
    sides = re.split(r"==?", source)
    if related(source)[0] != "=":
        raise ParseError(f"{text!r} is an inequality: pycraft.check, pycraft.truth and pycraft.prove take it")
    if len(sides) != 2:
        raise ParseError(f"{text!r} has {'one side' if len(sides) == 1 else 'more than two sides'}; a statement is lhs == rhs")
    defined = frozenset(own)
    left, right = (_python(side, LETTERS | defined) if is_python else Book(side, defined).whole() for side in sides)
    return left, right


def _python(source: str, names: frozenset[str]) -> Node:
    try:
        return _from_ast(ast.parse(source.strip(), mode="eval").body, names)
    except SyntaxError as error:
        raise ParseError(f"not understood: {source.strip()!r}") from error


def _from_ast(node: ast.AST, names: frozenset[str]) -> Node:
    match node:
        case ast.Constant(value=int() | float() as value):
            return Number(decimal(str(value)))
        case ast.Name(id=name) if name in names:
            return Letter(name)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return total([(-1, _from_ast(inner, names))])
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return total([(1, _from_ast(left, names)), (1, _from_ast(right, names))])
        case ast.BinOp(left=left, op=ast.Sub(), right=right):
            return total([(1, _from_ast(left, names)), (-1, _from_ast(right, names))])
        case ast.BinOp(left=left, op=ast.Mult() | ast.MatMult(), right=right):
            return product(_from_ast(left, names), _from_ast(right, names))
        case ast.BinOp(left=left, op=ast.Div(), right=ast.Constant(value=int() | float() as value)):
            return product(Number(1 / decimal(str(value))), _from_ast(left, names))
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return Power(_from_ast(left, names), int(ast.literal_eval(right)))
        case ast.Attribute(value=inner, attr="T"):
            return Star(_from_ast(inner, names))
        case ast.Call(func=ast.Attribute(value=inner, attr=method), args=[]) if method in FUNCTIONS:
            return _call(method, _from_ast(inner, names))
        case ast.Call(func=ast.Name(id=name), args=[inner]) if name in FUNCTIONS:
            return _call(name, _from_ast(inner, names))
        case ast.Call(func=ast.Name(id=name), args=arguments) if name in INDEXED:
            return Letter(name, tuple(ast.unparse(a) for a in arguments))
    raise ParseError(f"{ast.unparse(node)!r} is no operator expression")


def _call(function: str, inner: Node) -> Node:
    return Power(inner, -1) if function == "inv" else Call({"tr": "trace"}.get(function, function), inner)


@lru_cache(maxsize=32)
def _tokens(letters: frozenset[str]) -> re.Pattern[str]:
    names = "|".join((r"(?<![A-Za-z])" if n in GUARDED else "") + re.escape(n) for n in sorted(letters, key=lambda n: (-len(n), n)))
    functions = "|".join(FUNCTIONS)
    return re.compile(
        rf"\s*(?:(?P<number>\d+\.?\d*(?:[eE][+-]?\d+)?)|(?P<function>(?:{functions})\b|√)|(?P<indexed>(?:{'|'.join(INDEXED)})\s*\([^()]*\))"
        rf"|(?P<name>{names})|(?P<power>\^\s*-?\d+|\*\*\s*-?\d+)|(?P<star>\^\*|\^T|\.T|'|\*)|(?P<inverse>\.inv\(\))|(?P<root>\^½|\.sqrt\(\))"
        rf"|(?P<other>[-+()\[\]{{}}@·/]))"
    )


class Book:
    """The book's reading: juxtaposition multiplies, a postfix star transposes."""

    def __init__(self, source: str, own: frozenset[str] = frozenset()):
        self._own, self._names = own, LETTERS | own
        self._tokens: list[tuple[str, str]] = []
        self._places: list[int] = []
        self._end = len(source)
        at = 0
        while source[at:].strip():
            found = self._token(source, at)
            if found is None:
                raise self._stumbled(f"not understood at {source[at : at + 12].strip()!r}", at)
            self._tokens.append(found[:2])
            self._places.append(at)
            at = found[2]

    def _token(self, source: str, at: int) -> tuple[str, str, int] | None:
        """(kind, text, where it ends) of what stands at a place."""
        found = _tokens(self._names).match(source, at)
        return None if found is None else (str(found.lastgroup), found[str(found.lastgroup)], found.end())

    def _stumbled(self, message: str, at: int) -> ParseError:
        """The error of what stands at a place."""
        return ParseError(message)

    def _take(self) -> tuple[str, str]:
        if not self._tokens:
            raise self._stumbled("not understood at its end", self._end)
        self._places.pop(0)
        return self._tokens.pop(0)

    @property
    def _at(self) -> int:
        return self._places[0] if self._places else self._end

    def whole(self) -> Node:
        node = self._sum()
        if self._tokens:
            raise self._stumbled(f"not understood at {self._next()[1]!r}", self._at)
        return node

    def _next(self) -> tuple[str, str]:
        return self._tokens[0] if self._tokens else ("end", "")

    def _sum(self) -> Node:
        terms = []
        while True:
            sign = 1
            while self._next()[1] in ("+", "-"):
                sign = -sign if self._take()[1] == "-" else sign
            terms.append((sign, self._product()))
            if self._next()[1] not in ("+", "-"):
                return total(terms)

    def _product(self) -> Node:
        factors: list[Node] = []
        while True:
            kind, text = self._next()
            if text in ("@", "·"):
                self._take()
            elif text == "/":
                self._take()
                factors.insert(0, Number(1 / decimal(self._take()[1])))
            elif self._starts_factor(kind, text):
                factors.append(self._postfix())
            else:
                break
        if not factors:
            raise self._stumbled(f"not understood at {text!r}" if text else "not understood at its end", self._at)
        return product(*factors)

    def _starts_factor(self, kind: str, text: str) -> bool:
        return kind in ("number", "function", "indexed", "name") or text in ("(", "[", "{")

    def _postfix(self) -> Node:
        node = self._atom()
        while self._next()[0] in ("star", "power", "inverse", "root"):
            kind, text = self._take()
            if kind == "star":
                node = starred(node)
            elif kind == "power":
                exponent = int(text.lstrip("^*").strip())
                node = inverted(node) if exponent == -1 else Power(node, exponent)
            else:
                node = Power(node, -1) if kind == "inverse" else Call("sqrt", node)
        return node

    def _atom(self) -> Node:
        kind, text = self._take()
        if kind == "number":
            return Number(decimal(text))
        if kind == "name":
            return Letter(text if text in self._own else {"X": "X_world", "V": "velocity"}.get(text, text))
        if kind == "indexed":
            name, _, arguments = text.partition("(")
            return Letter(name.strip(), tuple(a.strip().strip("'\"") for a in arguments[:-1].split(",")))
        if kind == "function":
            if self._next()[1] not in ("(", "[", "{"):  # tr ΥM, ln det D: what follows; √D: the one factor
                return _call("sqrt", self._postfix()) if text == "√" else _call(text, self._product())
            self._take()
            node = self._sum()
            self._close()
            return _call({"√": "sqrt"}.get(text, text), node)
        node = self._sum()
        self._close()
        return node

    def _close(self) -> None:
        if self._next()[1] not in (")", "]", "}"):
            raise self._stumbled("a bracket is not closed", self._at)
        self._take()
