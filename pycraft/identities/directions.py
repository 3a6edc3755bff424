"""Derivatives in typed statements: ∂ or ∂_i along a coordinate i, ∂_j along another, ∂_t along time; Δ_i and Δ_j belong to them.

∂_x, ∂_y and ∂_z are along the three turns of one ball or free hinge, ∂_mass along the mass of the last body. In statements of embedded
loops i and j are independent coordinates.
"""

from __future__ import annotations

from typing import Any

from .. import _core

COORDINATES = ("i", "j")
"""Names of coordinates in text; `coordinates_meant` chooses coordinates of a model for them."""


def coordinates_meant(operators: Any) -> tuple[int, int]:
    """Return the coordinates i and j of a model for which a statement about any coordinate is most likely to fail.

    i is the last coordinate of its hinge, so that the subhinges before it turn with it, of a body with a parent and children; j is a
    coordinate outboard of it if there is one, else another.

    Raises
    ------
    ModelError
        The model has no coordinate.
    """
    source = operators._source
    parents, dof = source.parents, source.dof
    first = [sum(dof[:k]) for k in range(len(dof))]
    moving = [k for k, n in enumerate(dof) if n]
    if not moving:
        raise _core.ModelError(f"{source.name!r} has no coordinate to differentiate along")
    carried = [0] * len(parents)
    for k in reversed(range(len(parents))):
        if parents[k] >= 0:
            carried[parents[k]] += 1 + carried[k]
    own = max(moving, key=lambda k: (parents[k] >= 0, carried[k] > 0, dof[k], carried[k], -k))
    outboard = [k for k in moving if _is_outboard(k, own, parents)] or [k for k in moving if k != own] or [own]
    return first[own] + dof[own] - 1, first[outboard[0]]


def _is_outboard(k: int, of: int, parents: list[int]) -> bool:
    while parents[k] > of:
        k = parents[k]
    return parents[k] == of


AXES = ("x", "y", "z")
MASS = 0
"""The number of the mass among the parameters of a body's inertia."""


def axis_meant(operators: Any, axis: str) -> int:
    """Return the coordinate of a turn about an axis of the first ball or free hinge that is attached to a body; a root's turns no operator.

    Raises
    ------
    ModelError
        The model has no such hinge.
    """
    source, model = operators._source, operators._model
    first = 0
    for k, body in enumerate(model.description()["bodies"] if model is not None else ()):
        kinds = [subhinge["kind"] for subhinge in body["hinge"]["subhinges"]]
        if source.parents[k] >= 0 and kinds in (["ball"], ["free"]):
            return first + AXES.index(axis)
        first += source.dof[k]
    raise _core.ModelError(f"∂_{axis} is along a turn of a ball or free hinge that is attached to a body, and {source.name!r} has none")


def along(x: Any, direction: str, operators: Any) -> Any:
    """The derivative of an expression along i, j, time ("t"), an axis ("x", "y", "z") or a mass ("mass").

    Along time accelerations are the vector vdot.

    Raises
    ------
    EvaluationError
        The argument is not an expression.
    """
    if not isinstance(x, (_core.Operator, _core.Scalar)):
        raise _core.EvaluationError(f"{x} is a number, which cannot be differentiated")
    if direction == "mass":
        last = len(operators._source.parents) - 1
        return x.diff(_core._inertia_parameter(operators._source, last, MASS, "mass"))
    if direction in AXES:
        return x.diff(axis_meant(operators, direction))
    loops = getattr(operators, "_loops_embedded", None)
    if direction == "t" and loops is not None and isinstance(_core._moved(_operands(x)), _core.EmbeddedOperators):
        return x.dot(vdot=_core.vector("vdot_r", loops.Theta))
    if direction == "t":
        return x.dot(vdot=_core.vector("vdot", operators.Theta))
    if loops is not None:
        return _core._diff_on_loops(x, loops._source, operators.independent_coordinate(COORDINATES.index(direction)))
    return x.diff(coordinates_meant(operators)[COORDINATES.index(direction)])


def _operands(x: Any) -> list[Any]:
    return x.operands() if isinstance(x, _core.Scalar) else [x]
