"""Quadratic models: against differences in quad on the group, SymPy, the integrators' own steps, and dynamic programming that they drive.

Tolerances. Second differences of fourth order with step h = 2⁻⁷ of results that are rounded to double lose 5 eps/h² = 2e-11 of the
values' size to rounding and h⁴/90 = 4e-11 of the sixth derivative to truncation, which is some hundreds of the second one: NEAR. First
differences of first derivatives, each right to rounding, are as tests/linear/test_linearization.py has it: 1e-8.
"""

import re

import numpy as np
import pytest

import pycraft as pc
from support.differences import difference
from support.kernel_cases import MODELS
from support.oracle import agree

NAMES = ["panda", "tree of ball", "tree of free", "tree of universal", "tree of planar", "tree of screw", "rotors", "welds kept"]
STEPS = ["semi-implicit-euler", "rkmk4"]
NEAR, H = 1e-7, 2.0**-7


def at_random(model, seed=3):
    rng = np.random.default_rng(seed)
    state = model.random_state(seed)
    return state.q, state.v, rng.uniform(-1, 1, model.nv)


def second(f, h=H):
    """d²f/ds² at 0, fourth order."""
    return np.asarray(16 * (f(h) + f(-h)) - (f(2 * h) + f(-2 * h)) - 30 * f(0.0)) / (12 * h * h)


def along(hessian, z, n):
    x, u = z[:n], z[n:]
    return x @ hessian.xx @ x + 2 * x @ hessian.xu @ u + u @ hessian.uu @ u


@pytest.mark.parametrize("name", NAMES)
def test_accelerations_against_differences_of_first_derivatives(name):
    """Every entry: along coordinates the mean of both orders, as exponential coordinates have it."""
    model = MODELS[name]
    q, v, tau = at_random(model)
    nv, costate = model.nv, np.random.default_rng(5).uniform(-1, 1, model.nv)
    found = model.quadratic_model(q, v, tau).contracted(np.r_[np.zeros(nv), costate])

    def gradient(q, v, tau):
        return costate @ np.hstack(model.forward_dynamics_derivatives(q, v, tau, precision="quad"))

    rows = np.array([difference(lambda h, e=e: gradient(model.integrate(q, h * e), v, tau)) for e in np.eye(nv)])
    of_v = np.array([difference(lambda h, e=e: gradient(q, v + h * e, tau)) for e in np.eye(nv)])
    expected = np.block([[(rows[:, :nv] + rows[:, :nv].T) / 2, rows[:, nv : 2 * nv]], [of_v[:, : 2 * nv]]])
    agree(found.xx, expected, 1e-8)
    agree(found.xu, np.vstack([rows[:, 2 * nv :], of_v[:, 2 * nv :]]), 1e-8)
    assert not found.uu.any() and not found.xu[nv:].any()


@pytest.mark.parametrize("name", NAMES)
def test_the_state_equation_along_motions(name):
    """Along random directions on the group, accelerations themselves; and how fast two motions part, as `difference` measures it."""
    model = MODELS[name]
    q, v, tau = at_random(model)
    nv, rng = model.nv, np.random.default_rng(4)
    near = model.quadratic_model(q, v, tau)
    for _ in range(3):
        z, costate = rng.uniform(-0.5, 0.5, 3 * nv), rng.uniform(-1, 1, nv)
        move, faster, push = np.split(z, 3)
        vdot = lambda s: costate @ model.forward_dynamics(model.integrate(q, s * move), v + s * faster, tau + s * push, precision="quad")  # noqa: B023 - called here
        agree(along(near.contracted(np.r_[0 * costate, costate]), z, 2 * nv), second(vdot), NEAR)

        def apart(s, move=move, faster=faster, costate=costate):
            begun = model.integrate(q, s * move), v + s * faster
            after = lambda h: model.difference(model.integrate(q, h * v), model.integrate(begun[0], h * begun[1]))
            return costate @ difference(after, 2.0**-8)

        agree(along(near.contracted(np.r_[costate, 0 * costate]), z, 2 * nv), second(apart, 2.0**-5), 1e-6)  # whose values have 1e-12


