"""The normal form: the rules, their directions, and the step-by-step reduction of a polynomial.

A rule replaces a word by lighter or shorter ones (`weight`), so every reduction ends. Each step applies one equation
wherever it fits, in order of rank: hypotheses, cancellations, rules that shorten words, definitions of
abbreviations, then the recursions.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any

from . import mechanics
from .axioms import Theory, solved, theory
from .equations import Equation, Step, Use, marked, numbered
from .walk import GaveUp
from .words import FIRST, ONE, Alphabet, Number, Polynomial, Word, add_to, derivations, inverted, plain, ratio

WORDS, REWRITES = 2000, 12000
"""Sizes at which a reduction gives up; `generous` allows for more."""
REMEMBERED = 50000
"""Number of words for which the first matching rule is cached."""
_UNSEEN = 1 << 30
"""A rank beyond all groups."""
_allowed: ContextVar[int] = ContextVar("allowed", default=1)


@contextmanager
def generous(times: int) -> Iterator[None]:
    """Allow reductions of several times the size inside the block."""
    token = _allowed.set(times)
    try:
        yield
    finally:
        _allowed.reset(token)


# (the replaced word, the equation), in order of rank. Transposes are rules as well.
_CANCELLING = [(f"{x} {x}⁻¹", f"{x} {x}⁻¹ = I") for x in ("D", "M", "P", "R", "J", "Υ", "X")] + [("X⁻¹ X", "X⁻¹ X = I")]
_RESOLVENTS = [
    ("φ E_φ", "φ E_φ = φ − I"),
    ("E_φ φ", "E_φ φ = φ − I"),
    ("ψ E_ψ", "ψ E_ψ = ψ − I"),
    ("E_ψ ψ", "E_ψ ψ = ψ − I"),
    ("φ K H ψ", "φ K H ψ = φ − ψ"),
    ("ψ K H φ", "ψ K H φ = φ − ψ"),
]
_GAINS = [
    ("H P H*", "D = H P H* + J"),
    ("P H*", "G D = P H*"),
    ("H G", "H G = I − J D⁻¹"),
    ("E_φ G", "K = E_φ G"),
    ("φ G", "φ G = G + φ K"),
    ("ψ G", "ψ G = G + ψ K J D⁻¹"),
    ("G* P⁻¹", "G* P⁻¹ = D⁻¹ H"),
]
_ARTICULATED = [("ψ M ψ*", "ψ M ψ* = ψ P + P ψ* − P − ψ K J K* ψ*"), ("φ M ψ*", "φ M ψ* = φ P + P ψ* − P")]
_WITHOUT_R = [("φ M φ*", "φ M φ* = φ P + P φ* − P + φ K D K* φ*")]
_WITH_R = [
    ("φ M φ*", "φ M φ* = φ R + R φ* − R"),
    ("φ K D K* φ*", "φ K D K* φ* = φ R + R φ* − R − φ P − P φ* + P"),
    ("E_φ R E_φ*", "M = R − E_φ R E_φ*"),
    ("E_φ R φ*", "E_φ R φ* = E_φ R + R φ* − M φ*"),
    ("φ R H* K* ψ*", "φ R H* K* ψ* = R H* K* ψ* + φ R − φ P + R ψ* − P ψ* − R + P"),
    ("E_φ R H* K* ψ*", "E_φ R H* K* ψ* = − E_φ R ψ* + E_φ R − M ψ* + R ψ*"),
    (
        "ψ K H R H* K* ψ*",
        "ψ K H R H* K* ψ* = − ψ R H* K* ψ* − ψ K H R ψ* + ψ K H R + R H* K* ψ* + ψ K J K* ψ* + ψ R − ψ P + R ψ* − P ψ* − R + P",
    ),
]
_OPENING = [
    ("φ⁻¹", "φ⁻¹ = I − E_φ"),
    ("ψ⁻¹", "ψ⁻¹ = I − E_ψ"),
    ("φ̃", "φ̃ = φ − I"),
    ("ψ̃", "ψ̃ = ψ − I"),
    ("τ̄", "τ̄ = I − G H"),
    ("τ", "τ = G H"),
    ("P⁺", "P⁺ = P − G D G*"),
    ("E_ψ", "E_ψ = E_φ − K H"),
    ("Ω", "Ω = ψ* H* D⁻¹ H ψ"),
]
_REST = [
    ("ψ E_φ", "ψ E_φ = ψ − I + ψ K H"),
    ("E_φ ψ", "E_φ ψ = ψ − I + K H ψ"),
    ("E_φ P E_φ*", "M = P − E_φ P E_φ* + K D K*"),
    ("E_φ P φ*", "E_φ P φ* = E_φ P + P φ* − M φ* + K D K* φ*"),
    ("E_φ P ψ*", "E_φ P ψ* = E_φ P + P ψ* − M ψ*"),
]
_SIBLINGS = [("S", "Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H")]
COMPLIANCE = [
    ("ψ* H* D⁻¹ H ψ", "ψ* H* D⁻¹ H ψ = ψ* Υ + Υ ψ − Υ + ψ* S ψ"),
    ("E_φ* Υ E_φ", "E_φ* Υ E_φ = S + Υ − H* D⁻¹ H + E_φ* Υ K H + H* K* Υ E_φ − H* K* Υ K H"),
    ("E_φ* Υ ψ", "E_φ* Υ ψ = H* K* Υ ψ + E_φ* Υ − H* K* Υ + S ψ + Υ ψ − H* D⁻¹ H ψ"),
    ("φ* H* K* Υ ψ", "φ* H* K* Υ ψ = φ* H* K* Υ + φ* H* D⁻¹ H ψ − φ* Υ − Υ ψ + Υ − φ* S ψ"),
]

_WEIGHTS = {
    **{"D": 0, "J": 0, "K": 1, "H": 1, "G": 2, "P": 3, "R": 3, "M": 5, "E_φ": 3, "φ": 1, "ψ": 1, "Υ": 3, "S": 22},
    **{"φ̃": 9, "ψ̃": 9, "τ": 9, "τ̄": 9, "P⁺": 19, "E_ψ": 9, "Ω": 19},
    **mechanics.WEIGHTS,
}
_HEAVY = {"‹": 30}
_INVERSE_WEIGHTS = {"D": 0, "φ": 9, "ψ": 19}


@cache
def letter_weight(letter: str) -> int:
    """Return the weight of a letter. Derivatives are heavy, because the rules write them by Δ; so are a user's constants."""
    name = plain(letter)
    if name.startswith(FIRST):  # second derivatives reduce to first ones
        return 40 if len(derivations(name)[0]) == 1 else 200
    if name[0] in _HEAVY:
        return _HEAVY[name[0]]
    return (_INVERSE_WEIGHTS if inverted(letter) else _WEIGHTS).get(name, 1)


