"""Models written as MJCF: MuJoCo computes the same of them, what comes back moves the same, what MJCF does not have is refused by name.

Tolerance: inertias that are not diagonal go through MuJoCo's principal axes and rotations through quaternions, each of which keeps them to
a few eps; results of trees of seven bodies, with entries up to 100, stay within 1e-12 of their largest entry.
"""

import doctest
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pycraft as pc
from pycraft.interop import mujoco as conventions
from pycraft.models.loaders.rotations import rotation_from_rpy
from support.saved_models import differences, loaded, saved_and_loaded

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.peers

KINDS = ("pin", "slider", "weld", "ball", "universal", "gimbal", "cylindrical", "planar", "custom")
AGREE = 1e-12


def close(actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=0, atol=AGREE * max(1.0, np.abs(expected).max(initial=0.0)))


@st.composite
def trees(draw):
    """Random trees of what MJCF has, free bodies on the base among it, with limits, rotors, nodes and a state."""
    count = draw(st.integers(1, 7))
    parents = [draw(st.integers(-1, k - 1)) for k in range(count)]
    kinds = [draw(st.sampled_from((*KINDS, "free") if parent < 0 else KINDS)) for parent in parents]
    model = pc.tree(parents, kinds, seed=draw(st.integers(0, 99)), welds=draw(st.sampled_from(["lump", "keep"])))
    for hinge in model.hinges.values():
        if hinge.kind == "free":
            hinge.placement = np.eye(4)
        elif hinge.kind != "ball" and draw(st.booleans()):
            hinge.rotor_inertia = draw(st.lists(st.floats(0, 2), min_size=(n := len(hinge.subhinges)), max_size=n))
            hinge.limits = (
                [draw(st.sampled_from([-1.0, -np.inf])) for _ in range(n)],
                [draw(st.sampled_from([2.0, np.inf])) for _ in range(n)],
            )
        elif hinge.kind == "ball":
            hinge.rotor_inertia = [draw(st.sampled_from([0.0, 0.3]))] * 3
    for k in range(draw(st.integers(0, 3))):
        on = draw(st.sampled_from([None, *model.bodies, *model.nodes]))
        model.add_node(
            f"node{k}", on, position=[1, 2, k], rotation=rotation_from_rpy(*draw(st.lists(st.floats(-3, 3), min_size=3, max_size=3)))
        )
    state = model.random_state(draw(st.integers(0, 9)))
    model.q, model.v, model.gravity = state.q, state.v, draw(st.sampled_from([(0, 0, 0), (0.5, -1, -9.81)]))
    return model


def check_the_same(model, again):
    """Names, limits, state, mass matrix, dynamics both ways, poses of all that has a name."""
    assert (again.name, list(again.bodies), again.coordinate_names) == (model.name, list(model.bodies), model.coordinate_names)
    assert set(again.nodes) == set(model.nodes) and np.array_equal(again.gravity, model.gravity)
    for name, hinge in model.hinges.items():
        if not hinge.subhinges:
            continue
        other = again.hinges[name]
        assert np.array_equal(hinge.limits or (), other.limits or ()) or not np.isfinite(hinge.limits).any()
        assert other.rotor_inertia.tolist() == hinge.rotor_inertia.tolist()
        assert other.kind == hinge.kind or len(hinge.subhinges) > 1
    close(again.difference(model.q, again.q), np.zeros(model.nv))
    close(again.v, model.v)
    rng = np.random.default_rng(0)
    vdot = rng.normal(size=model.nv)
    close(again.mass_matrix(model.q), model.mass_matrix(model.q))
    close(again.inverse_dynamics(model.q, model.v, vdot), model.inverse_dynamics(model.q, model.v, vdot))
    if model.nv:
        condition = np.linalg.cond(model.mass_matrix(model.q))
        tau = model.inverse_dynamics(model.q, model.v, vdot)
        size = np.abs(vdot).max() + np.abs(tau).max()
        assert np.abs(again.forward_dynamics(model.q, model.v, tau) - vdot).max() < AGREE * condition * size
    for name in (*model.bodies, *model.nodes):
        close(again.pose(name, model.q), model.pose(name, model.q))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture])
@given(model=trees())
def test_it_moves_the_same(model, tmp_path):
    path, welds = tmp_path / "model.xml", "keep" if model.keeps_welds else "lump"
    again = (
        saved_and_loaded(model, path, welds=welds, gravity="file") if model.gravity.any() else saved_and_loaded(model, path, welds=welds)
    )
    check_the_same(model, again)
    simulated(model, path)


