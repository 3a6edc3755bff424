"""The energy balance: kinetic + potential - Σ work of every effect is constant to the integrator's error, for each alone and for all."""

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind
from support.scenes import balance

E = pc.effects


def swinging(t):
    return np.array([0.3 * np.sin(2 * t)])


class Drag:
    """A user's effect with a state of its own: a low pass of the first velocity, which brakes."""

    states = (0.0,)

    def __call__(self, t, state):
        forces = np.zeros(len(state.v))
        forces[1] = -0.5 * state.states[0]
        return forces

    def rates(self, t, state):
        return [3.0 * (state.v[1] - state.states[0])]


def single(model):
    return [name for name, hinge in model.hinges.items() if hinge.kind in ("pin", "slider", "screw")]


@pytest.fixture(scope="module")
def model():
    made = every_kind(rotor_inertia=True)
    bodies = list(made.bodies)
    made.add_node("a", bodies[2], position=(0.3, 0.1, 0))
    made.add_node("b", bodies[-1], position=(0, -0.2, 0.4))
    return made


EFFECTS = {
    "nothing": lambda m: [],
    "gravity": lambda m: [E.Gravity()],
    "point mass gravity": lambda m: [E.PointMassGravity(20.0, (5, 3, 4))],
    "gravity gradient": lambda m: [E.GravityGradient(200.0, (5, 3, 4))],
    "gravity compensation": lambda m: [E.Gravity(), E.GravityCompensation(0.6)],
    "fluid drag": lambda m: [E.FluidDrag(3.0, 0.5, (0.3, 0.2, 0.1))],
    "damping": lambda m: [E.Damping(0.4)],
    "quadratic damping": lambda m: [E.QuadraticDamping(0.4)],
    "coulomb friction": lambda m: [E.CoulombFriction(0.4, smoothing=0.3)],
    "spring": lambda m: [E.Spring(3.0)],
    "node spring": lambda m: [E.NodeSpring("a", "b", 6.0, 0.3)],
    "node damper": lambda m: [E.NodeDamper("a", "b", 2.0)],
    "bushing": lambda m: [E.Bushing("a", "b", [2.0, 3, 4, 5, 6, 7], [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])],
    "torque source": lambda m: [E.TorqueSource(E.Harmonic(2.0, 0.7), effort_limit=3.0, speed_limit=2.0, speed_band=0.9)],
    "servo": lambda m: [E.Servo(5.0, 1.0, target=E.Harmonic(0.4, 0.5))],
    "motor": lambda m: [E.Motor(0.7, 0.5, 20.0, gear_ratio=3.0, rotor_inertia=0.05)],
    "rotor inertia": lambda m: [E.RotorInertia(0.3, gear_ratio=2.0)],
    "implicit damping": lambda m: [E.ImplicitDamping(0.5)],
    "implicit spring": lambda m: [E.ImplicitSpring(4.0, rest=0.1)],
    "limits": lambda m: [E.Limits(30.0, 0.4, lower=-0.2, upper=0.2)],
    "prescribed": lambda m: [E.Prescribed(single(m)[0], swinging)],
    "wrench in the world": lambda m: [E.Wrench("b", (1, 2, 3, 4, 5, 6))],
    "wrench on the body": lambda m: [E.Wrench("b", (1, 2, 3, 4, 5, 6), axes="body")],
    "wrench in a node's axes": lambda m: [E.Wrench("b", (1, 2, 3, 4, 5, 6), axes="a")],
    "user's": lambda m: [Drag()],
    "sampled": lambda m: [E.Sampled(lambda t, s: -0.4 * s.v, 0.05)],
}


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("integrator", ["dop853", "rkmk4"])
def test_each(model, name, integrator):
    state = model.random_state(3)
    scene = pc.Scene(model).add(*EFFECTS[name](model))
    if name.startswith("implicit"):  # explicit integrators refuse them
        integrator = "rosenbrock4"
    options = dict(step=2e-3) if integrator == "rkmk4" else dict(rtol=1e-11, atol=1e-13)
    run = scene.simulate(0.4, state.q, state.v, integrator=integrator, **options)
    assert balance(run) < (1e-7 if name == "limits" else 3e-9)  # works go over the kink where a stop is met, which chooses no step
    kinetic = run.energy["kinetic"]
    if name != "nothing":  # and it does something
        still = pc.Scene(model).simulate(0.4, state.q, state.v, integrator=integrator, **options)
        assert np.abs(run.q[-1] - still.q[-1]).max() > 1e-3
    assert (
        kinetic[0] == pytest.approx(model.kinetic_energy(state.q, state.v) + extra_kinetic(scene, state), rel=1e-12) or "prescribed" in name
    )


def extra_kinetic(scene, state):
    """Of rotors that effects bring."""
    extra = 0.0
    for effect in scene.effects.values():
        if isinstance(effect, E.RotorInertia | E.Motor):
            inertia = effect.inertia if isinstance(effect, E.RotorInertia) else effect.rotor_inertia
            extra += inertia * effect.gear_ratio**2 * (state.v**2).sum() / 2
    return extra


def test_all_at_once(model):
    state = model.random_state(5)
    scene = pc.Scene(model).add(*(effect for name, made in EFFECTS.items() for effect in made(model) if name not in ("sampled", "user's")))
    scene.disable("implicit_damping", "implicit_spring")  # explicit integrators refuse them
    run = scene.simulate(0.2, state.q, state.v, integrator="dop853", rtol=1e-11, atol=1e-13)
    assert balance(run) < 1e-7
    assert set(run.workers) >= {"damping", "coulomb_friction", "node_damper", "bushing", "servo", "limits", "prescribed", "wrench"}
    assert not {"gravity", "spring", "node_spring", "rotor_inertia"} & set(run.workers)


def test_what_brakes_takes_energy_and_never_gives_any(model):
    state = model.random_state(3)
    for name in ("damping", "quadratic damping", "coulomb friction", "node damper", "bushing", "limits", "implicit damping"):
        integrator = "rosenbrock4" if name == "implicit damping" else "dopri5"
        run = pc.Scene(model).add(*EFFECTS[name](model)).simulate(0.5, state.q, state.v, integrator=integrator)
        work = run.energy["work"][:, 0]
        assert work[-1] < -1e-4 and np.diff(work).max() < 1e-9


def test_the_balance_follows_the_tolerance(model):
    """It is the integrator's error that is left, not the effects'."""
    state = model.random_state(3)
    scene = pc.Scene(model).add(E.Gravity(), E.Damping(0.3), E.Wrench("b", (1, 2, 3, 4, 5, 6)))
    spread = [balance(scene.simulate(0.5, state.q, state.v, rtol=10.0**-k, atol=10.0 ** -(k + 3))) for k in (5, 7, 9)]
    assert spread[0] > 20 * spread[1] > 400 * spread[2]


def test_works_change_no_step(model):
    """They are integrals beside the motion: the same steps, the same bits."""
    state = model.random_state(3)
    scene = pc.Scene(model).add(E.Gravity(), E.Damping(0.3), E.TorqueSource(0.2))
    for options in (dict(), dict(integrator="bulirsch-stoer"), dict(integrator="rkmk4", step=0.01)):
        counted, plain = (scene.simulate(0.3, state.q, state.v, energy=energy, **options) for energy in (True, False))
        assert np.array_equal(counted.t, plain.t) and np.array_equal(counted.q, plain.q) and np.array_equal(counted.v, plain.v)
        with pytest.raises(pc.EvaluationError, match="did not record works; simulate with energy=True"):
            print(plain.energy)
