"""Thermostats and the Fixman potential as effects: impulses and their heat, the extended energy, what is refused."""

import numpy as np
import pytest

import pycraft as pc
from support.differences import difference
from support.mechanisms import every_kind
from support.oracle import agree
from support.runs import SCIPY

E = pc.effects
INTEGRATORS = ["dopri5", "dop853", "rosenbrock4", "rk4", "rkmk4", "semi-implicit-euler", "variational2", *SCIPY[:1]]


def block(mass=2.0):
    model = pc.Multibody("block")
    model.add_body("block", hinge="slider", axis=(1, 0, 0), mass=mass)
    return model


def warm(**options):
    return pc.mechanisms.double_pendulum().add(E.Langevin(**(dict(temperature=1.0, friction=0.5, period=0.1, seed=3) | options)))


# Langevin --------------------------------------------------------------------------------------------------------------


def test_an_impulse_is_the_midpoint_rule():
    """Δv = (ℳ + J + ½hΓ)⁻¹ (-hΓ v + √(2kT hΓ) n) by dense matrices, rotors of effects included, n the same for the same seed."""
    model = pc.tree([-1, 0, 1, 1], ["pin", "ball", "slider", "pin"], seed=3)
    model.hinges["hinge3"].rotor_inertia = 0.7
    state = model.random_state(2)
    c, J, h, kT = np.linspace(0.5, 2, model.nv), 0.3, 0.25, 0.8
    M = model.mass_matrix(state.q) + J * np.eye(model.nv)
    for seed in (5, 6):
        jumps = []
        for temperature in (0.0, kT):
            scene = pc.Scene(model).add(E.RotorInertia(J), E.Langevin(temperature, c, h, seed=seed))
            run = scene.simulate(h / 2, state.q, state.v, rtol=1e-12, atol=1e-13)
            (k,) = np.flatnonzero(np.diff(run.t) == 0)
            assert run.t[k] == h / 2 and np.array_equal(run.q[k], run.q[k + 1])
            M = model.mass_matrix(run.q[k]) + J * np.eye(model.nv)
            jumps.append(run.v[k + 1] - run.v[k])
            if temperature == 0:
                agree(jumps[0], np.linalg.solve(M + h / 2 * np.diag(c), -h * c * run.v[k]), 1e-12)
            kinetic = 0.5 * (run.v[k + 1] @ M @ run.v[k + 1] - run.v[k] @ M @ run.v[k])
            work = run.energy["work"][:, 0]
            assert work[k] == 0 and work[k + 1] == pytest.approx(kinetic, rel=1e-12)
        n = (M + h / 2 * np.diag(c)) @ (jumps[1] - jumps[0]) / np.sqrt(2 * kT * h * c)
        if seed == 5:
            first = n
    assert np.abs(n - first).min() > 1e-3 and np.abs(n).max() < 5


def test_noise_is_normal_and_independent():
    """Of 20000 impulses on three coordinates: moments up to the fourth, correlations from one to the next and between coordinates."""
    scene = pc.Scene(pc.tree([-1, -1, -1], ["slider"] * 3, seed=1)).add(E.Langevin(1.0, 1.0, 1.0, seed=11))
    count = 20000
    times = np.arange(count + 1.0)
    v = scene.simulate(count, [0, 0, 0], [0, 0, 0], integrator="rk4", step=1.0, t_eval=times, dense=False, energy=False, progress=False).v
    m = np.diag(scene.model.mass_matrix([0, 0, 0]))
    n = ((m + 0.5) * np.diff(v, axis=0) + v[:-1]) / np.sqrt(2)
    sigma = 5 / np.sqrt(count)
    assert np.abs(n.mean(axis=0)).max() < sigma and np.abs((n**2).mean(axis=0) - 1).max() < np.sqrt(2) * sigma
    assert np.abs((n**3).mean(axis=0)).max() < np.sqrt(15) * sigma and np.abs((n**4).mean(axis=0) - 3).max() < np.sqrt(96) * sigma
    assert np.abs(n[1:].T @ n[:-1] / count).max() < sigma
    assert np.abs(n.T @ n / count - np.diag(np.diag(n.T @ n / count))).max() < sigma
    other = pc.Scene(scene.model).add(E.Langevin(1.0, 1.0, 1.0, seed=12))
    w = other.simulate(count, [0, 0, 0], [0, 0, 0], integrator="rk4", step=1.0, t_eval=times, dense=False, energy=False, progress=False).v
    m = ((m + 0.5) * np.diff(w, axis=0) + w[:-1]) / np.sqrt(2)
    assert np.abs(n.T @ m / count).max() < sigma


