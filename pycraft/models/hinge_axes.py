"""The axes of a hinge as a user gives them, for bodies and loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .. import _core
from ..arguments import listed
from .handles import Vector

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


def hinge_axes(
    what: str,
    hinge: str,
    axis: Vector | None,
    axes: Sequence[Vector] | None,
    point: Vector | None,
    subhinges: Sequence[Mapping[str, Any]] | None,
) -> list[Any]:
    """Return the axes of a hinge of this kind, default: along z. `what`: the owner, for errors.

    ModelError for axis and axes at once, and for a custom hinge with anything but its subhinges.
    """
    if axis is not None and axes is not None:
        raise _core.ModelError(f"{what}: give axis or axes, not both")
    if subhinges is not None and hinge != "custom":
        raise _core.ModelError(f"{what}: subhinges belong to a hinge of kind 'custom', not {hinge!r}")
    if hinge == "custom" and (subhinges is None or not (axis is axes is point is None)):
        raise _core.ModelError(f"{what}: a custom hinge takes subhinges=[...], each with its kind, axis and point, and nothing else")
    return listed([axis] if axis is not None else axes if axes is not None else _DEFAULT_AXES.get(hinge, ()), f"axes of {what}")
