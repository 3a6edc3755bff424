"""`prove`: one side of a statement derived from the other, from what the operators are defined to be.

Both sides are brought to a normal form by rules that are axioms or proved from them (`axioms`), and one chain of steps leads from side to side.
First without a hypothesis, then under those that may matter, fewest first. Every step is checked by multiplying it out (`equations`), whatever
search found it. If the normal forms differ, no proof was found, and nothing is said about the statement.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from .. import _core
from ..identities.checker import with_spaces
from ..identities.parse import Statement, Statements
from .attempt import Attempt, Outcome
from .axioms import joined
from .completion import complete
from .derivation import DerivativeProblem, derivative
from .equations import Equation
from .expand import Problem
from .proof import Proof, example
from .rules import GaveUp, Setting
from .words import FURTHER, Polynomial, Word, split


def prove(lhs: Any, rhs: Any = None, model: Any = None) -> Proof:
    """Derive one side of a statement from the other, from the definitions of the operators.

    Parameters
    ----------
    lhs, rhs : expressions of one model, or a statement as text and, in the second place, its model
    model : Multibody or OperatorSet: what text is read on, and where the steps are evaluated. Text without a model is read on a small tree.

    Returns
    -------
    Proof
        True if a derivation was found: its steps, hypotheses, lemmas and residuals. Else false, with both normal forms: nothing is then said
        about the statement; `pycraft.check` and `Proof.search_counterexample` look at it numerically.

    Raises
    ------
    ParseError, SpaceError
        The text does not read as a statement; the sides do not act between the same spaces.

    Notes
    -----
    Costs milliseconds, whatever the size of the model; no number decides anything. Traces, determinants and norms are outside.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.symbolic import prove
    >>> arm = pc.chain(3)
    >>> H, phi, psi, K, M, D, I = arm.soa("H phi psi K M D I")
    >>> MM, S = H @ phi @ M @ phi.T @ H.T, I - H @ psi @ K
    >>> proof = prove(MM.inv(), S.T @ D.inv() @ S)
    >>> bool(proof), proof.hypotheses
    (True, ['J = 0'])
    """
    if isinstance(lhs, str):
        if rhs is not None and model is None:
            model, rhs = rhs, None
        if isinstance(rhs, str):
            lhs, rhs = f"{lhs} == {rhs}", None
        read = _read(lhs, model)
    else:
        if rhs is None:
            raise _core.EvaluationError("a statement has two sides: prove(lhs, rhs), or prove(text, model)")
        read = Statement(*_sides(lhs, rhs), f"{_text(lhs)} == {_text(rhs)}", "expressions")
    return _prove(read, model)


def prove_derivative(expression: Any, rhs: Any, coordinate: int | str) -> Proof:
    """Derive ∂(expression)/∂θ_i = rhs from the product rule and ∂E_φ = E_φΔ_i.

    Parameters
    ----------
    expression, rhs : as for `prove`; rhs may hold `derivative(X, i)` of any operator X
    coordinate : the coordinate i, by number or name

    Returns
    -------
    Proof
        With "constant H" and "single-DOF hinges" among its hypotheses where a step uses them.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.symbolic import prove_derivative
    >>> arm = pc.chain(3)
    >>> phi, phi_tilde = arm.soa("phi phi_tilde")
    >>> bool(prove_derivative(phi, phi_tilde @ arm.soa.Delta(1) @ phi, 1))
    True
    """
    return prove(derivative(expression, coordinate), rhs)


# ---------------------------------------------------------------------- reading
def _read(text: str, model: Any) -> Statement:
    operators = getattr(model if model is not None else example([]), "soa", model)
    read = Statements(operators).read(text)
    if read.rhs is None:
        raise _core.EvaluationError(f"{text!r} has one side; a statement is lhs == rhs")
    return read


def _sides(lhs: Any, rhs: Any) -> tuple[Any, Any]:
    for one, other in ((lhs, rhs), (rhs, lhs)):
        if isinstance(one, (int, float)) and one == 0 and isinstance(other, _core.Operator) and other.domain is not None:
            zero = _core.zero(other.domain, other.codomain)
            return (zero, other) if one is lhs else (other, zero)
    if isinstance(lhs, _core.Operator) and isinstance(rhs, _core.Operator):
        lhs, rhs = with_spaces(lhs, rhs)
        lhs - rhs  # raises where the spaces differ
    return lhs, rhs


def _text(side: Any) -> str:
    return side.text() if hasattr(side, "text") else str(side)


# ---------------------------------------------------------------------- search
def _prove(read: Statement, model: Any) -> Proof:
    statement = f"{_text(read.lhs)} = {_text(read.rhs)}"
    scalars = [side for side in (read.lhs, read.rhs) if isinstance(side, _core.Scalar) or isinstance(side, (int, float))]
    problem = DerivativeProblem()
    if scalars:
        note = "traces, determinants and norms are not sums of words"
        return Proof(statement, problem.alphabet, [], found=False, note=note, read=read)
    try:
        p, first = problem.expand(read.lhs)
        q, second = problem.expand(read.rhs)
    except GaveUp:
        return Proof(statement, problem.alphabet, [], found=False, note="too many words", read=read)
    problem.sides = [p, q]
    latex = f"{read.lhs.latex()} = {read.rhs.latex()}"
    nearest: tuple[Polynomial, Polynomial] = (p, q)
    for attempt, outcome in _attempts(problem, p, q):
        if not outcome.closed:
            if nearest == (p, q):
                nearest = (outcome.lhs, outcome.rhs)
            continue
        steps = joined([first, *outcome.left], [second, *outcome.right], p, q, problem.alphabet)
        assert steps is not None
        proof = Proof(
            statement, problem.alphabet, steps, (outcome.lhs, outcome.rhs), latex=latex, sides=(read.lhs, read.rhs),
            contexts=problem.contexts, presupposes=_presupposed(problem, attempt), read=read, claim=(p, q),
        )  # fmt: skip
        proof.model = model if model is not None else _model_of(problem)
        proof.verify_if_possible()
        return proof
    return Proof(statement, problem.alphabet, [], nearest, latex=latex, found=False, read=read)


def _attempts(problem: Problem, p: Polynomial, q: Polynomial) -> Iterable[tuple[Attempt, Outcome]]:
    """Attempts under more and more hypotheses; then again, completed."""
    prepared: list[Attempt] = []
    for setting, extra in _settings(problem):
        try:
            attempt = Attempt(problem, setting)
            attempt.prepare(extra)
            outcome = attempt.run(p, q)
        except GaveUp:
            continue
        prepared.append(attempt)
        yield attempt, outcome
    for attempt in prepared:
        if not attempt.local:
            continue
        try:
            if complete(attempt):
                yield attempt, attempt.run(p, q)
        except GaveUp:
            continue


def _settings(problem: Problem) -> Iterable[tuple[Setting, list[tuple[Equation, Word]]]]:
    """Settings by the number of hypotheses, with the rules that they add."""
    names = {split(x)[0].rstrip(FURTHER) for p in problem.polynomials() for word in p for x in word}
    plain, of_hypothesis = problem.derivative_rules()
    deltas = [n for n, known in problem.alphabet.letters.items() if known.expression is not None and _is_delta(known.expression)]
    possible = ["J = 0"]
    if "Υ" in names:
        possible.append("serial chain")
    if deltas:
        possible.append("single-DOF hinges")
    if of_hypothesis:
        possible.append("constant H")
    composite, velocities = "R" in names or "∂R" in names, bool(names & {"Ṽ", "V̄", "Ḣ"})
    for size in range(len(possible) + 1):
        for chosen in itertools.combinations(possible, size):
            extra = list(plain)
            if "single-DOF hinges" in chosen:
                extra += [_no_delta(name) for name in deltas]
            if "constant H" in chosen:
                extra += of_hypothesis
            yield Setting(frozenset(chosen), composite, "serial chain" in chosen, velocities), extra


def _is_delta(e: Any) -> bool:
    return getattr(e, "kind", "") == "symbol" and e.name in ("Delta", "Delta_theta_dot")


def _no_delta(name: str) -> tuple[Equation, Word]:
    """HΔ = 0 where the axes at Δ's body are one: h*crf(h) = 0."""
    word = ("H", name)
    return Equation({word: Fraction(1)}, {}, "hypothesis", f"H {name} = 0", hypothesis="single-DOF hinges"), word


def _presupposed(problem: Problem, attempt: Attempt) -> list[str]:
    """Inverses that the statement names and no lemma shows to exist."""
    return [f"{problem.alphabet.letter_text(n)}⁻¹" for n in attempt.inverted_letters() if n not in attempt.shown_inverses]


def _model_of(problem: Problem) -> Any:
    """The model that the letters belong to."""
    from ..operators import OperatorSet

    for source, _ in problem.contexts:
        return OperatorSet(source, _python_model(source))
    return None


def _python_model(source: Any) -> Any:
    """Something with random states: the core's model behind a source."""
    return _Core(source.model) if hasattr(source, "model") else None


class _Core:
    """States of a model of the core."""

    def __init__(self, model: Any):
        self._model = model

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def random_state(self, seed: int) -> Any:
        import numpy as np

        from ..models.state import State

        rng = np.random.default_rng(seed)
        q = np.array(self._model.integrate(self._model.zero_q(), rng.uniform(-1, 1, self._model.nv)))
        return State(q, rng.uniform(-1, 1, self._model.nv))
