"""`repair`: the true formulas nearest to a wrong one, one slip of the pen away, checked and then proved.

Every change of one place (`edits`) is first evaluated on dense arrays at two states of small chains without J, where the book's formulas
hold; what stays is looked at over the family of random trees (`truth`), and derived (`prove`).
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from html import escape
from typing import Any

from .. import _core
from ..identities.edits import Slip, changed
from ..identities.family import Spec
from ..identities.formula import DenseLetters, Formula, Misfit, read_formula, residual, written_statement
from ..identities.tables import monospace, wrapped
from ..identities.truth import in_words, truth
from .prove import prove

_SMALL = (Spec((-1, 0, 1), ("pin", "screw", "slider"), False, 5), Spec((-1, 0, 1), ("screw", "pin", "pin"), False, 6))
_CLOSE = 1e-9
"""Of dense double on a chain of three: far above its rounding, below what a change makes."""


@dataclass
class Repair:
    """One formula near the typed one that is true.

    Attributes
    ----------
    statement : the formula, as the book prints it
    source : as text that reads in one way only
    slip : what was done wrong, in words
    where : the fewest hypotheses under which it is true, each set enough; [frozenset()] for none
    proof : its derivation, or None if none was found
    """

    statement: str
    source: str
    slip: str
    cost: float
    where: list[frozenset[str]]
    proof: Any = None

    def __str__(self) -> str:
        needs = self.where[0] if self.where else frozenset()
        lines = [f"{monospace(self.slip)}:", f"  {monospace(self.statement)}"]
        said = f"true where {in_words(needs)}" if needs else "true on every tree"
        lines.append(f"    {said}; " + ("proved" if self.proof else "checked, no proof found"))
        return "\n".join(wrapped(line) for line in lines)


@dataclass
class Repairs:
    """The true formulas nearest to a wrong one, the nearest first; empty where none was found. See `repair`."""

    statement: str
    found: list[Repair] = field(default_factory=list)
    tried: int = 0
    """Formulas one change away whose spaces fit."""
    seconds: float = 0.0
    was_true: str = ""
    """Where the typed formula itself is true, in words."""

    def __len__(self) -> int:
        return len(self.found)

    def __getitem__(self, i: int) -> Repair:
        return self.found[i]

    def __iter__(self) -> Iterator[Repair]:
        return iter(self.found)

    def __repr__(self) -> str:
        head = monospace(self.statement)
        if self.was_true:
            head += f"\n  needs no repair: {self.was_true}"
        elif not self.found:
            head += f"\n  no true formula one change away among {self.tried}"
        lines = [f"  {number}. {repair}".replace("\n", "\n  ") for number, repair in enumerate(self.found, 1)]
        return "\n".join([head, *lines])

    def _repr_html_(self) -> str:
        items = "".join(
            f"<li>{escape(r.slip)}: <b>{escape(r.statement)}</b>, "
            f"{escape('true where ' + in_words(r.where[0]) if r.where and r.where[0] else 'true on every tree')}</li>"
            for r in self.found
        )
        return f"<p>{escape(self.statement)}{escape(': ' + self.was_true if self.was_true else '')}</p><ol>{items}</ol>"


def repair(statement: str, *, most: int = 3, budget: float = 8.0) -> Repairs:
    """The true formulas nearest to a wrong one: one star, sign, tilde, letter, order, inverse, factor, number or term away.

    Parameters
    ----------
    statement : as text; its spaces need not fit. Names are those of random trees: "body0", "hinge0", "node0", ...
    most : formulas at most
    budget : seconds; three times as many where it found nothing

    Returns
    -------
    Repairs
        Ranked by how likely the slip is, then by how few hypotheses the formula needs; each with words, and with its proof where one was
        found.

    Raises
    ------
    ParseError
        It is no statement: one side, or letters that are not there.

    Examples
    --------
    >>> import pycraft as pc
    >>> print(pc.repair("D = H P H", most=1))
    D = H P H
      1. star missing on H, the last factor:
        D = H P H*
          true where J = 0; proved
    """
    begin = time.perf_counter()
    formula = read_formula(statement)
    models = small_models()
    result = Repairs(statement)
    try:
        if all(residual(formula, letters) < _CLOSE for letters in models):
            own = truth(written_statement(formula), smallest_case=False)
            if own.where:
                result.was_true, result.seconds = own.verdict, time.perf_counter() - begin
                return result
    except (Misfit, _core.Error):
        pass
    near, result.tried = nearest(formula, models)
    for new, slip in near:
        if len(result.found) > most + 2 or time.perf_counter() - begin > (budget if result.found else 3 * budget):
            break
        source = written_statement(new)
        try:
            where = truth(source, smallest_case=False).where
        except (_core.Error, ArithmeticError):
            continue
        if where:
            result.found.append(Repair(written_statement(new, shown=True), source, slip.words, slip.cost, where))
    result.found.sort(key=lambda r: r.cost + 0.5 * len(r.where[0]))
    del result.found[most:]
    for found in result.found:
        found.proof = _proof(found.source)
    result.seconds = time.perf_counter() - begin
    return result


def nearest(formula: Formula, models: list[DenseLetters]) -> tuple[list[tuple[Formula, Slip]], int]:
    """(the formulas one change away that are true on these models, the likeliest slip first; how many had spaces that fit)."""
    near: list[tuple[Formula, Slip]] = []
    tried = 0
    for new, slip in changed(formula):
        try:
            apart = residual(new, models[0])
            tried += 1
            if apart < _CLOSE and all(residual(new, other) < _CLOSE for other in models[1:]):
                near.append((new, slip))
        except Misfit:
            continue
    return sorted(near, key=lambda item: item[1].cost), tried


def small_models() -> list[DenseLetters]:
    """The letters of two small chains without J, at states at which they move."""
    return [_letters(spec) for spec in _SMALL]


def _letters(spec: Spec) -> DenseLetters:
    model = spec.model()
    state = spec.states(model, 1)[0]
    model.q, model.v = state.q, state.v
    return DenseLetters(model)


def _proof(source: str) -> Any:
    try:
        proof = prove(source)
    except (_core.Error, ArithmeticError):
        return None
    return proof or None
