"""Shapes that a model's file gives its bodies: boxes, spheres, cylinders, capsules, ellipsoids and meshes, to be seen or to touch.

They stand beside the model, as does what else its file says (`left_aside`): no dynamics uses them. Whoever draws a mesh opens its file.
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
"""Kinds, and what their sizes are, m."""


@dataclass(frozen=True, eq=False)
class Shape(Fixed):
    """One shape.

    Attributes
    ----------
    body : name of the body or node that it is fixed on; "" the base
    kind : of SIZES
    size : as SIZES says, m
    placement : (4, 4), of the shape in the frame of its body; the origin is in the middle, of a mesh its own
    colour : "#rrggbb", or None where the file gives none
    file : of a mesh as its model's file calls it, "package://robot/arm.stl"; "" of other kinds
    beside : of a mesh, the path of the model's file and the folders of packages, where it is looked for
    triangles : vertices (n, 3) and faces (m, 3) of a mesh that is in the model's file itself; None of others
    purpose : "visual", what is seen, or "collision", what touches
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
    """The text "#rrggbb" of red, green and blue from 0 to 1."""
    return "#" + "".join(f"{round(255 * min(1.0, max(0.0, float(x)))):02x}" for x in rgba[:3])
