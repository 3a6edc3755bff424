"""The state of a call: one rule for direct calls, expressions and certificates. Jacobians in other axes, against other frames."""

import inspect

import numpy as np
import pytest

import pycraft as pc
from pycraft.dynamics.constrained import ConstrainedDynamics, ConstrainedVelocities
from pycraft.dynamics.inverse_on_loops import ConstrainedForces
from pycraft.dynamics.quadratic import QuadraticModel
from pycraft.dynamics.task_space import TaskSpace
from pycraft.linear.linear_model import LinearModel
from pycraft.models.limits import LimitDistances
from pycraft.models.mobility import Mobility
from pycraft.view.shares import Shares
from support.mechanisms import every_kind, uniform_batch

FRAMES = {
    "task_space",
    "jacobian",
    "pose",
    "jacobian_dot",
    "jacobian_derivative",
    "operational_space_inertia",
    "operational_space_compliance",
}
TAU_OR_VDOT = {"interbody_forces", "interbody_forces_derivatives"}  # one of them, tau here
OTHERWISE = {
    "integrate_ode",
    "certify",
    "identify",
    "reattach",
    "mobility_along",
    "view",
    "rerootings",
}  # from a state on, of a whole log or motion, of one hinge, of a tree on a free root
NOT_OF_A_STATE = {"inertial_parameters", "prepare"}


def calls(model):
    """Every direct call that takes q, by name, with the names of its other arguments up to the options."""
    found = {}
    for name, function in inspect.getmembers(type(model), lambda member: inspect.isfunction(inspect.unwrap(member))):
        parameters = inspect.signature(function).parameters
        if name.startswith("_") or "q" not in parameters or name in OTHERWISE:
            continue
        found[name] = [p for p in parameters if p in ("v", "tau", "vdot", "p") and not (p == "vdot" and name in TAU_OR_VDOT)]
    return found


def leaves(x):
    if isinstance(x, LinearModel):
        return [x.A, x.B, x.C, x.D, x.rate, x.q, x.v]
    if isinstance(x, QuadraticModel):
        return [*leaves(x.linear), *x.tensors()]
    if isinstance(x, (ConstrainedDynamics, ConstrainedVelocities)):
        return [x.vdot if isinstance(x, ConstrainedDynamics) else x.v, x.multipliers]
    if isinstance(x, ConstrainedForces):
        return [x.tau, x.multipliers]
    if isinstance(x, Shares):
        return [x.values]
    if isinstance(x, LimitDistances):
        return [x.lower, x.upper]
    if isinstance(x, Mobility):
        return [x.singular_values, x.freedoms]
    if isinstance(x, TaskSpace):
        return [x.jacobian, x.velocity, x.bias()]
    if hasattr(x, "lines"):  # a picture: what it is drawn of
        return [np.stack(line.get_data_3d()) for line in x.lines]
    return [np.asarray(y) for y in (x if isinstance(x, tuple) else x.values() if isinstance(x, dict) else (x,))]


def same(a, b):
    return all(np.array_equal(x, y) for x, y in zip(leaves(a), leaves(b), strict=True))


@pytest.mark.parametrize("name", calls(pc.chain(1)))
def test_every_direct_call_takes_a_state_or_the_models_own(name):
    model = every_kind(rotor_inertia=True)
    others = calls(model)[name]
    state, now = model.random_state(5), pc.State(np.array(model.q), np.array(model.v))
    if name in ("refinement", "diagonalised_dynamics"):
        model = pc.chain(3, seed=1)
        state, now = model.random_state(5), model.random_state(6)
        model.q, model.v = now.q, now.v
    frame = ("body7",) if name.startswith("operational") else ("body1",) if name in FRAMES else ()  # body7 moves in every direction
    options = {"tau": np.arange(model.nv) / 10, "vdot": np.arange(model.nv) / 5, "p": np.ones(model.nv)}
    inputs = {key: options[key] for key in others if key != "v"} | ({"rng": 1} if name == "equipartition" else {})
    call = getattr(model, name)

    def at(q, v):
        return call(*frame, q, **({"v": v} if "v" in others else {}), **inputs)

    assert same(call(*frame, state, **inputs), at(state.q, state.v))
    assert same(call(*frame, **inputs), at(now.q, now.v))
    if "v" in others:
        zero = np.zeros(model.nv)
        assert same(call(*frame, state.q, **inputs), at(state.q, zero))
        assert same(call(*frame, state, now.v, **inputs), at(state.q, now.v))
        assert same(call(*frame, v=state.v, **inputs), at(now.q, state.v))
        assert same(call(*frame, state, now, **inputs), at(state.q, now.v))
    for key in inputs:
        if key not in ("p", "rng"):
            rest = {k: x for k, x in inputs.items() if k != key}
            assert same(call(*frame, state, **rest), call(*frame, state, **rest, **{key: np.zeros(model.nv)}))


