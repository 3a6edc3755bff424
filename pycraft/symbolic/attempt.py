"""One attempt at a statement, under given hypotheses: normal forms of both sides, with rules for what the statement adds of its own.

Inverses that are no letters are dealt with in turn. X⁻¹ = Z where a candidate Z shows XZ = I and ZX = I: X a single word, X one of the
operators whose inverse is known, X an operator whose inverse stands elsewhere in the statement. Otherwise XX⁻¹ = I and X⁻¹X = I are rules
themselves. What then still differs is multiplied by X from the left or right (`clear`), and last the rules are completed by their overlaps
(`completion.complete`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from .axioms import theory
from .blocks import diagonal_part
from .equations import Equation, Step, Use, chain_holds
from .expand import Opaque, Problem
from .rules import Rules, Setting, normal_form, rules_for, weight
from .words import Alphabet, Polynomial, Word, add_to, combine, framed, inverse_of, parse, split, times

KNOWN_INVERSES = [
    ("I − E_φ", "φ"),
    ("I − E_φ + K H", "ψ"),
    ("I + K H φ", "I − K H ψ"),
    ("I + φ K H", "I − ψ K H"),
    ("I + H φ K", "I − H ψ K"),
    ("H φ M φ* H* + J", "D⁻¹ − D⁻¹ H ψ K − K* ψ* H* D⁻¹ + K* ψ* H* D⁻¹ H ψ K"),
    ("φ M φ*", "φ⁻* M⁻¹ φ⁻¹"),
]
"""Pairs X, Z with XZ = ZX = I: candidates only, every use of one is proved where it is used."""

_ONE: Polynomial = {(): Fraction(1)}
_INVERTIBLE = {"φ", "ψ", "D", "M", "P", "R", "Υ"}


@lru_cache(maxsize=32)
def _known_inverses(setting: Setting) -> dict[tuple, tuple[Polynomial, Fraction]]:
    """Candidates by the normal form of X, scaled."""
    rules, alphabet = rules_for(setting), theory().alphabet
    found: dict[tuple, tuple[Polynomial, Fraction]] = {}
    for x, z in KNOWN_INVERSES:
        for X, Z in ((parse(x), parse(z)), (parse(z), parse(x))):
            for p, q in ((X, Z), (alphabet.star_of(X), alphabet.star_of(Z))):
                key, scale = _scaled(normal_form(p, rules, alphabet))
                found.setdefault(key, (q, scale))
    return found


def _scaled(p: Polynomial) -> tuple[tuple, Fraction]:
    """(a key for the polynomial up to a factor, that factor)."""
    lead = p[max(p, key=weight)]
    return tuple(sorted((w, c / lead) for w, c in p.items())), lead


@dataclass
class Outcome:
    """Normal forms of both sides, and how they came about; `frame` is what both were multiplied by."""

    left: list[Step]
    right: list[Step]
    lhs: Polynomial
    rhs: Polynomial
    frame: tuple[Word, Word] = ((), ())

    @property
    def closed(self) -> bool:
        return self.lhs == self.rhs


class Attempt:
    """Rules of one setting with those that a statement adds."""

    def __init__(self, problem: Problem, setting: Setting):
        self.problem, self.setting = problem, setting
        self.alphabet = problem.alphabet
        suffixes = problem.suffixes
        self.rules = rules_for(setting, suffixes).copy()
        blocks = Setting(setting.hypotheses, composite=True, compliance=True)
        self.block_rules = rules_for(blocks, suffixes).copy() if any(o.kind == "blockdiag" for o in problem.opaque) else None
        self.local: list[Equation] = []
        self.shown_inverses: set[str] = set()
        self._forms: list[tuple[str, tuple, Fraction]] = []
        self._roots: list[tuple[Opaque, Polynomial, list[Step]]] = []

    # ------------------------------------------------------------------ rules of the statement's own letters
    def add(self, equation: Equation, word: Word, both: bool = True, group: int | None = None) -> None:
        """A rule, and its transpose, wherever normal forms are taken."""
        self.local.append(equation)
        self.rules.add_equation(equation, word, self.alphabet, group)
        if both and self.block_rules is not None:
            self.block_rules.add_equation(equation, word, self.alphabet, group)

    def prepare(self, extra: list[tuple[Equation, Word]]) -> None:
        """Rules for the letters that the problem has: hypotheses on them, inverses, diagonal parts, roots."""
        for equation, word in extra:
            self.add(equation, word, group=-1)
        for letter in self.inverted_letters():
            for pair in ((letter, inverse_of(letter)), (inverse_of(letter), letter)):
                self.add(Equation({pair: Fraction(1)}, _ONE, "inverse", f"{self.alphabet.word_text(pair)} = I"), pair, group=-1)
        for opaque in self.problem.opaque:
            {"inverse": self._inverse, "blockdiag": self._blocks, "sqrt": self._root}[opaque.kind](opaque)

    def inverted_letters(self) -> list[str]:
        """Letters whose inverse occurs, D, φ and ψ aside."""
        names = {o.name for o in self.problem.opaque if o.kind == "inverse"}
        for p in self.problem.polynomials():
            names |= {split(x)[0] for word in p for x in word if split(x)[1] in ("⁻¹", "⁻*")}
        return sorted(n for n in names if n.rstrip("₂₃₄₅₆₇₈₉") not in ("D", "φ", "ψ"))

    def _inverse(self, o: Opaque) -> None:
        """X⁻¹ = Z, or the rules XX⁻¹ = X⁻¹X = I."""
        X = o.name
        definition = Equation({(X,): Fraction(1)}, o.inner, "definition", f"{self.alphabet.letters[X].text} is its operand")
        form, steps = self.rules.reduce(o.inner, self.alphabet)
        if not form:
            return
        key, scale = _scaled(form)
        for z in self._candidates(form, key, scale):
            lemma = self._inverse_is(X, o.inner, z, definition)
            if lemma is not None:
                self.shown_inverses.add(X)
                self.add(lemma, (inverse_of(X),), group=-1)
                return
        starred = self.alphabet.star_of(o.inner)
        symmetric = normal_form(starred, self.rules, self.alphabet) == form
        for left, right in (((), (inverse_of(X),)), ((inverse_of(X),), ())):
            equation = self._times_inverse(X, left, right, form, steps, definition)
            self.add(equation, left + max(form, key=weight) + right, both=False)
        if symmetric and not self.alphabet.letters[X].symmetric:
            star = self.alphabet.star(X)
            lemma = self._inverse_is(star, starred, {(inverse_of(X),): Fraction(1)}, definition.transposed(self.alphabet))
            if lemma is not None:
                # One direction is enough: the transpose of X⁻* = X⁻¹ says the same.
                self.local.append(lemma)
                for rules in filter(None, (self.rules, self.block_rules)):
                    rules.add(_rule(lemma, (inverse_of(star),)))
        self._forms.append((X, key, scale))

    def _candidates(self, form: Polynomial, key: tuple, scale: Fraction) -> Iterator[Polynomial]:
        if len(form) == 1:
            ((word, c),) = form.items()
            if all(self._invertible(x) for x in word):
                yield {tuple(inverse_of(x) for x in reversed(word)): 1 / c}
        known = _known_inverses(self.setting)
        for suffix in self.problem.suffixes:
            plain = _scaled(_unmarked(form, suffix))[0] if suffix else key
            if plain in known:
                z, its_scale = known[plain]
                z = {tuple(_mark(x, suffix) for x in w): c for w, c in z.items()} if suffix else z
                yield {w: c * its_scale / scale for w, c in z.items()}
        for X, other, its_scale in self._forms:
            if other == key:
                yield {(inverse_of(X),): its_scale / scale}
            starred = _scaled(self.alphabet.star_of(dict(other)))
            if tuple(sorted((w, c) for w, c in starred[0])) == key:
                yield {(inverse_of(self.alphabet.star(X)),): its_scale / scale}

    def _invertible(self, letter: str) -> bool:
        name, mark = split(letter)
        plain = name.rstrip("₂₃₄₅₆₇₈₉")
        return plain in _INVERTIBLE or (name.startswith("⟨") and mark in ("⁻¹", "⁻*"))

    def _inverse_is(self, X: str, inner: Polynomial, z: Polynomial, definition: Equation) -> Equation | None:
        """The lemma X⁻¹ = Z, by XZ = I and ZX = I; None if these do not come out."""
        a, text = self.alphabet, self.alphabet.text
        shown = self.alphabet.letter_text(X)
        halves = []
        for product, says in ((times(inner, z), f"{shown} Z = I"), (times(z, inner), f"Z {shown} = I")):
            form, steps = self.rules.reduce(product, a)
            if form != _ONE:
                return None
            halves.append(Equation(product, _ONE, "lemma", f"{says}, Z = {text(z)}", steps=_numbered(steps)))
        Y = inverse_of(X)
        first = framed((Y,), times(inner, z), ())
        second = {(Y, X, *w): c for w, c in z.items()}
        inverse = self._pair(Y, X)
        steps = [
            Step({(Y,): Fraction(1)}, first, [Use(Fraction(-1), (Y,), halves[0], (), False)], a),
            Step(first, second, [Use(-c, (Y,), definition, w, False) for w, c in z.items()], a),
            Step(second, z, [Use(c, (), inverse, w) for w, c in z.items()], a),
        ]
        note = "both products are I, the spaces are equal: Z is the inverse"
        return Equation(
            {(Y,): Fraction(1)}, z, "lemma", f"{a.letter_text(Y)} = {text(z)}", steps=_numbered(steps), uses=[halves[1]], note=note
        )

    def _pair(self, a: str, b: str) -> Equation:
        """The equation a b = I of a letter and its inverse."""
        word = (a, b)
        for equation in self.local:
            if equation.kind == "inverse" and word in equation.lhs:
                return equation
            if equation.kind == "inverse" and word in equation.transposed(self.alphabet).lhs:
                return equation.transposed(self.alphabet)
        return Equation({word: Fraction(1)}, _ONE, "inverse", f"{self.alphabet.word_text(word)} = I")

    def _times_inverse(
        self, X: str, left: Word, right: Word, form: Polynomial, steps: list[Step], definition: Equation
    ) -> Equation:
        """The lemma left (normal form of X) right = I, one of left and right X⁻¹."""
        a = self.alphabet
        inner = steps[0].before if steps else form
        chain = [_framed_step(step.reversed(), left, right) for step in reversed(steps)]
        whole = {left + (X,) + right: Fraction(1)}
        chain.append(Step(framed(left, inner, right), whole, [Use(Fraction(-1), left, definition, right, False)], a))
        pair = self._pair(*(left + (X,) + right))
        chain.append(Step(whole, _ONE, [Use(Fraction(1), (), pair, ())], a))
        lhs = framed(left, form, right)
        return Equation(lhs, _ONE, "lemma", f"{a.text(lhs)} = I", steps=_numbered(chain))

    def _blocks(self, o: Opaque) -> None:
        """blockdiag(X) by the normal form of X."""
        assert self.block_rules is not None
        form, steps = self.block_rules.reduce(o.inner, self.alphabet)
        value = diagonal_part(form, self.alphabet)
        if value == {(o.name,): Fraction(1)}:
            return
        a = self.alphabet
        equation = Equation(
            {(o.name,): Fraction(1)},
            value,
            "structure",
            f"{a.letters[o.name].text} = {a.text(value)}",
            steps=_numbered(steps),
            note="the diagonal blocks of each word, by where its letters lead on the tree",
            check=lambda: chain_holds(steps, o.inner, form) and diagonal_part(form, a) == value,
        )
        self.add(equation, (o.name,), group=-1)

    def _root(self, o: Opaque) -> None:
        """LL* = A for L = A^½."""
        a, L = self.alphabet, o.name
        form, steps = self.rules.reduce(o.inner, a)
        text = a.letters[L].text
        for other, its_form, its_steps in self._roots:
            if its_form == form:
                equal = Equation(
                    {(L,): Fraction(1)},
                    {(other.name,): Fraction(1)},
                    "structure",
                    f"{text} = {a.letters[other.name].text}",
                    steps=[*steps, *its_steps],
                    note="roots of equal operators",
                    check=lambda: chain_holds(steps, o.inner, form) and chain_holds(its_steps, other.inner, form),
                )
                self.add(equal, (L,), group=-1)
                return
        self._roots.append((o, form, steps))
        star = a.star(L)
        square = Equation({(L, star): Fraction(1)}, o.inner, "definition", f"{text} {text}* = {a.text(o.inner)}")
        self.add(square, (L, star), group=-1)
        if L in self.inverted_letters() and len(form) == 1:
            ((word, c),) = form.items()
            before = {(inverse_of(L), *word): Fraction(1)}
            inner = steps[0].before if steps else form
            chain = [Step(before, {(inverse_of(L), *word): Fraction(1)}, [], a)]
            scaled = {(inverse_of(L), *w): x / c for w, x in inner.items()}
            chain += [_scaled_step(_framed_step(s.reversed(), (inverse_of(L),), ()), 1 / c) for s in reversed(steps)]
            whole = {(inverse_of(L), L, star): 1 / c}
            chain.append(Step(scaled, whole, [Use(-1 / c, (inverse_of(L),), square, (), False)], a))
            chain.append(Step(whole, {(star,): 1 / c}, [Use(1 / c, (), self._pair(inverse_of(L), L), (star,))], a))
            lemma = Equation(before, {(star,): 1 / c}, "lemma", f"{a.text(before)} = {a.text({(star,): 1 / c})}", steps=_numbered(chain))
            self.add(lemma, (inverse_of(L), *word))

    # ------------------------------------------------------------------ both sides
    def run(self, lhs: Polynomial, rhs: Polynomial) -> Outcome:
        """Normal forms of both sides, cleared of inverses where that helps."""
        p, left = self.rules.reduce(lhs, self.alphabet)
        q, right = self.rules.reduce(rhs, self.alphabet)
        outcome = Outcome(left, right, p, q)
        return outcome if outcome.closed else self.clear(outcome)

    def clear(self, outcome: Outcome, rounds: int = 4) -> Outcome:
        """Both sides times X, from the side on which an X⁻¹ stands in what differs; the first outcome if that does not close it."""
        at = outcome
        for _ in range(rounds):
            found = self._to_clear(combine((1, at.lhs), (-1, at.rhs)))
            if found is None:
                return outcome
            letter, on_left = found
            at = self._cleared(at, letter, on_left)
            if at.closed:
                return at
        return outcome

    def _to_clear(self, difference: Polynomial) -> tuple[str, bool] | None:
        """(X⁻¹, whether it stands at the left end of a word)."""
        for on_left in (True, False):
            for word in difference:
                if not word:
                    continue
                letter = word[0] if on_left else word[-1]
                name, mark = split(letter)
                if mark in ("⁻¹", "⁻*") and name.rstrip("₂₃₄₅₆₇₈₉") not in ("D", "φ", "ψ"):
                    return letter, on_left
        return None

    def _cleared(self, at: Outcome, letter: str, on_left: bool) -> Outcome:
        a, X = self.alphabet, inverse_of(letter)
        frame = (at.frame[0] + (letter,), at.frame[1]) if on_left else (at.frame[0], (letter,) + at.frame[1])
        pair = self._pair(letter, X) if on_left else self._pair(X, letter)
        sides = []
        for steps, p in ((at.left, at.lhs), (at.right, at.rhs)):
            times_x = {((X, *w) if on_left else (*w, X)): c for w, c in p.items()}
            uses = [
                Use(-c, at.frame[0], pair, w + at.frame[1], False) if on_left else Use(-c, at.frame[0] + w, pair, at.frame[1], False)
                for w, c in p.items()
            ]
            insert = Step(p, times_x, uses, a, f"{pair.text}, read backwards", frame, at.frame)
            opened, more = self._opened(X, times_x)
            form, rest = self.rules.reduce(opened, a)
            for step in [*more, *rest]:
                step.frame = frame
                step.frame_before = None
                _frame_uses(step, frame)
            sides.append(([*steps, insert, *more, *rest], form))
        return Outcome(sides[0][0], sides[1][0], sides[0][1], sides[1][1], frame)

    def _opened(self, X: str, p: Polynomial) -> tuple[Polynomial, list[Step]]:
        """X written as its operand."""
        name, mark = split(X)
        opaque = next((o for o in self.problem.opaque if o.name == name and o.kind == "inverse"), None)
        if opaque is None:
            return p, []
        a = self.alphabet
        inner = a.star_of(opaque.inner) if mark == "*" else opaque.inner
        definition = Equation({(X,): Fraction(1)}, inner, "definition", f"{a.letter_text(X)} is its operand")
        out: Polynomial = {}
        uses = []
        for word, c in p.items():
            if X not in word:
                add_to(out, word, c)
                continue
            at = word.index(X)
            uses.append(Use(c, word[:at], definition, word[at + 1 :]))
            for w, x in inner.items():
                add_to(out, word[:at] + w + word[at + 1 :], c * x)
        return out, [Step(p, out, uses, a)] if uses else []


def _rule(equation: Equation, word: Word):
    from .rules import rule_from

    return rule_from(equation, word, -1)


def _numbered(steps: list[Step]) -> list[Step]:
    for number, step in enumerate(steps, 1):
        step.number = number
    return steps


def _framed_step(step: Step, left: Word, right: Word) -> Step:
    """The same step between two words."""
    uses = [Use(u.coefficient, left + u.left, u.equation, u.right + right, u.forward) for u in step.uses]
    return Step(framed(left, step.before, right), framed(left, step.after, right), uses, step.alphabet, step.title)


def _scaled_step(step: Step, c: Fraction) -> Step:
    if c == 1:
        return step
    uses = [Use(c * u.coefficient, u.left, u.equation, u.right, u.forward) for u in step.uses]
    before, after = ({w: c * x for w, x in p.items()} for p in (step.before, step.after))
    return Step(before, after, uses, step.alphabet, step.title)


def _frame_uses(step: Step, frame: tuple[Word, Word]) -> None:
    for use in step.uses:
        use.left, use.right = frame[0] + use.left, use.right + frame[1]


def _unmarked(p: Polynomial, suffix: str) -> Polynomial:
    """A polynomial of one further model's letters, in those of the first."""
    return {tuple(_unmark(x, suffix) for x in w): c for w, c in p.items()}


def _unmark(letter: str, suffix: str) -> str:
    name, mark = split(letter)
    return (name[: -len(suffix)] if name.endswith(suffix) else name) + mark


def _mark(letter: str, suffix: str) -> str:
    name, mark = split(letter)
    return name + suffix + mark


def local_alphabet(problem: Problem) -> Alphabet:
    """The letters of a problem."""
    return problem.alphabet
