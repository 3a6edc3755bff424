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
from functools import cached_property, partial
from types import FunctionType
from typing import Any

from .words import ONE, SHARED, Alphabet, Number, Polynomial, Word, add_to, combine, framed, inverse_of, of_model, split

Frame = tuple[Word, Word]
NO_FRAME: Frame = ((), ())


@dataclass(eq=False)
class Equation:
    """lhs = rhs, and why.

    Attributes
    ----------
    kind : "axiom"; "definition" of an abbreviation or of a part of the statement; "hypothesis"; "inverse", X X⁻¹ = I; "lemma"; "transpose",
        "derivative" and "copy" (the same for another model) of `source`; "structure", on diagonal blocks and the like, shown by `check`
    text : how it is cited
    hypothesis : its name, where it is one
    steps : of a lemma, from lhs to rhs; of a structure, what it needs
    uses : what it rests on besides
    note : a remark for the reader
    """

    kind: str
    text: str
    lhs: Polynomial
    rhs: Polynomial
    hypothesis: str | None = None
    source: Equation | None = None
    steps: list[Step] = field(default_factory=list)
    uses: list[Equation] = field(default_factory=list)
    note: str = ""
    check: Callable[[], bool] | None = None
    _star: Equation | None = None
    _copies: dict[tuple[str, str], Equation] = field(default_factory=dict)

    @cached_property
    def difference(self) -> Polynomial:
        """lhs - rhs."""
        return combine((1, self.lhs), (-1, self.rhs))

    def transposed(self, alphabet: Alphabet) -> Equation:
        """lhs* = rhs*."""
        if self.kind == "transpose" and self.source is not None:
            return self.source
        if self._star is None:
            lhs, rhs = alphabet.star_of(self.lhs), alphabet.star_of(self.rhs)
            self._star = Equation("transpose", f"({self.text})*", lhs, rhs, source=self, uses=symmetries(alphabet, [*self.lhs, *self.rhs]))
            self._star.check = partial(_transposes, lhs, rhs, self, alphabet)
        return self._star

    def copied(self, mark: str, base: str | None = None) -> Equation:
        """The same equation with the letters of another model; of a tree with hinges locked, those that it shares are its model's."""
        base = mark if base is None else base
        if not mark and not base:
            return self
        if (mark, base) not in self._copies:
            lhs, rhs = _carried(self.lhs, mark, base), _carried(self.rhs, mark, base)
            made = Equation("copy", self.text, lhs, rhs, hypothesis=self.hypothesis, source=self)
            made.check = partial(_copies, lhs, rhs, self, mark, base)
            self._copies[mark, base] = made
        return self._copies[mark, base]

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
        """Whether its premises give it. They are not looked into: `Proof.recheck` goes through all of them."""
        if self.kind == "lemma":
            return chain_holds(self.steps, self.lhs, self.rhs)
        if self.kind == "inverse":
            (word,) = self.lhs
            return len(word) == 2 and word[1] == inverse_of(word[0]) and self.lhs[word] == 1 and self.rhs == {(): 1}
        if self.kind in ("axiom", "definition", "hypothesis"):
            return self.kind != "hypothesis" or self.hypothesis is not None
        return self.check is not None and self.check()

    def __getstate__(self) -> dict[str, Any]:
        """What a structure is shown by are the rules that found it, of one process: what they say is pickled in their place."""
        state = dict(vars(self))
        if isinstance(self.check, FunctionType):
            state["check"] = partial(bool, self.check())
        return state

    def __repr__(self) -> str:
        return f"<{self.kind}: {self.text}>"


def _carried(p: Polynomial, mark: str, base: str) -> Polynomial:
    return {marked(word, mark, base): c for word, c in p.items()}


def _copies(lhs: Polynomial, rhs: Polynomial, of: Equation, mark: str, base: str) -> bool:
    return lhs == _carried(of.lhs, mark, base) and rhs == _carried(of.rhs, mark, base)


def _transposes(lhs: Polynomial, rhs: Polynomial, of: Equation, alphabet: Alphabet) -> bool:
    return lhs == alphabet.star_of(of.lhs) and rhs == alphabet.star_of(of.rhs)


SYMMETRY: dict[str, Equation] = {}
"""X* = X, by letter: what a transposition of symmetric letters uses. Both sides are the same word, as X* is written X."""


