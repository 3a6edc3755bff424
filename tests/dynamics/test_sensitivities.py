"""Derivatives of the direct calls, against fourth-order differences in quad precision, and against the operators.

Quad differences of step 2⁻⁷ on a state rounded to doubles: the state moves on the group in doubles, so what is compared is good to
eps/h of the quantity, and the truncation h⁴ f⁽⁵⁾/30 is near 1e-10 of it; with h = 2⁻¹⁰ both are near 1e-12.
"""

import numpy as np
import pytest

import pycraft as pc

TOLERANCE, STEP = 2e-10, 2.0**-10
KINDS = ["pin", "universal", "ball", "slider", "gimbal", "custom", "screw", "free", "planar", "cylindrical"]


def every_kind():
    mb = pc.tree([-1, 0, 1, 1, 0, 4, 5, 2, 2, 8], KINDS, seed=3)
    mb.hinges["hinge0"].rotor_inertia = mb.hinges["hinge2"].rotor_inertia = 0.3
    return mb


MODELS = {
    "every kind": every_kind,
    "floating": lambda: pc.tree([-1, 0, 0, 1, 1], ["free", "pin", "ball", "screw", "pin"], seed=1),
    "forest": lambda: pc.tree([-1, -1, 0, 1], ["ball", "pin", "universal", "slider"], seed=2),
    "chain": lambda: pc.tree([-1, 0, 1, 2], ["pin"] * 4, seed=4),
    "one ball": lambda: pc.tree([-1], ["ball"], seed=6),
    "welds kept": lambda: pc.tree([-1, 0, 1], ["pin", "weld", "gimbal"], seed=7, welds="keep"),
}


@pytest.fixture(scope="module", params=MODELS)
def case(request):
    model = MODELS[request.param]()
    model.gravity = (1, 2, -9.81)
    leaf = list(model.bodies)[-1]
    model.add_node("tip", leaf, position=(0.1, 0.2, 0.3))
    state = model.random_state(1)
    rng = np.random.default_rng(0)
    return model, state.q, state.v, rng.normal(size=model.nv), rng.normal(size=model.nv)


def difference(f, h=STEP):
    return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)


def by_q(model, f, q):
    """∂f/∂q, derivative last."""
    return np.stack([difference(lambda t, e=e: np.asarray(f(model.integrate(q, t * e)))) for e in np.eye(model.nv)], axis=-1)


def by_v(f, v):
    return np.stack([difference(lambda t, e=e: np.asarray(f(v + t * e))) for e in np.eye(len(v))], axis=-1)


def assert_close(got, expected, tolerance=TOLERANCE):
    assert got.shape == expected.shape
    error = np.abs(got - expected).max(initial=0) / (1 + np.abs(expected).max(initial=0))
    assert error <= tolerance, f"off by {error:.1e}"


def test_inverse_dynamics(case):
    m, q, v, a, _ = case
    d = m.inverse_dynamics_derivatives(q, v, a)
    assert_close(d.q, by_q(m, lambda q: m.inverse_dynamics(q, v, a, precision="quad"), q))
    assert_close(d.v, by_v(lambda v: m.inverse_dynamics(q, v, a, precision="quad"), v))
    assert_close(d.input, m.mass_matrix(q))


def test_forward_dynamics(case):
    m, q, v, _, tau = case
    d = m.forward_dynamics_derivatives(q, v, tau)
    condition = np.linalg.cond(m.mass_matrix(q))
    scale = TOLERANCE * max(1.0, condition)
    assert_close(d.q, by_q(m, lambda q: m.forward_dynamics(q, v, tau, precision="quad"), q), scale)
    assert_close(d.v, by_v(lambda v: m.forward_dynamics(q, v, tau, precision="quad"), v), scale)
    assert_close(d.input, m.mass_matrix_inverse(q))


