"""The normal form: which equations are read in which direction, and how a polynomial is brought there, step by step.

A rule replaces a word by shorter or lighter ones (`weight`), so that every chain of rules ends. In each step one equation is applied wherever
it fits, the one that stands first in the list before all others: hypotheses, what cancels, then what makes words short, then what opens
abbreviations.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache

from .axioms import Theory, solved, theory
from .equations import Equation, Step, Use
from .words import Alphabet, Polynomial, Word, add_to, split

WORDS, REWRITES = 1500, 6000
"""Sizes at which a reduction gives up."""

# (the word that goes, the equation), in order of rank. Transposes are rules as well.
_CANCELLING = [("D D⁻¹", "D D⁻¹ = I"), ("D⁻¹ D", "D⁻¹ D = I")]
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
    ("V", "V = φ* H* θ̇"),
]
_REST = [
    ("ψ E_φ", "ψ E_φ = ψ − I + ψ K H"),
    ("E_φ ψ", "E_φ ψ = ψ − I + K H ψ"),
    ("E_φ P E_φ*", "M = P − E_φ P E_φ* + K D K*"),
    ("E_φ P φ*", "E_φ P φ* = E_φ P + P φ* − M φ* + K D K* φ*"),
    ("E_φ P ψ*", "E_φ P ψ* = E_φ P + P ψ* − M ψ*"),
]
_SIBLINGS = [("S", "Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H")]
_COMPLIANCE = [
    ("ψ* H* D⁻¹ H ψ", "ψ* H* D⁻¹ H ψ = ψ* Υ + Υ ψ − Υ + ψ* S ψ"),
    ("E_φ* Υ E_φ", "E_φ* Υ E_φ = S + Υ − H* D⁻¹ H + E_φ* Υ K H + H* K* Υ E_φ − H* K* Υ K H"),
    ("E_φ* Υ ψ", "E_φ* Υ ψ = H* K* Υ ψ + E_φ* Υ − H* K* Υ + S ψ + Υ ψ − H* D⁻¹ H ψ"),
    ("φ* H* K* Υ ψ", "φ* H* K* Υ ψ = φ* H* K* Υ + φ* H* D⁻¹ H ψ − φ* Υ − Υ ψ + Υ − φ* S ψ"),
]
_VELOCITIES = [("a", "a = Ṽ H* θ̇ + Ḣ* θ̇"), ("b", "b = V̄ M V")]

_WEIGHTS = {
    **{"D": 0, "J": 0, "K": 1, "H": 1, "G": 2, "P": 3, "R": 3, "M": 5, "E_φ": 3, "φ": 1, "ψ": 1, "Υ": 3, "S": 20},
    **{"φ̃": 9, "ψ̃": 9, "τ": 9, "τ̄": 9, "P⁺": 19, "E_ψ": 9, "Ω": 19, "V": 9, "a": 19, "b": 29},
}
_INVERSE_WEIGHTS = {"D": 0, "φ": 9, "ψ": 19}


@lru_cache(maxsize=None)
def letter_weight(letter: str) -> int:
    """What a letter weighs: every rule of `rules_for` replaces a word by lighter ones, or shorter ones of the same weight."""
    name, mark = split(letter)
    name = name.rstrip("₂₃₄₅₆₇₈₉")
    if mark in ("⁻¹", "⁻*"):
        return _INVERSE_WEIGHTS.get(name, 1)
    return _WEIGHTS.get(name, 40 if name.startswith("∂") else 1)


def weight(word: Word) -> tuple[int, int, Word]:
    """The order that all rules lower."""
    return sum(map(letter_weight, word)), len(word), word


# ---------------------------------------------------------------------- rules
@dataclass(frozen=True)
class Rule:
    """word → to, by lhs - rhs = sign (word - to); `group` is its rank, shared by its transpose."""

    word: Word
    to: tuple[tuple[Word, Fraction], ...]
    equation: Equation
    factor: Fraction
    group: int


def rule_from(equation: Equation, word: Word, group: int) -> Rule:
    """The equation read as word → the rest."""
    difference = equation.difference
    c = difference[word]
    return Rule(word, tuple((w, -x / c) for w, x in difference.items() if w != word), equation, 1 / c, group)


@dataclass
class Budget:
    """What a search may still spend, in rewrites; the same input spends the same."""

    rewrites: int = REWRITES


class GaveUp(Exception):
    """A reduction outgrew its limits."""


@dataclass
class Rules:
    """Rules by the first letter of the word that they replace."""

    by_first: dict[str, list[Rule]] = field(default_factory=dict)
    groups: int = 0
    known: dict[Word, tuple[int, int, Rule] | None] = field(default_factory=dict)

    def copy(self) -> Rules:
        return Rules({k: list(v) for k, v in self.by_first.items()}, self.groups)

    def add(self, rule: Rule) -> None:
        self.by_first.setdefault(rule.word[0], []).append(rule)
        self.groups = max(self.groups, rule.group + 1)
        self.known.clear()

    def add_equation(self, equation: Equation, word: Word, alphabet: Alphabet, group: int | None = None) -> None:
        """Its rule and its transpose's."""
        group = self.groups if group is None else group
        first = rule_from(equation, word, group)
        self.add(first)
        star = alphabet.star_word(word)
        if star != word:
            self.add(rule_from(equation.transposed(alphabet), star, group))

    def all(self) -> list[Rule]:
        return [rule for rules in self.by_first.values() for rule in rules]

    def best(self, word: Word) -> tuple[int, int, Rule] | None:
        """(group, place, rule) of the first rule in rank that fits anywhere, leftmost."""
        if word in self.known:
            return self.known[word]
        best = None
        for place, letter in enumerate(word):
            for rule in self.by_first.get(letter, ()):
                if (best is None or rule.group < best[0]) and word[place : place + len(rule.word)] == rule.word:
                    best = (rule.group, place, rule)
        if len(self.known) < 20000:
            self.known[word] = best
        return best

    def _of_group(self, word: Word, group: int) -> tuple[int, Rule] | None:
        for place, letter in enumerate(word):
            for rule in self.by_first.get(letter, ()):
                if rule.group == group and word[place : place + len(rule.word)] == rule.word:
                    return place, rule
        return None

    def reduce(self, p: Polynomial, alphabet: Alphabet, budget: Budget | None = None) -> tuple[Polynomial, list[Step]]:
        """(the normal form, the steps that lead there). Raises GaveUp where it grows beyond all limits."""
        budget = budget or Budget()
        steps: list[Step] = []
        while True:
            fitting = [b[0] for word in p if (b := self.best(word)) is not None]
            if not fitting:
                return p, steps
            step = self._apply(p, min(fitting), alphabet, budget)
            steps.append(step)
            p = step.after

    def _apply(self, p: Polynomial, group: int, alphabet: Alphabet, budget: Budget) -> Step:
        """One equation, at every place."""
        done: Polynomial = {}
        uses: list[Use] = []
        for start, x in p.items():
            todo = [(start, x)]
            while todo:
                word, c = todo.pop()
                found = self._of_group(word, group)
                if found is None:
                    add_to(done, word, c)
                    continue
                place, rule = found
                left, right = word[:place], word[place + len(rule.word) :]
                uses.append(Use(c * rule.factor, left, rule.equation, right, rule.factor > 0))
                todo += [(left + w + right, c * y) for w, y in reversed(rule.to)]
                budget.rewrites -= 1
                if budget.rewrites < 0 or len(todo) + len(done) > WORDS:
                    raise GaveUp
        return Step(p, done, uses, alphabet)


