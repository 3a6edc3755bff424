"""Loops embedded in a tree: against dense matrices of the tree, minimum-norm forces of constraint, and differences along the loops.

Tolerances: rounding times the condition of Q_d, below 100 here; differences over 1e-5 leave 1e-8 of their third derivatives and rounding.
"""

import pickle

import numpy as np
import pytest

import pycraft as pc
from pycraft.dynamics.embedding import embedded_accelerations
from support.closed_models import MODELS, MOVING, closed_four_bar, spatial, two_loops

STEP = 1e-5


@pytest.fixture(scope="module", params=MODELS)
def model(request):
    return MODELS[request.param]()


@pytest.fixture(scope="module", params=MOVING)
def moving(request):
    return MOVING[request.param]()


def forces_of_least_norm(model, q, v, tau):
    """θ̈_free - ℳ⁻¹Q*λ with any λ that keeps the rows, dense."""
    A = np.array([model.inverse_dynamics(q, np.zeros(model.nv), e) for e in np.eye(model.nv)])
    A -= model.inverse_dynamics(q, np.zeros(model.nv), np.zeros(model.nv))
    Q, free = model.loops.jacobian(q), model.forward_dynamics(q, v, tau)
    multipliers = np.linalg.lstsq(Q @ np.linalg.solve(A, Q.T), Q @ free + model.loops.bias(q, v), rcond=1e-10)[0]
    return free - np.linalg.solve(A, Q.T @ multipliers)


def test_letters(model):
    """ℳ_C = X*ℳX, J_C = X*JX, QX = 0, H_C φ_C = X*Hφ by inverses, in quad too."""
    soa = model.soa.embedded()
    X = soa.X_r.dense()
    assert np.linalg.matrix_rank(model.loops.jacobian()) == model.nv - X.shape[1]
    assert np.abs(model.loops.jacobian() @ X).max() < 1e-13
    assert np.allclose(X[soa.independent], np.eye(X.shape[1]))
    whole = X.T @ (model.soa.MM + model.soa.J).dense() @ X
    for precision in ("double", "quad"):
        found, inverse = (op.at(precision=precision).dense().astype(float) for op in (soa.MM + soa.J, (soa.MM + soa.J).inv()))
        assert np.allclose(found, whole, rtol=1e-12, atol=1e-12)
        assert np.allclose(inverse, np.linalg.inv(whole), rtol=1e-11, atol=1e-11)
    mixed = soa.X_r.T @ model.soa.MM @ soa.X_r - soa.MM  # one expression of letters of both trees
    assert float(mixed.norm()) < 1e-12 * np.abs(whole).max()
    assert np.allclose(soa.velocity.dense(), (soa.phi.T @ soa.H.T @ soa.theta_dot).dense())


def test_theorems(model):
    assert model.soa.embedded().check(states=2)


def test_accelerations(moving):
    """θ̈ of the closed model, one state and a batch."""
    model, rng = moving, np.random.default_rng(6)
    tau = rng.normal(size=(3, model.nv))
    soa = model.soa.embedded()
    states = [soa.random_state(rng) for _ in tau]
    expected = np.array([forces_of_least_norm(model, s.q, s.v, t) for s, t in zip(states, tau, strict=True)])
    q, v = np.array([s.q for s in states]), np.array([s.v for s in states])
    independent = [model.coordinate_names[i] for i in soa.independent]
    found = embedded_accelerations(model, q, v, tau, independent)
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-9)
    assert np.allclose(embedded_accelerations(model, states[0], tau=tau[0]), expected[0], rtol=1e-9, atol=1e-9)


def test_derivatives(moving):
    """Along independent coordinates and along time, against differences of states on the loops."""
    model, soa = moving, moving.soa.embedded()
    X, v = soa.X_r.dense(), np.array(model.v)
    rolls = not model.loops.of_positions.all()
    for i, w in [*enumerate(X.T), (None, v)]:
        there, back = (model.integrate(model.q, step * w) for step in (STEP, -STEP))
        if not rolls:
            there, back = model.assemble(there, starts=1).q, model.assemble(back, starts=1).q
        for op in (soa.X_r, soa.H, soa.E, soa.J, soa.P, (soa.MM + soa.J).inv()):
            difference = (op.at(there).dense() - op.at(back).dense()) / (2 * STEP)
            exact = (op.dot() if i is None else op.diff(soa._source.coordinate_names[i])).dense()
            assert np.abs(difference - exact).max(initial=0) < 1e-7 * max(1, np.abs(exact).max(initial=0)), op


def test_states_of_independent_coordinates():
    model = closed_four_bar()
    soa = model.soa.embedded([model.coordinate_names[0]])
    state = soa.state([1.25], [2.0])
    assert state.q[0] == 1.25 and state.v[0] == 2.0
    assert np.abs(model.loops.residual(state.q)).max() < 1e-15 and np.abs(model.loops.jacobian(state.q) @ state.v).max() < 1e-14
    with pytest.raises(pc.ModelError, match="takes 1 numbers"):
        soa.state([1.0, 2.0])
    with pytest.raises(pc.ModelError, match="finite numbers"):
        soa.state([1.0], [np.nan])


