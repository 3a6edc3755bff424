"""Inverse kinematics: closed forms, forward kinematics, limits, what cannot be reached, batches, postures."""

import itertools

import numpy as np
import pytest

import pycraft as pc
from pycraft.kinematics.descent import Problem, descend
from pycraft.kinematics.frame_targets import rows_of
from pycraft.kinematics.rotation_vectors import rotation_vectors
from pycraft.models.limits import coordinate_limits

REACHED = 1e-9
"""The default tolerance."""


def planar(n, **limits):
    """n links of 1 m in the plane z = 0, and a tip."""
    arm = pc.chain(n)
    arm.add_node("tip", f"body{n - 1}", position=(1, 0, 0))
    for name, pair in limits.items():
        arm.hinges[name].limits = pair
    return arm


def wrapped(q):
    return (np.asarray(q) + np.pi) % (2 * np.pi) - np.pi


def near_one_of(q, solutions, tolerance):
    return min(np.abs(wrapped(np.asarray(q) - s)).max() for s in solutions) < tolerance


def rotation(axis, angle):
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(np.eye(3)["xyz".index(axis)] * angle).as_matrix()


# Closed forms ---------------------------------------------------------------------------------------------------------


def two_links(x, z, first=1.0, second=1.0):
    """Both solutions of an arm of two links that turn from the first axis to the second."""
    c = (x * x + z * z - first**2 - second**2) / (2 * first * second)
    for elbow in (np.arccos(c), -np.arccos(c)):
        yield np.arctan2(z, x) - np.arctan2(second * np.sin(elbow), first + second * np.cos(elbow)), elbow


@pytest.mark.parametrize("seed", range(8))
def test_two_links(seed):
    arm, rng = planar(2), np.random.default_rng(seed)
    angle, radius = rng.uniform(-np.pi, np.pi), rng.uniform(0.2, 1.9)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    found = arm.solve_ik({"tip": (x, y, 0)}, arm.random_state(seed))
    # an error of 1e-9 m in the tip is at most that over the least singular value in the angles
    least = np.linalg.svd(arm.frame("tip").jacobian(found.q, axes="aligned")[3:5])[1][-1]
    assert found.reached and near_one_of(found.q, list(two_links(x, y)), 2 * REACHED / least)


@pytest.mark.parametrize("seed", range(8))
def test_three_links_with_orientation(seed):
    arm, rng = planar(3), np.random.default_rng(seed)
    q = rng.uniform(-np.pi, np.pi, 3)
    q[1] = np.sign(q[1]) * max(abs(q[1]), 0.3)
    X = arm.pose("tip", q)
    wrist, heading = X[:2, 3] - X[:2, 0], np.arctan2(X[1, 0], X[0, 0])
    solutions = [(a, b, heading - a - b) for a, b in two_links(*wrist)]
    found = arm.solve_ik({"tip": X}, arm.neutral() + 0.3)
    assert found.reached and near_one_of(found.q, solutions, 1e-7)


def six_hinges():
    """Shoulder z, y, elbow y, spherical wrist x, y, x; links of 0.6 m and 0.5 m, a hand of 0.1 m, along x at zero; shoulder 0.4 m up."""
    arm = pc.Multibody("six hinges")
    places = {0: (0, 0, 0.4), 2: (0.6, 0, 0), 3: (0.5, 0, 0)}
    for k, axis in enumerate("zyyxyx"):
        along = np.eye(3)["xyz".index(axis)]
        arm.add_body(f"b{k}", f"b{k - 1}" if k else None, axis=along, position=places.get(k, (0, 0, 0)), mass=1, inertia=np.eye(3))
    arm.add_node("hand", "b5", position=(0.1, 0, 0))
    return arm


def six_hinges_solved(X):
    """All eight, by the wrist's centre and the angles of its rotation."""
    R, centre = X[:3, :3], X[:3, 3] - 0.1 * X[:3, 0]
    for q1 in (np.arctan2(centre[1], centre[0]), np.arctan2(-centre[1], -centre[0])):
        out = np.cos(q1) * centre[0] + np.sin(q1) * centre[1]
        for q2, q3 in two_links(out, -(centre[2] - 0.4), 0.6, 0.5):  # turning about y takes x to -z
            wrist = (rotation("z", q1) @ rotation("y", q2 + q3)).T @ R
            for q5 in (np.arccos(wrist[0, 0]), -np.arccos(wrist[0, 0])):
                s = np.sign(np.sin(q5))
                yield q1, q2, q3, np.arctan2(wrist[1, 0] * s, -wrist[2, 0] * s), q5, np.arctan2(wrist[0, 1] * s, wrist[0, 2] * s)


