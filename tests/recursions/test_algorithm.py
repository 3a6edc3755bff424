"""algorithm(): what a plan is written out as computes what the plan computes, in Python without pycraft and in C++ without it, and
the text reads as the textbook recursion (ruling 26).

Numbers are compared within the running bounds of `formulas`.
"""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import pycraft as pc
from pycraft.recursions import LANGUAGES
from pycraft.recursions.steps import WRITERS
from support.block_trees import TREES, letters_on
from support.eigen import eigen_headers
from support.formulas import EPS, SLACK, letters_of, norm
from support.mechanisms import every_kind, random_tree, uniform_batch
from support.random_formulas import draw, seeded
from support.spellings import BLOCKS, EVERYTHING, Constants

_made = {}
_executed = set()  # kinds of steps whose emitted source ran in this run


def letters_and_constants(rotor_inertia):
    """One branched tree of every hinge kind, welds kept, with or without rotors."""
    if rotor_inertia not in _made:
        o = letters_of(every_kind(rotor_inertia))
        _made[rotor_inertia] = o, Constants(o)
    return _made[rotor_inertia]


def kinds_of(program):
    """The kinds of a plan's steps, those of its operands included."""
    found = set()
    for step in program["steps"]:
        found.add(step["kind"])
        if step["operand"]:
            found |= kinds_of(step["operand"])
    return found


def compiled(algorithm):
    """The function of an algorithm's Python source, run in a namespace that knows nothing of pycraft."""
    source = algorithm.python()
    imported = {alias.name for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Import) for alias in node.names}
    assert imported == {"numpy"} and "pycraft" not in source
    assert not any(isinstance(node, ast.ImportFrom) for node in ast.walk(ast.parse(source)))
    names = {"__name__": "written"}
    exec(compile(source, "written.py", "exec"), names)
    for plan in algorithm._plans:
        _executed.update(kinds_of(plan.program))
    return names["algorithm"]


def run(algorithm, *arguments, **state):
    """The number, vector or matrix that the emitted source computes."""
    return compiled(algorithm)(algorithm.data(**state), *arguments)


def logdet_bound(formula):
    """What rounding moves ln|det| by (formulas.Formula.assert_logdet)."""
    n, inverse = len(formula.value), norm(np.linalg.inv(formula.value)) if len(formula.value) else 0.0
    return SLACK * inverse * (formula.error + n * EPS * norm(formula.value)) * np.sqrt(max(n, 1)) + n * EPS


def assert_runs(formula, rng, requests=("apply", "dense", "norm", "diagonal", "trace", "logdet")):
    """Every request of a formula that has it, as emitted Python, against the dense value."""
    op, value = formula.op, formula.value
    rows, n = value.shape
    square = op.domain == op.codomain or op.domain == op.codomain.dual
    for request in requests:
        if request in ("diagonal", "trace", "logdet") and not square:
            continue
        if request == "logdet" and rows and not (np.linalg.cond(value) < 1e12 and logdet_bound(formula) < 1):
            continue  # singular to working precision
        written = op.algorithm("python", request)
        assert written.text and written.latex
        if request == "apply":
            x = rng.uniform(-1, 1, (n, 2))
            formula.assert_close(run(written, x), value @ x, np.sqrt(2 * n))
            formula.assert_close(run(written, x[:, 0]), value @ x[:, 0], np.sqrt(n))
        elif request == "dense":
            formula.assert_close(run(written))
        elif request == "norm":
            formula.assert_close(run(written), norm(value), np.sqrt(rows * n))
        elif request == "diagonal":
            formula.assert_close(run(written), np.diag(value))
        elif request == "trace":
            formula.assert_close(run(written), np.trace(value), n)
        else:
            off = abs(run(written) - np.linalg.slogdet(value)[1])
            assert off <= logdet_bound(formula), f"ln|det({op.text()})|: off by {off:.2e}"


# ---------------------------------------------------------------------- Python


