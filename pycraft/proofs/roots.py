"""Square roots of operators, L = A^½ with LL* = A: when two are equal or multiples, and how they meet inverses."""

from __future__ import annotations

from .equations import Equation, Step, Use, chain_holds, numbered
from .expand import Opaque
from .local_rules import LocalRules
from .normal_form import scaled
from .presuppositions import ALWAYS
from .words import ONE, Number, Polynomial, Word, framed, inverse_of, monomial, plain, ratio, root_of


class Roots:
    """Known facts on the square roots in a statement, added to its rules one after another."""

    def __init__(self, local: LocalRules):
        self.local, self.problem, self.alphabet = local, local.problem, local.alphabet
        self._roots: list[tuple[Opaque, Polynomial, list[Step]]] = []

    def add(self, o: Opaque) -> None:
        """Add LL* = A of L = A^½, and L⁻¹A = L* if A is one word."""
        a, L = self.alphabet, o.name
        form, steps = self.local.reduce(o.inner)
        text = a.letters[L].text
        for other, its_form, its_steps in self._roots:
            if its_form == form:
                same = Equation("structure", f"{text} = {a.letters[other.name].text}", {(L,): ONE}, {(other.name,): ONE})
                same.steps, same.note = [*steps, *its_steps], "roots of equal operators"
                same.check = lambda i=other.inner, s=its_steps: chain_holds(steps, o.inner, form) and chain_holds(s, i, form)
                self.local.add(same, (L,))
                return
            if (multiple := self._multiple(o, form, steps, other, its_form, its_steps)) is not None:
                self.local.add(multiple, (L,))
                return
        self._roots.append((o, form, steps))
        star = a.star(L)
        square = Equation("definition", f"{text} ({text})* = {a.text(o.inner)}", {(L, star): ONE}, o.inner)
        self.local.add(square, (L, star))
        if len(form) != 1:
            return
        ((word, c),) = form.items()
        if all(plain(x) in ALWAYS for x in word):
            self.local.regular.add(L)
        letters = {x for p in self.problem.polynomials() for w in p for x in w}
        Y = inverse_of(L)
        if Y in letters or a.star(Y) in letters:
            self._inverted(Y, L, word, c, square, steps)
        if len(word) == 1 and inverse_of(word[0]) in letters:
            self._meets_inverse(Y, L, word[0], c, square, steps)

    def _multiple(
        self, o: Opaque, form: Polynomial, steps: list[Step], other: Opaque, its_form: Polynomial, its_steps: list[Step]
    ) -> Equation | None:
        """√(c²A) = c √A, c a fraction; None if the operands are not such multiples."""
        if not form or not its_form:
            return None
        (key, scale), (its_key, its_scale) = scaled(form), scaled(its_form)
        c = root_of(ratio(scale, its_scale)) if key == its_key else None
        if c is None:
            return None
        a = self.alphabet
        text = f"{a.letters[o.name].text} = {a.text({(other.name,): c})}"
        made = Equation(
            "structure", text, {(o.name,): ONE}, {(other.name,): c}, note="the root of a positive multiple is a multiple of the root"
        )
        made.steps = [*steps, *its_steps]
        made.check = lambda: chain_holds(steps, o.inner, form) and chain_holds(its_steps, other.inner, its_form)
        return made

    def _inverted(self, Y: str, L: str, word: Word, c: Number, square: Equation, steps: list[Step]) -> None:
        """L⁻¹A = L*, Y being L⁻¹ and c times the word A."""
        a, scale, star = self.alphabet, ratio(1, c), self.alphabet.star(L)
        chain = [step.reversed().between((Y,), (), scale) for step in reversed(steps)]
        inner = {w: x * scale for w, x in framed((Y,), square.rhs, ()).items()}
        whole = monomial(Y, L, star, c=scale)
        chain.append(Step(inner, whole, [Use(-scale, (Y,), square, (), (), False)], a))
        chain.append(Step(whole, monomial(star, c=scale), [Use(scale, (), self.local.pair(Y, L), (star,), (Y, L))], a))
        lhs, rhs = monomial(Y, *word), monomial(star, c=scale)
        self.local.add(Equation("lemma", f"{a.text(lhs)} = {a.text(rhs)}", lhs, rhs, steps=numbered(chain)), (Y, *word))

    def _meets_inverse(self, Y: str, L: str, x: str, c: Number, square: Equation, steps: list[Step]) -> None:
        """L*x⁻¹ = c L⁻¹, Y being L⁻¹ and c times the letter x A."""
        a, star, inverse = self.alphabet, self.alphabet.star(L), inverse_of(x)
        lhs, whole, rhs = monomial(star, inverse), monomial(Y, L, star, inverse), monomial(Y, c=c)
        inner = framed((Y,), square.rhs, (inverse,))
        chain = [
            Step(lhs, whole, [Use(-ONE, (), self.local.pair(Y, L), (star, inverse), (), False)], a),
            Step(whole, inner, [Use(ONE, (Y,), square, (inverse,), (L, star))], a),
            *(step.between((Y,), (inverse,)) for step in steps),
            Step(monomial(Y, x, inverse, c=c), rhs, [Use(c, (Y,), self.local.pair(x, inverse), (), (x, inverse))], a),
        ]
        self.local.add(Equation("lemma", f"{a.text(lhs)} = {a.text(rhs)}", lhs, rhs, steps=numbered(chain)), (star, inverse))
        if Y not in self.local.inverted:
            self.local.add_pairs(L)
