"""`on_singular="minimum-norm"`: least squares of smallest norm, as `numpy.linalg.pinv` of the mass matrix, in every form."""

import mpmath
import numpy as np
import pytest

import pycraft as pc
from support.descriptions import body, model, random_inertia, subhinge
from support.exact_accelerations import relative_error
from support.forms import FORMS
from support.formulas import EPS
from support.oracle import reference
from support.singular_hinges import REGULAR, ROUNDED, SINGULAR, SKEW, at_random_state

each_form = pytest.mark.parametrize("form", FORMS)


def pseudoinverse(A):
    """A⁺ of a symmetric positive semidefinite matrix of mpmath numbers, by its eigenvalues; what is below 1e-25 of the largest is zero."""
    values, vectors = mpmath.eigsy(mpmath.matrix(A.tolist()))
    largest = max(abs(x) for x in values)
    n = len(A)
    V = np.array(vectors.tolist(), object).reshape(n, n)
    inverse = np.array([1 / x if x > 1e-25 * largest else mpmath.mpf(0) for x in values], object)
    return (V * inverse) @ V.T


def least_squares(arm, q, v, tau):
    """(ℳ + J)⁺(T − 𝒞) in 60 digits."""
    with mpmath.workdps(60):
        exact = q * mpmath.mpf(1)
        o = reference.operators(arm.description(), exact, v)
        return pseudoinverse(o.mass_matrix + o.J) @ (tau - reference.bias_forces(arm.description(), exact, v))


def several_singular_hinges():
    """Two massless wrists on one arm, and a rod about its own axis: three singular hinges in one tree."""
    solid = dict(mass=2.0, com=[0.1, 0.2, 0.3], inertia=random_inertia(np.random.default_rng(1), 2.0))
    made = [
        body("b0", -1, [subhinge("pin", SKEW)], **solid),
        body("b1", 0, [subhinge("pin", [1, 0, 0])], 0.0, position=[1, 0, 0]),
        body("b2", 0, [subhinge("ball")], 0.0, position=[0, 1, 0]),
        body("b3", 0, [subhinge("pin", [1, 0, 0])], 1.0, [0.5, 0, 0], np.diag([0, 1 / 12, 1 / 12]), position=[0, 0, 1]),
    ]
    return model(made, (0, 0, -9.8))


def ball_with_one_noise_direction():
    """A rod on a ball spins about its own axis for nothing; askew, so that the axis is found only by rounding."""
    axis = np.array([1.0, 2.0, 2.0]) / 4
    inertia = (axis @ axis * np.eye(3) - np.outer(axis, axis)) / 2
    arm = body("b0", -1, [subhinge("pin", [0, 1, 0])], 1.0, [0.3, 0, 0], np.eye(3))
    return model([arm, body("b1", 0, [subhinge("ball")], 1.0, axis, inertia)], (1.0, 0, -9.8))


MINIMUM = {name: SINGULAR[name][0] for name in SINGULAR if name not in ROUNDED}
MINIMUM |= {"several singular hinges": several_singular_hinges, "a ball with one noise direction": ball_with_one_noise_direction}


@each_form
@pytest.mark.parametrize("name", MINIMUM)
def test_minimum_norm_is_the_pseudoinverse(name, form):
    """For forces that the mechanism can balance, and for any: θ̈ of least squares and smallest norm. Masses of about 1 kg, so that the
    condition of what is regular says how far rounding goes."""
    arm = at_random_state(MINIMUM[name](), 1)
    rng = np.random.default_rng(3)
    MM = reference.mass_matrix(arm.description(), arm.q)
    consistent = MM @ rng.normal(size=arm.nv) + reference.bias_forces(arm.description(), arm.q, arm.v)
    regular = np.linalg.svd(MM, compute_uv=False)
    condition = regular[0] / regular[regular > 1e-10 * regular[0]].min() if regular[0] > 0 else 1.0
    for tau in (consistent, rng.normal(size=arm.nv)):
        exact = np.asarray(least_squares(arm, arm.q, arm.v, tau), float)
        got = arm.forward_dynamics(arm.q, arm.v, tau, form=form, on_singular="minimum-norm")
        assert np.abs(got - exact).max() <= 1e4 * EPS * condition * (1 + np.abs(exact).max() + np.abs(tau).max())
    inverse = arm.mass_matrix_inverse(arm.q, form=form, on_singular="minimum-norm")
    with mpmath.workdps(60):
        o = reference.operators(arm.description(), arm.q * mpmath.mpf(1))
        exact = np.asarray(pseudoinverse(o.mass_matrix + o.J), float)
    assert np.abs(inverse - exact).max() <= 1e4 * EPS * condition * (1 + np.abs(exact).max())
    wide = arm.mass_matrix_inverse(arm.q, form=form, on_singular="minimum-norm", precision="quad")
    assert np.abs(wide - exact).max() <= 4 * EPS * (1 + np.abs(exact).max())
    assert np.abs(inverse - np.linalg.pinv(MM, rcond=1e-10, hermitian=True)).max() <= 1e4 * EPS * condition * (1 + np.abs(exact).max())