@pytest.mark.parametrize("rotor_inertia", [False, True], ids=["no rotors", "rotors"])
@pytest.mark.parametrize("name", EVERYTHING)
def test_python_of_every_spelling(name, rotor_inertia):
    if rotor_inertia and name == "ℳ inverted twice":
        pytest.skip("of ℳ + J only where there are no rotors")
    formula = EVERYTHING[name](*letters_and_constants(rotor_inertia))
    assert_runs(formula, np.random.default_rng(0))


@pytest.mark.parametrize("seed", range(40))
def test_python_of_random_expressions_on_random_mechanisms(seed):
    rng = np.random.default_rng(seed)
    letters = letters_of(random_tree(rng, int(rng.integers(1, 8))))
    domain, codomain = (str(s) for s in rng.choice(list("TVF"), 2))
    formula = draw(seeded(rng), letters, domain, codomain, 3)
    assert_runs(formula, rng)


@pytest.mark.parametrize("with_J", [False, True], ids=["J = 0", "J"])
@pytest.mark.parametrize("seed", range(30))
def test_python_of_random_expressions_on_blocks_of_any_size(seed, with_J):
    """Trees of raw blocks of mixed sizes, some bodies without coordinates."""
    rng = np.random.default_rng(1000 + seed)
    letters = letters_on(str(rng.choice(list(TREES))), with_J, seed)
    domain, codomain = (str(s) for s in rng.choice(list("TVF"), 2))
    assert_runs(draw(seeded(rng), letters, domain, codomain, 3), rng)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(300))
def test_python_of_more_random_expressions(seed):
    rng = np.random.default_rng(5000 + seed)
    if seed % 2:
        letters = letters_of(random_tree(rng, int(rng.integers(1, 9))))
    else:
        letters = letters_on(str(rng.choice(list(TREES))), bool(rng.integers(2)), seed)
    space = str(rng.choice(list("TVF")))
    assert_runs(draw(seeded(rng), letters, space, space, 3), rng)


@pytest.mark.parametrize("name", ["E", "phi", "H", "D", "Upsilon", "Omega", "R"])
def test_python_without_bodies_states_or_coordinates(name):
    empty = pc.sko_model([], [], [], [])
    one = pc.sko_model([-1, 0], [None, np.ones((2, 3))], [np.zeros((0, 2)), np.eye(1, 3)], [np.eye(2), 2 * np.eye(3)])
    for soa in (empty, one):
        op = getattr(soa, name)
        x = np.ones(op.shape[1])
        assert np.allclose(run(op.algorithm(), x), op @ x, atol=1e-14)
        assert run(op.algorithm(request="dense")).shape == op.shape


MECHANICS = {
    "θ̇": lambda o: o.theta_dot,
    "V": lambda o: o.velocity,
    "a": lambda o: o.a,
    "b": lambda o: o.b,
    "γ": lambda o: o.gravity_field,
    "a₀": lambda o: o.gravity_base,
    "bias": lambda o: o.H @ o.phi @ (o.M @ o.phi.T @ o.a + o.b),
    "gravity": lambda o: o.H @ o.phi @ o.M @ o.gravity_field,
    "Ṽa": lambda o: o.V_tilde @ o.a,
    "𝓑V": lambda o: o.momentum_cross @ o.velocity + o.V_bar @ o.b,
    "X*a": lambda o: o.X_world.T.inv() @ o.a,
    "Δb": lambda o: o.Delta(3) @ o.b + o.Delta_theta_dot @ o.b,
    "Ḣ*θ̇": lambda o: o.H_dot.T @ o.theta_dot,
}


@pytest.mark.parametrize("name", MECHANICS)
def test_vectors_and_velocities_of_a_mechanism(name):
    model = every_kind(True)
    model.gravity = (0.3, -0.2, -9.81)
    vector = MECHANICS[name](model.soa)
    assert np.allclose(run(vector.algorithm("python")), vector.value(), rtol=1e-12, atol=1e-12)
    state = model.random_state(5)
    there = run(vector.algorithm("python"), q=state.q, v=state.v)
    assert np.allclose(there, vector.at(state.q, state.v).value(), rtol=1e-12, atol=1e-12)


