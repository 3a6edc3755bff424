"""Write a model as URDF, if URDF has its features; `pycraft.load` reads it back to rounding.

hinge                        joint
pin revolute if a side has a limit, else continuous
slider                       prismatic
weld                         fixed
free                         floating
planar, its own axes         planar

A joint's axis passes through its child link's origin. If a pin's axis misses its body's origin, the joint carries a link "..._at_hinge"
with its origin at the pin's point and the body's mass; the body's own frame is fixed to it, a massless link of the body's name. Nodes are
massless links on fixed joints. Bodies on the base are on a massless root link, called "world" unless a node of the base is at its origin. A
side without a limit is the largest double, which every reader accepts; `pycraft.load` reads it as none. Unknown bounds on efforts and
velocities are 0, which readers interpret as "unknown". Rotor inertia and loops are in our own elements (see `loaders.urdf`).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ...interop.export import numbers_text
from ..loaders.left_aside import current
from ..loaders.rotations import nearest_rpy
from ..loaders.xml_file import abbreviated
from ..warning import warn
from .loop_elements import loops_element
from .shape_elements import UrdfShapes, lost_text
from .toml_writer import made_by, same

if TYPE_CHECKING:
    from lxml.etree import _Element as Element

    from ..multibody import Multibody
    from ..shapes import Shape

_TYPES = {"pin": "revolute", "slider": "prismatic", "free": "floating"}
_ZERO = np.zeros(3)
_NO_LIMIT = sys.float_info.max


def model_text(model: Multibody, path: str) -> str:
    """Return the file's text. `path`: its destination, for messages.

    Raises
    ------
    ModelError
        Hinges, limits and names that URDF does not have: names them, and the remedy.

    Warns
    -----
    ModelWarning
        Further data of the model that URDF does not hold: gravity, a state, stiffnesses in `left_aside`.
    """
    from lxml import etree

    described = model.description()
    _refuse(described, path)
    robot = etree.Element("robot", name=described["name"])
    links, shapes = _Links(described, _joint_extras(model)), UrdfShapes(path)
    made = {}
    for element in links.elements():
        robot.append(element)
        if element.tag == "link":
            made[element.get("name")] = element
    for link, own in _by_body(model).items():
        made[link or links.root].extend(shapes.elements(own))
    if (loops := loops_element(model, described, links.root)) is not None:
        robot.append(loops)
    if unsaid := _unsaid(model):
        warn(f"{path}: a URDF file does not hold {', '.join(unsaid)}; a .toml file does")
    if shapes.lost:
        warn(f"{path}: shapes that were not written: {lost_text(shapes.lost)}")
    etree.indent(robot)
    head = '<?xml version="1.0"?>\n<!-- Written by PyCraft. SI units and radians. -->\n'
    return head + etree.tostring(robot, encoding="unicode") + "\n"


# Features that URDF lacks ----------------------------------------------------------------------------------------------


def _refuse(described: dict[str, Any], path: str) -> None:
    lacking = [text for body in described["bodies"] if (text := _lacking(body["hinge"]))]
    if lacking:
        kinds = "URDF has joints of type revolute, continuous, prismatic, fixed, planar and floating alone"
        raise _core.ModelError(f"{path}: {abbreviated(lacking, '; ', 4)}. {kinds}; save the model as .toml, which holds every hinge")
    names = [described["name"], *(x["name"] for part in ("bodies", "nodes", "loops") for x in described.get(part, []))]
    for name in [*names, *(body["hinge"]["name"] for body in described["bodies"])]:
        if bad := _unwritable(name):
            raise _core.ModelError(f"{path}: the name {name!r} {bad}; rename it, or save the model as .toml, which holds every name")


def _lacking(hinge: dict[str, Any]) -> str:
    """Return the feature of a hinge that URDF lacks; empty if it has all."""
    name, kinds = f"hinge {hinge['name']!r}", [s["kind"] for s in hinge["subhinges"]]
    limited = len(hinge["lower"]) and bool(np.isfinite([hinge["lower"], hinge["upper"]]).any())
    if hinge["kind"] == "planar":
        made = made_by("planar", [hinge["subhinges"][2]["axis"]], hinge["subhinges"][2]["point"])
        if any(not same(a["axis"], b["axis"]) for a, b in zip(made, hinge["subhinges"], strict=True)):
            return f"{name} is planar with x and y of its own"
        return f"{name} is planar with limits" if limited else ""
    if len(kinds) > 1:
        parts = f" of {', '.join(kinds)}" if hinge["kind"] == "custom" else ""
        return f"{name} is of kind {hinge['kind']!r}{parts}"
    return f"{name} is of kind {kinds[0]!r}" if kinds and kinds[0] not in _TYPES else ""


def not_xml(name: str) -> str:
    """Return the fault of a name that XML does not accept; empty if it is valid."""
    lacking = any(not (" " <= c or c in "\t\n\r") or c in "\ufffe\uffff" for c in name)
    return "has a character that XML does not have" if lacking else ""


def _unwritable(name: str) -> str:
    if bad := not_xml(name):
        return bad
    if name.strip() != name:
        return "begins or ends with a blank, which readers of URDF take off"
    return "reads as an expression of xacro" if "${" in name or "$(" in name else ""


def _by_body(model: Multibody) -> dict[str, list[Shape]]:
    """Return the shapes by the body or node that they are on; shapes of removed bodies have none."""
    found: dict[str, list[Shape]] = {}
    there = {"", *model.bodies, *model.nodes}
    for shape in model._shapes:
        if shape.body in there:
            found.setdefault(shape.body, []).append(shape)
    return found


def _unsaid(model: Multibody) -> list[str]:
    said = [f"gravity {tuple(model.gravity.tolist())}"] if model.gravity.any() else []
    if not (same(model.q, model.zero_q()) and same(model.v, np.zeros(model.nv))):
        said.append("the state q, v")
    said += ["its actuators"] if model.actuators else []
    said += ["forces on bodies that its file offered"] if model.offers else []
    return said + [f"the {name} in left_aside" for name in ("gravity", "stiffness", "quadratic damping") if name in model.left_aside]


# Features that it has ----------------------------------------------------------------------------------------------------------


def _joint_extras(model: Multibody) -> dict[str, dict[str, float]]:
    """Return damping, friction and bounds in `left_aside`, by hinge of one coordinate."""
    extras: dict[str, dict[str, float]] = {}
    for quantity, values in current(model).items():
        if quantity not in ("damping", "friction", "effort limit", "velocity limit"):
            continue
        for name, hinge in model.hinges.items():
            value = values[hinge.v_slice]
            if len(value) == 1 and not np.isnan(value[0]):
                extras.setdefault(name, {})[quantity] = float(value[0])
    return extras


@dataclass
class _Links:
    """Links and joints of a model: `moved` is, by body, the origin of the link on its hinge, in the body's frame."""

    described: dict[str, Any]
    extras: dict[str, dict[str, float]]
    moved: list[np.ndarray] = field(default_factory=list)
    carried: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        bodies, nodes = self.described["bodies"], self.described["nodes"]
        self.links = {x["name"] for x in (*bodies, *nodes)}
        self.joints = {body["hinge"]["name"] for body in bodies}
        self.root, self.rooted = self._root()
        for body in bodies:
            self.moved.append(_off_axis(body["hinge"]))
            self.carried.append(_unused(f"{body['name']}_at_hinge", self.links) if self.moved[-1].any() else body["name"])

    def _root(self) -> tuple[str, str]:
        """Return the root link's name, and the name of the body or node that it represents; both are empty if there is none."""
        bodies, nodes = self.described["bodies"], self.described["nodes"]
        on_base = [body for body in bodies if body["parent"] < 0]
        fixed = [node["name"] for node in nodes if node["body"] < 0 and _is_origin(node)]
        if fixed:
            return fixed[0], fixed[0]
        if len(on_base) == 1:
            name, hinge = on_base[0]["name"], on_base[0]["hinge"]
            called_so = hinge["name"] in ("root", f"root of {name}")  # the name that `load` gives to the weld of a kept root link
            if called_so and not hinge["subhinges"] and _is_origin(hinge["placement"]):
                return name, name
        return _unused("world", self.links), ""

    def elements(self) -> Iterator[Element]:
        """Yield links and joints, every link before the joint that carries it."""
        if all(self.root != body["name"] for body in self.described["bodies"]):
            yield _link(self.root)
        for k, body in enumerate(self.described["bodies"]):
            yield _link(self.carried[k], body, self.moved[k])
            if body["name"] != self.rooted:
                yield self._hinge(k, body)
            if self.moved[k].any():
                yield _link(body["name"])
                yield self._fixed(body["name"], self.carried[k], _ZERO - self.moved[k])
        for node in self.described["nodes"]:
            if node["name"] != self.rooted:
                on = node["body"]
                yield _link(node["name"])
                position = node["position"] - self.moved[on] if on >= 0 else node["position"]
                yield self._fixed(node["name"], self.carried[on] if on >= 0 else self.root, position, node["rotation"])

    def _fixed(self, link: str, parent: str, position: np.ndarray, rotation: np.ndarray | None = None) -> Element:
        return _joint(_unused(f"{link}_fixed", self.joints), "fixed", parent, link, position, np.eye(3) if rotation is None else rotation)

    def _hinge(self, k: int, body: dict[str, Any]) -> Element:
        from lxml import etree

        hinge, parent = body["hinge"], body["parent"]
        placement, subhinges = hinge["placement"], hinge["subhinges"]
        position = placement["position"]
        if self.moved[k].any():
            position = position + placement["rotation"] @ self.moved[k]
        if parent >= 0 and self.moved[parent].any():
            position = position - self.moved[parent]
        lower, upper = (hinge["lower"][0], hinge["upper"][0]) if len(hinge["lower"]) == 1 else (-np.inf, np.inf)
        kind = "planar" if hinge["kind"] == "planar" else _TYPES[subhinges[0]["kind"]] if subhinges else "fixed"
        if kind == "revolute" and lower == -np.inf and upper == np.inf:
            kind = "continuous"
        on = self.carried[parent] if parent >= 0 else self.root
        joint = _joint(hinge["name"], kind, on, self.carried[k], position, placement["rotation"])
        if kind not in ("fixed", "floating"):
            etree.SubElement(joint, "axis", xyz=numbers_text(subhinges[-1]["axis"]))
        _add_extras(joint, kind, lower, upper, self.extras.get(hinge["name"], {}))
        if not same(hinge["rotor_inertia"], np.zeros(len(hinge["rotor_inertia"]))):
            etree.SubElement(joint, "pycraft", rotor_inertia=numbers_text(hinge["rotor_inertia"]))
        return joint


