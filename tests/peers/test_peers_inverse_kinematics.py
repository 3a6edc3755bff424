"""Inverse kinematics beside Pinocchio: its forward kinematics has our configurations at the targets, and its textbook loop reaches no pose
that we do not.

The loop is CLIK, v = -J⁺ log(X_t⁻¹X) with Pinocchio's log6, Jlog6 and frame Jacobian, damped, from the same start, without limits.
"""

import numpy as np
import pytest

import pycraft as pc

pin = pytest.importorskip("pinocchio")

from pycraft.interop.export import to_pinocchio  # noqa: E402 - after the check that the extra is there

pytestmark = pytest.mark.peers
ARMS = [("panda", "panda_link8"), ("ur5", None), ("puma560", None)]


def closed_loop(model, data, joint, place, target, q, steps=300):
    """CLIK's configuration, and whether it came to 1e-9."""
    for _ in range(steps):
        pin.forwardKinematics(model, data, q)
        error = target.actInv(data.oMi[joint] * place)
        e = pin.log6(error).vector
        if np.linalg.norm(e) < 1e-9:
            return q, True
        J = pin.Jlog6(error) @ place.toActionMatrixInverse() @ pin.computeJointJacobian(model, data, q, joint)
        q = pin.integrate(model, q, -J.T @ np.linalg.solve(J @ J.T + 1e-6 * np.eye(6), e))
    return q, False


@pytest.mark.parametrize(("name", "end"), ARMS)
def test_beside_its_textbook_loop(name, end):
    arm = getattr(pc.robots, name)()
    end = end or list(arm.bodies)[-1]
    twin = to_pinocchio(arm)
    data, (joint, carried) = twin.model.createData(), twin.tip
    last = list(arm.bodies)[-1]
    place = carried * pin.SE3(arm.frame(end).pose(arm.neutral(), wrt=last))
    Q = np.array([arm.random_state(seed).q for seed in range(60)])
    X = arm.pose(end, Q)
    start = arm.clamped(Q + 0.3 * np.random.default_rng(0).choice([-1, 1], Q.shape))
    ours = arm.solve_ik({end: X}, start, limits=False, restarts=0)
    theirs = 0
    for b, target in enumerate(X):
        q, reached = closed_loop(twin.model, data, joint, place, pin.SE3(target), twin.q(start[b]))
        theirs += reached
        assert ours.reached[b] or not reached, b
        if ours.reached[b]:
            pin.forwardKinematics(twin.model, data, twin.q(ours.q[b]))
            at = data.oMi[joint] * place
            assert np.linalg.norm(at.translation - target[:3, 3]) < 2e-9
            assert np.linalg.norm(pin.log3(target[:3, :3].T @ at.rotation)) < 2e-9
            if reached and np.abs(q - twin.q(ours.q[b])).max() < 1e-3 and arm.nv == 6:  # the same one of several solutions
                least = np.linalg.svd(arm.jacobian(end, ours.q[b]))[1][-1]
                assert np.abs(q - twin.q(ours.q[b])).max() < 4e-9 / least
    assert theirs > 40 and ours.reached.mean() > 0.95


@pytest.mark.parametrize("kinds", [["free", "ball", "pin"], ["universal", "planar", "gimbal"]])
def test_neutral(kinds):
    model = pc.tree([-1, 0, 1], kinds)
    twin = to_pinocchio(model)
    assert np.array_equal(pin.neutral(twin.model), twin.q(model.neutral()))