def test_named_vectors_are_arguments_in_the_order_of_their_names():
    model = every_kind(True)
    soa, rng = model.soa, np.random.default_rng(2)
    inverse = (soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T + soa.J).inv()
    vectors = {name: rng.normal(size=len(soa.Theta)) for name in ("D", "T", "lambda", "my load")}
    D, T, given, load = (pc.vector(name, soa.Theta) for name in vectors)
    op = inverse @ (T + 2 * D) + load - soa.D @ given
    written = op.algorithm("python")
    assert np.allclose(run(written, *vectors.values()), op.value(**vectors), atol=1e-11)
    assert re.search(r"def algorithm\(data, D_2, T, lambda_2, my_load\)", str(written))
    energy = 0.5 * T.T @ inverse @ T
    assert np.allclose(run(energy.algorithm(), vectors["T"]), energy.value(T=vectors["T"]), atol=1e-11)


def test_states_bound_and_batches():
    model = every_kind(True)
    soa, x = model.soa, np.random.default_rng(3).normal(size=len(model.soa.Theta))
    MM, other = soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T + soa.J, model.random_state(8).q
    difference = MM - MM.at(other)
    assert np.allclose(run(difference.algorithm("python"), x), difference @ x, atol=1e-11)
    assert "at a bound state" in difference.algorithm().text
    q, v = uniform_batch(model, 3)
    batch = MM.inv().at(q, v)
    for i in range(3):
        assert np.allclose(run(batch.algorithm(), x, state=i), (batch @ x)[i], atol=1e-10)
    with pytest.raises(pc.EvaluationError, match="batch of 3"):
        batch.algorithm().data(state=3)
    wide = MM.inv().at(other, precision="quad")
    assert "quad" in wide.algorithm().text and np.allclose(run(wide.algorithm(), x), wide @ x, atol=1e-10)


def test_two_models_in_one_expression():
    one, two = every_kind(), pc.chain(3)
    rng = np.random.default_rng(4)
    inertias = [o.H @ o.phi @ o.M @ o.phi.T @ o.H.T for o in (one.soa, two.soa)]
    middle = pc.constant(rng.normal(size=(2, len(one.soa.Theta))), one.soa.Theta, 2, "A")
    out = pc.constant(rng.normal(size=(3, 2)), 2, two.soa.Theta, "A")
    op = inertias[1].inv() @ out @ middle @ inertias[0]
    x = rng.normal(size=len(one.soa.Theta))
    expected = op @ x
    assert np.allclose(run(op.algorithm(), x), expected, atol=1e-12 * norm(expected))


def constants_alone(soa, rng):
    """Expressions without a letter of a model."""
    n = len(soa.Theta)
    C = pc.constant(rng.normal(size=(n, n)), soa.Theta, soa.Theta, "C")
    d = pc.constant(rng.uniform(1, 2, n), soa.Theta, soa.Theta, "d")
    U = pc.constant(rng.normal(size=(n, 2)), 2, soa.Theta, "U")
    yield from (C, 2 * C.T @ C, C + d, d.inv() @ d, U, U.T @ U, pc.identity(soa.Theta), pc.zero(soa.Theta, soa.F))
    yield from (pc.identity(pc.euclidean(1)), 3 * pc.identity(pc.euclidean(1)), (U.T @ U).inv(), C.inv())


def test_constants_alone():
    rng = np.random.default_rng(5)
    for op in constants_alone(every_kind().soa, rng):
        x = rng.normal(size=op.shape[1])
        assert np.allclose(run(op.algorithm(), x), op @ x, atol=1e-12), op


def dense_expressions():
    """Expressions whose plans have dense steps."""
    o, c = letters_and_constants(True)
    full = c.full()
    return {
        "inverse": (o.MM + full).inv(),
        "inverse of inverse": ((o.MM + full).inv() + 0.1 * o.I).inv(),
        "blocks": (o.MM + full).inv().blockdiag(),
        "product": full @ o.MM,
    }


