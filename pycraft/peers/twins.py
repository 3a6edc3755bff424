"""The same robot in another package, on our coordinates: the part of Pinocchio, MuJoCo and another model of ours in `compare`.

Velocities of the two are related by the orthogonal matrix T(q), v_theirs = T v; forces follow by duality, τ_theirs = T τ.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..interop import mujoco as mujoco_convention
from ..interop import pinocchio as pinocchio_convention
from ..models.loaders import mjcf_effects
from .effects_apart import Apart, effects_apart


class BodyData(NamedTuple):
    """A moving body with everything welded to it: the pose (4, 4) of its frame in the world; mass, centre of mass, inertia about it."""

    pose: np.ndarray
    mass: float
    com: np.ndarray
    inertia: np.ndarray

    def seen_from(self, X: np.ndarray) -> BodyData:
        """Return the data in a frame relative to which this body's frame has the pose X (4, 4)."""
        R, p = X[:3, :3], X[:3, 3]
        return BodyData(self.pose @ np.linalg.inv(X), self.mass, R @ self.com + p, R @ self.inertia @ R.T)


class Twin(ABC):
    """Another model of the same robot. `gravity` (3,), `armature` (nv,) in our order; arrays are on our coordinates."""

    name: str
    gravity: np.ndarray
    armature: np.ndarray

    @abstractmethod
    def velocities(self, q: np.ndarray) -> np.ndarray:
        """Return T (nv, nv)."""

    @abstractmethod
    def mass_matrix(self, q: np.ndarray) -> np.ndarray: ...

    @abstractmethod
    def inverse_dynamics(self, q: np.ndarray, v: np.ndarray, vdot: np.ndarray) -> np.ndarray: ...

    @abstractmethod
    def forward_dynamics(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray: ...

    @abstractmethod
    def bodies(self, q: np.ndarray) -> dict[str, BodyData]:
        """Return moving bodies by our names."""

    @abstractmethod
    def conventions(self) -> list[tuple[str, str]]:
        """Return the differences between the two packages' conventions."""

    def lacks_rotor_forces(self) -> np.ndarray:
        """Return where (nv,) the other package omits v ×* (J v) of rotors from the equations of motion (docs/conventions.md)."""
        return np.zeros(len(self.armature), bool)

    def effects_apart(self, states: Sequence[Any]) -> list[Apart]:  # noqa: ARG002 - subclasses need it
        """Return the differences between the effects of the two models' files; `states` are the compared states."""
        return []


def _order(ours: list[str], theirs: list[str]) -> list[tuple[str, str]]:
    """Return the first difference between two orders of the same joints."""
    if ours == theirs:
        return []
    k = next(k for k, (a, b) in enumerate(zip(ours, theirs, strict=False)) if a != b)
    after = f"after {ours[k - 1]} " if k else "first "
    return [("order", f"of joints: {after}comes {ours[k]} here, {theirs[k]} there")]


_QUATERNION = ("quaternion", "(w, x, y, z) here, (x, y, z, w) there")


class OwnTwin(Twin):
    """Another model of this package: a file read again, or a model built by hand."""

    def __init__(self, model: Any, other: Any):
        missing = set(model.hinges) ^ set(other.hinges)
        if missing:
            raise _core.ModelError(f"hinges {', '.join(sorted(missing))} are in one of {model.name!r} and {other.name!r} alone")
        for name, hinge in model.hinges.items():
            if hinge.kind != other.hinges[name].kind:
                raise _core.ModelError(
                    f"hinge {name!r} is a {hinge.kind} in {model.name!r} and a {other.hinges[name].kind} in the other model"
                )
        self.model, self.other, self.name = model, other, f"{other.name} there"
        self._q, self._v = (
            np.concatenate([np.arange(s.start, s.stop) for s in slices] or [np.arange(0)]).astype(int)
            for slices in (
                [model.hinges[name].q_slice for name in other.hinges],
                [model.hinges[name].v_slice for name in other.hinges],
            )
        )
        self.gravity = np.asarray(other.gravity)
        self.armature = np.zeros(model.nv)
        for name, hinge in other.hinges.items():
            self.armature[model.hinges[name].v_slice] = hinge.rotor_inertia

    def velocities(self, q):
        return np.eye(self.model.nv)[self._v]

    def mass_matrix(self, q):
        out = np.empty((self.model.nv,) * 2)
        out[np.ix_(self._v, self._v)] = self.other.mass_matrix(q[self._q])
        return out

    def inverse_dynamics(self, q, v, vdot):
        return self._back(self.other.inverse_dynamics(q[self._q], v[self._v], vdot[self._v]))

    def forward_dynamics(self, q, v, tau):
        return self._back(self.other.forward_dynamics(q[self._q], v[self._v], tau[self._v]))

    def _back(self, x):
        out = np.empty(self.model.nv)
        out[self._v] = x
        return out

    def bodies(self, q):
        own = q[self._q]
        of_hinge = {body.hinge.name: body for body in self.other.bodies.values()}
        return {
            body.name: BodyData(self.other.pose(twin.name, own), twin.mass, twin.com, twin.inertia)
            for body in self.model.bodies.values()
            if (twin := of_hinge.get(body.hinge.name)) is not None
        }

    def conventions(self):
        return _order(list(self.model.hinges), list(self.other.hinges))

    def effects_apart(self, states):
        return effects_apart(self.model, self.other)


class PinocchioTwin(Twin):
    """A `pinocchio.Model`."""

    def __init__(self, model: Any, other: Any):
        self.model, self.other = model, other
        self._map = pinocchio_convention.coordinates(model, other)
        self._data = other.createData()
        self.name = f"{other.name or model.name} in Pinocchio"
        self.gravity = np.array(other.gravity.linear)
        self.armature = np.abs(self._map.velocities(np.zeros(model.nq)).T) @ np.asarray(other.armature)

    def lacks_rotor_forces(self):
        return np.ones(self.model.nv, bool)

    def velocities(self, q):
        return self._map.velocities(q)

    def mass_matrix(self, q):
        import pinocchio

        T = self.velocities(q)
        upper = np.triu(pinocchio.crba(self.other, self._data, self._map.q(q)))  # the lower triangle is not filled
        return T.T @ (upper + np.triu(upper, 1).T) @ T

    def _velocity_product(self, q, v):
        """Return Ṫv: 0, except for planar joints, with velocities that turn with them."""
        return self._map.velocity_rate(q, v) @ v

    def inverse_dynamics(self, q, v, vdot):
        import pinocchio

        T = self.velocities(q)
        return T.T @ pinocchio.rnea(self.other, self._data, self._map.q(q), T @ v, T @ vdot + self._velocity_product(q, v))

    def forward_dynamics(self, q, v, tau):
        import pinocchio

        T = self.velocities(q)
        return T.T @ (pinocchio.aba(self.other, self._data, self._map.q(q), T @ v, T @ tau) - self._velocity_product(q, v))

    def bodies(self, q):
        import pinocchio

        pinocchio.forwardKinematics(self.other, self._data, self._map.q(q))
        joint_of = {own: joint for own, joint in self._map.joint_numbers()}
        found = {}
        for body in self.model.bodies.values():
            joint = joint_of.get(body.hinge.name)
            if joint is not None:
                inertia = self.other.inertias[joint]
                found[body.name] = BodyData(
                    np.array(self._data.oMi[joint].homogeneous), inertia.mass, np.array(inertia.lever), np.array(inertia.inertia)
                )
        return found

    def conventions(self):
        moving = [name for name, hinge in self.model.hinges.items() if hinge.v_slice.stop > hinge.v_slice.start]
        found = _order(moving, [own for own, _ in self._map.joint_numbers()])
        kinds = {s["kind"] for hinge in self.model.hinges.values() for s in hinge.subhinges}
        if kinds & {"ball", "free"}:
            found.append(_QUATERNION)
        if "free" in kinds:
            found.append(
                ("free joints", "q (quaternion, position), v (ω; v) here; (position, quaternion), (v; ω) there, both in body axes")
            )
        found += [("joint", text) for text in self._map.said()]
        return found


class MuJoCoTwin(Twin):
    """A `mujoco.MjModel`: its rigid-body dynamics; springs, dampers and the like are compared by their parameters."""

    def __init__(self, model: Any, other: Any):
        import mujoco

        self.model, self.other = model, other
        self._data = mujoco.MjData(other)
        self.name = f"{mujoco_convention.name_of(other)} in MuJoCo"
        self.gravity = mjcf_effects.gravity(other)
        self._q, self._v, self._joints = mujoco_convention.order(model, other)
        self.armature = np.empty(model.nv)
        self.armature[mujoco_convention.permutation(model)[1]] = mjcf_effects.armature(other)[self._v]

    def lacks_rotor_forces(self):
        balls = [hinge.v_slice for hinge in self.model.hinges.values() if any(s["kind"] == "ball" for s in hinge.subhinges)]
        return np.isin(np.arange(self.model.nv), [j for of in balls for j in range(of.start, of.stop)])

    def _move(self, q, v):
        import mujoco

        qpos, qvel = mujoco_convention.to_mujoco(self.model, q, v)
        self._data.qpos[self._q], self._data.qvel[self._v] = qpos, qvel
        mujoco.mj_kinematics(self.other, self._data)
        mujoco.mj_comPos(self.other, self._data)
        mujoco.mj_comVel(self.other, self._data)
        mujoco.mj_crb(self.other, self._data)

    def velocities(self, q):
        T = np.empty((self.model.nv,) * 2)
        T[self._v] = mujoco_convention.velocity_map(self.model, q)
        return T

    def _full_mass_matrix(self):
        import mujoco

        M = np.empty((self.model.nv,) * 2)
        mujoco.mj_fullM(self.other, self._data, M)
        return M

    def mass_matrix(self, q):
        self._move(q, np.zeros(self.model.nv))
        T = self.velocities(q)
        return T.T @ self._full_mass_matrix() @ T

    def _bias(self):
        import mujoco

        out = np.empty(self.model.nv)
        mujoco.mj_rne(self.other, self._data, 0, out)
        return out

    def _drift(self, q, v):
        """Return Ṫv in MuJoCo's order: the linear acceleration of a free joint belongs to its origin."""
        out = np.empty(self.model.nv)
        out[self._v] = mujoco_convention.acceleration_to_mujoco(self.model, q, v, np.zeros(self.model.nv))
        return out

    def inverse_dynamics(self, q, v, vdot):
        self._move(q, v)
        T = self.velocities(q)
        return T.T @ (self._full_mass_matrix() @ (T @ vdot + self._drift(q, v)) + self._bias())

    def forward_dynamics(self, q, v, tau):
        self._move(q, v)
        T = self.velocities(q)
        return T.T @ (np.linalg.solve(self._full_mass_matrix(), T @ tau - self._bias()) - self._drift(q, v))

    def bodies(self, q):
        self._move(q, np.zeros(self.model.nv))
        m, d = self.other, self._data
        found = {}
        for body in self.model.bodies.values():
            joint = self._joints.get(body.hinge.name)
            if joint is None:
                continue
            moving = int(m.jnt_bodyid[joint])
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = d.xmat[moving].reshape(3, 3), d.xpos[moving]
            parts = [k for k in range(m.nbody) if m.body_weldid[k] == moving]
            found[body.name] = _together(pose, [(m.body_mass[k], d.xipos[k], d.ximat[k].reshape(3, 3), m.body_inertia[k]) for k in parts])
        return found

    def conventions(self):
        import mujoco

        names = [mujoco.mj_id2name(self.other, mujoco.mjtObj.mjOBJ_JOINT, j) or f"joint {j}" for j in range(self.other.njnt)]
        ours = [s for hinge in self.model.hinges.values() for s in mujoco_convention.joint_names(hinge)]
        found = _order(ours, names)
        if any(s["kind"] == "free" for hinge in self.model.hinges.values() for s in hinge.subhinges):
            found.append(
                (
                    "free joints",
                    "q (quaternion, position), v (ω; v) in body axes here; (position, quaternion), (v; ω) with v in world axes there",
                )
            )
        return found

    def effects_apart(self, states):
        from ..models.loaders import mjcf

        try:
            theirs = mjcf.of_compiled(self.other, self.name)
        except _core.ModelError as error:
            return [Apart("effects", f"those of MuJoCo's model cannot be read: {error}", True)]
        return effects_apart(self.model, theirs, any(self._one_sided_act(state) for state in states))

    def _one_sided_act(self, state):
        """Check that a contact or a stop at a limit acts at a state."""
        import mujoco

        qpos, qvel = mujoco_convention.to_mujoco(self.model, state.q, state.v)
        self._data.qpos[self._q], self._data.qvel[self._v] = qpos, qvel
        mujoco.mj_forward(self.other, self._data)
        kinds = mujoco.mjtConstraint
        both_sides = {int(kind) for kind in (kinds.mjCNSTR_EQUALITY, kinds.mjCNSTR_FRICTION_DOF, kinds.mjCNSTR_FRICTION_TENDON)}
        rows = self._data.efc_type[: self._data.nefc]
        return any(self._data.efc_force[row] for row, kind in enumerate(rows) if int(kind) not in both_sides)


def _together(pose: np.ndarray, parts: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]]) -> BodyData:
    """Return bodies (mass, centre and principal axes in the world, principal inertias) as one, in the frame at `pose`."""
    mass = float(sum(m for m, *_ in parts))
    centre = sum((m * c for m, c, *_ in parts), np.zeros(3)) / mass if mass > 0 else pose[:3, 3]
    inertia = np.zeros((3, 3))
    for m, c, R, principal in parts:
        d = c - centre
        inertia += R @ np.diag(principal) @ R.T + m * (d @ d * np.eye(3) - np.outer(d, d))
    R = pose[:3, :3]
    return BodyData(pose, mass, R.T @ (centre - pose[:3, 3]), R.T @ inertia @ R)
