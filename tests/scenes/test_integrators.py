"""Integrators of scenes: their orders, measured; tolerances that are followed; and closed forms."""

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.runs import CASES, CONTROLLED, FIXED, SCIPY, apart, exact, orders

E = pc.effects


def test_the_table_is_of_all_integrators():
    table = {row["name"]: row for row in _core.integrator_table()}
    assert list(table) == _core.integrators() and set(table) == {*CONTROLLED, *FIXED, "auto"}
    assert {name for name, row in table.items() if not row["controlled"]} == set(FIXED)
    assert all(table[name]["order"] == order for name, order in FIXED.items())


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("integrator", FIXED)
def test_orders_of_steps_of_one_size(integrator, case):
    """The error after half a second falls by 2^p where steps are halved, to a tenth of p."""
    order, T = FIXED[integrator], 0.5
    scene, end = CASES[case](), exact(case, T)
    coarse = {1: 200, 2: 40, 4: 16}[order]
    errors = []
    for n in (coarse, 2 * coarse, 4 * coarse):
        run = scene.simulate(T, integrator=integrator, step=T / n, energy=False)
        errors.append(apart(scene.model, run.q[-1], run.v[-1], end))
        assert run.statistics["steps"] == n
    found = orders(errors)
    assert abs(found[-1] - order) < 0.1 * order + 0.05 and abs(found[0] - order) < 0.3 * order, (errors, found)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("integrator, order", [("dopri5", 5), ("cash-karp54", 5), ("dop853", 8), ("rosenbrock4", 4)])
def test_orders_of_controlled_steps(integrator, order, case):
    """The same with steps that the tolerance leaves alone: all of one size."""
    T = 0.5
    scene, end = CASES[case](), exact(case, T)
    counts = (32, 64, 128) if order < 8 else (8, 16, 32) if case == "double pendulum" else (2, 4, 8)
    errors = []
    for n in counts:
        run = scene.simulate(T, integrator=integrator, rtol=1e3, atol=1e3, step=T / n, max_step=T / n, energy=False)
        assert run.statistics["steps"] == n and run.statistics["rejected"] == 0
        errors.append(apart(scene.model, run.q[-1], run.v[-1], end))
    found = orders(errors)
    assert abs(found[-1] - order) < 0.15 * order, (errors, found)


@pytest.mark.parametrize("integrator", ["bulirsch-stoer", *CONTROLLED, *SCIPY])
def test_tolerances_are_followed(integrator):
    scene, end = CASES["damped"](), exact("damped", 0.5)
    errors, counts = [], []
    for rtol in (1e-4, 1e-7, 1e-10):
        run = scene.simulate(0.5, integrator=integrator, rtol=rtol, atol=rtol, energy=False)
        errors.append(apart(scene.model, run.q[-1], run.v[-1], end))
        counts.append(run.statistics["evaluations"])
        assert errors[-1] <= 300 * rtol
    assert counts == sorted(counts) and errors[2] < 1e-3 * errors[0]


def test_short_names():
    scene = pc.mechanisms.pendulum()
    for short, full in {"DOP853": "scipy:DOP853", "RK45": "scipy:RK45", "lsoda": "scipy:LSODA", "dop853": "dop853"}.items():
        runs = [scene.simulate(0.3, integrator=name, t_eval=[0.1, 0.3]) for name in (short, full)]
        assert np.array_equal(runs[0].q, runs[1].q) and runs[0].checkpoint().integrator == full


# Closed forms ---------------------------------------------------------------------------------------------------------

EVERY = [*CONTROLLED, "rk4", "rkmk4", "variational4", "scipy:DOP853"]


def tight(integrator):
    if integrator in FIXED:
        return {"integrator": integrator, "step": 1e-3}
    return {"integrator": integrator, "rtol": 1e-9 if integrator == "rosenbrock4" else 1e-11, "atol": 1e-12}


@pytest.mark.parametrize("integrator", EVERY)
def test_the_period_of_the_pendulum(integrator):
    """IFToMM A01: 2.367841947576 s."""
    run = pc.mechanisms.pendulum().simulate(2.367841947576, **tight(integrator))
    assert abs(run.q[-1, 0]) < 2e-7 and abs(run.v[-1, 0]) < 2e-7


def test_the_period_to_all_its_digits():
    """At rest again, falling with 9.81 rad/s²: half a unit of the last digit."""
    scene = pc.mechanisms.pendulum()
    wide = pc.Scene(scene.model, precision="extended").add(E.Gravity())
    run = wide.simulate(2.367841947576, integrator="dop853", rtol=1e-16, atol=1e-16)
    assert abs(run.v[-1, 0]) / 9.81 <= 5e-13 + 1e-14