@pytest.mark.parametrize("name", ["inverse", "inverse of inverse", "blocks", "product"])
def test_dense_steps(name):
    formula = dense_expressions()[name]
    assert_runs(formula, np.random.default_rng(6))
    assert_runs(formula, np.random.default_rng(6), requests=("logdet",))


def test_an_operator_from_outside_is_a_callable_in_the_data():
    o, _ = letters_and_constants(True)
    double = pc._core.external(lambda x: 2 * x, lambda x: 2 * x, o.soa.Theta, o.soa.Theta, "twice")
    MM = o.MM.op
    op, x = MM @ double @ MM + double.T, np.random.default_rng(7).normal(size=len(o.soa.Theta))
    written = op.algorithm()
    data = written.data() | {"twice": lambda x: 2 * x, "twice_transposed": lambda x: 2 * x}
    expected = op @ x
    assert np.allclose(compiled(written)(data, x), expected, atol=1e-12 * norm(expected))


def scalars(o):
    """Scalars made of operators."""
    MM = o.MM.op
    yield from (MM.trace(), 2 * MM.trace() - o.D.op.logdet() + 1.5, (MM + o.J.op).logdet() + MM.norm(), -(3 * (MM.trace() - 2)))
    yield from (o.D.op.logdet(), o.phi.op.logdet(), pc._core.scalar(2.5), o.soa.H.norm() - 2 * o.MM.op.norm())


def test_scalars():
    o, _ = letters_and_constants(True)
    for scalar in scalars(o):
        for language in LANGUAGES:
            assert str(scalar.algorithm(language))
        assert abs(run(scalar.algorithm()) - float(scalar)) <= 1e-12 * max(1, abs(float(scalar))), scalar.text()
    at = (o.MM.op.trace() - o.D.op.logdet()).at(every_kind(True, 3).q)
    assert abs(run(at.algorithm()) - float(at)) <= 1e-12 * abs(float(at))


def test_the_norm_of_a_long_operator():
    """Above 600 columns the norm is the root of tr(X*X): its step is written too."""
    soa = pc.chain(101).soa
    scalar = (soa.H @ soa.phi).norm()
    assert abs(run(scalar.algorithm()) - float(scalar)) <= 1e-12 * float(scalar)


def test_data_as_json_and_in_the_source():
    o, _ = letters_and_constants(True)
    op, x = (o.MM + o.J).inv().op, np.random.default_rng(9).normal(size=len(o.soa.Theta))
    written = op.algorithm("python")
    function = compiled(written)
    assert np.array_equal(function(json.loads(written.json()), x), function(written.data(), x))
    names = {"__name__": "written"}
    exec(written.python(with_data=True, name="inverse_dynamics"), names)
    assert np.array_equal(names["inverse_dynamics"](names["DATA"], x), function(written.data(), x))


def test_the_source_runs_by_itself(tmp_path):
    """In an interpreter that cannot import pycraft, printing the result for x = 1."""
    o, _ = letters_and_constants(False)
    op = (o.MM + 0.1 * o.I).inv().op
    file = tmp_path / "written.py"
    file.write_text(op.algorithm().python(with_data=True), encoding="utf-8")
    start = "import sys; sys.modules['pycraft'] = None; import numpy, runpy; numpy.set_printoptions(precision=17); "
    start += f"runpy.run_path({str(file)!r}, run_name='__main__')"
    shown = subprocess.run([sys.executable, "-c", start], capture_output=True, text=True, check=True).stdout
    assert np.allclose(np.array(shown.strip(" []\n").split(), float), op @ np.ones(op.shape[1]), rtol=1e-9)


