"""MJCF files against MuJoCo itself: poses, mass matrix, inverse dynamics; names, what is left out; the conversion of states.

Both sides compute sums of some tens of products; MuJoCo normalises its quaternions in between. `ROUNDING` (oracle.py) covers it.
"""

import re
from dataclasses import astuple

import numpy as np
import pytest

import pycraft as pc
from pycraft.interop import mujoco as conventions
from support.oracle import agree, reference

SHAPES = '<geom type="box" size=".1 .2 .3" pos=".1 .2 -.1" euler="20 30 40" density="900"/><geom size=".1" pos="0 .3 0"/>'


def body(name, joints, inside="", pose='pos=".3 .1 -.2" euler="10 -20 30"'):
    return f'<body name="{name}" {pose}>{joints}{SHAPES}{inside}</body>'


MODELS = {
    "hinge": body("a", '<joint name="j" axis="1 2 3"/>'),
    "hinge through a point": body("a", '<joint name="j" axis="1 2 3" pos=".1 -.2 .3"/>'),
    "slide": body("a", '<joint name="j" type="slide" axis="1 2 3" pos=".1 -.2 .3"/>', body("b", '<joint name="k"/>')),
    "ball": body("a", '<joint name="j" type="ball" pos=".1 -.2 .3"/>', body("b", '<joint name="k"/>')),
    "free": body("a", '<freejoint name="j"/>', body("b", '<joint name="k" axis="0 1 0"/>')),
    "weld": body("a", '<joint name="j"/>', body("fixed", "", body("b", '<joint name="k"/>'))),
    "armature": body(
        "a",
        '<joint name="j" armature=".7"/>',
        body("b", '<joint name="k" type="ball" armature=".4"/>', body("c", '<joint name="l" type="slide" armature="2"/>')),
    ),
    "several joints": body(
        "a",
        '<joint name="x" axis="1 0 0" pos="0 .1 0" armature=".1"/><joint name="t" type="slide" axis="1 1 0" armature=".2"/>'
        '<joint name="y" axis="0 1 1" pos=".2 0 0" armature=".3"/>',
        body("b", '<joint name="s" type="slide"/><joint name="o" type="ball" pos="0 0 .1"/>'),
    ),
    "references": body(
        "a",
        '<joint name="x" axis="1 0 0" pos="0 .1 0" ref="30"/><joint name="t" type="slide" axis="1 1 0" ref=".4"/>'
        '<joint name="y" axis="0 1 1" pos=".2 0 0" ref="-50"/>',
        body("b", '<joint name="k" ref="70" pos=".1 .1 .1"/>'),
    ),
    "reference after a ball": body(
        "a",
        '<joint name="b" type="ball" pos=".1 .2 .3"/><joint name="t" type="slide" axis="1 1 0" ref=".4"/>',
    ),
    "two trees": body("a", '<freejoint name="j"/>', body("b", '<joint name="k"/>'))
    + body("c", '<joint name="l"/>', body("d", '<joint name="m" type="slide"/>') + body("e", '<joint name="n" type="ball"/>'))
    + body("f", '<freejoint name="o"/>'),
    "given inertias": '<body name="a" quat="1 2 3 4"><freejoint/><inertial pos=".1 .2 .3" mass="2" '
    'fullinertia=".3 .4 .5 .01 -.02 .03"/><body name="b" pos="0 0 1" axisangle="1 1 0 40"><joint/>'
    '<inertial pos="0 0 .1" mass="1" diaginertia=".1 .2 .25" euler="10 20 30"/></body></body>',
}


@pytest.fixture
def write(tmp_path):
    def write(world, rest=""):
        path = tmp_path / "scene.xml"
        path.write_text(f'<mujoco model="scene"><worldbody>{world}</worldbody>{rest}</mujoco>')
        return path

    return write


@pytest.fixture
def mujoco():
    return pytest.importorskip("mujoco")


def simulator(mujoco, path):
    """MuJoCo's model and data, without contacts and limits."""
    m = mujoco.MjModel.from_xml_path(str(path))
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return m, mujoco.MjData(m)


