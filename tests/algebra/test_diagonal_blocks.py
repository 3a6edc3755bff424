"""blockdiag(...) of random products of letters, with theorems and without, against dense NumPy."""

import numpy as np
import pytest

import pycraft as pc
from support.formulas import blocks_only

LETTERS = "E phi phi_tilde H M P P_plus D G K tau tau_bar E_psi psi psi_tilde R Upsilon"
KINDS = ["free", "pin", "ball", "universal", "slider", "pin"]
TREES = {"chain": [-1, 0, 1, 2], "branched": [-1, 0, 0, 1], "two roots": [-1, 0, 0, 1, 1, -1]}


def letters(model):
    """(operator, dense) of every letter, its transpose and, where it has one, its inverse."""
    found = []
    for name, op in zip(LETTERS.split(), model.soa(LETTERS), strict=True):
        value = op.dense()
        found += [(op, value), (op.T, value.T)]
        if name in ("phi", "psi", "D"):
            inverse = np.linalg.inv(value)
            found += [(op.inv(), inverse), (op.T.inv(), inverse.T)]
    return found


def random_product(known, rng):
    op, value = known[rng.integers(len(known))]
    for _ in range(rng.integers(1, 6)):
        fitting = [(o, v) for o, v in known if o.codomain == op.domain]
        factor, own = fitting[rng.integers(len(fitting))]
        op, value = op @ factor, value @ own
    return op, value


def assert_blocks(op, value):
    expected = blocks_only(value, op.codomain.blocks, op.domain.blocks)
    for rules in (True, False):
        found = pc.blockdiag(op).dense(rules=rules)
        assert np.abs(found - expected).max(initial=0) <= 1e-10 * max(1.0, np.abs(value).max(initial=0)), (op.text(), rules)


def at_a_state(parents, kinds, seed=1):
    model = pc.tree(parents, kinds, seed=seed)
    model.q = model.random_state(0).q
    return model


@pytest.mark.parametrize("tree", TREES)
@pytest.mark.parametrize("kinds", ["pin", "universal", "mixed"])
def test_random_products(tree, kinds):
    parents = TREES[tree]
    known = letters(at_a_state(parents, KINDS[: len(parents)] if kinds == "mixed" else kinds))
    rng = np.random.default_rng(0)
    for _ in range(40):
        assert_blocks(*random_product(known, rng))


@pytest.mark.slow
@pytest.mark.parametrize("tree", TREES)
@pytest.mark.parametrize("seed", range(4))
def test_many_random_products(tree, seed):
    parents = TREES[tree]
    known = letters(at_a_state(parents, "universal" if seed % 2 else KINDS[: len(parents)], seed))
    rng = np.random.default_rng(seed)
    for _ in range(500):
        assert_blocks(*random_product(known, rng))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("parents", [[-1, 0], *TREES.values()], ids=["pair", *TREES])
def test_what_cancels_is_no_pivot(parents, seed):
    """In φRφ*⁻¹ the pivot of a body that is not a leaf is M = R - ERE*: where M has a zero, rounding is left, and it has no scale."""
    model = at_a_state(parents, "universal", seed)
    phi, psi, R, M, E, tau, P, tilde = model.soa("phi psi R M E tau P phi_tilde")
    for op in (
        phi @ R @ phi.T.inv(),
        phi @ R @ psi.T.inv(),
        psi @ R @ psi.T.inv(),
        E @ M @ phi.T.inv() @ tau.T @ phi.T.inv(),
        tilde @ P @ E.T @ tilde.T @ phi.T.inv(),
    ):
        assert_blocks(op, op.dense(rules=False))