def symmetries(alphabet: Alphabet, words: Iterable[Word]) -> list[Equation]:
    """The symmetries of letters that a transposition of these words uses."""
    return [SYMMETRY[name] for name in alphabet.symmetric_letters(words) if name in SYMMETRY]


def marked(word: Word, mark: str, base: str) -> Word:
    """A word of the first model for another; letters that do not depend on which hinges move are those of `base`."""
    return tuple(of_model(x, base if split(x)[0] in SHARED else mark) for x in word)


@dataclass
class Use:
    """c · left (lhs - rhs) right of one equation: at this place `word` was replaced, lhs by rhs if `forward`."""

    coefficient: Number
    left: Word
    equation: Equation
    right: Word
    word: Word = ()
    forward: bool = True

    def between(self, left: Word, right: Word, c: Number = ONE) -> Use:
        """The same, times c, between two words."""
        return Use(c * self.coefficient, left + self.left, self.equation, self.right + right, self.word, self.forward)


@dataclass
class Step:
    """before = after, by instances of equations.

    Attributes
    ----------
    number : its place in the proof, from 1
    before, after : polynomials; `before_text()`, `after_latex()`, ... show them
    uses : the instances, written with the frames multiplied out; none where only terms are collected
    title : said of the step instead of the equations used
    frames : words to the left and right of the whole, before and after: shown as factors
    residual : |before - after| relative to the largest term, at a random state of a model; None where it was not evaluated
    """

    before: Polynomial
    after: Polynomial
    uses: list[Use]
    alphabet: Alphabet
    title: str = ""
    frames: tuple[Frame, Frame] = (NO_FRAME, NO_FRAME)
    number: int = 0
    residual: float | None = None

    def full(self) -> tuple[Polynomial, Polynomial]:
        """Both sides with the frames multiplied out."""
        (a, b), (c, d) = self.frames
        return framed(a, self.before, b), framed(c, self.after, d)

    def holds(self) -> bool:
        """Whether the instances of equations add up to before - after, exactly."""
        before, after = self.full()
        left = combine((1, before), (-1, after))
        for use in self.uses:
            for word, c in use.equation.difference.items():
                add_to(left, use.left + word + use.right, -use.coefficient * c)
        return not left

    def premises(self) -> Iterator[Equation]:
        for use in self.uses:
            yield use.equation

    @property
    def equations(self) -> list[Equation]:
        """The equations used, each once; transposes and copies stand under what they are made from."""
        return list(dict.fromkeys(e.root for e in self.premises()))

    @property
    def kind(self) -> str:
        """What the step uses: "axiom", "lemma", "hypothesis", "definition", "inverse", ... or "arithmetic"."""
        return ", ".join(dict.fromkeys(e.kind for e in self.equations)) or "arithmetic"

    @property
    def reason(self) -> str:
        """The axioms or lemmas used, as text, and at how many places."""
        if self.title or not self.uses:
            return self.title or "collect terms"
        return "; ".join(e.text for e in self.equations) + self.manner

    @property
    def manner(self) -> str:
        """How the equations are used: transposed, and at how many places."""
        transposed = bool(self.uses) and all(use.equation.kind == "transpose" for use in self.uses)
        return (" (transposed)" if transposed else "") + (f", at {len(self.uses)} places" if len(self.uses) > 1 else "")

    @property
    def positions(self) -> list[tuple[str, int, str]]:
        """Where: (the word, how many of its letters stand before the place, what is replaced there)."""
        text = self.alphabet.word_text
        return [(text(u.left + u.word + u.right), len(u.left), text(u.word)) for u in self.uses]

    def reversed(self) -> Step:
        """after = before."""
        uses = [Use(-u.coefficient, u.left, u.equation, u.right, u.word, not u.forward) for u in self.uses]
        return Step(self.after, self.before, uses, self.alphabet, self.title, (self.frames[1], self.frames[0]))

    def between(self, left: Word, right: Word, c: Number = ONE) -> Step:
        """The same step, times c, between two words."""
        before, after = ({w: c * x for w, x in framed(left, p, right).items()} for p in self.full())
        return Step(before, after, [u.between(left, right, c) for u in self.uses], self.alphabet, self.title)

    # ------------------------------------------------------------------ how it is shown
    def before_text(self) -> str:
        return _shown(self.alphabet.text(self.before), self.frames[0], self.alphabet.word_text)

    def after_text(self) -> str:
        return _shown(self.alphabet.text(self.after), self.frames[1], self.alphabet.word_text)

    def before_latex(self) -> str:
        return _shown(self.alphabet.latex(self.before), self.frames[0], self.alphabet.word_latex)

    def after_latex(self) -> str:
        return _shown(self.alphabet.latex(self.after), self.frames[1], self.alphabet.word_latex)

    def __repr__(self) -> str:
        return f"{self.before_text()} = {self.after_text()}   [{self.reason}]"


