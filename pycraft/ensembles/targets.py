"""Targets of samples in a scene: initial coordinates, and parameters of the model and of effects, by name."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from typing import Any

import numpy as np

from .. import _core
from ..closed import settable
from ..scenes.coordinate_units import coordinate_units

_INDEX = re.compile(r"^(?P<path>.*?)\[(?P<index>\d+(?:\s*,\s*\d+)*)\]$")


class Targets:
    """Targets in one scene of the names of samples.

    Raises ModelError for a name that nothing in the scene has, and suggests the nearest.
    """

    def __init__(self, scene: Any, names: Iterable[str]):
        self._scene, names = scene, list(names)
        self._states = {name: _places(scene.model, name) for name in names if name.partition(".")[0] in ("q", "v")}
        self._setters = {name: _setter(scene, name) for name in names if name not in self._states}
        _once(self._states)

    def set(self, row: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
        """Set the parameters of a sample; return q and v at the start, the model's own where the sample gives none."""
        for name, setter in self._setters.items():
            setter(row[name])
        model = self._scene.model
        state = {"q": np.array(model.q), "v": np.array(model.v)}
        for name, (of, at) in self._states.items():
            value = _core.real_array(row[name], name)
            if value.size not in (1, at.stop - at.start):
                raise _core.ModelError(f"{name} takes {at.stop - at.start} numbers, not an array {value.shape}")
            state[of][at] = value.ravel()
        return state["q"], state["v"]


def _once(states: Mapping[str, tuple[str, slice]]) -> None:
    """Refuse samples that set a coordinate twice."""
    taken: dict[tuple[str, int], str] = {}
    for name, (of, at) in states.items():
        for i in range(at.start, at.stop):
            if (other := taken.setdefault((of, i), name)) != name:
                raise _core.ModelError(f"samples: {other} and {name} both set a coordinate; leave one out")


def _places(model: Any, name: str) -> tuple[str, slice]:
    """Return "q" or "v", and the slice of it."""
    of, _, which = name.partition(".")
    if not which:
        return of, slice(0, model.nq if of == "q" else model.nv)
    if which in model.hinges:
        hinge = model.hinges[which]
        return of, hinge.q_slice if of == "q" else hinge.v_slice
    coordinates = coordinate_units(model)[0] if of == "q" else model.coordinate_names
    if which in coordinates:
        return of, slice(coordinates.index(which), coordinates.index(which) + 1)
    near = _near(which, list(dict.fromkeys([*model.hinges, *coordinates])))
    raise _core.ModelError(f"samples: {name!r}: {model.name!r} has no hinge or coordinate {which!r}; {near}")


def _setter(scene: Any, name: str) -> Callable[[Any], None]:
    """Return the function that sets bodies.NAME.ATTRIBUTE, hinges.NAME.ATTRIBUTE or effects.NAME.PARAMETER, or one component of it."""
    indexed = _INDEX.match(name)
    path = indexed["path"] if indexed else name
    index = tuple(int(i) for i in indexed["index"].split(",")) if indexed else None
    room, _, rest = path.partition(".")
    of, _, attribute = rest.rpartition(".")
    owners = {"bodies": scene.model.bodies, "hinges": scene.model.hinges, "effects": scene.effects}
    if room not in owners or not of:
        raise _core.ModelError(
            f"samples: a scene has no {name!r}; write q.HINGE, v.HINGE, bodies.BODY.mass, hinges.HINGE.rotor_inertia or "
            "effects.EFFECT.PARAMETER"
        )
    if of not in owners[room]:
        raise _core.ModelError(f"samples: {name!r}: the scene's {room} include no {of!r}; {_near(of, list(owners[room]))}")
    owner = owners[room][of]
    known = [each for each in dir(owner) if not each.startswith("_") and settable(type(owner), each)]
    if attribute not in known:
        raise _core.ModelError(f"samples: {name!r}: {of!r} has no {attribute!r}; {_near(attribute, known)}")
    if index is None:
        return lambda value: setattr(owner, attribute, value)
    completed = owner.completed_for(scene.model) if room == "effects" else owner
    shape = np.shape(getattr(completed, attribute))
    if len(index) != len(shape) or any(i >= n for i, n in zip(index, shape, strict=True)):
        raise _core.ModelError(f"samples: {name!r}: {attribute} of {of!r} has the shape {shape}")

    def component(value: Any) -> None:
        present = getattr(owner, attribute)
        whole = np.array(getattr(completed, attribute) if present is None else present, float)
        whole[index] = value
        setattr(owner, attribute, whole)

    return component


def _near(name: str, names: list[str]) -> str:
    near = get_close_matches(name, names, 1)
    return f"did you mean {near[0]!r}?" if near else f"available: {', '.join(names[:12])}{', ...' if len(names) > 12 else ''}"
