"""Steps end at the knots of functions of time: against closed forms, and solutions of one equation of motion from knot to knot."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import PPoly

import pycraft as pc
from support.sliders import slider

E, P = pc.effects, dict(progress=False)
PULSE = E.Table([4.99, 5.0, 5.01], [0, 100.0, 0])  # 1 N s
FIXED = {"rk4", "rkmk4", "semi-implicit-euler", "variational2", "variational4"}
FOREIGN = ["scipy:RK45", "scipy:DOP853", "scipy:Radau", "scipy:BDF", "scipy:LSODA"]
ALL = [*pc._core.integrators(), *FOREIGN]


def options(integrator, step=0.05):
    return dict(integrator=integrator, **P) | (dict(step=step) if integrator in FIXED else {})


@pytest.mark.parametrize("integrator", ALL)
def test_a_pulse_is_not_stepped_over(integrator):
    """The impulse of a triangle, which any method of order 2 integrates exactly from knot to knot; Euler's errors on both sides cancel."""
    run = pc.Scene(slider()).add(E.TorqueSource(PULSE)).simulate(10.0, [0.0], [0.0], **options(integrator))
    tolerance = 1e-5 if integrator in FOREIGN else 1e-9
    assert abs(run.v[-1, 0] - 1) < tolerance
    if integrator != "semi-implicit-euler":
        assert abs(run.q[-1, 0] - 5) < 10 * tolerance
    if integrator != "semi-implicit-euler":  # works choose no step
        assert np.ptp(run.balance) < (1e-2 if integrator in {*FIXED, *FOREIGN} else 1e-6)
    for knot in PULSE.times:
        assert (run.t == knot).any()


