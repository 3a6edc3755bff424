"""Further data of a model's file, by coordinate, when the structure changes: carried over by hinge name, as q and v are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np


class Asides:
    """The present data beside a model (`left_aside`, `actuators`), to be restored to it, or added to another one, after an edit."""

    def __init__(self, model: Any):
        self._values: dict[str, np.ndarray] = model._left_aside
        self._actuators: list[dict[str, Any]] = model._actuators
        self._slices = _slices(model) if self._values or self._actuators else {}

    def put(self, model: Any, *, changed: Iterable[str] = (), turned: Iterable[str] = ()) -> None:
        """Restore the data to the model that they came from. Data of replaced hinges, `changed`, are dropped; hinges that were reversed
        have their coordinates in reverse order."""
        if not self._slices:
            return
        now, gone = _slices(model), set(changed)
        names = {name: name for name in self._slices if name in now and name not in gone}
        reverse = {name for name in turned if name in names and model.hinges[name].kind != "cylindrical"}
        model._left_aside = {key: values for key, values in self._values.items() if key == "gravity"}
        model._actuators = []
        self._overlay(model, now, names, reverse, str)

    def add(self, model: Any, hinges: Mapping[str, str], rename: Callable[[str], str]) -> None:
        """Add the data of hinges that were copied into a model, by their old names, to that model. `rename` applies to actuators."""
        if self._slices:
            model._left_aside, model._actuators = dict(model._left_aside), list(model._actuators)
            self._overlay(model, _slices(model), hinges, set(), rename)

    def of(self, hinge: str) -> dict[str, Any]:
        """Return the data of this hinge, to be restored when the same hinge returns."""
        if not self._slices:
            return {}
        own, names = self._slices[hinge], set(_coordinates(hinge, self._slices[hinge][1]))
        values = {key: np.array(all_[own[key != "spring rest"]]) for key, all_ in self._values.items() if key != "gravity"}
        return {"left aside": values, "actuators": [actuator for actuator in self._actuators if actuator["coordinate"] in names]}

    def put_back(self, model: Any, hinge: str, kept: Mapping[str, Any]) -> None:
        """Restore the data that `of` returned for this hinge."""
        for key, values in kept.get("left aside", {}).items():
            of_q = key == "spring rest"
            made = model._left_aside.setdefault(key, np.array(model.zero_q()) if of_q else np.full(model.nv, np.nan))
            made[model._slices(model._hinge_index(hinge))[0 if of_q else 1]] = values
        model._actuators = [*model._actuators, *kept.get("actuators", ())]

    def _overlay(
        self, model: Any, now: Mapping[str, Any], names: Mapping[str, str], reverse: set[str], rename: Callable[[str], str]
    ) -> None:
        for key, values in self._values.items():
            if key == "gravity":
                continue
            of_q = key == "spring rest"
            made = model._left_aside.setdefault(key, np.array(model.zero_q()) if of_q else np.full(model.nv, np.nan))
            for old, new in names.items():
                source, target = (slices[0 if of_q else 1] for slices in (self._slices[old], now[new]))
                own = values[source]
                if len(own) == target.stop - target.start:
                    made[target] = own[::-1] if old in reverse else own
        coordinates: dict[str | None, str | None] = {None: None}
        for old, new in names.items():
            size, other = (slices[old if slices is self._slices else new][1] for slices in (self._slices, now))
            if size.stop - size.start == other.stop - other.start:
                before, after = _coordinates(old, size), _coordinates(new, other)
                coordinates |= dict(zip(before, after[::-1] if old in reverse else after, strict=True))
        for actuator in self._actuators:
            if actuator["coordinate"] in coordinates:
                model._actuators.append(actuator | {"coordinate": coordinates[actuator["coordinate"]], "name": rename(actuator["name"])})


def _slices(model: Any) -> dict[str, tuple[slice, slice]]:
    return {name: model._slices(k) for k, name in enumerate(model._names()[1])}


def _coordinates(hinge: str, own: slice) -> list[str]:
    """Return the names of a hinge's coordinates."""
    size = own.stop - own.start
    return [hinge] if size == 1 else [f"{hinge}[{j}]" for j in range(size)]
