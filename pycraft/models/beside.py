"""What a model's file says beside bodies and hinges: numbers for effects, and the names of what is not read."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arguments import fixed
from .offers import Offer
from .shapes import Shape


class Beside:
    """What stands beside a model that was loaded; all of it is empty for a model that was built or generated."""

    _left_aside: dict[str, np.ndarray]
    _actuators: list[dict[str, Any]]
    _offers: list[Offer]
    _not_read: list[str]
    _shapes: list[Shape]

    def _begin_beside(self) -> None:
        self._left_aside, self._actuators, self._offers, self._not_read, self._shapes = {}, [], [], [], []

    @property
    def left_aside(self) -> dict[str, np.ndarray]:
        """What the model's file says beside the model, by name; empty for a model that was not loaded.

        "gravity" (3,), m/s²; per coordinate (nv,), NaN where the file has none: "damping", "quadratic damping", "friction", "stiffness",
        and "effort limit", "velocity limit"; "spring rest" (nq,), where springs are slack, if that is not zero.
        `pycraft.effects.from_model` makes effects of them; `integrate_ode(..., damping=np.nan_to_num(arm.left_aside["damping"]))` takes
        the first of these. The arrays are read-only.
        """
        return {name: fixed(values) for name, values in self._left_aside.items()}

    @property
    def actuators(self) -> list[dict[str, Any]]:
        """The actuators of the model's file, none for a model that was not loaded: `pycraft.effects.from_model` makes effects of them.

        Each a dictionary: "name", "coordinate", "gear", "gain", "bias" (3,), "control", the one that stands for zero, "force range" (2,),
        and "why not" of one that no effect is, else None. With a control u the force at the coordinate is gear · clip(gain u + bias · (1,
        gear q, gear v), force range).
        """
        return [{key: fixed(value) for key, value in actuator.items()} for actuator in self._actuators]

    @property
    def offers(self) -> list[Offer]:
        """The weights that are held and the boxes in a fluid of the model's file: `pycraft.effects.from_model` makes effects of them."""
        return list(self._offers)

    @property
    def not_read(self) -> list[str]:
        """What changes motions in the program that the model's file is for, and is neither in the model nor an effect here, in words.

        Contacts, tendons, plugins and the like of an MJCF file, empty for a model that was not loaded. `pycraft.effects.from_model`
        repeats it.
        """
        return list(self._not_read)
