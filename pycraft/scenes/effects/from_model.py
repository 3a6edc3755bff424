"""Effects described in a model's file: offered to scenes, but added only by the user."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ... import _core
from ...models.loaders.left_aside import OFF
from ...models.offers import BoxInFluid, HeldWeight
from .actuators import Servo, TorqueSource
from .effect import Effect
from .fluids import FluidDrag
from .frictions import CoulombFriction, Damping, QuadraticDamping
from .gravities import Gravity, GravityCompensation
from .springs import Spring


class Offered(Sequence[Effect]):
    """Effects that a model offers; `notes` lists the contents of its file without an effect. `scene.add(*offered)` adds all."""

    def __init__(self, model: str, effects: Iterable[Effect], notes: Iterable[str]):
        self._model, self._effects, self.notes = model, list(effects), list(notes)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, str):
            for effect in self._effects:
                if effect.kind() == index:
                    return effect
            kinds = ", ".join(repr(effect.kind()) for effect in self._effects) or "none"
            raise KeyError(f"{self._model!r} offers no {index!r}; there are {kinds}")
        return self._effects[index]

    def __len__(self) -> int:
        return len(self._effects)

    def __repr__(self) -> str:
        lines = [f"offered by {self._model!r}, none of it added yet:" if self._effects else f"{self._model!r} offers no effects"]
        lines += [f"  {effect.kind()}: {effect!r}" for effect in self._effects]
        return "\n".join([*lines, *(f"  not offered: {note}" for note in self.notes)])


def from_model(model: Any) -> Offered:
    """Return the effects described in a model's file, with their values.

    URDF and SDF: damping and friction of joints, and bounds of effort and velocity as a torque source of zero torque with these limits.
    MJCF: gravity, damping, frictionloss, stiffness, gravity compensation, the resistance of a fluid, and actuators with straight
    characteristics, at control zero (motors as `TorqueSource`, position and velocity servos as `Servo`); armature is the model's rotor
    inertia already. Effects that the file disables by a flag are not offered. The model's own gravity is offered if it is set.

    Returns
    -------
    Offered
        A sequence of effects, also by kind: `offered["damping"]`. Its text lists them, and omissions with their reasons, which are also in
        `notes`.

    Raises
    ------
    ModelError
        The argument is not a model.

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.robots.panda()
    >>> [effect.kind() for effect in pc.effects.from_model(arm)]
    ['damping', 'torque_source']
    """
    if not isinstance(model, _core.Multibody):
        raise _core.ModelError(f"from_model takes a model, not {model!r:.80}")
    left = getattr(model, "left_aside", {})
    effects: list[Effect] = []
    notes: list[str] = []
    gravity = left.get("gravity", model.gravity)
    if np.any(gravity):
        effects.append(Gravity(tuple(np.asarray(gravity).tolist())))
    for quantity, made in (("damping", Damping), ("quadratic damping", QuadraticDamping), ("friction", CoulombFriction)):
        if quantity in left:
            names, numbers = _numbers(model, left[quantity])
            effects.append(made(numbers, hinges=names))
    effects += _springs(model, left, notes)
    effects += _of_bodies(model)
    effects += _limited(model, left)
    effects += _drives(model, notes)
    if kept := list(getattr(model, "loops", ())):
        shown = ", ".join(map(repr, kept[:4])) + f", ... ({len(kept)} in all)" * (len(kept) > 4)
        notes.append(f"the loops of the model, {shown}: pycraft.effects.Loop() keeps them")
    return Offered(model.name, effects, [*notes, *getattr(model, "not_read", [])])


def _of_bodies(model: Any) -> list[Effect]:
    """Return compensated weights by gravity field, and boxes in fluids by fluid."""
    offers = getattr(model, "offers", [])
    effects: list[Effect] = []
    for g in dict.fromkeys(offer.g for offer in offers if isinstance(offer, HeldWeight)):
        held: dict[str, list[tuple[float, np.ndarray]]] = {}
        for offer in offers:
            if isinstance(offer, HeldWeight) and offer.g == g:
                body, placement = _carrier(model, offer.body)
                held.setdefault(body, []).append((offer.mass, placement[:3, :3] @ offer.point + placement[:3, 3]))
        bodies, share, points = [], [], []
        for body, parts in held.items():
            mass = sum(part for part, _ in parts)
            if mass and model.bodies[body].mass:
                bodies.append(body)
                share.append(mass / model.bodies[body].mass)
                points.append(sum(part * point for part, point in parts) / mass)
        if bodies:
            effects.append(GravityCompensation(np.array(share), bodies=bodies, points=np.array(points), g=g))
    for fluid in dict.fromkeys(offer.fluid for offer in offers if isinstance(offer, BoxInFluid)):
        boxes = [offer for offer in offers if isinstance(offer, BoxInFluid) and offer.fluid == fluid]
        sizes, placements = np.array([box.size for box in boxes]), np.array([box.placement for box in boxes])
        effects.append(FluidDrag(*fluid, bodies=[box.body for box in boxes], sizes=sizes, placements=placements))
    return effects


def _carrier(model: Any, name: str) -> tuple[str, np.ndarray]:
    """Return the body that carries a body or node, and the pose (4, 4) of the latter there."""
    if name in model.bodies:
        return name, np.eye(4)
    node = model.nodes[name]
    return node.body.name, node.pose


def _numbers(model: Any, values: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Return names of the coordinates that have a value, and the values."""
    there = np.flatnonzero(~np.isnan(values))
    return [model.coordinate_names[j] for j in there], values[there]


