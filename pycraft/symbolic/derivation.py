"""Derivatives of words along a coordinate: the product rule, and ∂E_φ = E_φΔ_i.

To every letter X belongs a letter ∂X; the product rule carries ∂ through words, ∂(X⁻¹) = -X⁻¹∂XX⁻¹, so that every equation has a
derivative. From those of the axioms follow ∂φ = φ∂E_φφ, ∂G = (∂PH* + P∂H* - G∂D)D⁻¹, ...; ∂P and ∂R stay, bound by the derivatives of
their recursions.
"""

from __future__ import annotations

from typing import Any

from .. import _core
from .axioms import replaced_everywhere, solved, theory
from .equations import Equation, Step, joined
from .expand import Problem
from .walk import Walk
from .words import ONE, Alphabet, Letter, Polynomial, Word, add_to, inverse_of, inverted, parse, parse_equation, split

# As in `axioms`: what stands above, and d(...), the derivative of an equation.
LEMMAS: list[tuple[str, list[tuple[str, str]]]] = [
    ("∂φ = φ ∂E_φ φ", [("φ ∂E_φ", "d(φ E_φ = φ − I)"), ("E_φ φ", "E_φ φ = φ − I")]),
    ("∂ψ = ψ ∂E_ψ ψ", [("ψ ∂E_ψ", "d(ψ E_ψ = ψ − I)"), ("E_ψ ψ", "E_ψ ψ = ψ − I")]),
    ("∂G = ∂P H* D⁻¹ + P ∂H* D⁻¹ − G ∂D D⁻¹", [("∂G", "d(G = P H* D⁻¹)"), ("P H*", "G D = P H*"), ("D D⁻¹", "D D⁻¹ = I")]),
    (
        "E_φ ∂P E_φ* = ∂P − ∂M − ∂E_φ P E_φ* − E_φ P ∂E_φ* + ∂K D K* + K ∂D K* + K D ∂K*",
        [("∂M", "d(M = P − E_φ P E_φ* + K D K*)")],
    ),
    ("E_φ ∂R E_φ* = ∂R − ∂M − ∂E_φ R E_φ* − E_φ R ∂E_φ*", [("∂M", "d(M = R − E_φ R E_φ*)")]),
]  # fmt: skip

# (the word that goes, the equation), by rank.
_RULES = [
    ("∂φ", "∂φ = φ ∂E_φ φ"),
    ("∂ψ", "∂ψ = ψ ∂E_ψ ψ"),
    ("∂φ̃", "d(φ̃ = φ − I)"),
    ("∂ψ̃", "d(ψ̃ = ψ − I)"),
    ("∂Ω", "d(Ω = ψ* H* D⁻¹ H ψ)"),
    ("∂τ̄", "d(τ̄ = I − G H)"),
    ("∂τ", "d(τ = G H)"),
    ("∂P⁺", "d(P⁺ = P − G D G*)"),
    ("∂E_ψ", "d(E_ψ = E_φ − K H)"),
    ("∂K", "d(K = E_φ G)"),
    ("∂G", "∂G = ∂P H* D⁻¹ + P ∂H* D⁻¹ − G ∂D D⁻¹"),
    ("∂D", "d(D = H P H* + J)"),
    ("∂V", "d(V = φ* H* θ̇)"),
    ("E_φ ∂P E_φ*", "E_φ ∂P E_φ* = ∂P − ∂M − ∂E_φ P E_φ* − E_φ P ∂E_φ* + ∂K D K* + K ∂D K* + K D ∂K*"),
    ("E_φ ∂R E_φ*", "E_φ ∂R E_φ* = ∂R − ∂M − ∂E_φ R E_φ* − E_φ R ∂E_φ*"),
]


def differentiated(p: Polynomial) -> Polynomial:
    """The product rule, with ∂(X⁻¹) = -X⁻¹∂XX⁻¹."""
    total: Polynomial = {}
    for word, c in p.items():
        for i, letter in enumerate(word):
            before, after = word[:i], word[i + 1 :]
            if inverted(letter):
                add_to(total, (*before, letter, f"∂{inverse_of(letter)}", letter, *after), -c)
            else:
                add_to(total, (*before, f"∂{letter}", *after), c)
    return total


def derivative_of(equation: Equation) -> Equation:
    """∂lhs = ∂rhs."""
    lhs, rhs = differentiated(equation.lhs), differentiated(equation.rhs)
    made = Equation("derivative", f"∂({equation.text})", lhs, rhs, source=equation)
    made.check = lambda: lhs == differentiated(equation.lhs) and rhs == differentiated(equation.rhs)
    return made