@pytest.mark.parametrize("integrator", STEPS)
@pytest.mark.parametrize("name", NAMES)
def test_steps_against_the_integrator(name, integrator):
    """First and second derivatives of the core's own steps, taken in quad, along random directions of states and inputs."""
    model = MODELS[name]
    q, v, tau = at_random(model)
    nv, h, rng = model.nv, 0.05, np.random.default_rng(6)
    near = model.quadratic_model(q, v, tau).discrete(h, integrator)

    def stepped(q, v, tau):
        run = model.integrate_ode(q, v, [0.0, h], tau=tau, integrator=integrator, step=h, precision="quad")
        return np.r_[model.difference(near.after.q, run.q[-1]), run.v[-1]]

    agree(stepped(q, v, tau), np.r_[np.zeros(nv), near.after.v], 1e-12)
    for _ in range(3):
        z, costate = rng.uniform(-0.5, 0.5, 3 * nv), rng.uniform(-1, 1, 2 * nv)
        moved = lambda s: stepped(model.integrate(q, s * z[:nv]), v + s * z[nv : 2 * nv], tau + s * z[2 * nv :])  # noqa: B023 - called here
        agree(np.hstack([near.A, near.B]) @ z, difference(moved), 1e-8)
        agree(along(near.contracted(costate), z, 2 * nv), second(lambda s: costate @ moved(s)), NEAR)  # noqa: B023 - called here


@pytest.mark.parametrize("name", ["panda", "tree of ball", "tree of free"])
def test_explicit_euler(name):
    """q⁺ = q exp(h v), v⁺ = v + h v̇."""
    model = MODELS[name]
    q, v, tau = at_random(model)
    nv, h, rng = model.nv, 0.1, np.random.default_rng(8)
    near = model.quadratic_model(q, v, tau).discrete(h, "euler")
    agree(near.after.q, model.integrate(q, h * v))
    z, costate = rng.uniform(-0.5, 0.5, 3 * nv), rng.uniform(-1, 1, 2 * nv)

    def stepped(s):
        at_q, at_v = model.integrate(q, s * z[:nv]), v + s * z[nv : 2 * nv]
        vdot = model.forward_dynamics(at_q, at_v, tau + s * z[2 * nv :], precision="quad")
        return np.r_[model.difference(near.after.q, model.integrate(at_q, h * at_v)), at_v + h * vdot]

    agree(np.hstack([near.A, near.B]) @ z, difference(stepped), 1e-8)
    agree(along(near.contracted(costate), z, 2 * nv), second(lambda s: costate @ stepped(s)), NEAR)


def test_without_turning_hinges_rk4_is_rkmk4():
    model = MODELS["panda"]
    q, v, tau = at_random(model)
    run = model.integrate_ode(q, v, [0.0, 0.02], tau=tau, integrator="rk4", step=0.02)
    after = model.quadratic_model(q, v, tau).discrete(0.02).after
    agree(after.q, run.q[-1])
    agree(after.v, run.v[-1])


def test_a_cart_with_a_pole_in_symbols():
    """Lagrange's equations by SymPy: every second derivative of v̇ by states and inputs."""
    sympy = pytest.importorskip("sympy")
    cart = pc.Multibody("cart-pole")
    cart.add_body("cart", hinge="slider", axis=(1, 0, 0), mass=2.0)
    cart.add_body("pole", "cart", hinge="pin", axis=(0, 0, 1), mass=0.5, com=(0, -0.8, 0), inertia=np.diag([0.03, 0.03, 0.03]))
    cart.gravity = (0, -9.81, 0)
    x, angle, x_dot, rate, push, torque = names = sympy.symbols("x a u w f t")
    ml, total, about = sympy.Rational(2, 5), sympy.Rational(5, 2), sympy.Rational(35, 100)  # 0.5·0.8, 2 + 0.5, 0.03 + 0.5·0.8²
    M = sympy.Matrix([[total, ml * sympy.cos(angle)], [ml * sympy.cos(angle), about]])
    forces = sympy.Matrix([push + ml * sympy.sin(angle) * rate**2, torque - ml * sympy.Float("9.81", 30) * sympy.sin(angle)])
    vdot = M.LUsolve(forces)
    at = dict(zip(names, (0.3, 0.7, -0.2, 1.1, 0.4, -0.6), strict=True))
    q, v, tau = (np.array([at[a], at[b]]) for a, b in ((x, angle), (x_dot, rate), (push, torque)))
    agree(cart.forward_dynamics(q, v, tau), np.array(vdot.subs(at).evalf(20), float).ravel())
    found = cart.quadratic_model(q, v, tau).tensors()
    whole = np.block([[found.xx, found.xu], [np.swapaxes(found.xu, 1, 2), found.uu]])
    assert not whole[:2].any()
    for i in range(2):
        agree(whole[2 + i], np.array(sympy.hessian(vdot[i], names).subs(at).evalf(20), float))


