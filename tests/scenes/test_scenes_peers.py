"""Accelerations of scenes against Pinocchio and MuJoCo, for the effects that they have; and what differs where the laws do.

Both solve ℳ v̇ = ... with matrices of condition up to 10⁶ here, in other axes and orders: 1e-9 of the largest acceleration is asked.
"""

import numpy as np
import pytest

import pycraft as pc

pytestmark = [pytest.mark.peers, pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")]
E = pc.effects


def models():
    yield pc.robots.panda()
    yield pc.robots.g1()
    yield pc.tree([-1, 0, 1, 1, 0, 4], ["free", "pin", "ball", "slider", "universal", "ball"], seed=3, name="tree")


MODELS = {model.name: model for model in models()}


def close(a, b):
    assert np.abs(a - b).max() < 1e-9 * np.abs(b).max()


@pytest.mark.parametrize("name", MODELS)
def test_pinocchio(name):
    """Gravity, rotors, forces on coordinates, wrenches in axes of the world and of the body."""
    pin = pytest.importorskip("pinocchio")
    from pycraft.interop.export import to_pinocchio

    model, rng = MODELS[name], np.random.default_rng(1)
    model.gravity = g = (0.4, -1.0, -9.0)
    inertia, tau, w, u = rng.uniform(0, 1, model.nv), *rng.normal(size=(3, max(model.nv, 6)))
    tau, w, u, last = tau[: model.nv], w[:6], u[:6], list(model.bodies)[-1]
    scene = pc.Scene(model).add(
        E.Gravity(g), E.RotorInertia(inertia), E.TorqueSource(tau), E.Damping(0.3), E.Wrench(last, w), E.Wrench(last, u, axes="body")
    )
    twin = to_pinocchio(model)
    twin.model.armature = twin.model.armature + inertia[twin.of_v]
    data = twin.model.createData()
    for seed in range(3):
        state = model.random_state(seed)
        R = model.pose(last, state.q)[:3, :3]
        on_body = np.concatenate([R.T @ w[:3], R.T @ w[3:]]) + u
        pushed = [pin.Force.Zero() for _ in range(twin.model.njoints)]
        pushed[twin.tip[0]] = twin.tip[1].act(pin.Force(on_body[3:], on_body[:3]))
        vdot = np.empty(model.nv)
        forces = tau - 0.3 * state.v - (model.rotor_regressor(state.v) @ inertia)  # what Pinocchio has no v ×* (J v) for
        vdot[twin.of_v] = pin.aba(twin.model, data, twin.q(state.q), state.v[twin.of_v], forces[twin.of_v], pushed)
        close(scene.evaluate(state.q, state.v).vdot, vdot)


@pytest.mark.parametrize("name", MODELS)
def test_mujoco(name):
    """Gravity, damping, armature, springs of joints, forces on coordinates, wrenches on bodies."""
    mujoco = pytest.importorskip("mujoco")
    from pycraft.interop import mujoco as conventions
    from pycraft.interop.export import to_mjcf

    model, rng = MODELS[name], np.random.default_rng(2)
    model.gravity = g = (0.4, -1.0, -9.0)
    m = mujoco.MjModel.from_xml_string(to_mjcf(model))
    data = mujoco.MjData(m)
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    order = conventions.permutation(model)[1]
    of_joint = rng.uniform(0.1, 1, (3, m.njnt))[:, m.dof_jntid]  # one number for a joint
    m.dof_damping[:], m.dof_armature[:] = of_joint[:2]
    free = m.jnt_type == mujoco.mjtJoint.mjJNT_FREE
    m.jnt_stiffness[:] = np.where(free, 0, of_joint[2][m.jnt_dofadr])
    ours = np.empty((3, model.nv))
    ours[:, order] = of_joint
    damping, armature, stiffness = ours
    bound = [j for j in range(model.nv) if not free[m.dof_jntid[list(order).index(j)]]]
    names = [model.coordinate_names[j] for j in bound]
    tau, w, last = rng.normal(size=model.nv), rng.normal(size=6), list(model.bodies)[-1]
    scene = pc.Scene(model).add(E.Gravity(g), E.Damping(damping), E.RotorInertia(armature), E.Spring(stiffness[bound], hinges=names))
    scene.add(E.TorqueSource(tau), E.Wrench(last, w))
    for seed in range(3):
        state = model.random_state(seed)
        data.qpos[:], data.qvel[:] = conventions.to_mujoco(model, state.q, state.v)
        data.qfrc_applied[:] = conventions.velocity_map(model, state.q) @ tau
        X, body = model.pose(last, state.q), m.body(last).id
        data.xfrc_applied[body, :3] = w[3:]
        data.xfrc_applied[body, 3:] = w[:3] - np.cross(X[:3, :3] @ model.bodies[last].com, w[3:])
        mujoco.mj_forward(m, data)
        close(conventions.acceleration_to_mujoco(model, state.q, state.v, scene.evaluate(state.q, state.v).vdot), data.qacc)


def block(mujoco, k, b=0.0):
    text = f"""<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="x" type="slide" axis="1 0 0" limited="true" range="-1 1"
    solreflimit="{-k} {-b}" solimplimit="0.9 0.9 0.001"/><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
    m = mujoco.MjModel.from_xml_string(text)
    model = pc.Multibody("block")
    model.add_body("x", hinge="slider", axis=(1, 0, 0), mass=2.0, limits=(-1, 1))
    return m, mujoco.MjData(m), model


def test_limits_of_mujoco_are_of_another_law():
    """At rest and with nothing else acting they are springs alike, MuJoCo's stiffness counted per unit of inertia. A force that pushes into
    the stop is taken up there to nine tenths at once (the constraint's impedance), and here as far as the spring is compressed."""
    mujoco = pytest.importorskip("mujoco")
    k, beyond, F = 300.0, 0.01, 5.0
    m, data, model = block(mujoco, k)
    scene = pc.Scene(model).add(E.Limits(2.0 * k), E.TorqueSource(F))
    for force in (0.0, F):
        data.qpos[0], data.qvel[0], data.qfrc_applied[0] = 1 + beyond, 0.0, force
        mujoco.mj_forward(m, data)
        scene.effects["torque_source"].torque = force
        ours = scene.evaluate([1 + beyond], [0.0]).vdot[0]
        assert ours == pytest.approx(force / 2 - k * beyond, rel=1e-12)
        assert data.qacc[0] == pytest.approx(0.1 * force / 2 - k * beyond, rel=1e-9)


def test_servos_of_mujoco():
    """Position and velocity servos with their limits of force; MuJoCo's target has no rate."""
    mujoco = pytest.importorskip("mujoco")
    text = """<mujoco><worldbody><body><joint name="x" axis="0 1 0"/>
    <inertial pos=".1 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>
    <actuator><position joint="x" kp="30" kv="2" gear="1.5" forcerange="-9 9"/></actuator></mujoco>"""
    m = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(m)
    model = pc.Multibody("x")
    model.add_body("x", axis=(0, 1, 0), mass=2.0, com=(0.1, 0, 0), inertia=np.eye(3))
    scene = pc.Scene(model).add(E.Gravity(), E.Servo(30 * 1.5**2, 2 * 1.5**2, target=0.4 / 1.5, effort_limit=9 * 1.5))
    for q, v in ((0.3, 0.1), (0.3, -2.0), (-1.0, 1.0), (0.28, 0.0)):
        data.qpos[0], data.qvel[0], data.ctrl[0] = q, v, 0.4
        mujoco.mj_forward(m, data)
        assert scene.evaluate([q], [v]).vdot[0] == pytest.approx(data.qacc[0], rel=1e-12)
