"""Hostile model files: errors of ours and nothing else, in time that grows with the file, no entity expanded, no folder left."""

import time

import numpy as np
import pytest

import pycraft as pc
from campaigns import loaders
from pycraft.models.loaders.urdf import resolve_package

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'


def test_a_part_of_the_campaign():
    assert not loaders.run(range(60))


@pytest.mark.slow
def test_the_campaign():
    assert not loaders.run(range(1000, 4000))


@pytest.fixture
def says(tmp_path):
    """Return the error of loading a text, without the path."""

    def refused(text, **options):
        path = tmp_path / "robot.urdf"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        with pytest.raises(pc.ModelError) as caught:
            pc.load(path, **options)
        assert str(caught.value).startswith(str(path))
        return str(caught.value).removeprefix(str(path))

    return refused


def link(name, inertial=INERTIAL):
    return f'<link name="{name}">{inertial}</link>'


def joint(name, parent, child, inside=""):
    return f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def robot(*lines):
    return "\n".join(['<robot name="r">', *lines, "</robot>"])


# ---------------------------------------------------------------------- names
@pytest.mark.parametrize("name", [r"\1", r"\g<2>", "(?P<a", "it's", "body 'b'", "hinge 'j'", "[/bold]", "{0} %s", "a\u0301"])
def test_errors_about_names_that_look_like_something_else(says, name):
    """They were put into patterns and replacements."""
    shown = name.replace("<", "&lt;")
    bad = INERTIAL.replace('value="1"', 'value="-1"')
    assert (
        says(robot(link("a"), link(shown, bad), joint("j", "a", shown))) == f":3: link {name!r}: its mass is -1 kg; a mass is not negative"
    )
    axis = '<pycraft rotor_inertia="-1"/>'
    text = says(robot(link("a"), link("b"), joint(shown, "a", "b", axis)))
    assert text == f":4: joint {name!r}: rotor inertia -1 is not a nonnegative number"


