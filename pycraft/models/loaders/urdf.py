"""Read URDF files into a `Multibody`: links become bodies, joints hinges, with the file's names and order.

joint type                  hinge     coordinates
revolute, continuous        pin       angle about the axis
prismatic                   slider    travel along the axis
planar planar (x, y, angle) in the plane normal to the axis
ball, spherical             ball      quaternion (w, x, y, z); not in the specification, but some tools write it
floating                    free      quaternion, position
fixed                       weld      none

Visuals are `Multibody.shapes`, collision shapes `Multibody.collision_shapes`. Damping, friction and bounds on efforts and velocities are
effects: they are in `Multibody.left_aside`; other elements that change the motion are named in `Multibody.not_read` (`urdf_not_read`). Two
elements are our own, which other readers ignore: inside a joint `<pycraft rotor_inertia="1.14"/>`, one value per coordinate in kg m² or kg
as seen at the joint; in the robot `<pycraft>` with its loops (`urdf_loops`).
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

import numpy as np

from ... import _core
from ..multibody import Multibody
from .left_aside import by_coordinate
from .rotations import rotation_about
from .urdf_elements import Elements, Joint, Link
from .urdf_loops import add_loops
from .urdf_not_read import not_read
from .urdf_shapes import shapes_of
from .xml_file import XmlFile, abbreviated, label

_CUT = "a model is a tree: take one joint out"


def read(
    file: XmlFile, *, root: str | None, mimic: str, welds: str, strict: bool, package_dirs: Iterable[str | os.PathLike[str]] = ()
) -> tuple[Multibody, list[str]]:
    """Return the model of a URDF file, and its warnings (each text with file and line).

    Parameters as in `pycraft.load`. Raises ModelError, with file, line and element, for faults of the file.
    """
    elements = Elements(file, follow=mimic != "free")
    _settle_mimics(file, elements.joints, mimic)
    tree = _Tree(file, elements.links, elements.joints)
    model = _build(tree, root, welds, strict)
    if mimic == "couple":
        _couple(file, elements.joints, model)
    add_loops(file, model, tree.root)
    model._left_aside = by_coordinate(model, elements.left_aside)
    model._not_read = not_read(file)
    model._shapes, unread = shapes_of(file, elements, package_dirs)
    fixed = [] if root is not None else root_is_fixed(file, tree.links[tree.root], tree.is_free())
    return model, elements.warnings + unread + fixed + [tree.with_line(body, text) for body, text in model.take_warnings()]


def root_is_fixed(file: XmlFile, root: Link, free: bool) -> list[str]:
    """Return the warning about a root link that would move if it were not fixed: one with mass, on no joint to a world."""
    if free or not (root.mass or np.any(root.inertia)):
        return []
    return [
        f"{file.at(root.element)}: the root {label(root.element)} has mass and is fixed; root='free' makes it float, root='fixed' is silent"
    ]


# Mimic joints ---------------------------------------------------------------------------------------------------------


def _settle_mimics(file: XmlFile, joints: dict[str, Joint], mimic: str) -> None:
    """Refuse joints that follow others, weld them at their position with the followed joint at zero, or check those to be coupled."""
    followers = {joint: joint.mimic for joint in joints.values() if joint.mimic}
    if followers and mimic == "refuse":
        pairs = abbreviated(f"{j.name!r} follows {m.follows!r} (line {m.element.sourceline})" for j, m in followers.items())
        raise file.error(
            next(iter(followers.values())).element,
            f'mimic="refuse", and joints follow others: {pairs}; mimic="couple" makes couplings of them, which are loops of the model, '
            'mimic="lock" welds them at their offsets, mimic="free" lets them move on their own',
        )
    positions: dict[str, float] = {}
    for joint in followers:
        _lock(file, joints, joint, positions)
    for joint in followers if mimic == "lock" else ():
        axis = np.asarray(joint.axis) / np.linalg.norm(joint.axis)
        if joint.kind == "pin":
            joint.rotation = joint.rotation @ rotation_about(axis, positions[joint.name])
        else:
            joint.position = joint.position + joint.rotation @ axis * positions[joint.name]
        joint.kind, joint.limits, joint.rotor_inertia = "weld", None, None


def _lock(file: XmlFile, joints: dict[str, Joint], joint: Joint, positions: dict[str, float]) -> None:
    """Lock a joint, and those that it follows: a joint that follows a locked joint is locked at the corresponding position."""
    waiting: dict[str, Joint] = {}  # in order: each follows the next
    while joint.mimic and joint.name not in positions:
        element, follows, remedy = joint.mimic.element, joint.mimic.follows, 'load with mimic="free"'
        if follows not in joints:
            text = f"{label(joint.element)} follows {follows!r}, and no joint has this name; correct it, or {remedy}"
            raise file.error(element, text)
        if joint.name in waiting:
            circle = abbreviated([*waiting, joint.name], " → ")
            raise file.error(element, f"joints follow each other in a circle: {circle}; correct them, or {remedy}")
        if joint.kind not in ("pin", "slider"):
            kind = joint.element.get("type")
            raise file.error(element, f"{label(joint.element)} of type {kind!r} has no single coordinate that could follow; {remedy}")
        waiting[joint.name] = joint
        joint = joints[follows]
    position = positions.get(joint.name, 0.0)
    for follower in reversed(waiting.values()):
        assert follower.mimic
        position = positions[follower.name] = follower.mimic.multiplier * position + follower.mimic.offset


def _couple(file: XmlFile, joints: dict[str, Joint], model: Multibody) -> None:
    """Declare q = multiplier · (q of the followed joint) + offset, as loops with the names of the following joints."""
    for joint in joints.values():
        if joint.mimic is None:
            continue
        leader = joints[joint.mimic.follows]
        terms = {joint.name: 1.0}
        if leader.kind in ("pin", "slider"):
            terms[leader.name] = -joint.mimic.multiplier
        elif leader.kind != "weld":  # it stays at zero
            text = f'{label(joint.element)} follows {leader.name!r}, which has no single coordinate; load with mimic="free"'
            raise file.error(joint.mimic.element, text)
        model.add_coupling(terms, constant=-joint.mimic.offset, name=joint.name)


# The tree -------------------------------------------------------------------------------------------------------------


class _Tree:
    """Links and joints that form a tree: `root`, `inboard[link]` the joint that carries a link."""

    def __init__(self, file: XmlFile, links: dict[str, Link], joints: dict[str, Joint]):
        self.file, self.links, self.joints = file, links, joints
        self.inboard: dict[str, Joint] = {}
        self.children: dict[str, list[str]] = {name: [] for name in links}
        for joint in joints.values():
            other = self.inboard.setdefault(joint.child, joint)
            if other is not joint:
                first = f"{other.parent!r} by joint {other.name!r} (line {other.element.sourceline})"
                second = f"{joint.parent!r} by joint {joint.name!r}"
                raise file.error(joint.element, f"link {joint.child!r} has two parents, {first} and {second}; {_CUT}")
            self.children[joint.parent].append(joint.child)
        self.root = self._root()

    def _root(self) -> str:
        roots = [link for link in self.links.values() if link.name not in self.inboard]
        if len(roots) > 1:
            names = abbreviated(f"{link.name!r} (line {link.element.sourceline})" for link in roots)
            text = f"{len(roots)} links have no parent: {names}; join them to one root by fixed joints"
            raise self.file.error(roots[1].element, text)
        reached = set(self.depth_first(roots[0].name)) if roots else set()
        for name in self.links:
            if name not in reached:
                raise self._loop(name)
        return roots[0].name

    def depth_first(self, root: str) -> Iterator[str]:
        """Links from `root` outward, parents first, siblings in the order of their joint elements."""
        stack = [root]  # not recursive: chains are longer than Python's stack
        while stack:
            name = stack.pop()
            yield name
            stack.extend(reversed(self.children[name]))

    def is_free(self) -> bool:
        """Return whether the root link only carries a floating joint called "root"."""
        carried = self.children[self.root]
        if len(carried) != 1 or self.links[self.root].mass or np.any(self.links[self.root].inertia):
            return False
        return self.inboard[carried[0]].kind == "free" and self.inboard[carried[0]].name == "root"

    def _loop(self, name: str) -> Exception:
        """Return the error for a link that no root carries: the inboard path from it ends in a loop, which is named."""
        path: dict[str, None] = {}  # in order
        while name not in path:
            path[name] = None
            name = self.inboard[name].parent
        walked = list(path)
        cycle = [name, *reversed(walked[walked.index(name) :])]
        joints = [self.inboard[link] for link in cycle[1:]]
        names = abbreviated(f"{joint.name!r} (line {joint.element.sourceline})" for joint in joints)
        text = f"the links {abbreviated(cycle, ' → ')} are a loop, by the joints {names}; {_CUT}"
        return self.file.error(joints[0].element, text)

    def with_line(self, body: str, text: str) -> str:
        """Return a warning of the core about a body, with the line of its link."""
        link = self.links.get(body)
        return f"{self.file.at(link.element) if link else self.file.path}: {text}"

    def located(self, text: str, link: str, hinge: str) -> Exception:
        """Return an error of the core about a link or the joint that carries it, with the element that it comes from."""
        owner, at = self.links[link].element, None
        words = {"body": f"body '{link}'", "hinge": f"hinge '{hinge}'"}
        named = min((k for k in words if words[k] in text), key=lambda k: text.find(words[k]), default="body")  # a name may hold the other
        if named == "hinge" and link in self.inboard:
            owner = self.inboard[link].element
            at = next(iter(self.file.children(owner, "pycraft")), None) if "rotor" in text else None
        elif inertial := self.file.children(owner, "inertial"):
            at = self.file.children(inertial[0], "mass" if "its mass" in text else "inertia")[0]
        text = text.replace(words[named], label(owner), 1)  # the file's words for the core's
        return self.file.error(at if at is not None else owner, text)


def _build(tree: _Tree, root: str | None, welds: str, strict: bool) -> Multibody:
    file, joints = tree.file, tree.joints
    root = "fixed" if tree.is_free() else root
    if root == "free" and "root" in joints:
        text = 'has the name of the free hinge that root="free" adds; rename it, or load with root="fixed"'
        raise file.error(joints["root"].element, f"{label(joints['root'].element)} {text}")
    model = Multibody(file.root.get("name") or Path(file.path).stem, welds=welds, strict=strict)
    for name in tree.depth_first(tree.root):
        link, joint = tree.links[name], tree.inboard.get(name)
        hinge = joint.name if joint else "root" if "root" not in joints else f"root of {name}"
        if joint is None:
            kind, parent, axes, rotation, position, limits, rotor = "free" if root == "free" else "weld", "", [], None, None, None, None
        else:
            kind, parent, rotation, position, limits, rotor = (
                joint.kind, joint.parent, joint.rotation, joint.position, joint.limits, joint.rotor_inertia,
            )  # fmt: skip
            axes = [joint.axis] if kind in ("pin", "slider", "planar") else []
        lower, upper = limits or (None, None)
        try:  # the reader of the elements has made the checks of add_body
            model._add_body(
                name, parent, kind, hinge, axes, None, 0.0, None, rotation, position, link.mass, link.com, link.inertia, rotor, lower, upper
            )
        except _core.ModelError as error:
            raise tree.located(str(error), name, hinge) from None
    return model


# Files that a URDF file names -----------------------------------------------------------------------------------------


def resolve_package(uri: str, urdf_path: str | os.PathLike[str], package_dirs: Iterable[str | os.PathLike[str]] = ()) -> Path:
    """Return the file that a mesh or texture name of a URDF file refers to. The loader opens none; viewers do.

    Parameters
    ----------
    uri : str
        "package://name/rest", "model://name/rest", "file:///path", or a path, which is relative to the URDF file's folder.
    urdf_path : path of the URDF file
    package_dirs : folders
        Locations of packages: folders that contain a folder `name` or have this name themselves. Searched first and in order; then the
        folders above the URDF file, from the nearest up, except the root of the file system.

    Raises
    ------
    ModelError
        A file that is not found: names the URI and the folders searched. A package:// name that leads out of its package.
    """
    urdf_path = os.fsdecode(urdf_path)
    above = Path(urdf_path).absolute().parent
    if uri.startswith(("package://", "model://")):
        package, _, rest = uri.partition("://")[2].partition("/")
        inside = PurePosixPath(rest)
        if package in ("", ".", "..") or inside.is_absolute() or ".." in inside.parts:
            raise _core.ModelError(f"{urdf_path}: {uri!r} leads out of a package; write package://name/path within it")
        climbed = [folder for folder in (above, *above.parents) if folder.parent != folder]  # not the root of the file system
        folders = [*(Path(os.fsdecode(folder)).absolute() for folder in package_dirs), *climbed]
        tried = [place for folder in folders for place in (folder / package, *([folder] if folder.name == package else []))]
        found, remedy = [place / inside for place in tried], f"give the folder that holds {package!r} in package_dirs"
    else:
        name = unquote(uri.removeprefix("file://")) if uri.startswith("file://") else uri
        tried, found, remedy = [above], [above / name], "a name without package:// is relative to the URDF file"
    for path in found:
        if _exists(path):
            return path
    places = ", ".join(map(str, tried[:6])) + (", ..." if len(tried) > 6 else "")
    raise _core.ModelError(f"{urdf_path}: {uri!r} is not found in {places}; {remedy}")


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a NUL in it, too long a name
        return False
