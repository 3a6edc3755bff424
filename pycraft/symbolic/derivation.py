"""Derivatives of words along a coordinate: the product rule, and ∂E_φ = E_φΔ_i.

To every letter X belongs a letter ∂X; the product rule carries ∂ through words, so that every equation has a derivative. From those of the
axioms follow ∂φ = φ∂E_φφ, ∂G = (∂PH* + P∂H* - G∂D)D⁻¹, ...; ∂P and ∂R stay, bound by the derivatives of their recursions.
"""

from __future__ import annotations

import functools
import operator
from fractions import Fraction
from typing import Any

from .. import _core
from .axioms import joined, replaced_everywhere, solved, theory
from .equations import Equation, Step
from .expand import Problem, symbol_parts
from .words import Alphabet, Letter, Polynomial, Word, add_to, combine, parse, parse_equation, split

# Lemmas on derivatives, with what their proofs use: as in `axioms`, where d(...) is the derivative of an equation, or of a word's meaning.
_LEMMAS: list[tuple[str, list[tuple[str, str]]]] = [
    ("∂φ = φ ∂E_φ φ", [("φ ∂E_φ", "d(φ E_φ = φ − I)"), ("E_φ φ", "E_φ φ = φ − I")]),
    ("∂ψ = ψ ∂E_ψ ψ", [("ψ ∂E_ψ", "d(ψ E_ψ = ψ − I)"), ("E_ψ ψ", "E_ψ ψ = ψ − I")]),
    ("∂D⁻¹ = − D⁻¹ ∂D D⁻¹", [("D⁻¹ ∂D", "d(D⁻¹ D = I)"), ("D D⁻¹", "D D⁻¹ = I")]),
    ("∂G = ∂P H* D⁻¹ + P ∂H* D⁻¹ − G ∂D D⁻¹", [("∂G", "d(G = P H* D⁻¹)"), ("∂D⁻¹", "∂D⁻¹ = − D⁻¹ ∂D D⁻¹"), ("P H*", "G D = P H*"), ("D D⁻¹", "D D⁻¹ = I")]),
    ("∂E_ψ = ∂E_φ − ∂K H − K ∂H", [("∂E_ψ", "d(E_ψ = E_φ − K H)")]),
    (
        "E_φ ∂P E_φ* = ∂P − ∂M − ∂E_φ P E_φ* − E_φ P ∂E_φ* + ∂K D K* + K ∂D K* + K D ∂K*",
        [("∂M", "d(M = P − E_φ P E_φ* + K D K*)")],
    ),
    ("E_φ ∂R E_φ* = ∂R − ∂M − ∂E_φ R E_φ* − E_φ R ∂E_φ*", [("∂M", "d(M = R − E_φ R E_φ*)")]),
]  # fmt: skip

# (the word that goes, the equation), by rank; what follows from the product rule alone stands as d(...).
_RULES = [
    ("∂φ", "∂φ = φ ∂E_φ φ"),
    ("∂ψ", "∂ψ = ψ ∂E_ψ ψ"),
    ("∂φ̃", "d(φ̃ = φ − I)"),
    ("∂ψ̃", "d(ψ̃ = ψ − I)"),
    ("∂φ⁻¹", "d(φ⁻¹ = I − E_φ)"),
    ("∂ψ⁻¹", "d(ψ⁻¹ = I − E_ψ)"),
    ("∂Ω", "d(Ω = ψ* H* D⁻¹ H ψ)"),
    ("∂τ̄", "d(τ̄ = I − G H)"),
    ("∂τ", "d(τ = G H)"),
    ("∂P⁺", "d(P⁺ = P − G D G*)"),
    ("∂E_ψ", "∂E_ψ = ∂E_φ − ∂K H − K ∂H"),
    ("∂K", "d(K = E_φ G)"),
    ("∂G", "∂G = ∂P H* D⁻¹ + P ∂H* D⁻¹ − G ∂D D⁻¹"),
    ("∂D⁻¹", "∂D⁻¹ = − D⁻¹ ∂D D⁻¹"),
    ("∂D", "d(D = H P H* + J)"),
    ("E_φ ∂P E_φ*", "E_φ ∂P E_φ* = ∂P − ∂M − ∂E_φ P E_φ* − E_φ P ∂E_φ* + ∂K D K* + K ∂D K* + K D ∂K*"),
    ("E_φ ∂R E_φ*", "E_φ ∂R E_φ* = ∂R − ∂M − ∂E_φ R E_φ* − E_φ R ∂E_φ*"),
]
_SYMMETRIC = {"M", "J", "P", "P⁺", "D", "R", "Υ"}


