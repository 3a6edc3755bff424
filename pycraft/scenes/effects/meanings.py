"""What the names and lists of numbers of effects are of: an edit of the structure that would make it something else is not silent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ... import _core
from .effect import Effect, names_of
from .functions_of_time import InTime


class Meanings:
    """Of each effect of a scene, what it was of when it was added, or when its fields were last seen to change."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[Effect, int, dict[str, str]]] = {}

    def keep(self, name: str, effect: Effect, model: Any) -> None:
        """Remember an effect that is new or was changed. ModelError for one that is of something else now, with what it was of."""
        now = meaning(effect, model)
        of, changes, before = self._known.get(name, (None, 0, {}))
        if of is not effect or changes != effect._changes:
            self._known[name] = (effect, effect._changes, now)
            return
        for what, was in before.items():
            if (is_now := now.get(what)) != was:
                since = f"since an edit of {model.name!r} that is {is_now}"
                raise _core.ModelError(f"effect {name!r} of the scene {what} {was}; {since}: remove it, and add it anew")

    def forget(self, name: str) -> None:
        """Of an effect that is taken out."""
        self._known.pop(name, None)


def meaning(effect: Effect, model: Any) -> dict[str, str]:
    """What each of its names is of in a model as it is, and which coordinates its numbers are of where they are given one by one."""
    named, listed = chosen(effect), _listed(effect)
    if named is None and not listed:
        return {}
    if listed:
        coordinates = _core.coordinates_named(model, named, effect.kind())
        return {"has numbers for the coordinates": ", ".join(model.coordinate_names[j] for j in coordinates)}
    hinges, known = {name.partition("[")[0] for name in named or ()}, model._names()[1]
    return {f"acts on hinge {hinge!r}, which was": _described(model._body(known.index(hinge))) for hinge in hinges & set(known)}


def acted_on(effect: Effect, model: Any) -> set[int]:
    """Coordinates that it acts on as such, and not by the motions of bodies that these make."""
    made = effect.made_for(model)
    if made.coordinates or not (hasattr(effect, "hinges") or hasattr(effect, "hinge")):
        return set(made.coordinates)
    named = chosen(effect)
    if named is None and effect.kind() == "limits":  # of all that have one
        return set()
    return set(_core.coordinates_named(model, named, effect.kind()))


def chosen(effect: Effect) -> list[str] | None:
    """Names of hinges and coordinates, and patterns, that it was given; None where it has no such, or acts on all."""
    for value in effect.values():
        if isinstance(value, Mapping):
            return names_of(list(value), effect.kind())
    return names_of(getattr(effect, "hinges", getattr(effect, "hinge", None)), effect.kind())


def _listed(effect: Effect) -> bool:
    """Whether some of its numbers are of coordinates one by one, in their order; those that depend on time may be."""
    if not hasattr(effect, "hinges"):
        return False
    given = effect.values(besides=("hinges", "function"))
    return any(isinstance(x, InTime) or callable(x) or (isinstance(x, (list, tuple, np.ndarray)) and np.size(x) > 1) for x in given)


def _described(body: dict[str, Any]) -> str:
    """Of the hinge of a body: its subhinges in any order, as it may be turned round; a free one is of the body alone."""
    hinge = body["hinge"]
    if hinge["kind"] == "free":
        return f"the free hinge of body {body['name']!r}"
    return f"a hinge of {', '.join(sorted(each['kind'] for each in hinge['subhinges'])) or 'no coordinates'}"
