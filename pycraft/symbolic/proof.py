"""Proofs as they are read: numbered steps from one side to the other, what they rest on, and numbers beside them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .equations import Equation, Step, chain_holds, foundations
from .values import LARGEST, Values, check_steps
from .words import Alphabet, Polynomial, combine


class Proof:
    """What `prove` found: true as a condition if a derivation was found, and then only if an independent pass over its steps agrees.

    Attributes
    ----------
    statement : the statement, as text
    steps : numbered, from the left side to the right: each with `.before`, `.after` (polynomials; `.before_text()`, `.before_latex()`, ...
        show them), `.reason` (the axiom or lemma), `.positions`, `.residual`
    hypotheses : names of those that the steps or their lemmas use: "J = 0", "serial chain", "single-DOF hinges", "constant H"
    axioms : texts of the axioms that it rests on, those of its lemmas included
    lemmas : the lemmas that its steps name, each with its own proof
    presupposes : inverses that the statement names and that no lemma shows to exist
    normal_forms : both sides as far as they were brought, as text; `difference` is what is left between them
    unmet : hypotheses that the model at hand does not meet

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.symbolic import prove
    >>> proof = prove("HψMψ*H* == D", pc.chain(3))
    >>> bool(proof), proof.hypotheses
    (True, ['J = 0'])
    """

    def __init__(
        self,
        statement: str,
        alphabet: Alphabet,
        steps: Sequence[Step],
        normal_forms: tuple[Polynomial, Polynomial] = ({}, {}),
        *,
        latex: str = "",
        sides: tuple[Any, Any] | None = None,
        contexts: Sequence[tuple[Any, Any]] = (),
        found: bool = True,
        note: str = "",
        presupposes: Sequence[str] = (),
        read: Any = None,
        claim: tuple[Polynomial, Polynomial] | None = None,
    ):
        self.statement, self.note, self._latex = statement, note, latex
        self.presupposes = list(presupposes)
        self.steps = list(steps) if found else []
        for number, step in enumerate(self.steps, 1):
            step.number = number
        self._alphabet, self._sides, self._contexts, self._read = alphabet, sides, list(contexts), read
        self._claim = claim
        self._forms = normal_forms
        self._rests_on = foundations(e for step in self.steps for e in step.premises())
        self._found = found and self.recheck()
        self.unmet: list[str] = []
        self.model: Any = None

    def __bool__(self) -> bool:
        return self._found

    # ------------------------------------------------------------------ what it rests on
    @property
    def hypotheses(self) -> list[str]:
        names = {e.hypothesis for e in self._rests_on if e.kind == "hypothesis" and e.hypothesis}
        return [n for n in ("J = 0", "serial chain", "single-DOF hinges", "constant H") if n in names]

    @property
    def axioms(self) -> list[str]:
        return list(dict.fromkeys(e.text for e in self._rests_on if e.kind == "axiom"))

    @property
    def lemmas(self) -> list[Proof]:
        named = dict.fromkeys(e.root for step in self.steps for e in step.premises())
        return [_lemma_proof(e, self._alphabet) for e in named if e.kind in ("lemma", "structure", "derivative")]

    def all_lemmas(self) -> list[Proof]:
        """The lemmas, and the lemmas of their proofs, what is cited before what cites it."""
        return [_lemma_proof(e, self._alphabet) for e in self._rests_on if e.kind in ("lemma", "structure")]

    def recheck(self) -> bool:
        """Whether every step, and every step of every lemma, follows from the equations that it names: exact, nothing searched."""
        if not self.steps:
            return False
        start, end = self.steps[0].full()[0], self.steps[-1].full()[1]
        if self._claim is not None:
            start, end = self._claim
        return chain_holds(self.steps, start, end) and all(e.holds() for e in self._rests_on)

    # ------------------------------------------------------------------ where the two sides stand
    @property
    def normal_forms(self) -> tuple[str, str]:
        return self._alphabet.text(self._forms[0]), self._alphabet.text(self._forms[1])

    @property
    def difference(self) -> str:
        return self._alphabet.text(combine((1, self._forms[0]), (-1, self._forms[1])))

    def search_counterexample(self, *, seed: int = 0, budget: float = 20.0) -> Any:
        """The smallest model and state at which the statement is false, or None if none was found.

        Parameters
        ----------
        budget : seconds

        Returns
        -------
        pycraft.identities.search.Counterexample or None
            None also where the statement holds constants, which belong to their own model.
        """
        from ..identities.search import smallest, statement_text

        if self._read is None:
            return None
        return smallest(statement_text(self._read), seed=seed, budget=budget)

    # ------------------------------------------------------------------ numbers
    def verify(self, model: Any = None, seed: int = 0) -> float:
        """Evaluate both sides of every step at a random state; a check of the proof that decides nothing.

        Parameters
        ----------
        model : Multibody or OperatorSet; None for the one that the statement was made on
        seed : of the state, and of the vectors that the steps are applied to

        Returns
        -------
        float
            The worst residual, relative to the largest term of a step; every `step.residual` is set. Steps that use a hypothesis which the
            model does not meet have large ones.

        Raises
        ------
        NoValue
            A letter has no value on that model: a constant of another model, an inverse that does not exist.
        """
        operators = self._operators(model)
        own = bool(self._contexts) and operators._source is self._contexts[0][0]
        values = Values(self._alphabet, operators, _state(operators, seed), own, seed, self._contexts if own else ())
        self.unmet = [h for h in self.hypotheses if not operators._source.traits.get(h, True)]
        return check_steps(self.steps, values)

    def _operators(self, model: Any) -> Any:
        model = self.model if model is None else model
        if model is None:
            model = example(self.hypotheses)
        return getattr(model, "soa", model)

    def verify_if_possible(self) -> None:
        """Residuals at a random state of the model at hand, or of an example where that is too large or fails a hypothesis."""
        operators = getattr(self.model, "soa", self.model)
        fits = operators is not None and len(operators.F) <= LARGEST
        if fits and not any(not operators._source.traits.get(h, True) for h in self.hypotheses):
            candidates = [operators, None]
        else:
            candidates = [None]
        for candidate in candidates:
            try:
                self.verify(candidate if candidate is not None else example(self.hypotheses))
                break
            except (ArithmeticError, ValueError, TypeError):
                continue
        if operators is not None:
            self.unmet = [h for h in self.hypotheses if not operators._source.traits.get(h, True)]

    @property
    def worst(self) -> float | None:
        """The worst residual of the steps that were evaluated; None if none was."""
        found = [s.residual for s in self.steps if s.residual is not None]
        return max(found) if found else None

    # ------------------------------------------------------------------ how it is shown
    def __str__(self) -> str:
        if not self:
            return self._not_found()
        title = f"{self.statement}\n  proved" + (f" where {' and '.join(self.hypotheses)}" if self.hypotheses else ", no hypothesis")
        if self.presupposes:
            title += f"; presupposes {', '.join(self.presupposes)}"
        if self.unmet:
            title += f"; the model at hand has not {' and '.join(self.unmet)}"
        lines = [title, *_lines(self.steps)]
        lines.append("  rests on " + "; ".join(self.axioms))
        if self.worst is not None:
            lines.append(f"  largest residual of a step at a random state: {self.worst:.1e}")
        return "\n".join(lines)

    def _not_found(self) -> str:
        text = f"{self.statement}\n  no proof found"
        if self.note:
            return text + f": {self.note}"
        left, right = self.normal_forms
        return text + f"\n  left side:  {left}\n  right side: {right}\n  difference: {self.difference}"

    def __repr__(self) -> str:
        return str(self)

    def text(self, lemmas: bool = True) -> str:
        """The proof with the proofs of its lemmas, down to the axioms, each once and before it is used."""
        if not lemmas or not self:
            return str(self)
        parts = [str(lemma) for lemma in self.all_lemmas()]
        return "\n\n".join([*parts, str(self)])

    def latex(self) -> str:
        """The chain of steps as an aligned display."""
        if not self:
            left, right = (self._alphabet.latex(p) for p in self._forms)
            return f"\\begin{{aligned}}\\text{{no proof found; normal forms: }}& {left}\\\\ & {right}\\end{{aligned}}"
        rows = [f"& {self.steps[0].before_latex()}"]
        for step in self.steps:
            rows.append(f"={{}}& {step.after_latex()} && \\text{{({step.number}) {_in_text(step)}}}")
        return "\\begin{aligned}" + "\\\\\n".join(rows) + "\\end{aligned}"

    def _repr_latex_(self) -> str:
        where = " and ".join(self.hypotheses)
        head = f"\\text{{{'proved' + (f' where {_escaped(where)}' if where else '') if self else 'no proof found'}: }} {self._latex}"
        return f"$$\\begin{{gathered}}{head}\\\\ {self.latex()}\\end{{gathered}}$$"


def _lines(steps: Sequence[Step]) -> list[str]:
    """The chain, one step a line, reasons in a column."""
    rows = [("", steps[0].before_text(), "")]
    rows += [(f"{s.number}.", f"= {s.after_text()}", f"[{s.reason}]") for s in steps]
    width = min(70, max(len(middle) for _, middle, _ in rows))
    lines = []
    for number, middle, reason in rows:
        line = f"  {number:>3} {middle}"
        if reason:
            line = f"{line:<{width + 6}}   {reason}" if len(middle) <= width else f"{line}\n{'':>{width + 6}}   {reason}"
        lines.append(line)
    return lines


def _in_text(step: Step) -> str:
    if step.title or not step.uses:
        return _escaped(step.reason)
    alphabet = step.alphabet
    shown = dict.fromkeys(f"${alphabet.latex(e.lhs)} = {alphabet.latex(e.rhs)}$" for e in step.equations if e.lhs or e.rhs)
    return "; ".join(shown)


def _escaped(text: str) -> str:
    """Plain text inside LaTeX's \\text."""
    for a, b in (("\\", ""), ("_", "\\_"), ("*", "{*}"), ("φ", "$\\phi$"), ("ψ", "$\\psi$"), ("⁻¹", "$^{-1}$"), ("Ω", "$\\Omega$")):
        text = text.replace(a, b)
    return text


