"""Derivatives in typed statements: ∂ or ∂_i along a coordinate i, ∂_j along another, ∂_t along time; Δ_i and Δ_j belong to them."""

from __future__ import annotations

from typing import Any

from .. import _core

COORDINATES = ("i", "j")
"""What coordinates are called in text; which ones of a model they are, `coordinates_meant` says."""


def coordinates_meant(operators: Any) -> tuple[int, int]:
    """The coordinates i and j of a model: where a statement about any coordinate is most likely to fail.

    i is the last of its hinge, so that the subhinges before it turn with it, of a body that hangs on another and carries some; j is one
    outboard of it where there is one, else another.

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


def along(x: Any, direction: str, operators: Any) -> Any:
    """The derivative of an expression along i, j or time ("t"); along time accelerations are the vector vdot.

    Raises
    ------
    EvaluationError
        What is to be differentiated is no expression.
    """
    if not isinstance(x, (_core.Operator, _core.Scalar)):
        raise _core.EvaluationError(f"{x} is a number: nothing to differentiate")
    if direction == "t":
        return x.dot(vdot=_core.vector("vdot", operators.Theta))
    return x.diff(coordinates_meant(operators)[COORDINATES.index(direction)])
