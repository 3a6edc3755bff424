"""The floor of refinement: the error left by a residual in a given precision.

A residual r = τ - (ℳθ̈ + 𝒞) is formed by inverse dynamics, whose two sweeps round at every body: the motion α(k) by u|α(k)|, the force
by u(|M(k)||α(k)| + |f(k)|). Their effect on θ̈ after the correction by ℳ⁻¹, in the worst case of signs, is

    floor = u ‖ |ℳ⁻¹HφMφ*| |α| + |ℳ⁻¹Hφ| (|M||α| + |f|) ‖ / ‖θ̈‖

with u half an epsilon of the precision of the residual, but at least half an epsilon of the precision of θ̈. If only
forces are gathered in a wider precision, the second term has the u of that precision. Velocities and poses are taken as exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import _core
from ..exact import EXACT
from ..rungs import Rung, epsilon, wider

LARGEST = 400
"""Largest number of coordinates for which a certificate has a floor, which needs two dense maps, (nv, 6n)."""


def refinement_floor(model: Any, q: np.ndarray, v: np.ndarray, vdot: np.ndarray, rung: Rung) -> float:
    """Return the floor at a state with accelerations vdot (nv,). Cost O(N²) in extended precision.

    Raises EvaluationError above LARGEST coordinates, and if the floor is not a number.
    """
    if model.nv > LARGEST:
        raise _core.EvaluationError(f"needs dense maps, and is computed only up to {LARGEST} coordinates")
    above = wider(rung.precision) or rung.precision
    residual = above if rung.residual == "wider" else rung.precision
    forces = epsilon(above) / epsilon(rung.precision) if rung.residual == "gather" else 1.0
    with np.errstate(all="ignore"):
        units = float(_units(model, q, v, np.asarray(vdot, float)[None], forces, form=EXACT, precision="extended")[0])
    if not np.isfinite(units):
        raise _core.EvaluationError("is relative to the accelerations, and they are zero or out of range")
    return max(epsilon(residual) / 2 * units, epsilon(rung.precision) / 2)


def floors(model: Any, q: np.ndarray, vdots: np.ndarray) -> np.ndarray:
    """Return the floors (B,), in units of u, of states q (B, nq) at rest with accelerations vdots (B, nv). Equal neighbours share their
    maps.

    Cost O(N²) for the two dense maps of a state, O(N²) for each of its accelerations, in double precision.
    """
    rest = np.zeros(model.nv)
    changes = [0, *(np.flatnonzero(np.any(q[1:] != q[:-1], axis=1)) + 1), len(q)]
    return np.concatenate([_units(model, q[a], rest, vdots[a:b]) for a, b in zip(changes, changes[1:], strict=False)])


def _units(model: Any, q: np.ndarray, v: np.ndarray, vdots: np.ndarray, forces: float = 1.0, **binding: Any) -> np.ndarray:
    """‖ |ℳ⁻¹HφMφ*| |α| + |ℳ⁻¹Hφ| (|M||α| + |f|) ‖ / ‖θ̈‖ (B,) for accelerations vdots (B, nv) at one state; 0 if all are zero.

    forces : the unit of the forces over the unit of the motions, if forces are gathered in a wider precision
    """
    soa, n, count = model.soa, model._size, len(vdots)
    H, phi, M, J, a, b, a0 = soa("H phi M J a b gravity_base")

    def at(operator: _core.Operator) -> np.ndarray:
        return operator.at(q, v, **binding).dense()

    columns = _core.euclidean(count)
    accelerations = _core.constant(np.ascontiguousarray(vdots.T), columns, soa.Theta, "θ̈")
    each = _core.constant(np.ones((1, count)), columns, _core.euclidean(1), "1")  # the same bias at all of them
    motion = phi.T @ (H.T @ accelerations + (a + a0) @ each)
    alpha, force = np.abs(at(motion)), np.abs(at(phi @ (M @ motion + b @ each)))
    inertias = np.abs(at(M @ _core.constant(np.tile(np.eye(6), (n, 1)), _core.euclidean(6), soa.V, "1")))
    pushed = np.einsum("kij,kjb->kib", inertias.reshape(-1, 6, 6), alpha.reshape(n, 6, count)).reshape(6 * n, count) + force
    inverse = (H @ phi @ M @ phi.T @ H.T + J).inv()
    rounding = np.abs(at(inverse @ H @ phi @ M @ phi.T)) @ alpha + forces * np.abs(at(inverse @ H @ phi)) @ pushed
    norms, sizes = np.linalg.norm(rounding, axis=0), np.linalg.norm(vdots, axis=1)
    return np.divide(norms, sizes, out=np.zeros(count), where=(sizes != 0) | (norms != 0))
