"""What drives hinges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import _core
from .effect import Effect, names_of, numbers_of
from .functions_of_time import function_of_time


@dataclass(repr=False, eq=False)
class TorqueSource(Effect):
    """Torques or forces at coordinates, within limits.

    Parameters
    ----------
    torque : N m or N
        One number or one for each coordinate; a `Table`, `Spline` or `Harmonic`; or a function of t.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    effort_limit : N m or N, what it does not exceed; inf: none
    speed_limit : rad/s or m/s, beyond which it does not push; inf: none
    speed_band : share of the speed limit within which what drives further falls to nothing
    """

    torque: Any
    hinges: Any = None
    effort_limit: Any = np.inf
    speed_limit: Any = np.inf
    speed_band: float = 0.05

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        torque = function_of_time(self.torque, "torque_source: torque")
        limits = numbers_of(self.effort_limit, "torque_source: effort_limit"), numbers_of(self.speed_limit, "torque_source: speed_limit")
        return _core.torque_source_effect(model, names_of(self.hinges, "torque_source"), torque, *limits, float(self.speed_band))