def _off_axis(hinge: dict[str, Any]) -> np.ndarray:
    """Return the vector from the body's origin to the rotation axis of its hinge, zero for an axis through the origin."""
    turning = [s for s in hinge["subhinges"] if s["kind"] == "pin"]
    if not turning or not turning[-1]["point"].any():
        return _ZERO
    axis, point = turning[-1]["axis"], turning[-1]["point"]
    across = point - axis * (axis @ point)
    return point if np.linalg.norm(across) > 8 * np.finfo(float).eps * np.linalg.norm(point) else _ZERO


def _is_origin(pose: dict[str, Any]) -> bool:
    return not pose["position"].any() and np.array_equal(pose["rotation"], np.eye(3))


def _unused(name: str, taken: set[str]) -> str:
    """Return the name, or the first of name_2, name_3, ... that is unused, and mark it as used."""
    free, i = name, 1
    while free in taken:
        i += 1
        free = f"{name}_{i}"
    taken.add(free)
    return free


# Elements -------------------------------------------------------------------------------------------------------------


def _link(name: str, body: dict[str, Any] | None = None, origin: np.ndarray = _ZERO) -> Element:
    """Return a link; `origin` is its origin in the body's frame."""
    from lxml import etree

    link = etree.Element("link", name=name)
    if body is not None and (body["mass"] or body["inertia"].any()):
        inertial, moments = etree.SubElement(link, "inertial"), body["inertia"]
        etree.SubElement(inertial, "origin", xyz=numbers_text(body["com"] - origin if origin.any() else body["com"]))
        etree.SubElement(inertial, "mass", value=numbers_text(body["mass"]))
        names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
        etree.SubElement(inertial, "inertia", {name: numbers_text(moments[at]) for name, at in names.items()})
    return link


