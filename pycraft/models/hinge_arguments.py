"""Read a hinge as users give it, before the core checks the values: for bodies that are added, or moved to another parent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..arguments import limit_pair, listed, pose_parts, text
from .handles import Body, Node, Vector
from .hinge_axes import hinge_axes


def hinge_arguments(
    what: str,
    hinge: str,
    *,
    axis: Vector | None = None,
    axes: Sequence[Vector] | None = None,
    point: Vector | None = None,
    pitch: float = 0.0,
    subhinges: Sequence[Mapping[str, Any]] | None = None,
    position: Vector | None = None,
    rotation: np.ndarray | None = None,
    placement: np.ndarray | None = None,
    rotor_inertia: float | Vector | None = None,
    limits: tuple[float | Vector, float | Vector] | None = None,
) -> dict[str, Any]:
    """Return the arguments of a hinge by the core's names. `what`: the owner, for errors, such as "body 'hand'".

    ModelError for arguments that exclude one another or belong to another kind of hinge.
    """
    hinge = text(hinge, "the kind of a hinge")
    directions = hinge_axes(what, hinge, axis, axes, point, subhinges)
    rotation, position = pose_parts(what, rotation, position, placement)
    lower, upper = limit_pair(what, limits)
    return {
        "hinge": hinge,
        "axes": directions,
        "point": point,
        "pitch": pitch,
        "subhinges": None if subhinges is None else listed(subhinges, f"subhinges of {what}"),
        "rotation": rotation,
        "position": position,
        "rotor_inertia": rotor_inertia,
        "lower": lower,
        "upper": upper,
    }


def frame_name(frame: str | Body | Node | None) -> str:
    """Return the name of the body or node of a placement; empty for the base."""
    if frame is None:
        return ""
    return frame.name if isinstance(frame, (Body, Node)) else text(frame, "a parent")


def body_name(body: str | Body) -> str:
    """Return the name of a body that is given by name or handle."""
    return body.name if isinstance(body, Body) else text(body, "a body")
