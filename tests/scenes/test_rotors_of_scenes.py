"""Scenes with rotors of unequal inertia on balls and of any on free hinges: integrators of both families, momentum, thermostats, effects.

The equations follow from the kinetic energy ½ v*(ℳ + J)v, so that steps that come from its variation and steps that follow accelerations
are of one motion, and exp(-H/kT) stays as it is.
"""

import numpy as np
import pytest

import pycraft as pc
from support.oracle import ROUNDING, agree
from support.rotors import ball, crossed, gyroscopic, hull
from support.scenes import hybrid_dynamics, prescribing

E = pc.effects
QUIET = dict(progress=False)


def end(scene, T, q, v, **how):
    run = scene.simulate(T, q, v, **QUIET, **how)
    return np.r_[run.q[-1], run.v[-1]]


@pytest.mark.parametrize("by", ["model", "effect", "motor"])
def test_two_families_of_integrators_agree(by):
    """rk4 and variational4, of order four: to each other as h⁴. At h = 1e-2 they differ by 1e-7 or so; a sixteenth at half the step."""
    model, J = ball(), np.array([0.2, 0.85, 1.5])
    scene = pc.Scene(model)
    if by != "model":
        model.hinges["body"].rotor_inertia = 0.0
        scene = pc.Scene(model).add(E.RotorInertia(J) if by == "effect" else E.Motor(0.0, 1e-300, 1e300, rotor_inertia=J, gear_ratio=1.0))
    start = model.zero_q(), [1.0, 0.15, -0.7]
    off = []
    for h in (0.02, 0.01):
        ends = [end(scene, 1.0, *start, integrator=i, step=h) for i in ("rk4", "variational4")]
        off.append(np.abs(ends[0] - ends[1]).max())
    assert off[1] < 1e-6 and off[1] < off[0] / 10
    fine = end(scene, 1.0, *start, integrator="dopri5", rtol=1e-12, atol=1e-13)
    agree(ends[0], fine, 1e-6)
    agree(fine[4:], [0.8788, -0.5064, -0.6256], 1e-3)  # what the variational steps had all along


def momentum(model, q, v):
    """Momentum (n; f) of a free body and its rotors about the world's origin, in world axes."""
    X = model.pose(next(iter(model.bodies)), q)
    own = (model.mass_matrix(q) @ v)[:6]
    n, f = X[:3, :3] @ own[:3], X[:3, :3] @ own[3:]
    return np.r_[n + np.cross(X[:3, 3], f), f]


