"""The elements of a URDF file: links and joints with checked values, before they are assembled (see `urdf`)."""

from __future__ import annotations

import difflib
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from ... import _core
from .rotations import rotation_from_quaternion, rotation_from_rpy, turned_inertia
from .xml_file import Element, XmlFile, abbreviated, label, local_name, same_elements

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
_MOMENTS, _PRINCIPAL = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), ("ixx", "iyy", "izz")
_IDENTITY, _ZERO, _X = np.eye(3), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)
_IDENTITY.setflags(write=False)
_LINK_PARTS, _INERTIAL_PARTS = frozenset({"inertial"}), frozenset({"origin", "mass", "inertia"})
_WELD_PARTS = frozenset({"origin", "parent", "child", "axis", "mimic", "pycraft"})
_JOINT_PARTS = _WELD_PARTS | {"limit", "dynamics"}
# For a joint: element, attribute, name in Multibody.left_aside.
_LEFT_ASIDE = {
    "dynamics": (("damping", "damping"), ("friction", "friction")),
    "limit": (("effort", "effort limit"), ("velocity", "velocity limit")),
}
_LARGEST = sys.float_info.max
_EXPAND = "expand the file first: pip install xacro, then xacro file.xacro > file.urdf"


@dataclass(slots=True)
class Link:
    """A link: its element, mass (kg), centre of mass (m) in the link's frame, inertia about it (kg m²) in the link's axes."""

    name: str
    element: Element
    mass: float = 0.0
    com: Sequence[float] = _ZERO
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))


@dataclass(slots=True)
class Mimic:
    """position = multiplier · (position of the joint it follows) + offset."""

    element: Element
    follows: str
    multiplier: float
    offset: float


@dataclass(eq=False, slots=True)  # hashed by identity
class Joint:
    """A joint: its element, kind of hinge, the pose of the child link in the parent link at zero, and its motion."""

    name: str
    element: Element
    kind: str
    parent: str
    child: str
    rotation: np.ndarray
    position: Sequence[float] | np.ndarray
    axis: Sequence[float]
    limits: tuple[float, float] | None
    rotor_inertia: Sequence[float] | None
    mimic: Mimic | None


T = TypeVar("T", Link, Joint)