class Formula:
    """A derivative, or what is made of derivatives and operators: goes wherever `prove` takes an expression.

    Sums, differences, products (`@`), multiples and `.T`, with operators on either side.
    """

    __array_ufunc__ = None

    def __init__(self, kind: str, children: list[Any], coefficient: float = 1.0, index: int = -1, name: str | None = None):
        self.kind, self.children, self.coefficient, self.index, self.name = kind, children, coefficient, index, name

    def _key(self) -> tuple:
        return (self.kind, tuple(self.children), self.coefficient, self.index)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Formula) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __add__(self, other: Any) -> Formula:
        return Formula("sum", [self, other])

    def __radd__(self, other: Any) -> Formula:
        return Formula("sum", [other, self])

    def __sub__(self, other: Any) -> Formula:
        return Formula("sum", [self, -other])

    def __rsub__(self, other: Any) -> Formula:
        return Formula("sum", [other, -self])

    def __matmul__(self, other: Any) -> Formula:
        return Formula("product", [self, other])

    def __rmatmul__(self, other: Any) -> Formula:
        return Formula("product", [other, self])

    def __mul__(self, other: Any) -> Formula:
        return Formula("scaled", [self], float(other)) if isinstance(other, (int, float)) else self @ other

    def __rmul__(self, other: Any) -> Formula:
        return Formula("scaled", [self], float(other)) if isinstance(other, (int, float)) else Formula("product", [other, self])

    def __truediv__(self, number: float) -> Formula:
        return Formula("scaled", [self], 1.0 / number)

    def __neg__(self) -> Formula:
        return Formula("scaled", [self], -1.0)

    @property
    def T(self) -> Formula:
        return Formula("transpose", [self])

    @property
    def domain(self) -> Any:
        return self.children[0].domain if self.kind in ("derivative", "scaled") else None

    def text(self) -> str:
        return self._shown("text", "∂", " ", "*", " − ")

    def latex(self) -> str:
        return self._shown("latex", "\\partial ", " ", "^*", " - ")

    def _shown(self, style: str, partial: str, space: str, star: str, minus: str) -> str:
        parts = [getattr(c, style)() for c in self.children]
        closed = [f"({p})" if getattr(c, "kind", "") in ("sum", "scaled") else p for c, p in zip(self.children, parts, strict=True)]
        match self.kind:
            case "derivative":
                return partial + (parts[0] if getattr(self.children[0], "kind", "") == "symbol" else f"({parts[0]})")
            case "sum":
                return f"{parts[0]} + {parts[1]}"
            case "product":
                return space.join(closed)
            case "transpose":
                return f"({parts[0]}){star}"
        return f"−{closed[0]}" if self.coefficient == -1 else f"{self.coefficient:g}{space}{closed[0]}"

    def __repr__(self) -> str:
        return f"<{self.text()}>"


def derivative(expression: Any, coordinate: int | str) -> Formula:
    """∂(expression)/∂θ_i, to be proved equal to something by `prove`.

    Parameters
    ----------
    expression : an operator expression
    coordinate : the coordinate i, by number or by name

    Raises
    ------
    ModelError
        No coordinate has that name.
    EvaluationError
        A derivative of a derivative.
    """
    if isinstance(expression, Formula):
        raise _core.EvaluationError("second derivatives are outside: prove takes first ones")
    if isinstance(coordinate, str):
        source = expression.sources[0]
        if coordinate not in source.coordinate_names:
            raise _core.ModelError(f"no coordinate of {source.name!r} is called {coordinate!r}")
        coordinate = source.coordinate_names.index(coordinate)
    return Formula("derivative", [expression], index=int(coordinate))


# ---------------------------------------------------------------------- the derivation on words
def d_letter(letter: str) -> str:
    """∂X of X; (∂X)* of X*. The inverse is one with its mark: ∂D⁻¹ is the letter "∂D⁻¹"."""
    name, mark = split(letter)
    if mark == "⁻*":
        return f"∂{name}⁻¹".replace("⁻¹", "⁻") + "*"
    return f"∂{name}" + ("⁻" if mark == "⁻¹" else mark)


