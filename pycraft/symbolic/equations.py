"""Equations, and the steps that use them: the small part that decides what counts as proved.

A step says before = after and names the instances of equations that make it so,

    before - after = Σ c · u (lhs - rhs) v        (c a number, u and v words),

an identity of polynomials that `Step.holds` multiplies out and compares, with exact coefficients. How a step was found plays no part in it.
An equation holds because it is an axiom, a hypothesis, the meaning of an inverse, the transpose or the derivative of one that holds, or
because a chain of such steps leads from its left side to its right side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from .words import Alphabet, Polynomial, Word, combine, framed, inverse_of, split


@dataclass(eq=False)
class Equation:
    """lhs = rhs, and why.

    Attributes
    ----------
    kind : "axiom", "definition" (of an abbreviation or of a part of the statement), "hypothesis", "inverse" (X X⁻¹ = I), "lemma",
        "transpose", "derivative", "copy" (the same for another model), "structure" (of diagonal blocks)
    hypothesis : its name, where it is one
    source : what it is the transpose, derivative or copy of
    steps : of a lemma, from lhs to rhs
    """

    lhs: Polynomial
    rhs: Polynomial
    kind: str
    text: str
    hypothesis: str | None = None
    source: Equation | None = None
    steps: list[Step] = field(default_factory=list)
    uses: list[Equation] = field(default_factory=list)
    note: str = ""
    check: Callable[[], bool] | None = None
    alphabet: Alphabet | None = None
    _star: Equation | None = None
    _copies: dict[str, Equation] = field(default_factory=dict)

    @property
    def difference(self) -> Polynomial:
        return combine((1, self.lhs), (-1, self.rhs))

    def transposed(self, alphabet: Alphabet) -> Equation:
        """lhs* = rhs*."""
        if self.kind == "transpose" and self.source is not None:
            return self.source
        if self._star is None:
            lhs, rhs = alphabet.star_of(self.lhs), alphabet.star_of(self.rhs)
            self._star = Equation(lhs, rhs, "transpose", f"({self.text})*", source=self, alphabet=alphabet)
            self._star.uses = symmetries(alphabet, [*self.lhs, *self.rhs])
        return self._star

    def copied(self, suffix: str) -> Equation:
        """The same equation with the letters of another model, marked by a suffix."""
        if not suffix:
            return self
        if suffix not in self._copies:
            self._copies[suffix] = Equation(
                marked(self.lhs, suffix), marked(self.rhs, suffix), "copy", self.text, hypothesis=self.hypothesis, source=self
            )
        return self._copies[suffix]

    @property
    def root(self) -> Equation:
        """What this is the transpose or copy of, or itself."""
        return self.source.root if self.kind in ("transpose", "copy") and self.source is not None else self

    def premises(self) -> Iterator[Equation]:
        """What it rests on directly."""
        if self.source is not None:
            yield self.source
        yield from self.uses
        for step in self.steps:
            yield from step.premises()

    def holds(self) -> bool:
        """Whether what it is said to rest on gives it. Premises are not looked into: `proof.recheck` goes through all of them."""
        if self.kind in ("transpose", "copy"):
            return self.source is not None and self._is_image()
        if self.kind in ("derivative", "structure"):
            return self.check is not None and self.check()
        if self.kind == "lemma":
            return chain_holds(self.steps, self.lhs, self.rhs)
        if self.kind == "inverse":
            (word,) = self.lhs
            return len(word) == 2 and word[1] == inverse_of(word[0]) and self.lhs[word] == 1 and self.rhs == {(): 1}
        return self.kind in ("axiom", "definition", "hypothesis") and (self.kind != "hypothesis" or self.hypothesis is not None)

    def _is_image(self) -> bool:
        assert self.source is not None
        if self.kind == "copy":
            suffix = next(s for s, e in self.source._copies.items() if e is self)
            return self.lhs == marked(self.source.lhs, suffix) and self.rhs == marked(self.source.rhs, suffix)
        assert self.alphabet is not None
        return self.lhs == self.alphabet.star_of(self.source.lhs) and self.rhs == self.alphabet.star_of(self.source.rhs)

    def __repr__(self) -> str:
        return f"<{self.kind}: {self.text}>"


_SYMMETRY: dict[str, Equation] = {}


def symmetries(alphabet: Alphabet, words: Iterable[Word]) -> list[Equation]:
    """The axioms X* = X of the symmetric letters that occur: what a transposition uses."""
    found = []
    for name in sorted(alphabet.symmetric_letters(words)):
        if alphabet.letters[name].expression is None and name in ("M", "P", "R", "D", "J", "Υ"):
            if name not in _SYMMETRY:
                _SYMMETRY[name] = Equation({(name,): Fraction(1)}, {(name,): Fraction(1)}, "axiom", f"{name}* = {name}")
            found.append(_SYMMETRY[name])
    return found


def marked(p: Polynomial, suffix: str) -> Polynomial:
    """The same polynomial in the letters of another model."""
    return {tuple(_with_suffix(x, suffix) for x in word): c for word, c in p.items()}


def _with_suffix(letter: str, suffix: str) -> str:
    name, mark = split(letter)
    return name + suffix + mark


@dataclass
class Use:
    """c · u (lhs - rhs) v of one equation; `forward` if it is read from left to right."""

    coefficient: Fraction
    left: Word
    equation: Equation
    right: Word
    forward: bool = True

    def value(self) -> Polynomial:
        return {w: self.coefficient * c for w, c in framed(self.left, self.equation.difference, self.right).items()}


@dataclass
class Step:
    """before = after, by instances of equations.

    Attributes
    ----------
    number : its place in the proof, from 1
    before, after : polynomials
    uses : the instances; none where only terms are collected
    frame : words that stand to the left and right of the whole throughout, shown as factors
    expression : the pycraft expression that this step writes out as words, where it is such a step
    residual : |before - after| relative to the largest term, at a random state of a model; None where it was not evaluated
    """

    before: Polynomial
    after: Polynomial
    uses: list[Use]
    alphabet: Alphabet
    title: str = ""
    frame: tuple[Word, Word] = ((), ())
    frame_before: tuple[Word, Word] | None = None
    expression: Any = None
    extra: list[Equation] = field(default_factory=list)
    check: Callable[[], bool] | None = None
    number: int = 0
    residual: float | None = None

    def full(self) -> tuple[Polynomial, Polynomial]:
        """Both sides with the frame multiplied out."""
        first = self.frame if self.frame_before is None else self.frame_before
        return framed(first[0], self.before, first[1]), framed(self.frame[0], self.after, self.frame[1])

    def holds(self) -> bool:
        """Whether the instances of equations named add up to before - after, exactly."""
        if self.check is not None:
            return self.check()
        before, after = self.full()
        claimed = combine((1, before), (-1, after), *((-1, use.value()) for use in self.uses))
        return not claimed

    def premises(self) -> Iterator[Equation]:
        for use in self.uses:
            yield use.equation
        yield from self.extra

    @property
    def equations(self) -> list[Equation]:
        """The equations used, each once; transposes and copies stand under what they are made from."""
        return list(dict.fromkeys(e.root for e in self.premises()))

    @property
    def reason(self) -> str:
        """The axiom or lemma used, as text, and at how many places."""
        if self.title:
            return self.title
        if not self.uses:
            return "collect terms"
        texts = "; ".join(dict.fromkeys(use.equation.root.text for use in self.uses))
        starred = all(use.equation.kind == "transpose" for use in self.uses)
        note = " (transposed)" if starred else ""
        places = f", at {len(self.uses)} places" if len(self.uses) > 1 else ""
        return texts + note + places

    @property
    def kind(self) -> str:
        """What the step uses: "axiom", "lemma", "hypothesis", "definition", "inverse", "arithmetic", ..."""
        kinds = list(dict.fromkeys(e.kind for e in self.equations))
        return ", ".join(kinds) if kinds else "arithmetic"

    @property
    def positions(self) -> list[tuple[str, int]]:
        """Where: the word that is rewritten, and the number of letters that stand before the place in it."""
        return [(self.alphabet.word_text(use.left + ("…",) + use.right), len(use.left)) for use in self.uses]

    def reversed(self) -> Step:
        """after = before."""
        uses = [Use(-u.coefficient, u.left, u.equation, u.right, not u.forward) for u in self.uses]
        first = self.frame if self.frame_before is None else self.frame_before
        return Step(
            self.after, self.before, uses, self.alphabet, self.title, first, self.frame, self.expression, self.extra, self.check
        )

    # ------------------------------------------------------------------ how it is shown
    def before_text(self) -> str:
        frame = self.frame if self.frame_before is None else self.frame_before
        return shown(self.alphabet.text(self.before), frame, self.alphabet.word_text)

    def after_text(self) -> str:
        return shown(self.alphabet.text(self.after), self.frame, self.alphabet.word_text)

    def before_latex(self) -> str:
        frame = self.frame if self.frame_before is None else self.frame_before
        return shown(self.alphabet.latex(self.before), frame, self._word_latex)

    def after_latex(self) -> str:
        return shown(self.alphabet.latex(self.after), self.frame, self._word_latex)

    def _word_latex(self, word: Word) -> str:
        return " ".join(map(self.alphabet.letter_latex, word))

    def __repr__(self) -> str:
        return f"{self.before_text()} = {self.after_text()}   [{self.reason}]"


def shown(inner: str, frame: tuple[Word, Word], word: Callable[[Word], str]) -> str:
    """A polynomial between the factors of a frame."""
    left, right = (word(w) if w else "" for w in frame)
    return " ".join(x for x in (left, f"({inner})" if left or right else inner, right) if x)


def chain_holds(steps: Sequence[Step], lhs: Polynomial, rhs: Polynomial) -> bool:
    """Whether the steps hold, fit together and lead from lhs to rhs."""
    at = lhs
    for step in steps:
        before, after = step.full()
        if before != at or not step.holds():
            return False
        at = after
    return at == rhs


# ---------------------------------------------------------------------- what a proof rests on
def foundations(equations: Iterable[Equation]) -> list[Equation]:
    """Everything that these rest on, themselves included, premises first. Raises RecursionError where a lemma rests on itself."""
    order: list[Equation] = []
    done: set[int] = set()
    open_: set[int] = set()

    def visit(equation: Equation) -> None:
        if id(equation) in done:
            return
        if id(equation) in open_:
            raise RecursionError(f"{equation.text} rests on itself")
        open_.add(id(equation))
        for premise in equation.premises():
            visit(premise)
        open_.discard(id(equation))
        done.add(id(equation))
        order.append(equation)

    for equation in equations:
        visit(equation)
    return order
