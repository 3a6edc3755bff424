"""Branches that are removed, copied, and taken from another model."""

import copy
import gc
import pickle

import numpy as np
import pytest

import pycraft as pc
from support.descriptions import KINDS, random_description
from support.edits import refused
from support.mechanisms import every_kind
from support.motions import Motions

E = pc.effects


def flying(seed=1, kinds=("free", "pin", "ball", "universal", "screw"), rotors=True):
    model = pc.Multibody.from_description(random_description([-1, 0, 1, 2, 0], kinds, seed, rotors))
    state = model.random_state(seed)
    model.q, model.v = state.q, state.v
    return model


def relative(model, frame, wrt):
    at = model.frame(frame)
    return at.pose(wrt=wrt), at.velocity(wrt=wrt)


def assert_same_branch(copied, original, names):
    """Bodies and hinges of `copied`, by the names of those of `original`, have the same numbers and the same state."""
    for new, old in names.items():
        ours, theirs = copied.bodies[new], original.bodies[old]
        assert ours.mass == theirs.mass and np.array_equal(ours.com, theirs.com) and np.array_equal(ours.inertia, theirs.inertia)
        assert ours.hinge.kind == theirs.hinge.kind and repr(ours.hinge.subhinges) == repr(theirs.hinge.subhinges)
        assert np.array_equal(ours.hinge.rotor_inertia, theirs.hinge.rotor_inertia)
        assert repr(ours.hinge.limits) == repr(theirs.hinge.limits)
        assert np.array_equal(copied.q[ours.hinge.q_slice], original.q[theirs.hinge.q_slice])
        assert np.array_equal(copied.v[ours.hinge.v_slice], original.v[theirs.hinge.v_slice])


# Copies ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_a_copy_moves_as_the_original_does(kind):
    model = flying(KINDS.index(kind), ("free", kind, "ball", "universal", "pin"))
    model.hinges["hinge3"].limits = [-1, -2], [1, 2]
    before = Motions(model)
    made = model.copy_subtree("body1", "body4", suffix="'")
    assert made.name == "body1'" and made.parent.name == "body4" and made.hinge.name == "hinge1'"
    before.assert_same(Motions(model), 1e-13)
    assert_same_branch(model, model, {f"body{k}'": f"body{k}" for k in (1, 2, 3)})
    for body in ("body1", "body2", "body3"):
        for new, old in zip(relative(model, body + "'", "body4"), relative(model, body, "body0"), strict=True):
            assert np.abs(new - old).max() < 1e-12
    assert np.array_equal(model.nodes["node2'"].pose, model.nodes["node2"].pose) and model.nodes["node2'"].body.name == "body2'"
    assert "node4'" not in model.nodes
    again = pickle.loads(pickle.dumps(model))
    assert repr(again.description()) == repr(model.description()) and np.array_equal(again.mass_matrix(), model.mass_matrix())


def test_where_a_copy_is_put():
    model = flying()
    placement = model.frame("body3").pose(wrt="body0")
    model.copy_subtree("body1", "node0", prefix="a ", placement=placement)
    on_body = model.nodes["node0"].pose @ placement
    assert np.abs(model.hinges["a hinge1"].placement - on_body).max() < 1e-14
    model.copy_subtree("body4", rename=lambda name: name.upper())
    assert model.bodies["BODY4"].parent is None and np.array_equal(model.hinges["HINGE4"].placement, model.hinges["hinge4"].placement)
    model.copy_subtree("body1", "body3", suffix=" on its own end")  # outboard of what is copied
    assert model.bodies["body1 on its own end"].parent.name == "body3" and "body1 on its own end on its own end" not in model.bodies


def test_frames_that_stand_on_it_are_copied():
    model = flying()
    model.add_frame("eye", on="body2", position=(0, 0, 1))
    model.add_frame("spot", on="eye", motion=lambda t: np.eye(4))
    model.add_frame("mark", on="body4")
    model.copy_subtree("body2", "body4", prefix="left ")
    assert model.frame("left eye").on.name == "left body2" and model.frame("left spot").on.name == "left eye"
    assert model.frame("left spot").kind == "moved" and "left mark" not in model.frames
    assert np.array_equal(model.frame("left eye").placement, model.frame("eye").placement)
    refused(model, lambda: model.copy_subtree("body2", "body4", rename=lambda n: "eye" if n == "body2" else n + "!"), "two of 'eye'")
    refused(model, lambda: model.copy_subtree("body2", "body4", rename=lambda n: "same" if n in ("eye", "spot") else n + "!"), "'same'")


