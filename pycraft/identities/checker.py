"""Theorems checked numerically: every one on one model (`soa.check`), or a user's own statement (`pycraft.check`)."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from .. import _core
from .bounds import CONSTANT, EPSILON, Sizes, growth, relative_bound
from .parse import Statement, Statements, check_has_space
from .report import CheckReport, Finding, Report

UNDECIDED = 1e-6
"""A bound above this decides nothing."""
FALL = 64.0
"""How far from the ratio of the epsilons the fall of a residual may be: a residual is one number and scatters."""


class BoundState:
    """One state of one model: expressions are bound to it once per precision, so that all of them share its values."""

    def __init__(self, operators: Any, state: Any):
        self.state = state
        self._operators = operators
        self._bindings: dict[str | int, Any] = {}
        self.sizes = Sizes(lambda e: self.bind(e, "double"), operators)

    def bind(self, side: Any, precision: str | int) -> Any:
        if precision not in self._bindings:
            q, v = (None, None) if self.state is None else (self.state.q, self.state.v)
            self._bindings[precision] = _core._bind([self._operators.E], q, v, precision=precision)
        binding = self._bindings[precision]
        return side.bound(binding) if isinstance(side, _core.Scalar) else side._bound(binding)


class Residuals:
    """Worst residuals of one statement over states, in double and in a wider scalar."""

    def __init__(self, wide: str | int = "extended"):
        self.wide = wide
        self.residual = self.bound = self.wide_residual = self.wide_bound = 0.0
        self.growth = 1.0
        self.states = 0
        self.worst_state: Any = None

    def add(
        self,
        lhs: Any,
        rhs: Any,
        at: BoundState,
        vectors: dict[str, np.ndarray] | None = None,
        on_one_path: bool = False,
        at_most: bool = False,
    ) -> float:
        """Evaluate at one state; returns the ratio of the double residual to its bound."""
        values = {name: [float(x) for x in value] for name, value in (vectors or {}).items()}
        relative = {}
        scale = 0.0
        for precision in ("double", self.wide):
            difference, left, right = _core.residual(at.bind(lhs, precision), at.bind(rhs, precision), values, on_one_path, at_most)
            at.sizes.give(values)
            if precision == "double":
                scale = _scale(lhs, rhs, left, right, at.sizes)
            relative[precision] = difference / scale if scale > 0 else difference
        self.states += 1
        if scale == 0 and not any(relative.values()):
            return 0.0  # nothing but zeros on both sides and between them: there is no rounding to bound
        bound = relative_bound(lhs, rhs, at.sizes, scale, "double")
        ratio = relative["double"] / bound
        self.growth = max(self.growth, growth(lhs, rhs, at.sizes))
        self.wide_residual = max(self.wide_residual, relative[self.wide])
        if self.worst_state is None or not relative["double"] <= self.residual:
            self.worst_state = at.state
        self.residual = _worse(self.residual, relative["double"])
        self.bound = max(self.bound, bound)
        self.wide_bound = self.bound * EPSILON[self.wide] / EPSILON["double"]
        return ratio

    @property
    def verdict(self) -> str:
        """ "holds" only if the residual is below its bound in both scalars and falls with epsilon from one to the other."""
        if self.states == 0:
            return "holds"
        if not (np.isfinite(self.residual) and np.isfinite(self.wide_residual)):
            return "fails"
        if self.wide_bound > UNDECIDED:
            return "undecided"
        ratio = EPSILON[self.wide] / EPSILON["double"]
        # A residual in double may be small by luck: where the sweep amplifies roundings, the wider one need not be as lucky.
        scatter = max(FALL * max(self.residual, EPSILON["double"]), CONSTANT * self.growth * EPSILON["double"])
        falls = self.wide_residual <= ratio * scatter
        return "holds" if self.residual <= self.bound and self.wide_residual <= self.wide_bound and falls else "fails"


def _scale(lhs: Any, rhs: Any, left: float, right: float, sizes: Sizes) -> float:
    """What a difference is relative to: the larger side; one for logarithms; where a side is zero, what the other is made of."""
    if isinstance(lhs, _core.Scalar):
        return max(left, right, 1.0)
    zeros = [side for side in (lhs, rhs) if isinstance(side, _core.Operator) and side.kind == "zero"]
    return max(left, right, sizes.size(lhs) + sizes.size(rhs) if zeros else 0.0)


def _worse(a: float, b: float) -> float:
    return b if not b <= a else a


def drawn_vectors(side: Any, rng: np.random.Generator, known: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Random values for the named vectors of an expression."""
    if isinstance(side, _core.Scalar):
        for operand in side.operands():
            drawn_vectors(operand, rng, known)
    elif isinstance(side, _core.Operator):
        if side.kind == "vector" and side.name not in known:
            known[side.name] = rng.uniform(-1, 1, side.codomain.dimension)
        for child in side.children:
            drawn_vectors(child, rng, known)
    return known


