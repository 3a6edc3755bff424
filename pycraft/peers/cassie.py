"""Cassie of example-robot-data as it is published: an SDF file, whose links hang together in loops by pins and balls.

A link's pose is in the model's frame, a joint's in its child's; the first joint that reaches a link is its hinge, every later one a loop.
Source: Agility Robotics, cassie_v2.sdf; SDF 1.6 (http://sdformat.org/spec).
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..models.loaders.rotations import rotation_from_rpy
from ..models.multibody import Multibody
from .peers import robot_files

_HINGES = {"revolute": "pin", "ball": "ball"}


def cassie_file() -> Path:
    """Where the installed example-robot-data has it. ModelError where it has none."""
    robots = next((folder for file in robot_files() for folder in file.parents if folder.name == "robots"), None)
    path = Path() if robots is None else robots / "cassie_description" / "robots" / "cassie_v2.sdf"
    if not path.is_file():
        raise _core.ModelError("the installed example-robot-data has no Cassie")
    return path


def cassie(path: Path | None = None, root: str = "pelvis") -> Multibody:
    """The model, at the pose that the file has it in; "free" at its root. ModelError names a joint of another type, or out of reach."""
    file = _found(ET.parse(cassie_file() if path is None else path).getroot(), "model")
    links = {link.attrib["name"]: link for link in file.findall("link")}
    where = {name: _pose(link) for name, link in links.items()}
    model = Multibody("cassie")
    model.add_body(root, hinge="free", hinge_name="root", **_inertial(links[root]))
    waiting = list(file.findall("joint"))
    while waiting:
        joint = next((j for j in waiting if _text(j, "parent") in model.bodies), waiting[0])
        if _text(joint, "parent") not in model.bodies or joint.attrib["type"] not in _HINGES:
            name, kind = joint.attrib["name"], joint.attrib["type"]
            raise _core.ModelError(f"joint {name!r} of type {kind!r}: joints are revolute or ball, and {root!r} reaches them")
        waiting.remove(joint)
        parent, child, kind, name = _text(joint, "parent"), _text(joint, "child"), joint.attrib["type"], joint.attrib["name"]
        X, at = np.linalg.inv(where[parent]) @ where[child], _pose(joint)
        how: dict[str, Any] = {
            "hinge": _HINGES[kind],
            "point": at[:3, 3],
            "rotation": X[:3, :3],
            "position": X[:3, 3],
        }
        if kind == "revolute":
            how["axis"] = at[:3, :3] @ np.array(_text(joint, "axis/xyz").split(), float)
        if child in model.bodies:
            model.add_loop(child, parent, name=name, **how)
        else:
            model.add_body(child, parent, hinge_name=name, **how, **_inertial(links[child]))
    q = np.array(model.q)
    q[:7] = [1, 0, 0, 0, *where[root][:3, 3]]
    model.q = q
    return model


def _found(element: ET.Element, path: str) -> ET.Element:
    found = element.find(path)
    if found is None:
        raise _core.ModelError(f"Cassie's file: <{element.tag}> has no {path}")
    return found


def _text(element: ET.Element, path: str) -> str:
    return _found(element, path).text or ""


def _pose(element: ET.Element) -> np.ndarray:
    """(4, 4) of an element's <pose>: xyz and roll, pitch, yaw."""
    X = np.eye(4)
    if element.find("pose") is not None:
        x = np.array(_text(element, "pose").split(), float)
        X[:3, :3], X[:3, 3] = rotation_from_rpy(*x[3:]), x[:3]
    return X


def _inertial(link: ET.Element) -> dict[str, Any]:
    part = _found(link, "inertial")
    X, I = _pose(part), {entry.tag: float(entry.text or "") for entry in _found(part, "inertia")}
    about = np.array([[I["ixx"], I["ixy"], I["ixz"]], [I["ixy"], I["iyy"], I["iyz"]], [I["ixz"], I["iyz"], I["izz"]]])
    return {"mass": float(_text(part, "mass")), "com": X[:3, 3], "inertia": X[:3, :3] @ about @ X[:3, :3].T}
