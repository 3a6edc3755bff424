"""The book's reading of statements: juxtaposition multiplies, a postfix star transposes, tr ΥM and √D need no parentheses.

The numbers in front of a product scale the whole of it: 2 D D is 2 (D D), as it is shown.
"""

from __future__ import annotations

import re
from fractions import Fraction
from functools import lru_cache, reduce
from typing import Any

from lark import Lark, Token, Transformer, Tree, exceptions

from .. import _core
from .standard_letters import GUARDED
from .vocabulary import FUNCTIONS, SCALARS, WITH_ARGUMENTS, Misread, ParseError, Vocabulary, decimal, is_operator, power

_BOOK = r"""
start: side (("==" | "=") side)?
side: sum
sum: (PLUS | MINUS)? term ((PLUS | MINUS) term)*
term: (number* product | number+) ("/" (NUMBER | postfix))?
number: (NUMBER | NUMBER "/" NUMBER | "(" NUMBER "/" NUMBER ")") ("*" | _TIMES)?
product: postfix (_TIMES? postfix)* -> product
       | (postfix _TIMES?)* SCALAR product -> scalar_of_product
       | (postfix _TIMES?)* DERIVATIVE SCALAR product -> derivative_of_scalar
postfix: atom suffix*
       | DERIVATIVE postfix -> derivative
suffix: (_STAR | "^*" | "^T" | ".T" | "'") -> star
      | ("^" EXPONENT | "**" POWER) -> power
      | ".inv()" -> inverse
      | ("^½" | ".sqrt()") -> root
      | "^-½" -> inverse_root
atom: NAME -> name
    | FUNCTION ("(" sum ")" | "[" sum "]" | "{" sum "}") -> function
    | "√" postfix -> root_of
    | INDEXED "(" ARGUMENT ("," ARGUMENT)* ")" -> indexed
    | "(" sum ")" -> group
    | "[" sum "]" -> group
    | "{" sum "}" -> group
DERIVATIVE: /∂(_(mass|[ijtxyz]))?/
PLUS: "+"
MINUS: "-"
_TIMES: "@" | "·"
_STAR: /\*(?!\*[\w(\[{-])/
NUMBER: /(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?/
EXPONENT: /-?\d+/
POWER: /-?\d+(?!\d|\s*\*\*)/
ARGUMENT: /[^(),]+/
FUNCTION.3: /(%(functions)s)(?=\s*[(\[{])/
SCALAR.3: /(%(scalars)s)(?![\w])(?!\s*[(\[{])/
INDEXED.3: /(%(indexed)s)(?=\s*\()/
NAME.2: /%(names)s/
%%import common.WS
%%ignore WS
"""


def read_book(source: str, vocabulary: Vocabulary) -> list[Any]:
    """The sides of a statement, one or two.

    Raises
    ------
    Misread
        The text is no statement; it says at which character.
    """
    if tower := re.search(r"(?<=\^)\d+\s*\^\s*-?\d", source):
        raise Misread("a power of a power needs parentheses", tower.start())
    try:
        return _Evaluate(vocabulary).transform(_tree(source, tuple(sorted(vocabulary.names))))
    except exceptions.VisitError as error:
        if isinstance(error.orig_exc, (_core.Error, ParseError)):
            raise error.orig_exc from None
        raise ParseError(str(error.orig_exc)) from None
    except exceptions.UnexpectedEOF:
        raise Misread("not understood at its end", len(source)) from None
    except exceptions.UnexpectedInput as error:
        raise _stumble(source, getattr(error, "pos_in_stream", None) or 0, vocabulary) from None


def _stumble(source: str, at: int, vocabulary: Vocabulary) -> Misread:
    """What to say of the text at which the grammar gave up."""
    while at > 0 and re.match(r"\\?\w", source[at - 1 : at + 1]):  # the whole word
        at -= 1
    rest = source[at:].lstrip()
    word = re.match(r"\\?[^\W\d]\w*", rest)
    name = word[0] if word else ""
    if not rest:
        return Misread("not understood at its end", len(source))
    if rest.startswith("\\") and not name:
        return Misread("a left division is not read: A \\ B is inv(A) B", at)
    if rest.startswith("^+") or rest.startswith("+") and source[:at].endswith("^"):
        return Misread("⁺ belongs to P alone", at)
    if source[:at].endswith("^"):
        return Misread(f"{rest[:12]!r} is no exponent: a whole number, *, T, 1/2 and -1/2 are", at)
    if name in FUNCTIONS:
        return Misread(
            f"{name} needs its operand in parentheses: {name}(A)"
            if rest == name or name not in SCALARS
            else f"not understood at {rest[:12]!r}",
            at,
        )
    if name and name not in vocabulary.names:
        return Misread(vocabulary.unknown(name), at)
    return Misread(f"not understood at {rest[:12]!r}", at)


