"""URDF files: what is read and how, trees and their degenerate cases, mimic joints, welds, warnings."""

import doctest
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pycraft as pc
from pycraft.models.loaders.urdf import resolve_package
from support.oracle import agree, reference

INERTIAL = (
    '<inertial><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/><mass value="2"/>'
    '<inertia ixx="0.3" ixy="0.01" ixz="-0.02" iyy="0.4" iyz="0.03" izz="0.5"/></inertial>'
)


PLACED = '<origin xyz="0.3 0.1 -0.2" rpy="0.1 0.2 -0.3"/><axis xyz="0 1 0"/>'


def link(name, inertial=INERTIAL):
    return f'<link name="{name}">{inertial}</link>\n'


def joint(name, parent, child, kind="revolute", inside=PLACED):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>\n'


@pytest.fixture
def load(tmp_path):
    """Loads the model of a robot element's contents; options as those of `pc.load`."""

    def load(*contents, **options):
        path = tmp_path / "robot.urdf"
        path.write_text(f'<?xml version="1.0"?>\n<robot name="robot">\n{"".join(contents)}</robot>\n')
        return pc.load(path, **options)

    return load


def check_against_oracle(model, seed=0):
    model.gravity = (0.3, 0.1, -9.81)
    description, state = model.description(), model.random_state(seed)
    vdot = np.random.default_rng(seed).normal(size=model.nv)
    agree(model.mass_matrix(state.q), reference.mass_matrix(description, state.q))
    agree(model.inverse_dynamics(state.q, state.v, vdot), reference.inverse_dynamics(description, state.q, state.v, vdot))


# Numbers --------------------------------------------------------------------------------------------------------------


def test_names_and_order(load):
    model = load(link("a"), link("d"), link("c"), link("b"), joint("jc", "a", "c"), joint("jb", "a", "b"), joint("jd", "c", "d"))
    assert model.name == "robot"
    assert list(model.bodies) == ["c", "d", "b"]  # children in the order of their joint elements, depth first
    assert list(model.hinges) == model.coordinate_names == ["jc", "jd", "jb"]
    assert model.bodies["d"].parent.name == "c"


def test_order_is_the_same_with_kept_welds(load):
    parts = [link(name) for name in "abcde"]
    parts += [joint("ab", "a", "b"), joint("bc", "b", "c", "fixed"), joint("bd", "b", "d"), joint("ce", "c", "e")]
    lumped, kept = load(*parts), load(*parts, welds="keep")
    assert lumped.coordinate_names == kept.coordinate_names == ["ab", "ce", "bd"]


def test_origin_is_fixed_axis_roll_pitch_yaw(load):
    model = load(link("a"), link("b"), joint("j", "a", "b"))
    pose = model.hinges["j"].placement
    np.testing.assert_allclose(pose[:3, :3], Rotation.from_euler("xyz", [0.1, 0.2, -0.3]).as_matrix(), atol=1e-15)
    assert pose[:3, 3].tolist() == [0.3, 0.1, -0.2]


def test_quaternion_origin(load):
    quaternion = Rotation.from_euler("xyz", [0.1, 0.2, -0.3]).as_quat()
    inside = f'<origin quat_xyzw="{" ".join(map(repr, (3 * quaternion).tolist()))}"/>'
    model = load(link("a"), link("b"), joint("j", "a", "b", inside=inside))
    np.testing.assert_allclose(model.hinges["j"].placement[:3, :3], Rotation.from_quat(quaternion).as_matrix(), atol=1e-15)


def test_axis_is_x_by_default_and_normalised(load):
    slanted = joint("k", "b", "c", inside='<axis xyz="0 3 4"/>')
    model = load(link("a"), link("b"), link("c"), joint("j", "a", "b", inside=""), slanted)
    assert model.hinges["j"].subhinges[0]["axis"].tolist() == [1, 0, 0]
    assert model.hinges["k"].subhinges[0]["axis"].tolist() == [0, 0.6, 0.8]