def weight(word: Word) -> tuple[int, int, Word]:
    """Return the order that rules decrease: weight, then length, then the letters."""
    return sum(map(letter_weight, word)), len(word), word


def scaled(p: Polynomial) -> tuple[tuple, Number]:
    """(a key for the polynomial up to a factor, that factor)."""
    lead = p[max(p, key=weight)]
    return tuple(sorted((w, ratio(c, lead)) for w, c in p.items())), lead


# ---------------------------------------------------------------------- rules
@dataclass(frozen=True)
class Rule:
    """word → to, because word - to = factor⁻¹ (lhs - rhs) of the equation; `group` is its rank, which its transpose shares."""

    word: Word
    to: tuple[tuple[Word, Number], ...]
    equation: Equation
    factor: Number
    group: int


def rule_from(equation: Equation, word: Word, group: int) -> Rule:
    """The equation read as word → the rest."""
    difference = equation.difference
    c = difference[word]
    return Rule(word, tuple((w, ratio(-x, c)) for w, x in difference.items() if w != word), equation, ratio(1, c), group)


@dataclass
class Budget:
    """Number of rewrites left; equal inputs spend equal numbers."""

    rewrites: int = field(default_factory=lambda: REWRITES * _allowed.get())


class Rules:
    """Rules by the first letter of the replaced word, and by group: own rules, and the fixed rules of `base`."""

    def __init__(self, base: Rules | None = None):
        self._base = base
        self._by_first: dict[str, list[Rule]] = {}
        self._groups: dict[int, dict[str, list[Rule]]] = {}
        self._lengths: dict[str, set[int]] = {}
        self._ranks: dict[Word, int] = {}
        self._best: dict[Word, int | None] = {}
        self._places: dict[int, dict[Word, tuple[int, Rule] | None]] = {}

    def copy(self) -> Rules:
        """Return rules that can be extended; the original must not change from here on."""
        return Rules(self)

    def add(self, rule: Rule) -> None:
        first = rule.word[0]
        self._by_first.setdefault(first, []).append(rule)
        self._groups.setdefault(rule.group, {}).setdefault(first, []).append(rule)
        self._lengths.setdefault(first, set()).add(len(rule.word))
        self._ranks[rule.word] = min(rule.group, self._ranks.get(rule.word, rule.group))
        self._best.clear()
        self._places.pop(rule.group, None)

    def add_equation(self, equation: Equation, word: Word, alphabet: Alphabet, group: int) -> None:
        """Add the rule of an equation, and of its transpose if the two together still end."""
        rule = rule_from(equation, word, group)
        self.add(rule)
        star = alphabet.star_word(word)
        if star != word and all(w != star for w, _ in rule.to):
            self.add(rule_from(equation.transposed(alphabet), star, group))

    def beginning(self, letter: str) -> list[Rule]:
        """The rules for words that begin with a letter."""
        below = [] if self._base is None else self._base.beginning(letter)
        return below + self._by_first[letter] if letter in self._by_first else below

    def all(self) -> list[Rule]:
        """Every rule, by first letters."""
        return [rule for letter in self._letters() for rule in self.beginning(letter)]

    def _letters(self) -> dict[str, list[Rule]]:
        return self._by_first if self._base is None else {**self._base._letters(), **self._by_first}

    def best(self, word: Word) -> int | None:
        """Return the first group in rank that fits anywhere."""
        found: int | None = self._best.get(word, _UNSEEN)
        if found == _UNSEEN:
            found = None if self._base is None else self._base.best(word)
            for place, letter in enumerate(word):
                for length in self._lengths.get(letter, ()):
                    rank = self._ranks.get(word[place : place + length])
                    if rank is not None and (found is None or rank < found):
                        found = rank
            _remember(self._best, word, found)
        return found

    def of(self, rank: int) -> Rules:
        """Return the rules that contain a group: a statement's own rules, or the common ones."""
        return self if self._base is None or rank in self._groups else self._base.of(rank)

    def place(self, word: Word, rank: int) -> tuple[int, Rule] | None:
        """Return (place, rule) of the group's leftmost match; of several rules there, the one that was added first."""
        places = self._places.setdefault(rank, {})
        if word in places:
            return places[word]
        rules = self._groups[rank]
        fitting = ((at, rule) for at, x in enumerate(word) for rule in rules.get(x, ()) if word[at : at + len(rule.word)] == rule.word)
        return _remember(places, word, next(fitting, None))

    def reduce(self, p: Polynomial, alphabet: Alphabet, budget: Budget | None = None) -> tuple[Polynomial, list[Step]]:
        """Return the normal form and the steps to it.

        Raises
        ------
        GaveUp
            The polynomial exceeds `WORDS` words, or the reduction exceeds the budget of rewrites.
        """
        budget = budget or Budget()
        steps: list[Step] = []
        while True:
            groups = [group for word in p if (group := self.best(word)) is not None]
            if not groups:
                return p, steps
            steps.append(self._apply(p, p, min(groups), alphabet, budget))
            p = steps[-1].after

    def reduce_both(self, p: Polynomial, q: Polynomial, alphabet: Alphabet) -> tuple[Polynomial, list[Step], Polynomial, list[Step]]:
        """Return (p, its steps, q, its steps), reduced where p and q differ; equal if their normal forms are equal. Raises GaveUp."""
        budget = Budget()
        sides = [p, q]
        steps: tuple[list[Step], list[Step]] = ([], [])
        while True:
            differing = [{w for w, c in one.items() if other.get(w) != c} for one, other in (sides, sides[::-1])]
            groups = [group for words in differing for word in words if (group := self.best(word)) is not None]
            if not groups:
                return sides[0], steps[0], sides[1], steps[1]
            for i in (0, 1):
                step = self._apply(sides[i], differing[i], min(groups), alphabet, budget)
                if step.uses:
                    steps[i].append(step)
                    sides[i] = step.after

    def _apply(self, p: Polynomial, where: Container[Word], group: int, alphabet: Alphabet, budget: Budget) -> Step:
        """Apply one equation at every place in these words."""
        done: Polynomial = {}
        uses: list[Use] = []
        rules = self.of(group)
        for start, x in p.items():
            todo = [(start, x)]
            if start not in where:
                add_to(done, *todo.pop())
            while todo:
                word, c = todo.pop()
                found = rules.place(word, group)
                if found is None:
                    add_to(done, word, c)
                    continue
                place, rule = found
                left, right = word[:place], word[place + len(rule.word) :]
                uses.append(Use(c * rule.factor, left, rule.equation, right, rule.word, rule.factor > 0))
                todo += [(left + w + right, c * y) for w, y in reversed(rule.to)]
                budget.rewrites -= 1
                if budget.rewrites < 0 or len(todo) + len(done) > WORDS * _allowed.get():
                    raise GaveUp
        return Step(p, done, uses, alphabet)


