"""The forces of every effect, by its equation written out here; and where it has a potential, that they are its slope."""

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind
from support.oracle import DIFFERENCE, ROUNDING, agree
from support.scenes import place, pushed, speed, subhinges

E = pc.effects


@pytest.fixture(scope="module")
def model():
    """Every kind of hinge; nodes on two bodies and on the base."""
    made = every_kind()
    bodies = list(made.bodies)
    rng = np.random.default_rng(8)
    for name, body in (("a", bodies[2]), ("b", bodies[-1]), ("fixed", None)):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        made.add_node(name, body, position=rng.uniform(-0.5, 0.5, 3), rotation=turn * np.linalg.det(turn))
    return made


@pytest.fixture(scope="module")
def state(model):
    return model.random_state(7)


def forces(model, effect, state, t=0.0):
    """Generalized forces of an effect alone."""
    found = pc.Scene(model).add(effect, name="it").evaluate(state.q, state.v, t)
    return found.forces["it"]


def single(model):
    """Numbers in q and v of the coordinates of pins, sliders and screws."""
    q = 0
    for kind, _, numbers in subhinges(model):
        if kind in ("pin", "slider", "screw"):
            yield q, numbers[0]
        q += {"ball": 4, "free": 7}.get(kind, 1)


# Hinges ---------------------------------------------------------------------------------------------------------------


def test_damping(model, state):
    c = np.random.default_rng(1).uniform(0, 1, model.nv)
    agree(forces(model, E.Damping(c), state), -c * state.v)
    agree(forces(model, E.Damping(0.3), state), -0.3 * state.v)


def test_quadratic_damping(model, state):
    c = np.random.default_rng(1).uniform(0, 1, model.nv)
    agree(forces(model, E.QuadraticDamping(c), state), -c * np.abs(state.v) * state.v)


def test_coulomb_friction(model, state):
    agree(forces(model, E.CoulombFriction(0.7, smoothing=0.2), state), -0.7 * np.tanh(state.v / 0.2))
    assert forces(model, E.CoulombFriction(0.7, smoothing=1e-9), state) == pytest.approx(-0.7 * np.sign(state.v))


def test_spring(model, state):
    """On single coordinates and on balls, from a rest of its own; none named: all but free ones."""
    rng = np.random.default_rng(2)
    expected = np.zeros(model.nv)
    rest, names, stiffness = [], [], []
    q = 0
    for kind, called, numbers in subhinges(model):
        n = {"ball": 4, "free": 7}.get(kind, 1)
        if kind != "free":
            k, here = rng.uniform(1, 2), state.q[q : q + n]
            names += called
            stiffness += [k] * len(numbers)
            if kind == "ball":
                turn = rng.normal(size=4)
                rest += turn.tolist()
                w, x, y, z = np.conj(1) * turn / np.linalg.norm(turn)
                r = np.array([[w, x, y, z], [-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]]) @ (here / np.linalg.norm(here))  # rest* q
                r *= np.sign(r[0])
                angle = 2 * np.arctan2(np.linalg.norm(r[1:]), r[0])
                expected[numbers] = -k * angle * r[1:] / np.linalg.norm(r[1:])
            else:
                rest.append(rng.uniform(-1, 1))
                expected[numbers] = -k * (here - rest[-1])
        q += n
    agree(forces(model, E.Spring(stiffness, rest=rest, hinges=names), state), expected)
    at_zero = forces(model, E.Spring(2.0), state)
    for q, v in single(model):
        assert at_zero[v] == pytest.approx(-2 * state.q[q])
    for kind, _, numbers in subhinges(model):
        assert kind != "free" or not at_zero[numbers].any()


def test_implicit_effects_are_plain_ones_without_a_step(model, state):
    assert np.array_equal(forces(model, E.ImplicitDamping(0.4), state), forces(model, E.Damping(0.4), state))
    names = [model.coordinate_names[v] for _, v in single(model)]
    plain = forces(model, E.Spring(3.0, rest=0.2, hinges=names), state)
    assert np.array_equal(forces(model, E.ImplicitSpring(3.0, rest=0.2), state), plain)


