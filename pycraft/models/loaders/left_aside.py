"""Data of a file that are not part of the model: gathered by coordinate, reported once, stored as values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..offers import BoxInFluid, HeldWeight
from ..warning import warn

if TYPE_CHECKING:
    from ..multibody import Multibody

OFF = "the file disables it"
"""The reason for an actuator that gives no force in its own program either."""
_SHOWN = 12
"""Number of unread items that a warning names."""
QUANTITIES = ("damping", "quadratic damping", "friction", "stiffness", "effort limit", "velocity limit")
"""Quantities by coordinate; further ones are "gravity", and "spring rest" by the coordinates q."""


def by_coordinate(model: Multibody, of_hinges: Mapping[str, Mapping[str, float]]) -> dict[str, np.ndarray]:
    """Return arrays (nv,) from values by quantity and hinge; NaN where the file has none of that quantity.

    Hinges that the model does not have (they were welded) are skipped, and quantities that then remain on no hinge.
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
    """Return the part of `left_aside` for the model's present coordinates. Warns of the rest: the model was edited since."""
    left = model.left_aside
    sizes = {"gravity": 3, "spring rest": model.nq}
    stale = [quantity for quantity, values in left.items() if len(values) != sizes.get(quantity, model.nv)]
    if stale:
        numbers = ", ".join(f"{quantity} of {len(left[quantity])} coordinates" for quantity in stale)
        warn(f"{model.name!r} was edited since it was loaded and has {model.nv} coordinates; its left_aside is not saved: {numbers}")
    return {quantity: values for quantity, values in left.items() if quantity not in stale}


def current_actuators(model: Multibody) -> list[dict[str, Any]]:
    """Return the actuators at coordinates that the model still has. Warns of the others, as `current` does."""
    names = {None, *model.coordinate_names}
    gone = [actuator["name"] for actuator in model.actuators if actuator["coordinate"] not in names]
    if gone:
        lost = ", ".join(gone)
        warn(f"{model.name!r} was edited since it was loaded; actuators at coordinates that it no longer has are not saved: {lost}")
    return [actuator for actuator in model.actuators if actuator["coordinate"] in names]


_NAMES = {
    "damping": "joint damping",
    "quadratic damping": "quadratic joint damping",
    "friction": "joint friction",
    "stiffness": "joint springs",
    "effort limit": "effort limits",
    "velocity limit": "velocity limits",
}
"""Names of the quantities in warnings."""


def told(left: Mapping[str, np.ndarray], model: Multibody) -> str:
    """Return the warnings of `load` for a file: data for effects, the gravity, and unread elements; empty if there are none."""
    parts, said = [], []
    for quantity, values in left.items():
        if quantity in _NAMES:
            parts.append(f"{_NAMES[quantity]} ({_count(int(np.count_nonzero(~np.isnan(values))), 'coordinate')})")
    if drives := [actuator for actuator in model.actuators if actuator["why not"] is None]:
        parts.append(_count(len(drives), "actuator"))
    if held := {offer.body for offer in model.offers if isinstance(offer, HeldWeight)}:
        parts.append(f"gravity compensation ({_count(len(held), 'body')})")
    if any(isinstance(offer, BoxInFluid) for offer in model.offers):
        parts.append("the resistance of a fluid")
    if parts:
        said.append(f"not in the model: {', '.join(parts)}; pycraft.effects.from_model(model) makes effects of them")
    if "gravity" in left:
        said.append(f'Gravity {tuple(left["gravity"].tolist())} of the file is not set; load(..., gravity="file") sets it')
    unread = [
        *model.not_read,
        *(f"actuator {drive['name']!r} ({why})" for drive in model.actuators if (why := drive["why not"]) not in (None, OFF)),
    ]
    if unread:
        shown = unread[:_SHOWN] + [f"... ({len(unread)} in all: model.not_read, model.actuators)"] * (len(unread) > _SHOWN)
        said.append(f"Not read, although it changes the motion: {', '.join(shown)}")
    return ". ".join(said)


def _count(count: int, what: str) -> str:
    many = what[:-1] + "ies" if what.endswith("y") else what + "s"
    return f"{count} {what if count == 1 else many}"
