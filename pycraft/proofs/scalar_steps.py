"""Steps between scalars, and the equations that they use: equations of operators inside a trace, and facts on scalars."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from .equations import Equation, Step, Use
from .scalar_words import product_of, trace_of
from .words import NUMBER, ONE, Alphabet, Polynomial, Word, add_to, combine


@dataclass
class TraceUse(Use):
    """c tr(left (lhs - rhs) right) of one equation; `space` is the space of the product's values."""

    space: str = ""

    def difference(self, alphabet: Alphabet) -> Polynomial:
        words = {self.left + w + self.right: c for w, c in self.equation.difference.items()}
        return trace_of(words, alphabet, self.space)


@dataclass
class ProductUse(Use):
    """c · others · (lhs - rhs) of one equation between numbers."""

    others: Word = NUMBER

    def difference(self) -> Polynomial:
        return product_of(self.equation.difference, {self.others: ONE})


class ScalarStep(Step):
    """A step between numbers: before - after is a sum of traces of equations and of equations between numbers, multiplied out exactly."""

    def holds(self) -> bool:
        left = combine((1, self.before), (-1, self.after))
        for use in self.uses:
            if isinstance(use, TraceUse):
                difference = use.difference(self.alphabet)
            else:
                difference = use.difference() if isinstance(use, ProductUse) else use.equation.difference
            for word, c in difference.items():
                add_to(left, word, -use.coefficient * c)
        return not left

    def reversed(self) -> Step:
        uses = [_negative(use) for use in self.uses]
        return ScalarStep(self.after, self.before, uses, self.alphabet, self.title)


def _negative(use: Use) -> Use:
    made: Any = type(use)
    more: dict[str, Any] = {}
    if isinstance(use, TraceUse):
        more = {"space": use.space}
    elif isinstance(use, ProductUse):
        more = {"others": use.others}
    return made(-use.coefficient, use.left, use.equation, use.right, use.word, not use.forward, **more)


def fact(
    alphabet: Alphabet,
    word: Word,
    by: Polynomial,
    note: str,
    check: Callable[[], bool],
    steps: Sequence[Step] = (),
    uses: Sequence[Equation] = (),
) -> Equation:
    """Return the equation that gives the value of a word, with its check."""
    text = f"{alphabet.word_text(word)} = {alphabet.text(by)}"
    made = Equation("structure", text, {word: ONE}, by, steps=list(steps), uses=list(uses), note=note)
    made.check = check
    return made