@each_form
@pytest.mark.parametrize("residual", ["same", "wider"])
def test_minimum_norm_takes_refinement(residual, form):
    """At a singular state too: a heavy tip beyond a hinge that feels nothing."""
    rng = np.random.default_rng(1)
    axes = [axis / np.linalg.norm(axis) for axis in rng.normal(size=(8, 3))]
    masses = [1.0] * 7 + [1e8]
    made = [
        body(f"b{k}", k - 1, [subhinge("pin", axis)], mass, [0.3, 0.1, 0], mass * np.eye(3), position=[0.5, 0, 0.2])
        for k, (axis, mass) in enumerate(zip(axes, masses, strict=True))
    ]
    made.append(body("b8", 0, [subhinge("pin", [1, 0, 0])], 0.0, position=[0, 1, 0]))
    arm = at_random_state(model(made, (0, 0, -9.8)))
    tau = np.random.default_rng(2).normal(size=arm.nv)
    exact = np.asarray(least_squares(arm, arm.q, arm.v, tau), float)
    error = {}
    for steps in (0, "auto"):
        options = {"refine": steps, "residual": residual if steps else "same", "on_singular": "minimum-norm"}
        error[steps] = relative_error(arm.forward_dynamics(arm.q, arm.v, tau, form=form, **options), exact)
    assert error["auto"] <= 1e-13 and (form != "fast" or error[0] >= 100 * error["auto"]), error


def coaxial():
    """A wrist whose first and last pins turn about one axis at q₁ = 0: the direction that nothing moves is not a coordinate."""
    made = [body("b0", -1, [subhinge("pin", [0, 0, 1])], 0.0), body("b1", 0, [subhinge("pin", [1, 0, 0])], 0.0)]
    made.append(body("b2", 1, [subhinge("pin", [0, 0, 1])], 1.0, [0.3, 0.1, 0], np.eye(3)))
    return at_random_state(model(made, (0.5, 0, -9.8)))


@each_form
@pytest.mark.parametrize("residual", ["same", "gather", "wider"])
def test_refinement_sees_the_singular_model(residual, form):
    """And not the one with the inertia that is added to solve it, which is not zero times the answer here."""
    arm = coaxial()
    q, v, tau = np.array([0.4, 0.0, 0.2]), np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, 3.0])
    exact = np.asarray(least_squares(arm, q, v, tau), float)
    with mpmath.workdps(60):
        inverse = np.asarray(pseudoinverse(reference.operators(arm.description(), q * mpmath.mpf(1)).mass_matrix), float)
    options = {"form": form, "refine": 2, "residual": residual, "on_singular": "minimum-norm"}
    assert relative_error(arm.forward_dynamics(q, v, tau, **options), exact) <= 1e-14
    assert np.abs(arm.mass_matrix_inverse(q, **options) - inverse).max() <= 1e-14 * np.abs(inverse).max()


@each_form
def test_what_nothing_moves_is_taken_out_of_a_long_solution(form):
    """A rod on a screw of small pitch on a massless slider: the solution of the regularised system is 1/pitch times as long as the
    answer, and once it is projected, eps/pitch of it is left along the direction that nothing moves."""
    pitch = 1.1e-6
    made = [body("b0", -1, [subhinge("slider", [0, 0, 1])], 0.0)]
    made.append(body("b1", 0, [subhinge("screw", [0, 0, 1], pitch=pitch)], 1.3, [0, 0, 0.25], np.diag([1.0, 1.0, 0])))
    arm = at_random_state(model(made, (0, 0, -8.1)))
    q, v, tau = np.array([0.3, -0.7]), np.zeros(2), np.array([3.1, 3.1 * pitch])
    exact = np.asarray(least_squares(arm, q, v, tau), float)
    found = arm.forward_dynamics(q, v, tau, form=form, on_singular="minimum-norm")
    assert np.abs(found / exact - 1).max() <= 1e-6 and relative_error(found, exact) <= 1e-14
    along = np.array([1.0, pitch])  # the inverse on what moves: along along*/(m |along|⁴)
    inverse = arm.mass_matrix_inverse(q, form=form, on_singular="minimum-norm")
    assert np.abs(inverse - np.outer(along, along) / (1.3 * (along @ along) ** 2)).max() <= 1e-14


@each_form
@pytest.mark.parametrize("name", ["inner body massless, outboard pin across", "massless tip with a rotor", "near its axis"])
def test_minimum_norm_of_what_is_regular_is_the_answer(name, form):
    """No singular hinge, no difference: the same bits."""
    arm = at_random_state(REGULAR[name]())
    x = np.ones(arm.nv)
    plain = arm.forward_dynamics(arm.q, arm.v, x, form=form)
    assert np.array_equal(plain, arm.forward_dynamics(arm.q, arm.v, x, form=form, on_singular="minimum-norm"))


def test_minimum_norm_of_a_batch():
    """States with and without a singular hinge: two pins whose axes meet in line at q₀ only."""
    upper = body("b0", -1, [subhinge("pin", [0, 0, 1])], 0.0)
    middle = body("b1", 0, [subhinge("pin", [1, 0, 0])], 0.0)
    lower = body("b2", 1, [subhinge("pin", [0, 0, 1])], 1.0, [0.3, 0.1, 0], np.eye(3))
    arm = at_random_state(model([upper, middle, lower]))
    Q = np.array([[0.4, 0.0, 0.2], [0.4, 1.0, 0.2], [-1.0, 0.0, 0.7]])  # b0 and b2 turn about one axis where q₁ = 0
    V, tau = np.zeros((3, 3)), np.array([[1.0, 2.0, 3.0]] * 3)
    got = arm.forward_dynamics(Q, V, tau, on_singular="minimum-norm")
    for q, v, t, x in zip(Q, V, tau, got, strict=True):
        exact = np.asarray(least_squares(arm, q, v, t), float)
        assert np.abs(x - exact).max() <= 1e5 * EPS * (1 + np.abs(exact).max())
    with pytest.raises(pc.SingularHingeError):
        arm.forward_dynamics(Q, V, tau)
