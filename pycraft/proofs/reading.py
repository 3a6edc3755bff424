"""Statements as text with own letters: `x ∈ Θ; A := I + HφK; x*(MM + J)x = (A*x)*D A*x`, and assumptions on them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .. import _core
from ..identities.block_reading import is_by_block, read_by_block
from ..identities.definitions import Definition, is_map, letter_name
from ..identities.dialects import divided
from ..identities.directions import COORDINATES, along, coordinates_meant
from ..identities.parse import ParseError, Statement, Statements
from .derivative import TIME, derivative
from .lifting import lifted
from .proof import HYPOTHESES
from .rotors import GYRATING, rotors_of_any


@dataclass
class Assumption:
    """An assumption: an equation lhs = rhs; with `regular`, that lhs is symmetric and positive definite; or a hypothesis by name."""

    text: str
    lhs: Any = None
    rhs: Any = None
    regular: bool = False


@dataclass
class Reading:
    """Text in the letters of one model, and own letters.

    Attributes
    ----------
    extra : own letters that are expressions, by name
    definitions : own letters that are text
    unknown : names of operators known only by their spaces
    written_out : True if derivatives are computed while reading, instead of becoming letters
    """

    operators: Any
    extra: dict[str, Any] = field(default_factory=dict)
    unknown: set[str] = field(default_factory=set)
    definitions: list[Definition] = field(default_factory=list)
    written_out: bool = False

    def define(self, name: str, what: Any) -> None:
        """Define a letter: an expression, or text: an expression, a space for a vector, "Θ → V" for an unknown operator.

        Raises
        ------
        ParseError
            The text is none of these; the name is invalid.
        """
        if isinstance(what, str):
            self._add([Definition(letter_name(name), what.strip(), f"{name} := {what}")])
        else:
            self.extra[letter_name(name)] = what

    def _add(self, made: Sequence[Definition]) -> None:
        for d in made:
            self.definitions.append(d)
            value = None if d.of_the_book else self._statements().letter(d.name, self.definitions)  # errors in the text appear at once
            if is_map(d):  # one operator, in the statement and in the assumptions
                self.extra[d.name] = value
                self.definitions.pop()
                self.unknown.add(d.name)

    def _statements(self, more: Mapping[str, Any] | None = None) -> Statements:
        known = {**rotors_of_any(self.operators), **(more or {}), **self.extra}
        return Statements(self.operators, known, derive=along if self.written_out else _formula)

    def statement(self, text: str) -> Statement:
        """Return the statement, with the definitions before and after it. Raises ParseError."""
        own = [*self.extra, *(d.name for d in self.definitions)]
        definitions, claim = divided(text, lambda said, more: is_by_block(said, own=[*own, *more]))
        self._add(definitions)
        if is_by_block(claim, own=[*own, *(d.name for d in definitions)]):
            claim = self._of_operators(claim)
        return self.read(claim)

    def _of_operators(self, claim: str) -> str:
        """Return a statement by block as a statement of operators. Raises ParseError if there is none."""

        def kind(name: str) -> str:
            made = self._statements().letter(name, self.definitions)
            if made.domain is None or made.domain.name == "R^1":
                return "vector"
            return "blocks" if made.is_block_diagonal else "rows" if made.domain == self.operators.Theta else ""

        lift = lifted(read_by_block(claim, before=self.definitions), kind)
        if lift is None:
            raise ParseError(
                f"{claim!r} is a statement by block without a form in operators: prove takes statements for every body k, its parent and "
                "children, such as V(k) = φ*(℘(k),k)V(℘(k)) + H*(k)θ̇(k); pycraft.check evaluates it for every choice of bodies"
            )
        return lift

    def read(self, text: str) -> Statement:
        """Read both sides. N remains the trace of I: a proof holds for every model, so no model's number of coordinates may enter."""
        try:
            return self._statements({"N": _core.identity(self.operators.Theta).trace()}).read(text, self.definitions, inequalities=True)
        except ParseError as error:
            if re.search(r"\bN\b", text) and "N" not in {*self.extra, *(d.name for d in self.definitions)}:
                raise ParseError(
                    f"{error}\nN, the number of coordinates, differs between models: in a proof, use it only with scalars"
                ) from None
            raise

    def assumption(self, text: str) -> Assumption:
        """Read an assumption: an equation, "X > 0", or the name of a hypothesis. Raises ParseError."""
        if text in HYPOTHESES:
            return Assumption(text)
        if (found := re.match(r"(.*?)(?:\s*>\s*0|\s+regular)$", text)) is not None:
            return Assumption(text, self.read(found[1]).lhs, regular=True)
        read = self.read(text)
        if read.rhs is None or not isinstance(read.lhs, _core.Operator):
            raise ParseError(f"assumption {text!r}: write an equation of operators, X > 0, or one of {', '.join(HYPOTHESES)}")
        return Assumption(text, read.lhs, read.rhs)


def _formula(x: Any, direction: str, operators: Any) -> Any:
    """Return ∂x for a proof on every model: a letter for the product rule and ∂E_φ = E_φΔ_i; a scalar's derivative is computed."""
    if direction == "t" and GYRATING in x.text():
        raise ParseError("the rate of what rotors add, b_J and C_J, is not taken in proofs: pycraft.check evaluates it")
    if isinstance(x, _core.Scalar) or direction not in (*COORDINATES, "t"):
        return along(x, direction, operators)
    return derivative(x, TIME if direction == "t" else coordinates_meant(operators)[COORDINATES.index(direction)])


def reading(operators: Any, define: Mapping[str, Any] | None, written_out: bool = False) -> Reading:
    """Return the letters of a model and own letters."""
    made = Reading(operators, written_out=written_out)
    for name, what in (define or {}).items():
        made.define(name, what)
    return made


def assumptions(made: Reading, texts: Iterable[str]) -> list[Assumption]:
    """Return all assumptions, parsed."""
    return [made.assumption(text) for text in ([texts] if isinstance(texts, str) else texts)]
