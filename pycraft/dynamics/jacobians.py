"""Jacobians in other axes, about other points, relative to other frames than the core's: see `DirectCalls.jacobian`."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import text

AXES = ("body", "aligned", "world")


def resolved_jacobian(model: Any, frame: str, q: Any, axes: str, relative_to: str | None, precision: str | int) -> np.ndarray:
    """Return J (6, nv) or (B, 6, nv), of the velocity (ω; v) of `frame` (f) relative to `relative_to` (o).

    With R, p the pose of f in o, and the core's 𝒥_f and 𝒥_o, each in its own axes about its own origin:

      body     𝒥 = 𝒥_f - (R* ω_o; R* (v_o + ω_o × p))        the motion of o is subtracted
      aligned  (R ω; R v) of the body form
      world    (R ω; R v + p × R ω)

    O(N). Raises EvaluationError for unknown axes.
    """
    if not isinstance(axes, str) or axes not in AXES:
        raise _core.EvaluationError(f"axes={axes!r} of a Jacobian: there are {', '.join(map(repr, AXES))}")
    calls = model._calls()
    J = core_f = calls.jacobian(frame, q, precision, None)
    X = calls.pose(frame, q)
    R, p = X[..., :3, :3], X[..., :3, 3]
    if relative_to is not None:
        relative_to = text(relative_to, "a frame")
        J_o, X_o = calls.jacobian(relative_to, q, precision, None), calls.pose(relative_to, q)
        R_o = np.swapaxes(X_o[..., :3, :3], -1, -2)
        R, p = R_o @ R, np.einsum("...ij,...j->...i", R_o, p - X_o[..., :3, 3])
        carried = J_o[..., 3:, :] - _cross(p, J_o[..., :3, :])
        J = J - _turned(np.swapaxes(R, -1, -2), np.concatenate([J_o[..., :3, :], carried], axis=-2))
        # a coordinate that moves both moves them as one body: exactly zero, although the difference is rounding
        J[..., _moves(core_f) & _moves(J_o)] = 0
    if axes == "body":
        return J
    J = _turned(R, J)
    if axes == "world":
        J[..., 3:, :] += _cross(p, J[..., :3, :])
    return J


def _turned(R: np.ndarray, J: np.ndarray) -> np.ndarray:
    """Return (R ω; R v) of every column."""
    return np.concatenate([R @ J[..., :3, :], R @ J[..., 3:, :]], axis=-2)


def _moves(J: np.ndarray) -> np.ndarray:
    """Return which coordinates (nv,) move the frame: columns off the path to the base are zero, the others never."""
    return np.asarray(J.reshape(-1, J.shape[-1]).any(axis=0))


def _cross(p: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return p × each column, (..., 3) and (..., 3, n)."""
    return np.cross(p[..., None, :], np.swapaxes(columns, -1, -2)).swapaxes(-1, -2)
