"""Rows of loops by differences in 60 digits of residuals that are written anew here, on poses of `FrameOracle`.

Residuals by angles and quaternions, velocities of points of contact by where the points go: nothing is shared with the core but what the
residuals are.
"""

import mpmath
import numpy as np

from pycraft.state import State
from support.frame_oracle import DIGITS, STEP, FrameOracle, inverse

Z = np.array([0, 0, 1])


def norm(x):
    return mpmath.sqrt(sum(a * a for a in x))


def frame_along(axis, point):
    """z along the axis, turned from z the short way (from -z, which is z turned about x, where that is nearer)."""
    axis = np.array([mpmath.mpf(float(a)) for a in axis])
    axis = axis / norm(axis)
    T = np.eye(4) * mpmath.mpf(1)
    sign = -1 if axis[2] < 0 else 1
    normal = np.cross(sign * Z, axis)
    if norm(normal) > 0:
        n, angle = normal / norm(normal), mpmath.asin(norm(normal))
        K = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
        T[:3, :3] = np.eye(3) + mpmath.sin(angle) * K + (1 - mpmath.cos(angle)) * (K @ K)
    T[:3, :3] = T[:3, :3] @ np.diag([1, sign, sign])
    T[:3, 3] = point
    return T


def quaternion(R):
    w = mpmath.sqrt(1 + R[0, 0] + R[1, 1] + R[2, 2]) / 2
    return w, np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * w)


def between(R):
    """The turn that brings z to where R has it, as 2 sin(half its angle) along its axis, x and y."""
    axis = np.cross(Z, R[:, 2])
    angle = mpmath.acos(R[2, 2])
    return (2 * mpmath.sin(angle / 2) * axis / norm(axis))[:2]


def on_curve(pieces, p):
    """(p - c) along both normals at the nearest place of a curve of coefficients (pieces, order, 6), by a root found in all digits."""

    def at(piece, u, order=0):
        factors = [mpmath.ff(k, order) * u ** max(k - order, 0) for k in range(len(piece))]
        return sum(factor * np.array([mpmath.mpf(float(x)) for x in row]) for factor, row in zip(factors, piece, strict=True))

    places = np.linspace(-1, 1, 41)
    near = np.vander(places, pieces.shape[1], increasing=True) @ pieces[:, :, :3]
    k, i = divmod(int(np.argmin(np.linalg.norm(near - np.array(p, float), axis=2))), len(places))
    piece, start = pieces[k], places[i]
    u = mpmath.findroot(lambda u: (p - at(piece, u)[:3]) @ at(piece, u, 1)[:3], start)
    off, t, m = p - at(piece, u)[:3], at(piece, u, 1)[:3], at(piece, u)[3:]
    first = np.cross(m, t)
    second = np.cross(t, first)
    return [first @ off / norm(first), second @ off / norm(second)]


