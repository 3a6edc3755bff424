"""Read SDF files into a `Multibody`: links become bodies, joints hinges, with the file's names and order (docs/sdf.md).

joint type                  hinge              coordinates
revolute, continuous        pin                angle about the axis
prismatic                   slider             travel along the axis
screw                       screw              angle; screw_thread_pitch is metres per turn
ball                        ball               quaternion (w, x, y, z)
universal                   universal          angles about axis and axis2
revolute2                   custom, two pins   angles about axis and axis2
fixed                       weld               none

A model is read in its initial state: poses by the rules of frames (`relative_to`, `attached_to`, `expressed_in`), at coordinates zero. The
first joint that reaches a link is its hinge; each further one is a loop of the model. A link that no joint reaches is free, as in Gazebo,
unless the model is static or `root="fixed"`. Names are scoped by "::" in models within models, and in worlds of several models. A link
without gravity is a compensated weight: `Multibody.offers`.
"""

from __future__ import annotations

import heapq
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ... import _core
from ..multibody import Multibody
from ..offers import HeldWeight
from .left_aside import by_coordinate
from .sdf_elements import WORLD, Joint, Link, Scope, numbers_of, text_of, version_of
from .sdf_shapes import shapes_of
from .xml_file import Element, XmlFile, abbreviated, label, local_name

_SILENT = {
    "visual",
    "collision",
    "inertial",
    "pose",
    "sensor",
    "gravity",
    "self_collide",
    "light",
    "audio_source",
    "audio_sink",
    "projector",
    "battery",
}
_SILENT_VALUES = {"kinematic": ("false", "0"), "enable_wind": ("false", "0"), "must_be_base_link": ("false", "0", "true", "1")}


def read(
    file: XmlFile, *, root: str | None, mimic: str, welds: str, strict: bool, package_dirs: Iterable[str | os.PathLike[str]] = ()
) -> tuple[Multibody, list[str]]:
    """Return the model of an SDF file, and its warnings (each text with file and line).

    Parameters as in `pycraft.load`. Raises ModelError, with file, line and element, for faults of the file.
    """
    scope, name, gravity = _scope(file)
    if mimic == "refuse" and (followers := _followers(scope)):
        names = abbreviated(f"{joint.name!r}" for joint, _ in followers)
        raise file.error(followers[0][1], f'mimic="refuse", and joints follow others: {names}; mimic="couple" makes couplings of them')
    model = Multibody(name or Path(file.path).stem, welds=welds, strict=strict)
    builder = _Builder(scope, model, root)
    builder.build()
    if mimic == "couple":
        _couple(scope, model)
    elif mimic == "lock" and (followers := _followers(scope)):
        raise file.error(followers[0][1], 'mimic="lock" is for URDF files; load with mimic="couple" or mimic="free"')
    builder.add_frames()
    _leave_aside(scope, model, gravity)
    model._not_read = _not_read(file)
    model._shapes, unread = shapes_of(file, scope, model, package_dirs)
    lines = {link.name: link.element for link in scope.links.values()}
    said = [f"{file.at(lines[body]) if body in lines else file.path}: {text}" for body, text in model.take_warnings()]
    return model, unread + said


def _scope(file: XmlFile) -> tuple[Scope, str, np.ndarray | None]:
    """Return all names of the file, its name, and the gravity of its world."""
    version_of(file)  # before anything else depends on it
    scope, worlds = Scope(file), file.children(file.root, "world")
    if len(worlds) > 1:
        raise file.error(worlds[1], f"the file has {len(worlds)} worlds; a model is one of them")
    top = worlds[0] if worlds else file.root
    if (include := next(iter(file.children(top, "include")), None)) is not None:
        uri = text_of(file, include, "uri", "")
        raise file.error(
            include, f"the world includes {uri!r}, and files that are included are not read; put its model in the place of the <include>"
        )
    models = file.children(top, "model")
    if not models:
        raise file.error(top, f"<{local_name(top)}> has no <model>; write one with its links and joints")
    for element in models:
        own = file.text(element, "name")
        scope.read(element, f"{own}::" if len(models) > 1 else "", WORLD)
    if not scope.links:
        raise file.error(models[0], f"{label(models[0])} has no links; a model has one at least")
    gravity = next(iter(file.children(top, "gravity")), None) if worlds else None
    name = worlds[0].get("name") if len(models) > 1 else models[0].get("name")
    return scope, name or "", None if gravity is None else np.array(numbers_of(file, gravity, 3, top))