def test_six_hinges_with_a_wrist():
    arm, met = six_hinges(), set()
    rng = np.random.default_rng(4)
    q = rng.uniform(-1, 1, 6) + [0, 0, 1.5, 0, 1.3, 0]
    X = arm.pose("hand", q)
    solutions = list(six_hinges_solved(X))
    for s in solutions:
        assert np.abs(arm.pose("hand", s) - X).max() < 1e-14
    for seed in range(40):
        found = arm.solve_ik({"hand": X}, arm.random_state(seed))
        assert found.reached and near_one_of(found.q, solutions, 1e-7)
        met.add(int(np.argmin([np.abs(wrapped(found.q - s)).max() for s in solutions])))
    assert len(met) >= 4  # the nearest ones, of different starts


# Forward kinematics ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "end"), [("panda", "panda_link8"), ("ur5", "wrist_3_link"), ("puma560", "link6")])
def test_reachable_poses_of_arms(name, end):
    """All of 200, within limits, whichever they are."""
    arm = getattr(pc.robots, name)()
    Q = np.array([arm.random_state(seed).q for seed in range(200)])
    X = arm.pose(end, Q)
    found = arm.solve_ik({end: X}, arm.neutral())
    assert found.reached.all() and (arm.distance_to_limits(found.q).smallest >= 0).all()
    at = arm.pose(end, found.q)
    assert np.linalg.norm(at[:, :3, 3] - X[:, :3, 3], axis=-1).max() < 1.01 * REACHED
    assert np.linalg.norm(rotation_vectors(np.swapaxes(X[:, :3, :3], 1, 2) @ at[:, :3, :3]), axis=-1).max() < 1.01 * REACHED
    alone = arm.solve_ik({end: X[7]}, arm.neutral())
    assert np.abs(alone.q - found[7].q).max() < 1e-6 and alone.descents == found.descents[7]


def test_several_frames_of_a_humanoid_at_once():
    """Feet where they are, a hand elsewhere seen from the pelvis, looking ahead, the centre of mass over the feet: the root is free."""
    robot = pc.robots.g1()
    bodies = list(robot.bodies)
    left, right = (next(b for b in bodies if b.startswith(side) and "ankle_roll" in b) for side in ("left", "right"))
    hand = next(b for b in bodies if b.startswith("left_wrist_yaw") or b.startswith("left_wrist"))
    q0 = robot.clamped(robot.neutral())
    feet = {side: robot.pose(side, q0) for side in (left, right)}
    reach = robot.frame(hand).pose(q0, wrt="pelvis")[:3, 3] + [0.05, 0.02, 0.08]
    over = (feet[left][:2, 3] + feet[right][:2, 3]) / 2
    targets = [
        (left, feet[left]),
        (right, feet[right]),
        (hand, dict(position=reach, wrt="pelvis")),
        ("pelvis", dict(axis=(0, 0, 1), along=(0, 0, 1))),
    ]
    found = robot.solve_ik(targets, q0, centre_of_mass=dict(position=[*over, 0], directions=["x", "y"]), restarts=0)
    assert found.reached and robot.distance_to_limits(found.q).smallest >= 0
    assert np.abs(robot.centre_of_mass(found.q)[:2] - over).max() < REACHED
    assert np.abs(robot.pose(left, found.q) - feet[left]).max() < 2e-9
    assert np.abs(robot.frame(hand).pose(found.q, wrt="pelvis")[:3, 3] - reach).max() < REACHED
    assert abs(np.linalg.norm(found.q[:4]) - 1) < 1e-12


def test_an_axis_and_a_free_turn_about_it():
    arm = pc.robots.ur5()
    end = list(arm.bodies)[-1]
    found = arm.solve_ik([(end, dict(position=(0.4, 0.2, 0.3))), (end, dict(axis=(0, 0, 2), along=(0, 0, -3)))], arm.neutral() + 0.2)
    X = arm.pose(end, found.q)
    assert found.reached and np.abs(X[:3, 2] - [0, 0, -1]).max() < 2e-9 and np.abs(X[:3, 3] - [0.4, 0.2, 0.3]).max() < 2e-9
    assert list(found.errors) == [end, f"{end} (2)"]
    opposite = pc.Multibody("gimbal")
    opposite.add_body("ring", hinge="gimbal", mass=1, inertia=np.eye(3))
    turned = opposite.solve_ik({"ring": dict(axis=(0, 0, 1), along=(0, 0, -1))}, [0, 0, 0], restarts=0)
    assert turned.reached and opposite.pose("ring", turned.q)[2, 2] < -1 + 1e-15  # from exactly the other way