DERIVATIVES = {
    "∂ℳ": lambda o, d: o.MM.op.diff(d),
    "∂ℳ⁻¹": lambda o, d: (o.MM + o.J).inv().op.diff(d),
    "∂φ": lambda o, d: o.phi.op.diff(d),
    "∂D": lambda o, d: o.D.op.diff(d),
    "∂∂ℳ": lambda o, d: o.MM.op.diff(d).diff(1),
    "∂D^½": lambda o, d: o.D.op.sqrt().diff(d),
    "∂b": lambda o, d: o.soa.b.diff(d),
    "∂a": lambda o, d: o.soa.a.diff(d),
    "∂V̄": lambda o, d: o.soa.V_bar.diff(d),
    "∂𝓑": lambda o, d: o.soa.momentum_cross.diff(d),
    "∂Υ": lambda o, d: o.Upsilon.op.diff(d),
    "∂ℳ, world": lambda o, d: o.MM.op.diff(d, frame="world"),
    "ℳ̇": lambda o, d: o.MM.op.dot(),
    "ḃ": lambda o, d: o.soa.b.dot(vdot=np.linspace(-1, 1, len(o.soa.Theta))),
    "V̄̇": lambda o, d: o.soa.V_bar.dot(vdot=np.linspace(-1, 1, len(o.soa.Theta))),
}


@pytest.mark.parametrize("coordinate", [0, 7, 12])
@pytest.mark.parametrize("name", DERIVATIVES)
def test_derivatives(name, coordinate):
    o, _ = letters_and_constants(True)
    op = DERIVATIVES[name](o, coordinate)
    assert_is_the_operator(op)


def assert_is_the_operator(op):
    """The emitted source applies the operator, to rounding at the size of what it maps to, cancellation within it allowed."""
    written = op.algorithm("python")
    assert written.text and written.latex
    x = np.random.default_rng(11).normal(size=(op.shape[1], 2))
    vector = op.shape[1] == 1 and not written._program.inputs
    got, expected = (run(written), op.value()) if vector else (run(written, x), op @ x)
    assert np.abs(got - expected).max(initial=0.0) <= 1e-9 * (1 + np.abs(expected).max(initial=0.0)), op.text()


def test_derivatives_along_parameters():
    model = every_kind(True)
    soa = model.soa
    MM = soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T
    body, several = model.bodies["body3"], next(h for h in model.hinges.values() if len(h.subhinges) > 1)
    parameters = [body.symbol("mass"), body.symbol("com", "y"), body.symbol("inertia", 0, 1), body.hinge.symbol("placement", "rx")]
    parameters += [several.symbol("axis", 0, 1), several.symbol("point", 1, 1), several.symbol("rotor_inertia", 0)]
    for parameter in parameters:
        for op in (MM, (MM + soa.J).inv(), soa.b):
            assert_is_the_operator(op.diff(parameter))
    assert_is_the_operator(MM.diff(several.symbol("axis", 1, 1)).diff(several.v_slice.start))


# ---------------------------------------------------------------------- every kind of step


def test_every_kind_of_step_has_a_writer():
    assert set(WRITERS) == set(pc._core.step_kinds())


def test_every_kind_of_step_was_run():
    """The expressions of this file exercise every writer: source with each kind of step ran and was right."""
    rng = np.random.default_rng(10)
    o, c = letters_and_constants(True)
    wanted = [*(EVERYTHING[name](o, c) for name in ("ℳ with J", "ℳ⁻¹ as typed", "shifted", "rank two", "φψφ*-like", "E X E*", "𝒥"))]
    wanted += [BLOCKS[name](o, c) for name in ("blockdiag ψMψ*", "blockdiag of a shifted inverse", "D^-½HψM^½", "blockdiag Ω")]
    wanted += [o.D, o.MM + c.full(), (o.MM + c.full()).inv().blockdiag(), (o.MM + c.full()).inv(), c.full(), o.E]
    for formula in wanted:
        assert_runs(formula, rng)
    for op in constants_alone(o.soa, rng):
        run(op.algorithm(), rng.normal(size=op.shape[1]))
    test_vectors_and_velocities_of_a_mechanism("bias")
    test_named_vectors_are_arguments_in_the_order_of_their_names()
    test_an_operator_from_outside_is_a_callable_in_the_data()
    test_the_norm_of_a_long_operator()
    test_scalars()
    for name in ("∂D^½", "∂b", "V̄̇", "ḃ"):
        assert_is_the_operator(DERIVATIVES[name](o, 7))
    run(pc.blockdiag(o.E.op.T @ o.Upsilon.op @ o.E.op).algorithm(request="trace"))
    model = every_kind(True)
    assert_is_the_operator((o.soa.MM + o.soa.J).inv().diff(7).at(model.q, form="ud"))
    assert set(pc._core.step_kinds()) - _executed == set()


