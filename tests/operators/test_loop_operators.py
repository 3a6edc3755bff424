"""Rows of loops as operators: against the arrays of `model.loops`, which have an oracle of their own; derivatives against Q̇θ̇, differences.

Rounding: Q is the arrays' own numbers. A B*φ*H* uses the world's axes, as relative Jacobians do: 2·10⁴ eps of the largest entry beside 1
(test_frame_operators.py), and so do derivatives, times what rows divide by: the half cosine between axes, cubed, above 0.1.
"""

import pickle

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind

EPS = float(np.finfo(float).eps)
HINGES = ("weld", "pin", "slider", "screw", "universal", "cylindrical", "planar", "ball", "free")


def near(got, expected, scale=1.0):
    return np.abs(got - expected).max(initial=0) <= 2e4 * EPS * scale * (1 + np.abs(expected).max(initial=0))


def with_all_pairs(seed):
    """Loops of every kind between bodies, nodes and the base, open."""
    model, rng = every_kind(seed=seed), np.random.default_rng(seed)
    bodies = list(model.bodies)
    model.add_node("eye", bodies[-1], position=rng.normal(size=3))
    for i, kind in enumerate(HINGES):
        a, b = [(bodies[5], "eye"), ("eye", bodies[0]), (None, bodies[8])][i % 3]
        X = model.frame(b).pose(wrt=a)
        X[:3, 3] += 0.3 * rng.normal(size=3)
        model.add_loop(b, a, kind, placement=X, name=f"{kind} loop", **({"pitch": 0.3} if kind == "screw" else {}))
    model.add_rolling("eye", kind="wheel", radius=0.2, name="wheel")
    model.add_rolling(bodies[2], bodies[7], kind="ball", radius=0.2, name="marble")
    model.add_rolling(bodies[4], kind="blade", name="skate")
    model.add_surface("eye", bodies[3], A=rng.normal(size=(3, 3)), b=rng.normal(size=3), name="bowl")
    return model


def with_couplings():
    model = pc.chain(3)
    model.add_coupling({"hinge0": [0.0, 1.0, 2.0, -0.5], "hinge2": -3.0}, name="gear")
    function = lambda q: (q[1] - np.sin(q[0]) * q[1], [-np.cos(q[0]) * q[1], 1 - np.sin(q[0])], second(q))
    second = lambda q: [[np.sin(q[0]) * q[1], -np.cos(q[0])], [-np.cos(q[0]), 0]]
    model.add_coupling(["hinge0", "hinge1"], function=function, name="cam")
    return model


def four_bar():
    model = pc.chain(3)
    model.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    return model


def of_ends(model):
    soa = model.soa
    return soa.A @ soa.B(model.loops.ends).T @ soa.phi.T @ soa.H.T


@pytest.mark.parametrize("seed", [0, 1])
def test_rows_and_their_rates(seed):
    model = with_all_pairs(seed)
    q, v, Q = model.q, model.v, model.soa.Q
    assert np.array_equal(Q.at(q).dense(), model.loops.jacobian(q))
    assert Q.shape == (len(model.loops.rows), model.nv) and Q.domain == model.soa.Theta
    assert near(of_ends(model).at(q).dense(), model.loops.jacobian(q))
    for rate in (Q.dot(), of_ends(model).dot()):
        assert near(rate.at(q, v).dense() @ v, model.loops.bias(q, v), 1000)


@pytest.mark.parametrize("model", [with_all_pairs(0), with_couplings()], ids=["pairs", "couplings"])
def test_derivatives_along_coordinates(model):
    """Central differences of h = 1e-5: h² of third derivatives, some hundreds here, and eps/h: 1e-7."""
    q, h = np.array(model.random_state(3).q), 1e-5
    for i in range(0, model.nv, 3):
        step = h * np.eye(model.nv)[i]
        expected = (model.loops.jacobian(model.integrate(q, step)) - model.loops.jacobian(model.integrate(q, -step))) / (2 * h)
        got = model.soa.Q.diff(i).at(q).dense()
        assert np.abs(got - expected).max() <= 1e-7 * (1 + np.abs(expected).max())
        if len(model.loops.ends):
            assert near(of_ends(model).diff(i).at(q).dense(), got, 1000)


