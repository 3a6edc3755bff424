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


NEITHER = [3, None, "arm", np.eye(2), [1]]


@pytest.mark.parametrize("given", NEITHER)
def test_what_is_no_operator_space_or_matrix(arm, given):
    """Said by name: no attribute that something has not, no signature of the core."""
    phi = arm.soa.phi
    with pytest.raises(pc.SpaceError, match="to_scipy takes an operator of a model, as arm.soa.phi, not"):
        pc.interop.to_scipy(given)
    with pytest.raises(pc.SpaceError, match=r"from_scipy: codomain is a space, as arm.soa.phi.codomain, not"):
        pc.interop.from_scipy(phi.dense(), phi.domain, given)
    with pytest.raises(pc.Error, match="'L' has shape|from_scipy: 'L' is not an array of numbers|it takes"):
        pc.interop.from_scipy(given, phi.domain, phi.codomain)
    if not isinstance(given, str):
        with pytest.raises(pc.ModelError, match="an operator is named by a string, not by"):
            pc.interop.from_scipy(phi.dense(), phi.domain, phi.codomain, given)


@pytest.mark.parametrize("given", [*NEITHER, pc.mechanisms.pendulum()])
def test_what_is_no_model(given):
    from pycraft.interop import drake, export, mujoco, pinocchio

    calls = [export.to_mjcf, export.mjcf_elements, drake.drake_plant, mujoco.permutation, lambda m: mujoco.to_mujoco(m, [0.0], [0.0])]
    calls += [lambda m: mujoco.velocity_map(m, [0.0]), lambda m: mujoco.acceleration_to_mujoco(m, [0.0], [0.0], [0.0])]
    calls += [lambda m: mujoco.from_mujoco(m, [0.0], [0.0]), lambda m: pinocchio.coordinates(m, None)]
    for call in calls:
        with pytest.raises(pc.ModelError, match="takes a model, not"):
            call(given)
    with pytest.raises(pc.ModelError, match="is given by its path, not by"):
        mujoco.compiled(given if not isinstance(given, str) else 4)
    with pytest.raises(pc.ModelError, match="name_of takes an MjModel, not"):
        mujoco.name_of(given)
    with pytest.raises(pc.ModelError, match="coordinates takes a model of Pinocchio's, not"):
        pinocchio.coordinates(pc.chain(1), given)
    if not isinstance(given, (str, list, np.ndarray)):
        with pytest.raises(pc.ModelError, match="q of 'chain of 1 rods'"):
            mujoco.to_mujoco(pc.chain(1), given, [0.0])


def test_a_scene_is_told_where_its_model_is():
    with pytest.raises(pc.ModelError, match="MJCF takes a model, not <scene.*a scene's model is scene.model"):
        pc.interop.export.to_mjcf(pc.mechanisms.pendulum())


def test_a_plant_of_drake_says_what_is_missing(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pydrake.multibody.plant", None)
    with pytest.raises(ImportError, match="a plant of Drake needs the package drake, which is not installed: pip install drake"):
        from pycraft.interop.drake import drake_plant

        drake_plant(pc.chain(1))


@pytest.mark.peers
@pytest.mark.parametrize("given", NEITHER)
def test_what_pinocchio_and_mujoco_are_handed(given):
    from pycraft.interop import export, mujoco, pinocchio

    with pytest.raises(pc.ModelError, match="to_pinocchio takes a model, not"):
        export.to_pinocchio(given)
    with pytest.raises(pc.ModelError, match="pinocchio_peer takes a model, not"):
        export.pinocchio_peer(given)
    with pytest.raises(pc.ModelError, match="takes a model, not"):
        export.mujoco_peer(given)
    with pytest.raises(pc.ModelError, match="order takes an MjModel, not"):
        mujoco.order(pc.chain(1), given)
    with pytest.raises(pc.ModelError, match="is not a file"):
        pinocchio.build(given)


@pytest.mark.peers
def test_files_that_pinocchio_refuses(tmp_path):
    from pycraft.interop import pinocchio

    path = tmp_path / "no.urdf"
    path.write_text("<robot/>")
    with pytest.raises(pc.ModelError, match="Pinocchio refuses the file"):
        pinocchio.build(path)
    with pytest.raises(pc.ModelError, match="root='floating': there are 'fixed' and 'free'"):
        pinocchio.build(path, "floating")