def differentiated(p: Polynomial) -> Polynomial:
    """The product rule."""
    total: Polynomial = {}
    for word, c in p.items():
        for i, letter in enumerate(word):
            add_to(total, (*word[:i], d_letter(letter), *word[i + 1 :]), c)
    return total


def derivative_of(equation: Equation) -> Equation:
    """∂lhs = ∂rhs."""
    lhs, rhs = differentiated(equation.lhs), differentiated(equation.rhs)
    made = Equation(lhs, rhs, "derivative", f"∂({equation.text})", source=equation)
    made.check = lambda: lhs == differentiated(equation.lhs) and rhs == differentiated(equation.rhs)
    return made


def _plain(text: str) -> str:
    """∂D⁻¹ as the letter it is: its mark belongs to the name."""
    return " ".join(f"∂{t[1:].replace('⁻¹', '⁻')}" if t.startswith("∂") and t.endswith("⁻¹") else t for t in text.split(" "))


class Derivatives:
    """The lemmas on derivatives, by their text, on the letters of one alphabet."""

    def __init__(self, alphabet: Alphabet):
        self.alphabet = alphabet
        for name, known in list(alphabet.letters.items()):
            if known.ascii is not None or name == "S":
                self.add_letters(known)
        self._equations: dict[str, Equation] = {}

    def add_letters(self, known: Letter) -> None:
        """∂X and ∂X⁻¹ of a letter X."""
        symmetric = known.name in _SYMMETRIC or known.symmetric
        for mark, latex in (("", ""), ("⁻", "^{-1}")):
            name = f"∂{known.name}{mark}"
            text = f"∂{known.text}" + ("⁻¹" if mark else "")
            self.alphabet.add(Letter(name, text, f"\\partial {{{known.latex}}}{latex}", symmetric, known.shape))

    def __call__(self, text: str) -> Equation:
        if text.startswith("d("):
            if text not in self._equations:
                self._equations[text] = derivative_of(theory()(text[2:-1]))
            return self._equations[text]
        if "∂" not in text:
            return theory()(text)
        if text not in self._equations:
            self._equations[text] = self._prove(text)
        return self._equations[text]

    def _prove(self, text: str) -> Equation:
        lhs, rhs = parse_equation(_plain(text))
        sides = []
        for side in (lhs, rhs):
            steps: list[Step] = []
            for word, cited in dict(_LEMMAS)[text]:
                found = replaced_everywhere(
                    steps[-1].after if steps else side, *solved(self(cited), tuple(_plain(word).split())), self.alphabet
                )
                if found is not None:
                    steps.append(found)
            sides.append(steps)
        chain = joined(sides[0], sides[1], lhs, rhs, self.alphabet)
        if chain is None:
            raise AssertionError(f"the proof of {text} does not close")
        return Equation(lhs, rhs, "lemma", text, steps=chain)


