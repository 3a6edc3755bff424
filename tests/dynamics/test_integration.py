"""Rates of configurations and trajectories: against differences on the group, closed forms, published values and conserved quantities."""

import signal
import threading

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.descriptions import KINDS, coordinate_rates
from support.mechanisms import SEQUENCES, every_kind, uniform_batch, with_hinges
from support.oracle import DIFFERENCE, agree

CONTROLLED = ["dopri5", "cash-karp54", "dop853", "bulirsch-stoer"]
FIXED = ["rk4", "rkmk4"]
SCIPY = ["scipy:RK45", "scipy:DOP853", "scipy:Radau", "scipy:BDF", "scipy:LSODA"]
GRAVITY = (0, 0, -9.81)
UNIT_LENGTH = 5 * np.finfo(float).eps  # scaling once, and measuring


# Rates ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES])
def test_rates_of_every_hinge(kind):
    model = with_hinges(kind, "forest", seed=3)
    q, v = np.array(model.q), np.array(model.v)
    h = 1e-3
    along = [model.integrate(q, x * h * v) for x in (-2, -1, 1, 2)]
    rate = model.configuration_rate(q, v)
    agree(rate, (along[0] - 8 * along[1] + 8 * along[2] - along[3]) / (12 * h), DIFFERENCE)
    stretched = q * np.random.default_rng(1).uniform(0.5, 2)  # quaternions of any length
    agree(model.configuration_rate(stretched, v), coordinate_rates(model.description(), stretched, v), 20 * np.finfo(float).eps)
    agree(model.configuration_rate(q, v, precision="quad"), rate, 20 * np.finfo(float).eps)


def test_rates_of_batches():
    model = every_kind()
    Q, V = uniform_batch(model, 4)
    whole = model.configuration_rate(Q, V)
    assert whole.shape == Q.shape
    assert all(np.array_equal(whole[i], model.configuration_rate(Q[i], V[i])) for i in range(4))
    assert model.configuration_rate(Q[:0], V[:0]).shape == (0, model.nq)
    out = np.empty_like(Q)
    assert model.configuration_rate(Q, V[0], out=out) is out
    assert model.configuration_rate(model.random_state(1), V[0]).shape == (model.nq,)
    with pytest.raises(pc.ModelError, match="v of .* takes"):
        model.configuration_rate(Q, V[:, :-1])


# Mechanisms -----------------------------------------------------------------------------------------------------------


def pendulum():
    """A point mass of 1 kg, 1 m from a pin along y."""
    model = pc.Multibody("pendulum")
    model.add_body("bob", axis=(0, 1, 0), mass=1.0, com=(1, 0, 0))
    model.gravity = GRAVITY
    return model


def double_pendulum():
    model = pc.Multibody("double pendulum")
    rod = dict(axis=(0, 1, 0), mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0, 1 / 12, 1 / 12]))
    model.add_body("upper", **rod)
    model.add_body("lower", "upper", position=(1, 0, 0), **rod)
    model.gravity = GRAVITY
    return model


def free_body():
    model = pc.Multibody("free body")
    model.add_body("b", hinge="free", mass=2.0, com=(0.1, -0.2, 0.3), inertia=np.diag([1.0, 2.0, 2.5]))
    return model


def heavy_top():
    model = pc.Multibody("heavy top")
    model.add_body("top", hinge="ball", mass=15.0, com=(0, 1, 0), inertia=np.diag([0.234375, 0.46875, 0.234375]))
    model.gravity = GRAVITY
    return model


TUMBLING = np.array([0.3, 2.0, 0.1, 0.5, -0.2, 0.4])
UNIT = np.array([1.0, 0, 0, 0, 0, 0, 0])


def energy(model, motion):
    return model.kinetic_energy(motion.q, motion.v) + model.potential_energy(motion.q)


def final_error(motion, reference):
    return max(np.abs(motion.q[-1] - reference.q[-1]).max(), np.abs(motion.v[-1] - reference.v[-1]).max())


