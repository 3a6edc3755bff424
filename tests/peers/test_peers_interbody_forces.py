"""Forces of hinges against Pinocchio's `data.f` after `rnea`, on robots fixed and floating, and with ball and free hinges inside.

Each is a sum over the bodies outboard of products that both sides round: 100 N eps of the largest entry, N the number of coordinates.
"""

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

from support.pinocchio_pairs import ANGULAR_FIRST, EPS, INSIDE, Pair, models  # noqa: E402 - after the check that the extra is there

pytestmark = [pytest.mark.peers, pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")]

CASES = [(robot, root) for robot in ("panda", "anymal", "baxter", "talos_reduced") for root in ("fixed", "free")] + [(INSIDE, "fixed")]


@pytest.mark.parametrize("robot, root", CASES)
@pytest.mark.parametrize("given", ["vdot", "tau"])
def test_forces_of_hinges(robot, root, given):
    model, twin, still = models(robot, root)
    rng = np.random.default_rng(7)
    state = model.random_state(rng)
    pair = Pair(model, twin, still, state.q, state.v, rng.uniform(-1, 1, model.nv))
    vdot = pair.u if given == "vdot" else model.forward_dynamics(state.q, state.v, pair.u)
    data = pair.pin_model.createData()
    pin.rnea(pair.pin_model, data, pair.pq, pair.S @ state.v, pair.S @ vdot)
    number = {own: pair.pin_model.getJointId(name) for name, own in pair.joint_names().items()}
    theirs = np.array([np.array(data.f[number[name]].vector)[ANGULAR_FIRST] for name in model.hinges])
    ours = model.interbody_forces(state, **{given: pair.u})
    assert ours.shape == theirs.shape and len(ours) > 3
    assert np.abs(ours - theirs).max() <= 100 * model.nv * EPS * np.abs(theirs).max()
