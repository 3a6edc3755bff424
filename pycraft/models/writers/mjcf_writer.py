"""Write a model as MJCF, if MJCF has its features; `pycraft.load` reads it back to rounding, MuJoCo like any file.

hinge                                    joints of its body
weld                                     none
pin, slider, ball                        hinge, slide, ball, with the hinge's name
free, on the base                        free
universal, gimbal, cylindrical,
planar, custom of pins and sliders       one a subhinge, called name[0], name[1], ..., read back as a custom hinge of that name

Nodes are sites, rotor inertia is armature. The largest double stands for a side without a limit. Damping, friction, stiffness and rest
positions of springs, from an earlier file, go back into joints, actuators into actuators; loops are equality constraints if MJCF has them
(`equality_elements`); the state is a keyframe called "state". Shapes are geoms (`shape_elements`): visible ones in group 1, without
contacts, collision shapes in group 3. Compensated weights are gravcomp, a fluid is in the options. MuJoCo's compiler is set to keep masses
and inertias; it turns inertias that are not diagonal into principal axes.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ...interop.export import inertia_attribute, mjcf_elements, numbers_text
from ...interop.mujoco import _quaternion, to_mujoco
from ..loaders.left_aside import current, current_actuators
from ..loaders.mjcf import STATE
from ..loaders.xml_file import abbreviated
from ..offers import BoxInFluid, HeldWeight
from ..warning import warn
from .equality_elements import add_equalities
from .shape_elements import MjcfShapes, lost_text
from .toml_writer import same
from .urdf_writer import not_xml

if TYPE_CHECKING:
    from ..multibody import Multibody

LEAST = 1e-15
"""MuJoCo's mjMINVAL: a smaller mass or inertia counts as none."""
ROUNDING = 16 * np.finfo(float).eps
"""Relative to the largest moment: rounding in the triangle inequality of a flat body."""
_JOINT_KEYS = {"damping": "damping", "friction": "frictionloss", "stiffness": "stiffness"}
_NO_LIMIT = sys.float_info.max


def model_text(model: Multibody, path: str, state: bool) -> str:
    """Return the file's text. `path`: its destination, for messages.

    Raises
    ------
    ModelError
        Hinges, limits, inertias and names that MJCF does not have: names them, and the remedy.

    Warns
    -----
    ModelWarning
        Further data of the model that MJCF does not hold.
    """
    from lxml import etree

    described = model.description()
    _refuse(model, described, path)
    root, elements = mjcf_elements(model)
    unsaid = _unsaid(described)
    for body, element in zip(described["bodies"], elements, strict=True):
        _add_limits(body["hinge"], element)
        _add_flat_inertia(body, element)
    for node in described["nodes"]:
        site = etree.SubElement(elements[node["body"]] if node["body"] >= 0 else root.find("worldbody"), "site", name=node["name"])
        site.set("pos", numbers_text(node["position"]))
        if not np.array_equal(node["rotation"], np.eye(3)):
            site.set("quat", numbers_text(_quaternion(node["rotation"])))
    unshown = _add_shapes(model, path, root, described, elements)
    joints = [joint for element in elements for joint in element.findall("joint")]
    unsaid += _add_left_aside(model, root, joints)
    of_coordinate = {model.coordinate_names[v.start]: joint.get("name") for joint, _, v in _places(joints) if v.stop - v.start == 1}
    unsaid += _add_actuators(model, root, of_coordinate)
    unsaid += _add_offers(model, root, described, elements)
    unsaid += add_equalities(model, described, root, elements, of_coordinate)
    if state and not (same(model.q, model.zero_q()) and same(model.v, np.zeros(model.nv))):
        qpos, qvel = to_mujoco(model, model.q, model.v)
        etree.SubElement(etree.SubElement(root, "keyframe"), "key", name=STATE, qpos=numbers_text(qpos), qvel=numbers_text(qvel))
    if unsaid:
        warn(f"{path}: an MJCF file does not hold {', '.join(unsaid)}; a .toml file does")
    if unshown:
        warn(f"{path}: shapes that were not written: {lost_text(unshown)}")
    etree.indent(root)
    return f"<!-- Written by PyCraft. SI units and radians. -->\n{etree.tostring(root, encoding='unicode')}\n"


# Features that MJCF lacks ----------------------------------------------------------------------------------------------


