"""Determinants: ln|det| of triangular operators, of products of square factors, of the mass matrix, of partitioned operators.

ln|det XY| = ln|det X| + ln|det Y| for square factors,    ln|det X*| = ln|det X|,    ln|det c I + strictly triangular| = n ln|c|,
ln|det(ℳ + J)| = ln det D,  by ℳ + J = [I+HφK] D [I+HφK]*.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence

from .. import _core
from .axioms import theory
from .equations import Equation, Step, chain_holds
from .expand import Opaque, square
from .inverses import Inverses
from .local_rules import LocalRules
from .presuppositions import is_triangular
from .scalar_steps import fact
from .scalar_words import space_of, trace_word
from .words import ONE, Alphabet, Number, Polynomial, Word, add_to, combine, inverse_of, inverted, monomial, of_model, plain, split, times

TRIANGULAR = "the determinant of a triangular operator is the determinant of its diagonal"
PRODUCT = "the determinant of a product of square factors"
PARTITIONED = "the determinant of a partitioned operator: of one block, and of the other's Schur complement"
"""The reasons, as notes of equations."""


class Determinants:
    """Known facts on the determinants in a statement."""

    def __init__(self, local: LocalRules, inverses: Inverses):
        self.local, self.inverses, self.problem, self.alphabet = local, inverses, local.problem, local.alphabet

    def equations(self, word: Word) -> Iterator[Equation]:
        """Yield known equations for ln|det X|, from X as written and from its normal form."""
        name = word[1]
        opaque = next((o for o in self.problem.opaque if o.name == name), None)
        inner: Polynomial = {(name,): ONE} if opaque is None else opaque.inner
        form, steps = self.local.reduce(inner)
        for q, way in ((inner, []), (form, steps)):
            yield from self._triangular(word, inner, q, way)
            yield from self._product(word, inner, q, way)
        yield from self._partitioned(word, inner)
        if opaque is not None and form:
            yield from self._by_factors(word, form, opaque.definition)
        yield from self._factor(word)

    def _triangular(self, word: Word, inner: Polynomial, form: Polynomial, steps: Sequence[Step]) -> Iterator[Equation]:
        """n ln|c| if X reduces to c I and a strictly triangular part."""
        if is_triangular(form, self.alphabet):
            c = sum(c for w, c in form.items() if is_triangular({w: ONE}, self.alphabet))
            check = functools.partial(_is_triangular, inner, form, steps, self.alphabet)
            yield fact(self.alphabet, word, self._multiple(word, c), TRIANGULAR, check, steps)

    def _product(self, word: Word, inner: Polynomial, form: Polynomial, steps: Sequence[Step]) -> Iterator[Equation]:
        """The sum over the letters if X reduces to one word of square letters."""
        if len(form) != 1:
            return
        ((letters, c),) = form.items()
        if letters != (word[1],) and all(self._is_square(x) for x in letters):
            by = self._multiple(word, c)
            for x in letters:
                add_to(by, ("ln det", split(x)[0]), -ONE if inverted(x) else ONE)
            yield fact(self.alphabet, word, by, PRODUCT, functools.partial(chain_holds, steps, inner, form), steps)

    def _by_factors(self, word: Word, form: Polynomial, definition: Equation) -> Iterator[Equation]:
        """ln|det X| of X = c A D A*, such as ℳ + J, from the determinants of A and D."""
        found = self.inverses.factored(word[1], form, definition)
        if found is not None:
            product, factor, mark, c = found
            by: Polynomial = {("ln det", factor.name): 2 * ONE, ("ln det", of_model("D", mark)): ONE}
            yield fact(self.alphabet, word, by | self._multiple(word, c), PRODUCT, product.holds, uses=[product])

    def _factor(self, word: Word) -> Iterator[Equation]:
        """Zero for an innovations factor I + HφK."""
        for factor in self.inverses.found_factors:
            if factor.name == word[1]:
                check = functools.partial(is_triangular, factor.definition.rhs, self.alphabet)
                yield fact(self.alphabet, word, {}, TRIANGULAR, check, uses=[factor.definition])

    def _multiple(self, word: Word, c: Number) -> Polynomial:
        """ln|det c I| on the space of the word's operator; nothing if |c| is 1."""
        size = c if c > 0 else -c
        return {} if size == 1 else {("ln", str(size), trace_word((), self.alphabet, space_of((word[1],), self.alphabet))[1]): ONE}

    def _partitioned(self, word: Word, inner: Polynomial) -> Iterator[Equation]:
        """ln|det H X H*| from a partition of the hinges into two sets: the determinants of one set's block and of its Schur complement."""
        for first, second, base in self._halves():
            H, H_star = of_model("H", base), of_model("H*", base)
            if not inner or any(len(w) < 2 or w[0] != H or w[-1] != H_star for w in inner):
                continue
            rows = {mark: (of_model("H", mark), of_model("H*", mark)) for mark in (first, second)}
            block = lambda i, j, r=rows: {(r[i][0], *w[1:-1], r[j][1]): c for w, c in inner.items()}
            form = self.local.reduce(block(first, first))[0]
            inverted_by = [o for o in self.problem.opaque if o.kind == "inverse" and self.local.reduce(o.inner)[0] == form]
            blocks = [o for o in self.problem.opaque if o.kind == "operand" and self.local.reduce(o.inner)[0] == form]
            for z in inverted_by[:1] if blocks else ():
                coupling = times(times(block(second, first), monomial(inverse_of(z.name))), block(first, second))
                schur = self.local.reduce(combine((1, block(second, second)), (-1, coupling)))[0]
                for o in self.problem.opaque:
                    if o.kind == "operand" and self.local.reduce(o.inner)[0] == schur:
                        by = monomial("ln det", blocks[0].name) | monomial("ln det", o.name)
                        uses = [z.definition, o.definition, blocks[0].definition]
                        premises = [theory()("J = 0")] if "J = 0" in self.local.setting.hypotheses else []
                        complement = combine((1, block(second, second)), (-1, coupling))
                        parts = [(block(first, first), z), (block(first, first), blocks[0]), (complement, o)]
                        yield fact(self.alphabet, word, by, PARTITIONED, functools.partial(self._equal, parts), uses=[*uses, *premises])

    def _equal(self, pairs: Sequence[tuple[Polynomial, Opaque]]) -> bool:
        """Return True if operands have the normal forms of these words."""
        return all(self.local.reduce(p)[0] == self.local.reduce(o.inner)[0] for p, o in pairs)

    def _halves(self) -> Iterator[tuple[str, str, str]]:
        """Return (mark, mark, the mark of their model) of two trees with hinges locked, if each hinge is in one of them."""
        names = {mark: source.coordinate_names for mark, (source, _) in zip(self.problem.marks, self.problem.contexts, strict=False)}
        for first, base in self.local.locked:
            for second, other in self.local.locked:
                if base == other and sorted([*names[first], *names[second]]) == sorted(names.get(base, [])):
                    yield first, second, base

    def _is_square(self, letter: str) -> bool:
        e = self.alphabet.letters[split(letter)[0]].expression
        if plain(letter) in ("φ", "ψ", "D", "M", "P", "R", "J", "Υ", "X"):
            return True
        return e is not None and not isinstance(e, _core.Scalar) and square(e)


def _is_triangular(inner: Polynomial, form: Polynomial, steps: Sequence[Step], alphabet: Alphabet) -> bool:
    return is_triangular(form, alphabet) and chain_holds(steps, inner, form)
