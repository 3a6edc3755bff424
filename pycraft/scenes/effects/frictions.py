"""Friction and damping of hinges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from ...arguments import one_number
from .effect import Effect, by_hinge, warn_of_negative


@dataclass(repr=False, eq=False)
class Damping(Effect):
    """Viscous damping, T = -c v at every coordinate.

    Parameters
    ----------
    coefficient : N m s/rad or N s/m
        One number, one for each coordinate, or a dictionary by hinge. A negative value drives the motion and causes a warning.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    """

    _example = "pc.effects.Damping(0.1)"

    coefficient: Any
    hinges: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.coefficient, self.hinges, model, "damping", "coefficient")
        warn_of_negative(values, "damping", "coefficient", "it drives the motion instead of braking it")
        return _core.damping_effect(model, names, values)


@dataclass(repr=False, eq=False)
class QuadraticDamping(Effect):
    """Quadratic damping, as in air, T = -c |v| v at every coordinate.

    Parameters
    ----------
    coefficient : N m s²/rad² or N s²/m²
        One number, one for each coordinate, or a dictionary by hinge. A negative value causes a warning.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    """

    _example = "pc.effects.QuadraticDamping(0.1)"

    coefficient: Any
    hinges: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.coefficient, self.hinges, model, "quadratic_damping", "coefficient")
        warn_of_negative(values, "quadratic_damping", "coefficient", "it drives the motion instead of braking it")
        return _core.quadratic_damping_effect(model, names, values)


@dataclass(repr=False, eq=False)
class CoulombFriction(Effect):
    """Dry friction, smoothed: T = -F tanh(v/s) at every coordinate. Joints that should stick creep at s T/F.

    Parameters
    ----------
    level : N m or N
        F: one number, one for each coordinate, or a dictionary by hinge; not negative.
    smoothing : rad/s or m/s
        s, the speed at which three quarters of F are reached. Small values make the equations stiff.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    """

    _example = "pc.effects.CoulombFriction(0.5)"

    level: Any
    smoothing: float = 0.01
    hinges: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.level, self.hinges, model, "coulomb_friction", "level")
        return _core.coulomb_friction_effect(model, names, values, one_number(self.smoothing, "coulomb_friction: smoothing"))


@dataclass(repr=False, eq=False)
class ImplicitDamping(Effect):
    """Viscous damping, implicit in fixed steps: they add h c to D ("semi-implicit-euler"), stable for any step and any c.

    Implicit integrators ("rosenbrock4", "radau", ...) and `Scene.evaluate` without a step use plain damping, T = -c v;
    explicit integrators refuse it.

    Parameters
    ----------
    coefficient : N m s/rad or N s/m
        One number, one for each coordinate, or a dictionary by hinge; not negative.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    """

    _example = "pc.effects.ImplicitDamping(0.1)"

    coefficient: Any
    hinges: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.coefficient, self.hinges, model, "implicit_damping", "coefficient")
        return _core.implicit_damping_effect(model, names, values)

    def at_states(self, model: _core.Multibody) -> Damping:  # noqa: ARG002 - signature of the base
        return Damping(self.coefficient, self.hinges)
