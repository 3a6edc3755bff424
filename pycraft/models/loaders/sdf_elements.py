"""The elements of an SDF file: links, joints and frames by their scoped names, before they are assembled (see `sdf`)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from .rotations import rotation_from_quaternion, rotation_from_rpy, turned_inertia
from .toml_file import nearest
from .xml_file import Element, XmlFile, label, local_name

WORLD, MODEL = "world", "__model__"
TYPES = {
    "revolute": "pin",
    "continuous": "pin",
    "prismatic": "slider",
    "screw": "screw",
    "ball": "ball",
    "universal": "universal",
    "revolute2": "custom",
    "fixed": "weld",
}
_NO_LIMIT = 1e16
"""Limits from this value on mean no limit: the default of the format."""


@dataclass(slots=True)
class Frame:
    """A link, joint or frame: its pose (4, 4) in the frame `within`, and for frames the link that they are attached to."""

    element: Element
    within: str
    pose: np.ndarray
    attached_to: str = ""


@dataclass(slots=True)
class Link:
    """A link: its mass (kg), centre of mass (m) and inertia about it (kg m²) in the link's frame."""

    name: str
    element: Element
    mass: float
    com: np.ndarray
    inertia: np.ndarray
    has_gravity: bool


@dataclass(slots=True)
class Axis:
    """An axis of a joint, expressed in a frame, its limits, and data for effects, by the quantities of `Multibody.left_aside`."""

    element: Element
    direction: np.ndarray
    expressed_in: str
    limits: tuple[float, float]
    aside: dict[str, float]
    spring_rest: float
    mimic: Element | None


@dataclass(slots=True, eq=False)
class Joint:
    """A joint: its kind of hinge, the frames of its ends, its axes, and the pitch of a screw in metres per radian."""

    name: str
    element: Element
    kind: str
    parent: str
    child: str
    axes: list[Axis]
    pitch: float


