"""Parts of models: a part is, bit for bit, the same bodies as a model of their own, and shares parameters and state with the whole.

The model of their own (support.parts.alone) is made from the description. What relates a part to the whole (blocks of φ and ℳ, forces
at hinges of a part whose base moves) holds to rounding: both sides sum the same products in another order, 1e-12 of the largest at these
sizes.
"""

import numpy as np
import pytest

from pycraft import reference
from support.mechanisms import every_kind, random_tree, uniform_batch
from support.parts import alone, index_of, names_of

ROUNDING = 1e-12


def close(a, b):
    assert np.shape(a) == np.shape(b)
    assert np.abs(a - b).max(initial=0) <= ROUNDING * (1 + np.abs(b).max(initial=0))


def same(a, b):
    assert np.array_equal(np.asarray(a), np.asarray(b))


def sample(seed):
    """A random forest, and the names of a connected set of its bodies."""
    rng = np.random.default_rng(seed)
    model = random_tree(rng, int(rng.integers(2, 9)))
    parents = [model._body(k)["parent"] for k in range(len(model.bodies))]
    chosen = names_of(parents, rng, int(rng.integers(1, len(parents) + 1)))
    return model, [list(model.bodies)[k] for k in chosen]


def test_an_outboard_part_is_the_body_with_its_hinge_and_all_outboard():
    model = every_kind()
    part = model.subgraph(root="body1")
    assert list(part.bodies) == [name for name in model.bodies if name in alone_outboard(model, "body1")]
    assert list(part.hinges)[0] == "hinge1" and part.bodies["body1"].parent is None
    assert type(part) is type(model) and part.whole is model and part.carrier.name == model.bodies["body1"].parent.name


def alone_outboard(model, root):
    found = {root}
    for name, body in model.bodies.items():
        if body.parent is not None and body.parent.name in found:
            found.add(name)
    return found


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("base", ["fixed", "moving"])
def test_every_call_is_that_of_the_bodies_alone(seed, base):
    model, bodies = sample(seed)
    part, other = model.subgraph(bodies=bodies, base=base), alone(model, bodies, base == "moving")
    assert part.nq == other.nq and part.nv == other.nv and part.coordinate_names == other.coordinate_names
    (Q, V), rng = uniform_batch(other, 3, seed), np.random.default_rng(seed)
    A = rng.normal(size=(3, other.nv))
    for q, v, a in [(Q[0], V[0], A[0]), (Q, V, A), (Q[:0], V[:0], A[:0])]:
        same(part.inverse_dynamics(q, v, a), other.inverse_dynamics(q, v, a))
        same(part.mass_matrix(q), other.mass_matrix(q))
        same(part.bias_forces(q, v), other.bias_forces(q, v))
        same(part.coriolis_matrix(q, v), other.coriolis_matrix(q, v))
        same(part.jacobian(bodies[-1], q), other.jacobian(bodies[-1], q))
        same(part.potential_energy(q), other.potential_energy(q))
        same(part.inverse_dynamics_derivatives(q, v, a).q, other.inverse_dynamics_derivatives(q, v, a).q)
        same(part.mass_matrix_derivative(q), other.mass_matrix_derivative(q))
        if base == "fixed":
            for form in ("fast", "ud", "square-root"):
                same(part.forward_dynamics(q, v, a, form=form), other.forward_dynamics(q, v, a, form=form))
            same(part.forward_dynamics(q, v, a, precision="quad"), other.forward_dynamics(q, v, a, precision="quad"))
            same(part.mass_matrix_inverse(q), other.mass_matrix_inverse(q))


@pytest.mark.parametrize("seed", range(6))
def test_every_operator_is_that_of_the_bodies_alone(seed):
    model, bodies = sample(seed)
    part, other = model.subgraph(bodies=bodies), alone(model, bodies)
    Q, V = uniform_batch(other, 2, seed)
    for name in "E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi Upsilon Omega MM".split():
        mine, theirs = part.soa(name), other.soa(name)
        same(mine.at(Q[0], V[0]).dense(), theirs.at(Q[0], V[0]).dense())
        same(mine.at(Q, V).dense(), theirs.at(Q, V).dense())
        same(mine.at(Q[0], V[0], precision="quad").dense(), theirs.at(Q[0], V[0], precision="quad").dense())
    if part.nv:
        same(part.soa.MM.at(Q[0]).diff(0).dense(), other.soa.MM.at(Q[0]).diff(0).dense())
        same(part.soa.MM.at(Q[0]).logdet().gradient(), other.soa.MM.at(Q[0]).logdet().gradient())
        assert part.soa.check()


