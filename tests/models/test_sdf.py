"""SDF files: frames, joints of every type, inertias, what stands beside a model, worlds, loops, and what a file gets wrong."""

import re
import warnings
from dataclasses import astuple

import numpy as np
import pytest

import pycraft as pc
from support.oracle import agree, reference
from support.sdf_texts import random_tree, tree_as_sdf

INERTIAL = "<inertial><pose>.1 .2 .3 0 0 0</pose><mass>2</mass><inertia><ixx>.3</ixx><iyy>.4</iyy><izz>.5</izz></inertia></inertial>"


def link(name, inside="", inertial=INERTIAL):
    return f'<link name="{name}">{inside}{inertial}</link>\n'


def joint(name, parent, child, kind="revolute", inside="<axis><xyz>0 1 0</xyz></axis>"):
    return f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>{inside}</joint>\n'


@pytest.fixture
def load(tmp_path):
    def load(*contents, version="1.9", attributes="", world="", **options):
        path = tmp_path / "robot.sdf"
        model = f'<model name="robot"{attributes}>\n{"".join(contents)}</model>'
        path.write_text(f'<sdf version="{version}">{f"<world name={chr(34)}w{chr(34)}>{world}{model}</world>" if world else model}</sdf>')
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pc.ModelWarning)
            return pc.load(path, **options)

    return load


# Frames and joints ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(25))
def test_trees_with_poses_relative_to_drawn_frames(tmp_path, seed):
    """Angles of poses have 16 digits and are composed some ten times: 1e-12 covers that."""
    truth = random_tree(seed)
    text, frames = tree_as_sdf(truth, seed)
    path = tmp_path / "tree.sdf"
    path.write_text(text)
    model = pc.load(path)
    assert list(model.bodies) == list(truth.bodies) and list(model.hinges) == list(truth.hinges) and model.name == truth.name
    assert [h.kind for h in model.hinges.values()] == [h.kind for h in truth.hinges.values()]
    q, v = astuple(truth.random_state(seed))
    vdot = np.random.default_rng(seed).normal(size=truth.nv)
    scale = np.abs(truth.mass_matrix(q)).max()
    assert np.abs(model.mass_matrix(q) - truth.mass_matrix(q)).max() < 1e-12 * scale
    expected = truth.inverse_dynamics(q, v, vdot)
    assert np.abs(model.inverse_dynamics(q, v, vdot) - expected).max() < 1e-11 * (1 + np.abs(expected).max())
    zero = truth.zero_q()
    for name in (*model.bodies, *(f"frame{k}" for k in range(4))):
        assert np.abs(model.pose(name, zero) - frames[name]).max() < 1e-12 * (1 + np.abs(frames[name]).max())
    assert model.pose(list(model.bodies)[-1], q) == pytest.approx(truth.pose(list(truth.bodies)[-1], q), abs=1e-11)


def test_a_pendulum_in_closed_form(load):
    """m g l sin of the angle from the hanging, about a joint half a metre above the link's origin."""
    inertial = "<inertial><mass>3</mass><inertia><ixx>.1</ixx><iyy>.2</iyy><izz>.3</izz></inertia></inertial>"
    model = load(
        link("bob", "<pose>0 0 -1 0 0 0</pose>", inertial),
        joint("j", "world", "bob", inside="<pose>0 0 .5 0 0 0</pose><axis><xyz>0 1 0</xyz></axis>"),
    )
    model.gravity = (0, 0, -9.81)
    assert model.nv == 1 and model.hinges["j"].kind == "pin"
    agree(model.mass_matrix([0.3]), [[0.2 + 3 * 0.25]])
    agree(model.forward_dynamics([0.3], [0.0], [0.0]), [-3 * 9.81 * 0.5 * np.sin(0.3) / 0.95])
    agree(model.pose("bob", [0.0])[:3, 3], [0, 0, -1])


def test_revolute2_is_two_pins_in_order(load):
    axes = "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 0 1</xyz></axis2>"
    model = load(link("a"), joint("j", "world", "a", "revolute2", axes))
    assert model.coordinate_names == ["j[0]", "j[1]"] and model.hinges["j"].kind == "custom"
    R = model.pose("a", [0.4, 0.7])[:3, :3]
    c, s = np.cos([0.4, 0.7]), np.sin([0.4, 0.7])
    agree(R, np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]]) @ [[c[1], -s[1], 0], [s[1], c[1], 0], [0, 0, 1]])


