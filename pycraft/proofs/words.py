"""Words: products of letters; and sums of words with exact coefficients, the ring in which proofs are written.

A letter is a string: a name and marks: "φ", "φ*", "D⁻¹", "φ⁻*". A word is a tuple of letters, the empty one is I. A
polynomial maps words to fractions; the zero operator is the empty polynomial. Products do not commute.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from typing import Any

from .. import _core

Word = tuple[str, ...]
Number = int | Fraction
Polynomial = dict[Word, Number]

ONE = 1
FURTHER = "₂₃₄₅₆₇₈₉"
"""Marks of the letters of a second model, a third, ..., in one statement."""
SHARED = ("E_φ", "φ", "φ̃", "M", "R")
"""Letters that do not depend on which hinges move: a tree with locked hinges shares them with its model."""
SAME_EDGES = ("hinge subset", "embedded loops")
"""Kinds of derived trees that share these letters: with locked hinges, and with loops embedded in groups of bodies."""
NUMBERS = ("tr", "ln det", "norm", "ln", "1", "×", "1/")
"""First letters of words that stand for numbers: see `scalars`."""
NUMBER: Word = ("1",)
_MARKS = ("⁻*", "⁻¹", "*")
_TRANSPOSED = {"": "*", "*": "", "⁻¹": "⁻*", "⁻*": "⁻¹"}
_INVERTED = {"": "⁻¹", "⁻¹": "", "*": "⁻*", "⁻*": "*"}


# ---------------------------------------------------------------------- arithmetic
def ratio(a: Number, b: Number) -> Number:
    """a / b, exactly."""
    quotient = Fraction(a) / b
    return quotient.numerator if quotient.denominator == 1 else quotient


def root_of(c: Number) -> Number | None:
    """Return √c if it is a fraction, else None."""
    above, below = Fraction(c).numerator, Fraction(c).denominator
    if above <= 0:
        return None
    up, down = math.isqrt(above), math.isqrt(below)
    return ratio(up, down) if up * up == above and down * down == below else None


def add_to(p: Polynomial, word: Word, c: Number) -> None:
    """Add c word to p in place; zero terms are dropped."""
    total = p.get(word, 0) + c
    if total:
        p[word] = total
    else:
        p.pop(word, None)


def monomial(*letters: str, c: Number = ONE) -> Polynomial:
    """c times one word."""
    return {letters: c}


def combine(*parts: tuple[Number, Polynomial]) -> Polynomial:
    """Σ c p."""
    total: Polynomial = {}
    for c, p in parts:
        for word, x in p.items():
            add_to(total, word, c * x)
    return total


def times(p: Polynomial, q: Polynomial) -> Polynomial:
    """p q."""
    product: Polynomial = {}
    for u, x in p.items():
        for w, y in q.items():
            add_to(product, u + w, x * y)
    return product


def framed(left: Word, p: Polynomial, right: Word) -> Polynomial:
    """left p right, between two words."""
    return {left + word + right: c for word, c in p.items()}


# ---------------------------------------------------------------------- numbers
def factors_of(word: Word) -> list[Word]:
    """Return the factors of a product of numbers: a single number itself, none for 1."""
    if word == NUMBER:
        return []
    if word[0] != "×":
        return [word]
    made: list[list[str]] = [[]]
    for letter in word[1:]:
        if letter == ";":
            made.append([])
        else:
            made[-1].append(letter)
    return [tuple(f) for f in made]


# ---------------------------------------------------------------------- derivatives
FIRST, SECOND = "∂", "∂ⱼ"
"""Marks of derivatives: along a statement's first and second direction; ∂ⱼ∂X is a derivative of ∂X."""


def derivations(name: str) -> tuple[list[str], str]:
    """Return the marks of derivatives, outermost first, and the differentiated letter."""
    marks = []
    while name.startswith(FIRST):
        marks.append(SECOND if name.startswith(SECOND) else FIRST)
        name = name[len(marks[-1]) :]
    return marks, name


def underived(name: str) -> str:
    """Return the letter differentiated in a derivative; any other letter itself."""
    return derivations(name)[1]


