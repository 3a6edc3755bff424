"""Inverse kinematics of models with loops: what is reached is reached with them closed."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.kinematics.frame_targets import rows_of

REACHED = 1e-9
"""The default tolerance."""


def four_bar():
    """Three links of 1 m on a ground of 2 m, and a pen at (0.5, 0.5) of the middle one."""
    model = pc.chain(3)
    model.add_node("tip", "body2", position=(1, 0, 0))
    model.add_node("pen", "body1", position=(0.5, 0.5, 0))
    model.add_loop("tip", None, "pin", axis=(0, 0, 1), position=(2, 0, 0), name="close")
    return model


def closed_form(crank):
    """q of the four-bar with the elbow up, and where its pen is, by the intersection of two circles."""
    A, D = np.array([np.cos(crank), np.sin(crank)]), np.array([2.0, 0.0])
    half = (D - A) / 2
    B = A + half + np.sqrt(1 - half @ half) * np.array([-half[1], half[0]]) / np.linalg.norm(half)
    first, second = (np.arctan2(*(to - there)[::-1]) for there, to in ((A, B), (B, D)))
    pen = A + 0.5 * (B - A) + 0.5 * np.array([-(B - A)[1], (B - A)[0]])
    return np.array([crank, first - crank, second - first]), pen


@pytest.mark.parametrize("crank", [0.4, 0.9, 1.2])
@pytest.mark.parametrize("asked", ["x", "y"])
def test_a_four_bar_against_its_closed_form(crank, asked):
    model, (q, pen) = four_bar(), closed_form(crank)
    assert np.abs(model.loops.residual(q)).max() < 1e-14  # of the closed form: a few roundings of lengths near 2
    found = model.solve_ik({"pen": dict(position=(*pen, 0), directions=[asked])}, q + [0.1, -0.1, 0.1])
    # an error of 1e-9 m in each of the pen and the loop is at most that over the least singular value of what says where q is
    row = model.frame("pen").jacobian(found.q, axes="aligned")[3 + "xy".index(asked)]
    least = np.linalg.svd(np.vstack([row, model.loops.jacobian(found.q)]))[1][model.nv - 1]
    assert found.reached and np.abs(found.q - q).max() < 2 * REACHED / least
    assert set(found.errors) == {"pen", "loop 'close'"} and max(found.errors["loop 'close'"]) <= REACHED


def test_without_its_loop_the_pen_goes_elsewhere():
    """The same target, which an open chain reaches with its tip anywhere: the test above could turn red."""
    model, (q, pen) = four_bar(), closed_form(0.9)
    ask = {"pen": dict(position=(*pen, 0), directions=["y"])}
    start = q + [0.1, -0.1, 0.1]
    model.loops.remove("close")
    open_ = model.solve_ik(ask, start)
    assert open_.reached and set(open_.errors) == {"pen"} and np.abs(open_.q - q).max() > 1e-3


def test_a_batch_is_its_members():
    model = four_bar()
    heights = np.array([closed_form(crank)[1] for crank in (0.4, 0.9)] + [[1.0, 9.0]])
    positions = np.column_stack([heights, np.zeros(3)])
    start = closed_form(0.7)[0]
    found = model.solve_ik({"pen": dict(position=positions, directions=["y"])}, start)
    assert found.reached.tolist() == [True, True, False] and found.errors["loop 'close'"][1].shape == (3,)
    for b, position in enumerate(positions):
        alone = model.solve_ik({"pen": dict(position=position, directions=["y"])}, start)
        assert alone.reached == found.reached[b] and np.array_equal(alone.q, found.q[b])
    none = model.solve_ik({"pen": dict(position=np.zeros((0, 3)), directions=["y"])}, start)
    assert none.q.shape == (0, 3) and none.errors["loop 'close'"][1].shape == (0,)


def test_a_loop_that_stays_open_is_named():
    model = four_bar()
    far = model.solve_ik({"pen": (5, 5, 0)}, closed_form(0.9)[0])
    assert not far.reached and "pen is" in far.why and "loop 'close' is" in far.why and "close: along x" in far.missed
    held = model.solve_ik({"body0": np.eye(3)}, [0.0, 0.3, 0.3], coordinates=["hinge0"])
    assert not held.reached and "loop 'close' is" in held.why and held.q[1:].tolist() == [0.3, 0.3]


def test_loops_hold_on_the_way_to_a_posture():
    model, (q, _) = four_bar(), closed_form(0.9)
    rest, _ = closed_form(1.2)
    found = model.solve_ik({"body2": dict(position=(0, 0, 0), directions=["z"])}, q, posture=rest)
    assert found.reached and np.abs(model.loops.residual(found.q)).max() <= REACHED
    assert np.abs(found.q - rest).max() < 1e-5  # one freedom: the posture is on the loop, and is come to within 1e-7 of its distance


def test_which_rows_of_loops_are_angles():
    """Their tolerance is (rad, m). Rows of velocities are no targets."""
    model = pc.tree([-1, 0, 1, 2], ["pin", "pin", "slider", "pin"])
    hinges = list(model.hinges)
    model.add_loop("body1", None, "universal", axes=[(1, 0, 0), (0, 1, 0)], name="about it")
    model.add_loop("body3", "body0", "screw", axis=(0, 0, 1), pitch=0.1, name="about: along x")
    model.add_coupling({hinges[0]: 1.0, hinges[1]: -2.0}, name="about a gear")
    model.add_coupling({hinges[0]: 0.1, hinges[2]: -1.0}, name="about a rack")
    model.add_rolling("body3", None, "blade", name="skate")
    rows, _ = rows_of(model, {"body3": np.eye(3)}, None, (1e-3, 1e-6))
    told = {one.name: one.angular.tolist() for one in rows[1:]}
    assert told == {
        "loop 'about it'": [True, False, False, False],
        "loop 'about: along x'": [True, True, False, False, False],
        "loop 'about a gear'": [True],
        "loop 'about a rack'": [False],
    }
    assert all(one.tolerance == (1e-3, 1e-6) for one in rows)


def test_a_loop_that_lost_its_body_is_named():
    model = four_bar()
    model.add_body("other", None, "pin")
    model.add_loop("other", None, "weld", name="stuck")
    model._remove_body("other")  # the core knows of no loops
    with pytest.raises(pc.ModelError, match="loop 'stuck' of .* has lost what it was declared on"):
        model.solve_ik({"pen": (1, 1, 0)})