def test_names_that_are_taken_are_all_listed():
    model = flying()
    words = "'random1' would have two of 'body1', 'body2', 'body3', 'hinge1', 'hinge2',"
    refused(model, lambda: model.copy_subtree("body1", "body4"), words, "'node3'; give the copies names of their own by prefix, suffix or")
    refused(model, lambda: model.copy_subtree("body1", "body4", rename=lambda name: "one"), "two of 'one'")
    refused(model, lambda: model.copy_subtree("body1", "body4", rename=lambda name: ""), "no name")
    refused(model, lambda: model.copy_subtree("body1", "body4", rename=lambda name: 1), "not by 1")
    refused(model, lambda: model.copy_subtree("body1", "body4", rename="x"), "rename is a function")
    refused(model, lambda: model.copy_subtree("body1", "body4", prefix="x", rename=str), "not both")
    refused(model, lambda: model.copy_subtree("body1", "nobody", prefix="x"), "'nobody'")
    refused(model, lambda: model.copy_subtree("nobody", "body4", prefix="x"), "'nobody'")
    refused(model, lambda: model.copy_subtree("body1", "body4", prefix="x", rotation=2 * np.eye(3)), "not orthogonal")
    part = model.subgraph(root="body1")
    refused(part, lambda: part.copy_subtree("body2", "body2", prefix="x"), "is a part of")
    # Coordinates of one hinge are called as another hinge is.
    clash = lambda name: {"hinge2": "joint", "hinge1": "joint[1]"}.get(name, name + "x")
    refused(model, lambda: model.copy_subtree("body1", "body4", rename=clash), "would be called 'joint[1]'")


# Models taken in ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("parent", [None, "body4", "node4"])
def test_a_model_is_taken_in_where_its_base_is_put(parent):
    model, other = flying(), every_kind(rotor_inertia=True, seed=3)
    other.gravity = (0, 0, -1)
    X = model.frame("body3").pose(wrt="body0")
    before, kept, its = Motions(model), repr(other.description()), Motions(other)
    assert [body.name for body in model.merge(other, parent, prefix="o/", placement=X)] == ["o/body0"]
    assert repr(other.description()) == kept and model.gravity.tolist() == flying().gravity.tolist()
    before.assert_same(Motions(model), 1e-13)
    assert_same_branch(model, other, {"o/" + name: name for name in other.bodies})
    for name, pose in its.poses.items():
        now, twist = relative(model, "o/" + name, parent)
        assert np.abs(now - X @ pose).max() < 1e-12 and np.abs(twist - its.twists[name]).max() < 1e-11
    base = [name for name, node in other.nodes.items() if node.body is None][0]
    assert np.abs(model.frame("o/" + base).pose(wrt=parent) - X @ other.nodes[base].pose).max() < 1e-13
    apart = model.nv - other.nv
    rows = [model.coordinate_names.index("o/" + name) for name in other.coordinate_names]
    assert apart > 0 and np.allclose(model.mass_matrix()[np.ix_(rows, rows)], other.mass_matrix(), rtol=0, atol=1e-11)


def test_a_model_alone_a_part_and_none():
    empty, other = pc.Multibody("empty"), flying()
    other.add_frame("mark", position=(1, 2, 3))
    other.add_frame("eye", on="body2")
    other.add_frame("spot", on="world")
    empty.merge(other)
    assert empty.frame("spot").on.name == "base"
    assert np.array_equal(empty.q, other.q) and np.array_equal(empty.mass_matrix(), other.mass_matrix())
    assert empty.frame("mark").placement[:3, 3].tolist() == [1, 2, 3] and empty.frame("eye").on.name == "body2"
    assert empty.merge(pc.Multibody("nothing")) == [] and list(empty.bodies) == list(other.bodies)
    refused(empty, lambda: empty.merge(empty), "'empty' would have two of 'base_node', 'body0', 'body1',", "'eye',", "(19 in all)")
    twice = [body.name for body in empty.merge(empty, suffix=" again")]
    assert twice == ["body0 again"] and empty.nv == 2 * other.nv and "eye again" in empty.frames
    empty.merge(empty.subgraph(root="body2 again"), "body1", prefix="own part/")
    assert empty.bodies["own part/body3 again"].parent.name == "own part/body2 again"
    empty.merge(other, "body0", suffix=" put", position=(0, 0, 2))
    assert empty.frame("mark put").on.name == "body0" and empty.frame("mark put").placement[:3, 3].tolist() == [1, 2, 5]
    leg = other.subgraph(root="body2")
    assert [body.name for body in empty.merge(leg, "body4", prefix="leg/")] == ["leg/body2"]
    refused(empty, lambda: empty.merge("other"), "takes in a model")
    refused(empty, lambda: empty.merge(other, "nobody", prefix="z"), "'nobody'")
    other.frame("mark").motion = lambda t: np.eye(4)
    refused(empty, lambda: empty.merge(other, "body0", prefix="z"), "frame 'mark' is moved by a function of time", "node")
    empty.merge(other, prefix="z")
    assert empty.frame("zmark").kind == "moved"