# ---------------------------------------------------------------------- letters
@dataclass(frozen=True)
class Letter:
    """Meaning of a name.

    Attributes
    ----------
    text, latex : display forms
    symmetric : True if it is its own transpose
    expression : the pycraft expression, if known; `ascii` names it in the operator set of any model
    shape : "diagonal" by bodies, "down" (strictly, towards the children), "unit" (down, with I on the diagonal), "siblings", or "full"
    word : for a letter of the diagonal blocks of a word, that word
    """

    name: str
    text: str
    latex: str
    symmetric: bool = False
    shape: str = "full"
    ascii: str | None = None
    expression: Any = None
    word: Word = ()


SYMMETRIC = ("M", "P", "R", "D", "J", "Υ", "S")
_SHAPES = {
    **dict.fromkeys(["H", "M", "J", "P", "P⁺", "D", "G", "τ", "τ̄", "R", "Υ", "Δ", "Δ_θ̇", "Ṽ", "V̄", "𝓑", "X", "Ḣ"], "diagonal"),
    **dict.fromkeys(["E_φ", "E_ψ", "K", "φ̃", "ψ̃"], "down"),
    **dict.fromkeys(["φ", "ψ"], "unit"),
    "S": "siblings",
}


def shape_of(name: str) -> str:
    """The shape of a letter of the table."""
    return _SHAPES.get(name, "full")


def sko_letters() -> dict[str, Letter]:
    """The letters of the core's table that take no argument, and S, the siblings' part of E_ψ*ΥE_ψ."""
    letters = {
        s.text: Letter(s.text, s.text, s.latex, s.text in SYMMETRIC, shape_of(s.text), s.name)
        for s in _core.symbols
        if s.takes == "nothing"
    }
    letters["S"] = Letter("S", "S", "S", True, "siblings")
    return letters


@cache
def split(letter: str) -> tuple[str, str]:
    """(name, mark)."""
    for mark in _MARKS:
        if letter.endswith(mark):
            return letter[: -len(mark)], mark
    return letter, ""


@cache
def inverse_of(letter: str) -> str:
    """X⁻¹ of X."""
    name, mark = split(letter)
    return name + _INVERTED[mark]


@cache
def plain(letter: str) -> str:
    """Return the name of a letter in the first model."""
    return split(letter)[0].rstrip(FURTHER)


@cache
def of_model(letter: str, mark: str) -> str:
    """Return the letter of a further model, given the first model's."""
    name, done = split(letter)
    return name + mark + done


def inverted(letter: str) -> bool:
    """Return True if the letter is an inverse."""
    return split(letter)[1] in ("⁻¹", "⁻*")


