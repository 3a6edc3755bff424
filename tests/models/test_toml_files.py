"""Models through TOML files: every number comes back to the last bit, and the text is one that a person reads and writes."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pycraft as pc
from pycraft.models.loaders.rotations import rotation_from_rpy
from pycraft.models.loaders.toml_reader import BODY
from support.descriptions import KINDS
from support.mechanisms import every_kind, with_hinges
from support.saved_models import differences, loaded, lost, saved_and_loaded

AXES = {"pin": 1, "slider": 1, "screw": 1, "universal": 2, "gimbal": 3, "cylindrical": 1, "planar": 1}
NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=True, width=64)
LENGTHS = st.floats(-1e150, 1e150)
SMALL = st.floats(-3, 3)


def vectors(numbers=LENGTHS, size=3):
    return st.lists(numbers, min_size=size, max_size=size)


@st.composite
def models(draw):
    """Trees of all kinds with anything on them that a model can have."""
    count = draw(st.integers(0, 5))
    kinds = [draw(st.sampled_from(KINDS)) for _ in range(count)]
    parents = [draw(st.integers(-1, k - 1)) for k in range(count)]
    plain = pc.tree(parents, kinds, seed=draw(st.integers(0, 9)), rotor_inertia=draw(st.booleans()), welds="keep")
    described = plain.description()
    names = draw(st.lists(NAMES, min_size=2 * count + 2, max_size=2 * count + 2, unique=True))
    described["name"] = draw(st.one_of(st.just(""), NAMES))
    described["gravity"], described["strict"] = draw(vectors()), draw(st.booleans())
    for k, body in enumerate(described["bodies"]):
        hinge = body["hinge"]
        body["name"] = names[k]
        hinge["name"] = draw(st.sampled_from([names[k], names[count + k]]))
        if draw(st.booleans()):
            body["mass"], body["com"] = abs(draw(LENGTHS)), draw(vectors())
        if draw(st.booleans()):
            hinge["placement"]["position"] = draw(vectors())
        if draw(st.booleans()):
            hinge["placement"]["rotation"] = rotation_from_rpy(*draw(vectors(SMALL)))
        if draw(st.booleans()) and hinge["subhinges"] and all(s["kind"] not in ("ball", "free") for s in hinge["subhinges"]):
            pairs = [sorted(draw(vectors(st.floats(-1e9, 1e9), 2))) for _ in hinge["subhinges"]]
            hinge["lower"], hinge["upper"] = [draw(st.sampled_from([low, -np.inf])) for low, _ in pairs], [high for _, high in pairs]
    described["nodes"] = [
        {
            "name": name,
            "body": draw(st.integers(-1, count - 1)),
            "rotation": rotation_from_rpy(*draw(vectors(SMALL))),
            "position": draw(vectors()),
        }
        for name in names[2 * count : 2 * count + draw(st.integers(0, 2))]
    ]
    model = pc.Multibody.from_description(described)
    if draw(st.booleans()):
        model.q = np.asarray(draw(vectors(st.floats(0.1, 5), model.nq)))
        model.v = np.asarray(draw(vectors(LENGTHS, model.nv)))
    if draw(st.booleans()):
        model._left_aside = {
            "gravity": np.array(draw(vectors())),
            "damping": np.array(draw(vectors(st.one_of(st.just(np.nan), st.just(np.inf), NUMBERS), model.nv))),
        }
    return model


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture])
@given(model=models())
def test_nothing_is_lost(model, tmp_path):
    assert lost(model, tmp_path / "model.toml") == []


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("welds", ["lump", "keep"])
@pytest.mark.parametrize("seed", [None, 0, 1])
def test_every_kind_of_hinge(tmp_path, kind, welds, seed):
    model = pc.chain(3, kind, seed=seed, welds=welds)
    state = model.random_state(1)
    model.q, model.v = state.q, state.v
    model.save(tmp_path / "chain.toml")
    again = pc.load(tmp_path / "chain.toml")
    assert differences(model.description(), again.description()) == []
    text = (tmp_path / "chain.toml").read_text()
    assert ("subhinges" in text) == (kind == "custom")  # axes, a point and a pitch are what is read of the others
    assert max(map(len, text.split("\n"))) < 180
    assert not model.nv or np.array_equal(model.mass_matrix(), again.mass_matrix())


@pytest.mark.parametrize("model", [every_kind(True), with_hinges("screw-ball-pin", "tree"), with_hinges("planar", "chain")])
def test_subhinges_by_axes_of_their_own(tmp_path, model):
    """Descriptions may have planar hinges with any two axes across the normal, which no axis alone says."""
    assert lost(model, tmp_path / "model.toml") == []


@pytest.mark.parametrize("name", pc.robots.names())
@pytest.mark.parametrize("welds", ["lump", "keep"])
def test_robots_of_the_package(tmp_path, name, welds):
    robot = getattr(pc.robots, name)(welds=welds)
    assert lost(robot, tmp_path / "robot.toml") == []
    again, q = loaded(tmp_path / "robot.toml"), robot.random_state(0).q
    assert np.array_equal(robot.mass_matrix(q), again.mass_matrix(q))
    bodies = (tmp_path / "robot.toml").read_text().partition("[[shapes]]")[0]
    assert "rotation" not in bodies or name == "ur5"  # rpy as in their URDF files


@pytest.mark.peers
def test_a_model_of_a_mujoco_file(tmp_path):
    pytest.importorskip("mujoco")
    text = (
        '<mujoco model="m"><compiler angle="radian"/><worldbody><body name="a" pos="1 2 3" quat="1 2 3 4">'
        '<joint name="j" pos=".1 .2 .3" damping="2" stiffness="3" armature=".1"/><joint name="k" type="slide" axis="1 1 0"/>'
        '<geom size=".1" pos=".3 0 0"/><site name="s" pos="0 0 1" euler=".1 .2 .3"/></body></worldbody></mujoco>'
    )
    (tmp_path / "m.xml").write_text(text)
    model = loaded(tmp_path / "m.xml")
    assert set(model.left_aside) == {"gravity", "damping", "stiffness"}
    assert lost(model, tmp_path / "m.toml") == []
    assert loaded(tmp_path / "m.toml", gravity="file").gravity.tolist() == [0, 0, -9.81]


@pytest.mark.peers
def test_springs_and_actuators_of_a_mujoco_file(tmp_path):
    """Rest positions of springs have the size of q, which is larger for a ball; actuators that are no effects keep their reason."""
    pytest.importorskip("mujoco")
    text = (
        '<mujoco model="m"><compiler angle="radian"/><worldbody><body name="a"><joint name="ball" type="ball" stiffness="2"/>'
        '<geom size=".1"/><site name="tip"/><body name="b" pos="1 0 0"><joint name="j" stiffness="3" springref="0.4"/><geom size=".1"/>'
        '</body></body></worldbody><actuator><motor name="push" joint="j" gear="50" forcerange="-3 4"/>'
        '<position name="hold" joint="j" kp="7" kv="2"/>'
        '<motor name="thrust" site="tip"/></actuator></mujoco>'
    )
    (tmp_path / "m.xml").write_text(text)
    model = loaded(tmp_path / "m.xml")
    assert model.left_aside["spring rest"].tolist() == [1, 0, 0, 0, 0.4] and len(model.actuators) == 3
    assert lost(model, tmp_path / "m.toml") == []
    again = loaded(tmp_path / "m.toml")
    assert repr(pc.effects.from_model(again)) == repr(pc.effects.from_model(model))


def test_edits_after_loading_and_long_ways_of_nodes(tmp_path):
    """Rotations that were multiplied many times and zeros with a sign come back as they are."""
    rng, model = np.random.default_rng(0), pc.Multibody("way")
    model.add_body("body", mass=1.0, com=(0.0, -0.0, 1.0), inertia=np.diag([1.0, 1.0, 1.0]))
    for k in range(300):
        rotation = rotation_from_rpy(*rng.uniform(-3, 3, 3))
        model.add_node(f"node{k}", f"node{k - 1}" if k else "body", rotation=rotation, position=rng.normal(size=3))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = [[1, -0.0, 0], [0, 1, -0.0], [-0.0, 0, 1]], [-0.0, 0, 5e-324]
    model.hinges["body"].placement = pose
    assert lost(model, tmp_path / "model.toml") == []
    gram = np.array([node.pose[:3, :3].T @ node.pose[:3, :3] for node in model.nodes.values()])
    assert abs(gram - np.eye(3)).max() < 2e-14


def test_what_a_file_looks_like(tmp_path):
    arm = pc.Multibody("arm")
    rod = dict(mass=1.5, com=(0.5, 0, 0), inertia=np.diag([0, 0.125, 0.125]))
    arm.add_body("upper", hinge="pin", axis=(0, 1, 0), hinge_name="shoulder", limits=(-1.5, np.inf), rotor_inertia=0.25, **rod)
    arm.add_body("lower", "upper", "universal", position=(1, 0, 0), rotation=rotation_from_rpy(0, 0, np.pi / 2), hinge_name="elbow", **rod)
    arm.add_node("tip", "lower", position=(1, 0, 0))
    arm.gravity = (0, 0, -9.81)
    arm.q = [0.1, 0, 0.25]
    arm.save(tmp_path / "arm.toml")
    assert (tmp_path / "arm.toml").read_bytes().decode() == ARM
    assert differences(arm.description(), pc.load(tmp_path / "arm.toml").description()) == []
    arm.save(tmp_path / "arm.toml", state=False)
    assert "[state" not in (tmp_path / "arm.toml").read_text()
    assert not pc.load(tmp_path / "arm.toml").q.any()


ARM = """\
# A model of PyCraft: SI units and radians. docs/models.md, Files, says what the keys mean.