# ---------------------------------------------------------------------- text and LaTeX


def equations(text):
    """The lines of a text that are equations or announce a pass, stripped."""
    return [line.strip() for line in text.splitlines() if " = " in line or line.startswith("for ")][1:]


def test_the_text_of_forward_dynamics_is_the_textbooks():
    soa = pc.robots.panda().soa
    H, phi, M = soa("H phi M")
    written = ((H @ phi @ M @ phi.T @ H.T).inv() @ pc.vector("T", soa.Theta)).algorithm()
    lines = [line for line in equations(str(written)) if not line.startswith("by ")]
    assert lines == [
        "for k from tip to base:",
        "P(k) = M(k) + Σ_c E(k,c) P⁺(c) E*(k,c)",
        "D(k) = H(k) P(k) H*(k)",
        "G(k) = P(k) H*(k) D⁻¹(k)",
        "P⁺(k) = P(k) - G(k) D(k) G*(k)",
        "z(k) = Σ_c E(k,c) z⁺(c)",
        "ε(k) = T(k) - H(k) z(k)",
        "ν(k) = D⁻¹(k) ε(k)",
        "z⁺(k) = z(k) + G(k) ε(k)",
        "for k from base to tip:",
        "α⁺(k) = E*(p,k) α(p)",
        "y(k) = ν(k) - G*(k) α⁺(k)",
        "α(k) = α⁺(k) + H*(k) y(k)",
    ]
    assert "cost: O(N)" in str(written) and "7 bodies" in str(written)
    assert "by inverse by the innovations factors" in str(written)


def test_the_text_of_the_mass_matrix_and_of_velocities():
    model = every_kind(True)
    soa = model.soa
    MM = soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T
    assert equations((MM + soa.J).algorithm().text) == [
        "for k from base to tip:",
        "α(k) = E*(p,k) α(p) + H*(k) x(k)",
        "for k from tip to base:",
        "f(k) = M(k) α(k) + Σ_c E(k,c) f(c)",
        "y(k) = H(k) f(k) + J(k) x(k)",
    ]
    assert equations(soa.b.algorithm().text)[1:4] == [
        "β(k) = H*(k) θ̇(k)",
        "V(k) = E*(p,k) V(p) + β(k)",
        "b(k) = crf(V(k)) M(k) V(k)",
    ]
    assert "R(k) = M(k) + Σ_c E(k,c) R(c) E*(k,c)" in soa.R.algorithm().text
    assert "Υ(k) = H*(k) D⁻¹(k) H(k) + τ̄*(k) E*(p,k) Υ(p) E(p,k) τ̄(k)" in soa.Upsilon.algorithm().text
    assert "for c = k and then its ancestors" in MM.algorithm(request="dense").text
    assert "cost: O(N · depth)" in MM.algorithm(request="dense").text


def test_the_text_of_a_realization_shows_its_equations_and_their_elimination():
    o, c = letters_and_constants(False)
    text = (o.MM + 0.1 * o.I).inv().op.algorithm().text
    for line in (
        "s(k) - E*(p,k) s(p) - H*(k) s₃(k) = b₁(k)",
        "A(k) = T(k,k) - Σ_c T(k,c) U(c)",
        "U(k) = A⁻¹(k) T(k,p)",
        "r(k) = b(k) - Σ_c T(k,c) A⁻¹(c) r(c)",
        "σ(k) = A⁻¹(k) r(k) - U(k) σ(p)",
    ):
        assert line in text
    bordered = (o.MM + o.J + c.border @ c.border.T + 0.1 * o.I).inv().op.algorithm().text
    assert "S₂ = T₂(b,b) - Σ_k Y₂(k) X₂(k)" in bordered and "s₃ - Σ_k U*(·,k) s₅(k) = b₃" in bordered  # U is the user's