def test_what_files_said_is_merged():
    robot, other = pc.chain(2), pc.chain(1, name="other")
    robot._left_aside = {"damping": np.array([1.0, 2]), "gravity": np.array([0, 0, -9.81])}
    other._left_aside = {"damping": np.array([3.0]), "friction": np.array([4.0]), "gravity": np.array([0, 0, -1.0])}
    other._actuators = [{"name": "motor", "coordinate": "hinge0"}]
    robot.merge(other, "body0", prefix="o/")
    named = {key: dict(zip(robot.coordinate_names, values, strict=True)) for key, values in robot.left_aside.items() if key != "gravity"}
    assert named["damping"] == {"hinge0": 1, "hinge1": 2, "o/hinge0": 3} and named["friction"]["o/hinge0"] == 4
    assert np.isnan(named["friction"]["hinge0"]) and robot.left_aside["gravity"].tolist() == [0, 0, -9.81]
    robot.copy_subtree("o/body0", "body1", suffix="2")
    assert [(a["name"], a["coordinate"]) for a in robot.actuators] == [("o/motor", "o/hinge0"), ("o/motor2", "o/hinge02")]
    assert other._left_aside["damping"].tolist() == [3]
    gone = robot.remove_body("body1")
    assert gone.bodies == ["body1", "o/body02"] and [a["name"] for a in robot.actuators] == ["o/motor"]
    assert robot.left_aside["damping"].tolist() == [1, 3]


# Removal --------------------------------------------------------------------------------------------------------------


def test_a_body_in_use_is_not_removed():
    arm = pc.chain(4)
    arm.add_node("eye", "body3", position=(1, 0, 0))
    arm.add_node("tool", "eye")
    scene = pc.Scene(arm).add(E.Damping(0.1, hinges=["hinge0", "hinge2"]), E.Gravity(), E.Damping({"hinge1": 1.0}), name=None)
    scene.add(E.NodeSpring("body0", arm.nodes["eye"], 3.0), name="pull")
    refused(arm, lambda: arm.remove_body("body2"), "body 'body2' is in use: node 'eye' is on 'body3'; node 'tool' is on 'body3'",
            "effect 'damping' of a scene names 'hinge2'", "effect 'pull' of a scene names 'eye'",
            "remove_body('body2', with_uses=True) removes these along")  # fmt: skip
    kept = copy.copy(arm), pickle.loads(pickle.dumps(arm))
    gone = arm.remove_body("body2", with_uses=True)
    assert gone.bodies == ["body2", "body3"] and gone.hinges == ["hinge2", "hinge3"] and gone.nodes == ["eye", "tool"]
    assert gone.effects == [(scene, "damping"), (scene, "pull")] and list(scene.effects) == ["gravity", "damping_2"]
    assert scene.evaluate(np.zeros(2), np.zeros(2)).vdot.shape == (2,)
    for again in kept:  # no scene of theirs has anything
        refused(again, lambda again=again: again.remove_body("body2"), "node 'eye' is on 'body3'; node 'tool' is on 'body3'; remove")
    refused(arm, lambda: arm.remove_body("body1"), "effect 'damping_2' of a scene names 'hinge1'")
    del scene, gone
    gc.collect()
    assert arm.remove_body(arm.bodies["body1"]).bodies == ["body1"]
    assert arm.remove_body("body0").bodies == ["body0"] and arm.nv == 0 and arm.mass_matrix().shape == (0, 0)


def test_coordinates_patterns_and_parts_of_lists_are_uses():
    arm = pc.chain(2, "universal")
    scene = pc.Scene(arm).add(E.Damping(0.1, hinges=["hinge1[0]"]), E.Damping(0.1, hinges="hinge*"))
    refused(arm, lambda: arm.remove_body("body1"), "effect 'damping' of a scene names 'hinge1'")
    scene.remove("damping")
    arm.remove_body("body1")  # a pattern takes what there is
    assert scene.evaluate(np.zeros(2), np.ones(2)).vdot.shape == (2,)


def test_links_of_the_file_go_with_their_body(tmp_path):
    robot = pc.Multibody("robot")
    robot.add_body("arm", mass=1.0, com=(1, 0, 0))
    robot.add_body("flange", "arm", "weld", mass=0.5, com=(0, 1, 0))
    robot.save(tmp_path / "robot.toml")
    assert robot.remove_body("arm").nodes == ["flange"]
    assert pc.load(tmp_path / "robot.toml").remove_body("arm").nodes == ["flange"]


def test_a_node_that_was_copied_is_a_node_that_was_added():
    arm = pc.chain(2)
    arm.add_node("eye", "body1")
    arm.copy_subtree("body1", "body0", prefix="left ")
    refused(arm, lambda: arm.remove_body("left body1"), "node 'left eye' is on 'left body1'")
    other = pc.Multibody("other")
    other.merge(arm)
    refused(other, lambda: other.remove_body("body1"), "node 'eye'")
    leg = other.subgraph(root="body1")
    leg.add_node("end", "body1")
    refused(other, lambda: other.remove_body("body1"), "node 'end'")