def _refuse(model: Multibody, described: dict[str, Any], path: str) -> None:
    bodies = described["bodies"]
    if lacking := [text for body in bodies if (text := _lacking(body))]:
        kinds = "MJCF has joints of type hinge, slide and ball, several on a body with a ball last, and free ones alone on the base"
        raise _core.ModelError(f"{path}: {abbreviated(lacking, '; ', 4)}. {kinds}; save the model as .toml, which holds every hinge")
    if light := [body["name"] for k, body in enumerate(bodies) if body["hinge"]["subhinges"] and not _heavy(bodies, k)]:
        base = model.moving_base
        remedy = "take the part with base='fixed', or " if base is not None and base.name in light else ""
        text = f"bodies {abbreviated([repr(name) for name in light], ', ', 4)} move and have no mass, or no inertia about some axis"
        given = f"{remedy}give them some (model.bodies[{light[0]!r}].inertia = ...), or save the model as .toml"
        raise _core.ModelError(f"{path}: {text}, which MuJoCo refuses (less than {LEAST:g} kg and kg m²); {given}")
    if unreal := [body["name"] for body in bodies if _excess(body["inertia"]) > ROUNDING]:
        text = f"inertias of {abbreviated([repr(name) for name in unreal], ', ', 4)} violate the triangle inequality"
        raise _core.ModelError(f"{path}: {text}, and MuJoCo refuses them; set inertias that a body can have, or save the model as .toml")
    for name in [described["name"], *(x["name"] for part in ("bodies", "nodes", "loops") for x in described.get(part, [])), *model.hinges]:
        if bad := not_xml(name):
            raise _core.ModelError(f"{path}: the name {name!r} {bad}; rename it, or save the model as .toml, which holds every name")
    if "world" in model.bodies:
        raise _core.ModelError(f"{path}: a body is called 'world', which in MJCF is the base; rename it, or save the model as .toml")


def _lacking(body: dict[str, Any]) -> str:
    """Return the feature of a body's hinge that MJCF lacks; empty if it has all."""
    hinge, kinds = body["hinge"], [s["kind"] for s in body["hinge"]["subhinges"]]
    name, sizes = f"hinge {hinge['name']!r}", [_core.subhinge_kinds[kind].nv for kind in kinds]
    if "screw" in kinds:
        return f"{name} is a screw" if len(kinds) == 1 else f"{name} has a screw"
    if "free" in kinds and (len(kinds) > 1 or body["parent"] >= 0):
        return f"{name} is free and not alone on the base"
    if "ball" in kinds and {"pin", "ball"} & set(kinds[kinds.index("ball") + 1 :]):
        return f"{name} turns after its ball"
    for first, size in zip(np.cumsum([0, *sizes]), sizes, strict=False):
        if len(set(hinge["rotor_inertia"][first : first + size])) > 1:
            return f"{name} has different rotor inertias in one {kinds[-1]}"
    return ""


def _heavy(bodies: list[dict[str, Any]], k: int) -> bool:
    """Return whether MuJoCo accepts body k as one that may move: it, or a body welded to it, has mass and inertia about all axes."""
    if bodies[k]["mass"] >= LEAST and np.linalg.eigvalsh(bodies[k]["inertia"])[0] >= LEAST:
        return True
    welded = (i for i, body in enumerate(bodies) if body["parent"] == k and not body["hinge"]["subhinges"])
    return any(_heavy(bodies, i) for i in welded)


def _excess(inertia: np.ndarray) -> float:
    """Return the excess of the largest principal moment over the sum of the others, relative to it: negative except for flat and impossible
    bodies."""
    a, b, c = np.linalg.eigvalsh(inertia)
    return (c - a - b) / c if c else -1.0


def _add_flat_inertia(body: dict[str, Any], element: Any) -> None:
    """Write the moments of a flat body plus rounding: MuJoCo refuses a violation of the triangle inequality, even by rounding."""
    inertia = body["inertia"]
    if abs(_excess(inertia)) <= ROUNDING:
        element.find("inertial").set(*inertia_attribute(inertia + 2 * ROUNDING * np.trace(inertia) * np.eye(3)))


def _unsaid(described: dict[str, Any]) -> list[str]:
    said = []
    for body in described["bodies"]:
        hinge, placement = body["hinge"], body["hinge"]["placement"]
        moved = placement["position"].any() or not np.array_equal(placement["rotation"], np.eye(3))
        if hinge["kind"] == "free" and moved:
            said.append(f"the placement of free hinge {hinge['name']!r} (its coordinates there are the body's pose in the world)")
        if len(hinge["lower"]) and np.any(hinge["lower"] == hinge["upper"]):
            said.append(f"limits of hinge {hinge['name']!r} that are equal")
        if not hinge["subhinges"] and hinge["name"] != body["name"]:
            said.append(f"the name of weld {hinge['name']!r} (there it has its body's)")
    return said


def _add_shapes(model: Multibody, path: str, root: Any, described: dict[str, Any], elements: list[Any]) -> list[str]:
    """Write shapes as geoms without mass; return those that MuJoCo does not read."""
    made = MjcfShapes(root, path)
    owners = {body["name"]: (element, np.eye(4)) for body, element in zip(described["bodies"], elements, strict=True)}
    owners[""] = root.find("worldbody"), np.eye(4)
    for node in described["nodes"]:
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = node["rotation"], node["position"]
        owners[node["name"]] = (elements[node["body"]] if node["body"] >= 0 else root.find("worldbody")), X
    for shape in model._shapes:
        if shape.body in owners:
            element, X = owners[shape.body]
            made.add(shape, element, X @ shape.placement)
    return made.lost