class _Builder:
    """Builds a model from links and joints."""

    def __init__(self, scope: Scope, model: Multibody, root: str | None):
        self.scope, self.model, self.file, self.root = scope, model, scope.file, root
        self.ends = {name: self._ends(joint) for name, joint in scope.joints.items()}
        self.world = {name: scope.in_world(name, link.element) for name, link in scope.links.items()}
        self.there: set[str] = set()  # links that are in the model
        self.closing: list[str] = []  # joints that become loops

    def _ends(self, joint: Joint) -> tuple[str, str]:
        parent, child = (self.scope.link_of(end, joint.element) for end in (joint.parent, joint.child))
        if parent == child:
            raise self.file.error(joint.element, f"joint {joint.name!r} has link {child!r} at both of its ends")
        if child == WORLD:
            raise self.file.error(joint.element, f"joint {joint.name!r} has the world for its child; exchange its parent and child")
        return parent, child

    def build(self) -> None:
        """Add links that no joint carries, then bodies by the first joint of the file that reaches them; further joints become loops."""
        carried_by_any = {child for _, child in self.ends.values()}
        roots = [name for name in self.scope.links if name not in carried_by_any]
        for name in roots:
            self._add_root(name, len(roots) == 1)
        self._reach([WORLD, *roots])
        for name in self.scope.links:  # a circle of links without a carrier: the first of them is the root
            if not self._stands(name):
                self._add_root(name, not roots)
                self._reach([name])
        for name in self.closing:
            self._close(self.scope.joints[name])

    def _reach(self, starts: list[str]) -> None:
        """Add the bodies that joints reach from these links, each by the earliest such joint of the file."""
        outboard: dict[str, list[int]] = {}
        for k, (parent, _) in enumerate(self.ends.values()):
            outboard.setdefault(parent, []).append(k)
        names, open_joints = list(self.ends), [k for start in starts for k in outboard.get(start, ())]
        heapq.heapify(open_joints)
        while open_joints:
            name = names[heapq.heappop(open_joints)]
            child = self.ends[name][1]
            if self._stands(child):
                self.closing.append(name)
            else:
                self._add_body(name)
                for k in outboard.get(child, ()):
                    heapq.heappush(open_joints, k)

    def _stands(self, link: str) -> bool:
        return link in self.there

    def _add_root(self, name: str, alone: bool) -> None:
        """Add a link that no joint carries: free, or fixed where the file places it."""
        free = self.root != "fixed" and name not in self.scope.static
        hinge = "root" if alone and "root" not in self.scope.joints else f"root of {name}"
        if self.root == "free" and "root" in self.scope.joints and alone:
            text = 'has the name of the free hinge that root="free" adds; rename it, or load with root="fixed"'
            raise self.file.error(self.scope.joints["root"].element, f"joint 'root' {text}")
        X = self.world[name]
        self._add(
            self.scope.links[name],
            None,
            hinge,
            {"hinge": "free"} if free else {"hinge": "weld", "placement": X},
            self.scope.links[name].element,
        )
        if free:
            q, at = np.array(self.model.q), self.model.hinges[hinge].q_slice
            q[at] = [*_quaternion(X[:3, :3]), *X[:3, 3]]
            self.model.q = q

    def _add_body(self, name: str) -> None:
        joint, (parent, link) = self.scope.joints[name], self.ends[name]
        how = self._hinge(joint, self.world[parent] if parent != WORLD else np.eye(4), self.world[link])
        if link in self.scope.static:  # nothing in a static model moves
            how = {"hinge": "weld", "placement": how["placement"]}
        self._add(self.scope.links[link], None if parent == WORLD else parent, joint.name, how, joint.element)

    def _add(self, link: Link, parent: str | None, hinge: str, how: dict[str, Any], element: Element) -> None:
        self.there.add(link.name)
        try:
            self.model.add_body(link.name, parent, hinge_name=hinge, mass=link.mass, com=link.com, inertia=link.inertia, **how)
        except _core.ModelError as error:
            at = link.element if f"body '{link.name}'" in str(error) else element
            raise self.file.error(at, str(error)) from None

    def _hinge(self, joint: Joint, parent: np.ndarray, child: np.ndarray) -> dict[str, Any]:
        """Return the hinge of the child on the parent, from their poses (4, 4) in the world."""
        placement = np.linalg.inv(parent) @ child
        placement[:3, :3], placement[3] = parent[:3, :3].T @ child[:3, :3], (0, 0, 0, 1)
        how: dict[str, Any] = {"hinge": joint.kind, "placement": placement}
        if joint.kind == "weld":
            return how
        at = child[:3, :3].T @ (self.scope.in_world(joint.name, joint.element)[:3, 3] - child[:3, 3])
        axes = []
        for axis in joint.axes:
            R = self.scope.in_world(axis.expressed_in, axis.element)[:3, :3]
            axes.append(child[:3, :3].T @ R @ axis.direction)
        limited = any(np.isfinite(axis.limits).any() for axis in joint.axes)
        if limited:
            pairs = np.array([axis.limits for axis in joint.axes])
            how["limits"] = tuple(pairs.T) if len(pairs) > 1 else tuple(pairs[0])
        if joint.kind == "custom":
            return how | {"subhinges": [{"kind": "pin", "axis": axis, "point": at} for axis in axes]}
        how |= {"point": at} if joint.kind != "slider" else {}
        how |= {"pitch": joint.pitch} if joint.kind == "screw" else {}
        return how | ({"axes": axes} if len(axes) > 1 else {"axis": axes[0]} if axes else {})

    def _close(self, joint: Joint) -> None:
        """Declare a loop for a joint to a link that another joint already carries."""
        parent, child = self.ends[joint.name]
        if {parent, child} <= self.scope.static | {WORLD}:
            return
        how = self._hinge(joint, self.world[parent] if parent != WORLD else np.eye(4), self.world[child])
        how.pop("limits", None)
        placement = how.pop("placement")
        try:
            self.model.add_loop(
                child, None if parent == WORLD else parent, name=joint.name, rotation=placement[:3, :3], position=placement[:3, 3], **how
            )
        except _core.ModelError as error:
            raise self.file.error(joint.element, str(error)) from None

    def add_frames(self) -> None:
        """Add frames of the file as nodes."""
        for name in self.scope.named_frames:
            element = self.scope.frames[name].element
            on = self.scope.link_of(name, element)
            X, base = self.scope.in_world(name, element), np.eye(4) if on == WORLD else self.world[on]
            try:
                self.model.add_node(name, None if on == WORLD else on, placement=np.linalg.inv(base) @ X)
            except _core.ModelError as error:
                raise self.file.error(element, str(error)) from None


