"""Actuators of an MJCF file as numbers: what a straight line from control and joint to force is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...interop.mujoco import permutation

if TYPE_CHECKING:
    from ..multibody import Multibody

_JOINT, _NO_STATE, _FIXED = 0, 0, 0  # mjtTrn, mjtDyn, mjtGain
_NO_BIAS, _AFFINE = 0, 1  # mjtBias
_HINGE, _SLIDE = 3, 2  # mjtJoint


def read_actuators(m: Any, model: Multibody) -> list[dict[str, Any]]:
    """The actuators of MuJoCo's compiled model, as `Multibody.actuators` has them, with the coordinates of ours."""
    names = [model.coordinate_names[j] for j in permutation(model)[1]] if m.nu else []  # in MuJoCo's order
    return [_actuator(m, a, names) for a in range(m.nu)]


def _actuator(m: Any, a: int, names: list[str]) -> dict[str, Any]:
    joint = int(m.actuator_trnid[a, 0])
    on_joint = int(m.actuator_trntype[a]) == _JOINT
    affine = int(m.actuator_biastype[a]) == _AFFINE
    limited = bool(m.actuator_forcelimited[a])
    return {
        "name": m.actuator(a).name or f"actuator{a}",
        "coordinate": names[int(m.jnt_dofadr[joint])] if on_joint else None,
        "gear": float(m.actuator_gear[a, 0]),
        "gain": float(m.actuator_gainprm[a, 0]),
        "bias": [float(x) for x in m.actuator_biasprm[a, :3]] if affine else [0.0, 0.0, 0.0],
        "force range": [float(x) for x in m.actuator_forcerange[a]] if limited else [-np.inf, np.inf],
        "why not": _why_not(m, a, joint, on_joint),
    }


def _why_not(m: Any, a: int, joint: int, on_joint: bool) -> str | None:
    """Why no effect is this actuator, None where one is."""
    if not on_joint:
        return "it does not act on a joint"
    if int(m.jnt_type[joint]) not in (_HINGE, _SLIDE):
        return "its joint has several coordinates"
    if int(m.actuator_dyntype[a]) != _NO_STATE:
        return "it has a state of its own"
    if int(m.actuator_gaintype[a]) != _FIXED or int(m.actuator_biastype[a]) not in (_NO_BIAS, _AFFINE):
        return "its force is no straight line in control, position and velocity"
    return None