@pytest.mark.parametrize("name", ["panda", "tree of free"])
@pytest.mark.parametrize("dt", [None, 0.03])
def test_tensors_are_what_is_contracted(name, dt):
    model = MODELS[name]
    near = model.quadratic_model(*at_random(model))
    near = near if dt is None else near.discrete(dt)
    tensors, costate = near.tensors(), np.random.default_rng(2).uniform(-1, 1, 2 * model.nv)
    for whole, contracted in zip(tensors, near.contracted(costate), strict=True):
        agree(np.einsum("i,ijk->jk", costate, whole), contracted, 1e-11)
    assert np.array_equal(tensors.xx, np.swapaxes(tensors.xx, 1, 2)) or np.allclose(tensors.xx, np.swapaxes(tensors.xx, 1, 2), atol=1e-13)
    assert dt is None or tensors.uu.any()  # the second stage feels what the input made of the first


def test_first_order_is_the_linear_model():
    model = MODELS["tree of free"]
    q, v, tau = at_random(model)
    near, linear = model.quadratic_model(q, v, tau, inputs="hinge0"), model.linearize(q, v, tau, inputs="hinge0")
    assert near.inputs == linear.inputs and near.states == linear.states and near.dt is None and near.after is None
    agree(near.A, linear.A)
    agree(near.B, linear.B)
    some, whole = near.contracted(np.ones(2 * model.nv)), model.quadratic_model(q, v, tau).contracted(np.ones(2 * model.nv))
    agree(some.xu, whole.xu[:, :6])
    step, full = near.discrete(0.02), model.quadratic_model(q, v, tau).discrete(0.02)
    agree(step.B, full.B[:, :6])
    agree(step.contracted(np.ones(2 * model.nv)).uu, full.contracted(np.ones(2 * model.nv)).uu[:6, :6])


@pytest.mark.parametrize("dt", [None, 0.02])
def test_batches_are_their_states(dt):
    model = MODELS["tree of ball"]
    Q, V, tau = (np.array(x) for x in zip(*(at_random(model, seed) for seed in range(3)), strict=True))
    costates = np.random.default_rng(1).uniform(-1, 1, (3, 2 * model.nv))
    ways = (lambda one: one) if dt is None else (lambda one: one.discrete(dt))
    whole = ways(model.quadratic_model(Q, V, tau))
    for b in range(3):
        one = ways(model.quadratic_model(Q[b], V[b], tau[b]))
        agree(whole.A[b], one.A, 1e-12)
        for all_of_them, its_own in zip(whole.contracted(costates), one.contracted(costates[b]), strict=True):
            agree(all_of_them[b], its_own, 1e-11)
        agree(whole.tensors().xx[b], one.tensors().xx, 1e-11)
    shared = ways(model.quadratic_model(Q, V[0], tau[0])).contracted(costates[0])
    agree(shared.xx[1], ways(model.quadratic_model(Q[1], V[0], tau[0])).contracted(costates[0]).xx, 1e-11)
    empty = ways(model.quadratic_model(Q[:0], V[:0], tau[:0]))
    assert empty.contracted(costates[:0]).xx.shape == (0, 2 * model.nv, 2 * model.nv) and empty.tensors().xu.shape[:2] == (0, 2 * model.nv)
    assert "0 of 'tree of ball'" in repr(empty)


