"""Certificates: a value with its measured error, the effect of rounded data, the places of lost digits, and the cost of the next rung."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from ... import _core
from ...tidy import error_text
from ..exact import EXACT, dynamics_error, exact_dynamics, magnitude, relative_error
from ..hard_cases.inputs import Data, applied_to, check, check_coordinates, input_errors, vector
from ..rungs import Rung, above, epsilon, precision_name, reference_of, wider
from ..tables.timing import time_forward_dynamics
from .certificate import Certificate, NextRung, counted, rounding_level
from .floor import refinement_floor
from .locator import condition_estimate, hinge_losses, runs_articulated_sweep

STEP_UP = 2.0
"""A rung is a step up if its error is smaller by this factor."""

VANISHING = 1e4
"""A reference that falls in a wider precision by the ratio of the epsilons, within this factor, is only rounding."""


def certify_dynamics(
    model: Any,
    q: Any,
    v: Any = None,
    tau: Any = None,
    *,
    form: str = "fast",
    refine: int | str = 0,
    residual: str = "same",
    precision: Any = "double",
    seed: int = 0,
    seconds: float = 0.02,
    method: str = "articulated",
    on_singular: str = "raise",
) -> Certificate:
    """Certify forward dynamics at one state; see `Certificate` for the measurements.

    Parameters
    ----------
    q : (nq,), or a State, which also gives v
    v, tau : (nv,), default zero
    form, refine, residual, precision : as in `forward_dynamics`
    seed : seed of the signs by which q, v and tau are moved, 0 or above
    seconds : time spent on each timing
    method, on_singular : only these values; certificates exist for the articulated method and for values that it returns

    Returns
    -------
    Certificate
        Its value are the accelerations (nv,).

    Cost: a dozen evaluations in quad precision and one in 50 digits, O(N); the floor, up to 400 coordinates, O(N²).

    Raises
    ------
    ModelError
        An array of another shape; a model without coordinates.
    EvaluationError
        An unknown form or precision, an invalid seed; another method.
    ArithmeticError
        As for `forward_dynamics`: a refused value has no certificate.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.accuracy.certificates.certify import certify_dynamics
    >>> arm = pc.chain(6, seed=1)
    >>> certificate = certify_dynamics(arm, arm.random_state(0))
    >>> certificate.error < 1e-12, certificate.reference
    (True, 'quad')
    """
    check(seed, method=method, on_singular=on_singular)
    check_coordinates(model)
    if v is None and hasattr(q, "v"):
        v = q.v
    data = {"q": vector(model, "q", getattr(q, "q", q), model.nq)}
    for name, value in (("v", v), ("tau", tau)):
        data[name] = np.zeros(model.nv) if value is None else vector(model, name, value, model.nv)
    q, v, tau = data.values()
    rung = Rung(form, refine, residual, precision)
    steps = above(rung)
    returned = model.forward_dynamics(q, v, tau, **rung.options)

    def error(step: Rung, truth: Any) -> float:
        value = returned if step == rung else model.forward_dynamics(q, v, tau, **step.options)
        return dynamics_error(model, q, v, tau, step, value, truth)

    notes = {name: f"{name} is zero, and exact" for name, value in (("v", v), ("tau", tau)) if not value.any()}
    soa = model.soa
    H, phi, M, J = soa("H phi M J")
    return _certificate(_Measured(
        what=f"forward dynamics of {model.name}, {counted(model.nv, 'degree of freedom', 'degrees of freedom')}",
        value=returned,
        rung=rung,
        steps=steps,
        data=data,
        seed=seed,
        exact=lambda at, wide: exact_dynamics(model, at["q"], at["v"], at["tau"], wide),
        error=error,
        time=lambda step: time_forward_dynamics(model, q, v, tau, seconds, **step.options)["minimum"],
        state=(q, v),
        square=(H @ phi @ M @ phi.T @ H.T + J, "ℳ + J"),
        sources=[soa._source],
        floor=lambda: refinement_floor(model, q, v, returned, rung),
        notes=notes,
    ))  # fmt: skip


def certify_expression(
    expr: Any,
    q: Any = None,
    x: Any = None,
    *,
    v: Any = None,
    form: str = "fast",
    refine: int | str = 0,
    residual: str = "same",
    precision: Any = "double",
    seed: int = 0,
    seconds: float = 0.02,
    method: str = "articulated",
    on_singular: str = "raise",
) -> Certificate:
    """Certify an expression's value at one state: for an operator its dense form or its product with x, for a scalar the number.

    Parameters
    ----------
    expr : an operator or scalar expression that is not bound to a state
    q : (nq,) or a State; default: the model's present state
    x : (n,) or (n, m), argument of the operator; default: certify its dense form
    v : (nv,), default zero
    form, refine, residual, precision : as in `expr.at`
    seed : seed of the signs by which q, v and x are moved, 0 or above
    seconds : time spent on each timing
    method, on_singular : only these values; certificates exist for the articulated method and for values that it returns

    A scalar, and x @ in a precision of double or below, is measured as returned, rounded to double. If the plan has no
    articulated sweep, there is no locator, and the form has no effect.

    Raises
    ------
    ModelError
        An array of another shape; a model without coordinates.
    EvaluationError
        A bound expression; an unknown form or precision, an invalid seed; another method; x with a scalar.
    ArithmeticError
        As for the evaluation.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.accuracy.certificates.certify import certify_expression
    >>> arm = pc.chain(6, seed=1)
    >>> H, phi, M = arm.soa("H phi M")
    >>> MM = H @ phi @ M @ phi.T @ H.T
    >>> certify_expression(MM.logdet(), arm.random_state(0)).error < 1e-13
    True
    """
    check(seed, method=method, on_singular=on_singular)
    scalar = isinstance(expr, _core.Scalar)
    operands = expr.operands() if scalar else [expr]
    sources = list({id(s): s for operand in operands for s in operand.sources}.values())
    models = [s.model for s in sources if isinstance(s, _core.MultibodyOperators)]
    _check_certifiable(expr, operands, models, x)
    q, v = _expression_state(models, q, v)
    data: Data = {}
    if len(models) == 1:
        data = {"q": q} if v is None else {"q": q, "v": v}
    if x is not None:
        data["x"] = applied_to(expr, x)
    rung = Rung(form, refine, residual, precision)
    articulated = runs_articulated_sweep(expr, "dense" if x is None else "apply")
    steps = _steps(rung, articulated, any(_has_inverse(operand) for operand in operands))

    def in_full(at: Data, step: Rung) -> Any:
        """Return the value before rounding to double, if it has more digits."""
        whole = expr
        if x is not None:
            columns = at["x"].reshape(len(at["x"]), -1)
            whole = expr @ _core.constant(columns, _core.euclidean(columns.shape[1]), expr.domain, "x")
        bound = whole.at(at.get("q", q), at.get("v", v), **step.binding)
        return float(bound) if scalar else bound.dense(dtype=object)

    def as_returned(step: Rung) -> Any:
        bound = expr.at(q, v, **step.binding)
        if scalar:
            return float(bound)
        return bound.dense() if x is None else bound @ data["x"]

    square = operands[0] if len(operands) == 1 and operands[0].domain == operands[0].codomain else None
    return _certificate(_Measured(
        what=expr.text(),
        value=as_returned(rung),
        rung=rung,
        steps=steps,
        data=data,
        seed=seed,
        exact=lambda at, wide: in_full(at, Rung(EXACT, precision=wide)),
        error=lambda step, truth: relative_error(in_full(data, step), truth),
        time=lambda step: _seconds(lambda: as_returned(step), seconds),
        state=(q, v),
        square=None if square is None else (square, square.text()),
        sources=[s for s in sources if articulated and (s.derived_from or ("",))[0] != "loops"],  # rows of loops have no sweep
        floor=None,
        notes=_expression_notes(data, articulated),
    ))  # fmt: skip


def _check_certifiable(expr: Any, operands: Sequence[Any], models: Sequence[Any], x: Any) -> None:
    """Raise EvaluationError for an expression that is bound, scalar with x, or without entries; ModelError without coordinates."""
    if any(_bound(operand) for operand in operands):
        raise _core.EvaluationError(f"{expr.text()} is bound to a state already; certify the expression itself: expr.certify(q)")
    if x is not None and isinstance(expr, _core.Scalar):
        raise _core.EvaluationError(f"{expr.text()} is a number, which cannot be applied to x; leave x out")
    for model in models:
        check_coordinates(model)
    if any(0 in operand.shape for operand in operands):
        raise _core.EvaluationError(f"{expr.text()} has no entries: nothing to certify")


def _expression_state(models: Sequence[Any], q: Any, v: Any) -> tuple[Any, Any]:
    """Return checked (q, v) of the first model: from a State, default the model's present ones; unchanged without a model."""
    if v is None and hasattr(q, "v"):
        v = q.v
    if not models:
        return q, v
    if q is None:
        q, v = np.array(models[0].q), np.array(models[0].v) if v is None else v
    q = vector(models[0], "q", getattr(q, "q", q), models[0].nq)
    return q, None if v is None else vector(models[0], "v", v, models[0].nv)


