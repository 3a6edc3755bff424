"""`repair`: the true formulas nearest to a wrong one, one slip of the pen away, checked and then proved.

Every change of one place (`edits`) is first evaluated on dense arrays at two states of small chains without J, where the book's formulas
hold. The remaining candidates are proved (`prove`); if no proof is found, or one with several hypotheses, they are checked on the family of
random trees (`truth`).
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

from .. import _core
from ..identities.block_reading import refuse_by_block
from ..identities.budget import Budget
from ..identities.definitions import Definition
from ..identities.dialects import divided, in_dialect
from ..identities.edits import Slip, changed
from ..identities.family import HYPOTHESES, Spec
from ..identities.formula import Formula, written_statement
from ..identities.formula_reading import read_formula
from ..identities.formula_values import DenseLetters, Misfit, residual
from ..identities.parse import as_text
from ..identities.terminal_report import monospace, wrapped
from ..identities.truth import in_words, truth_within
from .prove import prove

_SMALL = (Spec((-1, 0, 1), ("pin", "screw", "slider"), False, 5), Spec((-1, 0, 1), ("screw", "pin", "pin"), False, 6))
_CLOSE = 1e-9
"""Tolerance of dense double precision on a chain of three: far above its rounding, below the effect of a change."""
FEW = 1
"""A proof with more hypotheses may have too many; then the formula is checked numerically for the hypotheses it needs."""


@dataclass
class Repair:
    """A true formula near the typed one.

    Attributes
    ----------
    statement : the formula in the book's notation
    source : the formula as unambiguous text
    slip : the mistake, in words
    where : smallest sets of hypotheses under which it is true, each sufficient; [frozenset()] for none
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
    """True formulas nearest to a wrong one, nearest first; empty if none was found. See `repair`."""

    statement: str
    found: list[Repair] = field(default_factory=list)
    tried: int = 0
    """Number of formulas one change away with matching spaces."""
    seconds: float = 0.0
    was_true: str = ""
    """Hypotheses under which the typed formula itself is true, in words."""
    ended: str = ""
    """Changes left untried when the budget ended the search; empty if none."""

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
        return "\n".join([head, *lines, *([wrapped(f"  {self.ended}")] if self.ended else [])])

    def _repr_html_(self) -> str:
        items = "".join(
            f"<li>{escape(r.slip)}: <b>{escape(r.statement)}</b>, "
            f"{escape('true where ' + in_words(r.where[0]) if r.where and r.where[0] else 'true on every tree')}</li>"
            for r in self.found
        )
        ended = f"<p>{escape(self.ended)}</p>" if self.ended else ""
        return f"<p>{escape(self.statement)}{escape(': ' + self.was_true if self.was_true else '')}</p><ol>{items}</ol>{ended}"


def repair(statement: str, *, most: int = 3, budget: float = 5.0, dialect: str | None = None) -> Repairs:
    """Return the true formulas nearest to a wrong one: one star, sign, tilde, letter, order, inverse, factor, number or term away.

    Parameters
    ----------
    statement : text; its spaces need not match. Names as in random trees: "body0", "hinge0", "node0", ...
    most : largest number of formulas
    dialect : notation of the statement, see `check`
    budget : CPU seconds. If they end the search, `.ended` and the printed result name what was left untried.

    Returns
    -------
    Repairs
        Ranked by the likelihood of the slip, then by the number of hypotheses; each with an explanation, and with its proof if one was
        found.

    Raises
    ------
    ParseError
        The text is not a statement: it has one side, or unknown letters.

    Examples
    --------
    >>> import pycraft as pc
    >>> print(pc.repair("D = H P H", most=1))
    D = H P H
      1. star missing on H, the last factor:
        D = H P H*
          true where J = 0; proved
    """
    begin, spending = time.perf_counter(), Budget(budget)
    statement = in_dialect(as_text(statement), dialect)
    definitions, claim = divided(statement)
    refuse_by_block(claim)
    formula = read_formula(claim, [d.name for d in definitions])
    models = small_models(definitions)
    before = "".join(f"{d.typed}; " for d in definitions if not d.of_the_book)
    before = statement[: statement.index(";") + 1] + before if any(d.of_the_book for d in definitions) else before
    result = Repairs(statement)
    if _is_close(formula, models) and (own := _found(formula, None, spending, before)) is not None:
        needs = own.where[0]
        result.was_true = f"TRUE where {in_words(needs)}" if needs else "TRUE on every tree"
        result.seconds = time.perf_counter() - begin
        return result
    near, result.tried, whole = nearest(formula, models, spending)
    left_out = 0 if whole else -1
    for i, (new, slip) in enumerate(near):
        if len(result.found) > most + 2:
            break
        if spending.over:
            left_out = len(near) - i
            break
        found = _found(new, slip, spending, before)
        result.found += [] if found is None else [found]
    if left_out:
        what = f"{left_out} formulas that hold on small chains were not examined" if left_out > 0 else "not every change was tried"
        result.ended = f"the search ended after {budget:g} s of CPU time (budget={budget:g}): {what}"
    result.found.sort(key=lambda r: r.cost + 0.5 * len(r.where[0]))
    del result.found[most:]
    result.seconds = time.perf_counter() - begin
    return result


def _is_close(formula: Formula, models: list[DenseLetters]) -> bool:
    """Return True if both sides match and agree on small models."""
    try:
        return all(residual(formula, letters) < _CLOSE for letters in models)
    except Misfit:
        return False


def _found(formula: Formula, slip: Slip | None, spending: Budget, before: str = "") -> Repair | None:
    """Return the formula with its hypotheses and proof; None if it is false, or undecided within the budget."""
    source = before + written_statement(formula)
    proof = _proof(source)
    where = [frozenset(proof.hypotheses)] if proof and {*proof.hypotheses} <= {*HYPOTHESES} else []
    if not where or len(where[0]) > FEW:
        try:
            found = truth_within(source, spending)
        except (_core.Error, ArithmeticError):
            found = None
        where = found.where if found is not None and not found.partial and found.where else where
    if not where:
        return None
    return Repair(written_statement(formula, shown=True), source, slip.words if slip else "", slip.cost if slip else 0.0, where, proof)


def nearest(formula: Formula, models: list[DenseLetters], spending: Budget | None = None) -> tuple[list[tuple[Formula, Slip]], int, bool]:
    """Return the formulas one change away that are true on these models, likeliest slip first; the number with matching spaces; True if all
    were tried before half of the budget was spent)."""
    near: list[tuple[Formula, Slip]] = []
    tried, whole = 0, True
    for new, slip in changed(formula):
        if spending is not None and spending.left <= 0.5 * spending.seconds:
            whole = False
            break
        try:
            apart = residual(new, models[0])
            tried += 1
            if apart < _CLOSE and all(residual(new, other) < _CLOSE for other in models[1:]):
                near.append((new, slip))
        except Misfit:
            continue
    return sorted(near, key=lambda item: item[1].cost), tried, whole


def small_models(definitions: Sequence[Definition] = ()) -> list[DenseLetters]:
    """Return the letters of two small chains without J, at moving states, and the letters of definitions."""
    return [_letters(spec, definitions) for spec in _SMALL]


def _letters(spec: Spec, definitions: Sequence[Definition] = ()) -> DenseLetters:
    model = spec.model()
    state = spec.states(model, 1)[0]
    model.q, model.v = state.q, state.v
    return DenseLetters(model, definitions)


def _proof(source: str) -> Any:
    try:
        proof = prove(source)
    except (_core.Error, ArithmeticError):
        return None
    return proof or None