# Features that it has ----------------------------------------------------------------------------------------------------------


def _add_limits(hinge: dict[str, Any], element: Any) -> None:
    if not len(hinge["lower"]):
        return
    for joint, subhinge, *sides in zip(element.findall("joint"), hinge["subhinges"], hinge["lower"], hinge["upper"], strict=True):
        if _core.subhinge_kinds[subhinge["kind"]].nq == 1 and np.isfinite(sides).any() and sides[0] < sides[1]:
            joint.set("limited", "true")
            joint.set("range", numbers_text(np.clip(sides, -_NO_LIMIT, _NO_LIMIT)))


def _add_left_aside(model: Multibody, root: Any, joints: list[Any]) -> list[str]:
    """Write data beside the model from an earlier file into joints; report the rest."""
    unsaid = []
    for quantity, values in current(model).items():
        if quantity == "gravity":
            if model.gravity.any():
                unsaid.append("the gravity in left_aside")
            else:
                root.find("option").set("gravity", numbers_text(values))
        elif quantity == "spring rest":
            for joint, q, _ in _places(joints):
                if q.stop - q.start == 1 and values[q.start]:
                    joint.set("springref", numbers_text(values[q]))
                elif q.stop - q.start > 1 and not same(values[q], model.zero_q()[q]):
                    unsaid.append(f"where the spring of joint {joint.get('name')!r} is slack")
        elif quantity in _JOINT_KEYS:
            for joint, _, v in _places(joints):
                own = values[v]
                if len(set(own[~np.isnan(own)])) > 1 or np.isnan(own).any() and not np.isnan(own).all():
                    unsaid.append(f"{quantity} of joint {joint.get('name')!r}, which differs among its coordinates")
                elif not np.isnan(own).any() and len(own):
                    joint.set(_JOINT_KEYS[quantity], numbers_text(own[:1]))
        else:
            unsaid.append(f"the {quantity} in left_aside")
    return unsaid


def _add_offers(model: Multibody, root: Any, described: dict[str, Any], elements: list[Any]) -> list[str]:
    """Add compensated weights at the centre of mass, and the fluid of the boxes of all bodies; return the names of the others."""
    unsaid, bodies = [], {body["name"]: (body, element) for body, element in zip(described["bodies"], elements, strict=True)}
    boxes = [offer for offer in model.offers if isinstance(offer, BoxInFluid)]
    for offer in model.offers:
        if not isinstance(offer, HeldWeight):
            continue
        body, element = bodies.get(offer.body, (None, None))
        if body is None or element is None or not np.allclose(offer.point, body["com"], rtol=0, atol=1e-12) or element.get("gravcomp"):
            unsaid.append(f"the weight that is held on {offer.body!r}")
        else:
            element.set("gravcomp", numbers_text(offer.mass / body["mass"]))
    if boxes:
        massive = [name for name, (body, _) in bodies.items() if body["mass"] >= LEAST]
        if {box.fluid for box in boxes} == {boxes[0].fluid} and sorted(box.body for box in boxes) == sorted(massive):
            for key, value in zip(("density", "viscosity", "wind"), boxes[0].fluid, strict=True):
                root.find("option").set(key, numbers_text(value))
        else:
            unsaid.append("the fluid, whose boxes are not one for each body")
    return unsaid


def _places(joints: list[Any]) -> list[tuple[Any, slice, slice]]:
    """Return every joint with its places in q and v."""
    places, q, v = [], 0, 0
    for joint in joints:
        nq, nv = {"ball": (4, 3), "free": (7, 6)}.get(joint.get("type"), (1, 1))
        places.append((joint, slice(q, q + nq), slice(v, v + nv)))
        q, v = q + nq, v + nv
    return places


def _add_actuators(model: Multibody, root: Any, of_coordinate: dict[str, str]) -> list[str]:
    """Add actuators on joints of one coordinate with an affine force; return the names of the others."""
    from lxml import etree

    section, unsaid = etree.Element("actuator"), []
    for actuator in current_actuators(model):
        if actuator["why not"] is not None or actuator["coordinate"] not in of_coordinate:
            unsaid.append(f"actuator {actuator['name']!r}")
            continue
        element = etree.SubElement(section, "general", name=actuator["name"], joint=of_coordinate[actuator["coordinate"]])
        element.set("gear", numbers_text(actuator["gear"]))
        element.set("gainprm", numbers_text(actuator["gain"]))
        if np.any(actuator["bias"]):
            element.set("biastype", "affine")
            element.set("biasprm", numbers_text(actuator["bias"]))
        if np.isfinite(actuator["force range"]).any():
            element.set("forcelimited", "true")
            element.set("forcerange", numbers_text(np.clip(actuator["force range"], -_NO_LIMIT, _NO_LIMIT)))
    if len(section):
        root.append(section)
    return unsaid