def test_inertia_is_turned_into_link_axes_and_exactly_symmetric(load):
    body = load(link("a"), link("b"), joint("j", "a", "b")).bodies["b"]
    R = Rotation.from_euler("xyz", [0.4, -0.5, 0.6]).as_matrix()
    given = np.array([[0.3, 0.01, -0.02], [0.01, 0.4, 0.03], [-0.02, 0.03, 0.5]])
    np.testing.assert_allclose(body.inertia, R @ given @ R.T, atol=1e-15)
    assert np.array_equal(body.inertia, body.inertia.T)
    assert body.mass == 2 and body.com.tolist() == [0.1, -0.2, 0.3]


def test_unturned_inertia_is_kept_to_the_last_bit(load):
    moments = '<inertia ixx="0.3" ixy="0.03" ixz="0.01" iyy="0.4" iyz="0.07" izz="0.45"/>'
    inertial = f'<inertial><mass value="1"/>{moments}</inertial>'
    body = load(link("a"), link("b", inertial), joint("j", "a", "b")).bodies["b"]
    assert body.inertia.tolist() == [[0.3, 0.03, 0.01], [0.03, 0.4, 0.07], [0.01, 0.07, 0.45]]


@pytest.mark.parametrize(
    ("kind", "hinge", "nq", "nv"),
    [
        ("revolute", "pin", 1, 1),
        ("continuous", "pin", 1, 1),
        ("prismatic", "slider", 1, 1),
        ("planar", "planar", 3, 3),
        ("ball", "ball", 4, 3),
        ("spherical", "ball", 4, 3),
        ("floating", "free", 7, 6),
    ],
)
def test_joint_types(load, kind, hinge, nq, nv):
    parts = link("a"), link("b"), link("c"), joint("j", "a", "b", kind), joint("k", "b", "c")
    model = load(*parts)
    assert (model.hinges["j"].kind, model.nq, model.nv) == (hinge, nq + 1, nv + 1)
    check_against_oracle(model)
    inner = load(link("r"), *parts, joint("root joint", "r", "a"))
    assert (inner.hinges["j"].kind, inner.nv) == (hinge, nv + 2)  # also a floating joint in the middle
    check_against_oracle(inner)


def test_planar_joint_is_two_travels_and_a_turn(load):
    inside = '<origin xyz="0.3 0.1 -0.2" rpy="0.1 0.2 -0.3"/><axis xyz="0 0 1"/>'
    planar = load(link("a"), link("b"), joint("j", "a", "b", "planar", inside))
    empty = "".join(link(name, "") for name in "xy")
    x = joint("x", "a", "x", "prismatic", '<origin xyz="0.3 0.1 -0.2" rpy="0.1 0.2 -0.3"/><axis xyz="1 0 0"/>')
    y = joint("y", "x", "y", "prismatic", '<axis xyz="0 1 0"/>')
    turn = joint("t", "y", "b", "continuous", '<axis xyz="0 0 1"/>')
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        three = load(link("a"), link("b"), empty, x, y, turn)
    q, v = [0.3, -0.4, 0.5], [1.0, 2.0, 3.0]
    agree(planar.pose("b", q), three.pose("b", q))
    agree(planar.inverse_dynamics(q, v, v), three.inverse_dynamics(q, v, v))


def test_limits(load):
    limit = '<limit lower="-1" upper="0.5" effort="10" velocity="2"/>'
    model = load(
        *(link(name) for name in "abcdef"),
        joint("revolute", "a", "b", inside=limit),
        joint("slide", "b", "c", "prismatic", limit.replace(' lower="-1"', "")),
        joint("continuous", "c", "d", "continuous", limit),
        joint("effort only", "d", "e", inside='<limit effort="10" velocity="2"/>'),
        joint("half open", "e", "f", inside='<limit lower="-inf" upper="1"/>'),
    )
    limits = {name: hinge.limits and tuple(map(float, np.ravel(hinge.limits))) for name, hinge in model.hinges.items()}
    assert limits == {
        "revolute": (-1, 0.5),
        "slide": (0, 0.5),  # the specification's default
        "continuous": None,
        "effort only": None,
        "half open": (-np.inf, 1),
    }
    assert np.isfinite(model.random_state(0).q).all()


