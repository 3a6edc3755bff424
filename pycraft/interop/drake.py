"""Drake's multibody plant of a model of pins, sliders, screws and a free base, if the package drake is installed."""

from __future__ import annotations

from typing import Any

import numpy as np

from .described import Described, described
from .packages import MissingPackageError
from .peer import Peer, PeerRefusal


def drake_plant(model: Described) -> tuple[Any, np.ndarray, np.ndarray]:
    """Return the model as a continuous plant of Drake, and the places of our q (nq,) and v (nv,) in its positions and velocities.

    Raises PeerRefusal for hinges other than pin, slider and screw, and for anything that Drake refuses.
    """
    described(model, "drake_plant")
    try:
        from pydrake.multibody.plant import MultibodyPlant
    except ImportError:
        raise MissingPackageError("a plant of Drake needs the package drake, which is not installed: pip install drake") from None

    plant = MultibodyPlant(0.0)
    try:
        _build(plant, model)
        plant.Finalize()
    except RuntimeError as error:
        raise PeerRefusal(" ".join(str(error).split())) from None
    joints = [plant.GetJointByName(name) for name, hinge in model.hinges.items() if hinge.v_slice.stop > hinge.v_slice.start]
    of_q = np.array([joint.position_start() for joint in joints])
    of_v = np.array([joint.velocity_start() for joint in joints])
    return plant, of_q, of_v


def _build(plant: Any, model: Described) -> None:
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody import tree

    bodies: list[Any] = []
    for body in model.description()["bodies"]:
        hinge = body["hinge"]
        kinds = [s["kind"] for s in hinge["subhinges"]]
        if len(kinds) > 1 or set(kinds) - {"pin", "slider", "screw"}:
            raise PeerRefusal(f"Drake has no joint for hinge {hinge['name']!r} of kind {hinge['kind']}")
        rotational = np.asarray(body["inertia"], float)
        central = tree.RotationalInertia(*np.diag(rotational), rotational[0, 1], rotational[0, 2], rotational[1, 2])
        com = np.asarray(body["com"], float)
        inertia = tree.SpatialInertia.MakeFromCentralInertia(float(body["mass"]), com, central)
        made = plant.AddRigidBody(body["name"], inertia)
        bodies.append(made)
        parent = bodies[body["parent"]].body_frame() if body["parent"] >= 0 else plant.world_frame()
        rotation = RotationMatrix(np.asarray(hinge["placement"]["rotation"], float))
        placement = RigidTransform(rotation, np.asarray(hinge["placement"]["position"], float))
        if not kinds:
            plant.AddJoint(tree.WeldJoint(hinge["name"], parent, made.body_frame(), placement))
            continue
        subhinge = hinge["subhinges"][0]
        point = RigidTransform(np.asarray(subhinge["point"], float) if kinds[0] != "slider" else np.zeros(3))
        inboard = plant.AddFrame(tree.FixedOffsetFrame(f"{hinge['name']} inboard", parent, placement @ point))
        outboard = plant.AddFrame(tree.FixedOffsetFrame(f"{hinge['name']} outboard", made.body_frame(), point))
        axis = np.asarray(subhinge["axis"], float)
        if kinds[0] == "pin":
            joint = tree.RevoluteJoint(hinge["name"], inboard, outboard, axis)
        elif kinds[0] == "slider":
            joint = tree.PrismaticJoint(hinge["name"], inboard, outboard, axis)
        else:
            joint = tree.ScrewJoint(hinge["name"], inboard, outboard, axis, 2 * np.pi * float(subhinge["pitch"]), 0.0)
        plant.AddJoint(joint)
        if hinge["rotor_inertia"][0]:
            actuator = plant.AddJointActuator(hinge["name"], plant.GetJointByName(hinge["name"]))
            actuator.set_default_rotor_inertia(float(hinge["rotor_inertia"][0]))
            actuator.set_default_gear_ratio(1.0)
    plant.mutable_gravity_field().set_gravity_vector(np.array(model.gravity, float))


def drake_peer(model: Described) -> Peer:
    """Return Drake's forward dynamics (articulated bodies) on the model. Raises PeerRefusal as `drake_plant` does."""
    from importlib.metadata import version

    plant, of_q, of_v = drake_plant(model)
    context = plant.CreateDefaultContext()
    forces = plant.get_applied_generalized_force_input_port()

    def forward_dynamics(q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        positions, velocities, applied = np.empty(model.nv), np.empty(model.nv), np.empty(model.nv)
        positions[of_q], velocities[of_v], applied[of_v] = q, v, tau
        plant.SetPositions(context, positions)
        plant.SetVelocities(context, velocities)
        forces.FixValue(context, applied)
        rates = plant.EvalTimeDerivatives(context).CopyToVector()
        return rates[model.nv :][of_v]

    return Peer(f"Drake {version('drake')}", forward_dynamics)