def _lemma_proof(equation: Equation, alphabet: Alphabet) -> Proof:
    """A lemma as a proof of its own."""
    steps = [Step(**{**s.__dict__}) for s in equation.steps]
    claim = None if equation.kind == "structure" else (equation.lhs, equation.rhs)
    own = equation.steps[0].alphabet if equation.steps else alphabet
    latex = f"{own.latex(equation.lhs)} = {own.latex(equation.rhs)}"
    proof = Proof(equation.text, own, steps, (equation.lhs, equation.rhs), latex=latex, claim=claim, note=equation.note)
    proof._rests_on = foundations([equation])[:-1]
    proof._found = equation.holds() and all(e.holds() for e in proof._rests_on)
    return proof


def _state(operators: Any, seed: int) -> Any:
    model = operators._model
    return None if model is None else model.random_state(seed)


def example(hypotheses: Sequence[str]) -> Any:
    """A small random model that meets these hypotheses and as few others as may be."""
    from ..models.generators import tree

    chain, single, constant = (h in hypotheses for h in ("serial chain", "single-DOF hinges", "constant H"))
    kinds = ["pin", "slider", "pin", "screw"] if single else ["free", "pin", "ball", "slider"] if constant else ["pin", "ball", "universal", "slider"]
    return tree([-1, 0, 1, 2] if chain else [-1, 0, 0, 1], kinds, seed=3, rotor_inertia="J = 0" not in hypotheses)
