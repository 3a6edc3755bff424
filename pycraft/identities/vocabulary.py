"""The words of statements: operators by their typed names, functions, powers; and the errors of text that cannot be read."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from fractions import Fraction
from numbers import Real
from typing import Any, TypeGuard

from .. import _core
from .directions import COORDINATES, along, coordinates_meant
from .spelling import Spelled


class Written:
    """An operator that is written and not worked out, such as a derivative that is to be proved equal to something.

    It has a domain, a codomain and a text as operators have.
    """

    def blockdiag(self) -> Written:
        """Its diagonal blocks."""
        raise NotImplementedError


SCALARS = {
    "trace": lambda x: x.trace(),
    "tr": lambda x: x.trace(),
    "Tr": lambda x: x.trace(),
    "logdet": lambda x: x.logdet(),
    "norm": lambda x: x.norm(),
}
FUNCTIONS = {
    **SCALARS,
    "inv": lambda x: x.inv(),
    **dict.fromkeys(("blockdiag", "blkdiag", "bdiag"), lambda x: x.blockdiag() if isinstance(x, Written) else _core.blockdiag(x)),
    "sqrt": lambda x: x.sqrt(),
    "transpose": lambda x: x.T,
}
WITH_ARGUMENTS = tuple(s.name for s in _core.symbols if s.takes != "nothing")
LARGEST_POWER = 1000

_NAMES = {s.name for s in _core.symbols}
# What stands for a letter in ASCII where its own name is another: X, V; E_phi; and names typed without their underscores: taubar, Epsi.
_ALIASES = {
    **{s.text: s.name for s in _core.symbols if s.text != s.name and s.text.isascii()},
    **{name.replace("_", ""): name for name in _NAMES if "_" in name},
    "E_phi": "E",
    "Ephi": "E",
}


class ParseError(_core.EvaluationError):
    """A statement that cannot be read, or that can be read in two ways."""


class SpacesError(ParseError):
    """A statement of operators whose spaces do not fit: it cannot be true, on any model."""


class Misread(ParseError):
    """What one reading stumbles over, at character `at` of the spelled text."""

    def __init__(self, message: str, at: int):
        super().__init__(message)
        self.message = message
        self.at = at

    def place(self, source: Spelled) -> str:
        """The typed line and a caret below the place, indented."""
        return "".join(f"\n    {line}" for line in source.place(self.at).split("\n"))


class Vocabulary:
    """The operators of one model by every name that is typed for them, ℳ, I, N, and what the caller adds.

    `derive(x, "i" | "j" | "t", operators)` is what ∂ makes of an expression.
    """

    def __init__(self, operators: Any, extra: Mapping[str, Any] | None = None, derive: Callable[[Any, str, Any], Any] = along):
        self._derive = derive
        H, phi, M = operators("H phi M")
        self._own = {"MM": H @ phi @ M @ phi.T @ H.T, "I": operators.I, "N": operators.Theta.dimension}
        self._own |= {"vdot": _core.vector("vdot", operators.Theta), **(extra or {})}
        self._operators = operators

    @property
    def own(self) -> set[str]:
        """Names that are not the table's."""
        return {*self._own}

    @property
    def names(self) -> set[str]:
        """Names that stand alone, without arguments."""
        return {*(_NAMES - set(WITH_ARGUMENTS)), *_ALIASES, *self._own}

    def operator(self, name: str) -> Any:
        if name in self._own:
            return self._own[name]
        if name in WITH_ARGUMENTS:
            raise ParseError(needs_arguments(name))
        if name not in _NAMES and name not in _ALIASES:
            raise ParseError(self.unknown(name))
        return getattr(self._operators, _ALIASES.get(name, name))

    def indexed(self, name: str, arguments: list[str]) -> Any:
        arguments = [a.strip().strip("'\"") for a in arguments]
        if name == "Delta" and arguments[0] in COORDINATES and arguments[0] not in self._operators._source.coordinate_names:
            return self._operators.Delta(coordinates_meant(self._operators)[COORDINATES.index(arguments[0])])
        if name == "Delta":
            return self._operators.Delta(int(arguments[0]) if arguments[0].isdigit() else arguments[0])
        return getattr(self._operators, name)(arguments)

    def derivative(self, x: Any, direction: str) -> Any:
        """∂x along the coordinate i or j, or along time."""
        return self._derive(x, direction, self._operators)

    def unknown(self, name: str) -> str:
        """What to say of a name that stands for nothing."""
        if name == "det":
            return "a determinant is read by its logarithm: ln det A"
        if name.startswith("\\"):
            return f"the command {name.partition('_')[0]} is not known here"
        near = get_close_matches(name, [*self.names, *WITH_ARGUMENTS, *FUNCTIONS], cutoff=0.7)
        return f"no operator is called {name!r}" + (f"; the nearest names are {', '.join(near)}" if near else "")


def needs_arguments(name: str) -> str:
    return f"{name} needs its arguments, as in {name}({'hinge' if name == 'Delta' else 'body'})"


def decimal(text: str) -> Fraction:
    """A number as it is typed: 0.3 is 3/10.

    Raises
    ------
    ParseError
        It is beyond the range of a double.
    """
    text = text.replace("_", "")
    if not math.isfinite(near := float(text)) or near == 0 and any(c in "123456789" for c in text.lower().partition("e")[0]):
        raise ParseError(f"the number {text} is beyond the range of a double, 1e-308 to 1e308")
    return Fraction(text)


def is_number(x: object) -> TypeGuard[float | Fraction]:
    """A real number and no scalar expression; NumPy's count."""
    return isinstance(x, Real)


def is_operator(x: object) -> bool:
    """An operator, worked out or not; no number and no scalar expression."""
    return isinstance(x, (_core.Operator, Written))


def power(base: Any, exponent: Any) -> Any:
    """base to a whole power.

    Raises
    ------
    ParseError
        The exponent is no whole number, or beyond 1000.
    """
    if not is_number(exponent) or not -LARGEST_POWER <= exponent <= LARGEST_POWER or exponent != int(exponent):
        raise ParseError(f"a power is a whole number up to {LARGEST_POWER}")
    return base ** int(exponent)
