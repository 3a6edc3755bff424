"""The Whipple bicycle against the published benchmark.

Source: J. P. Meijaard, J. M. Papadopoulos, A. Ruina, A. L. Schwab, Proc. R. Soc. A 463, 2007.
Matrices of its equations in lean and steer (eq. 5.4) and eigenvalues (table 2), to the digits that are published: 14.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft.models import vehicles
from support.linkages import close

E, M = pc.effects, pc.mechanisms
G = 9.81
MASS = np.array([[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]])
C1 = np.array([[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])
K0 = np.array([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
K2 = np.array([[0, 76.59734589573222], [0, 2.65431523794604]])
WEAVE = {
    1: 3.52696170990070 + 0.8077402751993j, 2: 2.68234517512745 + 1.68066296590675j, 3: 1.70675605663975 + 2.31582447384325j,
    4: 0.41325331521125 + 3.07910818603206j, 5: -0.77534188219585 + 4.46486771378823j, 6: -1.52644486584142 + 5.87673060598709j,
    7: -2.13875644258362 + 7.19525913329805j, 8: -2.69348683581097 + 8.46037971396931j, 9: -3.21675402252485 + 9.69377351531791j,
    10: -3.72016840437287 + 10.90681139476287j,
}  # fmt: skip
CAPSIZE = {
    1: -3.13423125066578, 2: -3.07158645641514, 3: -2.63366137253667, 4: -1.42944427361326, 5: -0.32286642900409, 6: -0.00406690076970,
    7: 0.10268170574766, 8: 0.14327879765713, 9: 0.15790184030917, 10: 0.16105338653172,
}  # fmt: skip
CASTERING = {
    1: -7.11008014637442, 2: -8.67387984831735, 3: -10.35101467245920, 4: -12.15861426576450, 5: -14.07838969279820, 6: -16.08537123098030,
    7: -18.15788466125262, 8: -20.27940894394569, 9: -22.43788559040858, 10: -24.62459635017404,
}  # fmt: skip
CHOSEN = ["frame[0]", "steer", "rear wheel", "frame[2]", "frame[3]", "frame[4]", "front wheel"]


def lateral(speed):
    """Lean and steer of the linear model at a speed: A (4, 4) and B (4, 2), which nothing else has a part in."""
    found = M.bicycle(speed).linearize(independent=CHOSEN, inputs=["frame[0]", "steer"])
    assert len(found.states) == 10 and found.displacements == 7
    kept = found.place(["q.frame[0]", "q.steer", "v.frame[0]", "v.steer"])
    others = [k for k in range(10) if k not in kept]
    assert np.abs(found.A[np.ix_(kept, others)]).max() < 1e-11
    rest = np.linalg.eigvals(found.A[np.ix_(others, others)])
    assert np.abs(rest).max() < 1e-3  # x, y, heading, the wheels' angles and the speed: zeros, in chains of up to 3, ε^(1/3)
    return found.A[np.ix_(kept, kept)], found.B[kept], found


@pytest.mark.parametrize("speed", [0.0, 1.0, 4.6, 10.0])
def test_matrices_are_as_published(speed):
    A, B, _ = lateral(speed)
    inverse = np.linalg.inv(MASS)
    close(B, np.vstack([np.zeros((2, 2)), inverse]), 1e-12)
    close(A[:2], np.eye(4)[2:])
    close(A[2:, :2], -inverse @ (G * K0 + speed**2 * K2), 1e-12)
    close(A[2:, 2:], -inverse @ (speed * C1), 1e-12)


def test_eigenvalues_are_as_published():
    """Digits that are published have rounding of 5e-15, of numbers to 25; conditions of the eigenvalues are up to some 50."""
    for speed in range(1, 11):
        values = np.linalg.eigvals(lateral(float(speed))[0])
        expected = [CASTERING[speed], CAPSIZE[speed], WEAVE[speed], WEAVE[speed].conjugate()]
        for value in expected:
            assert np.abs(values - value).min() < 1e-12 * (1 + abs(value)), (speed, value)
    still = np.sort(np.linalg.eigvals(lateral(0.0)[0]).real)
    close(still, [-5.53094371765393, -3.13164324790656, 3.13164324790656, 5.53094371765393], 1e-12)


def test_speeds_between_which_it_keeps_upright():
    for speed, imaginary in ((4.29238253634111, 3.43503384866144), (6.02426201538837, 0.0)):  # weave, capsize
        values = np.linalg.eigvals(lateral(speed)[0])
        assert np.abs(values - 1j * imaginary).min() < 1e-12
    assert np.linalg.eigvals(lateral(5.0)[0]).real.max() < 0
    for speed in (4.2, 6.1):
        assert np.linalg.eigvals(lateral(speed)[0]).real.max() > 0


def test_it_rights_itself_as_the_linear_model_says():
    """A push of 0.01 rad/s at 5 m/s: the nonlinear motion is the linear one up to squares of the push."""
    from scipy.linalg import expm

    push, times = 1e-2, np.array([0.3, 0.6, 1.0])
    run = M.bicycle(5.0, lean_rate=push).simulate(1.0, rtol=1e-10, atol=1e-12, t_eval=times, progress=False)
    A, _, _ = lateral(5.0)
    w = np.array([expm(A * t)[:, 2] * push for t in times])
    steer = run.q[:, run.model.hinges["steer"].q_slice.start]
    assert np.abs(steer - w[:, 1]).max() < 20 * push**2 and np.abs(w[:, 1]).max() > 0.1 * push
    upright = [run.model.frame("frame").pose(q)[:3, :3] for q in run.q]
    lean = np.array([np.arctan2(R[2, 1], R[2, 2]) for R in upright])
    assert np.abs(lean - w[:, 0]).max() < 20 * push**2


def test_energy_slip_and_height_are_kept():
    run = M.bicycle(4.6, lean_rate=0.5).simulate(2.0, rtol=1e-9, progress=False)
    assert np.ptp(run.balance) < 1e-6 * run.balance[0]
    model = run.model
    assert max(drift.max() for drift in run.drift.values()) < 1e-13
    assert max(np.abs(model.loops.jacobian(q) @ v).max() for q, v in zip(run.q, run.v, strict=True)) < 1e-11
    assert np.abs(run.q[:, model.hinges["steer"].q_slice.start]).max() > 0.1


def test_at_rest_it_falls_over():
    """Equilibrium of a standing bicycle: unstable, with its stiffness g K0."""
    found = M.bicycle(0.0).equilibrium()
    assert found.stability == "unstable" and np.abs(found.residual).max() < 1e-9
    kept = np.ix_([0, 7], [0, 7])
    close(found.stiffness[kept], G * K0, 1e-12)
    standing = vehicles.bicycle().mobility()
    assert standing.degrees_of_freedom == 3 and not standing.redundant
