"""Exercises: a derivation with one line left out, and a judge of what is filled in, who accepts proofs and nothing else.

An answer is accepted if it is proved equal to the line before, from the axioms and under no other hypotheses than the theorem's. Numbers
only ever refute: they say by how much a false line is off, and that a hypothesis which would save it is not idle.
"""

from __future__ import annotations

import difflib
import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any

from .. import _core
from ..identities.checker import check
from ..identities.parse import Statement, Statements
from ..identities.vocabulary import is_number
from .attempt import Attempt
from .axioms import AXIOMS, DEFINITIONS, INVERSES, find, replaced_everywhere, solved, theory
from .derivation import DerivativeProblem
from .equations import Equation, Step, chain_holds, foundations, opened
from .proof import Proof, example, examples
from .prove import _operators, _settings, prove
from .rules import corollary
from .shown import escaped, reason_latex
from .values import LARGEST, NoValue, transferred
from .walk import GaveUp
from .words import ONE, Alphabet, Polynomial, Word, combine, number, of_model, plain, ratio, split

ACCEPTED = ("right", "another road")
_SAYS = {
    "J = 0": "a hinge-diagonal term J is lost",
    "serial chain": "on a branched tree blocks between siblings are lost",
    "single-DOF hinges": "HΔ = 0 is said of hinges with one coordinate",
    "constant H": "H is constant for hinges of one subhinge, not of several",
}
# Letters that are taken for each other.
_CONFUSED = [("φ", "ψ"), ("φ̃", "ψ̃"), ("E_φ", "E_ψ"), ("φ", "φ̃"), ("ψ", "ψ̃"), ("M", "P", "R", "P⁺"), ("G", "K"), ("τ", "τ̄"), ("Ω", "Υ")]


