"""Bad model files: every error says file, line, element and remedy, and is a ModelError (and ValueError)."""

import sys

import numpy as np
import pytest

import pycraft as pc

BASE = '<link name="base"/>'
MASS = '<mass value="1"/>'
INERTIA = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
ARM = f'<link name="arm"><inertial>{MASS}{INERTIA}</inertial></link>'


def joint(inside="", name="elbow", kind="revolute", parent="base", child="arm"):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>\n{inside}</joint>'


def inertial(inside):
    return f'<link name="arm"><inertial>\n{inside}</inertial></link>'


def text_of(path, text, **options):
    """Return the error of loading the text."""
    path.write_text(text)
    with pytest.raises(pc.ModelError) as caught:
        pc.load(path, **options)
    assert isinstance(caught.value, ValueError) and isinstance(caught.value, pc.Error)
    assert str(caught.value).startswith(str(path))
    return str(caught.value).removeprefix(str(path))


# Contents of a robot element from line 2 on, one part a line; then the line, and what the error says.
BAD = {
    "type": (
        [BASE, ARM, joint(kind="hinge")],
        4,
        "joint 'elbow' has the type 'hinge'; there are revolute, continuous, prismatic",
    ),
    "no type": ([BASE, ARM, '<joint name="elbow"/>'], 4, '<joint> has no type; give it one: type="..."'),
    "no joint name": ([BASE, ARM, joint(name="")], 4, '<joint> has no name; give it one: name="..."'),
    "no link name": ([BASE, "<link/>"], 3, '<link> has no name; give it one: name="..."'),
    "no parent": (
        [BASE, ARM, '<joint name="elbow" type="fixed"><child link="arm"/></joint>'],
        4,
        "joint 'elbow' has no <parent>; write <parent link=\"...\"/>",
    ),
    "no child": (
        [BASE, ARM, '<joint name="elbow" type="fixed"><parent link="base"/></joint>'],
        4,
        "joint 'elbow' has no <child>; write <child link=\"...\"/>",
    ),
    "empty parent": (
        [BASE, ARM, '<joint name="elbow" type="fixed">\n<parent/><child link="arm"/></joint>'],
        5,
        "<parent> of joint 'elbow' has no link; give it one: link=\"...\"",
    ),
    "unknown link": (
        [BASE, ARM, joint(child="arms")],
        4,
        "joint 'elbow' has the child 'arms', and no link has this name; add <link name=\"arms\"/> or correct the name (there are arm, ...)",
    ),
    "two parents": (
        [BASE, ARM, '<link name="rod"/>', joint(), joint(name="a", child="rod"), joint(name="b", parent="rod")],
        9,
        "link 'arm' has two parents, 'base' by joint 'elbow' (line 5) and 'rod' by joint 'b'; a model is a tree: take one joint out",
    ),
    "loop": (
        [BASE, ARM, '<link name="rod"/>', joint(parent="rod"), joint(name="back", parent="arm", child="rod")],
        7,
        "the links arm → rod → arm are a loop, by the joints 'back' (line 7), 'elbow' (line 5)",
    ),
    "loop of one": ([BASE, ARM, joint(parent="arm")], 4, "the links arm → arm are a loop, by the joints 'elbow' (line 4)"),
    "no root": (
        [ARM, '<link name="rod"/>', joint(parent="rod"), joint(name="back", parent="arm", child="rod")],
        None,
        "are a loop, by the joints",
    ),
    "two roots": (
        [BASE, ARM],
        3,
        "2 links have no parent: 'base' (line 2), 'arm' (line 3); join them to one root by fixed joints",
    ),
    "no links": ([], 1, "robot 'r' has no links; a robot has one at least"),
    "two links of a name": (
        [BASE, ARM, '<link name="base"><inertial/></link>'],
        4,
        "link 'base' is defined twice, first in line 2; rename one",
    ),
    "two joints of a name": ([BASE, ARM, joint(), joint("<origin/>")], 6, "joint 'elbow' is defined twice, first in line 4; rename one"),
    "two origins": (
        [BASE, ARM, joint("<origin/>\n<origin xyz='1 0 0'/>")],
        6,
        "joint 'elbow' has 2 elements <origin> that differ, the first in line 5; keep one",
    ),
    "word in xyz": (
        [BASE, ARM, joint('<origin xyz="0 0,5 0"/>')],
        5,
        "joint 'elbow': <origin> xyz=\"0 0,5 0\": '0,5' is not a number; write 3 numbers separated by blanks, with a decimal point",
    ),
    "two numbers in rpy": (
        [BASE, ARM, joint('<origin rpy="0 0"/>')],
        5,
        "joint 'elbow': <origin> rpy=\"0 0\" has 2 values; write 3 numbers separated by blanks",
    ),
    "no numbers in axis": ([BASE, ARM, joint('<axis xyz=""/>')], 5, "joint 'elbow': <axis> xyz=\"\" has 0 values"),
    "four numbers in axis": (
        [BASE, ARM, joint('<axis xyz="0 0 0 1"/>')],
        5,
        "joint 'elbow': <axis> xyz=\"0 0 0 1\" has 4 values",
    ),
    "nan": (
        [BASE, ARM, joint('<origin xyz="0 nan 0"/>')],
        5,
        "joint 'elbow': <origin> xyz=\"0 nan 0\": 'nan' is not a finite number",
    ),
    "inf": ([BASE, ARM, joint('<origin rpy="0 inf 0"/>')], 5, "'inf' is not a finite number"),
    "underscore": ([BASE, ARM, joint('<origin xyz="0 1_0 0"/>')], 5, "'1_0' is not a number"),
    "zero axis": ([BASE, ARM, joint('<axis xyz="0 0 0"/>')], 5, "joint 'elbow': its axis has length 0; give a direction"),
    "zero quaternion": (
        [BASE, ARM, joint('<origin quat_xyzw="0 0 0 0"/>')],
        5,
        "joint 'elbow': <origin> quat_xyzw has length 0; the identity is 0 0 0 1",
    ),
    "rpy and quaternion": (
        [BASE, ARM, joint('<origin rpy="0 0 0" quat_xyzw="0 0 0 1"/>')],
        5,
        "joint 'elbow': <origin> has rpy and quat_xyzw; give one of them",
    ),
    "nan limit": (
        [BASE, ARM, joint('<limit lower="nan"/>')],
        5,
        "joint 'elbow': <limit> lower=\"nan\": 'nan' is not a finite number",
    ),
    "no mass": ([BASE, inertial(INERTIA), joint()], 3, "link 'arm' has no <mass>; write <mass value=\"...\"/> in kg"),
    "no inertia": (
        [BASE, inertial(MASS), joint()],
        3,
        "link 'arm' has no <inertia>; write it with six moments, zeros for a point",
    ),
    "five moments": (
        [BASE, inertial(MASS + INERTIA.replace('izz="1"', "")), joint()],
        4,
        "link 'arm': <inertia> izz is missing; write it",
    ),
    "word in inertia": (
        [BASE, inertial(MASS + INERTIA.replace('ixz="0"', 'ixz="O"')), joint()],
        4,
        "link 'arm': <inertia> ixz=\"O\": 'O' is not a number; write one number, with a decimal point",
    ),
    "mass without value": ([BASE, inertial("<mass/>" + INERTIA), joint()], 4, "link 'arm': <mass> value is missing; write it"),
    "negative mass": (
        [BASE, inertial('<mass value="-2"/>\n' + INERTIA), joint()],
        4,
        "link 'arm': its mass is -2 kg; a mass is not negative",
    ),
    "indefinite inertia": (
        [BASE, inertial(MASS + "\n" + INERTIA.replace('iyy="1"', 'iyy="-1"')), joint()],
        5,
        "link 'arm': its inertia has the principal moment -1 kg m²; an inertia is positive semidefinite",
    ),
    "indefinite inertia of the root": (
        [inertial(MASS + "\n" + INERTIA.replace('iyy="1"', 'iyy="-1"'))],
        4,
        "link 'arm': its inertia has the principal moment -1 kg m²",
    ),
    "negative rotor inertia": (
        [BASE, ARM, joint('<pycraft rotor_inertia="-1"/>')],
        5,
        "joint 'elbow': rotor inertia -1 is not a nonnegative number",
    ),
    "two rotor inertias": (
        [BASE, ARM, joint('<pycraft rotor_inertia="1 2"/>')],
        5,
        "joint 'elbow' takes 1 rotor inertia, one for each coordinate, not 2",
    ),
    "rotor of a weld": (
        [BASE, ARM, joint('<pycraft rotor_inertia="1"/>', kind="fixed")],
        5,
        "joint 'elbow' takes 0 rotor inertias, one for each coordinate, not 1",
    ),
    "unknown attribute of ours": (
        [BASE, ARM, joint('<pycraft rotor="1"/>')],
        5,
        "joint 'elbow': <pycraft> has the attribute 'rotor'; there is rotor_inertia",
    ),
    "xacro expression": (
        [BASE, ARM, joint('<origin xyz="0 0 ${length}"/>')],
        5,
        '<origin>: xyz="0 0 ${length}" is a xacro expression; expand the file first: pip install xacro, then xacro file.xacro > file.urdf',
    ),
    "xacro substitution": ([BASE, '<link name="$(arg name)"/>'], 3, 'name="$(arg name)" is a xacro expression'),
}