def pieces(rates, x, times):
    """x at the last of the times, the equation solved anew between neighbours, by right sides that know the piece."""
    for i, (a, b) in enumerate(zip(times, times[1:], strict=False)):
        x = solve_ivp(lambda t, y, i=i: rates(i, t, y), (a, b), x, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    return x


def test_a_pendulum_under_a_pulse():
    b = pc.Multibody("b")
    b.add_body("b", axis=(0, 1, 0), mass=1.0, com=(0, 0, -1.0), inertia=0.2 * np.eye(3))
    scene = pc.Scene(b).add(E.Gravity(), E.TorqueSource(PULSE))
    run = scene.simulate(10.0, [0.0], [0.0], **P)
    ends, force = [0, 4.99, 5.0, 5.01, 10.0], [lambda t: 0, lambda t: 1e4 * (t - 4.99), lambda t: 1e4 * (5.01 - t), lambda t: 0]
    exact = pieces(lambda i, t, y: [y[1], (force[i](t) - 9.81 * np.sin(y[0])) / 1.2], [0.0, 0.0], ends)
    assert abs(exact[0]) > 0.01 and np.abs([run.q[-1, 0] - exact[0], run.v[-1, 0] - exact[1]]).max() < 1e-7


@pytest.mark.parametrize("integrator", ["dopri5", "rosenbrock4", "cash-karp54", "scipy:DOP853"])
def test_a_servo_whose_target_goes_out_and_back(integrator):
    """Its rate jumps at the knots, and its torque with it; both sides of a step see their own: no step is refused for that."""
    times, target = [0.0, 5.0, 5.3, 5.7, 9.0], [0.0, 0.0, 1.0, 0.0, 0.0]
    scene = pc.Scene(slider()).add(E.Servo(40.0, 3.0, target=E.Table(times, target)))
    tight = dict(rtol=1e-10, atol=1e-13)
    run = scene.simulate(6.0, [0.0], [0.0], **options(integrator), **tight)
    slope = np.diff(target) / np.diff(times)

    def at(i, t):
        return target[i] + slope[i] * (t - times[i])

    exact = pieces(lambda i, t, y: [y[1], 40 * (at(i, t) - y[0]) + 3 * (slope[i] - y[1])], [0.0, 0.0], [0, 5, 5.3, 5.7, 6])
    assert abs(exact[0]) > 1e-2 and np.abs([run.q[-1, 0] - exact[0], run.v[-1, 0] - exact[1]]).max() < 1e-8
    if integrator == "dopri5":
        assert run.statistics["rejected"] <= 20  # more where the end of a step sees what follows


@pytest.mark.parametrize(("integrator", "order"), [("rk4", 4), ("rkmk4", 4), ("variational2", 2), ("variational4", 4)])
def test_orders_at_kinks(integrator, order):
    """Kinks off the grid of steps: errors fall by their order when steps are halved, as without them."""
    times, force = np.array([0.0, 0.317, 0.71, 1.01]), np.array([0.0, 3.0, -2.0, 1.0])
    model = slider()
    scene = pc.Scene(model).add(E.TorqueSource(E.Table(times, force)), E.Spring(9.0))
    slope = np.diff(force) / np.diff(times)
    end = [*times[:3], 1.0]
    exact = pieces(lambda i, t, y: [y[1], force[i] + slope[i] * (t - times[i]) - 9 * y[0]], [0.3, 0.0], end)
    errors = [abs(scene.simulate(1.0, [0.3], [0.0], **options(integrator, step)).q[-1, 0] - exact[0]) for step in (0.1, 0.05, 0.025)]
    for larger, smaller in zip(errors, errors[1:], strict=False):
        assert abs(np.log2(larger / smaller) - order) < 0.5


def test_between_the_ends_of_steps():
    """Dense output on both sides of a kink, and the states at knots themselves."""
    times, force = [0.0, 0.4, 0.5, 2.0], [0.0, 0.0, 8.0, 0.0]
    scene = pc.Scene(slider()).add(E.TorqueSource(E.Table(times, force)))
    asked = np.unique(np.r_[np.linspace(0, 1, 41), 0.4, 0.5, 0.4 - 1e-7, 0.5 + 1e-7])
    u = np.clip(asked - 0.4, 0, 0.1)
    after = np.clip(asked - 0.5, 0, None)
    v = 40 * u**2 + 8 * after - 8 / 3 * after**2
    for integrator in ("dopri5", "rk4", "cash-karp54", "rosenbrock4", "scipy:RK45"):
        run = scene.simulate(1.0, [0.0], [0.0], **options(integrator))
        assert np.abs(run.at(asked).v[:, 0] - v).max() < (1e-5 if integrator in FOREIGN else 1e-8)
        sampled = scene.simulate(1.0, [0.0], [0.0], t_eval=asked, **options(integrator))
        assert np.abs(sampled.v[:, 0] - v).max() < (1e-5 if integrator in FOREIGN else 1e-8)


@pytest.mark.parametrize("integrator", ["dopri5", "rk4", "cash-karp54", "rosenbrock4", "rkmk4", "variational2"])
@pytest.mark.parametrize("until", [0.0653, 0.4, 0.45, 0.5, 0.73, 0.7777])
def test_runs_that_go_on(integrator, until):
    """From knots and from between them, on the grid of steps of one size and off it: bit for bit."""
    scene = pc.Scene(slider()).add(E.TorqueSource(E.Table([0.0, 0.4, 0.5, 2.0], [0.0, 0.0, 8.0, 0.0])), E.Spring(30.0), E.Damping(0.2))
    if integrator == "variational2":
        scene.remove("damping")
    how = options(integrator, 0.01)
    first = scene.simulate(until, [0.1], [0.0], **how)
    again, whole = scene.resume(first.checkpoint(), 1.0, progress=False), scene.simulate(1.0, [0.1], [0.0], **how)
    assert np.array_equal(again.q[-1], whole.q[-1]) and np.array_equal(again.v[-1], whole.v[-1])


@pytest.mark.parametrize("integrator", ["rk4", "rkmk4", "semi-implicit-euler", "variational2", "variational4"])
@pytest.mark.parametrize("period", [None, 0.017])
def test_going_on_off_the_grid(integrator, period):
    """A first run of 0.065 s in steps of 0.01 s, alone and between impulses: 2e-7 to 1e-2 off in equal parts of 0.065 s."""
    scene = pc.Scene(slider()).add(E.Spring(30.0))
    if period:
        scene.add(E.Langevin(0.1, 0.3, period))
    how = options(integrator, 0.01)
    first = scene.simulate(0.065, [0.1], [0.0], **how)
    again, whole = scene.resume(first.checkpoint(), 0.215, progress=False), scene.simulate(0.215, [0.1], [0.0], **how)
    assert first.t[-1] == 0.065 and np.array_equal(again.q[-1], whole.q[-1]) and np.array_equal(again.v[-1], whole.v[-1])
    third = scene.resume(scene.resume(first.checkpoint(), 0.1234, progress=False).checkpoint(), 0.215, progress=False)
    assert np.array_equal(third.q[-1], whole.q[-1]) and np.array_equal(third.v[-1], whole.v[-1])
    if not period:
        assert np.allclose(np.diff(first.t), [0.01] * 6 + [0.005])


def test_ticks_of_controllers_that_fall_on_knots():
    """Both happen, each once: 0.3 and 3 · 0.1 are neighbours, 0.2 is one and the same."""
    calls = []
    control = E.Sampled(lambda t, state: calls.append(t) or [0.0], 0.1)
    table = E.Table([0.0, 0.2, 0.3, 0.30000000000000004, 0.5], [0.0, 1.0, -1.0, 2.0, 0.0])
    run = pc.Scene(slider()).add(control, E.TorqueSource(table)).simulate(0.65, [0.0], [0.0], **P)
    assert np.allclose(calls, np.arange(7) / 10, atol=1e-12)
    area = 0.2 * 1 / 2 + 0 + 0.2 * 2 / 2
    assert abs(run.v[-1, 0] - area) < 1e-9


def test_forces_that_jump():
    """A piecewise constant torque of SciPy's: exact, without steps that creep up to where it jumps."""
    torque = PPoly(np.array([[2.0, -5.0, 1.0]]), [0.0, 0.3, 0.4, 1.0])
    run = pc.Scene(slider()).add(E.TorqueSource(torque)).simulate(2.0, [0.0], [0.0], **P)
    assert abs(run.v[-1, 0] - (0.6 - 0.5 + 0.6 + 1.0)) < 1e-14 * 10
    assert run.statistics["rejected"] == 0


@pytest.mark.parametrize("precision", ["extended", "quad"])
def test_wider_precisions(precision):
    scene = pc.Scene(slider(), precision=precision).add(E.TorqueSource(PULSE), E.Wrench("b", E.Table([1.0, 2.0], np.zeros((2, 6)))))
    run = scene.simulate(10.0, [0.0], [0.0], rtol=1e-16, atol=1e-18, **P)
    assert abs(run.v[-1, 0] - 1) < 64 * np.finfo(float).eps  # the table is of doubles: its times are rounded, and 100 N are 1e4 N/s


def test_a_run_that_starts_within_and_at_the_last_knot():
    """The value of a table there is used from then on: nothing continues to move."""
    b = slider()
    held = pc.Scene(b).add(E.Prescribed("b", E.Table([-1.0, 0.0], [0.0, 2.0])))
    run = held.simulate(1.0, [0.0], [0.0], **P)
    assert run.v[0, 0] == 0.0 and np.all(run.q == 2.0)
    assert "prescribed" not in run.events or len(run.events["prescribed"]) == 0
    assert np.ptp(run.balance) == 0.0


def test_a_motor_and_a_wrench():
    """Knots of every effect that a function of time drives."""
    model = slider()
    command = E.Table([4.99, 5.0, 5.01], [0, 1.0, 0])
    motor = pc.Scene(model).add(E.Motor(command, 100.0, 1e12)).simulate(10.0, [0.0], [0.0], **P)
    push = E.Table([4.99, 5.0, 5.01], np.outer([0, 100.0, 0], np.eye(6)[3]))
    wrench = pc.Scene(model).add(E.Wrench("b", push)).simulate(10.0, [0.0], [0.0], **P)
    target = E.Spline([0.0, 4.9, 4.95, 5.0, 5.05, 10.0], [0.0, 0, 1.0, 1.0, 0.0, 0.0], ends="clamped")
    servo = pc.Scene(model).add(E.Servo(10.0, 0.0, target=target))
    assert abs(motor.v[-1, 0] - 1) < 1e-9 and abs(wrench.v[-1, 0] - 1) < 1e-9
    coarse, fine = servo.simulate(10.0, [0.0], [0.0], **P), servo.simulate(10.0, [0.0], [0.0], max_step=1e-3, **P)
    assert abs(coarse.q[-1, 0] - fine.q[-1, 0]) < 1e-7
