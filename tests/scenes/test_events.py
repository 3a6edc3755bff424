"""Events: zeros found to rounding, with direction, terminal or not, in every integrator; and what is no event."""

import numpy as np
import pytest

import pycraft as pc
from support.runs import CONTROLLED, FIXED, SCIPY

E = pc.effects
PERIOD = 2.367841947576
EVERY = [*CONTROLLED, *FIXED, *SCIPY]


def fall(height=2.0):
    """A body that falls: meets the ground after √(2 h/g)."""
    model = pc.Multibody("stone")
    model.add_body("stone", hinge="slider", axis=(0, 0, 1), mass=1.0)
    model.q = [height]
    return pc.Scene(model).add(E.Gravity())


def options_of(integrator):
    return {"integrator": integrator, "step": 0.01} if integrator in FIXED else {"integrator": integrator, "rtol": 1e-10, "atol": 1e-12}


@pytest.mark.parametrize("integrator", EVERY)
def test_the_state_at_an_event_is_as_good_as_a_step(integrator):
    """Of a fall, which all but the first-order method integrate exactly: time and speed to rounding, the height zero."""
    run = fall().simulate(1.0, events={"ground": lambda t, s: s.q[0]}, **options_of(integrator))
    met, T = run.events["ground"], np.sqrt(2 * 2.0 / 9.81)
    tolerance = 0.02 if integrator == "semi-implicit-euler" else 1e-9
    assert met.t == pytest.approx([T], abs=tolerance) and met.v[:, 0] == pytest.approx([-9.81 * T], abs=10 * tolerance)
    assert abs(met.q[0, 0]) < 1e-14 and run.t[-1] == 1.0 and run.ended_by is None


@pytest.mark.parametrize("integrator", [name for name in EVERY if name != "semi-implicit-euler"])
def test_directions(integrator):
    """A pendulum turns back after half a period, is back after a whole one: v falls and rises through zero."""
    scene = pc.mechanisms.pendulum()

    def speed(t, state):
        return state.v[0]

    events = [pc.Event(speed, name="both"), pc.Event(speed, "rising", name="rises"), pc.Event(speed, -1, name="falls")]
    run = scene.simulate(2.5, events=events, **options_of(integrator))
    tolerance = 3e-4 if integrator == "variational2" else 1e-5
    for name, times in {"both": [PERIOD / 2, PERIOD], "rises": [PERIOD], "falls": [PERIOD / 2]}.items():
        assert run.events[name].t == pytest.approx(times, abs=tolerance)
    assert run.events["both"].q.shape == (2, 1) and len(run.events["both"]) == 2


@pytest.mark.parametrize("integrator", EVERY)
def test_terminal_events_end_the_run(integrator):
    def ground(t, state):
        return state.q[0]

    ground.terminal, ground.direction = True, -1  # as SciPy has it
    run = fall().simulate(5.0, events=[ground], t_eval=[0.1, 0.2, 3.0], **options_of(integrator))
    assert run.ended_by == "ground" and run.t.tolist() == [0.1, 0.2]
    every = fall().simulate(5.0, events=[ground], **options_of(integrator))
    assert every.t[-1] == every.events["ground"].t[0] and abs(every.q[-1, 0]) < 1e-14 and "ended by 'ground'" in repr(every)


@pytest.mark.parametrize("integrator", ["rk4", "dopri5"])
def test_times_after_a_terminal_event_in_its_step_are_not_reached(integrator):
    ground = pc.Event(lambda t, s: s.q[0], terminal=True, name="ground")
    T = np.sqrt(2 * 2.0 / 9.81)
    run = fall().simulate(5.0, events=ground, integrator=integrator, step=2.5, t_eval=[T - 0.1, T - 0.01, T + 0.01, T + 0.1])
    assert run.t.tolist() == [T - 0.1, T - 0.01] and run.q[:, 0] == pytest.approx(2.0 - 9.81 / 2 * run.t**2, abs=1e-9)


def test_an_event_changes_no_step():
    scene = pc.mechanisms.double_pendulum()
    plain, looked = scene.simulate(2.0), scene.simulate(2.0, events=lambda t, s: s.q[0] - 1.0)
    assert np.array_equal(plain.t, looked.t) and np.array_equal(plain.q, looked.q) and np.array_equal(plain.v, looked.v)
    assert list(looked.events) == ["lambda"] and len(looked.events["lambda"]) > 0


def test_several_in_one_step_come_in_order():
    """A long step of a fall: three heights, the last terminal; what is below is not reached."""
    events = [pc.Event(lambda t, s, h=h: s.q[0] - h, terminal=h == 1.0, name=f"at {h}") for h in (0.5, 1.5, 1.0)]
    run = fall().simulate(1.0, events=events, integrator="rk4", step=1.0)
    assert [len(run.events[f"at {h}"]) for h in (1.5, 1.0, 0.5)] == [1, 1, 0] and run.ended_by == "at 1.0"
    assert run.t[-1] == pytest.approx(np.sqrt(2 * 1.0 / 9.81), abs=1e-14)


def test_a_zero_at_the_start_is_no_event():
    """The pendulum starts at rest: v = 0."""
    run = pc.mechanisms.pendulum().simulate(1.0, events=lambda t, s: s.v[0])
    assert len(run.events["lambda"]) == 0