def test_without_noise_it_is_damping_of_order_two():
    """At whole multiples of the period; twice the period, four times the difference."""
    plain = pc.mechanisms.double_pendulum().add(E.Damping([0.5, 0.3])).simulate(2.0, [0.5, 0.2], [1, 0.5], t_eval=[2.0], rtol=1e-12)
    errors = []
    for h in (0.1, 0.05, 0.025):
        run = warm(temperature=0.0, friction=[0.5, 0.3], period=h).simulate(2.0, [0.5, 0.2], [1, 0.5], t_eval=[2.0], rtol=1e-12)
        errors.append(np.abs(np.r_[run.q[0] - plain.q[0], run.v[0] - plain.v[0]]).max())
    assert 3.6 < errors[0] / errors[1] < 4.4 and 3.8 < errors[1] / errors[2] < 4.2


def test_two_thermostats_of_one_coordinate_have_noise_of_their_own():
    """Seeds the same: the mean of n n' over 4000 impulses, 1 if they were one, and the first's noise as if it were alone."""
    model, count = block(), 4000
    options = dict(integrator="rk4", step=0.5, dense=False, energy=False, progress=False)
    two, alone = [], []
    for scene, jumps in (
        (pc.Scene(model).add(E.Langevin(1.0, 1e-9, 1.0, seed=4), E.Langevin(1.0, 1e-9, 1.0, seed=4)), two),
        (pc.Scene(model).add(E.Langevin(1.0, 1e-9, 1.0, seed=4)), alone),
    ):
        v = scene.simulate(count, [0.0], [0.0], t_eval=np.arange(count + 1.0), **options).v[:, 0]
        jumps.append(np.diff(v) * 2.0 / np.sqrt(2e-9))
    first, second = alone[0], two[0] - alone[0]
    sigma = 5 / np.sqrt(count)
    assert abs(np.mean(first * second)) < sigma and abs(np.mean(second**2) - 1) < np.sqrt(2) * sigma


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_every_integrator_has_the_same_impulses(integrator):
    """The noise is the same, and so is the path, to the integrator's error; heat is counted."""
    options = (
        dict(step=1e-4)
        if integrator == "semi-implicit-euler"
        else dict(step=2.5e-3)
        if integrator in ("rk4", "rkmk4", "variational2")
        else {}
    )
    times = np.linspace(0, 1.0, 11)
    one = warm().simulate(1.0, [0.3, 0.2], [0, 0], t_eval=times)
    other = warm().simulate(1.0, [0.3, 0.2], [0, 0], integrator=integrator, t_eval=times, **options)
    near = 2e-3 if integrator == "semi-implicit-euler" else 2e-4 if integrator == "variational2" else 1e-6
    assert np.abs(one.q - other.q).max() < near and np.abs(one.v - other.v).max() < 5 * near
    assert np.ptp(other.balance) < 20 * near
    assert np.abs(one.q[-1] - pc.mechanisms.double_pendulum().simulate(1.0, [0.3, 0.2], [0, 0]).q[-1]).max() > 0.05


