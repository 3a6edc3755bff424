"""Fit coordinates and velocities of a hinge to the pose and velocity of a body: one iteration for all kinds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from .. import _core
from ..dynamics.direct_calls import DirectCalls
from ..state import random_state
from .parts import _quaternions

STARTS = 12
"""Number of random starts if the given configuration leads nowhere."""
STEPS = 60
HALVINGS = 12
ROUNDING = 1e-14
"""Rounding of products of a few poses: a smaller error counts as reached."""


@dataclass(frozen=True)
class HingeFit:
    """The part of a pose X and a twist V of a body relative to its inboard side that its hinge can produce.

    Attributes
    ----------
    q, v : coordinates and velocities of the hinge
    pose_error, velocity_error : (6,), the remainders of X and V, twists in the body's axes: rad and m, rad/s and m/s
    """

    q: np.ndarray
    v: np.ndarray
    pose_error: np.ndarray
    velocity_error: np.ndarray


def twist_between(X: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """Return the twist ξ with Y = X exp(ξ), (6,), its rotation at most π."""
    return _free().difference(*(np.r_[_quaternions(pose[:3, :3]), pose[:3, 3]] for pose in (X, Y)))


def fitted(hinge: OneHinge, X: np.ndarray, V: np.ndarray, guess: np.ndarray, tolerance: float) -> HingeFit:
    """Return coordinates with the pose X, the nearest found to the guess, and velocities with the twist V in least squares.

    Gauss-Newton's iteration on the hinge's group, q ← q exp(J(q)⁺ ξ) with ξ = log(X(q)⁻¹ X), its steps halved until ξ falls. J is constant
    for a pin, a slider, a ball and a free hinge, which need one step, up to rounding. It starts at the guess; if that fails, from a screw's
    angle by its travel, and at random.
    """
    best: tuple[np.ndarray, np.ndarray] | None = None
    scale = 1 + np.linalg.norm(X[:3, 3])
    for start in hinge.starts(X, guess):
        q, error = _descended(hinge, X, start, scale)
        if best is None or _size(error, scale) < _size(best[1], scale):
            best = q, error
        if _size(best[1], scale) <= tolerance:
            break
    assert best is not None  # the guess always yields one
    q = hinge.nearest_turn(best[0], guess)
    J = hinge.jacobian(hinge.body, q)
    v = np.linalg.lstsq(J, V, rcond=None)[0] if hinge.nv else np.zeros(0)
    return HingeFit(q, v, best[1], V - J @ v)


class OneHinge(DirectCalls, _core.Multibody):
    """A body on its own hinge, to examine the hinge's motions."""

    def __init__(self, body: str, hinge_name: str, hinge: dict[str, Any]):
        super().__init__(body, True, False)
        self._add_body(name=body, parent="", hinge_name=hinge_name, mass=0.0, com=None, inertia=None, **hinge)
        self.body, self._subhinges = body, self._body(0)["hinge"]["subhinges"]

    def guess(self) -> np.ndarray:
        """Return zero coordinates, or the nearest limits."""
        q, hinge = np.array(self.zero_q()), self._body(0)["hinge"]
        for (at, _), lower, upper in zip(self._one_coordinate(), *self._limits(hinge), strict=False):
            q[at] = np.clip(0.0, lower, upper)
        return q

    def _limits(self, hinge: dict[str, Any]) -> tuple[list[float], list[float]]:
        numbers = [i for i, s in enumerate(hinge["subhinges"]) if _core.subhinge_kinds[s["kind"]].nq == 1]
        return ([hinge["lower"][i] for i in numbers], [hinge["upper"][i] for i in numbers]) if len(hinge["lower"]) else ([], [])

    def _one_coordinate(self) -> list[tuple[int, dict[str, Any]]]:
        """Return the places in q of subhinges with one coordinate, with the subhinge."""
        found, at = [], 0
        for subhinge in self._subhinges:
            size = _core.subhinge_kinds[subhinge["kind"]].nq
            found += [(at, subhinge)] if size == 1 else []
            at += size
        return found

    def starts(self, X: np.ndarray, guess: np.ndarray) -> Any:
        """Yield starts: the guess, screws turned to the travel of the pose, random configurations."""
        yield guess
        if not self.nv:
            return
        turned, placed = guess.copy(), self.pose(self.body, self.zero_q())
        for at, subhinge in self._one_coordinate():
            if subhinge["kind"] == "screw" and subhinge["pitch"]:
                turned[at] = placed[:3, :3] @ subhinge["axis"] @ (X[:3, 3] - placed[:3, 3]) / subhinge["pitch"]
        if not np.array_equal(turned, guess):
            yield turned
        for seed in range(STARTS):
            yield random_state(self, seed).q

    def nearest_turn(self, q: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """Return the same configuration with the angles of pins by whole turns, and quaternions by their sign, nearest to the guess."""
        q, at = np.array(q), 0
        for subhinge in self._subhinges:
            kind = _core.subhinge_kinds[subhinge["kind"]]
            if subhinge["kind"] == "pin":
                q[at] += 2 * np.pi * np.round((guess[at] - q[at]) / (2 * np.pi))
            elif kind.quaternion is not None:
                turned = slice(at + kind.quaternion, at + kind.quaternion + 4)
                q[turned] *= 1 if q[turned] @ guess[turned] >= 0 else -1
            at += kind.nq
        return q


def _descended(hinge: OneHinge, X: np.ndarray, q: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the end of the iteration from q, and the remainder of the pose there."""
    error = twist_between(hinge.pose(hinge.body, q), X)
    weights = np.r_[np.ones(3), np.full(3, 1 / scale)]
    for _ in range(STEPS if hinge.nv else 0):
        if _size(error, scale) <= ROUNDING:
            break
        step = np.linalg.lstsq(weights[:, None] * hinge.jacobian(hinge.body, q), weights * error, rcond=None)[0]
        for halving in range(HALVINGS):
            moved = hinge.integrate(q, 0.5**halving * step)
            left = twist_between(hinge.pose(hinge.body, moved), X)
            if np.linalg.norm(weights * left) < np.linalg.norm(weights * error):
                break
        else:
            return q, error
        q, error = moved, left
    return q, error


def _size(error: np.ndarray, scale: float) -> float:
    """Return the larger of rotation (rad) and translation over the scale of lengths (m)."""
    return max(float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:])) / scale)


@cache
def _free() -> _core.Multibody:
    model = _core.Multibody("pose", True, False)
    model._add_body("pose", "", "free", "", [], None, 0.0, None, None, None, 0.0, None, None, None, None, None)
    return model