def _shown(inner: str, frame: Frame, word: Callable[[Word], str]) -> str:
    """A polynomial between the factors of a frame."""
    if frame == NO_FRAME:
        return inner
    left, right = (word(w) if w else "" for w in frame)
    return " ".join(x for x in (left, f"({inner})", right) if x)


def numbered(steps: list[Step]) -> list[Step]:
    """The steps with their numbers, from 1."""
    for number, step in enumerate(steps, 1):
        step.number = number
    return steps


def chain_holds(steps: Sequence[Step], lhs: Polynomial, rhs: Polynomial) -> bool:
    """Whether the steps hold, fit together and lead from lhs to rhs."""
    at = lhs
    for step in steps:
        before, after = step.full()
        if before != at or not step.holds():
            return False
        at = after
    return at == rhs


def joined(left: Sequence[Step], right: Sequence[Step], lhs: Polynomial, rhs: Polynomial, alphabet: Alphabet) -> list[Step] | None:
    """One chain from lhs to rhs of two that lead from them to the same; None if they do not."""
    a, b = left[-1].after if left else lhs, right[-1].after if right else rhs
    if a != b:
        return None
    backwards = [step.reversed() for step in reversed(right)]
    if backwards:
        backwards[0].before = a  # the same terms in the same order
    return numbered([*left, *backwards] or [Step(lhs, rhs, [], alphabet)])


def opened(step: Step, equation: Equation | None = None) -> list[Step]:
    """The step with the lemma that it uses carried out: that lemma's steps at its place. Itself where there is nothing to open.

    With `equation`, the uses of that one are opened, wherever they stand; else a step with a single use is.
    """
    chosen = [u for u in step.uses if (equation is None or u.equation.root is equation) and u.equation.steps and u.equation.kind == "lemma"]
    chosen += [u for u in step.uses if equation is not None and u.equation.root is equation and u not in chosen and _turned(u) is not None]
    if not chosen or equation is None and len(step.uses) != 1:
        return [step]
    at, after = step.full()
    made: list[Step] = []
    for use in chosen:
        own = use.equation.steps or _turned(use) or []
        steps = own if use.forward else [s.reversed() for s in reversed(own)]
        c = use.coefficient if use.forward else -use.coefficient
        for s in steps:
            s = s.between(use.left, use.right, c)
            s.before, s.after = at, combine((1, at), (1, s.after), (-1, s.before))
            s.alphabet, at = step.alphabet, s.after
            made.append(s)
    rest = [u for u in step.uses if u not in chosen]
    if rest or at != after:
        made.append(Step(at, after, rest, step.alphabet, step.title))
    return made if all(s.holds() for s in made) else [step]


def _turned(use: Use) -> list[Step] | None:
    """The steps of a transposed lemma: those of the lemma, transposed. None where it has none."""
    e = use.equation
    if e.kind != "transpose" or e.source is None or e.source.kind != "lemma" or not e.source.steps:
        return None
    steps = []
    for s in e.source.steps:
        a = s.alphabet
        uses = [
            Use(u.coefficient, a.star_word(u.right), u.equation.transposed(a), a.star_word(u.left), a.star_word(u.word), u.forward)
            for u in s.uses
        ]
        before, after = s.full()
        steps.append(Step(a.star_of(before), a.star_of(after), uses, a, s.title))
    return steps


# ---------------------------------------------------------------------- what a proof rests on
def foundations(equations: Iterable[Equation]) -> list[Equation]:
    """Everything that these rest on, themselves included, premises first.

    Raises
    ------
    RecursionError
        A lemma rests on itself.
    """
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