def test_couplings_and_what_is_no_closure():
    model = with_couplings()
    q, v = np.array([0.3, 0.8, -0.2]), np.array([1.0, -2.0, 0.5])
    assert np.array_equal(model.soa.Q.at(q).dense(), model.loops.jacobian(q))
    assert near(model.soa.Q.dot().at(q, v).dense() @ v, model.loops.bias(q, v))
    assert model.soa.A.shape == (2, 0)
    with pytest.raises(pc.EvaluationError, match="coupling 'cam' is a function in double precision"):
        model.soa.Q.at(q, precision="quad").dense()


def test_as_any_operator():
    """Transposes, products, batches, precisions, forms."""
    model = four_bar()
    Q, MM = model.soa.Q, model.soa.MM
    q = np.random.default_rng(0).normal(size=(4, 3))
    arrays = model.loops.jacobian(q)
    assert np.array_equal(Q.at(q).dense(), arrays) and np.array_equal(Q.T.at(q).dense(), arrays.transpose(0, 2, 1))
    assert np.array_equal(Q.at(q[0], precision="quad").dense().astype(float), model.loops.jacobian(q[0], precision="quad"))
    x = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    assert near(Q.T.at(q[1]) @ x, arrays[1].T @ x) and near((Q @ Q.T).at(q[1]) @ x, arrays[1] @ (arrays[1].T @ x))
    for form in ("fast", "ud", "square-root"):
        compliance = (Q @ MM.inv() @ Q.T).at(q[2], form=form).dense()
        assert near(compliance, arrays[2] @ np.linalg.solve(MM.at(q[2]).dense(), arrays[2].T), 100)
    assert str(Q) == "Σ Q" and "hinge1" in str(Q.diff("hinge1"))


def test_of_the_loops_that_there_are_now():
    model = four_bar()
    before = model.soa.Q
    assert model.soa.Q == before and model.soa.A == model.soa.A
    model.add_coupling({"hinge0": 1.0, "hinge1": -1.0})
    with pytest.raises(pc.StaleOperatorError, match="before the loops of 'chain of 3 rods' changed"):
        before.dense()
    assert model.soa.Q.shape == (6, 3) and np.array_equal(model.soa.Q.dense(), model.loops.jacobian())
    model.bodies["body1"].mass = 3.0
    placement = np.eye(4)
    placement[0, 3] = 1.5
    model.hinges["hinge1"].placement = placement
    assert np.array_equal(model.soa.Q.dense(), model.loops.jacobian())
    for name in list(model.loops):
        model.loops.remove(name)
    assert model.soa.Q.shape == (0, 3) and model.soa.A.shape == (0, 0) and model.loops.ends == []


def test_pickled_with_their_model():
    q = [0.1, 0.2, 0.3]
    for made in (lambda m: m.soa.Q, lambda m: m.soa.A, lambda m: m.soa.Q.diff(1), lambda m: m.soa.Q.dot().at(q, q)):
        model = four_bar()
        again = pickle.loads(pickle.dumps(made(model)))
        assert np.array_equal(again.at(q, q).dense() if again._state is None else again.dense(), made(model).at(q, q).dense())


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda m: m.soa.Q.diff(0, 1, 2), "rows of loops are differentiated twice"),
        (lambda m: m.soa.grouped([["body0", "body1"]]).Q, "whole model"),
        (lambda m: m.soa.free(["hinge1"]).A, "whole model"),
        (lambda m: m.soa.Q.algorithm(), "no recursion is written for Q, the rows of loops"),
        (lambda m: m.soa.Q.at([0.0, np.nan, 0.0]).dense(), "hinge1"),
    ],
)
def test_refused(ask, said):
    with pytest.raises((pc.EvaluationError, pc.ModelError, AttributeError), match=said):
        ask(four_bar())


def test_no_row_moves_with_masses():
    model = four_bar()
    assert not model.soa.Q.diff(model.bodies["body1"].symbol("mass")).dense().any()
