"""The elements of a URDF file: links and joints, their numbers checked, before they are put together (see `urdf`)."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from .rotations import rotation_from_quaternion, rotation_from_rpy, turned_inertia
from .xml_file import Element, XmlFile, label, local_name

HINGES = {
    "revolute": "pin",
    "continuous": "pin",
    "prismatic": "slider",
    "fixed": "weld",
    "floating": "free",
    "planar": "planar",
    "ball": "ball",
    "spherical": "ball",
}
_COORDINATES = {"pin": 1, "slider": 1, "weld": 0, "free": 6, "planar": 3, "ball": 3}
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_IDENTITY, _ZERO, _X = np.eye(3), np.zeros(3), np.array([1.0, 0.0, 0.0])
for _constant in (_IDENTITY, _ZERO, _X):
    _constant.setflags(write=False)
# Of a joint: element, attribute, what it is called in Multibody.left_aside.
_LEFT_ASIDE = (
    ("dynamics", "damping", "damping"),
    ("dynamics", "friction", "friction"),
    ("limit", "effort", "effort limit"),
    ("limit", "velocity", "velocity limit"),
)
_EXPAND = "expand the file first: xacro file.xacro > file.urdf"


@dataclass
class Link:
    """A link: its element, mass (kg), centre of mass (m) in the link's frame, inertia about it (kg m²) in the link's axes."""

    name: str
    element: Element
    mass: float = 0.0
    com: np.ndarray = field(default_factory=lambda: _ZERO)
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))


@dataclass
class Mimic:
    """position = multiplier · (position of the joint it follows) + offset."""

    element: Element
    follows: str
    multiplier: float
    offset: float


@dataclass(eq=False)  # hashed by identity
class Joint:
    """A joint: its element, kind of hinge, the pose of the child link in the parent link at zero, and how it moves."""

    name: str
    element: Element
    kind: str
    parent: str
    child: str
    rotation: np.ndarray
    position: np.ndarray
    axis: np.ndarray
    limits: tuple[np.ndarray, np.ndarray] | None
    rotor_inertia: np.ndarray | None
    mimic: Mimic | None


T = TypeVar("T", Link, Joint)


class Elements:
    """The links and joints of a file by name, in its order, and in `warnings` what is worth a word.

    Parameters
    ----------
    file : XmlFile
    follow : bool
        Whether mimic elements are read.

    Raises
    ------
    ModelError
        With file, line, link or joint: names that are missing, taken or unknown, numbers that are none, xacro.
    """

    def __init__(self, file: XmlFile, follow: bool):
        self.file, self.follow = file, follow
        self.warnings: list[str] = []
        self.left_aside: dict[str, dict[str, float]] = {}  # numbers by quantity and joint
        self._refuse_xacro()
        self.links = {link.name: link for link in self._named("link", self._link)}
        if not self.links:
            raise file.error(file.root, f"{label(file.root)} has no links; a robot has one at least")
        self.joints = {joint.name: joint for joint in self._named("joint", self._joint)}

    def _refuse_xacro(self) -> None:
        if not self.file.may_have_macros:
            return
        # In libxml2: to list the attributes of an element one by one takes time by the square of their number.
        macros = "//*[contains(name(), 'xacro') or contains(namespace-uri(), 'xacro')]"
        expressions = "//@*[contains(., '${') or contains(., '$(')]"
        found: list[Any] = self.file.root.xpath(f"({macros} | {expressions})[1]")
        for macro in found:
            if not isinstance(macro, str):
                raise self.file.error(macro, f"<{local_name(macro)}> is a xacro macro; {_EXPAND}")
            attribute: Any = macro  # a string that knows its element
            element = attribute.getparent()
            raise self.file.error(element, f'{label(element)}: {attribute.attrname}="{macro}" is a xacro expression; {_EXPAND}')

    def _named(self, kind: str, read: Callable[[str, Element], T]) -> Iterator[T]:
        """The root's elements of one kind, read one by one; ModelError where two have the same name."""
        lines: dict[str, int] = {}
        for element in self.file.children(self.file.root, kind):
            name = self.file.text(element, "name")
            if name in lines:
                raise self.file.error(element, f"{kind} {name!r} is defined twice, first in line {lines[name]}; rename one")
            lines[name] = element.sourceline
            yield read(name, element)

    def _origin(self, parent: Element, owner: Element) -> tuple[np.ndarray, np.ndarray]:
        """Rotation and position that an <origin> gives; the identity where there is none."""
        origin = self.file.child(parent, "origin")
        if origin is None:
            return _IDENTITY, _ZERO
        position = self.file.numbers(origin, "xyz", 3, owner, _ZERO)
        if origin.get("quat_xyzw") is None:
            angles = self.file.numbers(origin, "rpy", 3, owner, _ZERO)
            return rotation_from_rpy(angles) if angles.any() else _IDENTITY, position
        if origin.get("rpy") is not None:
            raise self.file.error(origin, f"{label(owner)}: <origin> has rpy and quat_xyzw; give one of them")
        quaternion = self.file.numbers(origin, "quat_xyzw", 4, owner)
        if not np.linalg.norm(quaternion) > 1e-8:
            raise self.file.error(origin, f"{label(owner)}: <origin> quat_xyzw has length 0; no rotation is 0 0 0 1")
        return rotation_from_quaternion(np.roll(quaternion, 1)), position

    # ------------------------------------------------------------------ links
    def _link(self, name: str, element: Element) -> Link:
        inertial = self.file.child(element, "inertial")
        if inertial is None:
            return Link(name, element)
        mass = self.file.required(inertial, "mass", element, 'write <mass value="..."/> in kg')
        inertia = self.file.required(inertial, "inertia", element, "write it with six moments, zeros for a point mass")
        rotation, com = self._origin(inertial, element)
        xx, xy, xz, yy, yz, zz = (self.file.number(inertia, moment, element) for moment in _MOMENTS)
        moments = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if rotation is not _IDENTITY:
            moments = turned_inertia(rotation, moments)
        return Link(name, element, self.file.number(mass, "value", element), com, moments)

    # ------------------------------------------------------------------ joints
    def _joint(self, name: str, element: Element) -> Joint:
        kind = self.file.text(element, "type")
        if kind not in HINGES:
            raise self.file.error(element, f"joint {name!r} has the type {kind!r}; there are {', '.join(HINGES)}")
        hinge = HINGES[kind]
        if hinge != "weld":
            self._leave_aside(name, element)
        rotation, position = self._origin(element, element)
        return Joint(
            name,
            element,
            hinge,
            self._end("parent", element),
            self._end("child", element),
            rotation,
            position,
            self._axis(element, hinge),
            self._limits(element, kind),
            self._rotor_inertia(element, hinge),
            self._mimic(element, hinge),
        )

    def _leave_aside(self, name: str, element: Element) -> None:
        """What the file says of a joint that a model does not have: numbers above zero of damping, friction and bounds."""
        for tag, attribute, quantity in _LEFT_ASIDE:
            inner = self.file.child(element, tag)
            if inner is not None and inner.get(attribute) is not None:
                number = self.file.number(inner, attribute, element, infinite=True)
                if number > 0:
                    self.left_aside.setdefault(quantity, {})[name] = number

    def _end(self, end: str, element: Element) -> str:
        inner = self.file.required(element, end, element, f'write <{end} link="..."/>')
        link = self.file.text(inner, "link", element)
        if link not in self.links:
            near = (difflib.get_close_matches(link, self.links, 3) if len(link) < 200 else []) or list(self.links)[:6]
            names = ", ".join(near) + (", ..." if len(near) < len(self.links) else "")
            remedy = f'add <link name="{link}"/> or correct the name (there are {names})'
            raise self.file.error(inner, f"{label(element)} has the {end} {link!r}, and no link has this name; {remedy}")
        return link

    def _axis(self, element: Element, hinge: str) -> np.ndarray:
        axis = self.file.child(element, "axis")
        if axis is None or hinge not in ("pin", "slider", "planar"):
            return _X  # a zero axis is common in joints that have none
        direction = self.file.numbers(axis, "xyz", 3, element, _X)
        length = math.hypot(*direction)
        if not length > 1e-12:
            raise self.file.error(axis, f"{label(element)}: its axis has length {length:g}; give a direction")
        return direction

    def _limits(self, element: Element, kind: str) -> tuple[np.ndarray, np.ndarray] | None:
        limit = self.file.child(element, "limit") if kind in ("revolute", "prismatic") else None
        if limit is None or (limit.get("lower") is None and limit.get("upper") is None):
            return None
        lower, upper = (self.file.number(limit, end, element, 0.0, infinite=True) for end in ("lower", "upper"))
        if lower > upper:
            text = f"its lower limit {lower:g} lies above the upper one {upper:g}; both are left out"
            self.warnings.append(f"{self.file.at(limit)}: {label(element)}: {text}")
            return None
        return np.array([lower]), np.array([upper])

    def _rotor_inertia(self, element: Element, hinge: str) -> np.ndarray | None:
        ours = self.file.child(element, "pycraft")
        if ours is None:
            return None
        unknown = [attribute for attribute in ours.attrib if attribute != "rotor_inertia"]
        if unknown:
            raise self.file.error(ours, f"{label(element)}: <pycraft> has the attribute {unknown[0]!r}; there is rotor_inertia")
        values, count = self.file.numbers(ours, "rotor_inertia", None, element), _COORDINATES[hinge]
        if len(values) != count:
            what = f"takes {count} rotor inerti{'a' if count == 1 else 'as'}, one for each coordinate, not {len(values)}"
            raise self.file.error(ours, f"{label(element)} {what}")
        return values

    def _mimic(self, element: Element, hinge: str) -> Mimic | None:
        mimic = self.file.child(element, "mimic")
        if mimic is None or not self.follow or hinge == "weld":
            return None
        multiplier, offset = (
            self.file.number(mimic, attribute, element, default) for attribute, default in (("multiplier", 1.0), ("offset", 0.0))
        )
        return Mimic(mimic, self.file.text(mimic, "joint", element), multiplier, offset)
