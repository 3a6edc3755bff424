"""The visuals and collisions of a URDF file as shapes: <origin>, <geometry>, <material>. Invalid ones are omitted with a warning."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ... import _core
from ..shapes import Shape, hex_colour
from .urdf_elements import Elements
from .xml_file import Element, XmlFile, label

_SIZES = {
    "box": (("size", 3),),
    "sphere": (("radius", 1),),
    "cylinder": (("radius", 1), ("length", 1)),
    "capsule": (("radius", 1), ("length", 1)),
}


def shapes_of(file: XmlFile, elements: Elements, package_dirs: Iterable[Any]) -> tuple[list[Shape], list[str]]:
    """Return all shapes of the file, on bodies and nodes with the names of the links, and warnings of those that cannot be read."""
    beside = beside_of(file, package_dirs)
    colours = {material.get("name", ""): colour for material in file.children(file.root, "material") if (colour := _colour(file, material))}
    found: list[Shape] = []
    warnings: list[str] = []
    if next(file.root.iter("{*}visual", "{*}collision"), None) is None:  # a large file without shapes
        return found, warnings
    for name, link in elements.links.items():
        for purpose in ("visual", "collision"):
            for element in file.children(link.element, purpose):
                try:
                    found += _shapes(file, elements, element, name, colours, beside, purpose)
                except _core.ModelError as error:
                    warnings.append(f"{error}; the shape is left out")
    return found, warnings


def beside_of(file: XmlFile, package_dirs: Iterable[Any]) -> tuple[str, tuple[str, ...]]:
    """Return the search path of a file's meshes: its own path, and the folders of packages, absolute."""
    folders = [package_dirs] if isinstance(package_dirs, (str, bytes, os.PathLike)) else package_dirs
    try:
        return os.path.abspath(os.fsdecode(file.path)), tuple(os.path.abspath(os.fsdecode(folder)) for folder in folders)
    except TypeError:
        raise _core.ModelError(f"package_dirs={package_dirs!r:.60}: give folders by their paths") from None


def _shapes(
    file: XmlFile,
    elements: Elements,
    visual: Element,
    link: str,
    colours: dict[str, str],
    beside: tuple[str, tuple[str, ...]],
    purpose: str,
) -> list[Shape]:
    placement = np.eye(4)
    origin = next(iter(file.children(visual, "origin")), None)
    placement[:3, :3], placement[:3, 3] = elements._pose(origin, visual)
    colour = None
    for material in file.children(visual, "material"):
        colour = _colour(file, material) or colours.get(material.get("name", ""))
    made = []
    for geometry in file.children(visual, "geometry"):
        for kind, attributes in _SIZES.items():
            for element in file.children(geometry, kind):
                size = [x for attribute, count in attributes for x in file.numbers(element, attribute, count, visual)]
                if min(size) <= 0:
                    raise file.error(element, f"{label(visual)}: the sizes of <{kind}> must be positive")
                made.append(Shape(link, kind, tuple(size), placement, colour, purpose=purpose))
        for element in file.children(geometry, "mesh"):
            scale: Sequence[float] = file.numbers(element, "scale", 3, visual, (1.0, 1.0, 1.0))
            made.append(Shape(link, "mesh", tuple(scale), placement, colour, file.text(element, "filename"), beside, purpose=purpose))
    return made


def _colour(file: XmlFile, material: Element) -> str | None:
    for element in file.children(material, "color"):
        try:
            return hex_colour(file.numbers(element, "rgba", 4, material))
        except _core.ModelError:
            return None
    return None
