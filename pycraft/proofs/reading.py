"""Statements as text with letters of one's own: `x ∈ Θ; A := I + HφK; x*(MM + J)x = (A*x)*D A*x`, and what is assumed of them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from .. import _core
from ..identities.block_reading import is_by_block
from ..identities.definitions import Definition, letter_name, meant, parted
from ..identities.directions import COORDINATES, along, coordinates_meant
from ..identities.parse import ParseError, Statement, Statements
from .derivative import TIME, derivative
from .proof import HYPOTHESES


@dataclass
class Assumption:
    """What is assumed: an equation lhs = rhs; with `regular`, that lhs is symmetric and positive definite; or a hypothesis by name."""

    text: str
    lhs: Any = None
    rhs: Any = None
    regular: bool = False


@dataclass
class Reading:
    """Text on the letters of one model, and one's own.

    Attributes
    ----------
    extra : one's own letters by their names
    unknown : names of operators of which nothing is known but their spaces
    written_out : whether derivatives are worked out as they are read, and are no letters of their own
    """

    operators: Any
    extra: dict[str, Any] = field(default_factory=dict)
    unknown: set[str] = field(default_factory=set)
    written_out: bool = False

    def define(self, name: str, what: Any) -> None:
        """A letter: an expression, or text: an expression, a space for a vector, "Θ → V" for an operator of which nothing more is known.

        Raises
        ------
        ParseError
            Text that is none of these; a name that is none.
        """
        if isinstance(what, str):
            self._add(Definition(letter_name(name), what.strip(), f"{name} := {what}"))
        else:
            self.extra[letter_name(name)] = what

    def _add(self, made: Definition) -> None:
        def expression(text: str) -> Any:
            read = self._statements().read(text)
            if read.rhs is not None:
                raise ParseError(f"{made.typed} is a statement: a letter stands for one expression")
            return read.lhs

        self.extra[made.name], nothing_known = meant(made, self.operators, expression)
        if nothing_known:
            self.unknown.add(made.name)

    def _statements(self, more: Mapping[str, Any] | None = None) -> Statements:
        return Statements(self.operators, {**(more or {}), **self.extra}, derive=along if self.written_out else _formula)

    def statement(self, text: str) -> Statement:
        """The statement, with the definitions before and behind it. Raises ParseError."""
        definitions, claim = parted(text, lambda said, own: is_by_block(said, own=[*self.extra, *own]))
        for made in definitions:
            self._add(made)
        return self.read(claim)

    def read(self, text: str) -> Statement:
        """Both sides. N stays the trace of I: what is proved is said of every model, so no model's number of coordinates may enter."""
        try:
            return self._statements({"N": _core.identity(self.operators.Theta).trace()}).read(text)
        except ParseError as error:
            if re.search(r"\bN\b", text) and "N" not in self.extra:
                raise ParseError(
                    f"{error}\nN, the number of coordinates, differs from model to model: in a proof it stands beside scalars"
                ) from None
            raise

    def assumption(self, text: str) -> Assumption:
        """An equation, "X > 0", or the name of a hypothesis. Raises ParseError."""
        if text in HYPOTHESES:
            return Assumption(text)
        if (found := re.match(r"(.*?)(?:\s*>\s*0|\s+regular)$", text)) is not None:
            return Assumption(text, self.read(found[1]).lhs, regular=True)
        read = self.read(text)
        if read.rhs is None or not isinstance(read.lhs, _core.Operator):
            raise ParseError(f"{text!r} is assumed: write an equation of operators, X > 0, or one of {', '.join(HYPOTHESES)}")
        return Assumption(text, read.lhs, read.rhs)


def _formula(x: Any, direction: str, operators: Any) -> Any:
    """∂x of what is proved of every model: a letter of which the product rule and ∂E_φ = E_φΔ_i speak; of a number, worked out."""
    if isinstance(x, _core.Scalar):
        return along(x, direction, operators)
    return derivative(x, TIME if direction == "t" else coordinates_meant(operators)[COORDINATES.index(direction)])


def reading(operators: Any, define: Mapping[str, Any] | None, written_out: bool = False) -> Reading:
    """The letters of a model and one's own."""
    made = Reading(operators, written_out=written_out)
    for name, what in (define or {}).items():
        made.define(name, what)
    return made


def assumptions(made: Reading, texts: Iterable[str]) -> list[Assumption]:
    """Everything assumed, read."""
    return [made.assumption(text) for text in ([texts] if isinstance(texts, str) else texts)]
