"""Data of a model's file beside bodies and hinges: parameters of effects, and the names of elements that are not read."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arguments import fixed
from .offers import Offer
from .shapes import Shape


class Beside:
    """Data beside a loaded model; all of it is empty for a model that was built or generated."""

    _left_aside: dict[str, np.ndarray]
    _actuators: list[dict[str, Any]]
    _offers: list[Offer]
    _not_read: list[str]
    _shapes: list[Shape]

    def _begin_beside(self) -> None:
        self._left_aside, self._actuators, self._offers, self._not_read, self._shapes = {}, [], [], [], []

    @property
    def left_aside(self) -> dict[str, np.ndarray]:
        """Data of the model's file that are not part of the model, by name; empty for a model that was not loaded.

        "gravity" (3,), m/s²; per coordinate (nv,), NaN where the file has none: "damping", "quadratic damping", "friction", "stiffness",
        and "effort limit", "velocity limit"; "spring rest" (nq,), the rest positions of springs, unless they are zero.
        `pycraft.effects.from_model` makes effects of them; `integrate_ode(..., damping=np.nan_to_num(arm.left_aside["damping"]))` uses the
        first of these. The arrays are read-only.
        """
        return {name: fixed(values) for name, values in self._left_aside.items()}

    @property
    def actuators(self) -> list[dict[str, Any]]:
        """The actuators of the model's file, empty for a model that was not loaded: `pycraft.effects.from_model` makes effects of them.

        Each is a dictionary: "name", "coordinate", "gear", "gain", "bias" (3,), "control", the value that stands for zero, "force range"
        (2,), and "why not", the reason why no effect represents it, or None. With a control u the force at the coordinate is gear ·
        clip(gain u + bias · (1, gear q, gear v), force range).
        """
        return [{key: fixed(value) for key, value in actuator.items()} for actuator in self._actuators]

    @property
    def offers(self) -> list[Offer]:
        """Gravity compensation and boxes in a fluid from the model's file: `pycraft.effects.from_model` makes effects of them."""
        return list(self._offers)

    @property
    def not_read(self) -> list[str]:
        """Elements that change motions in the program of the model's file, but are neither in the model nor available as effects, in words.

        Contacts, tendons, plugins and the like of an MJCF file, empty for a model that was not loaded. `pycraft.effects.from_model`
        repeats it.
        """
        return list(self._not_read)