def _expression_notes(data: Data, articulated: bool) -> dict[str, str]:
    """Return why parts of the certificate are missing."""
    notes = {"floor": "exists only for forward dynamics"}
    notes |= {name: f"{name} is zero, and exact" for name in ("v", "x") if name in data and not data[name].any()}
    if "q" not in data:
        notes["input_error"] = "q is moved only if it has the coordinates of one model"
    if not articulated:
        notes["locator"] = "the plan has no articulated sweep: no D(k) is used, and no form matters"
    return notes


# ---------------------------------------------------------------------- the parts of a certificate
@dataclass(frozen=True)
class _Measured:
    """Contents of a certificate: a value, and functions that compute it in another precision, from other data or in another way."""

    what: str
    value: Any
    rung: Rung
    steps: list[Rung]
    data: Data
    seed: int
    exact: Callable[[Data, Any], Any]
    """The value of data in a wider precision."""
    error: Callable[[Rung, Any], float]
    """The error of a way of computing, against the exact value."""
    time: Callable[[Rung], float]
    state: tuple[Any, Any]
    square: tuple[_core.Operator, str] | None
    """The operator for the condition number, and its name."""
    sources: list[_core.SkoSource]
    """The trees whose D(k) are used."""
    floor: Callable[[], float] | None
    notes: dict[str, str]


