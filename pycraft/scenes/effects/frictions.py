"""What brakes the motion of hinges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from .effect import Effect, by_hinge, warn_of_negative


@dataclass(repr=False, eq=False)
class Damping(Effect):
    """Viscous damping, T = -c v at every coordinate.

    Parameters
    ----------
    coefficient : N m s/rad or N s/m
        One number, one for each coordinate, or a dictionary by hinge. A negative one is warned of: it drives.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    """

    coefficient: Any
    hinges: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.coefficient, self.hinges, model, "damping", "coefficient")
        warn_of_negative(values, "damping", "coefficient", "it drives the motion instead of braking it")
        return _core.damping_effect(model, names, values)