@pytest.mark.parametrize("name", ["four-bar", "spatial"])
def test_written_out(name):
    """The recursion in Python, run, gives the numbers; X_r is given."""
    soa = MODELS[name]().soa.embedded()
    for op in ((soa.MM + soa.J).inv(), soa.MM, soa.X_r, soa.X_r.T @ soa.unconstrained.MM @ soa.X_r):
        x, names = np.random.default_rng(9).normal(size=op.shape[1]), {"__name__": "written"}
        written = op.algorithm("python")
        exec(compile(written.python(), "written.py", "exec"), names)
        expected = op @ x
        assert np.allclose(names["algorithm"](written.data(), x), expected, rtol=1e-11, atol=1e-11 * np.abs(expected).max())


def test_bodies_and_coordinates_of_each_set():
    """Overlapping loops form one node, and so do loops on two roots; outboard bodies are not part of it."""
    names = two_loops().soa.embedded()._source.body_names
    assert names == ["body0+body1+body2+body3+body4+body5", "body6+body7+body8"]
    source = spatial().soa.embedded()._source
    assert source.body_names == ["body0", "body1+body2+body3+body5+body6", "body4"] and source.parents == [-1, 0, 1]
    nested = pc.tree([-1, 0, 1, 2, 3], ["pin"] * 5, seed=1)
    nested.add_coupling({"hinge0": 1.0, "hinge1": -1.0}, name="inner")
    nested.add_coupling({"hinge3": 1.0, "hinge4": 2.0}, name="outer")
    nested.q = np.zeros(5)
    assert nested.soa.embedded()._source.body_names == ["body0+body1", "body2", "body3+body4"]


def test_bad_states_and_welds():
    model = closed_four_bar()
    for call in (
        lambda: model.soa.embedded(q="x"),
        lambda: embedded_accelerations(model, "x"),
        lambda: embedded_accelerations(model, tau="x"),
    ):
        with pytest.raises(pc.ModelError, match="not an array of numbers"):
            call()
    with pytest.raises(pc.ModelError, match="of as many states"):
        embedded_accelerations(model, np.tile(model.q, (2, 1)), np.zeros((3, 3)))
    weld = pc.Multibody("weld")
    weld.add_body("a", None, "weld", mass=1.0)
    assert embedded_accelerations(weld).shape == (0,)
    held = pc.chain(2)
    held.add_coupling({"hinge0": 1.0}, name="first")
    held.add_coupling({"hinge1": 1.0}, name="second")
    assert held.soa.embedded().X_r.shape == (2, 0) and not embedded_accelerations(held, tau=[1.0, 2.0]).any()


def test_copies_and_edits():
    model = closed_four_bar()
    soa = model.soa.embedded()
    again = pickle.loads(pickle.dumps(soa))
    assert np.array_equal(again.MM.dense(), soa.MM.dense()) and again.independent == soa.independent
    before = soa.MM.dense()
    model.bodies["rocker"].mass = 3.0
    assert not np.allclose(soa.MM.dense(), before)
    model.add_coupling({model.coordinate_names[0]: 1.0}, name="held")
    with pytest.raises(pc.StaleOperatorError, match="loops of 'four-bar' changed"):
        soa.MM.dense()


def test_refusals():
    """Off the loops, velocities that break them, coordinates that tell nothing, dead points, flat linkages."""
    model = closed_four_bar()
    first, second, third = model.coordinate_names
    soa = model.soa.embedded([first])
    with pytest.raises(pc.EvaluationError, match="not on its loops: row 'closure: along"):
        soa.MM.at([1.0, 0.0, 0.0]).dense()
    with pytest.raises(pc.EvaluationError, match="velocities of 'four-bar' break row 'closure: along"):
        soa.theta_dot.at(model.q, [1.0, 0.0, 0.0]).dense()
    wrongs = (
        ([first, second], r"are 1 coordinate"),
        (["elbow"], "no coordinate or hinge"),
        ("crank", "a list"),
        ([first] * 2, "twice"),
        (3, "a list"),
    )
    for wrong, text in wrongs:
        with pytest.raises(pc.ModelError, match=text):
            model.soa.embedded(wrong)
    # the crank in line with the ground: the angle between coupler and rocker has an extremum there, and tells nothing
    dead = model.assemble([0.0, -0.8, -1.6], fix=[first], starts=40).q
    by_rocker = model.soa.embedded([third])
    with pytest.raises(pc.EvaluationError, match=f"do not follow from '{third}', which are no .*; '({first}|{second})' are"):
        by_rocker.MM.at(dead).dense()
    with pytest.raises(pc.ModelError, match="do not determine the others"):
        model.soa.embedded([third], q=dead)
    with pytest.raises(pc.EvaluationError, match="row 'closure: about x' hangs on the others, and is broken"):
        soa.MM.diff(model.hinges[second].symbol("axis", "x")).dense()
    bars = pc.chain(3)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    with pytest.raises(pc.ModelError, match="singular at this state"):
        bars.soa.embedded(q=[0, 0, np.pi])
    with pytest.raises(pc.ModelError, match="tau of .* is nan at"):
        embedded_accelerations(model, tau=[np.nan, 0, 0])
    with pytest.raises(pc.ModelError, match="not a complete multibody model"):
        soa.embedded()


def test_without_loops():
    arm = pc.chain(3, seed=1)
    soa = arm.soa.embedded()
    assert np.array_equal(soa.X_r.dense(), np.eye(3)) and np.allclose(soa.MM.dense(), arm.soa.MM.dense())
    tau = np.array([1.0, 2.0, 3.0])
    assert np.allclose(embedded_accelerations(arm, tau=tau), arm.forward_dynamics(arm.q, arm.v, tau))
    assert embedded_accelerations(arm, np.zeros((0, 3)), np.zeros((0, 3))).shape == (0, 3)
