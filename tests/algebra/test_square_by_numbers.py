"""Operators that are square in numbers while their blocks are not: the Jacobian of a node from six coordinates is 6 × 6, and has blocks of
6 × 1. Diagonal, trace, ln|det| and all else equal the dense matrix's.

Tolerances: an entry of the dense matrix carries at most 200 ε of its norm (a sweep over a dozen bodies); ln|det A| moves by tr(A⁻¹δA), at
most √n ‖A⁻¹‖ ‖δA‖.
"""

import numpy as np
import pytest

import pycraft as pc

EPS = np.finfo(float).eps


def arm(kinds, seed=3):
    model = pc.tree(list(range(-1, len(kinds) - 1)), kinds, seed=seed)
    model.q = model.random_state(seed).q
    return model


MODELS = {
    "ur5": pc.robots.ur5,
    "six pins": lambda: arm(["pin"] * 6),
    "one free body": lambda: arm(["free"]),
    "a ball and sliders": lambda: arm(["ball", "slider", "slider", "slider"]),
    "of several sizes": lambda: arm(["pin", "gimbal", "universal"]),
}


@pytest.fixture(params=MODELS)
def model(request):
    made = MODELS[request.param]()
    made.q = made.random_state(1).q
    return made


def assert_dense_reductions(op):
    """Every reduction of a square operator beside NumPy's of its dense matrix; of a batch state by state."""
    dense = op.dense()
    whole = dense if dense.ndim == 3 else dense[None]
    n = whole.shape[1]
    size = np.linalg.norm(whole, axis=(1, 2))
    inverse = np.linalg.norm(np.linalg.inv(whole), axis=(1, 2))
    off = 200 * EPS * size

    def close(found, wanted, allowed):
        found = np.asarray(found).reshape(np.shape(wanted))
        assert (np.abs(found - wanted).reshape(len(whole), -1).max(axis=1) <= allowed).all(), (op, found, wanted)

    close(op.diagonal(), np.diagonal(whole, axis1=1, axis2=2), off)
    close(op.trace().value(), np.trace(whole, axis1=1, axis2=2), n * off)
    close(op.norm().value(), size, n * off)
    moved = 200 * EPS * np.sqrt(n) * inverse * size
    close(op.logdet().value(), np.linalg.slogdet(whole)[1], moved)
    close(op.inv().logdet().value(), -np.linalg.slogdet(whole)[1], moved)
    x = np.arange(1.0, n + 1)
    close(op.inv() @ x, np.linalg.solve(whole, np.broadcast_to(x, (len(whole), n))[..., None])[..., 0], inverse * moved * np.linalg.norm(x))


def test_manipulability_of_an_arm():
    """The finding: memory that nobody wrote, 1e103 and a crash in place of these."""
    ur5 = pc.robots.ur5()
    J = ur5.soa.Jacobian(list(ur5.bodies)[-1]).at(ur5.random_state(1).q)
    np.testing.assert_allclose(J.diagonal(), np.diag(J.dense()), rtol=0, atol=1e-14)
    assert float(J.trace()) == pytest.approx(0.2645, abs=1e-4) and float(J.logdet()) == pytest.approx(-5.0234, abs=1e-4)


def test_jacobian_of_a_node(model):
    J = model.soa.Jacobian(list(model.bodies)[-1])
    for precision in ("double", "extended", "quad"):
        assert_dense_reductions(J.at(model.q, precision=precision))
    assert_dense_reductions(J.T)
    assert_dense_reductions(J @ J.T)
    assert_dense_reductions(2 * J)


def test_jacobian_of_a_node_in_batches(model):
    """A few states run one by one, many in packs."""
    J = model.soa.Jacobian(list(model.bodies)[-1])
    for count in (1, 3, 70):
        q = np.array([model.random_state(seed).q for seed in range(count)])
        for threads in (1, 2):
            assert_dense_reductions(J.at(q, threads=threads))