def test_mass_matrix_and_christoffel(case):
    m, q, v, _, _ = case
    derivative = m.mass_matrix_derivative(q)
    assert_close(derivative, by_q(m, lambda q: m.mass_matrix(q, precision="quad"), q))
    assert np.array_equal(derivative, derivative.transpose(1, 0, 2))
    H, phi, M = m.soa("H phi M")
    MM = (H @ phi @ M @ phi.T @ H.T).at(q)
    for i in range(m.nv):
        assert_close(MM.diff(i).dense(), derivative[:, :, i], 1e-12)
    gamma = m.christoffel(q)
    force = m.bias_forces(q, v) - m.bias_forces(q, 0 * v)
    assert_close(np.einsum("ijk,j,k", gamma, v, v), force, 1e-12)
    rate = derivative @ v
    for form in ("christoffel", "skew"):
        C = m.coriolis_matrix(q, v, form=form)
        assert_close(C @ v, force, 1e-12)
        assert_close(rate - 2 * C, -(rate - 2 * C).T, 1e-12)
    if all(h.v_slice.stop - h.v_slice.start == 1 for h in m.hinges.values()):
        assert_close(gamma, gamma.transpose(0, 2, 1), 1e-12)
        assert_close(m.inverse_dynamics_derivatives(q, v, 0 * v).v, 2 * m.coriolis_matrix(q, v), 1e-12)
    else:  # Γ(i,j,k) - Γ(i,k,j) is the bracket's, so that Γ v is metric all the same
        assert_close(np.einsum("ijk,k", gamma, v) + np.einsum("jik,k", gamma, v), rate, 1e-12)
    with pytest.raises(pc.EvaluationError, match="form 'other' of the Coriolis matrix"):
        m.coriolis_matrix(q, v, form="other")


def test_energy_and_momentum(case):
    m, q, v, _, _ = case
    slope, momenta = m.kinetic_energy_derivatives(q, v)
    assert_close(slope, by_q(m, lambda q: m.kinetic_energy(q, v), q), 1e-9)  # energies are differenced in doubles
    assert_close(momenta, m.mass_matrix(q) @ v, 1e-12)
    h = m.momentum(q, v)
    assert_close(h.value, h.matrix @ v, 1e-14)
    assert_close(h.dq, by_q(m, lambda q: m.momentum(q, v, precision="quad").value, q), 1e-9)
    moving = by_q(m, lambda q: sum(b.mass * (m.pose(n, q)[:3, :3] @ b.com + m.pose(n, q)[:3, 3]) for n, b in m.bodies.items()), q) @ v
    assert_close(h.value[3:], moving, 1e-9)


def test_small_velocities_under_gravity_lose_nothing():
    arm = pc.robots.panda()
    arm.gravity = (0, 0, -9.81)
    state = arm.random_state(0)
    v = 1e-12 * state.v
    p = arm.mass_matrix(state.q) @ v
    momenta = arm.kinetic_energy_derivatives(state.q, v)[1]
    assert np.abs(momenta - p).max() <= 1e-14 * np.abs(p).max()
    velocity = arm.hamiltonian_dynamics(state.q, p, p)[0]
    assert np.abs(velocity - v).max() <= 1e-11 * np.abs(v).max()
    assert np.array_equal(arm.mass_matrix(state), arm.mass_matrix(state.q))  # a State stands for its q
    assert np.array_equal(arm.bias_forces(state, state), arm.bias_forces(state.q, state.v))
    V = np.stack([state.v, v])
    assert np.allclose(arm.coriolis_matrix(state.q, V, form="skew")[0], arm.coriolis_matrix(state.q, state.v, form="skew"))


def test_jacobians(case):
    m, q, v, _, _ = case
    for frame in ("tip", list(m.bodies)[0]):
        hessian = m.jacobian_derivative(frame, q)
        assert_close(hessian, by_q(m, lambda q, f=frame: m.jacobian(f, q, precision="quad"), q))
        assert_close(m.jacobian_dot(frame, q, v), hessian @ v, 1e-12)
        J = m.soa.Jacobian(frame)
        assert_close(J.dot().at(q, v).dense(), m.jacobian_dot(frame, q, v), 1e-12)
        assert_close(J.diff(m.nv - 1).at(q).dense(), hessian[:, :, -1], 1e-12)


def test_regressor(case):
    m, q, v, a, _ = case
    Y = m.inertial_regressor(q, v, a)
    assert Y.shape == (m.nv, 10 * len(m.bodies))
    rotors = m.soa.J.dense() @ a
    assert_close(Y @ m.inertial_parameters() + rotors, m.inverse_dynamics(q, v, a), 1e-12)
    body = list(m.bodies.values())[-1]
    mass = body.mass
    body.mass = mass * 1.5  # at the same centre of mass and inertia about it: linear in π
    assert_close(Y @ m.inertial_parameters() + rotors, m.inverse_dynamics(q, v, a), 1e-12)
    body.mass = mass


