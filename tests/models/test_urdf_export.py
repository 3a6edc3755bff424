"""Models written as URDF: what comes back moves the same, and what URDF does not have is refused by name.

Tolerance: a rotation goes through three angles, which keeps it to a few eps; results of trees of a dozen bodies, with entries up to 100,
stay within 1e-12 of their largest entry.
"""

import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pycraft as pc
from pycraft.models.loaders.rotations import rotation_from_rpy
from support.saved_models import differences, loaded, saved_and_loaded

KINDS = ("pin", "slider", "weld", "free", "planar")
AGREE = 1e-12


def close(actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=0, atol=AGREE * max(1.0, np.abs(expected).max(initial=0.0)))


def check_the_same(model, again, seed=0):
    """Names, mass matrix, inverse dynamics under gravity, poses of all that has a name."""
    assert again.coordinate_names == model.coordinate_names and again.name == model.name
    for name, hinge in model.hinges.items():
        assert np.array_equal(hinge.limits or (), again.hinges[name].limits or ()) or not np.isfinite(hinge.limits).any()
        assert again.hinges[name].rotor_inertia.tolist() == hinge.rotor_inertia.tolist()
    model.gravity = again.gravity = (0.5, -1, -9.81)
    state, rng = model.random_state(seed), np.random.default_rng(seed)
    vdot = rng.normal(size=model.nv)
    close(again.mass_matrix(state.q), model.mass_matrix(state.q))
    close(again.inverse_dynamics(state.q, state.v, vdot), model.inverse_dynamics(state.q, state.v, vdot))
    for name in (*model.bodies, *model.nodes):
        close(again.pose(name, state.q), model.pose(name, state.q))


@st.composite
def trees(draw):
    """Random trees of what URDF has, hinges off their bodies' origins among it, with limits, rotors and nodes."""
    count = draw(st.integers(1, 7))
    kinds = [draw(st.sampled_from(KINDS)) for _ in range(count)]
    parents = [draw(st.integers(-1, k - 1)) for k in range(count)]
    welds = draw(st.sampled_from(["lump", "keep"]))
    model = pc.tree(parents, kinds, seed=draw(st.integers(0, 99)), rotor_inertia=draw(st.booleans()), welds=welds)
    for hinge in model.hinges.values():
        if hinge.kind in ("pin", "slider"):
            hinge.limits = draw(st.sampled_from([None, (-1, 2), (-np.inf, 1), (-1, np.inf), (-np.inf, np.inf)]))
    for k in range(draw(st.integers(0, 3))):
        on = draw(st.sampled_from([None, *model.bodies, *model.nodes]))
        model.add_node(
            f"node{k}", on, position=[1, 2, k], rotation=rotation_from_rpy(*draw(st.lists(st.floats(-3, 3), min_size=3, max_size=3)))
        )
    return model


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture])
@given(model=trees())
def test_it_moves_the_same(model, tmp_path):
    welds = "keep" if model.keeps_welds else "lump"
    again = saved_and_loaded(model, tmp_path / "model.urdf", welds=welds)
    check_the_same(model, again)
    third = saved_and_loaded(again, tmp_path / "again.urdf", welds=welds)
    assert list(third.bodies) == list(again.bodies) and set(third.nodes) == set(again.nodes)  # what was added was added once
    check_the_same(again, third)


@pytest.mark.parametrize("name", pc.robots.names())
@pytest.mark.parametrize("root", ["fixed", "free"])
@pytest.mark.parametrize("welds", ["lump", "keep"])
def test_robots_of_the_package(tmp_path, name, root, welds):
    robot = getattr(pc.robots, name)(root=root, welds=welds)
    again = saved_and_loaded(robot, tmp_path / "robot.urdf", welds=welds)
    assert differences(robot.left_aside, again.left_aside) == []
    check_the_same(robot, again)
    assert set(robot.bodies) <= set(again.bodies) <= {*robot.bodies, "world"}
    assert set(robot.nodes) <= set(again.nodes) <= {*robot.nodes, "world"}
    third = saved_and_loaded(again, tmp_path / "again.urdf", welds=welds)
    assert list(third.bodies) == list(again.bodies) and set(third.nodes) == set(again.nodes)