def test_half_a_turn_away():
    """φ = π: the logarithm's edge is a start like any other."""
    body = pc.chain(1, "ball")
    target = np.diag([1.0, -1.0, -1.0])
    found = body.solve_ik({"body0": target}, body.neutral(), restarts=0)
    assert found.reached and np.abs(body.pose("body0", found.q)[:3, :3] - target).max() < 2e-9


def test_convergence_is_quadratic():
    """|r| is squared from step to step, up to a factor that the second derivatives of an arm of 1 m are far below; redundancy or not."""
    for arm, end in ((pc.robots.panda(), "panda_link8"), (six_hinges(), "hand")):
        q = arm.random_state(3).q * 0.7 + 0.1 * arm.clamped(arm.neutral())
        rows, _ = rows_of(arm, {end: arm.pose(end, q)}, None, 1e-14)
        problem = Problem(arm, rows, np.ones(arm.nv, bool), coordinate_limits(arm))
        ends = [descend(problem, q[None] + 0.15, np.zeros(1, int), count, 0.0) for count in range(1, 7)]
        errors = [float(np.linalg.norm(ended.r)) for ended in ends]
        small = [k for k in range(1, len(errors)) if errors[k - 1] < 1e-2]
        assert len(small) >= 2 and errors[-1] < 1e-13
        assert all(errors[k] < max(20 * errors[k - 1] ** 2, 1e-14) for k in small)


# Limits, and what cannot be reached -----------------------------------------------------------------------------------


def test_out_of_reach_by_how_much():
    arm = planar(2)
    found = arm.solve_ik({"tip": (0, 3, 0)}, [0.2, 0.4])
    assert not found.reached and abs(found.errors["tip"][1] - 1) < 1e-12 and found.stationarity < 1e-7
    assert found.why == "tip is 1 m off: no motion lessens it along tip.y, the best of 21 descents"
    assert np.abs(arm.pose("tip", found.q)[:2, 3] - [0, 2]).max() < 1e-6
    assert {"tip.y": 1.0} in found.lost and list(found.missed) == ["tip.x", "tip.y", "tip.z"]
    with pytest.raises(pc.EvaluationError, match="^tip is 1 m off: no motion lessens it along tip.y"):
        arm.solve_ik({"tip": (0, 3, 0)}, [0.2, 0.4], unreached="raise")


def test_limits_hold_and_are_named():
    arm = planar(2, hinge0=(-0.5, 0.5), hinge1=(-0.2, 0.3))
    found = arm.solve_ik({"tip": (0, 2, 0)}, [0, 0])
    assert not found.reached and found.q.tolist() == [0.5, 0.3] and found.at_limits == [("hinge0", "upper"), ("hinge1", "upper")]
    assert found.why.endswith("at limits are hinge0 (upper), hinge1 (upper), the best of 21 descents")
    free = arm.solve_ik({"tip": (0, 2, 0)}, [0.1, 0.1], limits=False)
    assert free.reached and not free.at_limits


def test_a_minimum_within_limits_is_the_least():
    """Of a grid of all configurations none is nearer."""
    arm = planar(3, hinge0=(-1, 1), hinge1=(-0.5, 1.2), hinge2=(0.3, 0.9))
    for target in ((0.5, 1.0, 0), (-1, -1, 0), (0.2, -0.3, 0), (2.5, 2.5, 0)):
        found = arm.solve_ik({"tip": target}, [0, 0, 0])
        grid = np.array(list(itertools.product(np.linspace(-1, 1, 41), np.linspace(-0.5, 1.2, 41), np.linspace(0.3, 0.9, 41))))
        nearest = np.linalg.norm(arm.pose("tip", grid)[:, :3, 3] - target, axis=1).min()
        left = np.linalg.norm(arm.pose("tip", found.q)[:3, 3] - target)
        assert left <= nearest + 1e-9 and (found.reached or found.stationarity < 1e-7)
        assert arm.distance_to_limits(found.q).smallest >= 0


def test_what_is_held_stays_and_starts_outside_come_in():
    arm = planar(3, hinge0=(-1, 1), hinge1=(-1, 1))
    found = arm.solve_ik({"tip": (1.0, 1.2, 0)}, [2.0, 0.3, 0.4], coordinates=["hinge1", "hinge2"])
    assert found.q[0] == 2.0 and abs(found.q[1]) <= 1  # outside, and no business of this search
    inside = arm.solve_ik({"tip": (1.0, 1.2, 0)}, [2.0, 0.3, 0.4])
    assert inside.reached and abs(inside.q[0]) <= 1


