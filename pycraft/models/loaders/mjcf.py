"""Read MJCF files into a `Multibody` through the mujoco package (extra `mjcf`), whose compiler resolves frames and inertias.

joint type        hinge     coordinates
hinge             pin       angle about the axis through the joint's pos
slide             slider    travel along the axis
ball              ball      quaternion (w, x, y, z)
free              free      quaternion, position of the body in the world, which is MuJoCo's qpos in another order
several           custom    those of its joints, in their order
none              weld      none

Names. Bodies have the file's names ("body3", by MuJoCo's number, without one). A hinge has its joint's name, or its body's name if the
joint has none or there are several (the first joint's if some joint has the body's name). Joints called name[0], name[1], ... form the
hinge "name". A site with a name is a node, with "_site" added if a body has its name already.

Coordinates are MuJoCo's values: a joint's `ref` goes into the placement of its hinge, and the model's state is MuJoCo's qpos0, or the
keyframe called "state" if there is one. A limit at the largest double means no limit. `pycraft.interop.mujoco` has the order and the
velocities of free hinges. `armature` is the rotor inertia.

Elements that become effects, and elements that are not read: see `mjcf_effects`. Equality constraints connect, weld and joint are in
`Multibody.loops`, with a warning, as dynamics of the tree does not keep them.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from ... import _core
from ...interop import mujoco as conventions
from ..multibody import Multibody
from .mjcf_actuators import read_actuators
from .mjcf_effects import armature, by_coordinate, not_read, offers
from .mjcf_equalities import add_equalities
from .mjcf_missing import without_missing_files
from .mjcf_shapes import shapes_of
from .rotations import rotation_about, rotation_from_quaternion, turned_inertia
from .xml_file import XmlFile, abbreviated

STATE = "state"
"""The keyframe that is the model's state."""

_FREE, _BALL, _SLIDE, _HINGE = range(4)  # mjtJoint
_KINDS = {_FREE: "free", _BALL: "ball", _SLIDE: "slider", _HINGE: "pin"}
_V_SIZE = {_FREE: 6, _BALL: 3, _SLIDE: 1, _HINGE: 1}


def read(file: XmlFile, *, root: str, welds: str, strict: bool) -> tuple[Multibody, list[str]]:
    """Return the model of an MJCF file, and its warnings. Parameters as in `pycraft.load`.

    Raises
    ------
    MissingPackageError
        The mujoco package is not installed: names the extra.
    ModelError
        Anything that MuJoCo refuses, in its words; root="free", which an MJCF file specifies by a freejoint.
    """
    if root == "free":
        raise file.error(file.root, 'root="free" is for URDF files; in an MJCF file give the body a <freejoint name="root"/>')
    missing: list[str] = []
    try:
        compiled = conventions.compiled(file.path, lambda spec: missing.extend(without_missing_files(spec, file.path)))
        model, words = _Reader(compiled, file.root.get("model") or Path(file.path).stem, file.path).model(welds, strict)
        return model, [*words, *([f"{file.path}: files that are not there, and left out: {abbreviated(missing)}"] if missing else [])]
    except UnicodeDecodeError as error:  # MuJoCo passes names as bytes
        text = f"a name is not in UTF-8 ({error.reason}), which is how MuJoCo reads files whatever they declare; convert the file"
        raise file.error(file.root, text) from None


def of_compiled(compiled: Any, name: str) -> Multibody:
    """Return the model of an MjModel, without warnings."""
    return _Reader(compiled, name, name).model("lump", False)[0]


