"""The oracle `pycraft/reference/__init__.py` against what is independent of it: differentiated poses, Newton and Euler, energy.

Closed forms are in test_reference_closed_forms.py, the algebra's identities and limits in test_reference_algebra.py.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from support.descriptions import KINDS, Q_SIZE, V_SIZE, body, coordinate_rates, model, random_description, random_state, subhinge
from support.oracle import DIFFERENCE, ROUNDING, agree, reference

SEQUENCES = [("ball", "slider"), ("screw", "ball", "pin"), ("pin", "slider", "ball")]
TREE = [-1, 0, 0, 1, 1, 2, 4, 4, 3, 7, 5]
MODELS = {
    "every kind": random_description(TREE, KINDS, 1),
    "every kind, rotors": random_description(TREE, KINDS[::-1], 2, rotor_inertia=True),
    "sequences in a forest": random_description([-1, 0, -1, 2, 2], [*SEQUENCES, "pin", "universal"], 3),
    # a hinge of more than six coordinates has an invertible D only through its rotors
    "sequences, rotors": random_description([-1, 0, -1, 2, 2], [*SEQUENCES, "pin", ("slider", "free", "pin")], 4, True),
    "serial pins": random_description(range(-1, 6), ["pin"] * 7, 5),
    "free root": random_description([-1, 0, 0, 1, 2, 2], ["free", "pin", "screw", "slider", "pin", "pin"], 6),
    "one weld": random_description([-1, 0], ["weld", "pin"], 7),
}
each_model = pytest.mark.parametrize("description", MODELS.values(), ids=MODELS.keys())


def rate(function, x, dx):
    """Directional derivative of a real analytic function by a complex step: exact to rounding."""
    return np.imag(function(x + 1e-30j * dx)) / 1e-30


def rate_along(function, description, q, v):
    """Derivative of function(q) along the generalized velocities v."""
    return rate(function, np.asarray(q, complex), coordinate_rates(description, q, v))


def twist(X, X_dot):
    """(ω; v) of the moving pose X in its own axes, from X⁻¹Ẋ."""
    W = np.linalg.inv(X) @ X_dot
    return np.array([W[2, 1], W[0, 2], W[1, 0], *W[:3, 3]])


def state(description, seed=0):
    """Random q, v and v̇."""
    return *random_state(description, seed), random_state(description, seed + 1)[1]


# Poses and what is differentiated from them ---------------------------------------------------------------------------


@pytest.mark.parametrize("kind", Q_SIZE)
def test_step_is_the_textbook_motion(kind):
    rng = np.random.default_rng(3)
    a, c, q, pitch = rng.normal(size=3), rng.normal(size=3), rng.normal(size=Q_SIZE[kind]), 0.37
    a /= np.linalg.norm(a)
    turn = {"slider": np.eye(3), "ball": None, "free": None}.get(kind, Rotation.from_rotvec(a * q[0]).as_matrix())
    if turn is None:
        turn = Rotation.from_quat([*q[1:4], q[0]]).as_matrix()  # SciPy's order is (x, y, z, w) and it normalises
    shift = {"slider": a * q[0], "screw": c - turn @ c + pitch * q[0] * a, "free": q[4:]}.get(kind, c - turn @ c)
    X = reference.subhinge_step(subhinge(kind, a, c, pitch), q)
    agree(X[:3], np.column_stack([turn, shift]))
    agree(X[3], [0, 0, 0, 1])


def test_steps_compose_outward_from_the_placement():
    rng = np.random.default_rng(4)
    steps = [subhinge("pin", rng.normal(size=3), rng.normal(size=3)), subhinge("ball", point=rng.normal(size=3))]
    turn = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
    inner, outer = body("inner", -1, steps, position=[1, 2, 3], rotation=turn), body("outer", 0, [subhinge("free")])
    q = rng.normal(size=12)
    placement = np.block([[turn, np.array([[1], [2], [3]])], [np.zeros((1, 3)), 1]])
    expected = placement @ reference.subhinge_step(steps[0], q[:1]) @ reference.subhinge_step(steps[1], q[1:5])
    o = reference.operators(model([inner, outer]), q)
    agree(o.world_pose(0), expected)
    agree(o.world_pose(1), expected @ reference.subhinge_step(subhinge("free"), q[5:]))


@each_model
def test_hinge_map_and_jacobians_are_derivatives_of_poses(description):
    q, v, _ = state(description)
    o, names = reference.operators(description, q, v), [node["name"] for node in description["nodes"]]
    for i, e in enumerate(np.eye(len(v))):
        X_dots = rate_along(lambda x: np.array(reference.operators(description, x).X), description, q, e)
        agree(o.H[i], np.concatenate([twist(X, X_dot) for X, X_dot in zip(o.X, X_dots, strict=True)]))
    for name in [*names, "body1"]:
        X_dot = rate_along(lambda x, name=name: reference.node_pose(description, name, x), description, q, v)
        agree(reference.node_jacobian(description, name, q) @ v, twist(reference.node_pose(description, name, q), X_dot))
    agree(o.Jacobian(names), np.vstack([reference.node_jacobian(description, name, q) for name in names]))
    agree(o.V, np.concatenate([reference.node_jacobian(description, b["name"], q) @ v for b in description["bodies"]]))


@each_model
def test_rates_of_operators(description):
    q, v, vdot = state(description)
    o = reference.operators(description, q, v)

    def at(symbol, direction):
        return rate_along(lambda x: getattr(reference.operators(description, x, v), symbol), description, q, direction)

    agree(o.H_dot, at("H", v))
    agree(o.E @ o.Delta_theta_dot, at("E", v))
    for i, e in enumerate(np.eye(len(v))):
        agree(o.E @ o.Delta(i), at("E", e))
    # φ* turns the base acceleration −g into minus the field in every body's axes: alpha is V̇ less the field
    field = np.concatenate([[0, 0, 0, *o.world_pose(k)[:3, :3].T @ description["gravity"]] for k in range(len(o.X))])
    V_dot = at("V", v) + o.phi.T @ o.H.T @ vdot
    agree(reference.inverse_dynamics_vectors(description, q, v, vdot).alpha, V_dot - field)
    agree(o.phi.T @ o.a_gravity, -field)


# Forces, energy and the equations of motion ---------------------------------------------------------------------------


def newton_euler(description, q, v, vdot):
    """Generalized forces by Kane's projection of Newton's and Euler's laws, in world axes, and the mass matrix.

    Poses are all that is taken from the oracle; partial velocities are their complex-step derivatives, accelerations the
    fourth-order differences of velocities along the motion.
    """

    def poses(x):
        o = reference.operators(description, x)
        return np.array([o.world_pose(k) for k in range(len(o.X))])

    coms = np.array([[*b["com"], 1.0] for b in description["bodies"]])

    def partial_velocities(x):
        """(bodies, 6, nv): angular velocities and velocities of the centres of mass, in the world."""
        X, columns = poses(x), []
        for e in np.eye(len(v)):
            X_dot = rate_along(poses, description, x, e)
            W = X_dot[:, :3, :3] @ X[:, :3, :3].swapaxes(1, 2)
            centre = np.einsum("kij,kj->ki", X_dot[:, :3], coms)
            columns.append(np.column_stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0], centre]))
        return np.stack(columns, axis=-1)

    h, direction = 1e-3, coordinate_rates(description, q, v)
    at = {x: partial_velocities(q + x * h * direction) for x in (-2, -1, 1, 2)}
    U, U_dot = partial_velocities(q), (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * h)
    tau, mass_matrix = np.zeros(len(v)), np.zeros((len(v), len(v)))
    for k, b in enumerate(description["bodies"]):
        R = poses(q)[k, :3, :3]
        inertia, omega, acceleration = R @ b["inertia"] @ R.T, U[k, :3] @ v, U[k] @ vdot + U_dot[k] @ v
        moment = inertia @ acceleration[:3] + np.cross(omega, inertia @ omega)
        tau += U[k].T @ np.concatenate([moment, b["mass"] * (acceleration[3:] - description["gravity"])])
        mass_matrix += U[k, :3].T @ inertia @ U[k, :3] + b["mass"] * U[k, 3:].T @ U[k, 3:]
    rotors = np.concatenate([np.zeros(0), *[b["hinge"]["rotor_inertia"] for b in description["bodies"]]])
    return tau + rotors * vdot, mass_matrix + np.diag(rotors)


def gyroscopic(description, v):
    """Of rotors on balls and free hinges, by Euler's equations and Newton's in turning axes: (ω × Jω + u × Ju; ω × Ju)."""
    forces, at = np.zeros(len(v)), 0
    for b in description["bodies"]:
        rotors, first = np.asarray(b["hinge"]["rotor_inertia"]), at
        for part in b["hinge"]["subhinges"]:
            size = {"ball": 3, "free": 6}.get(part["kind"], 1)
            x, p = v[at : at + size], rotors[at - first : at - first + size] * v[at : at + size]
            if size == 3:
                forces[at : at + 3] = np.cross(x, p)
            if size == 6:
                forces[at : at + 6] = [*(np.cross(x[:3], p[:3]) + np.cross(x[3:], p[3:])), *np.cross(x[:3], p[3:])]
            at += size
    return forces


@each_model
def test_newton_and_euler_in_the_world(description):
    q, v, vdot = state(description)
    tau, mass_matrix = newton_euler(description, q, v, vdot)
    tau += gyroscopic(description, v)
    agree(reference.mass_matrix(description, q), mass_matrix)
    agree(reference.inverse_dynamics(description, q, v, vdot), tau, DIFFERENCE)
    agree(reference.kinetic_energy(description, q, v), 0.5 * v @ mass_matrix @ v)
    agree(reference.bias_forces(description, q, v), tau - mass_matrix @ vdot, DIFFERENCE)


@each_model
def test_power_is_the_rate_of_energy(description):
    q, v, vdot = state(description)
    tau = reference.inverse_dynamics(description, q, v, vdot)
    kinetic = rate_along(lambda x: reference.kinetic_energy(description, x, v), description, q, v)
    kinetic += rate(lambda x: reference.kinetic_energy(description, q, x), v.astype(complex), vdot)
    potential = [rate_along(lambda x: reference.potential_energy(description, x), description, q, e) for e in np.eye(len(v))]
    agree(reference.bias_forces(description, q, 0 * v), potential)
    agree(v @ tau, kinetic + v @ potential)


@each_model
def test_coriolis_matrix(description):
    q, v, _ = state(description)
    o = reference.operators(description, q, v)
    J = o.phi.T @ o.H.T
    J_dot = o.phi.T @ (o.Delta_theta_dot.T @ o.phi_tilde.T @ o.H.T + o.H_dot.T)
    agree(J_dot, rate_along(lambda x: (lambda s: s.phi.T @ s.H.T)(reference.operators(description, x)), description, q, v))
    C = o.H @ o.phi @ (o.M @ J_dot + o.momentum_cross @ J)
    agree(rate_along(lambda x: reference.mass_matrix(description, x), description, q, v), C + C.T)
    agree(C @ v + gyroscopic(description, v), reference.bias_forces(description, q, v) - reference.bias_forces(description, q, 0 * v))
    agree(o.momentum_cross @ o.V, o.b)
    agree(o.V_bar, -o.V_tilde.T)
    for s in o.states:  # f = ṗ about a moving origin: (ω × n + v × f; ω × f)
        (w, u), (n, f) = np.split(o.V[s], 2), np.split((o.M @ o.V)[s], 2)
        agree(o.b[s], [*(np.cross(w, n) + np.cross(u, f)), *np.cross(w, f)])


@each_model
def test_forward_dynamics(description):
    q, v, vdot = state(description)
    mass_matrix = reference.mass_matrix(description, q)
    condition = np.linalg.cond(mass_matrix)
    tau = reference.inverse_dynamics(description, q, v, vdot)
    forward = reference.forward_dynamics_vectors(description, q, v, tau)
    inverse = reference.inverse_dynamics_vectors(description, q, v, vdot)
    agree(forward.vdot, vdot, ROUNDING * condition)
    agree(forward.alpha, inverse.alpha, ROUNDING * condition)
    agree(forward.f, inverse.f, ROUNDING * condition)
    agree(reference.mass_matrix_inverse(description, q), np.linalg.inv(mass_matrix), ROUNDING * condition)
    fall = -np.linalg.solve(mass_matrix, reference.bias_forces(description, q, v))
    agree(reference.forward_dynamics(description, q, v, 0 * v), fall, ROUNDING * condition)
    # ε, ν and z leave no bias at rest without gravity: ε = [I − HψK]T, and T*ℳ⁻¹T = ε*D⁻¹ε
    still, at_rest = {**description, "gravity": np.zeros(3)}, 0 * v
    innovations, o = reference.forward_dynamics_vectors(still, q, at_rest, tau), reference.operators(still, q, at_rest)
    agree(innovations.epsilon, o.innovations @ tau, ROUNDING * condition)
    agree(innovations.epsilon @ innovations.nu, tau @ np.linalg.solve(mass_matrix, tau), ROUNDING * condition)
    agree(innovations.z, o.phi @ o.K @ innovations.epsilon, ROUNDING * condition)  # ψK = φK[I − HψK]


def subtree(description, q, k):
    """The bodies outboard of k, with k itself on a free hinge: description and coordinates."""
    kept, bodies, coordinates, offset = {k: 0}, [], [np.array([1.0, 0, 0, 0, 0, 0, 0])], 0
    for j, b in enumerate(description["bodies"]):
        size = sum(Q_SIZE[s["kind"]] for s in b["hinge"]["subhinges"])
        if j == k:
            bodies.append(body("root", -1, [subhinge("free")], b["mass"], b["com"], b["inertia"]))
        elif b["parent"] in kept:
            kept[j] = len(bodies)
            bodies.append({**b, "parent": kept[b["parent"]]})
            coordinates.append(q[offset : offset + size])
        offset += size
    return model(bodies), np.concatenate(coordinates)


@each_model
def test_articulated_inertia_is_the_inertia_that_a_push_meets(description):
    q, _, _ = state(description)
    o = reference.operators(description, q)
    for k, s in enumerate(o.states):
        mass_matrix = reference.mass_matrix(*subtree(description, q, k))
        rest = slice(6, None)
        schur = mass_matrix[:6, :6] - mass_matrix[:6, rest] @ np.linalg.solve(mass_matrix[rest, rest], mass_matrix[rest, :6])
        agree(o.P[s, s], schur, ROUNDING * np.linalg.cond(mass_matrix[rest, rest]) if mass_matrix[rest].size else ROUNDING)
        agree(o.R[s, s], mass_matrix[:6, :6])  # all hinges locked


@each_model
def test_operational_space_inertia(description):
    q, _, _ = state(description)
    o, names = reference.operators(description, q), [f"node{len(description['bodies']) - 1}"]
    J = o.Jacobian(names)
    compliance = J @ np.linalg.solve(reference.mass_matrix(description, q), J.T)
    agree(o.B(names).T @ o.Omega @ o.B(names), compliance, ROUNDING * np.linalg.cond(o.mass_matrix + o.J))
    if np.linalg.matrix_rank(J) == 6:
        agree(o.Lambda(names) @ compliance, np.eye(6), ROUNDING * np.linalg.cond(compliance))
    with pytest.raises(ArithmeticError, match="base_node"):
        o.Lambda(["base_node"])


@each_model
def test_a_hinge_is_a_chain_of_massless_bodies_with_one_subhinge_each(description):
    bodies, last = [], [-1]
    for b in description["bodies"]:
        pieces, parent, rotors = b["hinge"]["subhinges"], last[b["parent"] + 1], b["hinge"]["rotor_inertia"]
        for j, s in enumerate(pieces[:-1]):
            used, rotors = rotors[: V_SIZE[s["kind"]]], rotors[V_SIZE[s["kind"]] :]
            placement = b["hinge"]["placement"] if j == 0 else {}
            bodies.append(body(f"{b['name']}_{j}", parent, [s], 0.0, rotor=used, **placement))
            parent = len(bodies) - 1
        placement = b["hinge"]["placement"] if len(pieces) < 2 else {}
        bodies.append(body(b["name"], parent, pieces[-1:], b["mass"], b["com"], b["inertia"], rotor=rotors, **placement))
        last.append(len(bodies) - 1)
    expanded, (q, v, vdot) = model(bodies, description["gravity"]), state(description)
    condition = np.linalg.cond(reference.mass_matrix(description, q))
    agree(reference.mass_matrix(expanded, q), reference.mass_matrix(description, q))
    agree(reference.inverse_dynamics(expanded, q, v, vdot), reference.inverse_dynamics(description, q, v, vdot))
    forward = reference.forward_dynamics(description, q, v, vdot)
    agree(reference.forward_dynamics(expanded, q, v, vdot), forward, ROUNDING * condition)
    assert not reference.operators(expanded, q, v).H_dot.any()
