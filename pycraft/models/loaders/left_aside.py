"""What a file says and a model does not have: gathered by coordinate, told once, kept as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..warning import warn

if TYPE_CHECKING:
    from ..multibody import Multibody

QUANTITIES = ("damping", "friction", "stiffness", "effort limit", "velocity limit")
"""What of a coordinate there is to leave aside; beside them "gravity"."""


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
    stale = [quantity for quantity, values in left.items() if quantity != "gravity" and len(values) != model.nv]
    if stale:
        numbers = ", ".join(f"{quantity} of {len(left[quantity])} coordinates" for quantity in stale)
        warn(f"{model.name!r} was edited since it was loaded and has {model.nv} coordinates: not saved is what was left aside, {numbers}")
    return {quantity: values for quantity, values in left.items() if quantity not in stale}


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
