"""The forces of effects on whole bodies, fields of gravity and fluids, by their equations written out here."""

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind
from support.oracle import agree
from support.scenes import pushed, speed

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


def of_bodies(model, state, force):
    """Σ over bodies of (moment, force)(mass, com, inertia), in the world's axes at the centre of mass, as generalized forces."""
    total = np.zeros(model.nv)
    for name, body in model.bodies.items():
        X = model.pose(name, state.q)
        moment, push = force(body.mass, (X @ [*body.com, 1])[:3], X[:3, :3] @ body.inertia @ X[:3, :3].T)
        J = model.jacobian(name, state.q, axes="aligned")
        total += J.T @ np.concatenate([moment + np.cross(X[:3, :3] @ body.com, push), push])
    return total


def test_point_mass_gravity(model, state):
    mu, at = 3.0, np.array([4.0, -1.0, 2.0])
    expected = of_bodies(model, state, lambda m, c, _: (np.zeros(3), -mu * m * (c - at) / np.linalg.norm(c - at) ** 3))
    agree(forces(model, E.PointMassGravity(mu, at), state), expected)
    some = list(model.bodies)[:3]
    assert np.abs(forces(model, E.PointMassGravity(mu, at, bodies=some), state) - expected).max() > 1e-3


def test_gravity_compensation(model, state):
    """The whole weight of all, shares of some, and at other points than the centres of mass."""
    g = np.array([0.3, -0.2, -9.0])
    expected = of_bodies(model, state, lambda m, c, _: (np.zeros(3), -m * g))
    agree(forces(model, E.GravityCompensation(g=g), state), expected)
    agree(forces(model, E.GravityCompensation(0.5, g=g), state), 0.5 * expected)
    names, shares, points = [list(model.bodies)[k] for k in (4, 1)], np.array([0.7, -0.4]), np.array([[0.1, 0.2, 0.3], [0.0, -0.5, 0.1]])
    expected = np.zeros(model.nv)
    for name, share, point in zip(names, shares, points, strict=True):  # in the order of the names, not of the bodies
        push = -share * model.bodies[name].mass * g
        turned = model.pose(name, state.q)[:3, :3] @ point
        expected += pushed(model, state, name, np.cross(turned, push), push)
    agree(forces(model, E.GravityCompensation(shares, names, points, g), state), expected)


def test_gravity_that_is_compensated_is_the_models_own(model, state):
    moved = pc.Multibody.from_description(model.description())
    moved.gravity = (0, 0, 0)
    standard = forces(moved, E.GravityCompensation(), state)
    agree(standard, forces(moved, E.GravityCompensation(g=(0, 0, -9.81)), state))
    moved.gravity = (0, 0, -1.62)
    agree(forces(moved, E.GravityCompensation(), state), standard * 1.62 / 9.81)


def test_fluid_drag(model, state):
    """Boxes on bodies and nodes, several on one body: the formulas in each box's axes, at its centre."""
    rho, beta, wind = 3.0, 0.4, np.array([0.5, -1.0, 2.0])
    rng = np.random.default_rng(4)
    names = [list(model.bodies)[2], "a", "b"]
    sizes, placements = rng.uniform(0.1, 0.5, (3, 3)), np.tile(np.eye(4), (3, 1, 1))
    for X in placements:
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        X[:3, :3], X[:3, 3] = turn * np.linalg.det(turn), rng.normal(size=3)
    expected = np.zeros(model.nv)
    for name, size, X in zip(names, sizes, placements, strict=True):
        frame = model.pose(name, state.q)
        R, arm = frame[:3, :3] @ X[:3, :3], frame[:3, :3] @ X[:3, 3]
        motion = speed(model, name, state)
        w, v = R.T @ motion[:3], R.T @ (motion[3:] + np.cross(motion[:3], arm) - wind)
        b, c, d = np.roll(size, -1), np.roll(size, -2), size.mean()
        f = R @ (-0.5 * rho * b * c * np.abs(v) * v - 3 * np.pi * beta * d * v)
        n = R @ (-rho * size * (b**4 + c**4) * np.abs(w) * w / 64 - np.pi * beta * d**3 * w)
        expected += pushed(model, state, name, n + np.cross(arm, f), f)
    agree(forces(model, E.FluidDrag(rho, beta, wind, names, sizes, placements), state), expected)


