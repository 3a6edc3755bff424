"""The oracle's algebra on blocks of any size: identities with their hypotheses, degenerate sizes, errors, independence."""

import ast
import doctest
import importlib
import warnings

import numpy as np
import pytest
from numpy.linalg import cond, inv
from scipy.linalg import block_diag

from support.descriptions import KINDS, body, model, random_description, random_state, subhinge
from support.oracle import ROUNDING, SOURCES, agree, reference

TREE = [-1, 0, 0, 1, -1, 4, 5, 5, 3]
SIZES, COORDINATES = [6, 2, 9, 6, 3, 4, 1, 6, 5], [2, 1, 0, 3, 3, 1, 1, 6, 2]
NAMES = "E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi psi_tilde Upsilon Omega".split()


def random_operators(parents, sizes, coordinates, seed, with_J):
    """Operators of random blocks; inertias well inside the positive definite ones."""
    rng = np.random.default_rng(seed)

    def definite(n):
        X = rng.normal(size=(n, n))
        return X @ X.T + n * np.eye(n)

    E = [rng.normal(size=(sizes[p], s)) / np.sqrt(s) if p >= 0 else None for p, s in zip(parents, sizes, strict=True)]
    H = [rng.normal(size=(n, s)) for n, s in zip(coordinates, sizes, strict=True)]
    J = [definite(n) for n in coordinates] if with_J else None
    return reference.sko_operators(parents, E, H, [definite(s) for s in sizes], J)


def blocks(o, X):
    """The block-diagonal part of X: F → F."""
    return X * block_diag(np.zeros((0, 0)), *[np.ones((s.stop - s.start,) * 2) for s in o.states])


@pytest.mark.parametrize("with_J", [False, True])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("parents", [TREE, range(-1, 8), [-1] * 9], ids=["forest", "chain", "roots"])
def test_identities(parents, seed, with_J):
    o = random_operators(list(parents), SIZES, COORDINATES, seed, with_J)
    E, phi, phi_tilde, H, M, J, R, P, P_plus, D, G, K, tau, tau_bar, E_psi, psi, psi_tilde, Upsilon, Omega = (
        getattr(o, name) for name in NAMES
    )
    I, one, total = o.I, np.eye(len(D)), o.mass_matrix + J
    A, B = one + H @ phi @ K, one - H @ psi @ K
    tolerance = ROUNDING * max(cond(phi), cond(psi), cond(D))
    always = [
        (phi, I + E @ phi),
        (phi_tilde, phi @ E),
        (phi_tilde, E @ phi),
        (o.mass_matrix, H @ phi @ M @ phi.T @ H.T),
        (M, R - E @ R @ E.T),
        (phi @ M @ phi.T, R + phi_tilde @ R + R @ phi_tilde.T),
        (M, P - blocks(o, E @ P_plus @ E.T)),
        (D, H @ P @ H.T + J),
        (G @ D, P @ H.T),
        (P_plus, tau_bar @ P),
        (P_plus, tau_bar @ P @ tau_bar.T + G @ J @ G.T),
        (M, P - E_psi @ P @ E.T),
        (M, P - E_psi @ P @ E_psi.T - K @ J @ K.T),
        (tau, G @ H),
        (tau_bar, I - G @ H),
        (K, E @ G),
        (E_psi, E @ tau_bar),
        (psi_tilde, psi - I),
        (inv(psi), inv(phi) + K @ H),
        (inv(psi) @ phi, I + K @ H @ phi),
        (phi @ inv(psi), I + phi @ K @ H),
        (inv(phi) @ psi, I - K @ H @ psi),
        (psi @ inv(phi), I - psi @ K @ H),
        (B @ H @ phi, H @ psi),
        (phi @ K @ B, psi @ K),
        (A @ H @ psi, H @ phi),
        (psi @ K @ A, phi @ K),
        (A @ B, one),
        (o.innovations, B),
        (total, A @ D @ A.T),
        (o.mass_matrix_inverse, inv(total)),
        (np.linalg.slogdet(total), np.linalg.slogdet(D)),
        (Omega, phi.T @ H.T @ inv(total) @ H @ phi),
        (blocks(o, Omega), Upsilon),
        (np.linalg.det(A), 1.0),
        (H @ psi @ M @ psi.T @ H.T + B @ J @ B.T, D),
        (tau @ P, P @ tau.T),
        (phi @ M @ psi.T, P + phi_tilde @ P + P @ psi_tilde.T),
        ((I - Omega @ M) @ phi.T, psi.T - Omega @ P),
        (phi.T @ H.T @ o.mass_matrix_inverse, psi.T @ H.T @ inv(D) @ B),
    ]
    without_J = [
        (H @ G, one),
        (tau @ tau, tau),
        (H @ tau_bar, 0 * H),
        (H @ psi @ M @ psi.T @ H.T, D),
        (M, P - E_psi @ P @ E_psi.T),
        (psi @ M @ psi.T, P + psi_tilde @ P + P @ psi_tilde.T),
        (H @ psi @ G, one),
        (A, H @ phi @ G),
        (np.trace(Upsilon @ M), len(D)),
        (H @ phi @ M @ psi.T @ H.T, A @ D),
        (tau_bar @ P @ tau_bar.T, P_plus),
        (Omega @ M @ Omega, Omega),
    ]
    for left, right in always if with_J else always + without_J:
        agree(left, right, tolerance)
    S = E_psi.T @ Upsilon @ E_psi  # its off-diagonal blocks couple siblings, and are what a chain lacks
    decomposition = Upsilon + psi_tilde.T @ Upsilon + Upsilon @ psi_tilde
    agree(Omega, decomposition + psi.T @ (S - blocks(o, S)) @ psi, tolerance)
    if list(parents) == TREE:
        assert np.abs(Omega - decomposition).max() > 1e-3
    if with_J:  # the hypothesis J = 0 matters: these fail on every tree
        assert all(np.abs(left - right).max() > 1e-3 for left, right in without_J[:4])