@dataclass
class Judgement:
    """What was said of an answer: true as a condition if it was accepted.

    Attributes
    ----------
    verdict : "right"; "another road", true and proved, but not by one equation from line to line; "no step", a line that is there already;
        "unproved", neither proved nor refuted; "wrong"; "unreadable"
    text : why, in sentences
    residual : by how much it is off, relative, on `model`; None where nothing was evaluated
    missed : hypotheses and equations that the answer took for granted
    proof : that it equals the line before, also if only under more hypotheses; None if none was found
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


def exercise(theorem: Any, model: Any = None, blank: int | Sequence[int] | None = None, seed: int = 0) -> Exercise:
    """A proof with one line left out, or several, to be filled in.

    Parameters
    ----------
    theorem : a name of the catalogue (`soa.theorems()`), a statement as text, or a pair (lhs, rhs) of expressions
    model : Multibody or OperatorSet on which text is read and numbers are taken; a small random tree if left out
    blank : the number of the line to leave out, from 1, or several; without it, one is drawn
    seed : of that draw

    Returns
    -------
    Exercise
        It prints the derivation with the gaps; `.answer(line)`, `.hint(level)`, `.solution()`; of several gaps `.answer({2: ..., 4: ...})`
        judges each, and `.gap(4)` is the exercise at one of them.

    Raises
    ------
    EvaluationError
        There is no proof of it, no such theorem, no such line.
    ParseError
        Text that is no statement.

    Examples
    --------
    >>> from pycraft.symbolic import exercise
    >>> task = exercise("HψMψ*H* == D", blank=2)
    >>> print(task)
    H ψ M ψ* H* = D, where J = 0
          H ψ M ψ* H*
       1. = H ψ P H* + H P ψ* H* − H P H*   [ψ M ψ* = ψ P + P ψ* − P]
       2. = ?
       3. = H ψ G D + D G* ψ* H* − D        [G D = P H*, at 2 places]
       4. = H G D + D G* H* − D             [ψ G = G, at 2 places]
       5. = D                               [H G = I, at 2 places]
    >>> bool(task.answer("HψPH* + HPψ*H* - D"))
    True
    """
    if isinstance(theorem, str):
        read, name = _read_theorem(theorem, model)
    else:
        if not isinstance(theorem, Sequence) or len(theorem) != 2:
            what = "a theorem's name, a statement as text or a pair (lhs, rhs)"
            raise _core.EvaluationError(f"an exercise is made of {what}, not of {theorem!r}")
        lhs, rhs = theorem
        read, name = Statement(lhs, rhs, "", "expressions"), ""
    proof = prove(read.lhs, read.rhs, model)
    if not isinstance(read.lhs, _core.Operator):
        raise _core.EvaluationError(f"there is no proof to leave a line out of: {name or proof.statement} is said of numbers")
    if not proof:
        said = f"{name}: {proof.statement}" if name else proof.statement
        raise _core.EvaluationError(f"there is no proof to leave a line out of: {said}\n  {str(proof).partition(chr(10))[2].strip()}")
    return Exercise(proof, model, blank, seed)


def _read_theorem(text: str, model: Any) -> tuple[Any, str]:
    """(the statement, its name in the catalogue)."""
    operators = _operators(model if model is not None else example())
    theorems = {t.name: t for t in operators.theorems()}
    found = theorems.get(text) or next((t for t in theorems.values() if t.name.lower() == text.lower()), None)
    if found is not None:
        reason = "waits for what is not there yet" if found.waiting else "it is said of blocks on one path" if found.on_one_path else ""
        reason = reason or ("it is a bound" if found.at_most else "")
        if reason:
            raise _core.EvaluationError(f"there is no proof of {found.name!r} to leave a line out of: {reason}")
        return Statement(found.lhs, found.rhs, "", "expressions"), found.name
    if "=" not in text:
        near = difflib.get_close_matches(text, theorems, 3, 0.4)
        hint = f"; near it: {', '.join(map(repr, near))}" if near else "; soa.theorems() lists them"
        raise _core.EvaluationError(f"no theorem is called {text!r}, and it is no statement lhs == rhs{hint}")
    return Statements(operators).read(text), ""


class Exercise:
    """A derivation with a gap or several, see `exercise`.

    Attributes
    ----------
    proof : the whole proof
    steps : the derivation shown: the proof's, with lemmas opened where it has too few lines to leave one out
    blanks : the numbers of the lines left out
    blank : the one that `answer`, `hint` and `solution` are about: the first, see `gap`
    """

    def __init__(self, proof: Proof, model: Any = None, blank: int | Sequence[int] | None = None, seed: int = 0):
        self.proof, self._model, self._read = proof, model, proof._read
        self.steps = list(proof.steps)
        gaps = self._gaps()
        if blank is None and not gaps:
            longer = [step for s in proof.steps for step in opened(s)]
            if chain_holds(longer, *self._ends(proof.steps)):
                self.steps = longer
            gaps = self.gaps()
        if blank is None:
            blank = random.Random(seed).choice(gaps)
        self._leave_out(_lines_of(blank))
        self._read_text = Statements(self._operators(), self._abbreviations())

    def _leave_out(self, blanks: set[int]) -> None:
        if not blanks:
            raise _core.EvaluationError("an exercise leaves out one line or more: blank=[] names none")
        for line in blanks:
            if not 1 <= line <= len(self.steps):
                raise _core.EvaluationError(f"there is no line {line} to leave out: the derivation has lines 1 to {len(self.steps)}")
        self.blanks: tuple[int, ...] = tuple(sorted(blanks))
        self.blank = self.blanks[0]

    def leaving_out(self, *blanks: int) -> Exercise:
        """The same derivation with other lines left out, by their numbers as it is shown here; see `gaps`."""
        other = copy(self)
        other._leave_out(set(blanks))
        return other

    def gap(self, blank: int) -> Exercise:
        """The exercise at one of its gaps; the others stay open."""
        if blank not in self.blanks:
            raise _core.EvaluationError(f"line {blank} is no gap of this exercise; its gaps are {', '.join(map(str, self.blanks))}")
        other = copy(self)
        other.blank = blank
        return other

    # ------------------------------------------------------------------ lines
    @staticmethod
    def _ends(steps: Sequence[Step]) -> tuple[Polynomial, Polynomial]:
        return steps[0].full()[0], steps[-1].full()[1]

    def _polynomials(self) -> list[Polynomial]:
        """Of every line, as one who types it has it: operands of inverses written out."""
        lines = [self.steps[0].full()[0], *(s.full()[1] for s in self.steps)]
        for o in self._problem().opaque:
            for equation in (o.definition, o.definition.transposed(self.proof._alphabet)) if o.kind == "inverse" else ():
                (word,) = equation.lhs
                replaced = [replaced_everywhere(p, *solved(equation, word), self.proof._alphabet) for p in lines]
                lines = [p if step is None else step.after for p, step in zip(lines, replaced, strict=True)]
        return lines

    def gaps(self) -> list[int]:
        """Lines that can be left out: those that say something other than the line before and the line after; else any."""
        return self._gaps() or list(range(1, len(self.steps))) or [len(self.steps)]

    def _gaps(self) -> list[int]:
        lines = self._polynomials()
        texts = [self.steps[0].before_text(), *(s.after_text() for s in self.steps)]
        said = [(lines[i - 1], lines[i + 1]) for i in range(1, len(lines) - 1)]
        return [i for i, beside in enumerate(said, 1) if lines[i] not in beside and texts[i] not in (texts[i - 1], texts[i + 1])]

    @property
    def lines(self) -> list[str]:
        """The derivation line by line, from the left side; "?" for a gap."""
        texts = [self.steps[0].before_text(), *(s.after_text() for s in self.steps)]
        return ["?" if i in self.blanks else text for i, text in enumerate(texts)]

    @property
    def _last(self) -> bool:
        return self.blank == len(self.steps)

    @property
    def _end_is_open(self) -> bool:
        return self.blanks[-1] == len(self.steps)

    @property
    def statement(self) -> str:
        """The theorem; its right side is a question where that is the line left out."""
        return f"{self.lines[0]} = ?" if self._end_is_open else self.proof.statement

    def _operators(self) -> Any:
        """Those that answers are read on."""
        if self._model is not None:
            return _operators(self._model)
        from ..operators import OperatorSet

        for source, _ in self.proof._contexts[:1]:
            model = getattr(source, "model", None)
            return OperatorSet(source, model if hasattr(model, "random_state") else None)
        return example().soa

    def _abbreviations(self) -> dict[str, Any]:
        """Vectors and constants by their names, and X₁, ... as the derivation shows them."""
        problem, letters = self._problem(), self.proof._alphabet.letters.values()
        named = {x.text: x.expression for x in letters if getattr(x.expression, "kind", "") in ("vector", "constant")}
        found: dict[str, Any] = {text: e for text, e in named.items() if text.isidentifier()}
        for o in problem.opaque:
            text = self.proof._alphabet.letters[o.name].text
            if o.kind == "inverse" and text.startswith("X"):
                found[text] = o.expression
        return found

    def _problem(self) -> DerivativeProblem:
        """The statement's letters, made anew as the proof made them."""
        problem = DerivativeProblem()
        problem.sides = [problem.expand(side).before for side in (self._read.lhs, self._read.rhs)]
        return problem

    # ------------------------------------------------------------------ how it is shown
    def __str__(self) -> str:
        where = f", where {' and '.join(self.proof.hypotheses)}" if self.proof.hypotheses else ""
        lines = self.lines
        width = max(len(line) for line in lines if len(line) <= 76) + 2 if any(len(line) <= 76 for line in lines) else 20
        rows = [self.statement + where, f"      {lines[0]}"]
        for i, (line, step) in enumerate(zip(lines[1:], self.steps, strict=True), 1):
            shown = f"  {i:>2}. = {line}"
            reason = "" if i in self.blanks else f"[{step.reason}]"
            far = len(line) + 2 > width
            rows.append(f"{shown}\n{'':>{width + 9}}{reason}" if far and reason else f"{shown:<{width + 9}}{reason}".rstrip())
        return "\n".join(rows)

    __repr__ = __str__

    def latex(self) -> str:
        """The derivation as an aligned display, a box for the gap."""
        rows = [f"& {self.steps[0].before_latex()}"]
        for i, step in enumerate(self.steps, 1):
            gap = i in self.blanks
            rows.append(f"={{}}& {GAP if gap else step.after_latex()} && \\text{{{i}.}}\\;{'' if gap else reason_latex(step)}")
        return "\\begin{aligned}" + "\\\\\n".join(rows) + "\\end{aligned}"

    def _repr_latex_(self) -> str:
        where = f"\\quad\\text{{where {escaped(' and '.join(self.proof.hypotheses))}}}" if self.proof.hypotheses else ""
        claim = f"{self.steps[0].before_latex()} = {GAP}" if self._end_is_open else self.proof._latex
        return f"$$\\begin{{gathered}}{claim}{where}\\\\ {self.latex()}\\end{{gathered}}$$"

    # ------------------------------------------------------------------ help
    def hint(self, level: int = 1) -> str:
        """1: the equation that leads to the line; 2: where it is used; 3: the line's beginning; beyond that, the line."""
        if not isinstance(level, int):
            raise _core.EvaluationError(f"hints have the levels 1, 2, 3 and more, not {level!r}")
        step = self.steps[self.blank - 1]
        there = any(u.left + u.word + u.right in step.full()[0] for u in step.uses)
        if level <= 1:
            return f"use {step.reason}{'' if there else ', read backwards'}" if step.uses else f"{step.reason}: no axiom is needed"
        if level == 2:
            places = dict.fromkeys(f"{part} in {word}" if part != word else part for word, _, part in step.positions)
            verb = "replace {}" if there else "{} is to appear"
            return verb.format("; ".join(places)) if places else "multiply out, and collect what is equal"
        words = list(step.after.items())
        if level == 3 and words:
            count = "one term" if len(words) == 1 else f"{len(words)} terms"
            first = step.alphabet.text(dict(words[:1])) if len(words) > 1 else step.alphabet.word_text(words[0][0][:1]) + " ..."
            return f"{count}, beginning with {first}"
        return self.solution()

    def solution(self) -> str:
        """The line left out, and what leads to it."""
        step = self.steps[self.blank - 1]
        return f"{step.after_text()}   [{step.reason}]"

    # ------------------------------------------------------------------ judging
    def answer(self, line: Any) -> Any:
        """Judge a line: an expression, or text in Unicode, ASCII or LaTeX; of several gaps {number: line}, which gives {number: Judgement}.

        It is right if it is the line left out, or proved equal to the lines before and after, each by a single equation. Cost:
        milliseconds; where it is not accepted, a tenth of a second for the reasons.
        """
        if isinstance(line, Mapping):
            return {blank: self.gap(blank).answer(given) for blank, given in line.items()}
        try:
            expression = self._expression(line)
        except (_core.Error, NoValue) as error:
            return Judgement("unreadable", str(error))
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
        """The answer as an expression between the spaces of the theorem."""
        lhs = self._read.lhs
        if isinstance(line, str):
            text = line.strip().removeprefix("=").strip()
            read = self._read_text.read(text)
            if read.rhs is not None:
                raise _core.EvaluationError(f"{text!r} is a statement: the line is one expression, equal to the line before")
            line = read.lhs
        if is_number(line) and line == 0:
            return _core.zero(lhs.domain, lhs.codomain)
        if not isinstance(line, _core.Operator):
            raise _core.EvaluationError(f"a line is an operator, not {line!r}")
        if not {id(s) for s in line.sources} <= {id(s) for s in lhs.sources}:
            line = transferred(line, self._operators())
        return line @ _core.identity(lhs.domain) if line.domain is None and lhs.domain == lhs.codomain else line

    def _misfit(self, line: Any) -> str | None:
        """What is said of a line between other spaces than the theorem's."""
        lhs = self._read.lhs
        if (line.domain, line.codomain) == (lhs.domain, lhs.codomain):
            return None
        spaces = [f"{e.domain.name} → {e.codomain.name}" if e.domain is not None else "any space to itself" for e in (lhs, line)]
        return f"the lines of this derivation map {spaces[0]}, and {line.text()} maps {spaces[1]}"

    def _proved(self, expression: Any, allowed: frozenset[str]) -> Proof | None:
        """A proof that the line equals a side of the theorem: under the theorem's hypotheses, else under more."""
        proofs = []
        for side in (self._read.lhs, self._read.rhs):
            proof = prove(side, expression, self._model)
            if proof and allowed >= {*proof.hypotheses}:
                return proof
            proofs += [proof] if proof else []
        return proofs[0] if proofs else None

    def _accepted(self, problem: DerivativeProblem, lines: Sequence[Polynomial], given: Polynomial, proof: Proof) -> Judgement:
        """Right if one equation leads to it and one onward."""
        candidates = list(_candidates(problem, frozenset(self.proof.hypotheses), self.steps))
        to = _single_equation(lines[self.blank - 1], given, candidates, problem.alphabet)
        onward = None if self._last else _single_equation(given, lines[self.blank + 1], candidates, problem.alphabet)
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
        """Wrong if numbers refute it, and why; else unproved."""
        if void := self._void(problem, expression, allowed):
            return Judgement("wrong", void)
        residual, model = self._off(expression, allowed)
        if residual is None:
            proved = "no proof was found" if found is None else f"a proof was found only where {' and '.join(found.hypotheses)}"
            text = f"{proved}, and no number refutes it: it is not accepted"
            return Judgement("unproved", text, model=model, proof=found)
        text = f"off by {residual:.1e}, relative, on {_described(model)}"
        missed: list[str] = []
        if found is not None:
            missed = [h for h in found.hypotheses if h not in allowed]
            text += f"; true only where {' and '.join(missed)}"
            wider = list(_candidates(problem, frozenset(found.hypotheses), self.steps))
            step = _single_equation(self._polynomials()[self.blank - 1], given, wider, problem.alphabet)
            for hypothesis in list(missed):
                used = _used(found, hypothesis)
                told = sorted(used, key=lambda text: (text != step, text != "H G = I", len(text)))[:1]
                text += f", {_SAYS[hypothesis]}" + "".join(f": {short} there, {used[short]} in general" for short in told)
                missed += told
        else:
            slip = self._slip(problem, given, allowed)
            text += f"; {slip}" if slip else f"; the line comes {_by(self.steps[self.blank - 1])}"
            missed = [] if slip else [e.text for e in self.steps[self.blank - 1].equations]
        return Judgement("wrong", text, residual, model, missed, found)

    def _void(self, problem: DerivativeProblem, expression: Any, allowed: frozenset[str]) -> str:
        """Why an inverse or a root of the line exists nowhere under the theorem's hypotheses; empty if nothing says so."""
        claim = Proof.of_statement(Statement(expression, expression, "", "expressions"), problem, [], [], ({}, {}))
        claim.takes_for_granted([o.name for o in problem.opaque if o.kind == "inverse"])
        return claim.void_where(sorted(allowed), self._operators())

    def _off(self, expression: Any, allowed: frozenset[str]) -> tuple[float | None, Any]:
        """(residual, model) where the line is refuted, under the theorem's hypotheses; (None, the last model) if nowhere."""
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
        """What one change of a sign, a coefficient, a star or a letter would make true."""
        settings = [(s, extra) for s, extra in _settings(problem) if s.hypotheses <= allowed]
        a = problem.alphabet
        try:
            attempt = Attempt(problem, *max(settings, key=lambda pair: len(pair[0].hypotheses)))
            form = {w: attempt.reduce({w: ONE})[0] for w in given}
            off = attempt.reduce(combine((1, problem.sides[0]), (-1, given)))[0]
            line = self._polynomials()[self.blank]
            suspects = sorted(given.items(), key=lambda term: line.get(term[0]) == term[1])  # what differs from the line left out first
            for word, c in suspects:
                if off == combine((-2 * c, form[word])):
                    return f"a sign, that of {a.word_text(word)}"
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
                    return f"the coefficient of {a.word_text(word)} should be {wanted}" if c + k else f"{a.word_text(word)} is too much"
            for word, c, other, said in changes:
                if off == combine((c, attempt.reduce({other: ONE})[0]), (-c, form[word])):
                    return f"in {a.word_text(word)} {said}"
        except GaveUp:
            return ""
        return ""