@pytest.mark.parametrize(
    ("inside", "pitch"),
    [("<screw_thread_pitch>.5</screw_thread_pitch>", 0.5), ("<thread_pitch>-12.566370614359172</thread_pitch>", 0.5), ("", 1.0)],
)
def test_pitch_of_screws(load, inside, pitch):
    """sdformat's own example: 0.5 m a turn is -12.566 rad/m; one metre by default."""
    model = load(link("a"), joint("j", "world", "a", "screw", inside + "<axis><xyz>0 0 1</xyz></axis>"))
    agree(model.pose("a", [2 * np.pi])[:3, 3], [0, 0, pitch])


def test_axes_of_old_versions_are_in_the_model(load):
    """Before 1.5 in the model's frame; until 1.6 by use_parent_model_frame; after that in the joint's."""
    turned, parent_frame = link("a", "<pose>0 0 0 1.5707963267948966 0 0</pose>"), "<use_parent_model_frame>1</use_parent_model_frame>"
    in_model, in_joint = [0, 1, 0], [0, 0, 1]  # the link's y axis points along z of the model
    for version, inside, axis in (
        ("1.4", "", in_model),
        ("1.6", "", in_joint),
        ("1.6", parent_frame, in_model),
        ("1.9", parent_frame, in_joint),
    ):
        model = load(turned, joint("j", "world", "a", inside=f"<axis><xyz>0 1 0</xyz>{inside}</axis>"), version=version)
        agree(model.pose("a", [0.0])[:3, :3] @ model._body(0)["hinge"]["subhinges"][0]["axis"], axis)


def test_frames_may_be_ends_and_are_nodes(load):
    frames = '<frame name="grip" attached_to="a"><pose>1 0 0 0 0 0</pose></frame>'
    frames += '<frame name="mark" attached_to="grip"><pose>0 2 0 0 0 0</pose></frame>'
    model = load(
        link("a"), link("b", '<pose relative_to="grip">0 0 1 0 0 0</pose>'), frames, joint("i", "world", "a"), joint("j", "grip", "b")
    )
    assert list(model.hinges) == ["i", "j"] and model.bodies["b"].parent.name == "a"
    agree(model.pose("mark", [0, 0])[:3, 3], [1, 2, 0])
    agree(model.pose("b", [0, 0])[:3, 3], [1, 0, 1])


def test_models_within_models(load):
    links = link("palm", "<pose>5 0 0 0 0 0</pose>") + link("tip", "<pose>6 0 0 0 0 0</pose>")
    inner = f'<model name="hand" placement_frame="palm"><pose relative_to="a">0 0 1 0 0 0</pose>{links}'
    inner += joint("bend", "palm", "tip") + "</model>"
    model = load(link("a", "<pose>0 3 0 0 0 0</pose>"), inner, joint("i", "world", "a"), joint("j", "a", "hand::palm", "fixed", ""))
    assert list(model.bodies) == ["a", "hand::tip"] and "hand::palm" in model.nodes
    agree(model.pose("hand::palm", [0, 0])[:3, 3], [0, 3, 1])
    agree(model.pose("hand::tip", [0, 0])[:3, 3], [1, 3, 1])


# Roots ----------------------------------------------------------------------------------------------------------------


def test_what_no_joint_carries_flies_from_where_it_stands(load):
    parts = link("a", "<pose>1 2 3 .1 .2 .3</pose>"), link("b"), joint("j", "a", "b")
    model = load(*parts)
    assert list(model.hinges) == ["root", "j"] and model.nv == 7
    agree(model.pose("a")[:3, 3], [1, 2, 3])
    fixed = load(*parts, root="fixed")
    assert fixed.nv == 1 and fixed.pose("a", [0.0]) == pytest.approx(model.pose("a"), abs=1e-15)
    agree(model.pose("b"), fixed.pose("b", [0.0]))
    assert load(*parts, joint("weld", "world", "a", "fixed", "")).nv == 1
    assert load(*parts, "<static>true</static>").nv == 0
    assert [*load(link("a"), link("b")).hinges] == ["root of a", "root of b"]


