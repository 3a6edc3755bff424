"""Shapes of bodies from a model's file: boxes, spheres, cylinders, capsules, ellipsoids and meshes, for display or collision.

They are data beside the model, like other data of its file (`left_aside`): no dynamics uses them. Code that draws a mesh opens its file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from ..arguments import Fixed

SIZES = {
    "box": "lengths of its edges",
    "sphere": "radius",
    "cylinder": "radius, length along z",
    "capsule": "radius, length along z of the cylinder between its ends",
    "ellipsoid": "half axes",
    "mesh": "scales along its axes, 1 each where it is in metres",
}
"""Kinds, and the meaning of their sizes, m."""


@dataclass(frozen=True, eq=False)
class Shape(Fixed):
    """One shape.

    Attributes
    ----------
    body : name of the body or node that it is fixed on; "" for the base
    kind : a key of SIZES
    size : as described in SIZES, m
    placement : (4, 4), of the shape in the frame of its body; the origin is in the middle, for a mesh its own
    colour : "#rrggbb", or None if the file gives none
    file : of a mesh, as in its model's file, "package://robot/arm.stl"; "" for other kinds
    beside : of a mesh, its search path: the path of the model's file and the folders of packages
    triangles : vertices (n, 3) and faces (m, 3) of a mesh embedded in the model's file; None for others
    purpose : "visual", for display, or "collision", for contact
    """

    body: str
    kind: str
    size: tuple[float, ...]
    placement: np.ndarray
    colour: str | None = None
    file: str = ""
    beside: tuple[str, tuple[str, ...]] = ("", ())
    triangles: tuple[np.ndarray, np.ndarray] | None = None
    purpose: str = "visual"

    def __repr__(self) -> str:
        size = " × ".join(f"{x:g}" for x in self.size)
        return f"<{self.kind} {self.file or size} on {self.body or 'the base'!r}>"


OnBody = TypeVar("OnBody", bound=Any)  # a dataclass with a field `body`


def renamed(things: Iterable[OnBody], bodies: set[str], called: Callable[[str], str]) -> list[OnBody]:
    """Return the shapes or offers on these bodies and nodes, moved to their copies with other names."""
    return [replace(thing, body=called(thing.body)) for thing in things if thing.body in bodies]


def hex_colour(rgba: Any) -> str:
    """Return the text "#rrggbb" of red, green and blue from 0 to 1."""
    return "#" + "".join(f"{round(255 * min(1.0, max(0.0, float(x)))):02x}" for x in rgba[:3])