class Derivatives:
    """The lemmas on derivatives, by their text, on the letters of one alphabet."""

    def __init__(self, alphabet: Alphabet):
        self.alphabet = alphabet
        for known in list(alphabet.letters.values()):
            self.add_letter(known)
        self._equations: dict[str, Equation] = {}

    def add_letter(self, known: Letter, value: Any = None) -> None:
        """∂X of a letter X; `value` is (X, i), where numbers are wanted."""
        if not known.name.startswith("∂"):
            name, latex = f"∂{known.name}", f"\\partial {{{known.latex}}}"
            shape = "down" if known.shape == "unit" else known.shape
            self.alphabet.add(Letter(name, f"∂{known.text}", latex, known.symmetric, shape, None, value))

    def __call__(self, text: str) -> Equation:
        """The equation of this text: of derivatives, d(...), or of `axioms`."""
        if "∂" not in text and not text.startswith("d("):
            return theory()(text)
        if text not in self._equations:
            self._equations[text] = derivative_of(theory()(text[2:-1])) if text.startswith("d(") else self._prove(text)
        return self._equations[text]

    def _prove(self, text: str) -> Equation:
        lhs, rhs = parse_equation(text)
        sides = []
        for side in (lhs, rhs):
            steps: list[Step] = []
            for word, cited in dict(LEMMAS)[text]:
                at = steps[-1].after if steps else side
                found = replaced_everywhere(at, *solved(self(cited), tuple(word.split())), self.alphabet)
                steps += [found] if found is not None else []
            sides.append(steps)
        chain = joined(sides[0], sides[1], lhs, rhs, self.alphabet)
        if chain is None:
            raise AssertionError(f"the proof of {text} does not close")
        return Equation("lemma", text, lhs, rhs, steps=chain)


class DerivativeProblem(Problem):
    """A problem whose statement may hold first derivatives along one coordinate."""

    def __init__(self) -> None:
        super().__init__()
        self.index: int | None = None
        self._derivatives: Derivatives | None = None

    def _words(self, e: Any, transposed: bool = False) -> Walk:
        if e.kind != "derivative":
            return (yield super()._words(e, transposed))
        if self.index is not None and self.index != e.index:
            raise _core.EvaluationError("a statement holds derivatives along one coordinate")
        p = yield super()._words(e.children[0])
        if self._derivatives is None:
            self.index, self._derivatives = e.index, Derivatives(self.alphabet)
        p = differentiated(p)
        return self.alphabet.star_of(p) if transposed else p

    def derivative_rules(self) -> tuple[list[tuple[Equation, Word]], list[tuple[Equation, Word]]]:
        """(rules, rules under "constant H") for derivatives of letters: (equation, the word that goes). None where nothing is derived."""
        if self._derivatives is None:
            return [], []
        d, delta = self._derivatives, self._delta()
        for known in list(self.alphabet.letters.values()):
            d.add_letter(known, None if known.expression is None else (known.expression, self.index))
        edge: tuple[Polynomial, Polynomial] = ({("∂E_φ",): ONE}, {("E_φ", delta): ONE})
        rules: list[tuple[Equation, Word]] = [
            (Equation("axiom", f"∂E_φ = E_φ {self.alphabet.letter_text(delta)}", *edge), ("∂E_φ",)),
            *((Equation("axiom", f"∂{x} = 0", parse(f"∂{x}"), {}), (f"∂{x}",)) for x in ("M", "J", "θ̇")),
            *((d(text), tuple(word.split())) for word, text in _RULES),
        ]
        rules += [(derivative_of(o.definition), (f"∂{o.name}",)) for o in self.opaque if o.kind == "inverse"]
        for name in {split(x)[0] for p in self.polynomials() for w in p for x in w if x.startswith("∂")}:
            known = self.alphabet.letters[name[1:]]
            if known.expression is not None and known.expression.kind in ("constant", "vector", "external"):
                rules.append((Equation("axiom", f"∂{known.text} = 0", {(name,): ONE}, {}), (name,)))
        constant = Equation("hypothesis", "∂H = 0", parse("∂H"), {}, hypothesis="constant H")
        return rules[::-1], [(constant, ("∂H",))]

    def _delta(self) -> str:
        """The letter Δ_i."""
        source, binding = self.contexts[0]
        symbol = source.symbol("Delta", coordinate=self.index)
        return self.letter(symbol if binding is None else symbol._bound(binding))
