"""The floor of refinement for many states at rest, and many right-hand sides at each: see `pycraft.accuracy.floor` for the formula."""

from __future__ import annotations

from typing import Any

import numpy as np


def floors(model: Any, q: np.ndarray, vdots: np.ndarray) -> np.ndarray:
    """The floors (B,), in units of u, of states q (B, nq) at rest with accelerations vdots (B, nv). Equal neighbours share their maps."""
    changes = [0, *(np.flatnonzero(np.any(q[1:] != q[:-1], axis=1)) + 1), len(q)]
    return np.concatenate([_at(model, q[a], vdots[a:b]) for a, b in zip(changes, changes[1:], strict=False)])


def _at(model: Any, q: np.ndarray, vdots: np.ndarray) -> np.ndarray:
    """‖ |ℳ⁻¹HφMφ*| |α| + |ℳ⁻¹Hφ| (|M||α| + |f|) ‖ / ‖θ̈‖ (B,) for accelerations vdots (B, nv) at rest and without gravity.

    Times u, half the epsilon of the residual's precision, it is the floor. Cost O(N²) for the two dense maps, O(N²) a right-hand side.
    """
    H, phi, M, J = model.soa("H phi M J")
    inverse = (H @ phi @ M @ phi.T @ H.T + J).inv()
    of_motion = np.abs((inverse @ H @ phi @ M @ phi.T).at(q).dense())
    of_force = np.abs((inverse @ H @ phi).at(q).dense())
    n = model._size
    motion = phi.T @ H.T
    alpha = (motion.at(q) @ vdots.T).reshape(n, 6, -1)
    force = (phi.at(q) @ (M.at(q) @ alpha.reshape(6 * n, -1))).reshape(n, 6, -1)
    inertias = np.abs(M.at(q) @ np.tile(np.eye(6), (n, 1))).reshape(n, 6, 6)
    pushed = np.einsum("kij,kjb->kib", inertias, np.abs(alpha)) + np.abs(force)
    rounding = of_motion @ np.abs(alpha).reshape(6 * n, -1) + of_force @ pushed.reshape(6 * n, -1)
    return np.linalg.norm(rounding, axis=0) / np.linalg.norm(vdots, axis=1)
