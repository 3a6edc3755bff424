"""Coriolis matrices by kernels and by the general recursion, beyond what test_kernels.py asks of every call.

Oracles: Γ v of the Christoffel symbols, the operators' formula, `pycraft.reference`, ℳ̇ = C + C*, and ∂T/∂v = 2C of hinges of one
coordinate.
Tolerance: 40 n eps of the largest entry, rounding of n sums of up to six products as in test_kernels.py.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft import reference
from support.kernel_cases import LONG, MODELS, states

EPS = np.finfo(float).eps
FORMS = ("christoffel", "skew")


def close(got, expected, n, scale=1):
    assert got.shape == expected.shape
    assert np.abs(got - expected).max(initial=0) <= scale * 40 * max(n, 1) * EPS * np.abs(expected).max(initial=0)


def by_operators(model, q, v, form):
    H, phi, M, cross, V_bar, V_tilde = model.soa("H phi M momentum_cross V_bar V_tilde")
    J = phi.T @ H.T
    C = H @ phi @ (M @ J.dot() + (cross @ J if form == "skew" else 0.5 * (cross + V_bar @ M + M @ V_tilde) @ J))
    return C.at(q, v).dense()


@pytest.mark.parametrize("name", [*MODELS, *LONG])
def test_every_kind_of_hinge(name):
    model = {**MODELS, **LONG}[name]
    Q, V, _ = states(model, 3)
    gamma = np.einsum("ijk,k", model.christoffel(Q[0]), V[0]) if model.nv < 60 else by_operators(model, Q[0], V[0], "christoffel")
    for form, known in zip(FORMS, (gamma, by_operators(model, Q[0], V[0], "skew") if model.nv else gamma), strict=True):
        found = model.coriolis_matrix(Q, V, form=form)
        close(found[0], known, model.nv)
        close(found, model.coriolis_matrix(Q, V, form=form, precision="extended"), model.nv)
        for b in range(3):
            np.testing.assert_array_equal(model.coriolis_matrix(Q[b], V[b], form=form), found[b])
        if model.nv < 60:
            rate = model.mass_matrix_derivative(Q[1]) @ V[1]
            close(found[1] + found[1].T, rate, model.nv, 4)


@pytest.mark.parametrize("name", ["tree of ball", "tree of universal", "tree of free", "tree of screw", "rotors", "welds kept"])
def test_the_formula_of_the_reference(name):
    model = MODELS[name]
    Q, V, _ = states(model, 1)
    o = reference.operators(model.description(), Q[0], V[0])
    J = o.phi.T @ o.H.T
    J_dot = o.phi.T @ (o.Delta_theta_dot.T @ o.phi_tilde.T @ o.H.T + o.H_dot.T)
    turning = 0.5 * (o.momentum_cross + o.V_bar @ o.M + o.M @ o.V_tilde)
    for form, middle in zip(FORMS, (turning, o.momentum_cross), strict=True):
        close(model.coriolis_matrix(Q[0], V[0], form=form), o.H @ o.phi @ (o.M @ J_dot + middle @ J), model.nv, 4)


def wide_models():
    """Of more columns than are taken at once: pins alone, and hinges of several coordinates across the borders."""
    yield pc.chain(300, seed=3)
    rng = np.random.default_rng(4)
    kinds = ["pin", "free", "ball", "slider", "gimbal", "screw", "free"] * 14
    yield pc.tree([-1, *(int(rng.integers(max(0, k - 3), k)) for k in range(1, 98))], kinds, seed=5, name="free and ball")
    yield pc.tree([-1, *(0 if k % 45 == 1 else k - 1 for k in range(1, 136))], ["ball", *["pin"] * 135], seed=6, name="legs")


@pytest.mark.parametrize("model", list(wide_models()), ids=lambda m: m.name)
def test_columns_beyond_near_memory(model):
    assert model.nv > 128
    Q, V, _ = states(model, 2)
    for form in FORMS:
        for q, v, C in zip(Q, V, model.coriolis_matrix(Q, V, form=form), strict=True):
            close(C, model.coriolis_matrix(q, v, form=form, precision="extended"), model.nv)
    if model.nv == 300:  # hinges of one coordinate
        slopes = model.inverse_dynamics_derivatives(Q, V, 0 * V).v
        close(2 * model.coriolis_matrix(Q, V), slopes, model.nv)


def test_force_and_order_of_results():
    """Whatever was computed before in the same memory: the same bits."""
    model = LONG["chain of 50"] if "chain of 50" in LONG else next(iter(LONG.values()))
    Q, V, U = states(model, 1)
    first = [model.coriolis_matrix(Q[0], V[0], form=form) for form in FORMS]
    with np.errstate(all="ignore"):
        for spoil in (1e300, 1e-300, 1e150):
            try:
                model.forward_dynamics(Q[0], spoil * V[0], U[0])
                model.mass_matrix_inverse(Q[0])
                model.coriolis_matrix(Q[0], spoil * V[0])
            except pc.Error:
                pass
            for form, C in zip(FORMS, first, strict=True):
                np.testing.assert_array_equal(model.coriolis_matrix(Q[0], V[0], form=form), C)
    close(first[0] @ V[0], first[1] @ V[0], model.nv)


@pytest.mark.parametrize("form", FORMS)
def test_what_kernels_do_not_know(form):
    """A rotor on a ball, sliders behind a turn, other precisions: the general recursion."""
    model = pc.tree([-1, 0, 1, 1], ["ball", "pin", "free", "screw"], seed=8)
    model.hinges["hinge0"].rotor_inertia = [0.3, 0.2, 0.1]
    q, v = model.random_state(1).q, model.random_state(2).v
    known, J, w = by_operators(model, q, v, form), np.diag([0.3, 0.2, 0.1]), reference.skew(v[:3])
    momentum = reference.skew(J @ v[:3])
    known[:3, :3] += -momentum if form == "skew" else (J @ w + w @ J - momentum) / 2
    close(model.coriolis_matrix(q, v, form=form), known, model.nv)
    sliders = [{"kind": "pin", "axis": [0, 0, 1.0]}, *({"kind": "slider", "axis": list(axis)} for axis in np.eye(3)), {"kind": "ball"}]
    model = pc.Multibody("behind a turn")
    model.add_body("base", mass=2.0, com=(0.2, 0.1, 0), inertia=np.diag([1.0, 2, 2.5]))
    model.add_body(
        "body", "base", hinge="custom", subhinges=sliders, position=(0.3, 0, 1), mass=1.0, com=(0.1, 0.3, 0.2), inertia=np.diag([2.0, 3, 4])
    )
    model.add_body("tip", "body", hinge="universal", position=(0, 1, 0), mass=0.5, com=(0.1, 0.3, 0.2), inertia=np.diag([2.0, 3, 4]))
    q, v = model.random_state(3).q, model.random_state(3).v
    close(model.coriolis_matrix(q, v, form=form), by_operators(model, q, v, form), model.nv)
    exact = model.coriolis_matrix(q, v, form=form, precision="quad")
    close(model.coriolis_matrix(q, v, form=form, precision="extended"), exact, model.nv)
    single = model.coriolis_matrix(q, v, form=form, precision="single")
    assert 0 < np.abs(single - exact).max() <= 40 * model.nv * np.finfo(np.float32).eps * np.abs(exact).max()
    if form == "skew":
        close(model.coriolis_matrix([q], [v], form=form, precision=50)[0], exact, model.nv)
        out = np.empty_like(exact)
        assert model.coriolis_matrix(q, v, form=form, precision=50, out=out) is out
        close(out, exact, model.nv)
    else:
        with pytest.raises(pc.EvaluationError, match="'single' to 'quad'"):
            model.coriolis_matrix(q, v, precision=50)


@pytest.mark.parametrize("precision", ["double", "quad"])
def test_the_speed_of_a_base_is_not_in_it(precision):
    """Christoffel's, to the bit: of a free root, and of sliders that carry it."""
    model = MODELS["g1"]
    q, v = model.random_state(1).q, model.random_state(1).v
    fast = v.copy()
    fast[3:6] += (7e3, -2e3, 1e3)
    np.testing.assert_array_equal(model.coriolis_matrix(q, v, precision=precision), model.coriolis_matrix(q, fast, precision=precision))
    cart = pc.tree([-1, 0, 1, 2], ["slider", "slider", "pin", "ball"], seed=2)
    q, v = cart.random_state(1).q, cart.random_state(1).v
    fast = v + np.r_[1e4, -1e4, 0, 0, 0, 0]
    np.testing.assert_array_equal(cart.coriolis_matrix(q, v, precision=precision), cart.coriolis_matrix(q, fast, precision=precision))


