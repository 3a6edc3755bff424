"""The axioms, and the lemmas proved from them: everything that `prove` may use.

Every lemma comes with its proof: pairs (word, equation), each of which replaces the word, wherever it occurs on either side,
by its value from the equation. After all replacements, in this order, the two sides are equal: that is the proof, carried out
when the lemma is first used. An equation may be read in either direction; "(...)*" is its transpose. A lemma cites only earlier lemmas.

With their transposes, the equations that `normal_form` reads as rules bring words to a normal form that does not depend on where reduction
begins (`tests/proofs/test_prove_axioms.py` resolves all their overlaps): two polynomials of these letters, except Υ on chains, are equal by
the axioms exactly if their normal forms are.
"""

from __future__ import annotations

from collections import deque
from functools import lru_cache

from . import mechanics
from .equations import SYMMETRY, Equation, Step, Use, joined
from .words import Alphabet, Polynomial, Word, add_to, parse, parse_equation

# Definitions of the operators. M = P - E_ψPE_φ* and M = R - E_φRE_φ* are the sweeps of P and R; φ⁻¹ and ψ⁻¹ exist since E_φ is strictly
# triangular, D⁻¹ since the hinges are regular.
AXIOMS = [
    "φ⁻¹ = I − E_φ",
    "ψ⁻¹ = I − E_ψ",
    "τ = G H",
    "τ̄ = I − τ",
    "E_ψ = E_φ τ̄",
    "K = E_φ G",
    "D = H P H* + J",
    "G D = P H*",
    "M = P − E_ψ P E_φ*",
    "M = R − E_φ R E_φ*",
    "Ω = ψ* H* D⁻¹ H ψ",
    "Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H",
]
SYMMETRIC = ("M", "P", "R", "D", "J")
"""Symmetric letters: M* = M, ... are also axioms."""

# Abbreviations. In the recursion of Υ, S = E_ψ*ΥE_ψ - blockdiag(E_ψ*ΥE_ψ): the blocks between siblings.
DEFINITIONS = [
    "φ̃ = φ − I",
    "ψ̃ = ψ − I",
    "P⁺ = τ̄ P",
]

# Equations that hold only under a hypothesis.
HYPOTHESES = {"J = 0": "J = 0", "S = 0": "serial chain"}

# Definition of an inverse. A statement with M⁻¹, P⁻¹, R⁻¹, J⁻¹, Υ⁻¹ presupposes that they exist.
INVERTIBLE = ("φ", "ψ", "X", "D", "M", "P", "R", "J", "Υ")
INVERSES = [f"{x} {x}⁻¹ = I" for x in INVERTIBLE] + [f"{x}⁻¹ {x} = I" for x in INVERTIBLE]