GAP = "\\boxed{\\;?\\;}"


def _described(operators: Any) -> str:
    source = operators._source
    shape = "a chain" if source.traits.get("serial chain") else "branched"
    size = f"{operators.Theta.dimension} coordinate{'s' * (operators.Theta.dimension != 1)}"
    return f"{source.name!r} ({shape}, {size}{'' if source.traits.get('J = 0', True) else ', J ≠ 0'})"


def _by(step: Step) -> str:
    return f"by {step.reason}" if step.uses else step.reason


def _changed(word: Word, alphabet: Alphabet) -> Iterator[tuple[Word, str]]:
    """Words with one letter transposed, inverted or taken for another, and what to say."""
    for i, letter in enumerate(word):
        name, mark = split(letter)
        others = [alphabet.star(letter)] + ([name + {"": "⁻¹", "⁻¹": ""}[mark]] if name == "D" and mark in ("", "⁻¹") else [])
        others += [other + mark for group in _CONFUSED if name in group for other in group if other != name]
        for other in others:
            other = alphabet.star(alphabet.star(other))  # P* is P
            if other != letter:
                yield (*word[:i], other, *word[i + 1 :]), f"{alphabet.letter_text(letter)} should be {alphabet.letter_text(other)}"


# ---------------------------------------------------------------------- steps
def _candidates(problem: DerivativeProblem, allowed: frozenset[str], steps: Sequence[Step]) -> Iterator[tuple[Equation, Word]]:
    """(equation, word) of what one step may use: this derivation's equations, axioms, lemmas, and what those say under the hypotheses."""
    facts = theory()
    known = [e.root for s in steps for e in s.premises()]
    known += [facts(text) for text in (*AXIOMS, *DEFINITIONS, *INVERSES)] + facts.lemmas
    zeros = [("J", "J = 0")] * ("J = 0" in allowed) + [("S", "S = 0")] * ("serial chain" in allowed)
    for equation in dict.fromkeys(known):
        for word, c in equation.difference.items():
            others = [w for w in equation.difference if w != word]
            if not word or abs(c) != 1 or any(find(w, word) >= 0 for w in others):
                continue
            yield equation, word
            for letter, zero in zeros if equation.kind in ("axiom", "lemma") else ():
                if any(letter in w for w in others) and letter not in word:
                    yield corollary(equation, word, letter, zero), word


