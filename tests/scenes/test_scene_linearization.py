"""Scenes linearized: every effect against differences of the scene's own accelerations, effects' states, prescribed motion, runs."""

import numpy as np
import pytest

import pycraft as pc
from support.differences import difference
from support.oracle import agree

E = pc.effects


@pytest.fixture(scope="module")
def model():
    made = pc.tree([-1, 0, 1, 1], ["pin", "ball", "slider", "pin"], seed=5)
    made.add_node("tip", "body3", position=(0.1, 0.2, 0.3))
    made.add_node("hook", "body0", position=(0.3, 0.0, 0.2))
    return made


EFFECTS = {
    "nothing": lambda: [],
    "gravity": lambda: [E.Gravity()],
    "point mass": lambda: [E.PointMassGravity(3.0, (1.0, 2.0, 3.0))],
    "compensation": lambda: [E.Gravity(), E.GravityCompensation(0.6)],
    "fluid": lambda: [E.FluidDrag(3.0, 0.5, (0.3, 0.2, 0.1))],
    "damping": lambda: [E.Damping(0.3), E.QuadraticDamping(0.2)],
    "friction": lambda: [E.CoulombFriction(0.3, 0.5)],
    "springs": lambda: [
        E.Spring(2.0, hinges=["hinge0", "hinge2"]),
        E.NodeSpring("tip", "hook", 5.0, 0.1),
        E.NodeDamper("tip", "hook", 0.4),
    ],
    "implicit": lambda: [E.ImplicitDamping(0.4), E.ImplicitSpring(3.0, rest=0.2)],
    "rotors": lambda: [E.Gravity(), E.RotorInertia(0.6, hinges=["hinge0", "hinge3"])],
    "servo": lambda: [E.Servo(4.0, 0.5, target=0.3, hinges=["hinge0", "hinge2", "hinge3"])],
    "wrench": lambda: [E.Wrench("tip", (1, 2, 3, 4, 5, 6), axes="world")],
    "python": lambda: [lambda t, s: np.cos(np.arange(s.v.size)) * s.v**2 - np.sin(s.v)],
}


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_against_differences(model, name):
    scene = pc.Scene(model).add(*EFFECTS[name]())
    state, nv = model.random_state(2), model.nv
    found = scene.linearize(state.q, state.v)
    near = 1e-6 if name == "python" else 1e-8  # differences within
    for i, e in enumerate(np.eye(nv)):
        agree(found.A[nv:, i], difference(lambda h, e=e: scene.evaluate(model.integrate(state.q, h * e), state.v).vdot), near)
        agree(found.A[nv:, nv + i], difference(lambda h, e=e: scene.evaluate(state.q, state.v + h * e).vdot), near)
    pushed = lambda push: pc.Scene(model).add(*EFFECTS[name](), E.TorqueSource(push)).evaluate(state.q, state.v).vdot
    for i, e in enumerate(np.eye(nv)):
        agree(found.B[nv:, i], pushed(e) - pushed(0 * e), 1e-10)
    agree(found.rate, np.concatenate([state.v, scene.evaluate(state.q, state.v).vdot]))


def test_gravity_alone_is_the_models_own(model):
    state = model.random_state(4)
    model.gravity = (0, 0, -9.81)
    scene, own = pc.Scene(model).add(E.Gravity()).linearize(state.q, state.v), model.linearize(state.q, state.v)
    for name in ("A", "B", "C", "D", "rate"):
        agree(getattr(scene, name), getattr(own, name), 1e-11)
    assert scene.states == own.states and scene.units == own.units


class Actuator:
    """A first-order lag between a constant command and the torque on the first coordinate."""

    states = (0.2,)

    def __call__(self, t, state):
        return np.r_[state.states[0], np.zeros(state.v.size - 1)]

    def rates(self, t, state):
        return [5.0 * (1.0 - state.states[0]) - 0.1 * state.v[0]]


def test_states_of_effects(model):
    scene, nv = pc.Scene(model).add(Actuator()), model.nv
    state = model.random_state(1)
    found = scene.linearize(state.q, state.v)
    assert found.states[-1] == "state.0" and found.A.shape == (2 * nv + 1, 2 * nv + 1)
    agree(found.A[-1], np.r_[np.zeros(nv), -0.1, np.zeros(nv - 1), -5.0], 1e-8)
    agree(found.A[nv:-1, -1], model.mass_matrix_inverse(state.q)[:, 0], 1e-7)
    agree(found.rate[-1], 5.0 * 0.8 - 0.1 * state.v[0])
    other = scene.linearize(state.q, state.v, states=[0.7])
    agree(other.rate[-1], 5.0 * 0.3 - 0.1 * state.v[0])
    with pytest.raises(pc.ModelError, match="the effects have 1 states of their own, not 2"):
        scene.linearize(state.q, state.v, states=[0.7, 0.1])


def test_what_is_prescribed_stays(model):
    scene = pc.Scene(model).add(E.Gravity(), E.Prescribed("hinge0", 0.3))
    state, nv = model.random_state(1), model.nv
    found = scene.linearize(state.q, state.v)
    for place in (0, nv):
        assert not found.A[place].any() and not found.A[nv:, place].any() and not found.B[place].any()
    free = model.soa.free(["hinge0"])
    moved = np.r_[0.3, state.q[1:]], np.r_[0.0, state.v[1:]]
    agree(found.B[nv + 1 :, 1:], (free.MM + free.J).inv().at(moved[0]).dense(), 1e-9)


