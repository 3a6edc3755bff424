"""Certificates: a value with its measured error, what the data alone do to it, where digits went, and what the next rung costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import perf_counter
from typing import Any

import mpmath
import numpy as np

from .. import _core
from ..identities.bounds import uses_riccati
from .certificate import Certificate, HingeLoss, NextRung
from .exact import BITS, EXACT, dynamics_error, exact_dynamics, relative_error
from .floor import refinement_floor
from .rungs import Rung, above, epsilon, precision_name, reference_of
from .timing import time_forward_dynamics

DRAWS = 4
"""Draws of signs for the error that rounded coordinates make; the largest counts."""


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
) -> Certificate:
    """Forward dynamics at one state, certified: see `Certificate` for what is measured.

    Parameters
    ----------
    q : (nq,) or a State, whose v is taken then
    v, tau : (nv,), zero where left out
    form, refine, residual, precision : as in `forward_dynamics`
    seed : of the signs by which coordinates are moved
    seconds : spent on each timing

    Cost: a few evaluations in quad precision, O(N); the floor, up to 400 coordinates, O(N²).

    Raises what `forward_dynamics` raises: there is no certificate of a value that is refused.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.accuracy.certify import certify_dynamics
    >>> arm = pc.chain(6, seed=1)
    >>> certificate = certify_dynamics(arm, arm.random_state(0))
    >>> certificate.error < 1e-12, certificate.reference
    (True, 'quad')
    """
    if v is None and hasattr(q, "v"):
        v = q.v
    q = _one_state(model, getattr(q, "q", q))
    v, tau = (np.zeros(model.nv) if x is None else np.asarray(x, float) for x in (v, tau))
    rung = Rung(form, refine, residual, precision)
    returned = model.forward_dynamics(q, v, tau, **rung.options)

    def exact(at: np.ndarray, precision: Any) -> Any:
        return exact_dynamics(model, at, v, tau, precision)

    def error(step: Rung, truth: Any) -> float:
        value = returned if step == rung else model.forward_dynamics(q, v, tau, **step.options)
        return dynamics_error(model, q, v, tau, step, value, truth)

    def time(step: Rung) -> float:
        return time_forward_dynamics(model, q, v, tau, seconds, **step.options)["minimum"]

    soa = model.soa
    H, phi, M, J = soa("H phi M J")
    notes: dict[str, str] = {}
    floor = _noted(notes, "floor", lambda: refinement_floor(model, q, v, returned, rung))
    return _certificate(
        f"forward dynamics of {model.name}, {model.nv} degrees of freedom", returned, rung, exact, error, time, (model, q, seed),
        (H @ phi @ M @ phi.T @ H.T + J, "ℳ + J"), [soa._source], (q, v), floor, notes, above(rung),
    )  # fmt: skip


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
) -> Certificate:
    """An expression's value at one state, certified: of an operator the dense form, or its product with x; of a scalar the number.

    Parameters
    ----------
    expr : an operator or scalar expression that is not bound to a state
    q : (nq,) or a State; the model's present state where left out
    x : (n,) or (n, m), what the operator is applied to; its dense form where left out
    v : (nv,), zero where left out
    form, refine, residual, precision, seed, seconds : as in `certify_dynamics`

    A scalar, and x @ in a precision of double or below, is measured as it is returned, rounded to double.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.accuracy.certify import certify_expression
    >>> arm = pc.chain(6, seed=1)
    >>> H, phi, M = arm.soa("H phi M")
    >>> MM = H @ phi @ M @ phi.T @ H.T
    >>> certify_expression(MM.logdet(), arm.random_state(0)).error < 1e-13
    True
    """
    operands = expr.operands() if isinstance(expr, _core.Scalar) else [expr]
    if any(_bound(operand) for operand in operands):
        raise _core.EvaluationError(f"{expr.text()} is bound to a state already; certify the expression itself: expr.certify(q)")
    if x is not None and isinstance(expr, _core.Scalar):
        raise _core.EvaluationError(f"{expr.text()} is a number: there is nothing to apply to x")
    if v is None and hasattr(q, "v"):
        v = q.v
    sources = list({id(s): s for operand in operands for s in operand.sources}.values())
    models = [s.model for s in sources if isinstance(s, _core.MultibodyOperators)]
    if q is None and models:
        q, v = np.array(models[0].q), np.array(models[0].v) if v is None else v
    elif models:
        q = _one_state(models[0], getattr(q, "q", q))
    rung = Rung(form, refine, residual, precision)
    whole = expr
    if x is not None:
        columns = np.asarray(x, float).reshape(len(x), -1)
        whole = expr @ _core.constant(columns, _core.euclidean(columns.shape[1]), expr.domain, "x")

    def bind(what: Any, at: Any, step: Rung) -> Any:
        return what.at(at, v, **step.binding)

    def in_full(at: Any, step: Rung) -> Any:
        """The value before it is rounded to double, where there is more of it."""
        bound = bind(whole, at, step)
        if isinstance(expr, _core.Scalar):
            return float(bound)
        return bound.dense(dtype=object)

    def as_returned(step: Rung) -> Any:
        if isinstance(expr, _core.Scalar):
            return float(bind(expr, q, step))
        return bind(expr, q, step).dense() if x is None else bind(expr, q, step) @ np.asarray(x, float)

    def error(step: Rung, truth: Any) -> float:
        return relative_error(in_full(q, step), truth)

    def time(step: Rung) -> float:
        return _seconds(lambda: as_returned(step), seconds)

    square = operands[0] if len(operands) == 1 and operands[0].domain == operands[0].codomain else None
    notes = {"floor": "is there for forward dynamics"}
    steps = above(rung) if any(_has_inverse(o) for o in operands) else [s for s in above(rung) if not s.refine]
    articulated = uses_riccati(expr) or any(_has_inverse(o) for o in operands) or (isinstance(expr, _core.Scalar) and square is not None)
    return _certificate(
        expr.text(), as_returned(rung), rung, lambda at, wide: in_full(at, Rung(EXACT, precision=wide)), error, time,
        (models[0], q, seed) if len(models) == 1 else None, (square, square.text()) if square is not None else None,
        sources if articulated else [], (q, v), None, notes, steps,
    )  # fmt: skip


# ---------------------------------------------------------------------- the parts of a certificate
def _certificate(
    what: str, returned: Any, rung: Rung, exact: Callable[[Any, Any], Any], error: Callable[[Rung, Any], float],
    time: Callable[[Rung], float], moved: tuple[Any, np.ndarray, int] | None, square: tuple[_core.Operator, str] | None,
    sources: list[_core.SkoSource], state: tuple[Any, Any], floor: float | None, notes: dict[str, str], steps: list[Rung],
) -> Certificate:  # fmt: skip
    reference = reference_of(rung.precision)
    if reference is None:
        raise _core.EvaluationError(f"nothing is wider than {precision_name(rung.precision)} to measure its error against")
    truth = exact(state[0], reference)
    locator = [loss for source in sources for loss in hinge_losses(source, *state, rung, reference)]
    if square is None:
        notes["condition"] = "is there for square operators"
        condition = None
    else:
        condition = _noted(notes, "condition", lambda: condition_estimate(square[0].at(*state, form=EXACT, precision=reference)))
    if moved is None:
        notes["input_error"] = "is there for the coordinates of one model"
    return Certificate(
        what=what,
        rung=rung,
        value=returned,
        error=error(rung, truth),
        reference=precision_name(reference),
        condition=condition,
        condition_of=square[1] if square else "",
        input_error=None if moved is None else _input_error(*moved, truth, lambda at: exact(at, reference)),
        floor=floor,
        locator=sorted(locator, key=lambda loss: -loss.error),
        next_rung=_next(rung, steps, error, time, truth, exact, state[0]),
        notes=notes,
    )


def _next(rung: Rung, steps: list[Rung], error: Callable, time: Callable, truth: Any, exact: Callable, q: Any) -> NextRung | None:
    """The next rung that answers, measured; rungs that refuse on the way are told."""
    refused = {}
    for step in steps:
        reference = reference_of(step.precision)
        if reference is None:
            break
        try:
            found = error(step, truth if reference == reference_of(rung.precision) else exact(q, reference))
        except (ArithmeticError, _core.Error) as reason:
            refused[step.label] = str(reason)
            continue
        return NextRung(step, found, precision_name(reference), time(step) / time(rung), refused)
    return None


def _input_error(model: Any, q: np.ndarray, seed: int, truth: Any, exact: Callable[[np.ndarray], Any]) -> float:
    """The value's relative change when every coordinate moves by half a unit in its last place.

    Half a unit is no double: coordinates move by a whole one, and the change, small against the value, is halved.
    """
    rng = np.random.default_rng(seed)
    signs = rng.choice([-1.0, 1.0], (DRAWS, q.size))
    return max(relative_error(exact(np.nextafter(q, np.copysign(np.inf, s))), truth) for s in signs) / 2


def condition_estimate(operator: _core.Operator) -> float:
    """1-norm condition number of a square operator, estimated from products and solves, none of them dense.

    SciPy's block 1-norm estimator (Higham and Tisseur 2000): a lower bound that is rarely off by more than a small factor.
    """
    from scipy.sparse.linalg import onenormest

    from ..interop.scipy import to_scipy

    columns = min(4, operator.shape[0])
    return float(onenormest(to_scipy(operator), t=columns) * onenormest(to_scipy(operator.inv()), t=columns))


def hinge_losses(source: _core.SkoSource, q: Any, v: Any, rung: Rung, reference: Any) -> Iterator[HingeLoss]:
    """Relative error of each D(k), in the form and precision used, against the wider one: a locator of lost digits, and no proof.

    The error of D(k) is ‖L⁻¹δD L⁻*‖₂ with D = LL*: of a hinge of several coordinates in different units, too. What a wrong D(k) does
    to the result depends on the rest of the model; and digits may be lost in the other sweeps as well.
    """
    D = source.symbol("D")
    sizes = [n for n in source.dof if n]
    names = [name for name, n in zip(getattr(source, "hinge_names", source.body_names), source.dof, strict=True) if n]
    if not sizes:
        return
    width = max(sizes)
    ones = np.vstack([np.eye(n, width) for n in sizes])  # one column for all the first coordinates of hinges, one for all the second
    columns = D @ _core.constant(ones, _core.euclidean(width), D.domain, "1")
    used = columns.at(q, v, form=rung.form, precision=rung.precision).dense(dtype=object)
    exact = columns.at(q, v, form=EXACT, precision=reference).dense(dtype=object)
    start = 0
    for name, n in zip(names, sizes, strict=True):
        block = slice(start, start + n)
        error = _block_error(used[block, :n], exact[block, :n])
        yield HingeLoss(name, error, max(0.0, float(np.log10(error / (epsilon(rung.precision) / 2)))) if error else 0.0)
        start += n


def _block_error(used: np.ndarray, exact: np.ndarray) -> float:
    with mpmath.workprec(BITS):
        off, size = mpmath.matrix((used - exact).tolist()), mpmath.matrix(exact.tolist())
        if exact.size == 1:
            return float(abs(off[0] / size[0])) if size[0] else float("inf") if off[0] else 0.0
        try:
            root = mpmath.cholesky((size + size.T) / 2)
        except ValueError:  # not positive definite
            return relative_error(used, exact)
        scaled = mpmath.inverse(root) * off * mpmath.inverse(root).T
    return float(np.linalg.norm(np.array(scaled.tolist(), float), 2))


# ---------------------------------------------------------------------- small things
def _one_state(model: Any, q: Any) -> np.ndarray:
    q = np.array(q, float)
    if q.shape != (model.nq,):
        raise _core.ModelError(f"a certificate is of one state: q of {model.name!r} takes {model.nq} numbers, not an array {q.shape}")
    return q


def _bound(operator: Any) -> bool:
    return operator._state is not None or any(_bound(child) for child in operator.children)


def _has_inverse(operator: Any) -> bool:
    return operator.kind == "inverse" or any(_has_inverse(child) for child in operator.children)


def _noted(notes: dict[str, str], name: str, measure: Callable[[], float | None]) -> float | None:
    """A number, or None and the reason why there is none."""
    try:
        return measure()
    except (ArithmeticError, _core.Error) as reason:
        notes[name] = str(reason)
        return None


def _seconds(evaluate: Callable[[], Any], budget: float) -> float:
    """The least time of one evaluation within a budget of seconds, at least three of them."""
    times: list[float] = []
    while len(times) < 3 or (sum(times) < budget and len(times) < 1000):
        begin = perf_counter()
        evaluate()
        times.append(perf_counter() - begin)
    return min(times)
