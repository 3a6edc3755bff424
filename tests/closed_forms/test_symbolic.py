"""Closed forms against numbers (ruling 29): every operator of the notation table, at random states, on mechanisms of every hinge kind.

The formulas are evaluated with 50 digits, so what differs is the package's own rounding: the bounds are those of `formulas`.
"""

import numpy as np
import pytest
import sympy

import pycraft as pc
from pycraft.closed_forms.closed_forms import symbolic
from support.formulas import EPS, LETTERS, letters_of, norm

VECTORS = {"theta_dot": "v", "velocity": "V", "a": "a", "b": "b", "gravity_base": "a_gravity"}
MOVING = "Delta_theta_dot V_tilde V_bar momentum_cross H_dot".split()
AXES = [(0, 0, 1), (0, 1, 0), (0.6, 0, 0.8)]
CUSTOM = [
    {"kind": "pin", "axis": (0, 0, 1)},
    {"kind": "slider", "axis": (1, 0, 0)},
    {"kind": "pin", "axis": (0, 1, 0), "point": (0.1, 0, 0)},
]


def mechanism(*kinds, parents=None, rotors=False, seed=1):
    """Bodies on hinges of these kinds, all numbers short decimals, at a random state."""
    model = pc.Multibody("_".join(kinds), welds="keep")
    for k, kind in enumerate(kinds):
        options = {"point": (0.1, 0, 0.2)} if kind not in ("free", "custom", "weld") else {}
        if kind in ("pin", "slider", "screw"):
            options["axis"] = AXES[k % 3]
        if kind == "screw":
            options["pitch"] = 0.2
        if kind == "custom":
            options["subhinges"] = CUSTOM
        parent = (parents or range(-1, len(kinds)))[k]
        inertia = np.array([[0.3, 0.05, 0], [0.05, 0.4, 0], [0, 0, 0.5]])
        model.add_body(
            f"body{k}", f"body{parent}" if parent >= 0 else None, kind, mass=1.5 + k / 2, com=(0.2, 0.1, -0.3), inertia=inertia,
            position=(0.5, 0, 0.1), rotation=[[0, -1, 0], [1, 0, 0], [0, 0, 1]], **options,
        )  # fmt: skip
        hinge = model.hinges[f"body{k}"]
        if rotors:
            hinge.rotor_inertia = 0.25 * (1 + np.arange(len(hinge.rotor_inertia)))
        model.add_node(f"node{k}", f"body{k}", position=(0.25, 0, 0.5), rotation=[[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    model.gravity = (0, 0, -9.81)
    state = model.random_state(seed)
    model.q, model.v = state.q, state.v
    return model


def double_pendulum():
    model = pc.chain(2)
    for k in range(2):
        model.add_node(f"node{k}", f"body{k}", position=(1.0, 0, 0))
    model.gravity = (0, -9.81, 0)
    model.q, model.v = [0.3, -1.2], [0.7, 0.4]
    return model


MECHANISMS = {
    "double pendulum": double_pendulum,
    "double pendulum with rotors": lambda: mechanism("pin", "pin", rotors=True),
    "ball": lambda: mechanism("ball"),
    "slider and pin": lambda: mechanism("slider", "pin"),
    "branched": lambda: mechanism("pin", "pin", "slider", parents=[-1, 0, 0]),
    "forest": lambda: mechanism("pin", "slider", parents=[-1, -1]),
    "screw": lambda: mechanism("screw", "pin"),
    "gimbal": lambda: mechanism("gimbal"),
    "gimbal with rotors": lambda: mechanism("gimbal", rotors=True),
    "weld kept": lambda: mechanism("pin", "weld", "slider"),
    "universal": lambda: mechanism("universal"),
    "cylindrical": lambda: mechanism("cylindrical", "pin"),
    "planar": lambda: mechanism("planar", "slider"),
    "custom": lambda: mechanism("custom"),
    "free": lambda: mechanism("free"),
    "ball and pin": lambda: mechanism("ball", "pin", rotors=True),
}
SMALL = ["double pendulum", "ball", "screw", "branched", "universal", "free"]
each = pytest.mark.parametrize("name", MECHANISMS)


@each
def test_every_operator_of_the_table(name):
    model = MECHANISMS[name]()
    letters, forms = letters_of(model), symbolic(model, simplify=name in SMALL)  # the shortest forms take longest to find
    for letter in [*LETTERS, *MOVING]:
        formula = getattr(letters, letter)
        formula.assert_close(forms.at(letter))
        assert getattr(forms, letter).shape == formula.value.shape
    for i in range(model.nv):
        letters.Delta(i).assert_close(forms.at(forms.Delta(i)))
    chosen = list(model.nodes)[-2:]
    for letter in ("B", "Jacobian"):
        getattr(letters, letter)(chosen).assert_close(forms.at(getattr(forms, letter)(chosen)))
    for letter, attribute in VECTORS.items():
        expected = letters.o.a - letters.o.a_gravity if letter == "a" else getattr(letters.o, attribute)
        size = norm(letters.o.V) * (1 + norm(letters.o.V) + norm(letters.o.M @ letters.o.V)) + norm(model.gravity) + norm(letters.o.v)
        assert np.abs(forms.at(letter)[:, 0] - expected).max(initial=0) <= 1e3 * EPS * size, letter
    for letter in ("X_world", "gravity_field"):
        expected = getattr(model.soa, letter).dense()
        assert np.abs(forms.at(letter) - expected).max(initial=0) <= 1e3 * EPS * (1 + norm(expected)), letter


@each
def test_equations_of_motion(name):
    model = MECHANISMS[name]()
    forms = symbolic(model, simplify=name in SMALL)
    for formula, expected in (
        ("mass_matrix", model.mass_matrix(model.q)),
        ("mass_matrix_inverse", model.mass_matrix_inverse(model.q)),
        ("bias_forces", model.bias_forces(model.q, model.v)[:, None]),
        ("innovations", (model.soa.I - model.soa.H @ model.soa.psi @ model.soa.K).dense()),
    ):
        assert np.abs(forms.at(formula) - expected).max(initial=0) <= 1e4 * EPS * max(1, norm(expected)), formula


@pytest.mark.parametrize("name", ["free", "ball and pin"])
def test_operational_space_inertia(name):
    model = mechanism("free") if name == "free" else mechanism("free", "pin")
    forms = symbolic(model, force=True)
    expected = model.soa.Lambda("node0").dense()
    assert np.abs(forms.at(forms.Lambda("node0")) - expected).max() <= 1e5 * EPS * norm(expected)
    assert np.abs(forms.at(forms.evaluate(model.soa.Lambda("node0"))) - expected).max() <= 1e5 * EPS * norm(expected)


@pytest.mark.parametrize("name", SMALL)
def test_theorems_hold_as_formulas(name):
    """Both sides are one formula: the difference is zero, no number looked at."""
    model = MECHANISMS[name]()
    forms = symbolic(model, simplify=False)
    H, phi, M, P, D, K, psi, I, E, Omega, J = model.soa("H phi M P D K psi I E Omega J")
    MM = H @ phi @ M @ phi.T @ H.T
    S = I - H @ psi @ K
    for zero in (
        (MM + J) @ S.T @ D.inv() @ S - I,
        psi.inv() - phi.inv() - K @ H,
        Omega - phi.T @ H.T @ (MM + J).inv() @ H @ phi,
        pc.blockdiag(Omega) - model.soa.Upsilon,
        H @ psi @ M @ psi.T @ H.T + S @ J @ S.T - D,
        (I - E).inv() - phi,
    ):
        assert forms.evaluate(zero).is_zero_matrix, zero.text()


@pytest.mark.parametrize("name", ["double pendulum", "ball", "screw", "universal", "branched"])
def test_derivatives_are_the_packages(name):
    """Derivatives of formulas, formulas of derivatives and the package's numbers: three ways to one value."""
    model = MECHANISMS[name]()
    forms = symbolic(model, simplify=False)
    H, phi, M, P, psi, b = model.soa("H phi M P psi b")
    for e in (H @ phi @ M @ phi.T @ H.T, P, psi, b, model.soa.momentum_cross, model.soa.X_world):
        for i in range(model.nv):
            expected = e.diff(i).dense()
            for found in (forms.at(forms.diff(e, i)), forms.at(e.diff(i))):
                assert np.abs(found - expected).max() <= 1e5 * EPS * (1 + norm(expected) + norm(e.dense())), (e.text(), i)
    rate = P.dot().dense()
    assert np.abs(forms.at(forms.dot("P")) - rate).max() <= 1e5 * EPS * (1 + norm(rate))


def test_derivatives_by_parameters():
    model = mechanism("pin", "universal")
    forms, hinge, body = symbolic(model), model.hinges["body1"], model.bodies["body1"]
    H, phi, M = model.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    for parameter in (
        body.symbol("mass"), body.symbol("com", 1), body.symbol("inertia", 0, 1), hinge.symbol("placement", "rx"),
        hinge.symbol("axis", "z", 1), hinge.symbol("point", "y"), hinge.symbol("rotor_inertia", 1),
    ):  # fmt: skip
        e = (MM + model.soa.J).diff(parameter)
        assert np.abs(forms.at(e) - e.dense()).max() <= 1e4 * EPS * (1 + norm(e.dense())), parameter


def test_expressions_that_no_letter_names():
    model = mechanism("pin", "slider", rotors=True)
    forms, soa = symbolic(model), model.soa
    H, phi, M, P, D, psi, I = soa("H phi M P D psi I")
    MM = H @ phi @ M @ phi.T @ H.T
    C = pc.constant(np.array([[2.0, 0.3], [0.3, 1.0]]), soa.Theta, soa.Theta, "C")
    for e in (
        (MM + 0.1 * I).inv(), (MM + C).inv() @ C, D.sqrt(), P.sqrt(), M.sqrt().inv(), D.sqrt().inv() @ H @ psi @ M.sqrt(),
        pc.blockdiag(phi @ M @ phi.T).inv(), -MM / 3, MM**2, pc.zero(soa.F, soa.V) + soa.Omega, soa.I @ MM, soa.J, P.sqrt().diff(1),
        pc.identity(soa.F) - soa.tau, (2 * soa.I).inv() @ MM, soa.I.T @ MM + soa.I @ soa.I,
    ):  # fmt: skip
        expected = e.dense()
        assert np.abs(forms.at(e) - expected).max() <= 1e5 * EPS * (1 + norm(expected)), e.text()
    for s in (MM.trace(), (MM + C).logdet(), P.norm(), MM.trace() - 2 * D.logdet() + 3):
        assert float(forms.at(s)) == pytest.approx(float(s), rel=1e-13)
    W = D.sqrt().inv() @ H @ psi @ M.sqrt()
    assert forms.evaluate(
        W @ W.T + D.sqrt().inv() @ (I - H @ psi @ soa.K) @ soa.J @ (I - H @ psi @ soa.K).T @ D.sqrt().inv().T
    ) == sympy.eye(2)


def test_vectors_and_constants_by_name():
    model = double_pendulum()
    forms, soa = symbolic(model), model.soa
    T = pc.vector("T", soa.Theta)
    made = forms.evaluate(soa.D.inv() @ T)
    T1, T2 = sympy.symbols("T1 T2", real=True)
    assert (made - forms.D.inv() * sympy.Matrix([T1, T2])).applyfunc(sympy.simplify).is_zero_matrix
    u = sympy.Symbol("u")
    assert forms.evaluate(soa.D.inv() @ T, {"T": [u, 0]})[1] == 0
    C = pc.constant(np.ones((2, 1)), 1, soa.Theta, "C")
    assert forms.evaluate(C, {"C": [[u], [u**2]]}) == sympy.Matrix([u, u**2])
    with pytest.raises(pc.EvaluationError, match="T is given 1 entries"):
        forms.evaluate(T, {"T": [u]})
    with pytest.raises(pc.EvaluationError, match="values= is missing for T1"):
        forms.at(soa.D @ T)


# ---------------------------------------------------------------------- parameters


def test_the_mass_matrix_of_a_double_pendulum_is_the_textbooks():
    forms = symbolic(pc.chain(2), "theta1 theta2", parameters="symbolic")
    m1, m2, l1, l2 = sympy.symbols("m1 m2 l1 l2", positive=True)
    c = sympy.cos(sympy.Symbol("theta2", real=True))
    book = sympy.Matrix(
        [
            [m1 * l1**2 / 3 + m2 * (l1**2 + l2**2 / 3 + l1 * l2 * c), m2 * (l2**2 / 3 + l1 * l2 * c / 2)],
            [m2 * (l2**2 / 3 + l1 * l2 * c / 2), m2 * l2**2 / 3],
        ]
    )
    assert (forms.mass_matrix - book).applyfunc(sympy.expand).is_zero_matrix
    assert str(forms.mass_matrix[0, 0]) == "l1**2*m1/3 + l1**2*m2 + l1*l2*m2*cos(theta2) + l2**2*m2/3"
    assert forms.parameters == {m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0}
    assert forms.at("D", [0.1, 0.2], values={m2: 3.0}) == pytest.approx(
        np.diag([float(x.subs({m1: 1, m2: 3, l1: 1, l2: 1}).subs(forms.q[1], 0.2)) for x in forms.D.diagonal()])
    )


@pytest.mark.parametrize("name", ["double pendulum", "double pendulum with rotors", "ball", "screw", "branched", "gimbal"])
def test_symbols_for_every_parameter_stand_for_its_number(name):
    model = MECHANISMS[name]()
    forms = symbolic(model, parameters="symbolic", simplify=False)
    for letter, expected in (("mass_matrix", model.mass_matrix(model.q)), ("bias_forces", model.bias_forces(model.q, model.v)[:, None])):
        formula = getattr(forms, letter)
        assert formula.free_symbols - {*forms.q, *forms.v} <= set(forms.parameters)
        assert np.abs(forms.at(letter) - expected).max() <= 1e4 * EPS * norm(expected)
    assert sympy.Symbol("m1", positive=True) in forms.parameters


def test_chosen_parameters():
    model = double_pendulum()
    l = sympy.Symbol("l", positive=True)
    forms = symbolic(
        model,
        parameters={
            ("body0", "mass"): "m", ("body0", "com"): [l / 2, 0, 0], ("body1", "position"): [l, 0, 0], ("hinge1", "rotor_inertia"): "J",
            ("node1", "position"): ["x", 0, 0], "gravity": [0, "-g", 0], ("body0", "inertia"): [[0, 0, 0], [0, "I", 0], [0, 0, "I"]],
        },
    )  # fmt: skip
    assert {str(x): v for x, v in forms.parameters.items()} == {"m": 1.0, "l": 1.0, "x": 1.0, "g": 9.81, "I": 1 / 12, "J": 0.0}
    assert np.abs(forms.at("mass_matrix") - model.mass_matrix(model.q)).max() <= 1e-14
    assert np.abs(forms.at("bias_forces")[:, 0] - model.bias_forces(model.q, model.v)).max() <= 1e-13
    assert {str(x) for x in forms.Jacobian("node1").free_symbols} == {"l", "x", "q2"}
    assert {str(x) for x in forms.mass_matrix.free_symbols} == {"m", "l", "I", "J", "q2"}


def test_numbers_are_exact():
    model = pc.Multibody("tilted")
    model.add_body("a", mass=0.1, com=(1 / 3, 0, 0), inertia=np.eye(3) / 7, axis=(1, 1, 0))
    forms = symbolic(model)
    assert forms.H[0, 0] == sympy.sqrt(2) / 2
    assert forms.M[3, 3] == sympy.Rational(1, 10)
    assert forms.mass_matrix == sympy.Matrix([[sympy.Rational(1, 7) + sympy.Rational(1, 180)]])


def test_random_numbers_have_closed_forms_too():
    model = pc.tree([-1, 0], ["pin", "slider"], seed=3, rotor_inertia=True)
    model.q, model.v = [0.4, -0.7], [1.0, 2.0]
    forms = symbolic(model)
    expected = model.mass_matrix_inverse(model.q)
    assert np.abs(forms.at("mass_matrix_inverse") - expected).max() <= 1e4 * EPS * norm(expected)


# ---------------------------------------------------------------------- quaternions


def test_quaternions_of_any_length_and_unit_ones():
    model = mechanism("ball", "pin")
    any_length, unit = symbolic(model), symbolic(model, unit_quaternions=True)
    q = np.array(model.q)
    expected = model.soa.X_world.dense()
    for scale in (1.0, 3.0):
        turned = np.r_[scale * q[:4], q[4:]]
        assert np.abs(any_length.at("X_world", turned) - expected).max() <= 1e-13
    for letter in ("X_world", "P", "psi", "mass_matrix_inverse"):
        assert np.abs(unit.at(letter) - any_length.at(letter)).max() <= 1e-12 * max(1, np.abs(any_length.at(letter)).max())
    w, x, y, z, _ = unit.q
    R = unit.X_world[:3, :3]
    residual = (R.T * R - sympy.eye(3)).applyfunc(lambda e: sympy.expand(sympy.expand(e).subs(w**4, (1 - x**2 - y**2 - z**2) ** 2)))
    assert residual.applyfunc(lambda e: sympy.expand(e.subs(w**2, 1 - x**2 - y**2 - z**2))).is_zero_matrix
    assert len(str(unit.X_world[0, 0])) < len(str(any_length.X_world[0, 0]))


# ---------------------------------------------------------------------- refusals


def test_large_mechanisms_are_refused_with_the_reason():
    with pytest.raises(pc.ModelError, match=r"has 5 coordinates; closed forms grow exponentially.*over a million operations.*force=True"):
        symbolic(pc.chain(5))
    forms = symbolic(pc.chain(5), force=True)
    expected = forms.model.mass_matrix(forms.model.q)
    assert np.abs(forms.at("mass_matrix") - expected).max() <= 1e-12 * norm(expected)
    assert symbolic(mechanism("free")).mass_matrix.shape == (6, 6)


def test_what_has_no_closed_form_is_said():
    model, other = double_pendulum(), double_pendulum()
    forms, soa = symbolic(model), model.soa
    for expression, words in (
        (other.soa.phi, "is not made of the letters"),
        (soa.phi.at([0.1, 0.2]), "bound to a state"),
        (soa.I, "no space"),
    ):
        with pytest.raises(pc.EvaluationError, match=words):
            forms.evaluate(expression)
    with pytest.raises(TypeError, match="not a list"):
        forms.evaluate([1])
    with pytest.raises(AttributeError, match="no closed form is called 'Q'"):
        forms.Q  # noqa: B018 - asking raises
    with pytest.raises(pc.ModelError, match="names= takes 2, not 1"):
        symbolic(model, "a")
    with pytest.raises(pc.ModelError, match="no parameter is called"):
        symbolic(model, parameters={("upper", "mass"): "m"})
    with pytest.raises(pc.ModelError, match=r"com of 'body0': an array \(3,\) is needed"):
        symbolic(model, parameters={("body0", "com"): "c"})
    with pytest.raises(pc.ModelError, match="there are 'numeric', 'symbolic'"):
        symbolic(model, parameters="letters")
    with pytest.raises(pc.ModelError, match="a parameter and a coordinate of one name"):
        symbolic(model, parameters={("body0", "mass"): sympy.Symbol("q1", real=True)})
    with pytest.raises(pc.ModelError, match="need a Multibody"):
        symbolic(soa)
    with pytest.raises(pc.ModelError, match="no coordinate"):
        forms.Delta("elbow")
    with pytest.raises(pc.SingularHingeError, match="hinge 'a' of body 'a'"):
        massless = pc.Multibody("massless")
        massless.add_body("a", mass=1.0)
        symbolic(massless).D  # noqa: B018 - asking raises


def test_blocks_by_name_and_how_it_shows():
    forms = symbolic(double_pendulum(), parameters="symbolic")
    assert forms.block("D", "hinge1", "hinge1") == forms.D[1:, 1:]
    assert forms.block("phi", "body0", "body1") == forms.phi[:6, 6:]
    with pytest.raises(KeyError, match="no block row or column is called 'elbow'"):
        forms.block("D", "elbow", "hinge1")
    assert repr(forms) == "<closed forms of 'chain of 2 rods' in q1, q2; parameters m1, l1, m2, l2, g>"
    assert "mass_matrix" in dir(forms) and forms("M D")[1] == forms.D
