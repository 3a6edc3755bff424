"""Every robot of example-robot-data through our files, TOML bit for bit, URDF and MJCF to rounding; a part of one, read by Pinocchio."""

import numpy as np
import pytest

import pycraft as pc

pytest.importorskip("pinocchio")

from pycraft.peers import peers
from support.saved_models import loaded, lost, saved_and_loaded

pytestmark = pytest.mark.peers

FILES = peers.robot_files()


@pytest.mark.parametrize("path", FILES, ids=[f"{f.parent.parent.name}-{f.stem}" for f in FILES])
def test_robot(path, tmp_path):
    try:
        robot = loaded(path, root="free", mimic="lock")
    except pc.ModelError:
        pytest.skip("not read: tests/peers/test_peers.py says why")
    assert lost(robot, tmp_path / "robot.toml") == []
    again = saved_and_loaded(robot, tmp_path / "robot.urdf")
    assert again.coordinate_names == robot.coordinate_names
    q = robot.random_state(0).q
    ours, theirs = robot.mass_matrix(q), again.mass_matrix(q)
    assert np.abs(ours - theirs).max() <= 1e-13 * robot.nv * np.abs(ours).max()


@pytest.mark.parametrize("path", FILES, ids=[f"{f.parent.parent.name}-{f.stem}" for f in FILES])
def test_as_mjcf(path, tmp_path):
    """MuJoCo's own mass matrix and inverse dynamics of the file are ours, or it is said which bodies it does not take."""
    mujoco = pytest.importorskip("mujoco")
    from pycraft.interop import mujoco as conventions

    try:
        robot = loaded(path, root="free", mimic="lock")
    except pc.ModelError:
        pytest.skip("not read: tests/peers/test_peers.py says why")
    state = robot.random_state(0)
    robot.q, robot.v = state.q, state.v
    try:
        again = saved_and_loaded(robot, tmp_path / "robot.xml")
    except pc.ModelError as error:
        said = str(error).removeprefix(f"{tmp_path / 'robot.xml'}: ")
        assert said.startswith(("bodies '", "inertias of '", "a body is called 'world'")), said
        pytest.skip(said)
    assert again.coordinate_names == robot.coordinate_names
    size = 1e-13 * robot.nv
    ours, theirs = robot.mass_matrix(robot.q), again.mass_matrix(robot.q)
    assert np.abs(ours - theirs).max() <= size * np.abs(ours).max()
    m = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    m.dof_damping[:] = 0
    data = mujoco.MjData(m)
    vdot = np.random.default_rng(0).normal(size=robot.nv)
    data.qpos, data.qvel = conventions.to_mujoco(robot, robot.q, robot.v)
    data.qacc = conventions.acceleration_to_mujoco(robot, robot.q, robot.v, vdot)
    mujoco.mj_inverse(m, data)
    forces = conventions.velocity_map(robot, robot.q) @ robot.inverse_dynamics(robot.q, robot.v, vdot)
    assert np.abs(data.qfrc_inverse - forces).max() <= size * np.abs(forces).max()


@pytest.mark.parametrize("ending", ["urdf", "xml"])
def test_a_part_read_by_pinocchio(tmp_path, ending):
    """Its mass matrix and inverse dynamics of an arm that was cut off a humanoid; it may have the joints in another order."""
    import pinocchio as pin

    part = pc.robots.g1().subgraph(root="left_shoulder_pitch_link")
    path = tmp_path / f"part.{ending}"
    saved_and_loaded(part, path)
    twin = (pin.buildModelFromUrdf if ending == "urdf" else pin.buildModelFromMJCF)(str(path))
    order = [part.coordinate_names.index(name) for name in list(twin.names)[1:]]
    assert sorted(order) == list(range(part.nv))
    data, state = twin.createData(), part.random_state(4)
    part.gravity = twin.gravity.linear
    vdot = np.random.default_rng(2).normal(size=part.nv)
    forces = part.inverse_dynamics(state.q, state.v, vdot)
    mass = part.mass_matrix(state.q) - np.diag(np.concatenate([hinge.rotor_inertia for hinge in part.hinges.values()]))
    forces -= (part.mass_matrix(state.q) - mass) @ vdot
    twin.armature = np.zeros(part.nv)
    theirs = pin.rnea(twin, data, state.q[order], state.v[order], vdot[order])
    assert np.abs(theirs - forces[order]).max() <= 1e-13 * part.nv * np.abs(forces).max()
    full = pin.crba(twin, data, state.q[order])
    full = np.triu(full) + np.triu(full, 1).T
    assert np.abs(full - mass[np.ix_(order, order)]).max() <= 1e-13 * part.nv * np.abs(mass).max()
