"""Rotors that differ on balls, any on free hinges: the energy ½ v*(ℳ + J)v defines the equations, with v ×* (J v) of their own.

Oracle: the equations of Euler and Poincaré from the energy alone, `momentum_balance`. It knows mass matrices at displaced configurations
and the brackets of so(3) and se(3), and nothing of forces; differences as in `support.oracle`. Beside it `pycraft.reference`, closed forms
of one body, and the momentum of a free body.
"""

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind
from support.oracle import DIFFERENCE, ROUNDING, agree, reference
from support.rotors import ball, crossed, gyroscopic, hull, rotors_of

FORMS = ("fast", "ud", "square-root")


MODELS = {"ball": ball, "hull": hull, "every kind": lambda: every_kind(rotor_inertia=True)}
each_model = pytest.mark.parametrize("name", MODELS)


def drawn(name, seed=0):
    model = MODELS[name]()
    model.gravity = (0.0, 0.0, 0.0)
    state = model.random_state(seed)
    return model, state.q, state.v, np.random.default_rng(seed).uniform(-1, 1, model.nv)


def momentum_balance(model, q, v, vdot, h=1e-3):
    """T = π̇ + v ×* π - ∂KE/∂θ of π = (ℳ + J)v, derivatives by differences of fourth order."""

    def along(f):
        return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)

    M = model.mass_matrix(q)
    rate = along(lambda t: model.mass_matrix(model.integrate(q, t * v)))
    slope = [along(lambda t, e=e: v @ model.mass_matrix(model.integrate(q, t * e)) @ v / 2) for e in np.eye(model.nv)]
    return M @ vdot + rate @ v + crossed(model, v) @ (M @ v) - slope


@each_model
@pytest.mark.parametrize("seed", range(3))
def test_forces_follow_from_the_kinetic_energy(name, seed):
    model, q, v, vdot = drawn(name, seed)
    agree(model.inverse_dynamics(q, v, vdot), momentum_balance(model, q, v, vdot), DIFFERENCE)
    agree(model.bias_forces(q, v), momentum_balance(model, q, v, 0 * v), DIFFERENCE)
    agree(model.inverse_dynamics(q, v, vdot), reference.inverse_dynamics(model.description(), q, v, vdot))
    assert np.abs(gyroscopic(model, v)).max() > 1e-2
    assert abs(v @ gyroscopic(model, v)) < ROUNDING


@each_model
def test_accelerations_undo_forces(name):
    """Every form, precision and method, refined or not, against inverse dynamics; those of scenes' hybrid calls in test_scenes below."""
    model, q, v, vdot = drawn(name, 1)
    tau = model.inverse_dynamics(q, v, vdot)
    bound = ROUNDING * np.linalg.cond(model.mass_matrix(q))
    for form in FORMS:
        for how in (
            {}, {"refine": 1}, {"refine": 2, "residual": "wider"}, {"refine": 1, "residual": "gather"}, {"precision": "quad"},
            {"precision": 50}, {"precision": "extended", "refine": 1},
        ):  # fmt: skip
            agree(model.forward_dynamics(q, v, tau, form=form, **how), vdot, bound)
        agree(model.forward_dynamics(q, v, tau, form=form, precision="single"), vdot, 1e9 * bound)
    for method in ("cholesky", "ldl", "conjugate-gradients", "inverse", "divide-and-conquer", "realization"):
        agree(model.forward_dynamics(q, v, tau, method=method), vdot, bound)
    many = np.tile(q, (9, 1)), np.tile(v, (9, 1)) * np.linspace(0.2, 1, 9)[:, None]
    forces = np.array([model.inverse_dynamics(a, b, vdot) for a, b in zip(*many, strict=True)])
    agree(model.forward_dynamics(*many, forces), np.tile(vdot, (9, 1)), bound)
    agree(model.inverse_dynamics(*many, np.tile(vdot, (9, 1))), forces)


@each_model
def test_prescribed_coordinates_need_their_rotors_forces(name):
    model, q, v, vdot = drawn(name, 2)
    tau = model.inverse_dynamics(q, v, vdot)
    first = next(h for h in model.hinges.values() if h.v_slice.stop - h.v_slice.start > 1)
    bound = ROUNDING * np.linalg.cond(model.mass_matrix(q))
    for form in FORMS:
        found = model.hybrid_dynamics(q, v, tau, vdot, first.name, form=form)
        agree(found.vdot, vdot, bound)
        agree(found.tau, tau, bound)


