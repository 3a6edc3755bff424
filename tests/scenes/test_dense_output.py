"""States between the ends of steps: orders measured, on the group, in runs and after them."""

import pickle

import numpy as np
import pytest

import pycraft as pc
from support.runs import CASES, CONTROLLED, FIXED

E = pc.effects


def errors_between(scene, integrator, counts, T=0.4, pickled=False):
    """Of q and of v between the ends of equal steps, against steps that end there; pickled: by Hermite's interpolation."""
    times = (np.arange(97) + 0.37) / 97 * T  # anywhere in steps
    found = []
    for n in counts:
        options = {"integrator": integrator, "step": T / n} | ({} if integrator in FIXED else {"rtol": 1e6, "atol": 1e6, "max_step": T / n})
        run = scene.simulate(T, energy=False, **options)
        best = scene.simulate(T, integrator="dop853", rtol=1e-13, atol=1e-14, t_eval=times, energy=False)
        at = (pickle.loads(pickle.dumps(run)) if pickled else run).at(times)
        q = max(np.abs(scene.model.difference(a, b)).max() for a, b in zip(at.q, best.q, strict=True))
        found.append((q, np.abs(at.v - best.v).max()))
    return np.array(found)


@pytest.mark.parametrize("case", ["double pendulum", "spinning"])
def test_hermites_order(case):
    """The error of dop853's steps is far below: what is left is O(h⁶) in q and O(h⁵) in v, of a step of size h."""
    found = errors_between(CASES[case](), "dop853", (4, 8, 16), pickled=True)
    orders = np.log2(found[:-1] / found[1:])
    assert abs(orders[-1, 0] - 6) < 0.5 and abs(orders[-1, 1] - 5) < 0.5, (found, orders)


@pytest.mark.parametrize("case", ["double pendulum", "spinning"])
def test_the_order_of_the_dense_output_of_dop853(case):
    """It is a polynomial of degree 7 with local errors O(h⁸), like the steps' accumulated errors."""
    found = errors_between(CASES[case](), "dop853", (8, 16, 32) if case == "double pendulum" else (2, 4, 8))
    orders = np.log2(found[:-1] / found[1:])
    assert (orders[-1] > 7).all() and found[-1].max() < 1e-9, (found, orders)


@pytest.mark.parametrize("case", ["double pendulum", "spinning"])
@pytest.mark.parametrize(
    "integrator, order",
    [("dopri5", 5), ("rk4", 4), ("rkmk4", 4), ("variational2", 2), ("variational4", 4), ("rosenbrock4", 4), ("cash-karp54", 5)],
)
def test_between_steps_errors_are_no_worse_than_at_their_ends(case, integrator, order):
    """The order of the method, also between: dopri5 by its own of order 4 (local errors h⁵)."""
    found = errors_between(CASES[case](), integrator, (16, 32, 64))
    orders = np.log2(found[:-1] / found[1:])
    assert (orders[-1] > min(order, 5) - 0.6).all(), (found, orders)


@pytest.mark.parametrize("integrator", [*CONTROLLED, *FIXED, "scipy:DOP853", "scipy:Radau"])
def test_times_asked_for_change_no_step(integrator):
    """Or, where no dense output has the method's order, steps end there; and what `at` says is what the run said."""
    scene = CASES["damped"]()
    options = {"integrator": integrator, "step": 0.01} if integrator in FIXED else {"integrator": integrator, "rtol": 1e-7}
    times = np.linspace(0.03, 0.47, 12)
    plain, asked = scene.simulate(0.5, **options), scene.simulate(0.5, t_eval=times, **options)
    assert np.array_equal(asked.t, times)
    ends_there = integrator == "bulirsch-stoer"
    assert (asked.statistics["steps"] != plain.statistics["steps"]) == ends_there
    at = (asked if ends_there else plain).at(times)
    if integrator.startswith("scipy:"):  # after the run by Hermite's
        assert np.abs(at.q - asked.q).max() < 1e-5 and np.abs(at.v - asked.v).max() < 1e-4
    else:
        assert np.abs(at.q - asked.q).max() < 1e-14 and np.abs(at.v - asked.v).max() < 1e-13
        assert np.abs(at.energy["work"] - asked.energy["work"]).max() < 1e-13
    assert np.abs(asked.q - scene.simulate(0.5, integrator="dop853", t_eval=times).q).max() < (
        0.05 if integrator == "semi-implicit-euler" else 1e-3
    )