# Published and exact values -------------------------------------------------------------------------------------------


def test_period_of_the_pendulum():
    """Released horizontally it is back, at rest, after 2.367841947576 s (IFToMM benchmark library, simple pendulum).

    At rest it falls with 9.81 rad/s², so an error of the period shows as a velocity 9.81 times that; half a unit of its last digit.
    """
    model = pendulum()
    motion = model.integrate_ode([0], [0], [0, 2.367841947576], integrator="dop853", rtol=1e-16, atol=1e-16, precision="extended")
    assert abs(motion.v[-1, 0]) / 9.81 <= 5e-13 + 1e-14
    for integrator in CONTROLLED:
        motion = model.integrate_ode([0], [0], [0, 2.367841947576], integrator=integrator, rtol=1e-12, atol=1e-12)
        assert abs(motion.v[-1, 0]) <= 1e-9, integrator


def test_heavy_top():
    """Energy and the place of the centre of mass after 1 s as published for the benchmark, ten digits."""
    model = heavy_top()
    q, v = [1, 0, 0, 0], [0, 150, -4.61538]
    motion = model.integrate_ode(q, v, [0, 1], integrator="dop853", rtol=1e-12, atol=1e-12)
    total = energy(model, motion)
    assert 0 <= total[0] - 5435.69679086 < 1e-8  # the published digits are cut, not rounded
    assert abs(total[1] / total[0] - 1) < 1e-10
    at = model.pose("top", motion.q[1])[:3, :3] @ [0, 1, 0]
    assert np.abs(at - [0.1733439641, 0.6400885921, -0.7484907911]).max() < 1e-9
    on_group = model.integrate_ode(q, v, [0, 1], integrator="rkmk4", step=5e-5)
    assert np.abs(model.pose("top", on_group.q[1])[:3, :3] @ [0, 1, 0] - at).max() < 1e-6


@pytest.mark.parametrize("integrator", [*CONTROLLED, *FIXED])
def test_torque_free_symmetric_top(integrator):
    """Exact: ω turns about the axis of symmetry with (C - A)/A ω₃; the centre of mass moves straight."""
    model = pc.Multibody("top")
    model.add_body("b", hinge="free", mass=2.0, inertia=np.diag([1.0, 1.0, 1.6]))
    v = np.array([0.4, 0, 2.0, 0.3, -0.1, 0.2])
    times = np.array([0, 0.7, 1.9])
    motion = model.integrate_ode(UNIT, v, times, integrator=integrator, rtol=1e-12, atol=1e-13, step=1e-3)
    angle = 0.6 * 2.0 * times
    # A ω̇₁ = (A - C) ω₂ω₃, A ω̇₂ = (C - A) ω₃ω₁
    expected = np.stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), np.full(3, 2.0)], axis=1)
    assert np.abs(motion.v[:, :3] - expected).max() < 1e-10
    assert np.abs(motion.q[:, 4:] - np.outer(times, v[3:])).max() < 1e-10


def test_damping_is_a_torque():
    model = pc.Multibody("wheel")
    model.add_body("w", mass=1.0, inertia=np.diag([1.0, 1, 0.5]))
    times = np.array([0, 0.1, 1.0])
    for integrator, damping in (("dopri5", 3.0), ("scipy:Radau", 5e5), ("scipy:BDF", 5e5)):
        motion = model.integrate_ode([0], [2], times, tau=[0.25], damping=[damping], integrator=integrator, rtol=1e-10, atol=1e-12)
        limit, rate = 0.25 / damping, damping / 0.5
        expected = limit + (2 - limit) * np.exp(-rate * times)
        assert np.abs(motion.v[:, 0] - expected).max() < 1e-7
        angle = limit * times + (2 - limit) * (1 - np.exp(-rate * times)) / rate
        assert np.abs(motion.q[:, 0] - angle).max() < 1e-7


