"""Frames against Pinocchio: LOCAL, LOCAL_WORLD_ALIGNED and WORLD are ours "body", "aligned" and "world" relative to the base.

Pinocchio's rates of Jacobians are rates of the entries in each of these axes, as ours; its spatial acceleration in LOCAL_WORLD_ALIGNED is
the local one in the world's axes, as ours; the classical one v̇ + ω × v of each. Of two frames that move, Pinocchio's differences are formed
here by its own actions: J_a - Ad(X_ab) J_b, and the rate of that, with d/dt Ad(X) = Ad(X) ad(V).

Tolerance: as in test_peers_sensitivities, 100 N eps of the largest entry, N the number of coordinates.
"""

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

from support.pinocchio_pairs import ANGULAR_FIRST, EPS, INSIDE, STATES, Pair, models  # noqa: E402 - after the check that the extra is there

pytestmark = [pytest.mark.peers, pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")]

AXES = {"body": pin.LOCAL, "aligned": pin.LOCAL_WORLD_ALIGNED, "world": pin.WORLD}
ROBOTS = ("panda", "allegro_right_hand", "anymal", "simple_humanoid", "talos_reduced")
CASES = [(robot, root) for robot in ROBOTS for root in ("fixed", "free")]


class Theirs:
    """Return Pinocchio's values for the frames of a pair of models at its state, angular first and over our coordinates."""

    def __init__(self, pair):
        self.pair, self.model, self.data = pair, pair.pin_model, pair.pin_model.createData()
        v, u = pair.S @ pair.v, pair.S @ pair.u
        pin.forwardKinematics(self.model, self.data, pair.pq, v, u)
        pin.computeJointJacobians(self.model, self.data, pair.pq)
        pin.computeJointJacobiansTimeVariation(self.model, self.data, pair.pq, v)
        pin.updateFramePlacements(self.model, self.data)

    def index(self, name):
        return self.model.getFrameId(name, pin.FrameType.BODY)

    def pose(self, name):
        return self.data.oMf[self.index(name)]

    def motion(self, call, name, axes):
        return np.array(call(self.model, self.data, self.index(name), AXES[axes]).vector)[ANGULAR_FIRST]

    def columns(self, call, name, axes):
        return np.array(call(self.model, self.data, self.index(name), AXES[axes]))[ANGULAR_FIRST] @ self.pair.S


@pytest.fixture(scope="module", params=[*CASES, (INSIDE, "fixed")], ids=lambda case: "-".join(case))
def cases(request):
    model, twin, still = models(*request.param)
    rng = np.random.default_rng(8)
    states = [model.random_state(rng) for _ in range(STATES)]
    return [(pair, Theirs(pair)) for pair in (Pair(model, twin, still, s.q, s.v, rng.uniform(-1, 1, model.nv)) for s in states)]


def agree(pair, mine, theirs, label):
    scale = max(1.0, np.abs(theirs).max(initial=0))
    assert mine.shape == theirs.shape and np.abs(mine - theirs).max(initial=0) <= 100 * pair.model.nv * EPS * scale, label


def names_of(pair):
    """Bodies and nodes that are frames of Pinocchio: of each robot the tips, which hang at its branches, and some between."""
    known = [name for name in [*pair.model.bodies, *pair.model.nodes] if pair.pin_model.existFrame(name, pin.FrameType.BODY)]
    return known if len(known) <= 8 else known[:: max(1, len(known) // 8)]


@pytest.mark.parametrize("axes", AXES)
def test_against_the_base(cases, axes):
    for pair, theirs in cases:
        for name in names_of(pair):
            frame, state = pair.model.frame(name), (pair.q, pair.v)
            agree(pair, frame.pose(pair.q), np.array(theirs.pose(name).homogeneous), name)
            agree(pair, frame.velocity(*state, axes=axes), theirs.motion(pin.getFrameVelocity, name, axes), name)
            agree(pair, frame.acceleration(*state, pair.u, axes=axes), theirs.motion(pin.getFrameAcceleration, name, axes), name)
            classical = theirs.motion(pin.getFrameClassicalAcceleration, name, axes)
            agree(pair, frame.acceleration(*state, pair.u, axes=axes, kind="classical"), classical, name)
            agree(pair, frame.jacobian(pair.q, axes=axes), theirs.columns(pin.getFrameJacobian, name, axes), name)
            rate = theirs.columns(pin.getFrameJacobianTimeVariation, name, axes)
            # Pinocchio's is along its own v, where ours = S v and S is constant: no planar joint is among these
            agree(pair, frame.jacobian_dot(*state, axes=axes), rate, name)


def test_against_each_other(cases):
    swap = lambda A: A[np.ix_(ANGULAR_FIRST, ANGULAR_FIRST)]
    for pair, theirs in cases:
        names = names_of(pair)
        for a, b in zip(names, [*names[3:], *names[:3]], strict=True):
            frame, X = pair.model.frame(a), theirs.pose(a).actInv(theirs.pose(b))  # b in a
            agree(pair, frame.pose(pair.q, wrt=b), np.array(X.inverse().homogeneous), (a, b))
            Ad = swap(np.array(X.action))
            J_b, rate_b = (theirs.columns(call, b, "body") for call in (pin.getFrameJacobian, pin.getFrameJacobianTimeVariation))
            J = theirs.columns(pin.getFrameJacobian, a, "body") - Ad @ J_b
            agree(pair, frame.jacobian(pair.q, wrt=b), J, (a, b))
            agree(pair, frame.velocity(pair.q, pair.v, wrt=b), J @ pair.v, (a, b))
            # the twist of b relative to a, in b's axes
            V = np.array(X.actInv(pin.Motion((-J @ pair.v)[ANGULAR_FIRST])).vector)
            turning = swap(np.array(pin.Motion(V).action))
            rate = theirs.columns(pin.getFrameJacobianTimeVariation, a, "body") - Ad @ (rate_b + turning @ J_b)
            agree(pair, frame.jacobian_dot(pair.q, pair.v, wrt=b), rate, (a, b))
            agree(pair, frame.acceleration(pair.q, pair.v, pair.u, wrt=b), J @ pair.u + rate @ pair.v, (a, b))
