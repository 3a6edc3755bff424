"""A value set under a name that an object does not have is an error with the nearest name, not a number that nothing reads."""

import pickle

import numpy as np
import pytest

import pycraft as pc


@pytest.mark.parametrize(
    ("thing", "name", "says"),
    [
        (lambda a: a, "graviti", r"Multibody 'chain of 2 rods' takes no 'graviti'; did you mean 'gravity'\?"),
        (lambda a: a, "Gravity", r"did you mean 'gravity'\?"),
        (lambda a: a, "Q", r"did you mean 'q'\?"),
        (lambda a: a, "nv", "takes no 'nv', which cannot be set; settable: gravity, q, v"),
        (lambda a: a, "mass_matrix", "which cannot be set"),
        (lambda a: a, "xyzzy", "settable: gravity, q, v"),
        (lambda a: a.bodies["body0"], "Mass", r"Body 'body0' takes no 'Mass'; did you mean 'mass'\?"),
        (lambda a: a.bodies["body0"], "inertias", r"did you mean 'inertia'\?"),
        (lambda a: a.bodies["body0"], "name", "which cannot be set; settable: com, inertia, mass"),
        (lambda a: a.hinges["hinge0"], "rotor_inertias", r"did you mean 'rotor_inertia'\?"),
        (lambda a: a.hinges["hinge0"], "limit", r"did you mean 'limits'\?"),
        (lambda a: a.hinges["hinge0"], "kind", "which cannot be set"),
        (lambda a: a.nodes["tip"], "pose", "which cannot be set"),
        (lambda a: a.random_state(0), "V", r"a State takes no 'V'; did you mean 'v'\?"),
        (lambda a: a.soa, "phi2", "takes no 'phi2'"),
    ],
)
def test_misspelt(thing, name, says):
    arm = pc.chain(2)
    arm.add_node("tip", "body1")
    with pytest.raises(AttributeError, match=says) as caught:
        setattr(thing(arm), name, 1.0)
    assert isinstance(caught.value, pc.Error)


def test_what_is_set_is_still_set():
    arm = pc.chain(2)
    arm.gravity, arm.q, arm.v = (0, 0, -1), [1, 2], [3, 4]
    arm.bodies["body0"].mass = 3
    assert arm.gravity.tolist() == [0, 0, -1] and arm.q.tolist() == [1, 2] and arm.bodies["body0"].mass == 3
    state = arm.random_state(0)
    state.q = np.zeros(2)
    again = pickle.loads(pickle.dumps(state))
    assert again.q.tolist() == [0, 0] and np.array_equal(again.v, state.v)


def test_a_class_of_ones_own_has_attributes_of_its_own():
    class Robot(pc.Multibody):
        pass

    robot = Robot("mine")
    robot.owner = "me"
    assert robot.owner == "me"


# ---------------------------------------------------------------------- what files say beside a model
URDF = """<robot name="r"><link name="a"/><link name="b">{0}</link><link name="c">{0}</link><link name="d">{0}</link>
<joint name="one" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<dynamics damping="0.5" friction="0"/><limit lower="-1" upper="1" effort="10" velocity="3"/></joint>
<joint name="two" type="planar"><parent link="b"/><child link="c"/><dynamics damping="2"/></joint>
<joint name="three" type="continuous"><parent link="c"/><child link="d"/></joint></robot>""".format(
    '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
)


def test_urdf_says_once_what_is_left_aside(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(URDF)
    with pytest.warns(pc.ModelWarning) as said:
        arm = pc.load(path)
    text = "not in the model: joint damping (4 coordinates), effort limits (1 coordinate), velocity limits (1 coordinate)"
    assert [str(w.message) for w in said] == [f"{path}: {text}; pycraft.effects.from_model(model) makes effects of them"]
    nan = np.nan
    expected = {"damping": [0.5, 2, 2, 2, nan], "effort limit": [10, nan, nan, nan, nan], "velocity limit": [3, nan, nan, nan, nan]}
    assert arm.left_aside.keys() == expected.keys()
    for again in (arm, pickle.loads(pickle.dumps(arm))):
        for name, numbers in expected.items():
            np.testing.assert_array_equal(again.left_aside[name], numbers)
    motion = arm.integrate_ode(arm.q, np.ones(5), [0, 1.0], damping=np.nan_to_num(arm.left_aside["damping"]))
    assert motion.v[-1, 0] < 1
    with pytest.raises(pc.ModelError, match=r"gravity='file', and the file gives none"):
        pc.load(path, gravity="file")
    with pytest.raises(pc.ModelError, match="gravity='moon': give three numbers"):
        pc.load(path, gravity="moon")
    with pytest.raises(pc.ModelError, match="gravity takes 3 numbers"):
        pc.load(path, gravity=(0, 0))
    assert pc.load(path, gravity=(0, 0, -1.62)).gravity.tolist() == [0, 0, -1.62]


def test_a_file_without_anything_to_leave_aside_is_silent(tmp_path, recwarn):
    path = tmp_path / "r.urdf"
    path.write_text('<robot name="r"><link name="a"/></robot>')
    assert not pc.load(path).left_aside and not recwarn.list


@pytest.mark.peers
def test_mjcf_gravity_and_damping(tmp_path):
    pytest.importorskip("mujoco")
    path = tmp_path / "r.xml"
    path.write_text(
        '<mujoco><option gravity="0 1 -9"/><worldbody><body name="b"><freejoint/><geom size="1"/>'
        '<body name="c"><joint name="j" damping="2" stiffness="3" frictionloss="4"/><geom size="1"/></body></body></worldbody></mujoco>'
    )
    with pytest.warns(
        pc.ModelWarning, match=r'joint damping \(1 coord.*Gravity \(0.0, 1.0, -9.0\) of the file is not set; load\(..., gravity="file"\)'
    ):
        model = pc.load(path)
    assert not model.gravity.any()
    for name, number in (("damping", 2), ("stiffness", 3), ("friction", 4)):
        np.testing.assert_array_equal(model.left_aside[name], [np.nan] * 6 + [number])
    with pytest.warns(pc.ModelWarning) as said:
        model = pc.load(path, gravity="file")
    assert model.gravity.tolist() == [0, 1, -9] and "gravity" not in model.left_aside and "Gravity" not in str(said[0].message)


def test_robots_of_the_package_load_silently(recwarn):
    for name in pc.robots.names():
        getattr(pc.robots, name)()
    assert not recwarn.list
