"""The rules of one setting and of one statement: its assumptions, the definitions of its letters, and its hypotheses."""

from __future__ import annotations

from .. import _core
from .axioms import theory
from .equations import Equation, Step, Use, numbered
from .expand import Problem
from .normal_form import Rules, Setting, normal_form, rule_from, rules_for, weight
from .of_loops import of_embedded, of_rows
from .presuppositions import ALWAYS, is_positive_constant, is_regular_constant
from .relations import at_the_roots, compliance_facts, crosses_with_axes, in_world, of_a_cut
from .words import ONE, SAME_EDGES, Alphabet, Polynomial, Word, inverse_of, inverted, plain, ratio, split, underived

UNIT: Polynomial = {(): ONE}
"""I."""


class LocalRules:
    """The rules of one setting, and the rules of the letters that a statement adds.

    Attributes
    ----------
    rules : for normal forms; `block_rules` for operands of blockdiag, which need the recursions of R and Υ
    equations : the added equations
    regular : letters that have an inverse
    definite : letters that are symmetric and positive definite
    needs : for letters whose inverse depends on other inverses, the letters of these
    inverted : inverses in the statement
    locked : (mark, the mark of its model) of trees with locked hinges or embedded loops
    """

    def __init__(self, problem: Problem, setting: Setting, extra: list[tuple[Equation, Word]]):
        self.problem, self.setting = problem, setting
        self.alphabet: Alphabet = problem.alphabet
        self.equations: list[Equation] = []
        self.locked = tuple((mark, base) for mark, how, base in problem.relations if how in SAME_EDGES)
        self.rules: Rules = rules_for(setting, problem.marks, self.locked).copy()
        blocks = Setting(setting.hypotheses, composite=True, compliance=True)
        diagonal_parts = any(o.kind == "blockdiag" for o in problem.opaque)
        self.block_rules = rules_for(blocks, problem.marks, self.locked).copy() if diagonal_parts else None
        self._rank = 0
        named = sorted({split(x)[0] for p in problem.polynomials() for w in p for x in w if inverted(x)})
        self.inverted = {inverse_of(n) for n in named}
        letters = self.alphabet.letters.items()
        constants = {n: x.expression for n, x in letters if x.expression is not None and x.text not in problem.unknown}
        self.regular = {n for n in named if plain(n) in ALWAYS or is_regular_constant(constants.get(n))}
        self.definite = {n for n, e in constants.items() if is_positive_constant(e)}
        self.needs: dict[str, set[str]] = {}
        for equation, word in extra:
            self.add(equation, word)
        self._add_recursions()
        for equation, name in problem.assumed:
            self._assume(equation, name)
        self._world_axes()
        self._add_constants(constants)
        for name in named:
            if name not in theory().alphabet.letters:
                self.add_pairs(name)
        made_of_another = (*of_rows(problem), *of_embedded(problem), *of_a_cut(problem))
        for equation, word in (*made_of_another, *compliance_facts(problem, setting.hypotheses), *crosses_with_axes(problem)):
            self.add(equation, word)

    # ------------------------------------------------------------------ what is asked
    def reduce(self, p: Polynomial) -> tuple[Polynomial, list[Step]]:
        """Return the normal form and the steps to it."""
        return self.rules.reduce(p, self.alphabet)

    def pair(self, a: str, b: str) -> Equation:
        """a b = I for a letter and its inverse."""
        word = (a, b)
        for equation in self.equations:
            for e in (equation, equation.transposed(self.alphabet)) if equation.kind == "inverse" else ():
                if word in e.lhs:
                    return e
        return Equation("inverse", f"{self.alphabet.word_text(word)} = I", {word: ONE}, UNIT)

    def base(self, mark: str) -> str:
        """Return the mark of the model of a tree with locked hinges; the mark itself for other models."""
        return dict(self.locked).get(mark, mark)

    # ------------------------------------------------------------------ what is added
    def add(self, equation: Equation, word: Word, blocks: bool = True) -> None:
        """Add a rule and its transpose before all others."""
        self.equations.append(equation)
        self._rank -= 1
        for rules in self._every_rules() if blocks else (self.rules,):
            rules.add_equation(equation, word, self.alphabet, self._rank)

    def add_untransposed(self, equation: Equation, word: Word) -> None:
        """Add a rule that equals its transpose before all others."""
        self.equations.append(equation)
        self._rank -= 1
        for rules in self._every_rules():
            rules.add(rule_from(equation, word, self._rank))

    def _every_rules(self) -> list[Rules]:
        return [self.rules] if self.block_rules is None else [self.rules, self.block_rules]

    def add_pairs(self, name: str) -> None:
        """Add X X⁻¹ = I and X⁻¹ X = I of a letter."""
        for pair in ((name, inverse_of(name)), (inverse_of(name), name)):
            self.add(self.pair(*pair), pair)

    def _add_recursions(self) -> None:
        """Add equations between derivatives of one recursion, for operands of blockdiag."""
        letters = {underived(plain(x)) for p in self.problem.polynomials() for w in p for x in w}
        if self.block_rules is None or "Υ" not in letters:
            return
        for equation, word in self.problem.recursion_rules():
            self._rank -= 1
            self.block_rules.add_equation(equation, word, self.alphabet, self._rank)

    def _add_constants(self, constants: dict[str, object]) -> None:
        """Add rules from the values of a user's constants: constants that are zero except at bodies on the base."""
        source = self.problem.contexts[0][0] if self.problem.contexts else None
        for name, e in constants.items():
            for equation, word in at_the_roots(name, e, source) if isinstance(e, _core.Operator) and e.kind == "constant" else ():
                self.add(equation, word)

    def _assume(self, equation: Equation, name: str) -> None:
        """Add a user's hypothesis as a rule; X > 0 implies X* = X, and that X has an inverse."""
        if name:
            self.regular.add(name)
            self.definite.add(name)
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
        self.equations.append(solved)
        self._rank -= 1
        for rules in self._every_rules():
            rules.add(rule_from(solved, lead, self._rank))
            star = self.alphabet.star_word(lead)
            if star not in solved.difference:
                rules.add(rule_from(solved.transposed(self.alphabet), star, self._rank))

    def _world_axes(self) -> None:
        """Add rules for letters in world axes, in letters of their model."""
        found = {
            x.replace("*", "") if not inverted(x) else inverse_of(split(x)[0]) for p in self.problem.polynomials() for w in p for x in w
        }
        for mark, how, base in self.problem.relations:
            for letter in sorted(found) if how == "world frame" else ():
                equation = in_world(letter, mark, base)
                if equation is not None:
                    self.add(equation, (letter,))
