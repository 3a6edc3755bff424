"""Quadratic models of scenes: every effect against differences of the scene's accelerations in quad, steps against the integrators' own.

Tolerances, as in tests/dynamics/test_quadratic.py. Second differences of fourth order, with h = 2⁻⁷, of accelerations in quad that are
rounded to double: 5 eps/h² = 2e-11 of their size to rounding, h⁴/90 = 4e-11 of a sixth derivative, some hundreds of the second one, to
truncation: NEAR. First differences of exact first derivatives: 1e-8. Second derivatives of effects in Python are themselves differences, of
which 1e-7 of the forces' size is wrong (cpp/simulation/scene_curvature.h); the mass matrix's inverse, 1e1 here, makes it 1e-6.
"""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc
from support.differences import difference
from support.oracle import agree

E = pc.effects
NEAR, H, PYTHON = 1e-7, 2.0**-7, 1e-6


@pytest.fixture(scope="module")
def model():
    made = pc.tree([-1, 0, 1, 1, 3, 2], ["free", "pin", "ball", "slider", "screw", "universal"], seed=5)
    made.add_node("tip", "body3", position=(0.1, 0.2, 0.3))
    made.add_node("hook", "body0", position=(0.3, 0.0, 0.2))
    made.add_node("ring", "body5", position=(0.3, 0.1, 0.0))
    return made


ONES = ["hinge1", "hinge3", "hinge4"]  # one coordinate each
ROD = pc.effects.Harmonic(0.3, 0.7, 0.2)


class Actuator:
    """A lag whose rate bends: states, rates and forces of second order."""

    states = (0.2,)

    def __call__(self, t, state):
        return np.r_[np.zeros(6), state.states[0] * np.sin(state.q[7]) + state.states[0] ** 2, np.zeros(state.v.size - 7)]

    def rates(self, t, state):
        return [5.0 * (1.0 - state.states[0] ** 2) - 0.1 * state.v[6] * state.q[7]]


EFFECTS = {
    "nothing": lambda: [],
    "gravity": lambda: [E.Gravity((1.0, -2.0, -9.0))],
    "point mass": lambda: [E.PointMassGravity(3.0, (1.0, 2.0, 3.0))],
    "gravity gradient": lambda: [E.GravityGradient(50.0, (1.0, 2.0, 6.0))],
    "compensation": lambda: [E.Gravity(), E.GravityCompensation(0.6)],
    "fluid": lambda: [E.FluidDrag(0.0, 0.5, (0.3, 0.2, 0.1))],
    "damping": lambda: [E.Damping(0.3), E.QuadraticDamping(0.2)],
    "friction": lambda: [E.CoulombFriction(0.3, 0.5)],
    "springs": lambda: [E.Spring(2.0, hinges=["hinge1", "hinge2"])],
    "nodes": lambda: [E.NodeSpring("tip", "hook", 5.0, 0.1), E.NodeDamper("tip", "hook", 0.4)],
    "bushing": lambda: [E.Bushing("tip", "ring", 3.0, 0.2)],
    "implicit": lambda: [E.ImplicitDamping(0.4), E.ImplicitSpring(3.0, rest=0.2)],
    "rotors": lambda: [E.Gravity(), E.RotorInertia(0.6, hinges=ONES)],
    "servo": lambda: [E.Servo(4.0, 0.5, target=ROD, hinges=ONES, speed_limit=0.9, speed_band=0.8)],
    "motor": lambda: [E.Motor(0.6, 3.0, 2.0, gear_ratio=2.0, rotor_inertia=0.1, hinges=ONES, speed_limit=0.9, speed_band=0.8)],
    "torque": lambda: [E.TorqueSource(lambda t: 1.0 + t, hinges=ONES, speed_limit=0.9, speed_band=0.8)],
    "stops": lambda: [E.Limits(40.0, 0.3, lower=-0.01, upper=0.01, hinges=ONES)],
    "wrench": lambda: [E.Wrench("tip", (1, 2, 3, 4, 5, 6), axes="world"), E.Wrench("ring", (3, 2, 1, 4, 2, 6), axes="hook")],
    "fixman": lambda: [E.Fixman(0.7)],
    "prescribed": lambda: [E.Gravity(), E.Prescribed("hinge3", ROD), E.NodeSpring("tip", "hook", 5.0, 0.1)],
    "prescribed ball": lambda: [E.Gravity(), E.Prescribed("hinge2", lambda t: [np.cos(t), np.sin(t), 0.1, 0.2]), E.Damping(0.3)],
    "python": lambda: [lambda t, s: np.cos(np.arange(s.v.size)) * s.v**2 - np.sin(s.v) * np.cos(s.q[7] + t)],
    "states": lambda: [E.Gravity(), Actuator()],
    "thermostat": lambda: [E.NoseHoover(0.8, 0.5)],
}  # fmt: skip
BY_DIFFERENCES = ("python", "states")