def test_in_other_precisions():
    wide = pc.mechanisms.double_pendulum()
    scene = pc.Scene(wide.model, precision="quad").add(
        E.Gravity(), E.Langevin(1.0, 0.5, 0.1, seed=3), E.NoseHoover(1.0, 0.4), E.Fixman(0.5)
    )
    options = dict(integrator="dop853", t_eval=[0.35], rtol=1e-15, atol=1e-17)
    run = scene.simulate(0.35, [0.3, 0.2], [0.1, 0.2], **options)
    plain = pc.Scene(wide.model).add(*scene.effects.values()).simulate(0.35, [0.3, 0.2], [0.1, 0.2], rtol=1e-12, atol=1e-13, t_eval=[0.35])
    agree(plain.v, run.v, 1e-9)


@pytest.mark.parametrize("integrator", ["dopri5", "rkmk4", "rosenbrock4", "variational2"])
@pytest.mark.parametrize("end", [0.43, 0.45, 0.25])
def test_runs_go_on_bit_for_bit(integrator, end):
    """From between impulses, where a step ends, and from the times of some."""
    scene, options = warm().add(E.NoseHoover(1.0, 0.7)), {} if integrator in ("dopri5", "rosenbrock4") else dict(step=0.02)
    first = scene.simulate(end, [0.3, 0.2], [0, 1], integrator=integrator, **options)
    again = scene.resume(first.checkpoint(), 1.2)
    whole = scene.simulate(1.2, [0.3, 0.2], [0, 1], integrator=integrator, **options)
    for name in ("q", "v", "states"):
        assert np.array_equal(getattr(again, name)[-1], getattr(whole, name)[-1])
    assert again.energy["work"][-1] == pytest.approx(whole.energy["work"][-1], rel=1e-12)


def test_between_the_rows():
    """Dense output starts from the velocities after an impulse; tables and files have the two rows."""
    scene = warm(period=0.4)
    run = scene.simulate(1.0, [0.3, 0.2], [0, 0], integrator="rk4", step=0.05)
    times = np.linspace(0, 1, 83)
    asked = scene.simulate(1.0, [0.3, 0.2], [0, 0], integrator="rk4", step=0.05, t_eval=times)
    assert np.abs(run.at(times).v - asked.v).max() < 1e-9
    twice = np.flatnonzero(np.diff(run.t) == 0)
    assert run.t[twice].tolist() == pytest.approx([0.2, 0.6, 1.0]) and np.abs(np.diff(run.v, axis=0)[twice]).min() > 1e-4


def test_files_of_runs(tmp_path):
    run = warm().simulate(0.5, [0.3, 0.2], [0, 0])
    run.save(tmp_path / "run.nc")
    again = pc.load_run(tmp_path / "run.nc")
    assert np.array_equal(again.t, run.t) and np.array_equal(again.v, run.v)


def test_sweeps_have_noise_of_their_own():
    samples = {"effects.langevin.seed": np.arange(9)}
    found = pc.sweep(warm(), samples, 1.0, integrator="rkmk4", step=0.05, progress=False)
    assert "side by side in packs" in found.explain() and len({tuple(q) for q in found["end.q"]}) == 9
    for i in (0, 7):
        alone = warm(seed=i).simulate(1.0, integrator="rkmk4", step=0.05, t_eval=[0.0, 1.0], dense=False)
        assert np.array_equal(found["end.q"][i], alone.q[-1]) and np.array_equal(found["end.v"][i], alone.v[-1])


def test_chains_are_swept():
    """Their lengths are whole numbers, which samples have as floats."""
    scene = pc.mechanisms.double_pendulum().add(E.NoseHoover(1.0, 0.5))
    found = pc.sweep(scene, {"effects.nose_hoover.chain": [1, 2]}, 0.3, progress=False)
    for i in range(2):
        alone = pc.mechanisms.double_pendulum().add(E.NoseHoover(1.0, 0.5, chain=i + 1)).simulate(0.3)
        assert found["end.v"][i] == pytest.approx(alone.v[-1], rel=1e-9)


