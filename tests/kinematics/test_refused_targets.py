"""Refusals of inverse kinematics: by name, with the model unchanged."""

import numpy as np
import pytest

import pycraft as pc

X = np.eye(4)
MIRROR = np.diag([1.0, 1.0, -1.0])
CASES = {
    "an unknown frame": (dict(targets={"bdoy1": X}), "the nearest is 'body1'"),
    "the base": (dict(targets={None: X}), "a target of the base, which moves nowhere"),
    "nothing": (dict(targets={}), "no target: give {frame: pose}, or centre_of_mass="),
    "no dictionary": (dict(targets="tip"), "targets must be a dictionary {frame: target}"),
    "not a number": (dict(targets={"tip": (0, np.nan, 0)}), r"position of the target of 'tip': entry \[0, 1\] is nan|entry \[1\] is nan"),
    "infinite": (dict(targets={"tip": (0, np.inf, 0)}), "position of the target of 'tip': entry"),
    "a mirror": (dict(targets={"tip": MIRROR}), "the target of 'tip': its matrix is no rotation, it mirrors"),
    "a stretch": (dict(targets={"tip": 2 * np.eye(3)}), "no rotation, R\\*R is 3.0e\\+00 from the identity"),
    "a stretch of a batch": (
        dict(targets={"tip": np.stack([np.eye(3), np.eye(3), 2 * np.eye(3)])}),
        "its matrix of state 2 is no rotation",
    ),
    "a pose's last row": (dict(targets={"tip": np.diag([1.0, 1, 1, 2])}), r"its last row is not \(0, 0, 0, 1\)"),
    "a shape": (dict(targets={"tip": np.zeros(2)}), r"the target of 'tip' is a pose \(4, 4\), .* not an array of shape \(2,\)"),
    "a shape by key": (dict(targets={"tip": dict(position=np.zeros(4))}), r"position of the target of 'tip' takes shape \(3,\)"),
    "text": (dict(targets={"tip": "there"}), "target of 'tip'"),
    "a misspelt key": (dict(targets={"tip": dict(positon=(0, 0, 0))}), "has no 'positon'; did you mean 'position'?"),
    "two of a kind": (dict(targets={"tip": dict(pose=X, position=(0, 0, 0))}), "takes one of pose, position"),
    "nothing of a target": (dict(targets={"tip": dict(wrt="body0")}), r"takes one of pose, position.*it has none"),
    "an axis alone": (dict(targets={"tip": dict(axis=(0, 0, 1))}), "axis= without along="),
    "along alone": (dict(targets={"tip": dict(position=(0, 0, 0), along=(0, 0, 1))}), "along= is the direction of an axis"),
    "no direction": (dict(targets={"tip": dict(axis=(0, 0, 0), along=(0, 0, 1))}), "axis of the target of 'tip' has no direction"),
    "a batch of axes": (dict(targets={"tip": dict(axis=np.ones((2, 3)), along=(0, 0, 1))}), "is one for all states"),
    "directions of an axis": (dict(targets={"tip": dict(axis=(1, 0, 0), along=(0, 0, 1), directions=["x"])}), "takes no directions="),
    "a direction": (dict(targets={"tip": dict(position=(0, 0, 0), directions=["rx"])}), r"different ones of x, y, z, not \['rx'\]"),
    "a direction twice": (dict(targets={"tip": dict(pose=X, directions=["x", "x"])}), "different ones of rx, ry"),
    "the axes of nothing": (dict(targets={"tip": dict(position=(0, 0, 0), axes="target")}), "no axes of its own without an orientation"),
    "unknown axes": (dict(targets={"tip": dict(pose=X, axes="boby0")}), "the nearest is 'body0'"),
    "an unknown wrt": (dict(targets={"tip": dict(pose=X, wrt="elbow")}), "'elbow'"),
    "a weight": (dict(targets={"tip": dict(pose=X, weight=0)}), "weight of the target of 'tip' must be a positive number"),
    "a number whose square is none": (dict(targets={"tip": (1e160, 0, 0)}), "position of the target of 'tip': 1e\\+160 is beyond 1e\\+100"),
    "an axis whose square is none": (
        dict(targets={"tip": dict(axis=(1e300, 0, 0), along=(0, 1, 0))}),
        "axis of the target of 'tip': 1e\\+300 is beyond",
    ),
    "a weight whose square is none": (dict(targets={"tip": dict(position=X[:3, 3], weight=1e200)}), "weight of the target of 'tip': from"),
    "a weight that is nothing": (dict(targets={"tip": dict(position=X[:3, 3], weight=1e-200)}), "weight of the target of 'tip': from"),
    "three weights": (dict(targets={"tip": dict(pose=X, weight=(1, 2, 3))}), "weight of the target of 'tip' must be a positive number"),
    "a tolerance": (dict(targets={"tip": X}, tolerance=-1), "tolerance must be a positive number for rad and m"),
    "a target's tolerance": (dict(targets={"tip": dict(pose=X, tolerance=(1, np.nan))}), "tolerance of the target of 'tip'"),
    "q0 of another size": (dict(targets={"tip": X}, q0=[0.0]), "q of 'chain of 2 rods' takes 2"),
    "q0 that is no number": (dict(targets={"tip": X}, q0=[0.0, np.nan]), "q of hinge 'hinge1'"),
    "batches": (
        dict(targets={"tip": np.zeros((2, 3))}, q0=np.zeros((3, 2))),
        "batches of different sizes: 2 of the targets, 3 of q0",
    ),
    "batches of targets": (
        dict(targets={"tip": np.zeros((2, 3)), "body0": np.zeros((4, 3))}),
        "targets of batches of different sizes: 2 of position of 'tip', 4 of position of 'body0'",
    ),
    "unknown coordinates": (dict(targets={"tip": X}, coordinates=["hinge7"]), "no hinge or coordinate"),
    "the centre of mass": (dict(targets={}, centre_of_mass=dict(positions=(0, 0, 0))), "target of the centre of mass has no 'positions'"),
    "where the centre of mass is": (dict(targets={}, centre_of_mass=dict(wrt="tip")), "target of the centre of mass takes a position"),
    "a pose of the centre of mass": (dict(targets={}, centre_of_mass=X), "target of the centre of mass"),
    "a posture": (dict(targets={"tip": X}, posture=[0.0]), "takes 2"),
}
OPTIONS = {
    "iterations": (dict(iterations=0), "iterations=0, restarts=20: at least 1 and 0"),
    "restarts": (dict(restarts=-1), "at least 1 and 0"),
    "unreached": (dict(unreached="stop"), "unreached='stop': there are 'answer' and 'raise'"),
    "limits": (dict(limits="no"), "limits='no': there are True and False"),
}


