"""Derivatives of words along coordinates and time: the product rule, and ∂E_φ = E_φΔ_i, dE_φ/dt = E_φΔ_θ̇, dH/dt = Ḣ.

Every letter X has a letter ∂X; the product rule carries ∂ through words, ∂(X⁻¹) = -X⁻¹∂XX⁻¹, so that every equation has a
derivative. The derivatives of the axioms give ∂φ = φ∂E_φφ, ∂G = (∂PH* + P∂H* - G∂D)D⁻¹, ...; ∂P and ∂R remain, bound by the derivatives of
their recursions. A second derivative ∂ⱼ∂X obeys the derivative of the equations of the first; Δ_i does not change as θ_j of another hinge,
or θ_i, moves.
"""

from __future__ import annotations

from typing import Any

from .. import _core
from .axioms import replaced_everywhere, solved, theory
from .derivative import TIME
from .equations import Equation, Step, joined
from .expand import Problem
from .normal_form import COMPLIANCE
from .walk import Walk
from .words import (
    FIRST,
    ONE,
    SECOND,
    Alphabet,
    Letter,
    Polynomial,
    Word,
    add_to,
    derivations,
    inverse_of,
    inverted,
    parse,
    parse_equation,
    split,
)

# As in `axioms`: earlier equations, and d(...), the derivative of an equation.
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

# (the replaced word, the equation), by rank.
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


def differentiated(p: Polynomial, mark: str = FIRST) -> Polynomial:
    """Return the derivative by the product rule, with ∂(X⁻¹) = -X⁻¹∂XX⁻¹; letters of derivatives get this mark."""
    total: Polynomial = {}
    for word, c in p.items():
        for i, letter in enumerate(word):
            before, after = word[:i], word[i + 1 :]
            if inverted(letter):
                add_to(total, (*before, letter, f"{mark}{inverse_of(letter)}", letter, *after), -c)
            else:
                add_to(total, (*before, f"{mark}{letter}", *after), c)
    return total


def derivative_of(equation: Equation, mark: str = FIRST) -> Equation:
    """∂lhs = ∂rhs."""
    lhs, rhs = differentiated(equation.lhs, mark), differentiated(equation.rhs, mark)
    made = Equation("derivative", f"{mark}({equation.text})", lhs, rhs, source=equation)
    made.check = lambda: lhs == differentiated(equation.lhs, mark) and rhs == differentiated(equation.rhs, mark)
    return made


class Derivatives:
    """The lemmas on derivatives with one mark, by their text with ∂ for that mark, on the letters of one alphabet."""

    def __init__(self, alphabet: Alphabet, mark: str = FIRST, shown: str = ""):
        self.alphabet, self.mark, self._shown = alphabet, mark, shown or mark
        for known in list(alphabet.letters.values()):
            self.add_letter(known)
        self._equations: dict[str, Equation] = {}

    def add_letter(self, known: Letter) -> None:
        """Add ∂X of a letter X that is not a second derivative."""
        if len(derivations(known.name)[0]) < 2:
            subscript = "" if self.mark == FIRST else "_j" if self._shown == SECOND else "_t"
            name, partial = f"{self.mark}{known.name}", f"\\partial{subscript}"
            shape = "down" if known.shape == "unit" else known.shape
            self.alphabet.add(Letter(name, f"{self._shown}{known.text}", f"{partial} {{{known.latex}}}", known.symmetric, shape))

    def __call__(self, text: str) -> Equation:
        """Return the equation of this text: from the derivatives, d(...), or from `axioms`."""
        if FIRST not in text and not text.startswith("d("):
            return theory()(text)
        if text not in self._equations:
            made = derivative_of(theory()(text[2:-1]), self.mark) if text.startswith("d(") else self._prove(text)
            self._equations[text] = made
        return self._equations[text]

    def marked(self, text: str) -> str:
        """With the mark for ∂."""
        return text.replace(FIRST, self.mark)

    def _prove(self, text: str) -> Equation:
        lhs, rhs = parse_equation(self.marked(text))
        sides = []
        for side in (lhs, rhs):
            steps: list[Step] = []
            for word, cited in dict(LEMMAS)[text]:
                at = steps[-1].after if steps else side
                found = replaced_everywhere(at, *solved(self(cited), tuple(self.marked(word).split())), self.alphabet)
                steps += [found] if found is not None else []
            sides.append(steps)
        chain = joined(sides[0], sides[1], lhs, rhs, self.alphabet)
        if chain is None:
            raise AssertionError(f"the proof of {text} does not close")
        return Equation("lemma", self.marked(text), lhs, rhs, steps=chain)