def second(f, h=H):
    """d²f/ds² at 0, fourth order."""
    return np.asarray(16 * (f(h) + f(-h)) - (f(2 * h) + f(-2 * h)) - 30 * f(0.0)) / (12 * h * h)


def along(hessian, z, n):
    x, u = z[:n], z[n:]
    return x @ hessian.xx @ x + 2 * x @ hessian.xu @ u + u @ hessian.uu @ u


def own_states(scene, seed=3):
    count = len(scene.linearize().states) - 2 * scene.model.nv
    return np.random.default_rng(seed).uniform(0.2, 1, count)


def held(near, nv):
    """Numbers of the coordinates that are prescribed, whose rows are zero."""
    return [j for j in range(nv) if not near.A[j].any()]


@pytest.mark.parametrize("name", EFFECTS)
def test_accelerations_against_differences_in_quad(model, name):
    """Along random directions of states, effects' own states and inputs, by the scene's evaluations in quad alone.

    Coordinates that are prescribed are put where their motion has them, and stay there.
    """
    scene, nv, rng = pc.Scene(model).add(*EFFECTS[name]()), model.nv, np.random.default_rng(4)
    state, own, t = model.random_state(2), own_states(scene), 0.4
    near = scene.quadratic_model(state.q, state.v, t, states=own)
    n = 2 * nv + len(own)
    assert near.states == scene.linearize().states and near.A.shape == (n, n) and near.B.shape == (n, nv)
    known, at = held(near, nv), near.linear
    free = np.setdiff1d(np.arange(nv), known)

    def vdot(move, faster, more, push):
        pushed = pc.Scene(model, precision="quad").add(*EFFECTS[name](), E.TorqueSource(push))
        return pushed.evaluate(model.integrate(at.q, move), at.v + faster, t, states=own + more).vdot

    for _ in range(2):
        z, costate = rng.uniform(-0.5, 0.5, n + nv), rng.uniform(-1, 1, nv)
        z[[*known, *(nv + j for j in known)]] = costate[known] = 0.0
        parts = np.split(z, [nv, 2 * nv, n])
        agree(near.linear.rate[nv:][free], vdot(*(0 * x for x in parts))[free], 1e-10)
        bent = second(lambda s: costate @ vdot(*(s * x for x in parts)))  # noqa: B023 - called here
        found = along(near.contracted(np.r_[np.zeros(nv), costate, 0 * own]), z, n)
        agree(found, bent, PYTHON if name in BY_DIFFERENCES else NEAR)


@pytest.mark.parametrize("name", EFFECTS)
def test_every_entry_against_differences_of_first_derivatives(model, name):
    """Along coordinates the mean of both orders, as exponential coordinates have it; also rates of effects' own states."""
    scene, nv = pc.Scene(model).add(*EFFECTS[name]()), model.nv
    state, own, t = model.random_state(2), own_states(scene), 0.4
    n = 2 * nv + len(own)
    costate = np.r_[np.zeros(nv), np.random.default_rng(5).uniform(-1, 1, n - nv)]
    found = scene.quadratic_model(state.q, state.v, t, states=own).contracted(costate)

    def gradient(move, faster, more):
        near = scene.linearize(model.integrate(state.q, move), state.v + faster, t, states=own + more)
        return costate @ np.hstack([near.A, near.B])

    rows = np.array([difference(lambda h, e=e: gradient(*np.split(h * e, [nv, 2 * nv])), 2.0**-8) for e in np.eye(n)])
    known = held(scene.linearize(state.q, state.v, t, states=own), nv)
    rows[[*known, *(nv + j for j in known)]] = 0.0
    rows[:nv, :nv] = (rows[:nv, :nv] + rows[:nv, :nv].T) / 2
    near = PYTHON if name in BY_DIFFERENCES else 1e-8
    agree(found.xx, rows[:, :n], near)
    agree(found.xu, rows[:, n:], near)
    assert np.array_equal(found.xx, found.xx.T) or np.allclose(found.xx, found.xx.T, atol=1e-12)
    assert not found.uu.any()


