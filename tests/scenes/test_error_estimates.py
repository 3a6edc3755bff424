"""Error estimates that see forces of time alone, and the method of order 8 to the last digit of every precision."""

import json

import mpmath
import numpy as np
import pytest

import pycraft as pc
from support.runs import CONTROLLED

E = pc.effects
QUIET = dict(progress=False)


def slider(axis=(1, 0, 0)):
    model = pc.Multibody("cart")
    model.add_body("b", None, "slider", axis=axis, mass=1.0)
    return model


@pytest.mark.parametrize("integrator", CONTROLLED)
def test_a_force_that_is_a_function_of_time_alone(integrator):
    """x = t/w - sin(wt)/w². An estimate that is zero there takes steps of any size, and is off by the size of the motion."""
    scene, w, T = pc.Scene(slider()).add(E.TorqueSource(E.Harmonic(1.0, 3.0))), 6 * np.pi, 10.3
    rtol = 1e-8 if integrator == "rosenbrock4" else 1e-11
    run = scene.simulate(T, [0.0], [0.0], integrator=integrator, rtol=rtol, atol=1e-3 * rtol, **QUIET)
    assert run.q[-1, 0] == pytest.approx(T / w - np.sin(w * T) / w**2, abs=100 * rtol)
    if integrator != "bulirsch-stoer":  # no tolerance sees works, and its steps are longest
        assert np.ptp(run.balance) < 1e3 * rtol


@pytest.mark.parametrize("integrator", CONTROLLED)
def test_a_ball_on_a_compliant_floor(integrator):
    """Free flight before and after a contact has equal rates at both ends of a step; the ball never rises above where it was let go."""
    scene = pc.Scene(slider((0, 0, 1))).add(E.Gravity(), E.Limits(1e4, 0.0, 0.0, np.inf))
    run = scene.simulate(5.0, [1.0], [0.0], integrator=integrator, **QUIET)
    assert run.q.max() <= 1 + 1e-6 and np.ptp(run.balance) < 1e-5


def test_a_wheel_that_is_driven_by_whole_periods():
    """Of a harmonic torque: nothing is left of the rate."""
    wheel = pc.Multibody("wheel")
    wheel.add_body("w", None, "pin", axis=(0, 0, 1), mass=1.0, inertia=np.eye(3))
    scene = pc.Scene(wheel).add(E.TorqueSource(E.Harmonic(0.5, 2.0)))
    run = scene.simulate(10.0, [0.0], [0.0], integrator="dop853", rtol=1e-12, atol=1e-14, **QUIET)
    assert abs(run.v[-1, 0]) < 1e-10


def test_the_method_that_was_blind_is_refused():
    for call in (
        lambda: pc.Scene(slider()).simulate(1.0, [0.0], [0.0], integrator="fehlberg78"),
        lambda: slider().integrate_ode([0.0], [0.0], [0, 1], integrator="fehlberg78"),
    ):
        with pytest.raises(pc.EvaluationError, match="'fehlberg78' was removed: .* functions of time; take 'dop853'"):
            call()
    assert "fehlberg78" not in pc._core.integrators()


@pytest.mark.parametrize("precision, rtol", [("extended", 1e-17), ("quad", 1e-29)])
def test_order_eight_in_wide_precisions(precision, rtol, tmp_path):
    """An oscillator, x = cos t: coefficients with the digits of double alone would leave 1e-17, whatever the tolerance.

    A tolerance of ε a step, of which there are 1/h, leaves errors of some ten ε; the checkpoint has all digits.
    """
    scene = pc.Scene(slider(), precision=precision).add(E.Spring(1.0))
    run = scene.simulate(1.0, [1.0], [0.0], integrator="dop853", rtol=rtol, atol=rtol, **QUIET)
    run.checkpoint().save(tmp_path / "end.json")
    state = json.loads((tmp_path / "end.json").read_text())
    with mpmath.workdps(45):
        t = mpmath.fsum(state["state"]["t"])
        x, v = (mpmath.fsum(parts) for parts in state["state"]["x"][:2])
        assert abs(x - mpmath.cos(t)) < 30 * rtol and abs(v + mpmath.sin(t)) < 30 * rtol
    assert run.statistics["steps"] < 3 * (1 / rtol) ** (1 / 8)


def test_tighter_tolerances_cost_as_an_order_of_eight():
    """Evaluations grow as rtol^(-1/8): by 10^(1/2) for four digits, 1.8 to 6 with what is rejected and the steps at the start."""
    scene = pc.mechanisms.double_pendulum()
    counts = [
        scene.simulate(2.0, [0.4, 1.0], [0.0, 0.0], integrator="dop853", rtol=r, atol=r, energy=False, **QUIET).statistics["evaluations"]
        for r in (1e-5, 1e-9, 1e-13)
    ]
    assert 1.8 < counts[1] / counts[0] < 6 and 2.2 < counts[2] / counts[1] < 5