def test_log_determinant(case):
    m, q, _, _, _ = case
    H, phi, M, J = m.soa("H phi M J")
    logdet = (H @ phi @ M @ phi.T @ H.T + J).logdet().at(q)
    assert_close(m.log_determinant_gradient(q), np.array([float(logdet.diff(i)) for i in range(m.nv)]), 1e-11)
    by_inertia, by_placement = m.log_determinant_gradient(q, "inertias"), m.log_determinant_gradient(q, "geometry")
    for k, (body, hinge) in enumerate(zip(m.bodies.values(), m.hinges.values(), strict=True)):
        c = body.com
        with_mass = np.r_[1, c, (c @ c * np.eye(3) - np.outer(c, c))[np.triu_indices(3)]]
        assert abs(float(logdet.diff(body.symbol("mass"))) - by_inertia[k] @ with_mass) <= 1e-10 * (1 + norm(by_inertia[k]))
        assert abs(float(logdet.diff(body.symbol("inertia", 0, 2))) - by_inertia[k][6]) <= 1e-10 * (1 + norm(by_inertia[k]))
        for x in range(3):
            shifted = np.zeros(10)
            shifted[1 + x] = body.mass
            around = body.mass * (2 * c[x] * np.eye(3) - np.outer(np.eye(3)[x], c) - np.outer(c, np.eye(3)[x]))
            shifted[4:] = around[np.triu_indices(3)]
            assert abs(float(logdet.diff(body.symbol("com", x))) - by_inertia[k] @ shifted) <= 1e-10 * (1 + norm(by_inertia[k]))
        for component in range(6):
            expected = float(logdet.diff(hinge.symbol("placement", component)))
            assert abs(by_placement[k, component] - expected) <= 1e-10 * (1 + norm(by_placement))
    axes = m.log_determinant_gradient(q, "axes")
    P_plus, G, W = m.soa.P_plus, m.soa.G, pc.blockdiag(m.soa.E.T @ m.soa.Upsilon @ m.soa.E)
    dense = 2 * (G - P_plus @ W @ G).at(q).dense()
    for j in range(m.nv):
        k = next(k for k, h in enumerate(m.hinges.values()) if h.v_slice.start <= j < h.v_slice.stop)
        assert_close(axes[j], dense[6 * k : 6 * k + 6, j], 1e-11)
    with pytest.raises(pc.EvaluationError, match="there are coordinates, inertias, geometry, axes"):
        m.log_determinant_gradient(q, "colours")


def norm(x):
    return float(np.linalg.norm(x))


def test_hamiltonian_and_diagonalised_forms(case):
    m, q, v, _, tau = case
    p = m.mass_matrix(q) @ v
    velocity, p_rate = m.hamiltonian_dynamics(q, p, tau)
    condition = np.linalg.cond(m.mass_matrix(q))
    assert_close(velocity, v, 1e-13 * condition)
    vdot = m.forward_dynamics(q, v, tau)
    expected = m.mass_matrix_derivative(q) @ v @ v + m.mass_matrix(q) @ vdot
    assert_close(p_rate, expected, 1e-12 * condition)
    xi, epsilon = m.innovations(q, v, tau)
    D = m.soa.D.at(q)
    assert abs(xi @ (D @ xi) - 2 * m.kinetic_energy(q, v)) <= 1e-11 * (1 + abs(xi @ (D @ xi)))
    forces = tau - m.bias_forces(q, v)
    size = norm(forces) ** 2 * norm(D.inv().dense())
    assert abs(epsilon @ (D.inv() @ epsilon) - forces @ np.linalg.solve(m.mass_matrix(q), forces)) <= 1e-12 * condition * size
    eta, S, driven = m.diagonalised_dynamics(q, v, tau)
    assert abs(eta @ eta - 2 * m.kinetic_energy(q, v)) <= 1e-11 * (1 + eta @ eta)
    assert_close(S, -S.T, 1e-10)
    H, phi, K, D_ = m.soa("H phi K D")
    m_op = (m.soa.I + H @ phi @ K) @ D_.sqrt()
    eta_rate = m_op.dot().T.at(q, v) @ v + m_op.T.at(q) @ vdot
    assert_close(eta_rate + S @ eta, driven, 1e-10 * max(1.0, condition) ** 0.5)


def test_gravity_is_the_slope_of_potential_energy(case):
    m, q, _, _, _ = case
    H, phi, M, field = m.soa("H phi M gravity_field")
    force = -(H @ phi @ M @ field).at(q).value()
    rest = np.zeros(m.nv)
    assert_close(force, m.inverse_dynamics(q, rest, rest), 1e-12)
    assert_close(force, by_q(m, m.potential_energy, q), 1e-9)


