"""Loops of a model in TOML: tables [[loops]], each with its kind, the frames a and b, and the keys of the kind (docs/models.md, Files).

For a hinge the arguments of `Multibody.add_loop` by their names, for a custom one its subhinges; for "wheel" and "rolling ball" the radius;
for "surface" quadratic, linear and constant; for "curve" parameters, closed, and coefficients, those of each piece in turn; for "coupling"
constant and coordinates = { name = coefficients of 1, q, q², ... }.
"""

from __future__ import annotations

from typing import Any

from ... import _core
from ..curves import curve_of_pieces
from ..multibody import Multibody
from .toml_file import TomlTable
from .toml_subhinges import subhinges_of

_HINGE = ("axis", "axes", "point", "pitch", "position", "rotation", "rpy", "quaternion")
_KEYS: dict[str, tuple[str, ...]] = {kind: _HINGE for kind in _core.hinge_kinds} | {
    "custom": ("subhinges", "position", "rotation", "rpy", "quaternion"),
    "blade": (),
    "wheel": ("radius",),
    "rolling ball": ("radius",),
    "surface": ("quadratic", "linear", "constant"),
    "curve": ("parameters", "coefficients", "closed"),
    "coupling": ("coordinates", "constant"),
}
LOOP = (
    "name",
    "kind",
    "a",
    "b",
    "axis",
    "axes",
    "point",
    "pitch",
    "subhinges",
    "radius",
    "quadratic",
    "linear",
    "constant",
    "coordinates",
    *_KEYS["curve"],
)
_VECTOR = "three finite numbers: [x, y, z]"


def add_loop(model: Multibody, table: TomlTable, rotation: Any, position: Any) -> None:
    """Declare the loop of a table. ModelError with file, line, loop and key."""
    kind, name = table.choice("kind", tuple(_KEYS), "pin"), table.text("name")
    keys = _KEYS[kind] if kind == "coupling" else ("a", "b", *_KEYS[kind])
    if wrong := [key for key in table.data if key not in ("name", "kind", *keys)]:
        raise table.error(wrong[0], f"{table.label} of kind {kind!r} has no {wrong[0]}; it has {', '.join(keys)}")
    a, b = (table.text(end, "", empty=True) or None for end in ("a", "b"))
    parts = _parts(table, kind)
    try:
        if kind == "coupling":
            model.loops.add_coupling(parts["coordinates"], parts["constant"], None, name)
        elif kind == "surface":
            model.loops.add_surface(b, a, parts["quadratic"], parts["linear"], parts["constant"], name)
        elif kind == "curve":
            curve = curve_of_pieces(parts["parameters"], parts["coefficients"], parts["closed"], table.label)
            model.loops.add_curve(b, a, curve, None, False, name)
        elif kind in ("blade", "wheel", "rolling ball"):
            model.loops.add_pair(b, a, kind, parts["radius"], name)
        else:
            model.loops.add_hinge(b, a, kind, parts | {"rotation": rotation, "position": position, "placement": None}, name)
    except _core.ModelError as error:
        raise table.error(None, str(error)) from None


def _parts(table: TomlTable, kind: str) -> dict[str, Any]:
    """Return the arguments of the table's kind, except a hinge's placement."""
    if kind == "coupling":
        return {"coordinates": _coefficients(table), "constant": table.number("constant", 0.0, "the constant of the relation")}
    if kind == "surface":
        A = table.vectors("quadratic", 3, "three rows of three finite numbers: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]")
        return {
            "quadratic": A,
            "linear": table.vector("linear", 3, _VECTOR),
            "constant": table.number("constant", 0.0, "the constant of the surface"),
        }
    if kind == "curve":
        return {
            "parameters": table.vector("parameters", None, "a list of finite numbers, between which the pieces are"),
            "coefficients": table.vectors("coefficients", None, "a list of three finite numbers each: [[x, y, z], ...]"),
            "closed": table.flag("closed"),
        }
    if kind in ("blade", "wheel", "rolling ball"):
        return {"radius": table.number("radius", 0.0, "in m")}
    return {
        "axis": table.vector("axis", 3, _VECTOR),
        "axes": table.vectors("axes", None, "a list of axes: [[1, 0, 0], [0, 1, 0]]"),
        "point": table.vector("point", 3, f"{_VECTOR} in m, in the hinge's frame"),
        "pitch": table.number("pitch", 0.0, "in metres per radian"),
        "subhinges": subhinges_of(table),
    }


def _coefficients(table: TomlTable) -> dict[str, Any]:
    given = table.table("coordinates", None, f"{table.label}: coordinates")
    if given is None:
        raise table.error(None, f"{table.label} has no coordinates; write coordinates = {{ motor = 1, wheel = -3 }}")
    wanted = "that of q, or a list of those of 1, q, q², ...: [0, 1]"
    return {
        name: given.vector(name, None, wanted) if isinstance(given.data[name], list) else given.number(name, 0.0, wanted)
        for name in given.data
    }