def _certificate(m: _Measured) -> Certificate:
    reference = reference_of(m.rung.precision)
    if reference is None:
        raise _core.EvaluationError(f"nothing is wider than {precision_name(m.rung.precision)} to measure its error against")
    reference, truth, error = _reference(m, reference)
    locator = [loss for source in m.sources for loss in hinge_losses(source, *m.state, m.rung, reference)]
    condition = None
    if m.square is None:
        m.notes["condition"] = "exists only for square operators"
    else:
        bound = m.square[0].at(*m.state, form=EXACT, precision=reference)
        condition = _noted(m.notes, "condition", lambda: condition_estimate(bound))
    return Certificate(
        what=m.what,
        rung=m.rung,
        value=m.value,
        error=error,
        reference=precision_name(reference),
        condition=condition,
        condition_of=m.square[1] if m.square else "",
        input_errors=input_errors(m.data, m.seed, truth, lambda at: m.exact(at, reference)),
        floor=None if m.floor is None else _noted(m.notes, "floor", m.floor),
        locator=sorted(locator, key=lambda loss: -loss.error),
        next_rung=_next(m, error, truth),
        notes=m.notes,
    )


def _reference(m: _Measured, reference: Any) -> tuple[Any, Any, float]:
    """Return the first precision from `reference` on with a value that agrees with the next wider one's to a tenth of the measured error;
    the value; and the error. A value that falls with epsilon is the rounding of zero, and is replaced by zero."""
    truth = m.exact(m.data, reference)
    error = m.error(m.rung, truth)
    while (finer := wider(reference)) is not None:
        better = m.exact(m.data, finer)
        if 10 * relative_error(truth, better) <= max(error, rounding_level(m.rung.precision)):
            break
        if magnitude(better) <= VANISHING * epsilon(finer) / epsilon(reference) * magnitude(truth):
            truth = 0 * np.asarray(better, dtype=object)
            m.notes["error"] = "the exact value is zero"
            return finer, truth, m.error(m.rung, truth)
        reference, truth = finer, better
        error = m.error(m.rung, truth)
    return reference, truth, error


def _next(m: _Measured, error: float, truth: Any) -> NextRung | None:
    """Return the next rung that is a step up, measured, with the rungs that refused or were no better, or None with a note."""
    if error <= rounding_level(m.rung.precision):
        m.notes["next_rung"] = "none is needed: the value is right to rounding"
        return None
    refused: dict[str, str] = {}
    passed: dict[str, float] = {}
    truths = {reference_of(m.rung.precision): truth}
    for step in m.steps:
        reference = reference_of(step.precision)
        if reference is None:
            break
        try:
            if reference not in truths:
                truths[reference] = m.exact(m.data, reference)
            found = m.error(step, truths[reference])
        except (ArithmeticError, _core.Error) as reason:
            refused[step.label] = str(reason)
            continue
        if STEP_UP * found <= error:
            return NextRung(step, found, precision_name(reference), m.time(step) / m.time(m.rung), refused, passed)
        passed[step.label] = found
    tried = [f"{label} {error_text(found)}" for label, found in passed.items()] + [f"{label} refuses" for label in refused]
    m.notes["next_rung"] = "no rung above halves the error" + (f": {', '.join(tried)}" if tried else "")
    return None


def _steps(rung: Rung, articulated: bool, inverse: bool) -> list[Rung]:
    """Yield the steps above that change an expression's value: of form if the sweep runs, of refinement if there is an inverse."""
    steps = [step for step in above(rung) if inverse or not step.refine]
    same = epsilon(rung.precision)
    return [step for step in steps if articulated or step.form == rung.form or epsilon(step.precision) < same]


# ---------------------------------------------------------------------- small things
def _bound(operator: Any) -> bool:
    return operator._state is not None or any(_bound(child) for child in operator.children)


def _has_inverse(operator: Any) -> bool:
    return operator.kind == "inverse" or any(_has_inverse(child) for child in operator.children)


def _noted(notes: dict[str, str], name: str, measure: Callable[[], float]) -> float | None:
    """Return a number, or None and note the reason."""
    try:
        found = measure()
    except (ArithmeticError, _core.Error) as reason:
        notes[name] = str(reason)
        return None
    if np.isnan(found):
        notes[name] = "is not a number at this state"
        return None
    return found


def _seconds(evaluate: Callable[[], Any], budget: float) -> float:
    """Return the least time of one evaluation within a budget of seconds, from at least three."""
    times: list[float] = []
    while len(times) < 3 or (sum(times) < budget and len(times) < 1000):
        begin = perf_counter()
        evaluate()
        times.append(perf_counter() - begin)
    return min(times)