def simulated(model, path):
    """MuJoCo's own mass matrix and inverse dynamics of the file, at our state."""
    m = mujoco.MjModel.from_xml_path(str(path))
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    m.dof_damping[:] = 0  # what was left aside is no part of our inverse dynamics
    data = mujoco.MjData(m)
    data.qpos, data.qvel = conventions.to_mujoco(model, model.q, model.v)
    vdot = np.random.default_rng(1).normal(size=model.nv)
    data.qacc = conventions.acceleration_to_mujoco(model, model.q, model.v, vdot)
    mujoco.mj_inverse(m, data)
    T = conventions.velocity_map(model, model.q) if model.nv else np.zeros((0, 0))
    close(data.qfrc_inverse, T @ model.inverse_dynamics(model.q, model.v, vdot))
    if model.nv:
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(m, data, mass)
        close(mass, T @ model.mass_matrix(model.q) @ T.T)
    if m.nkey:  # the keyframe is the state
        mujoco.mj_resetDataKeyframe(m, data, 0)
        qpos, qvel = conventions.to_mujoco(model, model.q, model.v)
        close(data.qvel, qvel)
        assert np.abs(data.qpos - qpos).max() < 1e-14 * max(1.0, np.abs(qpos).max())


@pytest.mark.parametrize("name", ["panda", "ur5", "a1", "g1"])
@pytest.mark.parametrize("root", ["fixed", "free"])
@pytest.mark.parametrize("welds", ["lump", "keep"])
def test_robots_of_the_package(tmp_path, name, root, welds):
    robot = getattr(pc.robots, name)(root=root, welds=welds)
    state = robot.random_state(2)
    robot.q, robot.v, robot.gravity = state.q, state.v, (0, 0, -9.81)
    again = saved_and_loaded(robot, tmp_path / "robot.xml", welds=welds, gravity="file")
    check_the_same(robot, again)
    simulated(robot, tmp_path / "robot.xml")
    for quantity in ("damping", "friction"):
        if (values := robot.left_aside.get(quantity)) is not None:
            assert np.array_equal(np.nan_to_num(values), np.nan_to_num(again.left_aside.get(quantity, np.zeros(robot.nv))))


BESIDE = """\
<mujoco model="beside">
  <compiler angle="radian"/>
  <option gravity="0 1 -9"/>
  <worldbody>
    <body name="a" pos="0 0 1">
      <inertial pos="0 0 .1" mass="2" diaginertia=".1 .2 .25"/>
      <joint name="j" axis="0 1 0" damping=".5" frictionloss=".25" stiffness="3" springref=".75" range="-1 2" armature=".1"/>
      <body name="b" pos="0 0 1">
        <inertial pos="0 0 .1" mass="1" diaginertia=".1 .2 .25"/>
        <joint name="k" type="ball" damping=".125"/>
        <body name="c">
          <inertial pos="0 0 .1" mass="1" diaginertia=".1 .2 .25"/>
          <joint name="l[0]" type="slide" stiffness="7" springref=".25"/>
          <joint name="l[1]" axis="1 0 0" frictionloss="2"/>
          <site name="tip" pos="0 0 .5"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general name="motor" joint="j" gear="50" gainprm="2" forcerange="-3 4"/>
    <position name="servo" joint="l[1]" kp="20" kv="3"/>
  </actuator>
</mujoco>
"""


def test_what_a_file_said_beside_the_model_is_said_again(tmp_path):
    (tmp_path / "beside.xml").write_text(BESIDE)
    model = loaded(tmp_path / "beside.xml")
    assert list(model.hinges) == ["j", "k", "l"] and model.coordinate_names[4:] == ["l[0]", "l[1]"]
    again = saved_and_loaded(model, tmp_path / "again.xml")
    assert differences(again.left_aside, model.left_aside) == [] and differences(again.actuators, model.actuators) == []
    assert len(model.left_aside) == 5 and len(model.actuators) == 2
    assert differences(again.description(), model.description()) == []  # all numbers of this file are exact
    model.gravity = (0, 0, -1)
    with pytest.warns(pc.ModelWarning, match="does not hold the gravity in left_aside"):
        model.save(tmp_path / "other.xml")


