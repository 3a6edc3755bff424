"""One singular state in a batch: refused by its number, masked by NaN, or damped; the others have what they have alone."""

import numpy as np
import pytest

import pycraft as pc

HAND = "wrist_3_link"
SINGULAR = [0.3, -1, 0, 0.4, 0.5, 0.1]  # the elbow stretched


@pytest.fixture
def arm():
    return pc.robots.ur5()


@pytest.fixture
def q(arm):
    return np.array([arm.random_state(seed=1).q, SINGULAR, arm.random_state(seed=2).q])


def test_refusals_tell_the_state(arm, q):
    for call in (
        lambda: arm.operational_space_inertia(HAND, q),
        lambda: arm.operational_space_inertia(HAND, q, form="ud"),
        lambda: arm.operational_space_inertia(HAND, q, precision="extended"),
        lambda: arm.operational_space_inertia(HAND, q, threads=2),
        lambda: arm.task_space(HAND, q).inertia,
        lambda: arm.task_space(HAND, q, np.zeros((3, 6))).torques(np.ones((3, 6))),
        lambda: arm.task_space(HAND, q).force(np.ones(6)),
        lambda: arm.task_space(HAND, q).inertia_derivative,
        lambda: arm.soa.Lambda(HAND).at(q).dense(),
    ):
        with pytest.raises(pc.SingularOperatorError, match="state 1 of a batch of 3"):
            call()
    with pytest.raises(pc.SingularOperatorError, match=r"no motion along .*on_singular='nan' or 'damped'"):
        arm.operational_space_inertia(HAND, q)


@pytest.mark.parametrize("how", [{}, {"form": "ud"}, {"precision": "extended"}, {"threads": 2}])
def test_masked(arm, q, how):
    """The others to the last bit where each is computed by itself."""
    inertia = arm.operational_space_inertia(HAND, q, on_singular="nan", **how)
    assert np.isnan(inertia[1]).all()
    for b in (0, 2):
        np.testing.assert_array_equal(inertia[b], arm.operational_space_inertia(HAND, q[b], **how))
    assert np.isnan(arm.operational_space_inertia(HAND, q[1], on_singular="nan", **how)).all()


def test_a_masked_task_space(arm, q):
    """Regular states by the decomposition have what they have alone, 1e-12 at conditions up to 1e3."""
    ones = np.ones((3, 6))
    space = arm.task_space(HAND, q, on_singular="nan")
    assert space.singular.tolist() == [False, True, False]
    for values in (space.inertia, space.torques(ones), space.force(ones), space.dynamically_consistent_inverse, space.null_space):
        assert np.isnan(values[1]).all() and np.isfinite(values[[0, 2]]).all()
    assert np.isfinite(space.compliance).all() and np.isfinite(space.acceleration(ones)).all()
    alone = arm.task_space(HAND, q[2])
    assert alone.singular is False or not alone.singular
    np.testing.assert_allclose(space.inertia[2], alone.inertia, rtol=1e-10, atol=1e-10 * np.abs(alone.inertia).max())
    np.testing.assert_allclose(space.torques(ones)[2], alone.torques(np.ones(6)), rtol=1e-10, atol=1e-10)
    np.testing.assert_array_equal(arm.task_space(HAND, q[[0, 2]], on_singular="nan").inertia, arm.task_space(HAND, q[[0, 2]]).inertia)


