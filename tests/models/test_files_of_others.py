"""Files as other programs write and read them: what peers overlook is overlooked with a warning; foreign errors become ours."""

import warnings

import numpy as np
import pytest

import pycraft as pc
from pycraft.models.loaders import named_robots, urdf

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
LINKS = f'<link name="a"/><link name="b">{INERTIAL}</link>'
JOINT = '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/></joint>'
ROBOT = f'<robot name="r">{LINKS}\n{JOINT}\n</robot>'


@pytest.fixture
def load(tmp_path):
    """The model of a file with these bytes, and what was said of it."""

    def load(content, name="robot.urdf", **options):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            model = pc.load(path, **options)
        return model, [str(warning.message).removeprefix(str(path)) for warning in caught]

    return load


# XML ------------------------------------------------------------------------------------------------------------------

HEADS = {
    "version 0.0": ('<?xml version="0.0" ?>\n', ": the file declares XML version '0.0', which is none; it is read as XML 1.0"),
    "version 2": (
        "<?xml version='2' encoding='utf-8'?>",
        ": the file declares XML version '2', which is none; it is read as XML 1.0",
    ),
    "empty version": ('<?xml version=""?>', ": the file declares XML version '', which is none; it is read as XML 1.0"),
    "blanks": ('\n  <?xml version="1.0"?>', ":2: what comes before the XML declaration is ignored"),
    "a comment": ('<!-- by hand -->\n<?xml version="1.0"?>', ":2: what comes before the XML declaration is ignored"),
    "words": ('written by hand\n<?xml version="1.0"?>', ":2: what comes before the XML declaration is ignored"),
    "words alone": ("written by hand\n", ":1: text before the root element is ignored"),
}


@pytest.mark.parametrize("name", HEADS)
def test_what_stands_before_a_robot(load, name):
    head, said = HEADS[name]
    model, words = load(head + ROBOT)
    assert model.nv == 1 and words == [said]


@pytest.mark.parametrize(
    "head", ['<?xml version="1.0"?>', '<?xml version="1.1"?>', "\ufeff", '\ufeff<?xml version="1.0"?>', "", "<!-- by hand -->"]
)
def test_what_is_well_formed_is_silent(load, head):
    assert load(head + ROBOT)[1] == []


@pytest.mark.parametrize("tail", ["\nand so on", "<robot/>", "]]>"])
def test_what_stands_after_a_robot(load, tail):
    model, words = load(ROBOT + tail)
    assert model.nv == 1 and len(words) == 1 and "what comes after the end of the root element is ignored" in words[0]


def test_both_at_once_and_lines_stay_the_files_own(load, tmp_path):
    model, words = load('one\ntwo\n<?xml version="0.0"?>' + ROBOT + "end")
    assert model.nv == 1 and len(words) == 3
    (tmp_path / "bad.urdf").write_text('one\ntwo\n<?xml version="1.0"?>\n' + ROBOT.replace('mass value="1"', 'mass value="x"'))
    with pytest.raises(pc.ModelError, match=r"bad\.urdf:4: link 'b': <mass> value"):
        pc.load(tmp_path / "bad.urdf")


@pytest.mark.parametrize("text", ["<robot>", "<robot></rob>", "no robot at all", "", "<robot/><", '<?xml version="1.0"?>'])
def test_what_is_no_xml_is_refused(load, text):
    with pytest.raises(pc.ModelError, match="not well-formed XML|has no links"):
        load(text)


def test_a_head_without_end_takes_no_time(load):
    with pytest.raises(pc.ModelError):
        load("<?xml version='1" * 20000)


# URDF -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("missing", [("ixy",), ("ixy", "iyz"), ("ixy", "ixz", "iyz")])
def test_products_of_inertia_that_are_missing_are_zero(load, missing):
    text = ROBOT
    for name in missing:
        text = text.replace(f' {name}="0"', "")
    model, words = load(text)
    assert np.array_equal(model.bodies["b"].inertia, np.eye(3))
    assert words == [f":1: link 'b': {' and '.join(missing)} of its <inertia> are missing and taken for 0"]


