"""Effects written in Python: what they are given and may give, states of their own, and what is said of what they get wrong."""

import threading

import numpy as np
import pytest

import pycraft as pc

E = pc.effects


@pytest.fixture
def arm():
    made = pc.chain(3, seed=3)
    made.add_node("tip", "body2", position=(1, 0, 0))
    return made


class Brake:
    def __call__(self, t, state):
        return -0.3 * state.v


def drag(t, state):
    return -0.3 * state.v


class NonLinearThing(Brake):
    pass


def test_functions_and_objects(arm):
    """Named after what they are, and worth the effect that they imitate."""
    state = arm.random_state(1)
    expected = pc.Scene(arm).add(E.Damping(0.3)).evaluate(state.q, state.v)
    scene = pc.Scene(arm)
    for effect, name in ((Brake(), "brake"), (drag, "drag"), (NonLinearThing(), "non_linear_thing"), (lambda t, s: -0.3 * s.v, "lambda")):
        scene.add(effect)
        assert name in scene.effects
        found = pc.Scene(arm).add(effect).evaluate(state.q, state.v)
        assert np.array_equal(found.vdot, expected.vdot) and np.array_equal(found.forces[name], expected.forces["damping"])
    assert repr(scene.remove(drag)) == "<scene of 'chain of 3': brake, non_linear_thing, lambda>"
    assert repr(pc.Scene(arm).add(drag).effects["drag"]) == "UserEffect(function=drag)"


def test_what_it_is_given(arm):
    """Time, q, v, and poses, twists and Jacobians of nodes at the state."""
    seen, state = [], arm.random_state(2)

    def look(t, s):
        seen.append((t, s.t, s.q.copy(), s.v.copy(), s.pose("tip"), s.twist("tip"), s.jacobian("tip", axes="world")))
        s.q[:] = 9.0  # a copy
        return np.zeros(3)

    before = state.q.copy()
    pc.Scene(arm).add(look).evaluate(state.q, state.v, 0.7)
    assert len(seen) == 1 and np.array_equal(state.q, before)
    t, again, q, v, X, V, J = seen[0]
    assert t == again == 0.7 and np.array_equal(q, state.q) and np.array_equal(v, state.v)
    assert np.array_equal(X, arm.pose("tip", state.q)) and np.array_equal(V, arm.jacobian("tip", state.q) @ state.v)
    assert np.array_equal(J, arm.jacobian("tip", state.q, axes="world"))


def test_a_dictionary_by_hinge(arm):
    found = pc.Scene(arm).add(lambda t, s: {"hinge1": 2.0, "hinge2": [3.0]}).evaluate(arm.zero_q(), np.zeros(3))
    assert found.forces["lambda"].tolist() == [0.0, 2.0, 3.0]
    with pytest.raises(pc.ModelError, match="lambda: no hinge or coordinate .* 'hinge9'; did you mean 'hinge"):
        pc.Scene(arm).add(lambda t, s: {"hinge9": 2.0}).evaluate(arm.zero_q())


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ([0.0, 0.0], "effect 'bad': its forces function gives 2 numbers where 3 are expected"),
        (1.0, "effect 'bad': its forces function gives one number where 3 are expected"),
        (np.zeros((3, 1)), r"gives an array \(3, 1\) where 3"),
        ("no", "effect 'bad': its forces function is not an array of numbers"),
        (None, "effect 'bad': its forces function is not an array of numbers"),
        ([0, 1j, 0], "is complex"),
        ({"hinge0": None}, "effect 'bad': its force on 'hinge0' is not an array of numbers"),
        ({"hinge0": [1.0, 2.0]}, r"effect 'bad': its force on 'hinge0' takes 1 number, not 2"),
    ],
)
def test_what_is_no_forces(arm, given, text):
    def bad(t, state):
        return given

    with pytest.raises(pc.ModelError, match=text):
        pc.Scene(arm).add(bad).evaluate(arm.zero_q())


@pytest.mark.parametrize("integrator", [dict(), dict(integrator="rkmk4", step=0.01), dict(integrator="bulirsch-stoer")])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_name_effect_and_time(arm, bad, integrator):
    def late(t, state):
        return [0.0, bad if t > 0.25 else 0.0, 0.0]

    scene = pc.Scene(arm).add(E.Gravity(), E.Damping(0.1)).add(late, name="thruster")
    for energy in (True, False):
        with pytest.raises(
            pc.EvaluationError, match=rf"effect 'thruster': its force on coordinate 'hinge1' is {bad} at t = 0\.2\d* s|at t = 0\.[3-9]"
        ):
            scene.simulate(1.0, energy=energy, **integrator)
    with pytest.raises(pc.EvaluationError, match=rf"effect 'thruster': its force on coordinate 'hinge1' is {bad} at t = 3 s"):
        scene.evaluate(arm.zero_q(), np.zeros(3), 3.0)


def test_functions_of_time_that_are_not_finite_name_the_effect(arm):
    late = lambda t: np.nan if t > 0.25 else 1.0
    for effect, text in (
        (E.TorqueSource(late), "effect 'torque_source': its force on coordinate 'hinge0' is nan at t = 0"),
        (E.Wrench("tip", lambda t: np.full(6, late(t))), "effect 'wrench': its moment on body 'body2' is nan at t = 0"),
        (E.Prescribed("hinge1", late, step=1e-9), "effect 'prescribed': its motion is not finite .* at t = 0"),
        (E.Sampled(lambda t, s: np.full(3, late(t)), 0.1), "effect 'sampled': number 0 of its sample is nan at t = 0.3 s"),
        (E.Motor(late, 1.0, 1.0), "effect 'motor': its force on coordinate 'hinge0' is nan at t = 0"),
        (E.Servo(1.0, target=late), "effect 'servo': its force on coordinate 'hinge0' is nan at t = 0"),
    ):
        with pytest.raises(pc.EvaluationError, match=text):
            pc.Scene(arm).add(effect).simulate(1.0, arm.zero_q(), np.zeros(3), integrator="rk4", step=0.01)


