"""Meaning of the names and lists of values of effects: structural edits that would change it raise an error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ... import _core
from .effect import Effect, names_of
from .functions_of_time import InTime


class Meanings:
    """Meaning of each effect of a scene when it was added, or when its fields last changed."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[Effect, int, dict[str, str]]] = {}

    def keep(self, name: str, effect: Effect, model: Any) -> None:
        """Record a new or changed effect. Raises ModelError, with the former meaning, for an effect whose meaning an edit changed."""
        now = meaning(effect, model)
        of, changes, before = self._known.get(name, (None, 0, {}))
        if of is not effect or changes != effect._changes:
            self._known[name] = (effect, effect._changes, now)
            return
        for what, was in before.items():
            if (is_now := now.get(what)) != was:
                since = f"since an edit of {model.name!r} that is {is_now}"
                raise _core.ModelError(f"effect {name!r} of the scene {what} {was}; {since}: remove it, and add it again")

    def forget(self, name: str) -> None:
        """Forget a removed effect."""
        self._known.pop(name, None)


def meaning(effect: Effect, model: Any) -> dict[str, str]:
    """Return the present meaning of each of its names in a model, and the coordinates of values given one by one."""
    named, listed = chosen(effect), _listed(effect)
    if named is None and not listed:
        return {}
    if listed:
        coordinates = _core.coordinates_named(model, named, effect.kind())
        return {"has numbers for the coordinates": ", ".join(model.coordinate_names[j] for j in coordinates)}
    hinges, known = {name.partition("[")[0] for name in named or ()}, model._names()[1]
    return {f"acts on hinge {hinge!r}, which was": _described(model._body(known.index(hinge))) for hinge in hinges & set(known)}


def acted_on(effect: Effect, model: Any) -> set[int]:
    """Return the coordinates on which it acts directly, instead of through the motion of bodies."""
    made = effect.made_for(model)
    if made.coordinates or not (hasattr(effect, "hinges") or hasattr(effect, "hinge")):
        return set(made.coordinates)
    named = chosen(effect)
    if named is None and effect.kind() == "limits":  # all coordinates with a limit
        return set()
    return set(_core.coordinates_named(model, named, effect.kind()))


def chosen(effect: Effect) -> list[str] | None:
    """Return its given names of hinges and coordinates, and patterns; None if it has none, or acts on all."""
    for value in effect.values():
        if isinstance(value, Mapping):
            return names_of(list(value), effect.kind())
    return names_of(getattr(effect, "hinges", getattr(effect, "hinge", None)), effect.kind())


def _listed(effect: Effect) -> bool:
    """Return True if some of its values belong to single coordinates, in order; values that depend on time may."""
    if not hasattr(effect, "hinges"):
        return False
    given = effect.values(besides=("hinges", "function"))
    return any(isinstance(x, InTime) or callable(x) or (isinstance(x, (list, tuple, np.ndarray)) and np.size(x) > 1) for x in given)


def _described(body: dict[str, Any]) -> str:
    """Describe the hinge of a body: its subhinges in any order, because it may be reversed; a free hinge by its body only."""
    hinge = body["hinge"]
    if hinge["kind"] == "free":
        return f"the free hinge of body {body['name']!r}"
    return f"a hinge of {', '.join(sorted(each['kind'] for each in hinge['subhinges'])) or 'no coordinates'}"
