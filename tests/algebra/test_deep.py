"""Expressions nested ten thousand levels deep, and parts shared so often that written out they would fill the universe."""

import copy
import pickle
import time

import numpy as np
import pytest

import pycraft as pc

LEVELS = 10_000


@pytest.fixture(scope="module")
def soa():
    return pc.chain(3, seed=1).soa


def nest(e, step, levels=LEVELS):
    for _ in range(levels):
        e = step(e)
    return e


NESTS = {
    "transposes": lambda soa: nest(soa.D, lambda e: e.T),
    "multiples": lambda soa: nest(soa.D, lambda e: 1.0001 * e),
    "sums within multiples": lambda soa: nest(soa.D, lambda e: 0.5 * (e + soa.D)),
    "sums within transposes": lambda soa: nest(soa.D + soa.J, lambda e: (0.5 * e + soa.D).T),
    "inverses": lambda soa: nest(soa.D, lambda e: e.inv()),
    "block diagonals": lambda soa: nest(soa.phi, lambda e: pc.blockdiag(0.5 * e + soa.phi)),
    "flat sums": lambda soa: nest(soa.D, lambda e: e + soa.D, 3000),
    "flat products": lambda soa: nest(soa.tau, lambda e: e @ soa.tau, 3000),
    "products with sums": lambda soa: nest(soa.tau, lambda e: (0.5 * e + soa.I) @ soa.tau, 3000),
    "I alone": lambda soa: nest(soa.I, lambda e: (0.9999 * e).T) @ pc.identity(soa.Theta),
}


EVERY_DAY = "sums within multiples"


@pytest.mark.parametrize("name", [n if n == EVERY_DAY else pytest.param(n, marks=pytest.mark.slow) for n in NESTS])
def test_everything_works_at_any_depth(soa, name):
    e, twin = NESTS[name](soa), NESTS[name](soa)
    assert e == twin and hash(e) == hash(twin)
    assert e.shape[0] != e.shape[1] or e != twin.T.T.inv()
    assert len(repr(e)) < 1000 and str(e) and (e._repr_latex_() is None or len(e._repr_latex_()) < 30000)
    assert len(e.text()) > 2 and len(e.latex()) > 2 and len(e.python()) > 2
    x, q = np.ones(e.shape[1]), np.array([0.3, -0.2, 0.1])
    bound = e.at(q)
    assert bound.batch is None and e.at(np.stack([q, q])).batch == 2
    assert np.allclose(bound @ x, bound.dense() @ x, rtol=1e-9)
    assert copy.copy(e) == e and copy.deepcopy(e).python() == e.python()
    assert pickle.loads(pickle.dumps(e)).python() == e.python()
    assert e.check_current() is None and e.simplify() is not None and e.explain() and e.diff(0).shape == e.shape
    assert isinstance(e.is_symmetric, bool) and isinstance(e.is_upper_triangular, bool)


@pytest.mark.parametrize("levels", [50, pytest.param(1000, marks=pytest.mark.slow)])
def test_inverses_within_inverses(soa, levels):
    """Beyond what one elimination takes, one inverse after the other is made dense."""
    e, dense = soa.D, soa.D.dense()
    D = dense
    for _ in range(levels):
        e, dense = (e + soa.D).inv() + soa.I, np.linalg.inv(dense + D) + np.eye(len(D))
    assert np.allclose(e @ np.ones(3), dense @ np.ones(3), rtol=1e-9)


@pytest.mark.parametrize("levels", [50, pytest.param(500, marks=pytest.mark.slow)])
def test_mass_matrices_within_inverses(soa, levels):
    MM = soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T
    e, dense, D = MM, MM.dense(), MM.dense()
    for _ in range(levels):
        e, dense = (e + MM).inv() + soa.I, np.linalg.inv(dense + D) + np.eye(len(D))
    assert np.allclose(e @ np.ones(3), dense @ np.ones(3), rtol=1e-9)
    assert np.allclose(e.at(precision="quad").dense(), dense, rtol=1e-9)


def doubled(e, soa, times):
    for _ in range(times):
        e = (e + soa.I).inv() + e
    return e


@pytest.mark.parametrize("letter", ["D", "MM"])
def test_shared_parts_are_planned_once(soa, letter):
    """e ← (e + I)⁻¹ + e: written out, 2ⁿ letters."""
    H, phi, M, D = soa("H phi M D")
    first = D if letter == "D" else H @ phi @ M @ phi.T @ H.T
    for times in (8, 14, 40):
        e, dense = doubled(first, soa, times), first.dense()
        for _ in range(times):
            dense = np.linalg.inv(dense + np.eye(len(dense))) + dense
        start = time.perf_counter()
        assert np.allclose(e @ np.ones(3), dense @ np.ones(3), rtol=1e-9)
        assert np.allclose(e.dense(rules=False), dense, rtol=1e-9)
        assert time.perf_counter() - start < 20
    assert "…" in repr(e)
    with pytest.raises(pc.EvaluationError, match="occur many times"):
        e.text()
    again = pickle.loads(pickle.dumps(e))
    assert np.array_equal(copy.deepcopy(e) @ np.ones(3), e @ np.ones(3)) and again.shape == e.shape
    assert doubled(first, soa, 40) == e and doubled(first, soa, 39) != e
    assert e.at(np.zeros(3)).T.shape == e.diff(1).shape


@pytest.mark.parametrize("levels", [3_300, pytest.param(33_000, marks=pytest.mark.slow)])
def test_a_hundred_thousand_nodes(soa, levels):
    """A chain of parts that are each used twice; ten thousand of them every day."""
    e = soa.D
    for _ in range(levels):
        half = 0.5 * e
        e = 0.5 * (half + soa.J + half)
    start = time.perf_counter()
    assert np.isfinite(e @ np.ones(3)).all()
    assert time.perf_counter() - start < 20


def test_limits_are_named(soa):
    for double in (lambda e: e @ e, lambda e: e + e):
        with pytest.raises(pc.EvaluationError, match="1000000"):
            nest(soa.tau, double, 40)
    for exponent in (1001, 2**30, -(2**70)):
        with pytest.raises(pc.EvaluationError, match="exponents go to 1000; evaluate one"):
            soa.tau**exponent
    with pytest.raises(pc.EvaluationError, match="levels deep"):
        nest(soa.D, lambda e: 0.5 * (e + soa.J), 101_000) @ np.ones(3)
    with pytest.raises(pc.EvaluationError, match="levels deep"):
        nest(soa.D.trace(), lambda s: 2 * (s + soa.D.trace()), 2000)
    e = nest(soa.phi, lambda e: (0.1 * e + soa.I) @ (0.1 * e + soa.tau), 25)  # applied to 2ⁿ vectors
    with pytest.raises(pc.EvaluationError, match="takes more than 200000 steps"):
        e.plan(rules=False)


def test_sums_of_many_scalars(soa):
    s = soa.D.trace()
    total = nest(s, lambda t: t + s, 3000)
    assert np.isclose(float(total), 3001 * float(s), rtol=1e-12)
    assert total.text().count("tr(D)") == 3001