def test_every_effect_is_tried(model):
    """All but loops, which are refused, impulses, which are no forces, and samples, which have a test of their own."""
    offered = {one for one in vars(E).values() if isinstance(one, type) and issubclass(one, E.Effect)}
    tried = {type(one) for make in EFFECTS.values() for one in make()}
    assert {one.__name__ for one in offered - tried} == {"Effect", "Loop", "Langevin", "Sampled", "UserEffect"}


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.05])
def test_small_rotations_of_springs(angle):
    """Where a rotation vector is a series: a ball's spring and a bushing, all of T(exp(δ)) against differences in quad."""
    model = pc.tree([-1, 0], ["ball", "pin"], seed=1)
    model.add_node("there", "", position=(0.1, 0.2, 0.3), rotation=model.frame("body0").pose()[:3, :3])
    effects = [E.Spring(2.0, hinges="hinge0"), E.Bushing("there", "body0", 3.0, 0.4)]
    q = model.integrate(model.zero_q(), angle * np.array([0.48, 0.6, -0.64, 0.0]))
    v, costate, quad = np.array([0.3, -0.5, 0.7, 0.2]), np.array([0.3, 0.5, -0.7, 0.4]), pc.Scene(model, precision="quad").add(*effects)
    near = pc.Scene(model).add(*effects).quadratic_model(q, v)
    for z in np.random.default_rng(1).uniform(-0.5, 0.5, (3, 8)):
        bent = second(lambda s, z=z: costate @ quad.evaluate(model.integrate(q, s * z[:4]), v + s * z[4:]).vdot)
        agree(along(near.contracted(np.r_[np.zeros(4), costate]), np.r_[z, np.zeros(4)], 8), bent, NEAR)


def test_gravity_alone_is_the_models_own(model):
    state, nv = model.random_state(4), model.nv
    model.gravity = (0, 0, -9.81)
    scene, own = pc.Scene(model).add(E.Gravity()).quadratic_model(state.q, state.v), model.quadratic_model(state.q, state.v)
    costate = np.random.default_rng(1).uniform(-1, 1, 2 * nv)
    for one, two in zip((*scene.contracted(costate), *scene.tensors()), (*own.contracted(costate), *own.tensors()), strict=True):
        agree(one, two, 1e-11)
    for integrator in ("euler", "semi-implicit-euler", "rkmk4"):
        one, two = scene.discrete(0.02, integrator), own.discrete(0.02, integrator)
        for found, expected in zip((one.A, one.B, *one.contracted(costate)), (two.A, two.B, *two.contracted(costate)), strict=True):
            agree(found, expected, 1e-11)
        agree(one.after.q, two.after.q)
        assert one.states_after.shape == (0,) and two.states_after.shape == (0,)
    model.gravity = (0, 0, 0)


STEPPED = {
    "forces": lambda: [E.Gravity(), E.QuadraticDamping(0.2), E.Bushing("tip", "ring", 3.0, 0.2), E.Wrench("tip", ROD6, axes="world")],
    "prescribed": lambda: [E.Gravity(), E.Prescribed("hinge3", ROD), E.Damping(0.3), E.Servo(4.0, 0.5, target=ROD, hinges=["hinge1"])],
    "prescribed ball": lambda: EFFECTS["prescribed ball"](),
    "thermostat": lambda: [E.Gravity(), E.NoseHoover(0.8, 0.5)],
}
ROD6 = E.Table([0.0, 1.0], [[1, 2, 3, 4, 5, 6], [2, 2, 1, 0, 5, 1]])


