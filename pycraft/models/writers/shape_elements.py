"""Shapes as elements of URDF and MJCF files: primitives by their sizes, meshes by their files; shapes without an element are named."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ...interop.export import numbers_text
from ...interop.mujoco import _quaternion
from ..loaders.rotations import nearest_rpy
from ..loaders.urdf import resolve_package
from ..shapes import Shape

if TYPE_CHECKING:
    from lxml.etree import _Element as Element

_URDF = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}
_MESHES_OF_MUJOCO = (".stl", ".obj", ".msh")
_MOST_FACES = 200_000
_PACKAGES = ("package://", "model://")
HIDDEN_GROUP = 3
"""The group of MuJoCo's geoms that its viewer hides by default: it holds collision shapes."""


def lost_text(lost: Iterable[str]) -> str:
    """Return shapes that were not written, as a text: "2 × ellipsoid (URDF has none)"."""
    return ", ".join(f"{count} × {text}" if count > 1 else text for text, count in Counter(lost).items())


# URDF -----------------------------------------------------------------------------------------------------------------


class UrdfShapes:
    """The elements of shapes for a URDF file at `path`; `lost` collects shapes that URDF does not have."""

    def __init__(self, path: str):
        self.folder = Path(path).absolute().parent
        self.lost: list[str] = []

    def elements(self, shapes: Iterable[Shape]) -> Iterator[Element]:
        """Yield a <visual> or <collision> for each shape that URDF has."""
        from lxml import etree

        for shape in shapes:
            if (geometry := self._geometry(shape)) is None:
                continue
            element = etree.Element(shape.purpose)
            X = shape.placement
            if X[:3, 3].any() or not np.array_equal(X[:3, :3], np.eye(3)):
                etree.SubElement(element, "origin", xyz=numbers_text(X[:3, 3]), rpy=numbers_text(nearest_rpy(X[:3, :3])))
            etree.SubElement(element, "geometry").append(geometry)
            if shape.colour is not None and shape.purpose == "visual":
                material = etree.SubElement(element, "material", name=f"colour {shape.colour[1:]}")
                etree.SubElement(material, "color", rgba=numbers_text([*red_green_blue(shape.colour), 1]))
            yield element

    def _geometry(self, shape: Shape) -> Element | None:
        from lxml import etree

        if shape.kind in _URDF:
            names = _URDF[shape.kind]
            sizes = [shape.size] if len(names) == 1 else [[size] for size in shape.size]
            return etree.Element(shape.kind, {name: numbers_text(size) for name, size in zip(names, sizes, strict=True)})
        if shape.kind != "mesh":
            self.lost.append(f"{shape.kind} (URDF has none)")
            return None
        if shape.triangles is not None:
            self.lost.append("mesh without a file of its own")
            return None
        mesh = etree.Element("mesh", filename=reference(shape, self.folder))
        if any(scale != 1 for scale in shape.size):
            mesh.set("scale", numbers_text(shape.size))
        return mesh


def reference(shape: Shape, folder: Path) -> str:
    """Return the reference of a file in a folder to a mesh file: by its package as before, else by the relative path, if the mesh is
    found."""
    if shape.file.startswith(_PACKAGES):
        return "package://" + shape.file.partition("://")[2]
    try:
        found = resolve_package(shape.file, *shape.beside)
        return PurePosixPath(*Path(os.path.relpath(found, folder)).parts).as_posix()
    except (_core.ModelError, ValueError):  # it is not there, or on another drive
        return shape.file


def red_green_blue(colour: str) -> list[float]:
    """Return the values from 0 to 1 of a text "#rrggbb"."""
    return [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]


# MJCF -----------------------------------------------------------------------------------------------------------------