def test_limits_the_wrong_way_round_are_left_out(load):
    text = r"robot.urdf:5: joint 'j': its lower limit 2 lies above the upper one 1; both are left out"
    with pytest.warns(pc.ModelWarning, match=text):
        model = load(link("a"), link("b"), joint("j", "a", "b", inside='<limit lower="2" upper="1"/>'))
    assert model.hinges["j"].limits is None


def test_rotor_inertia(load):
    model = load(
        *(link(name) for name in "abc"),
        joint("one", "a", "b", inside='<pycraft rotor_inertia="1.14"/>'),
        joint("three", "b", "c", "ball", '<pycraft rotor_inertia="0.1 0.2 0.3"/>'),
    )
    assert model.hinges["one"].rotor_inertia.tolist() == [1.14]
    assert model.hinges["three"].rotor_inertia.tolist() == [0.1, 0.2, 0.3]


def test_what_is_not_read_does_not_matter(load):
    extra = '<dynamics damping="1" friction="2"/><safety_controller k_velocity="1"/><calibration rising="0"/>'
    mesh = '<visual><geometry><mesh filename="package://nowhere/x.stl"/></geometry><material name="red"/></visual>'
    other = (
        '<material name="red"><color rgba="1 0 0 1"/></material><transmission name="t"><joint name="j"/></transmission>'
        '<gazebo reference="b"><controller:camera/></gazebo><mujoco><compiler/></mujoco>'
    )
    plain = load(link("a"), link("b"), joint("j", "a", "b")).description()
    full = load(other, link("a"), link("b", INERTIAL + mesh), joint("j", "a", "b", inside=extra + PLACED)).description()
    np.testing.assert_equal(full, plain)


def test_a_namespace_and_undeclared_prefixes_are_read(tmp_path):
    path = tmp_path / "old.xml"  # the content says what it is, not the suffix
    path.write_text(f'<robot xmlns="http://www.ros.org">{link("a")}{link("b")}{joint("j", "a", "b")}<sensor:ray/></robot>')
    model = pc.load(str(path))
    assert model.name == "old" and model.nv == 1


# Roots, welds, degenerate trees ---------------------------------------------------------------------------------------


def test_fixed_and_free_root(load):
    parts = link("trunk"), link("leg"), joint("hip", "trunk", "leg")
    fixed, free, kept = load(*parts), load(*parts, root="free"), load(*parts, welds="keep")
    assert list(fixed.bodies) == ["leg"] and fixed.nodes["trunk"].body is None
    assert list(free.hinges) == ["root", "hip"] and list(free.bodies) == ["trunk", "leg"]
    assert (free.hinges["root"].kind, free.bodies["trunk"].mass, free.nv) == ("free", 2, 7)
    assert list(kept.hinges) == ["root", "hip"] and kept.hinges["root"].kind == "weld" and kept.bodies["trunk"].mass == 2
    q = fixed.random_state(0).q
    agree(kept.mass_matrix(q), fixed.mass_matrix(q))
    check_against_oracle(free)


def test_a_joint_called_root_under_a_fixed_root(load):
    parts = link("trunk"), link("leg"), joint("root", "trunk", "leg")
    assert list(load(*parts).hinges) == ["root"]
    assert list(load(*parts, welds="keep").hinges) == ["root of trunk", "root"]


def test_welds_lumped_and_kept_agree(load):
    parts = [link(name) for name in ("base", "arm", "plate", "tool", "tip", "wrist", "eye")]
    parts += [joint("shoulder", "base", "arm"), joint("w1", "arm", "plate", "fixed"), joint("w2", "plate", "tool", "fixed")]
    parts += [joint("wrist", "tool", "wrist", "ball"), joint("w3", "wrist", "tip", "fixed"), joint("w4", "base", "eye", "fixed")]
    lumped, kept = load(*parts), load(*parts, welds="keep")
    assert list(lumped.bodies) == ["arm", "wrist"] and set(lumped.nodes) == {"base", "plate", "tool", "tip", "eye"}
    assert lumped.nodes["tool"].body.name == "arm" and lumped.nodes["eye"].body is None
    assert len(kept.bodies) == 7 and not kept.nodes
    state, vdot = lumped.random_state(3), np.arange(4.0)
    lumped.gravity = kept.gravity = (1, 2, 3)
    agree(kept.mass_matrix(state.q), lumped.mass_matrix(state.q))
    agree(kept.inverse_dynamics(state.q, state.v, vdot), lumped.inverse_dynamics(state.q, state.v, vdot))
    for frame in ("plate", "tool", "tip", "eye"):
        agree(kept.pose(frame, state.q), lumped.pose(frame, state.q))
    check_against_oracle(kept)