@pytest.mark.parametrize(("lines", "line", "says"), BAD.values(), ids=BAD)
def test_bad_urdf(tmp_path, lines, line, says):
    text = text_of(tmp_path / "bad.urdf", "\n".join(['<robot name="r">', *lines, "</robot>"]))
    assert text.startswith(f":{line}: " if line else ":")
    assert says in text


# Mimic joints, roots, options -----------------------------------------------------------------------------------------

MIMIC = [BASE, ARM, '<link name="tip"/>', joint(), joint('<mimic joint="elbow"/>', name="follower", parent="arm", child="tip")]


def robot(*lines):
    return "\n".join(['<robot name="r">', *lines, "</robot>"])


def test_mimic_is_refused_by_name(tmp_path):
    assert text_of(tmp_path / "hand.urdf", robot(*MIMIC), mimic="refuse") == (
        ":8: mimic=\"refuse\", and joints follow others: 'follower' follows 'elbow' (line 8); "
        'mimic="couple" makes couplings of them, which are loops of the model, mimic="lock" welds them at their offsets, '
        'mimic="free" lets them move on their own'
    )


@pytest.mark.parametrize(
    ("mimic", "kind", "says"),
    [
        ('<mimic joint="elbows"/>', "revolute", "joint 'follower' follows 'elbows', and no joint has this name; correct it, or"),
        ('<mimic joint="follower"/>', "revolute", "joints follow each other in a circle: follower → follower; correct them, or"),
        ('<mimic joint="elbow"/>', "planar", "joint 'follower' of type 'planar' has no single coordinate that could follow"),
        ('<mimic joint="elbow" offset="x"/>', "revolute", "joint 'follower': <mimic> offset=\"x\": 'x' is not a number"),
        ("<mimic/>", "revolute", "<mimic> of joint 'follower' has no joint; give it one"),
    ],
)
def test_bad_mimic(tmp_path, mimic, kind, says):
    lines = [*MIMIC[:-1], joint(mimic, "follower", kind, "arm", "tip")]
    for how in ("lock", "couple"):
        text = text_of(tmp_path / "hand.urdf", robot(*lines), mimic=how)
        assert text.startswith(":8: ") and says in text


