"""Expressions compiled for one model: graphs against plans for many letters and trees, and the callables that are built of some."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.compiled.compiled import Compiled, _callable
from pycraft.compiled.expressions import ExpressionGraph
from pycraft.compiled.graph import Graph
from support.closed_models import closed_four_bar
from support.graphs import evaluated
from support.graphs import inputs as inputs_of

EPS = np.finfo(float).eps
MOST = 400_000

TREES = {
    "several subhinges": lambda: pc.tree([-1, 0, 1, 1], ["universal", "planar", "gimbal", "cylindrical"], seed=2),
    "screws, balls, sliders": lambda: pc.tree([-1, 0, 1, 0], ["screw", "ball", "slider", "pin"], seed=3),
    "two roots, free": lambda: pc.tree([-1, -1, 0], ["free", "pin", "pin"], seed=4),
    "welds kept": lambda: pc.tree([-1, 0, 1, 2], ["pin", "weld", "weld", "slider"], seed=5, welds="keep"),
    "one body": lambda: pc.chain(1),
}

EXPRESSIONS = {
    "M x": (lambda s: s.MM, "apply"),
    "M⁻¹ x": (lambda s: s.MM.inv(), "apply"),
    "M": (lambda s: s.MM, "dense"),
    "M⁻¹": (lambda s: s.MM.inv(), "dense"),
    "diagonal of M⁻¹": (lambda s: s.MM.inv(), "diagonal"),
    "ln det M": (lambda s: s.MM, "logdet"),
    "tr M": (lambda s: s.MM, "trace"),
    "‖M‖": (lambda s: s.MM, "norm"),
    "with J": (lambda s: (s.MM + s.J).inv(), "apply"),
    "not a theorem": (lambda s: (s.MM + 0.1 * s.I).inv(), "apply"),
    "its ln det": (lambda s: s.MM + 0.1 * s.I, "logdet"),
    "I - HψK": (lambda s: s.I - s.H @ s.psi @ s.K, "apply"),
    "Υ": (lambda s: s.Upsilon, "dense"),
    "velocities": (lambda s: s.velocity, "dense"),
    "Coriolis accelerations": (lambda s: s.a, "dense"),
    "gyroscopic forces": (lambda s: s.b, "dense"),
    "gravity": (lambda s: s.gravity_field, "dense"),
    "world": (lambda s: s.X_world, "dense"),
    "Ḣ": (lambda s: s.H_dot, "apply"),
}


@pytest.fixture(scope="module", autouse=True)
def libraries(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYCRAFT_CACHE", str(tmp_path_factory.mktemp("libraries")))
        yield


def at_states(model, expression, request, made, count=3):
    """Inputs of the graph, and what the plan gives at each state."""
    rng = np.random.default_rng(1)
    drawn = [model.random_state(seed) for seed in range(count)]
    inputs = {"q": np.array([s.q for s in drawn]), "v": np.array([s.v for s in drawn])}
    inputs |= {name: rng.normal(size=(count, n)) for name, n in made.arguments if name not in "qv"}
    x = [inputs[name] for name, _ in made.arguments if name not in "qv"]
    wanted = []
    for b, s in enumerate(drawn):
        bound = expression.at(s.q, s.v) if isinstance(expression, pc.Operator) else expression.at(s.q)
        if isinstance(bound, pc.Scalar):
            value = float(bound)
        else:
            value = bound @ x[0][b] if x else getattr(bound, request)() if request != "apply" else bound.dense().ravel()
        wanted.append(float(value) if request in ("logdet", "trace", "norm") else value)
    return inputs, np.array(wanted)


@pytest.mark.parametrize("wanted", EXPRESSIONS)
@pytest.mark.parametrize("tree", TREES)
def test_graphs_are_the_plans(tree, wanted):
    """Graphs agree with plans to the rounding of sums over bodies times the condition; guards hold everywhere, except in eliminations."""
    model = TREES[tree]()
    model.gravity = (0.3, -9.0, 1.0)
    make, request = EXPRESSIONS[wanted]
    expression = make(model.soa)
    made = ExpressionGraph(expression, request, MOST)
    inputs, exact = at_states(model, expression, request, made)
    found, sound = evaluated(made.graph, made.results, inputs)
    condition = np.linalg.cond(model.mass_matrix(inputs["q"])).max()
    assert sound.all() or (sound.any() and wanted in ("not a theorem", "its ln det"))
    assert np.abs(found - exact)[sound].max() <= 400 * model.nv * EPS * condition * max(np.abs(exact).max(), 1e-3)


def test_derivatives():
    model = TREES["several subhinges"]()
    for coordinate in (0, 3, 5):
        expression = model.soa.MM.diff(coordinate)
        made = ExpressionGraph(expression, "apply", MOST)
        inputs, exact = at_states(model, expression, "apply", made)
        found, _ = evaluated(made.graph, made.results, inputs)
        np.testing.assert_allclose(found, exact, rtol=0, atol=400 * EPS * np.abs(exact).max())


def test_what_is_bound_is_folded_in():
    model = TREES["screws, balls, sliders"]()
    s = model.random_state(4)
    made = ExpressionGraph(model.soa.MM.inv().at(s.q), "apply", MOST)
    assert made.arguments == [("x", model.nv)] and made.model is None
    assert not any(name in ("sine", "divide") for name, *_ in (made.graph.operations[n] for n in made.graph.needed(made.results.ravel())))
    x = np.linspace(-1, 1, model.nv)
    found, _ = evaluated(made.graph, made.results, {"x": x[None]})
    wanted = model.soa.MM.inv().at(s.q) @ x
    size = np.linalg.cond(model.mass_matrix(s.q)) * np.abs(wanted).max()
    np.testing.assert_allclose(found[0], wanted, rtol=0, atol=40 * model.nv * EPS * size)


@pytest.mark.parametrize("count", [0, 1, 4])
def test_a_batch_of_states_is_for_the_compiled_function(count):
    MM = pc.chain(3).soa.MM
    Q = np.ones((count, 3))
    for bound in (MM.at(Q), MM.at(Q) + MM, MM.logdet().at(Q)):
        with pytest.raises(pc.EvaluationError, match=rf"bound to a batch, q of shape \({count}, nq\). Compile it before at"):
            bound.compile()
    if count != 1:
        with pytest.raises(pc.EvaluationError, match=f"a batch of {count} states"):
            MM.at(Q).plan("dense").tape(MOST)


def test_forms_are_folded_in_and_other_arithmetic_is_refused_by_name():
    model = TREES["several subhinges"]()
    q, x = model.random_state(3).q, np.linspace(-1, 1, model.nv)
    inverse = model.soa.MM.inv()
    for form in ("ud", "square-root"):
        made = ExpressionGraph(inverse.at(q, form=form), "apply", MOST)
        found, _ = evaluated(made.graph, made.results, {"x": x[None]})
        wanted = inverse.at(q, form=form) @ x
        size = np.linalg.cond(model.mass_matrix(q)) * np.abs(wanted).max()
        np.testing.assert_allclose(found[0], wanted, rtol=0, atol=40 * model.nv * EPS * size)
    for precision in ("single", "quad", 50):
        for bound in (inverse.at(q, precision=precision), model.soa.MM.logdet().at(q, precision=precision)):
            with pytest.raises(pc.EvaluationError, match="double precision"):
                bound.compile()
    with pytest.raises(pc.EvaluationError, match="without refine="):
        inverse.at(q, refine=1).compile()


def test_the_ln_det_of_a_sum_that_is_no_theorem_runs_as_code(monkeypatch):
    model = TREES["several subhinges"]()
    scalar = (model.soa.MM + 0.1 * model.soa.I).logdet()
    monkeypatch.setattr("pycraft.compiled.compiled._evaluated", lambda *given, **options: pytest.fail("evaluated by the plan"))
    compiled = scalar.compile()
    q = model.random_state(0).q
    assert compiled.operations > 100
    # The sizes are near 1, and each of nv pivots carries the rounding of its elimination.
    dense = model.mass_matrix(q) + 0.1 * np.eye(model.nv)
    assert abs(float(compiled(q)) - float(scalar.at(q))) <= 40 * model.nv * EPS * np.linalg.cond(dense)


def test_no_coordinates_and_no_states():
    welded = pc.tree([-1, 0], ["weld", "weld"], welds="keep")
    none = np.zeros(0)
    assert welded.soa.MM.compile()(none, none).shape == (0,) and welded.soa.MM.inv().compile("dense")(none).shape == (0, 0)
    assert float(welded.soa.MM.logdet().compile()(none)) == 0 and welded.soa.MM.trace().compile()(np.zeros((3, 0))).tolist() == [0, 0, 0]
    np.testing.assert_array_equal(welded.soa.phi.compile("dense")(none), welded.soa.phi.dense())
    compiled = pc.chain(1).soa.MM.compile()
    assert compiled(np.zeros((0, 1)), np.zeros((0, 1))).shape == (0, 1)
    assert compiled(np.zeros((0, 1), np.float32), np.zeros(1)).shape == (0, 1)  # by the plan


def test_compiled_expressions_run():
    model = TREES["screws, balls, sliders"]()
    s, x = model.random_state(4), np.linspace(-1, 1, model.nv)
    inverse = model.soa.MM.inv()
    compiled = inverse.compile()
    assert compiled.arguments == ("q", "x") and compiled.shape == (model.nv,)
    wanted = inverse.at(s.q) @ x
    size = 1e-12 * np.abs(wanted).max()
    np.testing.assert_allclose(compiled(s.q, x), wanted, atol=size)
    np.testing.assert_allclose(compiled(s.q.tolist(), x.tolist()), wanted, atol=size)  # by the plan
    Q = np.array([model.random_state(k).q for k in range(6)])
    np.testing.assert_allclose(compiled(Q, x), [inverse.at(q) @ x for q in Q], atol=10 * size)
    out = np.empty((6, model.nv))
    assert compiled(Q.tolist(), x, out=out) is out
    np.testing.assert_allclose(out, compiled(Q, x), atol=10 * size)


def test_named_vectors_are_arguments():
    """Also with names that have another meaning in the written code."""
    model = TREES["screws, balls, sliders"]()
    q = model.random_state(4).q
    s, y = (pc.vector(name, model.soa.Theta) for name in ("s", "y"))
    expression = model.soa.MM @ s - 2 * y
    compiled = expression.compile()
    assert compiled.arguments == ("q", "s", "y")
    a, b = np.linspace(-1, 1, model.nv), np.ones(model.nv)
    wanted = expression.at(q).value(s=a, y=b)
    np.testing.assert_allclose(compiled(q, a, b), wanted, atol=1e-12 * np.abs(wanted).max())
    np.testing.assert_array_equal(compiled(q.tolist(), a.tolist(), b.tolist()), wanted)


def test_a_vector_named_as_a_state():
    model = TREES["one body"]()
    with pytest.raises(pc.EvaluationError, match="rename"):
        (model.soa.MM @ pc.vector("q", model.soa.Theta)).compile()


def test_compiled_scalars_run():
    model = TREES["one body"]()
    scalar = model.soa.MM.logdet() + 2.0
    compiled = scalar.compile()
    assert compiled.arguments == ("q",) and compiled.shape == ()
    assert abs(float(compiled(np.array([0.3]))) - float(scalar.at([0.3]))) < 1e-14
    assert compiled(np.zeros((5, 1))).shape == (5,)


def test_errors_are_those_of_plans():
    model = TREES["one body"]()
    compiled = model.soa.MM.compile()
    with pytest.raises(pc.ModelError):
        compiled([0.1, 0.2], [1.0])
    with pytest.raises(pc.ModelError, match="as many as the others"):
        compiled(np.zeros((2, 1)), np.zeros((3, 1)))
    with pytest.raises(pc.ModelError, match="out="):
        compiled([0.1], [1.0], out=np.empty(7))
    with pytest.raises(pc.Error):
        compiled(np.array([np.nan]), np.array([1.0]))


def test_a_singular_state_is_refused_as_usual():
    model = pc.Multibody("in line")
    model.add_body("a", hinge="slider", axis=(1, 0, 0))
    model.add_body("b", "a", axis=(0, 0, 1), rotor_inertia=1.0)
    model.add_body("c", "b", hinge="slider", axis=(1, 0, 0), mass=1.0)
    inverse = (model.soa.MM + model.soa.J).inv()
    compiled = inverse.compile()
    bent = np.array([0.0, 1.0, 0.0])
    np.testing.assert_allclose(compiled(bent, np.ones(3)), inverse.at(bent) @ np.ones(3), rtol=1e-13)
    for angle in (0.0, 1e-9):  # then what is left of the mass is 1e-18 of it, and finite
        with pytest.raises(pc.Error, match="'a'"):
            compiled(np.array([0.0, angle, 0.0]), np.ones(3))


def test_an_edited_model_is_told():
    model = pc.chain(2)
    compiled = model.soa.MM.compile()
    before = compiled(np.zeros(2), np.ones(2))
    model.bodies["body1"].mass = 7.0
    np.testing.assert_array_equal(compiled(np.zeros(2), np.ones(2)), before)
    with pytest.raises(pc.EvaluationError, match="compile it again"):
        compiled([0.0, 0.0], [1.0, 1.0])


def test_what_cannot_be_compiled():
    one, other = pc.chain(2), pc.chain(2)
    with pytest.raises(pc.EvaluationError, match="'dense'"):
        one.soa.MM.compile("blockdiag")
    with pytest.raises(pc.EvaluationError, match="one model"):
        ExpressionGraph(one.soa.MM.trace() + other.soa.MM.trace(), "apply", MOST)
    with pytest.raises(pc.EvaluationError, match="operations"):
        pc.chain(60).soa.X_world.compile("dense")


def of_parts(model):
    """Expressions of trees that are made of a model's, and requests of them."""
    soa = model.soa
    grouped = soa.grouped([["body1", "body2"]])
    return {
        "grouped": (grouped.MM.inv(), "apply"),
        "grouped, ln det": (grouped.MM, "logdet"),
        "grouped beside its own": (soa.MM + grouped.MM, "dense"),
        "scalars of both": (grouped.MM.logdet() + 2 * soa.MM.trace(), "apply"),
        "free": (soa.free(["hinge1"]).MM.inv(), "apply"),
        "prescribed": (soa.prescribed(["hinge1"]).D.trace(), "apply"),
        "Schur complement": (soa.free(["hinge1"]).Schur_complement, "dense"),
        "derivative": (grouped.MM.diff(2), "dense"),
    }


