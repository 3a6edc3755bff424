"""Fields of gravity."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ... import _core
from ...arguments import one_number
from .effect import Effect, names_of, numbers_of

EARTH = (0.0, 0.0, -9.81)
"""Default gravity, m/s², if neither the effect nor the model has one."""


@dataclass(repr=False, eq=False)
class Gravity(Effect):
    """Uniform gravity: the force m g at every body's centre of mass. Potential -Σ m g·c.

    It costs nothing: accelerations are computed with the base accelerated by -g.

    Parameters
    ----------
    g : (3,) m/s², in the world's axes; None: the model's own gravity if it is not zero, else (0, 0, -9.81)
        The model's gravity is read when the scene computes, so a later `model.gravity = ...` takes effect.
    """

    g: Any = None

    def completed_for(self, model: _core.Multibody) -> Gravity:
        if self.g is not None:
            return self
        own = np.asarray(model.gravity)
        return replace(self, g=tuple(own.tolist()) if own.any() else EARTH)

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        return _core.gravity_effect(self.completed_for(model).g)


@dataclass(repr=False, eq=False)
class PointMassGravity(Effect):
    """The gravity of a point mass, F = -μ m r/|r|³ at every body's centre of mass, r from the point. Potential -Σ μ m/|r|.

    Parameters
    ----------
    mu : m³/s², the gravitational parameter
    position : (3,) m, the point, in the world's axes
    bodies : names of bodies, patterns, or a list of them; None: all
    """

    _example = "pc.effects.PointMassGravity(3.986e14) for the Earth"

    mu: float
    position: Any = (0.0, 0.0, 0.0)
    bodies: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        mu = one_number(self.mu, "point_mass_gravity: mu")
        return _core.point_mass_gravity_effect(model, mu, self.position, names_of(self.bodies, "point_mass_gravity", "bodies"))


@dataclass(repr=False, eq=False)
class GravityGradient(Effect):
    """Gravity gradient of a point mass on extended bodies, to the order of the inertia (MacCullagh): N = 3μ/|r|³ r̂ × I r̂ and a force.

    Parameters
    ----------
    mu : m³/s²
    position : (3,) m, the attracting point, in the world's axes
    bodies : names of bodies, patterns, or a list of them; None: all
    """

    _example = "pc.effects.GravityGradient(3.986e14) for the Earth"

    mu: float
    position: Any = (0.0, 0.0, 0.0)
    bodies: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        mu = one_number(self.mu, "gravity_gradient: mu")
        return _core.gravity_gradient_effect(model, mu, self.position, names_of(self.bodies, "gravity_gradient", "bodies"))


@dataclass(repr=False, eq=False)
class GravityCompensation(Effect):
    """Hold bodies up against uniform gravity: the force -share m g at a point of every body. Potential Σ share m g·c.

    Parameters
    ----------
    share : float or (n,)
        Share of each body's weight, one number for all or one per body: 1 cancels it, 0 leaves it, 2 lifts the body with its weight.
    bodies : names of bodies, patterns, or a list of them; None: all
    points : (n, 3) m
        Point at which each body is held, in its axes; default: the centres of mass.
    g : (3,) m/s², in the world's axes
        The compensated gravity; default: the model's own if it is set, else (0, 0, -9.81).

    Raises
    ------
    ModelError
        Unknown bodies, a wrong number of values, values that are not finite.
    """

    share: Any = 1.0
    bodies: Any = None
    points: Any = None
    g: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        kind = "gravity_compensation"
        share = numbers_of(self.share, f"{kind}: share")
        points = [] if self.points is None else _core.real_array(self.points, f"{kind}: points").ravel().tolist()
        g = self.g if self.g is not None else model.gravity if model.gravity.any() else (0.0, 0.0, -9.81)
        return _core.gravity_compensation_effect(model, names_of(self.bodies, kind, "bodies"), share, points, g)
