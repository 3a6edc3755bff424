"""Forces on bodies from an earlier file, in TOML: tables [[held_weights]] and [[fluid_boxes]] (docs/models.md, Files)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..multibody import Multibody
from ..offers import BoxInFluid, HeldWeight, Offer
from .toml_file import TomlTable, nearest
from .toml_shapes import placement_of

HELD = ("body", "mass", "point", "g")
BOX = ("body", "size", "density", "viscosity", "wind")


def held_weight(model: Multibody, table: TomlTable) -> HeldWeight:
    """Return the weight that a table of [[held_weights]] describes. ModelError with file, line and key."""
    point = table.vector("point", 3, "three finite numbers: [x, y, z] in m") or [0.0, 0.0, 0.0]
    g = table.vector("g", 3, "three finite numbers: [x, y, z] in m/s²")
    return HeldWeight(_body(model, table), table.number("mass", 0.0, "in kg"), np.array(point), None if g is None else tuple(g))


def fluid_box(model: Multibody, table: TomlTable, rotation: Any, position: Any) -> BoxInFluid:
    """Return the box that a table of [[fluid_boxes]] describes. ModelError with file, line and key."""
    size = table.vector("size", 3, "the edges of the box: three numbers in m")
    if size is None or min(size) < 0:
        raise table.error(
            "size" if size else None, f"{table.label}: size is a list of three numbers, zero or more: the edges of the box, m"
        )
    wind = table.vector("wind", 3, "three finite numbers: [x, y, z] in m/s") or [0.0, 0.0, 0.0]
    density, viscosity = table.number("density", 0.0, "in kg/m³"), table.number("viscosity", 0.0, "in Pa s")
    return BoxInFluid(_body(model, table), np.array(size), placement_of(table, rotation, position), density, viscosity, tuple(wind))


def offer_data(offer: Offer, pose: Any) -> Mapping[str, Any]:
    """Return the table of an offer; `pose` makes the keys of a position and a rotation."""
    if isinstance(offer, HeldWeight):
        return {"body": offer.body, "mass": offer.mass, "point": offer.point} | ({} if offer.g is None else {"g": list(offer.g)})
    data = {"body": offer.body, "size": offer.size, "density": offer.density, "viscosity": offer.viscosity, "wind": list(offer.wind)}
    return data | pose({"position": offer.placement[:3, 3], "rotation": offer.placement[:3, :3]})


def _body(model: Multibody, table: TomlTable) -> str:
    body = table.text("body")
    if body not in model.bodies and body not in model.nodes:
        raise table.error("body", f"{table.label}: no body or node is called {body!r}; {nearest(body, [*model.bodies, *model.nodes])}")
    return body
