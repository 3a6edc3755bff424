"""Samples of thermostats against the exact densities: √det(ℳ + J) exp(-H/kT), and exp(-H/kT) of configurations with the Fixman potential.

Runs are independent (seeds, starts), so that means over them have known errors: a mean is within SIGMAS standard errors of the exact one,
and tests of Kolmogorov and Smirnov have a probability above LIKELY; the density that it would be without the effect is out of reach.
Seeds are fixed.
"""

import numpy as np
import pytest
from scipy.stats import kstest

import pycraft as pc
from support.mechanisms import four_atoms

E = pc.effects
SIGMAS, LIKELY = 4, 1e-3


def torsion_mean(f, fixman):
    """Of the torsion's density: √det ℳ with det ℳ = 70 - 8c - 32c² + 2c⁴, or uniform."""
    angle = np.linspace(-np.pi, np.pi, 4000, endpoint=False)
    c = np.cos(angle)
    weight = np.ones_like(angle) if fixman else np.sqrt(70 - 8 * c - 32 * c**2 + 2 * c**4)
    return (f(angle) * weight).sum() / weight.sum()


def torsions(run):
    return {"torsion": run.q[:, 7]}


def states(run):
    return {"end.q": run.q[-1], "end.v": run.v[-1]}


@pytest.mark.parametrize(
    ("thermostat", "fixman"),
    [("langevin", False), ("langevin", True), ("nose-hoover", False), ("nose-hoover", True)],
)
def test_the_torsion_of_four_atoms(thermostat, fixman):
    """√det ℳ without the Fixman potential, uniform with it: the mean of cos 2φ is -0.070 or 0, ten standard errors apart.

    Nosé-Hoover chains keep the directions of the momenta of what floats freely: there the whole is held by springs, of which the torsion's
    density knows nothing.
    """
    model, runs, T = four_atoms(), 64, 100.0
    scene = pc.Scene(model)
    if thermostat == "langevin":
        scene.add(E.Langevin(1.0, 1.0, 0.2))
    else:
        scene.add(E.NoseHoover(1.0, 0.5), E.Bushing(None, "angle", [1.0, 2, 3, 1, 1.5, 2], [0] * 6))
    if fixman:
        scene.add(E.Fixman(1.0))
    rng = np.random.default_rng(5)
    samples = {
        "q": np.array([model.random_state(rng).q for _ in range(runs)]),
        "v": np.array([model.equipartition(model.zero_q(), 1.0, rng=rng) for _ in range(runs)]),
    }
    if thermostat == "langevin":
        samples["effects.langevin.seed"] = np.arange(runs)
    options = dict(integrator="rkmk4", step=0.1, t_eval=np.arange(5.0, T, 1.0), dense=False, energy=False, progress=False)
    angle = pc.sweep(scene, samples, T, measure=torsions, **options)["torsion"]
    away = []
    for f in (np.cos, np.sin, lambda x: np.cos(2 * x), lambda x: np.sin(2 * x), lambda x: np.cos(4 * x)):
        each = f(angle).mean(axis=1)
        error = each.std(ddof=1) / np.sqrt(runs)
        assert abs(each.mean() - torsion_mean(f, fixman)) < SIGMAS * error
        away.append(abs(each.mean() - torsion_mean(f, not fixman)) / error)
    assert max(away) > 6  # and it is not the other one


def pendulum():
    return pc.mechanisms.double_pendulum()


def exact_density(model, kT, fixman=False, points=240):
    """Of (q₁, q₂) on a grid, by the dense mass matrix."""
    grid = np.linspace(-np.pi, np.pi, points, endpoint=False)
    q = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1).reshape(-1, 2)
    M = np.asarray(model.mass_matrix(q))
    model.gravity = (0, 0, -9.81)
    U = np.asarray(model.potential_energy(q))
    model.gravity = (0, 0, 0)
    weight = np.exp(-(U - U.min()) / kT) * (1 if fixman else np.sqrt(np.linalg.det(M)))
    return grid, weight.reshape(points, points) / weight.sum()


def cumulated(grid, weight):
    """The distribution of one angle from its weights at the points of a grid, as a function."""
    edges, total = np.append(grid, np.pi), np.append(0.0, np.cumsum((weight + np.roll(weight, -1)) / 2))
    return lambda x: np.interp(x, edges, total / total[-1])


def ends(scene, count, T, seed=0, **options):
    """The last states of runs with noise and starts of their own."""
    rng = np.random.default_rng(seed)
    samples = {"q": rng.uniform(-np.pi, np.pi, (count, 2)), "v": rng.normal(size=(count, 2))}
    samples |= {f"effects.{name}.seed": np.arange(count) for name, effect in scene.effects.items() if isinstance(effect, E.Langevin)}
    found = pc.sweep(scene, samples, T, measure=states, **(dict(energy=False, dense=False, t_eval=[0.0, T], progress=False) | options))
    return found["end.q"], found["end.v"]