class DerivativeProblem(Problem):
    """A problem whose statements may hold first derivatives along one coordinate."""

    def __init__(self) -> None:
        super().__init__()
        self.index: int | None = None
        self._derivatives: Derivatives | None = None
        self._operand: Any = None

    def _expand(self, e: Any, transposed: bool) -> Polynomial:
        if e.kind != "derivative":
            return super()._expand(e, transposed)
        if self.index is not None and self.index != e.index:
            raise _core.EvaluationError("a statement holds derivatives along one coordinate")
        if self._derivatives is None:
            self.index, self._derivatives = e.index, Derivatives(self.alphabet)
        p = super()._expand(e.children[0], False)
        for word in p:
            for letter in word:
                self._know(split(letter)[0], e)
        p = differentiated(p)
        return self.alphabet.star_of(p) if transposed else p

    def _know(self, name: str, e: Any) -> None:
        """∂ of a letter that the statement adds."""
        assert self._derivatives is not None
        if f"∂{name}" not in self.alphabet.letters:
            self._derivatives.add_letters(self.alphabet.letters[name])
        known = self.alphabet.letters[name]
        if known.expression is None:
            return
        for mark, expression in (("", known.expression), ("⁻", None)):
            letter = self.alphabet.letters[f"∂{name}{mark}"]
            value = known.expression.inv() if expression is None else expression
            self.alphabet.add(
                Letter(letter.name, letter.text, letter.latex, letter.symmetric, letter.shape, letter.ascii, (value, e.index))
            )

    def derivative_rules(self) -> tuple[list[tuple[Equation, Word]], list[tuple[Equation, Word]]]:
        """(rules, rules under "constant H"): what the derivatives of letters are. Nothing where no derivative occurs."""
        if self._derivatives is None:
            return [], []
        d, delta = self._derivatives, self._delta()
        rules = [
            (Equation(*parse_equation(f"∂E_φ = E_φ {delta}"), "axiom", f"∂E_φ = E_φ {delta}"), ("∂E_φ",)),
            (Equation(parse("∂M"), {}, "axiom", "∂M = 0"), ("∂M",)),
            (Equation(parse("∂J"), {}, "axiom", "∂J = 0"), ("∂J",)),
        ]
        rules += [(d(text), tuple(_plain(word).split())) for word, text in _RULES]
        for opaque in self.opaque:
            if opaque.kind == "inverse":
                rules += self._of_inverse(opaque.name, opaque.inner)
        for name in {split(x)[0] for p in self.polynomials() for w in p for x in w}:
            known = self.alphabet.letters.get(name[1:]) if name.startswith("∂") else None
            if known is not None and known.expression is not None and known.expression.kind in ("constant", "vector"):
                rules.append((Equation({(name,): Fraction(1)}, {}, "axiom", f"{name} = 0"), (name,)))
        constant = [(Equation(parse("∂H"), {}, "hypothesis", "∂H = 0", hypothesis="constant H"), ("∂H",))]
        return rules, constant

    def _of_inverse(self, X: str, inner: Polynomial) -> list[tuple[Equation, Word]]:
        """∂(X⁻¹) = -X⁻¹ ∂X X⁻¹, from X⁻¹X = I."""
        assert self._derivatives is not None
        a = self.alphabet
        if f"∂{X}" not in a.letters:
            self._derivatives.add_letters(a.letters[X])
        left = Equation({(f"{X}⁻¹", X): Fraction(1)}, {(): Fraction(1)}, "inverse", f"{a.letter_text(X)}⁻¹ {a.letter_text(X)} = I")
        right = Equation({(X, f"{X}⁻¹"): Fraction(1)}, {(): Fraction(1)}, "inverse", f"{a.letter_text(X)} {a.letter_text(X)}⁻¹ = I")
        definition = Equation({(X,): Fraction(1)}, inner, "definition", f"{a.letter_text(X)} is its operand")
        lhs, rhs = {(f"∂{X}⁻",): Fraction(1)}, {(f"{X}⁻¹", f"∂{X}", f"{X}⁻¹"): Fraction(-1)}
        step = replaced_everywhere(rhs, *solved(derivative_of(left), (f"{X}⁻¹", f"∂{X}")), a)
        assert step is not None
        last = replaced_everywhere(step.after, *solved(right, (X, f"{X}⁻¹")), a)
        assert last is not None
        chain = joined([], [step, last], lhs, rhs, a)
        assert chain is not None
        lemma = Equation(lhs, rhs, "lemma", f"{a.text(lhs)} = {a.text(rhs)}", steps=chain)
        opened = derivative_of(definition)
        for word in opened.rhs:
            for letter in word:
                name = split(letter)[0]
                if not name.startswith("∂") and f"∂{name}" not in a.letters:
                    self._derivatives.add_letters(a.letters[name])
        return [(lemma, (f"∂{X}⁻",)), (opened, (f"∂{X}",))]

    def _delta(self) -> str:
        """The letter Δ_i."""
        for name, known in self.alphabet.letters.items():
            e = known.expression
            if getattr(e, "kind", "") == "symbol" and e.name == "Delta" and symbol_parts(e)[2] == [self.index]:
                return name
        source, binding = self.contexts[0]
        symbol = source.symbol("Delta", coordinate=self.index)
        return self._letter(symbol if binding is None else symbol._bound(binding))


def product(*factors: Any) -> Any:
    """Factors multiplied in order."""
    return functools.reduce(operator.matmul, factors)


def sum_of(*parts: tuple[int, Polynomial]) -> Polynomial:
    """Σ c p."""
    return combine(*((Fraction(c), p) for c, p in parts))
