"""Loops in URDF files: written, read back with the same rows, and refused with file, line, loop and attribute.

Tolerance: rotations go through three angles, a few eps; rows of loops within metres, 1e-13.
"""

import numpy as np
import pytest

import pycraft as pc
from support.planar_linkages import four_bar

AGREE = 1e-13
INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
LINKS = (
    f'<link name="ground"/><link name="one">{INERTIAL}</link><link name="two">{INERTIAL}</link>'
    '<joint name="j1" type="continuous"><parent link="ground"/><child link="one"/><axis xyz="0 0 1"/></joint>'
    '<joint name="j2" type="prismatic"><parent link="one"/><child link="two"/><axis xyz="1 0 0"/><limit lower="-1" upper="1"/></joint>'
)


def robot(tmp_path, loops):
    path = tmp_path / "robot.urdf"
    path.write_text(f'<robot name="r">{LINKS}\n<pycraft>\n{loops}</pycraft></robot>')
    return path


def every_loop():
    """Pins off their bodies' origins, loops of every kind between bodies, nodes and the base."""
    rng = np.random.default_rng(1)
    model = pc.tree([-1, 0, 1, -1, 3], ["pin", "slider", "pin", "planar", "pin"], seed=2)
    bodies = list(model.bodies)
    R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R * np.linalg.det(R), rng.normal(size=3)
    model.add_node("eye", bodies[2], position=rng.normal(size=3), rotation=X[:3, :3])
    for kind in ("weld", "pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free"):
        given = {"placement": X}
        if kind == "universal":
            given["axes"] = [rng.normal(size=3), rng.normal(size=3)]
        if kind in ("pin", "slider", "screw", "cylindrical"):
            given |= {"axis": rng.normal(size=3), "point": rng.normal(size=3)}
        if kind == "screw":
            given["pitch"] = 0.3
        model.add_loop("eye", [None, bodies[4]][len(model.loops) % 2], kind, **given, name=f"by {kind}")
    model.add_rolling("eye", None, "wheel", radius=0.2, name="wheel")
    model.add_rolling(bodies[4], bodies[0], "ball", radius=0.1, name="ball")
    model.add_rolling(bodies[4], None, "blade", name="blade")
    model.add_surface("eye", bodies[3], A=rng.normal(size=(3, 3)), b=rng.normal(size=3), c=0.5, name="bowl")
    model.add_curve("eye", bodies[3], curve=rng.normal(size=(4, 3)), name="wire")
    model.add_curve("eye", curve=lambda s: (np.cos(s), np.sin(s), np.cos(2 * s)), parameters=(0, 2 * np.pi), closed=True, name="ring")
    model.add_coupling({0: [0.1, 2.0, -0.3], 1: -3.0}, constant=0.7, name="gear")
    return model


@pytest.mark.parametrize("welds", ["lump", "keep"])
@pytest.mark.parametrize("make", [every_loop, lambda: four_bar(0.4, 1.0, 0.8, 1.0)], ids=["every loop", "four-bar"])
def test_rows_come_back(tmp_path, make, welds):
    model, path = make(), tmp_path / "model.urdf"
    model.save(path)
    again = pc.load(path, welds=welds)
    assert list(again.loops) == list(model.loops) and again.loops.rows == model.loops.rows
    assert np.array_equal(again.loops.of_positions, model.loops.of_positions)
    for seed in range(3):
        state = model.random_state(seed)
        for got, expected in (
            (again.loops.residual(state.q), model.loops.residual(state.q)),
            (again.loops.jacobian(state.q), model.loops.jacobian(state.q)),
            (again.loops.bias(state.q, state.v), model.loops.bias(state.q, state.v)),
        ):
            np.testing.assert_allclose(got, expected, rtol=0, atol=AGREE * (1 + np.abs(expected).max()))
    second = tmp_path / "again.urdf"
    again.save(second)
    assert list(pc.load(second).loops) == list(model.loops)


def test_ends_that_are_not_given_are_the_root_link(tmp_path):
    path = robot(tmp_path, '<loop name="c" kind="ball" b="two" point="1 0 0" xyz="0.5 0 0"/>')
    model, floating = pc.load(path), pc.load(path, root="free")
    expected = pc.load(robot(tmp_path, ""))
    expected.add_loop("two", hinge="ball", point=(1, 0, 0), position=(0.5, 0, 0), name="c")
    assert np.array_equal(model.loops.residual([0.3, 0.2]), expected.loops.residual([0.3, 0.2]))
    assert floating.loops.ends == ["ground", "two"]  # which moves now


def test_functions_are_left_out_with_a_word(tmp_path):
    model = four_bar(0.4, 1.0, 0.8, 1.0)
    model.add_coupling(["crank"], function=lambda q: (q[0], [1.0], [[0.0]]), name="cam")
    with pytest.warns(pc.ModelWarning, match="no file holds couplings by functions, and these were not written: cam"):
        model.save(tmp_path / "model.urdf")
    assert list(pc.load(tmp_path / "model.urdf").loops) == ["closure"]


