"""Write a model as the TOML text that `pycraft.load` reads back bit for bit (docs/models.md, Files).

Defaults are omitted; values are compared with defaults by their bits, so that -0.0 is written.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..loaders.left_aside import current, current_actuators
from ..loaders.rotations import rpy_of_rotation
from ..loaders.toml_offers import offer_data
from ..loaders.toml_reader import FORMAT, MOMENTS
from ..offers import BoxInFluid, HeldWeight
from .toml_text import Inline, document

if TYPE_CHECKING:
    from ..multibody import Multibody
    from ..shapes import Shape

_HEAD = "# A model of PyCraft: SI units and radians. docs/models.md, Files, says what the keys mean.\n\n"
_SILENT = {"bias": [0.0, 0.0, 0.0], "control": 0.0, "force range": [-np.inf, np.inf]}
_ZERO, _Z = np.zeros(3), np.array([0.0, 0.0, 1.0])
# For each kind with axes: its subhinges with axes, in order. (For a plane the normal is given, the axis of the last.)
_GIVEN_AXES = {
    "pin": (0,),
    "slider": (0,),
    "screw": (0,),
    "universal": (0, 1),
    "gimbal": (0, 1, 2),
    "cylindrical": (0,),
    "planar": (2,),
}


def model_text(model: Multibody, state: bool = True) -> str:
    """Return the file's text; `state`: include nonzero q and v."""
    return f"{_HEAD}{document(model_data(model, state))}\n"


def model_data(model: Multibody, state: bool = True) -> dict[str, Any]:
    """Return the file's tables as plain data."""
    described = model.description()
    bodies = described["bodies"]
    names = [body["name"] for body in bodies]
    data: dict[str, Any] = {"format": FORMAT, "name": described["name"]}
    if not same(described["gravity"], _ZERO):
        data["gravity"] = described["gravity"]
    if described["welds"] != "lump" or any(not body["hinge"]["subhinges"] for body in bodies):  # for instance locked hinges
        data["welds"] = "keep"
    if described["strict"]:
        data["strict"] = True
    if bodies:
        data["bodies"] = [_body(body, names) for body in bodies]
    if described["nodes"]:
        data["nodes"] = [_node(node, names) for node in described["nodes"]]
    if loops := [loop_data(model, loop) for loop in described.get("loops", []) if loop.get("function") is None]:
        data["loops"] = loops
    if state and (moved := state_data(model)):
        data["state"] = moved
    if left := _left_aside(model):
        data["left_aside"] = left
    if actuators := current_actuators(model):
        data["actuators"] = [_actuator(actuator) for actuator in actuators]
    for key, kind in (("held_weights", HeldWeight), ("fluid_boxes", BoxInFluid)):
        if offers := [offer_data(offer, _pose) for offer in model.offers if isinstance(offer, kind)]:
            data[key] = offers
    if model.not_read:
        data["not_read"] = model.not_read
    if shapes := [_shape(shape) for shape in model._shapes if shape.triangles is None]:
        data["shapes"] = shapes
    return data


def same(numbers: Any, others: Any) -> bool:
    """Check that these are the same doubles, bit for bit."""
    return np.asarray(numbers, float).tobytes() == np.asarray(others, float).tobytes()


def _body(body: dict[str, Any], names: list[str]) -> dict[str, Any]:
    hinge = body["hinge"]
    data: dict[str, Any] = {"name": body["name"]}
    if body["parent"] >= 0:
        data["parent"] = names[body["parent"]]
    data["hinge"] = hinge["kind"]
    if hinge["name"] != body["name"]:
        data["hinge_name"] = hinge["name"]
    data |= _axes(hinge) | _pose(hinge["placement"])
    if len(lower := hinge["lower"]):
        one = len(lower) == 1
        data["limits"] = [lower[0], hinge["upper"][0]] if one else [list(lower), list(hinge["upper"])]
    rotor = hinge["rotor_inertia"]
    if not same(rotor, np.zeros(len(rotor))):
        data["rotor_inertia"] = rotor[0] if same(rotor, np.full(len(rotor), rotor[0])) else list(rotor)
    if not same(body["mass"], 0.0):
        data["mass"] = body["mass"]
    if not same(body["com"], _ZERO):
        data["com"] = body["com"]
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    moments = Inline((key, body["inertia"][at]) for key, at in zip(MOMENTS, places, strict=True) if not same(body["inertia"][at], 0.0))
    if moments:
        data["inertia"] = moments
    return data


def _node(node: dict[str, Any], names: list[str]) -> dict[str, Any]:
    carrier = {"body": names[node["body"]]} if node["body"] >= 0 else {}
    return {"name": node["name"]} | carrier | _pose(node)


def loop_data(model: Multibody, loop: dict[str, Any]) -> dict[str, Any]:
    """Return a loop as plain data, by the keys that toml_loops reads."""
    data: dict[str, Any] = {"name": loop["name"], "kind": loop["kind"]} | {end: loop[end] for end in ("a", "b") if loop.get(end)}
    if loop["kind"] == "coupling":
        numbers = model.loops.coupled(loop["name"])
        data["coordinates"] = Inline((model.coordinate_names[i], list(of)) for i, (*_, of) in zip(numbers, loop["terms"], strict=True))
    elif "axes" in loop:
        axes = loop["axes"]
        data |= {"axis": axes[0]} if len(axes) == 1 else {"axes": axes} if axes else {}
        data |= {} if loop["point"] is None else {"point": loop["point"]}
        if "subhinges" in loop:
            data["subhinges"] = [_subhinge({"axis": _Z, "point": _ZERO, "pitch": 0.0} | one) for one in loop["subhinges"]]
        rotation, position = (zero if loop[key] is None else loop[key] for key, zero in (("rotation", np.eye(3)), ("position", _ZERO)))
        data |= _pose({"rotation": rotation, "position": position})
    data |= {key: loop[key] for key in ("quadratic", "linear") if key in loop}
    if loop["kind"] == "curve":
        data |= {"parameters": loop["parameters"], "coefficients": loop["coefficients"].reshape(-1, 3)}
        data |= {"closed": True} if loop["closed"] else {}
    return data | {key: loop[key] for key in ("radius", "pitch", "constant") if not same(loop.get(key, 0.0), 0.0)}