@pytest.mark.parametrize("integrator", EVERY)
def test_a_symmetric_top_without_torque(integrator):
    """ω turns about the axis of symmetry with (C - A)/A ω₃; the centre of mass moves straight."""
    model = pc.Multibody("top")
    model.add_body("b", hinge="free", mass=2.0, inertia=np.diag([1.0, 1.0, 1.6]))
    v = np.array([0.4, 0, 2.0, 0.3, -0.1, 0.2])
    run = pc.Scene(model).simulate(1.9, [1, 0, 0, 0, 0, 0, 0], v, t_eval=[0.7, 1.9], **tight(integrator))
    angle = 0.6 * 2.0 * run.t
    expected = np.stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), np.full(2, 2.0)], axis=1)
    assert np.abs(run.v[:, :3] - expected).max() < 1e-8
    assert np.abs(run.q[:, 4:] - np.outer(run.t, v[3:])).max() < 1e-8
    assert np.abs(run.momentum["origin"] - run.momentum["origin"][0]).max() < 1e-7


@pytest.mark.parametrize("integrator", EVERY)
def test_an_asymmetric_top_without_torque(integrator):
    """Jacobi's elliptic functions: with I₁ > I₂ > I₃ and L² > 2 E I₂, ω₁ ~ dn, ω₂ ~ sn, ω₃ ~ cn (Landau and Lifshitz, Mechanics, § 37)."""
    from scipy.special import ellipj

    I = np.array([3.0, 2.0, 1.0])
    w1, w3 = 1.5, 0.9  # ω₂ = 0 at the start
    energy2, momentum2 = I[0] * w1**2 + I[2] * w3**2, (I[0] * w1) ** 2 + (I[2] * w3) ** 2
    assert momentum2 > energy2 * I[1]
    rate = np.sqrt((I[0] - I[1]) * (momentum2 - energy2 * I[2]) / np.prod(I))
    m = (I[1] - I[2]) * (energy2 * I[0] - momentum2) / ((I[0] - I[1]) * (momentum2 - energy2 * I[2]))
    model = pc.Multibody("asymmetric")
    model.add_body("b", hinge="ball", mass=1.0, inertia=np.diag(I))
    run = pc.Scene(model).simulate(4.0, [1, 0, 0, 0], [w1, 0, w3], t_eval=np.linspace(0.5, 4, 8), **tight(integrator))
    sn, cn, dn, _ = ellipj(rate * run.t, m)
    w2 = np.sqrt((energy2 * I[0] - momentum2) / (I[1] * (I[0] - I[1])))
    # I₂ ω̇₂ = (I₃ - I₁) ω₃ω₁ < 0 at the start
    assert np.abs(run.v - np.stack([w1 * dn, -w2 * sn, w3 * cn], axis=1)).max() < 2e-7


@pytest.mark.parametrize("integrator", [*EVERY, "scipy:Radau"])
def test_an_oscillator_damped_and_driven(integrator):
    m, k, c, F, w = 2.0, 18.0, 0.8, 3.0, 2.5
    model = pc.Multibody("block")
    model.add_body("block", hinge="slider", axis=(1, 0, 0), mass=m)
    scene = pc.Scene(model).add(E.Spring(k), E.Damping(c), E.TorqueSource(E.Harmonic(F, w / (2 * np.pi), phase=np.pi / 2)))
    H = F / (k - m * w**2 + 1j * c * w)
    lam, x0, v0 = np.roots([m, c, k]), 0.4, -0.3
    A = np.linalg.solve([[1, 1], lam], [x0 - H.real, v0 - (1j * w * H).real])
    times = np.linspace(0, 5, 11)
    solution = (A * np.exp(np.outer(times, lam))).sum(axis=1).real + (H * np.exp(1j * w * times)).real
    run = scene.simulate(5.0, [x0], [v0], t_eval=times, **tight(integrator))
    assert np.abs(run.q[:, 0] - solution).max() < 1e-7


@pytest.mark.parametrize("integrator", ["dop853", "dopri5", "rosenbrock4", "rkmk4", "variational4", "scipy:DOP853"])
def test_the_heavy_top(integrator):
    """Energy and the place of the centre of mass after 1 s as published (Brüls and Cardona 2010), ten digits."""
    options = {"step": 1e-4} if integrator in FIXED else {"rtol": 1e-9 if integrator == "rosenbrock4" else 1e-11, "atol": 1e-11}
    run = pc.mechanisms.heavy_top().simulate(1.0, integrator=integrator, t_eval=[0.0, 1.0], **options)
    assert 0 <= run.balance[0] - 5435.69679086 < 1e-8
    assert np.abs(run.centre_of_mass[1] - [0.1733439641, 0.6400885921, -0.7484907911]).max() < 2e-5
    assert abs(run.balance[1] / run.balance[0] - 1) < 1e-7


@pytest.mark.parametrize("integrator", [*CONTROLLED, "rk4", "rkmk4", "variational2", "variational4", "scipy:DOP853"])
def test_the_balance_of_energy_is_the_integrators_error(integrator):
    """Works are counted by each to its own order: halved steps or a thousandth of the tolerance close it that much better."""
    scene = CASES["damped"]()
    settings = [{"step": h} for h in (0.02, 0.005)] if integrator in FIXED else [{"rtol": r, "atol": r} for r in (1e-5, 1e-8)]
    spread = [np.ptp(scene.simulate(0.5, integrator=integrator, **one).balance) for one in settings]
    better = 4.0 ** FIXED[integrator] if integrator in FIXED else 1000
    assert spread[1] < spread[0] / (0.15 * better) + 1e-12 and spread[1] < 1e-3, spread