RuleOf = tuple[Equation, Word]
"""An equation, and the word that it replaces."""


class DerivativeProblem(Problem):
    """A problem with first and second derivatives along one or two coordinates, or along one coordinate and time."""

    def __init__(self) -> None:
        super().__init__()
        self._derivatives: dict[str, Derivatives] = {}

    def _words(self, e: Any, transposed: bool = False) -> Walk:
        if e.kind != "derivative":
            return (yield super()._words(e, transposed))
        p = yield self._words(e.children[0])
        mark = self._mark_along(e.index)
        for known in list(self.alphabet.letters.values()):
            self._derivatives[mark].add_letter(known)
        p = differentiated(p, mark)
        if any(len(derivations(split(x)[0])[0]) > 2 for word in p for x in word):
            raise _core.EvaluationError("prove supports first and second derivatives, not higher ones")
        return self.alphabet.star_of(p) if transposed else p

    def _mark_along(self, index: Any) -> str:
        """The mark of derivatives along this coordinate, or time."""
        along = self.alphabet.along
        mark = next((m for m, known in along.items() if known == index), None)
        if mark is None:
            if len(along) == 2:
                raise _core.EvaluationError("a statement may hold derivatives along at most two coordinates, or along one and time")
            mark = SECOND if along else FIRST
            along[mark] = index
            self._derivatives[mark] = Derivatives(self.alphabet, mark, "∂_t " if index == TIME and mark == SECOND else mark)
        return mark

    def derivative_rules(self) -> tuple[list[RuleOf], list[RuleOf]]:
        """Return (rules, rules under "constant H") for derivatives of letters: (equation, replaced word). None without derivatives."""
        rules: list[RuleOf] = []
        constant: list[RuleOf] = []
        deltas = {mark: self._delta(mark) for mark in self._derivatives}
        for mark, d in self._derivatives.items():
            for known in list(self.alphabet.letters.values()):
                d.add_letter(known)
            first, under = self._first_rules(mark, deltas[mark])
            rules, constant = rules + first, constant + under
        rules += self._deltas_of_two_bodies(list(deltas.values()))
        for outer, inner in self._nested():
            first, under = self._first_rules(inner, deltas[inner])
            rules += [self._derived(rule, inner, outer) for rule in first]
            constant += [self._derived(rule, inner, outer) for rule in under]
            if TIME in self.alphabet.along.values():
                constant += self._deltas_with_constant_axes(deltas[inner], outer)
            else:
                rules += self._deltas_that_stay(deltas[inner], outer)
        return rules[::-1], constant

    def single_axis_rules(self) -> list[RuleOf]:
        """Under "single-DOF hinges": Δ_θ̇Δ_i = Δ_iΔ_θ̇, because at each body both are crosses of one axis; also with stars."""
        along = self.alphabet.along
        if len(along) < 2 or TIME not in along.values():
            return []
        a, in_time = self.alphabet, next(m for m, index in along.items() if index == TIME)
        T, D = self._delta(in_time), self._delta(next(m for m in along if m != in_time))
        text = f"{a.word_text((T, D))} = {a.word_text((D, T))}"
        return [(Equation("hypothesis", text, {(T, D): ONE}, {(D, T): ONE}, hypothesis="single-DOF hinges"), (T, D))]

    def recursion_rules(self) -> list[RuleOf]:
        """Return rules for ∂Υ under blockdiag: E_φ*∂ΥE_φ by ∂Υ and ∂S, which has no blocks on the diagonal."""
        text, word = next((text, word) for word, text in COMPLIANCE if word == "E_φ* Υ E_φ")
        rules = []
        for mark in self._derivatives:
            at = tuple(f"{mark}{x}" if x == "Υ" else x for x in word.split())
            rules.append((derivative_of(theory()(text), mark), at))
        return rules

    def _first_rules(self, mark: str, delta: str) -> tuple[list[RuleOf], list[RuleOf]]:
        d, a = self._derivatives[mark], self.alphabet
        in_time = a.along[mark] == TIME
        E = f"{mark}E_φ"
        rules: list[RuleOf] = [
            (Equation("axiom", f"{E} = E_φ {a.letter_text(delta)}", {(E,): ONE}, {("E_φ", delta): ONE}), (E,)),
            *((Equation("axiom", f"{mark}{x} = 0", parse(f"{mark}{x}"), {}), (f"{mark}{x}",)) for x in ("M", "J")),
            *((d(text), tuple(d.marked(word).split())) for word, text in _RULES),
        ]
        if in_time:
            rules.append((Equation("axiom", f"{mark}H = Ḣ", {(f"{mark}H",): ONE}, {("Ḣ",): ONE}), (f"{mark}H",)))
            vdot = next((n for n, known in a.letters.items() if known.text == "vdot"), None)
            if vdot is not None:
                rules.append((Equation("axiom", f"{mark}θ̇ = vdot", {(f"{mark}θ̇",): ONE}, {(vdot,): ONE}), (f"{mark}θ̇",)))
        else:
            rules.append((Equation("axiom", f"{mark}θ̇ = 0", {(f"{mark}θ̇",): ONE}, {}), (f"{mark}θ̇",)))
        rules += [(derivative_of(o.definition, mark), (f"{mark}{o.name}",)) for o in self.opaque if o.kind == "inverse"]
        for name in {split(x)[0] for p in self.polynomials() for w in p for x in w if derivations(split(x)[0])[0] == [mark]}:
            known = a.letters[name[len(mark) :]]
            if known.expression is not None and known.expression.kind in ("constant", "vector", "external"):
                rules.append((Equation("axiom", f"{mark}{known.text} = 0", {(name,): ONE}, {}), (name,)))
        H = f"{mark}H"
        hypothesis = Equation("hypothesis", f"{H} = 0", {(H,): ONE}, {}, hypothesis="constant H")
        return rules, [] if in_time else [(hypothesis, (H,))]

    def _nested(self) -> list[tuple[str, str]]:
        """The marks of the second derivatives that occur, outer and inner."""
        letters = {split(x)[0] for p in self.polynomials() for w in p for x in w}
        return sorted({(marks[0], marks[1]) for x in letters if len(marks := derivations(x)[0]) == 2})

    def _derived(self, rule: RuleOf, inner: str, outer: str) -> RuleOf:
        """Return the derivative of a rule for first derivatives, as a rule for the second derivative in its word."""
        equation, word = rule
        return derivative_of(equation, outer), tuple(f"{outer}{x}" if derivations(split(x)[0])[0] == [inner] else x for x in word)

    def _deltas_that_stay(self, delta: str, outer: str) -> list[RuleOf]:
        """∂_jΔ_i = 0 of a coordinate j of another hinge, and of i itself."""
        symbol = self.alphabet.letters[delta].expression
        if symbol.diff(self.alphabet.along[outer]).kind != "zero":
            return []
        name = f"{outer}{delta}"
        text = f"{outer}{self.alphabet.letter_text(delta)} = 0, θ_i and θ_j one or of two hinges"
        return [(Equation("axiom", text, {(name,): ONE}, {}), (name,))]

    def _deltas_with_constant_axes(self, delta: str, outer: str) -> list[RuleOf]:
        """∂_tΔ_i = 0 and ∂_iΔ_θ̇ = 0 if the axes are constant in their bodies; ∂_iḢ = 0 follows from Ḣ = 0."""
        found: list[RuleOf] = []
        for name in (f"{outer}{delta}", f"{outer}Ḣ"):
            known = self.alphabet.letters.get(name)
            if known is not None:
                found.append((Equation("hypothesis", f"{known.text} = 0", {(name,): ONE}, {}, hypothesis="constant H"), (name,)))
        return found

    def _deltas_of_two_bodies(self, deltas: list[str]) -> list[RuleOf]:
        """Δ_iΔ_j = 0 if each is a block of another body; also with stars."""
        along = self.alphabet.along.values()
        if len(deltas) < 2 or TIME in along or len({self._body_of(index) for index in along}) < 2:
            return []
        a, (x, y) = self.alphabet, deltas
        pairs = [(u, v) for u in (x, a.star(x)) for v in (y, a.star(y))] + [(a.star(y), x), (y, x)]
        return [(Equation("axiom", f"{a.word_text(w)} = 0: θ_i and θ_j are of two hinges", {w: ONE}, {}), w) for w in pairs]

    def _body_of(self, coordinate: int) -> int:
        left = coordinate
        for k, n in enumerate(self.contexts[0][0].dof):
            if left < n:
                return k
            left -= n
        raise AssertionError(coordinate)

    def _delta(self, mark: str) -> str:
        """The letter Δ_i, or Δ_θ̇."""
        source, binding = self.contexts[0]
        index = self.alphabet.along[mark]
        symbol = source.symbol("Delta_theta_dot") if index == TIME else source.symbol("Delta", coordinate=index)
        return self.letter(symbol if binding is None else symbol._bound(binding))
