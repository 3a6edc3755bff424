"""Springs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from .effect import Effect, by_hinge, numbers_of, warn_of_negative


@dataclass(repr=False, eq=False)
class Spring(Effect):
    """Springs at hinges, T = -k (q - rest) on pins, sliders and screws, T = -k θ on balls, θ the rotation vector from rest.

    The potential is ½ k (q - rest)² and ½ k |θ|².

    Parameters
    ----------
    stiffness : N m/rad or N/m
        One number, one for each coordinate, or a dictionary by hinge. A ball has one stiffness. A negative one is warned of.
    rest : rad or m, quaternions of balls
        One number, or as many as these hinges have in q; 0: all at zero.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all but free ones
    """

    stiffness: Any
    rest: Any = 0.0
    hinges: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.stiffness, self.hinges, model, "spring", "stiffness")
        warn_of_negative(values, "spring", "stiffness", "it drives away from rest")
        return _core.spring_effect(model, names, values, numbers_of(self.rest, "spring: rest"))
