"""Rows of closed loops span what differences of Pinocchio's frame Jacobians do: of six directions a weld's, of three a ball's.

Tolerance: both Jacobians are right to 100 N eps of their largest entry (test_peers_frames.py), the space that they span to that through the
condition of the rows; singular values below 1e-3 do not count, and are rounding.
"""

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

from support.pinocchio_pairs import EPS, Pair, models  # noqa: E402 - after the check that the extra is there

pytestmark = pytest.mark.peers


@pytest.mark.parametrize("kind", ["weld", "ball"])
@pytest.mark.parametrize(("robot", "root"), [("panda", "fixed"), ("anymal", "free"), ("simple_humanoid", "free")])
def test_rows_span_what_pinocchio_s_do(robot, root, kind):
    model, twin, still = models(robot, root)
    rng = np.random.default_rng(3)
    state = model.random_state(rng)
    pair = Pair(model, twin, still, state.q, state.v, np.zeros(model.nv))
    bodies = [name for name in model.bodies if pair.pin_model.existBodyName(name)]
    for a, b in ((bodies[1], bodies[-1]), (bodies[-2], bodies[2])):
        point = rng.normal(size=3) if kind == "ball" else np.zeros(3)
        X = model.frame(b).pose(state.q, wrt=a)
        loop = model.add_loop(b, a, kind, placement=X, **({"point": point} if kind == "ball" else {}))
        rows = loop.jacobian(state.q)
        loop.remove()  # other tests have the same model
        theirs = pair.pin_model.copy()
        own, ends = pin.SE3(np.eye(3), point), []
        for name, place in ((a, pin.SE3(X[:3, :3], X[:3, 3]) * own), (b, own)):
            body = theirs.frames[theirs.getFrameId(name, pin.FrameType.BODY)]
            ends.append(theirs.addFrame(pin.Frame(f"end on {name}", body.parentJoint, 0, body.placement * place, pin.FrameType.OP_FRAME)))
        data = theirs.createData()
        pin.computeJointJacobians(theirs, data, pair.pq)
        pin.updateFramePlacements(theirs, data)
        one, other = (pin.getFrameJacobian(theirs, data, end, pin.LOCAL_WORLD_ALIGNED) for end in ends)
        J = (other - one)[: len(rows)] @ pair.S  # linear first
        values, others = np.linalg.svd(rows, compute_uv=False), np.linalg.svd(J, compute_uv=False)
        rank = int((values > 1e-3).sum())
        assert rank == (others > 1e-3).sum() >= min(3, len(rows))
        tolerance = 100 * model.nv * EPS * others[0] / others[rank - 1]
        assert values[rank:].max(initial=0) <= tolerance and others[rank:].max(initial=0) <= tolerance
        assert np.abs(rows - rows @ np.linalg.pinv(J, 1e-6) @ J).max() <= tolerance * np.abs(rows).max()