@pytest.mark.parametrize("name", of_parts(pc.chain(3)))
def test_parts_compile_as_functions_of_the_state(name):
    """Ruling 36: today's state, at which the code is made, is not in it."""
    model = pc.chain(4)
    model.q = model.random_state(9).q
    expression, request = of_parts(model)[name]
    made = ExpressionGraph(expression, request, MOST)
    inputs, exact = at_states(model, expression, request, made)
    found, sound = evaluated(made.graph, made.results, inputs)
    assert sound.all()
    condition = np.linalg.cond(model.mass_matrix(inputs["q"])).max()
    assert np.abs(found - exact).max() <= 400 * model.nv * EPS * condition * np.abs(exact).max()


OF_LOOPS = {
    "embedded": lambda of, soa: (of.MM, "dense"),
    "embedded, inverse": lambda of, soa: (of.MM.inv(), "apply"),
    "embedded, ln det": lambda of, soa: (of.MM.logdet(), "apply"),
    "X_r": lambda of, soa: (of.X_r, "dense"),
    "Ẋ_r": lambda of, soa: (of.X_r_dot, "dense"),
    "derivative": lambda of, soa: (of.MM.diff(0), "dense"),
    "second derivative": lambda of, soa: (of.MM.diff(0).diff(0), "dense"),
    "Q": lambda of, soa: (soa.Q, "dense"),
    "Q derivative": lambda of, soa: (soa.Q.diff("crank"), "dense"),
    "Q ℳ⁻¹ Q*": lambda of, soa: (soa.Q @ soa.MM.inv() @ soa.Q.T, "dense"),
}


