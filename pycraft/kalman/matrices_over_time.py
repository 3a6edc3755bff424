"""Matrices over time: their shapes, the number of steps that they imply, and covariances."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core


def matrices(x: Any, name: str, rows: int | None = None) -> np.ndarray:
    """Return a matrix, or one per time step; a scalar is 1 x 1, and a vector for B one column."""
    made = _core.real_array(x, name)
    if made.ndim == 0:
        made = made.reshape(1, 1)
    if made.ndim == 1 and rows is not None and len(made) == rows:
        made = made[:, None]
    if made.ndim not in (2, 3) or not made.size:
        raise _core.ModelError(f"{name} is a matrix, or one per time step; got an array {np.shape(x)}")
    if not np.isfinite(made).all():
        raise _core.ModelError(f"{name} has entries that are not finite")
    return made


def count_of_steps(given: int | None, measured: int | None, at: dict[str, np.ndarray], between: dict[str, np.ndarray]) -> int:
    """Return N, after a check that every time axis has it."""
    said = {"steps=": given, "measurements": measured} | {name: len(x) for name, x in at.items() if x.ndim == 3}
    known: dict[str, int] = {name: count for name, count in said.items() if count is not None}
    if not known:
        lengths = {len(x) for x in between.values() if x.ndim == 3}
        if len(lengths) != 1:
            raise _core.ModelError("how many steps? give measurements, steps=, or C or R with a time axis")
        known = {"the time axis": lengths.pop() + 1}
    if len(set(known.values())) > 1:
        raise _core.ModelError("the number of steps differs: " + ", ".join(f"{name} has {count}" for name, count in known.items()))
    made = int(next(iter(known.values())))
    if made < 1:
        raise _core.ModelError(f"a state space has at least one step, not {made}")
    for name, x in between.items():
        if x.ndim == 3 and len(x) not in (made - 1, made):
            raise _core.ModelError(f"{name} has {len(x)} matrices; between {made} steps there are {made - 1}")
    return made


def over_time(x: np.ndarray, count: int) -> np.ndarray:
    return np.broadcast_to(x, (count, *x.shape)) if x.ndim == 2 else x[:count]


def symmetric(x: np.ndarray) -> np.ndarray:
    """Return x made symmetric to the last bit: an inertia that is asymmetric by one rounding costs digits."""
    return (x + np.swapaxes(x, -1, -2)) / 2


def require_covariance(x: np.ndarray, name: str) -> None:
    """Raise ModelError unless symmetric positive semidefinite, to rounding."""
    size = np.abs(x).max(initial=0.0)
    if np.abs(x - np.swapaxes(x, -1, -2)).max(initial=0.0) > 1e-12 * size:
        raise _core.ModelError(f"{name} is a covariance: it must be symmetric")
    low = np.linalg.eigvalsh(x)
    if low.min(initial=0.0) < -1e-12 * x.shape[-1] * size:
        where = f" at step {int(np.argmin(low.min(axis=-1)))}" if x.ndim == 3 else ""
        raise _core.ModelError(f"{name} is a covariance: it must be positive semidefinite, and has the eigenvalue {low.min():.3g}{where}")


def stationary(A: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Return P = APA* + BQB* of a stable model that does not change with time."""
    if A.ndim == 3 or noise.ndim == 3 or np.abs(np.linalg.eigvals(A)).max() >= 1:
        raise _core.ModelError("P0 is needed: only a stable model that does not change with time has a stationary covariance")
    from scipy.linalg import solve_discrete_lyapunov

    return symmetric(solve_discrete_lyapunov(A, noise))


def roots(x: np.ndarray) -> np.ndarray:
    """Return L with LL* = x, of semidefinite matrices."""
    values, vectors = np.linalg.eigh(x)
    return vectors * np.sqrt(np.maximum(values, 0))[:, None, :]