def test_some_hinges_and_what_is_prescribed():
    """Friction by hinge; prescribed coordinates keep their velocities, and no impulse acts on them."""
    arm = pc.chain(3)
    scene = pc.Scene(arm).add(E.Prescribed("hinge1", E.Harmonic(0.3, 1.0)), E.Langevin(1.0, {"hinge1": 2.0, "hinge2": 0.4}, 0.1))
    run = scene.simulate(1.0, [0.1, 0, 0.2], [1, 0, 0])
    (jumps,) = np.nonzero(np.diff(run.t) == 0)
    assert len(jumps) == 10
    change = run.v[jumps + 1] - run.v[jumps]
    assert not change[:, 1].any() and np.abs(change[:, [0, 2]]).min() > 0
    for k, dv in zip(jumps, change, strict=True):
        M = arm.mass_matrix(run.q[k])
        impulse = M[np.ix_([0, 2], [0, 2])] @ dv[[0, 2]]
        assert abs(impulse[0]) < 1e-12 * np.abs(impulse).max()  # nothing acts at hinge0
    assert np.ptp(run.balance) < 1e-7


def test_nothing_to_warm():
    for model in (pc.Multibody("nothing"), pc.chain(2)):
        scene = pc.Scene(model).add(E.Langevin(1.0, 0.0, 0.1), E.Fixman(1.0))
        run = scene.simulate(0.5)
        assert np.abs(run.v).max(initial=0.0) < 1e-12
    assert pc.Scene(pc.Multibody("nothing")).add(E.Langevin(1.0, 1.0, 0.1)).simulate(0.3).t[-1] == 0.3


# Nosé-Hoover -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("chain", [1, 2, 3, 5])
def test_the_extended_energy_is_kept(chain):
    """With what it is written out; and it does something."""
    model = every_kind(rotor_inertia=True)
    state = model.random_state(3)
    scene = pc.Scene(model).add(E.Gravity(), E.RotorInertia(0.2), E.NoseHoover(0.7, 0.3, chain=chain))
    run = scene.simulate(1.0, state.q, state.v, rtol=1e-11, atol=1e-13)
    total = run.energy["kinetic"] + run.energy["potential"]
    assert np.ptp(total) < 1e-8 * np.ptp(run.energy["kinetic"]) and run.workers == []
    xi, eta, n = run.states[:, :chain], run.states[:, chain:], model.nv
    own = 0.7 * (n * (0.09 * xi[:, 0] ** 2 / 2 + eta[:, 0]) + (0.09 * xi[:, 1:] ** 2 / 2 + eta[:, 1:]).sum(axis=1))
    agree(run._along["potential"][:, list(run.effects).index("nose_hoover")], own, 1e-12)


def flow(scene, state, own):
    """(v̇, rates of the effects' own states)."""
    rate = scene.linearize(state.q, state.v, states=own).rate
    return rate[scene.model.nv : 2 * scene.model.nv], rate[2 * scene.model.nv :]


