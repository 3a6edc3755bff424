"""Each rule of differentiation where no term of it vanishes: J ≠ 0, hinges of several coordinates, blocks that are not symmetric.

Small and quick beside test_calculus, of which the everyday subset has the first derivatives of a few letters only. Differences and
tolerance are those of `differences`, as there.
"""

import numpy as np
import pytest

import pycraft as pc
from support.differences import along, assert_close, difference, numbers, value


@pytest.fixture(scope="module")
def model():
    """A pin, a pin-slider-pin, a ball and a screw, rotors on the first three, branched."""
    mb = pc.tree([-1, 0, 1, 1], ["pin", "custom", "ball", "screw"], seed=8)
    for hinge, inertia in (("hinge0", 0.3), ("hinge1", [0.2, 0.5, 0.1]), ("hinge2", [0.4, 0.1, 0.3])):
        mb.hinges[hinge].rotor_inertia = inertia
    state = mb.random_state(1)
    mb.q, mb.v, mb.gravity = np.round(state.q * 2**20) / 2**20, state.v, (1, 2, -9.81)
    return mb


LETTERS = ["P", "P_plus", "D", "G", "K", "tau_bar", "E_psi", "psi", "Upsilon", "Omega"]


@pytest.mark.parametrize("name", LETTERS)
def test_along_a_rotor_inertia(name, model):
    """∂J enters through G ∂J G*, and through D."""
    hinge, op = model.hinges["hinge1"], getattr(model.soa, name)
    before = hinge.rotor_inertia

    def moved(t):
        hinge.rotor_inertia = before + t * np.eye(3)[1]
        return value(op, model.q, model.v)

    expected = difference(moved)
    hinge.rotor_inertia = before
    assert np.abs(expected).max() > 1e-3
    assert_close(numbers(op.diff(hinge.symbol("rotor_inertia", 1)), model.q, model.v), expected, name)


@pytest.mark.parametrize("name", ["P", "D", "Upsilon", "Omega"])
def test_along_coordinates_of_several_subhinges(name, model):
    op = getattr(model.soa, name)
    for i in range(1, model.nv):
        assert_close(numbers(op.diff(i), model.q, model.v), along(model, op, i, model.q, model.v), f"∂_{i} {name}")


def unsymmetric(domain, codomain, model, seed):
    """Random blocks on the diagonal."""
    rng, n = np.random.default_rng(seed), domain.dimension
    entries, at = np.zeros((n, n)), 0
    for _ in model.bodies:
        entries[at : at + 6, at : at + 6] = rng.normal(size=(6, 6))
        at += 6
    return pc.constant(entries, domain, codomain)


@pytest.mark.parametrize("resolvent", ["phi", "psi"])
@pytest.mark.parametrize("transposed", [False, True])
def test_block_diagonals_of_what_is_not_symmetric(resolvent, transposed, model):
    """∂ blockdiag(AXA*): FY τ̄* and τ̄ Y F* are two terms, not one and its transpose."""
    soa = model.soa
    A = getattr(soa, resolvent).T if transposed else getattr(soa, resolvent)
    X = unsymmetric(A.domain.dual, A.domain, model, 3)
    op = pc.blockdiag(A @ X @ A.T)
    dense = op.dense()
    assert np.abs(dense - dense.T).max() > 0.1
    for i in (1, 3, 5):
        assert_close(numbers(op.diff(i), model.q, model.v), along(model, op, i, model.q, model.v), f"∂_{i}")


@pytest.mark.parametrize("name", ["H", "E", "D"])
def test_second_derivatives_within_one_hinge(name, model):
    """A coordinate moves the twists of the subhinges inboard of its own, and not its own."""
    op = getattr(model.soa, name)
    for i, j in [(1, 1), (1, 3), (3, 1), (3, 3), (4, 5), (5, 5)]:
        expected = along(model, op.diff(i), j, model.q, model.v)
        assert_close(numbers(op.diff(i, j), model.q, model.v), expected, f"∂_{j}∂_{i} {name}")


def test_twists_within_one_hinge(model):
    for i, j in [(1, 1), (1, 2), (1, 3), (3, 1), (3, 3), (5, 5)]:
        op = model.soa.Delta(i)
        assert_close(numbers(op.diff(j), model.q, model.v), along(model, op, j, model.q, model.v), f"∂_{j}Δ_{i}")


def test_along_time_with_rotors(model):
    vdot = np.random.default_rng(0).normal(size=model.nv)
    for name in ("P", "H_dot", "b"):
        op = getattr(model.soa, name)
        expected = difference(lambda t, op=op: value(op, model.integrate(model.q, t * model.v), model.v + t * vdot))
        assert_close(numbers(op.dot(vdot=vdot), model.q, model.v), expected, f"d{name}/dt")


def steps(op):
    return [step["kind"] for step in op.plan("apply").program["steps"]]


@pytest.mark.parametrize("name", ["R", *LETTERS])
@pytest.mark.parametrize("coordinates", [(1,), (1, 3), (1, 3, 6)])
def test_derivatives_of_sweeps_are_sweeps(name, coordinates, model):
    """However often: ∂P, of which E X E* is a part, is swept like P, so that nothing is eliminated and nothing made dense."""
    found = steps(getattr(model.soa, name).diff(*coordinates))
    assert "lyapunov_blocks" in found
    assert not {"factor", "selected_blocks", "solve", "dense_factor", "blocks_of_dense"}.intersection(found)


@pytest.mark.parametrize("resolvent", ["phi", "psi"])
def test_second_derivatives_of_what_is_swept_from_parents(resolvent, model):
    """blockdiag(A (X + E Y E*) A*) with X and Y that are not symmetric."""
    soa = model.soa
    A, E = getattr(soa, resolvent), soa.E
    X, Y = (unsymmetric(A.domain.dual, A.domain, model, seed) for seed in (3, 4))
    op = pc.blockdiag(A @ (X + E @ Y @ E.T) @ A.T)
    alone = pc.blockdiag(A @ E @ Y @ E.T @ A.T)
    assert "lyapunov_blocks" in steps(alone) and "factor" not in steps(alone)
    for e in (op, alone):
        assert np.abs(e.dense() - e.dense().T).max() > 0.1
        for i, j in ((1, 3), (3, 1), (5, 5)):
            assert_close(numbers(e.diff(i, j), model.q, model.v), along(model, e.diff(i), j, model.q, model.v), f"∂_{j}∂_{i}")
