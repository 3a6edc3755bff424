"""Task space: dense computations in quad precision, what cannot move by name, forward and inverse dynamics, poses near singular ones."""

import re

import numpy as np
import pytest

import pycraft as pc
from support.differences import difference
from support.kernel_cases import MODELS
from support.mechanisms import every_kind
from support.oracle import ROUNDING, agree

NAMES = ["panda", "tree of ball", "tree of free", "tree of screw", "every kind"]
REDUNDANT = ["panda", "tree of free"]


def model_of(name):
    return every_kind() if name == "every kind" else MODELS[name]


def ends(model):
    """A body at the end of the longest way, and one near the root."""
    bodies = list(model.bodies)
    return bodies[-1], bodies[len(bodies) // 2]


@pytest.mark.parametrize("name", NAMES)
def test_against_dense_computations(name):
    model = model_of(name)
    state, (tip, middle) = model.random_state(3), ends(model)
    rng = np.random.default_rng(1)
    tau = rng.uniform(-1, 1, model.nv)
    J = np.vstack([model.jacobian(tip, state.q)[3:], model.jacobian(middle, state.q)[[0, 5]]])
    rate = np.vstack([model.jacobian_dot(tip, state.q, state.v)[3:], model.jacobian_dot(middle, state.q, state.v)[[0, 5]]])
    task = model.task_space({tip: ["x", "y", "z"], middle: ["rx", "z"]}, state.q, state.v)
    assert task.names == (*(f"{tip}.{axis}" for axis in "xyz"), f"{middle}.rx", f"{middle}.z")
    M = model.mass_matrix(state.q)
    compliance = J @ np.linalg.solve(M, J.T)
    condition = np.linalg.cond(M)
    agree(task.jacobian, J)
    agree(task.velocity, J @ state.v)
    agree(task.compliance, compliance, ROUNDING * condition)
    vdot = model.forward_dynamics(state.q, state.v, tau)
    agree(task.bias(tau), J @ vdot + rate @ state.v, ROUNDING * condition)
    if np.linalg.matrix_rank(J) < 5:
        assert task.rank == np.linalg.matrix_rank(J) and len(task.lost) == 5 - task.rank
        return
    assert task.rank == 5 and task.lost == []
    condition *= np.linalg.cond(compliance)
    agree(task.inertia, np.linalg.inv(compliance), ROUNDING * condition)
    agree(task.dynamically_consistent_inverse, np.linalg.solve(M, J.T) @ np.linalg.inv(compliance), ROUNDING * condition)
    agree(J @ task.null_space, np.zeros((5, model.nv)), ROUNDING * condition)
    agree(task.null_space @ task.null_space, task.null_space, ROUNDING * condition)
    agree(task.null_space.T @ M @ task.dynamically_consistent_inverse, np.zeros((model.nv, 5)), ROUNDING * condition)
    # forces on the nodes, as hinge forces do them
    F, wanted = rng.uniform(-1, 1, (2, 5))
    pushed = model.forward_dynamics(state.q, state.v, tau + J.T @ F)
    agree(task.acceleration(F, tau), J @ pushed + rate @ state.v, ROUNDING * condition)
    agree(task.acceleration(task.force(wanted, tau), tau), wanted, ROUNDING * condition)
    moved = model.forward_dynamics(state.q, state.v, task.torques(wanted, tau))
    agree(J @ moved + rate @ state.v, wanted, ROUNDING * condition)


@pytest.mark.parametrize("name", REDUNDANT)
def test_whole_frames_are_the_direct_call(name):
    model = model_of(name)
    state, (tip, _) = model.random_state(5), ends(model)
    task, inertia = model.task_space(tip, state.q), model.operational_space_inertia(tip, state.q)
    agree(task.inertia, inertia, ROUNDING * np.linalg.cond(inertia))
    agree(task.compliance, model.operational_space_compliance(tip, state.q), ROUNDING * np.linalg.cond(model.mass_matrix(state.q)))


@pytest.mark.parametrize("name", REDUNDANT)
def test_forces_of_the_null_space_accelerate_no_task(name):
    model = model_of(name)
    state, (tip, _) = model.random_state(4), ends(model)
    task = model.task_space({tip: ["x", "y"]}, state.q, state.v)
    idle = np.random.default_rng(2).uniform(-1, 1, model.nv)
    agree(task.bias(task.null_space.T @ idle), task.bias(), ROUNDING * np.linalg.cond(model.mass_matrix(state.q)))
    agree(task.torques(np.zeros(2), idle) - task.torques(np.zeros(2)), task.null_space.T @ idle, 1e-9)


def test_batches_are_their_states():
    model = MODELS["panda"]
    states = [model.random_state(seed) for seed in range(4)]
    Q, V = (np.array([getattr(s, x) for s in states]) for x in "qv")
    task = model.task_space("panda_link7", Q, V)
    wanted = np.random.default_rng(0).uniform(-1, 1, (4, 6))
    for b, state in enumerate(states):
        one = model.task_space("panda_link7", state.q, state.v)
        for what in ("jacobian", "velocity", "compliance", "inertia", "dynamically_consistent_inverse", "null_space"):
            agree(getattr(task, what)[b], getattr(one, what), 1e-9)
        agree(task.torques(wanted)[b], one.torques(wanted[b]), 1e-9)
    assert task.rank.tolist() == [6] * 4 and task.lost == [[]] * 4
    empty = model.task_space("panda_link7", Q[:0], V[:0])
    assert empty.inertia.shape == (0, 6, 6) and empty.rank.shape == (0,)
    Q[2] = 0.0
    Q[2, 3] = 0.0  # stretched
    with pytest.raises(pc.SingularOperatorError, match="at state 2 of a batch of 4"):
        model.task_space("panda_link7", Q, V).inertia  # noqa: B018 - raises


def test_the_jacobian_rate_is_that_of_the_velocity():
    model = MODELS["tree of ball"]
    state, (tip, _) = model.random_state(2), ends(model)
    vdot = np.random.default_rng(3).uniform(-1, 1, model.nv)
    tau = model.inverse_dynamics(state.q, state.v, vdot)

    def velocity(h):
        q = model.integrate(state.q, h * state.v + h * h / 2 * vdot)
        return model.task_space({tip: ["x", "ry"]}, q, state.v + h * vdot).velocity

    agree(model.task_space({tip: ["x", "ry"]}, state.q, state.v).bias(tau), difference(velocity), 1e-6)  # of a motion to second order


@pytest.mark.parametrize("name", NAMES)
def test_the_recursion_and_the_decomposition_agree(name, monkeypatch):
    """Everything by Ω's recursion, and by the singular values of J L⁻*, which states near singular poses are left to."""
    model = model_of(name)
    states = [model.random_state(seed) for seed in range(3)]
    Q, V = (np.array([getattr(s, x) for s in states]) for x in "qv")
    tip, middle = ends(model)
    directions = {tip: ["x", "y", "z"]} if name == "panda" else {tip: [[0.0, 0, 0, 1, 0.5, 0], [0.2, 0, 0, 0, 1, 0]], middle: ["rx"]}
    task = model.task_space(directions, Q, V)
    if task._factor is None:
        assert task.rank.min() < len(task.names)
        return
    condition = max(np.linalg.cond(model.mass_matrix(q)) for q in Q) * max(np.linalg.cond(one) for one in task.compliance)
    monkeypatch.setattr(pc.dynamics.task_space, "SHARED", 2.0)  # no pivot is that
    other = model.task_space(directions, Q, V)
    monkeypatch.setattr(pc.dynamics.task_space.TaskSpace, "_by_recursion", None)
    assert other._factor is None and other.rank.tolist() == task.rank.tolist() and other.lost == task.lost
    wanted = np.random.default_rng(1).uniform(-1, 1, (3, len(task.names)))
    for what in ("compliance", "inertia", "dynamically_consistent_inverse", "null_space"):
        agree(getattr(other, what), getattr(task, what), ROUNDING * condition)
    agree(other.torques(wanted), task.torques(wanted), ROUNDING * condition)


# What cannot move -----------------------------------------------------------------------------------------------------


def test_what_cannot_move_is_named():
    arm = pc.chain(2)
    tip = arm.task_space({"body1": ["rz", "x", "y"]}, [0.0, 0.0])
    assert tip.rank == 2 and tip.lost == [{"body1.x": 1.0}]
    bent = arm.task_space({"body1": ["rz", "x", "y"]}, [0.0, 0.3])
    assert bent.rank == 2 and len(bent.lost) == 1 and "body1.x" in bent.lost[0]
    shares = np.array([bent.lost[0].get(name, 0.0) for name in bent.names])
    agree(shares @ bent.jacobian, np.zeros(2))
    for call in (lambda: tip.inertia, lambda: tip.force([0, 0, 0])):
        with pytest.raises(pc.SingularOperatorError, match=r"of body1.rz, body1.x, body1.y no motion along body1.x$"):
            call()
    assert arm.task_space({"body1": ["rz", "y"]}, [0.0, 0.0]).inertia.shape == (2, 2)
    with pytest.raises(pc.SingularOperatorError, match="There is no motion along body1.rx; body1.ry; body1.x; body1.z"):
        arm.operational_space_inertia("body1", [0.0, 0.0])


def test_what_rounding_moves_does_not_move():
    """A planar arm in a plane that is no coordinate plane: out of it the Jacobian is rounding, which is no motion."""
    R = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    R *= np.linalg.det(R)
    arm = pc.Multibody("tilted")
    for k in range(4):
        position = R[:, 0] if k else (0, 0, 0)
        arm.add_body(
            f"b{k}", f"b{k - 1}" if k else None, axis=R[:, 2], position=position, mass=1.0, com=R[:, 0] / 2, inertia=np.eye(3) / 10
        )
    arm.add_node("tip", "b3", rotation=R)
    q = [0.3, 0.5, -0.7, 0.4]
    whole = arm.task_space("tip", q)
    assert whole.rank == 3 and whole.lost == [{"tip.rx": 1.0}, {"tip.ry": 1.0}, {"tip.z": 1.0}] and whole.jacobian[5].any()
    assert arm.task_space({"tip": ["rz", "x", "y"]}, q).rank == 3
    with pytest.raises(pc.SingularOperatorError, match="of tip.rz, tip.x, tip.z no motion along tip.z$"):
        arm.task_space({"tip": ["rz", "x", "z"]}, q).inertia  # noqa: B018 - raises


def test_torques_along_what_moves():
    arm = pc.chain(2)
    tip = arm.task_space({"body1": ["rz", "x", "y"]}, [0.0, 0.0], [0.0, 0.0])
    vdot = arm.forward_dynamics([0, 0], [0, 0], tip.torques([1.0, 0.0, 2.0]))
    agree(tip.jacobian @ vdot, [1.0, 0.0, 2.0])
    with pytest.raises(pc.SingularOperatorError, match="an acceleration with parts along lost directions"):
        tip.torques([1.0, 0.5, 2.0])


@pytest.mark.parametrize("power", [2, 4, 6])
def test_near_a_singular_pose_few_digits_are_lost(power):
    """A two-link arm at an elbow angle of 10⁻ᵖ: Λ along the arm is 10²ᵖ, and is found to about 10ᵖ roundings; by inverting Λ⁻¹ to 10²ᵖ."""
    arm, q = pc.chain(2), [0.2, 10.0**-power]
    arm.add_node("tip", "body1", position=(1, 0, 0))
    found = arm.task_space({"tip": ["x", "y"]}, q).inertia
    J = arm.soa.Jacobian("tip").at(q, precision="quad").dense(dtype=object)[[3, 4]]
    M = arm.soa.MM.at(q, precision="quad").dense(dtype=object)
    inverse = lambda A: np.array([[A[1, 1], -A[0, 1]], [-A[1, 0], A[0, 0]]], dtype=object) / (A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0])
    exact = inverse(J @ inverse(M) @ J.T).astype(float)
    assert np.abs(found - exact).max() < 100 * np.finfo(float).eps * 10.0**power * np.abs(exact).max()
    assert arm.task_space({"tip": ["x", "y"]}, q).rank == 2


