"""What a file says and a model does not have: gathered by coordinate, told once, kept as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..warning import warn

if TYPE_CHECKING:
    from ..multibody import Multibody

QUANTITIES = ("damping", "friction", "stiffness", "effort limit", "velocity limit")
"""What of a coordinate there is to leave aside; beside them "gravity", and "spring rest" by the coordinates q."""


def by_coordinate(model: Multibody, of_hinges: Mapping[str, Mapping[str, float]]) -> dict[str, np.ndarray]:
    """Arrays (nv,) from numbers by quantity and hinge; NaN where the file has none of that quantity.

    A hinge that the model does not have (it was welded) is passed over, and so is a quantity that is left on none.
    """
    if not of_hinges:
        return {}
    hinges, counts = model._hinge_sizes()
    arrays = {}
    for quantity, numbers in of_hinges.items():
        values = np.repeat([numbers.get(hinge, np.nan) for hinge in hinges], counts)
        if not np.isnan(values).all():
            arrays[quantity] = values
    return arrays


def current(model: Multibody) -> dict[str, np.ndarray]:
    """What of `left_aside` belongs to the coordinates that the model has now. Warns of the rest: the model was edited since."""
    left = model.left_aside
    sizes = {"gravity": 3, "spring rest": model.nq}
    stale = [quantity for quantity, values in left.items() if len(values) != sizes.get(quantity, model.nv)]
    if stale:
        numbers = ", ".join(f"{quantity} of {len(left[quantity])} coordinates" for quantity in stale)
        warn(f"{model.name!r} was edited since it was loaded and has {model.nv} coordinates: not saved is what was left aside, {numbers}")
    return {quantity: values for quantity, values in left.items() if quantity not in stale}


def current_actuators(model: Multibody) -> list[dict[str, Any]]:
    """The actuators whose coordinates the model still has. Warns of the others, as `current` does."""
    names = {None, *model.coordinate_names}
    gone = [actuator["name"] for actuator in model.actuators if actuator["coordinate"] not in names]
    if gone:
        lost = ", ".join(gone)
        warn(f"{model.name!r} was edited since it was loaded: not saved are actuators whose coordinates it no longer has, {lost}")
    return [actuator for actuator in model.actuators if actuator["coordinate"] in names]


def told(left: Mapping[str, np.ndarray], model: Multibody) -> str:
    """One line about all of it, and how to get it; empty where nothing is left aside."""
    parts, drives = [], len(model.actuators)
    for quantity, values in left.items():
        if quantity == "spring rest":
            continue  # goes with the stiffness
        if quantity == "gravity":
            parts.append(f'gravity {tuple(values.tolist())}, which load(..., gravity="file") takes')
            continue
        count = int(np.count_nonzero(~np.isnan(values)))
        parts.append(f"{quantity} of {count} coordinate{'s' if count > 1 else ''}")
    if drives:
        parts.append(f"{drives} actuator{'s' if drives > 1 else ''}")
    if not parts:
        return ""
    return f"left aside: {'; '.join(parts)}; the numbers are in left_aside of the model"