def test_what_a_file_looks_like(tmp_path):
    arm = pc.Multibody("arm")
    arm.add_body("post", axis=(0, 0, 1), mass=1, com=(0, 0, 0.5), inertia=np.diag([0.25, 0.25, 0.125]), limits=(-1, np.inf))
    arm.add_body("lid", "post", "universal", hinge_name="crank", position=(0, 0, 1), mass=2, inertia=np.eye(3), rotor_inertia=[0.5, 0])
    arm.add_node("knob", "lid", position=(1, 0, 0))
    arm.q, arm.gravity = [0.5, 0, 0], (0, 0, -9.81)
    arm.save(tmp_path / "arm.xml")
    assert (tmp_path / "arm.xml").read_text() == ARM
    arm.save(tmp_path / "still.xml", state=False)
    assert "keyframe" not in (tmp_path / "still.xml").read_text()


ARM = """\
<!-- Written by PyCraft. SI units and radians. -->
<mujoco model="arm">
  <compiler angle="radian" autolimits="false" boundmass="0" boundinertia="0" balanceinertia="false" inertiafromgeom="false" \
settotalmass="-1" fusestatic="false"/>
  <option gravity="0 0 -9.81"/>
  <worldbody>
    <body name="post" pos="0 0 0">
      <inertial pos="0 0 0.5" mass="1" diaginertia="0.25 0.25 0.125"/>
      <joint name="post" armature="0" type="hinge" pos="0 0 0" axis="0 0 1" \
limited="true" range="-1 1.7976931348623157e+308"/>
      <body name="lid" pos="0 0 1">
        <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
        <joint name="crank[0]" armature="0.5" type="hinge" pos="0 0 0" axis="1 0 0"/>
        <joint name="crank[1]" armature="0" type="hinge" pos="0 0 0" axis="0 1 0"/>
        <site name="knob" pos="1 0 0"/>
      </body>
    </body>
  </worldbody>
  <keyframe>
    <key name="state" qpos="0.5 0 0" qvel="0 0 0"/>
  </keyframe>
</mujoco>
"""


def test_flat_bodies(tmp_path):
    """A plate has A + B = C, or more by rounding, which MuJoCo refuses: rounding is added."""
    for turned in (np.eye(3), rotation_from_rpy(0.3, 0.7, -0.2)):
        plate = pc.Multibody("plate")
        moments = turned @ np.diag([0.1, 0.7, np.nextafter(0.1 + 0.7, 1)]) @ turned.T
        plate.add_body("plate", mass=3, inertia=(moments + moments.T) / 2)
        again = saved_and_loaded(plate, tmp_path / "plate.xml")
        assert np.abs(again.bodies["plate"].inertia - moments).max() < 1e-13


def test_a_free_hinge_that_is_placed(tmp_path):
    """The motion comes back, in the world's coordinates, and that is said."""
    model = pc.tree([-1, 0], ["free", "pin"], seed=1)
    state = model.random_state(0)
    model.q, model.v = state.q, state.v
    with pytest.warns(
        pc.ModelWarning, match="the placement of free hinge 'hinge0' .its coordinates there are the body's pose in the world."
    ):
        model.save(tmp_path / "placed.xml")
    again = loaded(tmp_path / "placed.xml")
    close(again.pose("body1"), model.pose("body1"))
    close(again.frame("body1").velocity(), model.frame("body1").velocity())