def test_torque_source(model, state):
    u = np.random.default_rng(3).uniform(-5, 5, model.nv)
    agree(forces(model, E.TorqueSource(u), state), u)
    agree(forces(model, E.TorqueSource(u, effort_limit=2.0), state), np.clip(u, -2, 2))
    fast = 0.5  # rad/s: some coordinates are beyond it, some within the band below it
    left = np.clip((fast - np.abs(state.v)) / (0.4 * fast), 0, 1)
    expected = np.where(u * state.v > 0, left, 1) * u
    assert 0 < np.count_nonzero(left == 0) < model.nv and np.any((left > 0) & (left < 1) & (u * state.v > 0))
    agree(forces(model, E.TorqueSource(u, speed_limit=fast, speed_band=0.4), state), expected)


def test_servo(model, state):
    kp, kd, r = 3.0, 0.5, E.Harmonic(0.7, 0.3, phase=0.2, offset=0.1)
    t, w = 0.4, 2 * np.pi * 0.3
    target, rate = 0.1 + 0.7 * np.sin(w * t + 0.2), 0.7 * w * np.cos(w * t + 0.2)
    expected = np.zeros(model.nv)
    for q, v in single(model):
        expected[v] = kp * (target - state.q[q]) + kd * (rate - state.v[v])
    agree(forces(model, E.Servo(kp, kd, target=r), state, t), expected)
    agree(forces(model, E.Servo(kp, kd, target=lambda t: 0.1 + 0.7 * np.sin(w * t + 0.2)), state, t), expected, DIFFERENCE)
    agree(forces(model, E.Servo(kp, kd, target=r, effort_limit=0.8), state, t), np.clip(expected, -0.8, 0.8))


def test_motor(model, state):
    """The line at the hinge, the command within ±1, the rotor in D and not in the forces that it gives."""
    n, stall, fastest = 4.0, 2.0, 30.0
    for command, u in ((0.6, 0.6), (7.0, 1.0), (-7.0, -1.0)):
        line = n * stall * (u - n * state.v / fastest)
        agree(forces(model, E.Motor(command, stall, fastest, gear_ratio=n), state), line)
        agree(forces(model, E.Motor(command, stall, fastest, gear_ratio=n, effort_limit=3.0), state), np.clip(line, -3, 3))
    scene = pc.Scene(model).add(E.Motor(0.6, stall, fastest, gear_ratio=n, rotor_inertia=0.02))
    other = pc.Scene(model).add(E.Motor(0.6, stall, fastest, gear_ratio=n), E.RotorInertia(0.02, gear_ratio=n))
    agree(scene.evaluate(state.q, state.v).vdot, other.evaluate(state.q, state.v).vdot)
    assert (
        np.abs(scene.evaluate(state.q, state.v).vdot - pc.Scene(model).add(other.effects["motor"]).evaluate(state.q, state.v).vdot).max()
        > 1e-3
    )


def test_limits(model, state):
    k, a, low, high = 50.0, 0.3, -0.2, 0.1
    expected = np.zeros(model.nv)
    for q, v in single(model):
        if state.q[q] < low:
            expected[v] = k * (low - state.q[q]) * max(0, 1 - a * state.v[v])
        elif state.q[q] > high:
            expected[v] = -k * (state.q[q] - high) * max(0, 1 + a * state.v[v])
    assert np.any(expected > 0) and np.any(expected < 0)
    agree(forces(model, E.Limits(k, a, lower=low, upper=high), state), expected)
    pulls = E.Limits(k, 1e3, lower=low, upper=high)  # never towards the stop
    assert np.all(forces(model, pulls, state) * np.sign(expected) >= 0)


def test_limits_of_the_model():
    model = pc.chain(3)
    model.hinges["hinge0"].limits, model.hinges["hinge2"].limits = (-0.5, 0.5), (-np.inf, 0.2)
    state = model.random_state(0)
    state.q[:] = 0.7, 9.0, 0.9
    found = forces(model, E.Limits(10.0), state)
    assert found == pytest.approx([-10 * 0.2, 0, -10 * 0.7])
    model.hinges["hinge2"].limits = (-np.inf, 0.4)  # a scene sees what changes
    assert forces(model, E.Limits(10.0), state)[2] == pytest.approx(-5.0)