def test_worlds(load, tmp_path):
    model = load(link("a"), world="<gravity>0 0 -1.62</gravity>", gravity="file")
    assert model.gravity.tolist() == [0, 0, -1.62]
    two = "".join(f'<model name="{name}"><pose>{x} 0 0 0 0 0</pose>{link("a")}</model>' for name, x in (("one", 1), ("two", 2)))
    (tmp_path / "w.sdf").write_text(f'<sdf version="1.9"><world name="yard">{two}</world></sdf>')
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        both = pc.load(tmp_path / "w.sdf")
    assert list(both.bodies) == ["one::a", "two::a"] and both.name == "yard"
    agree(both.pose("two::a")[:3, 3], [2, 0, 0])


def test_further_joints_are_loops(load):
    ends = link("a"), link("b", "<pose>1 0 0 0 0 0</pose>"), joint("i", "world", "a"), joint("j", "a", "b")
    model = load(*ends, joint("close", "world", "b", inside="<pose>1 0 0 0 0 0</pose><axis><xyz>0 1 0</xyz></axis>"))
    assert list(model.loops) == ["close"] and model.nv == 2
    assert np.abs(model.loops.residual([0.0, 0.0])).max() < 1e-15
    assert model.constrained_dynamics([0.0, 0.0], [0.0, 0.0], [0.0, 0.0]).vdot == pytest.approx([0, 0], abs=1e-12)


# Beside the model -----------------------------------------------------------------------------------------------------


def test_what_effects_are_made_of(load):
    spring = "<spring_stiffness>4</spring_stiffness><spring_reference>.1</spring_reference>"
    dynamics = f"<dynamics><damping>.3</damping><friction>.2</friction>{spring}</dynamics>"
    limit = "<limit><lower>-1</lower><upper>1e16</upper><effort>5</effort><velocity>-1</velocity></limit>"
    model = load(link("a"), joint("j", "world", "a", inside=f"<axis><xyz>0 1 0</xyz>{dynamics}{limit}</axis>"))
    assert {k: v.tolist() for k, v in model.left_aside.items()} == {
        "damping": [0.3],
        "friction": [0.2],
        "stiffness": [4],
        "effort limit": [5],
        "spring rest": [0.1],
    }
    assert np.array(model.hinges["j"].limits).ravel().tolist() == [-1, np.inf]
    assert [e.kind() for e in pc.effects.from_model(model)] == ["damping", "coulomb_friction", "spring", "torque_source"]
    two = "<axis><xyz>1 0 0</xyz><dynamics><damping>1</damping></dynamics></axis>"
    two += "<axis2><xyz>0 1 0</xyz><dynamics><damping>2</damping></dynamics></axis2>"
    assert load(link("a"), joint("j", "world", "a", "universal", two)).left_aside["damping"].tolist() == [1, 2]


def test_a_link_without_gravity_is_held(load):
    model = load(link("a", "<gravity>false</gravity>"), joint("j", "world", "a"), link("b"), joint("k", "a", "b"))
    model.gravity = (0, 0, -9.81)
    scene = pc.Scene(model).add(*pc.effects.from_model(model))
    q = [0.4, -0.3]
    bias = model.bias_forces(q)
    J = model.jacobian("a", q, axes="aligned")
    R = model.pose("a", q)[:3, :3]
    lift = J.T @ np.r_[np.cross(R @ [0.1, 0.2, 0.3], [0, 0, 2 * 9.81]), 0, 0, 2 * 9.81]
    agree(scene.evaluate(q).vdot, np.linalg.solve(model.mass_matrix(q), lift - bias))


def test_followers_are_coupled(load):
    mimic = '<axis><xyz>0 1 0</xyz><mimic joint="j"><multiplier>2</multiplier><offset>.3</offset><reference>.1</reference></mimic></axis>'
    parts = link("a"), link("b"), joint("j", "world", "a"), joint("k", "a", "b", inside=mimic)
    model = load(*parts)
    assert list(model.loops) == ["k"]
    agree(model.loops.residual([0.5, 2 * (0.5 - 0.1) + 0.3]), [0])
    assert list(load(*parts, mimic="free").loops) == []
    with pytest.raises(pc.ModelError, match="mimic=\"refuse\", and joints follow others: 'k'"):
        load(*parts, mimic="refuse")


