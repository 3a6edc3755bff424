"""Gyroscopic forces of rotors as expressions: b_J = θ̇ ×* (Jθ̇) at hinges of three or six coordinates about a point.

Kinetic energy ½θ̇*(ℳ + J)θ̇ gives the equations of motion (ℳ + J)θ̈ + Hφ(Mφ*a + b) + b_J = T. With [e_i, e_a]_j the structure constants
of a ball's or a free subhinge's group, and e_i the unit vectors of Θ,

    hinge_cross = Σ_i e_i θ̇*B_i,  (B_i)_aj = [e_i, e_a]_j        b_J = hinge_cross J θ̇
    C_J = ½(hinge_cross J − J hinge_cross* + Σ_i e_i (Jθ̇)*B_i*)   C_J θ̇ = b_J, C_J* = −C_J: what rotors add to the Christoffel matrix
"""

from __future__ import annotations

from functools import reduce
from operator import add
from typing import Any

import numpy as np

from .. import _core

NAMES = ("hinge_cross", "b_J", "C_J")


def rotor_letter(soa: Any, name: str) -> _core.Operator:
    """hinge_cross, b_J or C_J of a model's operators.

    Raises
    ------
    AttributeError
        The operators are not those of a whole model.
    """
    if not isinstance(soa._source, _core.MultibodyOperators) or soa._model is None:
        raise AttributeError(f"{name} is an operator of a whole model, model.soa.{name}: {soa._source.name!r} is none")
    rows = _brackets(soa) if not soa._source.traits["J = 0"] else []
    J, theta_dot = soa.J, soa.theta_dot
    if not rows:
        return _core.zero(theta_dot.domain if name == "b_J" else soa.Theta, soa.Theta)
    cross = reduce(add, (e @ theta_dot.T @ B for e, B in rows))
    if name == "hinge_cross":
        return cross
    if name == "b_J":
        return cross @ J @ theta_dot
    turned = reduce(add, (e @ (J @ theta_dot).T @ B.T for e, B in rows))
    return 0.5 * (cross @ J - J @ cross.T + turned)


def _brackets(soa: Any) -> list[tuple[_core.Operator, _core.Operator]]:
    """(e_i, B_i) of every coordinate of a subhinge whose group does not commute."""
    found, at, n = [], 0, soa.Theta.dimension
    one = _core.euclidean(1)
    for body in soa._model.description()["bodies"]:
        for subhinge in body["hinge"]["subhinges"]:
            constants = STRUCTURE.get(subhinge["kind"])
            size = _core.subhinge_kinds[subhinge["kind"]].nv
            for i, bracket in enumerate(constants if constants is not None else ()):
                unit, B = np.zeros((n, 1)), np.zeros((n, n))
                unit[at + i] = 1
                B[at : at + size, at : at + size] = bracket
                name = soa._source.coordinate_names[at + i]
                found.append((_core.constant(unit, one, soa.Theta, f"e_{name}"), _core.constant(B, soa.Theta, soa.Theta, f"B_{name}")))
            at += size
    return found


def _structure(size: int) -> np.ndarray:
    """c[i, a, j] = [e_i, e_a]_j: the cross product, of two twists where there are six."""
    cross = np.zeros((3, 3, 3))
    for i, a, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[i, a, j], cross[a, i, j] = 1, -1
    if size == 3:
        return cross
    c = np.zeros((6, 6, 6))
    c[:3, :3, :3] = c[:3, 3:, 3:] = c[3:, :3, 3:] = cross
    return c


STRUCTURE = {"ball": _structure(3), "free": _structure(6)}
"""By the kind of the subhinge."""
