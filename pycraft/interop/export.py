"""Convert a model to other packages, body by body, and run their forward dynamics on our coordinates.

Features that a package lacks raise `PeerRefusal` with its text. No package is imported before a function here is called. Values are passed
unchanged: Pinocchio and Drake take them as they are; MuJoCo reads MJCF text with 17 digits, with its compiler set to keep masses and
inertias (it turns every inertia that is not diagonal into principal axes, though).

A multi-coordinate hinge becomes Pinocchio's composite joint, or several MuJoCo joints on one body, of the same subhinges in the same order
about the same points, so that coordinates have the same values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from . import mujoco as convention
from .described import Described, described
from .drake import drake_peer
from .packages import required
from .peer import Peer, PeerRefusal, Vector

_PINOCCHIO_BYTES = 64
"""Pinocchio's workspace per coordinate cubed, measured: it holds tensors for second derivatives."""


def _bodies(model: Described) -> list[dict[str, Any]]:
    return model.description()["bodies"]


# Pinocchio ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PinocchioModel:
    """Pinocchio's model with its order of coordinates: `q[..., of_q]` and `v[..., of_v]` are Pinocchio's, with unit quaternions.

    `bodies`: for each the joint that carries it, and the body's frame in the joint's.
    """

    model: Any
    of_q: np.ndarray
    of_v: np.ndarray
    quaternions: tuple[int, ...]
    bodies: tuple[tuple[int, Any], ...]

    @property
    def tip(self) -> tuple[int, Any]:
        """Return the joint and the place of the last body, or of the base."""
        import pinocchio as pin

        return self.bodies[-1] if self.bodies else (0, pin.SE3.Identity())

    def q(self, q: Vector) -> Vector:
        """Return Pinocchio's configuration (nq,) from ours."""
        out = np.asarray(q, float)[self.of_q]
        for at in self.quaternions:
            out[at : at + 4] /= np.linalg.norm(out[at : at + 4])
        return out


def to_pinocchio(model: Described) -> PinocchioModel:
    """Return the model as a `pinocchio.Model` built joint by joint, with rotor inertias as armature and the same gravity.

    For rotors that differ on a ball, or act on a free hinge's travels, Pinocchio omits v ×* (J v) (docs/conventions.md).

    Raises PeerRefusal for anything that Pinocchio refuses. All hinge kinds are supported.
    """
    pin, _ = required("pinocchio", "peers", "a hand-over to Pinocchio needs"), described(model, "to_pinocchio")

    out = pin.Model()
    joints: list[int] = []
    placements: list[Any] = []  # of our body frame in Pinocchio's joint frame
    of_q: list[int] = []
    of_v: list[int] = []
    quaternions, armature = [], []
    at_q = at_v = 0
    for body in _bodies(model):
        hinge, parent = body["hinge"], body["parent"]
        inboard = pin.SE3(np.asarray(hinge["placement"]["rotation"], float), np.asarray(hinge["placement"]["position"], float))
        if parent >= 0:
            inboard = placements[parent] * inboard
        joint = joints[parent] if parent >= 0 else 0
        point = np.zeros(3)
        parts = []
        for subhinge in hinge["subhinges"]:
            moved = np.zeros(3)
            if subhinge["kind"] not in ("slider", "free"):
                moved = np.asarray(subhinge["point"], float) - point
                point = point + moved
            parts.append((_pinocchio_joint(subhinge), pin.SE3(np.eye(3), moved)))
            kind = _core.subhinge_kinds[subhinge["kind"]]
            own_q, own_v = np.arange(at_q, at_q + kind.nq), np.arange(at_v, at_v + kind.nv)
            if subhinge["kind"] == "ball":
                quaternions.append(at_q)
                own_q = own_q[[1, 2, 3, 0]]
            elif subhinge["kind"] == "free":
                quaternions.append(at_q + 3)
                own_q, own_v = own_q[[4, 5, 6, 1, 2, 3, 0]], own_v[[3, 4, 5, 0, 1, 2]]
            of_q.extend(own_q)
            of_v.extend(own_v)
            at_q, at_v = at_q + kind.nq, at_v + kind.nv
        outboard = pin.SE3(np.eye(3), -point)
        if not parts:
            outboard = inboard
        elif len(parts) == 1:
            joint = out.addJoint(joint, parts[0][0], inboard * parts[0][1], hinge["name"])
        else:
            composite = pin.JointModelComposite()
            for part, placement in parts:
                composite.addJoint(part, placement)
            joint = out.addJoint(joint, composite, inboard, hinge["name"])
        inertia = pin.Inertia(float(body["mass"]), np.asarray(body["com"], float), np.asarray(body["inertia"], float))
        out.appendBodyToJoint(joint, inertia, outboard)
        joints.append(joint)
        placements.append(outboard)
        armature.extend(hinge["rotor_inertia"])
    out.armature = np.array(armature, float)[of_v]
    out.gravity.linear = np.array(model.gravity, float)
    bodies = tuple(zip(joints, placements, strict=True))
    return PinocchioModel(out, np.array(of_q, int), np.array(of_v, int), tuple(quaternions), bodies)


