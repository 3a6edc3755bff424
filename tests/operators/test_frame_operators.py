"""Relative Jacobians as expressions: against the arrays of frames, their derivatives against differences, without a dense step.

An expression uses the world's axes: its error is the rounding of poses and motions there, within metres, through two chains of at most
six bodies, some thousand roundings, with X⁻¹ beside: 2·10⁴ eps of the largest entry, beside 1.
"""

import numpy as np
import pytest

import pycraft as pc
from support.differences import along, assert_close, numbers
from support.mechanisms import every_kind

EPS = float(np.finfo(float).eps)


def loose(model):
    bodies = list(model.bodies)
    model.add_frame("hand", on=bodies[10], placement=pose_of(1))
    model.add_frame("glove", on="hand", placement=pose_of(2))
    model.add_frame("wall", placement=pose_of(3))
    return bodies


def pose_of(seed):
    rng = np.random.default_rng(seed)
    R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R * np.linalg.det(R), rng.normal(size=3)
    return X


def near(got, expected):
    return np.abs(got - expected).max(initial=0) <= 2e4 * EPS * (1 + np.abs(expected).max(initial=0))


PAIRS = [("glove", "body7"), ("body7", "glove"), ("glove", "wall"), ("wall", "glove"), ("body4", None), (None, "body9")]
PAIRS += [("glove", "hand"), ("wall", None), ("a node", "body5")]


@pytest.mark.parametrize("seed", [0, 1])
def test_any_pair_in_any_axes(seed):
    model = every_kind(seed=seed)
    loose(model)
    q, v = model.q, model.v
    for a, b in PAIRS:
        if a == "a node":
            a = next(name for name, node in model.nodes.items() if node.body is not None)
        for axes in ("body", "aligned", "world", "body3", "wall", "glove"):
            frame = model.frame(a)
            J = frame.jacobian_operator(wrt=b, axes=axes)
            assert J.shape == (6, model.nv) and J.domain == model.soa.Theta
            assert near(J.dense(), frame.jacobian(wrt=b, axes=axes)), (a, b, axes)
            assert near(J.dot().at(q, v).dense(), frame.jacobian_dot(q, v, wrt=b, axes=axes)), (a, b, axes)


def test_some_coordinates_and_batches():
    model = every_kind(seed=2)
    loose(model)
    hinges = list(model.hinges)
    chosen = [hinges[9], hinges[4], 0]
    J = model.frame("glove").jacobian_operator(wrt="body7", axes="aligned", coordinates=chosen)
    Q = np.array([model.random_state(seed).q for seed in range(3)])
    assert near(J.at(Q).dense(), model.frame("glove").jacobian(Q, wrt="body7", axes="aligned", coordinates=chosen))
    x = np.arange(1.0, J.shape[1] + 1)
    assert near(J.at(Q[1]) @ x, model.frame("glove").jacobian(Q[1], wrt="body7", axes="aligned", coordinates=chosen) @ x)


def test_derivatives_along_coordinates():
    model = every_kind(seed=3)
    loose(model)
    q, v = model.q, model.v
    J = model.frame("glove").jacobian_operator(wrt="body7", axes="aligned")
    for i in range(0, model.nv, 4):
        assert_close(numbers(J.diff(i), q, v), along(model, J, i, q, v), i)


def test_they_are_expressions_of_the_algebra():
    """J ℳ⁻¹ J*, the relative compliance, is applied by sweeps; a node's own Jacobian is Θ → R⁶ of the same numbers."""
    model = every_kind(seed=4)
    bodies = loose(model)
    J = model.frame("glove").jacobian_operator(wrt="body7")
    compliance = J @ (model.soa.MM + model.soa.J).inv() @ J.T
    dense = J.dense() @ model.mass_matrix_inverse(model.q) @ J.dense().T
    x = np.arange(1.0, 7)
    assert np.abs(compliance @ x - dense @ x).max() <= 1e-9 * np.abs(dense @ x).max()
    assert "dense" not in J.explain() and "dense" not in J.dot().explain()
    own = model.frame(bodies[3]).jacobian_operator()
    assert near(own.dense(), model.soa.Jacobian(bodies[3]).dense())


def test_the_set_of_operators_has_them_too():
    model = every_kind(seed=5)
    loose(model)
    J = model.soa.Jacobian("glove", relative_to="body7", axes="world", coordinates=[0, 1])
    assert near(J.dense(), model.frame("glove").jacobian(wrt="body7", axes="world", coordinates=[0, 1]))
    assert model.soa.Jacobian("body7").codomain == model.soa.NodesV("body7")
    with pytest.raises(pc.EvaluationError, match="B takes no relative_to, axes or coordinates; Jacobian does"):
        model.soa.B("body7", relative_to="body3")
    with pytest.raises(pc.ModelError, match="one frame, not 2"):
        model.soa.Jacobian(["body7", "body3"], relative_to="body1")
    with pytest.raises(pc.ModelError, match="has no frames: it is not a complete multibody model"):
        model.soa.grouped([["body0", "body1"]]).Jacobian("body7", relative_to="body3")
    with pytest.raises(pc.EvaluationError, match="axes='bdy'"):
        model.soa.Jacobian("body7", axes="bdy")


def test_operators_know_of_no_time():
    model = every_kind(seed=6)
    model.add_frame("swing", on="body3", motion=lambda t: np.eye(4))
    model.add_frame("upon", on="swing")
    with pytest.raises(
        pc.ModelError, match="frame 'swing' is moved by a function of time, and operators do not depend on time; compute arrays instead"
    ):
        model.frame("body8").jacobian_operator(wrt="upon")
    with pytest.raises(pc.ModelError, match="'swing'"):
        model.frame("body8").jacobian_operator(axes="upon")