def test_momentum_of_a_free_body_is_kept():
    """Nothing acts: (ℳ + J)v in world axes stays, the arm's ball with its own rotors moving all the while."""
    model = hull()
    state = model.random_state(2)
    run = pc.Scene(model).simulate(3.0, state.q, state.v, rtol=1e-12, atol=1e-13, **QUIET)
    kept = [momentum(model, run.q[k], run.v[k]) for k in (0, len(run.t) // 2, -1)]
    agree(kept[1], kept[0], 1e-9)
    agree(kept[2], kept[0], 1e-9)
    assert np.ptp(run.balance) < 1e-9
    assert np.abs(run.v[-1] - run.v[0]).max() > 0.1


def test_rotors_of_effects_are_a_models_own():
    """Accelerations, forces shown, linear and quadratic models: the same whether the model has the rotors or the scene."""
    own, bare = hull(), hull()
    J = np.concatenate([hinge.rotor_inertia for hinge in own.hinges.values()])
    for hinge in bare.hinges.values():
        hinge.rotor_inertia = 0.0
    state, tau = own.random_state(5), np.random.default_rng(5).uniform(-1, 1, own.nv)
    scenes = [pc.Scene(own).add(E.TorqueSource(tau)), pc.Scene(bare).add(E.TorqueSource(tau), E.RotorInertia(J))]
    found = [scene.evaluate(state.q, state.v) for scene in scenes]
    condition = np.linalg.cond(own.mass_matrix(state.q))
    agree(found[1].vdot, found[0].vdot, ROUNDING * condition)
    agree(found[0].vdot, own.forward_dynamics(state.q, state.v, tau), ROUNDING * condition)
    agree(found[1].forces["rotor_inertia"], -J * found[1].vdot - crossed(own, state.v) @ (J * state.v), ROUNDING * condition)
    lines = [scene.linearize(state.q, state.v) for scene in scenes]
    agree(lines[1].A, lines[0].A, ROUNDING * condition)
    h, n = 2.0**-10, own.nv
    for j, e in enumerate(h * np.eye(n)):
        near, far = (rate(scenes[1], state, s * e) - rate(scenes[1], state, -s * e) for s in (1, 2))
        slope = (8 * near - far) / (12 * h)
        agree(lines[1].A[n:, n + j], slope, 1e-9 * condition)
    bends = [scene.quadratic_model(state.q, state.v).contracted(np.r_[np.zeros(n), np.ones(n)]) for scene in scenes]
    agree(bends[1].xx, bends[0].xx, ROUNDING * condition**2)


def rate(scene, state, along):
    return scene.evaluate(state.q, state.v + along).vdot


def heavier(J):
    """The hull with more rotors."""
    model, at = hull(), 0
    for hinge in model.hinges.values():
        size = hinge.v_slice.stop - hinge.v_slice.start
        hinge.rotor_inertia = hinge.rotor_inertia + J[at : at + size]
        at += size
    return model


def test_prescribed_balls_beside_rotors_of_effects():
    """The forces that a prescribed ball needs have its rotors' in them, the model's and the effect's."""
    J = np.linspace(0.1, 1.0, 9)
    whole, state, given = heavier(J), hull().random_state(7), list(range(6, 9))
    tau, vdot = np.random.default_rng(8).uniform(-1, 1, (2, 9))
    expected, forces, condition = hybrid_dynamics(whole, state.q, state.v, tau, vdot, given)
    for model, more in ((whole, []), (hull(), [E.RotorInertia(J)])):
        scene = pc.Scene(model).add(E.TorqueSource(tau), prescribing(model, given, vdot), *more)
        found = scene.evaluate(state.q, state.v)
        agree(found.vdot, expected, ROUNDING * condition)
        agree(found.forces["prescribed"][6:], (forces - tau)[6:], ROUNDING * condition)


def test_an_implicit_step_brings_no_rotor():
    """h C + h² K stand on the diagonal of D like rotors, and are none: 𝒞 is that of ℳ + J."""
    model = ball()
    v = np.array([1.0, 0.15, -0.7])
    damped = pc.Scene(model).add(E.ImplicitDamping([5.0, 1.0, 0.1]))
    agree(damped.evaluate(model.zero_q(), v).vdot, model.forward_dynamics(model.zero_q(), v, -np.array([5.0, 1.0, 0.1]) * v))
    M, C, h = model.mass_matrix(model.zero_q()), np.diag([5.0, 1.0, 0.1]), 1e-2
    run = damped.simulate(h, model.zero_q(), v, integrator="semi-implicit-euler", step=h, **QUIET)
    bias = np.cross(v, M @ v)  # I + J of the energy, not h C
    agree(run.v[-1], v + h * np.linalg.solve(M + h * C, -C @ v - bias), 1e-12)


@pytest.mark.slow
def test_langevin_keeps_the_canonical_distribution():
    """⟨vv*⟩ = kT(ℳ + J)⁻¹ of a body on a ball, I full, J = (3, 0, .5).

    64 runs of 150 s sampled each 1.5 s, the first 15 s left out. With friction Γ = 1 on modes of (ℳ+J) up to 4 velocities forget within
    τ = 4 s, and squares within 2 s: at least 64 · 135/4 = 2160 independent squares, each of relative deviation √2: five deviations of a
    mean are 5 √(2/2160) = 0.15 of √(c_ii c_jj). Without v ×* (J v) the largest entry is off by half.
    """
    model = pc.Multibody("grain")
    inertia = np.array([[1.0, 0.2, 0.1], [0.2, 1.4, -0.3], [0.1, -0.3, 1.1]])
    model.add_body("grain", None, "ball", mass=1.0, inertia=inertia)
    J, kT = np.array([3.0, 0.0, 0.5]), 1.0
    model.hinges["grain"].rotor_inertia = J
    times, sums, count = np.arange(15.0, 150.0, 1.5), np.zeros((3, 3)), 0
    for seed in range(64):
        scene = pc.Scene(model).add(E.Langevin(temperature=kT, friction=1.0, period=0.05, seed=seed))
        v = model.equipartition(model.zero_q(), kT, rng=seed)
        run = scene.simulate(150.0, model.zero_q(), v, t_eval=times, integrator="rk4", step=0.025, dense=False, energy=False, **QUIET)
        sums += run.v.T @ run.v
        count += len(run.v)
    covariance = kT * np.linalg.inv(inertia + np.diag(J))
    size = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert (np.abs(sums / count - covariance) < 0.15 * size).all()


def test_nose_hoover_keeps_its_energy():
    """The thermostat's conserved quantity, over a run with unequal rotors: constant to the integrator's error."""
    model = ball()
    scene = pc.Scene(model).add(E.NoseHoover(1.0, 0.5))
    run = scene.simulate(5.0, model.zero_q(), [1.0, 0.15, -0.7], rtol=1e-11, atol=1e-12, **QUIET)
    assert np.ptp(run.balance) < 1e-8
    assert abs(run.v[-1] @ gyroscopic(model, run.v[-1])) < ROUNDING