@pytest.mark.parametrize("name", OF_LOOPS)
def test_loops_compile_as_functions_of_the_state(name):
    """Guards hold at most states on the loops; at others, and off the loops, the plan answers.

    Every solve for the dependent rates multiplies rounding by the condition κ of their rows; a derivative adds one solve. ℳ⁻¹ multiplies it
    by its own condition. Sums are over coordinates; 40 as in `bound` of test_compiled_calls.
    """
    model = closed_four_bar()
    embedded = model.soa.embedded(["crank"])
    expression, request = OF_LOOPS[name](embedded, model.soa)
    made = ExpressionGraph(expression, request, MOST)
    drawn = [model.assemble(model.random_state(seed), seed=seed) for seed in range(8)]
    inputs = {"q": np.array([s.q for s in drawn]), "v": np.array([s.v for s in drawn])}
    inputs["x"] = np.random.default_rng(2).normal(size=(len(drawn), dict(made.arguments).get("x", 0)))
    found, sound = evaluated(made.graph, made.results, inputs)
    assert sound.mean() >= 0.5
    for b in np.flatnonzero(sound):
        s = drawn[b]
        bound = expression.at(s.q, s.v) if isinstance(expression, pc.Operator) else expression.at(s.q)
        value = float(bound) if isinstance(expression, pc.Scalar) else bound @ inputs["x"][b] if request == "apply" else bound.dense()
        sizes = np.linalg.svd(model.soa.Q.at(s.q).dense()[:, 1:], compute_uv=False)  # of all coordinates except the crank's
        solves = 1 + ("derivative" in name) + ("second" in name)
        condition = (sizes[0] / sizes[sizes > 1e-10 * sizes[0]][-1]) ** solves
        condition *= np.linalg.cond(model.mass_matrix(s.q)) if "inverse" in name or "⁻¹" in name else 1
        np.testing.assert_allclose(found[b], value, rtol=0, atol=40 * model.nv * EPS * condition * np.abs(value).max())
    if "Q" not in name:
        assert not evaluated(made.graph, made.results, inputs | {"q": inputs["q"] + 0.1})[1].any()