@pytest.mark.parametrize(
    ("loops", "said"),
    [
        ('<loop kind="pin" b="two"/>', r"robot.urdf:3: <loop> has no name"),
        ('<loop name="c" b="two"/>', r"robot.urdf:3: <loop> has no kind"),
        ('<loop name="c" kind="knot" b="two"/>', r"robot.urdf:3: loop 'c' is of kind 'knot'; there are .*pin"),
        ('<loop name="c" kind="custom" b="two"/>', r"robot.urdf:3: loop 'c': a custom hinge takes subhinges="),
        (
            '<loop name="c" kind="custom" b="two"><coordinate/></loop>',
            r"robot.urdf:3: loop 'c' has the element <coordinate>; there is <subhinge>",
        ),
        ('<loop name="c" kind="custom" b="two"><subhinge/></loop>', r"robot.urdf:3: <subhinge> of loop 'c' has no kind"),
        (
            '<loop name="c" kind="custom" b="two"><subhinge kind="pin" q="1"/></loop>',
            r"robot.urdf:3: <subhinge> of loop 'c' has no q; it has kind",
        ),
        ('<loop name="c" kind="custom" b="two"><subhinge kind="pin" axis="0 0"/></loop>', r"robot.urdf:3: .*axis"),
        ('<loop name="c" kind="custom" b="two"><subhinge kind="pins"/></loop>', r"robot.urdf:3: .*pins"),
        ('<loop name="c" kind="pin" b="two" radius="1"/>', r"loop 'c' of kind 'pin' has no radius; it has a, b, axis"),
        ('<loop name="c" kind="pin" b="three"/>', r"robot.urdf:3: .*'three'"),
        ('<loop name="c" kind="pin" a="two" b="two"/>', r"robot.urdf:3: loop 'c' is of 'two' with itself"),
        ('<loop name="c" kind="pin"/>', r"robot.urdf:3: loop 'c' is of the base with itself"),
        ('<loop name="c" kind="pin" b="two" axis="0 0"/>', r"robot.urdf:3: loop 'c': its axis has 2 numbers"),
        ('<loop name="c" kind="pin" b="two" axis="0 0 nan"/>', r"'nan' is not a finite number"),
        ('<loop name="c" kind="pin" b="two" axis="0 0 0"/>', r"robot.urdf:3: .*its axis has length 0"),
        ('<loop name="c" kind="universal" b="two" axis="0 0 1"/>', r"robot.urdf:3: .*axes"),
        ('<loop name="c" kind="pin" b="two" xyz="1 2"/>', r"loop 'c': <loop> xyz=\"1 2\" has 2 values"),
        ('<loop name="c" kind="wheel" b="two"/>', r"robot.urdf:3: .*radius is a positive number"),
        ('<loop name="c" kind="surface" b="two"/>', r"robot.urdf:3: .*is no surface"),
        ('<loop name="c" kind="pin" b="two"><coordinate/></loop>', r"has the element <coordinate>; a coupling has coordinates"),
        ('<loop name="c" kind="coupling"/>', r"loop 'c' has no coordinates"),
        ('<loop name="c" kind="coupling"><joint/></loop>', r"loop 'c' has the element <joint>"),
        ('<loop name="c" kind="coupling"><coordinate name="j3" coefficients="1"/></loop>', r"robot.urdf:3: .*'j3'"),
        ('<loop name="c" kind="coupling"><coordinate name="j1" coefficients="one"/></loop>', r"'one' is not a number"),
        ('<loop name="c" kind="coupling"><coordinate name="j1" coefficients="0 0"/></loop>', r"robot.urdf:3: .*couples nothing"),
        (
            '<loop name="c" kind="coupling"><coordinate name="j1" coefficients="1"/><coordinate name="j1" coefficients="1"/></loop>',
            r"names coordinate 'j1' twice",
        ),
        ('<loop name="c" kind="pin" b="two"/>\n<loop name="c" kind="pin" b="two"/>', r"robot.urdf:4: .*has a loop called 'c' already"),
        ('<spring name="c"/>', r"robot.urdf:3: <pycraft> of robot 'r' has the element <spring>; there is <loop>"),
    ],
)
def test_what_is_wrong_is_told(tmp_path, loops, said):
    with pytest.raises(pc.ModelError, match=said):
        pc.load(robot(tmp_path, loops))


def test_attributes_of_the_robot_are_none(tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(f'<robot name="r">{LINKS}\n<pycraft rotor_inertia="1"/></robot>')
    with pytest.raises(pc.ModelError, match=r"robot.urdf:2: <pycraft> of robot 'r' has the attribute 'rotor_inertia'"):
        pc.load(path)
