"""Bad input to frames: an error that names the frame and the remedy, and everything as it was."""

import copy
import re

import numpy as np
import pytest

import pycraft as pc


@pytest.fixture
def arm():
    arm = pc.chain(3)
    arm.add_frame("tool", on="body2", position=(1, 0, 0))
    arm.add_frame("bit", on="tool", position=(0, 0, 1))
    return arm


def refused(kind, words):
    return pytest.raises(kind, match=re.escape(words))


def test_unknown_frames_are_told_with_the_nearest(arm):
    with refused(pc.ModelError, "no frame of 'chain of 3 rods' is called 'body22'; the nearest is 'body2'; there are"):
        arm.frame("body22")
    with refused(pc.ModelError, "is called 'tol'; the nearest is 'tool'"):
        arm.frame("body1").pose(wrt="tol")
    with refused(pc.EvaluationError, "axes='bdy': there are 'body', 'aligned', 'world', and those of a frame; no frame of"):
        arm.frame("tool").velocity(axes="bdy")
    with refused(pc.ModelError, "the nearest is 'bit'"):
        arm.add_frame("new", on="bitt")
    with refused(KeyError, "no frame of"):
        arm.frames["nothing"]
    with refused(pc.ModelError, "a frame is named by a string, not by 3"):
        arm.frame(3)
    assert "bit" in arm.frames and "nothing" not in arm.frames and len(arm.frames) == 5


def test_states_come_first_and_frames_by_their_word(arm):
    with refused(pc.ModelError, "the reference frame of 'tool' is given as wrt='body1'"):
        arm.frame("tool").pose("body1", t=0.0)
    with refused(pc.ModelError, "given as wrt='body1'"):
        arm.frame("tool").velocity(arm.frame("body1"))
    with refused(pc.EvaluationError, "kind='coriolis' of an acceleration: there are 'spatial', 'classical'"):
        arm.frame("tool").acceleration(kind="coriolis")
    with refused(pc.ModelError, "q of 'chain of 3 rods' takes 3 numbers"):
        arm.frame("tool").pose([0, 0])
    with refused(pc.ModelError, "inf"):
        arm.frame("tool").velocity([0, 0, 0], [0, np.inf, 0])
    with refused(pc.ModelError, "t has an entry that is not a finite number"):
        arm.frame("tool").pose([0, 0, 0], t=np.nan)
    with refused(pc.ModelError, "the time of the frames of 'chain of 3 rods'"):
        arm.frames.t = np.inf
    with refused(pc.ModelError, "vdot"):
        arm.frames.vdot = [0, 0]


def test_frames_of_another_model(arm):
    other = pc.chain(2)
    for foreign in (other.frame("body1"), other.bodies["body1"], other.add_node("eye", "body1")):
        with refused(pc.ModelError, f"frame {foreign.name!r} belongs to another model, 'chain of 2 rods', and has no pose in 'chain"):
            arm.frame("tool").pose(wrt=foreign)
        with refused(pc.ModelError, "belongs to another model"):
            arm.add_frame("new", on=foreign)


def test_names_are_taken_once(arm):
    for name in ("tool", "body1", "base", "world"):
        with refused(pc.ModelError, f"has a frame called '{name}' already"):
            arm.add_frame(name)
    with refused(pc.ModelError, "a frame called 'tool' already; give every body a name"):
        arm.add_body("tool", mass=1.0)
    with refused(pc.ModelError, "a frame called 'tool' already; give every node a name"):
        arm.add_node("tool")
    assert list(arm.bodies) == ["body0", "body1", "body2"]


def test_a_body_of_the_model_may_be_called_base(arm):
    arm.add_node("base", "body1", position=(0, 0, 2))
    assert arm.frame("base").kind == "node" and arm.frame(None).kind == "base" and arm.frame("world").kind == "base"
    assert arm.frame("base").pose(arm.q)[2, 3] == 2


def test_what_others_stand_on_is_not_removed(arm):
    with refused(pc.ModelError, "frame 'tool' cannot be removed: 'bit' stands on it; remove or attach elsewhere what does"):
        arm.frame("tool").remove()
    arm.add_frame("light", on="tool")
    with refused(pc.ModelError, "'bit', 'light' stand on it"):
        arm.frames.remove("tool")
    arm.frame("bit").remove(), arm.frame("light").attach("body0"), arm.frame("tool").remove()
    assert "tool" not in arm.frames and "light" in arm.frames
    with refused(pc.ModelError, "no frame of 'chain of 3 rods' is called 'tool'"):
        arm.frame("body1").pose(wrt="tool")


