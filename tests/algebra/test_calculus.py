"""Derivatives of every operator by rule, against fourth-order differences of the same expression in extended precision."""

import pickle

import numpy as np
import pytest
from scipy.linalg import expm

import pycraft as pc
from support.differences import TOLERANCE, along, assert_close, difference, numbers, value
from support.formulas import EPS, norm

KINDS = ["pin", "universal", "ball", "slider", "gimbal", "custom", "screw", "free", "planar", "cylindrical"]
LETTERS = (
    "E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi psi_tilde Upsilon Omega "
    "Delta_theta_dot V_tilde V_bar momentum_cross X_world H_dot velocity a b gravity_field gravity_base"
).split()


@pytest.fixture(scope="module")
def model():
    """Every kind of hinge, branches, rotors, nodes, gravity; rounded coordinates, so that steps of 2⁻¹⁰ are exact on one-DOF hinges."""
    mb = pc.tree([-1, 0, 1, 1, 0, 4, 5, 2, 2, 8], KINDS, seed=3)
    mb.hinges["hinge0"].rotor_inertia = mb.hinges["hinge2"].rotor_inertia = 0.3
    mb.add_node("on_free", "body7", position=(0.1, 0.2, 0.3))
    mb.add_node("outboard", "body9", position=(0.1, 0.2, 0.3))
    mb.gravity = (1, 2, -9.81)
    state = mb.random_state(1)
    mb.q, mb.v = np.round(state.q * 2**20) / 2**20, state.v
    return mb


def expressions(model):
    soa = model.soa
    H, phi, M, D, psi, K, J, P = soa("H phi M D psi K J P")
    MM = H @ phi @ M @ phi.T @ H.T
    made = {name: getattr(soa, name) for name in LETTERS}
    made |= {
        "𝒥": soa.Jacobian(["on_free", "outboard"]),
        "Λ": soa.Lambda(["outboard"]),
        "Δ": soa.Delta(5),
        "ℳ": MM,
        "ℳ⁻¹": MM.inv(),
        "(ℳ+J)⁻¹": (MM + J).inv(),
        "a realization": (MM + 0.1 * soa.I).inv(),
        "a nested realization": (MM.inv() + 0.01 * D).inv(),
        "√D": D.sqrt(),
        "m": (soa.I + H @ phi @ K) @ D.sqrt(),
        "[I-HψK]*D⁻¹[I-HψK]": (soa.I - H @ psi @ K).T @ D.inv() @ (soa.I - H @ psi @ K),
        "blockdiag(φPφ*)": pc.blockdiag(phi @ P @ phi.T),
        "blockdiag(ψ*MψM)": pc.blockdiag(psi.T @ soa.Upsilon @ psi),
        "3 ℳ - D": 3 * MM - D,
    }
    return made


NAMES = LETTERS + [
    "𝒥", "Λ", "Δ", "ℳ", "ℳ⁻¹", "(ℳ+J)⁻¹", "a realization", "a nested realization", "√D", "m", "[I-HψK]*D⁻¹[I-HψK]", "blockdiag(φPφ*)",
    "blockdiag(ψ*MψM)", "3 ℳ - D",
]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_along_every_coordinate(name, model):
    op = expressions(model)[name]
    for i in range(0, model.nv) if name in ("H", "D", "ℳ", "P") else range(0, model.nv, 3):
        assert_close(numbers(op.diff(i), model.q, model.v), along(model, op, i, model.q, model.v), f"∂_{model.coordinate_names[i]} {name}")


@pytest.mark.parametrize("name", NAMES)
def test_along_time(name, model):
    op = expressions(model)[name]
    vdot = np.random.default_rng(0).normal(size=model.nv)
    q, v = model.q, model.v
    expected = difference(lambda t: value(op, model.integrate(q, t * v), v + t * vdot))
    assert_close(numbers(op.dot(vdot=vdot), q, v), expected, f"d{name}/dt")
    named = pc.vector("a", model.soa.Theta)
    rate = op.dot(vdot=named)
    if op.domain != pc.euclidean(1) and "a" not in str(rate):
        assert_close(numbers(op.dot(), q, v), expected, f"d{name}/dt without accelerations")


PAIRS = [(1, 2), (2, 1), (4, 3), (6, 7), (7, 6), (10, 11), (3, 3), (8, 9), (12, 5), (20, 4)]


TWICE = ["E", "H", "P", "D", "psi", "Upsilon", "R", "X_world", "V_tilde", "H_dot", "ℳ", "ℳ⁻¹", "a realization", "√D", "m"]


@pytest.mark.parametrize("name", TWICE)
def test_second_derivatives(name, model):
    op = expressions(model)[name]
    for i, j in PAIRS:
        expected = along(model, op.diff(i), j, model.q, model.v)
        assert_close(numbers(op.diff(i, j), model.q, model.v), expected, f"∂_{j}∂_{i} {name}")