@pytest.mark.parametrize("damping", [0.02, 0.2])
def test_damped(arm, q, damping):
    """Against a dense decomposition of its own: singular values of J L⁻* over the directions' own, of damping at least."""
    space = arm.task_space(HAND, q, on_singular="damped", damping=damping)
    inertia = space.inertia
    assert np.isfinite(inertia).all()
    for b in range(3):
        J, M = arm.jacobian(HAND, q[b]), arm.mass_matrix(q[b])
        compliance = J @ np.linalg.solve(M, J.T)
        d = np.sqrt(compliance.diagonal())
        values, U = np.linalg.eigh(compliance / np.outer(d, d))
        expected = (U / np.maximum(values, damping**2)) @ U.T / np.outer(d, d)
        np.testing.assert_allclose(inertia[b], expected, rtol=0, atol=1e-9 * np.abs(expected).max())
        np.testing.assert_allclose(
            space.dynamically_consistent_inverse[b], np.linalg.solve(M, J.T) @ expected, atol=1e-8 * np.abs(expected).max()
        )
        torques = arm.task_space(HAND, q[b], on_singular="damped", damping=damping).torques(np.ones(6))
        np.testing.assert_allclose(torques, J.T @ expected @ (1 - space.bias()[b]), rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(arm.operational_space_inertia(HAND, q, on_singular="damped", damping=damping), inertia, rtol=1e-13)
    assert np.abs(inertia).max() <= 6 / (damping * space._parts[1].min()) ** 2


def test_damping_changes_nothing_away_from_singular_states(arm, q):
    clear = q[[0, 2]]
    least = arm.task_space(HAND, clear, on_singular="nan")._parts[3].min()
    damped = arm.task_space(HAND, clear, on_singular="damped", damping=least / 2).inertia
    np.testing.assert_allclose(damped, arm.task_space(HAND, clear).inertia, rtol=1e-9, atol=1e-9 * np.abs(damped).max())


def test_torques_stay_within_bounds_near_a_singular_pose(arm):
    """1e-10 rad off: 1e10 N m by the exact inertia."""
    near = np.array(SINGULAR) + [0, 0, 1e-10, 0, 0, 0]
    assert np.abs(arm.task_space(HAND, near).torques(np.ones(6))).max() > 1e6
    assert np.abs(arm.task_space(HAND, near, on_singular="damped").torques(np.ones(6))).max() < 1e4


def test_more_directions_than_coordinates():
    arm = pc.chain(2)
    space = arm.task_space("body1", [[0.1, 0.5], [0.2, 0.0]], on_singular="damped")
    assert np.isfinite(space.inertia).all() and np.isfinite(space.torques(np.ones(6))).all()
    assert space.singular.all()
    assert np.isnan(arm.task_space("body1", [0.1, 0.5], on_singular="nan").inertia).all()


def test_options_that_are_not_there(arm, q):
    with pytest.raises(pc.EvaluationError, match="on_singular='skip' of a task space: there are 'raise', 'nan', 'damped'"):
        arm.task_space(HAND, q, on_singular="skip")
    with pytest.raises(pc.EvaluationError, match="on_singular='skip'"):
        arm.operational_space_inertia(HAND, q, on_singular="skip")
    for damping in (0, -1.0, 1.0, np.nan):
        with pytest.raises(pc.Error, match="damping"):
            arm.task_space(HAND, q, on_singular="damped", damping=damping)
    with pytest.raises(pc.EvaluationError, match="in form 'fast' and double precision"):
        arm.operational_space_inertia(HAND, q, on_singular="damped", form="ud")
    with pytest.raises(pc.EvaluationError, match="no derivative where singular values cross"):
        arm.task_space(HAND, q, on_singular="damped").inertia_derivative.sum()


def test_calls_that_go_state_by_state_tell_which():
    """A mass on the axis of a massless body at the second of three states."""
    model = pc.Multibody("gyroscope")
    model.add_body("ring", None, "pin", axis=(0, 0, 1))
    model.add_body("mass", "ring", "pin", axis=(0, 1, 0), mass=1.0, com=(0, 0, 1))
    q, v = np.array([[0, 0.3], [0, 0.0], [0, 0.5]]), np.zeros((3, 2))
    scene, told = pc.Scene(model).add(pc.effects.Gravity((0, 0, -9.81))), "state 1 of a batch of 3"
    for call in (
        lambda: scene.linearize(q, v),
        lambda: model.linearize(q, v),
        lambda: model.hybrid_dynamics_derivatives(q, v, v, v, "mass"),
    ):
        with pytest.raises(pc.SingularHingeError, match=told):
            call()
    bars = pc.chain(3)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    square, still = [np.pi / 2, -np.pi / 2, -np.pi / 2], np.zeros((3, 3))
    states = np.array([square, [0, 0, np.pi], square])  # the flat one is singular
    for call in (
        lambda: bars.linearize(states, still, loops=True),
        lambda: bars.constrained_inverse_dynamics_derivatives(states, actuated="hinge0"),
        lambda: bars.equilibrium(q0=states, loops=True),
    ):
        with pytest.raises(pc.EvaluationError, match=told):
            call()
    with pytest.raises(pc.EvaluationError, match="no equilibrium was found.*state 1 of a batch of 2"):
        pc.chain(1).equilibrium(tau=[[0.0], [1.0]], q0=[0.1])
    assert bars.linearize(states[:1], still[:1], loops=True)  # and of one state says no number


def test_other_batched_calls_tell_the_state():
    """One massless body on a hinge of its own: ℳ is singular at every state, and each call says at which it found out first."""
    arm = pc.chain(2)
    arm.add_body("feather", "body1", axis=(0, 0, 1))
    q, v = np.zeros((3, 3)), np.zeros((3, 3))
    for call in (
        lambda: arm.forward_dynamics(q, v, v),
        lambda: arm.hybrid_dynamics(q, v, v, v, prescribed="hinge0" if "hinge0" in arm.hinges else list(arm.hinges)[0]),
        lambda: arm.mass_matrix_inverse(q),
        lambda: arm.forward_dynamics_derivatives(q, v, v),
        lambda: arm.task_space("body1", q).inertia,
        lambda: arm.task_space("body1", q).bias(),
        lambda: arm.constrained_dynamics(q, v, v),
    ):
        with pytest.raises(pc.Error, match="state 0 of a batch of 3"):
            call()
