"""Shapes of bodies as triangles for a page: primitives of some dozens, and meshes from files, simplified for drawing."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..models.loaders.urdf import resolve_package
from ..models.shapes import Shape
from ..progress_bar import StepProgress

ROUND = 16
"""Number of sides of round shapes."""
MOST = 10000
"""Triangles of a figure: a canvas without a graphics card draws this many about twenty times a second."""


def solids(model: Any, most: int | None = MOST) -> tuple[list[dict[str, Any]], list[str]]:
    """Return vertices (n, 3) and faces (m, 3) of the model's shapes in the frames of their bodies, and why others are not shown.

    In total about `most` triangles; with None, all triangles of the files. Reading many meshes shows a bar in a terminal or notebook.

    Each shape is a dictionary: "of", the number of the body, -1 the base; "vertices", "faces", "colour". A shape on a removed body
    is not shown; a shape on a body lumped with another is drawn at its node.
    """
    shapes = model.shapes
    if not shapes:
        return [], []
    described = model.description()
    numbers = {body["name"]: k for k, body in enumerate(described["bodies"])} | {"": -1}
    nodes = {node["name"]: node for node in described["nodes"]}
    made: list[dict[str, Any]] = []
    missing: dict[str, None] = {}
    with StepProgress(len(shapes), "shapes") as bar:
        for shape in shapes:
            bar(Path(shape.file).name or shape.kind)
            placed = _placed(shape, numbers, nodes)
            if placed is None:
                continue
            try:
                vertices, faces = triangles(shape)
            except _core.Error as error:
                missing[str(error)] = None
                continue
            owner, X = placed
            made.append({"of": owner, "vertices": vertices @ X[:3, :3].T + X[:3, 3], "faces": faces, "colour": shape.colour})
    return (made if most is None else _thinned(made, most)), list(missing)


def triangles(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of one shape in its own frame, m. Raises ModelError for a mesh that is missing or unreadable."""
    if shape.kind == "box":
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(shape.size) / 2
        sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        return corners, np.array([half for a, b, c, d in sides for half in ((a, b, c), (a, c, d))])
    if shape.kind == "cylinder":
        radius, length = shape.size
        return _turned([(0.0, -length / 2), (radius, -length / 2), (radius, length / 2), (0.0, length / 2)])
    if shape.kind == "capsule":
        radius, length = shape.size
        arc = [(radius * np.cos(a), radius * np.sin(a) + length / 2) for a in np.linspace(0, np.pi / 2, ROUND // 4 + 1)]
        return _turned([*((r, -z) for r, z in reversed(arc)), *arc])
    if shape.kind in ("sphere", "ellipsoid"):
        arc = [(np.cos(a), np.sin(a)) for a in np.linspace(-np.pi / 2, np.pi / 2, ROUND // 2 + 1)]
        vertices, faces = _turned(arc)
        return vertices * np.array(shape.size), faces
    vertices, faces = shape.triangles if shape.triangles is not None else _read(shape)
    return vertices * np.array(shape.size), faces


def _turned(profile: list[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface that a line of (radius, z) sweeps about z, with the outside on the right of the line."""
    angles = 2 * np.pi * np.arange(ROUND) / ROUND
    vertices = np.array([(r * np.cos(a), r * np.sin(a), z) for r, z in profile for a in angles])
    thin = 1e-9 * max(r for r, _ in profile)  # a ring of one point
    faces = []
    for i in range(len(profile) - 1):
        first, second = (int(r > thin) for r, _ in profile[i : i + 2])
        for j in range(ROUND):
            a, b = ROUND * i + j, ROUND * i + (j + 1) % ROUND
            faces += [(a, b, b + ROUND)] * first + [(a, b + ROUND, a + ROUND)] * second
    return vertices, np.array(faces)


def _read(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Read a mesh file with trimesh: STL, OBJ, PLY, OFF, glTF."""
    path = resolve_package(shape.file, *shape.beside)
    return _mesh(path, path.stat().st_mtime_ns, shape.file)


@lru_cache(maxsize=64)
def _mesh(path: Path, changed: int, called: str) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of a file, cached by its modification time: pages of a model read the same meshes again."""
    try:
        import trimesh
    except ImportError:
        raise _core.ModelError("meshes need the package trimesh, which is not installed: pip install 'pycraft-soa[meshes]'") from None
    try:
        mesh: Any = trimesh.load(path, force="mesh", process=False)
        vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, int)
    except Exception as error:  # readers of foreign files raise anything
        raise _core.ModelError(f"trimesh cannot read {called} as a mesh: {str(error) or type(error).__name__}") from None
    if not len(faces) or not np.isfinite(vertices).all():
        raise _core.ModelError(f"{called} cannot be drawn: it has no triangles, or vertices that are not finite")
    return vertices, faces


def _placed(shape: Shape, numbers: dict[str, int], nodes: dict[str, Any]) -> tuple[int, np.ndarray] | None:
    """Return the body that carries a shape and the shape's pose there; None if the body was removed."""
    if shape.body in numbers:
        return numbers[shape.body], shape.placement
    if shape.body not in nodes:
        return None
    node, X = nodes[shape.body], np.eye(4)
    X[:3, :3], X[:3, 3] = node["rotation"], node["position"]
    return node["body"], X @ shape.placement


def _thinned(made: list[dict[str, Any]], most: int) -> list[dict[str, Any]]:
    """Reduce to about `most` triangles: meshes lose triangles in proportion to their number, primitives none."""
    primitive = 16 * ROUND  # most triangles of one primitive
    total = sum(len(solid["faces"]) for solid in made)
    if total <= most:
        return made
    few = sum(len(solid["faces"]) for solid in made if len(solid["faces"]) <= primitive)
    share = max(0, most - few) / max(1, total - few)
    return [solid if len(solid["faces"]) <= primitive else _thin(solid, max(32, int(share * len(solid["faces"])))) for solid in made]


def _thin(solid: dict[str, Any], most: int) -> dict[str, Any]:
    """Merge vertices that share a cell of a grid, coarsening the grid until there are few enough triangles.

    [J. Rossignac and P. Borrel, "Multi-resolution 3D approximations for rendering complex scenes", 1993]
    """
    vertices, faces = solid["vertices"], solid["faces"]
    low, span = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max()) or 1.0
    cells = 64
    while len(faces) > most and cells >= 2:
        grid = np.floor((solid["vertices"] - low) / span * cells).astype(int)
        _, cell = np.unique(grid, axis=0, return_inverse=True)
        cell = cell.reshape(-1)
        counts = np.bincount(cell)
        vertices = np.column_stack([np.bincount(cell, solid["vertices"][:, i]) / counts for i in range(3)])
        faces = cell[solid["faces"]]
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        faces = faces[np.sort(first)]
        cells = int(cells / 1.3)
    return solid | {"vertices": vertices, "faces": faces}