def test_third_derivatives_and_mixed_with_time(model):
    MM, P = (expressions(model)[name] for name in ("ℳ", "P"))
    assert_close(numbers(MM.diff(4, 6, 9), model.q, model.v), along(model, MM.diff(4, 6), 9, model.q, model.v), "third")
    expected = difference(lambda t: value(P.diff(4), model.integrate(model.q, t * model.v), model.v))
    assert_close(numbers(P.diff(4).dot(), model.q, model.v), expected, "d/dt ∂P")
    mass = model.bodies["body2"].symbol("mass")
    assert_close(numbers(P.diff(mass, 4), model.q, model.v), along(model, P.diff(mass), 4, model.q, model.v), "∂_q ∂_m P")


# ---------------------------------------------------------------------- parameters


def twist_pose(component, t):
    x = t * np.eye(6)[component]
    A = np.zeros((4, 4))
    A[:3, :3] = [[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]]
    A[:3, 3] = x[3:]
    return expm(A)


def parameters(model):
    """Name, parameter, setter by a step (zero restores)."""
    body, hinges = model.bodies["body5"], model.hinges
    mass, com, inertia, rotor = body.mass, body.com, body.inertia, hinges["hinge2"].rotor_inertia

    def placed(name, c):
        hinge = hinges[name]
        before = hinge.placement
        return lambda t: setattr(hinge, "placement", before @ twist_pose(c, t))

    pair = np.zeros((3, 3))
    pair[0, 1] = pair[1, 0] = 1
    yield "mass", body.symbol("mass"), lambda t: setattr(body, "mass", mass + t)
    yield "com", body.symbol("com", "y"), lambda t: setattr(body, "com", com + t * np.eye(3)[1])
    yield "inertia xy", body.symbol("inertia", "x", "y"), lambda t: setattr(body, "inertia", inertia + t * pair)
    yield "inertia zz", body.symbol("inertia", 2), lambda t: setattr(body, "inertia", inertia + t * np.diag([0, 0, 1.0]))
    yield (
        "rotor",
        hinges["hinge2"].symbol("rotor_inertia", 1),
        lambda t: setattr(hinges["hinge2"], "rotor_inertia", rotor + t * np.eye(3)[1]),
    )
    for name, c in [("hinge1", 0), ("hinge4", 4), ("hinge8", 2), ("hinge6", "y"), ("hinge5", "rz")]:
        number = c if isinstance(c, int) else ("rx", "ry", "rz", "x", "y", "z").index(c)
        yield f"placement of {name}", hinges[name].symbol("placement", c), placed(name, number)


OF_PARAMETERS = [
    "E", "H", "M", "J", "P", "D", "K", "psi", "Upsilon", "ℳ", "(ℳ+J)⁻¹", "a realization", "X_world", "V_tilde", "𝒥", "H_dot", "b",
    "gravity_field", "gravity_base",
]  # fmt: skip


@pytest.mark.parametrize("which", range(10))
def test_along_parameters(which, model):
    label, parameter, move = list(parameters(model))[which]
    ops = expressions(model)
    for name in OF_PARAMETERS:

        def moved(t, op=ops[name]):
            move(t)
            return value(op, model.q, model.v)

        expected = difference(moved, 2.0**-9)  # truncation 16 times that of STEP
        move(0.0)
        assert_close(numbers(ops[name].diff(parameter), model.q, model.v), expected, f"∂{name} by {label}")


@pytest.mark.parametrize("what, component", [("axis", 0), ("axis", "y"), ("point", "x"), ("point", 2)])
def test_along_a_hinge_axis(what, component):
    """Of the second subhinge of a hinge of three, rebuilt with its axis turned about its point, or shifted."""
    c = component if isinstance(component, int) else "xyz".index(component)
    base = pc.tree([-1, 0, 1], ["pin", "gimbal", "pin"], seed=5)
    q = base.random_state(2).q
    description = base.description()

    def rebuilt(t):
        changed = pickle.loads(pickle.dumps(description))
        body = next(b for b in changed["bodies"] if b["name"] == "body1")
        subhinge = body["hinge"]["subhinges"][1]
        if what == "axis":
            subhinge["axis"] = twist_pose(c, t)[:3, :3] @ subhinge["axis"]
        else:
            subhinge["point"] = np.asarray(subhinge["point"]) + t * np.eye(3)[c]
        return pc.Multibody.from_description(changed)

    def mass_matrix(soa):
        H, phi, M = soa("H phi M")
        return H @ phi @ M @ phi.T @ H.T

    parameter = base.hinges["hinge1"].symbol(what, component, subhinge=1)
    for make in (lambda soa: soa.H, lambda soa: soa.E, lambda soa: soa.P, mass_matrix):
        expected = difference(lambda t, make=make: value(make(rebuilt(t).soa), q))
        assert_close(numbers(make(base.soa).diff(parameter), q, None), expected, what)


