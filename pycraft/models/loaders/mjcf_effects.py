"""Elements of an MJCF file that move bodies and are not in a model: parameters of effects, and the names of elements that are not read.

Every option, flag and attribute of MuJoCo that changes accelerations is in one of these places (tests/models/test_mjcf_differences.py has
the list of fields and compares accelerations):

| in MuJoCo | here |
|---|---|
| armature of joints and of actuators at joints | rotor inertia of hinges |
| gravity, damping, frictionloss, stiffness, springref; damping of actuators at joints | `Multibody.left_aside` |
| quadratic damping, gravcomp, density, viscosity, wind | `Multibody.offers` |
| actuators at joints with one coordinate and straight characteristics, at control zero | `Multibody.actuators` |
| equality constraints | `Multibody.loops` |
| contacts, limits, tendons, flexes, plugins, ellipsoids in fluids, other polynomials, plastic springs, mocap bodies | `Multibody.not_read`
|

A flag that disables one of them omits it everywhere.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...interop import mujoco as conventions
from ...interop.mujoco import disabled
from ..offers import BoxInFluid, HeldWeight, Offer
from .rotations import rotation_from_quaternion

_HINGE, _SLIDE, _JOINTS = 3, 2, (0, 1)  # mjtJoint; mjtTrn of joints
_SLEEP = 1 << 4  # mjtEnableBit, since MuJoCo 3.4
_LISTED = 8
"""Number of names of one kind that a text lists."""


def no_passive_forces(m: Any) -> bool:
    """Return whether MuJoCo omits all passive forces, which it does if springs and dampers are both disabled."""
    return disabled(m, "spring") and disabled(m, "damper")


def gravity(m: Any) -> np.ndarray:
    """Return the effective gravity (3,), m/s²."""
    return np.zeros(3) if disabled(m, "gravity") else np.array(m.opt.gravity)


def of_actuators(m: Any, quantity: str) -> np.ndarray:
    """Return the actuators' part of the armature or damping of coordinates (nv,), in MuJoCo's order: gear² times their own."""
    added = np.zeros(m.nv)
    own = np.asarray(getattr(m, f"actuator_{quantity}", np.zeros(0)))  # since MuJoCo 3.5
    for a in np.flatnonzero(own):
        if int(m.actuator_trntype[a]) in _JOINTS:
            joint = int(m.actuator_trnid[a, 0])
            gear = float(m.actuator_gear[output_of(m, int(a)), 0])
            added[np.flatnonzero(m.dof_jntid == joint)] += gear**2 * own[a]
    return added


def output_of(m: Any, a: int) -> int:
    """Return the number of an actuator's first output, which counts the rows of its gears."""
    return int(m.actuator_outadr[a]) if hasattr(m, "actuator_outadr") else a


def armature(m: Any) -> np.ndarray:
    """Return the rotor inertia (nv,), in MuJoCo's order."""
    return np.array(m.dof_armature) + of_actuators(m, "armature")


def by_coordinate(m: Any, model: Any) -> dict[str, np.ndarray]:
    """Return the effective gravity, and by coordinate damping, friction and stiffness: see `Multibody.left_aside`."""
    left: dict[str, np.ndarray] = {}
    if np.any(acting := gravity(m)):
        left["gravity"] = acting
    none = np.zeros(m.nv)
    numbers = {
        "damping": none if disabled(m, "damper") else m.dof_damping + of_actuators(m, "damping"),
        "friction": none if disabled(m, "frictionloss") or disabled(m, "constraint") else m.dof_frictionloss,
        "stiffness": none if disabled(m, "spring") else m.jnt_stiffness[m.dof_jntid],
        "quadratic damping": none if disabled(m, "damper") else _polynomial(m, "dof_damping")[:, 0],
    }
    order = conventions.permutation(model)[1]
    for quantity, values in numbers.items():
        if np.any(values):
            left[quantity] = np.full(m.nv, np.nan)
            left[quantity][order] = np.where(values != 0, values, np.nan)
    rest = conventions.from_mujoco(model, m.qpos_spring, np.zeros(m.nv))[0]
    if "stiffness" in left and not np.array_equal(rest, model.zero_q()):
        left["spring rest"] = rest
    return left


def _polynomial(m: Any, name: str) -> np.ndarray:
    """Return the coefficients above the linear one, zeros if this MuJoCo version has none."""
    of = getattr(m, f"{name}poly", None)  # since MuJoCo 3.6
    return np.zeros((len(getattr(m, name)), 2)) if of is None else np.asarray(of)


# Bodies ---------------------------------------------------------------------------------------------------------------


def offers(m: Any, bodies: list[str]) -> list[Offer]:
    """Return the compensated weights and the boxes in a fluid, body by body; `bodies` are the names by MuJoCo's numbers."""
    if no_passive_forces(m):
        return []
    return [*_held(m, bodies), *_in_fluid(m, bodies)]


