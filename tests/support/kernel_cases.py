"""Models with every kind of hinge where kernels of direct calls may meet it, states of them, and the calls."""

import numpy as np

import pycraft as pc

KINDS = ["pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free", "weld"]
STATES = 7  # two packs of four and a remainder, or four of two, or one of eight


def trees():
    """Every kind of hinge at the base, in the middle of a branched tree and at a tip; a model without coordinates; welds kept."""
    for kind in KINDS:
        yield pc.tree([-1, 0, 1, 1, 0, 4], [kind, "pin", kind, "screw", "ball", kind], seed=3, name=f"tree of {kind}")
    yield pc.tree([-1, 0, 1, 2], ["pin", "weld", "weld", "slider"], seed=4, welds="keep", name="welds kept")
    yield pc.tree([-1, 0], ["weld", "weld"], seed=5, name="welds only")
    rotors = pc.tree([-1, 0, 1, 0], ["pin", "slider", "pin", "screw"], seed=6, name="rotors")
    for name in rotors.hinges:
        rotors.hinges[name].rotor_inertia = 0.7
    yield rotors
    yield pc.chain(30, seed=1)
    yield pc.robots.panda()
    yield pc.robots.g1()


MODELS = {model.name: model for model in trees()}


def long_models():
    """Of 49 to 90 coordinates: a chain, branches of one coordinate, and branches of every kind of hinge; rotors on what can have them."""
    rng = np.random.default_rng(3)
    yield pc.chain(50, seed=2)
    yield pc.tree([-1, *(int(rng.integers(max(0, k - 5), k)) for k in range(1, 57))], ["pin"] * 57, seed=5, name="branches")
    kinds = ["free", "pin", "ball", "slider", "gimbal", "screw", "ball", "weld", "universal", "free", "pin", "planar"] * 3
    mixed = pc.tree([-1, *(int(rng.integers(max(-1, k - 4), k)) for k in range(1, 36))], kinds, seed=6, name="every kind")
    for name, hinge in mixed.hinges.items():
        if hinge.kind == "pin":
            mixed.hinges[name].rotor_inertia = 0.3
    yield mixed


LONG = {model.name: model for model in long_models()}


def states(model, count=STATES):
    drawn = [model.random_state(seed) for seed in range(count)]
    rng = np.random.default_rng(7)
    Q, V = (np.array([getattr(s, name) for s in drawn]) for name in "qv")
    return Q, V, rng.uniform(-1, 1, (count, model.nv))


def heavy(model, ratio, gravity=(0.4, -1.0, -9.0)):
    """The model with bodies without children `ratio` times as heavy."""
    description = model.description()
    parents = {b["parent"] for b in description["bodies"]}
    for k, b in enumerate(description["bodies"]):
        if k not in parents and b["name"] not in parents:
            b["mass"], b["inertia"] = ratio * b["mass"], ratio * np.asarray(b["inertia"])
    made = pc.Multibody.from_description(description)
    made.gravity = gravity
    return made


def by_recursions(model, Q, V, U, **how):
    """Forward dynamics by the general recursions: of the model beside a body at rest by itself, on a ball hinge with rotors, which kernels
    do not know."""
    beside = pc.Multibody.from_description(model.description())
    beside.gravity = model.gravity
    beside.add_body("apart", None, hinge="ball", mass=1.0, inertia=np.eye(3), rotor_inertia=(0.1, 0.1, 0.1))
    more = np.zeros((len(Q), 3))
    return beside.forward_dynamics(np.hstack([Q, more + 1, more[:, :1]]), np.hstack([V, more]), np.hstack([U, more]), **how)[:, : model.nv]


def errors(model, given, reference="quad", call=pc.Multibody.forward_dynamics, **how):
    """Of forward dynamics at every state: relative 2-norms."""
    exact = model.forward_dynamics(*given, precision=reference)
    return np.linalg.norm(call(model, *given, **how) - exact, axis=1) / np.linalg.norm(exact, axis=1)


def calls(model, Q, V, U, **how):
    """Every call that kernels have, forward dynamics in every form."""
    derivatives = {
        f"{call}, {along}": matrix
        for call in ("inverse_dynamics_derivatives", "forward_dynamics_derivatives")
        for along, matrix in zip(("q", "v", "input"), getattr(model, call)(Q, V, U, **how), strict=True)
    }
    if model.nv and how.get("precision") != "single":
        tip = list(model.bodies)[-1]
        derivatives["operational_space_compliance"] = model.operational_space_compliance(tip, Q, **how)
    return derivatives | {
        "coriolis_matrix": model.coriolis_matrix(Q, V, **how),
        "coriolis_matrix, skew": model.coriolis_matrix(Q, V, form="skew", **how),
        "forward_dynamics": model.forward_dynamics(Q, V, U, **how),
        "forward_dynamics, ud": model.forward_dynamics(Q, V, U, form="ud", **how),
        "forward_dynamics, square-root": model.forward_dynamics(Q, V, U, form="square-root", **how),
        "inverse_dynamics": model.inverse_dynamics(Q, V, U, **how),
        "bias_forces": model.bias_forces(Q, V, **how),
        "mass_matrix": model.mass_matrix(Q, **how),
        "mass_matrix_inverse": model.mass_matrix_inverse(Q, **how),
    }