class _Reader:
    """One compiled model on its way to a `Multibody`."""

    def __init__(self, compiled: Any, name: str, path: str):
        self.m, self.name, self.path, self.armature = compiled, name, path, armature(compiled)
        self.joint_names = {name for j in range(compiled.njnt) if (name := compiled.joint(j).name)}
        self.bodies = self._body_names()
        self.warnings: list[str] = []

    def _body_names(self) -> list[str]:
        named = {self.m.body(b).name for b in range(self.m.nbody)}
        return [self.m.body(b).name or _unused(f"body{b}", named) for b in range(self.m.nbody)]

    def model(self, welds: str, strict: bool) -> tuple[Multibody, list[str]]:
        m, model = self.m, Multibody(self.name, welds=welds, strict=strict)
        hinges = set(self.joint_names)
        try:
            for b in range(1, m.nbody):
                options = self._hinge(b)
                name = self._hinge_name(b, hinges)
                hinges.add(name)
                parent = int(m.body_parentid[b])
                model.add_body(
                    self.bodies[b],
                    self.bodies[parent] if parent else None,
                    hinge_name=name,
                    mass=m.body_mass[b],
                    com=m.body_ipos[b],
                    inertia=turned_inertia(rotation_from_quaternion(m.body_iquat[b]), np.diag(m.body_inertia[b])),
                    **options,
                )
            self._add_sites(model)
        except _core.ModelError as error:
            raise _core.ModelError(f"{self.path}: {error}") from None
        model.q, model.v = self._state(model)
        model._not_read = [*self._equalities(model), *not_read(m, self.bodies)]
        model._left_aside = by_coordinate(m, model)
        model._actuators = read_actuators(m, model)
        model._offers = offers(m, self.bodies)
        model._shapes = shapes_of(m, self.bodies)
        return model, self.warnings + [f"{self.path}: {text}" for _, text in model.take_warnings()]

    def _state(self, model: Multibody) -> tuple[np.ndarray, np.ndarray]:
        """Return the keyframe "state", which `Multibody.save` writes; else qpos0, at rest."""
        for k in range(self.m.nkey):
            if self.m.key(k).name == STATE:
                return conventions.from_mujoco(model, self.m.key_qpos[k], self.m.key_qvel[k])
        return conventions.from_mujoco(model, self.m.qpos0, np.zeros(self.m.nv))

    def _add_sites(self, model: Multibody) -> None:
        m, frames = self.m, set(self.bodies[1:])
        renamed = []
        for s in range(m.nsite):
            if not (own := m.site(s).name):
                continue  # nothing could refer to it
            name = _unused(own, frames, "_site")
            renamed += [f"{own!r} is {name!r}"] if name != own else []
            frames.add(name)
            on, rotation = int(m.site_bodyid[s]), rotation_from_quaternion(m.site_quat[s])
            model.add_node(name, self.bodies[on] if on else None, position=m.site_pos[s], rotation=rotation)
        if renamed:
            self.warnings.append(f"{self.path}: sites with the names of bodies are nodes with other names: {abbreviated(renamed)}")

    # ------------------------------------------------------------------ hinges
    def _joints(self, b: int) -> range:
        first = int(self.m.body_jntadr[b])
        return range(first, first + int(self.m.body_jntnum[b]))

    def _hinge_name(self, b: int, taken: set[str]) -> str:
        joints = self._joints(b)
        if len(joints) == 1 and self.m.joint(joints[0]).name:
            return self.m.joint(joints[0]).name
        if len(joints) > 1 and (common := self._common_name(joints)) and common not in taken:
            return common
        body, first = self.bodies[b], self.m.joint(joints[0]).name if joints else ""
        return body if body not in taken else first or _unused(f"{body}_joint", taken)

    def _common_name(self, joints: range) -> str:
        """Return the name of joints that are called name[0], name[1], ..., as `Multibody.save` writes those of one hinge; else empty."""
        names = [self.m.joint(j).name for j in joints]
        common = names[0].removesuffix("[0]")
        return common if names == [f"{common}[{i}]" for i in range(len(names))] else ""

    def _hinge(self, b: int) -> dict[str, Any]:
        """Return the arguments of `Multibody.add_body` for the body's hinge."""
        m, joints = self.m, self._joints(b)
        placement = np.eye(4)
        placement[:3, :3], placement[:3, 3] = rotation_from_quaternion(m.body_quat[b]), m.body_pos[b]
        if not joints:
            return dict(hinge="weld", placement=placement)
        kinds = [int(m.jnt_type[j]) for j in joints]
        dofs = range(int(m.jnt_dofadr[joints[0]]), int(m.jnt_dofadr[joints[0]]) + sum(_V_SIZE[kind] for kind in kinds))
        options: dict[str, Any] = dict(hinge=_KINDS[kinds[0]] if len(kinds) == 1 else "custom")
        options["rotor_inertia"] = self.armature[dofs]
        if kinds == [_FREE]:  # its coordinates are the body's pose in the world: the body's pos and quat are in qpos0 only
            options["rotor_inertia"] = np.roll(self.armature[dofs], 3)  # of turns, then of travels
            if any(np.ptp(triple) for triple in (self.armature[dofs][:3], self.armature[dofs][3:])):
                self.warnings.append(
                    f"{self.path}: the free joint of body {self.bodies[b]!r} has armatures that differ among turns or among travels; "
                    "here they act along the body's axes, and with v ×* (Jv), in MuJoCo travels' along the world's, and without"
                )
            return options
        firsts = [int(m.jnt_dofadr[j]) for j, kind in zip(joints, kinds, strict=True) if kind == _BALL]
        if any(np.ptp(self.armature[first : first + 3]) for first in firsts):
            self.warnings.append(
                f"{self.path}: the ball joint of body {self.bodies[b]!r} has armatures that differ; "
                "ω × Jω of them is in the equations of motion here, and in MuJoCo's it is not"
            )
        placement, subhinges = self._absorb_references(placement, joints)
        options["placement"] = placement
        if len(kinds) == 1:
            options["point"] = subhinges[0]["point"]
            if kinds[0] != _BALL:
                options["axis"] = subhinges[0]["axis"]
        else:
            options["subhinges"] = subhinges
        limited = [bool(m.jnt_limited[j]) and kind != _BALL for j, kind in zip(joints, kinds, strict=True)]
        if any(limited):
            pairs = [m.jnt_range[j] if has else (-np.inf, np.inf) for j, has in zip(joints, limited, strict=True)]
            options["limits"] = tuple(np.where(np.abs(pairs) < sys.float_info.max, pairs, np.sign(pairs) * np.inf).T)
        return options

    def _absorb_references(self, placement: np.ndarray, joints: range) -> tuple[np.ndarray, list[dict[str, Any]]]:
        """Return subhinges with MuJoCo's joint angles, and the placement with the remainder of their `ref`.

        A joint's step is s(q − ref) = s(−ref) s(q). The constant steps are moved to the left, s(q) C = C (C⁻¹ s(q) C), into the placement:
        a step that is passed gets its axis and point from C⁻¹. A ball joint keeps its quaternion: MuJoCo allows no rotation after it, so
        that C is a translation there.
        """
        C = np.eye(4)
        subhinges: list[dict[str, Any]] = []
        for j in reversed(joints):
            kind, axis, point = int(self.m.jnt_type[j]), np.array(self.m.jnt_axis[j]), np.array(self.m.jnt_pos[j])
            moved = not np.array_equal(C, np.eye(4))
            inverse = _pose(C[:3, :3].T, -C[:3, :3].T @ C[:3, 3])
            passed = dict(axis=inverse[:3, :3] @ axis, point=inverse[:3, :3] @ point + inverse[:3, 3])
            subhinges.insert(0, dict(kind=_KINDS[kind]) | (passed if moved else dict(axis=axis, point=point)))
            reference = 0.0 if kind == _BALL else float(self.m.qpos0[self.m.jnt_qposadr[j]])
            if reference and kind == _HINGE:
                R = rotation_about(axis, -reference)
                C = _pose(R, point - R @ point) @ C
            elif reference:
                C = _pose(np.eye(3), -reference * axis) @ C
        return placement @ C if not np.array_equal(C, np.eye(4)) else placement, subhinges

    # ------------------------------------------------------------------ constraints that direct calls do not keep
    def _equalities(self, model: Multibody) -> list[str]:
        """Declare equality constraints as loops, and return those that cannot be."""
        left_out, inactive = add_equalities(self.m, model, self.bodies)
        if len(model.loops):
            names = ", ".join(map(repr, model.loops))
            self.warnings.append(
                f"{self.path}: equality constraints are loops of the model, which direct calls and scenes do not keep: {names}"
            )
        if inactive:
            self.warnings.append(f"{self.path}: not active in the file, and left out: {', '.join(inactive)}")
        return left_out


def _pose(rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = rotation, position
    return X


def _unused(name: str, taken: set[str], suffix: str = "_") -> str:
    while name in taken:
        name += suffix
    return name