def test_loops_whose_rows_are_sought_are_refused_by_name():
    model = pc.chain(3)
    model.add_coupling(["hinge0", "hinge1"], function=lambda q: (q[0] - q[1], [1, -1], np.zeros((2, 2))), name="cam")
    with pytest.raises(pc.ModelError, match="'cam' cannot be compiled: it is a function"):
        model.soa.Q.compile()


def test_letters_known_at_one_state_are_compiled_there():
    model = pc.chain(4)
    q = model.random_state(3).q
    for soa in (model.soa.grouped([["body1", "body2"]]), model.soa.free(["hinge1"])):
        fixed = soa.MM.at(q)
        model.q = model.random_state(5).q
        assert soa.MM.at(q).compile().arguments == ("x",)
        x = np.ones(soa.Theta.dimension)
        np.testing.assert_allclose(fixed.compile()(x), fixed @ x, rtol=1e-13)


def test_trees_of_given_blocks_do_not_move():
    rng = np.random.default_rng(0)
    tree = pc.sko_model([-1, 0], [None, rng.normal(size=(3, 3))], [rng.normal(size=(1, 3))] * 2, [np.eye(3)] * 2)
    MM = tree.H @ tree.phi @ tree.M @ tree.phi.T @ tree.H.T
    x = np.ones(2)
    np.testing.assert_allclose(MM.compile()(x), MM @ x, rtol=1e-13)