def test_one_link(load):
    model = load(link("stone"))
    assert (model.nv, len(model.bodies), list(model.nodes)) == (0, 0, ["stone"])
    kept = load(link("stone"), welds="keep")
    assert (kept.nv, len(kept.bodies)) == (0, 1)
    assert model.mass_matrix([]).shape == kept.mass_matrix([]).shape == (0, 0)
    free = load(link("stone"), root="free")
    assert (free.nv, list(free.hinges)) == (6, ["root"])
    check_against_oracle(free)


def test_welds_only(load):
    parts = link("a"), link("b"), link("c"), joint("ab", "a", "b", "fixed"), joint("bc", "b", "c", "fixed")
    model = load(*parts)
    assert (model.nq, model.nv, list(model.nodes)) == (0, 0, ["a", "b", "c"])
    kept = load(*parts, welds="keep")
    agree(kept.pose("c", []), model.pose("c", []))
    assert load(*parts, root="free").bodies["a"].mass == pytest.approx(6)


def test_branches_against_the_oracle(load):
    parts = [link(name) for name in "abcdefg"]
    edges = ["ab", "bc", "bd", "de", "af", "dg"]
    kinds = ["revolute", "prismatic", "floating", "continuous", "ball", "planar"]
    parts += [joint(edge, *edge, kind) for edge, kind in zip(edges, kinds, strict=True)]
    for options in ({}, {"root": "free"}):
        model = load(*parts, **options)
        assert list(model.bodies)[-6:] == ["b", "c", "d", "e", "g", "f"]
        check_against_oracle(model)


