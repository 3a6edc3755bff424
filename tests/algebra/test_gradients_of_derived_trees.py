"""Gradients of scalars of free, prescribed, grouped and embedded trees, and of constants: all derivatives at once, in the coordinates that
`diff` takes.

The oracle is a central difference of the scalar in quad precision with a step h = 1e-8: its truncation, h² times third derivatives of order
one, and its rounding, 1e-34/h, stay below 1e-12.
"""

import numpy as np
import pytest

import pycraft as pc
from support.closed_models import closed_four_bar

STEP = 1e-8
ALLOWED = 1e-11


@pytest.fixture
def tree():
    made = pc.tree([-1, 0, 1, 1], ["pin", "ball", "pin", "slider"], seed=1, rotor_inertia=True)
    made.q = made.random_state(2).q
    return made


def difference(scalar, model, i):
    ends = [np.float64(scalar.at(model.integrate(model.q, s * STEP * np.eye(model.nv)[i]), precision="quad")) for s in (1, -1)]
    return (ends[0] - ends[1]) / (2 * STEP)


def assert_gradient(scalar, model):
    gradient = scalar.gradient()
    assert gradient.shape == (model.nv,)
    wanted = np.array([difference(scalar, model, i) for i in range(model.nv)])
    # doubles come out: the difference of two of them carries their rounding over 2h
    rounding = 4 * np.finfo(float).eps * abs(float(scalar)) / STEP
    np.testing.assert_allclose(gradient, wanted, rtol=0, atol=ALLOWED * (1 + np.abs(wanted).max()) + rounding)


def test_the_finding():
    tree = pc.tree([-1, 0, 1], ["pin", "ball", "pin"], seed=1)
    scalar = tree.soa.free(["hinge0"]).MM.logdet()
    assert scalar.gradient()[-1] == pytest.approx(float(scalar.diff("hinge2")), rel=1e-12) == pytest.approx(-0.0284, abs=1e-4)


def test_free_and_prescribed_coordinates(tree):
    free = tree.soa.free(["hinge0", "hinge3"])
    for soa in (free, free.of_prescribed, tree.soa.prescribed(["hinge1"])):
        for scalar in ((soa.MM + soa.J).logdet(), soa.MM.trace(), soa.MM.norm(), 2 * soa.MM.trace() - soa.D.logdet() / 3 + 1):
            assert_gradient(scalar, tree)
    assert_gradient(free.Schur_complement.logdet(), tree)
    assert_gradient(free.MM.trace() * tree.soa.MM.logdet(), tree)


def test_grouped_bodies(tree):
    grouped = tree.soa.grouped([["body1", "body2"]])
    whole = (tree.soa.MM + tree.soa.J).logdet()
    scalar = (grouped.MM + grouped.J).logdet()
    assert_gradient(scalar, tree)
    np.testing.assert_allclose(scalar.gradient(), whole.gradient(), atol=1e-12)


def test_embedded_loops_go_along_their_independent_coordinates():
    bars = closed_four_bar()
    linkage = bars.soa.embedded(["crank"])
    for scalar in (linkage.MM.logdet(), linkage.MM.trace(), linkage.MM.logdet() + bars.soa.MM.trace()):
        gradient = scalar.gradient()
        assert gradient.shape == (1,) and gradient[0] == pytest.approx(float(scalar.diff(0)), rel=1e-13)
    h = 1e-5
    ends = [float(linkage.MM.logdet().at(linkage.state([bars.q[0] + s * h]).q, precision="quad")) for s in (1, -1)]
    assert linkage.MM.logdet().gradient()[0] == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-7)  # h², and 1e-16/h


def test_rows_of_loops():
    bars = closed_four_bar()
    Q = bars.soa.Q
    scalar = (Q @ Q.T).trace()
    assert scalar.gradient().shape == (bars.nv,)
    np.testing.assert_allclose(scalar.gradient(), [float(scalar.diff(i)) for i in range(bars.nv)], rtol=1e-13)


def test_batches(tree):
    scalar = tree.soa.free(["hinge0"]).MM.logdet()
    states = np.array([tree.random_state(seed).q for seed in range(3)])
    batch = scalar.at(states).gradient()
    assert batch.shape == (3, tree.nv)
    for q, row in zip(states, batch, strict=True):
        np.testing.assert_allclose(row, scalar.at(q).gradient(), rtol=1e-11, atol=1e-13)


def test_constants_have_none(tree):
    """Zero along every coordinate, not an error; of numbers between spaces R^n, zero."""
    C = pc.constant(np.eye(tree.nv) * 2, tree.soa.Theta, tree.soa.Theta)
    assert np.array_equal(C.trace().gradient(), np.zeros(tree.nv))
    assert np.array_equal((C.trace() + tree.soa.MM.trace()).gradient(), tree.soa.MM.trace().gradient())
    R = pc.constant(np.diag([1.0, 2.0]), 2, 2)
    assert not np.any(R.trace().gradient()) and np.array_equal((R.logdet() + C.trace()).gradient(), np.zeros(tree.nv))


def test_two_models_are_refused(tree):
    other = pc.chain(2)
    with pytest.raises(pc.EvaluationError, match="operators of two models"):
        (tree.soa.MM.trace() + other.soa.MM.trace()).gradient()