def test_no_frame_stands_on_itself(arm):
    before = arm.frame("bit").pose()
    with refused(pc.ModelError, "frame 'tool' cannot stand on itself"):
        arm.frame("tool").attach("tool")
    arm.add_frame("tip", on="bit")
    with refused(pc.ModelError, "frame 'tool' cannot stand on 'tip', which stands on it: 'tip' on 'bit' on 'tool'"):
        arm.frame("tool").attach("tip")
    with refused(pc.ModelError, "cannot stand on 'tip'"):
        arm.frame("tool").attach("tip", keep_pose=True)
    assert arm.frame("tool").on.name == "body2" and np.array_equal(arm.frame("bit").pose(), before)


def test_only_loose_frames_are_edited(arm):
    for name, what in (("body1", "that of a body"), ("base", "the base")):
        frame = arm.frame(name)
        with refused(pc.ModelError, what):
            frame.attach("body0")
        with refused(pc.ModelError, what):
            frame.remove()
        with refused(pc.ModelError, what):
            frame.placement = np.eye(4)
        with refused(pc.ModelError, what):
            frame.motion = lambda t: np.eye(4)


def test_what_a_body_takes_with_it(arm):
    """A removed body leaves its loose frames without a carrier: they raise an error until they are attached elsewhere."""
    arm.remove_body("body2")
    for question in (lambda: arm.frame("bit").pose(), lambda: arm.frame("body0").velocity(wrt="tool"), lambda: arm.frame("tool").on):
        words = "frame 'tool' of 'chain of 3 rods' stood on 'body2', which is no longer there: attach it to another frame, or remove it"
        with refused(pc.ModelError, words):
            question()
    assert repr(arm.frame("tool")) == "<frame 'tool': missing, or without its carrier>"
    with refused(pc.ModelError, "frame 'tool' is not copied: no frame of 'chain of 3 rods' is called 'body2'"):
        copy.copy(arm)
    arm.frame("tool").attach("body1")
    assert arm.frame("bit").pose([0, 0])[:3, 3].tolist() == [2, 0, 1]


def test_poses_that_are_none(arm):
    with refused(pc.ModelError, "the rotation of frame 'new' is not orthogonal"):
        arm.add_frame("new", rotation=2 * np.eye(3))
    with refused(pc.ModelError, "the rotation of frame 'tool' is a reflection"):
        arm.frame("tool").placement = np.diag([1.0, 1, -1, 1])
    with refused(pc.ModelError, "frame 'tool'"):
        arm.frame("tool").placement = np.eye(3)
    with refused(pc.ModelError, "frame 'new': give a pose, or a motion"):
        arm.add_frame("new", position=(0, 0, 0), motion=lambda t: np.eye(4))
    with refused(pc.ModelError, "the motion of frame 'new' is a function of time, not 7"):
        arm.add_frame("new", motion=7)
    with refused(pc.ModelError, "frame 'tool' is a function of time, not None"):
        arm.frame("tool").motion = None
    assert "new" not in arm.frames and arm.frame("tool").placement[0, 3] == 1 and arm.frame("tool").kind == "fixed"


NONSENSE = [
    (lambda t: None, "the pose of the motion of frame 'odd' at t = 0.5"),
    (lambda t: np.eye(3), "is a (4, 4) pose, not an array (3, 3)"),
    (lambda t: 2 * np.eye(4), "the last row of a pose is (0, 0, 0, 1)"),
    (lambda t: np.diag([t, 1, 1, 1]), "is not orthogonal"),
    (lambda t: np.full((4, 4), np.nan), "the pose of the motion of frame 'odd' at t = 0.5"),
    (lambda t: np.vstack([np.full((3, 4), np.nan), np.eye(4)[3]]), "has an entry that is not a number"),
    (lambda t: "pose", "the pose of the motion of frame 'odd' at t = 0.5"),
    (lambda t: 1j * np.eye(4), "the pose of the motion of frame 'odd'"),
    (lambda t: (), "not a tuple of 0"),
    (lambda t: (np.eye(4), *np.zeros((3, 6))), "a pose (4, 4), or (pose, twist) or (pose, twist, acceleration), not a tuple of 4"),
    (lambda t: (np.eye(4), np.zeros(3)), "the twist of the motion of frame 'odd' at t = 0.5 is six numbers, angular first, not 3"),
    (lambda t: (np.eye(4), np.zeros(6), np.full(6, np.inf)), "the acceleration of the motion of frame 'odd' at t = 0.5 has an entry"),
]


