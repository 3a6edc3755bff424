"""What a statement adds to the rules: the letters that stand for inverses of sums, diagonal parts and square roots.

X⁻¹ = Z where a candidate Z shows XZ = I and ZX = I: for X a single word, for X one of the operators whose inverse is known, for X an
operator whose inverse stands elsewhere in the statement. Otherwise XX⁻¹ = I and X⁻¹X = I are rules, with X in its normal form.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from . import factors
from .axioms import theory
from .blocks import diagonal_part
from .equations import Equation, Step, Use, chain_holds, marked, numbered
from .expand import Opaque, Problem
from .normal_form import Rules, Setting, normal_form, rule_from, rules_for, weight
from .presuppositions import ALWAYS, Void, inverses_used, is_positive_constant, is_positive_definite, is_regular_constant, is_triangular
from .relations import at_the_roots, compliance_facts, crosses_with_axes, in_world
from .words import (
    ONE,
    SHARED,
    Alphabet,
    Letter,
    Number,
    Polynomial,
    Word,
    combine,
    framed,
    inverse_of,
    inverted,
    monomial,
    parse,
    plain,
    ratio,
    root_of,
    split,
    times,
    underived,
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
"""Pairs X, Z with XZ = ZX = I: candidates only, each is proved where it is used."""

_UNIT: Polynomial = {(): ONE}


class LocalRules:
    """The rules of one setting with those of the letters that a statement adds.

    Attributes
    ----------
    rules : for normal forms; `block_rules` for operands of blockdiag, which need the recursions of R and Υ
    local : the equations added
    regular : letters that have an inverse
    needs : of letters that have one where others have, which these are
    """

    def __init__(self, problem: Problem, setting: Setting, extra: list[tuple[Equation, Word]]):
        self.problem, self.setting = problem, setting
        self.alphabet: Alphabet = problem.alphabet
        self.local: list[Equation] = []
        self.locked = tuple((mark, base) for mark, how, base in problem.relations if how == "hinge subset")
        self.rules: Rules = rules_for(setting, problem.marks, self.locked).copy()
        blocks = Setting(setting.hypotheses, composite=True, compliance=True)
        diagonal_parts = any(o.kind == "blockdiag" for o in problem.opaque)
        self.block_rules = rules_for(blocks, problem.marks, self.locked).copy() if diagonal_parts else None
        self._rank = 0
        self._factors: dict[str, factors.Factor | None] = {}
        self._forms: list[tuple[str, Polynomial]] = []
        self._roots: list[tuple[Opaque, Polynomial, list[Step]]] = []
        self._swept: list[tuple[str, str, Polynomial, list[Step]]] = []
        named = sorted({split(x)[0] for p in problem.polynomials() for w in p for x in w if inverted(x)})
        self.regular = {n for n in named if plain(n) in ALWAYS}
        self.needs: dict[str, set[str]] = {}
        letters = self.alphabet.letters.items()
        constants = {n: x.expression for n, x in letters if x.expression is not None and x.text not in problem.unknown}
        self.regular |= {n for n in named if is_regular_constant(constants.get(n))}
        self._definite = {n for n, e in constants.items() if is_positive_constant(e)}
        for equation, word in extra:
            self.add(equation, word)
        if self.block_rules is not None and "Υ" in {underived(plain(x)) for p in problem.polynomials() for w in p for x in w}:
            for equation, word in problem.recursion_rules():
                self._rank -= 1
                self.block_rules.add_equation(equation, word, self.alphabet, self._rank)
        for equation, name in problem.assumed:
            self._assume(equation, name)
        self._world_axes()
        source = problem.contexts[0][0] if problem.contexts else None
        for name, e in constants.items():
            for equation, word in at_the_roots(name, e, source) if getattr(e, "kind", "") == "constant" else ():
                self.add(equation, word)
        self.inverted = {inverse_of(n) for n in named}
        for name in named:
            if name not in theory().alphabet.letters:
                self._add_pairs(name)
        for equation, word in (*compliance_facts(problem, setting.hypotheses), *crosses_with_axes(problem)):
            self.add(equation, word)
        kinds = {"inverse": self._inverse, "blockdiag": self._blocks, "sqrt": self._root, "half": self._half}
        for opaque in problem.opaque:
            if opaque.kind != "operand":
                kinds[opaque.kind](opaque)

    def _assume(self, equation: Equation, name: str) -> None:
        """A hypothesis of the user's as a rule; of X > 0, X* = X, and that X has an inverse."""
        if name:
            self.regular.add(name)
            self._definite.add(name)
        form = normal_form(equation.difference, self.rules, self.alphabet)
        if not form:
            return
        lead = max(form, key=weight)
        c, p = form[lead], equation.difference
        reduced, steps = self.reduce(p)
        rest = {w: ratio(-x, c) for w, x in reduced.items() if w != lead}
        uses = [Use(ratio(1, c), (), equation, (), lead)] + [u.between((), (), ratio(-1, c)) for s in steps for u in s.uses]
        step = Step({lead: ONE}, rest, uses, self.alphabet)
        solved = Equation(
            "lemma", f"{self.alphabet.word_text(lead)} = {self.alphabet.text(rest)}", {lead: ONE}, rest, steps=numbered([step])
        )
        if rest == equation.rhs and {lead: ONE} == equation.lhs:
            solved = equation
        self.local.append(solved)
        self._rank -= 1
        for rules in filter(None, (self.rules, self.block_rules)):
            rules.add(rule_from(solved, lead, self._rank))
            star = self.alphabet.star_word(lead)
            if star not in solved.difference:
                rules.add(rule_from(solved.transposed(self.alphabet), star, self._rank))

    def _world_axes(self) -> None:
        """Letters in world axes by those of their model."""
        found = {
            x.replace("*", "") if not inverted(x) else inverse_of(split(x)[0]) for p in self.problem.polynomials() for w in p for x in w
        }
        for mark, how, base in self.problem.relations:
            for letter in sorted(found) if how == "world frame" else ():
                equation = in_world(letter, mark, base)
                if equation is not None:
                    self.add(equation, (letter,))

    def add(self, equation: Equation, word: Word, blocks: bool = True) -> None:
        """A rule and its transpose, before all that are there."""
        self.local.append(equation)
        self._rank -= 1
        for rules in [self.rules, *([self.block_rules] if blocks and self.block_rules is not None else [])]:
            rules.add_equation(equation, word, self.alphabet, self._rank)

    def reduce(self, p: Polynomial) -> tuple[Polynomial, list[Step]]:
        """(the normal form, the steps to it)."""
        return self.rules.reduce(p, self.alphabet)

    def _add_pairs(self, name: str) -> None:
        """X X⁻¹ = I and X⁻¹ X = I of a letter."""
        for pair in ((name, inverse_of(name)), (inverse_of(name), name)):
            self.add(self.pair(*pair), pair)

    def pair(self, a: str, b: str) -> Equation:
        """a b = I for a letter and its inverse."""
        word = (a, b)
        for equation in self.local:
            for e in (equation, equation.transposed(self.alphabet)) if equation.kind == "inverse" else ():
                if word in e.lhs:
                    return e
        return Equation("inverse", f"{self.alphabet.word_text(word)} = I", {word: ONE}, _UNIT)

    # ------------------------------------------------------------------ inverses
    def _inverse(self, o: Opaque) -> None:
        X, a = o.name, self.alphabet
        form, steps = self.reduce(o.inner)
        if not form:
            where = f" where {' and '.join(sorted(self.setting.hypotheses))}" if self.setting.hypotheses else ""
            raise Void(f"{o.expression.text()} = 0{where}, which has no inverse")
        self._by_structure(X, o.inner, form, steps)
        if self._by_factors(o, form):
            return
        for z in self._candidates(form):
            lemma = self._inverse_is(X, o.inner, z, o.definition)
            if lemma is not None:
                self.needs[X] = inverses_used([lemma.steps[0].uses[0].equation, *lemma.uses])
                self.add(lemma, (inverse_of(X),))
                return
        lead = max(form, key=weight)
        for left, right in (((), (inverse_of(X),)), ((inverse_of(X),), ())):
            self.add(self._times_inverse(o, left, right, form, steps), left + lead + right, blocks=False)
        starred = a.star_of(o.inner)
        if normal_form(starred, self.rules, a) == form:
            lemma = self._inverse_is(a.star(X), starred, {(inverse_of(X),): ONE}, o.definition.transposed(a))
            if lemma is not None:  # X⁻* = X⁻¹; its transpose says the same
                self.local.append(lemma)
                self._rank -= 1
                for rules in filter(None, (self.rules, self.block_rules)):
                    rules.add(rule_from(lemma, (inverse_of(a.star(X)),), self._rank))
        self._forms.append((X, form))

    def factor(self, mark: str) -> factors.Factor | None:
        """A = I + HφK of one model, with its inverse; None if that is not shown."""
        if mark not in self._factors:
            base = dict(self.locked).get(mark, mark)
            context = self.problem.contexts[self.problem.marks.index(mark)] if self.problem.contexts else None
            name, definition = factors.letter(self.alphabet, mark, base, context)
            lemma = self._inverse_is(name, definition.rhs, factors.of(factors.INVERSE, mark, base), definition)
            self._factors[mark] = None if lemma is None else factors.Factor(name, definition, lemma)
        return self._factors[mark]

    def factored(self, X: str, form: Polynomial, definition: Equation) -> tuple[Equation, factors.Factor, str, Number] | None:
        """(X = c A D A*, A, the mark of its model, c) of a letter with this definition and normal form; None if it is not that."""
        key, scale = _scaled(form)
        for mark in self.problem.marks:
            base = dict(self.locked).get(mark, mark)
            product = self.reduce(factors.of(factors.PRODUCT, mark, base))[0]
            its_key, its_scale = _scaled(product) if product else ((), ONE)
            if its_key == key and (factor := self.factor(mark)) is not None:
                c = ratio(scale, its_scale)
                lemma = factors.factorization(X, c, definition, factor, mark, self.alphabet, self.reduce)
                return None if lemma is None else (lemma, factor, mark, c)
        return None

    def _by_factors(self, o: Opaque, form: Polynomial) -> bool:
        """X⁻¹ where X is ℳ + J, by its factors."""
        found = self.factored(o.name, form, o.definition)
        if found is None:
            return False
        product, factor, mark, c = found
        self.needs[o.name] = inverses_used(factor.premises)
        self.needs[factor.name] = self.needs[o.name]
        whole = factors.inverse_of_product(o.name, c, product, factor, mark, self.alphabet, self.pair)
        self.add(whole, (inverse_of(o.name),))
        if factor.inverse not in self.local:
            self.add(factor.inverse, (inverse_of(factor.name),))
        return True

    def _by_structure(self, X: str, inner: Polynomial, form: Polynomial, steps: list[Step]) -> None:
        """X regular, where its words say so: as they were written, or in normal form."""
        for p, premises in ((inner, ()), (form, [e for step in steps for e in step.premises()])):
            definite = is_positive_definite(p, self.alphabet, self.setting.hypotheses, self._definite)
            if definite or is_triangular(p, self.alphabet):
                self._definite |= {X} if definite else set()
                self.needs[X] = inverses_used(premises) | {split(x)[0] for w in p for x in w if inverted(x)} - {*ALWAYS}
                return

    def _candidates(self, form: Polynomial) -> Iterator[Polynomial]:
        """What may be the inverse of an operator with this normal form."""
        if len(form) == 1:
            ((word, c),) = form.items()
            if all(plain(x) in ("φ", "ψ", "D", "M", "P", "R", "Υ") or inverted(x) for x in word):
                yield {tuple(inverse_of(x) for x in reversed(word)): ratio(1, c)}
        for mark in self.problem.marks:
            base = dict(self.locked).get(mark, mark)
            key, scale = _scaled({tuple(_unmarked(x, base if plain(x) in SHARED else mark) for x in w): c for w, c in form.items()})
            for z, its_scale in _known_inverses(self.setting).get(key, ()):
                yield {marked(w, mark, base): ratio(c * its_scale, scale) for w, c in z.items()}
        key, scale = _scaled(form)
        for X, other in self._forms:
            for name, p in ((X, other), (self.alphabet.star(X), self.alphabet.star_of(other))):
                its_key, its_scale = _scaled(p)
                if its_key == key:
                    yield {(inverse_of(name),): ratio(its_scale, scale)}

    def _inverse_is(self, X: str, inner: Polynomial, z: Polynomial, definition: Equation) -> Equation | None:
        """The lemma X⁻¹ = Z, by XZ = I and ZX = I; None if these do not come out."""
        a, Y = self.alphabet, inverse_of(X)
        halves = []
        shown = a.letter_text(X)
        for product, text in ((times(inner, z), f"{shown} Z = I"), (times(z, inner), f"Z {shown} = I")):
            form, steps = self.reduce(product)
            if form != _UNIT:
                return None
            halves.append(Equation("lemma", f"{text}, Z = {a.text(z)}", product, _UNIT, steps=numbered(steps)))
        first, second = framed((Y,), times(inner, z), ()), {(Y, X, *w): c for w, c in z.items()}
        pair = self.pair(Y, X)
        steps = [
            Step({(Y,): ONE}, first, [Use(-ONE, (Y,), halves[0], (), (), False)], a),
            Step(first, second, [Use(-c, (Y,), definition, w, (), False) for w, c in z.items()], a),
            Step(second, z, [Use(c, (), pair, w, (Y, X)) for w, c in z.items()], a),
        ]
        text = f"{a.letter_text(Y)} = {a.text(z)}"
        note = "both products are I between equal spaces, so that the one is the inverse of the other"
        return Equation("lemma", text, {(Y,): ONE}, z, steps=numbered(steps), uses=[halves[1]], note=note)

    def _times_inverse(self, o: Opaque, left: Word, right: Word, form: Polynomial, steps: list[Step]) -> Equation:
        """left (the normal form of X) right = I, where one of left and right is X⁻¹ and the other I."""
        a, whole = self.alphabet, (*left, o.name, *right)
        chain = [step.reversed().between(left, right) for step in reversed(steps)]
        chain.append(Step(framed(left, o.inner, right), {whole: ONE}, [Use(-ONE, left, o.definition, right, (), False)], a))
        chain.append(Step({whole: ONE}, _UNIT, [Use(ONE, (), self.pair(whole[0], whole[1]), (), whole)], a))
        lhs = framed(left, form, right)
        return Equation("lemma", f"{a.text(lhs)} = I", lhs, _UNIT, steps=numbered(chain))

    # ------------------------------------------------------------------ diagonal parts and roots
    def _blocks(self, o: Opaque) -> None:
        """blockdiag(X), by the normal form of X."""
        assert self.block_rules is not None
        a = self.alphabet
        form, steps = self.block_rules.reduce(o.inner, a)
        chain = "serial chain" in self.setting.hypotheses
        value = diagonal_part(form, a, chain)
        if any(a.letters[split(x)[0]].word for w in value for x in w) and self._recursion(o):
            return
        name = o.name
        if form != o.inner:  # first inside, then by blocks
            name = self._written(o, form, steps)
        text = f"{a.letters[name].text} = {a.text(value)}"
        note = "the diagonal blocks of each word, by where its letters lead on the tree"
        equation = Equation("structure", text, {(name,): ONE}, value, note=note, uses=[theory()("S = 0")] * chain)
        equation.check = lambda: diagonal_part(form, a, chain) == value
        self.add(equation, (name,))

    def _written(self, o: Opaque, form: Polynomial, steps: list[Step]) -> str:
        """The letter of blockdiag(the normal form), with the rule that blockdiag(X) is that."""
        a, known = self.alphabet, self.alphabet.letters[o.name]
        name = f"{o.name}form"
        latex = f"\\operatorname{{blockdiag}}({a.latex(form)})"
        a.add(Letter(name, f"blockdiag({a.text(form)})", latex, known.symmetric, "diagonal", None, known.expression))
        text = f"{a.text(o.inner)} = {a.text(form)}"
        inside = Equation("structure", text, {(o.name,): ONE}, {(name,): ONE}, steps=numbered(list(steps)), uses=[o.definition])
        inside.check = lambda: chain_holds(steps, o.inner, form)
        self.add(inside, (o.name,))
        return name

    def _recursion(self, o: Opaque) -> bool:
        """Y = X + E Y E* for Y = blockdiag(A X A*), A = (I-E)⁻¹ and X block diagonal; Y = Z where Z obeys the same. Whether Y is that."""
        a, problem = self.alphabet, self.problem
        factors = o.expression.children[0].children if o.expression.children[0].kind == "product" else []
        if len(factors) < 3 or factors[0].name not in ("phi", "psi") or factors[0].T != factors[-1]:
            return False
        A = problem.letter(factors[0])
        E = A.replace("φ", "E_φ").replace("ψ", "E_ψ")
        X: Polynomial = {(): ONE}
        for factor in factors[1:-1]:
            X = times(X, problem.words(factor))
        if diagonal_part(X, a) != X:
            return False
        form, steps = self.reduce(X)

        def says(Z: str, its_steps: list[Step]) -> Equation:
            equation = Equation("structure", f"{a.letters[o.name].text} = {a.letter_text(Z)}", {(o.name,): ONE}, {(Z,): ONE})
            equation.steps, equation.note = [*steps, *its_steps], "both obey Y = X + E Y E*, which has one solution"
            equation.check = lambda: chain_holds(steps, X, form) and (not its_steps or its_steps[-1].full()[1] == form)
            return equation

        for Z in (f"∂{x}{A[1:]}" for x in ("P", "R")):
            if Z in a.letters:
                rest, its_steps = self.reduce({(Z,): ONE, (E, Z, a.star(E)): -ONE})
                if rest == form:
                    self.add(says(Z, its_steps), (o.name,))
                    return True
        for Z, other, its_form, its_steps in self._swept:
            if other == A and its_form == form:
                self.add(says(Z, its_steps), (o.name,))
                return True
        self._swept.append((o.name, A, form, steps))
        edge: Polynomial = {(E, o.name, a.star(E)): ONE}
        text = f"{a.text(edge)} = Y − X, Y = {a.letters[o.name].text}"
        equation = Equation("structure", text, edge, combine((1, monomial(o.name)), (-1, X)))
        equation.note = "Y = X + E Y E*: φ = I + E φ, and what leads out to two children leads back to none"
        equation.check = lambda: diagonal_part(X, a) == X
        E_phi = A.replace("φ", "E_φ").replace("ψ", "E_φ")
        self._add_solved(equation, (E_phi, o.name, a.star(E_phi)))
        return True

    def _add_solved(self, equation: Equation, lead: Word) -> None:
        """The equation with its sides in normal form, as a rule for one of its words."""
        a = self.alphabet
        form, steps = self.reduce(equation.difference)
        c = form.get(lead)
        if c is None:  # the letters are written by those of another tree
            return
        rest = {w: ratio(-x, c) for w, x in form.items() if w != lead}
        uses = [Use(ratio(1, c), (), equation, (), lead)] + [u.between((), (), ratio(-1, c)) for step in steps for u in step.uses]
        step = Step({lead: ONE}, rest, uses, a, f"{equation.text}, solved for {a.word_text(lead)}")
        self.add(Equation("lemma", f"{a.word_text(lead)} = {a.text(rest)}", {lead: ONE}, rest, steps=numbered([step])), lead)

    def _root(self, o: Opaque) -> None:
        """LL* = A of L = A^½; L⁻¹A = L* where A is one word."""
        a, L = self.alphabet, o.name
        form, steps = self.reduce(o.inner)
        text = a.letters[L].text
        for other, its_form, its_steps in self._roots:
            if its_form == form:
                same = Equation("structure", f"{text} = {a.letters[other.name].text}", {(L,): ONE}, {(other.name,): ONE})
                same.steps, same.note = [*steps, *its_steps], "roots of equal operators"
                same.check = lambda i=other.inner, s=its_steps: chain_holds(steps, o.inner, form) and chain_holds(s, i, form)
                self.add(same, (L,))
                return
            if (multiple := self._multiple(o, form, steps, other, its_form, its_steps)) is not None:
                self.add(multiple, (L,))
                return
        self._roots.append((o, form, steps))
        star = a.star(L)
        square = Equation("definition", f"{text} ({text})* = {a.text(o.inner)}", {(L, star): ONE}, o.inner)
        self.add(square, (L, star))
        if len(form) != 1:
            return
        ((word, c),) = form.items()
        if all(plain(x) in ALWAYS for x in word):
            self.regular.add(L)
        letters = {x for p in self.problem.polynomials() for w in p for x in w}
        Y = inverse_of(L)
        if Y in letters or a.star(Y) in letters:
            self._root_inverted(Y, L, word, c, square, steps)
        if len(word) == 1 and inverse_of(word[0]) in letters:
            self._root_meets_inverse(Y, L, word[0], c, square, steps)

    def _multiple(
        self, o: Opaque, form: Polynomial, steps: list[Step], other: Opaque, its_form: Polynomial, its_steps: list[Step]
    ) -> Equation | None:
        """√(c²A) = c √A, c a fraction; None if the operands are not such multiples."""
        if not form or not its_form:
            return None
        (key, scale), (its_key, its_scale) = _scaled(form), _scaled(its_form)
        c = root_of(ratio(scale, its_scale)) if key == its_key else None
        if c is None:
            return None
        a = self.alphabet
        text = f"{a.letters[o.name].text} = {a.text({(other.name,): c})}"
        made = Equation(
            "structure", text, {(o.name,): ONE}, {(other.name,): c}, note="a root of a positive multiple is that multiple's root"
        )
        made.steps = [*steps, *its_steps]
        made.check = lambda: chain_holds(steps, o.inner, form) and chain_holds(its_steps, other.inner, its_form)
        return made

    def _half(self, o: Opaque) -> None:
        """T + T* = X for the lower half T of a symmetric X, half of the diagonal included."""
        a, T = self.alphabet, o.name
        form, steps = self.reduce(o.inner)
        if a.star_of(form) != form:
            return
        text = f"{a.letters[T].text} + ({a.letters[T].text})* = {a.text(form)}"
        whole = Equation("structure", text, {(T,): ONE, (a.star(T),): ONE}, form, steps=list(steps), uses=[o.definition])
        whole.note = "the halves of a symmetric operator are each other's transpose"
        whole.check = lambda: chain_holds(steps, o.inner, form) and a.star_of(form) == form
        self.local.append(whole)
        self._rank -= 1
        for rules in filter(None, (self.rules, self.block_rules)):
            rules.add(rule_from(whole, (a.star(T),), self._rank))

    def _root_inverted(self, Y: str, L: str, word: Word, c: Number, square: Equation, steps: list[Step]) -> None:
        """L⁻¹A = L*, Y being L⁻¹ and c times the word A."""
        a, scale, star = self.alphabet, ratio(1, c), self.alphabet.star(L)
        chain = [step.reversed().between((Y,), (), scale) for step in reversed(steps)]
        inner = {w: x * scale for w, x in framed((Y,), square.rhs, ()).items()}
        whole = monomial(Y, L, star, c=scale)
        chain.append(Step(inner, whole, [Use(-scale, (Y,), square, (), (), False)], a))
        chain.append(Step(whole, monomial(star, c=scale), [Use(scale, (), self.pair(Y, L), (star,), (Y, L))], a))
        lhs, rhs = monomial(Y, *word), monomial(star, c=scale)
        self.add(Equation("lemma", f"{a.text(lhs)} = {a.text(rhs)}", lhs, rhs, steps=numbered(chain)), (Y, *word))

    def _root_meets_inverse(self, Y: str, L: str, x: str, c: Number, square: Equation, steps: list[Step]) -> None:
        """L*x⁻¹ = c L⁻¹, Y being L⁻¹ and c times the letter x A."""
        a, star, inverse = self.alphabet, self.alphabet.star(L), inverse_of(x)
        lhs, whole, rhs = monomial(star, inverse), monomial(Y, L, star, inverse), monomial(Y, c=c)
        inner = framed((Y,), square.rhs, (inverse,))
        chain = [
            Step(lhs, whole, [Use(-ONE, (), self.pair(Y, L), (star, inverse), (), False)], a),
            Step(whole, inner, [Use(ONE, (Y,), square, (inverse,), (L, star))], a),
            *(step.between((Y,), (inverse,)) for step in steps),
            Step(monomial(Y, x, inverse, c=c), rhs, [Use(c, (Y,), self.pair(x, inverse), (), (x, inverse))], a),
        ]
        self.add(Equation("lemma", f"{a.text(lhs)} = {a.text(rhs)}", lhs, rhs, steps=numbered(chain)), (star, inverse))
        if Y not in self.inverted:
            self._add_pairs(L)


def _scaled(p: Polynomial) -> tuple[tuple, Number]:
    """(a key for the polynomial up to a factor, that factor)."""
    lead = p[max(p, key=weight)]
    return tuple(sorted((w, ratio(c, lead)) for w, c in p.items())), lead


@lru_cache(maxsize=32)
def _known_inverses(setting: Setting) -> dict[tuple, list[tuple[Polynomial, Number]]]:
    """Candidates by the normal form of X, scaled."""
    rules, alphabet = rules_for(setting), theory().alphabet
    found: dict[tuple, list[tuple[Polynomial, Number]]] = {}
    for one, other in KNOWN_INVERSES:
        for x, z in ((parse(one), parse(other)), (parse(other), parse(one))):
            for p, q in ((x, z), (alphabet.star_of(x), alphabet.star_of(z))):
                key, scale = _scaled(normal_form(p, rules, alphabet))
                found.setdefault(key, []).append((q, scale))
    return found


def _unmarked(letter: str, mark: str) -> str:
    """A letter of a further model as the first has it; letters of other models stay apart."""
    name, done = split(letter)
    if not mark:
        return letter
    return name[: -len(mark)] + done if name.endswith(mark) else "?" + letter