@pytest.mark.parametrize("seed", range(8))
def test_blocks_of_the_whole(seed):
    """φ, E, M, H of any connected set are blocks of the whole's; of all outboard of a body R, ψ, P, D, ℳ as well."""
    model, bodies = sample(seed)
    part, q = model.subgraph(bodies=bodies), model.random_state(seed).q
    rows = np.concatenate([np.arange(6 * k, 6 * k + 6) for k, name in enumerate(model.bodies) if name in bodies])
    columns = index_of(model, bodies, "v")
    same(part.v_index, columns)
    same(part.q_index, index_of(model, bodies, "q"))
    outboard = set(bodies) == alone_outboard(model, bodies[0])
    for name in ("E phi M H R psi P D MM" if outboard else "E phi M H").split():
        of_whole, own = model.soa(name).at(q).dense(), part.soa(name).at(part.q_of(q)).dense()
        left = columns if name in ("H", "D", "MM") else rows
        right = columns if name in ("D", "MM") else rows
        close(own, of_whole[np.ix_(left, right)])


def test_the_oracle_has_the_same_numbers():
    model = every_kind(rotor_inertia=True)
    bodies = alone_outboard(model, "body1")
    part, state = model.subgraph(root="body1"), model.random_state(3)
    description, own = alone(model, bodies).description(), part.state_of(state)
    vdot = np.random.default_rng(0).normal(size=part.nv)
    close(part.mass_matrix(own.q), reference.mass_matrix(description, own.q))
    close(part.inverse_dynamics(own.q, own.v, vdot), reference.inverse_dynamics(description, own.q, own.v, vdot))
    close(part.forward_dynamics(own.q, own.v, vdot), reference.forward_dynamics(description, own.q, own.v, vdot))
    close(part.kinetic_energy(own), reference.kinetic_energy(description, own.q, own.v))


def test_the_whole_is_one_of_its_parts():
    model = every_kind(rotor_inertia=True)
    part, state = model.subgraph(), model.random_state(2)
    assert list(part.bodies) == list(model.bodies) and list(part.nodes) == list(model.nodes)
    tau = np.arange(model.nv) / 10
    same(part.forward_dynamics(state, tau=tau), model.forward_dynamics(state, tau=tau))
    same(part.soa.psi.at(state).dense(), model.soa.psi.at(state).dense())
    assert model.whole is None and np.shares_memory(part.q, model.q)
    same(model.q_of(state), state.q)


@pytest.mark.parametrize("root", ["body0", "body1", "body2", "body4"])
def test_a_moving_base_is_the_carriers_motion(root):
    """Forces at the hinges of all outboard of a body are the whole's; before them stands what carries it: the carrier's interbody force."""
    model = every_kind(rotor_inertia=True)
    part = model.subgraph(root=root, base="moving")
    Q, V = uniform_batch(model, 3, 7)
    A = np.random.default_rng(1).normal(size=(3, model.nv))
    for q, v, a in [(Q, V, A), (Q[0], V[0], A[0]), (Q[:0], V[:0], A[:0])]:
        forces = part.inverse_dynamics(part.state_of(q, v), vdot=part.accelerations_of(a, q, v))
        close(forces[..., 6:], model.inverse_dynamics(q, v, a)[..., part.v_index])
    model.q, model.v = Q[1], V[1]
    own = part.state_of()
    close(part.q, own.q)
    close(part.v, own.v)
    close(part.pose(root), model.pose(root))
    close(part.jacobian(root) @ part.v, model.jacobian(root) @ model.v)
    base = [np.zeros(6) if part.carrier is None else model.jacobian(part.carrier.name) @ model.v]
    velocities = base + [model.jacobian(name) @ model.v for name in list(part.bodies)[1:]]
    close(part.soa.velocity.dense()[:, 0], np.concatenate(velocities))