def mass_matrix(mujoco, m, d):
    columns = np.empty((m.nv, m.nv))
    for column, unit in zip(columns, np.eye(m.nv), strict=True):  # mj_fullM has changed its arguments between versions
        mujoco.mj_mulM(m, d, column, unit)
    return columns.T


# Against MuJoCo -------------------------------------------------------------------------------------------------------


@pytest.mark.peers
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("world", MODELS.values(), ids=MODELS)
@pytest.mark.parametrize("welds", ["lump", "keep"])
def test_agrees_with_mujoco(mujoco, write, world, welds, seed):
    path = write(world, '<option gravity="1 2 -9"/>')
    model = pc.load(path, welds=welds)
    m, d = simulator(mujoco, path)
    model.gravity = m.opt.gravity
    assert (model.nq, model.nv) == (m.nq, m.nv)
    (q, v), vdot = astuple(model.random_state(seed)), np.random.default_rng(seed).normal(size=model.nv)
    d.qpos, d.qvel = conventions.to_mujoco(model, q, v)
    mujoco.mj_forward(m, d)
    T = conventions.velocity_map(model, q)
    agree(T @ model.mass_matrix(q) @ T.T, mass_matrix(mujoco, m, d))
    turning = conventions.acceleration_to_mujoco(model, q, v, np.zeros(m.nv))  # world axes: qacc where vdot is zero
    agree(T @ model.bias_forces(q, v), d.qfrc_bias + mass_matrix(mujoco, m, d) @ turning)
    for k in range(1, m.nbody):
        pose = model.pose(m.body(k).name, q)
        agree(pose[:3, 3], d.xpos[k])
        agree(pose[:3, :3], d.xmat[k].reshape(3, 3))
    d.qacc = conventions.acceleration_to_mujoco(model, q, v, vdot)
    mujoco.mj_inverse(m, d)
    agree(T @ model.inverse_dynamics(q, v, vdot), d.qfrc_inverse)


@pytest.mark.peers
@pytest.mark.parametrize("world", MODELS.values(), ids=MODELS)
def test_agrees_with_the_oracle(mujoco, write, world):
    model = pc.load(write(world))
    q, v = astuple(model.random_state(5))
    description = model.description()
    agree(model.mass_matrix(q), reference.mass_matrix(description, q))
    agree(model.bias_forces(q, v), reference.bias_forces(description, q, v))


@pytest.mark.peers
def test_state_is_the_reference_configuration(mujoco, write):
    for world in MODELS.values():
        path = write(world)
        model, (m, d) = pc.load(path), simulator(mujoco, path)
        agree(conventions.to_mujoco(model, model.q, model.v)[0], m.qpos0)
        mujoco.mj_forward(m, d)
        agree(model.pose(m.body(m.nbody - 1).name, model.q)[:3, 3], d.xpos[m.nbody - 1])
        assert not model.gravity.any()


# Names and kinds ------------------------------------------------------------------------------------------------------


@pytest.mark.peers
def test_names(mujoco, write):
    several = '<joint name="lean"/><joint name="turn" axis="1 0 0"/>'
    nameless = f"<body><joint/>{SHAPES}</body>"
    world = body("torso", '<freejoint name="root"/>', body("hip", several) + body("lean_body", "<joint/>") + nameless)
    world += body("turn", '<joint name="one"/><joint name="other" axis="1 0 0"/>')  # a joint is called like this body
    world += '<body name="mount"><geom size=".1"/><site name="torso"/></body><site name="origin" pos="1 2 3"/>'
    model = pc.load(write(world))
    assert model.name == "scene"
    assert list(model.bodies) == ["torso", "hip", "lean_body", "body4", "turn"]
    assert list(model.hinges) == ["root", "hip", "lean_body", "body4", "one"]
    assert [hinge.kind for hinge in model.hinges.values()] == ["free", "custom", "pin", "pin", "custom"]
    assert model.coordinate_names[6:8] == ["hip[0]", "hip[1]"]
    assert set(model.nodes) == {"mount", "torso_site", "origin"}
    assert model.nodes["origin"].body is None and model.nodes["origin"].pose[:3, 3].tolist() == [1, 2, 3]