def test_expressions_by_the_same_rule():
    model = every_kind()
    other = model.random_state(7)
    e = model.soa.velocity
    now = pc.State(np.array(model.q), np.array(model.v))

    def value(*args, **kwargs):
        return e.at(*args, **kwargs).value()

    expected = value(other.q, other.v)
    assert np.array_equal(value(other), expected)
    assert np.array_equal(value(), e.value())
    assert np.array_equal(value(v=other.v), value(now.q, other.v)) and not np.array_equal(value(v=other.v), e.value())
    assert np.array_equal(value(other, now.v), value(other.q, now.v))
    assert not value(other.q).any()


def test_operators_of_two_models_are_not_put_at_the_state_of_one():
    a, b = pc.chain(2), pc.chain(2)
    a.q = [0.3, 0.4]
    both = a.soa.D.logdet() + b.soa.D.logdet()
    with pytest.raises(pc.EvaluationError, match="operators of two models"):
        both.at(precision="quad")
    b.q = a.q
    assert np.isclose(float(both.at(precision="quad")), float(both))


def test_motions_and_certificates_by_the_same_rule():
    arm = pc.chain(2, seed=1)
    state = arm.random_state(3)
    arm.q, arm.v = state.q, state.v
    times = [0, 0.1]
    expected = arm.integrate_ode(state.q, state.v, times)
    for q, v in ((state, None), (None, None), (None, state.v)):
        assert np.array_equal(arm.integrate_ode(q, v, times).q, expected.q)
    assert np.array_equal(arm.integrate(state, state), arm.integrate(state.q, state.v))
    assert np.array_equal(arm.difference(state, state), np.zeros(2))
    assert arm.certify(seconds=0).error == arm.certify(state, seconds=0).error


# ---------------------------------------------------------------------- jacobians
def moved(model, frame, relative_to, q, v, h):
    """Pose of the frame in the other one a time h later."""
    at = model.integrate(q, h * np.asarray(v))
    X = model.pose(frame, at)
    return X if relative_to is None else np.linalg.solve(model.pose(relative_to, at), X)


@pytest.mark.parametrize("axes", ["body", "aligned", "world"])
@pytest.mark.parametrize("relative_to", [None, "body1", "body10", "tool"])
def test_jacobians_are_the_derivatives_of_poses(axes, relative_to):
    model = every_kind()
    model.add_node("tool", "body5", position=(0.1, 0.2, 0.3), rotation=np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]))
    state, h = model.random_state(3), 1e-6
    X = moved(model, "body9", relative_to, state.q, state.v, 0)
    rate = (moved(model, "body9", relative_to, state.q, state.v, h) - moved(model, "body9", relative_to, state.q, state.v, -h)) / (2 * h)
    turning = rate[:3, :3] @ X[:3, :3].T
    w, v = np.array([turning[2, 1], turning[0, 2], turning[1, 0]]), rate[:3, 3]
    if axes == "body":
        w, v = X[:3, :3].T @ w, X[:3, :3].T @ v
    if axes == "world":
        v = v - np.cross(w, X[:3, 3])
    found = model.jacobian("body9", state, axes=axes, relative_to=relative_to) @ state.v
    # Central differences: h² of third derivatives, eps/h of rounding, in poses of a few metres at a few rad/s.
    assert np.abs(found - np.r_[w, v]).max() < 1e-8 * (1 + np.abs(np.r_[w, v]).max())