def normal_form(p: Polynomial, rules: Rules, alphabet: Alphabet) -> Polynomial:
    """The normal form alone."""
    return rules.reduce(p, alphabet)[0]


# ---------------------------------------------------------------------- which rules
@dataclass(frozen=True)
class Setting:
    """What decides on the rules: hypotheses, and which recursions the statement needs.

    With `composite`, φMφ* is written by R; with `compliance`, Ω by Υ and S; else S by Υ, which is then like any other letter.
    """

    hypotheses: frozenset[str] = frozenset()
    composite: bool = False
    compliance: bool = False
    velocities: bool = False


@lru_cache(maxsize=64)
def rules_for(setting: Setting, suffixes: tuple[str, ...] = ("",)) -> Rules:
    """The rules of a setting for the letters of one or more models. Shared: copy before adding."""
    facts = theory()
    rules = Rules()
    group = 0
    for word, text in chosen(setting):
        equation = facts(text)
        if tuple(word.split()) not in equation.difference:
            equation = equation.transposed(facts.alphabet)
        for suffix in suffixes:
            _add_both(rules, equation, tuple(word.split()), facts, suffix, group)
        group += 1
    rules.groups = group
    return rules


def chosen(setting: Setting) -> list[tuple[str, str]]:
    """(word, equation) of a setting, by rank."""
    facts: list[tuple[str, str]] = []
    if "J = 0" in setting.hypotheses:
        facts.append(("J", "J = 0"))
    if "serial chain" in setting.hypotheses:
        facts.append(("S", "S = 0"))
    facts += [*_CANCELLING, *_RESOLVENTS, *_GAINS, *_ARTICULATED]
    facts += _WITH_R if setting.composite else _WITHOUT_R
    facts += _OPENING
    if setting.velocities:
        facts += _VELOCITIES
    facts += _REST
    facts += _COMPLIANCE if setting.compliance else _SIBLINGS
    return facts


def _add_both(rules: Rules, equation: Equation, word: Word, facts: Theory, suffix: str, group: int) -> None:
    """A rule and its transpose, for the letters of one model."""
    solved_ = solved(equation, word)
    starred = facts.alphabet.star_word(word)
    pairs = [(solved_[0], word)] + ([(equation.transposed(facts.alphabet), starred)] if starred != word else [])
    for e, w in pairs:
        copy = e.copied(suffix)
        rules.add(rule_from(copy, tuple(_suffixed(x, suffix) for x in w), group))


def _suffixed(letter: str, suffix: str) -> str:
    name, mark = split(letter)
    return name + suffix + mark


def overlaps(first: Sequence[str], second: Sequence[str]) -> Iterable[int]:
    """The lengths by which a word's end may lie over another's beginning."""
    return (k for k in range(1, min(len(first), len(second))) if tuple(first[-k:]) == tuple(second[:k]))
