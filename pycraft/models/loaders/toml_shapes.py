"""Shapes of a model in TOML: tables [[shapes]], each with its kind, its body, its size and its pose on it (docs/models.md, Files).

A mesh has a file, which is located by the rules of `resolve_package`: from the model's file, or from the first path of `beside` and the
folders of packages after it.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from ..multibody import Multibody
from ..shapes import SIZES, Shape
from .toml_file import TomlTable, nearest

SHAPE = ("kind", "body", "size", "colour", "file", "beside", "purpose")
_COUNTS = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "ellipsoid": 3, "mesh": 3}


def shape_of(model: Multibody, table: TomlTable, rotation: Any, position: Any) -> Shape:
    """Return the shape of a table. ModelError with file, line, shape and key."""
    if "kind" not in table:
        raise table.error(None, f"{table.label} has no kind; there are {', '.join(SIZES)}")
    kind, body = table.choice("kind", tuple(SIZES), ""), table.text("body", "")
    if body not in (*model.bodies, *model.nodes, ""):
        raise table.error("body", f"{table.label}: no body or node is called {body!r}; {nearest(body, [*model.bodies, *model.nodes])}")
    size = table.vector("size", _COUNTS[kind], f"{SIZES[kind]}: {_COUNTS[kind]} in a list, m") or ([1.0] * 3 if kind == "mesh" else None)
    if size is None or (kind != "mesh" and min(size) <= 0):
        raise table.error("size" if size else None, f"{table.label}: size is a list of numbers above zero: {SIZES[kind]}, m")
    colour = table.text("colour", "") or None
    if colour is not None and not re.fullmatch("#[0-9a-f]{6}", colour):
        raise table.error("colour", f'{table.label}: colour = {colour!r:.40}; write "#rrggbb", such as "#0072b2"')
    if (kind == "mesh") != ("file" in table):
        raise table.error("file" if "file" in table else None, f"{table.label}: a mesh has a file, and nothing else has one")
    purpose = table.choice("purpose", ("visual", "collision"), "visual")
    placement, file = placement_of(table, rotation, position), table.text("file", "")
    return Shape(body, kind, tuple(size), placement, colour, file, _beside(table, kind), purpose=purpose)


def placement_of(table: TomlTable, rotation: Any, position: Any) -> np.ndarray:
    """Return the pose (4, 4) of a rotation and a position, each optional. ModelError for an invalid rotation."""
    placement = np.eye(4)
    if rotation is not None:
        placement[:3, :3] = rotation
    if not np.allclose(placement[:3, :3] @ placement[:3, :3].T, np.eye(3), rtol=0, atol=1e-8) or np.linalg.det(placement[:3, :3]) < 0:
        raise table.error("rotation", f"{table.label}: rotation is no rotation matrix")  # with the tolerance for rotations of bodies
    placement[:3, 3] = 0.0 if position is None else position
    return placement


def _beside(table: TomlTable, kind: str) -> tuple[str, tuple[str, ...]]:
    paths = table.data.get("beside", [table.file.path] if kind == "mesh" else [""])
    if not isinstance(paths, list) or not paths or not all(isinstance(path, str) for path in paths):
        raise table.error("beside", f"{table.label}: beside is a list of paths: that of a model's file, and folders of packages")
    return paths[0], tuple(paths[1:])