format = 1
name = "arm"
gravity = [0, 0, -9.81]

[[bodies]]
name = "upper"
hinge = "pin"
hinge_name = "shoulder"
axis = [0, 1, 0]
limits = [-1.5, inf]
rotor_inertia = 0.25
mass = 1.5
com = [0.5, 0, 0]
inertia = { yy = 0.125, zz = 0.125 }

[[bodies]]
name = "lower"
parent = "upper"
hinge = "universal"
hinge_name = "elbow"
axes = [[1, 0, 0], [0, 1, 0]]
position = [1, 0, 0]
rpy = [0, 0, 1.5707963267948966]
mass = 1.5
com = [0.5, 0, 0]
inertia = { yy = 0.125, zz = 0.125 }

[[nodes]]
name = "tip"
body = "lower"
position = [1, 0, 0]

[state.q]
shoulder = 0.1
elbow = [0, 0.25]
"""


# Written by hand ------------------------------------------------------------------------------------------------------


@pytest.fixture
def load(tmp_path):
    """Loads the model of a text; options as those of `pc.load`."""

    def load(text, **options):
        (tmp_path / "model.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
        return pc.load(tmp_path / "model.toml", **options)

    return load


def test_a_table_says_what_an_argument_does(load):
    """Everything but the name has the default of `add_body`."""
    model, same = load('[[bodies]]\nname = "a"\nmass = 1\n'), pc.Multibody("model")
    same.add_body("a", mass=1)
    assert differences(model.description(), same.description()) == []


def test_bodies_and_nodes_in_any_order(load):
    text = (
        '[[nodes]]\nname = "n"\nbody = "b"\nposition = [0, 0, 1]\n'
        '[[bodies]]\nname = "c"\nparent = "n"\nmass = 1\nposition = [1, 0, 0]\n'
        '[[bodies]]\nname = "d"\nparent = "a"\nmass = 1\n'
        '[[bodies]]\nname = "b"\nparent = "a"\nmass = 1\n'
        '[[bodies]]\nname = "a"\nmass = 1\n'
    )
    model = load(text)
    assert list(model.bodies) == ["a", "d", "b", "c"]  # children in the order of their tables
    assert model.hinges["c"].placement[:3, 3].tolist() == [1, 0, 1]


def test_rotations_in_three_spellings(load):
    poses = [
        load(f'[[bodies]]\nname = "a"\nmass = 1\n{spelling}\n').hinges["a"].placement[:3, :3]
        for spelling in ("rotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]", "rpy = [0, 0, 1.5707963267948966]", "quaternion = [2, 0, 0, 2]")
    ]
    assert abs(poses[1] - poses[0]).max() < 1e-15 and abs(poses[2] - poses[0]).max() < 1e-15


def test_welds_in_a_file(load):
    text = '[[bodies]]\nname = "a"\nmass = 1\n[[bodies]]\nname = "b"\nparent = "a"\nhinge = "weld"\nmass = 2\n'
    assert list(load(text).bodies) == ["a"] and load(text).bodies["a"].mass == 3
    assert list(load(text, welds="keep").bodies) == list(load('welds = "keep"\n' + text).bodies) == ["a", "b"]
    assert list(load('welds = "keep"\n' + text, welds="lump").bodies) == ["a"]


def test_other_ways_to_write_toml(load):
    """Dotted keys, inline tables, comments, literal and multi-line strings, carriage returns, a byte order mark."""
    text = (
        '\ufeffname = """\nan \\\n  arm"""  # joined\r\n'
        "bodies = [\r\n  {name = 'a', inertia.xx = 1, inertia.yy = 1, inertia.zz = 1, mass = 1_000}, # [[\r\n]\r\n"
        "state.q.a = 0.5\r\n"
    )
    model = load(text)
    assert model.name == "an arm" and model.bodies["a"].mass == 1000 and model.q.tolist() == [0.5]
    assert model.bodies["a"].inertia.tolist() == np.eye(3).tolist()


def test_a_state_of_some_hinges(load):
    """The others are at zero: a quaternion is that of no rotation."""
    text = '[[bodies]]\nname = "a"\nmass = 1\n[[bodies]]\nname = "b"\nparent = "a"\nhinge = "ball"\nmass = 1\n'
    model = load(text + "[state]\nq.a = 0.5\nv.b = [1, 2, 3]")
    assert model.q.tolist() == [0.5, 1, 0, 0, 0] and model.v.tolist() == [0, 1, 2, 3]


def test_the_model_is_called_as_its_file(load):
    assert load("").name == "model" and load("").nv == 0 and load('name = ""').name == ""


def test_what_is_left_aside_is_told(load):
    text = '[[bodies]]\nname = "a"\nhinge = "universal"\nmass = 1\n[left_aside.damping]\n"a[1]" = 0.5\n'
    with pytest.warns(pc.ModelWarning, match=r"model\.toml: not in the model: joint damping \(1 coordinate\); pycraft.effects.from_model"):
        model = load(text)
    np.testing.assert_array_equal(model.left_aside["damping"], [np.nan, 0.5])


def test_gravity_of_a_file_and_of_a_call(load):
    text = "gravity = [0, 0, -9.81]"
    assert load(text).gravity[2] == load(text, gravity="file").gravity[2] == -9.81
    assert load(text, gravity=(0, -1, 0)).gravity.tolist() == [0, -1, 0]
    with pytest.raises(pc.ModelError, match="the file gives none"):
        load("", gravity="file")


def test_doubtful_numbers_are_told_with_their_line(load):
    with pytest.warns(pc.ModelWarning, match=r"model\.toml:2: body 'a' on hinge 'a' has no mass"):
        load('\n[[bodies]]\nname = "a"\n')
    thin = '[[bodies]]\nname = "a"\nmass = 1\ninertia = { xx = 1 }\n'
    with pytest.warns(pc.ModelWarning, match=r"model\.toml:1: body 'a': its principal moments .* triangle"):
        load(thin)
    with pytest.raises(pc.ModelError, match=r"model\.toml:4: body 'a': its principal moments"):
        load(thin, strict=True)
    with pytest.raises(pc.ModelError, match=r"model\.toml:5: body 'a': its principal moments"):
        load("strict = true\n" + thin)


def test_what_was_left_aside_before_an_edit_is_not_saved(tmp_path):
    arm = pc.robots.panda()
    arm.add_body("tool", "panda_link7", mass=1.0)
    with pytest.warns(pc.ModelWarning, match="its left_aside is not saved: damping of 7 coordinates"):
        arm.save(tmp_path / "arm.toml")
    assert loaded(tmp_path / "arm.toml").left_aside == {}


def test_actuators_of_coordinates_that_are_gone_are_not_saved(tmp_path):
    arm = pc.chain(2)
    lost = {"name": "push", "coordinate": "elbow", "gear": 1.0, "gain": 1.0, "bias": [0.0] * 3, "control": 0.0}
    lost |= {"force range": [-1.0, 1.0], "why not": None}
    arm._actuators = [lost, lost | {"name": "pull", "coordinate": arm.coordinate_names[0]}]
    with pytest.warns(pc.ModelWarning, match="at coordinates that it no longer has are not saved: push"):
        arm.save(tmp_path / "arm.toml")
    assert loaded(tmp_path / "arm.toml").actuators == arm.actuators[1:]


def test_saving(tmp_path):
    arm = pc.chain(2)
    with pytest.raises(pc.ModelError, match=r"arm\.yaml: a model's file ends in \.toml, .* \.urdf, .*, or \.xml, for what MJCF knows"):
        arm.save("arm.yaml")
    with pytest.raises(pc.ModelError, match="cannot be written: No such file"):
        arm.save(tmp_path / "nowhere" / "arm.toml")
    with pytest.raises(pc.ModelError, match="cannot be written: Is a directory"):
        (tmp_path / "folder.toml").mkdir()
        arm.save(tmp_path / "folder.toml")
    with pytest.raises(pc.ModelError, match="cannot be written: embedded null"):
        arm.save("a\x00.toml")
    with pytest.raises(pc.ModelError, match="at the path of a file, not at 3"):
        arm.save(3)
    arm.save(str(tmp_path / "ARM.TOML").encode())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert pc.load(tmp_path / "ARM.TOML").nv == 2
    assert differences(arm.description(), saved_and_loaded(arm, tmp_path / "arm.toml").description()) == []


def test_the_file_of_the_page(tmp_path):
    """docs/models.md: what it shows is read, and says what it claims."""
    page = (Path(__file__).parents[2] / "docs" / "models.md").read_text()
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.S)
    (tmp_path / "arm.toml").write_text(text)
    arm = loaded(tmp_path / "arm.toml")
    assert set(re.findall(r"^(\w+)", re.sub(r"\[.*?\]", "", text), re.M)) >= {"limits", "rotor_inertia", "subhinges", "rpy", "com"}
    assert (arm.nv, arm.coordinate_names) == (3, ["shoulder", "lower[0]", "lower[1]"])
    assert arm.q.tolist() == [0.1, 0.2, 0.05] and arm.left_aside["damping"][0] == 0.5 and arm.nodes["tip"].body.name == "lower"
    assert arm.loops.rows[4:] == ["closure: along z", "gear"] and arm.loops["gear"].jacobian().tolist() == [[1.0, 0.0, -3.0]]
    assert lost(arm, tmp_path / "again.toml") == []
    for key in BODY:
        assert re.search(rf"`?\b{key}\b", page), key
