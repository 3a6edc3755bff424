"""Pinocchio's conventions: order of joints, quaternions (x, y, z, w), linear part first, cosine and sine of continuous joints.

Pinocchio (package `pin`, extra [peers]) is imported only when a function here is called.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from .packages import required

if TYPE_CHECKING:
    from ..models.multibody import Multibody

_SWAP = np.array([3, 4, 5, 0, 1, 2])
"""From angular-first to linear-first order."""


def build(path: str, root: str = "fixed") -> Any:
    """Pinocchio's model of a URDF file, with a free flyer for root="free"."""
    pinocchio = required("pinocchio", "peers", "comparison with Pinocchio needs")

    return (
        pinocchio.buildModelFromUrdf(str(path), pinocchio.JointModelFreeFlyer())
        if root == "free"
        else pinocchio.buildModelFromUrdf(str(path))
    )


@dataclass
class Coordinates:
    """How the coordinates of a model lie in Pinocchio's model of the same file.

    `q(q)` converts configurations, `velocities(q)` is the orthogonal matrix S with v_pinocchio = S v; so ℳ_pinocchio = S ℳ S*.
    """

    model: Multibody
    pin_model: Any
    joints: list[tuple[str, str, slice, slice, int, int, int]]

    def q(self, q: np.ndarray) -> np.ndarray:
        """A configuration (nq,) in Pinocchio's order."""
        out = np.zeros(self.pin_model.nq)
        for _, kind, q_slice, _, at, nq, _ in self.joints:
            own = q[q_slice]
            if kind == "free":
                out[at : at + 7] = [*own[4:7], *_unit(own[[1, 2, 3, 0]])]
            elif kind == "ball":
                out[at : at + 4] = _unit(own[[1, 2, 3, 0]])
            elif kind == "planar":
                out[at : at + 4] = [own[0], own[1], np.cos(own[2]), np.sin(own[2])]
            elif nq == 2:
                out[at : at + 2] = [np.cos(own[0]), np.sin(own[0])]
            else:
                out[at] = own[0]
        return out

    def velocities(self, q: np.ndarray) -> np.ndarray:
        """S (nv, nv): velocities of the model to Pinocchio's."""
        S = np.zeros((self.pin_model.nv, self.model.nv))
        for _, kind, q_slice, v_slice, _, _, at in self.joints:
            n = v_slice.stop - v_slice.start
            block = np.eye(n)
            if kind == "free":
                block = np.eye(6)[_SWAP]
            elif kind == "planar":  # Pinocchio's planar velocity is in the body's axes
                c, s = np.cos(q[q_slice][2]), np.sin(q[q_slice][2])
                block = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
            S[at : at + n, v_slice] = block
        return S


def _unit(quaternion: np.ndarray) -> np.ndarray:
    return quaternion / np.linalg.norm(quaternion)


def coordinates(model: Multibody, pin_model: Any) -> Coordinates:
    """Match hinges and joints by name. Raises ModelError for a joint that only one of the two has."""
    hinges = model.hinges
    joints = []
    for j in range(1, pin_model.njoints):
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
        joints.append((own, hinge.kind, hinge.q_slice, hinge.v_slice, joint.idx_q, joint.nq, joint.idx_v))
    missing = {name for name in hinges if hinges[name].v_slice.stop > hinges[name].v_slice.start} - {j[0] for j in joints}
    if missing:
        raise _core.ModelError(f"hinges {', '.join(sorted(missing))} of {model.name!r} have no joint in Pinocchio's model")
    return Coordinates(model, pin_model, joints)


def jacobian(pin_model: Any, data: Any, q: np.ndarray, frame: str) -> np.ndarray:
    """Pinocchio's Jacobian of a link frame, in its own axes, rows brought to angular-first order."""
    pinocchio = required("pinocchio", "peers", "comparison with Pinocchio needs")

    index = pin_model.getFrameId(frame, pinocchio.FrameType.BODY)
    return pinocchio.computeFrameJacobian(pin_model, data, q, index, pinocchio.ReferenceFrame.LOCAL)[_SWAP]


def derivative_calls(robot: str, floating: bool) -> dict[str, Any]:
    """Pinocchio's derivatives of inverse and forward dynamics on a shipped robot, as calls without arguments, to be timed."""
    pinocchio = required("pinocchio", "peers", "comparison with Pinocchio needs")

    with as_file(files("pycraft.models") / "robots" / f"{robot}.urdf") as path:
        model = build(str(path), "free" if floating else "fixed")
    data, q, rates = model.createData(), pinocchio.neutral(model), np.full(model.nv, 0.1)
    return {
        "inverse_dynamics_derivatives": lambda: pinocchio.computeRNEADerivatives(model, data, q, rates, rates),
        "forward_dynamics_derivatives": lambda: pinocchio.computeABADerivatives(model, data, q, rates, rates),
    }