LEMMAS: list[tuple[str, list[tuple[str, str]]]] = [
    # ------------------------------------------------------------------ resolvents
    ("φ E_φ = φ − I", [("E_φ", "φ⁻¹ = I − E_φ"), ("φ φ⁻¹", "φ φ⁻¹ = I")]),
    ("E_φ φ = φ − I", [("E_φ", "φ⁻¹ = I − E_φ"), ("φ⁻¹ φ", "φ⁻¹ φ = I")]),
    ("ψ E_ψ = ψ − I", [("E_ψ", "ψ⁻¹ = I − E_ψ"), ("ψ ψ⁻¹", "ψ ψ⁻¹ = I")]),
    ("E_ψ ψ = ψ − I", [("E_ψ", "ψ⁻¹ = I − E_ψ"), ("ψ⁻¹ ψ", "ψ⁻¹ ψ = I")]),
    ("τ̄ = I − G H", [("τ̄", "τ̄ = I − τ"), ("τ", "τ = G H")]),
    ("E_ψ = E_φ − K H", [("E_ψ", "E_ψ = E_φ τ̄"), ("τ̄", "τ̄ = I − G H"), ("E_φ G", "K = E_φ G")]),
    ("ψ E_φ = ψ − I + ψ K H", [("E_φ", "E_ψ = E_φ − K H"), ("ψ E_ψ", "ψ E_ψ = ψ − I")]),
    ("E_φ ψ = ψ − I + K H ψ", [("E_φ", "E_ψ = E_φ − K H"), ("E_ψ ψ", "E_ψ ψ = ψ − I")]),
    ("φ K H ψ = φ − ψ", [("K H", "E_ψ = E_φ − K H"), ("φ E_φ", "φ E_φ = φ − I"), ("E_ψ ψ", "E_ψ ψ = ψ − I")]),
    ("ψ K H φ = φ − ψ", [("K H", "E_ψ = E_φ − K H"), ("E_φ φ", "E_φ φ = φ − I"), ("ψ E_ψ", "ψ E_ψ = ψ − I")]),
    # ------------------------------------------------------------------ gains
    ("G = P H* D⁻¹", [("P H*", "G D = P H*"), ("D D⁻¹", "D D⁻¹ = I")]),
    ("H G = I − J D⁻¹", [("G", "G = P H* D⁻¹"), ("H P H*", "D = H P H* + J"), ("D D⁻¹", "D D⁻¹ = I")]),
    ("φ G = G + φ K", [("K", "K = E_φ G"), ("φ E_φ", "φ E_φ = φ − I")]),
    (
        "ψ G = G + ψ K J D⁻¹",
        [("J D⁻¹", "H G = I − J D⁻¹"), ("K H", "E_ψ = E_φ − K H"), ("E_φ G", "K = E_φ G"), ("ψ E_ψ", "ψ E_ψ = ψ − I")],
    ),
    ("G* P⁻¹ = D⁻¹ H", [("G*", "(G = P H* D⁻¹)*"), ("P P⁻¹", "P P⁻¹ = I")]),
    ("P⁺ = P − G D G*", [("P⁺", "P⁺ = τ̄ P"), ("τ̄", "τ̄ = I − G H"), ("H P", "(G D = P H*)*")]),
    # ------------------------------------------------------------------ the recursion of P
    (
        "M = P − E_φ P E_φ* + K D K*",
        [("M", "M = P − E_ψ P E_φ*"), ("E_ψ", "E_ψ = E_φ − K H"), ("H P", "(G D = P H*)*"), ("G* E_φ*", "(K = E_φ G)*")],
    ),
    ("E_φ P φ* = E_φ P + P φ* − M φ* + K D K* φ*", [("M", "M = P − E_φ P E_φ* + K D K*"), ("E_φ* φ*", "(φ E_φ = φ − I)*")]),
    ("E_φ P ψ* = E_φ P + P ψ* − M ψ*", [("M", "(M = P − E_ψ P E_φ*)*"), ("E_ψ* ψ*", "(ψ E_ψ = ψ − I)*")]),
    (
        "φ M φ* = φ P + P φ* − P + φ K D K* φ*",
        [("M", "M = P − E_φ P E_φ* + K D K*"), ("φ E_φ", "φ E_φ = φ − I"), ("E_φ* φ*", "(φ E_φ = φ − I)*")],
    ),
    (
        "φ M ψ* = φ P + P ψ* − P",
        [("M", "(M = P − E_ψ P E_φ*)*"), ("φ E_φ", "φ E_φ = φ − I"), ("E_ψ* ψ*", "(ψ E_ψ = ψ − I)*")],
    ),
    (
        "E_ψ P H* = K J",
        [("E_ψ", "E_ψ = E_φ − K H"), ("H P H*", "D = H P H* + J"), ("P H*", "G D = P H*"), ("E_φ G", "K = E_φ G")],
    ),
    (
        "M = P − E_ψ P E_ψ* − K J K*",
        [("M", "M = P − E_ψ P E_φ*"), ("E_φ*", "(E_ψ = E_φ − K H)*"), ("E_ψ P H*", "E_ψ P H* = K J")],
    ),
    (
        "ψ M ψ* = ψ P + P ψ* − P − ψ K J K* ψ*",
        [("M", "M = P − E_ψ P E_ψ* − K J K*"), ("ψ E_ψ", "ψ E_ψ = ψ − I"), ("E_ψ* ψ*", "(ψ E_ψ = ψ − I)*")],
    ),
    # ------------------------------------------------------------------ the recursion of R
    ("φ M φ* = φ R + R φ* − R", [("M", "M = R − E_φ R E_φ*"), ("φ E_φ", "φ E_φ = φ − I"), ("E_φ* φ*", "(φ E_φ = φ − I)*")]),
    ("E_φ R φ* = E_φ R + R φ* − M φ*", [("M", "M = R − E_φ R E_φ*"), ("E_φ* φ*", "(φ E_φ = φ − I)*")]),
    (
        "φ K D K* φ* = φ R + R φ* − R − φ P − P φ* + P",
        [
            ("K D K*", "M = P − E_φ P E_φ* + K D K*"),
            ("φ E_φ", "φ E_φ = φ − I"),
            ("E_φ* φ*", "(φ E_φ = φ − I)*"),
            ("φ M φ*", "φ M φ* = φ R + R φ* − R"),
        ],
    ),
    (
        "φ R H* K* ψ* = R H* K* ψ* + φ R − φ P + R ψ* − P ψ* − R + P",
        [
            ("H* K*", "(E_ψ = E_φ − K H)*"),
            ("φ R E_φ*", "(E_φ R φ* = E_φ R + R φ* − M φ*)*"),
            ("E_ψ* ψ*", "(ψ E_ψ = ψ − I)*"),
            ("φ M ψ*", "φ M ψ* = φ P + P ψ* − P"),
        ],
    ),
    (
        "E_φ R H* K* ψ* = − E_φ R ψ* + E_φ R − M ψ* + R ψ*",
        [("H* K*", "(E_ψ = E_φ − K H)*"), ("E_φ R E_φ*", "M = R − E_φ R E_φ*"), ("E_ψ* ψ*", "(ψ E_ψ = ψ − I)*")],
    ),
    (
        "ψ K H R H* K* ψ* = − ψ R H* K* ψ* − ψ K H R ψ* + ψ K H R + R H* K* ψ* + ψ K J K* ψ* + ψ R − ψ P + R ψ* − P ψ* − R + P",
        [
            ("K H", "E_ψ = E_φ − K H"),
            ("H* K*", "(E_ψ = E_φ − K H)*"),
            ("E_φ R E_φ*", "M = R − E_φ R E_φ*"),
            ("ψ E_ψ", "ψ E_ψ = ψ − I"),
            ("E_ψ* ψ*", "(ψ E_ψ = ψ − I)*"),
            ("ψ M ψ*", "ψ M ψ* = ψ P + P ψ* − P − ψ K J K* ψ*"),
        ],
    ),
    # ------------------------------------------------------------------ the recursion of Υ
    (
        "E_φ* Υ E_φ = S + Υ − H* D⁻¹ H + E_φ* Υ K H + H* K* Υ E_φ − H* K* Υ K H",
        [("S", "Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H"), ("E_ψ", "E_ψ = E_φ − K H"), ("E_ψ*", "(E_ψ = E_φ − K H)*")],
    ),
    (
        "ψ* H* D⁻¹ H ψ = ψ* Υ + Υ ψ − Υ + ψ* S ψ",
        [("S", "Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H"), ("E_ψ ψ", "E_ψ ψ = ψ − I"), ("ψ* E_ψ*", "(E_ψ ψ = ψ − I)*")],
    ),
    (
        "E_φ* Υ ψ = H* K* Υ ψ + E_φ* Υ − H* K* Υ + S ψ + Υ ψ − H* D⁻¹ H ψ",
        [("S", "Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H"), ("E_ψ ψ", "E_ψ ψ = ψ − I"), ("E_ψ*", "(E_ψ = E_φ − K H)*")],
    ),
    (
        "φ* H* K* Υ ψ = φ* H* K* Υ + φ* H* D⁻¹ H ψ − φ* Υ − Υ ψ + Υ − φ* S ψ",
        [
            ("S", "Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H"),
            ("E_ψ ψ", "E_ψ ψ = ψ − I"),
            ("H* K*", "(E_ψ = E_φ − K H)*"),
            ("φ* E_φ*", "(E_φ φ = φ − I)*"),
        ],
    ),
]  # fmt: skip