# ---------------------------------------------------------------------- structure


def test_what_is_zero_by_structure_is_the_zero_operator():
    arm = pc.tree([-1, 0, 1], ["pin", "pin", "slider"], seed=0)
    H, phi, M, J, D, psi = arm.soa("H phi M J D psi")
    MM = H @ phi @ M @ phi.T @ H.T
    for op in (M, J, H, MM.T - MM.T):
        assert op.diff("hinge1").kind == "zero"
    assert M.diff(0) == pc.zero(arm.soa.V, arm.soa.F)
    for op in (MM, MM.inv(), phi, D, psi):  # the root's coordinate moves all rigidly
        assert op.diff("hinge0").kind == "zero"
    assert MM.diff("hinge1").kind == "sum" and MM.dot().kind == "sum" and H.dot().kind == "zero"
    assert pc.constant(np.eye(3), arm.soa.Theta, arm.soa.Theta).diff(1).kind == "zero"
    assert (arm.soa.I @ MM).diff(2).domain == arm.soa.Theta
    assert MM.diff([1, "hinge2"]) == [MM.diff(1), MM.diff(2)] and MM.diff([]) == []


@pytest.mark.slow
def test_no_plan_of_a_derivative_is_dense(model):
    for name, op in expressions(model).items():
        if op.domain == pc.euclidean(1):
            continue
        for derived in (op.diff(7), op.diff(7, 4), op.dot(vdot=np.ones(model.nv))):
            assert not derived.plan().has_dense_step, name


def test_a_mass_matrix_derivative_takes_six_sweeps():
    arm = pc.chain(8, seed=1)
    H, phi, M = arm.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    derived = MM.diff(3)
    derived @ np.ones(8)
    passes = derived.plan().passes
    assert passes.gathers + passes.scatters + passes.kernels <= 6 and passes.dense == passes.eliminations == 0