def test_a_free_root_may_be_asked_for(tmp_path):
    """A file with its own floating root is not made free twice."""
    robot = pc.robots.a1()
    robot.save(tmp_path / "a1.urdf")
    for root in ("fixed", "free"):
        again = loaded(tmp_path / "a1.urdf", root=root)
        assert (again.nv, next(iter(again.hinges)), again.hinges["root"].kind) == (robot.nv, "root", "free")
    text = (tmp_path / "a1.urdf").read_text()
    for mass, moment in ((1, 1), (1, 0), (0, 1)):  # a body that flies, and one that flies off it
        moments = f'ixx="{moment}" ixy="0" ixz="0" iyy="{moment}" iyz="0" izz="{moment}"'
        heavy = f'<link name="world"><inertial><mass value="{mass}"/><inertia {moments}/></inertial></link>'
        (tmp_path / "a1.urdf").write_text(text.replace('<link name="world"/>', heavy))
        with pytest.raises(pc.ModelError, match="has the name of the free hinge"):
            loaded(tmp_path / "a1.urdf", root="free")


def test_what_a_file_looks_like(tmp_path):
    arm = pc.Multibody("arm")
    arm.add_body("post", hinge="pin", axis=(0, 0, 1), point=(0, 0, 5), mass=1, com=(0, 0, 0.5), inertia=np.diag([0.25, 0.25, 0]))
    arm.add_body(
        "lid", "post", hinge_name="crank", point=(0.5, 0, 0.25), position=(0, 0, 1), limits=(-1, np.inf), rotor_inertia=0.5, mass=2
    )
    arm.add_node("knob", "lid", position=(1, 0, 0))
    arm.save(tmp_path / "arm.urdf")
    assert (tmp_path / "arm.urdf").read_text() == ARM
    again = pc.load(tmp_path / "arm.urdf")
    check_the_same(arm, again)
    assert list(again.bodies) == ["post", "lid_at_hinge"] and list(again.nodes) == ["world", "lid", "knob"]


ARM = """\
<?xml version="1.0"?>
<!-- Written by PyCraft. SI units and radians. -->
<robot name="arm">
  <link name="world"/>
  <link name="post">
    <inertial>
      <origin xyz="0 0 0.5"/>
      <mass value="1"/>
      <inertia ixx="0.25" ixy="0" ixz="0" iyy="0.25" iyz="0" izz="0"/>
    </inertial>
  </link>
  <joint name="post" type="continuous">
    <parent link="world"/>
    <child link="post"/>
    <axis xyz="0 0 1"/>
  </joint>
  <link name="lid_at_hinge">
    <inertial>
      <origin xyz="-0.5 0 -0.25"/>
      <mass value="2"/>
      <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>
    </inertial>
  </link>
  <joint name="crank" type="revolute">
    <parent link="post"/>
    <child link="lid_at_hinge"/>
    <origin xyz="0.5 0 1.25"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1" upper="1.7976931348623157e+308" effort="0" velocity="0"/>
    <pycraft rotor_inertia="0.5"/>
  </joint>
  <link name="lid"/>
  <joint name="lid_fixed" type="fixed">
    <parent link="lid_at_hinge"/>
    <child link="lid"/>
    <origin xyz="-0.5 0 -0.25"/>
  </joint>
  <link name="knob"/>
  <joint name="knob_fixed" type="fixed">
    <parent link="lid_at_hinge"/>
    <child link="knob"/>
    <origin xyz="0.5 0 -0.25"/>
  </joint>
</robot>
"""


def test_names_that_are_taken(tmp_path):
    model = pc.Multibody("taken")
    for name, parent, point in (("world", None, (0, 0, 0)), ("a", "world", (1, 0, 0)), ("a_at_hinge", "a", (0, 0, 0))):
        model.add_body(name, parent, point=point, mass=1, hinge_name={"a": "a_fixed"}.get(name), inertia=np.eye(3))
    again = saved_and_loaded(model, tmp_path / "model.urdf")
    assert list(again.bodies) == ["world", "a_at_hinge_2", "a_at_hinge"] and "world_2" in again.nodes
    check_the_same(model, again)