def test_along_a_run_and_discrete():
    scene = pc.mechanisms.double_pendulum().add(E.Damping(0.2))
    run = scene.simulate(0.5, t_eval=np.linspace(0, 0.5, 11))
    whole = scene.linearize(run.q, run.v, run.t, dt=0.05)
    assert len(whole) == 11 and whole.dt == 0.05
    agree(whole[4].A, scene.linearize(run.q[4], run.v[4], run.t[4]).discrete(0.05).A)
    start = scene.simulate(0.05, run.q[0] + 1e-6, run.v[0], t_eval=[0.0, 0.05], rtol=1e-12)
    parted = np.r_[start.q[-1] - run.q[1], start.v[-1] - run.v[1]]
    assert np.abs(parted - whole[0].A @ np.r_[1e-6, 1e-6, 0, 0]).max() < 1e-7  # the model is held over the step


def test_refusals(model):
    with pytest.raises(pc.EvaluationError, match="linearized in double precision, and this one computes in 'quad'"):
        pc.Scene(model, precision="quad").linearize()
    with pytest.raises(pc.EvaluationError, match="t is nan"):
        pc.Scene(model).linearize(t=np.nan)
    with pytest.raises(pc.ModelError, match="no hinge or coordinate"):
        pc.Scene(model).linearize(inputs="elbow")
    with pytest.raises(pc.ModelError, match="entry 1 is nan|is nan"):
        pc.Scene(model).linearize(model.zero_q(), np.full(model.nv, np.nan))


def test_members_of_a_batch_and_what_does_not_fit(model):
    scene = pc.Scene(model).add(Actuator())
    states = [model.random_state(seed) for seed in range(3)]
    Q, V = (np.array([getattr(s, x) for s in states]) for x in "qv")
    whole = scene.linearize(Q, V, [0.0, 1.0, 2.0], states=[[0.1], [0.2], [0.3]])
    assert whole.t.tolist() == [0.0, 1.0, 2.0] and whole[1].t == 1.0 and np.array_equal(whole[1].q, Q[1])
    agree(whole[2].A, scene.linearize(Q[2], V[2], 2.0, states=[0.3]).A)
    with pytest.raises(pc.ModelError, match="has the shape .2, 6.; give 3 states, or one for all"):
        scene.linearize(Q, V[:2])
    with pytest.raises(pc.ModelError, match="give 3 states, or one for all"):
        scene.linearize(Q, V, [0.0, 1.0])
    with pytest.raises(pc.ModelError, match="states: entry 0 is nan"):
        scene.linearize(Q[0], V[0], states=[np.nan])


def test_along_no_states():
    """A batch of none is one of no rows, as `Multibody.linearize` has it."""
    model = pc.tree([-1, 0], ["free", "ball"], seed=1)
    scene = pc.Scene(model).add(pc.effects.Gravity(), pc.effects.Damping(0.1))
    none = np.zeros((0, model.nq)), np.zeros((0, model.nv))
    for dt in (None, 0.1):
        found, plain = scene.linearize(*none, inputs=["hinge1"], dt=dt), model.linearize(*none, inputs=["hinge1"], dt=dt)
        for name in ("A", "B", "C", "D"):
            assert getattr(found, name).shape == getattr(plain, name).shape
        assert found.states == plain.states and len(found.A) == 0


def test_a_run_brings_its_times_and_the_states_of_its_effects():
    """They were taken for t = 0 and the states at first: a model that was not the motion's, without an error."""
    model = pc.chain(2)
    push = E.Table([0, 1], [[0] * 6, [0, 0, 9, 3, 2, 0]])
    scene = pc.Scene(model).add(E.Gravity((9.81, 0, 0)), E.Wrench("body1", push), E.NoseHoover(1.0, 0.3))
    run = scene.simulate(0.2, [0.3, 0.4], [0.5, 0.6], t_eval=np.linspace(0, 0.2, 5))
    told = scene.linearize(run.q, run.v, run.t, states=run.states)
    found = scene.linearize(run)
    agree(found.A, told.A)
    agree(found.rate, told.rate)
    agree(found.t, run.t)
    assert np.abs(found.rate - scene.linearize(run.q, run.v).rate).max() > 1e-2
    agree(scene.linearize(run, t=0.0, states=np.zeros(6)).rate, scene.linearize(run.q, run.v).rate)
    curved, known = (
        one.contracted(np.ones(10)) for one in (scene.quadratic_model(run), scene.quadratic_model(run.q, run.v, run.t, states=run.states))
    )
    agree(curved.xx, known.xx)
    late = run.at(0.15)
    agree(scene.evaluate(late).vdot, scene.evaluate(late.q, late.v, 0.15, states=late.states).vdot)
    agree(scene.interbody_forces(None, run), run.interbody_forces(), 1e-9)
    agree(scene.interbody_forces("hinge0", run)[2], scene.interbody_forces("hinge0", run.q[2], run.v[2], run.t[2], states=run.states[2]))
    with pytest.raises(pc.ModelError, match="q .5, 2., v .5, 2. and states .5, 6., t .3,. are batches of different sizes"):
        scene.interbody_forces(None, run, t=[0.0, 0.1, 0.2])