@dataclass
class Scope:
    """All names of a file: `links`, `joints` and `frames` by their scoped names "model::link", those of a single model by their own."""

    file: XmlFile
    links: dict[str, Link] = field(default_factory=dict)
    joints: dict[str, Joint] = field(default_factory=dict)
    frames: dict[str, Frame] = field(default_factory=dict)
    named_frames: list[str] = field(default_factory=list)
    canonical: dict[str, str] = field(default_factory=dict)
    static: set[str] = field(default_factory=set)

    # ------------------------------------------------------------------ reading
    def read(self, model: Element, prefix: str, outer: str, static: bool = False) -> None:
        """Read a model and those nested in it. `prefix` precedes its names, `outer` is the frame of its pose."""
        file = self.file
        if (include := next(iter(file.children(model, "include")), None)) is not None:
            uri = text_of(file, include, "uri", "")
            text = f"{label(model)} includes {uri!r}, and files that are included are not read"
            raise file.error(include, f"{text}; put its model in the place of the <include>, for instance by `gz sdf -p`")
        static = static or truth(file, model, "static", False)
        own = prefix + MODEL
        for element in file.children(model, "link"):
            name = self._new(element, prefix)
            self.links[name] = _link(file, element, name)
            self._add_frame(name, element, prefix, own)
            if static:
                self.static.add(name)
        for element in file.children(model, "frame"):
            name, attached = self._new(element, prefix), (element.get("attached_to") or "").strip()
            self._add_frame(name, element, prefix, prefix + attached if attached else own, prefix + (attached or MODEL))
            self.named_frames.append(name)
        for element in file.children(model, "joint"):
            name = self._new(element, prefix)
            self.joints[name] = joint = self._joint(element, name, prefix)
            self._add_frame(name, element, prefix, joint.child, joint.child)
        for element in file.children(model, "model"):
            name = self._new(element, prefix)
            self.read(element, f"{name}::", own, static)
            self.frames[name] = Frame(element, f"{name}::{MODEL}", np.eye(4), f"{name}::{MODEL}")
        first = [name for name in self.links if name.startswith(prefix)]
        wanted = prefix + (model.get("canonical_link") or "").strip()
        if wanted != prefix and wanted not in self.links:
            raise file.error(model, f"{label(model)}: its canonical_link {wanted!r} is no link; {nearest(wanted, first)}")
        if first:
            self.canonical[own] = wanted if wanted != prefix else first[0]
        self._place_model(model, prefix, outer)

    def _place_model(self, model: Element, prefix: str, outer: str) -> None:
        """Return the frame of a model: at its <pose>, or as given by the frame in it that is its placement_frame."""
        own = prefix + MODEL
        within, pose = _pose(self.file, model, outer)
        relative = outer[: len(outer) - len(MODEL)] if outer.endswith(MODEL) else ""
        within = outer if within == outer else relative + within
        self.frames[own] = Frame(model, within, pose, own)
        if placed := (model.get("placement_frame") or "").strip():
            inner = self.pose(prefix + placed, own, model)
            self.frames[own].pose = pose @ np.linalg.inv(inner)

    def _new(self, element: Element, prefix: str) -> str:
        name = self.file.text(element, "name")
        if name in (WORLD, MODEL) or "::" in name:
            raise self.file.error(element, f"the name {name!r} is reserved, and so are names with '::'; rename this {local_name(element)}")
        scoped = prefix + name
        if scoped in self.frames or scoped in self.joints:
            first = (self.frames.get(scoped) or self.joints[scoped]).element
            raise self.file.error(
                element, f"{local_name(element)} {name!r} has the name of the {local_name(first)} in line {first.sourceline}; rename one"
            )
        return scoped

    def _add_frame(self, name: str, element: Element, prefix: str, default: str, attached_to: str = "") -> None:
        within, pose = _pose(self.file, element, "")
        self.frames[name] = Frame(element, prefix + within if within else default, pose, attached_to or name)

    def _joint(self, element: Element, name: str, prefix: str) -> Joint:
        file, given = self.file, self.file.text(element, "type")
        if given not in TYPES:
            remedy = " (a gearbox is a coupling: `Multibody.add_coupling`)" if given == "gearbox" else ""
            raise file.error(element, f"joint {name!r} is of type {given!r}; there are {', '.join(TYPES)}{remedy}")
        ends = [text_of(file, element, end) for end in ("parent", "child")]
        if ends[1] == WORLD:
            raise file.error(element, f"joint {name!r} has the world for its child; exchange its parent and child")
        kind, axes = TYPES[given], []
        for k in range({"weld": 0, "ball": 0, "universal": 2, "custom": 2}.get(kind, 1)):
            tag = ("axis", "axis2")[k]
            inner = next(iter(file.children(element, tag)), None)
            if inner is None and kind in ("universal", "custom"):
                raise file.error(element, f"joint {name!r} of type {given!r} has no <{tag}>; write <{tag}><xyz>...</xyz></{tag}>")
            axes.append(self._axis(inner, element, name, prefix, given))
        pitch = self._pitch(element, name) if kind == "screw" else 0.0
        parent, child = (end if end == WORLD else prefix + end for end in ends)
        return Joint(name, element, kind, parent, child, axes, pitch)

    def _axis(self, axis: Element | None, joint: Element, name: str, prefix: str, given: str) -> Axis:
        file = self.file
        if axis is None:
            return Axis(joint, np.array([0.0, 0.0, 1.0]), name, (-math.inf, math.inf), {}, 0.0, None)
        xyz = next(iter(file.children(axis, "xyz")), None)
        direction = np.array([0.0, 0.0, 1.0]) if xyz is None else np.array(numbers_of(file, xyz, 3, joint))
        if not np.linalg.norm(direction) > 1e-12:
            raise file.error(xyz if xyz is not None else axis, f"{label(joint)}: its axis has no length; give a direction")
        frame = (xyz.get("expressed_in") or "").strip() if xyz is not None else ""
        in_model = truth(file, axis, "use_parent_model_frame", version_of(file) < (1, 5))
        expressed_in = prefix + frame if frame else prefix + MODEL if in_model and version_of(file) < (1, 7) else name
        numbers = {}
        for tag in ("limit", "dynamics"):
            inside = next(iter(file.children(axis, tag)), None)
            for part in () if inside is None else inside:
                numbers[local_name(part)] = numbers_of(file, part, 1, joint, infinite=True)[0]
        lower, upper = numbers.get("lower", -math.inf), numbers.get("upper", math.inf)
        if lower > upper:
            raise file.error(axis, f"{label(joint)}: its lower limit {lower:g} lies above the upper one {upper:g}; exchange them")
        limits = (-math.inf if lower <= -_NO_LIMIT else lower, math.inf if upper >= _NO_LIMIT else upper)
        quantities = {
            "damping": "damping",
            "friction": "friction",
            "spring_stiffness": "stiffness",
            "effort": "effort limit",
            "velocity": "velocity limit",
        }
        aside = {quantities[key]: value for key, value in numbers.items() if key in quantities and 0 < value < _NO_LIMIT}
        mimic = next(iter(file.children(axis, "mimic")), None)
        return Axis(
            axis,
            direction,
            expressed_in,
            limits if given != "continuous" else (-math.inf, math.inf),
            aside,
            numbers.get("spring_reference", 0.0),
            mimic,
        )

    def _pitch(self, element: Element, name: str) -> float:
        """Return metres per radian from screw_thread_pitch, metres per turn, or from the older thread_pitch, radians per metre,
        left-handed."""
        for tag in ("screw_thread_pitch", "thread_pitch"):
            if (inner := next(iter(self.file.children(element, tag)), None)) is not None:
                value = numbers_of(self.file, inner, 1, element)[0]
                if value == 0:
                    raise self.file.error(inner, f"joint {name!r}: <{tag}> is zero; a screw moves along its axis")
                return value / (2 * math.pi) if tag == "screw_thread_pitch" else -1 / value
        return 1 / (2 * math.pi)

    # ------------------------------------------------------------------ poses and ends
    def pose(self, name: str, upto: str, element: Element) -> np.ndarray:
        """Return the pose (4, 4) of a frame in another one that its poses lead to. ModelError for an unknown name, and for a circle."""
        X, seen = np.eye(4), [name]
        while name != upto:
            if name not in self.frames:
                known = [known for known in self.frames if not known.endswith(MODEL)]
                raise self.file.error(
                    element, f"{label(element)} refers to the frame {name!r}, which does not exist; {nearest(name, known)}"
                )
            frame = self.frames[name]
            X, name, element = frame.pose @ X, frame.within, frame.element
            if name == WORLD and name != upto:
                raise self.file.error(element, f"{label(element)}: its pose does not lead to {upto!r}")
            if name in seen:
                raise self.file.error(element, f"poses are relative to each other in a circle: {' → '.join([*seen, name])}")
            seen.append(name)
        return X

    def in_world(self, name: str, element: Element) -> np.ndarray:
        """Return the pose (4, 4) of a frame in the world."""
        return np.eye(4) if name == WORLD else self.pose(name, WORLD, element)

    def link_of(self, name: str, element: Element) -> str:
        """Return the link to which a frame is attached; "world" for the world."""
        seen: list[str] = []
        while name not in self.links and name != WORLD:
            if name in self.canonical:
                return self.canonical[name]
            if name not in self.frames:
                known = [WORLD, *self.links, *self.named_frames]
                raise self.file.error(
                    element, f"{label(element)} names {name!r}, and no link or frame has this name; {nearest(name, known)}"
                )
            if name in seen:
                raise self.file.error(element, f"frames are attached to each other in a circle: {' → '.join([*seen, name])}")
            seen.append(name)
            name = self.frames[name].attached_to
        return name