def holds(model, q, v, kT, fixman=False):
    """Angles and velocities whitened by ℳ by Kolmogorov and Smirnov; how far cos 2q₂ is from its means with √det ℳ and without."""
    grid, weight = exact_density(model, kT, fixman)
    angle = (q + np.pi) % (2 * np.pi) - np.pi
    for i in range(2):
        assert kstest(angle[:, i], cumulated(grid, weight.sum(axis=1 - i))).pvalue > LIKELY
    n = np.einsum("bji,bj->bi", np.linalg.cholesky(np.asarray(model.mass_matrix(q))), v) / np.sqrt(kT)
    for i in range(2):
        assert kstest(n[:, i], "norm").pvalue > LIKELY
    assert abs(np.mean(n[:, 0] * n[:, 1])) < SIGMAS / np.sqrt(len(q))
    bent, error = np.cos(2 * q[:, 1]), np.cos(2 * q[:, 1]).std() / np.sqrt(len(q))
    means = [(np.cos(2 * grid) * exact_density(model, kT, which)[1].sum(axis=0)).sum() for which in (fixman, not fixman)]
    assert abs(bent.mean() - means[0]) < SIGMAS * error
    return abs(bent.mean() - means[1]) / error


@pytest.mark.parametrize(
    ("period", "friction", "integrator", "fixman"),
    [(0.2, 6.0, "rkmk4", False), pytest.param(0.2, 6.0, "rkmk4", True, marks=pytest.mark.slow), (1.0, 4.0, "dopri5", False)],
)
def test_a_pendulum_in_its_potential(period, friction, integrator, fixman):
    """With impulses so far apart, too, that no path is followed: the pendulum goes over some times between them."""
    scene, kT = pendulum().add(E.Langevin(20.0, friction, period)), 20.0
    if fixman:
        scene.add(E.Fixman(kT))
    options = {"step": 0.04} if integrator == "rkmk4" else {"rtol": 1e-5, "atol": 1e-7}
    q, v = ends(scene, 2048, 3.0 + 8 * period, integrator=integrator, **options)
    assert holds(scene.model, q, v, kT, fixman) > 3


@pytest.mark.parametrize("friction", [0.4, 40.0])
def test_an_oscillator_has_kT_in_each_part_whatever_the_period(friction):
    """m⟨v²⟩ = k⟨q²⟩ = kT where hΓ/m is 0.2 and 20: the impulses' own step has no bias. Errors by the means of parts of the run."""
    block = pc.Multibody("block on a spring")
    block.add_body("block", hinge="slider", axis=(1, 0, 0), mass=2.0)
    scene = pc.Scene(block).add(E.Spring(3.0), E.Langevin(0.7, friction, 1.0, seed=2))
    T, parts = 40000, 40
    times = np.arange(100.0, T)
    run = scene.simulate(T, [0.0], [0.0], integrator="rkmk4", step=0.1, t_eval=times, dense=False, energy=False, progress=False)
    for x in (3.0 * run.q[:, 0] ** 2, 2.0 * run.v[:, 0] ** 2):
        means = np.array([part.mean() for part in np.array_split(x, parts)])
        assert abs(means.mean() - 0.7) < SIGMAS * means.std(ddof=1) / np.sqrt(parts)
        assert means.std(ddof=1) / np.sqrt(parts) < 0.02


def test_one_nose_hoover_thermostat_is_not_enough_for_an_oscillator():
    """Its motion stays on a torus (Hoover 1985), with a hole in the plane of q and v; a chain fills it, and has normal moments."""
    block = pc.Multibody("block on a spring")
    block.add_body("block", hinge="slider", axis=(1, 0, 0), mass=1.0)
    found = {}
    for chain in (1, 3):
        scene = pc.Scene(block).add(E.Spring(1.0), E.NoseHoover(1.0, 1.0, chain=chain))
        times = np.arange(0.0, 6000.0, 0.25)
        run = scene.simulate(6000.0, [0.0], [1.0], integrator="rkmk4", step=0.05, t_eval=times, dense=False, energy=False, progress=False)
        found[chain] = run.q[:, 0], run.v[:, 0]
    least = {chain: (q**2 + v**2).min() for chain, (q, v) in found.items()}
    assert least[1] > 0.1 > 0.01 > least[3]
    for x in found[3]:
        means = np.array([[(part**2).mean(), (part**4).mean()] for part in np.array_split(x, 20)])
        assert (np.abs(means.mean(axis=0) - [1, 3]) < SIGMAS * means.std(axis=0, ddof=1) / np.sqrt(20)).all()
    assert abs((found[1][0] ** 4).mean() / (found[1][0] ** 2).mean() ** 2 - 3) > 1


def test_a_nose_hoover_chain_samples_a_pendulum():
    """Starts of their own in place of noise."""
    scene, kT = pendulum().add(E.NoseHoover(20.0, 0.3)), 20.0
    q, v = ends(scene, 1024, 10.0, seed=3, integrator="rkmk4", step=0.04)
    holds(scene.model, q, v, kT)