# Nodes ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axes", ["world", "body", "b", "a", "fixed"])
def test_wrench(model, state, axes):
    moment, force = np.array([1.0, -2.0, 0.5]), np.array([0.3, 4.0, -1.0])
    body = model.nodes["b"].body.name
    turn = {"world": np.eye(3), "body": model.pose(body, state.q)[:3, :3]}.get(axes)
    turn = model.pose(axes, state.q)[:3, :3] if turn is None else turn
    expected = pushed(model, state, "b", turn @ moment, turn @ force)
    agree(forces(model, E.Wrench("b", [*moment, *force], axes=axes), state), expected)


def test_a_wrench_of_time(model, state):
    times, values = [0.0, 1.0, 3.0], np.random.default_rng(1).normal(size=(3, 6))
    for t, expected in ((-1.0, values[0]), (0.25, 0.75 * values[0] + 0.25 * values[1]), (2.0, values[1:].mean(axis=0)), (9.0, values[2])):
        constant = forces(model, E.Wrench("b", expected), state)
        agree(forces(model, E.Wrench("b", E.Table(times, values)), state, t), constant)
        agree(forces(model, E.Wrench("b", lambda t, expected=expected: expected), state, t), constant)


PAIRS = [("a", "b"), ("b", "a"), ("fixed", "b"), ("b", None)]


@pytest.mark.parametrize("nodes", PAIRS, ids=str)
@pytest.mark.parametrize("length", [0.0, 0.6])
def test_node_spring(model, state, nodes, length):
    a, b = (place(model, node, state)[:3, 3] for node in nodes)
    d = b - a
    pull = 5.0 * (np.linalg.norm(d) - length) * d / np.linalg.norm(d)
    expected = sum(pushed(model, state, node, np.zeros(3), s * pull) for node, s in zip(nodes, (1, -1), strict=True) if node)
    agree(forces(model, E.NodeSpring(*nodes, 5.0, length), state), expected)


@pytest.mark.parametrize("nodes", PAIRS, ids=str)
def test_node_damper(model, state, nodes):
    a, b = (place(model, node, state)[:3, 3] for node in nodes)
    along = (b - a) / np.linalg.norm(b - a)
    pull = 2.0 * along * (along @ (speed(model, nodes[1], state)[3:] - speed(model, nodes[0], state)[3:]))
    expected = sum(pushed(model, state, node, np.zeros(3), s * pull) for node, s in zip(nodes, (1, -1), strict=True) if node)
    agree(forces(model, E.NodeDamper(*nodes, 2.0), state), expected)


def rotation_vector(R):
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_rotvec()


@pytest.mark.parametrize("nodes", PAIRS, ids=str)
def test_bushing(model, state, nodes):
    """Power and momentum: -ξ̇*(Kξ + Cξ̇) is what the forces do, with ξ̇ by differences; and both bodies are pushed alike."""
    rng = np.random.default_rng(5)
    K, C = (np.diag(rng.uniform(1, 9, 6)) + 0.2 for _ in range(2))
    elsewhere = pc.tree([-1], ["free"], seed=3)
    rest = elsewhere.pose("body0", elsewhere.random_state(1).q)
    effect = E.Bushing(*nodes, K, C, rest=rest)

    def stretch(q):
        A, B = (place(model, node, pc.State(q, state.v)) for node in nodes)
        X = np.linalg.inv(A @ rest) @ B
        return np.concatenate([rotation_vector(X[:3, :3]), X[:3, 3]])

    h, v = 1e-3, state.v
    xi = stretch(state.q)
    rates = np.empty((6, model.nv))  # ∂ξ/∂ each coordinate
    for j, e in enumerate(np.eye(model.nv)):
        x = [stretch(model.integrate(state.q, i * h * e)) for i in (-2, -1, 1, 2)]
        rates[:, j] = (x[0] - 8 * x[1] + 8 * x[2] - x[3]) / (12 * h)
    agree(forces(model, effect, state), -rates.T @ (K @ xi + C @ rates @ v), 1e-8)
    energy = pc.Scene(model).add(effect).simulate(1e-6, state.q, v, t_eval=[0.0]).energy
    assert energy["potential"][0] == pytest.approx(xi @ K @ xi / 2, rel=1e-12)


