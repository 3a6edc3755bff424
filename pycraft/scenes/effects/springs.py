"""Springs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import _core
from ...arguments import one_number, pose_parts
from .effect import Effect, by_hinge, node_name, numbers_of, warn_of_negative


@dataclass(repr=False, eq=False)
class Spring(Effect):
    """Springs at hinges, T = -k (q - rest) on pins, sliders and screws, T = -k θ on balls, θ the rotation vector from rest.

    The potential is ½ k (q - rest)² and ½ k |θ|².

    Parameters
    ----------
    stiffness : N m/rad or N/m
        One number, one for each coordinate, or a dictionary by hinge. A ball has one stiffness. A negative value causes a warning.
    rest : rad or m, quaternions of balls
        One number, or as many values as these hinges have in q; 0: all at zero.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all but free ones
    """

    _example = "pc.effects.Spring(100.0)"

    stiffness: Any
    rest: Any = 0.0
    hinges: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.stiffness, self.hinges, model, "spring", "stiffness")
        warn_of_negative(values, "spring", "stiffness", "it drives away from rest")
        return _core.spring_effect(model, names, values, numbers_of(self.rest, "spring: rest"))


@dataclass(repr=False, eq=False)
class ImplicitSpring(Effect):
    """Springs at pins, sliders and screws, implicit in fixed steps: they add h² k to D, stable for any step and any k.

    Implicit integrators ("rosenbrock4", "radau", ...) and `Scene.evaluate` without a step use plain springs,
    T = -k (q - rest); explicit integrators refuse them.

    Parameters
    ----------
    stiffness : N m/rad or N/m
        One number, one for each coordinate, or a dictionary by hinge; not negative.
    rest : rad or m, one number or one for each coordinate
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all pins, sliders and screws
    """

    _example = "pc.effects.ImplicitSpring(100.0)"

    stiffness: Any
    rest: Any = 0.0
    hinges: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.stiffness, self.hinges, model, "implicit_spring", "stiffness")
        return _core.implicit_spring_effect(model, names, values, numbers_of(self.rest, "implicit_spring: rest"))

    def at_states(self, model: _core.Multibody) -> Spring:
        names, values = by_hinge(self.stiffness, self.hinges, model, "implicit_spring", "stiffness")
        if names is None:  # a plain spring would include the balls
            names = [name for j, name in enumerate(model.coordinate_names) if _core.numbers_in_q(model, [j]) == 1]
        return Spring(values[0] if len(values) == 1 else values, self.rest, names)


@dataclass(repr=False, eq=False)
class NodeSpring(Effect):
    """A spring between two nodes, with the force k (L - length) along the line between their origins. Potential ½ k (L - length)².

    Parameters
    ----------
    node_a, node_b : names of nodes or bodies; None: the base
    stiffness : N/m
    length : m, natural length; 0: linear in all directions
    """

    _example = 'pc.effects.NodeSpring("hand", None, stiffness=100.0)'

    node_a: Any
    node_b: Any
    stiffness: float
    length: float = 0.0

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        numbers = one_number(self.stiffness, "node_spring: stiffness"), one_number(self.length, "node_spring: length")
        warn_of_negative(numbers[:1], "node_spring", "stiffness", "it drives the nodes apart")
        return _core.node_spring_effect(model, node_name(self.node_a, "node_spring"), node_name(self.node_b, "node_spring"), *numbers)


@dataclass(repr=False, eq=False)
class NodeDamper(Effect):
    """A damper between two nodes, with the force c L̇ along the line between their origins.

    Parameters
    ----------
    node_a, node_b : names of nodes or bodies; None: the base
    coefficient : N s/m
    """

    _example = 'pc.effects.NodeDamper("hand", None, coefficient=10.0)'

    node_a: Any
    node_b: Any
    coefficient: float

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        coefficient = one_number(self.coefficient, "node_damper: coefficient")
        warn_of_negative([coefficient], "node_damper", "coefficient", "it drives the motion instead of braking it")
        return _core.node_damper_effect(model, node_name(self.node_a, "node_damper"), node_name(self.node_b, "node_damper"), coefficient)


@dataclass(repr=False, eq=False)
class Bushing(Effect):
    """A spring and damper in six dimensions between two nodes, with the wrench K ξ + C ξ̇, ξ = (rotation vector; position) of b in a.
    Potential ½ ξ* K ξ.

    Parameters
    ----------
    node_a, node_b : names of nodes or bodies; None: the base
    stiffness : (6,) or (6, 6), N m/rad and N/m, rotations first, in the axes of a at rest; symmetric
    damping : (6,) or (6, 6), N m s/rad and N s/m
    rest : (4, 4), the pose of b in a without deformation; None: coinciding frames
    """

    _example = 'pc.effects.Bushing("hand", None, stiffness=1000.0)'

    node_a: Any
    node_b: Any
    stiffness: Any
    damping: Any = 0.0
    rest: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        a, b = node_name(self.node_a, "bushing"), node_name(self.node_b, "bushing")
        K, C = _six_by_six(self.stiffness, "bushing: stiffness"), _six_by_six(self.damping, "bushing: damping")
        rotation, position = pose_parts("a bushing at rest", None, None, np.eye(4) if self.rest is None else self.rest)
        return _core.bushing_effect(model, a, b, K, C, rotation, position)


def _six_by_six(value: Any, what: str) -> np.ndarray:
    given = _core.real_array(value, what)
    if given.shape in ((), (6,)):
        return np.diag(np.broadcast_to(given, 6)).copy()
    if given.shape != (6, 6):
        raise _core.ModelError(f"{what} takes six numbers or a (6, 6) matrix, not an array {given.shape}")
    return given