class LoopOracle:
    """The rows of one loop at its model's present state."""

    def __init__(self, model, b, a, kind, given):
        self.frames = FrameOracle(model, model.q, model.v)
        self.state = State(np.array(model.q), np.array(model.v))
        self.b, self.a, self.kind, self.given = b, "base" if a is None else a, kind, given
        with mpmath.workdps(DIGITS):
            self.ends()

    def ends(self):
        """The end frames in a and in b, and the cosine between a universal hinge's axes."""
        given, one = self.given, np.eye(4) * mpmath.mpf(1)
        point = given.get("point", (0, 0, 0))
        axes = given.get("axes", [given["axis"]] * 2 if "axis" in given else [])
        if self.kind in ("ball", "gimbal", "wheel", "blade", "weld", "free", "surface", "curve"):
            in_a = in_b = frame_along(Z, point)
        else:
            in_a, in_b = (frame_along(axis, point) for axis in axes)
        self.end_a, self.end_b = one @ np.asarray(given.get("placement", np.eye(4))) @ in_a, in_b
        self.cosine = in_a[:3, 2] @ in_b[:3, 2]

    def X(self, t=0, then=None):
        return inverse(self.end_a) @ self.frames.pose(self.b, self.a, t, then) @ self.end_b

    def positions(self, t=0, then=None):
        X, kind = self.X(t, then), self.kind
        R, p, given = X[:3, :3], X[:3, 3], self.given
        if kind in ("weld", "slider"):
            return [*(2 * quaternion(R)[1]), *p[: 3 if kind == "weld" else 2]]
        if kind in ("pin", "cylindrical"):
            return [*between(R), *p[: 3 if kind == "pin" else 2]]
        if kind == "planar":
            return [*between(R), p[2]]
        if kind == "screw":
            w, epsilon = quaternion(R)
            off = p[2] - mpmath.mpf(given["pitch"]) * 2 * mpmath.atan2(epsilon[2], w)
            turn = 2 * mpmath.pi * mpmath.mpf(given["pitch"])
            return [*between(R), p[0], p[1], off - turn * mpmath.nint(off / turn)]
        if kind == "universal":
            return [R[2, 2] - self.cosine, *p]
        if kind == "surface":
            return [p @ given["A"] @ p + np.asarray(given["b"]) @ p + given["c"]]
        if kind == "curve":
            return on_curve(given["pieces"], p)
        if kind == "wheel":
            return [p[2] - mpmath.mpf(given["radius"]) * mpmath.sin(mpmath.acos(R[2, 2]))]
        if kind == "ball" and "radius" in given:
            return [p[2] - mpmath.mpf(given["radius"])]
        return [] if kind == "blade" else list(p)

    def speeds(self, t=0, then=None):
        """Of rows of velocities: how fast the point moves that touches at t, along the motion or, if given, along `then`."""
        X = self.X(t)
        if self.kind == "blade":
            directions, arm = [X[:3, 2]], np.zeros(3)
        elif self.kind == "wheel":
            level = np.cross(X[:3, 2], Z)
            forward = level / norm(level)
            arm = mpmath.mpf(self.given["radius"]) * np.cross(X[:3, 2], forward)  # down, across the axle
            directions = [forward, np.cross(Z, forward)]
        elif "radius" in self.given:
            arm, directions = -mpmath.mpf(self.given["radius"]) * Z, [np.array([1, 0, 0]), np.array([0, 1, 0])]
        else:
            return []
        own = np.array([*(X[:3, :3].T @ arm), 1])  # the point of the moving frame that touches
        if then is None:
            ahead, behind = self.X(t + STEP), self.X(t - STEP)
        else:
            ahead, behind = self.X(t, then), self.X(t, -then)
        moved = ((ahead - behind) @ own)[:3] / (2 * STEP)
        return [d @ moved for d in directions]

    def residual(self):
        with mpmath.workdps(DIGITS):
            return [float(x) for x in self.positions()] + [0.0] * len(self.speeds())

    def jacobian(self):
        with mpmath.workdps(DIGITS):
            columns = []
            for along in np.eye(self.frames.nv):
                ahead, behind = self.positions(0, along), self.positions(0, -along)
                columns.append([(x - y) / (2 * STEP) for x, y in zip(ahead, behind, strict=True)] + self.speeds(0, along))
            return np.array(columns, float).T

    def bias(self):
        """r̈ at v̇ = 0, and the rate of the speeds."""
        with mpmath.workdps(DIGITS):
            ahead, now, behind = self.positions(STEP), self.positions(), self.positions(-STEP)
            second = [(x - 2 * y + z) / STEP**2 for x, y, z in zip(ahead, now, behind, strict=True)]
            return [
                float(x) for x in [*second, *((x - y) / (2 * STEP) for x, y in zip(self.speeds(STEP), self.speeds(-STEP), strict=True))]
            ]


def assert_close(got, expected, scale=1.0):
    """To 2000 eps of the largest entry beside 1, as frames are (tests/models/test_frames.py), times `scale`."""
    expected = np.array(expected, float)
    assert got.shape == expected.shape
    error = np.abs(got - expected).max(initial=0) / (1 + np.abs(expected).max(initial=0))
    assert error <= 2000 * np.finfo(float).eps * scale, f"off by {error:.1e}"


def check_against(oracle, loop, scale=1000.0):
    """A loop's rows at the oracle's state, in double and quad."""
    for precision in ("double", "quad"):
        assert_close(loop.residual(oracle.state, precision=precision), oracle.residual())
        assert_close(loop.jacobian(oracle.state, precision=precision), oracle.jacobian(), scale)
        assert_close(loop.bias(oracle.state, precision=precision), oracle.bias(), scale)