def test_passes_that_go_one_way_are_one_pass():
    o, _ = letters_and_constants(False)
    for formula in (o.MM.inv(), o.phi @ o.phi @ o.M @ o.P.inv() @ o.psi):
        heads = [line for line in str(formula.op.algorithm()).splitlines() if line.startswith("for ")]
        assert len(heads) <= 2 and all(a != b for a, b in zip(heads, heads[1:], strict=False))


@pytest.mark.parametrize("name", EVERYTHING)
def test_latex_is_balanced(name):
    op = EVERYTHING[name](*letters_and_constants(True)).op
    latex = op.algorithm("latex")
    text = str(latex)
    assert text.startswith("\\begin{aligned}") and text.endswith("\\end{aligned}") and latex._repr_latex_().startswith("$")
    assert text.count("{") == text.count("}") and text.count("\\left") == text.count("\\right")
    assert not re.search(r"[^\x00-\x7f]", text.replace("ℳ", "")), "letters are written as LaTeX"
    assert not re.search(r"\^\{[^{}]*\}\^", text), "no double superscript"
    assert op.algorithm("python")._repr_latex_() is None


def test_what_is_refused():
    soa = pc.chain(2).soa
    with pytest.raises(pc.EvaluationError, match="'fortran'.*text, latex, python, cpp"):
        soa.phi.algorithm("fortran")
    with pytest.raises(pc.EvaluationError, match="no plan is made for 'eigenvalues'"):
        soa.phi.algorithm(request="eigenvalues")
    with pytest.raises(pc.SpaceError):
        soa.I.algorithm()
    with pytest.raises(pc.EvaluationError, match="'forward dynamics'"):
        soa.phi.algorithm().python(name="forward dynamics")


# ---------------------------------------------------------------------- C++


PRINT = """
template <class T>
void print(const T& result) {
  Eigen::MatrixXd y(1, 1);
  if constexpr (std::is_same_v<T, double>) y(0, 0) = result;
  else y = result;
  for (int i = 0; i < y.rows(); ++i)
    for (int j = 0; j < y.cols(); ++j) std::cout << y(i, j) << ' ';
  std::cout << std::endl;
}
int main() {
  std::cout.precision(17);
"""


