"""Equations, and the steps that use them: the small trusted part that decides what is proved.

A step states before = after and names the instances of equations that imply it,

    before - after = Σ c · u (lhs - rhs) v        (c a number, u and v words),

an identity of polynomials that `Step.holds` multiplies out and compares, with exact coefficients. How the step was found does not matter.
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
    """lhs = rhs, with its justification.

    Attributes
    ----------
    kind : "axiom"; "definition" of an abbreviation or of a part of the statement; "hypothesis"; "inverse", X X⁻¹ = I; "lemma"; "transpose",
        "derivative" and "copy" (the same for another model) of `source`; "structure", on diagonal blocks and the like, shown by `check`
    text : text by which it is cited
    hypothesis : name of the hypothesis, if it is one
    steps : for a lemma, from lhs to rhs; for a structure, the steps that it needs
    uses : other equations on which it rests
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
        """Return the same equation with the letters of another model; a tree with locked hinges keeps the letters shared with its model."""
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
        """The equation of which this is the transpose or copy, or itself."""
        return self.source.root if self.kind in ("transpose", "copy") and self.source is not None else self

    def premises(self) -> Iterator[Equation]:
        """Return the equations on which it rests directly."""
        if self.source is not None:
            yield self.source
        yield from self.uses
        for step in self.steps:
            yield from step.premises()

    def holds(self) -> bool:
        """Return True if its premises imply it. It does not check the premises; `Proof.recheck` checks all of them."""
        if self.kind == "lemma":
            return chain_holds(self.steps, self.lhs, self.rhs)
        if self.kind == "inverse":
            (word,) = self.lhs
            return len(word) == 2 and word[1] == inverse_of(word[0]) and self.lhs[word] == 1 and self.rhs == {(): 1}
        if self.kind in ("axiom", "definition", "hypothesis"):
            return self.kind != "hypothesis" or self.hypothesis is not None
        return self.check is not None and self.check()

    def __getstate__(self) -> dict[str, Any]:
        """Pickle the result of a structure's check instead of the rules that found it, which belong to one process."""
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
"""X* = X by letter, used to transpose symmetric letters. Both sides are the same word, because X* is written X."""


def symmetries(alphabet: Alphabet, words: Iterable[Word]) -> list[Equation]:
    """The symmetries of letters that a transposition of these words uses."""
    return [SYMMETRY[name] for name in alphabet.symmetric_letters(words) if name in SYMMETRY]


def marked(word: Word, mark: str, base: str) -> Word:
    """Return a word of the first model for another; letters that do not depend on the moving hinges are the letters of `base`."""
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
        """Return the same use, times c, between two words."""
        return Use(c * self.coefficient, left + self.left, self.equation, self.right + right, self.word, self.forward)


@dataclass
class Step:
    """before = after, by instances of equations.

    Attributes
    ----------
    number : its place in the proof, from 1
    before, after : polynomials; `before_text()`, `after_latex()`, ... show them
    uses : the instances, with the frames multiplied out; empty if terms are only collected
    title : shown instead of the equations used
    frames : words to the left and right of the whole, before and after: shown as factors
    residual : |before - after| relative to the largest term, at a random state of a model; None if not evaluated
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
        """Return both sides with the frames multiplied out."""
        (a, b), (c, d) = self.frames
        return framed(a, self.before, b), framed(c, self.after, d)

    def holds(self) -> bool:
        """Return True if the instances of equations add up to before - after exactly."""
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
        """The equations used, each once; transposes and copies are listed as their originals."""
        return list(dict.fromkeys(e.root for e in self.premises()))

    @property
    def kind(self) -> str:
        """Kind of equations used: "axiom", "lemma", "hypothesis", "definition", "inverse", ... or "arithmetic"."""
        return ", ".join(dict.fromkeys(e.kind for e in self.equations)) or "arithmetic"

    @property
    def reason(self) -> str:
        """The axioms or lemmas used, as text, and the number of places."""
        if self.title or not self.uses:
            return self.title or "collect terms"
        return "; ".join(e.text for e in self.equations) + self.manner

    @property
    def manner(self) -> str:
        """Manner of use: transposed, and the number of places."""
        transposed = bool(self.uses) and all(use.equation.kind == "transpose" for use in self.uses)
        return (" (transposed)" if transposed else "") + (f", at {len(self.uses)} places" if len(self.uses) > 1 else "")

    @property
    def positions(self) -> list[tuple[str, int, str]]:
        """Places of use: (the word, the number of letters before the place, the replaced part)."""
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
    """Return True if the steps hold, fit together and lead from lhs to rhs."""
    at = lhs
    for step in steps:
        before, after = step.full()
        if before != at or not step.holds():
            return False
        at = after
    return at == rhs


def joined(left: Sequence[Step], right: Sequence[Step], lhs: Polynomial, rhs: Polynomial, alphabet: Alphabet) -> list[Step] | None:
    """Return a chain from lhs to rhs, made from two chains that end in the same polynomial; None if they do not."""
    a, b = left[-1].after if left else lhs, right[-1].after if right else rhs
    if a != b:
        return None
    backwards = [step.reversed() for step in reversed(right)]
    if backwards:
        backwards[0].before = a  # the same terms in the same order
    return numbered([*left, *backwards] or [Step(lhs, rhs, [], alphabet)])


def opened(step: Step, equation: Equation | None = None) -> list[Step]:
    """Return the step with its lemma expanded: the lemma's steps at its place. Returns the step itself if it has nothing to expand.

    With `equation`, all uses of that equation are expanded; otherwise a step with a single use is.
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
    """Return the steps of a transposed lemma: the transposed steps of the lemma. None if it has none."""
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
    """Return all equations on which these rest, including themselves, premises first.

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
