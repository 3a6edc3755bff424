"""One model here and in Pinocchio, at a state: what tests beside Pinocchio share. Pinocchio is installed where this is imported."""

from dataclasses import dataclass, field
from functools import cache

import numpy as np
import pinocchio as pin

import pycraft as pc
from pycraft.interop import pinocchio as convention
from pycraft.peers import peers

INSIDE = "ball and free inside"
STATES = 3
ANGULAR_FIRST = [3, 4, 5, 0, 1, 2]
# Of a body's ten parameters: ours xx, xy, xz, yy, yz, zz after mass and mass times centre; Pinocchio's xx, xy, yy, xz, yz, zz.
PARAMETERS = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]
EPS = float(np.finfo(float).eps)


@dataclass
class Pair:
    """One model in both libraries, at one state; `still` is Pinocchio's without gravity."""

    model: pc.Multibody
    twin: convention.Coordinates
    still: pin.Model
    q: np.ndarray
    v: np.ndarray
    u: np.ndarray
    pq: np.ndarray = field(init=False)
    S: np.ndarray = field(init=False)

    def __post_init__(self):
        self.pq, self.S = self.twin.q(self.q), self.twin.velocities(self.q)

    @property
    def pin_model(self):
        return self.twin.pin_model

    def ours(self, matrix):
        """A matrix over Pinocchio's coordinates, rows and columns, in ours."""
        return self.S.T @ matrix @ self.S

    def call(self, function, *vectors, still=False):
        """Copies of what a function of Pinocchio gives at this configuration; vectors are in our coordinates."""
        model = self.still if still else self.pin_model
        data = model.createData()  # what comes back are views of it
        result = function(model, data, self.pq, *(self.S @ x for x in vectors))
        return tuple(map(np.array, result)) if isinstance(result, tuple) else np.array(result)

    def frames(self):
        """Three bodies that are frames of Pinocchio: the last, the middle, the first."""
        names = [name for name in self.model.bodies if self.pin_model.existFrame(name, pin.FrameType.BODY)]
        return [names[i] for i in sorted({len(names) - 1, len(names) // 2, 0})]

    def parameter_columns(self):
        """Where the columns of our regressor stand in Pinocchio's: ten a joint, in its order of joints and of parameters."""
        joint = {own: self.pin_model.getJointId(name) for name, own in self.joint_names().items()}
        return [10 * (joint[body.hinge.name] - 1) + p for body in self.model.bodies.values() for p in PARAMETERS]

    def joint_names(self):
        hinges = self.model.hinges
        renamed = "root" in hinges and "root_joint" not in hinges
        return {name: "root" if name == "root_joint" and renamed else name for name in list(self.pin_model.names)[1:]}

    def mass_columns(self):
        """∂ℳ/∂π by Pinocchio, (nv, nv, 10 n): the regressor of ℳ e_j at rest, column j."""
        rest, columns = np.zeros(self.model.nv), self.parameter_columns()
        slabs = [self.S.T @ self.call(pin.computeJointTorqueRegressor, rest, e, still=True)[:, columns] for e in np.eye(self.model.nv)]
        return np.stack(slabs, axis=1)

    def inertia(self):
        """The largest entry of ℳ: what the terms are like that make a derivative of it, per radian or metre."""
        return np.abs(self.model.mass_matrix(self.q)).max()

    def mass_slope(self):
        """∂ℳ/∂q by Pinocchio, derivative last."""
        rest = np.zeros(self.model.nv)
        slabs = [self.ours(self.call(pin.computeRNEADerivatives, rest, e, still=True)[0]) for e in np.eye(self.model.nv)]
        return np.stack(slabs, axis=1)

    def inverse(self):
        upper = np.triu(self.call(pin.computeMinverse))  # the lower triangle is not filled
        return self.ours(upper + np.triu(upper, 1).T)


@cache
def models(robot, root):
    if robot == INSIDE:
        model, pin_model = inside()
    else:
        path = next(f for f in peers.robot_files() if f.stem == robot)
        model, pin_model = pc.load(path, root=root, mimic="free"), convention.build(str(path), root)
    model.gravity = peers.GRAVITY
    pin_model.gravity.linear = np.array(peers.GRAVITY)
    still = pin_model.copy()
    still.gravity.linear = np.zeros(3)
    return model, convention.coordinates(model, pin_model), still


def inside():
    """Hinges that no robot file has inside the tree: a pin, a ball on it, a free hinge on that, a ball and a slider on it."""
    rng = np.random.default_rng(5)
    model, pin_model = pc.Multibody("inside"), pin.Model()
    kinds = {"pin": pin.JointModelRZ, "slider": pin.JointModelPZ, "ball": pin.JointModelSpherical, "free": pin.JointModelFreeFlyer}
    for k, (parent, kind) in enumerate([(-1, "pin"), (0, "ball"), (1, "free"), (2, "ball"), (2, "slider")]):
        rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        rotation *= np.linalg.det(rotation)
        position, com, mass = rng.uniform(-1, 1, 3), rng.uniform(-0.3, 0.3, 3), rng.uniform(1, 2)
        root = rng.normal(size=(3, 3))
        second = root @ root.T
        inertia = np.trace(second) * np.eye(3) - second  # of a distribution of mass
        model.add_body(f"b{k}", f"b{parent}" if parent >= 0 else None, kind, position=position, rotation=rotation, mass=mass, com=com,
                       inertia=inertia, hinge_name=f"h{k}")  # fmt: skip
        joint = pin_model.addJoint(parent + 1, kinds[kind](), pin.SE3(rotation, position), f"h{k}")
        pin_model.appendBodyToJoint(joint, pin.Inertia(mass, com, inertia), pin.SE3.Identity())
        pin_model.addFrame(pin.Frame(f"b{k}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
        if kind in ("pin", "slider"):
            model.hinges[f"h{k}"].rotor_inertia = 0.1 * mass
            armature = pin_model.armature
            armature[pin_model.joints[joint].idx_v] = 0.1 * mass
            pin_model.armature = armature
    return model, pin_model