@pytest.mark.parametrize("hinges", [None, ["hinge1", "hinge2"]])
def test_it_keeps_the_density(hinges):
    """Liouville: ∇·ẋ + ẋ·∇ln ρ = 0 in (q, p, ξ) with ρ = exp(-(H + ½ΣQξ²)/kT), by differences; some coordinates, rotors of effects."""
    arm, kT, tau, J = pc.chain(3), 0.8, 0.6, np.array([0.2, 0.0, 0.1])
    scene = pc.Scene(arm).add(E.Spring(2.0), E.RotorInertia(J), E.NoseHoover(kT, tau, chain=3, hinges=hinges))
    chosen = [0, 1, 2] if hinges is None else [1, 2]
    Q = kT * tau**2 * np.array([len(chosen), 1, 1])
    mass = lambda q: arm.mass_matrix(q) + np.diag(J)

    def rates(x):
        q, p, xi = np.split(x, 3)
        v = np.linalg.solve(mass(q), p)
        vdot, own = flow(scene, pc.State(q, v), [*xi, 0, 0, 0])
        turning = difference(lambda h: mass(q + h * v) @ v)
        return np.concatenate([v, mass(q) @ vdot + turning, own[:3]])

    def energy(x):
        q, p, xi = np.split(x, 3)
        return p @ np.linalg.solve(mass(q), p) / 2 + 2.0 * (q @ q) / 2 + Q @ xi**2 / 2

    x = np.random.default_rng(4).uniform(-1, 1, 9)
    divergence = sum(difference(lambda h, e=e: rates(x + h * e)[np.argmax(e)]) for e in np.eye(9))
    slope = np.array([difference(lambda h, e=e: energy(x + h * e)) for e in np.eye(9)])
    assert divergence == pytest.approx(-len(chosen) * x[6] - x[7] - x[8], rel=1e-6)
    assert divergence == pytest.approx(rates(x) @ slope / kT, rel=1e-6)


def test_prescribed_coordinates_are_not_among_them():
    scene = pc.Scene(pc.chain(3)).add(E.Prescribed("hinge0", 0.3), E.NoseHoover(1.0, 0.5))
    run = scene.simulate(1.0, [0.3, 0.1, 0.2], [0, 1, 2])
    xi, v, q = run.states[0, 0], run.v[0], run.q[0]
    twice = v @ pc.chain(3).mass_matrix(q) @ v
    later = run.at(1e-5).states[0]
    assert (later - xi) / 1e-5 == pytest.approx((twice / 2 - 1) / 0.25, rel=1e-3)
    with pytest.raises(pc.ModelError, match="nose_hoover: there is no coordinate of 'chain of 1 rods' for it that moves freely"):
        pc.Scene(pc.chain(1)).add(E.Prescribed("hinge0", 0.3), E.NoseHoover(1.0, 0.5)).evaluate([0.1], [0.0])


# Fixman ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["chain", "tree", "free", "every kind"])
def test_the_fixman_force_is_that_of_the_direct_call(name):
    """And its potential, rotors of effects as the model's own."""
    model = {
        "chain": lambda: pc.chain(4),
        "tree": lambda: pc.tree([-1, 0, 1, 1], ["pin", "ball", "slider", "pin"], seed=3),
        "free": lambda: pc.tree([-1, 0, 0], ["free", "pin", "universal"], seed=2),
        "every kind": every_kind,
    }[name]()
    state, kT = model.random_state(1), 1.7
    agree(pc.Scene(model).add(E.Fixman(kT)).evaluate(state.q, state.v).forces["fixman"], model.fixman_torque(state.q, kT), 1e-12)
    rotors = pc.Scene(model).add(E.RotorInertia(0.4), E.Fixman(kT / 2, boltzmann=2.0))
    forces = rotors.evaluate(state.q, state.v).forces["fixman"]
    potential = rotors.simulate(1e-3, state.q, state.v)._along["potential"][0, 1]
    for hinge in model.hinges.values():
        hinge.rotor_inertia = np.asarray(hinge.rotor_inertia) + 0.4
    agree(forces, model.fixman_torque(state.q, kT), 1e-12)
    assert potential == pytest.approx(model.fixman_potential(state.q, kT), rel=1e-12)


@pytest.mark.parametrize("integrator", ["dop853", "rosenbrock4", "variational4"])
def test_the_fixman_potential_balances_its_force(integrator):
    model = every_kind(rotor_inertia=True)
    state = model.random_state(3)
    options = dict(step=2e-3) if integrator == "variational4" else dict(rtol=1e-11, atol=1e-13)
    run = pc.Scene(model).add(E.Fixman(3.0)).simulate(0.3, state.q, state.v, integrator=integrator, **options)
    assert np.ptp(run.balance) < 1e-7 * np.ptp(run.energy["kinetic"]) and np.ptp(run.energy["potential"]) > 1e-2