def _pose(pose: dict[str, Any]) -> dict[str, Any]:
    """Return position and rotation; three angles if they give the matrix to the last bit, else its rows."""
    data: dict[str, Any] = {}
    if not same(pose["position"], _ZERO):
        data["position"] = pose["position"]
    if same(pose["rotation"], np.eye(3)):
        return data
    angles = rpy_of_rotation(pose["rotation"])
    return data | ({"rotation": pose["rotation"]} if angles is None else {"rpy": angles})


def _axes(hinge: dict[str, Any]) -> dict[str, Any]:
    """Return axes, point and pitch, if the core makes exactly these subhinges from them; else the subhinges one by one."""
    kind, subhinges = hinge["kind"], hinge["subhinges"]
    if kind != "custom":
        axes = [subhinges[i]["axis"] for i in _GIVEN_AXES.get(kind, ())]
        data: dict[str, Any] = {"axis": axes[0]} if len(axes) == 1 else {"axes": axes} if axes else {}
        point = subhinges[-1]["point"] if subhinges else _ZERO
        pitch = max((subhinge["pitch"] for subhinge in subhinges), key=abs, default=0.0)
        if same(_subhinge_numbers(made_by(kind, axes, point, pitch)), _subhinge_numbers(subhinges)):
            data |= {} if same(point, _ZERO) else {"point": point}
            return data | ({} if same(pitch, 0.0) else {"pitch": pitch})
    return {"subhinges": [_subhinge(subhinge) for subhinge in subhinges]}


def made_by(kind: str, axes: list[Any], point: Any = None, pitch: float = 0.0) -> list[dict[str, Any]]:
    """Return the subhinges that the core makes for a hinge of this kind, which is not "custom"."""
    trial = _core.Multibody("trial", True, False)
    trial._add_body("trial", "", kind, "", axes, point, pitch, None, None, None, 0.0, None, None, None, None, None)
    return trial._body(0)["hinge"]["subhinges"]


def _subhinge_numbers(subhinges: list[dict[str, Any]]) -> np.ndarray:
    return np.array([[*s["axis"], *s["point"], s["pitch"]] for s in subhinges])


def _subhinge(subhinge: dict[str, Any]) -> Inline:
    kind = _core.subhinge_kinds[subhinge["kind"]]
    data = Inline(kind=subhinge["kind"])
    if kind.axis:
        data["axis"] = subhinge["axis"]
    if not same(subhinge["point"], _ZERO):
        data["point"] = subhinge["point"]
    if not same(subhinge["pitch"], 0.0):
        data["pitch"] = subhinge["pitch"]
    return data


def state_data(model: Multibody) -> dict[str, Any]:
    """Return q and v by the names of hinges, without hinges at zero."""
    parts = {"q": _positions(model, model.q)}
    parts["v"] = _by_hinge({name: hinge.v_slice for name, hinge in model.hinges.items()}, model.v, np.zeros(model.nv))
    return {key: part for key, part in parts.items() if part}


def _positions(model: Multibody, q: np.ndarray) -> dict[str, Any]:
    return _by_hinge({name: hinge.q_slice for name, hinge in model.hinges.items()}, q, model.zero_q())


def _by_hinge(slices: dict[str, slice], numbers: np.ndarray, zero: np.ndarray) -> dict[str, Any]:
    part = {name: numbers[at] for name, at in slices.items() if not same(numbers[at], zero[at])}
    return {name: values[0] if len(values) == 1 else values for name, values in part.items()}


def _left_aside(model: Multibody) -> dict[str, Any]:
    """Return data by quantity and coordinate, without NaN; rest positions of springs by hinge, as positions are."""
    data: dict[str, Any] = {}
    for quantity, values in current(model).items():
        if quantity == "gravity":
            data[quantity] = values
        elif quantity == "spring rest":
            data["spring_rest"] = _positions(model, values)
        else:
            data[quantity] = {name: value for name, value in zip(model.coordinate_names, values, strict=True) if not np.isnan(value)}
    return data


def _actuator(actuator: dict[str, Any]) -> dict[str, Any]:
    """Return the keys of `Multibody.actuators` as TOML's, without defaults."""
    data: dict[str, Any] = {"name": actuator["name"]}
    for key in ("coordinate", "gear", "gain", "bias", "control", "force range", "why not"):
        value = actuator.get(key)
        if value is not None and not (key in _SILENT and same(value, _SILENT[key])):
            data[key.replace(" ", "_")] = value
    return data


def _shape(shape: Shape) -> dict[str, Any]:
    """Return a shape; the search path of a mesh is written as absolute paths."""
    data: dict[str, Any] = {"kind": shape.kind}
    if shape.body:
        data["body"] = shape.body
    data["size"] = shape.size
    data |= _pose({"position": shape.placement[:3, 3], "rotation": shape.placement[:3, :3]})
    if shape.colour is not None:
        data["colour"] = shape.colour
    if shape.purpose != "visual":
        data["purpose"] = shape.purpose
    if shape.kind == "mesh":
        path, folders = shape.beside
        data |= {"file": shape.file, "beside": [os.path.abspath(os.fsdecode(place)) for place in (path, *folders)]}
    return data
