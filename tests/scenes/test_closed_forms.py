"""Motions with a closed form: an orbit, a block that slides and stops, a motor that runs up; by every integrator that fits.

Those of pendulum, tops and oscillator are in test_integrators.py.
"""

import numpy as np
import pytest

import pycraft as pc
from support.runs import CONTROLLED, FIXED

E = pc.effects
EVERY = [*CONTROLLED, *FIXED, "scipy:DOP853", "scipy:Radau"]


def options(integrator, step=2e-4, rtol=1e-10, atol=1e-12):
    if integrator in FIXED:
        return {"step": step}
    return {"rtol": max(rtol, 1e-8) if integrator in ("rosenbrock4", "scipy:Radau") else rtol, "atol": atol}


def error_of(integrator, step=2e-4):
    """Error of fixed steps in motions of size and rate one: a few h^p."""
    return 20 * step ** FIXED[integrator] + 1e-8 if integrator in FIXED else 3e-6


# An orbit --------------------------------------------------------------------------------------------------------------


def on_the_ellipse(t, a, e, mu):
    """Places and velocities at t from the pericentre: E - e sin E = n t, solved by Newton's method."""
    n = np.sqrt(mu / a**3)
    E = n * t
    for _ in range(60):
        E = E - (E - e * np.sin(E) - n * t) / (1 - e * np.cos(E))
    b, rate = a * np.sqrt(1 - e**2), n / (1 - e * np.cos(E))
    return np.stack([a * (np.cos(E) - e), b * np.sin(E)], axis=1), np.stack([-a * np.sin(E) * rate, b * np.cos(E) * rate], axis=1)


@pytest.mark.parametrize("integrator", EVERY)
@pytest.mark.parametrize("eccentricity", [0.0, 0.5])
def test_keplers_orbit(integrator, eccentricity):
    """All along one revolution, in units in which a = μ = 1 and a period lasts 2π."""
    if integrator == "semi-implicit-euler" and eccentricity:
        pytest.skip("order 1: a hundred thousand steps to three digits")
    scene = pc.mechanisms.kepler(1.0, eccentricity, mu=1.0)
    times = np.linspace(0, 2 * np.pi, 9)
    run = scene.simulate(times[-1], integrator=integrator, t_eval=times, **options(integrator, 1e-3))
    place, velocity = on_the_ellipse(times, 1.0, eccentricity, 1.0)
    allowed = 100 * error_of(integrator, 1e-3) if eccentricity else 10 * error_of(integrator, 1e-3)  # it passes near, and quickly
    assert np.abs(run.q[:, 4:6] - place).max() < allowed and np.abs(run.q[:, 6]).max() < 1e-14
    assert np.abs(run.frame("satellite", axes="aligned").twist[:, 3:5] - velocity).max() < allowed
    assert np.ptp(run.balance) < allowed
    spin = run.momentum["origin"][:, 2]  # the areal law
    assert np.abs(spin - np.sqrt(1 - eccentricity**2)).max() < allowed


# A block on a slope ----------------------------------------------------------------------------------------------------

SLOPE, FRICTION, MASS, G = np.radians(30.0), 0.3, 2.0, 9.81


def block(friction=FRICTION, smoothing=1e-3):
    """On the slope's own axis x, downwards; the friction is μ m g cos α, as the block presses with m g cos α."""
    model = pc.Multibody("block")
    model.add_body("block", hinge="slider", axis=(1, 0, 0), mass=MASS)
    downhill = (G * np.sin(SLOPE), 0.0, -G * np.cos(SLOPE))
    return pc.Scene(model).add(E.Gravity(downhill), E.CoulombFriction(friction * MASS * G * np.cos(SLOPE), smoothing=smoothing))


