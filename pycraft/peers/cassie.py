"""Cassie of example-robot-data as it is published: an SDF file, whose links hang together in loops by pins and balls.

A link's pose is in the model's frame, a joint's in its child's; the first joint that reaches a link is its hinge, every later one a loop.
Source: Agility Robotics, cassie_v2.sdf; SDF 1.6 (http://sdformat.org/spec).
"""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

import pycraft as pc
from pycraft.models.loaders.rotations import rotation_from_rpy


def pose(element):
    """(4, 4) of an element's <pose>: xyz and roll, pitch, yaw."""
    X = np.eye(4)
    found = element.find("pose")
    if found is not None:
        x = np.array(found.text.split(), float)
        X[:3, :3], X[:3, 3] = rotation_from_rpy(*x[3:]), x[:3]
    return X


def inertial(link):
    part = link.find("inertial")
    X, I = pose(part), {entry.tag: float(entry.text) for entry in part.find("inertia")}
    about = np.array([[I["ixx"], I["ixy"], I["ixz"]], [I["ixy"], I["iyy"], I["iyz"]], [I["ixz"], I["iyz"], I["izz"]]])
    return {"mass": float(part.find("mass").text), "com": X[:3, 3], "inertia": X[:3, :3] @ about @ X[:3, :3].T}


def cassie(path: Path, root="pelvis"):
    """The model, at the pose that the file has it in; "free" at its root."""
    file = ET.parse(path).getroot().find("model")
    links = {link.get("name"): link for link in file.findall("link")}
    where = {name: pose(link) for name, link in links.items()}
    model = pc.Multibody("cassie")
    model.add_body(root, hinge="free", hinge_name="root", **inertial(links[root]))
    waiting = list(file.findall("joint"))
    while waiting:
        joint = next(j for j in waiting if j.find("parent").text in model.bodies)
        waiting.remove(joint)
        parent, child, kind = joint.find("parent").text, joint.find("child").text, joint.get("type")
        X, at = np.linalg.inv(where[parent]) @ where[child], pose(joint)
        how = {"hinge": {"revolute": "pin", "ball": "ball"}[kind], "point": at[:3, 3], "rotation": X[:3, :3], "position": X[:3, 3]}
        if kind == "revolute":
            axis = joint.find("axis/xyz")
            how["axis"] = at[:3, :3] @ np.array(axis.text.split(), float)
        if child in model.bodies:
            model.add_loop(child, parent, name=joint.get("name"), **how)
        else:
            model.add_body(child, parent, hinge_name=joint.get("name"), **how, **inertial(links[child]))
    q = np.array(model.q)
    X = where[root]
    q[:7] = [1, 0, 0, 0, *X[:3, 3]]
    model.q = q
    return model
