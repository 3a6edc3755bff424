"""Scalars multiply, divide and differentiate; two expressions bound alike are equal; constants turn with the frame they are seen from."""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind

STEP = 1e-5


@pytest.fixture(scope="module")
def arm():
    model = pc.tree([-1, 0, 1, 1], ["free", "ball", "universal", "pin"], seed=2, rotor_inertia=True)
    state = model.random_state(1)
    model.q, model.v = state.q, state.v
    return model


def slope(model, f, i):
    """Of fourth order, along coordinate i; f of a configuration."""
    step = np.zeros(model.nv)
    step[i] = STEP
    at = [f(model.integrate(model.q, k * step)) for k in (-2, -1, 1, 2)]
    return (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * STEP)


@pytest.mark.parametrize("name", ["MM", "D", "P", "phi", "M phi*", "H phi", "Jacobian", "C"])
def test_norms_have_derivatives(arm, name):
    H, phi, M = arm.soa("H phi M")
    of_constants = pc.constant(np.arange(24.0)[None], arm.soa.V, 1) @ arm.soa.P.inv()
    A = {"M phi*": M @ phi.T, "H phi": H @ phi, "Jacobian": arm.soa.Jacobian(["body3"]), "C": of_constants}.get(name) or getattr(
        arm.soa, name
    )
    for i in (7, 10):
        expected = slope(arm, lambda q: np.linalg.norm(np.asarray(A.at(q).dense())), i)
        size = np.linalg.norm(np.asarray(A.diff(i).dense()))
        assert abs(float(A.norm().diff(i)) - expected) <= 1e-9 * max(size, 1)


def test_a_norm_that_is_zero(arm):
    nothing = arm.soa.D - arm.soa.D
    assert float(nothing.norm().diff(7)) == 0  # of what is zero by structure
    with pytest.raises(pc.SingularOperatorError, match="divided by, and is 0"):
        float(arm.soa.D.trace() / nothing.norm())


def test_products_quotients_and_powers(arm):
    D, M, MM, P = arm.soa("D M MM P")
    a, b, c = D.trace(), MM.norm(), P.logdet()
    x, y, z = float(a), float(b), float(c)
    cases = [
        (a * b, x * y), (a * b / c, x * y / z), (a / 3, x / 3), (2 / b, 2 / y), (a**3, x**3), (a**-2, x**-2), (a**0, 1.0),
        ((a + 1) * (b - c), (x + 1) * (y - z)), (1 / (a + b) ** 2, 1 / (x + y) ** 2), (-a * (b * c), -x * y * z),
    ]  # fmt: skip
    for scalar, value in cases:
        assert float(scalar) == pytest.approx(value, rel=1e-14)
        again = pickle.loads(pickle.dumps(scalar))
        assert repr(again) == repr(scalar) and repr(copy.deepcopy(scalar)) == repr(scalar)
        for i in (7, 10):
            assert float(scalar.diff(i)) == pytest.approx(np.broadcast_to(scalar.gradient(), arm.nv)[i], rel=1e-10, abs=1e-12)
    Q = np.stack([arm.random_state(k).q for k in range(3)])
    scalar = a * b / c
    assert np.array_equal(np.asarray(scalar.at(Q)), [float(scalar.at(q)) for q in Q])
    assert np.allclose(scalar.at(Q).gradient(), [scalar.at(q).gradient() for q in Q], rtol=1e-12, atol=1e-14)
    expected = [slope(arm, lambda q: float(scalar.at(q)), i) for i in range(arm.nv)]
    assert np.allclose(scalar.gradient(), expected, atol=1e-8 * max(1, np.abs(expected).max()))


def test_how_they_are_shown(arm):
    D, MM = arm.soa("D MM")
    a, b = D.trace(), MM.norm()
    assert (a * b).text() == "tr(D) ‖H φ M φ* H*‖" and (a / b).text() == "tr(D)/‖H φ M φ* H*‖"
    assert ((a + 1) * b / 3).text() == "1/3 (tr(D) + 1) ‖H φ M φ* H*‖"
    assert (1 / a).text() == "1/tr(D)" and (a - (a + 1)).text() == "tr(D) - (tr(D) + 1)"
    assert (a / b).latex().startswith("\\frac{") and b.latex().count("\\Vert") == 2
    assert D.logdet().text() == "ln det D" and (D @ D).logdet().text() == "ln det(D D)"