def test_batches_and_precisions():
    m = every_kind()
    states = [m.random_state(k) for k in range(3)]
    Q, V, A = np.stack([s.q for s in states]), np.stack([s.v for s in states]), np.ones((3, m.nv))
    for call in (
        lambda q, v, a: m.inverse_dynamics_derivatives(q, v, a).q,
        lambda q, v, a: m.inverse_dynamics_derivatives(q, v, a).input,
        lambda q, v, a: m.forward_dynamics_derivatives(q, v, a).v,
        lambda q, v, a: m.mass_matrix_derivative(q),
        lambda q, v, a: m.christoffel(q),
        lambda q, v, a: m.coriolis_matrix(q, v),
        lambda q, v, a: m.coriolis_matrix(q, v, form="skew"),
        lambda q, v, a: m.momentum(q, v).dq,
        lambda q, v, a: m.momentum(q, v).value,
        lambda q, v, a: m.jacobian_dot("body9", q, v),
        lambda q, v, a: m.jacobian_derivative("body9", q),
        lambda q, v, a: m.inertial_regressor(q, v, a),
        lambda q, v, a: m.log_determinant_gradient(q, "geometry"),
        lambda q, v, a: m.hamiltonian_dynamics(q, v, a)[1],
        lambda q, v, a: m.kinetic_energy_derivatives(q, v)[0],
    ):
        whole = call(Q, V, A)
        assert whole.shape[0] == 3
        for k in range(3):
            assert_close(whole[k], call(Q[k], V[k], A[k]), 1e-13)
    q, v, a = Q[0], V[0], A[0]
    for precision in ("extended", "quad"):
        assert_close(m.forward_dynamics_derivatives(q, v, a).q, m.forward_dynamics_derivatives(q, v, a, precision=precision).q, 1e-9)
        assert_close(m.christoffel(q), m.christoffel(q, precision=precision), 1e-12)
    none = np.zeros((0, m.nq))
    assert m.mass_matrix_derivative(none).shape == (0, m.nv, m.nv, m.nv)


@pytest.mark.parametrize("shared", [(0,), (0, 2), (1,), (0, 1), (1, 2)], ids=str)
def test_what_is_of_one_state_goes_with_every_state_of_a_batch(shared):
    """As many velocities as coordinates, beside one q, are states and no columns of a matrix."""
    m = pc.tree([-1, 0], ["ball", "pin"], seed=1)
    rng = np.random.default_rng(2)
    given = [np.array([m.random_state(k).q for k in range(m.nv)]), *rng.normal(size=(2, m.nv, m.nv))]
    given = [x[0] if k in shared else x for k, x in enumerate(given)]
    one = lambda i: [x if k in shared else x[i] for k, x in enumerate(given)]
    for call in (m.innovations, m.diagonalised_dynamics, lambda q, v, tau: m.hamiltonian_dynamics(pc.State(q, v), None, tau)):
        found = call(*given)
        for i in range(m.nv):
            for x, y in zip(found, call(*one(i)), strict=True):
                assert_close(x[i], y, 1e-13)


def test_no_coordinates_and_singular_hinges():
    bench = pc.Multibody("bench", welds="keep")
    bench.add_body("table", hinge="weld", mass=1.0, inertia=np.eye(3))
    nothing = np.zeros(0)
    assert bench.mass_matrix_derivative(nothing).shape == (0, 0, 0)
    assert bench.inertial_regressor(nothing, nothing, nothing).shape == (0, 10)
    assert bench.log_determinant_gradient(nothing).shape == (0,)
    arm = pc.Multibody("arm")
    arm.add_body("link", mass=1.0, com=(1, 0, 0))
    arm.add_body("tip", "link", axis=(1, 0, 0), position=(1, 0, 0))
    arm.take_warnings()
    zero = np.zeros(2)
    for call in (
        lambda: arm.forward_dynamics_derivatives(zero, zero, zero),
        lambda: arm.log_determinant_gradient(zero),
        lambda: arm.hamiltonian_dynamics(zero, zero, zero),
    ):
        with pytest.raises(pc.SingularHingeError, match="'tip'"):
            call()
    assert np.isfinite(arm.inverse_dynamics_derivatives(zero, zero, zero).q).all()
    with pytest.raises(pc.ModelError, match="v of 'arm' takes 2 numbers"):
        arm.inverse_dynamics_derivatives(zero, np.zeros(3), zero)
    with pytest.raises(pc.ModelError, match="nan|finite|NaN"):
        arm.christoffel([np.nan, 0])
