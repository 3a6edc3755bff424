"""The geoms of a compiled MJCF file as shapes, with the triangles of their meshes.

Geoms of the groups 0 to 2, which MuJoCo's viewer shows by default, are visible; those that collide are collision shapes. Many are both.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..shapes import Shape, hex_colour
from .rotations import rotation_from_quaternion

_NO_COLOUR = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's default colour of a geom
_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = range(2, 8)  # mjtGeom; planes and height fields, 0 and 1, are no bodies' shapes
_SHOWN_GROUPS = 3


def shapes_of(m: Any, bodies: list[str]) -> list[Shape]:
    """Return all shapes; `bodies` are the names by MuJoCo's numbers, where 0 is the world."""
    made = []
    for g in range(m.ngeom):
        kind, size, on = int(m.geom_type[g]), np.array(m.geom_size[g]), int(m.geom_bodyid[g])
        purposes = ["visual"] * (int(m.geom_group[g]) < _SHOWN_GROUPS) + ["collision"] * bool(m.geom_contype[g] or m.geom_conaffinity[g])
        if not _SPHERE <= kind <= _MESH or not purposes:
            continue
        placement = np.eye(4)
        placement[:3, :3], placement[:3, 3] = rotation_from_quaternion(m.geom_quat[g]), m.geom_pos[g]
        said: dict[int, tuple[str, tuple[float, ...]]] = {
            _SPHERE: ("sphere", (size[0],)),
            _CAPSULE: ("capsule", (size[0], 2 * size[1])),
            _ELLIPSOID: ("ellipsoid", tuple(size)),
            _CYLINDER: ("cylinder", (size[0], 2 * size[1])),
            _BOX: ("box", tuple(2 * size)),
            _MESH: ("mesh", (1.0, 1.0, 1.0)),
        }
        name, sizes = said[kind]
        triangles = _triangles(m, int(m.geom_dataid[g])) if kind == _MESH else None
        material, colour = int(m.geom_matid[g]), m.geom_rgba[g]
        if material >= 0 and np.array_equal(colour, _NO_COLOUR):
            colour = m.mat_rgba[material]
        if colour[3] == 0:  # invisible
            purposes = [purpose for purpose in purposes if purpose != "visual"]
        body, size_of = bodies[on] if on else "", tuple(map(float, sizes))
        made += [Shape(body, name, size_of, placement, hex_colour(colour), triangles=triangles, purpose=purpose) for purpose in purposes]
    return made


def _triangles(m: Any, mesh: int) -> tuple[np.ndarray, np.ndarray]:
    first, count = int(m.mesh_vertadr[mesh]), int(m.mesh_vertnum[mesh])
    face, faces = int(m.mesh_faceadr[mesh]), int(m.mesh_facenum[mesh])
    return np.array(m.mesh_vert[first : first + count], float), np.array(m.mesh_face[face : face + faces], int)
