"""Variational integrators: symplectic, symmetric, momenta kept, energy in a band where others drift."""

import numpy as np
import pytest

import pycraft as pc
from support.runs import spinning

E = pc.effects
BOTH = ["variational2", "variational4"]


def step_map(scene, h, integrator):
    """(q, v) -> (q, v) after one step, in quad precision."""
    wide = pc.Scene(scene.model, precision="quad").add(*scene.effects.values())
    return lambda q, v: (lambda run: (run.q[-1], run.v[-1]))(wide.simulate(h, q, v, integrator=integrator, step=h, energy=False))


@pytest.mark.parametrize("integrator", BOTH)
@pytest.mark.parametrize("case", ["double pendulum", "spinning"])
def test_steps_are_symplectic(case, integrator):
    """The derivative J of a step along (u, p), p = ℳ v, by central differences: J* Ω J = Ω, the canonical form on the group."""
    scene = pc.mechanisms.double_pendulum() if case == "double pendulum" else spinning()
    model, h, d = scene.model, 0.05, 1e-4
    step, n = step_map(scene, h, integrator), scene.model.nv
    q0, v0 = np.array(model.q), np.array(model.v) + 0.3
    q1, v1 = step(q0, v0)

    def momenta(q, v):
        return model.mass_matrix(q) @ v

    def from_coordinates(z):
        q = model.integrate(q0, z[:n])
        return q, np.linalg.solve(model.mass_matrix(q), momenta(q0, v0) + z[n:])

    def to_coordinates(q, v):
        return np.concatenate([model.difference(q1, q), momenta(q, v) - momenta(q1, v1)])

    J = np.zeros((2 * n, 2 * n))
    for i in range(2 * n):
        e = d * np.eye(2 * n)[i]
        ends = [to_coordinates(*step(*from_coordinates(k * e))) for k in (-2, -1, 1, 2)]
        J[:, i] = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * d)

    def form(q, p):
        """Ω((u, p), (u', p')) = p'·u - p·u' + p̄·[u, u'] at the momentum p̄, in body axes: -dθ of θ = p̄·u."""
        W = np.zeros((2 * n, 2 * n))
        W[:n, n:], W[n:, :n] = np.eye(n), -np.eye(n)
        for i in range(n):
            for j in range(n):
                W[i, j] = p @ bracket(model, np.eye(n)[i], np.eye(n)[j])
        return W

    before, after = form(q0, momenta(q0, v0)), form(q1, momenta(q1, v1))
    assert np.abs(J.T @ after @ J - before).max() < 2e-8 * max(1.0, np.abs(before).max()) * np.abs(J).max() ** 2


def bracket(model, u, w):
    """[u, w] of each hinge's group: ω × ω of balls, the cross product of twists of free ones."""
    out = np.zeros(model.nv)
    for hinge in model.hinges.values():
        s = hinge.v_slice
        a, b = u[s], w[s]
        if hinge.kind in ("ball", "free"):
            out[s][:3] = np.cross(a[:3], b[:3])
        if hinge.kind == "free":
            out[s][3:] = np.cross(a[3:], b[:3]) + np.cross(a[:3], b[3:])
    return out


@pytest.mark.parametrize("integrator", BOTH)
def test_steps_are_symmetric_in_time(integrator):
    """A step forwards and, velocities turned round, back: the same state to rounding."""
    scene = spinning()
    there = scene.simulate(0.2, integrator=integrator, step=0.02, energy=False)
    back = scene.simulate(0.2, there.q[-1], -there.v[-1], integrator=integrator, step=0.02, energy=False)
    assert np.abs(scene.model.difference(there.q[0], back.q[-1])).max() < 1e-12
    assert np.abs(back.v[-1] + there.v[0]).max() < 1e-11


@pytest.mark.parametrize("integrator", BOTH)
def test_momenta_of_free_systems_are_kept(integrator):
    """Noether: without outer forces linear and angular momentum stay, to rounding, at any step."""
    free = pc.Scene(spinning().model).add(E.Spring(3.0, hinges=["ball", "boom"]))
    run = free.simulate(5.0, integrator=integrator, step=0.05)
    assert np.abs(run.momentum["origin"] - run.momentum["origin"][0]).max() < 2e-11
    explicit = free.simulate(5.0, integrator="rkmk4", step=0.05)
    assert np.abs(explicit.momentum["origin"] - explicit.momentum["origin"][0]).max() > 1e-7


