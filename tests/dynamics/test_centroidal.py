"""Centre of mass, composite inertia and centroidal momentum against sums over the oracle's bodies, differences in quad, and laws of motion.

Sums over N bodies in another order: 1e-12 of the largest entry. Differences: as in test_sensitivities, states moved in doubles.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft import reference
from support.mechanisms import every_kind, uniform_batch

ROUNDING = 1e-12
MODELS = {
    "every kind": lambda: every_kind(rotor_inertia=True),
    "floating": lambda: pc.tree([-1, 0, 0, 1, 1], ["free", "pin", "ball", "screw", "pin"], seed=1),
    "forest": lambda: pc.tree([-1, -1, 0, 1], ["free", "free", "universal", "slider"], seed=2),
    "chain": lambda: pc.chain(5),
    "one body": lambda: pc.tree([-1], ["ball"], seed=6),
}


@pytest.fixture(scope="module", params=MODELS)
def model(request):
    mb = MODELS[request.param]()
    state = mb.random_state(3)
    mb.q, mb.v = state.q, state.v
    return mb


def close(a, b, tolerance=ROUNDING):
    assert a.shape == np.shape(b)
    assert np.abs(a - b).max(initial=0) <= tolerance * (1 + np.abs(b).max(initial=0))


def by_definition(model, q, v, bodies=None):
    """Mass, centre of mass, its velocity, inertia about it, momentum about it: sums over the oracle's bodies."""
    description = model.description()
    ops = reference.operators(description, q, v)
    parts = []
    for k, body in enumerate(description["bodies"]):
        if bodies is not None and body["name"] not in bodies:
            continue
        X, V = ops.world_pose(k), ops.V[6 * k : 6 * k + 6]
        R, p = X[:3, :3], X[:3, 3]
        c = p + R @ body["com"]
        parts.append((body["mass"], c, R @ (V[3:] + np.cross(V[:3], body["com"])), R @ body["inertia"] @ R.T, R @ V[:3]))
    mass = sum(m for m, *_ in parts)
    centre, velocity = sum(m * c for m, c, *_ in parts) / mass, sum(m * u for m, _, u, *_ in parts) / mass
    inertia, angular = np.zeros((3, 3)), np.zeros(3)
    for m, c, u, own, omega in parts:
        r = c - centre
        inertia += own + m * (r @ r * np.eye(3) - np.outer(r, r))
        angular += own @ omega + m * np.cross(r, u - velocity)
    return mass, centre, velocity, inertia, np.r_[angular, mass * velocity]


def assert_as_defined(model, q, v, expected):
    mass, centre, velocity, inertia, momentum = expected
    close(np.array(model.mass), mass)
    close(model.centre_of_mass(q), centre)
    close(model.centre_of_mass_velocity(q, v), velocity)
    close(model.composite_inertia(q)[:3, :3], inertia)
    close(model.composite_inertia(q)[3:], np.c_[np.zeros((3, 3)), mass * np.eye(3)])
    close(model.centroidal_momentum(q, v).value, momentum)
    frame = np.eye(4)
    frame[:3, 3] = centre
    close(model.centre_of_mass_frame(q), frame)


def test_sums_over_bodies(model):
    assert_as_defined(model, model.q, model.v, by_definition(model, model.q, model.v))


def test_matrices_are_of_the_velocities(model):
    h = model.centroidal_momentum()
    close(h.matrix @ model.v, h.value)
    close(model.centre_of_mass_jacobian() @ model.v, model.centre_of_mass_velocity())
    centre, about_origin = model.centre_of_mass(), model.momentum()
    moved = about_origin.matrix.copy()
    moved[:3] -= np.cross(centre, about_origin.matrix[3:], axisb=0, axisc=0)
    close(h.matrix, moved)


def test_derivatives(model):
    v = np.array(model.v)

    def at(t, along, what):
        q = model.integrate(model.q, t * along)
        return getattr(model.centroidal_momentum(q, v, precision="quad"), what)

    def difference(along, what, h=2.0**-10):
        f = [at(s * h, along, what) for s in (1, -1, 2, -2)]
        return (8 * (f[0] - f[1]) - (f[2] - f[3])) / (12 * h)

    h = model.centroidal_momentum()
    close(h.matrix_dot, difference(v, "matrix"), 2e-10)
    close(h.dq, np.stack([difference(e, "value") for e in np.eye(model.nv)], axis=1), 2e-10)
    if not any(kind in ("free", "ball") for hinge in model.hinges.values() for kind in [s["kind"] for s in hinge.subhinges]):
        jacobian = [
            (model.centre_of_mass(model.integrate(model.q, 1e-5 * e)) - model.centre_of_mass(model.integrate(model.q, -1e-5 * e))) / 2e-5
            for e in np.eye(model.nv)
        ]
        close(model.centre_of_mass_jacobian(), np.stack(jacobian, axis=1), 1e-9)


