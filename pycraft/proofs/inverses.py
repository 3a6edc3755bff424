"""Inverses in a statement, of sums and products that have their own letters.

X⁻¹ = Z if a candidate Z satisfies XZ = I and ZX = I: for X a single word, for X one of the operators with a known inverse, for X an
operator whose inverse occurs elsewhere in the statement. Otherwise XX⁻¹ = I and X⁻¹X = I are rules, with X in its normal form.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from . import factors
from .axioms import theory
from .equations import Equation, Step, Use, marked, numbered
from .expand import Opaque
from .local_rules import UNIT, LocalRules
from .normal_form import Setting, normal_form, rules_for, scaled, weight
from .presuppositions import ALWAYS, Void, inverses_used, is_positive_definite, is_triangular
from .words import (
    ONE,
    SHARED,
    Number,
    Polynomial,
    Word,
    framed,
    inverse_of,
    inverted,
    parse,
    plain,
    ratio,
    split,
    times,
)

KNOWN_INVERSES = [
    ("I − E_φ", "φ"),
    ("I − E_φ + K H", "ψ"),
    ("I + K H φ", "I − K H ψ"),
    ("I + φ K H", "I − ψ K H"),
    ("I + H φ K", "I − H ψ K"),
    ("H φ M φ* H* + J", "D⁻¹ − D⁻¹ H ψ K − K* ψ* H* D⁻¹ + K* ψ* H* D⁻¹ H ψ K"),
    ("φ M φ*", "φ⁻* M⁻¹ φ⁻¹"),
]
"""Pairs X, Z with XZ = ZX = I: only candidates, each proved when used."""


class Inverses:
    """Known facts on the inverses in a statement, added to its rules one after another."""

    def __init__(self, local: LocalRules):
        self.local, self.problem, self.alphabet = local, local.problem, local.alphabet
        self._factors: dict[str, factors.Factor | None] = {}
        self._forms: list[tuple[str, Polynomial]] = []

    @property
    def found_factors(self) -> list[factors.Factor]:
        """Innovations factors A = I + HφK that were used and have their inverse."""
        return [factor for factor in self._factors.values() if factor is not None]

    def add(self, o: Opaque) -> None:
        """Add the known facts on X⁻¹. Raises Void if X is zero."""
        X, a = o.name, self.alphabet
        form, steps = self.local.reduce(o.inner)
        if not form:
            where = f" where {' and '.join(sorted(self.local.setting.hypotheses))}" if self.local.setting.hypotheses else ""
            raise Void(f"{o.expression.text()} = 0{where}, which has no inverse")
        self._by_structure(X, o.inner, form, steps)
        if self._by_factors(o, form):
            return
        for z in self._candidates(form):
            lemma = self._inverse_is(X, o.inner, z, o.definition)
            if lemma is not None:
                self.local.needs[X] = inverses_used([lemma.steps[0].uses[0].equation, *lemma.uses])
                self.local.add(lemma, (inverse_of(X),))
                return
        lead = max(form, key=weight)
        for left, right in (((), (inverse_of(X),)), ((inverse_of(X),), ())):
            self.local.add(self._times_inverse(o, left, right, form, steps), left + lead + right, blocks=False)
        starred = a.star_of(o.inner)
        if normal_form(starred, self.local.rules, a) == form:
            lemma = self._inverse_is(a.star(X), starred, {(inverse_of(X),): ONE}, o.definition.transposed(a))
            if lemma is not None:  # X⁻* = X⁻¹; its transpose says the same
                self.local.add_untransposed(lemma, (inverse_of(a.star(X)),))
        self._forms.append((X, form))

    def _by_structure(self, X: str, inner: Polynomial, form: Polynomial, steps: list[Step]) -> None:
        """Record X as regular if its words imply it, as written or in normal form."""
        for p, premises in ((inner, ()), (form, [e for step in steps for e in step.premises()])):
            definite = is_positive_definite(p, self.alphabet, self.local.setting.hypotheses, self.local.definite)
            if definite or is_triangular(p, self.alphabet):
                self.local.definite |= {X} if definite else set()
                self.local.needs[X] = inverses_used(premises) | {split(x)[0] for w in p for x in w if inverted(x)} - {*ALWAYS}
                return

    def _by_factors(self, o: Opaque, form: Polynomial) -> bool:
        """Return X⁻¹ of X = ℳ + J, by its factors."""
        found = self.factored(o.name, form, o.definition)
        if found is None:
            return False
        product, factor, mark, c = found
        self.local.needs[o.name] = inverses_used(factor.premises)
        self.local.needs[factor.name] = self.local.needs[o.name]
        whole = factors.inverse_of_product(o.name, c, product, factor, mark, self.alphabet, self.local.pair)
        self.local.add(whole, (inverse_of(o.name),))
        if factor.inverse not in self.local.equations:
            self.local.add(factor.inverse, (inverse_of(factor.name),))
        return True

    def factor(self, mark: str) -> factors.Factor | None:
        """Return A = I + HφK of one model, with its inverse; None if the inverse is not proved."""
        if mark not in self._factors:
            base = self.local.base(mark)
            context = self.problem.contexts[self.problem.marks.index(mark)] if self.problem.contexts else None
            name, definition = factors.letter(self.alphabet, mark, base, context)
            lemma = self._inverse_is(name, definition.rhs, factors.of(factors.INVERSE, mark, base), definition)
            self._factors[mark] = None if lemma is None else factors.Factor(name, definition, lemma)
        return self._factors[mark]

    def factored(self, X: str, form: Polynomial, definition: Equation) -> tuple[Equation, factors.Factor, str, Number] | None:
        """Return (X = c A D A*, A, the mark of its model, c) of a letter with this definition and normal form; None for another letter."""
        key, scale = scaled(form)
        for mark in self.problem.marks:
            base = self.local.base(mark)
            product = self.local.reduce(factors.of(factors.PRODUCT, mark, base))[0]
            its_key, its_scale = scaled(product) if product else ((), ONE)
            if its_key == key and (factor := self.factor(mark)) is not None:
                c = ratio(scale, its_scale)
                lemma = factors.factorization(X, c, definition, factor, mark, self.alphabet, self.local.reduce)
                return None if lemma is None else (lemma, factor, mark, c)
        return None

    def _candidates(self, form: Polynomial) -> Iterator[Polynomial]:
        """Yield candidates for the inverse of an operator with this normal form."""
        if len(form) == 1:
            ((word, c),) = form.items()
            if all(plain(x) in ("φ", "ψ", "D", "M", "P", "R", "Υ") or inverted(x) for x in word):
                yield {tuple(inverse_of(x) for x in reversed(word)): ratio(1, c)}
        for mark in self.problem.marks:
            base = self.local.base(mark)
            key, scale = scaled({tuple(_unmarked(x, base if plain(x) in SHARED else mark) for x in w): c for w, c in form.items()})
            for z, its_scale in _known_inverses(self.local.setting).get(key, ()):
                yield {marked(w, mark, base): ratio(c * its_scale, scale) for w, c in z.items()}
        key, scale = scaled(form)
        for X, other in self._forms:
            for name, p in ((X, other), (self.alphabet.star(X), self.alphabet.star_of(other))):
                its_key, its_scale = scaled(p)
                if its_key == key:
                    yield {(inverse_of(name),): ratio(its_scale, scale)}

    def _inverse_is(self, X: str, inner: Polynomial, z: Polynomial, definition: Equation) -> Equation | None:
        """Return the lemma X⁻¹ = Z, by XZ = I and ZX = I; None if these are not proved."""
        a, Y = self.alphabet, inverse_of(X)
        halves = []
        shown = a.letter_text(X)
        for product, text in ((times(inner, z), f"{shown} Z = I"), (times(z, inner), f"Z {shown} = I")):
            form, steps = self.local.reduce(product)
            if form != UNIT:
                return None
            halves.append(Equation("lemma", f"{text}, Z = {a.text(z)}", product, UNIT, steps=numbered(steps)))
        first, second = framed((Y,), times(inner, z), ()), {(Y, X, *w): c for w, c in z.items()}
        pair = self.local.pair(Y, X)
        steps = [
            Step({(Y,): ONE}, first, [Use(-ONE, (Y,), halves[0], (), (), False)], a),
            Step(first, second, [Use(-c, (Y,), definition, w, (), False) for w, c in z.items()], a),
            Step(second, z, [Use(c, (), pair, w, (Y, X)) for w, c in z.items()], a),
        ]
        text = f"{a.letter_text(Y)} = {a.text(z)}"
        note = "both products are I between equal spaces, so each factor is the inverse of the other"
        return Equation("lemma", text, {(Y,): ONE}, z, steps=numbered(steps), uses=[halves[1]], note=note)

    def _times_inverse(self, o: Opaque, left: Word, right: Word, form: Polynomial, steps: list[Step]) -> Equation:
        """Return left (the normal form of X) right = I, with X⁻¹ for one of left and right and I for the other."""
        a, whole = self.alphabet, (*left, o.name, *right)
        chain = [step.reversed().between(left, right) for step in reversed(steps)]
        chain.append(Step(framed(left, o.inner, right), {whole: ONE}, [Use(-ONE, left, o.definition, right, (), False)], a))
        chain.append(Step({whole: ONE}, UNIT, [Use(ONE, (), self.local.pair(whole[0], whole[1]), (), whole)], a))
        lhs = framed(left, form, right)
        return Equation("lemma", f"{a.text(lhs)} = I", lhs, UNIT, steps=numbered(chain))


@lru_cache(maxsize=32)
def _known_inverses(setting: Setting) -> dict[tuple, list[tuple[Polynomial, Number]]]:
    """Candidates by the normal form of X, scaled."""
    rules, alphabet = rules_for(setting), theory().alphabet
    found: dict[tuple, list[tuple[Polynomial, Number]]] = {}
    for one, other in KNOWN_INVERSES:
        for x, z in ((parse(one), parse(other)), (parse(other), parse(one))):
            for p, q in ((x, z), (alphabet.star_of(x), alphabet.star_of(z))):
                key, scale = scaled(normal_form(p, rules, alphabet))
                found.setdefault(key, []).append((q, scale))
    return found


def _unmarked(letter: str, mark: str) -> str:
    """Return a letter of a further model as the first model's letter; letters of other models stay distinct."""
    name, done = split(letter)
    if not mark:
        return letter
    return name[: -len(mark)] + done if name.endswith(mark) else "?" + letter
