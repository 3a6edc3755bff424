"""Limits of coordinates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ... import _core
from .effect import Effect, names_of, numbers_of
from .stiffness_by_inertia import stiffness_by_inertia

FREQUENCY = 150.0
"""rad/s, of a coordinate against its stop where no stiffness is given."""


@dataclass(repr=False, eq=False)
class Limits(Effect):
    """Compliant stops at pins, sliders and screws (Hunt and Crossley): with d > 0 beyond a limit, k d max(0, 1 + a ḋ) back towards it.

    Potential ½ k d²; what is lost is work.

    Parameters
    ----------
    stiffness : N m/rad or N/m, k; one number or one for each coordinate
        None: ω² (ℳ + J)_jj at q = 0 with ω = 150 rad/s. A bounce then lasts about 20 ms, and a stop gives way by about g/ω² = 0.4 mm
        under a body's own weight.
    dissipation : s/rad or s/m, a; about 3/2 (1 - e)/v for a coefficient of restitution e at the speed v
    lower, upper : rad or m, one number or one for each coordinate; None: those of the model's hinges (`hinge.limits`)
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all that have a limit
    """

    _example = "pc.effects.Limits(1e4)"

    stiffness: Any = None
    dissipation: Any = 0.0
    lower: Any = None
    upper: Any = None
    hinges: Any = None

    def completed_for(self, model: _core.Multibody) -> Limits:
        if self.stiffness is not None:
            return self
        coordinates = replace(self, stiffness=0.0).made_for(model).coordinates
        return replace(self, stiffness=stiffness_by_inertia(model, coordinates, FREQUENCY, "limits"))

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        if self.stiffness is None:
            return self.completed_for(model).made_for(model)
        numbers = numbers_of(self.stiffness, "limits: stiffness"), numbers_of(self.dissipation, "limits: dissipation")
        bounds = [[] if x is None else numbers_of(x, f"limits: {what}") for x, what in ((self.lower, "lower"), (self.upper, "upper"))]
        return _core.limits_effect(model, names_of(self.hinges, "limits"), *numbers, *bounds)