def test_a_joint_that_follows_one_of_many_coordinates(tmp_path):
    lines = [*MIMIC[:3], joint(kind="planar"), joint('<mimic joint="elbow"/>', name="follower", parent="arm", child="tip")]
    text = text_of(tmp_path / "hand.urdf", robot(*lines), mimic="couple")
    assert text.startswith(":8: ") and "joint 'follower' follows 'elbow', which has no single coordinate; load with mimic=\"free\"" in text


def test_a_joint_called_root_under_a_free_root(tmp_path):
    text = text_of(tmp_path / "r.urdf", robot(BASE, ARM, joint(name="root")), root="free")
    assert text == (':4: joint \'root\' has the name of the free hinge that root="free" adds; rename it, or load with root="fixed"')


def test_a_violated_triangle_inequality_under_strict(tmp_path):
    flat = inertial(MASS + INERTIA.replace('izz="1"', 'izz="3"'))
    text = text_of(tmp_path / "r.urdf", robot(BASE, flat, joint()), strict=True)
    assert text.startswith(":4: link 'arm': its principal moments 1, 1, 3 kg m² violate the triangle inequality by 1")


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        ("root", "floating", "root='floating': there are 'fixed', 'free'"),
        ("mimic", "follow", "mimic='follow': there are 'couple', 'refuse', 'lock', 'free'"),
        ("welds", "drop", "welds='drop': there are 'lump', 'keep'"),
    ],
)
def test_options(tmp_path, option, value, says):
    path = tmp_path / "r.urdf"
    path.write_text(robot(BASE))
    with pytest.raises(pc.ModelError, match=says):
        pc.load(path, **{option: value})