# Derivatives of the operators -----------------------------------------------------------------------------------------


def test_derivatives_of_the_operators():
    """∂𝒥 and ∂Λ by the tangent rule, against differences."""
    model = MODELS["panda"]
    state = model.random_state(6)
    for operator in (model.soa.Jacobian("panda_link7"), model.soa.Lambda("panda_link7")):
        for i in (0, 3):
            moved = lambda h, i=i, of=operator: of.at(model.integrate(state.q, h * np.eye(7)[i])).dense()
            found = operator.diff(i).at(state.q).dense()
            agree(found, difference(moved), 1e-8 * max(1.0, np.abs(found).max()))


@pytest.mark.parametrize("name", ["panda", "tree of ball", "tree of free"])
def test_derivatives(name):
    """∂J, ∂(Λ⁻¹) and ∂Λ along coordinates and quasi-velocities, against differences of what is rounded to double."""
    model = MODELS[name]
    state, (tip, middle) = model.random_state(6), ends(model)
    directions = {tip: ["x", "y"], middle: ["rx"]}
    task = model.task_space(directions, state.q)
    assert task.rank == 3
    size = ROUNDING * 1e3 * np.linalg.cond(model.mass_matrix(state.q)) * np.linalg.cond(task.compliance)
    for i, e in enumerate(np.eye(model.nv)):
        at = lambda h, e=e: model.task_space(directions, model.integrate(state.q, h * e))
        agree(task.jacobian_derivative[..., i], difference(lambda h, at=at: at(h).jacobian), 1e-9)
        for what in ("compliance", "inertia"):
            agree(getattr(task, f"{what}_derivative")[..., i], difference(lambda h, at=at, what=what: getattr(at(h), what)), size)
    batch = model.task_space(directions, np.array([state.q, model.random_state(7).q]))
    for what in ("jacobian_derivative", "compliance_derivative", "inertia_derivative"):
        agree(getattr(batch, what)[0], getattr(task, what), 1e-10)