def _springs(model: Any, left: dict[str, np.ndarray], notes: list[str]) -> list[Effect]:
    if "stiffness" not in left:
        return []
    values, rest, free = left["stiffness"].copy(), [], []
    for name, hinge in model.hinges.items():
        q, v = hinge.q_slice.start, hinge.v_slice.start
        for subhinge in model._body(hinge._index())["hinge"]["subhinges"]:
            kind = _core.subhinge_kinds[subhinge["kind"]]
            if not np.isnan(values[v]) and kind.name == "free":
                values[v : v + kind.nv] = np.nan
                free.append(name)
            elif not np.isnan(values[v]):
                rest += left.get("spring rest", np.asarray(model.zero_q()))[q : q + kind.nq].tolist()
            q, v = q + kind.nq, v + kind.nv
    notes += [f"the spring of free hinge {name!r}: add it as a bushing between two nodes" for name in free]
    names, numbers = _numbers(model, values)
    return [Spring(numbers, rest=rest if "spring rest" in left else 0.0, hinges=names)] if names else []


def _limited(model: Any, left: dict[str, np.ndarray]) -> list[Effect]:
    """Return limits of effort and velocity, as a source of zero torque."""
    none = np.full(model.nv, np.nan)
    effort, speed = left.get("effort limit", none), left.get("velocity limit", none)
    there = np.flatnonzero(~np.isnan(effort) | ~np.isnan(speed))
    if not there.size:
        return []
    names = [model.coordinate_names[j] for j in there]
    limits = [np.where(np.isnan(x[there]), np.inf, x[there]) for x in (effort, speed)]
    return [TorqueSource(np.zeros(len(names)), hinges=names, effort_limit=limits[0], speed_limit=limits[1])]


def _drives(model: Any, notes: list[str]) -> list[Effect]:
    """Return actuators; actuators of one kind on different coordinates form one effect."""
    groups: list[tuple[bool, list[dict[str, Any]]]] = []
    for actuator in getattr(model, "actuators", []):
        _, position, velocity = actuator["bias"]
        offset, (low, high) = _at_rest(actuator), actuator["force range"]
        if why := actuator["why not"] or ("it brakes and has an offset, but no spring" if offset and velocity and not position else None):
            notes += [f"actuator {actuator['name']!r}: {why}"] if why != OFF else []
            continue
        servo = bool(position or velocity)
        if servo and low != -high:
            both = f"its effect uses {max(-low, high):g} in both directions"
            notes.append(f"the force range [{low:g}, {high:g}] of actuator {actuator['name']!r}, which is not symmetric: {both}")
        for of_servos, group in groups:
            if of_servos == servo and all(other["coordinate"] != actuator["coordinate"] for other in group):
                group.append(actuator)
                break
        else:
            groups.append((servo, [actuator]))
    return [(_servos if servo else _sources)(group) for servo, group in groups]


def _at_rest(actuator: dict[str, Any]) -> float:
    """Return the force before the gear at position and velocity zero, and at the control for zero."""
    return float(actuator["gain"] * actuator.get("control", 0.0) + actuator["bias"][0])


def _common(group: Sequence[dict[str, Any]]) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Return coordinates, gears, forces at rest and bounds of effort."""
    gear, rest = np.array([a["gear"] for a in group]), np.array([_at_rest(a) for a in group])
    most = np.array([np.abs(a["force range"]).max() for a in group])
    return [a["coordinate"] for a in group], gear, rest, np.abs(gear) * most


def _sources(group: Sequence[dict[str, Any]]) -> Effect:
    names, gear, rest, most = _common(group)
    low, high = np.array([a["force range"] for a in group]).T
    return TorqueSource(gear * np.clip(rest, low, high), hinges=names, effort_limit=most)


def _servos(group: Sequence[dict[str, Any]]) -> Effect:
    """gear (b₀ + b₁ gear q + b₂ gear v) = kp (r - q) - kd v."""
    names, gear, rest, most = _common(group)
    bias = np.array([a["bias"] for a in group])
    stiffness, damping = -bias[:, 1] * gear**2, -bias[:, 2] * gear**2
    target = np.divide(gear * rest, stiffness, out=np.zeros_like(stiffness), where=stiffness != 0)
    return Servo(stiffness, damping, target=target, hinges=names, effort_limit=most)
