"""Models with ball loops in Pinocchio, their bodies, hinges and loops one for one. Pinocchio is installed where this is imported."""

import numpy as np
import pinocchio as pin

JOINTS = {"pin": pin.JointModelRevoluteUnaligned, "slider": pin.JointModelPrismaticUnaligned}


def se3(X):
    return pin.SE3(np.array(X[:3, :3]), np.array(X[:3, 3]))


def shift(p):
    return pin.SE3(np.eye(3), np.array(p, float))


class Twin:
    """Pinocchio's model, its rigid constraints, and where its coordinates stand in ours: pins, sliders, universal hinges, balls, free."""

    def __init__(self, model):
        self.model, self.pin_model = model, pin.Model()
        self.pin_model.gravity.linear = np.array(model.gravity)
        self.q_order, self.v_order, self._joints, self._shifts = [], [], {None: 0}, {None: pin.SE3.Identity()}
        for body in model.bodies.values():
            self._add(body)
        self.constraints = pin.StdVec_RigidConstraintModel()
        for loop in model.loops._description():
            given = {key: value for key, value in loop.items() if value is not None}
            point = shift(given.get("point", np.zeros(3)))
            placed = pin.SE3(np.array(given.get("rotation", np.eye(3))), np.array(given.get("position", np.zeros(3)), float))
            b, a = model.loops.ends_of(loop["name"])
            ends = [*self._end(b, point), *self._end(a, placed * point)]
            self.constraints.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, self.pin_model, *ends, pin.LOCAL))

    def _add(self, body):
        hinge, parent = body.hinge, body.parent.name if body.parent else None
        kinds = [subhinge["kind"] for subhinge in hinge.subhinges]
        q, v = hinge.q_slice.start, hinge.v_slice.start
        if kinds[0] == "free":
            joint, point = pin.JointModelFreeFlyer(), np.zeros(3)
            self.q_order += [q + k for k in (4, 5, 6, 1, 2, 3, 0)]
            self.v_order += [v + k for k in (3, 4, 5, 0, 1, 2)]
        else:
            point = np.array(hinge.subhinges[0].get("point", np.zeros(3)), float)
            if kinds[0] == "ball":
                joint = pin.JointModelSpherical()
                self.q_order += [q + k for k in (1, 2, 3, 0)]
            else:
                steps = [JOINTS[subhinge["kind"]](np.array(subhinge["axis"], float)) for subhinge in hinge.subhinges]
                joint = steps[0]
                if len(steps) > 1:
                    joint = pin.JointModelComposite()
                    for step in steps:
                        joint.addJoint(step, pin.SE3.Identity())
                self.q_order += range(q, hinge.q_slice.stop)
            self.v_order += range(v, hinge.v_slice.stop)
        self._shifts[body.name] = shift(-point)  # of a body in its joint
        placement = self._shifts[parent] * se3(hinge.placement) * shift(point)
        self._joints[body.name] = self.pin_model.addJoint(self._joints[parent], joint, placement, body.name)
        inertia = pin.Inertia(body.mass, np.array(body.com), np.array(body.inertia))
        self.pin_model.appendBodyToJoint(self._joints[body.name], inertia, self._shifts[body.name])

    def _end(self, frame, X):
        """Joint and placement of a pose X on a body, a node or the base."""
        node = self.model.nodes.get(frame) if frame else None
        on, at = (node.body, node.pose) if node is not None else (self.model.bodies[frame] if frame else None, np.eye(4))
        name = on.name if on is not None else None
        return self._joints[name], self._shifts[name] * se3(at) * X

    def constrained_accelerations(self, state, tau, mu=1e-10):
        """By constraintDynamics, in our coordinates; and the mass matrix is the same before. mu : of its proximal steps, over which
        their rounding is divided, and which redundant rows are to be small beside."""
        model, data = self.pin_model, self.pin_model.createData()
        q, v, tau = np.array(state.q)[self.q_order], np.array(state.v)[self.v_order], np.asarray(tau)[self.v_order]
        M = np.array(pin.crba(model, data, q))
        M, ours = np.triu(M) + np.triu(M, 1).T, self.model.mass_matrix(state.q)[np.ix_(self.v_order, self.v_order)]
        assert np.abs(M - ours).max() < 1e-12 * np.abs(ours).max()
        datas = pin.StdVec_RigidConstraintData()
        for constraint in self.constraints:
            datas.append(constraint.createData())
        pin.initConstraintDynamics(model, data, self.constraints, datas)
        found = pin.constraintDynamics(model, data, q, v, tau, self.constraints, datas, pin.ProximalSettings(1e-13, mu, 10000))
        out = np.zeros(len(found))
        out[self.v_order] = found
        return out