@pytest.mark.parametrize("form", FORMS)
def test_batches_and_places_of_results(form):
    model = MODELS["tree of gimbal"]
    Q, V, _ = states(model, 9)
    whole = model.coriolis_matrix(Q, V, form=form)
    for count in (0, 1, 3, 5, 9):
        found = model.coriolis_matrix(Q[:count], V[:count], form=form)
        assert found.shape == (count, model.nv, model.nv)
        np.testing.assert_array_equal(found, whole[:count])
    np.testing.assert_array_equal(model.coriolis_matrix(Q[0], V, form=form), model.coriolis_matrix(Q[[0] * 9], V, form=form))
    np.testing.assert_array_equal(model.coriolis_matrix(Q, V[0], form=form), model.coriolis_matrix(Q, V[[0] * 9], form=form))
    memory = np.zeros(model.nv * model.nv)
    memory[: model.nv] = V[2]
    out = memory.reshape(model.nv, model.nv)
    assert model.coriolis_matrix(Q[2], memory[: model.nv], form=form, out=out) is out
    np.testing.assert_array_equal(out, whole[2])
    with pytest.raises(pc.ModelError, match="out= takes"):
        model.coriolis_matrix(Q[0], V[0], form=form, out=np.empty(3))


def test_errors():
    model = MODELS["panda"]
    q, v = model.random_state(1).q, np.ones(7)
    for form in ("other", "fast"):
        with pytest.raises(
            pc.EvaluationError, match=f"form '{form}' of the Coriolis matrix is not there; there are 'christoffel' and 'skew'"
        ):
            model.coriolis_matrix(q, v, form=form)
    with pytest.raises(pc.ModelError, match="v of"):
        model.coriolis_matrix(q, np.full(7, np.nan))
    with pytest.raises(pc.ModelError, match="v of 'panda' takes 7"):
        model.coriolis_matrix(q, v[:3])
    with pytest.raises(pc.ModelError, match="batches of 2 and 3"):
        model.coriolis_matrix(np.tile(q, (2, 1)), np.tile(v, (3, 1)))
    heavy = pc.Multibody("heavy")
    for k in range(2):
        heavy.add_body(f"body{k}", f"body{k - 1}" if k else None, axis=(0, k, 1 - k), position=(1, 0, 0), mass=1e200, com=(1, 0, 0))
    with pytest.raises(pc.EvaluationError, match="beyond the range"):
        heavy.coriolis_matrix([0.1, 0.2], [1e200, 1e200])
