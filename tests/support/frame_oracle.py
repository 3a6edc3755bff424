"""Frames by differences of poses in 60 digits: `pycraft.reference` has the hinges, and nothing else is of the package.

Along a motion with velocities v and accelerations v̇ at time zero every hinge stands at step(q) exp(u), u = v t + ½ v̇ t² along the rows of H
of each subhinge: on the group its twist is then v and the rate of that v̇, at t = 0. Differences are central with a step of 10⁻¹²: their
error is near 10⁻²⁴ of the poses' derivatives, and what the digits round off 10⁻³⁶, so they count as exact.
"""

import mpmath
import numpy as np

from pycraft.reference.spatial import Q_SIZE, V_SIZE, hinge_sizes, in_the_numbers_of, pose, skew, split, subhinge_rows, subhinge_step

DIGITS, STEP = 60, mpmath.mpf(10) ** -12


def inverse(X):
    R = X[:3, :3].T
    return pose(R, -R @ X[:3, 3])


def six(A):
    """(ω; v) of a matrix of se(3)."""
    return np.array([A[2, 1], A[0, 2], A[1, 0], A[0, 3], A[1, 3], A[2, 3]])


def small_exponential(A):
    """exp(A) of a matrix near 10⁻¹²: the terms left out are below 10⁻⁶⁰."""
    power, total = A, np.eye(4) + A
    for n in range(2, 5):
        power = power @ A / n
        total = total + power
    return total


def hat(V):
    return np.block([[skew(V[:3]), V[3:, None]], [np.zeros((1, 4))]])


class FrameOracle:
    """Frames of a model at one state. `moved`: of loose frames what they stand on, and their poses at a time in mpmath numbers."""

    def __init__(self, model, q, v=None, vdot=None, moved=None, t=0.0):
        with mpmath.workdps(DIGITS):
            self.one = mpmath.mpf(1)
            self.q = np.asarray(q, float) * self.one
            plain = {key: value for key, value in model.description().items() if key not in ("frames", "loops")}
            self.description = in_the_numbers_of(self.q, plain) if len(self.q) else plain
        self.nv, self.t = model.nv, mpmath.mpf(t)
        self.v, self.vdot = (np.zeros(self.nv) if x is None else np.asarray(x, float) for x in (v, vdot))
        self.moved = moved or {}
        bodies = self.description["bodies"]
        self.number = {body["name"]: k for k, body in enumerate(bodies)}
        self.nodes = {node["name"]: node for node in self.description["nodes"]}
        self.q_of = split(self.q, hinge_sizes(self.description, Q_SIZE))
        self.kept = {}
        with mpmath.workdps(DIGITS):
            self.steps = [self._steps(k) for k in range(len(bodies))]
        self.slices = np.cumsum([0, *hinge_sizes(self.description, V_SIZE)])

    def world(self, name, t, then):
        """The pose of a frame at time t, moved on along `then` (nv,) by a step."""
        if name in self.moved:
            on, function = self.moved[name]
            return self.world(on, t, then) @ function(self.t + t)
        if name in self.nodes:
            node = self.nodes[name]
            return self.body(node["body"], t, then) @ pose(node["rotation"], node["position"])
        return self.body(self.number.get(name, -1), t, then)

    def _steps(self, k):
        """Return the pose at the state and the rows of each subhinge of body k, with the placement before the first."""
        hinge, q, out = self.description["bodies"][k]["hinge"], self.q_of[k], []
        X = pose(**hinge["placement"])
        for subhinge in hinge["subhinges"]:
            n = Q_SIZE[subhinge["kind"]]
            out.append((X @ subhinge_step(subhinge, q[:n]), subhinge_rows(subhinge)))
            X, q = np.eye(4), q[n:]
        return out or [(X, np.zeros((0, 6)))]

    def body(self, k, t, then):
        if k < 0:
            return np.eye(4) * self.one
        key = (k, t, then.tobytes())
        if key not in self.kept:
            X, at = self.body(self.description["bodies"][k]["parent"], t, then), self.slices[k]
            u = self.v * t + self.vdot * t * t / 2
            for step, rows in self.steps[k]:
                X = X @ step
                for along in (u[at : at + len(rows)], then[at : at + len(rows)] * STEP):
                    if any(x != 0 for x in along):
                        X = X @ small_exponential(hat(rows.T @ along))
                at += len(rows)
            self.kept[key] = X
        return self.kept[key]

    def pose(self, a, b, t=0, then=None):
        then = np.zeros(self.nv) if then is None else then
        return inverse(self.world(b, t, then)) @ self.world(a, t, then)

    def velocity(self, a, b):
        X = self.pose(a, b)
        return six(inverse(X) @ (self.pose(a, b, STEP) - self.pose(a, b, -STEP)) / (2 * STEP))

    def acceleration(self, a, b):
        """X⁻¹Ẍ = Ŵ + V̂², W = V̇."""
        X, V = self.pose(a, b), self.velocity(a, b)
        second = (self.pose(a, b, STEP) - 2 * X + self.pose(a, b, -STEP)) / STEP**2
        return six(inverse(X) @ second - hat(V) @ hat(V))

    def jacobian(self, a, b, i, t=0):
        """Column i at a time t of the motion."""
        along = np.eye(self.nv)[i]
        return six(inverse(self.pose(a, b, t)) @ (self.pose(a, b, t, along) - self.pose(a, b, t, -along)) / (2 * STEP))

    def in_axes(self, a, b, axes, V, t=0):
        """A velocity or a column at a time t, in other axes: "body", "aligned", "world", or those of a third frame."""
        if axes == "body":
            return V
        X = self.pose(a, b if axes in ("aligned", "world") else axes, t)
        R, p = X[:3, :3], X[:3, 3]
        turned = np.concatenate([R @ V[:3], R @ V[3:]])
        return turned if axes != "world" else np.concatenate([turned[:3], turned[3:] + np.cross(p, turned[:3])])

    def jacobian_dot(self, a, b, i, axes="body"):
        """The rate of column i in these axes."""
        ahead, behind = (self.in_axes(a, b, axes, self.jacobian(a, b, i, t), t) for t in (STEP, -STEP))
        return (ahead - behind) / (2 * STEP)