class Elements:
    """The links and joints of a file by name, in its order, and its `warnings`.

    Parameters
    ----------
    file : XmlFile
    follow : bool
        Whether to read mimic elements.

    Raises
    ------
    ModelError
        With file, line, link or joint: names that are missing, duplicate or unknown, invalid numbers, xacro.
    """

    def __init__(self, file: XmlFile, follow: bool):
        self.file, self.follow = file, follow
        self.warnings: list[str] = []
        self.left_aside: dict[str, dict[str, float]] = {}  # values by quantity and joint
        self._about_macros()
        self.links = self._named("link", self._link)
        if not self.links:
            raise file.error(file.root, f"{label(file.root)} has no links; a robot has one at least")
        self.joints = self._named("joint", self._joint)

    def _about_macros(self) -> None:
        """Ignore elements of xacro with a warning, as other readers do; ModelError for expressions in elements that are read."""
        if not self.file.may_have_macros:
            return
        # In libxml2: listing the attributes of an element one by one takes quadratic time.
        is_macro = "contains(name(), 'xacro') or contains(namespace-uri(), 'xacro')"
        macros: list[Any] = self.file.root.xpath(f"//*[{is_macro}]")
        read = "/*[local-name()='robot'] | /*/*[local-name()='link' or local-name()='joint']"
        inside = "/*/*[local-name()='link']/*[local-name()='inertial']/descendant-or-self::* | /*/*[local-name()='joint']/descendant::*"
        expressions: list[Any] = self.file.root.xpath(f"(({read} | {inside})/@*[contains(., '${{') or contains(., '$(')])[1]")
        if macros and self.file.path.lower().endswith(".xacro"):
            raise self.file.error(macros[0], f"<{local_name(macros[0])}> is a xacro macro; {_EXPAND}")
        for attribute in expressions:  # a string that refers to its element
            element = attribute.getparent()
            raise self.file.error(element, f'{label(element)}: {attribute.attrname}="{attribute}" is a xacro expression; {_EXPAND}')
        if macros:
            names = abbreviated((f"<{local_name(macro)}> (line {macro.sourceline})" for macro in macros), most=4)
            self.warnings.append(
                f"{self.file.at(macros[0])}: elements of xacro are ignored: {names}; if links or joints are missing, {_EXPAND}"
            )

    def _named(self, kind: str, read: Callable[[str, Element], T]) -> dict[str, T]:
        """Return the root's elements of one kind by name; ModelError for duplicate names."""
        found: dict[str, T] = {}
        for element in self.file.children(self.file.root, kind):
            name = self.file.text(element, "name")
            if name in found:
                first = found[name].element.sourceline
                if same_elements(found[name].element, element):
                    self.warnings.append(
                        f"{self.file.at(element)}: {kind} {name!r} is repeated word for word, first in line {first}; it counts once"
                    )
                    continue
                raise self.file.error(element, f"{kind} {name!r} is defined twice, first in line {first}; rename one")
            found[name] = read(name, element)
        return found

    def _pose(self, origin: Element | None, owner: Element) -> tuple[np.ndarray, Sequence[float]]:
        """Return rotation and position of an <origin>; the identity if there is none."""
        if origin is None:
            return _IDENTITY, _ZERO
        position = self.file.numbers(origin, "xyz", 3, owner, _ZERO)
        if origin.get("quat_xyzw") is None:
            angles = self.file.numbers(origin, "rpy", 3, owner, _ZERO)
            return rotation_from_rpy(*angles) if any(angles) else _IDENTITY, position
        if origin.get("rpy") is not None:
            raise self.file.error(origin, f"{label(owner)}: <origin> has rpy and quat_xyzw; give one of them")
        quaternion = self.file.numbers(origin, "quat_xyzw", 4, owner)
        if not np.linalg.norm(quaternion) > 1e-8:
            raise self.file.error(origin, f"{label(owner)}: <origin> quat_xyzw has length 0; the identity is 0 0 0 1")
        return rotation_from_quaternion(np.roll(quaternion, 1)), position

    # ------------------------------------------------------------------ links
    def _link(self, name: str, element: Element) -> Link:
        inertial = self.file.parts(element, _LINK_PARTS).get("inertial")
        if inertial is None:
            return Link(name, element)
        parts = self.file.parts(inertial, _INERTIAL_PARTS)
        mass = self.file.required(parts, "mass", inertial, element, 'write <mass value="..."/> in kg')
        inertia = self.file.required(parts, "inertia", inertial, element, "write it with six moments, zeros for a point mass")
        rotation, com = self._pose(parts.get("origin"), element)
        xx, xy, xz, yy, yz, zz = [self.file.number(inertia, moment, element, None if moment in _PRINCIPAL else 0.0) for moment in _MOMENTS]
        if len(inertia.attrib) < len(_MOMENTS) and (missing := [moment for moment in _MOMENTS if inertia.get(moment) is None]):
            self.warnings.append(
                f"{self.file.at(inertia)}: {label(element)}: {' and '.join(missing)} of its <inertia> are missing and taken for 0"
            )
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
        parts = self.file.parts(element, _JOINT_PARTS if hinge != "weld" else _WELD_PARTS)
        if hinge != "weld":
            self._leave_aside(name, element, parts)
        rotation, position = self._pose(parts.get("origin"), element)
        return Joint(
            name,
            element,
            hinge,
            self._end("parent", element, parts),
            self._end("child", element, parts),
            rotation,
            position,
            self._axis(element, parts.get("axis"), hinge),
            self._limits(element, parts.get("limit"), kind),
            self._rotor_inertia(element, parts.get("pycraft"), hinge),
            self._mimic(element, parts.get("mimic"), hinge),
        )

    def _leave_aside(self, name: str, element: Element, parts: dict[str, Element]) -> None:
        """Store data of a joint that a model does not have: positive values of damping, friction and bounds."""
        for tag, quantities in _LEFT_ASIDE.items():
            if (inner := parts.get(tag)) is None:
                continue
            for attribute, quantity in quantities:
                number = self.file.number(inner, attribute, element, 0.0, infinite=True)
                if number > 0:
                    self.left_aside.setdefault(quantity, {})[name] = number

    def _end(self, end: str, element: Element, parts: dict[str, Element]) -> str:
        inner = self.file.required(parts, end, element, element, f'write <{end} link="..."/>')
        link = self.file.text(inner, "link", element)
        if link not in self.links:
            near = (difflib.get_close_matches(link, self.links, 3) if len(link) < 200 else []) or list(self.links)[:6]
            names = ", ".join(near) + (", ..." if len(near) < len(self.links) else "")
            remedy = f'add <link name="{link}"/> or correct the name (there are {names})'
            raise self.file.error(inner, f"{label(element)} has the {end} {link!r}, and no link has this name; {remedy}")
        return link

    def _axis(self, element: Element, axis: Element | None, hinge: str) -> Sequence[float]:
        if axis is None or hinge not in ("pin", "slider", "planar"):
            return _X  # a zero axis is common in joints that have none
        direction = self.file.numbers(axis, "xyz", 3, element, _X)
        length = math.hypot(*direction)
        if not length > 1e-12:
            raise self.file.error(axis, f"{label(element)}: its axis has length {length:g}; give a direction")
        return direction

    def _limits(self, element: Element, limit: Element | None, kind: str) -> tuple[float, float] | None:
        if kind not in ("revolute", "prismatic") or limit is None or (limit.get("lower") is None and limit.get("upper") is None):
            return None
        lower = self.file.number(limit, "lower", element, 0.0, infinite=True)
        upper = self.file.number(limit, "upper", element, 0.0, infinite=True)
        if lower > upper:
            text = f"its lower limit {lower:g} lies above the upper one {upper:g}; both are left out"
            self.warnings.append(f"{self.file.at(limit)}: {label(element)}: {text}")
            return None
        # The largest double stands for a missing limit if a reader accepts only finite numbers.
        lower, upper = (-math.inf if lower <= -_LARGEST else lower), (math.inf if upper >= _LARGEST else upper)
        return None if math.isinf(lower) and math.isinf(upper) else (lower, upper)

    def _rotor_inertia(self, element: Element, ours: Element | None, hinge: str) -> Sequence[float] | None:
        if ours is None:
            return None
        unknown = [attribute for attribute in ours.attrib if attribute != "rotor_inertia"]
        if unknown:
            raise self.file.error(ours, f"{label(element)}: <pycraft> has the attribute {unknown[0]!r}; there is rotor_inertia")
        values, count = self.file.numbers(ours, "rotor_inertia", None, element), _core.hinge_kinds[hinge].nv
        if len(values) != count:
            what = f"takes {count} rotor inerti{'a' if count == 1 else 'as'}, one for each coordinate, not {len(values)}"
            raise self.file.error(ours, f"{label(element)} {what}")
        return values

    def _mimic(self, element: Element, mimic: Element | None, hinge: str) -> Mimic | None:
        if mimic is None or not self.follow or hinge == "weld":
            return None
        multiplier, offset = (
            self.file.number(mimic, attribute, element, default) for attribute, default in (("multiplier", 1.0), ("offset", 0.0))
        )
        return Mimic(mimic, self.file.text(mimic, "joint", element), multiplier, offset)