def test_errors_of_a_users_own_come_through(arm):
    class Trouble(Exception):
        pass

    def raises(t, state):
        if t > 0.1:
            raise Trouble("fuel is out")
        return np.zeros(3)

    scene = pc.Scene(arm).add(raises)
    with pytest.raises(Trouble, match="fuel is out"):
        scene.simulate(1.0)
    assert scene.simulate(0.05).t[-1] == 0.05  # the scene is as good as before


def test_states_of_its_own(arm):
    class Integral:
        """Of the first angle: a controller's third part."""

        states = [0.5]

        def __call__(self, t, state):
            return [-2.0 * state.states[0], 0.0, 0.0]

        def rates(self, t, state):
            return [state.q[0]]

    scene = pc.Scene(arm).add(E.Gravity(), Integral())
    assert scene.evaluate(arm.zero_q()).forces["integral"].tolist() == [-1.0, 0.0, 0.0]
    assert scene.evaluate(arm.zero_q(), states=[3.0]).forces["integral"][0] == -6.0
    run = scene.simulate(0.5, [0.1, 0.2, 0.3], [0, 0, 0], rtol=1e-11, atol=1e-13, t_eval=np.linspace(0, 0.5, 201))
    area = 0.5 + np.concatenate([[0], np.cumsum((run.q[1:, 0] + run.q[:-1, 0]) / 2 * np.diff(run.t))])
    assert run.states.shape == (201, 1) and np.abs(run.states[:, 0] - area).max() < 1e-5
    two = pc.Scene(arm).add(Integral(), E.UserEffect(drag, states=[1.0, 2.0], rates=lambda t, s: -s.states))
    run = two.simulate(1.0, rtol=1e-11, atol=1e-13)
    assert run.states[0].tolist() == [0.5, 1.0, 2.0] and run.states[-1, 1:] == pytest.approx(np.exp(-1) * np.array([1, 2]))


def test_states_that_make_no_sense(arm):
    class NoRates(Brake):
        states = [0.0]

    with pytest.raises(pc.ModelError, match=r"effect 'no_rates' has 1 states of its own but no rates\(t, state\)"):
        pc.Scene(arm).add(NoRates())
    with pytest.raises(pc.ModelError, match="effect 'brake': its rates function gives 2 numbers where 1 is expected"):
        pc.Scene(arm).add(E.UserEffect(Brake(), states=[0.0], rates=lambda t, s: [0.0, 0.0])).simulate(0.1)
    with pytest.raises(pc.EvaluationError, match="effect 'brake': the rate of state 0 is nan at t = 0 s"):
        pc.Scene(arm).add(E.UserEffect(Brake(), states=[0.0], rates=lambda t, s: [np.nan])).simulate(0.1)


def test_no_python_without_a_python_effect(arm):
    """Another thread of Python's runs while a scene without Python effects is simulated; with one they take turns."""
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1

    thread = threading.Thread(target=count)
    scene = pc.Scene(pc.robots.g1()).add(E.Gravity(), E.Damping(0.5), E.TorqueSource(E.Harmonic(1.0, 1.0)))
    thread.start()
    try:
        before = counted[0]
        seconds = scene.simulate(0.05, integrator="rk4", step=1e-5).statistics["seconds"]
        assert counted[0] - before > 100 and seconds > 0.01
    finally:
        stop.set()
        thread.join()


def test_a_user_effect_in_wider_precision(arm):
    state = arm.random_state(3)
    a, b = (pc.Scene(arm, precision=p).add(E.Gravity(), drag).evaluate(state.q, state.v).vdot for p in ("double", "quad"))
    assert np.abs(a - b).max() < 1e-12 * np.abs(a).max()


def test_a_run_in_threads_with_python_effects(arm):
    scene = pc.Scene(arm).add(E.Gravity(), drag)
    states = [arm.random_state(i) for i in range(6)]
    alone, found = [scene.simulate(0.1, s.q, s.v).q[-1] for s in states], [None] * 6

    def work(i):
        found[i] = scene.simulate(0.1, states[i].q, states[i].v).q[-1]

    threads = [threading.Thread(target=work, args=(i,)) for i in range(6)]
    [t.start() for t in threads], [t.join() for t in threads]
    assert all(np.array_equal(a, b) for a, b in zip(alone, found, strict=True))


def test_a_prescribed_quaternion_without_a_direction_names_the_effect():
    top = pc.mechanisms.heavy_top().model
    for motion, time in ((np.zeros(4), "0"), (lambda t: np.array([1.0, 0, 0, 0]) * (t < 0.05), "0")):
        scene = pc.Scene(top).add(E.Prescribed("top", motion))
        with pytest.raises(
            pc.EvaluationError, match=f"effect 'prescribed': its motion is not finite .*quaternion of length 0.* at t = {time}"
        ):
            scene.simulate(0.1, integrator="rk4", step=0.01, progress=False)
