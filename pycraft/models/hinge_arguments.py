"""A hinge as users give it, taken apart before the core checks the numbers: of bodies that are added, or hung elsewhere."""

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
    """The arguments of a hinge as the core has them, by its names. `what` it belongs to, for errors: "body 'hand'".

    ModelError where arguments exclude one another or are of another kind of hinge.
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
    """The name of the body or node that something is put on; empty for the base."""
    if frame is None:
        return ""
    return frame.name if isinstance(frame, (Body, Node)) else text(frame, "a parent")


def body_name(body: str | Body) -> str:
    """The name of a body that is given by it or by its handle."""
    return body.name if isinstance(body, Body) else text(body, "a body")