@lru_cache(maxsize=512)
def _tree(source: str, names: tuple[str, ...]) -> Tree:
    """The syntax tree of a text, found once: it is the same on every model, and a search reads a statement on dozens."""
    return _parser(names).parse(source)


@lru_cache(maxsize=32)
def _parser(names: tuple[str, ...]) -> Lark:
    longest_first = sorted(names, key=lambda n: (-len(n), n))
    grammar = _BOOK % {
        "functions": "|".join(sorted(FUNCTIONS, key=len, reverse=True)),
        "scalars": "|".join(sorted(SCALARS, key=len, reverse=True)),
        "indexed": "|".join(WITH_ARGUMENTS),
        "names": "(" + "|".join((r"(?<![A-Za-z])" if n in GUARDED else "") + re.escape(n) for n in longest_first) + ")",
    }
    return Lark(grammar, parser="earley", lexer="dynamic")


def _product(factors: list[Any]) -> Any:
    """Operators by @, scalars by *."""
    return reduce(lambda a, b: a @ b if is_operator(a) and is_operator(b) else a * b, factors)


class _Evaluate(Transformer):
    """From the syntax tree to expressions."""

    def __init__(self, vocabulary: Vocabulary):
        super().__init__()
        self._vocabulary = vocabulary

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
            value = _product(operators) if operators else numbers.pop()
            for number in reversed(numbers):
                value = number * value
            value = value if divisor is None else value / divisor
            value = -value if negative else value
            total = value if total is None else total + value
        return total

    def term(self, parts):
        """Numbers, operators, divisor: the numbers scale the whole product."""
        divisor = None
        if isinstance(parts[-1], Token):
            divisor = decimal(parts.pop())
        elif len(parts) > 1 and not isinstance(parts[-1], list) and (isinstance(parts[-2], list) or not isinstance(parts[-1], Fraction)):
            divisor = parts.pop()
        factors = parts.pop() if isinstance(parts[-1], list) else []
        operators = [f for f in factors if is_operator(f)]
        return [*parts, *(f for f in factors if not is_operator(f))], operators, divisor

    def number(self, parts):
        if len(parts) == 2 and not decimal(parts[1]):
            raise ParseError(f"{parts[0]}/{parts[1]} divides by zero")
        return decimal(parts[0]) / decimal(parts[1]) if len(parts) == 2 else decimal(parts[0])

    def product(self, parts):
        return list(parts)

    def scalar_of_product(self, parts):
        """tr ΥM: the scalar of the whole product that follows."""
        *before, name, factors = parts
        return [*before, SCALARS[str(name)](_product(factors))]

    def derivative_of_scalar(self, parts):
        """∂ ln det D: of the scalar of the whole product that follows."""
        *before, direction, name, factors = parts
        return [*before, self.derivative([direction, SCALARS[str(name)](_product(factors))])]

    def postfix(self, parts):
        value = parts[0]
        for suffix in parts[1:]:
            value = suffix(value)
        return value

    def derivative(self, parts):
        return self._vocabulary.derivative(parts[1], str(parts[0])[2:] or "i")

    def star(self, _):
        return lambda x: x.T

    def inverse(self, _):
        return lambda x: x.inv()

    def power(self, parts):
        return lambda x: power(x, int(parts[0]))

    def root(self, _):
        return lambda x: x.sqrt()

    def root_of(self, parts):
        return parts[0].sqrt()

    def inverse_root(self, _):
        return lambda x: x.sqrt().inv()

    def name(self, parts):
        return self._vocabulary.operator(str(parts[0]))

    def function(self, parts):
        return FUNCTIONS[str(parts[0])](parts[1])

    def indexed(self, parts):
        return self._vocabulary.indexed(str(parts[0]), [str(a) for a in parts[1:]])
