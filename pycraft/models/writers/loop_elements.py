"""Loops of a model as elements of URDF that `loaders.urdf_loops` reads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...interop.export import numbers_text
from ..loaders.rotations import nearest_rpy
from .toml_writer import same

if TYPE_CHECKING:
    from lxml.etree import _Element as Element

    from ..multibody import Multibody


def loops_element(model: Multibody, described: dict[str, Any], root: str) -> Element | None:
    """Return `<pycraft>` with a `<loop>` for each, except those by functions; None if empty. `root`: the root link, which is the base."""
    from lxml import etree

    loops = [loop for loop in described.get("loops", []) if loop.get("function") is None]
    if not loops:
        return None
    ours = etree.Element("pycraft")
    for loop in loops:
        element = etree.SubElement(ours, "loop", name=loop["name"], kind=loop["kind"])
        if loop["kind"] == "coupling":
            for number, (*_, coefficients) in zip(model.loops.coupled(loop["name"]), loop["terms"], strict=True):
                text = numbers_text(np.array(coefficients, float))
                etree.SubElement(element, "coordinate", name=model.coordinate_names[number], coefficients=text)
        else:
            for end in ("a", "b"):
                element.set(end, loop[end] or root)
        for key, value in _numbers(loop).items():
            element.set(key, numbers_text(np.ravel(value)))
        for one in loop.get("subhinges") or ():
            subhinge = etree.SubElement(element, "subhinge", kind=one["kind"])
            for key in ("axis", "point", "pitch"):
                if key in one:
                    subhinge.set(key, numbers_text(np.ravel(one[key])))
    return ours


_NUMBERS = ("point", "quadratic", "linear", "radius", "pitch", "constant", "parameters", "coefficients", "closed")


def _numbers(loop: dict[str, Any]) -> dict[str, Any]:
    """Return the data of a loop except its name, ends and coordinates, without zeros."""
    given: dict[str, Any] = {key: loop.get(key) for key in _NUMBERS}
    given["xyz"] = loop.get("position")
    if loop.get("axes"):
        given["axis"] = np.concatenate(loop["axes"])
    if loop.get("rotation") is not None and not same(loop["rotation"], np.eye(3)):
        given["rpy"] = nearest_rpy(loop["rotation"])
    return {key: value for key, value in given.items() if value is not None and np.any(value)}