class MjcfShapes:
    """The geoms of shapes for an MJCF file at `path`, and their meshes in its `<asset>`; `lost` collects shapes that MuJoCo does not
    read."""

    def __init__(self, root: Element, path: str):
        self.root, self.folder = root, Path(path).absolute().parent
        self.lost: list[str] = []
        self._assets: dict[Any, str] = {}

    def add(self, shape: Shape, owner: Element, placement: np.ndarray) -> None:
        """Add a geom to a body's element, at a pose (4, 4) in it."""
        from lxml import etree

        size, mesh = self._size(shape), self._mesh(shape) if shape.kind == "mesh" else None
        if shape.kind == "mesh" and mesh is None:
            return
        seen = shape.purpose == "visual"
        geom = etree.SubElement(owner, "geom", type=shape.kind, group="1" if seen else str(HIDDEN_GROUP))
        if mesh is not None:
            geom.set("mesh", mesh)
        else:
            geom.set("size", numbers_text(size))
        if placement[:3, 3].any():
            geom.set("pos", numbers_text(placement[:3, 3]))
        if not np.array_equal(placement[:3, :3], np.eye(3)):
            geom.set("quat", numbers_text(_quaternion(placement[:3, :3])))
        if seen:
            geom.set("contype", "0")
            geom.set("conaffinity", "0")
        if shape.colour is not None:
            geom.set("rgba", numbers_text([*red_green_blue(shape.colour), 1]))

    @staticmethod
    def _size(shape: Shape) -> list[float]:
        """Return sizes by MuJoCo's convention: half edges, half lengths."""
        if shape.kind == "box":
            return [x / 2 for x in shape.size]
        if shape.kind in ("cylinder", "capsule"):
            return [shape.size[0], shape.size[1] / 2]
        return list(shape.size)

    def _mesh(self, shape: Shape) -> str | None:
        """Return the name of the mesh in the file's assets; None if MuJoCo cannot read it."""
        if shape.triangles is not None:
            return self._asset(
                id(shape.triangles[0]),
                shape,
                vertex=numbers_text(shape.triangles[0]),
                face=" ".join(map(str, np.ravel(shape.triangles[1]))),
            )
        try:
            found = resolve_package(shape.file, *shape.beside)
        except _core.ModelError:
            self.lost.append(f"mesh {shape.file!r} (its file is not found)")
            return None
        if found.suffix.lower() not in _MESHES_OF_MUJOCO:
            self.lost.append(f"mesh {shape.file!r} (MuJoCo reads {', '.join(_MESHES_OF_MUJOCO)})")
            return None
        if found.suffix.lower() == ".stl" and not _is_binary_stl(found):
            self.lost.append(f"mesh {shape.file!r} (MuJoCo reads binary STL files of at most {_MOST_FACES} triangles)")
            return None
        try:
            path = os.path.relpath(found, self.folder)
        except ValueError:  # on another drive
            path = str(found)
        return self._asset(str(found), shape, file=PurePosixPath(*Path(path).parts).as_posix())

    def _asset(self, key: Any, shape: Shape, **given: str) -> str:
        from lxml import etree

        key = (key, shape.size)
        if key not in self._assets:
            assets = self.root.find("asset")
            if assets is None:
                assets = etree.Element("asset")
                self.root.insert(list(self.root).index(self.root.find("worldbody")), assets)
            self._assets[key] = f"mesh{len(self._assets)}"
            element = etree.SubElement(assets, "mesh", name=self._assets[key], inertia="shell", **given)
            if any(scale != 1 for scale in shape.size):
                element.set("scale", numbers_text(shape.size))
        return self._assets[key]


def _is_binary_stl(path: Path) -> bool:
    """Check that a file is binary STL as MuJoCo accepts it: a head of 80 bytes, the number of triangles, 50 bytes for each."""
    try:
        with open(path, "rb") as file:
            head = file.read(84)
        count = int.from_bytes(head[80:84], "little")
        return len(head) == 84 and 1 <= count <= _MOST_FACES and path.stat().st_size == 84 + 50 * count
    except OSError:
        return False