# Accuracy and order ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", [*CONTROLLED, *SCIPY])
def test_tolerances_are_followed(integrator):
    model = double_pendulum()
    start = dict(q=[0.3, 0.5], v=[0.0, 0.1], times=[0, 0.4, 1.5])
    best = model.integrate_ode(**start, integrator="dop853", rtol=1e-20, atol=1e-20, precision="quad")
    errors, counts = [], []
    for rtol in (1e-5, 1e-8, 1e-11):
        motion = model.integrate_ode(**start, integrator=integrator, rtol=rtol, atol=rtol)
        errors.append(final_error(motion, best))
        counts.append(motion.evaluations)
        # errors of steps, added up over some hundred steps and carried on by the motion
        assert errors[-1] <= 1000 * rtol
        assert motion.evaluations >= motion.steps >= 2 and motion.seconds > 0
    assert counts == sorted(counts) and errors[2] < 1e-3 * errors[0]


@pytest.mark.parametrize("integrator", FIXED)
@pytest.mark.parametrize("case", ["double pendulum", "free body", "every kind"])
def test_fixed_steps_have_order_four(integrator, case):
    if case == "every kind":
        model = every_kind(rotor_inertia=True)
        q, v, end = np.array(model.q), 0.3 * np.array(model.v), 0.2
    else:
        pendulum = case == "double pendulum"
        model, q, v, end = (double_pendulum(), [0.3, 0.5], [0, 0.1], 1.0) if pendulum else (free_body(), UNIT, TUMBLING, 1.0)
    best = model.integrate_ode(q, v, [0, end], integrator="dop853", rtol=1e-15, atol=1e-15, precision="extended")
    errors = [final_error(model.integrate_ode(q, v, [0, end], integrator=integrator, step=end / n), best) for n in (40, 80, 160)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (np.abs(orders - 4) < 0.4).all(), (errors, orders)


def test_energy_and_momentum():
    model = double_pendulum()
    motion = model.integrate_ode([0.3, 0.5], [0, 0.1], np.linspace(0, 5, 11), integrator="dopri5", rtol=1e-11, atol=1e-12)
    total = energy(model, motion)
    assert np.abs(total - total[0]).max() < 1e-7
    body = free_body()
    motion = body.integrate_ode(UNIT, TUMBLING, np.linspace(0, 5, 11), integrator="bulirsch-stoer", rtol=1e-11, atol=1e-12)
    assert np.abs(energy(body, motion) / energy(body, motion)[0] - 1).max() < 1e-9
    momenta = np.array([body.momentum(q, v).value for q, v in zip(motion.q, motion.v, strict=True)])
    assert np.abs(momenta - momenta[0]).max() < 1e-9


def test_there_and_back():
    model = double_pendulum()
    ways = dict(integrator="dopri5", rtol=1e-12), dict(integrator="rkmk4", step=1e-3), dict(integrator="scipy:DOP853", rtol=1e-11)
    for options in ways:
        there = model.integrate_ode([0.3, 0.5], [0, 0.1], [0, 0.5, 1], **options)
        back = model.integrate_ode(there.q[-1], there.v[-1], [1, 0.5, 0], **options)
        assert np.abs(back.q[::-1] - there.q).max() < 1e-8


def test_precisions_reach_further():
    """The same motion at tolerances that double cannot hold: extended and quad agree to what is asked of extended."""
    model = free_body()
    wide = [
        model.integrate_ode(UNIT, TUMBLING, [0, 1], integrator="dop853", rtol=r, atol=r, precision=p)
        for r, p in ((1e-17, "extended"), (1e-24, "quad"))
    ]
    assert final_error(*wide) <= 2e-16 * 4


# Quaternions ----------------------------------------------------------------------------------------------------------


def test_lengths_of_quaternions():
    """Left alone they drift by the integrator's error; on the group, and where asked, they do not."""
    model = free_body()
    run = dict(q=UNIT, v=3 * TUMBLING, times=[0, 5])

    def drift(motion):
        return abs(np.linalg.norm(motion.q[-1, :4]) - 1)

    assert drift(model.integrate_ode(**run, integrator="rk4", step=0.01)) > 1e-9
    assert drift(model.integrate_ode(**run, integrator="rkmk4", step=0.01)) < UNIT_LENGTH
    for integrator in CONTROLLED:
        plain = model.integrate_ode(**run, integrator=integrator, rtol=1e-6)
        unit = model.integrate_ode(**run, integrator=integrator, rtol=1e-6, normalise="each step")
        assert 1e-10 < drift(plain) < 1e-2 and drift(unit) < UNIT_LENGTH
        best = model.integrate_ode(**run, integrator="dop853", rtol=1e-13)
        assert final_error(unit, best) < 1e-2
    # a length that is not one is kept as it is
    long = model.integrate_ode(2 * UNIT, TUMBLING, [0, 1], integrator="rkmk4", step=0.01)
    assert abs(np.linalg.norm(long.q[-1, :4]) - 2) < 2 * UNIT_LENGTH


def test_a_long_run_on_the_group():
    """10⁵ steps of a tumbling body about its middle axis; the everyday share of a million."""
    model = pc.Multibody("Dzhanibekov")
    model.add_body("b", hinge="free", mass=1.0, inertia=np.diag([1.0, 2.0, 3.0]))
    motion = model.integrate_ode(UNIT, [1e-3, 5, 1e-3, 0.1, 0, 0], [0, 50, 100], integrator="rkmk4", step=1e-3)
    assert motion.steps == 100_000 and motion.evaluations == 400_000
    total = energy(model, motion)
    assert np.abs(total / total[0] - 1).max() < 1e-11
    assert np.abs(np.linalg.norm(motion.q[:, :4], axis=1) - 1).max() < UNIT_LENGTH


# Arguments and errors -------------------------------------------------------------------------------------------------


def test_output():
    model = double_pendulum()
    state = model.random_state(2)
    times = [0.25, 0.5, 1]
    motion = model.integrate_ode(state, state, times)
    assert np.array_equal(motion.t, times) and motion.q.shape == motion.v.shape == (3, 2)
    assert np.array_equal(motion.q[0], state.q) and np.array_equal(motion.v[0], state.v)
    alone = model.integrate_ode(state.q, state.v, 0.25)
    assert alone.q.shape == (1, 2) and alone.steps == 0
    # a step that does not divide the interval is shortened
    fixed = model.integrate_ode(state.q, state.v, [0, 1], integrator="rk4", step=0.3)
    assert fixed.steps == 4 and fixed.evaluations == 16
    first = model.integrate_ode(state.q, state.v, [0, 1], step=1e-9)
    assert first.steps > model.integrate_ode(state.q, state.v, [0, 1]).steps
    welded = pc.Multibody("welded", welds="keep")
    welded.add_body("a", hinge="weld", mass=1.0)
    for integrator in (*CONTROLLED, "rk4"):
        assert welded.integrate_ode([], [], [0, 1], integrator=integrator, step=0.1).q.shape == (2, 0)


def test_gravity_and_forces_are_felt():
    model = pc.Multibody("lift")
    model.add_body("l", hinge="slider", mass=2.0)
    model.gravity = GRAVITY
    for integrator in (*CONTROLLED, *SCIPY):
        motion = model.integrate_ode([1], [2], [0, 1], tau=[4], integrator=integrator)
        assert motion.q[-1, 0] == pytest.approx(1 + 2 - (9.81 - 2) / 2, abs=1e-8)


@pytest.mark.parametrize(
    "options, text",
    [
        (dict(integrator="euler"), "no integrator is called 'euler'; there are 'dopri5', .*'variational4', 'scipy:RK45'.*'sundials:BDF'"),
        (dict(integrator="rk4"), r"integrator 'rk4' takes steps of one size: give step= in seconds"),
        (dict(step=-1.0), "step=-1.0: a step is a positive number of seconds"),
        (dict(times=[0, 1, 1]), "times: entry 2 is 1 s after 1 s; times are strictly increasing, or strictly decreasing"),
        (dict(times=[0, 1, 0.5]), "strictly increasing, or strictly decreasing"),
        (dict(times=[0, 1, 0.5], integrator="scipy:RK45"), "strictly increasing, or strictly decreasing"),
        (dict(times=[]), "times must be a list of times"),
        (dict(times=[0, np.inf]), "times: entry 1 is inf"),
        (dict(times=[0, np.inf], integrator="scipy:RK45"), "times: entry 1 is inf"),
        (dict(rtol=np.nan, integrator="scipy:RK45"), "rtol=nan: a tolerance is a positive number"),
        (dict(tau=[1.0, np.nan], integrator="scipy:RK45"), "tau of hinge 'lower': entry 0 is nan"),
        (dict(rtol=1e-20, atol=1e-20), "rtol=1e-20 and atol=1e-20 are below what the precision holds"),
        (dict(atol=0.0), "atol is positive"),
        (dict(normalise="always"), "normalise='always': there are 'never' and 'each step'"),
        (dict(normalise="each step", integrator="scipy:RK45"), "has no normalise"),
        (dict(tau=[1.0, 2, 3]), "tau of 'double pendulum' takes 2 numbers"),
        (dict(damping=[1.0], integrator="scipy:BDF"), "damping of 'double pendulum' takes 2 numbers"),
        (dict(q=[0, np.nan]), "q of hinge 'lower': entry 0 is nan"),
        (dict(precision="half"), "no precision is called 'half'"),
        (dict(form="slow"), "slow"),
        (dict(refine=10**12), "refine=1000000000000: a number of corrections"),
    ],
)
def test_arguments_that_make_no_sense(options, text):
    with pytest.raises(ValueError, match=text):
        double_pendulum().integrate_ode(**{"q": [0, 0], "v": [0, 0], "times": [0, 1], **options})


@pytest.mark.parametrize("integrator", [*CONTROLLED, *FIXED])
def test_motion_that_leaves_all_bounds(integrator):
    """Negative damping: the velocity grows tenfold every 2.3 ms. Its square is no number after 0.355 s, itself after 0.71 s; of one pin
    no square is needed."""
    model = pendulum()
    with pytest.raises(pc.EvaluationError, match=rf"integrator '{integrator}': .* t = 0\.(35|70)\d* s"):
        model.integrate_ode([0], [1], [0, 2], damping=[-1000], integrator=integrator, step=1e-4, rtol=1e-6)


def test_singular_hinges_are_named_with_the_time():
    model = pc.Multibody("tip")
    model.add_body("a", mass=1.0, com=(1, 0, 0))
    model.add_body("b", "a", mass=0.0, position=(1, 0, 0))
    model.take_warnings()
    for integrator in ("dopri5", "rk4", "scipy:RK45"):
        with pytest.raises(pc.SingularHingeError, match="hinge 'b' of body 'b' feels no inertia.*integrating, at t = 2.5 s"):
            model.integrate_ode([0, 0], [0, 0], [2.5, 3], integrator=integrator, step=0.1)


@pytest.mark.skipif(not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread(), reason="needs a timer")
def test_long_runs_can_be_interrupted():
    def stop(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, stop)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(KeyboardInterrupt):
            double_pendulum().integrate_ode([0, 0], [0, 0], [0, 1e6], integrator="rk4", step=1e-3)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_every_integrator_of_scenes_is_one_of_trajectories():
    """Also by its short name; on a pendulum, to a tolerance that all reach."""
    best = pendulum().integrate_ode([0.3], [0.0], [0, 0.3], integrator="dop853")
    for name in (*_core.integrators(), "DOP853", "radau"):
        motion = pendulum().integrate_ode([0.3], [0.0], [0, 0.3], integrator=name, rtol=1e-7, step=1e-4)
        assert abs(motion.q[-1, 0] - best.q[-1, 0]) < (1e-3 if name == "semi-implicit-euler" else 1e-6), name