def test_jacobians_of_batches_and_into_arrays():
    model = every_kind()
    Q, _ = uniform_batch(model, 3)
    for options in ({}, {"axes": "world"}, {"relative_to": "body2"}, {"axes": "aligned", "relative_to": "body2", "precision": "quad"}):
        J = model.jacobian("body9", Q, **options)
        for b in range(3):
            assert np.allclose(J[b], model.jacobian("body9", Q[b], **options), rtol=0, atol=1e-14)
        out = np.empty_like(J)
        assert model.jacobian("body9", Q, **options, out=out) is out and np.array_equal(out, J)
    assert not model.jacobian("body9", relative_to="body9").any()
    with pytest.raises(pc.EvaluationError, match=r"axes='local' of a Jacobian: there are 'body', 'aligned', 'world'"):
        model.jacobian("body9", axes="local")
    with pytest.raises(pc.ModelError, match="is called 'nowhere'"):
        model.jacobian("body9", relative_to="nowhere")


# ---------------------------------------------------------------------- what is composed
def test_the_mass_matrix_and_its_inverse_by_name():
    model = every_kind(rotor_inertia=True)
    soa = model.soa
    MM, MM_inv = soa("MM MM_inv")
    assert MM == soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T and MM_inv == MM.inv()
    assert np.allclose((MM + soa.J).dense(), model.mass_matrix())
    assert "MM" in dir(soa) and "MM_inv" in soa._ipython_key_completions_()


def test_keys_complete():
    arm = pc.chain(2)
    arm.add_node("tip", "body1")
    assert arm.bodies._ipython_key_completions_() == ["body0", "body1"]
    assert arm.hinges._ipython_key_completions_() == ["hinge0", "hinge1"]
    assert arm.nodes._ipython_key_completions_() == ["tip"]
    assert "tip" in arm.nodes and "body0" not in arm.nodes and "body0" in arm.bodies and 3 not in arm.bodies
    with pytest.raises(KeyError, match="'body0' is a body of"):
        arm.nodes["body0"]


def test_inertia_along_directions():
    """(C B*ΩB C*)⁻¹ against the dense formula, also where all six directions have none."""
    arm = pc.chain(3, seed=4)
    q = arm.random_state(2).q
    arm.q = q
    J = arm.jacobian("body2", q)
    inverse = J @ np.linalg.inv(arm.mass_matrix(q)) @ J.T
    rows = np.random.default_rng(0).normal(size=(2, 6))
    for directions, C in ((["x", "z"], np.eye(6)[[3, 5]]), ("ry", np.eye(6)[[1]]), (rows, rows), (rows[0], rows[:1])):
        found = arm.soa.Lambda("body2", directions=directions).dense()
        expected = np.linalg.inv(C @ inverse @ C.T)
        assert np.abs(found - expected).max() <= 1e-9 * np.abs(expected).max()
    for wrong, says in (
        (["x", "x"], "different ones of rx"),
        (["up"], "different ones of rx"),
        (np.ones((2, 5)), r"rows \(k, 6\), not \(2, 5\)"),
        (np.ones((2, 6)), "linearly dependent"),
    ):
        with pytest.raises(pc.EvaluationError, match=says):
            arm.soa.Lambda("body2", directions=wrong)
    with pytest.raises(pc.EvaluationError, match="Jacobian takes no directions; Lambda does"):
        arm.soa.Jacobian("body2", directions=["x"])


def test_short_rank_of_lambda_is_named_with_its_remedy():
    arm = pc.chain(3, seed=4)
    with pytest.raises(pc.SingularOperatorError, match=r"directions="):
        arm.soa.Lambda("body2").dense()


def test_a_scalar_shows_its_value():
    arm = pc.chain(2)
    assert repr(arm.soa.D.logdet()).startswith("<scalar ln det D = -")
    assert f"{float(arm.soa.D.logdet()):.10g}" in repr(arm.soa.D.logdet())
    assert repr(arm.soa.D.trace().at(np.zeros((3, 2)))) == "<scalar tr(D), at 3 states>"
    stale = arm.soa.D.logdet()
    arm.add_body("more", "body1", mass=1.0)
    assert repr(stale) == "<scalar ln det D>"
