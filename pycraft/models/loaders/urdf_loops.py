"""Loops of a URDF file: elements `<loop>` in a `<pycraft>` of the robot, which other readers ignore (docs/models.md, docs/loops.md).

    <pycraft>
      <loop name="closure" kind="pin" a="ground" b="rocker" xyz="1 0 0" axis="0 0 1"/>
      <loop name="gear" kind="coupling" constant="0.1">
        <coordinate name="motor" coefficients="0 1"/> <coordinate name="wheel" coefficients="0 -3"/>
      </loop>
      <loop name="slot" kind="custom" b="rocker"><subhinge kind="slider" axis="1 0 0"/> <subhinge kind="pin" axis="0 0 1"/></loop>
    </pycraft>

a and b are links, default: the root link. For a hinge the arguments of `Multibody.add_loop`: axis (three numbers per axis), point, pitch,
and the placement as xyz and rpy; for a custom one the placement and its subhinges; for "wheel" and "rolling ball" the radius; for "surface"
quadratic (nine), linear and constant; for "curve" parameters, closed (1 or 0), and coefficients, three numbers for each power of each piece
in turn; for "coupling" coordinates with coefficients of 1, q, q², ..., and constant.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import _core
from ..curves import curve_of_pieces
from ..multibody import Multibody
from .rotations import rotation_from_rpy
from .xml_file import Element, XmlFile, label, local_name

_HINGE = ("axis", "point", "pitch", "xyz", "rpy")
KEYS: dict[str, tuple[str, ...]] = {kind: ("a", "b", *_HINGE) for kind in _core.hinge_kinds} | {
    "custom": ("a", "b", "xyz", "rpy"),
    "blade": ("a", "b"),
    "wheel": ("a", "b", "radius"),
    "rolling ball": ("a", "b", "radius"),
    "surface": ("a", "b", "quadratic", "linear", "constant"),
    "curve": ("a", "b", "parameters", "coefficients", "closed"),
    "coupling": ("constant",),
}


def add_loops(file: XmlFile, model: Multibody, root: str) -> None:
    """Declare every loop of a file. `root`: its root link. ModelError with file, line, loop and attribute."""
    for ours in file.children(file.root, "pycraft"):
        if ours.attrib:
            raise file.error(
                ours, f"<pycraft> of {label(file.root)} has the attribute {next(iter(ours.attrib))!r}; there are elements <loop>"
            )
        for element in ours:
            if local_name(element) != "loop":
                raise file.error(element, f"<pycraft> of {label(file.root)} has the element <{local_name(element)}>; there is <loop>")
            _add(file, model, root, element)


def _add(file: XmlFile, model: Multibody, root: str, element: Element) -> None:
    name, kind = file.text(element, "name"), file.text(element, "kind")
    if kind not in KEYS:
        raise file.error(element, f"{label(element)} is of kind {kind!r}; there are {', '.join(KEYS)}")
    if wrong := [key for key in element.attrib if key not in ("name", "kind", *KEYS[kind])]:
        raise file.error(element, f"{label(element)} of kind {kind!r} has no {wrong[0]}; it has {', '.join(KEYS[kind])}")
    if kind not in ("coupling", "custom") and len(element):
        raise file.error(
            element[0], f"{label(element)} of kind {kind!r} has the element <{local_name(element[0])}>; a coupling has coordinates"
        )
    a, b = (None if (link := element.get(end, root)) == root and not _stands(model, link) else link for end in ("a", "b"))
    number = {key: file.number(element, key, element, 0.0) for key in ("constant", "radius", "pitch", "closed")}
    try:
        if kind == "coupling":
            model.loops.add_coupling(_coordinates(file, element), number["constant"], None, name)
        elif kind == "surface":
            A = np.reshape(file.numbers(element, "quadratic", 9, element, (0.0,) * 9), (3, 3))
            model.loops.add_surface(b, a, A, file.numbers(element, "linear", 3, element, (0.0,) * 3), number["constant"], name)
        elif kind == "curve":
            parameters, rows = (np.array(file.numbers(element, key, None, element), float) for key in ("parameters", "coefficients"))
            rows = rows.reshape(-1, 3) if rows.size % 3 == 0 else rows
            model.loops.add_curve(b, a, curve_of_pieces(parameters, rows, number["closed"] != 0, label(element)), None, False, name)
        elif kind in ("blade", "wheel", "rolling ball"):
            model.loops.add_pair(b, a, kind, number["radius"], name)
        else:
            model.loops.add_hinge(b, a, kind, _hinge(file, element) | {"pitch": number["pitch"]}, name)
    except _core.ModelError as error:
        text = str(error)
        raise error if text.startswith(f"{file.path}:") else file.error(element, text) from None


def _stands(model: Multibody, link: str) -> bool:
    return link in model.bodies or link in model.nodes


def _hinge(file: XmlFile, element: Element) -> dict[str, Any]:
    zero = (0.0, 0.0, 0.0)
    axes = np.array(file.numbers(element, "axis", None, element, ()), float)
    if axes.size % 3:
        raise file.error(element, f"{label(element)}: its axis has {axes.size} numbers; write three for each axis")
    angles = file.numbers(element, "rpy", 3, element, zero)
    return {
        "axis": axes if axes.size == 3 else None,
        "axes": list(axes.reshape(-1, 3)) if axes.size > 3 else None,
        "point": file.numbers(element, "point", 3, element) if element.get("point") is not None else None,
        "subhinges": (_subhinges(file, element) or None) if element.get("kind") == "custom" else None,
        "position": file.numbers(element, "xyz", 3, element, zero),
        "rotation": rotation_from_rpy(*angles) if any(angles) else None,
        "placement": None,
    }


def _subhinges(file: XmlFile, element: Element) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for inner in element:
        if local_name(inner) != "subhinge":
            raise file.error(inner, f"{label(element)} has the element <{local_name(inner)}>; there is <subhinge>")
        if wrong := [key for key in inner.attrib if key not in ("kind", "axis", "point", "pitch")]:
            raise file.error(inner, f"<subhinge> of {label(element)} has no {wrong[0]}; it has kind, axis, point, pitch")
        found.append({"kind": file.text(inner, "kind", element)})
        found[-1] |= {key: file.numbers(inner, key, 3, element) for key in ("axis", "point") if inner.get(key) is not None}
        if inner.get("pitch") is not None:
            found[-1]["pitch"] = file.number(inner, "pitch", element, 0.0)
    return found


def _coordinates(file: XmlFile, element: Element) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for inner in element:
        if local_name(inner) != "coordinate":
            raise file.error(inner, f"{label(element)} has the element <{local_name(inner)}>; there is <coordinate>")
        name = file.text(inner, "name", element)
        if name in found:
            raise file.error(inner, f"{label(element)} names coordinate {name!r} twice; give it once")
        found[name] = list(file.numbers(inner, "coefficients", None, element))
    if not found:
        raise file.error(element, f'{label(element)} has no coordinates; write <coordinate name="motor" coefficients="0 1"/>')
    return found