class Theory:
    """Equations by their text. Lemmas are proved when they are first asked for."""

    def __init__(self) -> None:
        self.alphabet = Alphabet()
        self._equations: dict[str, Equation] = {}
        self._order: dict[str, int] = {}
        self._proving: list[str] = []
        for kind, texts in (
            ("axiom", AXIOMS),
            ("axiom", mechanics.AXIOMS),
            ("definition", DEFINITIONS),
            ("definition", mechanics.DEFINITIONS),
            ("inverse", INVERSES),
        ):
            for text in texts:
                self._declare(kind, text)
        for text, name in HYPOTHESES.items():
            self._declare("hypothesis", text, hypothesis=name)
        self._declare_symmetries()
        self._lemmas = dict([*LEMMAS, *mechanics.LEMMAS])
        for text in self._lemmas:
            self._order[text] = len(self._order)

    def _declare(self, kind: str, text: str, hypothesis: str | None = None) -> None:
        lhs, rhs = parse_equation(text)
        self._equations[text] = Equation(kind, text, lhs, rhs, hypothesis=hypothesis)
        self._order[text] = len(self._order)

    def _declare_symmetries(self) -> None:
        for name in SYMMETRIC:
            SYMMETRY[name] = Equation("axiom", f"{name}* = {name}", parse(name), parse(name))
        recursion = self._equations["Υ = E_ψ* Υ E_ψ − S + H* D⁻¹ H"]
        SYMMETRY["Υ"] = Equation(
            "structure", "Υ* = Υ", parse("Υ"), parse("Υ"), uses=[recursion, SYMMETRY["D"]],
            note="Υ and Υ* obey Υ = blockdiag(E_ψ*ΥE_ψ) + H*D⁻¹H, which has one solution: E_ψ is strictly triangular",
            check=lambda: self.alphabet.star_of(recursion.rhs) == recursion.rhs,
        )  # fmt: skip

    def __call__(self, text: str) -> Equation:
        """The equation of this text; "(...)*" is the transpose. Raises KeyError if there is none."""
        if text.startswith("(") and text.endswith(")*"):
            return self(text[1:-2]).transposed(self.alphabet)
        if text not in self._equations:
            self._equations[text] = self._prove(text)
        return self._equations[text]

    @property
    def lemmas(self) -> list[Equation]:
        """All lemmas, proved."""
        return [self(text) for text in self._lemmas]

    def _prove(self, text: str) -> Equation:
        """Return a lemma with its proof; it cites only earlier lemmas."""
        lhs, rhs = parse_equation(text)
        left, right = (self._reduced(side, text) for side in (lhs, rhs))
        steps = joined(left, right, lhs, rhs, self.alphabet)
        if steps is None:
            raise AssertionError(f"the proof of {text} does not close")
        return Equation("lemma", text, lhs, rhs, steps=steps)

    def _reduced(self, side: Polynomial, lemma: str) -> list[Step]:
        steps: list[Step] = []
        for word, cited in self._lemmas[lemma]:
            plain = cited[1:-2] if cited.startswith("(") else cited
            if self._order[plain] >= self._order[lemma]:
                raise AssertionError(f"{lemma} cites {plain}, which is not an earlier lemma")
            step = replaced_everywhere(steps[-1].after if steps else side, *solved(self(cited), tuple(word.split())), self.alphabet)
            if step is not None:
                steps.append(step)
        return steps


