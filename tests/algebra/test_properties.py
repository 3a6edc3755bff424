"""Properties over random trees and random expressions (Hypothesis, derandomised): values against dense NumPy, steps on the
group, text that reads back as what was shown.

Values are compared within the running bounds of `formulas`, steps with the roundings of a few products of rotations at the size
of what is moved: near zero and near half a turn as well, where both are well conditioned.
"""

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

import pycraft as pc
from pycraft.identities.parse import ParseError, Statements
from support.descriptions import random_description
from support.formulas import EPS, letters_of, norm
from support.mechanisms import build, uniform_batch
from support.random_formulas import draw

KINDS = ["weld", "pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free", "custom"]


def runs(examples):
    """The same examples in every run, modest in number."""
    quiet = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
    return settings(max_examples=examples, derandomize=True, deadline=None, database=None, suppress_health_check=quiet)


@st.composite
def trees(draw, most=5, kinds=KINDS):
    """A model at a random state: shape, kinds, rotor inertia and seed drawn."""
    n = draw(st.integers(1, most))
    parents = [draw(st.integers(-1, k - 1)) for k in range(n)]
    chosen = [draw(st.sampled_from(kinds)) for _ in range(n)]
    return build(random_description(parents, chosen, draw(st.integers(0, 999)), draw(st.booleans())), draw(st.integers(0, 99)))


def formula_of(data, letters, depth):
    """A random formula between two drawn spaces."""
    domain, codomain = data.draw(st.sampled_from("TVF")), data.draw(st.sampled_from("TVF"))
    return draw(lambda items: items[data.draw(st.integers(0, len(items) - 1))], letters, domain, codomain, depth)


# ---------------------------------------------------------------------- values


@runs(60)
@given(trees(), st.data())
def test_values_are_those_of_dense_numpy(model, data):
    letters = letters_of(model)
    formula = formula_of(data, letters, 3)
    formula.assert_close(formula.op.dense())
    formula.assert_close(formula.op.dense(rules=False))
    formula.assert_applies(np.random.default_rng(0))
    formula.assert_close(formula.op.simplify().dense(rules=False))
    if formula.op.domain == formula.op.codomain:
        formula.assert_close(formula.op.diagonal(), np.diag(formula.value))
        formula.assert_close(float(formula.op.trace()), np.trace(formula.value), max(1, len(formula.value)))


@pytest.mark.slow
@runs(1500)
@given(trees(7), st.data())
def test_values_of_deeper_expressions(model, data):
    letters = letters_of(model)
    formula = formula_of(data, letters, 5)
    formula.assert_close(formula.op.dense())
    formula.assert_close(formula.op.dense(rules=False))
    square = formula.op.domain == formula.op.codomain
    if square and len(formula.value) and np.linalg.cond(formula.value) < 1e8 and norm(formula.value) > 1e6 * formula.error:
        formula.assert_logdet()


@runs(25)
@given(trees(4), st.data())
def test_batches_are_their_states(model, data):
    formula = formula_of(data, letters_of(model), 2)
    Q, V = uniform_batch(model, 2, 1)
    whole = formula.op.at(Q, V).dense()
    for i in range(2):
        alone = letters_of(model, Q[i], V[i])
        assert np.array_equal(whole[i], formula.op.at(Q[i], V[i]).dense())
        assert whole.shape[1:] == formula.value.shape and alone.o.v is not None


@runs(40)
@given(trees(3), st.data())
def test_transposition_and_flattening(model, data):
    letters = letters_of(model)
    a = formula_of(data, letters, 2)
    again = draw(lambda items: items[0], letters, "T", "T", 0)
    assert a.op.T.T != a.op or a.op.T.T.kind == "transpose"
    a.assert_close(a.op.T.T.dense())
    a.assert_close(a.op.T.dense().T)
    one, two = (a.op + a.op) + a.op, a.op + (a.op + a.op)
    assert one == two and hash(one) == hash(two)
    if a.op.domain == a.op.codomain:
        one, two = (a.op @ a.op) @ a.op, a.op @ (a.op @ a.op)
        assert one == two and hash(one) == hash(two) and one == a.op**3
    assert again.op == draw(lambda items: items[0], letters, "T", "T", 0).op


# ---------------------------------------------------------------------- steps on the group