def test_derivatives_with_rotors_and_of_the_operator():
    """For whole frames they equal the derivatives of the operator Λ; rotor inertias are in Λ but not in its derivative."""
    model = MODELS["panda"]
    for hinge in model.hinges.values():
        hinge.rotor_inertia = 0.2
    try:
        state = model.random_state(6)
        found, operator = model.task_space("panda_link7", state.q).inertia_derivative, model.soa.Lambda("panda_link7")
        for i in range(7):
            known = operator.diff(i).at(state.q).dense()
            agree(found[..., i], known, ROUNDING * np.linalg.cond(operator.at(state.q).dense()))
    finally:
        for hinge in model.hinges.values():
            hinge.rotor_inertia = 0.0


@pytest.mark.parametrize(
    ("frames", "text"),
    [
        ("hand", "is called 'hand'"),
        ([], "a task space needs frames"),
        (["body1", "body1"], "frame 'body1' is named twice"),
        ({"body1": ["x", "w"]}, "directions of 'body1' must be different ones of rx, ry, rz, x, y, z, or rows (k, 6); not ['x', 'w']"),
        ({"body1": ["x", "x"]}, "directions of 'body1' must be different ones"),
        ({"body1": 3}, "directions of 'body1' must be rows (k, 6), not ()"),
        ({"body1": []}, "directions of 'body1' must be different ones"),
        ({"body1": [[1, 0, 0]]}, "directions of 'body1' must be rows (k, 6), not (1, 3)"),
        ({"body1": np.ones((2, 6))}, "the 2 rows are linearly dependent"),
        ({"body1": [[1, 0, 0, 0, 0, 0], [0, np.nan, 0, 0, 0, 0]]}, "directions of 'body1': row 1 is not finite"),
        ([3], "a frame"),
    ],
)
def test_refusals(frames, text):
    with pytest.raises(pc.Error, match=re.escape(text)):
        pc.chain(2).task_space(frames, [0.0, 0.0])