@each_model
def test_derivatives(name):
    """Against fourth-order differences of the calls themselves, step 2⁻¹⁰; forces are of second degree in v, which they get exactly."""
    model, q, v, vdot = drawn(name, 3)
    tau, h, eye = model.inverse_dynamics(q, v, vdot), 2.0**-10, np.eye(model.nv)

    def along(f):
        return np.transpose([(8 * (f(h * e) - f(-h * e)) - (f(2 * h * e) - f(-2 * h * e))) / (12 * h) for e in eye])

    found = model.inverse_dynamics_derivatives(q, v, vdot)
    agree(found.v, along(lambda d: model.inverse_dynamics(q, v + d, vdot)), DIFFERENCE)
    agree(found.q, along(lambda d: model.inverse_dynamics(model.integrate(q, d), v, vdot)), DIFFERENCE)
    condition = np.linalg.cond(model.mass_matrix(q))
    for form in FORMS:
        of_forward = model.forward_dynamics_derivatives(q, v, tau, form=form)
        agree(of_forward.v, along(lambda d: model.forward_dynamics(q, v + d, tau)), DIFFERENCE * condition)
        agree(of_forward.q, along(lambda d: model.forward_dynamics(model.integrate(q, d), v, tau)), DIFFERENCE * condition)


@each_model
def test_second_derivatives(name):
    """Of accelerations, contracted, along velocities: v̇ is quadratic in v, and a difference of its gradients is exact to rounding."""
    model, q, v, _ = drawn(name, 4)
    nv, costate = model.nv, np.random.default_rng(9).uniform(-1, 1, model.nv)
    tau = np.random.default_rng(8).uniform(-1, 1, nv)
    found = model.quadratic_model(q, v, tau).contracted(np.r_[np.zeros(nv), costate])

    def gradient(v):
        return costate @ model.forward_dynamics_derivatives(q, v, tau, precision="extended").v

    expected = np.array([gradient(v + e) - gradient(v - e) for e in np.eye(nv)]) / 2
    agree(found.xx[nv:, nv:], expected, ROUNDING * np.linalg.cond(model.mass_matrix(q)))


@each_model
def test_coriolis_matrices(name):
    model, q, v, _ = drawn(name, 5)
    bias, gamma = model.bias_forces(q, v), model.christoffel(q)
    agree(np.einsum("ijk,j,k", gamma, v, v), bias)
    agree(gamma @ v, model.coriolis_matrix(q, v))
    rate = model.mass_matrix_derivative(q) @ v
    for form in ("christoffel", "skew"):
        for precision in ("double", "extended", 50) if form == "skew" else ("double", "quad"):
            C = model.coriolis_matrix(q, v, form=form, precision=precision)
            agree(C @ v, bias)
            agree(C + C.T, rate)
    # Koszul: Γ(i,j,k) - Γ(i,k,j) is the bracket [e_k, e_j] paired with e_i by ℳ + J
    M, eye = model.mass_matrix(q), np.eye(model.nv)
    brackets = np.array([[-crossed(model, a).T @ b for b in eye] for a in eye])
    agree(gamma - gamma.transpose(0, 2, 1), np.einsum("kjl,li->ijk", brackets, M))


@each_model
def test_diagonalised_and_hamiltonian_dynamics(name):
    model, q, v, vdot = drawn(name, 6)
    tau = model.inverse_dynamics(q, v, vdot)
    M = model.mass_matrix(q)
    found, rate = model.hamiltonian_dynamics(q, M @ v, tau)
    condition = np.linalg.cond(M)
    agree(found, v, ROUNDING * condition)
    agree(rate, M @ vdot + (model.mass_matrix_derivative(q) @ v) @ v, ROUNDING * condition)
    eta, S, forces = model.diagonalised_dynamics(q, v, tau)
    agree(S, -S.T, ROUNDING * condition)
    agree(eta @ eta, v @ M @ v, ROUNDING * condition)
    agree(eta @ (forces - S @ eta), v @ tau, ROUNDING * condition)  # power


