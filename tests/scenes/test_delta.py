"""A Delta robot against its closed forms: the angles of its motors by the plate's place, the place by three spheres, and no turning."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.models import linkages
from support.linkages import close

BASE, PLATE, UPPER, LOWER = 0.2, 0.05, 0.3, 0.6
MOTORS = ["arm0", "arm1", "arm2"]
OUT = np.array([[np.cos(a), np.sin(a), 0] for a in (0, 2 * np.pi / 3, 4 * np.pi / 3)])


def place_of(angles):
    """Below all elbows moved in by the plate's radius, at LOWER from each: three spheres meet in two points, the lower one."""
    c = (BASE - PLATE + UPPER * np.cos(angles))[:, None] * OUT - UPPER * np.sin(angles)[:, None] * [0, 0, 1]
    x = (c[1] - c[0]) / np.linalg.norm(c[1] - c[0])
    i = x @ (c[2] - c[0])
    y = c[2] - c[0] - i * x
    j = np.linalg.norm(y)
    y = y / j
    d = np.linalg.norm(c[1] - c[0])
    p = d / 2
    h = (i**2 + j**2) / (2 * j) - i / j * p
    z = np.cross(x, y)
    ends = [c[0] + p * x + h * y + s * np.sqrt(LOWER**2 - p**2 - h**2) * z for s in (1, -1)]
    return min(ends, key=lambda end: end[2])


def angles_at(place):
    """The half-angle formula of each arm: e cos θ + f sin θ = k, elbows outward."""
    found = []
    for out in OUT:
        s = place + (PLATE - BASE) * out
        e, f, k = 2 * UPPER * s @ out, -2 * UPPER * s[2], s @ s + UPPER**2 - LOWER**2
        found.append(2 * np.arctan((f - np.sqrt(e**2 + f**2 - k**2)) / (e + k)))
    return np.array(found)


def motors(model):
    return np.array([model.q[model.hinges[name].q_slice.start] for name in MOTORS])


@pytest.mark.parametrize("place", [(0, 0, -0.5), (0.1, -0.15, -0.45), (-0.2, 0.1, -0.6)])
def test_its_state_is_that_of_both_closed_forms(place):
    model = linkages.delta(position=place)
    assert np.abs(model.loops.residual(model.q)).max() < 1e-15
    close(motors(model), angles_at(np.array(place)), 1e-13)
    close(place_of(motors(model)), place, 1e-13)
    mobility = model.mobility()
    assert mobility.degrees_of_freedom == 3 and not mobility.redundant and not mobility.singular


def test_motors_say_where_the_plate_is():
    model = linkages.delta()
    rng = np.random.default_rng(0)
    for _ in range(5):
        q = np.array(model.q)
        for name, angle in zip(MOTORS, rng.uniform(-0.3, 0.7, 3), strict=True):
            q[model.hinges[name].q_slice] = angle
        state = model.assemble(q, rng.normal(size=model.nv), fix=MOTORS)
        wanted = place_of(np.array([state.q[model.hinges[name].q_slice.start] for name in MOTORS]))
        X = model.frame("plate").pose(state.q)
        close(X[:3, 3], wanted, 1e-12)
        close(X[:3, :3], np.eye(3), 1e-12)
        assert np.abs(model.frame("plate").velocity(state.q, state.v)[:3]).max() < 1e-12  # it does not turn
        # Its velocity by the three rods, which keep their lengths: (place - elbow)·(v - v_elbow) = 0.
        angles = np.array([state.q[model.hinges[name].q_slice.start] for name in MOTORS])
        rates = np.array([state.v[model.hinges[name].v_slice.start] for name in MOTORS])
        elbows = (BASE - PLATE + UPPER * np.cos(angles))[:, None] * OUT - UPPER * np.sin(angles)[:, None] * [0, 0, 1]
        turned = rates[:, None] * (-UPPER * np.sin(angles)[:, None] * OUT - UPPER * np.cos(angles)[:, None] * [0, 0, 1])
        rods = wanted - elbows
        close(model.frame("plate").velocity(state.q, state.v)[3:], np.linalg.solve(rods, (rods * turned).sum(axis=1)), 1e-11)


def test_it_hangs_still_where_its_motors_hold_it_by_virtual_work():
    """Torques of the motors are the work of the weights along displacements of the motors alone, by differences of the closed forms."""
    scene = pc.mechanisms.delta()
    model = scene.model
    held = scene.equilibrium(hold=MOTORS)
    close(held.q, model.q, 1e-12)
    angles = motors(model)

    def height(angles):
        """Mass times height of all: platform, arms at half, and rods between elbow and plate, two of each."""
        place = place_of(angles)
        elbows = -UPPER * np.sin(angles)
        return 0.5 * place[2] + (UPPER * elbows / 2).sum() + 2 * LOWER * (elbows + place[2]).sum() / 2

    h = 1e-3
    slope = [(8 * (height(angles + h * e) - height(angles - h * e)) - height(angles + 2 * h * e) + height(angles - 2 * h * e)) / (12 * h)
             for e in np.eye(3)]  # fmt: skip
    close(held.holding[[model.hinges[name].v_slice.start for name in MOTORS]], 9.81 * np.array(slope), 1e-9)
    assert np.count_nonzero(held.holding) == 3


def test_it_moves_without_turning():
    run = pc.mechanisms.delta().simulate(0.3, rtol=1e-9, progress=False)
    assert np.abs(np.abs(run.q[:, 0]) - 1).max() < 1e-13 and np.ptp(run.q[:, 6]) > 0.05
    assert np.ptp(run.balance) < 1e-6 * 9.81