def refused(model, path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        with pytest.raises(pc.ModelError) as error:
            model.save(path)
    assert not path.exists()
    return str(error.value).removeprefix(f"{path}: ")


def test_what_is_refused(tmp_path):
    path, solid = tmp_path / "model.xml", dict(mass=1.0, inertia=np.eye(3))
    several = [{"kind": "ball"}, {"kind": "pin", "axis": (0, 0, 1)}]
    screwed = [{"kind": "pin", "axis": (0, 0, 1)}, {"kind": "screw", "axis": (1, 0, 0), "pitch": 1.0}]
    for options, said in (
        (dict(hinge="screw", pitch=0.1), "hinge 'h' is a screw. MJCF has joints of type"),
        (dict(hinge="custom", subhinges=screwed), "hinge 'h' has a screw. MJCF"),
        (dict(hinge="custom", subhinges=several), "hinge 'h' turns after its ball. MJCF"),
        (dict(hinge="free"), "hinge 'h' is free and not alone on the base. MJCF"),
        (dict(hinge="ball", rotor_inertia=[1, 1, 2]), "hinge 'h' has different rotor inertias in one ball. MJCF"),
    ):
        model = pc.Multibody("refused")
        model.add_body("a", **solid)
        model.add_body("b", "a", hinge_name="h", **options, **solid)
        text = refused(model, path)
        assert text.startswith(said) and text.endswith("save the model as .toml, which holds every hinge")
    assert "bodies 'body0', 'body1' move and have no mass, or no inertia about some axis, which MuJoCo refuses" in refused(
        pc.chain(2), path
    )
    unreal = pc.Multibody("unreal")
    unreal.add_body("a", mass=1, inertia=np.diag([1.0, 1.0, 3.0]))
    assert refused(unreal, path).startswith("inertias of 'a' violate the triangle inequality, and MuJoCo refuses them")
    for names, said in (
        (("world", "h"), "a body is called 'world'"),
        (("a\x01", "h"), "the name 'a\\x01' has a character that XML does not"),
    ):
        model = pc.Multibody("names")
        model.add_body(names[0], hinge_name=names[1], **solid)
        assert refused(model, path).startswith(said)


def test_what_is_left_out_is_said(tmp_path):
    model = pc.Multibody("locked", welds="keep")
    model.add_body("a", hinge="planar", limits=((0, -1, 0), (0, 1, 2)), hinge_name="h", mass=1, inertia=np.eye(3))
    model.add_body("b", "a", "weld", hinge_name="glue", mass=1)
    with pytest.warns(
        pc.ModelWarning, match="limits of hinge 'h' that are equal, the name of weld 'glue' .there it has its body's.; a .toml"
    ):
        model.save(tmp_path / "model.xml")
    again = loaded(tmp_path / "model.xml", welds="keep")
    assert [side.tolist() for side in again.hinges["h"].limits] == [[-np.inf, -1, 0], [np.inf, 1, 2]] and "b" in again.hinges


def test_massless_bodies_that_carry_welded_mass(tmp_path):
    """MuJoCo takes a body without mass where what is welded to it has some."""
    model = pc.Multibody("carried", welds="keep")
    model.add_body("frame", hinge="pin")
    model.add_body("load", "frame", "weld", position=(1, 0, 0), mass=1, inertia=np.eye(3))
    again = saved_and_loaded(model, tmp_path / "model.xml", welds="keep")
    check_the_same(model, again)


# Parts ----------------------------------------------------------------------------------------------------------------

CUTS = {"an arm of a humanoid": dict(root="left_shoulder_pitch_link"), "all but its torso": dict(without=["torso_link"])}


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("ending", ["toml", "urdf", "xml"])
def test_parts_come_back_from_every_format(tmp_path, cut, ending):
    """By the format's own bound: TOML bit for bit, the others to rounding."""
    robot = pc.robots.g1()
    state = robot.random_state(1)
    robot.q, robot.v = state.q, state.v
    part = robot.subgraph(**CUTS[cut])
    again = saved_and_loaded(part, tmp_path / f"part.{ending}")
    assert again.whole is None and again.coordinate_names == part.coordinate_names
    if ending == "toml":
        assert differences(again.description(), part.description()) == []
    if ending == "urdf":
        again.q, again.v = part.q, part.v
        assert set(part.bodies) <= {*again.bodies, *again.nodes} and set(part.nodes) <= set(again.nodes)
        close(again.mass_matrix(part.q), part.mass_matrix(part.q))
        return
    check_the_same(part, again)


@pytest.mark.parametrize("ending", ["toml", "urdf", "xml"])
def test_parts_on_a_moving_base(tmp_path, ending):
    robot = pc.robots.g1()
    robot.q = robot.random_state(1).q
    part = robot.subgraph(root="left_shoulder_pitch_link", base="moving")
    if ending == "xml":
        text = refused(part, tmp_path / "part.xml")
        assert text.startswith("bodies 'base' move and have no mass") and "; take the part with base='fixed', or give them some" in text
        return
    again = saved_and_loaded(part, tmp_path / f"part.{ending}")
    assert again.coordinate_names == part.coordinate_names
    close(again.mass_matrix(part.q), part.mass_matrix(part.q))
    for name in part.bodies:
        close(again.pose(name, part.q), part.pose(name, part.q))


def test_paths(tmp_path):
    robot = pc.robots.a1(root="fixed")
    path = robot.path("FR_foot", "RL_foot")
    for ending in ("toml", "urdf", "xml"):
        again = saved_and_loaded(path, tmp_path / f"path.{ending}")
        assert again.coordinate_names == path.coordinate_names
        close(again.mass_matrix(path.q), path.mass_matrix(path.q))
        close(again.pose("RL_foot", path.q), path.pose("RL_foot", path.q))


def test_the_page_on_mjcf_files_runs(tmp_path, monkeypatch):
    page = Path(__file__).parents[2] / "docs" / "mjcf.md"
    monkeypatch.chdir(tmp_path)
    result = doctest.testfile(str(page), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0 and result.attempted > 8
