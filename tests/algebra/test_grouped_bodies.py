"""Operators over other bodies that share a space, bodies grouped in pairs and the robot's own: every pair of letters, against NumPy."""

import itertools

import numpy as np
import pytest

import pycraft as pc

NAMES = "E phi phi_tilde H M J P P_plus D G K tau tau_bar E_psi psi psi_tilde R Upsilon Omega".split()


@pytest.fixture(scope="module", params=[False, True], ids=["no rotors", "rotors"])
def letters(request):
    """(letters of the pairs, letters of the robot): {name: (operator, dense)}."""
    model = pc.tree([-1, 0, 0, 1, 1], ["free", "pin", "ball", "universal", "slider"], seed=2, rotor_inertia=request.param)
    model.q = model.random_state(2).q
    theorem = next(t for t in model.soa.theorems() if t.name == "bodies grouped in pairs: the same mass matrix")
    grouped = theorem.lhs.sources[0]
    both = ({n: grouped.symbol(n) for n in NAMES}, dict(zip(NAMES, model.soa(" ".join(NAMES)), strict=True)))
    return [{name: (op, op.dense()) for name, op in own.items()} for own in both]


def with_transposes(known):
    for op, value in known.values():
        yield op, value
        yield op.T, value.T


def assert_equal(found, expected, op):
    assert np.abs(found - expected).max(initial=0) <= 1e-9 * max(1.0, np.abs(expected).max(initial=0)), op.text()


def test_letters_of_pairs_are_other_letters(letters):
    pairs, own = letters
    assert pairs["H"][0].codomain == own["H"][0].codomain and pairs["H"][0].domain != own["H"][0].domain
    assert pairs["D"][0].shape == own["D"][0].shape and not np.allclose(pairs["D"][1], own["D"][1])


@pytest.mark.parametrize("rules", [True, False])
def test_products_and_sums(letters, rules):
    """A B and A + B of every two letters whose spaces fit, one of each."""
    tried = 0
    for first, second in itertools.product(with_transposes(letters[0]), with_transposes(letters[1])):
        for (a, x), (b, y) in ((first, second), (second, first)):
            if a.domain == b.codomain:
                assert_equal((a @ b).dense(rules=rules), x @ y, a @ b)
                tried += 1
        (a, x), (b, y) = first, second
        if a.domain == b.domain and a.codomain == b.codomain:
            assert_equal((a + 2 * b).dense(rules=rules), x + 2 * y, a + b)
            tried += 1
    assert tried > 50


@pytest.mark.parametrize("rules", [True, False])
def test_inverses_and_what_is_asked_of_the_whole(letters, rules):
    """(D_pairs + B)⁻¹, blockdiag, trace, diagonal and ln det of what has letters of both."""
    (D, x), own = letters[0]["D"], letters[1]
    H, phi, M = (letters[0][n] for n in ("H", "phi", "M"))
    pairs = H[0] @ phi[0] @ M[0] @ phi[0].T @ H[0].T, H[1] @ phi[1] @ M[1] @ phi[1].T @ H[1].T
    one = pc.identity(D.domain), np.eye(len(x))
    for b, y in (own["D"], own["J"], pairs, one):
        for op, value in ((D + b, x + y), (D @ (b + one[0]), x @ (y + one[1])), (pairs[0] + D @ b @ D, pairs[1] + x @ y @ x)):
            assert_equal(op.inv().dense(rules=rules), np.linalg.inv(value), op)
            assert_equal(op.diagonal(), np.diag(value), op)
            assert_equal(float(op.trace()), np.trace(value), op)
            assert_equal(float(op.logdet()), np.linalg.slogdet(value)[1], op)
            body = np.zeros(len(value), int)  # of the first operand's model: Θ is cut into its bodies
            for _, rows, k in op.codomain.blocks:
                body[rows] = k
            blocks = np.where(body[:, None] == body, value, 0.0)
            if op.domain.bodies == op.codomain.bodies:  # else rows are cut in one way, columns in another
                assert_equal(pc.blockdiag(op).dense(rules=rules), blocks, op)
            assert_equal(float(op.inv().logdet()), -np.linalg.slogdet(value)[1], op)


def test_what_has_no_blocks_in_common_is_refused(letters):
    H, D = letters[0]["H"][0], letters[0]["D"][0]
    assert_equal(pc.blockdiag(H).dense(), letters[0]["H"][1], H)
    assert_equal((D.sqrt() @ D.sqrt().T).dense(), letters[0]["D"][1], D)
    with pytest.raises(pc.SpaceError, match="not cut into the same bodies"):
        pc.blockdiag(D @ letters[1]["H"][0])
    with pytest.raises(pc.SpaceError, match="symmetric block-diagonal"):
        (D + letters[1]["D"][0]).sqrt()
    zero = letters[0]["H"][0] - letters[0]["H"][0]
    assert_equal((zero + H).dense(), H.dense(), H)
    assert_equal((zero.T @ H).dense(), np.zeros((H.shape[1], H.shape[1])), H)


def test_two_frames_are_not_one():
    """E X E* is block diagonal where both are one letter; E of the model and of the world frame, or of two states, are two."""
    model = pc.tree([-1, 0, 1, 1], ["pin", "universal", "pin", "ball"], seed=3)
    other = model.random_state(4).q
    model.q = model.random_state(3).q
    E, M = model.soa("E M")
    moved = E.at(other)
    for one, two in ((E, moved), (moved, E)):
        op, value = one @ M @ two.T, one.dense() @ M.dense() @ two.dense().T
        for rules in (True, False):
            assert_equal(op.dense(rules=rules), value, op)
            assert_equal(pc.blockdiag(op).dense(rules=rules), value, op)
            assert_equal(float(op.norm()), np.linalg.norm(value), op)
