"""The words of statements: operators by their typed names, functions, powers; and the errors of text that cannot be read.

A name is looked for among the definitions of the statement, what the caller adds, the letters of the operator table, those of the
equations of motion (`standard_letters`) and of parts (`part_letters`), in this order; X_dot is the rate ∂_tX where no letter is called so.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from difflib import get_close_matches
from fractions import Fraction
from numbers import Real
from typing import Any, TypeGuard

import numpy as np

from .. import _core
from .any_nodes import any_nodes
from .directions import COORDINATES, along, coordinates_meant
from .part_letters import OF_ROTORS, PARTS, part, text_of_part
from .spelling import Spelled
from .standard_letters import STANDARD


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
    "theta_ddot": "vdot",
}


def is_known(name: str) -> bool:
    """Return whether a name has a meaning without a definition."""
    return name in _NAMES or name in _ALIASES or name in STANDARD or name in ("MM", "I", "N", "vdot")


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


Read = Callable[[str, "Vocabulary", str], Any]
"""What a text defines, in the words of a vocabulary, as the letter of a name."""


class Vocabulary:
    """The operators of one model by every name that is typed for them, ℳ, I, N, and what the caller adds.

    `derive(x, direction, operators)` is what ∂ makes of an expression, see `directions.along`; `read` makes one of a definition's text.
    """

    def __init__(
        self,
        operators: Any,
        extra: Mapping[str, Any] | None = None,
        derive: Callable[[Any, str, Any], Any] = along,
        read: Read | None = None,
    ):
        self._derive, self._read = derive, read
        H, phi, M = operators("H phi M")
        self._own = {"MM": H @ phi @ M @ phi.T @ H.T, "I": operators.I, "N": operators.Theta.dimension}
        self._base = dict(self._own)
        self._own |= {"vdot": _core.vector("vdot", operators.Theta), **(extra or {})}
        self._operators = operators
        self._definitions: tuple[Any, ...] = ()
        self._choice: Mapping[str, int] = {}
        self._seen = math.inf
        self._open: tuple[tuple[str, str], ...] = ()
        self._made: dict[tuple[str, str], Any] = {}
        self.used: dict[str, tuple[str, Any]] = {}

    def _as(self, **changes: Any) -> Vocabulary:
        other = copy(self)
        for name, value in changes.items():
            setattr(other, f"_{name}", value)
        return other

    def with_letters(self, definitions: Sequence[Any], choice: Mapping[str, int]) -> Vocabulary:
        """The same words and those of definitions; of letters with several meanings those that are chosen."""
        other = self._as(definitions=tuple(definitions), choice=choice, made={})
        other.used = {}
        return other

    def choices(self, text: str) -> Iterator[dict[str, int]]:
        """The meanings that letters of a text may have."""
        meanings = {name: len(known.meanings) for name, known in STANDARD.items() if name not in self._own}
        meanings |= {d.name: 1 + len(d.others) for d in self._definitions}
        several = {name: count for name, count in meanings.items() if count > 1 and name in text}
        for chosen in itertools.product(*map(range, several.values())):
            yield dict(zip(several, chosen, strict=True))

    @property
    def own(self) -> set[str]:
        """Names that are not the table's."""
        return {*self._own, *(d.name for d in self._definitions)}

    @property
    def names(self) -> set[str]:
        """Names that stand alone, without arguments."""
        loops = getattr(self._operators._model, "loops", ())
        letters = {*_NAMES, *_ALIASES, *STANDARD, *(PARTS if len(loops) else PARTS - {"Q", "A"}), *self.own}
        numbers = {"I", "N"} - {d.name for d in self._definitions}
        return letters | {f"{name}_dot" for name in letters - numbers if not name.endswith("dot")}

    def operator(self, name: str) -> Any:
        named = [i for i, d in enumerate(self._definitions) if d.name == name]
        if named and (named[0] < self._seen or not (is_known(name) or name in self._own)):
            index = max((i for i in named if i < self._seen), default=named[0])
            made = self._definitions[index]
            scope = dict(definitions=(), own=self._of_the_book()) if made.of_the_book else dict(seen=index)
            return self._defined(name, (made.what, *made.others)[self._choice.get(name, 0)], scope)
        base = name.removesuffix("_dot")
        if base != name and any(d.name == base for d in self._definitions):  # the rate of what is called so here: Ḣ where H is ℳ
            return self.derivative(self.operator(base), "t")
        if name in self._own:
            return self._own[name]
        if name in WITH_ARGUMENTS:
            return self._of_any(name)
        if name == "X" and getattr(self._operators, "_loops_embedded", None) is not None:  # where loops are spoken of
            return self.operator("X_r")
        if name in _NAMES or _ALIASES.get(name, "vdot") != "vdot":
            return getattr(self._operators, _ALIASES.get(name, name))
        if name in _ALIASES:
            return self.operator(_ALIASES[name])
        if name in STANDARD:
            # Of the definitions in force those of the equations of motion reach others of them: z is made with the T that is given.
            among = tuple(d for d in self._definitions if d.name in STANDARD and not d.of_the_book)
            scope = dict(definitions=among, own=self._of_the_book())
            return self._defined(name, STANDARD[name].meanings[self._choice.get(name, 0)], scope)
        if name in PARTS:
            what = text_of_part(name)
            scope = dict(definitions=(), own=self._of_the_book())
            if what is not None:
                return self._defined(name, what, scope)
            made = part(self._operators, name)
            if name in OF_ROTORS:
                self.used.setdefault(name, (name, made))  # shown by its name
            return made
        if name.endswith("_dot") and name.removesuffix("_dot") in self.names:
            return self.derivative(self.operator(name.removesuffix("_dot")), "t")
        raise ParseError(self.unknown(name))

    def _of_the_book(self) -> dict[str, Any]:
        """Return what the caller adds, except letters of the table with another meaning: of these no letter of the book is made."""
        own = {name: value for name, value in self._own.items() if name in STANDARD or name not in _NAMES}
        return own | {"MM": self._base["MM"], "I": self._base["I"], "N": self._base["N"]}

    def _of_any(self, name: str) -> Any:
        """A letter without its arguments: of any nodes, Δ of the coordinate i."""
        if name == "Delta":
            return self.indexed(name, [COORDINATES[0]])
        return getattr(self._operators, name)(any_nodes(self._operators))

    def _defined(self, name: str, what: str, scope: dict[str, Any]) -> Any:
        """Return the meaning of a letter, derived once."""
        key = name, what
        if key in self._open:
            raise ParseError(f"{name} is defined by itself")
        if key not in self._made:
            if self._read is None:
                raise ParseError(f"{name} is defined by text, and nothing reads it here")
            self._made[key] = self._read(what, self._as(**scope, open=(*self._open, key)), name)
        value = self._made[key]
        self.used.setdefault(name, (what, value))
        return value

    def standing_for_themselves(self) -> Vocabulary:
        """The same words, letters that were used and defined by letters of their own, with no more than a name and spaces."""
        extra = {}
        translated = {d.name for d in self._definitions if d.of_the_book}
        for name, (_, value) in self.used.items():
            if (
                name not in translated
                and isinstance(value, _core.Operator)
                and value.domain is not None
                and value.kind not in ("vector", "symbol")
            ):
                shown = STANDARD[name].text if name in STANDARD else name
                if value.domain.name == "R^1":
                    extra[name] = _core.vector(shown, value.codomain)
                elif max(value.shape) <= LARGEST_SHOWN:
                    extra[name] = _core.constant(np.zeros(value.shape), value.domain, value.codomain, shown)
        kept = tuple(d for d in self._definitions if d.name not in extra)
        return self._as(own={**self._own, **extra}, definitions=kept)

    def indexed(self, name: str, arguments: list[str]) -> Any:
        arguments = [a.strip().strip("'\"") for a in arguments]
        if name == "Delta" and arguments[0] in COORDINATES and arguments[0] not in self._operators._source.coordinate_names:
            return self._operators.Delta(coordinates_meant(self._operators)[COORDINATES.index(arguments[0])])
        if name == "Delta":
            return self._operators.Delta(int(arguments[0]) if arguments[0].isdigit() else arguments[0])
        nodes = getattr(self._operators._model, "nodes", {})
        numbered = [*nodes]
        return getattr(self._operators, name)(
            [numbered[int(a)] if a.isdigit() and a not in nodes and int(a) < len(numbered) else a for a in arguments]
        )

    def derivative(self, x: Any, direction: str) -> Any:
        """∂x along a direction, see `directions.along`."""
        return self._derive(x, direction, self._operators)

    def unknown(self, name: str) -> str:
        """What to say of a name that stands for nothing."""
        if name == "det":
            return "a determinant is read by its logarithm, ln det A, or where both sides are products of determinants"
        if name.startswith("\\"):
            return f"the command {name.partition('_')[0]} is not known here"
        for ending, remedy in _ENDINGS.items():
            if name.endswith(ending) and name.removesuffix(ending) in self.names:
                return remedy.format(name.removesuffix(ending), name)
        near = get_close_matches(name, [*self.names, *WITH_ARGUMENTS, *FUNCTIONS], cutoff=0.7)
        return f"no operator is called {name!r}" + (
            f"; the nearest names are {', '.join(near)}" if near else f"; define it: {name} := …; statement"
        )


_ENDINGS = {
    "_ddot": "two dots over {0} are not read: write ∂_t(∂_t {0}), or define {1}",
    "_tilde": "{0} has no tilde in the book: define {1} := …",
    "_bar": "{0} has no bar in the book: define {1} := …",
    "_hat": "{0} has no hat in the book: define {1} := …",
}
LARGEST_SHOWN = 200
"""Rows and columns of matrices that stand for a letter where a statement is shown as it was read."""


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