@pytest.mark.parametrize("position", [(0, 0, 0), (1, 0, 0)])
def test_a_kept_root_is_the_root_link_where_it_is_at_the_origin(tmp_path, position):
    model = pc.Multibody("m", welds="keep")
    model.add_body("foot", hinge="weld", hinge_name="root", position=position, mass=1, inertia=np.eye(3))
    model.add_body("leg", "foot", mass=1, inertia=np.eye(3))
    model.add_node("mark", None, position=(0, 0, 1))
    again = saved_and_loaded(model, tmp_path / "m.urdf", welds="keep")
    assert set(again.bodies) == {"foot", "leg", "mark"} | ({"world"} if any(position) else set())
    check_the_same(model, again)


def test_what_a_file_gave_beside_the_model_is_given_again(tmp_path):
    """Bounds of a joint without limits; what was left aside before an edit is not taken for other coordinates."""
    text = '<limit effort="10" velocity="0"/><dynamics damping="2" friction="0"/>'
    moments = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    links = f'<link name="a"/><link name="b"><inertial><mass value="1"/>{moments}</inertial></link>'
    joint = f'<joint name="j" type="continuous"><parent link="a"/><child link="b"/>{text}</joint>'
    (tmp_path / "m.urdf").write_text(f'<robot name="m">{links}{joint}</robot>')
    model = loaded(tmp_path / "m.urdf")
    assert {name: values.tolist() for name, values in model.left_aside.items()} == {"effort limit": [10], "damping": [2]}
    again = saved_and_loaded(model, tmp_path / "again.urdf")
    assert differences(model.left_aside, again.left_aside) == []
    model.add_body("tool", "b", mass=1, inertia=np.eye(3))
    with pytest.warns(pc.ModelWarning, match="its left_aside is not saved"):
        model.save(tmp_path / "again.urdf")
    assert loaded(tmp_path / "again.urdf").left_aside == {}


def test_a_custom_hinge_of_one_part_is_that_part(tmp_path):
    model = pc.Multibody("m")
    model.add_body("a", hinge="custom", subhinges=[{"kind": "pin", "axis": (0, 1, 0), "point": (1, 0, 0)}], mass=1, inertia=np.eye(3))
    again = saved_and_loaded(model, tmp_path / "m.urdf")
    assert again.hinges["a"].kind == "pin"
    check_the_same(model, again)


# What URDF does not have ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "lacking"),
    [
        ("ball", "hinge 'hinge1' is of kind 'ball'"),
        ("screw", "hinge 'hinge1' is of kind 'screw'"),
        ("universal", "hinge 'hinge1' is of kind 'universal'"),
        ("gimbal", "hinge 'hinge1' is of kind 'gimbal'"),
        ("cylindrical", "hinge 'hinge1' is of kind 'cylindrical'"),
        ("custom", "hinge 'hinge1' is of kind 'custom' of pin, slider, pin"),
    ],
)
def test_hinges_that_urdf_does_not_have(tmp_path, kind, lacking):
    remedy = (
        "URDF has joints of type revolute, continuous, prismatic, fixed, planar and floating alone; save the model as .toml, which holds"
    )
    with pytest.raises(pc.ModelError) as caught:
        pc.tree([-1, 0], ["pin", kind], seed=1).save(tmp_path / "m.urdf")
    assert str(caught.value) == f"{tmp_path / 'm.urdf'}: {lacking}. {remedy} every hinge"
    assert not (tmp_path / "m.urdf").exists()


def test_many_of_them(tmp_path):
    with pytest.raises(pc.ModelError, match=r"hinge 'hinge0' .*; hinge 'hinge3' .*; \.\.\. \(9 in all\)\. URDF"):
        pc.chain(9, "ball").save(tmp_path / "m.urdf")


