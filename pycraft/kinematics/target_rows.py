"""Targets as residuals r(q) of a configuration with their exact Jacobians ∂r/∂v.

In the axes of the target's reference frame, R and p the frame's rotation and position there, (ω; v) its velocity in its own axes:

    rotation   x = R_t φ,  φ = log(R_t* R)          ẋ = R_t A(φ) ω           A: `rates_of_rotation_vectors`
    position   x = p - p_t                          ẋ = R v
    pointing   r = (θ / sin θ) E u,  u = R a        u̇ = Rω × u               E: two rows across b; cos θ = b·u, |r| = θ
    mass       x = c - c_t
    loop       r: the rows of its positions,         ṙ = Q v

and in other axes C, which may turn with ω_C, r = C* x,  ṙ = C* (ẋ + x × ω_C).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .rotation_vectors import rates_of_rotation_vectors, rotation_vectors, skew

Evaluated = tuple[np.ndarray, np.ndarray]
"""Residuals (B, m) and their Jacobians (B, m, nv)."""


@dataclass(frozen=True)
class Rows:
    """Residuals of one target. `angular`: marks the rows that are angles (rad); the others are lengths (m).

    tolerance : (rad, m) below which the target counts as reached, by the norms of angles and lengths
    weights : (m,) of the rows in the objective, 1/rad and 1/m
    """

    name: str
    names: tuple[str, ...]
    angular: np.ndarray
    tolerance: tuple[float, float]
    weights: np.ndarray

    def evaluate(self, q: np.ndarray, of: np.ndarray) -> Evaluated:
        """Evaluate at the states q (B, nq), for the targets of the members `of` (B,)."""
        raise NotImplementedError

    def errors(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the norms (B,) of the angles and of the lengths among residuals (B, m)."""
        return np.linalg.norm(r[:, self.angular], axis=-1), np.linalg.norm(r[:, ~self.angular], axis=-1)


def member(values: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Return the values of members; one value counts for all."""
    return values if len(values) == 1 else values[of]


@dataclass(frozen=True)
class PoseRows(Rows):
    """A frame's rotation, position or both, or chosen components of these; `axes`: None for the axes of `wrt`, "target", or a frame."""

    frame: Any
    wrt: Any
    axes: Any
    rotation: np.ndarray | None
    position: np.ndarray | None
    chosen_rotation: list[int]
    chosen_position: list[int]

    def evaluate(self, q: np.ndarray, of: np.ndarray) -> Evaluated:
        X, J = self.frame.pose(q, wrt=self.wrt), self.frame.jacobian(q, wrt=self.wrt)
        R, p = X[:, :3, :3], X[:, :3, 3]
        target = None if self.rotation is None else member(self.rotation, of)
        turned = self._turned(q, target)
        parts = []
        if self.chosen_rotation:
            assert target is not None
            phi = rotation_vectors(np.swapaxes(target, -1, -2) @ R)
            x, dx = np.einsum("bij,bj->bi", target, phi), target @ (rates_of_rotation_vectors(phi) @ J[:, :3])
            parts.append(turned(x, dx, self.chosen_rotation))
        if self.chosen_position:
            assert self.position is not None
            parts.append(turned(p - member(self.position, of), R @ J[:, 3:], self.chosen_position))
        residuals, rates = zip(*parts, strict=True)
        return np.concatenate(residuals, axis=-1), np.concatenate(rates, axis=-2)

    def _turned(self, q: np.ndarray, target: np.ndarray | None) -> Callable[[np.ndarray, np.ndarray, list[int]], Evaluated]:
        """Return the chosen components of vectors x in the axes of `wrt` and of their rates, both in the axes C of the target."""
        if self.axes is None:
            return lambda x, dx, chosen: (x[:, chosen], dx[:, chosen])
        if isinstance(self.axes, str):
            assert target is not None
            back, turning = np.swapaxes(target, -1, -2), np.zeros((3, 1))
        else:
            back = np.swapaxes(self.axes.pose(q, wrt=self.wrt)[:, :3, :3], -1, -2)
            turning = self.axes.jacobian(q, wrt=self.wrt, axes="aligned")[:, :3]
        return lambda x, dx, chosen: (np.einsum("bij,bj->bi", back, x)[:, chosen], (back @ (dx + skew(x) @ turning))[:, chosen])


@dataclass(frozen=True)
class PointingRows(Rows):
    """An axis a of a frame along a direction b of `wrt`, for any rotation about it; `across` (T, 2, 3): E."""

    frame: Any
    wrt: Any
    axis: np.ndarray
    along: np.ndarray
    across: np.ndarray

    def evaluate(self, q: np.ndarray, of: np.ndarray) -> Evaluated:
        R = self.frame.pose(q, wrt=self.wrt)[:, :3, :3]
        b, E = member(self.along, of), member(self.across, of)
        u = R @ self.axis
        y, cosine = np.einsum("bij,bj->bi", E, u), np.sum(b * u, axis=-1)
        sine = np.linalg.norm(y, axis=-1)
        opposite = (sine < 1e-8) & (cosine < 0)  # all ways round are equally short; take the first, from just beside
        y = np.where(opposite[:, None], (1e-8, 0.0), y)
        u = np.where(opposite[:, None], np.einsum("bji,bj->bi", E, y) - b, u)
        sine = np.where(opposite, 1e-8, sine)
        theta, small = np.arctan2(sine, cosine), (sine < 1e-4) & (cosine > 0)
        stretch = np.where(small, 1 + theta**2 / 6, theta / np.where(small, 1.0, sine))  # θ / sin θ, its series to θ²
        r = stretch[:, None] * y
        du = -skew(u) @ R @ self.frame.jacobian(q, wrt=self.wrt)[:, :3]
        by_cosine = np.where(small, -1 / 3 - theta**2 * 2 / 15, (stretch * cosine - 1) / np.where(small, 1.0, sine**2))
        along = np.einsum("bi,bij->bj", np.broadcast_to(b, u.shape), du)
        return r, stretch[:, None, None] * (E @ du) + (by_cosine[:, None] * y)[..., None] * along[:, None, :]


@dataclass(frozen=True)
class MassCentreRows(Rows):
    """The centre of mass at a position in `wrt`, a frame or None for the base."""

    model: Any
    wrt: Any
    position: np.ndarray
    chosen: list[int]

    def evaluate(self, q: np.ndarray, of: np.ndarray) -> Evaluated:
        x, dx = self.model.centre_of_mass(q), self.model.centre_of_mass_jacobian(q)
        if self.wrt is not None:
            X, J = self.wrt.pose(q), self.wrt.jacobian(q, axes="aligned")
            x, back = x - X[:, :3, 3], np.swapaxes(X[:, :3, :3], -1, -2)
            dx = back @ (dx - J[:, 3:] + skew(x) @ J[:, :3])
            x = np.einsum("bij,bj->bi", back, x)
        return (x - member(self.position, of))[:, self.chosen], dx[:, self.chosen]


@dataclass(frozen=True)
class LoopRows(Rows):
    """A loop of the model to be closed: its rows of positions, (k,) among all rows of the model's loops."""

    model: Any
    chosen: np.ndarray

    def evaluate(self, q: np.ndarray, of: np.ndarray) -> Evaluated:
        loops = self.model.loops
        return loops.residual(q)[:, self.chosen], loops.jacobian(q)[:, self.chosen]
