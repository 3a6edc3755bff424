"""Actuators of an MJCF file: the coefficients of an affine law from control and joint to force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...interop.mujoco import disabled, permutation
from .left_aside import OFF
from .mjcf_effects import count_of_actuators, output_of, totals_of_several

if TYPE_CHECKING:
    from ..multibody import Multibody

_JOINTS, _NO_STATE, _FIXED = (0, 1), 0, 0  # mjtTrn: joint, joint in parent; mjtDyn; mjtGain
_NO_BIAS, _AFFINE = 0, 1  # mjtBias
_HINGE, _SLIDE = 3, 2  # mjtJoint


def read_actuators(m: Any, model: Multibody) -> list[dict[str, Any]]:
    """Return the actuators of MuJoCo's compiled model, in the form of `Multibody.actuators`, with our coordinates."""
    if not (count := count_of_actuators(m)):
        return []
    names = [model.coordinate_names[j] for j in permutation(model)[1]]  # in MuJoCo's order
    shared = set(totals_of_several(m))
    return [_actuator(m, a, names, shared) for a in range(count)]


def _actuator(m: Any, a: int, names: list[str], shared: set[int]) -> dict[str, Any]:
    joint = int(m.actuator_trnid[a, 0])
    on_joint = int(m.actuator_trntype[a]) in _JOINTS
    affine = int(m.actuator_biastype[a]) == _AFFINE
    gear = float(m.actuator_gear[output_of(m, a), 0])
    why_not = _why_not(m, a, joint, on_joint)
    if on_joint and joint in shared and why_not is None:
        why_not = "it shares a limit of force with other actuators at its joint"
    return {
        "name": m.actuator(a).name or f"actuator{a}",
        "coordinate": names[int(m.jnt_dofadr[joint])] if on_joint else None,
        "gear": gear,
        "gain": float(m.actuator_gainprm[a, 0]),
        "bias": [float(x) for x in m.actuator_biasprm[a, :3]] if affine else [0.0, 0.0, 0.0],
        "control": _control(m, a),
        "force range": _force_range(m, a, joint if on_joint else None, gear),
        "why not": why_not,
    }


def _control(m: Any, a: int) -> float:
    """Return the control that MuJoCo uses for zero: the nearest one in its range."""
    first = int(m.actuator_ctrladr[a]) if hasattr(m, "actuator_ctrladr") else a
    if first < 0 or first >= len(m.actuator_ctrllimited) or not m.actuator_ctrllimited[first] or disabled(m, "clampctrl"):
        return 0.0
    return float(np.clip(0.0, *m.actuator_ctrlrange[first]))


def _force_range(m: Any, a: int, joint: int | None, gear: float) -> list[float]:
    """Return the bounds of the force before the gear, including the joint's bounds for its actuator."""
    own = np.array(m.actuator_forcerange[a]) if m.actuator_forcelimited[a] else np.array([-np.inf, np.inf])
    if joint is not None and gear and getattr(m, "jnt_actfrclimited", np.zeros(m.njnt))[joint]:
        own = np.clip(own, *sorted(m.jnt_actfrcrange[joint] / gear))
    return [float(x) for x in own]


def _why_not(m: Any, a: int, joint: int, on_joint: bool) -> str | None:
    """Return why no effect represents this actuator, None if one does."""
    disabled_groups, group = int(getattr(m.opt, "disableactuator", 0)), int(m.actuator_group[a])
    if disabled(m, "actuation") or (0 <= group <= 30 and disabled_groups >> group & 1):
        return OFF
    if not on_joint:
        return "it does not act on a joint"
    if int(m.jnt_type[joint]) not in (_HINGE, _SLIDE):
        return "its joint has several coordinates"
    if int(m.actuator_plugin[a]) >= 0:
        return "it is a plugin"
    if int(m.actuator_dyntype[a]) != _NO_STATE:
        return "it has a state of its own"
    if getattr(m, "actuator_delay", np.zeros(a + 1))[a] > 0:
        return "its control is delayed"
    if int(m.actuator_gaintype[a]) != _FIXED or int(m.actuator_biastype[a]) not in (_NO_BIAS, _AFFINE):
        return "its force is not affine in control, position and velocity"
    return None