# What is refused -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        (E.Langevin(-1.0, 1.0, 0.1), "langevin: temperature=-1: it is a finite number, not negative"),
        (E.Langevin(1.0, 1.0, 0.1, boltzmann=np.inf), "langevin: boltzmann=inf"),
        (E.Langevin(1.0, -1.0, 0.1), "langevin: friction"),
        (E.Langevin(1.0, [1.0, 2.0, 3.0], 0.1), "langevin: friction"),
        (E.Langevin(1.0, 1.0, 0.0), "langevin: period is 0; it is a positive number of seconds"),
        (E.Langevin(1.0, 1.0, 0.1, seed=-1), "langevin: seed is -1; it must be a whole number from 0 to"),
        (E.Langevin(1.0, 1.0, 0.1, seed=2.5), "langevin: seed must be a whole number, not 2.5"),
        (E.Langevin(1.0, 1.0, 0.1, hinges="hinge"), "langevin: no hinge or coordinate"),
        (E.Langevin(1e200, 1.0, 0.1, boltzmann=1e200), "langevin: temperature=1e[+]200 by boltzmann=1e[+]200 is inf J: take other units"),
        (E.NoseHoover(1e-200, 1.0, boltzmann=1e-200), "nose_hoover: temperature=1e-200 by boltzmann=1e-200 is 0 J"),
        (E.NoseHoover(1.0, 1e160), "nose_hoover: kT τ² of 1 J and a time_constant of 1e[+]160 s exceeds the range"),
        (E.NoseHoover(1.0, 1e-160), "nose_hoover: kT τ² of 1 J and a time_constant of 1e-160 s exceeds the range"),
        (E.NoseHoover(0.0, 1.0), "nose_hoover: temperature=0: it is a finite number, positive"),
        (E.NoseHoover(1.0, -1.0), "nose_hoover: time_constant is -1; it is a positive number of seconds"),
        (E.NoseHoover(1.0, 1.0, chain=0), "nose_hoover: chain is 0; it must be a whole number from 1 to 100"),
        (E.NoseHoover(1.0, 1.0, chain=1.5), "nose_hoover: chain must be a whole number, not 1.5"),
        (E.Fixman(np.nan), "fixman: temperature=nan"),
    ],
    ids=lambda one: one if isinstance(one, str) else None,
)
def test_numbers_that_make_no_sense(effect, message):
    scene = pc.Scene(pc.chain(2))
    with pytest.raises(pc.ModelError, match=message):
        scene.add(effect)
    assert not scene.effects


def test_what_does_not_fit():
    scene = pc.Scene(pc.chain(2)).add(E.Fixman(1.0), E.Prescribed("hinge0", 0.2))
    with pytest.raises(
        pc.ModelError, match="fixman: its determinant is of coordinates that all move freely, and another effect prescribes"
    ):
        scene.simulate(1.0)
    with pytest.raises(pc.EvaluationError, match="effect 'langevin' acts by impulses between steps, which no linear model has: disable it"):
        warm().linearize([0.1, 0.2])
    assert warm().disable("langevin").linearize([0.1, 0.2]).A.shape == (4, 4)


def test_files_of_scenes():
    scene = pc.Scene(pc.chain(2)).add(
        E.Langevin(1.0, [0.1, 0.2], 0.05, seed=7), E.NoseHoover(2.0, 0.3, chain=2), E.Fixman(0.5, boltzmann=2.0)
    )
    again = pc.Scene.from_dict(scene.to_dict())
    assert [repr(effect) for effect in again.effects.values()] == [repr(effect) for effect in scene.effects.values()]
    one, other = (each.simulate(0.3, [0.1, 0.2], [0, 1]) for each in (scene, again))
    assert np.array_equal(one.v, other.v)
    assert "nose_hoover" in scene.explain() and "fixman" in scene.explain()
