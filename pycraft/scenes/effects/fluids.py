"""Forces of a fluid that surrounds the bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import _core
from ...arguments import one_number
from .effect import Effect, names_of


@dataclass(repr=False, eq=False)
class FluidDrag(Effect):
    """Resist motion through a fluid: quadratic drag on the faces of boxes, and Stokes's law for spheres of their size.

    In a box's axes, with edges a, b, c, d = (a + b + c)/3, v the velocity of its centre against the fluid and ω its angular velocity:
    f_x = -½ ρ b c |v_x| v_x - 3πβ d v_x and n_x = -ρ a (b⁴ + c⁴) |ω_x| ω_x/64 - πβ d³ ω_x, and so on around. This is MuJoCo's inertia
    model.

    Parameters
    ----------
    density : ρ, kg/m³
    viscosity : β, Pa s
    wind : (3,) m/s
        The velocity of the fluid, in the world's axes.
    bodies : names of bodies and nodes, one for each box
        By default every body that has mass and inertia, each with the homogeneous box of its mass and principal moments.
    sizes : (n, 3) m
        The edges of each box; default: the homogeneous boxes of equal mass and moments.
    placements : (n, 4, 4)
        The pose of each box in the frame of its body or node; give it if and only if `sizes` is given.

    Raises
    ------
    ModelError
        Unknown bodies, values that are negative or not finite, placements without sizes.
    """

    density: float = 0.0
    viscosity: float = 0.0
    wind: Any = (0.0, 0.0, 0.0)
    bodies: Any = None
    sizes: Any = None
    placements: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        density, viscosity = (one_number(getattr(self, name), f"fluid_drag: {name}") for name in ("density", "viscosity"))
        names = names_of(self.bodies, "fluid_drag", "bodies")
        placements: Any
        sizes: Any
        if (self.sizes is None) != (self.placements is None):
            raise _core.ModelError("fluid_drag: sizes and placements belong together; give both, or neither")
        if self.sizes is None or self.placements is None:
            names, placements, sizes = _equivalent_boxes(model, names)
        else:
            sizes, placements = (
                _core.real_array(self.sizes, "fluid_drag: sizes"),
                _core.real_array(self.placements, "fluid_drag: placements"),
            )
            count = len(names or ())
            if names is None or sizes.shape != (count, 3) or placements.shape != (count, 4, 4):
                text = f"sizes {sizes.shape} and placements {placements.shape} must be (n, 3) and (n, 4, 4), with n names in bodies"
                raise _core.ModelError(f"fluid_drag: {text}")
        return _core.fluid_drag_effect(model, density, viscosity, self.wind, names, list(placements), list(sizes))


def _equivalent_boxes(model: Any, names: list[str] | None) -> tuple[list[str], list[np.ndarray], list[np.ndarray]]:
    """Return the homogeneous boxes with the masses and principal moments of bodies: names, placements in the bodies, edges."""
    chosen, placements, sizes = [], [], []
    for name in model.bodies if names is None else names:
        body = model.bodies[name]
        if not body.mass:
            continue
        placement, size = equivalent_box(body.mass, body.com, body.inertia)
        chosen.append(name)
        placements.append(placement)
        sizes.append(size)
    return chosen, placements, sizes


def equivalent_box(mass: float, com: np.ndarray, inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the pose (4, 4) and the edges (3,) of the homogeneous box with this mass, centre of mass and central inertia."""
    moments, axes = np.linalg.eigh(inertia)
    placement = np.eye(4)
    placement[:3, :3], placement[:3, 3] = axes * np.sign(np.linalg.det(axes)), com
    return placement, np.sqrt(np.maximum(0.0, moments.sum() - 2 * moments) * 6 / mass)