def test_what_is_no_scalar(arm):
    D = arm.soa.D
    for refused in (lambda: D.trace() * D, lambda: D / D.trace(), lambda: D.trace() + D):
        with pytest.raises(TypeError):
            refused()
    with pytest.raises(ZeroDivisionError):
        D.trace() / 0
    with pytest.raises(TypeError, match="whole number"):
        D.trace() ** 0.5
    with pytest.raises(pc.EvaluationError, match="exponents go to"):
        D.trace() ** 100000


def test_expressions_bound_alike_are_equal(arm):
    D, Q = arm.soa.D, np.stack([arm.random_state(k).q for k in range(2)])
    one, other = D.at(arm.q), D.at(list(arm.q))
    assert one == D.at(np.array(arm.q)) and one == other and hash(one) == hash(other)
    assert D.at(Q) == D.at(Q.copy()) and D.at(arm.q, arm.v) == D.at(arm.random_state(1)) and D.trace().at(Q) == D.trace().at(Q)
    assert pickle.loads(pickle.dumps((D.at(Q), D.at(Q))))[0].children == []
    one, two = pickle.loads(pickle.dumps((D.at(Q), D.at(Q))))
    assert one == two
    moved = np.array(arm.q)
    moved[-1] = np.nextafter(moved[-1], 9)
    others = [D.at(moved), D.at(Q), D.at(arm.q, arm.v), D.at(arm.q, form="ud"), D.at(arm.q, refine=1), D.at(arm.q, precision="quad"), D]
    assert len({D.at(arm.q), *others}) == len(others) + 1
    # and what is equal meets its inverse
    assert (D.at(arm.q) @ D.at(arm.q).inv()).simplify() == (D @ D.inv()).at(arm.q).simplify()


@pytest.mark.parametrize("direction", [8, "time"])
def test_constants_in_world_axes(arm, direction):
    """As beside a letter that is multiplied by zero."""
    M = arm.soa.M
    rng = np.random.default_rng(0)
    F, V = arm.soa.F, arm.soa.V
    pairs = [(V, F, 0 * M), (F, V, 0 * M.inv()), (V, V, 0 * M.inv() @ M), (F, F, 0 * M @ M.inv())]
    for domain, codomain, nothing in pairs:
        C = pc.constant(rng.normal(size=(24, 24)), domain, codomain)
        if direction == "time":
            alone, beside = C.dot(frame="world"), (C + nothing).dot(frame="world")
        else:
            alone, beside = C.diff(direction, frame="world"), (C + nothing).diff(direction, frame="world")
        assert np.allclose(alone.dense(), beside.dense(), rtol=0, atol=1e-13) and np.abs(alone.dense()).max() > 0.1
    C = pc.constant(rng.normal(size=(24, 24)), V, F)
    assert (
        not np.asarray(C.diff(8).dense()).any() and not np.asarray(C.diff(arm.bodies["body2"].symbol("mass"), frame="world").dense()).any()
    )


def test_theorems_of_derived_trees_are_copied():
    for theorem in every_kind().soa.theorems():
        if not theorem.waiting:
            again = pickle.loads(pickle.dumps(theorem))
            assert again.text == theorem.text and copy.deepcopy(theorem).text == theorem.text


def test_what_wants_rotor_inertia_says_so():
    plain, geared = pc.chain(2), pc.tree([-1, 0], "pin", rotor_inertia=True)
    report = pc.check("J⁻¹ J = I", plain)
    assert not report and report.verdict == "undefined" and report.true_where == [frozenset({"J > 0"})]
    assert "TRUE where J > 0" in repr(report) and "hinge0" in repr(report)
    assert pc.check("J⁻¹ J = I", geared) and "checked where J > 0" in repr(pc.check("J⁻¹ J = I", states=12))
    assert "TRUE where J > 0" in pc.truth("J⁻¹ J = I", smallest_case=False).verdict
    false = pc.check("J⁻¹ D = D", plain)
    assert not false and "FALSE where J > 0" in repr(false)
    with pytest.raises(pc.SingularOperatorError):  # which rotor inertia would not help
        pc.check("(H* H)⁻¹ H* H = I", plain)


def test_names_of_theorems_are_words():
    names = [theorem.name for theorem in every_kind().soa.theorems()]
    assert len(set(names)) == len(names) and not any("#" in name or "F1" in name for name in names)