# Texts ----------------------------------------------------------------------------------------------------------------


def version_of(file: XmlFile) -> tuple[int, ...]:
    """Return the version of the format that the file declares, default (1, 6)."""
    try:
        return tuple(map(int, (file.root.get("version") or "1.6").strip().split(".")))
    except ValueError:
        raise file.error(file.root, f"<sdf> has the version {file.root.get('version')!r}; write one such as 1.9") from None


def text_of(file: XmlFile, element: Element, tag: str, default: str | None = None) -> str:
    """Return the text of a child, which must exist and not be empty unless there is a default."""
    inner = next(iter(file.children(element, tag)), None)
    text = (inner.text or "").strip() if inner is not None else ""
    if not text and default is None:
        raise file.error(element if inner is None else inner, f"{label(element)} has no <{tag}>; write <{tag}>...</{tag}>")
    return text or default or ""


def truth(file: XmlFile, element: Element, tag: str, default: bool) -> bool:
    """Check that a child has the text "true" or "1"."""
    text = text_of(file, element, tag, "").lower()
    if text not in ("", "true", "false", "1", "0"):
        raise file.error(element, f"{label(element)}: <{tag}> is {text!r:.40}; write true or false")
    return default if not text else text in ("true", "1")


def numbers_of(file: XmlFile, element: Element, count: int | None, owner: Element, infinite: bool = False) -> list[float]:
    """Return the numbers of an element's text; ModelError, naming link or joint `owner`, for another count or words that are not
    numbers."""
    words = (element.text or "").split()
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = [math.nan]
    good = (lambda x: not math.isnan(x)) if infinite else math.isfinite
    if (
        not words
        or count not in (None, len(words))
        or not all(map(good, values))
        or "_" in (element.text or "")
        or not (element.text or "").isascii()
    ):
        wanted = "one finite number" if count == 1 else f"{count or 'finite'} numbers separated by blanks"
        raise file.error(element, f"{label(owner)}: <{local_name(element)}> is {' '.join(words)!r:.60}; write {wanted}")
    return values