def test_what_is_repeated_word_for_word_counts_once(load):
    twice = ROBOT.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/>\n<axis xyz="0 1 0"/>')
    model, words = load(twice)
    assert model.nv == 1 and words == [":3: joint 'j' repeats its <axis> of line 2; it counts once"]
    model, words = load(ROBOT.replace(LINKS, LINKS + '\n<link name="a"/>').replace(JOINT, JOINT + "\n" + JOINT))
    assert model.nv == 1 and len(words) == 2 and "link 'a' is repeated word for word, first in line 1; it counts once" in words[0]
    with pytest.raises(pc.ModelError, match="joint 'j' has 2 elements <axis> that differ"):
        load(twice.replace('\n<axis xyz="0 1 0"/>', '<axis xyz="1 0 0"/>'))


XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


@pytest.mark.parametrize(
    "text",
    [
        ROBOT.replace("</robot>", "<xacro:x/></robot>"),
        ROBOT.replace("</robot>", f"<xacro:property {XACRO} name='l' value='1'/></robot>"),
        ROBOT.replace(INERTIAL, INERTIAL + "<visual><xacro:x/></visual>"),
        ROBOT.replace(INERTIAL, INERTIAL + "<visual><geometry><mesh filename='$(find r)/a.stl'/><xacro:x/></geometry></visual>"),
    ],
)
def test_elements_of_xacro_are_ignored_with_a_word(load, text):
    model, words = load(text)
    assert model.nv == 1 and len(words) == 1 and "elements of xacro are ignored: <" in words[0]
    assert "pip install xacro, then xacro file.xacro > file.urdf" in words[0]


@pytest.mark.parametrize(
    "text",
    [
        ROBOT.replace('value="1"', 'value="${m}"'),
        ROBOT.replace('name="j"', 'name="${prefix}j"'),
        ROBOT.replace('name="r"', 'name="$(arg name)"'),
        ROBOT.replace('xyz="0 1 0"', 'xyz="0 ${one} 0"'),
    ],
)
def test_expressions_of_xacro_in_what_is_read_are_refused(load, text):
    with pytest.raises(pc.ModelError, match="is a xacro expression; expand the file first: pip install xacro"):
        load(text)


def test_a_xacro_file_says_what_to_do(load):
    with pytest.raises(pc.ModelError, match=r"robot\.xacro:\d: <x> is a xacro macro; expand the file first: pip install xacro"):
        load(ROBOT.replace("</robot>", f"<xacro:x {XACRO}/></robot>"), "robot.xacro")
    with pytest.raises(pc.ModelError, match="this is a part of a robot in xacro; expand the file that includes it"):
        load(f"<xacro:macro {XACRO}/>", "part.xacro")


@pytest.mark.parametrize(
    ("elements", "said"),
    [
        (
            '<gazebo reference="b"><turnGravityOff>true</turnGravityOff><material>Gazebo/Red</material></gazebo>',
            "Gazebo's turnGravityOff of 'b' (line 3)",
        ),
        ('<gazebo reference="b"><turnGravityOff>false</turnGravityOff></gazebo>', None),
        ('<gazebo><plugin name="control" filename="x.so"/></gazebo>', "Gazebo's plugin 'control' (line 3)"),
        (
            '<gazebo reference="j"><springStiffness>3</springStiffness><dampingFactor>1</dampingFactor></gazebo>',
            "Gazebo's springStiffness, dampingFactor of 'j' (line 3)",
        ),
        (
            '<transmission name="t"><actuator><drake:rotor_inertia value="1e-3"/></actuator></transmission>',
            "the rotor inertia of transmission 't' (line 3)",
        ),
        ('<transmission name="t"><actuator name="m"/></transmission>', None),
        ('<drake:joint name="k" type="ball"/>', "<drake:joint> (line 3)"),
        ("<mujoco><compiler/></mujoco>", "settings for MuJoCo (line 3)"),
    ],
)
def test_what_moves_a_robot_elsewhere_is_named(load, elements, said):
    model, words = load(ROBOT.replace("</robot>", elements + "</robot>"))
    assert model.not_read == ([said] if said else [])
    assert pc.effects.from_model(model).notes == model.not_read
    assert words == ([f": Not read, although it changes the motion: {said}"] if said else [])