@pytest.mark.peers
def test_limits_and_armature(mujoco, write):
    several = '<joint name="x" range="-40 50" armature=".5"/><joint name="y" type="slide" armature=".6"/>'
    model = pc.load(write(body("a", several, body("b", '<joint name="s" type="slide" range="-1 2" limited="true"/>'))))
    lower, upper = model.hinges["a"].limits
    np.testing.assert_allclose([lower[0], upper[0]], np.radians([-40, 50]))
    assert (lower[1], upper[1]) == (-np.inf, np.inf)
    assert model.hinges["a"].rotor_inertia.tolist() == [0.5, 0.6]
    assert [x.tolist() for x in model.hinges["s"].limits] == [[-1], [2]]
    assert np.isfinite(model.random_state(0).q).all()


# What is left out, what is refused ------------------------------------------------------------------------------------


@pytest.mark.peers
def test_constraints_are_loops_or_left_out_by_name(mujoco, write):
    world = body("a", '<joint name="j"/>', body("b", '<joint name="k"/>'))
    rest = '<tendon><fixed name="cable" stiffness="3"><joint joint="j" coef="1"/></fixed></tendon><equality><joint name="gear" joint1="j"'
    rest += ' joint2="k"/><connect body1="a" body2="b" anchor="0 0 0"/><weld name="glue" body1="b"/></equality>'
    with pytest.warns(pc.ModelWarning) as caught:
        model = pc.load(write(world, rest))
    assert str(caught[0].message).endswith(
        "scene.xml: equality constraints are loops of the model, which direct calls and scenes do not keep: "
        "'gear', \"equality connect of 'a' and 'b'\", 'glue'"
    )
    assert "Not read, although it changes the motion: tendon 'cable' (stiffness)" in str(caught[1].message)
    assert model.not_read[0] == "tendon 'cable' (stiffness)"
    assert caught[0].filename == __file__ and model.nv == 2


@pytest.mark.peers
def test_plain_scenes_say_once_what_is_left_aside(mujoco, write):
    world = '<geom type="plane" size="1 1 1"/>' + body("a", '<joint name="j" damping="1" stiffness="2"/>')
    path = write(world, '<actuator><motor joint="j"/></actuator>')
    with pytest.warns(pc.ModelWarning) as caught:
        pc.load(path)
    assert len(caught) == 1 and caught[0].filename == __file__
    assert str(caught[0].message) == (
        f"{path}: not in the model: joint damping (1 coordinate), joint springs (1 coordinate), 1 actuator; "
        "pycraft.effects.from_model(model) makes effects of them. "
        'Gravity (0.0, 0.0, -9.81) of the file is not set; load(..., gravity="file") sets it. '
        "Not read, although it changes the motion: contacts (3 geoms)"
    )


@pytest.mark.peers
def test_armature_of_a_free_joint(mujoco, write, recwarn):
    """One for all six coordinates, as MJCF has it: MuJoCo's acts along the world's axes, ours along the body's: the same motion."""
    path = write(body("a", '<joint name="j" type="free" armature=".3"/>'))
    model = pc.load(path)
    assert not [w for w in recwarn if "armatures" in str(w.message)]
    (m, d), (q, v) = simulator(mujoco, path), astuple(model.random_state(0))
    d.qpos, d.qvel = conventions.to_mujoco(model, q, v)
    mujoco.mj_forward(m, d)
    T = conventions.velocity_map(model, q)
    agree(T @ model.mass_matrix(q) @ T.T, mass_matrix(mujoco, m, d))
    vdot = np.random.default_rng(1).uniform(-1, 1, 6)
    d.qacc = conventions.acceleration_to_mujoco(model, q, v, vdot)
    mujoco.mj_inverse(m, d)
    model.gravity = m.opt.gravity
    agree(model.inverse_dynamics(q, v, vdot), T.T @ d.qfrc_inverse)


