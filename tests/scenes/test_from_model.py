"""Effects that a model's file speaks of: offered by name and number, none added until asked."""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc

E = pc.effects

LINK = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
URDF = f"""<robot name="r"><link name="a"/>{"".join(map(LINK.format, "bcde"))}
<joint name="one" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<dynamics damping="0.5" friction="0.2"/><limit lower="-1" upper="1" effort="10" velocity="3"/></joint>
<joint name="two" type="planar"><parent link="b"/><child link="c"/><dynamics damping="2"/></joint>
<joint name="three" type="continuous"><parent link="c"/><child link="d"/></joint>
<joint name="four" type="prismatic"><parent link="d"/><child link="e"/>
<limit lower="0" upper="1" effort="7" velocity="0"/></joint></robot>"""


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(URDF)
    with pytest.warns(pc.ModelWarning, match="not in the model: joint damping"):
        return pc.load(path)


def test_a_urdf_file(arm):
    offered = E.from_model(arm)
    assert [effect.kind() for effect in offered] == ["damping", "coulomb_friction", "torque_source"] and offered.notes == []
    damping, friction, source = offered
    assert damping.hinges == ["one", "two[0]", "two[1]", "two[2]"] and damping.coefficient.tolist() == [0.5, 2, 2, 2]
    assert friction.hinges == ["one"] and friction.level.tolist() == [0.2]
    assert source.hinges == ["one", "four"] and source.effort_limit.tolist() == [10, 7] and source.speed_limit.tolist() == [3, np.inf]
    assert not source.torque.any() and offered["damping"] is damping
    assert repr(offered).startswith("offered by 'r', none of it added yet:\n  damping: Damping(")
    with pytest.raises(KeyError, match="'r' offers no 'spring'; there are 'damping', 'coulomb_friction', 'torque_source'"):
        offered["spring"]
    scene, state = pc.Scene(arm), arm.random_state(1)
    assert not scene.effects  # asked for nothing yet
    forces = scene.add(*offered).evaluate(state.q, state.v).forces
    assert forces["damping"] == pytest.approx(-np.array([0.5, 2, 2, 2, 0, 0]) * state.v)
    for other in (copy.deepcopy(arm), pickle.loads(pickle.dumps(arm))):
        assert repr(E.from_model(other)) == repr(offered)


def test_the_models_own_gravity_is_offered(arm):
    arm.gravity = (0, 0, -1.62)
    assert E.from_model(arm)["gravity"].g == (0, 0, -1.62)
    assert list(E.from_model(pc.chain(2))) == [] and repr(E.from_model(pc.chain(2))) == "'chain of 2 rods' offers no effects"
    with pytest.raises(pc.ModelError, match="from_model takes a model, not 3"):
        E.from_model(3)


MJCF = """<mujoco><option gravity="0 0.5 -9"/><compiler angle="radian"/><worldbody>
<body name="base"><joint name="slide" type="slide" axis="1 0 0" damping="2" armature="0.3"/><geom size=".2"/>
<body name="arm" pos="0 0 1"><joint name="hinge" axis="0 1 0" stiffness="3" springref="0.4" frictionloss="0.2"/>
<geom size=".1" pos=".3 0 0"/>
<body name="hand" pos=".5 0 0"><joint name="ball" type="ball" stiffness="0.7" damping="0.1"/><geom size=".1" pos=".2 0 .1"/>
<body name="last" pos=".3 0 0"><joint name="two" axis="0 0 1"/><joint name="more" axis="1 0 0"/><geom size=".1" pos=".1 .1 0"/>
</body></body></body></body></worldbody>
<actuator><motor name="push" joint="slide" gear="3" forcerange="-2 2"/><position name="hold" joint="hinge" kp="5" kv="0.5" gear="2"/>
<velocity name="brake" joint="two" kv="0.6"/><motor name="twist" joint="more"/><motor name="again" joint="slide"/>
<general name="biased" joint="more" biastype="affine" biasprm="0.4 -2 -0.1"/>
<general name="curved" joint="hinge" gaintype="affine" gainprm="1 2 3"/>
<motor name="of ball" joint="ball"/><intvelocity name="lag" joint="hinge" kp="1" actrange="-1 1"/>
</actuator></mujoco>"""


@pytest.fixture
def machine(tmp_path):
    pytest.importorskip("mujoco")
    path = tmp_path / "m.xml"
    path.write_text(MJCF)
    with pytest.warns(pc.ModelWarning, match=r"joint springs \(4 coordinates\), 6 actuators; pycraft.effects.from_model\(model\)"):
        return path, pc.load(path)


@pytest.mark.peers
def test_an_mjcf_file(machine):
    _, model = machine
    offered = E.from_model(model)
    assert [e.kind() for e in offered] == ["gravity", "damping", "coulomb_friction", "spring", "torque_source", "servo", "torque_source"]
    assert offered[0].g == (0, 0.5, -9) and offered["spring"].rest == pytest.approx([0.4, 1, 0, 0, 0])
    assert offered["torque_source"].hinges == ["slide", "last[1]"] and offered["torque_source"].effort_limit.tolist() == [6, np.inf]
    servo = offered["servo"]
    assert servo.hinges == ["hinge", "last[0]", "last[1]"]
    assert (
        servo.stiffness == pytest.approx([20, 0, 2])
        and servo.damping == pytest.approx([2, 0.6, 0.1])
        and servo.target == pytest.approx([0, 0, 0.2])
    )
    assert offered.notes == [
        "actuator 'curved': its force is not affine in control, position and velocity",
        "actuator 'of ball': its joint has several coordinates",
        "actuator 'lag': it has a state of its own",
        "contacts (4 geoms)",
    ]
    assert model.hinges["slide"].rotor_inertia.tolist() == [0.3]  # armature is the model's own
    assert pickle.loads(pickle.dumps(model)).actuators == model.actuators and len(model.actuators) == 9


@pytest.mark.peers
def test_what_is_offered_moves_as_mujoco_does(machine):
    """All of it but dry friction, which MuJoCo solves as a constraint, and what is not offered."""
    import mujoco

    from pycraft.interop import mujoco as conventions

    path, model = machine
    m = mujoco.MjModel.from_xml_path(str(path))
    m.dof_frictionloss[:] = 0
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    m.actuator_gainprm[6:], m.actuator_biasprm[6:] = 0, 0
    d = mujoco.MjData(m)
    scene = pc.Scene(model).add(*E.from_model(model)).disable("coulomb_friction")
    for seed in range(3):
        state = model.random_state(seed)
        d.qpos[:], d.qvel[:] = conventions.to_mujoco(model, state.q, state.v)
        mujoco.mj_forward(m, d)
        ours = conventions.acceleration_to_mujoco(model, state.q, state.v, scene.evaluate(state.q, state.v).vdot)
        assert np.abs(ours - d.qacc).max() < 1e-8 * np.abs(d.qacc).max()