def _remember(where: dict[Word, Any], word: Word, found: Any) -> Any:
    if len(where) > REMEMBERED:
        where.clear()
    where[word] = found
    return found


def normal_form(p: Polynomial, rules: Rules, alphabet: Alphabet) -> Polynomial:
    """The normal form alone."""
    return rules.reduce(p, alphabet)[0]


# ---------------------------------------------------------------------- which rules
@dataclass(frozen=True)
class Setting:
    """Choice of the rules: hypotheses, and the recursions that the statement needs.

    With `composite`, φMφ* is written by R; with `compliance`, Ω by Υ and S, else S by Υ, which then is like any other letter; with
    `velocities`, a and b are written by Ṽ, V̄ and Ḣ, with the rules of `mechanics`.
    """

    hypotheses: frozenset[str] = frozenset()
    composite: bool = False
    compliance: bool = False
    velocities: bool = False


def chosen(setting: Setting) -> list[tuple[str, str]]:
    """Return (word, equation) of a setting, by rank."""
    facts: list[tuple[str, str]] = [(letter, text) for letter, text in _vanishing(setting)]
    facts += [(word, text) for word, text in _CANCELLING if word != "J J⁻¹" or "J = 0" not in setting.hypotheses]
    facts += [*_RESOLVENTS, *_GAINS, *_OPENING, *mechanics.ABBREVIATIONS]
    facts += mechanics.VELOCITIES if setting.velocities else []
    facts += _ARTICULATED
    facts += _WITH_R if setting.composite else _WITHOUT_R
    facts += _REST
    facts += COMPLIANCE if setting.compliance else _SIBLINGS
    return facts