@pytest.mark.parametrize(("motion", "words"), NONSENSE)
def test_functions_of_time_that_return_nonsense(arm, motion, words):
    arm.add_frame("odd", on="tool", motion=motion)
    arm.frames.t = 0.5
    with refused(pc.ModelError, words):
        arm.frame("odd").pose()
    with refused(pc.ModelError, words):
        arm.frame("odd").pose(arm.q)
    arm.frame("odd").motion = lambda t: np.eye(4)
    assert np.array_equal(arm.frame("odd").pose(), arm.frame("tool").pose())


def test_no_difference_is_taken_where_a_motion_gives_no_rate(arm):
    arm.add_frame("drift", on="tool", motion=lambda t: np.eye(4))
    arm.add_frame("glide", on="drift", motion=lambda t: (np.eye(4), np.zeros(6)))
    assert arm.frame("glide").velocity(wrt="drift").tolist() == [0] * 6
    for question in (arm.frame("drift").velocity, lambda: arm.frame("glide").velocity([0, 0, 0]), arm.frame("drift").jacobian_dot):
        with refused(pc.ModelError, "the motion of frame 'drift' gives a pose and no velocity: for velocities and rates let it return"):
            question()
    with refused(pc.ModelError, "the motion of frame 'glide' gives no acceleration"):
        arm.frame("glide").acceleration(wrt="drift")
    assert arm.frame("glide").jacobian().shape == (6, 3)
    with refused(pc.ModelError, "moved by a function of time and keeps its motion"):
        arm.frame("glide").attach("body0", keep_pose=True)


def test_errors_of_a_users_function_are_its_own(arm):
    def motion(t):
        raise KeyError("no data at that time")

    arm.add_frame("odd", motion=motion)
    with pytest.raises(KeyError, match="no data at that time"):
        arm.frame("odd").pose()
    with pytest.raises(KeyError, match="no data at that time"):
        arm.frame("odd").pose(np.zeros((4, 3)))


def test_nothing_is_edited_by_a_motion_while_it_is_asked(arm):
    edits = [lambda: arm.add_frame("new"), lambda: arm.frame("bit").remove(), lambda: arm.frame("bit").attach(None)]
    for edit in edits:
        if "odd" in arm.frames:
            arm.frame("odd").remove()
        arm.add_frame("odd", on="bit", motion=lambda t, edit=edit: [edit(), np.eye(4)][1])
        for question in (arm.frame("odd").pose, lambda: arm.frame("odd").pose([0, 0, 0])):
            with refused(pc.ModelError, "the frames of 'chain of 3 rods' are being asked about, in another thread or by a motion"):
                question()
    arm.frame("odd").motion = lambda t: [arm.add_body("new", mass=1.0), np.eye(4)][1]
    with refused(pc.ModelError, "is being evaluated"):
        arm.frame("odd").pose()
    assert list(arm.bodies) == ["body0", "body1", "body2"] and "new" not in arm.frames


def test_a_file_holds_no_loose_frames(arm, tmp_path):
    with pytest.warns(pc.ModelWarning, match="no file holds loose frames, and these were not written: bit, tool"):
        arm.save(tmp_path / "arm.toml")
    assert list(pc.load(tmp_path / "arm.toml").frames) == ["body0", "body1", "body2"]


def test_coordinates_that_are_not_there(arm):
    frame = arm.frame("tool")
    for given, words in [
        ("hinge9", "no hinge or coordinate of 'chain of 3 rods' is called 'hinge9'; the nearest is 'hinge"),
        ([3], "coordinate 3 of 'chain of 3 rods', which has 3"),
        ([-1], "coordinate -1 of 'chain of 3 rods', which has 3"),
        (["hinge0", 0], "coordinate 'hinge0' of 'chain of 3 rods' is named twice"),
        ([1.0], "a coordinate of 'chain of 3 rods' must be a whole number, not 1.0"),
        (2.5, "a coordinate of 'chain of 3 rods' must be a whole number, not 2.5"),
    ]:
        with refused(pc.ModelError, words):
            frame.jacobian(coordinates=given)
        with refused(pc.ModelError, words):
            frame.jacobian_operator(coordinates=given)


def test_misspelt_attributes(arm):
    with refused(pc.ModelError, "did you mean 'placement'"):
        arm.frame("tool").placment = np.eye(4)
