"""What a file says and a model does not have: gathered by coordinate, told once, kept as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..multibody import Multibody


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