def test_events_see_what_effects_see():
    """Poses of nodes, the effects' own states, the time."""
    scene = pc.mechanisms.double_pendulum()
    seen = scene.simulate(1.0, events={"height": lambda t, s: s.pose("lower")[2, 3] + 0.8, "time": lambda t, s: t - 0.25})
    assert seen.events["time"].t == pytest.approx([0.25], abs=1e-15)
    at = seen.events["height"]
    assert len(at) > 0 and all(abs(scene.model.pose("lower", q)[2, 3] + 0.8) < 1e-14 for q in at.q)


def test_a_bouncing_ball():
    """A terminal event, the velocity turned round, and on: heights fall by e² each time."""
    scene, q, v, t, e = fall(1.0), [1.0], [0.0], 0.0, 0.8
    ground = pc.Event(lambda t, s: s.q[0], "falling", terminal=True, name="ground")
    for bounce in range(4):
        run = scene.simulate(3.0, q, v, events=ground)
        t += run.t[-1]
        assert run.v[-1, 0] == pytest.approx(-(e**bounce) * np.sqrt(2 * 9.81), rel=1e-9)
        q, v = [1e-15], -e * run.v[-1]
    assert t == pytest.approx(np.sqrt(2 / 9.81) * (1 + 2 * (e + e**2 + e**3)), rel=1e-8)


def test_controllers_and_events():
    """Between samples, beside them, and one at a sample itself."""
    model = pc.chain(1)
    scene = pc.Scene(model).add(E.Sampled(lambda t, s: [0.3 if t < 0.15 else -0.3], 0.1))
    run = scene.simulate(0.6, [0.0], [0.0], events={"turn": lambda t, s: s.v[0], "sample": lambda t, s: t - 0.2}, rtol=1e-11)
    assert run.events["turn"].t == pytest.approx([0.4], abs=1e-9) and run.events["sample"].t == pytest.approx([0.2], abs=1e-12)


@pytest.mark.parametrize(
    "given, text",
    [
        (lambda t, s: s.q, r"event 'lambda' gives an array of shape \(2,\) at t = 0 s; it is one number, whose zeros are looked for"),
        (lambda t, s: s.q[:1], r"event 'lambda' gives an array of shape \(1,\) at t = 0 s"),
        (lambda t, s: None, "event 'lambda' gives NoneType at t = 0 s; it is one number"),
        (lambda t, s: "high", "event 'lambda' gives str at t = 0 s; it is one number"),
        (lambda t, s: np.nan if t > 0.05 else 1.0, r"event 'lambda' is nan at t = 0\.\d+ s"),
        (3.0, "events: an event must be a function .*, not 3.0"),
        ([3.0], "events: an event must be a function"),
        ([pc.Event(lambda t, s: 1.0, direction=[1])], r"events: direction=\[1\]; there are 0, 1, -1, 'both', 'rising' and 'falling'"),
        ([pc.Event(lambda t, s: 1.0, direction=None)], "events: direction=None; there are 0, 1, -1, 'both', 'rising' and 'falling'"),
        ([pc.Event(lambda t, s: 1.0, direction=2)], "events: direction=2; there are 0, 1, -1, 'both', 'rising' and 'falling'"),
        ([pc.Event(lambda t, s: 1.0, name="a"), pc.Event(lambda t, s: 1.0, name="a")], "events: two events are called 'a'"),
    ],
)
def test_what_is_no_event(given, text):
    with pytest.raises(pc.EvaluationError, match=text):
        pc.mechanisms.double_pendulum().simulate(0.2, events=given)


def test_errors_in_an_event_come_through():
    def wrong(t, state):
        raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine"):
        pc.mechanisms.pendulum().simulate(0.2, events=wrong)


# Where effects change their law ---------------------------------------------------------------------------------------


def stopped(stiffness=1e4, end=0.5):
    """A block of 1 kg that flies at 1 m/s against a stop at `end`, and back after half a period of its spring."""
    model = pc.Multibody("block")
    model.add_body("block", hinge="slider", axis=(1, 0, 0), mass=1.0, limits=(-end, end))
    return pc.Scene(model).add(E.Limits(stiffness)), end, end + np.pi / np.sqrt(stiffness)


@pytest.mark.parametrize("integrator", [name for name in EVERY if FIXED.get(name, 4) == 4])
def test_a_step_ends_where_a_stop_is_met_and_left(integrator):
    scene, met, left = stopped()
    run = scene.simulate(1.2, [0.0], [1.0], **options_of(integrator) | ({"step": 1e-3} if integrator in FIXED else {}))
    assert run.events["limits"].t == pytest.approx([met, left], abs=1e-5) and run.ended_by is None
    assert run.events["limits"].q == pytest.approx(np.array([[0.5], [0.5]]), abs=1e-12)
    assert all(np.abs(run.t - t).min() == 0 for t in run.events["limits"].t)
    assert run.q[-1, 0] == pytest.approx(0.5 - (1.2 - left), abs=1e-5) and np.ptp(run.balance) < 1e-5


def test_a_users_event_beside_them_keeps_its_place():
    """The stop ends the step; what a user looks for in the same step is found as well, in order."""
    scene, *_ = stopped()
    seen = scene.simulate(0.6, [0.03], [1.0], integrator="rk4", step=0.1, events={"before": lambda t, s: s.q[0] - 0.45})
    assert seen.events["before"].t[0] == pytest.approx(0.42, abs=1e-12) and seen.events["limits"].t[0] == pytest.approx(0.47, abs=1e-12)
    assert list(seen.events) == ["limits", "before"]