class Alphabet:
    """The letters of one problem: letters of the table, and letters that a statement adds."""

    def __init__(self, letters: Mapping[str, Letter] | None = None):
        self.letters: dict[str, Letter] = dict(_sko() if letters is None else letters)
        self._stars: dict[str, str] = {}
        self.along: dict[str, Any] = {}  # the coordinate or "t" of a derivative, by its mark

    def add(self, letter: Letter) -> None:
        self.letters[letter.name] = letter

    def star(self, letter: str) -> str:
        """Return X* of X: X itself if X is symmetric."""
        found = self._stars.get(letter)
        if found is None:
            name, mark = split(letter)
            known = self.letters.get(name)
            found = letter if known is not None and known.symmetric else name + _TRANSPOSED[mark]
            self._stars[letter] = found
        return found

    def star_word(self, word: Word) -> Word:
        return tuple(self.star(x) for x in reversed(word))

    def star_of(self, p: Polynomial) -> Polynomial:
        """The transpose of a polynomial."""
        starred: Polynomial = {}
        for word, c in p.items():
            add_to(starred, self.star_word(word), c)
        return starred

    def symmetric_letters(self, words: Iterable[Word]) -> list[str]:
        """Names of the symmetric letters that occur."""
        names = dict.fromkeys(split(x)[0] for word in words for x in word)
        return [n for n in names if n in self.letters and self.letters[n].symmetric]

    # ------------------------------------------------------------------ how words are shown
    def letter_text(self, letter: str) -> str:
        name, mark = split(letter)
        known = self.letters.get(name)
        text = known.text if known is not None else name
        if text.endswith("^½") and mark in ("⁻¹", "⁻*"):
            return text[:-1] + "-½" + ("*" if mark == "⁻*" else "")
        return text + mark

    def letter_latex(self, letter: str) -> str:
        name, mark = split(letter)
        known = self.letters.get(name)
        latex = known.latex if known is not None else name
        if mark and "^" in latex:
            latex = f"{{{latex}}}"
        return latex + {"": "", "*": "^*", "⁻¹": "^{-1}", "⁻*": "^{-*}"}[mark]

    def word_text(self, word: Word) -> str:
        if word and word[0] in NUMBERS:
            return self._number_shown(word, self.letter_text, "tr({})", "ln det({})", "‖{}‖", "ln {}")
        return " ".join(map(self.letter_text, word)) or "I"

    def word_latex(self, word: Word) -> str:
        if word and word[0] in NUMBERS:
            forms = "\\operatorname{{tr}}({})", "\\ln\\det({})", "\\Vert {} \\Vert", "\\ln {}"
            return self._number_shown(word, self.letter_latex, *forms)
        return " ".join(map(self.letter_latex, word)) or "I"

    def _number_shown(self, word: Word, shown: Callable[[str], str], trace: str, determinant: str, norm: str, logarithm: str) -> str:
        """Return the display of a word that stands for a number: see `scalars`."""
        kind, *letters = word
        if kind == "1":
            return "1"
        if kind in ("×", "1/") and not (letters and letters[0].startswith("⟨")):
            numbers = factors_of(word) if kind == "×" else [word[1:]]
            parts = [self._number_shown(w, shown, trace, determinant, norm, logarithm) for w in numbers]
            return " ".join(parts) if kind == "×" else f"1/{parts[0]}"
        if kind == "1/":
            return f"1/({letters[0][1:-1]})"
        inside = " ".join(x if x.startswith("I[") else shown(x) for x in letters)
        if kind == "ln":
            return f"{trace.format(letters[1])} {logarithm.format(letters[0])}"
        return {"tr": trace, "ln det": determinant, "norm": norm}[kind].format(inside)

    def text(self, p: Polynomial) -> str:
        """Return the polynomial in the book's notation."""
        return _sum(((c, self.word_text(w)) for w, c in p.items()), "−", " ")

    def latex(self, p: Polynomial) -> str:
        """LaTeX."""
        return _sum(((c, self.word_latex(w)) for w, c in p.items()), "-", "\\,")


@lru_cache(maxsize=1)
def _sko() -> dict[str, Letter]:
    return sko_letters()


def _sum(terms: Iterable[tuple[Number, str]], minus: str, space: str) -> str:
    text = ""
    for c, word in terms:
        size = "" if c in (1, -1) else number(c if c > 0 else -c) + space
        if word == "1":
            size, word = number(c if c > 0 else -c), ""
        sign = f" {minus} " if c < 0 else " + "
        text += (sign if text else minus if c < 0 else "") + size + word
    return text or "0"


def number(c: Number) -> str:
    """Return a coefficient exactly, or as the shortest decimal of its double."""
    if c.denominator == 1:
        return str(c.numerator)
    if c.denominator <= 64:
        return f"{c.numerator}/{c.denominator}" if c.denominator & (c.denominator - 1) else repr(float(c))
    return repr(float(c)) if Fraction(float(c)) == c else f"{c.numerator}/{c.denominator}"


# ---------------------------------------------------------------------- reading
def parse(text: str) -> Polynomial:
    """Parse a sum of words with separated letters: "φ K H ψ − 2 φ + I"."""
    p: Polynomial = {}
    word: list[str] = []
    c: Number = ONE
    sign, started = ONE, False
    for token in [*text.split(), "+"]:
        if token in ("+", "−", "-"):
            if started:
                add_to(p, tuple(word), sign * c)
            sign, word, c, started = 1 if token == "+" else -1, [], ONE, False
        elif re.fullmatch(r"\d+(/\d+)?", token):
            c, started = ratio(c * Fraction(token), 1), True
        elif token == "I":
            started = True
        else:
            word.append(token)
            started = True
    return p


def parse_equation(text: str) -> tuple[Polynomial, Polynomial]:
    """Parse both sides of "lhs = rhs"."""
    left, right = text.split(" = ")
    return parse(left), parse(right)
