"""Proofs: numbered steps from one side to the other, the equations on which they rest, and residuals."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

from ..operators.latex_lines import in_lines
from ..operators.latex_text import escaped
from .derivative import Formula
from .equations import Equation, Step, chain_holds, foundations, numbered
from .expand import Opaque, Problem, Spelling
from .models_tried import example, examples, operators_of
from .presuppositions import nowhere
from .shown import FullProof, aligned, fitted, lines, page
from .values import LARGEST, Values
from .words import Alphabet, Polynomial, combine

HYPOTHESES = ("J = 0", "serial chain", "single-DOF hinges", "constant H")
"""Names of the hypotheses that a proof may have, as in the traits of models."""

COUNTED = "the coordinates of this model"
"""The note of an equation that uses one model's number of coordinates."""


class Proof:
    """Result of `prove`: true as a condition if there is a derivation; all of its steps were multiplied out again.

    Attributes
    ----------
    statement : as text
    steps : numbered, from the left side to the right: `.before_text()`, `.after_text()`, the same in LaTeX, `.before` and `.after` as
        polynomials, `.reason` (the axiom or lemma), `.positions`, `.residual`
    presupposes : inverses that the proof uses without proof of existence; each exists on some model that meets the hypotheses
    rests_on : every equation that it uses, directly or indirectly, premises first
    unmet : hypotheses of the proof that the given model does not meet
    note : why no proof was attempted, if so

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.proofs import prove
    >>> proof = prove("HψMψ*H* == D", pc.chain(3))
    >>> bool(proof), proof.hypotheses
    (True, ['J = 0'])
    """

    def __init__(
        self,
        statement: str,
        latex: str,
        alphabet: Alphabet,
        steps: Sequence[Step] = (),
        normal_forms: tuple[Polynomial, Polynomial] = ({}, {}),
        *,
        claim: Equation | None = None,
        note: str = "",
    ):
        self.statement, self.note, self._latex = statement, note, latex
        self.steps = numbered(list(steps))
        self.presupposes: list[str] = []
        self.unmet: list[str] = []
        self._alphabet, self._forms, self._claim = alphabet, normal_forms, claim
        self.rests_on = [e for e in foundations(p for s in self.steps for p in s.premises()) if e is not claim]
        self._spellings: list[Spelling] = []
        self._inverted: list[str] = []
        self._determinants: list[str] = []
        self._opaque: list[Opaque] = []
        self._contexts: list[tuple[Any, Any]] = []
        self._read: Any = None
        self._model: Any = None
        self._found = False

    @classmethod
    def of_statement(
        cls, read: Any, problem: Problem, spellings: Sequence[Spelling], steps: Sequence[Step], forms: Any, note: str = ""
    ) -> Proof:
        """Return the proof of a parsed statement; without steps, no proof was found."""
        statement, latex = (f"{getattr(read.lhs, how)()} = {getattr(read.rhs, how)()}" for how in ("text", "latex"))
        proof = cls(statement, latex, problem.alphabet, steps, forms, note=note)
        proof._opaque, proof._determinants = list(problem.opaque), sorted(problem.determinants)
        proof._spellings, proof._contexts, proof._read = list(spellings), list(problem.contexts), read
        proof.rests_on = foundations([*proof.rests_on, *(e for s in spellings for e in s.premises())]) if steps else []
        proof._found = proof.recheck()
        return proof

    @classmethod
    def of_lemma(cls, lemma: Equation, alphabet: Alphabet) -> Proof:
        """The proof of a lemma."""
        steps = [copy.copy(step) for step in lemma.steps]
        own = steps[0].alphabet if steps else alphabet
        latex = f"{own.latex(lemma.lhs)} = {own.latex(lemma.rhs)}"
        proof = cls(lemma.text, latex, own, steps, (lemma.lhs, lemma.rhs), claim=lemma, note=lemma.note)
        proof.rests_on = foundations([lemma])[:-1]
        proof._found = proof.recheck()
        return proof

    def __bool__(self) -> bool:
        return self._found

    def recheck(self) -> bool:
        """Return True if every step, and every step of every lemma, follows from the equations that it names: exactly, without search."""
        if self._claim is not None:
            return self._claim.holds() and all(e.holds() for e in self.rests_on)
        if not self.steps:
            return False
        first, last = self.steps[0].full()[0], self.steps[-1].full()[1]
        if self._spellings:
            first, last = (s.before for s in self._spellings)
        spelled = all(s.holds() for s in self._spellings)
        return spelled and chain_holds(self.steps, first, last) and all(e.holds() for e in self.rests_on)

    # ------------------------------------------------------------------ what it rests on
    @property
    def hypotheses(self) -> list[str]:
        """Names of the hypotheses that steps or their lemmas use."""
        used = dict.fromkeys(e.hypothesis for e in self.rests_on if e.kind == "hypothesis" and e.hypothesis)
        if "single-DOF hinges" in used:  # their H is constant
            used.pop("constant H", None)
        return [*(name for name in HYPOTHESES if name in used), *(name for name in used if name not in HYPOTHESES)]

    @property
    def axioms(self) -> list[str]:
        """Texts of the axioms on which it rests, directly or through lemmas."""
        return list(dict.fromkeys(e.text for e in self.rests_on if e.kind == "axiom"))

    @property
    def lemmas(self) -> list[Proof]:
        """The lemmas cited by the steps, each with its own proof."""
        named = dict.fromkeys(e.root for step in self.steps for e in step.premises())
        return [Proof.of_lemma(e, self._alphabet) for e in named if e.kind in ("lemma", "structure")]

    def all_lemmas(self) -> list[Proof]:
        """Return all lemmas, including lemmas of lemmas, each before the proofs that cite it."""
        return [Proof.of_lemma(e, self._alphabet) for e in self.rests_on if e.kind in ("lemma", "structure")]

    # ------------------------------------------------------------------ what it takes for granted
    def takes_for_granted(self, letters: Sequence[str], assumed: Sequence[tuple[Equation, str]] = ()) -> None:
        """Record the inverses of these letters as presuppositions, and as hypotheses if the user assumes that they exist."""
        self.presupposes = [self._inverse_text(name) for name in letters]
        given = [(equation, name) for equation, name in assumed if name]
        self._inverted = [*letters, *(name for _, name in given)]
        if given and any(e.kind == "inverse" for e in self.rests_on):
            self.rests_on += [equation for equation, _ in given if equation not in self.rests_on]

    def _inverse_text(self, name: str) -> str:
        """Return the inverse of a letter as typed."""
        typed = next((o.expression.text() for o in self._opaque if o.name == name and o.kind == "inverse"), None)
        return f"{self._alphabet.letter_text(name)}⁻¹" if typed is None else f"({typed})⁻¹"

    def void_where(self, hypotheses: Sequence[str], operators: Any = None) -> str:
        """Return why the proof is void under these hypotheses: an inverse, root or ln|det| in it exists on no tried model. Else empty."""
        roots = [o.name for o in self._opaque if o.kind == "sqrt"]
        name = nowhere([*self._inverted, *self._determinants], roots, self._alphabet, hypotheses, self._contexts, operators)
        if not name:
            return ""
        text = self._alphabet.letter_text(name)
        shown = self._inverse_text(name) if name in self._inverted else f"ln|det {text}|" if name in self._determinants else text
        where = f" where {' and '.join(hypotheses)}" if hypotheses else ""
        return f"it uses {shown}, which exists on no model that was tried{where}"

    # ------------------------------------------------------------------ where the two sides stand
    @property
    def normal_forms(self) -> tuple[str, str]:
        """Normal forms of both sides."""
        return self._alphabet.text(self._forms[0]), self._alphabet.text(self._forms[1])

    @property
    def difference(self) -> str:
        """Difference of the normal forms."""
        return self._alphabet.text(combine((1, self._forms[0]), (-1, self._forms[1])))

    def search_counterexample(self, *, seed: int = 0, budget: float = 5.0) -> Any:
        """Return the smallest model and state found at which the statement is false, or None.

        Parameters
        ----------
        seed : seed of the random models and states
        budget : CPU seconds

        Returns
        -------
        pycraft.identities.search.Counterexample or None
            Always None for derivatives, and for constants, which belong to their own model.
        """
        from ..identities.search import named_vectors, smallest
        from ..identities.statement_text import statement_text

        if self._read is None or any(isinstance(side, Formula) for side in (self._read.lhs, self._read.rhs)):
            return None
        return smallest(statement_text(self._read), seed=seed, budget=budget, vectors=named_vectors(self._read))

    # ------------------------------------------------------------------ numbers
    def verify(self, model: Any = None, seed: int = 0) -> float:
        """Evaluate both sides of every step at a random state: a check of the proof, which does not depend on it.

        Parameters
        ----------
        model : Multibody or OperatorSet; default: the statement's model, or a small random one that meets the hypotheses
        seed : seed of the random state, and of the vectors to which the steps are applied

        Returns
        -------
        float
            The worst residual, relative to the largest term of its step; sets every `step.residual`. Steps with a hypothesis that
            the model does not meet have large residuals, and `unmet` names the hypothesis.

        Raises
        ------
        NoValue
            A letter has no value on that model: a constant of another model, an inverse that does not exist.
        """
        operators = operators_of(model if model is not None else self._model or example(self.hypotheses))
        own = bool(self._contexts) and self._contexts[0][0] is operators._source
        state = None if operators._model is None else operators._model.random_state(seed)
        values = Values(self._alphabet, operators, state, self._contexts if own else (), seed)
        self.unmet = _unmet(self.hypotheses, operators)
        residuals = [values.residual(step) for step in self.steps]
        for step, residual in zip(self.steps, residuals, strict=True):
            step.residual = residual
        return max(residuals, default=0.0)

    def verify_where_possible(self, operators: Any) -> None:
        """Evaluate residuals at a random state of the given model, or of an example if the model is large or fails a hypothesis."""
        self._model = operators
        unmet = [] if operators is None else _unmet(self.hypotheses, operators)
        if unmet and any(e.note == COUNTED for e in self.rests_on):  # a value that belongs to the given model
            self.unmet = unmet
            return
        if set(self.hypotheses) - {*HYPOTHESES}:  # no model is known that meets the assumptions
            self.unmet = unmet
            return
        own = [] if operators is None or unmet or len(operators.F) > LARGEST else [operators]
        for candidate in (*own, *examples(self.hypotheses)):
            try:
                self.verify(candidate)
                break
            except (ArithmeticError, ValueError, TypeError):
                continue
        self.unmet = unmet

    @property
    def worst(self) -> float | None:
        """The worst residual of the evaluated steps; None if there are none."""
        return max((s.residual for s in self.steps if s.residual is not None), default=None)

    # ------------------------------------------------------------------ how it is shown
    def __str__(self) -> str:
        return fitted(self._text() if self else f"{self.statement}\n  no proof found{self._reason()}")

    def _text(self) -> str:
        title = f"{self.statement}\n  proved" + (f" where {' and '.join(self.hypotheses)}" if self.hypotheses else ", no hypothesis")
        title += f"; presupposes {', '.join(self.presupposes)}" if self.presupposes else ""
        title += f"; not met by the model at hand: {' and '.join(self.unmet)}" if self.unmet else ""
        shown = [title, *lines(self.steps)]
        shown += [f"  {self.note}"] if self.note else []
        shown += [f"  rests on {'; '.join(self.axioms)}"] if self.axioms else []
        shown += [f"  largest residual of a step at a random state: {self.worst:.1e}"] if self.worst is not None else []
        return "\n".join(shown)

    def _reason(self) -> str:
        if self.note:
            return f": {self.note}"
        left, right = self.normal_forms
        return f"\n  left side:  {left}\n  right side: {right}\n  difference: {self.difference}"

    def __repr__(self) -> str:
        return str(self)

    def latex(self) -> str:
        """Return the chain of steps as an aligned display, or both normal forms."""
        if not self:
            apart = in_lines(" \\ne ".join(self._alphabet.latex(p) for p in self._forms))
            return apart if not self.note else f"\\text{{{escaped(self.note)}}}"
        return aligned(self.steps)

    def full(self) -> FullProof:
        """Return the proof with the derivations of all its lemmas, down to the axioms, numbered, each before its citations.

        It prints as text, as HTML in notebooks, and has `.latex()`.
        """
        return FullProof(self)

    def _repr_html_(self) -> str:
        return page(self)

    def _repr_latex_(self) -> str:
        where = f" where {' and '.join(self.hypotheses)}" if self.hypotheses else ""
        verdict = f"proved{where}: " if self else "no proof found; normal forms of both sides: " if not self.note else "no proof found: "
        return f"$$\\begin{{gathered}}{in_lines(self._latex)}\\\\ \\text{{{escaped(verdict)}}}\\\\ {self.latex()}\\end{{gathered}}$$"


def _unmet(hypotheses: Sequence[str], operators: Any) -> list[str]:
    return [h for h in hypotheses if not operators._source.traits.get(h, True)]