def _quaternion(R: np.ndarray) -> np.ndarray:
    from ...interop.mujoco import _quaternion as quaternion_of

    q = quaternion_of(R)
    return q if q[0] >= 0 else -q


# Beside the model -----------------------------------------------------------------------------------------------------


def _followers(scope: Scope) -> list[tuple[Joint, Element]]:
    return [(joint, axis.mimic) for joint in scope.joints.values() for axis in joint.axes if axis.mimic is not None]


def _couple(scope: Scope, model: Multibody) -> None:
    """Declare q = multiplier (q of the leader - reference) + offset, as couplings with the names of the following joints."""
    file = scope.file
    for joint, mimic in _followers(scope):
        leader = (mimic.get("joint") or "").strip()
        prefix = joint.name[: joint.name.rfind("::") + 2] if "::" in joint.name else ""
        if prefix + leader not in scope.joints:
            raise file.error(
                mimic, f'joint {joint.name!r} follows {leader!r}, and no joint has this name; correct it, or load with mimic="free"'
            )
        numbers = {"multiplier": 1.0, "offset": 0.0, "reference": 0.0}
        for part in mimic:
            if local_name(part) in numbers:
                numbers[local_name(part)] = numbers_of(file, part, 1, joint.element)[0]
        first = [f"{name}[0]" if len(scope.joints[name].axes) > 1 else name for name in (joint.name, prefix + leader)]
        constant = numbers["multiplier"] * numbers["reference"] - numbers["offset"]
        try:
            model.add_coupling({first[0]: 1.0, first[1]: -numbers["multiplier"]}, constant=constant, name=joint.name)
        except _core.ModelError as error:
            raise file.error(mimic, str(error)) from None


