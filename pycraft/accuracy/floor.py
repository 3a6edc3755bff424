"""The floor of refinement: what one residual in a given precision leaves.

A residual r = τ - (ℳθ̈ + 𝒞) is formed by inverse dynamics, whose two sweeps round at every body: the motion α(k) by u|α(k)|, the force
by u(|M(k)||α(k)| + |f(k)|). What these make of θ̈ after the correction by ℳ⁻¹, in the worst case of signs, is

    floor = u ‖ |ℳ⁻¹HφMφ*| |α| + |ℳ⁻¹Hφ| (|M||α| + |f|) ‖ / ‖θ̈‖

with u half an epsilon of the precision in which the residual is formed, and at least half an epsilon of the one in which θ̈ is kept.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from .exact import EXACT
from .rungs import Rung, epsilon, wider

LARGEST = 400
"""Coordinates up to which the floor is computed: it needs two dense maps, (nv, 6n)."""


def refinement_floor(model: Any, q: np.ndarray, v: np.ndarray, vdot: np.ndarray, rung: Rung) -> float:
    """The floor at a state with accelerations vdot (nv,). Cost O(N²) in extended precision.

    Raises EvaluationError above LARGEST coordinates.
    """
    if model.nv > LARGEST:
        raise _core.EvaluationError(f"the floor needs dense maps, and is computed up to {LARGEST} coordinates")
    residual = rung.precision if rung.residual == "same" else wider(rung.precision) or rung.precision
    soa = model.soa
    H, phi, M, J, a, b, a0 = soa("H phi M J a b gravity_base")
    accelerations = _core.constant(np.asarray(vdot, float)[:, None], _core.euclidean(1), soa.Theta, "θ̈")

    def at(operator: _core.Operator) -> np.ndarray:
        return operator.at(q, v, form=EXACT, precision="extended").dense()

    motion = phi.T @ (H.T @ accelerations + a + a0)
    alpha, force = np.abs(at(motion)[:, 0]), np.abs(at(phi @ (M @ motion + b))[:, 0])
    inertias = np.abs(at(M @ _core.constant(np.tile(np.eye(6), (model._size, 1)), _core.euclidean(6), soa.V, "1")))
    pushed = np.einsum("kij,kj->ki", inertias.reshape(-1, 6, 6), alpha.reshape(-1, 6)).ravel() + force
    inverse = (H @ phi @ M @ phi.T @ H.T + J).inv()
    rounding = np.abs(at(inverse @ H @ phi @ M @ phi.T)) @ alpha + np.abs(at(inverse @ H @ phi)) @ pushed
    size = float(np.linalg.norm(vdot))
    u = epsilon(residual) / 2
    return max(u * float(np.linalg.norm(rounding)) / size if size else 0.0, epsilon(rung.precision) / 2)
