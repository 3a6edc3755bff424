"""Expressions compiled for one model: graphs against plans for many letters and trees, and the callables that are built of some."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.compiled.expressions import ExpressionGraph
from support.closed_models import closed_four_bar
from support.graphs import evaluated

EPS = np.finfo(float).eps

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
        value = bound @ x[0][b] if x else getattr(bound, request)() if request != "apply" else bound.dense().ravel()
        wanted.append(float(value) if request in ("logdet", "trace", "norm") else value)
    return inputs, np.array(wanted)


@pytest.mark.parametrize("wanted", EXPRESSIONS)
@pytest.mark.parametrize("tree", TREES)
def test_graphs_are_the_plans(tree, wanted):
    """To the rounding of sums over bodies times the condition of what is inverted."""
    model = TREES[tree]()
    model.gravity = (0.3, -9.0, 1.0)
    make, request = EXPRESSIONS[wanted]
    expression = make(model.soa)
    made = ExpressionGraph(expression, request)
    inputs, exact = at_states(model, expression, request, made)
    found, sound = evaluated(made.graph, made.results, inputs)
    condition = np.linalg.cond(model.mass_matrix(inputs["q"])).max()
    assert sound.all()
    assert np.abs(found - exact).max() <= 400 * model.nv * EPS * condition * max(np.abs(exact).max(), 1e-3)


def test_derivatives():
    model = TREES["several subhinges"]()
    for coordinate in (0, 3, 5):
        expression = model.soa.MM.diff(coordinate)
        made = ExpressionGraph(expression, "apply")
        inputs, exact = at_states(model, expression, "apply", made)
        found, _ = evaluated(made.graph, made.results, inputs)
        np.testing.assert_allclose(found, exact, rtol=0, atol=400 * EPS * np.abs(exact).max())


def test_what_is_bound_is_folded_in():
    model = TREES["screws, balls, sliders"]()
    s = model.random_state(4)
    made = ExpressionGraph(model.soa.MM.inv().at(s.q), "apply")
    assert made.arguments == [("x", model.nv)] and made.model is None
    assert not any(name in ("sine", "divide") for name, *_ in (made.graph.operations[n] for n in made.graph.needed(made.results.ravel())))
    x = np.linspace(-1, 1, model.nv)
    found, _ = evaluated(made.graph, made.results, {"x": x[None]})
    np.testing.assert_allclose(found[0], model.soa.MM.inv().at(s.q) @ x, rtol=1e-10)


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
        ExpressionGraph(one.soa.MM.trace() + other.soa.MM.trace(), "apply")
    with pytest.raises(pc.EvaluationError, match="operations"):
        pc.chain(60).soa.X_world.compile("dense")


def test_letters_known_at_one_state_alone_are_refused_by_name():
    """Ruling 36: code is a function of the state. These would keep their values at the model's present one."""
    model, bars = pc.chain(4), closed_four_bar()
    grouped, free, loops = model.soa.grouped([["body1", "body2"]]), model.soa.free(["hinge1"]), bars.soa.embedded(["crank"])
    for op, what in (
        (grouped.MM, "grouped bodies"),
        (model.soa.MM + grouped.MM, "grouped bodies"),
        (grouped.MM.logdet() + model.soa.MM.trace(), "grouped bodies"),
        (free.MM, "free or of prescribed"),
        (free.Schur_complement, "free or of prescribed"),
        (model.soa.prescribed(["hinge1"]).D.trace(), "free or of prescribed"),
        (loops.MM, "embedded loops"),
        (loops.X_r, "embedded loops"),
    ):
        with pytest.raises(pc.EvaluationError, match=f"compile\\(\\) cannot record .*{what}.*at\\(q\\)"):
            op.compile()
    for op in (bars.soa.Q, bars.soa.Q @ bars.soa.MM.inv() @ bars.soa.Q.T):
        with pytest.raises(pc.EvaluationError, match="no recursion is written for Q, rows of loops"):
            op.compile()


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