def run_cpp(algorithms, folder):
    """The results of several algorithms at x = 1, compiled as one file; lists of numbers."""
    headers = eigen_headers()
    if headers is None:
        pytest.skip("Eigen's headers are not here")
    text, calls = "", []
    for i, written in enumerate(algorithms):
        source = written.cpp(with_data=True, name=f"a{i}")
        assert set(re.findall(r"#include <(.*?)>", source)) == {
            *("Eigen/Dense", "algorithm", "cmath", "functional", "iostream", "limits", "stdexcept", "vector")
        }
        assert '#include "' not in source and "pycraft" not in source
        call = re.search(r"a\d+::run\((.*)\)( <<|\))", source).group(0).removesuffix(" <<")
        text += source
        calls.append(f"  print({call});")
    (folder / "written.cpp").write_text(text + PRINT + "\n".join(calls) + "\n}\n", encoding="utf-8")
    program = folder / "written"
    command = ["g++", "-std=c++17", "-O0", "-Wall", "-Wextra", "-DNO_MAIN", "-isystem", str(headers), "-o", str(program)]
    made = subprocess.run([*command, str(folder / "written.cpp")], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr[:4000]
    assert "warning" not in made.stderr, made.stderr[:4000]
    shown = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout
    return [np.array(line.split(), float) for line in shown.splitlines()]


def cpp_cases(o, c, names):
    """(algorithm, expected, bound) of spellings, applied and reduced."""
    for name in names:
        formula = EVERYTHING[name](o, c)
        op, value = formula.op, formula.value
        x = np.ones(len(value[0]))
        yield op.algorithm("cpp"), value @ x, formula.bound * np.sqrt(len(x))
        if op.domain == op.codomain:
            yield op.algorithm("cpp", "trace"), [np.trace(value)], formula.bound * len(value)
            yield op.algorithm("cpp", "diagonal"), np.diag(value), formula.bound
            yield op.algorithm("cpp", "dense"), value.ravel(), formula.bound
            if np.linalg.cond(value) < 1e12:
                yield op.algorithm("cpp", "logdet"), [np.linalg.slogdet(value)[1]], logdet_bound(formula)


GROUPS = {
    "kernels and sweeps": ["ℳ with J", "ℳ⁻¹ as typed", "(I+HφK)⁻¹", "φψφ*-like", "𝒥", "D^-½HψM^½", "blockdiag ψMψ*", "blockdiag φ*Wφ"],
    "eliminations": ["shifted", "nested shifts", "φMφ* and loads", "compliance by hand", "blockdiag of a shifted inverse"],
    "borders and nodes": ["rank two", "Schur complement", "Woodbury by hand", "Λ", "(ℳ+𝒥*𝒥)⁻¹", "siblings", "E X E*"],
}


def assert_cpp(cases, folder):
    cases = list(cases)
    for (written, expected, bound), got in zip(cases, run_cpp([case[0] for case in cases], folder), strict=True):
        off = np.abs(got - np.asarray(expected)).max(initial=0.0)
        assert off <= bound, f"{written.title}: off by {off:.2e}, bound {bound:.2e}"


@pytest.mark.slow
@pytest.mark.parametrize("group", GROUPS)
def test_cpp_of_spellings(group, tmp_path):
    assert_cpp(cpp_cases(*letters_and_constants(True), GROUPS[group]), tmp_path)


@pytest.mark.slow
def test_cpp_of_mechanics_scalars_and_dense_steps(tmp_path):
    o, _ = letters_and_constants(True)
    cases = []
    for make in MECHANICS.values():
        vector = make(o.soa)
        expected = vector.value()
        cases.append((vector.algorithm("cpp"), expected, 1e-12 * (1 + norm(expected))))
    for scalar in scalars(o):
        cases.append((scalar.algorithm("cpp"), [float(scalar)], 1e-12 * (1 + abs(float(scalar)))))
    for name in ("∂ℳ⁻¹", "∂D^½", "∂b", "V̄̇", "ḃ"):
        op = DERIVATIVES[name](o, 7)
        expected = op @ np.ones(op.shape[1])
        cases.append((op.algorithm("cpp"), expected, 1e-9 * (1 + norm(expected))))
    for formula in dense_expressions().values():
        x = np.ones(formula.op.shape[1])
        cases.append((formula.op.algorithm("cpp"), formula.value @ x, formula.bound * np.sqrt(len(x))))
    assert_cpp(cases, tmp_path)


@pytest.mark.slow
def test_cpp_of_random_expressions(tmp_path):
    cases = []
    for seed in range(24):
        rng = np.random.default_rng(7000 + seed)
        if seed % 2:
            letters = letters_of(random_tree(rng, int(rng.integers(1, 6))))
        else:
            letters = letters_on(str(rng.choice(list(TREES))), bool(rng.integers(2)), seed)
        domain, codomain = (str(s) for s in rng.choice(list("TVF"), 2))
        formula = draw(seeded(rng), letters, domain, codomain, 3)
        x = np.ones(formula.op.shape[1])
        cases.append((formula.op.algorithm("cpp"), formula.value @ x, formula.bound * np.sqrt(max(1, len(x)))))
    assert_cpp(cases, tmp_path)


# ---------------------------------------------------------------------- the document


def test_the_document_shows_what_is_written():
    """The outputs in docs/algorithm.md are those of the package."""
    text = (Path(__file__).parents[2] / "docs" / "algorithm.md").read_text(encoding="utf-8")
    code, *shown = (block.removeprefix("python\n") for block in re.findall(r"```(.*?)```", text, re.S)[:3])
    names = {}
    exec(code, names)
    for name, block in zip(("MM", "inverse"), shown, strict=True):
        assert names[name].algorithm().text.strip() == block.strip()


def test_the_list_is_long_enough():
    assert len(EVERYTHING) >= 40