def test_warnings_about_names_that_look_like_something_else(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(robot(link("a"), "\n", link("it's 'b'", ""), joint("j", "a", "it's 'b'")))
    with pytest.warns(pc.ModelWarning, match=r"r\.urdf:5: body 'it's 'b'' on hinge 'j' has no mass"):
        pc.load(path)


# ---------------------------------------------------------------------- entities
@pytest.mark.parametrize(
    "doctype", ["<!DOCTYPE robot SYSTEM 'x.dtd'>", "<!DOCTYPE robot PUBLIC '-//x' 'x.dtd'>", "<!DOCTYPE robot [ %more; ]>"]
)
def test_entities_that_nothing_declares_are_refused(says, doctype):
    """libxml2 drops them with a warning where the declaration might be elsewhere: 10 kg for "1&nope;0"."""
    heavy = INERTIAL.replace('value="1"', 'value="1&nope;0"')
    text = says(doctype + "\n" + robot(link("a", heavy)))
    assert text.startswith(":3: Entity 'nope' not defined") or "entit" in text.lower()
    assert "<" not in says(doctype + robot(link("a"), "&nope;")).split(":", 2)[0]


@pytest.mark.parametrize("declared", ["'10'", "SYSTEM 'missing.txt'", "SYSTEM 'robot.urdf'"])
def test_entities_that_are_declared_are_named_and_nothing_of_them_is_read(says, declared):
    """Expanded, the others would open a file: one that is not there, and this one again."""
    text = says(f"<!DOCTYPE robot [<!ENTITY a {declared}>]>\n" + robot(link("a"), "&a;"))
    assert text == ":2: the file declares entities (a), which are not expanded; write their text out"


def test_entities_of_xml_itself_are_read(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(robot(link("a &amp; b", INERTIAL.replace('value="1"', 'value="&#49;0"'))))
    model = pc.load(path, root="free")
    assert model.bodies["a & b"].mass == 10


# ---------------------------------------------------------------------- what other libraries raised
def test_an_undeclared_prefix_on_the_root(says):
    assert "<foo:robot> is not the root element of a format" in says("<foo:robot name='r'><link/></foo:robot>")


@pytest.mark.parametrize("path", ["a\x00b.urdf", b"a\x00b.urdf"])
def test_a_nul_in_a_path(path):
    with pytest.raises(pc.ModelError, match="cannot be read: embedded null"):
        pc.load(path)


def test_paths_may_be_bytes(tmp_path):
    path = tmp_path / "r.urdf"
    path.write_text(robot(link("a")))
    assert pc.load(bytes(path)).nv == 0
    path.write_text("<robot>")
    with pytest.raises(pc.ModelError, match=f"^{path}:1: not well-formed"):
        pc.load(bytes(path))


@pytest.mark.peers
def test_mjcf_in_latin_1(tmp_path):
    pytest.importorskip("mujoco")
    path = tmp_path / "r.xml"
    world = '<worldbody><body name="bär"><joint name="j"/><geom size="1"/></body></worldbody>'
    text = f'<?xml version="1.0" encoding="ISO-8859-1"?><mujoco>{world}</mujoco>'
    path.write_bytes(text.encode("latin-1"))
    for given in (path, bytes(path)):
        with pytest.raises(pc.ModelError, match=rf"^{path}:1: a name is not in UTF-8"):
            pc.load(given)
    path.write_bytes(text.replace("ISO-8859-1", "UTF-8").encode())
    assert list(pc.load(bytes(path)).bodies) == ["bär"]


def followers(n, last='<mimic joint="j0" multiplier="0.5" offset="1"/>'):
    """j1 follows j0, j2 follows j1, ...: the file gives the last one first."""
    mimics = [last, *(f'<mimic joint="j{k}" multiplier="0.5" offset="1"/>' for k in range(1, n))]
    joints = [joint(f"j{k}", "base", f"l{k}", mimics[k - 1] if k else "") for k in range(n + 1)]
    return robot(link("base"), *(link(f"l{k}") for k in range(n + 1)), *reversed(joints))


def test_joints_that_follow_each_other_in_a_long_line(tmp_path, says):
    n = 3000
    path = tmp_path / "r.urdf"
    path.write_text(followers(n))
    model = pc.load(path, mimic="lock")
    assert model.nv == 1
    # x → x/2 + 1 tends to 2: the angle of the last
    assert np.allclose(model.pose(f"l{n}", [0.0])[1:3, 1:3], [[np.cos(2), -np.sin(2)], [np.sin(2), np.cos(2)]], atol=1e-12)
    text = says(followers(n, f'<mimic joint="j{n}"/>'), mimic="lock")
    assert "joints follow each other in a circle" in text and f"({n + 1} in all)" in text and len(text) < 1000
    assert len(says(followers(n), mimic="refuse")) < 2000


# ---------------------------------------------------------------------- time
def seconds_of(load):
    begin = time.process_time()
    load()
    return time.process_time() - begin


def test_time_grows_with_the_number_of_attributes(says):
    attributes = " ".join(f'a{k}="1"' for k in range(20_000))  # listed one by one, 5 s at 20,000 and 130 s at 100,000
    assert seconds_of(lambda: says(f"<robot {attributes}>{link('a')}<link/></robot>")) < 1.5


def test_time_grows_with_the_length_of_a_loop(says):
    n = 10_000
    loop = [joint(f"j{k}", f"l{k}", f"l{(k + 1) % n}") for k in range(n)]
    begin = time.process_time()
    text = says(robot(*(f'<link name="l{k}"/>' for k in range(n)), *loop))
    assert time.process_time() - begin < 4
    assert "are a loop" in text and f"({n} in all)" in text and len(text) < 3000


def long_chain(n):
    limit = '<limit lower="-1" upper="1"/>'
    place = '<origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 0 1"/>'
    return robot(*(link(f"l{k}") for k in range(n)), *(joint(f"j{k}", f"l{k - 1}", f"l{k}", place + limit) for k in range(1, n)))


@pytest.mark.parametrize("n", [4000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_a_long_chain_loads_and_draws_in_time(tmp_path, n):
    """100,000 links in 5 s, 50 µs a link; tests may run on a loaded machine, and are allowed three times that."""
    path = tmp_path / "r.urdf"
    path.write_text(long_chain(n))
    pc.load(path)
    begin = time.process_time()
    model = pc.load(path)
    loaded = time.process_time()
    state = model.random_state(0)
    drawn = time.process_time()
    assert model.nv == n - 1 and np.abs(state.q).max() <= 1
    assert loaded - begin < 150e-6 * n
    assert drawn - loaded < 60e-6 * n


# ---------------------------------------------------------------------- packages
@pytest.mark.parametrize(
    "uri",
    [
        "package:///etc/passwd", "package://../etc/passwd", "package://etc/../../etc/passwd", "package://robot//etc/passwd", "package://./etc/passwd",
        "package://robot/../../secret", "package://",
    ],
)  # fmt: skip
def test_package_names_stay_in_their_package(tmp_path, uri):
    (tmp_path / "robot").mkdir()
    (tmp_path / "secret").write_text("")
    with pytest.raises(pc.ModelError, match="leads out of a package"):
        resolve_package(uri, tmp_path / "robot" / "r.urdf", [tmp_path])


def test_packages_are_not_looked_for_at_the_root_of_the_file_system(tmp_path):
    with pytest.raises(pc.ModelError, match="is not found in"):
        resolve_package("package://etc/passwd", tmp_path / "r.urdf")
    mesh = tmp_path / "robot" / "meshes" / "a.stl"
    mesh.parent.mkdir(parents=True)
    mesh.write_text("")
    assert resolve_package("package://robot/meshes/a.stl", tmp_path / "robot" / "urdf" / "r.urdf") == mesh
    with pytest.raises(pc.ModelError, match="is not found in"):
        resolve_package("package://robot/" + "x" * 5000, tmp_path / "robot" / "r.urdf")


def test_what_is_no_path():
    for given in (3, None, ["a.urdf"], 2.5):
        with pytest.raises(pc.ModelError, match="a model is loaded from the path of a file, not from"):
            pc.load(given)


def test_bytes_in_another_encoding_name_the_remedy(tmp_path):
    path = tmp_path / "latin.urdf"
    path.write_bytes('<robot name="r"><link name="é"/></robot>'.encode("latin-1"))
    with pytest.raises(pc.ModelError, match="not well-formed XML: .*, column .*; save the file in UTF-8, or declare") as caught:
        pc.load(path)
    assert str(caught.value).count("line") == 1  # of "first line": the place is file:line, once