def _held(m: Any, bodies: list[str]) -> list[HeldWeight]:
    if not (np.any(gravity(m)) and np.any(m.body_gravcomp > 0)) or _compensation_needs_actuators(m):  # MuJoCo looks for one above zero
        return []
    g = tuple(gravity(m).tolist())
    held = [k for k in _moving(m) if m.body_mass[k] * m.body_gravcomp[k]]
    return [HeldWeight(bodies[k], float(m.body_mass[k] * m.body_gravcomp[k]), np.array(m.body_ipos[k]), g) for k in held]


def _compensation_needs_actuators(m: Any) -> bool:
    """Return whether compensation needs actuators that are missing or disabled: then MuJoCo omits it."""
    through = getattr(m, "jnt_actgravcomp", np.zeros(0))
    return bool(np.any(through)) and (m.nu == 0 or disabled(m, "actuation"))


def _in_fluid(m: Any, bodies: list[str]) -> list[BoxInFluid]:
    """Return the equivalent box of each body without a geom that the fluid resists as an ellipsoid."""
    if not (m.opt.density or m.opt.viscosity):
        return []
    fluid = float(m.opt.density), float(m.opt.viscosity), tuple(map(float, m.opt.wind))
    found, least, ellipsoids = [], 1e-15, _ellipsoids(m)  # mjMINVAL
    for k in _moving(m):
        if m.body_mass[k] < least or k in ellipsoids:
            continue
        moments, placement = np.array(m.body_inertia[k]), np.eye(4)
        placement[:3, :3], placement[:3, 3] = rotation_from_quaternion(m.body_iquat[k]), m.body_ipos[k]
        size = np.sqrt(np.maximum(least, moments.sum() - 2 * moments) / m.body_mass[k] * 6)
        found.append(BoxInFluid(bodies[k], size, placement, *fluid))
    return found


def _moving(m: Any) -> list[int]:
    """Return the bodies that joints move."""
    return [k for k in range(1, m.nbody) if m.body_weldid[k] != 0 and m.body_mocapid[m.body_rootid[k]] < 0]


def _ellipsoids(m: Any) -> set[int]:
    """Return the bodies with geoms that resist a fluid as ellipsoids."""
    return {int(m.geom_bodyid[g]) for g in range(m.ngeom) if m.geom_fluid[g, 0] > 0}


# What is not read -----------------------------------------------------------------------------------------------------


def not_read(m: Any, bodies: list[str]) -> list[str]:
    """Return, each in words, elements that change motions in MuJoCo and are neither in the model nor available as effects."""
    found = [*_tendons(m), *(f"flex {m.flex(f).name or f!r}" for f in range(m.nflex)), *_of_joints(m), *_of_bodies(m, bodies)]
    return found + _contacts(m)


def _tendons(m: Any) -> list[str]:
    limited = not (disabled(m, "limit") or disabled(m, "constraint"))
    found = []
    for t in range(m.ntendon):
        acting = {
            "stiffness": not disabled(m, "spring") and (m.tendon_stiffness[t] or _polynomial(m, "tendon_stiffness")[t].any()),
            "damping": not disabled(m, "damper") and (m.tendon_damping[t] or _polynomial(m, "tendon_damping")[t].any()),
            "armature": hasattr(m, "tendon_armature") and m.tendon_armature[t],
            "frictionloss": not (disabled(m, "frictionloss") or disabled(m, "constraint")) and m.tendon_frictionloss[t],
            "limits": limited and m.tendon_limited[t],
            "its actuator's armature or damping": int(getattr(m, "tendon_actuatorid", np.full(m.ntendon, -1))[t]) >= 0,
        }
        if names := [name for name, there in acting.items() if there]:
            found.append(f"tendon {m.tendon(t).name or str(t)!r} ({', '.join(names)})")
    return found


def _of_joints(m: Any) -> list[str]:
    found = []
    stiff, damped = _polynomial(m, "jnt_stiffness"), _polynomial(m, "dof_damping")
    actuators = of_actuators_polynomial(m)
    for j in range(m.njnt):
        name = f"of joint {m.joint(j).name or str(j)!r}"
        own = np.flatnonzero(m.dof_jntid == j)
        if stiff[j].any() and not disabled(m, "spring"):
            found.append(f"the quadratic and cubic stiffness {name}")
        if (damped[own, 1].any() or actuators[own].any()) and not disabled(m, "damper"):
            found.append(f"the cubic damping {name}" if not actuators[own].any() else f"the polynomial damping of actuators {name}")
        if (yields := getattr(m, "jnt_springyield", None)) is not None and yields[j] and not disabled(m, "spring"):
            found.append(f"the plastic yield {name}")
    return found + _limits(m)


