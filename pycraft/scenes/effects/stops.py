"""Limits of coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log1p
from typing import Any

from ... import _core
from .effect import Effect, names_of, numbers_of
from .stiffness_by_inertia import stiffness_by_inertia

FREQUENCY = 150.0
"""Default frequency of a coordinate against its stop, rad/s, if no stiffness is given."""


@dataclass(repr=False, eq=False)
class Limits(Effect):
    """Compliant stops at pins, sliders and screws (Hunt and Crossley): with d > 0 beyond a limit, k d max(0, 1 + a ḋ) back towards it.

    Potential ½ k d²; the dissipated energy is work of the effect.

    Parameters
    ----------
    stiffness : N m/rad or N/m, k; one number or one for each coordinate
        None: ω² (ℳ + J)_jj at q = 0 with ω = 150 rad/s. A bounce then lasts about 20 ms, and a stop deflects by about g/ω² = 0.4 mm
        under a body's own weight.
    dissipation : s/rad or s/m, a; one number or one for each coordinate
    lower, upper : rad or m, one number or one for each coordinate; None: the limits of the model's hinges (`hinge.limits`)
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all that have a limit
    restitution : (e, v), instead of `dissipation`
        A coordinate that meets a stop at the speed v, rad/s or m/s, leaves it at e v, 0 < e ≤ 1, if only the stop acts; each value is one
        number or one per coordinate. Then a = α/v with α(1 + e) = ln((1 + α)/(1 - αe)), whatever the stiffness and the mass.
        Slower impacts lose a smaller share.

    Source: K. H. Hunt, F. R. E. Crossley, J. Applied Mechanics 42, 1975; α follows by integrating v dv/(1 + a v) from v to -e v.
    """

    _example = "pc.effects.Limits(1e4)"
    _several = ("restitution",)

    stiffness: Any = None
    dissipation: Any = 0.0
    lower: Any = None
    upper: Any = None
    hinges: Any = None
    restitution: Any = None

    def completed_for(self, model: _core.Multibody) -> Limits:
        if self.stiffness is not None:
            return self
        coordinates = replace(self, stiffness=0.0).made_for(model).coordinates
        return replace(self, stiffness=stiffness_by_inertia(model, coordinates, FREQUENCY, "limits"))

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        if self.stiffness is None:
            return self.completed_for(model).made_for(model)
        numbers = numbers_of(self.stiffness, "limits: stiffness"), self._dissipation()
        bounds = [[] if x is None else numbers_of(x, f"limits: {what}") for x, what in ((self.lower, "lower"), (self.upper, "upper"))]
        return _core.limits_effect(model, names_of(self.hinges, "limits"), *numbers, *bounds)

    def _dissipation(self) -> list[float]:
        given = numbers_of(self.dissipation, "limits: dissipation")
        if self.restitution is None:
            return given
        if any(given):
            raise _core.ModelError("limits: give either dissipation or restitution, not both")
        if not isinstance(self.restitution, Sequence) or len(self.restitution) != 2:
            raise _core.ModelError(
                f"limits: restitution must be a pair (e, v), a coefficient and the speed at which it holds, not {self.restitution!r:.80}"
            )
        shares, speeds = (
            numbers_of(part, f"limits: {what} of restitution") for part, what in zip(self.restitution, ("e", "v"), strict=True)
        )
        if len(shares) != len(speeds) and 1 not in (len(shares), len(speeds)):
            raise _core.ModelError(
                f"limits: restitution has {len(shares)} coefficients and {len(speeds)} speeds; one number, or one for each coordinate"
            )
        count = max(len(shares), len(speeds))
        return [dissipation(e, v) for e, v in zip(shares * (count // len(shares)), speeds * (count // len(speeds)), strict=True)]


def dissipation(e: float, v: float) -> float:
    """Return a of a stop that returns a speed v as e v: α/v, α(1 + e) = ln((1 + α)/(1 - αe)), by bisection; else raises ModelError."""
    if not 1e-300 < e <= 1:
        raise _core.ModelError(f"limits: a coefficient of restitution is above 0 and no more than 1, not {e:g}")
    if not 0 < v < float("inf"):
        raise _core.ModelError(f"limits: restitution holds at a speed v that is positive and finite, not {v:g}")
    low, high = 0.0, 1.0 / e
    for _ in range(200):  # more than enough until the two are neighbouring doubles
        middle = (low + high) / 2
        if middle * e < 1 and _log_beyond(middle) < _log_beyond(-middle * e):
            low = middle
        else:
            high = middle
    return low / v


def _log_beyond(x: float) -> float:
    """Return ln(1 + x) - x, accurate to its own rounding for small x."""
    if abs(x) > 0.1:
        return log1p(x) - x
    term, total = x, 0.0
    for n in range(2, 20):
        term *= -x
        total += term / n
    return total
