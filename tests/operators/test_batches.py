"""Batches of states: whatever is asked of an expression at a batch is what is asked at each state, to the last bit."""

import copy

import numpy as np
import pytest

import pycraft as pc
from campaigns import batches
from support.mechanisms import every_kind, uniform_batch

STATES = 4


@pytest.mark.parametrize("first", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(40, 400, 40))])
def test_random_expressions(first):
    """Every request of expressions drawn at random, many of which theorems make independent of the state."""
    found = [line for seed in range(first, first + 40) for line in batches.check(seed)[1]]
    assert not found, "\n".join(found)


@pytest.fixture(scope="module")
def batch():
    model = every_kind()
    return model, *uniform_batch(model, STATES)


CANCELLING = {
    "(I+HφK)(I-HψK)": lambda soa: (soa.I + soa.H @ soa.phi @ soa.K) @ (soa.I - soa.H @ soa.psi @ soa.K),
    "DD⁻¹": lambda soa: soa.D @ soa.D.inv(),
    "0φ": lambda soa: 0 * soa.phi,
    "ψ⁻¹+E_ψ": lambda soa: soa.psi.inv() + soa.E_psi,
    "blockdiag φ": lambda soa: pc.blockdiag(soa.phi),
}


@pytest.mark.parametrize("rules", [True, False])
@pytest.mark.parametrize("name", CANCELLING)
def test_what_hangs_on_no_state_fills_its_batch(batch, name, rules):
    model, Q, V = batch
    e = CANCELLING[name](model.soa)
    n = len(e.domain)
    exact = np.zeros((n, n)) if name == "0φ" else np.eye(n)
    bound = e.at(Q, V)
    assert np.abs(bound.dense(rules=rules) - exact).max() < 1e-6 and bound.dense(rules=rules).shape == (STATES, n, n)
    assert np.abs(bound @ np.ones(n) - exact.sum(1)).max() < 1e-6
    assert np.shape(bound.trace()) == np.shape(bound.norm()) == (STATES,)
    assert np.abs(np.asarray(bound.trace()) - np.trace(exact)).max() < 1e-6
    assert bound.diagonal().shape == (STATES, n)


def test_zeros_identities_and_constants_have_the_batch(batch):
    model, Q, _ = batch
    Theta = model.soa.Theta
    n = len(Theta)
    leaves = [pc.zero(Theta, Theta), pc.identity(Theta), pc.constant(np.eye(n), Theta, Theta), pc.constant(np.eye(2), 2, 2)]
    for leaf in leaves:
        assert leaf.at(Q).batch == STATES and leaf.at(Q).dense().shape == (STATES, *leaf.shape)
        assert leaf.at(Q) == leaf and leaf.at(Q).T.batch == STATES
        assert leaf.at(Q[0]).batch is None and leaf.at(Q[0]).dense().shape == leaf.shape
    T = pc.vector("T", Theta).at(Q)
    assert np.array_equal(T.value(T=np.arange(n)), np.tile(np.arange(n, dtype=float), (STATES, 1)))
    assert copy.deepcopy(leaves[3].at(Q)).batch == STATES


def test_the_innermost_binding_wins_over_what_hangs_on_no_state(batch):
    model, Q, V = batch
    D, I = model.soa("D I")
    inner = D.at(Q, V) + I
    assert np.array_equal(inner.at(Q[:2], V[:2]).dense(), inner.dense())
    with pytest.raises(pc.EvaluationError, match="batches of"):
        (D.at(Q, V) + model.soa.J.at(Q[:2], V[:2])).dense()


def test_derivatives_that_vanish_keep_the_batch():
    chain = pc.chain(4)
    Q = np.linspace(-1, 1, 12).reshape(3, 4)
    H, phi, M, R = chain.soa("H phi M R")
    MM = H @ phi @ M @ phi.T @ H.T
    for derivative in (MM.diff(0).at(Q), MM.at(Q).diff(0), (M @ M.inv()).at(Q).diff(1), pc.constant(np.eye(2), 2, 2).at(Q).diff(0)):
        assert derivative.dense().shape == (3, *derivative.shape) and not derivative.dense().any()
    for derivative in (MM.logdet().diff(0).at(Q), MM.logdet().at(Q).diff(0), MM.trace().at(Q).diff(0), M.logdet().at(Q).diff(1)):
        assert np.array_equal(np.asarray(derivative), np.zeros(3))
    partly = (M.at(Q) + R).diff(3)  # what is left of it is bound to nothing
    assert partly.batch == 3 and partly.dense().shape == (3, *partly.shape)
    assert (R @ R.inv() @ M).at(Q).simplify().dense().shape == (3, *M.shape)


def test_an_empty_batch_is_empty(batch):
    model, Q, V = batch
    for make in CANCELLING.values():
        e = make(model.soa).at(Q[:0], V[:0])
        assert e.dense().shape == (0, *e.shape) and np.asarray(e.trace()).shape == (0,)
        assert (e @ np.ones(e.shape[1])).shape == (0, e.shape[0])


@pytest.mark.parametrize("seed", [0, 5])
def test_what_one_state_asks_of_an_elimination_is_not_kept(seed):
    """N + N* + D - C: where C is D every pivot block but the first is zero and fronts are merged; at the states after it they are not."""
    arm = pc.chain(6, seed=seed)
    H, E, G, D = arm.soa("H E G D")
    bent = np.random.default_rng(0).uniform(-1, 1, (2, 6))
    C = pc.constant(D.at(bent[0]).dense(), D.domain, D.codomain)
    N = H @ E @ G if seed else H @ E @ G @ D
    e = (N + N.T + D - C).inv()
    Q, x = bent[[1, 0, 1, 0]], np.ones(6)
    together = e.at(Q) @ x
    for q, row in zip(Q, together, strict=True):
        assert np.array_equal(e.at(q) @ x, row)
