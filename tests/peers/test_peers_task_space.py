"""Task space against Pinocchio's Delassus matrix of two frames, whole and along directions, and its inverse.

Tolerance: 100 N eps κ(ℳ) of the largest entry, N the number of coordinates, since both go through an inverse of ℳ; of Λ times κ(Λ⁻¹).
"""

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

from support.pinocchio_pairs import ANGULAR_FIRST, EPS, INSIDE, Pair, models  # noqa: E402 - after the check that the extra is there

pytestmark = [pytest.mark.peers, pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")]

CASES = [("panda", "free"), ("anymal", "free"), ("simple_humanoid", "free"), ("talos_reduced", "free"), (INSIDE, "fixed")]


def delassus(pair, names, kind):
    """J ℳ⁻¹ J* of these frames, linear first as Pinocchio has it."""
    held, data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for name in names:
        frame = pair.pin_model.frames[pair.pin_model.getFrameId(name, pin.FrameType.BODY)]
        held.append(pin.RigidConstraintModel(kind, pair.pin_model, frame.parentJoint, frame.placement, pin.LOCAL))
    for one in held:
        data.append(one.createData())
    return np.array(pin.computeDelassusMatrix(pair.pin_model, pair.pin_model.createData(), pair.pq, held, data))


@pytest.mark.parametrize("robot, root", CASES)
def test_two_frames(robot, root):
    model, twin, still = models(robot, root)
    for seed in range(3):
        state = model.random_state(seed)
        pair = Pair(model, twin, still, state.q, state.v, state.v)
        names = pair.frames()[:2]
        bound = 100 * model.nv * EPS * np.linalg.cond(model.mass_matrix(state.q))
        whole = model.task_space(names, state.q)
        order = [6 * i + j for i in range(len(names)) for j in ANGULAR_FIRST]
        theirs = delassus(pair, names, pin.ContactType.CONTACT_6D)[np.ix_(order, order)]
        assert np.abs(whole.compliance - theirs).max() <= bound * np.abs(theirs).max()
        points = model.task_space({name: ["x", "y", "z"] for name in names}, state.q)
        theirs = delassus(pair, names, pin.ContactType.CONTACT_3D)
        assert np.abs(points.compliance - theirs).max() <= bound * np.abs(theirs).max()
        condition = np.linalg.cond(theirs)
        if condition < 1e8:
            known = np.linalg.inv(theirs)
            assert np.abs(points.inertia - known).max() <= bound * condition * np.abs(known).max()
