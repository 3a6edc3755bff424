"""Coordinates of a model as users give them: hinges, single coordinates, numbers."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from .. import _core
from ..arguments import several, whole


def coordinate_numbers(model: Any, given: Any) -> list[int] | None:
    """Return the numbers of the named coordinates, in their order; None, for all, if nothing is given.

    Each is the name of a hinge (all its coordinates), its handle, the name of a coordinate, or a number. ModelError for an unknown one,
    with the nearest name, or one named twice.
    """
    if given is None:
        return None
    if isinstance(given, Mapping):
        raise _core.ModelError(
            f"coordinates are named by a list, without values, which are those of a state: {list(given)!r}, not {dict(given)!r}"
        )
    numbers: list[int] = []
    for one in several(given):
        numbers += _numbers_of(model, one)
    if len(set(numbers)) < len(numbers):
        twice = next(i for i in numbers if numbers.count(i) > 1)
        raise _core.ModelError(f"coordinate {model.coordinate_names[twice]!r} of {model.name!r} is named twice")
    return numbers


def _numbers_of(model: Any, one: Any) -> list[int]:
    name = getattr(one, "name", one)
    if isinstance(name, str):
        if name in model.hinges:
            own = model.hinges[name].v_slice
            return list(range(own.start, own.stop))
        names = model.coordinate_names
        if name in names:
            return [names.index(name)]
        known = list(dict.fromkeys([*model.hinges, *names]))
        near = get_close_matches(name, known, 1)
        said = f"; the nearest is {near[0]!r}" if near else f"; there are {', '.join(known[:12])}"
        raise _core.ModelError(f"no hinge or coordinate of {model.name!r} is called {name!r}{said}")
    number = whole(one, f"a coordinate of {model.name!r}")
    if not 0 <= number < model.nv:
        raise _core.ModelError(f"coordinate {number} of {model.name!r}, which has {model.nv}")
    return [number]