def test_a_value_that_was_multiplied_by_zero_is_finite():
    """1/x is infinite at x = 0, and the result is not; the code leaves this state to the ordinary call, for one state and in a batch."""
    graph = Graph()
    x, y = inputs_of(graph, "x", 2)
    inverse = 1 / x
    assert (0 * inverse).value == 0
    results = np.array([(y / (1 + inverse)).index])
    ordinary = Compiled("f", graph, results, [("x", 2)], lambda x, out=None: np.full((*x.shape[:-1], 1), np.nan))
    call = _callable(ordinary, [("x", 2)], lambda: ())
    assert call(np.array([1.0, 3.0])).tolist() == [1.5]
    assert np.isnan(call(np.array([0.0, 3.0]))).all() and np.isnan(call(np.array([[1.0, 3.0]] * 9 + [[0.0, 3.0]]))).all()
    assert np.isnan(call(np.array([1.0, 2.0**200]))).all() and call(np.array([1.0, 2.0**199])).tolist() == [2.0**198]


def test_a_tape_tells_which_values_must_be_finite():
    """A value that is only multiplied by zero on the core's own tape."""
    model = TREES["several subhinges"]()
    finite = model.soa.MM.inv().at(model.q[None], model.v[None]).plan("dense").tape(MOST)[0][5]
    assert len(finite) > 0