def test_shapes(load):
    red = "<material><diffuse>1 0 0 1</diffuse></material>"
    visual = f'<visual name="v"><pose>0 0 1 0 0 0</pose><geometry><box><size>1 2 3</size></box></geometry>{red}</visual>'
    shapes = (
        "<capsule><radius>.1</radius><length>2</length></capsule>",
        "<mesh><uri>model://r/a.stl</uri><scale>2 2 2</scale></mesh>",
        "<plane/>",
    )
    collisions = "".join(f'<collision name="c{k}"><geometry>{shape}</geometry></collision>' for k, shape in enumerate(shapes))
    model = load(link("a", visual + collisions))
    (box,) = model.shapes
    assert (box.kind, box.size, box.colour, box.placement[2, 3]) == ("box", (1, 2, 3), "#ff0000", 1)
    assert [(shape.kind, shape.size, shape.file) for shape in model.collision_shapes] == [
        ("capsule", (0.1, 2), ""),
        ("mesh", (2, 2, 2), "model://r/a.stl"),
    ]


def test_what_is_not_read_is_named(tmp_path):
    parts = '<plugin name="legs" filename="x.so"/>' + link(
        "a", "<velocity_decay><linear>.1</linear></velocity_decay><kinematic>1</kinematic>"
    )
    (tmp_path / "r.sdf").write_text(f'<sdf version="1.9"><model name="r">\n{parts}</model></sdf>')
    with pytest.warns(pc.ModelWarning) as caught:
        model = pc.load(tmp_path / "r.sdf")
    assert [text.split(" (line")[0] for text in model.not_read] == [
        "plugin 'legs' of model 'r'",
        "<kinematic>1</kinematic> of link 'a'",
        "<velocity_decay> of link 'a'",
    ]
    assert "Not read, although it changes the motion: plugin 'legs'" in str(caught[-1].message)


def test_agrees_with_the_oracle(load):
    model = load(
        link("a"), joint("j", "world", "a", "ball", ""), link("b", "<pose>1 .2 0 .3 0 0</pose>"), joint("k", "a", "b", "prismatic")
    )
    q, v = astuple(model.random_state(5))
    agree(model.mass_matrix(q), reference.mass_matrix(model.description(), q))
    agree(model.bias_forces(q, v), reference.bias_forces(model.description(), q, v))


def test_a_link_without_inertial_has_that_of_the_format(tmp_path):
    (tmp_path / "r.sdf").write_text('<sdf version="1.9"><model name="r"><link name="a"/></model></sdf>')
    with pytest.warns(pc.ModelWarning, match="r.sdf:1: link 'a' has no <inertial>, for which SDF has 1 kg"):
        model = pc.load(tmp_path / "r.sdf")
    assert model.bodies["a"].mass == 1 and np.array_equal(model.bodies["a"].inertia, np.eye(3))


# Wrong files ----------------------------------------------------------------------------------------------------------