def test_what_is_not_read_of_two_files_of_one_robot_is_no_difference(load, tmp_path):
    model, _ = load(ROBOT.replace("</robot>", "<mujoco><compiler/></mujoco></robot>"))
    (tmp_path / "same.urdf").write_text(ROBOT)
    assert pc.compare(model, tmp_path / "robot.urdf").differences == []
    (said,) = pc.compare(pc.load(tmp_path / "same.urdf"), tmp_path / "robot.urdf").differences
    assert said.kind == "not read" and not said.decides and pc.compare(model, tmp_path / "same.urdf")


def test_a_safety_controller_is_named(load):
    model, _ = load(ROBOT.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><safety_controller k_velocity="3"/>'))
    assert model.not_read == ["<safety_controller> of joint 'j'"]


def test_a_root_with_mass_is_fixed_with_a_word(load):
    text = ROBOT.replace('<link name="a"/>', f'<link name="a">{INERTIAL}</link>')
    model, words = load(text)
    assert model.nv == 1
    assert words == [":1: the root link 'a' has mass and is fixed; root='free' makes it float, root='fixed' is silent"]
    assert load(text, root="fixed")[1] == [] and load(text, root="free")[0].nv == 7
    assert load(ROBOT)[1] == []  # a place for the joint, no body


def test_the_warning_names_the_remedy(load):
    dynamics = '<limit effort="5" velocity="2" lower="-1" upper="1"/><dynamics damping="0.1" friction="0.2"/>'
    _, words = load(ROBOT.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/>' + dynamics))
    assert words == [
        ": not in the model: joint damping (1 coordinate), joint friction (1 coordinate), effort limits (1 coordinate), "
        "velocity limits (1 coordinate); pycraft.effects.from_model(model) makes effects of them"
    ]


def test_followers_are_coupled_by_default(load):
    more = f'<link name="c">{INERTIAL}</link><joint name="k" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 1 0"/>'
    model, words = load(ROBOT.replace("</robot>", more + '<mimic joint="j" multiplier="2" offset="0.5"/></joint></robot>'))
    assert list(model.loops) == ["k"] and model.nv == 2 and words == []
    assert pc.effects.from_model(model).notes == ["the loops of the model, 'k': pycraft.effects.Loop() keeps them"]
    assert abs(model.loops.residual([0.3, 1.1])).max() < 1e-15 and abs(model.loops.residual([0.3, 1.2])).max() > 0.05


# MJCF -----------------------------------------------------------------------------------------------------------------

MESHES = """<mujoco><asset><mesh name="m" file="gone.stl"/><texture name="t" type="2d" file="gone.png"/><material name="x" texture="t"/>
<hfield name="h" file="gone.bin" size="1 1 1 1"/></asset><worldbody><geom type="hfield" hfield="h"/><geom type="mesh" mesh="m"/>
<body name="a"><joint name="j"/>{inertial}<geom type="mesh" mesh="m" material="x"/></body></worldbody></mujoco>"""


@pytest.mark.peers
def test_missing_files_of_what_is_only_seen(load):
    pytest.importorskip("mujoco")
    inertial = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    model, words = load(MESHES.format(inertial=inertial), "robot.xml")
    assert model.nv == 1 and model.bodies["a"].mass == 1
    assert any(
        ": files that are not there, and left out: mesh 'gone.stl', height field 'gone.bin', texture 'gone.png'" in text for text in words
    )


@pytest.mark.peers
def test_a_missing_file_that_gives_a_body_its_mass(load):
    pytest.importorskip("mujoco")
    with pytest.raises(pc.ModelError, match=r"mesh 'gone.stl' is not there, and body 'a' takes its mass from it; add the file, or give"):
        load(MESHES.format(inertial=""), "robot.xml")
    always = MESHES.format(inertial='<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>').replace(
        "<mujoco>", '<mujoco><compiler inertiafromgeom="true"/>'
    )
    with pytest.raises(pc.ModelError, match="takes its mass from it"):
        load(always, "robot.xml")


@pytest.mark.peers
def test_an_actuator_with_more_controls_than_the_model_has_coordinates(load):
    mujoco = pytest.importorskip("mujoco")
    ball = '<body name="a"><joint name="b" type="ball"/><geom size=".1"/></body>'
    text = f'<mujoco><worldbody>{ball}</worldbody><actuator><so3 name="s" joint="b" kp="1" chart="quat"/></actuator></mujoco>'
    try:
        mujoco.MjModel.from_xml_string(text)
    except ValueError:
        text = text.replace(' chart="quat"', "")
        try:
            mujoco.MjModel.from_xml_string(text)
        except ValueError:
            pytest.skip("this version of MuJoCo has no such actuator")
    model, _ = load(text, "robot.xml")
    (actuator,) = model.actuators
    assert actuator["name"] == "s" and actuator["why not"] is not None and model.nv == 3


@pytest.mark.peers
def test_a_site_with_the_name_of_a_body_is_told(load):
    pytest.importorskip("mujoco")
    model, words = load(
        '<mujoco><worldbody><body name="peg"><joint/><geom size=".1"/><site name="peg" pos="1 0 0"/></body></worldbody></mujoco>',
        "robot.xml",
    )
    assert any(": sites with the names of bodies are nodes with other names: 'peg' is 'peg_site'" in text for text in words)
    assert "peg_site" in model.nodes and model.pose("peg", [0.0])[0, 3] == 0


def test_whatever_a_reader_raises_is_an_error_of_ours(load, monkeypatch):
    def broken(*args, **options):
        raise IndexError("index 5 is out of bounds")

    monkeypatch.setattr(urdf, "read", broken)
    with pytest.raises(pc.ModelError, match=r"robot\.urdf:1: the file cannot be read as a model \(IndexError: index 5") as caught:
        load(ROBOT)
    assert isinstance(caught.value.__cause__, IndexError)


# Names ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", pc.robots.names())
def test_robots_of_the_package_by_name(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = pc.load(name)
    assert model.name == name and model.nv == getattr(pc.robots, name)().nv
    assert pc.load(name, root="fixed").nv == getattr(pc.robots, name)(root="fixed").nv
    assert pc.load(name, gravity=(0, 0, -1.6)).gravity[2] == -1.6
    with pytest.raises(pc.ModelError, match=rf"strict=True is for files; pycraft.robots.{name}\(\) takes root and welds"):
        pc.load(name, strict=True)
    with pytest.raises(pc.ModelError, match="the robots of the package have no gravity"):
        pc.load(name, gravity="file")


def test_a_file_comes_before_a_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "panda").write_text(ROBOT)
    assert pc.load("panda").nv == 1


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("ur6", "no file and no robot is called 'ur6'; did you mean 'ur5'"),
        ("Panda", "did you mean 'panda'"),
        ("zzz", r"no robot is called 'zzz'; there are puma560, panda.*\(robots of the package: puma560, panda, ur5, a1, g1"),
    ],
)
def test_unknown_names(name, said):
    with pytest.raises(pc.ModelError, match=said):
        pc.load(name)


