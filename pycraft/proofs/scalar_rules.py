"""Normal form of traces, ln|det| and norms: the rules between numbers, and the steps of the reduction.

Equations of operators hold inside a trace (`traces`); determinants follow from the structure of their operands (`determinants`);
factors of products are reduced one by one, and scalars of equal operators are equal.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence

from .determinants import Determinants
from .equations import Equation, Step, Use, chain_holds
from .inverses import Inverses
from .local_rules import LocalRules
from .presuppositions import Void
from .scalar_steps import ProductUse, ScalarStep, fact
from .scalar_words import product_word, reciprocal_of
from .traces import Traces
from .walk import GaveUp
from .words import ONE, Number, Polynomial, Word, combine, factors_of, monomial, ratio

STEPS = 200
"""Number of steps at which a reduction gives up."""


class ScalarRules:
    """Rules that bring scalars to a normal form: an attempt's rules inside traces, and facts on diagonal blocks and determinants."""

    def __init__(self, local: LocalRules, inverses: Inverses):
        self.local, self.problem, self.alphabet = local, local.problem, local.alphabet
        self._traces, self._determinants = Traces(local), Determinants(local, inverses)
        self._forms: list[tuple[str, str, Polynomial, Polynomial, list[Step]]] = []
        self._reduced: dict[Word, tuple[Polynomial, list[Step]]] = {}

    def reduce(self, p: Polynomial) -> tuple[Polynomial, list[Step]]:
        """Return the normal form and the steps to it. Raises GaveUp."""
        steps: list[Step] = []
        while (step := self._traces.turned(p) or self._traces.inside(p) or self._between(p) or self._factors_reduced(p)) is not None:
            steps.append(step)
            p = step.after
            if len(steps) > STEPS:
                raise GaveUp
        return p, steps

    def _factors_reduced(self, p: Polynomial) -> Step | None:
        """Replace one factor of products by its normal form everywhere; a reciprocal by its operand's normal form."""
        for factor in sorted({f for word in p if word[0] in ("×", "1/") for f in factors_of(word)}):
            inverse = factor[0] == "1/"
            inner = factor[1:] if inverse else factor
            if inverse and inner[0].startswith("⟨"):
                continue
            if inner not in self._reduced:
                self._reduced[inner] = self.reduce({inner: ONE})
            form, steps = self._reduced[inner]
            if form == {inner: ONE}:
                continue
            if inverse and not form:
                raise Void(f"1/({self.alphabet.word_text(inner)}) is a reciprocal of zero")
            by = reciprocal_of(form) if inverse else form
            if by is None:
                continue
            note = "a factor, reduced by itself"
            equation = fact(self.alphabet, factor, by, note, functools.partial(_factor_holds, factor, inner, by, form, steps), steps)
            after, uses = dict(p), []
            for word, c in p.items():
                every = factors_of(word)
                if factor in every:
                    every.remove(factor)
                    use = ProductUse(c, (), equation, (), factor, others=product_word(every))
                    uses.append(use)
                    after = combine((1, after), (-c, use.difference()))
            return ScalarStep(p, after, list(uses), self.alphabet)
        return None

    # ------------------------------------------------------------------ equations between numbers
    def _between(self, p: Polynomial) -> Step | None:
        """One equation between numbers, for one of the words."""
        for word in p:
            for equation in self._equations(word):
                after = combine((1, p), (-p[word], equation.difference))
                return ScalarStep(p, after, [Use(p[word], (), equation, (), word)], self.alphabet)
        return None

    def _equations(self, word: Word) -> Iterator[Equation]:
        if word[0] == "tr":
            yield from self._traces.equations(word)
        elif word[0] == "ln det":
            yield from self._determinants.equations(word)
            yield from self._same("ln det", word[1])
        elif word[0] == "norm":
            yield from self._same("norm", word[1])

    def _same(self, kind: str, name: str) -> Iterator[Equation]:
        """Replace the scalar of an operand by the scalar of an earlier, equal operand, up to the sign or the star."""
        a = self.alphabet
        inner: Polynomial = next((o.inner for o in self.problem.opaque if o.name == name), {(name,): ONE})
        form, steps = self.local.reduce(inner)
        if kind == "norm" and not form:
            yield fact(a, (kind, name), {}, "the norm of zero", lambda: chain_holds(steps, inner, {}), steps)
        for its_kind, other, its_inner, its_form, its_steps in self._forms:
            if its_kind != kind or other == name:
                continue
            for p in (its_form, a.star_of(its_form)):
                if form and p and p.keys() == form.keys():
                    check = lambda i=its_inner, f=its_form, s=its_steps: chain_holds(steps, inner, form) and chain_holds(s, i, f)
                    ratios: set[Number] = {ratio(c, p[w]) for w, c in form.items()}
                    size = max(c if c > 0 else -c for c in ratios)
                    if len(ratios) == 1 and (kind == "norm" or size == 1):
                        note = "operators that are equal up to a factor and a star"
                        yield fact(a, (kind, name), monomial(kind, other, c=size), note, check, [*steps, *its_steps])
                        return
        if (kind, name) not in [(k, n) for k, n, *_ in self._forms]:
            self._forms.append((kind, name, inner, form, steps))


def _factor_holds(factor: Word, inner: Word, by: Polynomial, form: Polynomial, steps: Sequence[Step]) -> bool:
    """Return True if a factor equals its claimed form by its steps; for a reciprocal, by its operand's steps."""
    wanted = form if factor == inner else reciprocal_of(form)
    return by == wanted and chain_holds(steps, {inner: ONE}, form)
