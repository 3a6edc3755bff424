"""The given blocks of a model as functions of its coordinates: E(p,k), H(k), Ḣ(k) and θ̇(k) as traced numbers.

Letters that do not depend on the state (M, J, the nodes' B, ...) are constants and are not computed here.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce
from itertools import islice
from typing import Any

import numpy as np

from .. import _core
from ..models.multibody import describe
from .trace import Graph, Traced

_KINDS = _core.subhinge_kinds


def skew(a: np.ndarray) -> np.ndarray:
    """ã: ã b = a × b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]], object)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a × b."""
    return skew(a) @ b


def _block(upper: list[np.ndarray], lower: list[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.concatenate(upper, axis=1), np.concatenate(lower, axis=1)])


_ZERO, _ONE = np.full((3, 3), 0.0, object), np.array(np.eye(3).tolist(), object)

Pose = tuple[np.ndarray, np.ndarray]
"""Pose of a frame in another: R (3, 3) and l (3,)."""


def composed(first: Pose, second: Pose) -> Pose:
    """Return the composition of two poses, the second given in the frame of the first."""
    return first[0] @ second[0], first[1] + first[0] @ second[1]


def force_transform(pose: Pose) -> np.ndarray:
    """Return φ of a pose: [[R, l̃R], [0, R]] transforms forces (n; f) from the frame to its reference frame."""
    R, l = pose
    return _block([R, skew(l) @ R], [_ZERO, R])


def rotation_of(q: list[Traced]) -> np.ndarray:
    """Return R(q) of a quaternion w, x, y, z of any nonzero length."""
    w, x, y, z = q
    k = 2.0 / (w * w + x * x + y * y + z * z)
    kx, ky, kz = k * x, k * y, k * z
    return np.array(
        [
            [1.0 - (ky * y + kz * z), kx * y - kz * w, kx * z + ky * w],
            [kx * y + kz * w, 1.0 - (kx * x + kz * z), ky * z - kx * w],
            [kx * z - ky * w, ky * z + kx * w, 1.0 - (kx * x + ky * y)],
        ],
        object,
    )


def _step(subhinge: dict[str, Any], q: list[Traced]) -> Pose:
    """Return the pose of the frame after a subhinge in the frame before it. About an axis a: cos q I + sin q ã + (1 - cos q) a a*."""
    kind, a, c = subhinge["kind"], _numbers(subhinge["axis"]), _numbers(subhinge["point"])
    match kind:
        case "slider":
            return _ONE, a * q[0]
        case "free":
            return rotation_of(q[:4]), np.array(q[4:], object)
        case "ball":
            R = rotation_of(q)
            return R, c - R @ c
    cosine, sine = q[0].function("cosine"), q[0].function("sine")
    R = _ONE * cosine + skew(a) * sine + np.outer(a, a) * (1.0 - cosine)
    travel = a * (q[0] * subhinge["pitch"]) if kind == "screw" else 0.0 * a
    return R, c - R @ c + travel


def _rows(subhinge: dict[str, Any]) -> np.ndarray:
    """Return rows of H in the frame after the subhinge: pin (a; c×a), slider (0; a), screw (a; c×a + pitch a), ball (e; c×e), free I."""
    kind, a, c = subhinge["kind"], _numbers(subhinge["axis"]), _numbers(subhinge["point"])
    none = np.full(3, 0.0, object)
    match kind:
        case "free":
            return np.array(np.eye(6).tolist(), object)
        case "ball":
            return np.array([[*e, *cross(c, e)] for e in _ONE], object)
        case "slider":
            return np.array([[*none, *a]], object)
    moved = cross(c, a) + a * subhinge["pitch"] if kind == "screw" else cross(c, a)
    return np.array([[*a, *moved]], object)


def _numbers(x: Any) -> np.ndarray:
    return np.array([float(e) if abs(e) > 8 * np.finfo(float).eps else 0.0 for e in np.ravel(x)], object)


def crm(h: np.ndarray) -> np.ndarray:
    """[[ω̃, 0], [ṽ, ω̃]] of a motion (ω; v)."""
    w, v = skew(h[:3]), skew(h[3:])
    return _block([w, _ZERO], [v, w])


class Kinematics:
    """Kinematics hinge by hinge at traced coordinates.

    Attributes
    ----------
    poses : pose of each body in its parent
    H, H_dot : (n, 6) arrays of objects, body by body
    theta_dot : rates of each body's coordinates
    """

    def __init__(self, model: Any, graph: Graph):
        description = describe(model)
        q, v = iter(graph.inputs("q", model.nq)), iter(graph.inputs("v", model.nv))
        self.poses: list[Pose] = []
        self.H: list[np.ndarray] = []
        self.H_dot: list[np.ndarray] = []
        self.theta_dot: list[list[Traced]] = []
        for body in description["bodies"]:
            self._add(body["hinge"], q, v)

    def _add(self, hinge: dict[str, Any], q: Iterator[Traced], v: Iterator[Traced]) -> None:
        subhinges = hinge["subhinges"]
        steps = [_step(s, list(islice(q, _KINDS[s["kind"]].nq))) for s in subhinges]
        rates = [list(islice(v, _KINDS[s["kind"]].nv)) for s in subhinges]
        R, l = hinge["placement"]["rotation"], hinge["placement"]["position"]
        place = _numbers(R).reshape(3, 3), _numbers(l)
        self.poses.append(reduce(composed, steps, place))
        rows: list[np.ndarray] = []
        changes: list[np.ndarray] = []
        later: Pose = (_ONE, np.full(3, 0.0, object))
        moving = np.full(6, 0.0, object)  # of the body relative to the frame after this subhinge, in the body's frame
        for subhinge, step, rate in reversed(list(zip(subhinges, steps, rates, strict=True))):
            own = _rows(subhinge) @ force_transform(later)
            rows[:0] = list(own)
            changes[:0] = [crm(h) @ moving for h in own]
            moving = moving + sum((h * x for h, x in zip(own, rate, strict=True)), np.full(6, 0.0, object))
            later = composed(step, later)
        self.H.append(np.array(rows, object).reshape(-1, 6))
        self.H_dot.append(np.array(changes, object).reshape(-1, 6))
        self.theta_dot.append([x for rate in rates for x in rate])