def test_what_floats_keeps_its_momentum_and_falls():
    """ḣ = A v̇ + Ȧ v is zero without gravity, with it (0; m g), whatever the hinges do."""
    mb = pc.tree([-1, 0, 0, 1, 1], ["free", "pin", "ball", "screw", "universal"], seed=1)
    state, tau = mb.random_state(4), np.random.default_rng(2).normal(size=mb.nv)
    tau[:6] = 0
    for gravity in [(0, 0, 0), (1, 2, -9.8)]:
        mb.gravity = gravity
        h = mb.centroidal_momentum(state)
        rate = h.matrix @ mb.forward_dynamics(state, tau=tau) + h.matrix_dot @ state.v
        assert np.abs(rate - np.r_[np.zeros(3), mb.mass * np.array(gravity)]).max() < 1e-11 * (1 + np.abs(h.matrix_dot @ state.v).max())


def test_neither_place_nor_travel_takes_digits():
    """Moved by 2²⁷ m along x and by 2¹³ m/s, both exact beside the state's own doubles: what is about the centre of mass keeps its bits
    up to rounding of the state."""
    mb = pc.tree([-1, 0, 0, 1], ["free", "pin", "ball", "pin"], seed=3)
    state = mb.random_state(1)
    q, v = np.array(state.q), np.array(state.v)
    q[:4], q[4:7], v[3:6] = (1, 0, 0, 0), 0, 0
    far, fast = q.copy(), v.copy()
    far[4], fast[3] = 2.0**27, 2.0**13
    near, away = mb.centroidal_momentum(q, v), mb.centroidal_momentum(far, fast)
    for what in ("matrix", "matrix_dot"):
        close(getattr(away, what), getattr(near, what), 1e-15)
    close(away.value[:3], near.value[:3], 1e-15)
    close(mb.composite_inertia(far), mb.composite_inertia(q), 1e-15)


def test_batches_precisions_and_threads(model):
    Q, V = uniform_batch(model, 5)
    h, wide = model.centroidal_momentum(Q, V), model.centroidal_momentum(Q, V, precision="quad")
    for b in range(5):
        one = model.centroidal_momentum(Q[b], V[b])
        assert all(np.array_equal(all_of[b], of_one) for all_of, of_one in zip(h, one, strict=True))
    for double, quad in zip(h, wide, strict=True):
        close(double, quad)
    shared = model.centroidal_momentum(Q, V, threads=2)
    assert all(np.array_equal(a, b) for a, b in zip(h, shared, strict=True))
    none = model.centroidal_momentum(Q[:0], V[:0])
    assert none.value.shape == (0, 6) and none.matrix.shape == none.matrix_dot.shape == none.dq.shape == (0, 6, model.nv)
    assert model.centre_of_mass(Q[:0]).shape == (0, 3) and model.composite_inertia(Q[:0]).shape == (0, 6, 6)
    assert model.centre_of_mass_jacobian(Q).shape == (5, 3, model.nv) and model.centre_of_mass_frame(Q).shape == (5, 4, 4)


def test_of_a_part():
    """Of a part whose base moves: sums over its bodies where the whole has them; of one that is fixed, as if it were alone."""
    mb = every_kind(rotor_inertia=True)
    mb.gravity = (0.3, -0.2, -9.8)
    state = mb.random_state(5)
    for options in [{"root": "body1"}, {"root": "body4"}, {"bodies": ["body0", "body2"]}]:
        part = mb.subgraph(**options, base="moving")
        own, names = part.state_of(state), list(part.bodies)
        expected = by_definition(mb, state.q, state.v, names)
        assert_as_defined(part, own.q, own.v, expected)
        close(part.potential_energy(own.q), -expected[0] * (mb.gravity @ expected[1]))
    legs = [mb.subgraph(root=root, base="moving") for root in ("body1", "body2")]
    rest = mb.subgraph(root="body0", without=["body1", "body2"])
    everything = [*legs, rest]
    close(sum(p.mass * p.centre_of_mass(p.state_of(state).q) for p in everything) / mb.mass, mb.centre_of_mass(state))
    close(sum(p.centroidal_momentum(p.state_of(state)).value[3:] for p in everything), mb.centroidal_momentum(state).value[3:])


def test_no_mass_no_centre():
    mb = pc.Multibody("frame")
    mb.add_body("empty", hinge="pin")
    mb.add_body("full", "empty", hinge="pin", mass=1.0, inertia=np.eye(3))
    part = mb.subgraph(bodies=["empty"])
    for call in (part.centre_of_mass, part.centre_of_mass_frame, part.centre_of_mass_velocity, part.centre_of_mass_jacobian,
                 part.composite_inertia, part.centroidal_momentum):  # fmt: skip
        with pytest.raises(pc.ModelError, match="'frame/empty' has no mass and so no centre of mass"):
            call()
    assert part.kinetic_energy() == 0 and mb.centre_of_mass().shape == (3,)


@pytest.mark.parametrize("given", [(np.zeros(2),), (np.full(5, np.nan),), (np.zeros(5), np.zeros(4))], ids=["size", "nan", "v"])
def test_bad_states(given):
    with pytest.raises(pc.ModelError, match="q|v"):
        pc.chain(5).centroidal_momentum(*given)