def test_compliance_and_its_products(model):
    """ln det of 𝒥ℳ⁻¹𝒥* and of Λ add up, with Λ𝒥𝒥* beside them."""
    soa, tip = model.soa, list(model.bodies)[-1]
    J, Lambda = soa.Jacobian(tip), soa.Lambda(tip)
    compliance = J @ (soa.MM + soa.J).inv() @ J.T
    condition = np.linalg.cond(compliance.dense())
    assert float(compliance.logdet() + Lambda.logdet()) == pytest.approx(0.0, abs=1e4 * EPS * condition)
    assert float((Lambda @ J @ J.T).logdet()) == pytest.approx(np.linalg.slogdet((Lambda @ J @ J.T).dense())[1], abs=1e4 * EPS * condition)


def test_gradients(model):
    """Of tr 𝒥 and ln|det 𝒥|: tr ∂𝒥 and tr(𝒥⁻¹∂𝒥) of the dense matrices."""
    J = model.soa.Jacobian(list(model.bodies)[-1])
    slopes = np.array([J.diff(i).dense() for i in range(model.nv)])
    inverse = np.linalg.inv(J.dense())
    size = np.linalg.norm(slopes) * np.linalg.norm(inverse)
    np.testing.assert_allclose(J.trace().gradient(), np.trace(slopes, axis1=1, axis2=2), atol=1e3 * EPS * np.linalg.norm(slopes))
    wanted = np.trace(inverse @ slopes, axis1=1, axis2=2)
    np.testing.assert_allclose(J.logdet().gradient(), wanted, atol=1e3 * EPS * size * np.linalg.cond(J.dense()))


def test_certificates():
    ur5 = pc.robots.ur5()
    J = ur5.soa.Jacobian(list(ur5.bodies)[-1])
    for scalar in (J.logdet(), J.trace()):
        assert scalar.certify(ur5.random_state(1), seconds=0).error < 1e-12


def test_what_is_triangular_by_blocks_has_an_inverse_that_is_not():
    """By blocks that are not square nothing follows for an inverse."""
    model = arm(["pin"] * 6)
    J = model.soa.Jacobian(list(model.bodies)[-1])
    assert not J.inv().is_lower_triangular and not J.inv().is_upper_triangular and not J.inv().is_block_diagonal
    assert model.soa.phi.inv().is_upper_triangular and model.soa.D.inv().is_block_diagonal


def test_blocks_that_are_not_square_have_no_inverse():
    """blockdiag(𝒥) keeps one column of six: singular, and reported."""
    model = arm(["pin"] * 6)
    blocks = pc.blockdiag(model.soa.Jacobian(list(model.bodies)[-1]))
    np.testing.assert_allclose(blocks.diagonal(), np.diag(blocks.dense()), atol=1e-15)
    assert float(blocks.trace()) == pytest.approx(np.trace(blocks.dense()), abs=1e-14)
    for refused in (lambda: blocks.inv().dense(), lambda: float(blocks.logdet()), lambda: blocks.inv() @ np.ones(6)):
        with pytest.raises(pc.SingularOperatorError, match="singular"):
            refused()


def test_nodes_in_another_order_than_their_bodies():
    """Blocks are square, body by body, and stand at other rows than the columns do: the matrix' diagonal is in none of them."""
    model = arm(["free", "free"])
    for order in (["body0", "body1"], ["body1", "body0"]):
        J = model.soa.Jacobian(order)
        assert_dense_reductions(J)
        assert_dense_reductions(pc.blockdiag(J))


def test_free_coordinates_and_grouped_bodies():
    model = arm(["pin", "ball", "slider", "slider", "slider"])
    tip = list(model.bodies)[-1]
    free = model.soa.free(["hinge0"])
    B = model.soa.B(tip)
    assert_dense_reductions(B.T @ free.phi.T @ free.H.T)
    seven = arm(["pin"] * 6)
    grouped = seven.soa.grouped([["body1", "body2", "body3"]])
    assert_dense_reductions(grouped.Jacobian("body5"))
    np.testing.assert_allclose(grouped.Jacobian("body5").dense(), seven.soa.Jacobian("body5").dense(), atol=1e-13)


def test_what_is_not_square_is_refused():
    model = arm(["pin"] * 5)
    J = model.soa.Jacobian(list(model.bodies)[-1])
    with pytest.raises(pc.SpaceError, match="it is not square"):
        J.diagonal()
    for refused in (J.trace, J.logdet):
        with pytest.raises(pc.SpaceError, match="it is not square"):
            refused()