# Fields ---------------------------------------------------------------------------------------------------------------


def test_gravity(model, state):
    g = np.array([0.3, -1.0, -9.8])
    expected = np.zeros(model.nv)
    for name, body in model.bodies.items():
        J = model.jacobian(name, state.q)
        R, c = model.pose(name, state.q)[:3, :3], body.com
        expected += (J[3:] - np.cross(np.eye(3), c) @ J[:3]).T @ (body.mass * R.T @ g)
    agree(forces(model, E.Gravity(g), state), expected)
    both = pc.Scene(model).add(E.Gravity(g), E.Gravity(-2 * g)).evaluate(state.q, state.v)
    agree(both.vdot, pc.Scene(model).add(E.Gravity(-g)).evaluate(state.q, state.v).vdot, 1e-9)
    agree(both.forces["gravity_2"], -2 * expected)


# Potentials -----------------------------------------------------------------------------------------------------------


POTENTIALS = {
    "gravity": E.Gravity(),
    "point_mass_gravity": E.PointMassGravity(5.0, (3, 2, 4)),
    "gravity_gradient": E.GravityGradient(5.0, (3, 2, 4)),
    "gravity_compensation": E.GravityCompensation(0.7, g=(1, 2, -9)),
    "spring": E.Spring(2.0),
    "implicit_spring": E.ImplicitSpring(2.0, rest=0.3),
    "node_spring": E.NodeSpring("a", "b", 3.0),
    "node_spring with a length": E.NodeSpring("fixed", "b", 3.0, 0.4),
    "bushing": E.Bushing("a", "b", [3, 4, 5, 6, 7, 8]),
    "limits": E.Limits(40.0, lower=-0.3, upper=0.2),
}


@pytest.mark.parametrize("name", POTENTIALS)
def test_forces_are_the_slope_of_the_potential(model, name):
    """Along every coordinate, by differences of order 4."""
    effect, state, h = POTENTIALS[name], model.random_state(11), 1e-3
    scene = pc.Scene(model).add(effect)

    def potential(q):
        return scene.simulate(1e-9, q, np.zeros(model.nv), integrator="rosenbrock4", t_eval=[0.0]).energy["potential"][0]

    slope = np.empty(model.nv)
    for j, e in enumerate(np.eye(model.nv)):
        x = [potential(model.integrate(state.q, i * h * e)) for i in (-2, -1, 1, 2)]
        slope[j] = (x[0] - 8 * x[1] + 8 * x[2] - x[3]) / (12 * h)
    agree(scene.evaluate(state.q, np.zeros(model.nv)).forces[effect.kind()], -slope, 1e-8)


# All ------------------------------------------------------------------------------------------------------------------


def test_the_forces_of_all_effects_are_those_of_the_motion(model, state):
    """Their sum is ℳ v̇ + 𝒞 of the model without gravity, whatever acts."""
    rng = np.random.default_rng(4)
    scene = pc.Scene(model).add(
        *POTENTIALS.values(), E.Damping(0.2), E.QuadraticDamping(0.1), E.CoulombFriction(0.3), E.NodeDamper("a", "b", 1.0)
    )
    scene.add(E.TorqueSource(rng.uniform(-1, 1, model.nv)), E.Motor(0.4, 2.0, 50.0, rotor_inertia=0.1), E.Servo(2.0), E.RotorInertia(0.2))
    scene.add(E.Wrench("b", rng.normal(size=6), axes="a"), E.ImplicitDamping(0.1), E.Prescribed(list(model.hinges)[1], 0.2))
    found = scene.evaluate(state.q, state.v, 0.3)
    gravity, model.gravity = model.gravity, (0, 0, 0)
    agree(sum(found.forces.values()), model.inverse_dynamics(state.q, state.v, found.vdot), 10 * ROUNDING)
    model.gravity = gravity