def test_a_wind_pushes_what_is_at_rest():
    """A plate of 0.2 m² across a wind of 3 m/s, on a slider along it: ½ ρ A u²; without a wind nothing acts."""
    model = pc.Multibody("plate")
    model.add_body("plate", hinge="slider", axis=(1, 0, 0), mass=2.0, inertia=np.eye(3))
    box = dict(bodies=["plate"], sizes=[[0.01, 0.4, 0.5]], placements=[np.eye(4)])
    agree(pc.Scene(model).add(E.FluidDrag(1.2, wind=(3, 0, 0), **box)).evaluate([0.0]).vdot, [0.5 * 1.2 * 0.2 * 9 / 2])
    assert pc.Scene(model).add(E.FluidDrag(1.2, **box)).evaluate([0.0]).vdot[0] == 0


def test_fluid_drag_takes_the_boxes_of_the_bodies():
    """The box with these edges has the inertia that it is found from, turned and off the origin."""
    size, m = np.array([0.2, 0.3, 0.6]), 4.0
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    model, com = pc.Multibody("box"), np.array([0.1, 0.2, 0.3])
    moments = m / 12 * (np.sum(size**2) - size**2)
    model.add_body("box", hinge="free", mass=m, com=com, inertia=turn @ np.diag(moments) @ turn.T)
    model.add_body("frame", "box", hinge="pin", inertia=np.eye(3) * 1e-3, mass=0.0)  # no mass, no box
    state, X = model.random_state(3), np.eye(4)
    X[:3, :3], X[:3, 3] = turn, com
    own = E.FluidDrag(5.0, 0.3, (1, 2, 3))
    given = E.FluidDrag(5.0, 0.3, (1, 2, 3), ["box"], [size], [X])
    agree(forces(model, own, state), forces(model, given, state))


def test_gravity_gradient(model, state):
    mu, at = 3.0, np.array([4.0, -1.0, 2.0])

    def gradient(_, c, inertia):
        r = np.linalg.norm(c - at)
        u = (c - at) / r
        force = 1.5 * mu / r**4 * ((5 * u @ inertia @ u - np.trace(inertia)) * u - 2 * inertia @ u)
        return 3 * mu / r**3 * np.cross(u, inertia @ u), force

    agree(forces(model, E.GravityGradient(mu, at), state), of_bodies(model, state, gradient))


def test_two_terms_of_a_point_masss_gravity_are_those_of_a_dumbbell():
    """Two masses close together: point gravity on each, against point gravity and its gradient on the one body that they are."""
    far, apart, m = np.array([0.0, 0, 50.0]), 0.1, 2.0
    bodies = pc.Multibody("dumbbell")
    bodies.add_body("both", hinge="free", mass=2 * m, inertia=np.diag([0, 2 * m * apart**2, 2 * m * apart**2]))
    q = np.array([0.9, 0.1, 0.4, -0.2, 0.3, 0.2, 0.1])
    scene = pc.Scene(bodies).add(E.PointMassGravity(1e3, far), E.GravityGradient(1e3, far), E.RotorInertia(1.0))  # a line has no inertia
    forces = scene.evaluate(q, np.zeros(6)).forces
    found = forces["point_mass_gravity"] + forces["gravity_gradient"]
    X = bodies.pose("both", q)
    exact = np.zeros(6)
    for side in (-apart, apart):
        r = (X @ [side, 0, 0, 1])[:3] - far
        f = X[:3, :3].T @ (-1e3 * m * r / np.linalg.norm(r) ** 3)
        exact += np.concatenate([np.cross([side, 0, 0], f), f])
    assert np.abs(found - exact).max() < 1e-3 * (apart / 50) ** 2 * np.abs(exact).max()
