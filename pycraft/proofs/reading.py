"""Statements as text with letters of one's own: `x ∈ Θ; A := I + HφK; x*(MM + J)x = (A*x)*D A*x`, and what is assumed of them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _core
from ..identities.directions import COORDINATES, coordinates_meant
from ..identities.parse import ParseError, Statement, Statements
from .derivative import TIME, derivative
from .proof import HYPOTHESES

_SPACE = r"Θ|Theta|V|F|R\^?\d*"
_MAP = re.compile(rf"({_SPACE})\s*(?:→|->)\s*({_SPACE})$")
_VECTOR = re.compile(rf"({_SPACE})$")


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
    """

    operators: Any
    extra: dict[str, Any] = field(default_factory=dict)
    unknown: set[str] = field(default_factory=set)

    def define(self, name: str, what: Any) -> None:
        """A letter: an expression, or text: an expression, a space for a vector, "Θ → V" for an operator of which nothing more is known.

        Raises
        ------
        ParseError
            Text that is none of these; a name that is none.
        """
        name = name.strip()
        if not name.isidentifier():
            raise ParseError(f"{name!r} is no name for a letter: letters, digits and _, beginning with a letter")
        if isinstance(what, str):
            what = self._from_text(name, what.strip())
        self.extra[name] = what

    def _from_text(self, name: str, text: str) -> Any:
        if (found := _VECTOR.match(text)) is not None:
            return _core.vector(name, self._space(found[1]))
        if (found := _MAP.match(text)) is not None:
            self.unknown.add(name)
            domain, codomain = self._space(found[1]), self._space(found[2])
            rng = np.random.default_rng([*name.encode()])
            return _core.constant(rng.uniform(-1, 1, (codomain.dimension, domain.dimension)), domain, codomain, name)
        read = Statements(self.operators, self.extra, derive=_formula).read(text)
        if read.rhs is not None:
            raise ParseError(f"{name} := {text} is a statement: a letter stands for one expression")
        return read.lhs

    def _space(self, name: str) -> Any:
        if name.startswith("R"):
            return _core.euclidean(int(name.removeprefix("R").removeprefix("^") or 1))
        return self.operators.Theta if name in ("Θ", "Theta") else getattr(self.operators, name)

    def statement(self, text: str) -> Statement:
        """The statement at the end of the text, after its definitions. Raises ParseError."""
        *definitions, claim = text.split(";")
        for definition in definitions:
            name, sign, what = _parted(definition)
            if not sign:
                raise ParseError(f"{definition.strip()!r} is no definition: write name := expression, name : Θ → Θ, or name ∈ Θ")
            self.define(name, what)
        return self.read(claim.strip())

    def read(self, text: str) -> Statement:
        """Both sides. N stays the trace of I: what is proved is said of every model, so no model's number of coordinates may enter."""
        try:
            return Statements(self.operators, {"N": _core.identity(self.operators.Theta).trace(), **self.extra}, derive=_formula).read(text)
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
    """∂x of what is proved of every model: a letter of its own, of which the product rule and ∂E_φ = E_φΔ_i speak."""
    if isinstance(x, _core.Scalar):
        raise _core.EvaluationError(f"∂({x.text()}): derivatives of operators are proved; that of ln det X is tr(X⁻¹∂X), of tr X tr(∂X)")
    return derivative(x, TIME if direction == "t" else coordinates_meant(operators)[COORDINATES.index(direction)])


def _parted(definition: str) -> tuple[str, str, str]:
    """(name, the sign of the definition, what it stands for)."""
    for sign in (":=", "∈", " in ", ":"):
        name, found, what = definition.partition(sign)
        if found:
            return name, found, what
    return "", "", ""


def reading(operators: Any, define: Mapping[str, Any] | None) -> Reading:
    """The letters of a model and one's own."""
    made = Reading(operators)
    for name, what in (define or {}).items():
        made.define(name, what)
    return made


def assumptions(made: Reading, texts: Iterable[str]) -> list[Assumption]:
    """Everything assumed, read."""
    return [made.assumption(text) for text in ([texts] if isinstance(texts, str) else texts)]
