"""Find a configuration near a posture among those that reach their targets: descent of |δ|² in the null space, with restoration.

δ = `difference(q, posture)` is the displacement to the posture, and falls as (1 - t) δ along itself. The step is N δ, N = 1 - J⁺J on the
coordinates that no limit holds, as far as limits allow; it is restored by Gauss-Newton steps for the targets, and halved until |δ|² has
fallen. The descent ends where N δ vanishes: a local minimum of |δ| among the configurations that reach the targets.
"""

from __future__ import annotations

import numpy as np

from ..models.limits import subhinges
from .descent import Descents, Problem, descend

STILL = 1e-7
"""|N δ| over 1 + |δ| at which a configuration counts as nearest."""
WEAK = 1e-9
"""Relative to the largest singular value: a motion with a smaller one is in the null space."""


def approach(problem: Problem, best: Descents, posture: np.ndarray, iterations: int) -> None:
    """Move the members of `best` that reached their targets towards the postures (B, nq)."""
    counted = _counted(problem)
    live, step = np.flatnonzero(best.reached), np.ones(len(best.q))
    for _ in range(iterations):
        way = _way(problem, best.q[live], posture[live], counted)
        along, room = _along(problem, best, live, way)
        size, distance = np.linalg.norm(along, axis=-1), np.linalg.norm(way, axis=-1)
        going = (size > STILL * (1 + distance)) & (step[live] > STILL)
        live, along, room, size, distance = live[going], along[going], room[going], size[going], distance[going]
        if not len(live):
            return
        part = np.minimum(step[live], room)
        moved = problem.moved(best.q[live], part[:, None] * along)
        restored = descend(problem, moved, live, iterations, STILL)
        left = np.linalg.norm(_way(problem, restored.q, posture[live], counted), axis=-1)
        good = restored.reached & (left**2 < distance**2 - 1e-4 * part * size**2)
        best.iterations[live] += restored.iterations
        step[live] = np.where(good, np.minimum(2 * step[live], 1.0), step[live] / 2)
        kept = live[good]
        best.q[kept], best.r[kept] = restored.q[good], restored.r[good]


def _counted(problem: Problem) -> np.ndarray:
    """Return the coordinates (nv,) that a posture counts."""
    counted = np.array(problem.movable)
    for one in subhinges(problem.model):
        if one.kind == "free":
            counted[one.v] = False
    return counted


def _way(problem: Problem, q: np.ndarray, posture: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Return δ (B, nv)."""
    ways = [problem.model.difference(*one) for one in zip(q, posture, strict=True)]
    return np.array(ways).reshape(len(q), len(counted)) * counted


def _along(problem: Problem, best: Descents, live: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return N δ (B, nv), zero for coordinates held by a limit, and the largest step (B,) along it, 1 at most, within limits."""
    J = problem.evaluate(best.q[live], live)[1]
    low, high = problem.bounds(best.q[live])
    free = np.broadcast_to(problem.movable, way.shape)
    along = way
    for _ in range(way.shape[1]):
        _, s, Vt = np.linalg.svd(J * free[:, None, :], full_matrices=False)
        rows = Vt * (s > WEAK * s.max(axis=-1, initial=0.0, keepdims=True))[..., None]
        along = free * way
        along = along - np.einsum("bij,bi->bj", rows, np.einsum("bij,bj->bi", rows, along))
        pressed = free & (((low >= 0) & (along < 0)) | ((high <= 0) & (along > 0)))
        if not pressed.any():
            break
        free = free & ~pressed
    along = np.where(free, along, 0.0)
    bound = np.where(along > 0, high, low)
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.where(along != 0, bound / along, np.inf)
    return along, np.minimum(1.0, steps.min(axis=-1, initial=1.0))
