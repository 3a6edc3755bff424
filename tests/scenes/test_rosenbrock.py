"""The Rosenbrock method: exact derivatives of scenes, stiff motion by few steps, every effect."""

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind
from support.runs import apart, spinning

E = pc.effects


def stiff_pendulum(k=1e6, c=2e3):
    """A pendulum with a stiff, heavily damped spring on a second hinge: rates of 1 and some 10⁴ a second."""
    model = pc.Multibody("stiff")
    model.add_body("arm", axis=(0, 1, 0), mass=1.0, com=(0.5, 0, 0), inertia=np.eye(3) / 12)
    model.add_body("tip", "arm", axis=(0, 1, 0), position=(1, 0, 0), mass=0.2, com=(0.3, 0, 0), inertia=np.eye(3) / 100)
    return pc.Scene(model).add(E.Gravity(), E.Spring(k, hinges="tip"), E.Damping(c, hinges="tip"))


def test_stiff_motion_takes_few_steps():
    """A hundredth of the steps that explicit methods need, for the same motion of one body, except for the spring's deflection."""
    scene = stiff_pendulum()
    fast = scene.simulate(2.0, integrator="rosenbrock4", rtol=1e-6, atol=1e-9)
    slow = scene.simulate(0.2, integrator="dopri5", rtol=1e-6, atol=1e-9)
    assert fast.statistics["steps"] < 300 and slow.statistics["steps"] > 3000
    assert fast.statistics["linearizations"] <= fast.statistics["steps"] + fast.statistics["rejected"]
    rigid = pc.Multibody("rigid")
    rigid.add_body("arm", axis=(0, 1, 0), mass=1.0, com=(0.5, 0, 0), inertia=np.eye(3) / 12)
    rigid.add_body("tip", "arm", "weld", position=(1, 0, 0), mass=0.2, com=(0.3, 0, 0), inertia=np.eye(3) / 100)
    one = pc.Scene(rigid).add(E.Gravity()).simulate(2.0, rtol=1e-9, t_eval=[2.0])
    assert fast.q[-1, 0] == pytest.approx(one.q[-1, 0], abs=2e-4)
    assert np.ptp(fast.balance) < 1e-4


@pytest.mark.parametrize("rate", [1e3, 1e6, 1e9])
def test_stiffness_is_damped_at_once(rate):
    """L-stable: what is far from rest with 10⁹ a second is at rest after one step, not swinging."""
    model = pc.Multibody("wheel")
    model.add_body("w", mass=1.0, inertia=np.diag([1.0, 1, 0.5]))
    scene = pc.Scene(model).add(E.Damping(0.5 * rate), E.TorqueSource(0.25 * rate))
    run = scene.simulate(1.0, [0.0], [2.0], integrator="rosenbrock4", rtol=1e-7, atol=1e-9)
    assert run.v[-1, 0] == pytest.approx(0.5, abs=1e-8) and run.statistics["steps"] < 200
    assert run.q[-1, 0] == pytest.approx(0.5 + 1.5 / rate * (1 - np.exp(-rate)), abs=1e-6)


EFFECTS = {
    "springs and damping": lambda m: [E.Spring(30.0), E.Damping(0.4), E.RotorInertia(0.2)],
    "friction": lambda m: [E.CoulombFriction(0.4, smoothing=0.1), E.QuadraticDamping(0.2)],
    "in time": lambda m: [E.TorqueSource(E.Harmonic(2.0, 1.5)), E.Servo(5.0, 1.0, target=E.Harmonic(0.4, 0.5))],
    "nodes": lambda m: [
        E.Bushing("a", "b", [2.0, 3, 4, 5, 6, 7], 0.1),
        E.NodeSpring("a", None, 6.0, 0.3),
        E.Wrench("b", (1, 2, 3, 4, 5, 6)),
    ],
    "fields": lambda m: [E.PointMassGravity(20.0, (5, 3, 4)), E.Gravity()],
    "prescribed": lambda m: [E.Prescribed(first_pin(m), E.Harmonic(0.3, 0.7)), E.Gravity()],
    "implicit": lambda m: [E.ImplicitDamping(0.5), E.ImplicitSpring(4.0, rest=0.1)],
    "user's": lambda m: [Drag()],
    "sampled": lambda m: [E.Sampled(lambda t, s: -0.4 * s.v, 0.05)],
}


def first_pin(model):
    return next(name for name, hinge in model.hinges.items() if hinge.kind == "pin")


class Drag:
    """A low pass of the first velocity, which brakes; with a state of its own, in Python."""

    states = (0.0,)

    def __call__(self, t, state):
        forces = np.zeros(len(state.v))
        forces[1] = -0.5 * state.states[0] * np.cos(state.q[0])
        return forces

    def rates(self, t, state):
        return [3.0 * (state.v[1] - state.states[0])]


@pytest.fixture(scope="module")
def model():
    made = every_kind(rotor_inertia=True)
    bodies = list(made.bodies)
    made.add_node("a", bodies[2], position=(0.3, 0.1, 0))
    made.add_node("b", bodies[-1], position=(0, -0.2, 0.4))
    return made


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_keeps_the_order(model, name):
    """Fourth order needs derivatives that are exact: one wrong term would leave order two at most."""
    state, T = model.random_state(3), 0.2
    scene = pc.Scene(model).add(*EFFECTS[name](model))
    plain = scene
    if name == "implicit":
        of = single(model)
        plain = pc.Scene(model).add(E.Damping(0.5), E.Spring(4.0, rest=0.1, hinges=of))
    best = plain.simulate(T, state.q, state.v, integrator="dop853", rtol=1e-12, atol=1e-13, energy=False)
    errors = []
    for n in (10, 20, 40):
        run = scene.simulate(T, state.q, state.v, integrator="rosenbrock4", rtol=1e4, atol=1e4, step=T / n, max_step=T / n, energy=False)
        errors.append(apart(model, run.q[-1], run.v[-1], (best.q[-1], best.v[-1])))
    found = np.log2(np.array(errors[:-1]) / errors[1:])
    order = found.max() if name == "friction" else found[-1]  # where v |v| has its kink is not resolved further
    assert order > 3.4 or errors[-1] < 1e-9, (errors, found)


def single(model):
    kinds = {name: [s["kind"] for s in hinge.subhinges] for name, hinge in model.hinges.items()}
    return [name for name, of in kinds.items() if of and set(of) <= {"pin", "slider", "screw"}]


def test_dense_output_of_its_own():
    """Order 3: errors between the ends of steps of size h are O(h⁴)."""
    scene = spinning()
    times = np.linspace(0.01, 0.49, 25)
    best = scene.simulate(0.5, integrator="dop853", rtol=1e-13, atol=1e-14, t_eval=times)
    errors = []
    for n in (10, 20, 40):
        run = scene.simulate(0.5, integrator="rosenbrock4", rtol=1e4, atol=1e4, step=0.5 / n, max_step=0.5 / n, t_eval=times)
        errors.append(max(apart(scene.model, q, v, end) for q, v, *end in zip(run.q, run.v, best.q, best.v, strict=True)))
        assert np.abs(run.at(times[3]).q - run.q[3]).max() < 1e-14  # of a step from end to end, whose size is a rounding off
    found = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (found > 3.3).all(), (errors, found)


def test_quaternions_keep_their_length():
    run = spinning().simulate(2.0, integrator="rosenbrock4", rtol=1e-4)
    assert np.abs(np.linalg.norm(run.q[:, :4], axis=1) - 1).max() < 1e-15
