"""The visuals and collisions of an SDF file as shapes: <visual> and <collision> with <pose>, <geometry> and <material>."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ... import _core
from ..multibody import Multibody
from ..shapes import Shape, hex_colour
from .sdf_elements import Scope, numbers_of, pose_matrix, text_of
from .urdf_shapes import beside_of
from .xml_file import Element, XmlFile, label, local_name

_SIZES = {
    "box": (("size", 3),),
    "sphere": (("radius", 1),),
    "cylinder": (("radius", 1), ("length", 1)),
    "capsule": (("radius", 1), ("length", 1)),
    "ellipsoid": (("radii", 3),),
}
_WITHOUT_SIZE = ("plane", "heightmap", "empty", "image")
"""Geometries that are not shapes of a body."""


def shapes_of(
    file: XmlFile, scope: Scope, model: Multibody, package_dirs: Iterable[str | os.PathLike[str]]
) -> tuple[list[Shape], list[str]]:
    """Return all shapes of the file, on bodies and nodes with the names of the links, and warnings of those that cannot be read."""
    beside = beside_of(file, package_dirs)
    found: list[Shape] = []
    warnings: list[str] = []
    for name, link in scope.links.items():
        if name not in model.bodies and name not in model.nodes:
            continue
        for element in link.element:
            purpose = local_name(element)
            if purpose not in ("visual", "collision"):
                continue
            try:
                found += _shapes(file, scope, element, name, purpose, beside)
            except _core.ModelError as error:
                warnings.append(f"{error}; the shape is left out")
    return found, warnings


def _shapes(file: XmlFile, scope: Scope, element: Element, link: str, purpose: str, beside: tuple[str, tuple[str, ...]]) -> Iterator[Shape]:
    pose = next(iter(file.children(element, "pose")), None)
    placement = pose_matrix(file, pose, element)
    if pose is not None and (frame := (pose.get("relative_to") or "").strip()):
        prefix = link[: link.rfind("::") + 2] if "::" in link else ""
        of_link = scope.in_world(link, element)
        placement = np.linalg.inv(of_link) @ scope.in_world(prefix + frame, element) @ placement
    colour = _colour(file, element)
    for geometry in file.children(element, "geometry"):
        for part in geometry:
            kind = local_name(part)
            if kind in _SIZES:
                size = [x for tag, count in _SIZES[kind] for x in _numbers(file, part, tag, count, element)]
                if min(size) <= 0:
                    raise file.error(part, f"{label(element)}: the sizes of <{kind}> must be positive")
                yield Shape(link, kind, tuple(size), placement, colour, purpose=purpose)
            elif kind == "mesh":
                scale: Any = _numbers(file, part, "scale", 3, element) if file.children(part, "scale") else (1.0, 1.0, 1.0)
                yield Shape(link, "mesh", tuple(scale), placement, colour, text_of(file, part, "uri"), beside, purpose=purpose)
            elif kind not in _WITHOUT_SIZE:
                raise file.error(part, f"{label(element)}: <{kind}> is no shape that is drawn; there are {', '.join(_SIZES)}, mesh")


def _numbers(file: XmlFile, part: Element, tag: str, count: int, owner: Element) -> list[float]:
    inner = next(iter(file.children(part, tag)), None)
    if inner is None:
        raise file.error(part, f"{label(owner)}: <{local_name(part)}> has no <{tag}>; write it")
    return numbers_of(file, inner, count, owner)


def _colour(file: XmlFile, element: Element) -> str | None:
    for material in file.children(element, "material"):
        for tag in ("diffuse", "ambient"):
            for colour in file.children(material, tag):
                words = (colour.text or "").split()
                try:
                    return hex_colour([float(word) for word in words[:3]]) if len(words) in (3, 4) else None
                except ValueError:
                    return None
    return None
