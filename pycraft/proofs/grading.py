"""The judge of answers: it accepts only proofs, and for other answers reports the error and its reason."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .. import _core
from ..identities.budget import Budget
from ..identities.checker import check
from ..identities.formula_reading import read_formula
from ..identities.parse import Statement
from ..identities.vocabulary import ParseError, SpacesError, is_number
from .attempt import Attempt
from .derivation import DerivativeProblem
from .equations import Step
from .exercise_steps import candidates, single_equation, used
from .gaps import WithGaps
from .models_tried import examples
from .proof import Proof
from .prove import _settings, prove
from .repair import nearest, small_models
from .values import LARGEST, NoValue, transferred
from .walk import GaveUp
from .words import ONE, Alphabet, Polynomial, Word, combine, number, ratio, split

LIKELY = 1.5
"""Largest cost of a slip that is reported for a line that does not fit: a star, a tilde, a sign, the order, or a similar letter."""
SLIPS = 2.0
"""CPU seconds for the search of a slip in a line that does not fit."""
ACCEPTED = ("right", "another road")
_SAYS = {
    "J = 0": "a hinge-diagonal term J is missing",
    "serial chain": "on a branched tree, blocks between siblings are missing",
    "single-DOF hinges": "HΔ = 0 holds for hinges with one coordinate",
    "constant H": "H is constant for hinges of one subhinge, not of several",
}
# Letters that are often confused.
_CONFUSED = [("φ", "ψ"), ("φ̃", "ψ̃"), ("E_φ", "E_ψ"), ("φ", "φ̃"), ("ψ", "ψ̃"), ("M", "P", "R", "P⁺"), ("G", "K"), ("τ", "τ̄"), ("Ω", "Υ")]


@dataclass
class Judgement:
    """Judgement of an answer: true as a condition if it was accepted.

    Attributes
    ----------
    verdict : "right"; "another road", true and proved, but not by one equation from line to line; "no step", an existing line repeated;
        "unproved", neither proved nor refuted; "wrong"; "unreadable"
    text : the reasons, in sentences
    residual : relative error on `model`; None if not evaluated
    missed : hypotheses and equations that the answer assumes
    proof : proof that it equals the line before, possibly under more hypotheses; None if none was found
    """

    verdict: str
    text: str
    residual: float | None = None
    model: Any = None
    missed: list[str] = field(default_factory=list)
    proof: Proof | None = None

    def __bool__(self) -> bool:
        return self.verdict in ACCEPTED

    def __repr__(self) -> str:
        return f"{self.verdict}: {self.text}" if self.text else self.verdict

    __str__ = __repr__


class Exercise(WithGaps):
    """A derivation with gaps, which judges answers; see `exercise`.

    Attributes
    ----------
    proof : the whole proof
    steps : the displayed derivation: the proof, with lemmas expanded if it has too few lines to leave one out
    blanks : the numbers of the lines left out
    blank : the gap to which `answer`, `hint` and `solution` apply: the first, see `gap`
    """

    def answer(self, line: Any) -> Any:
        """Judge a line: an expression, or text in Unicode, ASCII or LaTeX; for several gaps {number: line}, returning {number: Judgement}.

        It is right if it is the line left out, or proved equal to the lines before and after, each by a single equation. Cost:
        milliseconds; if it is not accepted, a tenth of a second for the reasons.
        """
        if isinstance(line, Mapping):
            return {blank: self.gap(blank).answer(given) for blank, given in line.items()}
        try:
            expression = self._expression(line)
        except (_core.Error, NoValue) as error:
            slip = self._written_wrong(line) if isinstance(error, SpacesError) else ""
            return Judgement("wrong", f"spaces do not fit: {slip}") if slip else Judgement("unreadable", str(error))
        if (misfit := self._misfit(expression)) is not None:
            return Judgement("wrong", misfit)
        problem = self._problem()
        try:
            given = problem.expand(expression).before
        except GaveUp:
            return Judgement("unreadable", "the line has too many words")
        problem.sides = [*problem.sides, given]
        lines = self._polynomials()
        copied = expression.text() == self.lines[self.blank - 1]
        typed = expression.text() == self.steps[self.blank - 1].after_text()
        if (given == lines[self.blank] or typed) and not copied:
            return Judgement("right", _by(self.steps[self.blank - 1]), proof=prove(self._read.lhs, expression, self._model))
        on_page = next((i for i, p in enumerate(lines) if p == given and i not in self.blanks), None)
        if on_page is not None:
            return Judgement("no step", f"this is {'the left side' if on_page == 0 else f'line {on_page}'} written again")
        allowed = frozenset(self.proof.hypotheses)
        found = self._proved(expression, allowed)
        if found and (void := found.void_where(sorted(allowed), self._operators())):
            return Judgement("wrong", void)
        if found and allowed >= {*found.hypotheses}:
            return self._accepted(problem, lines, given, found)
        return self._refused(problem, expression, given, found, allowed)

    def _expression(self, line: Any) -> Any:
        """Return the answer as an expression between the spaces of the theorem."""
        lhs = self._read.lhs
        if isinstance(line, str):
            text = line.strip().removeprefix("=").strip()
            read = self._read_text.read(text)
            if read.rhs is not None:
                raise _core.EvaluationError(f"{text!r} is a statement; give one expression, equal to the line before")
            line = read.lhs
        if is_number(line) and line == 0:
            return _core.zero(lhs.domain, lhs.codomain)
        if not isinstance(line, _core.Operator):
            raise _core.EvaluationError(f"a line must be an operator, not {line!r}")
        if not {id(s) for s in line.sources} <= {id(s) for s in lhs.sources}:
            line = transferred(line, self._operators())
        return line @ _core.identity(lhs.domain) if line.domain is None and lhs.domain == lhs.codomain else line

    def _written_wrong(self, line: str) -> str:
        """Return in words the slip that explains a line whose spaces do not fit the theorem; empty if there is none."""
        try:
            formula = read_formula(f"{line.strip().removeprefix('=')} = {self.lines[0]}")
        except ParseError:
            return ""
        near, *_ = nearest(formula, small_models(), Budget(SLIPS))
        return next((slip.words for new, slip in near if new[1] == formula[1] and slip.cost <= LIKELY), "")

    def _misfit(self, line: Any) -> str | None:
        """Return the message for a line between other spaces than the theorem's."""
        lhs = self._read.lhs
        if (line.domain, line.codomain) == (lhs.domain, lhs.codomain):
            return None
        spaces = [f"{e.domain.name} → {e.codomain.name}" if e.domain is not None else "any space to itself" for e in (lhs, line)]
        return f"the lines of this derivation map {spaces[0]}, and {line.text()} maps {spaces[1]}"

    def _proved(self, expression: Any, allowed: frozenset[str]) -> Proof | None:
        """Return a proof that the line equals a side of the theorem, under the theorem's hypotheses or else under more."""
        proofs = []
        for side in (self._read.lhs, self._read.rhs):
            proof = prove(side, expression, self._model)
            if proof and allowed >= {*proof.hypotheses}:
                return proof
            proofs += [proof] if proof else []
        return proofs[0] if proofs else None

    def _accepted(self, problem: DerivativeProblem, lines: Sequence[Polynomial], given: Polynomial, proof: Proof) -> Judgement:
        """Return "right" if one equation leads to the line and one leads on, else "another road"."""
        may = list(candidates(problem, frozenset(self.proof.hypotheses), self.steps))
        to = single_equation(lines[self.blank - 1], given, may, problem.alphabet)
        onward = None if self._last else single_equation(given, lines[self.blank + 1], may, problem.alphabet)
        more = [x for x in proof.presupposes if x not in self.proof.presupposes]
        presupposes = f"; it presupposes {', '.join(more)}" if more else ""
        if to is not None and (onward is not None or self._last):
            then = "" if onward is None else f"; on to the next by {onward}"
            return Judgement(
                "right", f"by {to}{then}{presupposes}; the derivation has {self.steps[self.blank - 1].after_text()} here", proof=proof
            )
        text = f"proved equal to the line before{f', by {to}' if to else f', in {len(proof.steps)} steps'}"
        text += "; no single equation leads on to the next line" if to and not self._last else ""
        return Judgement("another road", text + presupposes, proof=proof)

    # ------------------------------------------------------------------ what is not accepted
    def _refused(
        self, problem: DerivativeProblem, expression: Any, given: Polynomial, found: Proof | None, allowed: frozenset[str]
    ) -> Judgement:
        """Return "wrong" with the reason if values refute the line, else "unproved"."""
        if void := self._void(problem, expression, allowed):
            return Judgement("wrong", void)
        residual, model = self._off(expression, allowed)
        if residual is None:
            proved = "no proof was found" if found is None else f"a proof was found only where {' and '.join(found.hypotheses)}"
            text = f"{proved}, and no value refutes it: it is not accepted"
            return Judgement("unproved", text, model=model, proof=found)
        text = f"off by {residual:.1e}, relative, on {_described(model)}"
        missed: list[str] = []
        if found is not None:
            missed = [h for h in found.hypotheses if h not in allowed]
            text += f"; true only where {' and '.join(missed)}"
            wider = list(candidates(problem, frozenset(found.hypotheses), self.steps))
            step = single_equation(self._polynomials()[self.blank - 1], given, wider, problem.alphabet)
            for hypothesis in list(missed):
                said = used(found, hypothesis)
                told = sorted(said, key=lambda text: (text != step, text != "H G = I", len(text)))[:1]
                text += f", {_SAYS[hypothesis]}" + "".join(f": {short} there, {said[short]} in general" for short in told)
                missed += told
        else:
            slip = self._slip(problem, given, allowed)
            text += f"; {slip}" if slip else f"; the line comes {_by(self.steps[self.blank - 1])}"
            missed = [] if slip else [e.text for e in self.steps[self.blank - 1].equations]
        return Judgement("wrong", text, residual, model, missed, found)

    def _void(self, problem: DerivativeProblem, expression: Any, allowed: frozenset[str]) -> str:
        """Return why an inverse or a root in the line exists nowhere under the theorem's hypotheses; empty if none is known to fail."""
        claim = Proof.of_statement(Statement(expression, expression, "", "expressions"), problem, [], [], ({}, {}))
        claim.takes_for_granted([o.name for o in problem.opaque if o.kind == "inverse"])
        return claim.void_where(sorted(allowed), self._operators())

    def _off(self, expression: Any, allowed: frozenset[str]) -> tuple[float | None, Any]:
        """Return (residual, model) of a refutation under the theorem's hypotheses; (None, the last model) if there is none."""
        candidates = [self._operators()] if self._model is not None else []
        candidates = [c for c in candidates if len(c.F) <= LARGEST and all(c._source.traits.get(h, True) for h in allowed)]
        at: Any = None
        for operators in (*candidates, *(model.soa for model in examples(sorted(allowed)))):
            try:
                sides = transferred(self._read.lhs, operators), transferred(expression, operators)
                at, report = operators, check(sides, operators, states=3, search=False)
            except (_core.Error, NoValue, ArithmeticError):
                continue
            if not report:
                return report.worst, operators
        return None, at

    def _slip(self, problem: DerivativeProblem, given: Polynomial, allowed: frozenset[str]) -> str:
        """Return the change of one sign, coefficient, star or letter that would make the line true."""
        settings = [(s, extra) for s, extra in _settings(problem) if s.hypotheses <= allowed]
        a = problem.alphabet
        try:
            attempt = Attempt(problem, *max(settings, key=lambda pair: len(pair[0].hypotheses)))
            form = {w: attempt.reduce({w: ONE})[0] for w in given}
            off = attempt.reduce(combine((1, problem.sides[0]), (-1, given)))[0]
            line = self._polynomials()[self.blank]
            suspects = sorted(
                given.items(), key=lambda term: line.get(term[0]) == term[1]
            )  # first the terms that differ from the missing line
            for word, c in suspects:
                if off == combine((-2 * c, form[word])):
                    return f"the sign of {a.word_text(word)}"
            changes = [(w, c, other, said) for w, c in suspects for other, said in _changed(w, a)]
            for word, c, other, said in changes:
                if other in line and off == combine((c, attempt.reduce({other: ONE})[0]), (-c, form[word])):
                    return f"in {a.word_text(word)} {said}"
            for word, c in line.items():
                if word not in given and off == combine((c, attempt.reduce({word: ONE})[0])):
                    return "one term is missing"
            for word, c in suspects:
                shared = {ratio(x, form[word][w]) for w, x in off.items() if w in form[word]}
                if len(shared) == 1 and off == combine((k := shared.pop(), form[word])):
                    wanted = number(c + k) if c + k >= 0 else f"−{number(-c - k)}"
                    return (
                        f"the coefficient of {a.word_text(word)} should be {wanted}"
                        if c + k
                        else f"{a.word_text(word)} should not be there"
                    )
            for word, c, other, said in changes:
                if off == combine((c, attempt.reduce({other: ONE})[0]), (-c, form[word])):
                    return f"in {a.word_text(word)} {said}"
        except GaveUp:
            return ""
        return ""


def _described(operators: Any) -> str:
    source = operators._source
    shape = "a chain" if source.traits.get("serial chain") else "branched"
    size = f"{operators.Theta.dimension} coordinate{'s' * (operators.Theta.dimension != 1)}"
    return f"{source.name!r} ({shape}, {size}{'' if source.traits.get('J = 0', True) else ', J ≠ 0'})"


def _by(step: Step) -> str:
    return f"by {step.reason}" if step.uses else step.reason


def _changed(word: Word, alphabet: Alphabet) -> Iterator[tuple[Word, str]]:
    """Yield words with one letter transposed, inverted or replaced, and the message."""
    for i, letter in enumerate(word):
        name, mark = split(letter)
        others = [alphabet.star(letter)] + ([name + {"": "⁻¹", "⁻¹": ""}[mark]] if name == "D" and mark in ("", "⁻¹") else [])
        others += [other + mark for group in _CONFUSED if name in group for other in group if other != name]
        for other in others:
            other = alphabet.star(alphabet.star(other))  # P* is P
            if other != letter:
                yield (*word[:i], other, *word[i + 1 :]), f"{alphabet.letter_text(letter)} should be {alphabet.letter_text(other)}"