def check_model(operators: Any, *, states: int = 3, seed: int = 0, precision: str | int = "extended", progress: Any = None) -> Report:
    """Check every theorem on the model of `operators`, at the present state and at `states` random ones.

    A theorem holds if its residual is below a derived bound (see `bounds`) in double and in a wider scalar, and falls with epsilon.
    Where the bound decides nothing in that scalar, the theorem is taken again in quad. Outside its hypotheses it is evaluated all the
    same and reported as expected to fail, with how much and which hypothesis.

    Parameters
    ----------
    states : random states, drawn from `seed`
    precision : the wider scalar, "extended", "quad", 50 or 100 digits
    progress : called with each theorem's name, if given
    """
    _check_wider(precision)
    source = operators._source
    model = operators._model
    report = Report(source.name, dict(source.traits))
    begin = time.perf_counter()
    rng = np.random.default_rng(seed)
    drawn = [
        BoundState(operators, s)
        for s in ([None] if model is None else [_present(model), *(model.random_state(rng) for _ in range(states))])
    ]
    for theorem in operators.theorems():
        if progress is not None:
            progress(theorem.name)
        report.findings.append(check_theorem(theorem, theorem.unmet(source), drawn, rng, precision))
    report.seconds = time.perf_counter() - begin
    return report


def _check_wider(precision: str | int) -> None:
    """A residual must be seen to fall: double beside double shows nothing."""
    names = list(_core.epsilons())
    _core.wider(precision)  # raises where there is no such precision
    wide = names[names.index("double") + 1 :]
    if precision not in wide:
        raise _core.EvaluationError(f"precision {precision!r} is not wider than double, in which every residual is taken; name {wide}")


def _present(model: Any) -> Any:
    from ..models.state import State

    return State(np.array(model.q), np.array(model.v))


def check_theorem(
    theorem: _core.Theorem, unmet: list[str], states: list[BoundState], rng: np.random.Generator, precision: str | int = "extended"
) -> Finding:
    """One theorem at these states; `unmet` are those of its hypotheses that the model does not meet."""
    finding = Finding(
        theorem.name,
        theorem.group,
        theorem.text,
        theorem.latex,
        list(theorem.hypotheses),
        unmet,
        "waiting",
        wide_precision=precision,
        note=theorem.waiting,
    )
    if theorem.waiting:
        return finding
    begin = time.perf_counter()
    lhs, rhs = with_spaces(theorem.lhs, theorem.rhs)
    vectors = [drawn_vectors(rhs, rng, drawn_vectors(lhs, rng, {})) for _ in states]
    try:
        residuals = evaluate(lhs, rhs, states, vectors, precision, theorem.on_one_path, theorem.at_most)
        verdict = residuals.verdict
    except _core.SingularHingeError as error:
        finding.verdict, finding.note = "undefined", str(error)
        return finding
    except _core.SingularOperatorError as error:
        # Outside its hypotheses a theorem may ask for an inverse that is not there: one way to fail.
        finding.verdict, finding.note = "expected to fail" if unmet else "undefined", str(error)
        return finding
    if unmet:
        verdict = "expected to fail" if verdict == "fails" else "holds anyway"
    finding.verdict = verdict
    finding.residual, finding.bound = residuals.residual, residuals.bound
    finding.wide_residual, finding.wide_bound, finding.wide_precision = (
        residuals.wide_residual,
        residuals.wide_bound,
        residuals.wide,
    )
    finding.states, finding.seconds = residuals.states, time.perf_counter() - begin
    return finding