def test_long_chains_do_not_recurse(load):
    count = 3000
    parts = [link(f"l{i}") for i in range(count)] + [joint(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(count - 1)]
    assert load(*parts).nv == count - 1


# Mimic joints ---------------------------------------------------------------------------------------------------------

FINGERS = [
    *(link(name) for name in "abcd"),
    joint("leader", "a", "b"),
    joint("turn", "b", "c", inside='<axis xyz="0 0 2"/><mimic joint="leader" multiplier="-2" offset="0.3"/>'),
    joint("slide", "c", "d", "prismatic", '<axis xyz="0 3 4"/><mimic joint="turn" multiplier="0.5"/><pycraft rotor_inertia="1"/>'),
]


def test_locked_mimic_joints_stand_where_their_leader_at_zero_puts_them(load):
    locked, free = load(*FINGERS, mimic="lock"), load(*FINGERS, mimic="free")
    assert locked.coordinate_names == ["leader"] and free.coordinate_names == ["leader", "turn", "slide"]
    for angle in (0.0, 0.7):
        for frame in "cd":
            agree(locked.pose(frame, [angle]), free.pose(frame, [angle, 0.3, 0.15]))
        agree(locked.mass_matrix([angle]), free.mass_matrix([angle, 0.3, 0.15])[:1, :1])
    kept = load(*FINGERS, mimic="lock", welds="keep")
    assert kept.hinges["turn"].kind == "weld"
    agree(kept.mass_matrix([0.7]), locked.mass_matrix([0.7]))


def test_coupled_mimic_joints_follow(load):
    model, free = load(*FINGERS, mimic="couple"), load(*FINGERS, mimic="free")
    assert model.coordinate_names == free.coordinate_names and list(model.loops) == ["turn", "slide"]
    state = model.assemble([0.7, 0.0, 0.0], [1.0, 0.0, 0.0], fix="leader")
    agree(state.q, np.array([0.7, -2 * 0.7 + 0.3, 0.5 * (-2 * 0.7 + 0.3)]))
    agree(state.v, np.array([1.0, -2.0, -1.0]))
    agree(model.loops.jacobian(), np.array([[2.0, 1.0, 0.0], [0.0, -0.5, 1.0]]))
    of_a_weld = load(
        *(link(n) for n in "abc"),
        joint("w", "a", "b", "fixed"),
        joint("j", "b", "c", inside='<mimic joint="w" offset="0.2"/>'),
        mimic="couple",
    )
    agree(of_a_weld.assemble().q, np.array([0.2]))


def test_mimic_elements_are_passed_over_when_free(load):
    model = load(link("a"), link("b"), joint("j", "a", "b", inside='<mimic joint="nowhere"/>'), mimic="free")
    assert model.nv == 1


# Warnings -------------------------------------------------------------------------------------------------------------


def test_a_massless_body_on_a_hinge_warns_at_the_callers_line(load, tmp_path):
    load(link("a", ""))
    path = tmp_path / "massless.urdf"
    path.write_text(f'<robot name="r">{link("a")}{link("empty", "")}{joint("j", "a", "empty")}</robot>')
    with pytest.warns(pc.ModelWarning, match=r"massless.urdf:2: body 'empty' on hinge 'j' has no mass") as caught:
        pc.load(path, root="fixed")
    assert Path(caught[0].filename).name == "test_urdf.py" and len(caught) == 1


def test_massless_frames_on_welds_are_silent(load):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parts = link("world", ""), link("a", ""), link("b"), link("frame", "")
        joints = joint("j", "world", "a"), joint("w", "a", "b", "fixed"), joint("f", "b", "frame", "fixed")
        model = load(*parts, *joints)  # a gets b's mass
        load(*parts, *joints[1:], joint("j", "world", "a", "fixed"), welds="keep")
    assert model.bodies["a"].mass == 2


def test_triangle_inequality_warns_or_is_an_error(load):
    flat = INERTIAL.replace('izz="0.5"', 'izz="5"')
    parts = link("a"), link("plate", flat), joint("j", "a", "plate")
    with pytest.warns(pc.ModelWarning, match=r"robot.urdf:4: body 'plate'.*violate the triangle inequality by 4\.3"):
        load(*parts)
    with pytest.raises(pc.ModelError, match=r"robot.urdf:4: link 'plate': its principal moments.*triangle inequality"):
        load(*parts, strict=True)


# Packages -------------------------------------------------------------------------------------------------------------


def test_resolve_package(tmp_path):
    urdf = tmp_path / "ws" / "arm_description" / "urdf" / "arm.urdf"
    near = tmp_path / "ws" / "arm_description" / "meshes" / "link.stl"
    far = tmp_path / "elsewhere" / "hand_description" / "hand.stl"
    for path in (urdf, near, far):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    assert resolve_package("package://arm_description/meshes/link.stl", urdf) == near  # a folder above the file holds it
    assert resolve_package("../meshes/link.stl", urdf).samefile(near)
    assert resolve_package(near.as_uri(), urdf) == near
    for where in (far.parent, far.parents[1]):  # the package, or the folder that holds it
        assert resolve_package("package://hand_description/hand.stl", urdf, [tmp_path, where]) == far
    other = tmp_path / "override" / "arm_description" / "meshes" / "link.stl"
    other.parent.mkdir(parents=True)
    other.touch()
    assert resolve_package("package://arm_description/meshes/link.stl", urdf, [tmp_path / "override"]) == other
    text = r"'package://hand_description/hand.stl' is not found in .*; give the folder that holds 'hand_description'"
    with pytest.raises(pc.ModelError, match=text):
        resolve_package("package://hand_description/hand.stl", urdf)
    with pytest.raises(pc.ModelError, match="'nothing.stl' is not found in .*relative to the URDF file"):
        resolve_package("nothing.stl", urdf)


# The page -------------------------------------------------------------------------------------------------------------


def test_the_page_on_models_runs(tmp_path, monkeypatch):
    root = Path(__file__).parents[2]
    shutil.copy(root / "pycraft" / "models" / "robots" / "panda.urdf", tmp_path / "arm.urdf")
    monkeypatch.chdir(tmp_path)
    result = doctest.testfile(str(root / "docs" / "models.md"), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert result.failed == 0 and result.attempted > 15