def test_refusals_of_vectors():
    task = pc.chain(2).task_space({"body1": ["rz", "y"]}, [0.0, 0.3])
    with pytest.raises(pc.ModelError, match=r"force takes 2 values, of body1.rz, body1.y; it has shape \(3,\)"):
        task.acceleration([1, 2, 3])
    for call, what in ((task.acceleration, "force"), (task.force, "acceleration"), (task.torques, "acceleration")):
        with pytest.raises(pc.ModelError, match=f"{what}: entry 'body1.y' is not finite"):
            call([1.0, np.nan])
    massless = pc.chain(2)
    for body in massless.bodies.values():
        body.mass, body.inertia = 0.0, np.zeros((3, 3))
    massless.take_warnings()
    with pytest.raises(pc.SingularOperatorError, match="not positive definite to rounding"):
        massless.task_space("body1", [0.0, 0.0]).compliance  # noqa: B018 - raises
    assert "task space of 'chain of 2 rods': body1.rz, body1.y" in repr(task)


@pytest.mark.parametrize("size", [1e300, 1e160, 1e-160, 1e-300])
def test_rows_whose_squares_are_no_numbers_are_refused(size):
    """Large ones overflowed with a warning of NumPy's, small ones were said not to move."""
    arm, row = pc.chain(3), np.array([[0, 0, 0, 1.0, 0, 0]])
    with pytest.raises(pc.ModelError, match="directions of 'body2': row 0, of size .* overflows: use other units"):
        arm.task_space({"body2": size * row}, [0.0, 0.5, 1.0])
    scaled = 1e99 if size > 1 else 1e-99
    Λ, found = (arm.task_space({"body2": by * row}, [0.0, 0.5, 1.0]).inertia for by in (1.0, scaled))
    assert np.allclose(found * scaled * scaled, Λ, rtol=1e-12, atol=0)
