"""No number outlives a parameter: every call, twice, with an edit between, against a model that was built with the edit.

Numbers are kept in five places: values of the present state, of a bound state and of a batch; workspaces of direct calls; plans, which
depend on whether there is a rotor inertia. Each has a key, and each key is tried with every kind of parameter.
"""

import copy

import numpy as np
import pytest

import pycraft as pc

BATCH = 11  # more than a pack, and no multiple of one


def robot():
    model = pc.tree([-1, 0, 1, 1, 3], ["free", "pin", "universal", "slider", "ball"], seed=5)
    state = model.random_state(2)
    model.q, model.v, model.gravity = state.q, state.v, (0.5, -1.0, -9.0)
    model.add_node("tool", "body4", position=(0.1, -0.2, 0.3))
    return model


def turned(model):
    pose = np.array(model.hinges["hinge3"].placement)
    pose[:3, :3] = pose[:3, :3] @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    pose[:3, 3] += [0.01, 0.02, 0.03]
    model.hinges["hinge3"].placement = pose


def edited(name, value):
    return lambda model: setattr(model.bodies["body3"], name, value(getattr(model.bodies["body3"], name)))


def moved(model):
    state = model.random_state(9)
    model.q, model.v = state.q, state.v


EDITS = {
    "mass": edited("mass", lambda m: 2 * m),
    "com": edited("com", lambda c: c + [0.01, 0, 0.02]),
    "inertia": edited("inertia", lambda inertia: 1.5 * inertia),
    "placement": turned,
    "rotor inertia": lambda model: setattr(model.hinges["hinge1"], "rotor_inertia", 0.7),
    "gravity": lambda model: setattr(model, "gravity", (0.0, 3.0, -2.0)),
    "state": moved,
}

rng = np.random.default_rng(0)
STATE = robot().random_state(4)
STATES = [robot().random_state(10 + i) for i in range(BATCH)]
NV = robot().nv
q, v, tau = STATE.q, STATE.v, rng.normal(size=NV)
Q, V, TAU = np.array([s.q for s in STATES]), np.array([s.v for s in STATES]), rng.normal(size=(BATCH, NV))

DIRECT = {
    "forward_dynamics": lambda m: m.forward_dynamics(q, v, tau),
    "forward_dynamics, ud": lambda m: m.forward_dynamics(q, v, tau, form="ud"),
    "forward_dynamics, refined": lambda m: m.forward_dynamics(q, v, tau, refine=1),
    "forward_dynamics, wider": lambda m: m.forward_dynamics(q, v, tau, refine=1, residual="wider"),
    "forward_dynamics, single": lambda m: m.forward_dynamics(q, v, tau, precision="single"),
    "forward_dynamics, extended": lambda m: m.forward_dynamics(q, v, tau, precision="extended"),
    "forward_dynamics, packs": lambda m: m.forward_dynamics(Q, V, TAU),
    "forward_dynamics, packs of ud": lambda m: m.forward_dynamics(Q, V, TAU, form="ud"),
    "forward_dynamics, packs of single": lambda m: m.forward_dynamics(Q, V, TAU, precision="single"),
    **{
        f"forward_dynamics, {method}": lambda m, method=method: m.forward_dynamics(q, v, tau, method=method)
        for method in ("cholesky", "ldl", "conjugate-gradients", "inverse", "divide-and-conquer", "realization")
    },
    "inverse_dynamics": lambda m: m.inverse_dynamics(q, v, tau),
    "inverse_dynamics, batch": lambda m: m.inverse_dynamics(Q, V, TAU),
    "bias_forces": lambda m: m.bias_forces(q, v),
    "mass_matrix": lambda m: m.mass_matrix(q),
    "mass_matrix_inverse": lambda m: m.mass_matrix_inverse(q),
    "mass_matrix_inverse, refined": lambda m: m.mass_matrix_inverse(q, refine=1),
    "jacobian": lambda m: m.jacobian("tool", q),
    "pose": lambda m: m.pose("tool", q),
    "kinetic_energy": lambda m: m.kinetic_energy(q, v),
    "potential_energy": lambda m: m.potential_energy(q),
    "inverse_dynamics_derivatives": lambda m: m.inverse_dynamics_derivatives(q, v, tau).q,
    "forward_dynamics_derivatives": lambda m: m.forward_dynamics_derivatives(q, v, tau).q,
    "mass_matrix_derivative": lambda m: m.mass_matrix_derivative(q),
    "christoffel": lambda m: m.christoffel(q),
    "coriolis_matrix": lambda m: m.coriolis_matrix(q, v),
    "coriolis_matrix, skew": lambda m: m.coriolis_matrix(q, v, form="skew"),
    "operational_space_inertia": lambda m: m.operational_space_inertia("tool", q),
    "operational_space_compliance": lambda m: m.operational_space_compliance(["tool"], q),
    "kinetic_energy_derivatives": lambda m: m.kinetic_energy_derivatives(q, v)[0],
    "hamiltonian_dynamics": lambda m: np.concatenate(m.hamiltonian_dynamics(q, v, tau)),
    "innovations": lambda m: np.concatenate(m.innovations(q, v, tau)),
    "diagonalised_dynamics": lambda m: m.diagonalised_dynamics(q, v, tau)[1],
    "momentum": lambda m: m.momentum(q, v).matrix,
    "jacobian_dot": lambda m: m.jacobian_dot("tool", q, v),
    "jacobian_derivative": lambda m: m.jacobian_derivative("tool", q),
    "inertial_regressor": lambda m: m.inertial_regressor(q, v, tau),
    "inertial_parameters": lambda m: m.inertial_parameters(),
    "log_determinant_gradient": lambda m: m.log_determinant_gradient(q),
    "integrate_ode": lambda m: m.integrate_ode(q, v, [0, 0.01], integrator="rk4", step=0.01).q,
}
LETTERS = (
    "E phi H M J R P P_plus D G K tau_bar psi Upsilon Omega V_bar momentum_cross X_world H_dot velocity a b gravity_field gravity_base"
).split()