WRONG = {
    "include": (
        ["<include><uri>model://x</uri></include>"],
        "model 'robot' includes 'model://x', and files that are included are not read",
    ),
    "no links": ([], "model 'robot' has no links"),
    "gearbox": ([link("a"), joint("j", "world", "a", "gearbox")], "joint 'j' is of type 'gearbox'; there are revolute,.*add_coupling"),
    "unknown end": (
        [link("arm"), joint("j", "world", "arn")],
        "joint 'j' names 'arn', and no link or frame has this name; did you mean 'arm'",
    ),
    "world as child": ([link("a"), joint("j", "a", "world")], "joint 'j' has the world for its child"),
    "one link": ([link("a"), joint("j", "a", "a")], "joint 'j' has link 'a' at both of its ends"),
    "no parent": ([link("a"), '<joint name="j" type="fixed"><child>a</child></joint>'], "joint 'j' has no <parent>"),
    "unknown frame": ([link("a", '<pose relative_to="b">0 0 0 0 0 0</pose>')], "link 'a' refers to the frame 'b', which does not exist"),
    "circle of poses": (
        [link("a", '<pose relative_to="b"/>'), link("b", '<pose relative_to="a"/>')],
        "poses are relative to each other in a circle: a → b → a",
    ),
    "circle of frames": (
        ['<frame name="f" attached_to="g"/><frame name="g" attached_to="f"/>', link("a")],
        "in a circle",
    ),
    "two of a name": ([link("a"), link("a")], "link 'a' has the name of the link in line 2; rename one"),
    "reserved": ([link("world")], "the name 'world' is reserved"),
    "five numbers": ([link("a", "<pose>0 0 0 0 0</pose>")], "link 'a': <pose> is '0 0 0 0 0'; write 6 numbers separated by blanks"),
    "a word": ([link("a", "<pose>0 0 O 0 0 0</pose>")], "link 'a': <pose> is '0 0 O 0 0 0'; write 6 numbers"),
    "an infinity": ([link("a", "<pose>0 0 inf 0 0 0</pose>")], "link 'a': <pose> is '0 0 inf 0 0 0'"),
    "no rotation": ([link("a", '<pose rotation_format="quat_xyzw">0 0 0 0 0 0 0</pose>')], "the quaternion of its <pose> has length 0"),
    "no axis": ([link("a"), joint("j", "world", "a", inside="<axis><xyz>0 0 0</xyz></axis>")], "joint 'j': its axis has no length"),
    "one axis of two": ([link("a"), joint("j", "world", "a", "universal")], "joint 'j' of type 'universal' has no <axis2>"),
    "no pitch": (
        [link("a"), joint("j", "world", "a", "screw", "<screw_thread_pitch>0</screw_thread_pitch>")],
        "<screw_thread_pitch> is zero",
    ),
    "limits": (
        [link("a"), joint("j", "world", "a", inside="<axis><xyz>1 0 0</xyz><limit><lower>1</lower><upper>0</upper></limit></axis>")],
        "joint 'j': its lower limit 1 lies above the upper one 0",
    ),
    "negative mass": ([link("a", "", INERTIAL.replace("<mass>2", "<mass>-2"))], "body 'a': its mass is -2 kg"),
    "automatic": ([link("a", "", '<inertial auto="true"/>')], "link 'a' has its inertia computed from its collisions"),
    "truth": ([link("a", "<gravity>no</gravity>")], "link 'a': <gravity> is 'no'; write true or false"),
    "canonical": ([link("a")], "its canonical_link 'b' is no link", ' canonical_link="b"'),
    "follows nothing": (
        [link("a"), joint("j", "world", "a", inside='<axis><xyz>1 0 0</xyz><mimic joint="k"/></axis>')],
        "joint 'j' follows 'k', and no joint has this name",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_a_file_gets_wrong(load, name):
    parts, said, *attributes = WRONG[name]
    with pytest.raises(pc.ModelError, match=said) as caught:
        load(*parts, attributes="".join(attributes))
    assert re.match(r".*robot\.sdf:\d+: ", str(caught.value))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('<sdf version="new"><model name="m"/></sdf>', "<sdf> has the version 'new'"),
        ('<sdf version="1.9"/>', "<sdf> has no <model>"),
        ('<sdf version="1.9"><world name="w"><include><uri>x</uri></include></world></sdf>', "the world includes 'x'"),
        ('<sdf version="1.9"><world name="w"/><world name="v"/></sdf>', "the file has 2 worlds"),
    ],
)
def test_wrong_files(tmp_path, text, said):
    (tmp_path / "r.sdf").write_text(text)
    with pytest.raises(pc.ModelError, match=said):
        pc.load(tmp_path / "r.sdf")


def test_long_chains_load_in_time_that_grows_with_them(tmp_path):
    n = 3000
    links = "".join(link(f"l{k}") for k in range(n))
    joints = "".join(joint(f"j{k}", f"l{k - 1}" if k else "world", f"l{k}") for k in range(n))
    (tmp_path / "r.sdf").write_text(f'<sdf version="1.9"><model name="m">{links}{joints}</model></sdf>')
    assert pc.load(tmp_path / "r.sdf").nv == n