@pytest.fixture
def arm():
    made = pc.chain(2)
    made.add_node("tip", "body1", position=(1, 0, 0))
    made.q = [0.25, 0.5]
    return made


@pytest.mark.parametrize("case", CASES)
def test_targets(arm, case):
    given, said = CASES[case]
    with pytest.raises(pc.ModelError, match=said):
        arm.solve_ik(**given)
    assert arm.q.tolist() == [0.25, 0.5] and arm.solve_ik({"tip": (1.0, 1.0, 0.0)}).reached


@pytest.mark.parametrize("case", OPTIONS)
def test_options(arm, case):
    given, said = OPTIONS[case]
    with pytest.raises(pc.EvaluationError, match=said):
        arm.solve_ik({"tip": X}, **given)


def test_a_frame_of_another_model(arm):
    with pytest.raises(pc.ModelError, match="belongs to another model"):
        arm.solve_ik({pc.chain(3).frame("body2"): X})


def test_part_of_a_ball():
    model = pc.tree([-1, 0], ["pin", "ball"])
    with pytest.raises(pc.ModelError, match="part of the ball subhinge of hinge 'hinge1'"):
        model.solve_ik({"body1": (0, 0, 0)}, coordinates=["hinge0", "hinge1[0]"])


def test_no_mass_has_no_centre():
    model = pc.Multibody("light")
    model.add_body("rod")
    with pytest.raises(pc.ModelError, match="mass"):
        model.solve_ik(centre_of_mass=(0, 0, 0))