@pytest.mark.parametrize("integrator", ["semi-implicit-euler", "rkmk4"])
@pytest.mark.parametrize("name", STEPPED)
def test_steps_against_the_integrators(model, name, integrator):
    """First and second derivatives of the scene's own steps, taken in quad, along random directions of states and inputs.

    What effects have of their own is at first what they say, and its end is not in a run's q and v: directions leave it as it is.
    """
    scene, nv, h, rng = pc.Scene(model).add(*STEPPED[name]()), model.nv, 0.05, np.random.default_rng(6)
    state = model.random_state(3)
    near = scene.quadratic_model(state.q, state.v).discrete(h, integrator)
    n = len(near.states)

    def stepped(q, v, push):
        pushed = pc.Scene(model, precision="quad").add(*STEPPED[name](), E.TorqueSource(push))
        run = pushed.simulate(h, q, v, integrator=integrator, step=h, t_eval=[0.0, h], energy=False, progress=False)
        return np.r_[model.difference(near.after.q, run.q[-1]), run.v[-1]]

    agree(stepped(state.q, state.v, np.zeros(nv)), np.r_[np.zeros(nv), near.after.v], 1e-12)
    known = held(near, nv)
    for _ in range(2):
        z, costate = rng.uniform(-0.5, 0.5, n + nv), rng.uniform(-1, 1, n)
        z[2 * nv : n] = costate[2 * nv :] = 0.0
        costate[[*known, *(nv + j for j in known)]] = 0.0
        weights = costate[: 2 * nv]
        moved = lambda s: weights @ stepped(model.integrate(state.q, s * z[:nv]), state.v + s * z[nv : 2 * nv], s * z[n:])  # noqa: B023 - called here
        agree(costate @ np.hstack([near.A, near.B]) @ z, difference(moved), 1e-8)
        agree(along(near.contracted(costate), z, n), second(moved), NEAR)


def test_steps_of_effects_states():
    """A lag ẏ = 5 (1 - y²) that drives a slider, v̇ = y²: a step of "rkmk4" written out."""

    class Lag:
        states = (0.2,)

        def __call__(self, t, state):
            return [state.states[0] ** 2]

        def rates(self, t, state):
            return [5.0 * (1.0 - state.states[0] ** 2)]

    rail = pc.Multibody("rail")
    rail.add_body("cart", hinge="slider", axis=(1, 0, 0), mass=1.0)
    h, start = 0.1, np.array([0.3, -0.2, 0.4])
    near = pc.Scene(rail).add(Lag()).quadratic_model(start[:1], start[1:2], states=start[2:]).discrete(h)

    def step(x):
        rate = lambda x: np.array([x[1], x[2] ** 2, 5 * (1 - x[2] ** 2)])
        a = rate(x)
        b = rate(x + h / 2 * a)
        c = rate(x + h / 2 * b)
        return x + h / 6 * (a + 2 * b + 2 * c + rate(x + h * c))

    agree(np.r_[near.after.q, near.after.v, near.states_after], step(start), 1e-13)
    assert near.states == ("q.cart", "v.cart", "state.0")
    for e in np.eye(3):
        agree(near.A @ e, difference(lambda s, e=e: step(start + s * e)), 1e-8)
    for i in range(3):
        z = np.array([0.3, 0.5, -0.7])
        agree(along(near.contracted(np.eye(3)[i]), np.r_[z, 0], 3), second(lambda s, i=i: step(start + s * z)[i]), PYTHON)  # noqa: B023 - called here


def test_what_controllers_hold_stays_over_a_step():
    """A sample is taken at the state itself where its time has come, and none within the step, though one would be due at its end."""
    rail = pc.Multibody("rail")
    rail.add_body("cart", hinge="slider", axis=(1, 0, 0), mass=1.0)
    scene = pc.Scene(rail).add(E.Sampled(lambda t, s: -3.0 * s.q - t, 0.05))
    near = scene.quadratic_model([0.2], [0.5], 0.05)  # holds -3 · 0.2 - 0.05
    step = near.discrete(0.05)
    agree(step.states_after, [-0.65])
    agree(np.r_[step.after.q, step.after.v], [0.2 + 0.05 * 0.5 - 0.65 * 0.05**2 / 2, 0.5 - 0.65 * 0.05])
    agree(step.A, [[1, 0.05, 0.05**2 / 2], [0, 1, 0.05], [0, 0, 1]], 1e-9)
    agree(scene.quadratic_model([0.2], [0.5], 0.06, states=[0.4]).discrete(0.05).after.v, [0.52])


