"""Forward dynamics on loops beside the dense equations with Pinocchio's mass matrix, bias forces, Jacobians and accelerations of frames.

Its own constraintDynamics iterates where rows are redundant; test_peers_mechanisms.py calls it, and `pycraft bench` has it on a ladder.
Tolerance: both are right to eps times the condition of Q ℳ⁻¹ Q*, below 1e6 here.
"""

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

from pycraft.cli.bench_loops import BESIDE, beside_pinocchio, ladder  # noqa: E402 - after the check that the extra is there
from pycraft.peers.pinocchio_loops import PinocchioLoops  # noqa: E402 - after the check that the extra is there
from support.pinocchio_pairs import Pair, models  # noqa: E402 - after the check that the extra is there

pytestmark = pytest.mark.peers


@pytest.mark.parametrize("kind", ["weld", "ball"])
@pytest.mark.parametrize(("robot", "root"), [("panda", "fixed"), ("anymal", "free")])
def test_accelerations_are_those_of_pinocchio_s_equations(robot, root, kind):
    model, twin, still = models(robot, root)
    rng = np.random.default_rng(5)
    state = model.random_state(rng)
    tau = rng.normal(size=model.nv)
    pair = Pair(model, twin, still, state.q, state.v, tau)
    bodies = [name for name in model.bodies if pair.pin_model.existBodyName(name)]
    a, b = bodies[1], bodies[-1]
    X = model.frame(b).pose(state.q, wrt=a)
    loop = model.add_loop(b, a, kind, placement=X, name="loop")
    try:
        v = model.constrained_velocities(state.q, state.v).v
        got = model.constrained_dynamics(state.q, v, tau)
    finally:
        loop.remove()  # other tests have the same model
    theirs, ends = pair.pin_model.copy(), []
    for name, place in ((a, pin.SE3(X[:3, :3], X[:3, 3])), (b, pin.SE3.Identity())):
        body = theirs.frames[theirs.getFrameId(name, pin.FrameType.BODY)]
        ends.append(theirs.addFrame(pin.Frame(f"end on {name}", body.parentJoint, 0, body.placement * place, pin.FrameType.OP_FRAME)))
    data, axes, rows = theirs.createData(), pin.LOCAL_WORLD_ALIGNED, 6 if kind == "weld" else 3
    M = pin.crba(theirs, data, pair.pq)
    M = pair.ours(np.triu(M) + np.triu(M, 1).T)
    h = pair.S.T @ pin.nonLinearEffects(theirs, data, pair.pq, pair.S @ v)
    pin.forwardKinematics(theirs, data, pair.pq, pair.S @ v, np.zeros(theirs.nv))
    pin.computeJointJacobians(theirs, data, pair.pq)
    pin.updateFramePlacements(theirs, data)
    one, other = (np.array(pin.getFrameJacobian(theirs, data, end, axes)) for end in ends)
    c, d = (pin.getFrameClassicalAcceleration(theirs, data, end, axes).vector for end in ends)
    J, bias = (other - one)[:rows] @ pair.S, (d - c)[:rows]
    free = np.linalg.solve(M, tau - h)
    W = np.linalg.solve(np.linalg.cholesky(M), J.T)
    y = np.linalg.pinv(W.T, rcond=1e-8) @ (J @ free + bias)
    expected = free - np.linalg.solve(np.linalg.cholesky(M).T, y)
    ours = model.forward_dynamics(state.q, v, tau)
    assert np.abs(ours - free).max() <= 1e-9 * np.abs(free).max()
    assert np.abs(got.vdot - free).max() > 0.1 * np.abs(free).max()  # the loop does something
    assert np.abs(got.vdot - expected).max() <= 1e-9 * np.abs(expected).max()


def test_its_own_constraint_dynamics_on_the_ladder_that_is_timed():
    """As `pycraft bench` takes it: balls for pins, whose rows across the plane are redundant; it iterates to 1e-10, ours is exact."""
    model = ladder(3)
    q, rng = np.array([1.0, -1.0] * 3 + [1.0]), np.random.default_rng(1)
    v = model.constrained_velocities(q, rng.normal(size=model.nv)).v
    tau = rng.normal(size=model.nv)
    peer = PinocchioLoops(model, [((f"crank{i}", (1, 0, 0)), (f"rod{i}", (1, 0, 0))) for i in range(1, 4)])
    expected = model.constrained_dynamics(q, v, tau).vdot
    assert np.abs(peer.ours(peer.call(q, v, tau)()) - expected).max() <= 1e-7 * np.abs(expected).max()
    figures = beside_pinocchio(seconds=0.01, ladders=(1, 100))
    assert [figure.name.split(", ")[1] for figure in figures] == ["ladder of 1", "ladder of 100", "Cassie"]
    assert all(figure.value > 0 and figure.bound == BESIDE for figure in figures)