def test_weights_choose_between_targets_that_disagree():
    """Of two places of one tip on a slider the mean by the squares of the weights."""
    cart = pc.chain(1, "slider")
    found = cart.solve_ik([("body0", dict(position=(0, 0, 0), weight=1)), ("body0", dict(position=(0, 0, 1), weight=2))], [0.3])
    axis = cart.pose("body0", [1.0])[:3, 3] - cart.pose("body0", [0.0])[:3, 3]
    weights, places = np.array([1.0, 4.0]), np.array([0.0, axis[2]])
    assert not found.reached and found.stationarity < 1e-7
    assert abs(found.q[0] - weights @ places / weights.sum()) < 1e-7  # |r| times the cosine


def test_tolerances_are_of_angles_and_of_lengths():
    arm = planar(2)
    loose = arm.solve_ik({"tip": dict(position=(0.3, 1.5, 0), tolerance=(1e-9, 0.05))}, [0, 1.2])
    tight = arm.solve_ik({"tip": (0.3, 1.5, 0)}, [0, 1.2], tolerance=1e-12)
    assert loose.reached and tight.reached and loose.iterations < tight.iterations
    assert 1e-6 < loose.errors["tip"][1] < 0.05 and tight.errors["tip"][1] < 1e-12


# Postures -------------------------------------------------------------------------------------------------------------


def test_a_posture_in_the_null_space():
    """Of three links whose tip is held, against a search over the one free angle."""
    arm, posture = planar(3), np.array([0.5, 0.2, 0.1])
    found = arm.solve_ik({"tip": (1.2, 1.1, 0)}, [1.0, -1.0, 1.0], posture=posture)
    least = np.inf
    for q0 in np.linspace(-np.pi, np.pi, 20001):
        wrist = np.array([1.2 - np.cos(q0), 1.1 - np.sin(q0)])
        if np.hypot(*wrist) < 2:
            for a, b in two_links(*wrist):
                least = min(least, np.linalg.norm([q0 - posture[0], wrapped(a - q0) - posture[1], b - posture[2]]))
    assert found.reached and abs(np.linalg.norm(found.q - posture) - least) < 1e-6


def test_a_posture_behind_limits():
    """The way to it ends at a limit, and goes on along it."""
    arm = planar(4, hinge0=(-0.2, 0.2))
    posture = np.array([-0.9, 0.3, 0.2, 0.1])
    found = arm.solve_ik({"tip": (2.0, 2.0, 0)}, [0, 0.5, 0.5, 0.5], posture=posture)
    assert found.reached and found.at_limits == [("hinge0", "lower")]
    J = arm.frame("tip").jacobian(found.q, axes="aligned")[3:5, 1:]
    way = (posture - found.q)[1:]
    left = way - np.linalg.pinv(J) @ (J @ way)
    assert np.linalg.norm(left) < 1e-6 * (1 + np.linalg.norm(way))


def test_a_posture_of_a_ball():
    arm = pc.tree([-1, 0, 1], ["ball", "ball", "ball"], seed=2)
    X, posture = arm.pose("body2", arm.random_state(1).q), arm.random_state(2).q
    plain = arm.solve_ik({"body2": X[:3, 3]}, arm.neutral())
    found = arm.solve_ik({"body2": X[:3, 3]}, arm.neutral(), posture=posture)
    J = arm.frame("body2").jacobian(found.q, axes="aligned")[3:]
    way = arm.difference(found.q, posture)
    assert found.reached and np.linalg.norm(way) < np.linalg.norm(arm.difference(plain.q, posture))
    assert np.linalg.norm(way - np.linalg.pinv(J) @ (J @ way)) < 1e-5


# Batches and degenerate models ----------------------------------------------------------------------------------------


def test_batches():
    arm = planar(3)
    X = arm.pose("tip", np.array([arm.random_state(s).q for s in range(5)]))
    found = arm.solve_ik({"tip": dict(position=X[:, :3, 3])}, arm.neutral() + 0.1)
    assert found.q.shape == (5, 3) and found.reached.shape == (5,) and len(found) == 5 and len(found.why) == 5
    assert found[-1].q.tolist() == found.q[4].tolist() and found[2].errors["tip"][1] == found.errors["tip"][1][2]
    starts = arm.solve_ik({"tip": X[0, :3, 3]}, np.tile(arm.neutral() + 0.1, (4, 1)))
    assert starts.q.shape == (4, 3) and np.ptp(starts.q, axis=0).max() < 1e-12
    none = arm.solve_ik({"tip": dict(position=X[:0, :3, 3])})
    assert none.q.shape == (0, 3) and none.reached.shape == (0,) and none.why == [] and none.errors["tip"][1].shape == (0,)
    one = arm.solve_ik({"tip": X[:1]})
    assert one.q.shape == (1, 3) and repr(one) == "<inverse kinematics: 1 of 1 reached>"
    state = arm.random_state(1)
    arm.q = state.q
    assert arm.solve_ik({"tip": X[0]}).q.tolist() == arm.solve_ik({"tip": X[0]}, state).q.tolist()


