"""SciPy's linear operators, both ways."""

import numpy as np
import pytest
import scipy.sparse
from scipy.sparse.linalg import LinearOperator, aslinearoperator, cg

import pycraft as pc


@pytest.fixture
def arm():
    model = pc.tree([-1, 0, 1, 1], ["pin", "ball", "slider", "pin"], seed=2)
    model.q = model.random_state(1).q
    return model


def mass_matrix(arm):
    H, phi, M = arm.soa("H phi M")
    return H @ phi @ M @ phi.T @ H.T


def test_to_scipy_solves_with_conjugate_gradients(arm):
    MM = mass_matrix(arm)
    x = np.arange(1.0, arm.nv + 1)
    y, info = cg(pc.interop.to_scipy(MM), x, rtol=1e-12)
    assert info == 0
    # cg stops at a relative residual of 1e-12; the error is that times the condition
    assert np.linalg.norm(y - MM.inv() @ x) <= 1e-12 * np.linalg.cond(MM.dense()) * np.linalg.norm(y) * 2


def test_to_scipy_has_all_four_products(arm):
    phi = arm.soa.phi
    A, dense = pc.interop.to_scipy(phi), phi.dense()
    X = np.random.default_rng(0).normal(size=(A.shape[1], 3))
    for got, want in ((A @ X[:, 0], dense @ X[:, 0]), (A @ X, dense @ X), (A.H @ X, dense.T @ X), (A.rmatvec(X[:, 1]), dense.T @ X[:, 1])):
        assert np.allclose(got, want, rtol=1e-13, atol=1e-13)


def test_from_scipy_in_an_expression(arm):
    MM, theta = mass_matrix(arm), arm.soa.Theta
    B = np.random.default_rng(1).normal(size=(arm.nv, arm.nv))
    L = pc.interop.from_scipy(aslinearoperator(B), theta, theta, "L")
    x = np.ones(arm.nv)
    assert np.allclose((MM + L) @ x, MM.dense() @ x + B @ x, rtol=1e-13)
    assert np.allclose((MM @ L.T) @ x, MM.dense() @ (B.T @ x), rtol=1e-12)
    inverse = (MM + L).inv()
    assert inverse.plan().has_dense_step
    assert "unknown structure" in str(inverse.explain())
    assert np.allclose(inverse @ x, np.linalg.solve(MM.dense() + B, x), rtol=1e-9)


def test_sparse_matrices_keep_their_blocks(arm):
    MM, theta = mass_matrix(arm), arm.soa.Theta
    C = pc.interop.from_scipy(scipy.sparse.diags(np.arange(1.0, arm.nv + 1)), theta, theta, "C")
    assert C.is_block_diagonal
    assert not (MM + C).inv().plan().has_dense_step


def test_what_does_not_fit_is_refused(arm):
    theta, forces = arm.soa.Theta, arm.soa.F
    with pytest.raises(pc.SpaceError, match="takes"):
        pc.interop.from_scipy(np.eye(3), theta, forces)
    with pytest.raises(pc.SpaceError, match="no space"):
        pc.interop.to_scipy(arm.soa.I)
    only_forward = pc.interop.from_scipy(LinearOperator((arm.nv, arm.nv), matvec=lambda x: x), theta, theta, "L")
    with pytest.raises(pc.EvaluationError, match="double precision only"):
        (only_forward @ mass_matrix(arm)).at(arm.q, precision="quad").dense()
