"""Least squares of residuals on the group of configurations, within bounds, for many members at once.

For every member ½|w r(q)|² is minimized over q = q₀ exp(d), lower ≤ q ≤ upper, from its own start. With J = w ∂r/∂v and μ = λ |w r|²,

    d = argmin |w r + J d|² + μ |d|²    with q + d within bounds: coordinates that leave them are held there, and the others solved again

so that near a solution μ falls with the square of the distance and convergence is quadratic, whether or not J has full rank. λ falls where
the model of the residual was good and grows where it was not. If r does not go to zero, J*J is not all of its curvature: Newton's steps, d
= -(|H| + μ)⁻¹ g with g = J* w r and H = ∂g/∂v by differences of the exact g, reach such a minimum in a few steps.

A member ends when its targets are reached, or when it is stationary: no coordinate that may move makes an angle with r with a cosine,
|J_i·w r| / (|J_i| |w r|), above a bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..models.limits import CoordinateLimits
from .target_rows import Rows

FIRST, LEAST, MOST = 1e-2, 1e-8, 1e12
"""λ: initial, least, and the value at which no step is any good."""
ROUNDING = 32 * np.finfo(float).eps
"""Relative to |w r|²: below it the gain of a step is lost in rounding, and the step is accepted."""


@dataclass(frozen=True)
class Problem:
    """Targets of a model, the coordinates that may move (nv,) and their bounds."""

    model: Any
    rows: Sequence[Rows]
    movable: np.ndarray
    limits: CoordinateLimits

    def evaluate(self, q: np.ndarray, of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return r (B, m) and J = w ∂r/∂v (B, m, nv), zero for fixed coordinates, at q (B, nq) with the targets of the members `of`
        (B,)."""
        residuals, rates = zip(*(rows.evaluate(q, of) for rows in self.rows), strict=True)
        return np.concatenate(residuals, axis=-1), self.weights[:, None] * np.concatenate(rates, axis=-2) * self.movable

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights (m,) of the rows."""
        return np.concatenate([rows.weights for rows in self.rows])

    @property
    def names(self) -> list[str]:
        """Names (m,) of the rows."""
        return [name for rows in self.rows for name in rows.names]

    def errors(self, r: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the norms (B,) of the angles and lengths of every target."""
        ends = np.cumsum([0, *(len(rows.names) for rows in self.rows)])
        return [rows.errors(r[:, first:last]) for rows, first, last in zip(self.rows, ends, ends[1:], strict=False)]

    def reached(self, r: np.ndarray) -> np.ndarray:
        """Return whether (B,) every target is within its tolerance."""
        within = np.ones(len(r), bool)
        for rows, (angle, length) in zip(self.rows, self.errors(r), strict=True):
            within &= (angle <= rows.tolerance[0]) & (length <= rows.tolerance[1])
        return within

    def bounds(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how far (B, nv) coordinates may move down and up."""
        value = np.where(self.limits.q_index >= 0, q[:, self.limits.q_index], 0.0)
        return self.limits.lower - value, self.limits.upper - value

    def moved(self, q: np.ndarray, d: np.ndarray) -> np.ndarray:
        """Return q exp(d), within bounds, and exactly on a bound where rounding left it just inside."""
        out = np.array([self.model.integrate(*one) for one in zip(q, d, strict=True)]).reshape(q.shape)
        for bound, past in ((self.limits.lower, np.less_equal), (self.limits.upper, np.greater_equal)):
            some = np.isfinite(bound)
            at, edge = self.limits.q_index[some], bound[some]
            inward = 4 * np.finfo(float).eps * np.maximum(1.0, np.abs(edge)) * (1 if past is np.less_equal else -1)
            out[:, at] = np.where(past(out[:, at], edge + inward), edge, out[:, at])
        return out


@dataclass
class Descents:
    """Ends of descents: q (B, nq), r (B, m), whether their targets are reached, how stationary they are, and the number of steps."""

    q: np.ndarray
    r: np.ndarray
    reached: np.ndarray
    slope: np.ndarray
    iterations: np.ndarray

    def of(self, members: Any) -> Descents:
        """Return these members, by numbers or a slice."""
        return Descents(self.q[members], self.r[members], self.reached[members], self.slope[members], self.iterations[members])

    def take(self, into: np.ndarray, other: Descents) -> None:
        """Copy the members of `other` to the places `into`."""
        for name in ("q", "r", "reached", "slope"):
            getattr(self, name)[into] = getattr(other, name)


def descend(problem: Problem, q: np.ndarray, of: np.ndarray, iterations: int, stationary: float, newton: bool = False) -> Descents:
    """Descend from the starts q (B, nq), for the targets of the members `of` (B,), until reached or stationary, or the step limit."""
    weights = problem.weights
    r, J = problem.evaluate(q, of)
    done = Descents(np.array(q), r, problem.reached(r), np.zeros(len(q)), np.zeros(len(q), int))
    live, damping = np.flatnonzero(~done.reached), np.full(len(q), FIRST)
    for _ in range(iterations):
        low, high = problem.bounds(done.q[live])
        e = weights * done.r[live]
        free, done.slope[live] = _free(J[live], e, low, high)
        going = (done.slope[live] > stationary) & (damping[live] < MOST)
        live, low, high, e, free = live[going], low[going], high[going], e[going], free[going]
        if not len(live):
            break
        before = np.sum(e**2, axis=-1)
        H = _hessian(problem, done.q[live], of[live]) if newton else None
        d = _step(J[live], e, damping[live] * before, low, high, free, H)
        trial = problem.moved(done.q[live], d)
        r, rates = problem.evaluate(trial, of[live])
        change = np.einsum("bij,bj->bi", J[live], d)
        bent = np.sum(change**2, axis=-1) if H is None else np.einsum("bi,bij,bj->b", d, H, d)
        predicted = -2 * np.sum(e * change, axis=-1) - bent  # |e|² - |e + J d|² would be rounding where J d is small
        actual = before - np.sum((weights * r) ** 2, axis=-1)
        done.iterations[live] += 1
        good = (predicted > 0) & ((actual > 1e-3 * predicted) | (np.maximum(np.abs(actual), predicted) < ROUNDING * before))
        grown = np.where(good, np.where(actual > 0.75 * predicted, 0.1, np.where(actual < 0.25 * predicted, 4.0, 1.0)), 8.0)
        damping[live] = np.maximum(damping[live] * grown, LEAST)
        better = live[good]
        done.q[better], done.r[better], J[better] = trial[good], r[good], rates[good]
        done.reached[better] = problem.reached(r[good])
        live = live[~done.reached[live]]
    return done


def _free(J: np.ndarray, e: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which coordinates (B, nv) move anything and are free of bounds in the direction in which e falls; and the largest cosine
    (B,)."""
    gradient = np.einsum("bij,bi->bj", J, e)
    size = np.linalg.norm(J, axis=-2) * np.linalg.norm(e, axis=-1)[:, None]
    free = (size > 0) & ~(((low >= 0) & (gradient > 0)) | ((high <= 0) & (gradient < 0)))
    cosine = np.where(free, np.abs(gradient) / np.where(free, size, 1.0), 0.0)
    return free, cosine.max(axis=-1, initial=0.0)


def _hessian(problem: Problem, q: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Return ∂g/∂v (B, nv, nv), symmetric, by central differences of g = J* w r, with a relative error near 10⁻¹⁰ from g itself."""
    n, h = len(problem.movable), 1e-5
    H = np.zeros((len(q), n, n))
    chosen = np.flatnonzero(problem.movable)
    ways = h * np.eye(n)[chosen]
    ahead, behind = (_gradient(problem, q, of, sign * ways) for sign in (1, -1))
    H[:, chosen] = (ahead - behind) / (2 * h)
    return (H + np.swapaxes(H, -1, -2)) / 2


def _gradient(problem: Problem, q: np.ndarray, of: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Return g (B, k, nv) of every member moved along every direction (k, nv), past its bounds where it is at one."""
    moved = np.array([problem.model.integrate(one, way) for one in q for way in ways]).reshape(-1, q.shape[1])
    r, J = problem.evaluate(moved, np.repeat(of, len(ways)))
    return np.einsum("bij,bi->bj", J, problem.weights * r).reshape(len(q), len(ways), -1)


def _step(
    J: np.ndarray, e: np.ndarray, mu: np.ndarray, low: np.ndarray, high: np.ndarray, free: np.ndarray, H: np.ndarray | None = None
) -> np.ndarray:
    """Return the damped step d (B, nv) within bounds; coordinates that leave them are held there, and the others solved again."""
    free, d = np.array(free), np.zeros(low.shape)
    open_ = np.arange(len(d))
    for _ in range(low.shape[-1]):
        held = np.where(free[open_], 0.0, d[open_])
        if H is None:
            rest = e[open_] + np.einsum("bij,bj->bi", J[open_], held)
            own = _damped(J[open_] * free[open_][:, None, :], rest, mu[open_])
        else:
            g = np.einsum("bij,bi->bj", J[open_], e[open_]) + np.einsum("bij,bj->bi", H[open_], held)
            own = _newton(H[open_] * free[open_][:, None, :] * free[open_][:, :, None], free[open_] * g, mu[open_])
        d[open_] = held + free[open_] * own
        out = free[open_] & ((d[open_] < low[open_]) | (d[open_] > high[open_]))
        d[open_] = np.clip(d[open_], low[open_], high[open_])
        free[open_] &= ~out
        open_ = open_[out.any(axis=-1)]
        if not len(open_):
            break
    return d


def _newton(H: np.ndarray, g: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """Return -(|H| + μ)⁻¹ g (B, nv)."""
    values, vectors = np.linalg.eigh(H)
    return -np.einsum("bij,bj->bi", vectors, np.einsum("bji,bj->bi", vectors, g) / (np.abs(values) + mu[:, None]))


def _damped(J: np.ndarray, e: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """Return argmin |e + J d|² + μ|d|², (B, nv), by singular values; those at the level of rounding count as zero."""
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    rounding = max(J.shape[-2], J.shape[-1]) * np.finfo(float).eps * s.max(axis=-1, initial=0.0)[:, None]
    kept = s > rounding
    inverse = np.where(kept, s / np.where(kept, s**2 + mu[:, None], 1.0), 0.0)
    return -np.einsum("bij,bi->bj", Vt, inverse * np.einsum("bij,bi->bj", U, e))
