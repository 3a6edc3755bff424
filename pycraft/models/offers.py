"""Forces on bodies from a model's file: data beside the model, from which `pycraft.effects.from_model` makes effects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arguments import Fixed


@dataclass(frozen=True, eq=False)
class HeldWeight(Fixed):
    """A part of a body with compensated gravity.

    Attributes
    ----------
    body : name of a body or node
    mass : kg, of the compensated weight
    point : (3,) m, of the compensating force, in the frame of the body or node
    g : (3,) m/s², in the world's axes, or None for the model's gravity at evaluation
    """

    body: str
    mass: float
    point: np.ndarray
    g: tuple[float, ...] | None


@dataclass(frozen=True, eq=False)
class BoxInFluid(Fixed):
    """A box with fluid drag: see `pycraft.effects.FluidDrag`.

    Attributes
    ----------
    body : name of a body or node
    size : (3,) m, its edges
    placement : (4, 4), of its centre and axes in the frame of the body or node
    density, viscosity, wind : of the fluid: kg/m³, Pa s, (3,) m/s in the world's axes
    """

    body: str
    size: np.ndarray
    placement: np.ndarray
    density: float
    viscosity: float
    wind: tuple[float, ...]

    @property
    def fluid(self) -> tuple[float, float, tuple[float, ...]]:
        """Density, viscosity and wind."""
        return self.density, self.viscosity, self.wind


Offer = HeldWeight | BoxInFluid