def pose_of(q, kind):
    """The pose of a lone ball or free hinge at the world's origin, from its coordinates."""
    w, x, y, z = q[:4] / norm(q[:4])
    X = np.eye(4)
    X[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    if kind == "free":
        X[:3, 3] = q[4:]
    return X


def twist_matrix(d):
    """[[w̃, v], [0, 0]] of a twist (w; v); of a rotation vector with v = 0."""
    w, v = d[:3], (d[3:] if len(d) > 3 else np.zeros(3))
    return np.array([[0, -w[2], w[1], v[0]], [w[2], 0, -w[0], v[1]], [-w[1], w[0], 0, v[2]], [0, 0, 0, 0]])


ANGLES = [
    0.0,
    1e-300,
    1e-15,
    1e-9,
    1e-5,
    0.009,
    0.011,
    0.5,
    0.999,
    1.001,
    2.0,
    3.0,
    np.pi - 1e-3,
    np.pi - 1e-7,
    np.pi - 1e-12,
    3.5,
    6.2,
    20.0,
]


@st.composite
def steps(draw):
    """A lone ball or free hinge: kind, q of any quaternion length, and a step by one of `ANGLES`."""
    kind = draw(st.sampled_from(["ball", "free"]))
    rng = np.random.default_rng(draw(st.integers(0, 9999)))
    quaternion = rng.normal(size=4)
    quaternion *= draw(st.sampled_from([1.0, 1e-6, 1e3])) / norm(quaternion)
    axis = rng.normal(size=3)
    step = axis / norm(axis) * draw(st.sampled_from(ANGLES))
    if kind == "ball":
        return kind, quaternion, step
    moved = rng.uniform(-1, 1, 3) * draw(st.sampled_from([0.0, 1e-12, 1.0, 100.0]))
    return kind, np.concatenate([quaternion, rng.uniform(-2, 2, 3)]), np.concatenate([step, moved])


@runs(150)
@given(steps())
def test_integrate_is_the_exponential_of_the_body_twist(step):
    kind, q, d = step
    model = pc.chain(1, kind)
    q1 = model.integrate(q, d)
    expected = pose_of(q, kind) @ expm(twist_matrix(d))
    # SciPy's exponential squares itself log2‖d‖ times and doubles its rounding each time
    assert np.abs(pose_of(q1, kind) - expected).max() <= 64 * EPS * (1 + norm(d[:3])) * (1 + norm(d) + norm(q[4:]))
    assert abs(norm(q1[:4]) - norm(q[:4])) <= 8 * EPS * norm(q[:4])  # the length of the quaternion is the user's, and stays


@runs(150)
@given(steps())
def test_difference_undoes_integrate(step):
    kind, q, d = step
    model = pc.chain(1, kind)
    q1 = model.integrate(q, d)
    back = model.difference(q, q1)
    angle = norm(d[:3])
    assert norm(back[:3]) <= np.pi * (1 + 4 * EPS)
    if angle < np.pi:  # the same vector, to what the rounding of q1 leaves of it; no worse near the half turn
        assert norm(back[:3] - d[:3]) <= 32 * EPS * (1 + angle)
        if kind == "free":
            assert norm(back[3:] - d[3:]) <= 64 * EPS * (norm(d[3:]) * (1 + angle) + norm(q[4:]) + norm(q1[4:]))
    again = model.integrate(q, back)
    assert np.abs(pose_of(again, kind) - pose_of(q1, kind)).max() <= 128 * EPS * (1 + norm(d) + norm(q[4:]))
    assert norm(model.difference(q, q)) <= 8 * EPS * (1 + norm(q[4:]))


@runs(40)
@given(trees(5), st.integers(0, 999))
def test_steps_of_whole_models(model, seed):
    rng = np.random.default_rng(seed)
    q0, q1, d = model.random_state(seed).q, model.random_state(seed + 1).q, rng.uniform(-1, 1, model.nv)
    there = model.integrate(q0, model.difference(q0, q1))
    back = model.difference(q0, model.integrate(q0, d))
    assert np.abs(back - d).max(initial=0.0) <= 256 * EPS * (4 + norm(q0))
    for body in model.bodies:
        assert np.abs(model.pose(body, there) - model.pose(body, q1)).max() <= 4096 * EPS * (1 + norm(model.pose(body, q1)))
    # a short step moves every body by its Jacobian: J d is the twist, to first order
    h = 1e-6
    for body in model.bodies:
        moved = np.linalg.inv(model.pose(body, q0)) @ model.pose(body, model.integrate(q0, h * d))
        twist = twist_matrix(model.jacobian(body, q0) @ d)
        assert np.abs((moved - np.eye(4)) / h - twist).max() <= 1e-6 * (1 + norm(twist)) ** 2 * 10


# ---------------------------------------------------------------------- text that reads back


def read_back(model, text):
    """The expression that the text reads as; what fits in two ways is left out, as ruling 6 has it."""
    try:
        return Statements(model.soa).read(text).lhs
    except ParseError as error:
        assume("is ambiguous" not in str(error))
        raise


SMALL = trees(3, ["pin", "ball", "slider"])


def same_value(made, formula):
    assert (made.domain, made.codomain) == (formula.op.domain, formula.op.codomain)
    formula.assert_close(made.dense())


@runs(60)
@given(SMALL, st.data())
def test_text_reads_back_as_the_same_value(model, data):
    formula = formula_of(data, letters_of(model), 2)
    same_value(read_back(model, formula.op.text()), formula)


@runs(60)
@given(SMALL, st.data())
def test_text_reads_back_as_what_has_the_same_text(model, data):
    """Numbers in text are decimals, and 0.3 in Python is a double: what is read has the same text, not the same coefficients."""
    text = formula_of(data, letters_of(model), 2).op.text()
    made = read_back(model, text)
    assert made.text() == text, f"{text} reads as {made.text()}"


@runs(60)
@given(SMALL, st.data())
def test_latex_reads_back_as_the_same_value(model, data):
    formula = formula_of(data, letters_of(model), 2)
    same_value(read_back(model, formula.op.latex()), formula)


@runs(60)
@given(SMALL, st.data())
def test_python_reads_back_and_evaluates(model, data):
    """As Python reads it, by Python itself and by the parser: nothing is ambiguous in it."""
    formula = formula_of(data, letters_of(model), 2)
    soa = model.soa
    names = {name: getattr(soa, name) for name in "E phi phi_tilde H M J R P P_plus D G K tau tau_bar E_psi psi psi_tilde".split()}
    names |= {"Upsilon": soa.Upsilon, "Omega": soa.Omega, "I": soa.I, "blockdiag": pc.blockdiag}
    text = formula.op.python()
    same_value(eval(text, {"__builtins__": {}}, names), formula)
    same_value(Statements(soa).read(text).lhs, formula)


LETTERS_SHOWN = [s.name for s in pc._core.symbols if s.takes == "nothing"]


@pytest.mark.parametrize("style", ["text", "latex", "python"])
@pytest.mark.parametrize("name", LETTERS_SHOWN)
def test_every_letter_reads_back(name, style):
    model = pc.tree([-1, 0], ["pin", "universal"], seed=0)
    letter = getattr(model.soa, name)
    for op in (letter, letter.T, 2 * letter, letter.T * 0.5):
        made = Statements(model.soa).read(getattr(op, style)()).lhs
        assert made.domain == op.domain and np.array_equal(made.dense(), op.dense()), f"{getattr(op, style)()} reads as {made.text()}"


WITH_ARGUMENTS = {
    "B": lambda soa: soa.B("body1"),
    "Jacobian": lambda soa: soa.Jacobian(["body0", "body1"]),
    "Lambda": lambda soa: soa.Lambda("body0"),
    "Delta": lambda soa: soa.Delta(7),
    "root": lambda soa: soa.M.sqrt(),
    "root transposed": lambda soa: soa.M.sqrt().T,
    "root inverted": lambda soa: soa.D.sqrt().inv() @ soa.H,
    "blockdiag": lambda soa: pc.blockdiag(soa.phi @ soa.M @ soa.phi.T).inv(),
}


@pytest.mark.parametrize("style", ["text", "latex", "python"])
@pytest.mark.parametrize("name", WITH_ARGUMENTS)
def test_operators_with_arguments_and_roots_read_back(name, style):
    model = pc.tree([-1, 0], ["free", "universal"], seed=0)
    op = WITH_ARGUMENTS[name](model.soa)
    made = Statements(model.soa).read(getattr(op, style)()).lhs
    assert made == op, f"{getattr(op, style)()} reads as {made.text()}"