def _joint(name: str, kind: str, parent: str, child: str, position: np.ndarray, rotation: np.ndarray) -> Element:
    from lxml import etree

    joint = etree.Element("joint", name=name, type=kind)
    etree.SubElement(joint, "parent", link=parent)
    etree.SubElement(joint, "child", link=child)
    turned = not np.array_equal(rotation, np.eye(3))
    if turned or position.any():
        etree.SubElement(
            joint, "origin", {"xyz": numbers_text(position)} | ({"rpy": numbers_text(nearest_rpy(rotation))} if turned else {})
        )
    return joint


def _add_extras(joint: Element, kind: str, lower: float, upper: float, extras: dict[str, float]) -> None:
    """Add limits, bounds and damping, if a joint of this type has them."""
    from lxml import etree

    if kind in ("revolute", "prismatic") or (kind == "continuous" and {"effort limit", "velocity limit"} & extras.keys()):
        sides = {"lower": max(lower, -_NO_LIMIT), "upper": min(upper, _NO_LIMIT)} if kind != "continuous" else {}
        bounds = {name: extras.get(f"{name} limit", 0.0) for name in ("effort", "velocity")}
        etree.SubElement(joint, "limit", {name: numbers_text(value) for name, value in (sides | bounds).items()})
    if own := {name: numbers_text(extras[name]) for name in ("damping", "friction") if name in extras}:
        etree.SubElement(joint, "dynamics", own)
