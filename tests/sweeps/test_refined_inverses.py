"""Several inverses in one refined expression: each is refined by residuals of its own system, made when its turn comes.

The dense matrix is the oracle. A backward stable solve of A x = b, refined or not, is off by at most n κ(A) ε relative to x, once for
each inverse of the expression; 64 of them are allowed, of sums of two and of products of up to three.
"""

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import random_tree

EPS = {"single": 2.0**-23, "double": 2.0**-52, "extended": 2.0**-52, "quad": 2.0**-52}  # of what comes out: doubles at best


def expressions(soa):
    """(name, expression, the same of dense matrices) with ℳ + 2I and ℳ + I, which no theorem inverts."""
    MM, I = soa("MM I")
    eye = lambda m: np.eye(len(m))
    a, b = (MM + 2 * I).inv(), (MM + I).inv()
    A, B = (lambda m: np.linalg.inv(m + 2 * eye(m))), (lambda m: np.linalg.inv(m + eye(m)))
    return {
        "sum": (a + b, lambda m: A(m) + B(m)),
        "product": (a @ b, lambda m: A(m) @ B(m)),
        "three": (a @ b + (MM + 3 * I).inv(), lambda m: A(m) @ B(m) + np.linalg.inv(m + 3 * eye(m))),
        "solve of a sum": ((a + b).inv(), lambda m: np.linalg.inv(A(m) + B(m))),
        "solve inside a solve": ((MM + a).inv() + b, lambda m: np.linalg.inv(m + A(m)) + B(m)),
        "one": (a, A),
        "twice the same": (a + a @ MM @ a, lambda m: A(m) + A(m) @ m @ A(m)),
        "with its blocks": (a + pc.blockdiag(b) @ b, lambda m: A(m) + np.diag(np.diag(B(m))) @ B(m)),
    }


NAMES = list(expressions(pc.chain(2).soa))


def off(found, wanted, m, precision="double"):
    """The difference in units of what is allowed."""
    condition = np.linalg.cond(m + np.eye(len(m))) ** 2
    return np.abs(found - wanted).max() / (64 * len(m) * condition * EPS[precision] * np.abs(wanted).max())


@pytest.mark.parametrize("name", NAMES)
def test_refined_expressions_of_several_inverses(name):
    model = pc.chain(5, seed=2)
    op, dense = expressions(model.soa)[name]
    x, X = np.ones(5), np.random.default_rng(0).normal(size=(5, 3))
    q = np.array([model.random_state(seed).q for seed in range(4)])
    M = model.soa.MM.at(q).dense()
    for refine in (1, 3, "auto"):
        for residual in ("same", "gather", "wider"):
            bound = op.at(q[0], refine=refine, residual=residual)
            assert off(bound @ x, dense(M[0]) @ x, M[0]) < 1
            assert off(bound @ X, dense(M[0]) @ X, M[0]) < 1
            assert off(bound.dense(), dense(M[0]), M[0]) < 1
    for precision in EPS:
        assert off(op.at(q[0], refine=1, precision=precision).dense(), dense(M[0]), M[0], precision) < 1
    for threads in (1, 2):
        batch = op.at(q, refine=1, threads=threads)
        for found, m in zip(batch.dense(), M, strict=True):
            assert off(found, dense(m), m) < 1
    for found, m in zip(op.at(q, refine=1) @ x, M, strict=True):
        assert off(found, dense(m) @ x, m) < 1


def test_states_one_after_another_in_one_plan():
    """The twin one scalar up follows the states of a batch, of an operand within it too, and goes back to none of them."""
    model = pc.chain(4, seed=1)
    op, dense = expressions(model.soa)["solve inside a solve"]
    q = np.array([model.random_state(seed).q for seed in range(6)])
    for order in (q, q[::-1], q[[0, 0, 5, 0, 5]]):
        M = model.soa.MM.at(order).dense()
        for found, m in zip(op.at(order, refine=2).dense(), M, strict=True):
            assert off(found, dense(m), m) < 1
    for at in q:  # the model's own state
        model.q = at
        assert off(op.at(refine=1).dense(), dense(model.soa.MM.dense()), model.soa.MM.dense()) < 1


def test_trace_and_determinant_beside_refined_solves():
    model = pc.chain(4, seed=1)
    for name in NAMES:
        op, dense = expressions(model.soa)[name]
        m = model.soa.MM.dense()
        wanted = dense(m)
        condition = np.linalg.cond(wanted) * np.linalg.cond(m + np.eye(4)) ** 2
        assert float(op.trace().at(model.q, refine=1)) == pytest.approx(np.trace(wanted), rel=256 * condition * EPS["double"])
        assert float(op.logdet().at(model.q, refine=1)) == pytest.approx(np.linalg.slogdet(wanted)[1], abs=256 * condition * EPS["double"])


def test_functions_of_vectors_beside_refined_solves():
    """Blocks made of velocities, and of accelerations that are named and change from run to run: the twin takes them as they are now."""
    model, rng = pc.chain(4, seed=1), np.random.default_rng(0)
    model.v = model.random_state(1).v
    soa, a, w = model.soa, pc.vector("a", model.soa.Theta), pc.vector("w", model.soa.Theta)
    moving = soa.H @ soa.M @ soa.V_tilde @ soa.H.T
    A, B = soa.MM + 0.2 * moving + 3 * soa.I, soa.MM + 2 * soa.I
    C = A + 0.1 * moving.dot(vdot=a)
    for v in (model.v, -2 * model.v, model.v):
        dense = np.linalg.inv(A.at(model.q, v).dense()) + np.linalg.inv(B.at(model.q, v).dense())
        for refine in (0, 1, "auto"):
            bound = (A.inv() + B.inv()).at(model.q, v, refine=refine)
            np.testing.assert_allclose(bound.dense(), dense, rtol=0, atol=1e-12 * np.abs(dense).max())
    for refine in (0, 1):
        solve = ((C.inv() + B.inv()) @ w).at(model.q, model.v, refine=refine)
        for _ in range(3):
            x, y = rng.normal(size=(2, 4))
            columns = [(C @ w).at(model.q, model.v).value(a=x, w=e) for e in np.eye(4)]
            whole = np.array(columns).T
            wanted = np.linalg.solve(whole, y) + np.linalg.solve(B.at(model.q).dense(), y)
            np.testing.assert_allclose(solve.value(a=x, w=y), wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


@pytest.mark.parametrize(("seed", "rules"), [(45, False), (47, False), (53, False), (53, True)])
def test_diagonal_blocks_read_from_factors_are_refined(seed, rules):
    """No solve corrects them: all is computed one precision up. In double they are off by 1e-13 here, with theorems by 3e-14."""
    rng = np.random.default_rng(seed)
    model = random_tree(rng, int(rng.integers(2, 6)))
    tip = [list(model.bodies)[-1]]
    state = model.random_state(rng)
    op = pc.blockdiag(model.soa.Lambda(tip) + model.soa.Lambda(tip))
    right = op.at(state.q, state.v, precision="quad").dense()
    for refine in (1, "auto"):
        refined = op.at(state.q, state.v, refine=refine)
        assert np.abs(refined.dense(rules=rules) - right).max() <= 2 * EPS["double"] * np.abs(right).max()
        x = np.ones(6)
        assert np.abs(refined @ x - right @ x).max() <= 16 * EPS["double"] * np.abs(right).max()
    plain = op.at(state.q, state.v).dense(rules=rules)
    assert np.abs(plain - right).max() > 64 * EPS["double"] * np.abs(right).max()
