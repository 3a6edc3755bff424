"""Inequalities proved: a difference written as a sum of congruences X*AX, with A positive definite or semidefinite by its definition.

M, P, R and D are positive definite, J, P⁺, Υ and Ω semidefinite, and so is the inverse of what is; X*AX is semidefinite, and definite where
X takes nothing but 0 to 0, as φ*, ψ*, H* and what has an inverse do; sums are, and diagonal blocks. `prove` calls this for >, ≥, <, ≤.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .. import _core
from ..identities.inequalities import SIGNS
from ..identities.parse import Statement
from ..identities.vocabulary import is_number
from .attempt import Attempt
from .derivation import DerivativeProblem
from .equations import Step, chain_holds
from .normal_form import Setting
from .presuppositions import Void
from .proof import Proof
from .reading import Assumption
from .walk import GaveUp
from .words import Alphabet, Polynomial, Word, combine, split

DEFINITE, SEMIDEFINITE, UNKNOWN = 2, 1, 0
_GRADES = {**dict.fromkeys(("M", "P", "R", "D"), DEFINITE), **dict.fromkeys(("J", "P⁺", "Υ", "Ω"), SEMIDEFINITE)}
_INJECTIVE = ("φ*", "ψ*", "φ", "ψ", "H*", "M", "P", "R", "D")
_SAYS = {DEFINITE: "> 0", SEMIDEFINITE: "≥ 0"}


class Grades:
    """What is known to be positive of the letters and words of one problem."""

    def __init__(self, problem: DerivativeProblem):
        self._problem, self.alphabet = problem, problem.alphabet
        self._regular = {name for _, name in problem.assumed if name}

    def of(self, p: Polynomial) -> int:
        """The grade of a sum: every term must have one."""
        grades = [self.of_word(word) if c > 0 else UNKNOWN for word, c in p.items()]
        return max(grades) if grades and min(grades) > UNKNOWN else SEMIDEFINITE if not p else UNKNOWN

    def of_word(self, word: Word) -> int:
        """The grade of X*AX."""
        middle, odd = divmod(len(word), 2)
        if self.alphabet.star_word(word[:middle]) != word[middle + odd :]:
            return UNKNOWN
        inner = self.of_letter(word[middle]) if odd else DEFINITE
        outer = word[middle + odd :]
        return inner if all(map(self._injective, outer)) else min(inner, SEMIDEFINITE)

    def of_letter(self, letter: str) -> int:
        name, mark = split(letter)
        if mark in ("⁻¹", "⁻*"):
            return DEFINITE if self._of_name(name, inverse=True) > UNKNOWN else UNKNOWN
        return self._of_name(name) if mark == "" else UNKNOWN

    def _of_name(self, name: str, inverse: bool = False) -> int:
        if name in self._regular:
            return DEFINITE
        opaque = next((o for o in self._problem.opaque if o.name == name), None)
        if opaque is None:
            return _GRADES.get(name, UNKNOWN)
        return self.of(opaque.inner) if opaque.kind == ("inverse" if inverse else "blockdiag") else UNKNOWN

    def _injective(self, letter: str) -> bool:
        name, mark = split(letter)
        roots = [o.name for o in self._problem.opaque if o.kind == "sqrt"]
        return letter in _INJECTIVE or mark in ("⁻¹", "⁻*") or name in roots or name in self._regular

    def reason(self, p: Polynomial) -> str:
        """Why a sum is positive, in words."""
        terms = [f"{self.alphabet.word_text(word)} {_SAYS[self.of_word(word)]}" for word in p]
        return "; ".join(terms) if terms else "the difference is 0"


class InequalityProof(Proof):
    """A proof that the difference of two sides is positive: steps to a sum of congruences, and why each of these is."""

    def __init__(
        self, read: Statement, alphabet: Alphabet, difference: Polynomial, steps: Sequence[Step], form: Polynomial, grades: Grades | None
    ):
        statement, latex = (f"{getattr(read.lhs, how)()} {sign} {getattr(read.rhs, how)()}" for how, sign in _shown(read.relation))
        super().__init__(statement, latex, alphabet, steps, (form, {}))
        self._read, self._grades, self._difference = read, grades, difference
        self._wanted = DEFINITE if SIGNS[read.relation] == ">" else SEMIDEFINITE
        self._found = self.recheck()
        self.note = f"every term is a congruence X*AX: {grades.reason(form)}" if self._found and grades is not None else ""

    def recheck(self) -> bool:
        """Whether every step follows from the equations that it names, and every term that they lead to is positive."""
        if self._grades is None or self._grades.of(self._forms[0]) < self._wanted:
            return False
        return chain_holds(self.steps, self._difference, self._forms[0]) and all(e.holds() for e in self.rests_on)

    def _reason(self) -> str:
        why = "it is not a sum of congruences of positive operators; pycraft.check decides it numerically"
        return f"\n  the difference of both sides: {self.normal_forms[0]}\n  {why}"


def _shown(relation: str) -> tuple[tuple[str, str], tuple[str, str]]:
    return ("text", relation), ("latex", {"≥": "\\ge", "≤": "\\le"}.get(relation, relation))


def prove_inequality(read: Statement, model: Any, assumed: Sequence[Assumption] = ()) -> Proof:
    """A proof of an inequality, see `prove`; false where none was found. EvaluationError of numbers that are no traces."""
    larger, smaller = (read.lhs, read.rhs) if read.relation in (">", "≥") else (read.rhs, read.lhs)
    if isinstance(larger, _core.Scalar) or isinstance(smaller, _core.Scalar):
        larger, smaller = _operands(larger, smaller, read)
    problem = DerivativeProblem()
    sides = [problem.words(side) for side in (larger, smaller)]
    problem.numbers = larger.shape == (1, 1)
    problem.sides = sides
    for a in assumed:
        if a.regular:
            ((letter,),) = problem.words(a.lhs.inv())
            problem.assumed.append((_regular(a, letter, problem), split(letter)[0]))
    difference = combine((1, sides[0]), (-1, sides[1]))
    grades = Grades(problem)
    given = [h for h in ("J = 0", "serial chain", "single-DOF hinges", "constant H") if h in {a.text for a in assumed}]
    nearest = InequalityProof(read, problem.alphabet, difference, [], difference, grades)
    if nearest:
        return nearest
    for hypotheses in ([], ["J = 0"], given):
        try:
            attempt = Attempt(problem, Setting(frozenset(hypotheses), composite=True, compliance=True))
            form, steps = attempt.reduce(difference)
        except (GaveUp, Void):
            continue
        found = InequalityProof(read, problem.alphabet, difference, steps, form, grades)
        if found:
            found.verify_where_possible(None if model is None else getattr(model, "soa", model))
            return found
    return nearest


def _regular(a: Assumption, letter: str, problem: DerivativeProblem) -> Any:
    from .equations import Equation

    name = split(letter)[0]
    return Equation("hypothesis", a.text, {(problem.alphabet.star(name),): 1}, {(name,): 1}, hypothesis=a.text)


def _operands(larger: Any, smaller: Any, read: Statement) -> tuple[Any, Any]:
    """Of traces what they are of: tr A ≥ tr B where A ≥ B."""
    inner = []
    for side in (larger, smaller):
        zero = (
            is_number(side) and side == 0 or isinstance(side, _core.Scalar) and side.operand is None and not side.terms and side.number == 0
        )
        if not zero and (not isinstance(side, _core.Scalar) or side.kind != "trace"):
            raise _core.EvaluationError(f"{read.text!r}: proved are inequalities of operators and of traces; pycraft.check decides others")
        inner.append(None if zero else side.operand)
    known = next(x for x in inner if x is not None)
    larger, smaller = (_core.zero(known.domain, known.codomain) if x is None else x for x in inner)
    return larger, smaller
