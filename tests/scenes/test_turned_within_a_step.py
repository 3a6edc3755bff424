"""Stops and events that are met and left within one step: on parabolas, which one step of any length follows exactly."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import pycraft as pc
from support.sliders import slider

E, P = pc.effects, dict(progress=False)
CONTROLLED = ["dopri5", "cash-karp54", "bulirsch-stoer", "rosenbrock4", "scipy:RK45", "scipy:DOP853", "scipy:Radau", "scipy:LSODA"]
FIXED = ["rk4", "rkmk4", "variational2", "variational4"]


def options(integrator):
    return dict(integrator=integrator, **P) | (dict(step=1.0) if integrator in FIXED else {})


def bounced(stiffness, dissipation, at, T):
    """q and v of v(0) = 1 under an acceleration of -2 and the law of stops, from one change of it to the next."""

    def law(t, y):
        return [y[1], -2 - (stiffness * (y[0] - at) * max(0, 1 + dissipation * y[1]) if y[0] > at else 0)]

    first = (1 - np.sqrt(1 - 4 * at)) / 2  # of q = t - t²

    def leaves(t, y):
        return y[0] - at if t > first + 1e-9 else 1.0

    leaves.terminal, leaves.direction = True, -1
    inside = solve_ivp(law, (first, T), [at, 1 - 2 * first], events=leaves, method="DOP853", rtol=1e-12, atol=1e-14, max_step=1e-3)
    t, (q, v) = inside.t[-1], inside.y[:, -1]
    return q + v * (T - t) - (T - t) ** 2, v - 2 * (T - t)


@pytest.mark.parametrize("integrator", CONTROLLED)
@pytest.mark.parametrize("overlap", [1e-2, 1e-4, 1e-6])
def test_a_stop(integrator, overlap):
    """q = t - t² turns at ¼: the stop is `overlap` before that."""
    tolerance = 1e-4 if integrator.startswith("scipy") else 1e-6
    at, tight = 0.25 - overlap, dict(rtol=1e-10, atol=1e-12)
    scene = pc.Scene(slider()).add(E.Gravity((-2.0, 0, 0)), E.Limits(1e4, 5.0, -10.0, at))
    run = scene.simulate(2.0, [0.0], [1.0], **options(integrator), **tight)
    assert len(run.events["limits"]) == 2
    exact = bounced(1e4, 5.0, at, 2.0)
    assert np.abs([run.q[-1, 0] - exact[0], run.v[-1, 0] - exact[1]]).max() < tolerance


def test_the_example():
    """Numbers of steps of 1e-4 s."""
    scene = pc.Scene(slider()).add(E.Gravity((-2.0, 0, 0)), E.Limits(1e6, 5.0, -10.0, 0.24))
    run = scene.simulate(2.0, [0.0], [1.0], **P)
    assert abs(run.q[-1, 0] + 2.5018) < 5e-5 and abs(run.v[-1, 0] + 3.3139) < 5e-5 and len(run.events["limits"]) == 2
    fine = scene.simulate(2.0, [0.0], [1.0], max_step=1e-4, **P)
    assert np.abs([run.q[-1, 0] - fine.q[-1, 0], run.v[-1, 0] - fine.v[-1, 0]]).max() < 1e-7


@pytest.mark.parametrize("integrator", [*CONTROLLED, *FIXED])
@pytest.mark.parametrize("depth", [0.01, 1e-5])
def test_events(integrator, depth):
    """Both zeros, each to rounding of the parabola's slope there, and of each direction one."""
    level = 0.25 - depth
    ball = pc.Scene(slider()).add(E.Gravity((-2.0, 0, 0)))

    def g(t, state):
        return state.q[0] - level

    events = [pc.Event(g, 0, name="both"), pc.Event(g, 1, name="rising"), pc.Event(g, -1, name="falling")]
    run = ball.simulate(2.0, [0.0], [1.0], events=events, **options(integrator))
    exact = 0.5 + np.array([-1, 1]) * np.sqrt(depth)
    tolerance = (1e-5 if integrator.startswith("scipy") else 1e-12) / np.sqrt(depth)
    assert len(run.events["both"]) == 2 and np.abs(run.events["both"].t - exact).max() < tolerance
    assert len(run.events["rising"]) == len(run.events["falling"]) == 1
    assert abs(run.events["rising"].t[0] - exact[0]) < tolerance and abs(run.events["falling"].t[0] - exact[1]) < tolerance
    last = ball.simulate(2.0, [0.0], [1.0], events=pc.Event(g, terminal=True, name="there"), **options(integrator))
    assert last.ended_by == "there" and abs(last.t[-1] - exact[0]) < tolerance
    falling = ball.simulate(2.0, [0.0], [1.0], events=pc.Event(g, -1, terminal=True, name="there"), **options(integrator))
    assert abs(falling.t[-1] - exact[1]) < tolerance


@pytest.mark.parametrize("sign", [1, -1])
def test_what_comes_near_and_no_further(sign):
    """Nothing happens; nor where a function is constant, or is of which side one is."""
    ball = pc.Scene(slider()).add(E.Gravity((-2.0 * sign, 0, 0)))
    near = {
        "near": lambda t, state: sign * state.q[0] - 0.25 - 1e-9,
        "constant": lambda t, state: 1e-3,
        "side": lambda t, state: 1.0 if state.q[0] * sign > -10 else -1.0,
    }
    run = ball.simulate(2.0, [0.0], [1.0 * sign], events=near, **P)
    assert all(len(run.events[name]) == 0 for name in near)


def test_many_turns():
    """Of random double pendulums between stops, and a function of their motion: as many as where steps are short."""
    rng = np.random.default_rng(0)
    for _ in range(12):
        arm = pc.chain(2)
        arm.gravity = (0, -9.81, 0)
        q, v = rng.normal(size=2), rng.normal(size=2)
        scene = pc.Scene(arm).add(E.Gravity())
        free = scene.simulate(1.5, q, v, **P)
        level = free.q[:, 0].max() - rng.uniform(1e-6, 1e-3)
        count = [
            len(scene.simulate(1.5, q, v, events={"g": lambda t, s, level=level: s.q[0] - level}, **how, **P).events["g"])
            for how in ({}, {"max_step": 1e-3})
        ]
        assert count[0] == count[1] >= 1


def test_a_first_zero_that_ends_a_run_hides_the_second():
    ball = pc.Scene(slider()).add(E.Gravity((-2.0, 0, 0)))
    first = pc.Event(lambda t, s: s.q[0] - 0.24, terminal=True, name="first")
    later = pc.Event(lambda t, s: s.t - 0.45, name="later")
    run = ball.simulate(2.0, [0.0], [1.0], events=[first, later], **P)
    assert run.ended_by == "first" and len(run.events["later"]) == 0
    again = ball.resume(run.checkpoint(), 2.0, events=[first, later], progress=False)
    assert again.ended_by == "first" and abs(again.t[-1] - 0.6) < 1e-9 and len(again.events["later"]) == 1
