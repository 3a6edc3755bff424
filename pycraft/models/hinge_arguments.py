"""A hinge as users give it, taken apart before the core checks the numbers: of bodies that are added, or hung elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..arguments import limit_pair, listed, pose_parts, text
from .handles import Body, Node, Vector

_Z = (0.0, 0.0, 1.0)
_DEFAULT_AXES: dict[str, tuple[tuple[float, float, float], ...]] = {
    "pin": (_Z,),
    "slider": (_Z,),
    "screw": (_Z,),
    "universal": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "gimbal": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "cylindrical": (_Z,),
    "planar": (_Z,),
}


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
    if axis is not None and axes is not None:
        raise _core.ModelError(f"{what}: give axis or axes, not both")
    if subhinges is not None and hinge != "custom":
        raise _core.ModelError(f"{what}: subhinges belong to a hinge of kind 'custom', not {hinge!r}")
    if hinge == "custom" and (subhinges is None or not (axis is axes is point is None)):
        raise _core.ModelError(f"{what}: a custom hinge takes subhinges=[...], each with its kind, axis and point, and nothing beside")
    rotation, position = pose_parts(what, rotation, position, placement)
    directions = [axis] if axis is not None else axes if axes is not None else _DEFAULT_AXES.get(hinge, ())
    lower, upper = limit_pair(what, limits)
    return {
        "hinge": hinge,
        "axes": listed(directions, f"axes of {what}"),
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