@pytest.mark.peers
@pytest.mark.parametrize(
    ("world", "says"),
    [
        (
            "<body><joint/></body>",
            "MuJoCo refuses the file: Error: mass and inertia of moving bodies must be larger than mjMINVAL",
        ),
        (
            "<body><jiont/></body>",
            "MuJoCo refuses the file: XML Error: Schema violation: unrecognized element Element 'jiont', line",
        ),
    ],
)
def test_refused(mujoco, write, world, says):
    with pytest.raises(pc.ModelError) as caught:
        pc.load(write(world))
    text = str(caught.value)
    line = re.search(r", line (\d+)$", text)[1]
    assert f"scene.xml:{line}: {says}" in text


@pytest.mark.peers
def test_empty_world(mujoco, write):
    assert pc.load(write('<geom size="1"/>')).nv == 0
    assert list(pc.load(write(body("stone", ""))).nodes) == ["stone"]


# The conversion of states, which needs no MuJoCo ----------------------------------------------------------------------


def floating(placed):
    """Two free bodies around an arm, the second placed off the world's frame."""
    model = pc.Multibody("floating")
    inertia = np.diag([0.3, 0.4, 0.5])
    model.add_body("first", None, "free", mass=1, inertia=inertia)
    model.add_body("arm", "first", "ball", mass=1, inertia=inertia)
    rotation = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]]) if placed else np.eye(3)
    model.add_body("second", None, "free", mass=1, inertia=inertia, rotation=rotation, position=(1, 2, 3) if placed else (0, 0, 0))
    return model


@pytest.mark.parametrize("placed", [False, True])
def test_states_go_there_and_back(placed):
    model = floating(placed)
    states = [model.random_state(seed) for seed in range(4)]
    q, v = np.array([s.q for s in states]), np.array([s.v for s in states])
    qpos, qvel = conventions.to_mujoco(model, q, v)
    assert qpos.shape == (4, model.nq) and qvel.shape == (4, model.nv)
    back_q, back_v = conventions.from_mujoco(model, qpos, qvel)
    agree(back_q, q)
    agree(back_v, v)
    one = conventions.to_mujoco(model, q[2], v[2])
    agree(np.concatenate(one), np.concatenate([qpos[2], qvel[2]]))


@pytest.mark.parametrize("placed", [False, True])
def test_converted_velocities_are_rates_of_converted_positions(placed):
    """Origins in world axes move with qvel's linear part, bodies turn with its angular part."""
    model = floating(placed)
    q, v = astuple(model.random_state(1))
    step = 1e-6
    (qpos, qvel), (later, _) = (conventions.to_mujoco(model, model.integrate(q, s * v), v) for s in (0, step))
    for name, p, d in (("first", 0, 0), ("second", 11, 9)):
        agree((later - qpos)[p : p + 3] / step, qvel[d : d + 3], 1e-5)
        agree(qpos[p : p + 3], model.pose(name, q)[:3, 3])
        agree(conventions._rotations(qpos[p + 3 : p + 7]), model.pose(name, q)[:3, :3])
        assert qvel[d + 3 : d + 6].tolist() == v[d : d + 3].tolist()


def test_permutation_and_velocity_map():
    model = floating(placed=False)
    q, v = astuple(model.random_state(2))
    i, j = conventions.permutation(model)
    qpos, qvel = conventions.to_mujoco(model, q, v)
    assert qpos.tolist() == q[i].tolist()
    assert j[:9].tolist() == [3, 4, 5, 0, 1, 2, 6, 7, 8]
    T = conventions.velocity_map(model, q)
    agree(T @ v, qvel)
    agree(T @ T.T, np.eye(model.nv))


def test_conversion_errors():
    model = pc.tree([-1, 0], ["pin", "free"])
    with pytest.raises(pc.ModelError, match="hinge 'hinge1' of 'tree of 2' is free and not alone on the base"):
        conventions.permutation(model)
    model = pc.chain(1, "free")
    with pytest.raises(pc.ModelError, match=r"q of 'chain of 1 rods' takes 7 values, not an array \(6,\)"):
        conventions.to_mujoco(model, np.zeros(6), np.zeros(6))
    with pytest.raises(pc.ModelError, match="a free hinge's quaternion has zero length"):
        conventions.to_mujoco(model, np.zeros(7), np.zeros(6))
