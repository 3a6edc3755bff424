"""A derivation with lines left out: the possible gaps, the display with gaps, and hints."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from copy import copy
from numbers import Integral
from typing import Any, TypeVar

from .. import _core
from ..identities.parse import Statements
from ..operators.latex_text import escaped
from .axioms import replaced_everywhere, solved
from .derivation import DerivativeProblem
from .equations import Step, chain_holds, opened
from .models_tried import example, operators_of, operators_of_sources
from .proof import Proof
from .shown import GAP, aligned
from .words import Polynomial

_Own = TypeVar("_Own", bound="WithGaps")


class WithGaps:
    """A derivation with lines left out: display and hints; `Exercise` judges answers."""

    def __init__(self, proof: Proof, model: Any = None, blank: int | Sequence[int] | None = None, seed: int = 0):
        self.proof, self._model, self._read = proof, model, proof._read
        self.steps = list(proof.steps)
        gaps = self._gaps()
        if blank is None and not gaps:
            longer = [step for s in proof.steps for step in opened(s)]
            if chain_holds(longer, *self._ends(proof.steps)):
                self.steps = longer
            gaps = self.gaps()
        if blank is None:
            blank = random.Random(seed).choice(gaps)
        self._leave_out(_lines_of(blank))
        self._read_text = Statements(self._operators(), self._abbreviations())

    def _leave_out(self, blanks: set[int]) -> None:
        if not blanks:
            raise _core.EvaluationError("an exercise leaves out at least one line; blank=[] names none")
        for line in blanks:
            if not 1 <= line <= len(self.steps):
                raise _core.EvaluationError(f"there is no line {line} to leave out: the derivation has lines 1 to {len(self.steps)}")
        self.blanks: tuple[int, ...] = tuple(sorted(blanks))
        self.blank = self.blanks[0]

    def leaving_out(self: _Own, *blanks: int) -> _Own:
        """Return the same derivation with other lines left out, by their numbers as shown here; see `gaps`."""
        other = copy(self)
        other._leave_out(set(blanks))
        return other

    def gap(self: _Own, blank: int) -> _Own:
        """Return the exercise at one of its gaps; the other gaps stay open."""
        if blank not in self.blanks:
            raise _core.EvaluationError(f"line {blank} is not a gap of this exercise; its gaps are {', '.join(map(str, self.blanks))}")
        other = copy(self)
        other.blank = blank
        return other

    # ------------------------------------------------------------------ lines
    @staticmethod
    def _ends(steps: Sequence[Step]) -> tuple[Polynomial, Polynomial]:
        return steps[0].full()[0], steps[-1].full()[1]

    def _polynomials(self) -> list[Polynomial]:
        """Return the polynomial of every line as a user would type it, with operands of inverses written out."""
        lines = [self.steps[0].full()[0], *(s.full()[1] for s in self.steps)]
        for o in self._problem().opaque:
            for equation in (o.definition, o.definition.transposed(self.proof._alphabet)) if o.kind == "inverse" else ():
                (word,) = equation.lhs
                replaced = [replaced_everywhere(p, *solved(equation, word), self.proof._alphabet) for p in lines]
                lines = [p if step is None else step.after for p, step in zip(lines, replaced, strict=True)]
        return lines

    def gaps(self) -> list[int]:
        """Return the lines that can be left out: lines that differ from the line before and the line after; else any."""
        return self._gaps() or list(range(1, len(self.steps))) or [len(self.steps)]

    def _gaps(self) -> list[int]:
        lines = self._polynomials()
        texts = [self.steps[0].before_text(), *(s.after_text() for s in self.steps)]
        said = [(lines[i - 1], lines[i + 1]) for i in range(1, len(lines) - 1)]
        return [i for i, beside in enumerate(said, 1) if lines[i] not in beside and texts[i] not in (texts[i - 1], texts[i + 1])]

    @property
    def lines(self) -> list[str]:
        """The derivation line by line, from the left side; "?" for a gap."""
        texts = [self.steps[0].before_text(), *(s.after_text() for s in self.steps)]
        return ["?" if i in self.blanks else text for i, text in enumerate(texts)]

    @property
    def _last(self) -> bool:
        return self.blank == len(self.steps)

    @property
    def _end_is_open(self) -> bool:
        return self.blanks[-1] == len(self.steps)

    @property
    def statement(self) -> str:
        """The theorem; its right side is a question if that line is left out."""
        return f"{self.lines[0]} = ?" if self._end_is_open else self.proof.statement

    def _operators(self) -> Any:
        """Operator set on which answers are read."""
        if self._model is not None:
            return operators_of(self._model)
        return operators_of_sources(source for source, _ in self.proof._contexts) or example().soa

    def _abbreviations(self) -> dict[str, Any]:
        """Return vectors and constants by their names, and X₁, ... as shown in the derivation."""
        problem, letters = self._problem(), self.proof._alphabet.letters.values()
        named = {
            x.text: x.expression
            for x in letters
            if isinstance(x.expression, _core.Operator) and x.expression.kind in ("vector", "constant")
        }
        found: dict[str, Any] = {text: e for text, e in named.items() if text.isidentifier()}
        for o in problem.opaque:
            text = self.proof._alphabet.letters[o.name].text
            if o.kind == "inverse" and text.startswith("X"):
                found[text] = o.expression
        return found

    def _problem(self) -> DerivativeProblem:
        """Return the statement's letters, rebuilt as in the proof."""
        problem = DerivativeProblem()
        problem.sides = [problem.expand(side).before for side in (self._read.lhs, self._read.rhs)]
        return problem

    # ------------------------------------------------------------------ how it is shown
    def __str__(self) -> str:
        where = f", where {' and '.join(self.proof.hypotheses)}" if self.proof.hypotheses else ""
        lines = self.lines
        width = max(len(line) for line in lines if len(line) <= 76) + 2 if any(len(line) <= 76 for line in lines) else 20
        rows = [self.statement + where, f"      {lines[0]}"]
        for i, (line, step) in enumerate(zip(lines[1:], self.steps, strict=True), 1):
            shown = f"  {i:>2}. = {line}"
            reason = "" if i in self.blanks else f"[{step.reason}]"
            far = len(line) + 2 > width
            rows.append(f"{shown}\n{'':>{width + 9}}{reason}" if far and reason else f"{shown:<{width + 9}}{reason}".rstrip())
        return "\n".join(rows)

    __repr__ = __str__

    def latex(self) -> str:
        """Return the derivation as an aligned display, with a box for the gap."""
        return aligned(self.steps, blanks=self.blanks)

    def _repr_latex_(self) -> str:
        where = f"\\quad\\text{{where {escaped(' and '.join(self.proof.hypotheses))}}}" if self.proof.hypotheses else ""
        claim = f"{self.steps[0].before_latex()} = {GAP}" if self._end_is_open else self.proof._latex
        return f"$$\\begin{{gathered}}{claim}{where}\\\\ {self.latex()}\\end{{gathered}}$$"

    # ------------------------------------------------------------------ help
    def hint(self, level: int = 1) -> str:
        """Return a hint by level. 1: the equation that gives the line; 2: its place; 3: the line's beginning; above 3: the line."""
        if not isinstance(level, int):
            raise _core.EvaluationError(f"level must be 1, 2, 3 or more, not {level!r}")
        step = self.steps[self.blank - 1]
        there = any(u.left + u.word + u.right in step.full()[0] for u in step.uses)
        if level <= 1:
            return f"use {step.reason}{'' if there else ', read backwards'}" if step.uses else f"{step.reason}: no axiom is needed"
        if level == 2:
            places = dict.fromkeys(f"{part} in {word}" if part != word else part for word, _, part in step.positions)
            verb = "replace {}" if there else "make {} appear"
            return verb.format("; ".join(places)) if places else "multiply out, and collect equal terms"
        words = list(step.after.items())
        if level == 3 and words:
            count = "one term" if len(words) == 1 else f"{len(words)} terms"
            first = step.alphabet.text(dict(words[:1])) if len(words) > 1 else step.alphabet.word_text(words[0][0][:1]) + " ..."
            return f"{count}, beginning with {first}"
        return self.solution()

    def solution(self) -> str:
        """Return the line left out, and the equation that leads to it."""
        step = self.steps[self.blank - 1]
        return f"{step.after_text()}   [{step.reason}]"


def _lines_of(blank: Any) -> set[int]:
    """Return the lines to leave out, from one number or several."""
    given = [blank] if isinstance(blank, Integral) else blank
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise _core.EvaluationError(f"blank={blank!r}: give the number of a line, or several numbers")
    lines = list(given)
    if any(isinstance(line, bool) or not isinstance(line, Integral) for line in lines):
        raise _core.EvaluationError(f"blank={blank!r}: give line numbers, from 1")
    return set(map(int, lines))