def _pinocchio_joint(subhinge: dict[str, Any]) -> Any:
    import pinocchio as pin

    axis = np.asarray(subhinge["axis"], float)
    along = next((i for i in range(3) if np.array_equal(axis, np.eye(3)[i])), None)  # joints about coordinate axes are its fastest
    match subhinge["kind"]:
        case "pin":
            aligned = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)
            return pin.JointModelRevoluteUnaligned(axis) if along is None else aligned[along]()
        case "slider":
            aligned = (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ)
            return pin.JointModelPrismaticUnaligned(axis) if along is None else aligned[along]()
        case "screw":
            return pin.JointModelHelicalUnaligned(axis, float(subhinge["pitch"]))
        case "ball":
            return pin.JointModelSpherical()
        case _:
            return pin.JointModelFreeFlyer()


def refuse_large(nv: int) -> None:
    """Raise PeerRefusal if Pinocchio's workspace for that many coordinates exceeds 2 GB."""
    if _PINOCCHIO_BYTES * nv**3 > 2**31:
        size = _PINOCCHIO_BYTES * nv**3 / 2**30
        raise PeerRefusal(f"its work space of {nv} coordinates takes {size:.0f} GB (third-order tensors for derivatives)")


def pinocchio_peer(model: Described) -> Peer:
    """Return Pinocchio's articulated-body algorithm (`aba`) on the model. Raises PeerRefusal if its workspace exceeds 2 GB."""
    pin, _ = required("pinocchio", "peers", "a hand-over to Pinocchio needs"), described(model, "pinocchio_peer")

    refuse_large(model.nv)
    twin = to_pinocchio(model)
    data = twin.model.createData()

    def forward_dynamics(q: Vector, v: Vector, tau: Vector) -> Vector:
        out = np.empty(model.nv)
        out[twin.of_v] = pin.aba(twin.model, data, twin.q(q), np.asarray(v, float)[twin.of_v], np.asarray(tau, float)[twin.of_v])
        return out

    return Peer(f"Pinocchio {pin.__version__}", forward_dynamics)


# MuJoCo ---------------------------------------------------------------------------------------------------------------

_COMPILER = dict(
    angle="radian", autolimits="false", boundmass="0", boundinertia="0", balanceinertia="false", inertiafromgeom="false",
    settotalmass="-1", fusestatic="false",
)  # fmt: skip
_JOINTS = {"pin": "hinge", "slider": "slide", "ball": "ball"}


def to_mjcf(model: Described) -> str:
    """Return the model as MJCF text for comparisons: `mjcf_elements`, contacts and constraints off. `Multibody.save` writes files."""
    from lxml import etree

    root, _ = mjcf_elements(model)
    etree.SubElement(root.find("option"), "flag", constraint="disable", contact="disable")
    return etree.tostring(root, encoding="unicode")


def mjcf_elements(model: Described) -> tuple[Any, list[Any]]:
    """Return the model's `<mujoco>` element, with the elements of its bodies, in order: joints, inertias with 17 digits, no geometry.

    Raises PeerRefusal for a screw, for a free hinge that is not alone on the base, and for different rotor inertias within a ball or free
    hinge: MuJoCo supports none of them.
    """
    from lxml import etree

    root = etree.Element("mujoco", model=described(model, "MJCF").name)
    etree.SubElement(root, "compiler", _COMPILER)
    etree.SubElement(root, "option", gravity=numbers_text(model.gravity))
    elements: list[Any] = []
    world = etree.SubElement(root, "worldbody")
    for body in _bodies(model):
        hinge, parent = body["hinge"], body["parent"]
        rotation = np.asarray(hinge["placement"]["rotation"], float)
        element = etree.SubElement(
            elements[parent] if parent >= 0 else world, "body", name=body["name"], pos=numbers_text(hinge["placement"]["position"])
        )
        if not np.array_equal(rotation, np.eye(3)):
            element.set("quat", numbers_text(convention._quaternion(rotation)))
        inertial = etree.SubElement(element, "inertial", pos=numbers_text(body["com"]), mass=numbers_text(body["mass"]))
        inertial.set(*inertia_attribute(np.asarray(body["inertia"], float)))
        at = 0
        for i, subhinge in enumerate(hinge["subhinges"]):
            size = _core.subhinge_kinds[subhinge["kind"]].nv
            _mujoco_joint(element, hinge, i, subhinge, np.asarray(hinge["rotor_inertia"], float)[at : at + size], parent)
            at += size
        elements.append(element)
    return root, elements