def evaluate(
    lhs: Any,
    rhs: Any,
    states: list[BoundState],
    vectors: list[dict[str, np.ndarray]],
    precision: str | int,
    on_one_path: bool = False,
    at_most: bool = False,
) -> Residuals:
    """The residuals over these states; in quad where the wider scalar decides nothing."""
    residuals = Residuals(precision)
    for state, values in zip(states, vectors, strict=True):
        residuals.add(lhs, rhs, state, values, on_one_path, at_most)
    if residuals.verdict == "undecided" and precision != "quad":
        return evaluate(lhs, rhs, states, vectors, "quad", on_one_path, at_most)
    return residuals


def with_spaces(lhs: Any, rhs: Any) -> tuple[Any, Any]:
    """An I on one side takes the other side's space."""
    if isinstance(lhs, _core.Operator) and isinstance(rhs, _core.Operator):
        check_has_space(lhs, rhs)
        if rhs.domain is None:
            rhs = rhs @ _core.identity(lhs.domain)
        if lhs.domain is None:
            lhs = lhs @ _core.identity(rhs.domain)
    return lhs, rhs


def check(
    statement: Any,
    model: Any = None,
    *,
    states: int = 20,
    seed: int = 0,
    search: bool = True,
    precision: str | int = "extended",
    budget: float = 20.0,
) -> CheckReport:
    """Check a statement numerically: on a model over many seeded states, or on random trees.

    Parameters
    ----------
    statement : str, or a pair (lhs, rhs) of expressions
        As text in Python's spelling, the book's (Unicode or ASCII) or LaTeX: ``"HψMψ*H* == D"``, ``"inv(psi) == inv(phi) + K*H"``. `MM`
        is the mass matrix HφMφ*H*, `N` the number of coordinates.
    model : Multibody, OperatorSet or None
        None: random trees of all hinge kinds, with and without rotor inertia (text only).
    states : how many states, drawn from `seed`
    search : when false, look for the smallest tree, hinge kinds and state that refute it, and for the hypothesis that would save it
    precision : the scalar beside double in which residuals must fall, "extended", "quad", 50 or 100 digits
    budget : seconds for that search

    Returns
    -------
    CheckReport
        True or false as a condition, with `.worst` and `.counterexample`.

    Examples
    --------
    >>> import pycraft as pc
    >>> bool(pc.check("HψMψ*H* == D", pc.chain(4)))
    True
    """
    from . import search as searching

    _check_wider(precision)
    text = statement if isinstance(statement, str) else f"{statement[0].text()} == {statement[1].text()}"
    if model is None:
        if not isinstance(statement, str):
            raise _core.EvaluationError("expressions belong to one model: give text to check a statement on random trees")
        return searching.check_on_trees(text, states=states, seed=seed, search=search, precision=precision, budget=budget)
    operators = model if not hasattr(model, "soa") else model.soa
    if isinstance(statement, str):
        read = Statements(operators).read(statement)
        if read.rhs is None:
            raise _core.EvaluationError(f"{statement!r} has one side; a statement is lhs == rhs")
    else:
        read = Statement(*with_spaces(*statement), text, "expressions")
    residuals = run(read, operators, states, seed, precision)
    name = operators._source.name
    report = CheckReport(
        text,
        residuals.verdict != "fails",
        residuals.residual,
        residuals.bound,
        residuals.states,
        [name],
        undecided=residuals.verdict == "undecided",
    )
    if not report.held and search:
        report.counterexample = searching.smallest(
            searching.statement_text(read), seed=seed, precision=precision, budget=budget, vectors=searching.named_vectors(read)
        )
    return report


def run(read: Statement, operators: Any, states: int, seed: int, precision: str | int) -> Residuals:
    """The residuals of a statement on one model."""
    model = operators._model
    rng = np.random.default_rng(seed)
    drawn = [BoundState(operators, s) for s in ([None] if model is None else [model.random_state(rng) for _ in range(states)])]
    vectors = [drawn_vectors(read.rhs, rng, drawn_vectors(read.lhs, rng, {})) for _ in drawn]
    return evaluate(read.lhs, read.rhs, drawn, vectors, precision)
