"""One attempt at a statement under given hypotheses: normal forms of both sides, then both sides multiplied by the operands of inverses."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from .diagonal_parts import DiagonalParts
from .equations import NO_FRAME, Equation, Frame, Step, Use
from .expand import Problem
from .inverses import Inverses
from .local_rules import LocalRules
from .normal_form import Setting
from .roots import Roots
from .scalar_rules import ScalarRules
from .words import ONE, Polynomial, Word, add_to, combine, inverse_of, inverted, plain, split

ROUNDS = 4
"""Largest number of inverses that are cleared, one after another."""


@dataclass
class Outcome:
    """Normal forms of both sides and the steps to them; `frame` holds the inverses of the factors that multiplied both sides."""

    left: list[Step]
    right: list[Step]
    lhs: Polynomial
    rhs: Polynomial
    frame: Frame = NO_FRAME

    @property
    def closed(self) -> bool:
        return self.lhs == self.rhs


class Attempt(LocalRules):
    """The rules of one setting and statement, and their application.

    Attributes
    ----------
    inverses : known facts on the inverses in the statement
    """

    def __init__(self, problem: Problem, setting: Setting, extra: Iterable[tuple[Equation, Word]] = ()):
        super().__init__(problem, setting, list(extra))
        self.inverses = Inverses(self)
        diagonal_parts, roots = DiagonalParts(self), Roots(self)
        added_by = {"inverse": self.inverses.add, "blockdiag": diagonal_parts.add, "half": diagonal_parts.add_half, "sqrt": roots.add}
        for opaque in problem.opaque:
            if opaque.kind != "operand":
                added_by[opaque.kind](opaque)

    def run(self, lhs: Polynomial, rhs: Polynomial) -> Outcome:
        """Return normal forms of both sides, cleared of inverses if that closes the gap. Raises GaveUp."""
        if self.problem.scalars:
            scalars = ScalarRules(self, self.inverses)
            (p, left), (q, right) = (scalars.reduce(side) for side in (lhs, rhs))
            return Outcome(left, right, p, q)
        turned = self._turned(rhs, lhs) if self.problem.numbers else []
        p, left, q, right = self.rules.reduce_both(lhs, turned[-1].after if turned else rhs, self.alphabet)
        first = at = Outcome(left, [*turned, *right], p, q)
        for _ in range(ROUNDS):
            found = None if at.closed else _end(combine((1, at.lhs), (-1, at.rhs)))
            if found is None:
                break
            at = self._cleared(at, *found)
        if not at.closed and self.problem.numbers:
            ends = [[*steps, *self._turned(side)] for steps, side in ((first.left, p), (first.right, q))]
            sides = [steps[-1].after if steps else side for steps, side in zip(ends, (p, q), strict=True)]
            return Outcome(ends[0], ends[1], sides[0], sides[1])
        return at if at.closed else first

    def _turned(self, p: Polynomial, like: Polynomial | None = None) -> list[Step]:
        """Transpose words that are numbers if the transpose occurs in `like`; without `like`, choose the first of the two in order."""
        a = self.alphabet
        out: Polynomial = {}
        uses = []
        for word, c in p.items():
            star = a.star_word(word)
            turn = star < word if like is None else word not in like and star in like
            add_to(out, star if turn else word, c)
            if turn:
                equation = Equation("structure", "a number is its own transpose", {word: ONE}, {star: ONE})
                equation.check = lambda w=word, s=star: a.star_word(w) == s and self.problem.numbers
                uses.append(Use(c, (), equation, (), word))
        return [Step(p, out, uses, a, "a number is its own transpose")] if uses else []

    def _cleared(self, at: Outcome, letter: str, on_left: bool) -> Outcome:
        """Multiply both sides by X if X⁻¹ is at an end of a word of their difference: Y = X⁻¹(XY)."""
        X, (a, b) = inverse_of(letter), at.frame
        frame = ((*a, letter), b) if on_left else (a, (letter, *b))
        pair = self.pair(letter, X) if on_left else self.pair(X, letter)
        chains, sides = [], []
        for steps, p in ((at.left, at.lhs), (at.right, at.rhs)):
            times_x = {((X, *w) if on_left else (*w, X)): c for w, c in p.items()}
            uses = [Use(-c, *((a, pair, w + b) if on_left else (a + w, pair, b)), (), False) for w, c in p.items()]
            insert = Step(p, times_x, uses, self.alphabet, f"{pair.text}, read backwards", (at.frame, frame))
            opened = self._opened(X, times_x)
            chains.append([*steps, insert, *(_in_frame(step, frame) for step in opened)])
            sides.append(opened[-1].after if opened else times_x)
        p, left, q, right = self.rules.reduce_both(sides[0], sides[1], self.alphabet)
        for chain, more in zip(chains, (left, right), strict=True):
            chain += [_in_frame(step, frame) for step in more]
        return Outcome(chains[0], chains[1], p, q, frame)

    def _opened(self, X: str, p: Polynomial) -> list[Step]:
        """Write X as its operand, if it has one."""
        name, mark = split(X)
        opaque = next((o for o in self.problem.opaque if o.name == name and o.kind == "inverse"), None)
        if opaque is None:
            return []
        definition = opaque.definition.transposed(self.alphabet) if mark == "*" else opaque.definition
        out: Polynomial = {}
        uses = []
        for word, c in p.items():
            at = word.index(X)
            uses.append(Use(c, word[:at], definition, word[at + 1 :], (X,)))
            for w, x in definition.rhs.items():
                add_to(out, word[:at] + w + word[at + 1 :], c * x)
        return [Step(p, out, uses, self.alphabet)] if uses else []


def _end(difference: Polynomial) -> tuple[str, bool] | None:
    """Return X⁻¹ at an end of a word, and True if it is the left end; D⁻¹, φ⁻¹ and ψ⁻¹ have their own rules."""
    for on_left in (True, False):
        for word in difference:
            letter = word[0 if on_left else -1] if word else ""
            if word and inverted(letter) and plain(letter) not in ("D", "φ", "ψ"):
                return letter, on_left
    return None


def _in_frame(step: Step, frame: Frame) -> Step:
    """Return the step with a frame around it."""
    return Step(step.before, step.after, [u.between(*frame) for u in step.uses], step.alphabet, step.title, (frame, frame))