def inertia_attribute(inertia: np.ndarray) -> tuple[str, str]:
    """Return the attribute of `<inertial>` for an inertia (3, 3), and its text."""
    if np.count_nonzero(inertia - np.diag(np.diag(inertia))):
        return "fullinertia", numbers_text(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    return "diaginertia", numbers_text(np.diag(inertia))


def _mujoco_joint(element: Any, hinge: dict, i: int, subhinge: dict, rotor: np.ndarray, parent: int) -> None:
    from lxml import etree

    name = hinge["name"] if len(hinge["subhinges"]) == 1 else f"{hinge['name']}[{i}]"
    if subhinge["kind"] == "screw":
        raise PeerRefusal(f"MuJoCo has no screw: hinge {hinge['name']!r}")
    if np.any(rotor != rotor[:1]):
        raise PeerRefusal(f"MuJoCo takes one armature for all coordinates of {subhinge['kind']} hinge {hinge['name']!r}, not {rotor}")
    common = dict(name=name, armature=numbers_text(rotor[0]))
    if subhinge["kind"] == "free":
        if parent >= 0 or len(hinge["subhinges"]) > 1:
            raise PeerRefusal(f"MuJoCo has free joints on the base alone: hinge {hinge['name']!r}")
        etree.SubElement(element, "joint", common | dict(type="free"))
        return
    joint = etree.SubElement(element, "joint", common | dict(type=_JOINTS[subhinge["kind"]], pos=numbers_text(subhinge["point"])))
    if subhinge["kind"] != "ball":
        joint.set("axis", numbers_text(subhinge["axis"]))


def numbers_text(values: Any) -> str:
    """Return values as an XML attribute, with all their digits."""
    return " ".join(repr(float(x)).removesuffix(".0") for x in np.ravel(values))


def mujoco_peer(model: Described) -> Peer:
    """Return MuJoCo's forward dynamics (`mj_forward`, constraints off) on the model. Raises PeerRefusal with the compiler's text."""
    import mujoco

    said: list[str] = []
    mujoco.set_mju_user_warning(said.append)  # otherwise they go to a file in the working directory; the compiler also warns
    try:
        twin = mujoco.MjModel.from_xml_string(to_mjcf(model))
    except ValueError as error:
        raise PeerRefusal(" ".join(str(error).split())) from None
    data = mujoco.MjData(twin)
    turned = any(s["kind"] == "free" for body in _bodies(model) for s in body["hinge"]["subhinges"])

    def forward_dynamics(q: Vector, v: Vector, tau: Vector) -> Vector:
        data.qpos, data.qvel = convention.to_mujoco(model, q, v)
        T = convention.velocity_map(model, q) if turned else None
        data.qfrc_applied = tau if T is None else T @ tau
        mujoco.set_mju_user_warning(said.append)  # the callback belongs to the package, not to a model
        mujoco.mj_forward(twin, data)
        if T is None:
            return np.array(data.qacc)
        return T.T @ (data.qacc - convention.acceleration_to_mujoco(model, q, v, np.zeros(model.nv)))

    return Peer(f"MuJoCo {mujoco.__version__}", forward_dynamics, said)


# All of them ----------------------------------------------------------------------------------------------------------


def installed() -> dict[str, Callable[[Described], Peer]]:
    """Return functions that make a peer of a model, by the name of each package that can be imported: Pinocchio, MuJoCo, Drake."""
    from importlib.util import find_spec

    makers = {"pinocchio": ("Pinocchio", pinocchio_peer), "mujoco": ("MuJoCo", mujoco_peer), "pydrake": ("Drake", drake_peer)}
    return {name: make for module, (name, make) in makers.items() if find_spec(module) is not None}
