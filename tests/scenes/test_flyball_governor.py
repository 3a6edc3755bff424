"""The flyball governor (IFToMM A05) against equations of its own, of two coordinates and one.

Both rods move alike: with α the angle of the rods, s the slider's height, and the angular momentum I(α) ω that nothing changes,

    2 J α̈ = ½ I' ω² - V_α - 2 F l_α,   m s̈ = -m g - 2 F l_s,   F = K (l - ½) + C l̇,   l² = ¼ cos² α + (1 - ½ sin α - s)²

The library's reference is published as a picture; that these equations are its mechanism follows from its drawing and table of numbers.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pycraft as pc
from pycraft.models import linkages
from support.linkages import close

M, E = pc.mechanisms, pc.effects
BAR, BALL, CUBE, THIN, G, K, C = 0.3, 5.0, 3.0, 0.01, 9.81, 8e5, 4e4
J = BAR * (1 + THIN**2) / 12 + BAR / 4 + BALL  # of a rod with its ball about its hinge


def about_shaft(a):
    """I(α) and I': rods by integrals along them, their thickness, the ball, the slider, the shaft."""
    c, s = np.cos(a), np.sin(a)
    bar = BAR * (0.05**2 + 0.05 * c + c**2 / 3) + BAR * THIN**2 / 12 * (2 * s**2 + c**2)
    slope = BAR * (-0.05 * s - 2 / 3 * s * c) + BAR * THIN**2 / 12 * 2 * s * c
    whole = 2 * (bar + BALL * (0.05 + c) ** 2) + CUBE * 0.1**2 / 6 + BAR * THIN**2 / 6
    return whole, 2 * (slope - 2 * BALL * (0.05 + c) * s)


MOMENTUM = about_shaft(np.pi / 6)[0] * 2 * np.pi


def rates(_, y):
    a, s, da, ds = y
    I, slope = about_shaft(a)
    drop = 1 - np.sin(a) / 2 - s
    length = np.sqrt(np.cos(a) ** 2 / 4 + drop**2)
    along_a, along_s = (-np.cos(a) * np.sin(a) / 4 - drop * np.cos(a) / 2) / length, -drop / length
    force = K * (length - 0.5) + C * (along_a * da + along_s * ds)
    lifted = -2 * G * np.cos(a) * (BAR / 2 + BALL)
    return [
        da,
        ds,
        (slope * (MOMENTUM / I) ** 2 / 2 - lifted - 2 * force * along_a) / (2 * J),
        -G - 2 * force * along_s / CUBE,
    ]


def rigid_rates(_, y):
    """s = 1 - sin α: (2 J + m cos² α) α̈ - m cos α sin α α̇² = ½ I' ω² + 2 g cos α (½ m_rod + m_ball) + m g cos α"""
    a, da = y
    I, slope = about_shaft(a)
    push = slope * (MOMENTUM / I) ** 2 / 2 + G * np.cos(a) * (2 * (BAR / 2 + BALL) + CUBE)
    return [da, (push + CUBE * np.cos(a) * np.sin(a) * da**2) / (2 * J + CUBE * np.cos(a) ** 2)]


def test_springs_and_dampers_give_the_motion_of_two_coordinates():
    times = np.array([0.1, 0.5, 1.0, 2.0])
    alone = solve_ivp(rates, (0, 2.0), [np.pi / 6, 0.5, 0, 0], method="Radau", t_eval=times, rtol=1e-10, atol=1e-12).y
    run = M.flyball_governor().simulate(2.0, integrator="rosenbrock4", rtol=1e-8, atol=1e-10, t_eval=times, progress=False)
    assert np.abs(run.q[:, 2] - alone[0]).max() < 1e-6 and np.abs(run.q[:, 1] - alone[1]).max() < 1e-6
    assert np.abs(run.q[:, 2] - run.q[:, 3]).max() < 1e-9  # both rods alike
    spin = np.array([about_shaft(a)[0] for a in run.q[:, 2]]) * run.v[:, 0]
    assert np.abs(spin - MOMENTUM).max() < 1e-6 * MOMENTUM
    assert np.ptp(alone[1]) > 0.1
    assert np.ptp(run.balance) < 1e-6 * abs(run.balance[0])  # with what the dampers take


@pytest.mark.parametrize("integrator", ["dopri5", "dop853"])
def test_rigid_couplers_give_the_motion_of_one(integrator):
    times = np.linspace(0.5, 10.0, 20)
    alone = solve_ivp(rigid_rates, (0, 10.0), [np.pi / 6, 0], method="DOP853", t_eval=times, rtol=1e-12, atol=1e-13).y
    run = M.flyball_governor(rigid=True).simulate(10.0, integrator=integrator, rtol=1e-10, atol=1e-11, t_eval=times, progress=False)
    assert np.abs(run.q[:, 2] - alone[0]).max() < 1e-7
    close(run.q[:, 1], 1 - np.sin(run.q[:, 2]), 1e-13)
    assert np.ptp(run.balance) < 1e-7 * abs(run.balance[0]) and np.ptp(alone[0]) > 0.1


def test_stiff_couplers_are_nearly_rigid():
    """Springs give by F/K, some 1e-4 m, and the dampers take little of it."""
    stiff = M.flyball_governor().simulate(1.0, integrator="rosenbrock4", rtol=1e-7, atol=1e-9, t_eval=[0.5, 1.0], progress=False)
    rigid = M.flyball_governor(rigid=True).simulate(1.0, rtol=1e-9, t_eval=[0.5, 1.0], progress=False)
    off = np.abs(stiff.q - rigid.q).max()
    assert 1e-6 < off < 2e-3


def test_masses_are_the_table_s():
    model = linkages.flyball_governor()
    assert abs(model.mass - (0.3 + 3.0 + 2 * 5.3)) < 1e-13
    close(model.mass_matrix([0, 0.5, np.pi / 6, np.pi / 6])[[0, 1, 2, 3], [0, 1, 2, 3]], [about_shaft(np.pi / 6)[0], CUBE, J, J], 1e-14)
    assert linkages.flyball_governor(True).mobility().degrees_of_freedom == 2
    gap = [model.frame(f"middle{i}").pose(model.q, wrt=f"collar{i}")[:3, 3] for i in range(2)]
    close(np.linalg.norm(gap, axis=1), [0.5, 0.5], 1e-15)