def drift(run, parts=10):
    """How far means of the energy over tenths of the run lie apart, and the band of all."""
    energy = run.balance
    means = [part.mean() for part in np.array_split(energy, parts)]
    return abs(means[-1] - means[0]), np.ptp(energy)


def test_energy_stays_in_a_band_for_long():
    """20,000 steps of a double pendulum that swings over; the everyday share of a million."""
    scene = pc.mechanisms.double_pendulum(angles=(-1.0, 0.4))
    options = {"step": 0.01, "t_eval": np.arange(1, 2001) * 0.1, "dense": False}
    moved, band = drift(scene.simulate(200.0, integrator="variational2", **options))
    moved4, band4 = drift(scene.simulate(200.0, integrator="variational4", **options))
    moved_rk, _ = drift(scene.simulate(200.0, integrator="rk4", **options))
    assert moved < 0.2 * band and moved4 < 0.2 * band4 and band4 < 0.02 * band
    assert moved_rk > 5 * moved4, (moved, band, moved4, band4, moved_rk)


@pytest.mark.slow
@pytest.mark.parametrize("mechanism, step", [("double_pendulum", 0.01), ("heavy_top", 1e-3)])
def test_energy_over_a_million_steps(mechanism, step):
    """Bounded for both variational ones, where rk4 drifts by more than its band at the start."""
    scene = pc.mechanisms.double_pendulum(angles=(-1.0, 0.4)) if mechanism == "double_pendulum" else pc.mechanisms.heavy_top()
    T = 1e6 * step
    options = {"step": step, "t_eval": np.linspace(T / 20000, T, 20000), "dense": False, "energy": False}
    energies = {}
    for integrator in ("variational2", "rk4"):
        run = scene.simulate(T, integrator=integrator, **options)
        assert run.statistics["steps"] == 1_000_000
        energies[integrator] = run._along["kinetic"] + run._along["potential"].sum(axis=1)
    first, last = np.ptp(energies["variational2"][:2000]), np.ptp(energies["variational2"][-2000:])
    assert np.ptp(energies["variational2"]) < 3 * first and last < 3 * first
    moved = abs(energies["rk4"][-2000:].mean() - energies["rk4"][:2000].mean())
    assert moved > 3 * abs(energies["variational2"][-2000:].mean() - energies["variational2"][:2000].mean())


def test_a_step_that_is_too_long_is_refused():
    scene = pc.mechanisms.heavy_top()
    text = (
        r"integrator 'variational2': the equations of the step of 0\.5 s after t = 0 s are not solved by iteration, "
        r"least of all the velocity of 'top\[\d\]'; take smaller steps"
    )
    with pytest.raises(pc.EvaluationError, match=text):
        scene.simulate(1.0, integrator="variational2", step=0.5)


def test_effects_with_states_and_controllers():
    """A lag of the first order is taken by the midpoint rule, a sampled controller holds: order 2 all the same."""

    class Lag:
        states = (0.0,)

        def __call__(self, t, state):
            return [state.states[0], 0.0]

        def rates(self, t, state):
            return (1.0 + state.q[0] - state.states) / 0.3

    arm = pc.chain(2)
    scene = pc.Scene(arm).add(E.Gravity((0, -9.81, 0)), Lag(), E.Sampled(lambda t, s: -0.5 * s.v, 0.1))
    start = ([0.3, 0.2], [0.5, 0.1])
    best = scene.simulate(0.5, *start, integrator="dop853", rtol=1e-11, atol=1e-13)
    errors = [np.abs(scene.simulate(0.5, *start, integrator="variational2", step=h).q[-1] - best.q[-1]).max() for h in (0.02, 0.01, 0.005)]
    assert np.abs(np.log2(np.array(errors[:-1]) / errors[1:]) - 2).max() < 0.3
