"""Effects that a model's file speaks of: offered, none added until asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ... import _core
from .actuators import Servo, TorqueSource
from .effect import Effect
from .frictions import CoulombFriction, Damping
from .gravities import Gravity
from .springs import Spring


class Offered(Sequence[Effect]):
    """Effects that a model offers, and in `notes` what its file says besides and no effect is. `scene.add(*offered)` adds them all."""

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
    """The effects that a model's file speaks of, with its numbers: gravity, damping, dry friction, springs, actuators.

    URDF: `<dynamics damping friction>`, and `<limit effort velocity>` as a torque source without torque that keeps them. MJCF: gravity,
    damping, frictionloss, stiffness, and actuators with straight characteristics, at control zero (motors as `TorqueSource`, position and
    velocity servos as `Servo`); armature is the model's rotor inertia already. The model's own gravity, where it is set, is offered, too.

    Returns
    -------
    Offered : a sequence of effects, also by kind, `offered["damping"]`; shown as a list with what is not offered and why

    Raises
    ------
    ModelError
        No model.

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.robots.panda()
    >>> [effect.kind() for effect in pc.effects.from_model(arm)]
    ['damping', 'torque_source']
    """
    if not isinstance(model, _core.Multibody):
        raise _core.ModelError(f"effects are offered by a model, not by {model!r:.80}")
    left = getattr(model, "left_aside", {})
    effects: list[Effect] = []
    notes: list[str] = []
    gravity = left.get("gravity", model.gravity)
    if np.any(gravity):
        effects.append(Gravity(tuple(np.asarray(gravity).tolist())))
    for quantity, made in (("damping", Damping), ("friction", CoulombFriction)):
        if quantity in left:
            names, numbers = _numbers(model, left[quantity])
            effects.append(made(numbers, hinges=names))
    effects += _springs(model, left, notes)
    effects += _limited(model, left)
    effects += _drives(model, notes)
    return Offered(model.name, effects, notes)


def _numbers(model: Any, values: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Names of the coordinates that have a number, and these."""
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
    notes += [f"the spring of free hinge {name!r}, which a bushing between two nodes would be" for name in free]
    names, numbers = _numbers(model, values)
    return [Spring(numbers, rest=rest if "spring rest" in left else 0.0, hinges=names)] if names else []


def _limited(model: Any, left: dict[str, np.ndarray]) -> list[Effect]:
    """Limits of effort and velocity, of a source that gives nothing yet."""
    none = np.full(model.nv, np.nan)
    effort, speed = left.get("effort limit", none), left.get("velocity limit", none)
    there = np.flatnonzero(~np.isnan(effort) | ~np.isnan(speed))
    if not there.size:
        return []
    names = [model.coordinate_names[j] for j in there]
    limits = [np.where(np.isnan(x[there]), np.inf, x[there]) for x in (effort, speed)]
    return [TorqueSource(np.zeros(len(names)), hinges=names, effort_limit=limits[0], speed_limit=limits[1])]


def _drives(model: Any, notes: list[str]) -> list[Effect]:
    """Actuators, those of one sort in one effect as long as they are on different coordinates."""
    groups: list[tuple[bool, list[dict[str, Any]]]] = []
    for actuator in getattr(model, "actuators", []):
        offset, position, velocity = actuator["bias"]
        if why := actuator["why not"] or ("it brakes and has an offset, but no spring" if offset and velocity and not position else None):
            notes.append(f"actuator {actuator['name']!r}: {why}")
            continue
        servo = bool(position or velocity)
        for of_servos, group in groups:
            if of_servos == servo and all(other["coordinate"] != actuator["coordinate"] for other in group):
                group.append(actuator)
                break
        else:
            groups.append((servo, [actuator]))
    return [(_servos if servo else _sources)(group) for servo, group in groups]


def _common(group: Sequence[dict[str, Any]]) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Coordinates, gears, biases and limits of effort."""
    gear, bias = np.array([a["gear"] for a in group]), np.array([a["bias"] for a in group])
    most = np.array([np.abs(a["force range"]).max() for a in group])
    return [a["coordinate"] for a in group], gear, bias, np.abs(gear) * most


def _sources(group: Sequence[dict[str, Any]]) -> Effect:
    names, gear, bias, most = _common(group)
    return TorqueSource(gear * bias[:, 0], hinges=names, effort_limit=most)


def _servos(group: Sequence[dict[str, Any]]) -> Effect:
    """gear (b₀ + b₁ gear q + b₂ gear v) = kp (r - q) - kd v."""
    names, gear, bias, most = _common(group)
    stiffness, damping = -bias[:, 1] * gear**2, -bias[:, 2] * gear**2
    target = np.divide(gear * bias[:, 0], stiffness, out=np.zeros_like(stiffness), where=stiffness != 0)
    return Servo(stiffness, damping, target=target, hinges=names, effort_limit=most)