def solved(equation: Equation, word: Word) -> tuple[Equation, Word, Polynomial, int]:
    """Return the equation solved for a word: (equation, word, the rest, the sign with which lhs - rhs is word - the rest).

    Raises ValueError if the word does not occur with coefficient ±1.
    """
    difference = equation.difference
    c = difference.get(word, 0)
    if abs(c) != 1:
        raise ValueError(f"{equation.text} does not give {' '.join(word)}")
    return equation, word, {w: -x * int(c) for w, x in difference.items() if w != word}, int(c)


def replaced_everywhere(p: Polynomial, equation: Equation, word: Word, by: Polynomial, sign: int, alphabet: Alphabet) -> Step | None:
    """Return the step that replaces all occurrences of a word; None if it does not occur."""
    uses: list[Use] = []
    todo = deque(p.items())
    done: Polynomial = {}
    while todo:
        at, c = todo.popleft()
        place = find(at, word)
        if place < 0:
            add_to(done, at, c)
            continue
        left, right = at[:place], at[place + len(word) :]
        uses.append(Use(sign * c, left, equation, right, word, sign > 0))
        todo.extendleft([(left + w + right, c * x) for w, x in reversed(by.items())])
        if len(uses) > 1000:
            raise AssertionError(f"{' '.join(word)} does not go away by {equation.text}")
    return Step(dict(p), done, uses, alphabet) if uses else None


def find(word: Word, part: Word) -> int:
    """Return the index of the part in the word, -1 if it does not occur."""
    n = len(part)
    return next((i for i in range(len(word) - n + 1) if word[i : i + n] == part), -1)


@lru_cache(maxsize=1)
def theory() -> Theory:
    """The one theory, on the letters of the table."""
    return Theory()