@pytest.mark.parametrize("how", [{"form": "ud"}, {"form": "square-root"}, {"precision": "extended"}, {"precision": "quad"}])
def test_forms_and_precisions(how):
    model = MODELS["tree of free"]
    state, costate = at_random(model), np.random.default_rng(2).uniform(-1, 1, 2 * model.nv)
    condition = np.linalg.cond(model.mass_matrix(state[0]))
    plain, other = (model.quadratic_model(*state, **chosen).contracted(costate) for chosen in ({}, how))
    for one, two in zip(plain, other, strict=True):
        agree(one, two, 1e3 * np.finfo(float).eps * condition)
    assert not np.array_equal(plain.xx, other.xx)


def test_the_present_state_and_states():
    model = pc.chain(2)
    model.gravity = (9.81, 0, 0)
    model.q, model.v = [0.3, -0.4], [0.5, 0.6]
    one, other = model.quadratic_model(), model.quadratic_model(pc.State(np.array(model.q), np.array(model.v)))
    agree(one.contracted(np.ones(4)).xx, other.contracted(np.ones(4)).xx)
    agree(one.contracted(np.ones(4)).xx, model.quadratic_model([0.3, -0.4], [0.5, 0.6]).contracted(np.ones(4)).xx)


def test_degenerate_models():
    for nothing in (pc.Multibody("nothing"), MODELS["welds only"]):
        near = nothing.quadratic_model()
        assert near.contracted([]).xx.shape == (0, 0) and near.tensors().xu.shape == (0, 0, 0)
        assert near.discrete(0.1).contracted([]).xx.shape == (0, 0)
    massless = pc.chain(2)
    massless.bodies["body1"].mass, massless.bodies["body1"].inertia = 0.0, np.zeros((3, 3))
    massless.take_warnings()
    with pytest.raises(pc.SingularHingeError, match="hinge1"):
        massless.quadratic_model()
    inner = pc.chain(2)  # the inner one is: its outboard body has mass
    inner.bodies["body0"].mass, inner.bodies["body0"].inertia = 0.0, np.zeros((3, 3))
    inner.take_warnings()
    q, v, tau = np.array([0.3, 0.9]), np.array([0.4, -0.2]), np.array([0.1, 0.5])
    z = np.array([0.3, -0.2, 0.4, 0.1, 0.2, -0.5])
    vdot = lambda s: inner.forward_dynamics(q + s * z[:2], v + s * z[2:4], tau + s * z[4:], precision="quad")[1]
    agree(along(inner.quadratic_model(q, v, tau).contracted([0, 0, 0, 1]), z, 4), second(vdot), NEAR)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda m, f: m.quadratic_model(inputs=["elbow"]), "inputs: no hinge or coordinate"),
        (lambda m, f: m.quadratic_model([0, np.nan]), "q of hinge 'hinge1': entry 0 is nan"),
        (lambda m, f: m.quadratic_model(precision=50), "precision"),
        (lambda m, f: f.contracted([1.0, 2.0]), "takes (4,) values, of q.hinge0, q.hinge1, v.hinge0, v.hinge1; it has shape (2,)"),
        (lambda m, f: f.contracted([0, 0, np.inf, 0]), "costate: entry 2 is not finite"),
        (lambda m, f: f.discrete(-1.0), "dt=-1: a step is a positive number of seconds"),
        (lambda m, f: f.discrete([0.1, 0.2]), "dt takes one number"),
        (lambda m, f: f.discrete(0.1, "dopri5"), "integrator='dopri5': steps to second order exist for 'euler', 'semi-impl"),
        (lambda m, f: f.discrete(0.1, ["euler"]), "integrator=['euler']: steps to second order"),
        (lambda m, f: f.discrete(0.1).discrete(0.1), "is discrete already, with a step of 0.1 s"),
    ],
)  # fmt: skip
def test_refusals(call, text):
    model = pc.chain(2)
    with pytest.raises(pc.Error, match=re.escape(text)):
        call(model, model.quadratic_model())
