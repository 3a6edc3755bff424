"""Jacobians of one frame relative to another as expressions of the letters 𝒥, B, X = φ(0,k), φ, H and of constants.

A frame is given by the body k that carries it, None for the base, and its pose there. With W(k) = B(k)* X⁻* φ*H*, the motion of body k in
the world's axes about the world's origin, and T(k) = B(k)* X* 1(k), which transforms such a motion to the body's own (6 × 6), the Jacobian
of a frame a relative to a frame b is, L_a = Ad(X_ka⁻¹) a constant,

    body     L_a (𝒥(k_a) - T(k_a) W(k_b))
    world    L_b T(k_b) (W(k_a) - W(k_b))
    aligned  R_b* ρ(k_b) ρ(k_a)* R_a of the first one, ρ(k) the blocks of T(k) on its diagonal: the rotation alone; and so in the axes of a
             third frame

Frames on the base have neither W nor T. Source: A. Jain, Robot and Multibody Dynamics, Springer 2011 (node Jacobians; φ between any
frames).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import _core

Anchor = tuple[str | None, np.ndarray]
"""The body that carries a frame, None for the base, and its pose (4, 4) there."""


def relative_jacobian(model: Any, anchors: dict[str, Anchor | None], axes: str, coordinates: Sequence[int] | None) -> _core.Operator:
    """Return the Jacobian of the anchor "frame" relative to "wrt", in the axes "body", "aligned", "world", or "other", given by "axes".

    Θ → R⁶, or R^m → R⁶ from m coordinates. O(N).
    """
    letters = _Letters(model.soa, model)
    a, b = anchors["frame"], anchors["wrt"]
    assert a is not None and b is not None
    if axes == "world":
        J = letters.world_jacobian(a, b)
    else:
        J = letters.body_jacobian(a, b)
        if axes != "body":
            third = b if axes == "aligned" else anchors["axes"]
            assert third is not None
            J = letters.turned(a, third) @ J
    if coordinates is None:
        return J
    chosen = np.zeros((model.nv, len(coordinates)))
    chosen[coordinates, range(len(coordinates))] = 1
    return J @ _core.constant(chosen, len(coordinates), letters.soa.Theta, "S")


class _Letters:
    """The letters of one model, of single bodies."""

    def __init__(self, soa: Any, model: Any):
        self.soa, self.model = soa, model

    def body_jacobian(self, a: Anchor, b: Anchor) -> _core.Operator:
        L = _adjoint(np.linalg.inv(a[1]))
        if a[0] == b[0]:
            return self.zero()
        if a[0] is None:
            return -1 * (L @ self.world(b[0]))
        own = self.six(a[0]) @ self.soa.Jacobian([a[0]])
        return L @ own if b[0] is None else L @ (own - self.from_world(a[0]) @ self.world(b[0]))

    def world_jacobian(self, a: Anchor, b: Anchor) -> _core.Operator:
        if a[0] == b[0]:
            return self.zero()
        L = _adjoint(np.linalg.inv(b[1]))
        if b[0] is None:
            return L @ self.world(a[0])
        moved = -1 * self.world(b[0]) if a[0] is None else self.world(a[0]) - self.world(b[0])
        return L @ self.from_world(b[0]) @ moved

    def turned(self, a: Anchor, c: Anchor) -> _core.Operator:
        """Return diag(R, R), R the axes of a in those of c."""
        turn = _rotation(a[1][:3, :3])
        if a[0] != c[0]:
            if a[0] is not None:
                turn = self.axes_from_world(a[0]).T @ turn
            if c[0] is not None:
                turn = self.axes_from_world(c[0]) @ turn
        return _rotation(c[1][:3, :3].T) @ turn

    def zero(self) -> _core.Operator:
        return _core.constant(np.zeros((6, self.model.nv)), self.soa.Theta, 6, "0")

    def six(self, body: str) -> _core.Operator:
        """Return the motion of a body as a 6-vector: NodesV → R⁶."""
        return _core.constant(np.eye(6), self.soa.NodesV([body]), 6, "1")

    def world(self, body: str | None) -> _core.Operator:
        """Return W(k): Θ → R⁶."""
        assert body is not None
        B, X, phi, H = self.soa.B([body]), self.soa.X_world, self.soa.phi, self.soa.H
        return self.six(body) @ B.T @ X.inv().T @ phi.T @ H.T

    def from_world(self, body: str) -> _core.Operator:
        """Return T(k): R⁶ → R⁶."""
        space = self.soa.NodesV([body])
        blocks = [np.eye(6) if name == body else np.zeros((6, 0)) for name in self.model.bodies]
        at = _core.constant(blocks, space, self.soa.V, "1")
        given = _core.constant(np.eye(6), 6, space, "1")
        return self.six(body) @ self.soa.B([body]).T @ self.soa.X_world.T @ at @ given

    def axes_from_world(self, body: str) -> _core.Operator:
        """Return ρ(k): diag(R*, R*) of T(k)."""
        T = self.from_world(body)
        angular, linear = (_core.constant(np.repeat(which, 3), 6, 6, "1") for which in ((1.0, 0.0), (0.0, 1.0)))
        return angular @ T @ angular + linear @ T @ linear


def _adjoint(X: np.ndarray) -> _core.Operator:
    """Return Ad(X), motions in the axes before X from those after it."""
    R, p = X[:3, :3], X[:3, 3]
    cross = np.array([[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]])
    return _core.constant(np.block([[R, np.zeros((3, 3))], [cross @ R, R]]), 6, 6, "Ad")


def _rotation(R: np.ndarray) -> _core.Operator:
    """Return diag(R, R)."""
    return _core.constant(np.kron(np.eye(2), R), 6, 6, "R")