def test_raw_blocks_give_the_rigid_model():
    description = random_description([-1, 0, 0, 2], ["free", "custom", "ball", "screw"], 8, rotor_inertia=True)
    q, v = random_state(description, 1)
    o = reference.operators(description, q, v)
    s, t, E = o.states, o.coordinates, [None, *[o.E[o.states[p], o.states[k]] for k, p in enumerate(o.parents) if p >= 0]]
    raw = reference.sko_operators(
        o.parents, E, [o.H[i, j] for i, j in zip(t, s, strict=True)], [o.M[j, j] for j in s], [o.J[i, i] for i in t]
    )
    for name in NAMES:
        assert np.array_equal(getattr(raw, name), getattr(o, name)), name


# Degenerate sizes -----------------------------------------------------------------------------------------------------


def every_result(description):
    """All that the oracle computes for a model, by name."""
    q, v = random_state(description, 0)
    o, names = reference.operators(description, q, v), [node["name"] for node in description["nodes"]]
    attributes = [
        *NAMES,
        "I",
        "mass_matrix",
        "mass_matrix_inverse",
        "innovations",
        "H_dot",
        "Delta_theta_dot",
        "V",
        "V_tilde",
        "V_bar",
        "momentum_cross",
        "a_gravity",
        "a",
        "b",
    ]
    results = {name: getattr(o, name) for name in attributes}
    results |= {f"Delta({i})": o.Delta(i) for i in range(len(v))} | {"B": o.B(names), "Jacobian": o.Jacobian(names)}
    results["no nodes"] = o.Lambda([])
    for function in (reference.inverse_dynamics, reference.forward_dynamics):
        results[function.__name__] = function(description, q, v, v)
    for function in (reference.bias_forces, reference.kinetic_energy):
        results[function.__name__] = function(description, q, v)
    for function in (reference.mass_matrix, reference.potential_energy):
        results[function.__name__ + " of the motion"] = function(description, q)
    return results