def test_cost_grows_as_the_bodies():
    plans = {}
    for n in (50, 500):
        arm = pc.chain(n, seed=0)
        H, phi, M, D, psi, K = arm.soa("H phi M D psi K")
        MM = H @ phi @ M @ phi.T @ H.T
        plans[n] = [op.diff(n // 2, n // 3).plan() for op in (MM, MM.inv(), D, (MM + 0.1 * arm.soa.I).inv())]
    for small, large in zip(plans[50], plans[500], strict=True):
        assert len(small.steps) == len(large.steps)
        assert large.flops / small.flops <= 10.5 and large.memory / small.memory <= 10.5


# ---------------------------------------------------------------------- frames


def test_the_world_frame(model):
    """∂(X_o A X_i⁻¹) = X_o (world derivative) X_i⁻¹, for operators between any of F, V, Θ."""
    X = model.soa.X_world
    ops = expressions(model)
    sides = [(model.soa.F, X, X.inv()), (model.soa.V, X.inv().T, X.T)]
    for name in ("E", "P", "M", "H", "G", "K", "psi", "Upsilon", "ℳ", "V_tilde"):
        op = ops[name]
        out = next((s for s in sides if s[0] == op.codomain), None)
        into = next((s for s in sides if s[0] == op.domain), None)
        resolved = op
        pulled = op.diff(6, frame="world")
        if out:
            resolved, pulled = out[1] @ resolved, out[1] @ pulled
        if into:
            resolved, pulled = resolved @ into[2], pulled @ into[2]
        assert_close(numbers(pulled, model.q, model.v), numbers(resolved.diff(6), model.q, model.v), name)
        if not out and not into:
            assert op.diff(6, frame="world") == op.diff(6)
    # the world's E is constant: φ does not move
    assert_close(numbers(model.soa.E.diff(6, frame="world"), model.q, model.v), np.zeros(model.soa.E.shape), "E")


# ---------------------------------------------------------------------- scalars


def test_scalars(model):
    H, phi, M, J, D = model.soa("H phi M J D")
    MM = H @ phi @ M @ phi.T @ H.T
    for scalar in (MM.trace(), (MM + J).logdet(), D.logdet(), 2 * MM.trace() - D.logdet() / 3 + 1, (MM @ D).trace(), MM.norm() * D.trace()):
        for i in (1, 4, 7, 13):
            e = np.eye(model.nv)[i]
            expected = difference(lambda t, s=scalar, e=e: np.asarray(s.at(model.integrate(model.q, t * e), precision="quad")))
            assert abs(float(scalar.diff(i)) - expected) <= TOLERANCE * (1 + abs(expected))
        gradient = scalar.gradient()
        assert gradient.shape == (model.nv,)
        assert np.allclose(gradient[[1, 4, 7, 13]], [float(scalar.diff(i)) for i in (1, 4, 7, 13)], rtol=1e-10, atol=1e-10)
    with pytest.raises(pc.EvaluationError, match="gradient over 'axes' exists for ln det"):
        MM.trace().gradient("axes")


def test_gradients_follow_the_binding(model):
    H, phi, M, J = model.soa("H phi M J")
    logdet = (H @ phi @ M @ phi.T @ H.T + J).logdet()
    states = np.stack([model.random_state(k).q for k in range(3)])
    batch = logdet.at(states).gradient()
    assert batch.shape == (3, model.nv)
    for q, row in zip(states, batch, strict=True):
        assert np.abs(logdet.at(q).gradient() - row).max() <= 1e-12 * (1 + norm(row))
        assert np.abs(model.log_determinant_gradient(q) - row).max() <= 1e-12 * (1 + norm(row))
    for over, shape in (("inertias", (10, 10)), ("geometry", (10, 6)), ("axes", (model.nv, 6))):
        assert logdet.gradient(over).shape == shape


# ---------------------------------------------------------------------- errors and copies


def test_errors_name_what_is_wrong(model):
    MM, V_bar = expressions(model)["ℳ"], model.soa.V_bar
    for error, text, call in [
        (pc.ModelError, "no coordinate of 'tree of 10' is called 'elbow'; there are hinge0", lambda: MM.diff("elbow")),
        (pc.ModelError, "coordinate 99 of", lambda: MM.diff(99)),
        (pc.EvaluationError, "diff takes a coordinate's name or number", lambda: MM.diff()),
        (TypeError, "diff takes a coordinate's name or number", lambda: MM.diff(1.5)),
        (pc.EvaluationError, r"needs the accelerations: .dot\(vdot=...\)", lambda: V_bar.dot()),
        (pc.ModelError, "vdot of 'tree of 10' takes", lambda: V_bar.dot(vdot=[1.0])),
        (pc.ModelError, r"coordinate 'hinge1\[0\]' is not a finite number", lambda: V_bar.dot(vdot=[0, np.nan] + [0] * (model.nv - 2))),
        (pc.SpaceError, "vdot: the accelerations are a vector of", lambda: V_bar.dot(vdot=pc.vector("a", model.soa.V))),
        (pc.EvaluationError, "frame 'moon'", lambda: MM.diff(1, frame="moon")),
        (pc.ModelError, "has no parameter 'colour'", lambda: model.bodies["body1"].symbol("colour")),
        (pc.ModelError, "has no parameter 'pitch'", lambda: model.hinges["hinge1"].symbol("pitch")),
        (pc.ModelError, "no component is called 'w'; there are x, y, z, or 0 to 2", lambda: model.bodies["body1"].symbol("com", "w")),
        (pc.ModelError, "no component is called 'yz'", lambda: model.bodies["body1"].symbol("inertia", "x", "yz")),
        (pc.ModelError, "no component is called 9; there are rx", lambda: model.hinges["hinge1"].symbol("placement", 9)),
        (pc.ModelError, "no component is called 2; there are 0, 1", lambda: model.hinges["hinge1"].symbol("rotor_inertia", 2)),
        (pc.ModelError, "has 2 subhinges, none with number 2", lambda: model.hinges["hinge1"].symbol("axis", 0, 2)),
    ]:
        with pytest.raises(error, match=text):
            call()
    other = pc.chain(2).bodies["body1"].symbol("mass")
    with pytest.raises(pc.EvaluationError, match="is not the model that this derivative is taken of"):
        MM.diff(other)


def test_derivatives_are_pickled(model):
    soa, mass = model.soa, model.bodies["body2"].symbol("mass")
    for op in (expressions(model)["m"].diff(7), soa.V_bar.diff(3), soa.H.diff(2), soa.P.diff(mass)):
        again = pickle.loads(pickle.dumps(op))
        assert str(again) == str(op)
        expected = op.at(model.q, model.v).dense()
        assert np.abs(again.at(model.q, model.v).dense() - expected).max() <= 10 * EPS * (1 + norm(expected))


def test_models_without_coordinates_and_bare_trees():
    fixed = pc.Multibody("bench", welds="keep")
    fixed.add_body("table", hinge="weld", mass=1.0, inertia=np.eye(3))
    assert fixed.soa.M.dot().kind == "zero" and fixed.soa.phi.dot().kind == "zero"
    bare = pc.sko_model([-1, 0], [None, np.eye(2)], [np.ones((1, 2))] * 2, [np.eye(2)] * 2)
    assert bare.P.diff(0).kind == "zero"  # constant blocks