def expressions(model):
    """Made once of a model and asked again after the edit, as users do."""
    soa = model.soa
    H, phi, M, J, D, I = soa("H phi M J D I")
    MM = H @ phi @ M @ phi.T @ H.T
    made = {name: getattr(soa, name) for name in LETTERS}
    made |= {
        "ℳ": MM,
        "(ℳ+J)⁻¹": (MM + J).inv(),
        "ℳ⁻¹": MM.inv(),
        "elimination": (MM + 0.1 * D + I).inv(),
        "∂ℳ": MM.diff(7),
        "∂(ℳ+J)⁻¹": (MM + J).inv().diff(8),
    }
    made |= {"∂D": D.diff(9), "𝒥": soa.Jacobian(["tool"]), "Λ": soa.Lambda(["tool"])}
    return made


BINDINGS = {
    "unbound": lambda e: e,
    "bound": lambda e: e.at(q, v),
    "bound, ud": lambda e: e.at(q, v, form="ud"),
    "bound, extended": lambda e: e.at(q, v, precision="extended"),
    "batch": lambda e: e.at(Q, V),
}
REQUESTS = {
    "dense": lambda e: e.dense(),
    "trace": lambda e: np.asarray(e.trace()) if e.domain in (e.codomain, e.codomain.dual) else np.zeros(()),
    "apply": lambda e: e @ np.ones(e.shape[1]),
}


def values(expressions):
    """Every expression, binding and request; expressions keep what they keep."""
    return {
        (name, binding, request): np.array(ask(bound))
        for (name, binding), bound in expressions.items()
        for request, ask in REQUESTS.items()
    }


def same(a, b):
    return a.shape == b.shape and np.array_equal(a, b)


@pytest.mark.parametrize("edit", EDITS)
def test_direct_calls_after_an_edit(edit):
    model = robot()
    before = {name: np.array(call(model)) for name, call in DIRECT.items()}
    EDITS[edit](model)
    fresh = copy.deepcopy(model)
    after = {name: np.array(call(model)) for name, call in DIRECT.items()}
    assert [name for name, call in DIRECT.items() if not same(after[name], np.array(call(fresh)))] == []
    changed = [name for name in DIRECT if not same(before[name], after[name])]
    if edit == "state":  # none of them reads it
        assert changed == []
    else:  # the edit is one that shows
        assert len(changed) >= {"gravity": 10, "rotor inertia": 15}.get(edit, 25), changed


@pytest.mark.parametrize("edit", EDITS)
def test_expressions_after_an_edit(edit):
    model = robot()
    made = {(name, binding): bind(e) for name, e in expressions(model).items() for binding, bind in BINDINGS.items()}
    before = values(made)
    EDITS[edit](model)
    fresh = copy.deepcopy(model)
    after = values(made)
    afresh = values({(name, binding): bind(e) for name, e in expressions(fresh).items() for binding, bind in BINDINGS.items()})
    assert [key for key in after if not same(after[key], afresh[key])] == []
    changed = {key for key in after if not same(before[key], after[key])}
    assert {binding for _, binding, _ in changed} == ({"unbound"} if edit == "state" else set(BINDINGS)), edit


@pytest.mark.parametrize("edit", ["mass", "rotor inertia"])
@pytest.mark.parametrize("which", ["first", "second", "both"])
@pytest.mark.parametrize("bound", [False, True])
def test_two_models_in_one_expression(edit, which, bound):
    """(ℳ+J)⁻¹ + ℳ⁻¹ of one model, C, and the same of the other, through R^n: two contexts of one plan, either of them edited.

    Where J = 0, ℳ⁻¹ is solved by the factors of (ℳ+J)⁻¹: a plan that does must not outlive a rotor inertia of either model.
    """
    pair = [robot(), robot()]

    def side(model, state):
        H, phi, M, J = model.soa("H phi M J")
        MM = H @ phi @ M @ phi.T @ H.T
        made = (MM + J).inv() + MM.inv()
        return made.at(state) if bound else made

    def through(a, b):
        left = pc.constant(np.eye(NV), pc.euclidean(NV), a.soa.Theta)
        right = pc.constant(np.eye(NV), b.soa.Theta, pc.euclidean(NV))
        return side(a, q) @ left @ right @ side(b, Q[0])

    e = through(*pair)
    before = e.dense()
    for k, model in enumerate(pair):
        if which in ("both", ("first", "second")[k]):
            EDITS[edit](model)
    after = e.dense()
    assert not same(before, after) and same(after, through(*copy.deepcopy(pair)).dense())
