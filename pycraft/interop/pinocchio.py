"""Pinocchio's conventions: order of joints, quaternions (x, y, z, w), linear part first, cosine and sine of continuous joints.

Pinocchio (package `pin`, extra [peers]) is imported only when a function here is called.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from .described import Described, described, theirs
from .packages import required

_SWAP = np.array([3, 4, 5, 0, 1, 2])
"""Permutation from angular-first to linear-first order."""


def build(path: str, root: str = "fixed") -> Any:
    """Return Pinocchio's model of a URDF file, with a free flyer for root="free"."""
    pinocchio = required("pinocchio", "peers", "comparison with Pinocchio needs")

    if root not in ("fixed", "free"):
        raise _core.ModelError(f"root={root!r:.60}: there are 'fixed' and 'free'")
    if not isinstance(path, (str, Path)) or not Path(path).is_file():
        raise _core.ModelError(f"{path!r:.60} is not a file")
    try:
        return pinocchio.buildModelFromUrdf(str(path), *([pinocchio.JointModelFreeFlyer()] if root == "free" else []))
    except ValueError as error:
        raise _core.ModelError(f"{path}: Pinocchio refuses the file: {error}") from None


@dataclass
class Coordinates:
    """The coordinates of a model in Pinocchio's model of the same file.

    `q(q)` converts configurations, `velocities(q)` is the orthogonal matrix S with v_pinocchio = S v; so ℳ_pinocchio = S ℳ S*.
    """

    model: Described
    pin_model: Any
    joints: list[tuple[int, str, slice, slice]]

    def q(self, q: np.ndarray) -> np.ndarray:
        """Return a configuration (nq,) in Pinocchio's order."""
        out = np.zeros(self.pin_model.nq)
        for joint, _, q_slice, _ in self.joints:
            at = self.pin_model.joints[joint].idx_q
            for part, own in self._parts(joint, q[q_slice], _OWN_Q):
                numbers = _configuration(part, own)
                out[at : at + len(numbers)] = numbers
                at += len(numbers)
        return out

    def velocities(self, q: np.ndarray) -> np.ndarray:
        """Return S (nv, nv): velocities of the model to Pinocchio's."""
        return self._by_joint(q, lambda part, own: _velocity_block(part, own))

    def velocity_rate(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return Ṡ (nv, nv) at velocity v: zero except for planar joints, with velocities in the body's axes in Pinocchio."""
        rate = np.zeros((self.pin_model.nv, self.model.nv))
        if any("Planar" in name for name in self.said_names()):
            for joint, _, q_slice, v_slice in self.joints:
                if "Planar" in _shortname(self.pin_model.joints[joint]):
                    c, s = np.cos(q[q_slice][2]), np.sin(q[q_slice][2])
                    at = self.pin_model.joints[joint].idx_v
                    rate[at : at + 2, v_slice.start : v_slice.start + 2] = v[v_slice][2] * np.array([[-s, c], [-c, -s]])
        return rate

    def joint_numbers(self) -> list[tuple[str, int]]:
        """Return hinges with their joint's number in Pinocchio, in Pinocchio's order."""
        return [(name, joint) for joint, name, _, _ in self.joints]

    def said_names(self) -> set[str]:
        """Return the kinds of Pinocchio's joints."""
        return {_shortname(part) for joint, *_ in self.joints for part in _components(self.pin_model.joints[joint])}

    def said(self) -> list[str]:
        """Return the differences in how Pinocchio writes the coordinates of single joints."""
        found = []
        if any("Planar" in name for name in self.said_names()):
            found.append("planar: (x, y, angle) here; (x, y, cos, sin) there, velocities in the body's axes")
        if any(_unbounded(name) for name in self.said_names()):
            found.append("continuous: one angle here, its cosine and sine there")
        return found

    def _parts(self, joint: int, own: np.ndarray, sizes: dict[str, int]) -> Any:
        at = 0
        for part in _components(self.pin_model.joints[joint]):
            size = sizes.get(_shortname(part), 1)
            yield part, own[at : at + size]
            at += size

    def _by_joint(self, q: np.ndarray, block: Any) -> np.ndarray:
        S = np.zeros((self.pin_model.nv, self.model.nv))
        for joint, _, q_slice, v_slice in self.joints:
            row, column = self.pin_model.joints[joint].idx_v, v_slice.start
            for part, own in self._parts(joint, q[q_slice], _OWN_Q):
                B = block(part, own)
                S[row : row + len(B), column : column + len(B)] = B
                row, column = row + len(B), column + len(B)
        return S


_OWN_Q = {"JointModelFreeFlyer": 7, "JointModelSpherical": 4, "JointModelPlanar": 3}
"""Number of entries of q here by Pinocchio's kind of joint; default: one."""
_VELOCITIES = {"JointModelFreeFlyer": 6, "JointModelSpherical": 3, "JointModelPlanar": 3}


def _shortname(joint: Any) -> str:
    return joint.shortname()


def _components(joint: Any) -> list[Any]:
    """Return the joints of a composite one, in order; for any other, itself."""
    return list(joint.extract().joints) if _shortname(joint) == "JointModelComposite" else [joint]


def _unbounded(name: str) -> bool:
    return name.startswith("JointModelRUB") or "Unbounded" in name


def _configuration(joint: Any, own: np.ndarray) -> list[float]:
    """Return our coordinates of one simple joint as Pinocchio writes them."""
    name = _shortname(joint)
    if name == "JointModelFreeFlyer":
        return [*own[4:7], *_unit(own[[1, 2, 3, 0]])]
    if name == "JointModelSpherical":
        return list(_unit(own[[1, 2, 3, 0]]))
    if name == "JointModelPlanar":
        return [own[0], own[1], np.cos(own[2]), np.sin(own[2])]
    return [np.cos(own[0]), np.sin(own[0])] if _unbounded(name) else [own[0]]


def _velocity_block(joint: Any, own: np.ndarray) -> np.ndarray:
    """Return S of one simple joint."""
    name = _shortname(joint)
    if name == "JointModelFreeFlyer":
        return np.eye(6)[_SWAP]
    if name == "JointModelPlanar":
        c, s = np.cos(own[2]), np.sin(own[2])
        return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return np.eye(_VELOCITIES.get(name, 1))


def _unit(quaternion: np.ndarray) -> np.ndarray:
    return quaternion / np.linalg.norm(quaternion)


def coordinates(model: Described, pin_model: Any) -> Coordinates:
    """Match hinges and joints by name. Raises ModelError for a joint that only one of the two has."""
    hinges = described(model, "coordinates").hinges
    joints = []
    for j in range(1, theirs(pin_model, "njoints", "coordinates", "a model of Pinocchio's").njoints):
        name = pin_model.names[j]
        own = "root" if name == "root_joint" and "root" in hinges and "root_joint" not in hinges else name
        if own not in hinges:
            raise _core.ModelError(f"Pinocchio's joint {name!r} has no hinge of that name in {model.name!r}")
        hinge = hinges[own]
        joint = pin_model.joints[j]
        if joint.nv != hinge.v_slice.stop - hinge.v_slice.start:
            raise _core.ModelError(
                f"joint {name!r} has {joint.nv} velocities in Pinocchio and {hinge.v_slice.stop - hinge.v_slice.start} here"
            )
        joints.append((j, own, hinge.q_slice, hinge.v_slice))
    missing = {name for name in hinges if hinges[name].v_slice.stop > hinges[name].v_slice.start} - {name for _, name, *_ in joints}
    if missing:
        raise _core.ModelError(f"hinges {', '.join(sorted(missing))} of {model.name!r} have no joint in Pinocchio's model")
    return Coordinates(model, pin_model, joints)


def jacobian(pin_model: Any, data: Any, q: np.ndarray, frame: str) -> np.ndarray:
    """Return Pinocchio's Jacobian of a link frame, in its own axes, with rows in angular-first order."""
    pinocchio = required("pinocchio", "peers", "comparison with Pinocchio needs")

    index = pin_model.getFrameId(frame, pinocchio.FrameType.BODY)
    return pinocchio.computeFrameJacobian(pin_model, data, q, index, pinocchio.ReferenceFrame.LOCAL)[_SWAP]


def derivative_calls(robot: str, floating: bool) -> dict[str, Any]:
    """Return Pinocchio's derivatives of inverse and forward dynamics on a package robot, as calls without arguments, for timing."""
    pinocchio = required("pinocchio", "peers", "comparison with Pinocchio needs")

    with as_file(files("pycraft.models") / "robots" / f"{robot}.urdf") as path:
        model = build(str(path), "free" if floating else "fixed")
    data, q, rates = model.createData(), pinocchio.neutral(model), np.full(model.nv, 0.1)
    return {
        "inverse_dynamics_derivatives": lambda: pinocchio.computeRNEADerivatives(model, data, q, rates, rates),
        "forward_dynamics_derivatives": lambda: pinocchio.computeABADerivatives(model, data, q, rates, rates),
    }