@pytest.mark.parametrize("path", ["ur5.urdf", "./ur5", "folder/ur5", "ur5.sdf"])
def test_paths_are_no_names(path):
    with pytest.raises(pc.ModelError, match="cannot be read: No such file"):
        pc.load(path)


def test_modules_of_robot_descriptions(tmp_path, monkeypatch):
    """A package of that name with two modules: one that has its file, one that fails as without a network."""
    package = tmp_path / "robot_descriptions"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "own_description.py").write_text(f"URDF_PATH = {str(tmp_path / 'own.urdf')!r}\n")
    (package / "gone_description.py").write_text("raise OSError('no network')\n")
    (package / "empty_description.py").touch()
    (tmp_path / "own.urdf").write_text(ROBOT)
    monkeypatch.syspath_prepend(tmp_path)
    named_robots.described_robots.cache_clear()
    try:
        assert pc.load("own_description").nv == 1
        with pytest.raises(pc.ModelError, match=r"robot_descriptions\.gone_description does not give its files: OSError: no network"):
            pc.load("gone_description")
        with pytest.raises(pc.ModelError, match="has neither a URDF_PATH nor an MJCF_PATH"):
            pc.load("empty_description")
        with pytest.raises(pc.ModelError, match="did you mean 'own_description'"):
            pc.load("own_descriptio")
    finally:
        named_robots.described_robots.cache_clear()


@pytest.mark.peers
def test_robots_of_example_robot_data():
    files = named_robots.example_robots()
    if not files:
        pytest.skip("example-robot-data is not installed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        assert pc.load("talos_reduced").nv > 20 and len(pc.load("cassie_v2").loops) == 4
    with pytest.raises(pc.ModelError, match="did you mean 'talos"):
        pc.load("talos_redused")