@pytest.mark.parametrize(("parents", "kinds"), [
    ([], []), ([-1], ["weld"]), ([-1, 0, -1], ["weld"] * 3), ([-1, -1, -1], ["pin", "weld", "ball"]), ([-1, 0], ["weld", "pin"]),
    *[([-1], [kind]) for kind in KINDS],
])  # fmt: skip
def test_degenerate_sizes(parents, kinds):
    description = random_description(parents, kinds, 9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        results = every_result(description)
    n, nv = 6 * len(parents), len(random_state(description, 0)[1])
    shapes = {"F → F": (n, n), "Θ → F": (n, nv), "F → Θ": (nv, n), "Θ → Θ": (nv, nv)}
    expected = dict.fromkeys(NAMES, shapes["F → F"]) | dict.fromkeys("GK", shapes["Θ → F"]) | dict.fromkeys("DJ", shapes["Θ → Θ"])
    expected |= {"H": (nv, n), "H_dot": (nv, n), "mass_matrix": (nv, nv), "a": (n,), "b": (n,), "V": (n,), "no nodes": (0, 0)}
    expected |= {"inverse_dynamics": (nv,), "forward_dynamics": (nv,), "kinetic_energy": (), "Jacobian": (n + 6, nv)}
    assert all(np.shape(results[name]) == shape for name, shape in expected.items())
    assert all(np.isfinite(x).all() for x in results.values())


def test_algebra_of_nothing():
    o = reference.sko_operators([], [], [], [])
    assert all(getattr(o, name).shape == (0, 0) for name in NAMES)
    o = reference.sko_operators([-1, 0], [None, np.ones((2, 0))], [[], []], [np.eye(2), np.zeros((0, 0))], [[], []])
    assert o.H.shape == (0, 2) and o.D.shape == (0, 0)
    agree(o.P, np.eye(2))


# Errors and independence ----------------------------------------------------------------------------------------------


def two_links(subhinges, **inner):
    return model([body("inner", -1, [subhinge("pin")], **inner), body("outer", 0, subhinges, 1.0, [1, 0, 0])])


def test_singular_hinges_are_named_and_only_the_articulated_side_fails():
    massless_tip = model([body("link", -1, [subhinge("pin")], 1.0, [1, 0, 0]), body("tip", 0, [subhinge("pin", [1, 0, 0])], 0.0)])
    coaxial = two_links([subhinge("pin")], mass=0.0)
    off_origin = two_links([subhinge("pin", [1, 2, 3], [0.3, -7.1, 0.2])], mass=0.0)  # coaxial up to rounding, far away
    off_origin["bodies"][0]["hinge"]["subhinges"] = [subhinge("pin", [1, 2, 3], [0.3, -7.1, 0.2])]
    for description, name in [(massless_tip, "tip"), (coaxial, "inner"), (off_origin, "inner")]:
        q, v = np.array([0.3, 0.7]), np.array([1.0, -1.0])
        with pytest.raises(ArithmeticError, match=f"'{name}_hinge' of body '{name}'"):
            reference.forward_dynamics(description, q, v, v)
        assert np.isfinite(reference.mass_matrix(description, q)).all()
        assert np.isfinite(reference.inverse_dynamics(description, q, v, v)).all()
    regular = two_links([subhinge("pin", [0, 1, 0])], mass=0.0)  # an inner massless body that the outer one makes regular
    agree(reference.operators(regular, [0.0, 0.3]).D, np.diag([np.cos(0.3) ** 2, 1]))
    heavy_tip = two_links([subhinge("pin", [0, 1, 0])], mass=1e-12, com=[1, 0, 0])  # extreme, yet regular
    assert np.isfinite(reference.operators(heavy_tip, [0.0, 0.3]).D).all()


@pytest.mark.parametrize("kind", ["ball", "free"])
def test_quaternions_without_direction_are_named(kind):
    description = two_links([subhinge("slider"), subhinge(kind)])
    for quaternion in (np.zeros(4), np.array([0, 9e-9, 0, 0]), np.array([np.nan, 1, 0, 0]), np.array([np.inf, 0, 0, 0])):
        with pytest.raises(ValueError, match="'outer_hinge' of body 'outer'.*quaternion"):
            reference.operators(description, [0, 0, *quaternion, *[0.0] * (3 if kind == "free" else 0)])
    short = [0, 0, 2e-8, 0, 0, 0, *[0.0] * (3 if kind == "free" else 0)]  # short, but with a direction
    agree(reference.operators(description, short).X[1], np.eye(4))


def test_wrong_arguments():
    description = two_links([subhinge("pin")])
    with pytest.raises(ValueError, match=r"shape \(2,\), got \(3,\)"):
        reference.operators(description, np.zeros(3))
    with pytest.raises(ValueError, match=r"shape \(2,\), got \(1,\)"):
        reference.operators(description, np.zeros(2), np.zeros(1))
    with pytest.raises(ValueError, match="'gripper'"):
        reference.node_jacobian(description, "gripper", np.zeros(2))
    with pytest.raises(ValueError, match="parents come before"):
        reference.sko_operators([1, -1], [None, None], [np.eye(1)] * 2, [np.eye(1)] * 2)
    with pytest.raises(ArithmeticError, match="outer"):
        reference.operators(description, np.zeros(2)).Lambda(["outer"])  # two coordinates cannot give six motions


def test_the_oracle_stands_alone():
    nodes = [node for source in SOURCES for node in ast.walk(ast.parse(source.read_text(encoding="utf-8")))]
    imports = [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]
    inside = {node.module for node in imports if getattr(node, "level", 0)}
    outside = {(getattr(node, "module", None) or node.names[0].name).split(".")[0] for node in imports if not getattr(node, "level", 0)}
    assert inside == {source.stem for source in SOURCES} - {"__init__"}
    assert outside == {"functools", "types", "numpy", "scipy"}
    modules = [
        reference if source.stem == "__init__" else importlib.import_module(f"pycraft.reference.{source.stem}") for source in SOURCES
    ]
    results = [doctest.testmod(module) for module in modules]
    assert sum(r.attempted for r in results) > 0 and not any(r.failed for r in results)
