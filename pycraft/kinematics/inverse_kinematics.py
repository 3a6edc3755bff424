"""Inverse kinematics from a start, then from random ones if needed, and its result: `Multibody.solve_ik`."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import chosen, seed_of, whole
from ..models.coordinates import coordinate_numbers
from ..models.limits import CoordinateLimits, checked_q, coordinate_limits, subhinges
from .descent import Descents, Problem, descend
from .frame_targets import rows_of
from .posture import approach
from .solution import Solution

SEARCH, STATIONARY = 1e-4, 1e-7
"""Cosines at which a descent is given up for another one, and at which a configuration is a local minimum: then the residual is the least
along any coordinate to 10⁻¹⁴ of itself."""
TOGETHER = 4096
"""Members of a descent, so that memory does not grow with the number of restarts."""


def solve_ik(
    model: Any, targets: Any, q0: Any, *, centre_of_mass: Any, posture: Any, coordinates: Any, limits: bool, tolerance: Any,
    iterations: int, restarts: int, seed: Any, unreached: str,
) -> Solution:  # fmt: skip
    """`Multibody.solve_ik`."""
    if whole(iterations, "iterations") < 1 or whole(restarts, "restarts") < 0:
        raise _core.EvaluationError(f"iterations={iterations}, restarts={restarts}: at least 1 and 0")
    if chosen(unreached, "unreached") not in ("answer", "raise"):
        raise _core.EvaluationError(f"unreached={unreached!r}: there are 'answer' and 'raise'")
    if not isinstance(limits, (bool, np.bool_)):
        raise _core.EvaluationError(f"limits={limits!r}: there are True and False")
    rng = seed_of(seed)
    rows, asked = rows_of(model, targets, centre_of_mass, tolerance)
    movable = _movable(model, coordinates)
    problem = Problem(model, rows, movable, _bounds(model, movable, bool(limits)))
    start, near = checked_q(model, q0), None if posture is None else checked_q(model, posture)
    given = {} if asked is None else {"the targets": asked}
    given |= {what: len(q) for what, q in (("q0", start), ("posture", near)) if q is not None and q.ndim == 2}
    if len(set(given.values())) > 1:
        raise _core.ModelError(f"batches of different sizes: {', '.join(f'{size} of {what}' for what, size in given.items())}")
    count = next(iter(given.values()), 1)
    start = np.broadcast_to(start, (count, model.nq))
    best, begun = _searched(problem, problem.moved(start, np.zeros((count, model.nv))), iterations, restarts, rng)
    if near is not None:
        approach(problem, best, np.broadcast_to(near, (count, model.nq)), iterations)
    found = Solution(problem, best, np.arange(count), begun, STATIONARY, bool(given))
    short = np.flatnonzero(~best.reached)
    if unreached == "raise" and len(short):
        where = f"state {short[0]} of {count}: " if given else ""
        raise _core.EvaluationError(f"{where}{found.why[short[0]] if given else found.why}")
    return found


def _movable(model: Any, coordinates: Any) -> np.ndarray:
    """Return which coordinates (nv,) may move. ModelError for part of a subhinge of several."""
    chosen = coordinate_numbers(model, coordinates)
    movable = np.ones(model.nv, bool)
    if chosen is not None:
        movable[:] = False
        movable[chosen] = True
    for one in subhinges(model):
        if movable[one.v].any() and not movable[one.v].all():
            text = f"coordinates: part of the {one.kind} subhinge of hinge {one.hinge!r}, which moves as a whole; name the hinge"
            raise _core.ModelError(text)
    return movable


def _bounds(model: Any, movable: np.ndarray, limits: bool) -> CoordinateLimits:
    """Return the limits of movable coordinates; the others stay where they are, inside or outside."""
    known = coordinate_limits(model)
    bounded = movable & limits
    return CoordinateLimits(np.where(bounded, known.lower, -np.inf), np.where(bounded, known.upper, np.inf), known.q_index)


def _searched(problem: Problem, start: np.ndarray, iterations: int, restarts: int, rng: Any) -> tuple[Descents, np.ndarray]:
    """Return the best of all descents of every member, and their number. Rounds double, so that few are in vain and many run together.

    Every member takes the same random starts in the same order: a batch finds for it what it finds alone.
    """
    count = len(start)
    best, begun = descend(problem, start, np.arange(count), iterations, SEARCH), np.ones(count, int)
    held = np.ones(problem.model.nq, bool)
    for one in subhinges(problem.model):
        held[one.q] = not problem.movable[one.v].all()
    tried = 0
    while tried < restarts and problem.movable.any() and len(left := np.flatnonzero(~best.reached)):
        several = min(tried + 1, restarts - tried)
        drawn = np.array([problem.model.random_state(rng).q for _ in range(several)])
        for some in np.array_split(left, -(-len(left) * several // TOGETHER)):
            q = np.where(held, start[some][:, None], drawn).reshape(-1, start.shape[1])
            found = descend(problem, q, np.repeat(some, several), iterations, SEARCH)
            _take_better(problem, best, some, found)
        begun[left] += several
        tried += several
    for newton in (False, True):
        left = np.flatnonzero(~best.reached)
        for some in np.array_split(left, -(-len(left) * (2 * len(held) if newton else 1) // TOGETHER) or 1):
            ended = descend(problem, best.q[some], some, iterations, STATIONARY, newton)
            best.take(some, ended)
            best.iterations[some] += ended.iterations
    return best, begun


def _take_better(problem: Problem, best: Descents, some: np.ndarray, found: Descents) -> None:
    """Take for each member the descent with the least residual, if it is less than before."""
    residuals = np.sum((problem.weights * found.r) ** 2, axis=-1).reshape(len(some), -1)
    rank = np.where(found.reached.reshape(residuals.shape), -1.0, residuals)
    first = np.arange(len(some)) * rank.shape[1] + rank.argmin(axis=-1)
    best.iterations[some] += found.iterations.reshape(rank.shape).sum(axis=-1)
    before = np.sum((problem.weights * best.r[some]) ** 2, axis=-1)
    better = rank.min(axis=-1) < before
    best.take(some[better], found.of(first[better]))