def _pose(file: XmlFile, owner: Element, default: str) -> tuple[str, np.ndarray]:
    """Return the frame that a <pose> is relative to, or `default`, and the pose (4, 4); the identity without a <pose>."""
    element = next(iter(file.children(owner, "pose")), None)
    if element is None:
        return default, np.eye(4)
    frame = (element.get("relative_to") or element.get("frame") or "").strip() or default
    return frame, pose_matrix(file, element, owner)


def pose_matrix(file: XmlFile, element: Element | None, owner: Element) -> np.ndarray:
    """Return the pose (4, 4) in the text of a <pose>: x y z and roll, pitch, yaw, or a quaternion x y z w."""
    X = np.eye(4)
    if element is None or not (element.text or "").strip():
        return X
    if (element.get("rotation_format") or "euler_rpy").strip() == "quat_xyzw":
        values = numbers_of(file, element, 7, owner)
        if not np.linalg.norm(values[3:]) > 1e-8:
            raise file.error(element, f"{label(owner)}: the quaternion of its <pose> has length 0; the identity is 0 0 0 1")
        X[:3, :3] = rotation_from_quaternion(np.roll(values[3:], 1))
    else:
        values = numbers_of(file, element, 6, owner)
        in_degrees = (element.get("degrees") or "").strip().lower() in ("true", "1")
        X[:3, :3] = rotation_from_rpy(*(np.radians(values[3:]) if in_degrees else values[3:]))
    X[:3, 3] = values[:3]
    return X


def _link(file: XmlFile, element: Element, name: str) -> Link:
    """Return a link with its inertia; by the format's default 1 kg and 1 kg m² about every axis."""
    inertial = next(iter(file.children(element, "inertial")), None)
    has_gravity = truth(file, element, "gravity", True)
    if inertial is None:
        file.warnings.append(f"{file.at(element)}: {label(element)} has no <inertial>, for which SDF has 1 kg and 1 kg m² about each axis")
        return Link(name, element, 1.0, np.zeros(3), np.eye(3), has_gravity)
    if (inertial.get("auto") or "").strip().lower() in ("true", "1"):
        text = f"{label(element)} has its inertia computed from its collisions (auto), which is not done here; write mass and inertia"
        raise file.error(inertial, text)
    X = pose_matrix(file, next(iter(file.children(inertial, "pose")), None), element)
    mass = next(iter(file.children(inertial, "mass")), None)
    moments = next(iter(file.children(inertial, "inertia")), None)
    values = {tag: 0.0 for tag in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")} | (
        {} if moments is not None else dict(ixx=1.0, iyy=1.0, izz=1.0)
    )
    for part in _known(moments, values):
        values[local_name(part)] = numbers_of(file, part, 1, element)[0]
    if moments is not None:
        for tag in ("ixx", "iyy", "izz"):
            if not file.children(moments, tag):
                values[tag] = 1.0
    about = np.array(
        [
            [values["ixx"], values["ixy"], values["ixz"]],
            [values["ixy"], values["iyy"], values["iyz"]],
            [values["ixz"], values["iyz"], values["izz"]],
        ]
    )
    kilograms = 1.0 if mass is None else numbers_of(file, mass, 1, element)[0]
    return Link(name, element, kilograms, X[:3, 3], turned_inertia(X[:3, :3], about), has_gravity)


def _known(element: Element | None, names: Iterable[str]) -> Iterator[Element]:
    return (part for part in (() if element is None else element) if local_name(part) in names)