def _leave_aside(scope: Scope, model: Multibody, gravity: np.ndarray | None) -> None:
    """Store damping, friction, springs and bounds by coordinate; gravity; links with compensated weight."""
    found: dict[str, dict[str, float]] = {}
    rest = np.array(model.zero_q())
    for name, joint in scope.joints.items():
        if name not in model.hinges or len(joint.axes) != 1:
            continue
        for quantity, value in joint.axes[0].aside.items():
            found.setdefault(quantity, {})[name] = value
        if "stiffness" in joint.axes[0].aside:
            rest[model.hinges[name].q_slice] = joint.axes[0].spring_rest
    model._left_aside = by_coordinate(model, found)
    for name, joint in scope.joints.items():
        if name in model.hinges and len(joint.axes) == 2:
            for k, axis in enumerate(joint.axes):
                for quantity, value in axis.aside.items():
                    made = model._left_aside.setdefault(quantity, np.full(model.nv, np.nan))
                    made[model.hinges[name].v_slice.start + k] = value
    if "stiffness" in model._left_aside and rest.any():
        model._left_aside["spring rest"] = rest
    if gravity is not None and gravity.any():
        model._left_aside["gravity"] = gravity
    g = None if gravity is None else tuple(gravity.tolist())
    held = [link for link in scope.links.values() if not link.has_gravity and link.mass and link.name not in scope.static]
    model._offers = [HeldWeight(link.name, link.mass, link.com, g) for link in held if gravity is None or gravity.any()]


def _not_read(file: XmlFile) -> list[str]:
    """Return elements that move bodies in a simulator of SDF and are not read here, in words."""
    found = []
    for element in file.root.iter():
        name, owner = local_name(element), element.getparent()
        of = f" of {label(owner)}" if owner is not None and owner.get("name") else ""
        at = f" (line {element.sourceline})"
        if name == "plugin":
            found.append(f"plugin {element.get('name') or element.get('filename') or ''!r}{of}{at}")
        elif name in ("gripper", "fluid_added_mass", "velocity_decay"):
            inside = [part for part in element if (part.text or "").strip() not in ("0", "0.0")]
            found += [f"<{name}>{of}{at}"] if name != "velocity_decay" or inside else []
        elif name == "link":
            moving = [part for part in element if local_name(part) in _SILENT_VALUES]
            values = [(local_name(part), (part.text or "").strip().lower()) for part in moving]
            found += [f"<{tag}>{text}</{tag}> of {label(element)}{at}" for tag, text in values if text not in _SILENT_VALUES[tag]]
        elif name == "wind" and any((part.text or "").strip() not in ("0 0 0", "") for part in element):
            found.append(f"<wind>{of}{at}")
        elif name == "ode" and owner is not None and local_name(owner) == "physics" and local_name(owner.getparent()) == "joint":
            found += [
                f"<{local_name(part)}> of {label(owner.getparent())}" for part in element if local_name(part) == "implicit_spring_damper"
            ]
    links = [link for link in file.root.iter() if local_name(link) == "link" and any(local_name(part) == "collision" for part in link)]
    if len(links) > 1:
        found.append(f"contacts (of {len(links)} links with collision shapes)")
    return found