def _vanishing(setting: Setting) -> list[tuple[str, str]]:
    """Return (letter, equation) of the letters that are zero."""
    return [("J", "J = 0")] * ("J = 0" in setting.hypotheses) + [("S", "S = 0")] * ("serial chain" in setting.hypotheses)


@lru_cache(maxsize=64)
def rules_for(setting: Setting, marks: tuple[str, ...] = ("",), locked: tuple[tuple[str, str], ...] = ()) -> Rules:
    """Return the rules of a setting for the letters of one or more models. The result is shared: copy before adding.

    `locked` : (mark, the mark of its model) of the trees with locked hinges.
    """
    facts = theory()
    rules = Rules()
    for group, (text_word, text) in enumerate(chosen(setting)):
        word = tuple(text_word.split())
        equation = facts(text)
        if word not in equation.difference:
            equation = equation.transposed(facts.alphabet)
        for letter, zero in _vanishing(setting):
            if text != zero:
                equation = corollary(equation, word, letter, zero)
        for mark in marks:
            _add_both(rules, equation, word, facts, (mark, dict(locked).get(mark, mark)), group)
    return rules


def _add_both(rules: Rules, equation: Equation, word: Word, facts: Theory, marks: tuple[str, str], group: int) -> None:
    """A rule and its transpose, for the letters of one model."""
    starred = facts.alphabet.star_word(word)
    pairs = [(equation, word)] + ([(equation.transposed(facts.alphabet), starred)] if starred not in equation.difference else [])
    for e, w in pairs:
        rules.add(rule_from(e.copied(*marks), marked(w, *marks), group))


@cache
def corollary(equation: Equation, word: Word, letter: str, zero: str) -> Equation:
    """Return an equation with a letter set to zero: H G = I from H G = I − J D⁻¹. The equation itself if the letter does not occur."""
    facts = theory()
    _, _, rest, sign = solved(equation, word)
    gone = [(w, c, w.index(letter)) for w, c in rest.items() if letter in w]
    if not gone or letter in word:
        return equation
    a, kept = facts.alphabet, {w: c for w, c in rest.items() if letter not in w}
    uses = [Use(c, w[:at], facts(zero), w[at + 1 :], (letter,)) for w, c, at in gone]
    steps = [Step({word: ONE}, rest, [Use(sign, (), equation, (), word, sign > 0)], a), Step(rest, kept, uses, a)]
    return Equation("lemma", f"{a.word_text(word)} = {a.text(kept)}", {word: ONE}, kept, steps=numbered(steps))


def overlaps(first: Sequence[str], second: Sequence[str]) -> Iterable[int]:
    """Return the lengths by which a word's end may overlap another's beginning."""
    return (k for k in range(1, min(len(first), len(second))) if tuple(first[-k:]) == tuple(second[:k]))