def test_planar_hinges_with_more_than_an_axis(tmp_path):
    model = pc.chain(1, "planar")
    model.hinges["hinge0"].limits = ([-1, -np.inf, -np.inf], [np.inf] * 3)
    with pytest.raises(pc.ModelError, match="hinge 'hinge0' is planar with limits"):
        model.save(tmp_path / "m.urdf")
    described = pc.chain(1, "planar").description()
    for subhinge, axis in zip(described["bodies"][0]["hinge"]["subhinges"], np.eye(3)[[1, 0, 2]], strict=True):
        subhinge["axis"] = axis * (-1 if axis[0] else 1)
    with pytest.raises(pc.ModelError, match="hinge 'hinge0' is planar with x and y of its own"):
        pc.Multibody.from_description(described).save(tmp_path / "m.urdf")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        (" a", "begins or ends with a blank"),
        ("a\x01", "has a character that XML does not have"),
        ("${a}", "reads as an expression of xacro"),
    ],
)
def test_names_that_urdf_does_not_have(tmp_path, name, why):
    model = pc.Multibody("m")
    model.add_body(name, mass=1)
    with pytest.raises(pc.ModelError, match=why) as caught:
        model.save(tmp_path / "m.urdf")
    assert repr(name) in str(caught.value) and "save the model as .toml" in str(caught.value)


def test_names_with_marks_of_xml(tmp_path):
    model = pc.Multibody("<&>\n\"'")
    model.add_body("a\tb & <c/>", mass=1, inertia=np.eye(3))
    again = saved_and_loaded(model, tmp_path / "m.urdf")
    assert again.name == model.name and list(again.bodies) == list(model.bodies)


def test_what_is_not_written_is_said(tmp_path):
    arm = pc.chain(2)
    arm.gravity, arm.q = (0, 0, -9.81), [1, 2]
    with pytest.warns(pc.ModelWarning) as told:
        arm.save(tmp_path / "arm.urdf")
    text = "a URDF file does not hold gravity (0.0, 0.0, -9.81), the state q, v; a .toml file does"
    assert [str(w.message) for w in told] == [f"{tmp_path / 'arm.urdf'}: {text}"] and told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pc.chain(2).save(tmp_path / "arm.urdf")


# Other readers --------------------------------------------------------------------------------------------------------


@pytest.mark.peers
@pytest.mark.parametrize("name", pc.robots.names())
def test_pinocchio_reads_robots(tmp_path, name):
    pin = pytest.importorskip("pinocchio")
    robot = getattr(pc.robots, name)()
    robot.save(tmp_path / "robot.urdf")
    assert pc.compare(robot, pin.buildModelFromUrdf(str(tmp_path / "robot.urdf")))


@pytest.mark.peers
@pytest.mark.parametrize("seed", range(12))
def test_pinocchio_reads_trees(tmp_path, seed):
    """Pins off their bodies' origins, travels, welds and limits on one side; its planar joint is about z alone."""
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(seed)
    kinds = [str(rng.choice(KINDS[:4], p=[0.5, 0.3, 0.1, 0.1])) for _ in range(8)]
    model = pc.tree([int(rng.integers(-1, k)) if k else -1 for k in range(8)], kinds, seed=seed)
    for hinge in model.hinges.values():
        if hinge.kind != "free":
            hinge.limits = ((-1, 2), (-np.inf, 1), (-1, np.inf), None)[int(rng.integers(4))]
    model.save(tmp_path / "tree.urdf")
    theirs = pin.buildModelFromUrdf(str(tmp_path / "tree.urdf"))
    again = pc.load(tmp_path / "tree.urdf")
    assert pc.compare(again, theirs)
    check_the_same(model, again)
    q = pin.neutral(theirs)
    data = theirs.createData()
    pin.framesForwardKinematics(theirs, data, q)
    for name in (*model.bodies, *model.nodes):
        close(data.oMf[theirs.getFrameId(name)].homogeneous, model.pose(name, model.zero_q()))


@pytest.mark.peers
@pytest.mark.parametrize("name", ["panda", "ur5", "a1", "g1"])
def test_mujoco_reads_robots(tmp_path, name):
    mujoco = pytest.importorskip("mujoco")
    robot = getattr(pc.robots, name)()
    robot.save(tmp_path / "robot.urdf")
    theirs = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.urdf"))
    assert (theirs.nv, theirs.nq) == (robot.nv, robot.nq)
    assert theirs.body_mass.sum() == pytest.approx(sum(body.mass for body in robot.bodies.values()), rel=1e-12)