def test_one_body_on_a_ball():
    """(I + J) ω̇ + ω × (I + J)ω = T, in closed form; equal rotors bring nothing, to the bit."""
    model, J = ball(), np.array([0.2, 0.85, 1.5])
    rng = np.random.default_rng(0)
    for v in rng.uniform(-2, 2, (5, 3)):
        I = np.diag([1.0, 2.0, 2.5] + J)
        agree(model.forward_dynamics(model.zero_q(), v, [0.1, 0.2, 0.3]), np.linalg.solve(I, [0.1, 0.2, 0.3] - np.cross(v, I @ v)))
        agree(model.rotor_regressor(v, [1.0, 2.0, 3.0]) @ J, J * [1, 2, 3] + np.cross(v, J * v))
        model.hinges["body"].rotor_inertia = 0.7
        assert not model.rotor_forces(v).any()
        model.hinges["body"].rotor_inertia = J


def test_identification_finds_unequal_rotors():
    """J of a ball, each on its own: the gyroscopic term is in the columns; exact data, exact to rounding."""
    model, rng = ball(), np.random.default_rng(1)
    states = [model.random_state(rng) for _ in range(20)]
    q, v, vdot = np.array([s.q for s in states]), rng.uniform(-2, 2, (20, 3)), rng.uniform(-2, 2, (20, 3))
    tau = model.inverse_dynamics(q, v, vdot)
    agree(
        np.einsum("bij,j", model.inertial_regressor(q, v, vdot), model.inertial_parameters())
        + model.rotor_regressor(v, vdot) @ rotors_of(model),
        tau,
    )
    model.hinges["body"].rotor_inertia = [1.0, 0.1, 0.4]
    found = model.identify(q, v, vdot, tau, bodies=[], rotors=True)
    agree(found.rotor_inertia, [0.2, 0.85, 1.5], 1e-10)
    agree(found.predict(q, v, vdot), tau, 1e-10)


@each_model
def test_beside_expressions(name):
    """𝒞 is Hφ(Mφ*a + b) plus the rotors' forces of the reference."""
    model, q, v, _ = drawn(name, 7)
    soa, o = model.soa, reference.operators(model.description(), q, v)
    agree(model.rotor_forces(v), o.b_J)
    agree(o.b_J, gyroscopic(model, v))
    agree(model.rotor_forces(np.array([v, 2 * v])), [o.b_J, 4 * o.b_J])
    C = soa.H @ soa.phi @ (soa.M @ soa.phi.T @ soa.a + soa.b)
    agree(C.at(q, v).value() + model.rotor_forces(v), model.bias_forces(q, v))


def test_on_loops():
    """Tree augmentation and embedding agree, and both keep the equations of motion: T + Q*λ = (ℳ + J)v̇ + 𝒞."""
    model = pc.Multibody("closed")
    inertia = np.diag([0.02, 0.1, 0.11])
    for k, kind in enumerate(("ball", "ball", "pin")):
        model.add_body(f"bar{k}", f"bar{k - 1}" if k else None, kind, axis=(0, 1, 0) if kind == "pin" else None,
                       position=(1, 0, 0) if k else (0, 0, 0), mass=1.0, com=(0.5, 0, 0), inertia=inertia)  # fmt: skip
    model.hinges["bar0"].rotor_inertia, model.hinges["bar1"].rotor_inertia = [0.1, 0.7, 0.3], [0.5, 0.2, 0.05]
    model.add_loop("bar2", hinge="ball", point=(1, 0, 0), position=(1.5, 0.2, 0.0))
    start = model.random_state(3)
    state = model.assemble(start.q, start.v)
    Q, tau = model.loops.jacobian(state), np.random.default_rng(2).uniform(-1, 1, model.nv)
    M, bias = model.mass_matrix(state.q), model.bias_forces(state.q, state.v)
    r = model.loops.bias(state)
    system = np.block([[M, -Q.T], [Q, np.zeros((len(Q), len(Q)))]])
    expected = np.linalg.lstsq(system, np.concatenate([tau - bias, -r]), rcond=1e-10)[0][: model.nv]
    bound = ROUNDING * np.linalg.cond(M) * 1e2
    agree(model.constrained_dynamics(state.q, state.v, tau).vdot, expected, bound)
    agree(model.constrained_dynamics(state.q, state.v, tau, refine=1, residual="wider").vdot, expected, bound)
    agree(model.constrained_dynamics(state.q, state.v, tau, method="embed").vdot, expected, bound)
    from pycraft.dynamics.embedding import embedded_accelerations

    agree(embedded_accelerations(model, state.q, state.v, tau), expected, bound)
    assert np.abs(gyroscopic(model, state.v)).max() > 1e-2
