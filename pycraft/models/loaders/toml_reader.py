"""Read TOML files into a `Multibody`: files of `Multibody.save`, and files written by hand (docs/models.md, Files).

A table [[bodies]] has the arguments of `Multibody.add_body` by their names, [[nodes]] those of `add_node`; [[loops]] are those of
`toml_loops`. Bodies and nodes may be in any order; children of a body are in the order of their tables.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ... import _core
from ..multibody import Multibody
from .left_aside import QUANTITIES
from .rotations import rotation_from_quaternion, rotation_from_rpy
from .toml_file import TomlFile, TomlTable, nearest
from .toml_loops import LOOP, add_loop
from .toml_offers import BOX, HELD, fluid_box, held_weight
from .toml_shapes import SHAPE, shape_of
from .toml_subhinges import subhinges_of
from .xml_file import abbreviated

FORMAT = 1
"""Raised when the meaning of a file changes."""
MODEL = (
    "format", "name", "gravity", "welds", "strict", "bodies", "nodes", "loops", "state", "left_aside", "actuators", "held_weights",
    "fluid_boxes", "not_read", "shapes",
)  # fmt: skip
POSE = ("position", "rotation", "rpy", "quaternion")
BODY = (
    "name", "parent", "hinge", "hinge_name", "axis", "axes", "point", "pitch", "subhinges", *POSE, "limits", "rotor_inertia", "mass", "com",
    "inertia",
)  # fmt: skip
NODE = ("name", "body", *POSE)
ACTUATOR = ("name", "coordinate", "gear", "gain", "bias", "control", "force_range", "why_not")
MOMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
_VECTOR = "three finite numbers: [x, y, z]"
_LIMITS = "[lower, upper], or [[lower, ...], [upper, ...]] with one of each a subhinge; -inf and inf are no limit"
# Phrases in the core's errors, and the keys that they concern: the error is at the first that the table has.
_SPOKEN_OF = (
    ("hinge kind", ("hinge",)),
    ("limit", ("limits",)),
    ("subhinge", ("subhinges", "hinge")),
    ("rotor inerti", ("rotor_inertia",)),
    ("its mass", ("mass",)),
    ("centre of mass", ("com",)),
    ("inertia", ("inertia",)),
    ("principal moments", ("inertia",)),
    ("rotation of", ("rotation", "quaternion", "rpy")),
    ("placement of", ("position",)),
    ("pitch", ("pitch", "subhinges")),
    ("point", ("point", "subhinges")),
    ("axes", ("axes", "axis", "hinge")),
    ("axis", ("axis", "axes", "subhinges")),
    ("a coordinate of hinge", ("hinge_name", "name")),
    ("has a hinge called", ("hinge_name", "name")),
)


def read(file: TomlFile, *, root: str, welds: str | None, strict: bool) -> tuple[Multibody, list[str]]:
    """Return the model of a TOML file, and its warnings (each text with file and line).

    Parameters as in `pycraft.load`. Raises ModelError, with file, line, table and key, for faults of the file.
    """
    if root == "free":
        text = 'root="free" is for URDF files; in a TOML file give the body hinge = "free" and hinge_name = "root"'
        raise file.error((), text)
    if "effects" in file.data or "model" in file.data:
        raise file.error((), "this is the file of a scene; pycraft.load_scene reads it")
    return read_table(TomlTable(file, file.data, (), "a model", MODEL), Path(file.path).stem, welds, strict)


def read_table(table: TomlTable, name: str, welds: str | None = None, strict: bool = False) -> tuple[Multibody, list[str]]:
    """Return the model of a table, `name` if it has none, and its warnings."""
    if (written := table.data.get("format", FORMAT)) != FORMAT or isinstance(written, bool):
        raise table.error("format", f"format = {written!r:.40} is not read by this version of pycraft, which reads {FORMAT}")
    kept = table.choice("welds", ("lump", "keep"), "lump")
    model = Multibody(table.text("name", name, empty=True), welds=welds or kept, strict=strict or table.flag("strict"))
    tables = (table.tables("bodies", BODY, "body", named=True) or []) + (table.tables("nodes", NODE, "node", named=True) or [])
    _add_all(model, tables)
    for loop in table.tables("loops", (*LOOP, *POSE), "loop", named=True) or []:
        add_loop(model, loop, *_pose(loop))
    gravity = table.vector("gravity", 3, f"{_VECTOR} in m/s²")
    if gravity is not None:
        model.gravity = gravity
    if (state := table.table("state", ("q", "v"), "the state")) is not None:
        set_state(model, state)
    if (left := table.table("left_aside", ("gravity", "spring_rest", *QUANTITIES), "left_aside")) is not None:
        model._left_aside = _left_aside(model, left)
    model._actuators = [_actuator(model, actuator) for actuator in table.tables("actuators", ACTUATOR, "actuator", named=True) or []]
    model._offers = [held_weight(model, held) for held in table.tables("held_weights", HELD, "held weight") or []]
    boxes = table.tables("fluid_boxes", (*BOX, *POSE), "box in a fluid") or []
    model._offers += [fluid_box(model, box, *_pose(box)) for box in boxes]
    model._not_read = table.texts("not_read")
    model._shapes = [shape_of(model, shape, *_pose(shape)) for shape in table.tables("shapes", (*SHAPE, *POSE), "shape", named=True) or []]
    lines = {body.data["name"]: body for body in tables}
    return model, [f"{lines[body].at() if body in lines else table.at()}: {text}" for body, text in model.take_warnings()]


# Bodies and nodes -----------------------------------------------------------------------------------------------------


def _add_all(model: Multibody, tables: list[TomlTable]) -> None:
    """Add bodies and nodes, each after its carrier, otherwise in the order of the file."""
    first: dict[str, TomlTable] = {}
    for table in tables:
        name = table.text("name")
        if (other := first.setdefault(name, table)) is not table:
            raise table.error("name", f"{table.label}: {other.label}, {other.at('name')}, has this name already; rename one")
    added: set[str] = set()
    waiting: dict[str, list[TomlTable]] = {}
    for table in tables:
        ready = [table]
        while ready:
            now = ready.pop()
            carrier = _carrier(now, first)
            if carrier is not None and carrier not in added:
                waiting.setdefault(carrier, []).append(now)
                continue
            (_add_node if "body" in _keys(now) else _add_body)(model, now, carrier)
            added.add(now.data["name"])
            ready.extend(reversed(waiting.pop(now.data["name"], [])))
    for table in tables:
        if table.data["name"] not in added:
            raise _circle(table, first)


def _keys(table: TomlTable) -> tuple[str, ...]:
    return NODE if table.place[-2] == "nodes" else BODY


def _carrier(table: TomlTable, known: dict[str, TomlTable]) -> str | None:
    """Return the body or node that carries a body or node, None for the base."""
    key = "body" if "body" in _keys(table) else "parent"
    if key not in table:
        return None
    name = table.text(key)
    if name not in known:
        raise table.error(key, f"{table.label} is on {name!r}, and no body or node has this name; {nearest(name, known)}")
    return name


def _circle(table: TomlTable, known: dict[str, TomlTable]) -> Exception:
    """Return the error for a body that is never added: bodies that carry each other."""
    path: dict[str, None] = {}  # in order
    name: str | None = table.data["name"]
    while name is not None and name not in path:
        path[name] = None
        name = _carrier(known[name], known)
    walked = list(path)
    circle = [str(name), *reversed(walked[walked.index(str(name)) :])]
    text = f"{abbreviated(circle, ' → ')} carry each other; a model is a tree: leave one parent out"
    return known[str(name)].error("parent" if "parent" in known[str(name)] else "body", text)


def _add_node(model: Multibody, table: TomlTable, carrier: str | None) -> None:
    rotation, position = _pose(table)
    try:
        model._add_node(table.data["name"], carrier or "", rotation, position)
    except _core.ModelError as error:
        raise _located(table, str(error)) from None


def _add_body(model: Multibody, table: TomlTable, carrier: str | None) -> None:
    kind = table.choice("hinge", tuple(_core.hinge_kinds), "pin")
    options = _hinge(table, kind)
    rotation, position = _pose(table)
    options |= dict(
        hinge_name=table.text("hinge_name", table.data["name"]),
        mass=table.number("mass", 0.0, "in kg"),
        com=table.vector("com", 3, f"{_VECTOR} in m, in the body's frame"),
        inertia=_inertia(table),
        rotor_inertia=_rotor_inertia(table),
        limits=_limits(table),
    )
    try:
        if "subhinges" in options and kind != "custom":  # subhinges of the kind, with other axes than its own
            lower, upper = options["limits"] or (None, None)
            model._add_body(
                table.data["name"], carrier or "", kind, options["hinge_name"], [], None, 0.0, options["subhinges"], rotation, position,
                options["mass"], options["com"], options["inertia"], options["rotor_inertia"], lower, upper,
            )  # fmt: skip
        else:
            model.add_body(table.data["name"], carrier, kind, rotation=rotation, position=position, **options)
    except _core.ModelError as error:
        raise _located(table, str(error)) from None


def _located(table: TomlTable, text: str) -> Exception:
    """Return an error of the core about a body or node, with the line of the key that it concerns."""
    rest = text
    for name in (table.data["name"], table.data.get("hinge_name", "")):
        rest = rest.replace(f"'{name}'", "") if name else rest  # a name may hold any word
    for words, keys in _SPOKEN_OF:
        if words in rest and (found := [key for key in keys if key in table]):
            return table.error(found[0], text)
    return table.error(None, text)


# Parts of a body ------------------------------------------------------------------------------------------------------


def _hinge(table: TomlTable, kind: str) -> dict[str, Any]:
    """Return axes, point and pitch, or subhinges, if the table has them."""
    options: dict[str, Any] = {}
    if (axis := table.vector("axis", 3, _VECTOR)) is not None:
        options["axis"] = axis
    if (axes := table.vectors("axes", None, "a list of axes: [[1, 0, 0], [0, 1, 0]]")) is not None:
        options["axes"] = axes
    if (point := table.vector("point", 3, f"{_VECTOR} in m, in the hinge's frame")) is not None:
        options["point"] = point
    if "pitch" in table:
        options["pitch"] = table.number("pitch", 0.0, "in metres per radian")
    subhinges = subhinges_of(table)
    if subhinges is not None:
        if other := [key for key in options if key in table]:
            raise table.error(other[0], f"{table.label} has subhinges and {other[0]}; each subhinge has its own")
        options["subhinges"] = subhinges
    elif kind == "custom":
        raise table.error("hinge", f'{table.label}: a custom hinge has subhinges = [{{kind = "pin", axis = [0, 0, 1]}}, ...]')
    return options


def _pose(table: TomlTable) -> tuple[Any, list[float] | None]:
    """Return rotation and position of a table, None for absent ones."""
    given = [key for key in ("rotation", "rpy", "quaternion") if key in table]
    if len(given) > 1:
        raise table.error(given[1], f"{table.label} has {given[0]} and {given[1]}; give one of them")
    position = table.vector("position", 3, f"{_VECTOR} in m")
    rotation: Any = table.vectors("rotation", 3, "three rows of three finite numbers: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]")
    if (angles := table.vector("rpy", 3, "three angles about the fixed axes x, y and z, in rad: [0, 0, 1.5707963267948966]")) is not None:
        rotation = rotation_from_rpy(*angles)
    if (quaternion := table.vector("quaternion", 4, "four finite numbers: [w, x, y, z]")) is not None:
        if not 1e-8 < np.linalg.norm(quaternion) < np.inf:
            raise table.error("quaternion", f"{table.label}: quaternion has zero length; the identity is [1, 0, 0, 0]")
        rotation = rotation_from_quaternion(quaternion)
    return rotation, position


def _inertia(table: TomlTable) -> np.ndarray | None:
    """Return the inertia from xx, yy, zz, xy, xz, yz, with zero for missing ones."""
    moments = table.table("inertia", MOMENTS, f"{table.label}: inertia")
    if moments is None:
        return None
    xx, yy, zz, xy, xz, yz = (moments.number(moment, 0.0, "in kg m²") for moment in MOMENTS)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _rotor_inertia(table: TomlTable) -> float | list[float] | None:
    if isinstance(table.data.get("rotor_inertia"), list):
        return table.vector("rotor_inertia", None, "a number, or one for each coordinate: [0.1, 0.2]")
    return table.number("rotor_inertia", 0.0, "in kg m² or kg, or a list of one for each coordinate") if "rotor_inertia" in table else None


def _limits(table: TomlTable) -> tuple[list[float], list[float]] | None:
    if "limits" not in table:
        return None
    value = table.data["limits"]
    if isinstance(value, list) and value and isinstance(value[0], list):
        lower, upper = table.vectors("limits", 2, _LIMITS, None, infinite=True) or ([], [])
        return lower, upper
    low, high = table.vector("limits", 2, _LIMITS, infinite=True) or (0.0, 0.0)
    return [low], [high]


# Beside the bodies ----------------------------------------------------------------------------------------------------


def set_state(model: Multibody, table: TomlTable) -> None:
    """Set q and v by the names of hinges; others stay at zero."""
    for key in ("q", "v"):
        if (given := table.table(key, None, f"{key} of the state")) is None:
            continue
        values = _by_hinge(model, given, f"{key}_slice", model.zero_q() if key == "q" else np.zeros(model.nv))
        try:
            setattr(model, key, values)
        except _core.ModelError as error:
            spoken_of = [name for name in given.data if f"'{name}'" in str(error)]
            raise given.error(spoken_of[0] if spoken_of else None, str(error)) from None


def _by_hinge(model: Multibody, table: TomlTable, part_of: str, values: np.ndarray) -> np.ndarray:
    """Return `values` with the entries of the hinges that the table names."""
    for name in table.data:
        hinge = _hinge_called(model, name, table)
        part: slice = getattr(hinge, part_of)
        count = part.stop - part.start
        one = count == 1 and not isinstance(table.data[name], list)
        wanted = f"{count} finite numbers, those of a {hinge.kind} hinge" if count != 1 else "one finite number"
        values[part] = table.number(name, 0.0, "the value of the hinge's coordinate") if one else table.vector(name, count, wanted)
    return values


def _hinge_called(model: Multibody, name: str, table: TomlTable) -> Any:
    if name not in model.hinges:
        raise table.error(name, f"{table.label}: no hinge is called {name!r}; {nearest(name, model.hinges)}")
    return model.hinges[name]


def _left_aside(model: Multibody, table: TomlTable) -> dict[str, np.ndarray]:
    """Return values by the names of coordinates; NaN where the table has none."""
    made: dict[str, np.ndarray] = {}
    numbers = {name: i for i, name in enumerate(model.coordinate_names)}
    for key in table.data:
        if key == "gravity":
            made[key] = np.array(table.vector(key, 3, f"{_VECTOR} in m/s²"))
            continue
        given = table.table(key, None, f"{key} in left_aside")
        assert given is not None
        if key == "spring_rest":
            made["spring rest"] = _by_hinge(model, given, "q_slice", model.zero_q())
            continue
        made[key] = np.full(model.nv, np.nan)
        for name in given.data:
            if name not in numbers:
                raise given.error(name, f"{given.label}: no coordinate is called {name!r}; {nearest(name, numbers)}")
            made[key][numbers[name]] = given.number(name, 0.0, "the value of this coordinate", infinite=True)
    return made


def _actuator(model: Multibody, table: TomlTable) -> dict[str, Any]:
    """Return an actuator with the keys of `Multibody.actuators`; on a coordinate, or on none with the reason why it is not an effect."""
    coordinate = table.text("coordinate", "") or None
    if coordinate is not None and coordinate not in model.coordinate_names:
        near = nearest(coordinate, model.coordinate_names)
        raise table.error("coordinate", f"{table.label}: no coordinate is called {coordinate!r}; {near}")
    why_not = table.text("why_not", "") or None
    if coordinate is None and why_not is None:
        raise table.error(None, f'{table.label} acts on no coordinate; name one: coordinate = "...", or say in why_not why there is none')
    lower, upper = table.vector("force_range", 2, "two forces in N m or N: [lower, upper]", infinite=True) or (-np.inf, np.inf)
    return {
        "name": table.text("name"),
        "coordinate": coordinate,
        "gear": table.number("gear", 1.0, "the ratio of its gear"),
        "gain": table.number("gain", 1.0, "in N m or N for each unit of control"),
        "bias": table.vector("bias", 3, "three finite numbers: [force, force by position, force by velocity]") or [0.0, 0.0, 0.0],
        "control": table.number("control", 0.0, "the one that stands for zero"),
        "force range": [lower, upper],
        "why not": why_not,
    }
