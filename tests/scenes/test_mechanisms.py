"""Mechanisms ready to simulate: each against its own equations or constants."""

import numpy as np
import pytest

import pycraft as pc

ALL = ("pendulum", "double_pendulum", "heavy_top", "cart_pole", "kepler", "furuta", "acrobot")


@pytest.mark.parametrize("name", ALL)
def test_they_run_and_keep_their_energy(name):
    scene = getattr(pc.mechanisms, name)()
    run = scene.simulate(100.0 if name == "kepler" else 0.5, integrator="dop853", rtol=1e-11, atol=1e-12)
    assert np.ptp(run.balance) < 1e-9 * max(np.abs(run.energy["kinetic"]).max(), 1.0)
    assert np.abs(run.q[-1] - run.q[0]).max() > 1e-3
    assert np.array_equal(run.q[0], scene.model.q) and np.array_equal(run.v[0], scene.model.v)


def test_a_kepler_orbit():
    a, e = 8.0e6, 0.2
    period = 2 * np.pi * np.sqrt(a**3 / pc.mechanisms.EARTH)
    run = pc.mechanisms.kepler(a, e).simulate(period, t_eval=[period / 2, period], integrator="dop853", rtol=1e-12, atol=1e-9)
    assert np.abs(run.q[:, 4:] - [[-a * (1 + e), 0, 0], [a * (1 - e), 0, 0]]).max() < 1e-6 * a
    long = pc.mechanisms.kepler().simulate(period * 20, integrator="variational4", step=period / 200, t_eval=np.arange(1, 21) * period)
    assert np.ptp(long.balance) < 1e-5 * abs(long.balance[0])


def test_the_cart_and_pole_of_barto():
    """θ̈ = (g sin θ + cos θ (-m l θ̇² sin θ)/(M + m))/(l (4/3 - m cos²θ/(M + m))), l half the length."""
    scene = pc.mechanisms.cart_pole()
    M, m, l, g = 1.0, 0.1, 0.5, 9.81
    for theta, rate in ((0.1, 0.0), (0.7, -1.3), (2.0, 3.0)):
        vdot = scene.evaluate([0.3, theta], [0.2, rate]).vdot
        push = m * l * rate**2 * np.sin(theta) / (M + m)
        angular = (g * np.sin(theta) - np.cos(theta) * push) / (l * (4 / 3 - m * np.cos(theta) ** 2 / (M + m)))
        linear = m * l * (rate**2 * np.sin(theta) - angular * np.cos(theta)) / (M + m)
        assert vdot == pytest.approx([linear, angular], rel=1e-12)


def test_the_acrobot_of_sutton():
    """d₁ θ̈₁ + d₂ θ̈₂ + φ₁ = 0, d₂ θ̈₁ + (m l_c² + I) θ̈₂ + φ₂ = 0, with his d and φ."""
    scene = pc.mechanisms.acrobot()
    m = l = I = 1.0
    c, g = 0.5, 9.81
    (q1, q2), (v1, v2) = (0.4, -0.9), (0.3, 1.1)
    d1 = m * c**2 + m * (l**2 + c**2 + 2 * l * c * np.cos(q2)) + 2 * I
    d2 = m * (c**2 + l * c * np.cos(q2)) + I
    phi2 = m * c * g * np.sin(q1 + q2)
    phi1 = -m * l * c * v2**2 * np.sin(q2) - 2 * m * l * c * v2 * v1 * np.sin(q2) + (m * c + m * l) * g * np.sin(q1) + phi2
    expected = np.linalg.solve([[d1, d2], [d2, m * c**2 + I]], [-phi1, -phi2 - m * l * c * v1**2 * np.sin(q2)])
    assert scene.evaluate([q1, q2], [v1, v2]).vdot == pytest.approx(expected, rel=1e-12)


def test_furutas_pendulum_is_unstable_upright():
    scene = pc.mechanisms.furuta(angle=0.0)
    upright = scene.evaluate(scene.model.q, np.zeros(2)).vdot
    tilted = scene.evaluate([0.0, 1e-3], np.zeros(2)).vdot
    assert np.abs(upright).max() < 1e-14 and tilted[1] > 0


@pytest.mark.parametrize(
    "make, text",
    [
        (lambda: pc.mechanisms.pendulum(length=0.0), "length=0.0: give a positive number"),
        (lambda: pc.mechanisms.double_pendulum(masses=(1.0, -1.0)), "masses=-1.0: give a positive number"),
        (lambda: pc.mechanisms.kepler(eccentricity=1.0), "eccentricity=1.0: give at least 0 and less than 1"),
    ],
)
def test_numbers_that_make_no_sense(make, text):
    with pytest.raises(pc.ModelError, match=text):
        make()
