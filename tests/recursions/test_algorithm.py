"""algorithm() in Python: what a plan is written out as computes what the plan computes, without pycraft (ruling 26).

Numbers are compared within the running bounds of `formulas`.
"""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

import pycraft as pc
from pycraft.recursions import LANGUAGES
from pycraft.recursions.steps import WRITERS
from support.block_trees import TREES, letters_on
from support.formulas import letters_of, norm
from support.mechanisms import every_kind, random_tree, uniform_batch
from support.random_formulas import draw, seeded
from support.spellings import BLOCKS, EVERYTHING, letters_and_constants
from support.written_programs import (
    DERIVATIVES,
    EXECUTED,
    MECHANICS,
    assert_is_the_operator,
    assert_runs,
    compiled,
    constants_alone,
    dense_expressions,
    run,
    scalars,
)

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


def test_constants_alone():
    rng = np.random.default_rng(5)
    for op in constants_alone(every_kind().soa, rng):
        x = rng.normal(size=op.shape[1])
        assert np.allclose(run(op.algorithm(), x), op @ x, atol=1e-12), op


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


@pytest.mark.parametrize("coordinate", [0, 7, 12])
@pytest.mark.parametrize("name", DERIVATIVES)
def test_derivatives(name, coordinate):
    o, _ = letters_and_constants(True)
    op = DERIVATIVES[name](o, coordinate)
    assert_is_the_operator(op)


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
    assert set(pc._core.step_kinds()) - EXECUTED == set()


def test_the_list_is_long_enough():
    assert len(EVERYTHING) >= 40