@pytest.mark.parametrize("integrator", EVERY)
def test_a_block_slides_down_a_slope(integrator):
    """v̇ = g (sin α - μ cos α) of dry friction, to which tanh(v/s) smooths it; at v₀ of 500 s it is one to rounding."""
    scene, v0 = block(smoothing=1e-3), 0.5
    times = np.array([0.25, 0.5, 1.0])
    run = scene.simulate(1.0, [0.1], [v0], integrator=integrator, t_eval=times, **options(integrator, 1e-3))
    along = G * (np.sin(SLOPE) - FRICTION * np.cos(SLOPE))
    allowed = 10 * error_of(integrator, 1e-3) if FIXED.get(integrator) == 1 else 1e-7
    assert run.v[:, 0] == pytest.approx(v0 + along * times, abs=allowed)
    assert run.q[:, 0] == pytest.approx(0.1 + v0 * times + along * times**2 / 2, abs=allowed)
    lost = -FRICTION * MASS * G * np.cos(SLOPE) * (run.q[:, 0] - 0.1)
    assert run.energy["work"][:, run.workers.index("coulomb_friction")] == pytest.approx(lost, abs=20 * allowed)


@pytest.mark.parametrize("integrator", ["dopri5", "rosenbrock4", "scipy:Radau"])
def test_a_block_thrown_uphill_stops_and_stays(integrator):
    """With μ > tan α: it stops after v₀/(g (sin α + μ cos α)), and creeps then with s artanh(tan α/μ), not more."""
    friction, smoothing, v0 = 0.9, 1e-4, -2.0
    run = block(friction, smoothing).simulate(1.0, [0.0], [v0], integrator=integrator, rtol=1e-8, atol=1e-10)
    slows = G * (np.sin(SLOPE) + friction * np.cos(SLOPE))
    stops = -v0 / slows
    way = -(v0**2) / (2 * slows)
    creep = smoothing * np.arctanh(np.tan(SLOPE) / friction)
    assert run.at(0.5 * stops).v[0] == pytest.approx(0.5 * v0, rel=1e-6)
    assert run.v[-1, 0] == pytest.approx(creep, rel=1e-5)
    assert run.at(1.2 * stops).q[0] == pytest.approx(way, abs=10 * smoothing * 1.0)  # what smoothing does lasts for less than the run
    assert np.ptp(run.balance) < 1e-5


# A motor ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", EVERY)
def test_a_motor_runs_up(integrator):
    """(I + n² I_r) ω̇ = n T₀ (u - n ω/ω₀): ω reaches its speed by 1 - exp(-t/τ), against a load that slows it."""
    inertia, n, stall, idle, rotor, command, load = 0.4, 5.0, 0.8, 60.0, 2e-3, 0.9, 0.5
    model = pc.Multibody("wheel")
    model.add_body("wheel", axis=(0, 0, 1), mass=1.0, inertia=np.diag([1.0, 1.0, inertia]))
    scene = pc.Scene(model).add(
        E.Motor(command, stall_torque=stall, no_load_speed=idle, gear_ratio=n, rotor_inertia=rotor), E.TorqueSource(-load)
    )
    whole, slope = inertia + n**2 * rotor, n**2 * stall / idle
    final, tau = (n * stall * command - load) / slope, whole / slope
    times = np.array([0.2, 0.7, 1.5, 3.0])
    run = scene.simulate(3.0, integrator=integrator, t_eval=times, **options(integrator, 1e-3))
    speed = final * (1 - np.exp(-times / tau))
    angle = final * (times - tau * (1 - np.exp(-times / tau)))
    allowed = error_of(integrator, 1e-3) * max(1.0, final)
    assert run.v[:, 0] == pytest.approx(speed, abs=allowed) and run.q[:, 0] == pytest.approx(angle, abs=3 * allowed)
    gains = final / tau * np.exp(-times / tau)
    force = n * stall * command - slope * speed - n**2 * rotor * gains
    assert run.forces["motor"][:, 0] == pytest.approx(force, abs=2 * slope * allowed)
    assert run.energy["kinetic"] == pytest.approx(whole * speed**2 / 2, abs=whole * final * allowed)
