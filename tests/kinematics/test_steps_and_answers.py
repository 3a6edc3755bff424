"""The bounded step by the laws that make it one, and what solutions say of targets that weights and batches make different."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.dynamics.task_space import told
from pycraft.kinematics.descent import _step


@pytest.mark.parametrize("seed", range(20))
def test_steps_within_bounds(seed):
    """Of coordinates strictly inside the objective's derivative is zero, and nothing is outside.

    Tolerance: singular values of random 4 x 6 and 6 x 6 matrices lie between 0.01 and 6, so that rounding stays below 1e-12.
    """
    rng = np.random.default_rng(seed)
    J, e, mu = rng.normal(size=(5, 4 + 2 * (seed % 2), 6)), rng.normal(size=(5, 4 + 2 * (seed % 2))), rng.uniform(0.01, 1, 5)
    low, high = -rng.uniform(0, 0.5, (5, 6)), rng.uniform(0, 0.5, (5, 6))
    free = rng.uniform(size=(5, 6)) < 0.8
    d = _step(J, e, mu, low, high, free)
    assert np.all(d >= low) and np.all(d <= high) and np.all(d[~free] == 0)
    gradient = np.einsum("bij,bi->bj", J, e + np.einsum("bij,bj->bi", J, d)) + mu[:, None] * d
    inside = free & (d > low) & (d < high)
    assert np.abs(gradient[inside]).max(initial=0) < 1e-12 and inside.any() and (free & ~inside).any()


def one_link():
    arm = pc.chain(1)
    arm.add_node("tip", "body0", position=(1, 0, 0))
    return arm


def test_what_is_lost_and_missed_is_told_in_directions_and_not_in_weights():
    """A link's tip turns as it moves: rz - y / cos q cannot change, whatever each weighs."""
    arm, target = one_link(), np.eye(4)
    target[:3, 3] = (1, 0.5, 0)
    for weight in (1, (1, 3), (5, 1)):
        found = arm.solve_ik({"tip": dict(pose=target, directions=["rz", "y"], weight=weight)}, [0.1])
        (lost,) = found.lost
        assert not found.reached and lost.keys() == {"tip.rz", "tip.y"}
        assert abs(lost["tip.rz"] * 1 + lost["tip.y"] * np.cos(found.q[0])) < 1e-6
        assert f": no motion lessens it along {told([lost])}, the best of 21 descents" in found.why


def test_members_answer_for_their_own_targets():
    """The lost directions of an orientation depend on it."""
    from scipy.spatial.transform import Rotation

    arm = one_link()
    targets = Rotation.from_rotvec([[0.5, 0, 0.2], [1.5, 0.3, 0], [0, 2.5, 0.1]]).as_matrix()
    found = arm.solve_ik({"tip": dict(orientation=targets)}, [0.0])
    for b, target in enumerate(targets):
        alone = arm.solve_ik({"tip": target}, [0.0])
        assert found.why[b] == alone.why == found[b].why and not alone.reached
        J = lambda lost: np.array([[one.get(f"tip.r{x}", 0.0) for x in "xyz"] for one in lost])
        one, same = J(alone.lost), J(found.lost[b])
        assert np.linalg.matrix_rank(np.vstack([one, same]), tol=0.1) == 2  # the same plane, whatever spans it


def test_what_rounding_hides_is_stationary_all_the_same():
    arm = pc.robots.panda()
    far = arm.solve_ik({"panda_link8": dict(position=[[1.5, 0, 0.333], [0, 2, 0.1], [0.2, 0.1, 3]])}, arm.clamped(arm.neutral()))
    assert not far.reached.any() and far.stationarity.max() < 1e-7


def test_what_is_left_over_is_stationary_where_first_order_steps_creep():
    """A humanoid's wrist out of reach: Gauss-Newton steps alone leave cosines of 1e-3 after a thousand."""
    robot = pc.robots.g1(root="fixed")
    places = np.random.default_rng(0).uniform(1.2, 2, (4, 3))
    far = robot.solve_ik({"left_wrist_yaw_link": dict(position=places)}, robot.clamped(robot.neutral()), restarts=3)
    assert not far.reached.any() and far.stationarity.max() < 1e-7
    assert (robot.distance_to_limits(far.q).smallest >= 0).all()


def test_a_posture_is_of_hinges_and_not_of_where_the_base_is():
    model = pc.tree([-1, 0, 1, 2], ["free", "pin", "pin", "pin"], seed=3)
    target = {"body3": (0.3, 0.2, 0.1)}
    here, there = model.neutral(), model.neutral()
    here[7:] = there[7:] = (0.5, -0.4, 0.3)
    there[4:7] = (5, 5, 5)
    found = [model.solve_ik(target, model.neutral(), posture=posture).q for posture in (here, there)]
    assert np.abs(found[0] - found[1]).max() < 1e-12 and np.abs(found[0][7:] - here[7:]).max() < 1e-6


def test_whether_it_is_reached_is_its_truth():
    """`if arm.solve_ik(...)` asked for a length, which one solution has not; a batch was true where none was reached."""
    arm = pc.chain(3)
    arm.add_node("tip", "body2", position=(1, 0, 0))
    assert arm.solve_ik({"tip": (1.5, 1.0, 0.0)}, [0.1, 0.2, 0.3])
    assert not arm.solve_ik({"tip": (9.0, 0.0, 0.0)}, [0.1, 0.2, 0.3])
    both = arm.solve_ik({"tip": [(1.5, 1.0, 0.0), (9.0, 0.0, 0.0)]}, [0.1, 0.2, 0.3])
    with pytest.raises(pc.ModelError, match=r"a batch of 2 is neither reached nor not: use .reached.all\(\) or .reached.any\(\)"):
        bool(both)
    assert both[0] and not both[1]