def test_what_is_prescribed_has_no_curvature(model):
    scene, nv = pc.Scene(model).add(*EFFECTS["prescribed"]()), model.nv
    state = model.random_state(1)
    at = model.coordinate_names.index("hinge3")
    near = scene.quadratic_model(state.q, state.v, 0.3)
    for one in (near, near.discrete(0.02)):
        whole = one.tensors()
        for place in (at, nv + at):
            assert (
                not whole.xx[place].any()
                and not whole.xx[:, place].any()
                and not whole.xx[:, :, place].any()
                and not whole.xu[:, place].any()
            )
        assert not whole.xu[:, :, at].any() and not one.contracted(np.eye(2 * nv)[at]).xx.any()
    assert near.discrete(0.02).after.q[model.hinges["hinge3"].q_slice][0] == pytest.approx(ROD(0.32)[0], abs=1e-15)


@pytest.mark.parametrize("dt", [None, 0.02])
def test_batches_are_their_states(model, dt):
    scene = pc.Scene(model).add(E.Gravity(), E.Wrench("tip", ROD6), E.NoseHoover(0.8, 0.5), E.Prescribed("hinge3", ROD))
    states, times = [model.random_state(seed) for seed in range(3)], [0.0, 0.3, 0.6]
    Q, V = (np.array([getattr(s, x) for s in states]) for x in "qv")
    own = np.random.default_rng(2).uniform(0.2, 1, (3, len(own_states(scene))))
    costates = np.random.default_rng(1).uniform(-1, 1, (3, 2 * model.nv + own.shape[1]))
    ways = (lambda one: one) if dt is None else (lambda one: one.discrete(dt))
    whole = ways(scene.quadratic_model(Q, V, times, states=own, inputs=ONES))
    assert len(whole.inputs) == 3
    for b in range(3):
        one = ways(scene.quadratic_model(Q[b], V[b], times[b], states=own[b], inputs=ONES))
        agree(whole.A[b], one.A, 1e-12)
        for all_of_them, its_own in zip(whole.contracted(costates), one.contracted(costates[b]), strict=True):
            agree(all_of_them[b], its_own, 1e-11)
    agree(whole.tensors().xu[2], one.tensors().xu, 1e-11)
    empty = ways(scene.quadratic_model(Q[:0], V[:0], states=own[:0]))
    n = 2 * model.nv + own.shape[1]
    assert empty.contracted(costates[:0]).xx.shape == (0, n, n) and empty.tensors().xu.shape == (0, n, n, model.nv)


def test_copies_and_pickles(model):
    scene = pc.Scene(model).add(E.Gravity(), E.QuadraticDamping(0.3))
    state = model.random_state(1)
    for near in (scene.quadratic_model(state.q, state.v), model.quadratic_model(state.q, state.v)):
        for other in (pickle.loads(pickle.dumps(near)), copy.deepcopy(near.discrete(0.02))):
            one = near if other.dt is None else near.discrete(0.02)
            agree(other.contracted(np.ones(2 * model.nv)).xx, one.contracted(np.ones(2 * model.nv)).xx, 1e-12)


def test_degenerate_scenes():
    for nothing in (pc.Multibody("nothing"), pc.tree([-1, 0], ["weld", "weld"], seed=1)):
        near = pc.Scene(nothing).add(E.Gravity()).quadratic_model()
        assert near.contracted([]).xx.shape == (0, 0) and near.discrete(0.1).tensors().xu.shape == (0, 0, 0)
    one = pc.chain(1)  # v̇ = 3 τ - 2 sin q of a spring between nodes, which is gravity's like
    every = pc.Scene(one).add(E.Prescribed("hinge0", 0.3)).quadratic_model([0.1], [0.2])
    assert not every.tensors().xx.any() and not every.B.any()


def test_the_linear_model_is_where_prescribed_coordinates_are():
    """Outputs and rates are taken where their motion has them, wherever q and v say that they are."""
    scene = pc.Scene(pc.chain(2)).add(E.Prescribed("hinge0", E.Harmonic(0.5, 1.0)))
    told = scene.linearize([9.0, 0.3], [7.0, 0.4], 0.1, outputs=["position.body1"])
    there = 0.5 * np.sin(0.2 * np.pi), np.pi * np.cos(0.2 * np.pi)
    agree(told.q, [there[0], 0.3])
    agree(told.rate[:2], [there[1], 0.4])
    agree(told.C, scene.linearize([there[0], 0.3], [there[1], 0.4], 0.1, outputs=["position.body1"]).C)