def test_models_that_cannot_move():
    still = pc.Multibody("still", welds="keep")
    still.add_body("block", hinge="weld", position=(1, 0, 0), mass=1)
    assert still.solve_ik({"block": (1.0, 0.0, 0.0)}).reached
    short = still.solve_ik({"block": (0.0, 0.0, 0.0)})
    assert not short.reached and short.q.shape == (0,) and short.why == "block is 1 m off: no motion lessens it along block.x"
    near = still.solve_ik({"block": (1.0, 0.0, 0.0)}, posture=[])
    assert near.reached
    arm = planar(2)
    held = arm.solve_ik({"tip": (1, 1, 0)}, [0, 0], coordinates=[])
    assert not held.reached and held.q.tolist() == [0, 0] and held.descents == 1


def test_a_part_of_a_model_and_its_frames():
    """A leg of a robot by itself, and a frame that moves with another one."""
    robot = pc.robots.a1()
    foot = "FR_foot"
    leg = robot.subgraph(root=robot.nodes[foot].body.parent.parent.name)
    X = leg.pose(foot, leg.random_state(5).q)
    found = leg.solve_ik({foot: X[:3, 3]}, leg.neutral())
    assert found.reached and np.abs(leg.pose(foot, found.q)[:3, 3] - X[:3, 3]).max() < REACHED
    robot.add_frame("lens", on=foot, position=(0, 0, -0.05))
    inward = robot.solve_ik(
        {"lens": dict(position=(0.2, -0.15, -0.3), wrt="imu_link")}, robot.clamped(robot.neutral()), coordinates=list(robot.hinges)[1:]
    )
    assert inward.reached and inward.q[:7].tolist() == robot.neutral()[:7].tolist()


def test_seeds():
    arm = pc.robots.panda()
    X = arm.pose("panda_link8", np.array([arm.random_state(s).q for s in range(20)]))
    one, same, other = (arm.solve_ik({"panda_link8": X}, arm.neutral(), seed=s) for s in (1, 1, 2))
    assert (one.q == same.q).all() and (one.q != other.q).any()


# Neutral, limits ------------------------------------------------------------------------------------------------------


def test_neutral():
    model = pc.tree([-1, 0, 1], ["free", "ball", "pin"])
    assert model.neutral().tolist() == [1, *[0] * 6, 1, 0, 0, 0, 0]
    assert model.neutral(3).shape == (3, 12) and model.neutral(0).shape == (0, 12)
    with pytest.raises(pc.ModelError, match="batch must be a number of states from 0 to 2147483647, not -1"):
        model.neutral(-1)


def test_distances_to_limits():
    model = pc.tree([-1, 0, 1], ["ball", "pin", "cylindrical"])
    model.hinges["hinge1"].limits = (-1, 2)
    model.hinges["hinge2"].limits = ((-np.inf, -0.5), (3, np.inf))
    q = np.r_[1, 0, 0, 0, 2.5, 1, 0.25]
    far = model.distance_to_limits(q)
    assert far.names == tuple(model.coordinate_names)
    assert far.lower.tolist() == [np.inf] * 3 + [3.5, np.inf, 0.75] and far.upper.tolist() == [np.inf] * 3 + [-0.5, 2, np.inf]
    assert far.smallest == -0.5 and [x[:2] for x in far.nearest] == [
        ("hinge1", "upper"), ("hinge2[1]", "lower"), ("hinge2[0]", "upper"), ("hinge1", "lower"),
    ]  # fmt: skip
    assert model.clamped(q).tolist() == [1, 0, 0, 0, 2, 1, 0.25]
    batch = model.distance_to_limits(np.tile(q, (2, 1)))
    assert batch.lower.shape == (2, 6) and batch.smallest.tolist() == [-0.5, -0.5] and len(batch.nearest) == 2
    assert model.distance_to_limits(np.zeros((0, 7)) + [1, 0, 0, 0, 0, 0, 0]).smallest.shape == (0,)
    free = pc.chain(2)
    assert (
        free.distance_to_limits().smallest == np.inf and repr(free.distance_to_limits()) == "<distances to limits: no coordinate has one>"
    )
    with pytest.raises(pc.ModelError, match="takes 7"):
        model.distance_to_limits([0, 0])