# Files ----------------------------------------------------------------------------------------------------------------


def test_missing_file(tmp_path):
    path = tmp_path / "nowhere.urdf"
    with pytest.raises(pc.ModelError) as caught:
        pc.load(path)
    assert str(caught.value) == f"{path}: cannot be read: No such file or directory"
    with pytest.raises(pc.ModelError, match="cannot be read: Is a directory"):
        pc.load(tmp_path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", ":1: not well-formed XML: Document is empty"),
        ("solid cube", ":1: not well-formed XML: Start tag expected"),
        ("<robot>\n<link>\n</robot>", ":3: not well-formed XML: Opening and ending tag mismatch: link line 2 and robot"),
        ("<robot>\n<link name=arm/></robot>", ":2: not well-formed XML: AttValue"),
        (
            "<scene version='1.6'/>",
            ":1: <scene> is not the root element of a format that pycraft reads; there are <robot> (URDF), <sdf> (SDF) and <mujoco> ",
        ),
        (
            '<!DOCTYPE robot [<!ENTITY length "1">]>\n<robot/>',
            ":2: the file declares entities (length), which are not expanded; write their text out",
        ),
        ('<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/hostname">]>\n<robot>&x;</robot>', ":2: the file declares entities (x)"),
        ("<robot>\n&x;</robot>", ":2: not well-formed XML: Entity 'x' not defined"),
    ],
)
def test_not_a_robot(tmp_path, text, says):
    assert text_of(tmp_path / "bad.urdf", text).startswith(says)


def test_xacro_file(tmp_path):
    text = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n<xacro:property name="l" value="1"/></robot>'
    assert text_of(tmp_path / "arm.xacro", text) == (
        ":2: <property> is a xacro macro; expand the file first: pip install xacro, then xacro file.xacro > file.urdf"
    )
    path = tmp_path / "expanded.urdf"  # expanded files keep the declaration
    path.write_text('<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a"/></robot>')
    assert pc.load(path).nv == 0


@pytest.mark.parametrize("as_given", [str, str.encode])
def test_the_text_of_a_model_is_no_path(as_given):
    text = "\n<robot name='r'>" + "<link name='a'/>" * 10000 + "</robot>"
    with pytest.raises(pc.ModelError, match="write \"<robot name='r'>.*to a file") as caught:
        pc.load(as_given(text))
    assert len(str(caught.value)) < 200


def test_mjcf_without_its_package(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    path = tmp_path / "arm.xml"
    path.write_text("<mujoco><worldbody/></mujoco>")
    says = r"arm.xml: MJCF files are read by the package mujoco.*pip install 'pycraft-soa\[mjcf\]'"
    with pytest.raises(pc.Error, match=says) as caught:
        pc.load(path)
    assert isinstance(caught.value, ImportError)


def test_mjcf_says_its_root_itself(tmp_path):
    text = text_of(tmp_path / "arm.xml", "<mujoco>\n<worldbody/></mujoco>", root="free")
    assert text == ':1: root="free" is for URDF files; in an MJCF file give the body a <freejoint name="root"/>'


def test_how_exact_an_inertia_must_be():
    """Symmetric to nine digits, or refused; the triangle inequality to nine digits, or warned of."""
    model = pc.chain(1)
    body = model.bodies["body0"]
    askew = np.diag([1.0, 1.0, 1.5])
    for off, refused in ((1e-6, True), (1e-11, False)):
        askew[0, 1] = off
        if refused:
            with pytest.raises(pc.ModelError, match="is not symmetric"):
                body.inertia = askew
        else:
            body.inertia = askew
    model.take_warnings()
    body.inertia = np.diag([1.0, 1.0, 2.0])
    assert not model.take_warnings()
    body.inertia = np.diag([1.0, 1.0, 2.0 + 1e-6])
    assert ["triangle inequality" in str(said) for said in model.take_warnings()] == [True]


def test_complex_entries_among_objects_are_refused_as_such():
    with pytest.raises(pc.ModelError, match="complex"):
        pc.chain(2).mass_matrix(np.array([0.1, 0.2j], object))