def test_one_time_and_several():
    run = CASES["damped"]().simulate(0.5)
    one, several = run.at(0.2), run.at([0.4, 0.2, 0.0, 0.5])
    assert one.q.shape == (run.model.nq,) and several.q.shape == (4, run.model.nq)
    assert np.array_equal(one.q, several.q[1]) and np.array_equal(several.q[2], run.q[0]) and np.array_equal(several.q[3], run.q[-1])
    assert one.vdot.shape == (run.model.nv,) and one.energy["kinetic"].shape == () and one.forces["gravity"].shape == (run.model.nv,)
    assert one.frame("ball").pose.shape == (4, 4) and several.momentum["com"].shape == (4, 6)
    assert one.balance == pytest.approx(run.balance[0], rel=1e-7)


def test_prescribed_coordinates_are_where_their_motion_says_between_steps():
    arm = pc.chain(3, seed=4)
    scene = pc.Scene(arm).add(E.Gravity(), E.Prescribed("hinge1", E.Harmonic(0.4, 0.6)))
    for integrator in ("dopri5", "rkmk4"):
        run = scene.simulate(1.0, integrator=integrator, step=0.05, t_eval=np.linspace(0, 1, 33))
        assert np.abs(run.q[:, 1] - 0.4 * np.sin(2 * np.pi * 0.6 * run.t)).max() < 1e-15
        assert np.abs(run.at(0.123).q[1] - 0.4 * np.sin(2 * np.pi * 0.6 * 0.123)) < 1e-15


def test_what_is_held_is_that_of_the_interval():
    scene = pc.Scene(pc.chain(1)).add(E.Sampled(lambda t, s: [np.sign(np.sin(9 * t + 0.1))], 0.1))
    run = scene.simulate(0.6, [0.0], [0.0], integrator="dopri5")
    for t in (0.05, 0.15, 0.36, 0.55):
        assert run.at(t).states[0] == np.sign(np.sin(9 * np.floor(t / 0.1) * 0.1 + 0.1)) == pytest.approx(run.at(t).forces["sampled"][0])


def test_of_a_run_that_was_pickled():
    """By Hermite's interpolation of what it has: q and v as good as before, to its order."""
    run = CASES["damped"]().simulate(0.5, t_eval=[0.1, 0.5])
    again = pickle.loads(pickle.dumps(run))
    for name in ("t", "q", "v", "states", "vdot", "balance"):
        assert np.array_equal(getattr(run, name), getattr(again, name))
    assert all(np.array_equal(run.forces[name], again.forces[name]) for name in run.effects)
    times = np.linspace(0, 0.5, 41)
    assert np.abs(again.at(times).q - run.at(times).q).max() < 1e-6
    assert again.checkpoint() == run.checkpoint() and again.statistics == run.statistics
    with pytest.raises(pc.EvaluationError, match="this motion has no scene"):
        print(again.at(0.2).vdot)


def test_what_is_not_there():
    run = pc.mechanisms.pendulum().simulate(1.0, t_eval=[0.5, 1.0], dense=False)
    with pytest.raises(pc.EvaluationError, match="kept only the times of t_eval; simulate with dense=True"):
        run.at(0.7)
    run = pc.mechanisms.pendulum().simulate(1.0)
    for t in (-0.1, 1.2, np.nan):
        with pytest.raises(pc.EvaluationError, match=f"t = {t:g} s is outside the run, which lasts from 0 to 1 s"):
            run.at(t)


@pytest.mark.parametrize("integrator", ["rkmk4", "rosenbrock4", "dopri5"])
def test_works_between_steps_follow_their_powers(integrator):
    """Errors of works fall with the fourth power of the step at least; straight lines would leave the second."""
    scene, times = CASES["damped"](), (np.arange(41) + 0.37) / 41 * 0.4
    best = scene.simulate(0.4, integrator="dop853", rtol=1e-13, atol=1e-14, t_eval=times).energy["work"]
    found = []
    for n in (10, 20, 40):
        run = scene.simulate(
            0.4, integrator=integrator, step=0.4 / n, **({} if integrator in FIXED else {"rtol": 1e6, "atol": 1e6, "max_step": 0.4 / n})
        )
        found.append(np.abs(run.at(times).energy["work"] - best).max())
    orders = np.log2(np.array(found[:-1]) / found[1:])
    assert orders[-1] > 3.5, (found, orders)