def _single_equation(p: Polynomial, q: Polynomial, candidates: Sequence[tuple[Equation, Word]], alphabet: Alphabet) -> str | None:
    """An equation that alone, with its transpose, makes p and q the same; None if there is none."""
    words = {x for w in (*p, *q) for x in w}
    if p == q:
        return "collecting terms"
    for mark in ("", *sorted({_mark(x) for x in words} - {""})):
        for equation, word in candidates:
            e, w = equation.copied(mark), tuple(of_model(x, mark) for x in word) if mark else word
            star = alphabet.star_word(w)
            if not any(find(x, part) >= 0 for x in (*p, *q) for part in (w, star)):
                continue
            try:
                if _replaced(p, e, w, star, alphabet) == _replaced(q, e, w, star, alphabet):
                    return equation.text
            except (AssertionError, ValueError):  # it leads in a circle
                continue
    return None


def _mark(letter: str) -> str:
    """The mark of the further model that a letter belongs to."""
    name = split(letter)[0]
    return name[len(plain(letter)) :]


def _replaced(p: Polynomial, equation: Equation, word: Word, star: Word, alphabet: Alphabet) -> Polynomial:
    starred = equation.transposed(alphabet)
    for _ in range(4):
        before = p
        for e, w in ((equation, word), (starred, star)):
            step = replaced_everywhere(p, *solved(e, w), alphabet)
            p = step.after if step is not None else p
        if p == before:
            break
    return p


def _lines_of(blank: Any) -> set[int]:
    """The lines to leave out, of one number or several."""
    given = [blank] if isinstance(blank, Integral) else blank
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise _core.EvaluationError(f"blank={blank!r}: the number of a line, or several")
    lines = list(given)
    if any(isinstance(line, bool) or not isinstance(line, Integral) for line in lines):
        raise _core.EvaluationError(f"blank={blank!r}: lines are told by their numbers, from 1")
    return set(map(int, lines))


def _used(proof: Proof, hypothesis: str) -> dict[str, str]:
    """Equations of a proof that hold under this hypothesis alone, each with what holds without it."""
    found: dict[str, str] = {}
    for e in (e for step in proof.steps for e in step.equations):
        general = next((x for s in e.steps[:1] for x in s.equations), None)
        if e.kind == "lemma" and general is not None and any(x.hypothesis == hypothesis for x in foundations([e])):
            if not any(x.hypothesis for x in foundations([general])):
                found.setdefault(e.text, general.text)
    return found


__all__ = ["Exercise", "Judgement", "exercise"]
