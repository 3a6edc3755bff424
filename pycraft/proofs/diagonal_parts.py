"""Diagonal parts of operators, blockdiag(X), and lower halves of symmetric operators, from the words inside them."""

from __future__ import annotations

from .axioms import theory
from .blocks import diagonal_part
from .equations import Equation, Step, Use, chain_holds, numbered
from .expand import Opaque
from .local_rules import LocalRules
from .words import ONE, Letter, Polynomial, Word, combine, monomial, ratio, split, times


class DiagonalParts:
    """Known facts on the diagonal parts and lower halves in a statement, added to its rules one after another."""

    def __init__(self, local: LocalRules):
        self.local, self.problem, self.alphabet = local, local.problem, local.alphabet
        self._swept: list[tuple[str, str, Polynomial, list[Step]]] = []

    def add(self, o: Opaque) -> None:
        """Add blockdiag(X), by the normal form of X."""
        assert self.local.block_rules is not None
        a = self.alphabet
        form, steps = self.local.block_rules.reduce(o.inner, a)
        chain = "serial chain" in self.local.setting.hypotheses
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
        self.local.add(equation, (name,))

    def _written(self, o: Opaque, form: Polynomial, steps: list[Step]) -> str:
        """Return the letter of blockdiag(the normal form), with the rule that blockdiag(X) equals it."""
        a, known = self.alphabet, self.alphabet.letters[o.name]
        name = f"{o.name}form"
        latex = f"\\operatorname{{blockdiag}}({a.latex(form)})"
        a.add(Letter(name, f"blockdiag({a.text(form)})", latex, known.symmetric, "diagonal", None, known.expression))
        text = f"{a.text(o.inner)} = {a.text(form)}"
        inside = Equation("structure", text, {(o.name,): ONE}, {(name,): ONE}, steps=numbered(list(steps)), uses=[o.definition])
        inside.check = lambda: chain_holds(steps, o.inner, form)
        self.local.add(inside, (o.name,))
        return name

    def _recursion(self, o: Opaque) -> bool:
        """Add Y = X + E Y E* for Y = blockdiag(A X A*), A = (I-E)⁻¹, X block diagonal, and Y = Z if Z obeys it. False for another Y."""
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
        form, steps = self.local.reduce(X)

        def says(Z: str, its_steps: list[Step]) -> Equation:
            equation = Equation("structure", f"{a.letters[o.name].text} = {a.letter_text(Z)}", {(o.name,): ONE}, {(Z,): ONE})
            equation.steps, equation.note = [*steps, *its_steps], "both obey Y = X + E Y E*, which has one solution"
            equation.check = lambda: chain_holds(steps, X, form) and (not its_steps or its_steps[-1].full()[1] == form)
            return equation

        for Z in (f"∂{x}{A[1:]}" for x in ("P", "R")):
            if Z in a.letters:
                rest, its_steps = self.local.reduce({(Z,): ONE, (E, Z, a.star(E)): -ONE})
                if rest == form:
                    self.local.add(says(Z, its_steps), (o.name,))
                    return True
        for Z, other, its_form, its_steps in self._swept:
            if other == A and its_form == form:
                self.local.add(says(Z, its_steps), (o.name,))
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
        form, steps = self.local.reduce(equation.difference)
        c = form.get(lead)
        if c is None:  # the letters are written by those of another tree
            return
        rest = {w: ratio(-x, c) for w, x in form.items() if w != lead}
        uses = [Use(ratio(1, c), (), equation, (), lead)] + [u.between((), (), ratio(-1, c)) for step in steps for u in step.uses]
        step = Step({lead: ONE}, rest, uses, a, f"{equation.text}, solved for {a.word_text(lead)}")
        self.local.add(Equation("lemma", f"{a.word_text(lead)} = {a.text(rest)}", {lead: ONE}, rest, steps=numbered([step])), lead)

    def add_half(self, o: Opaque) -> None:
        """T + T* = X for the lower half T of a symmetric X, half of the diagonal included."""
        a, T = self.alphabet, o.name
        form, steps = self.local.reduce(o.inner)
        if a.star_of(form) != form:
            return
        text = f"{a.letters[T].text} + ({a.letters[T].text})* = {a.text(form)}"
        whole = Equation("structure", text, {(T,): ONE, (a.star(T),): ONE}, form, steps=list(steps), uses=[o.definition])
        whole.note = "the halves of a symmetric operator are each other's transpose"
        whole.check = lambda: chain_holds(steps, o.inner, form) and a.star_of(form) == form
        self.local.add_untransposed(whole, (a.star(T),))