def of_actuators_polynomial(m: Any) -> np.ndarray:
    """Return by coordinate whether an actuator at its joint has quadratic or cubic damping."""
    there, of = np.zeros(m.nv, bool), np.asarray(getattr(m, "actuator_dampingpoly", np.zeros((0, 2))))
    for a in range(len(of)):
        if np.any(of[a]) and int(m.actuator_trntype[a]) in _JOINTS:
            there |= m.dof_jntid == int(m.actuator_trnid[a, 0])
    return there


def _limits(m: Any) -> list[str]:
    found = []
    if limited := [] if disabled(m, "limit") or disabled(m, "constraint") else np.flatnonzero(m.jnt_limited).tolist():
        names = listed([m.joint(j).name or str(j) for j in limited])
        found.append(f"stops at the limits of joint{'s' * (len(limited) > 1)} {names} (pycraft.effects.Limits is one)")
    shared = set(totals_of_several(m))
    for j in np.flatnonzero(getattr(m, "jnt_actfrclimited", np.zeros(0))).tolist():
        held = m.jnt_actgravcomp[j] and not no_passive_forces(m) and np.any(m.body_gravcomp) if hasattr(m, "jnt_actgravcomp") else False
        if j in shared or held:
            found.append(f"the limit of the total force of actuators at joint {m.joint(j).name or str(j)!r}")
    return found


def totals_of_several(m: Any) -> list[int]:
    """Return the joints with a limited total actuator force that several actuators share."""
    if disabled(m, "actuation") or not hasattr(m, "jnt_actfrclimited"):
        return []
    ends = [int(m.actuator_trnid[a, 0]) for a in range(count_of_actuators(m)) if int(m.actuator_trntype[a]) in _JOINTS]
    return [j for j in np.flatnonzero(m.jnt_actfrclimited).tolist() if ends.count(j) > 1]


def count_of_actuators(m: Any) -> int:
    """Return the number of actuators, which before MuJoCo 4 is the number of controls."""
    return int(getattr(m, "nactuator", m.nu))


def _of_bodies(m: Any, bodies: list[str]) -> list[str]:
    found = []
    if mocap := [bodies[b] for b in range(m.nbody) if m.body_mocapid[b] >= 0]:
        found.append(f"motions of mocap bodies, which are fixed here: {listed(mocap)}")
    if (m.opt.density or m.opt.viscosity) and not no_passive_forces(m) and (there := _ellipsoids(m)):
        found.append(f"forces of the fluid on ellipsoids of {listed([bodies[b] for b in sorted(there)])}")
    if plugins := [bodies[b] for b in range(m.nbody) if m.body_plugin[b] >= 0]:
        found.append(f"plugins of bodies {listed(plugins)}")
    if _compensation_needs_actuators(m) and np.any(m.body_gravcomp > 0) and not np.all(m.jnt_actgravcomp) and not no_passive_forces(m):
        found.append("gravity compensation, which acts at some joints only, as actuators that do not act would give it at the others")
    if int(m.opt.enableflags) & _SLEEP:
        found.append("sleeping of bodies at rest")
    return found


def _contacts(m: Any) -> list[str]:
    """Return contacts, if two geoms on different bodies, one of which moves, may touch."""
    if disabled(m, "contact") or disabled(m, "constraint") or not m.ngeom:
        return []
    on = m.body_weldid[m.geom_bodyid]
    welds, number = np.unique(on, return_inverse=True)
    kinds, affinities = (np.zeros(len(welds), np.int64) for _ in range(2))
    np.bitwise_or.at(kinds, number, m.geom_contype.astype(np.int64))
    np.bitwise_or.at(affinities, number, m.geom_conaffinity.astype(np.int64))
    meet = (kinds[:, None] & affinities[None, :]) != 0
    meet |= meet.T
    np.fill_diagonal(meet, False)
    if not disabled(m, "filterparent"):
        parents = m.body_weldid[m.body_parentid[welds]]
        related = (parents[:, None] == welds[None, :]) & (parents[:, None] != 0)
        meet &= ~(related | related.T)
    if not (meet.any() or m.npair):
        return []
    adhesive = getattr(m, "flg_adhesion", False)
    more = [
        f"{m.npair} pair{'s' * (m.npair > 1)}" * bool(m.npair),
        f"{m.nexclude} excluded" * bool(m.nexclude),
        "adhesion" * bool(adhesive),
    ]
    extra = "".join(f", {text}" for text in more if text)
    return [f"contacts ({m.ngeom} geom{'s' * (m.ngeom > 1)}{extra})"]


def listed(names: list[str]) -> str:
    """Return names in quotation marks, at most eight of them."""
    return ", ".join(map(repr, names[:_LISTED])) + (f", ... ({len(names)} in all)" if len(names) > _LISTED else "")
