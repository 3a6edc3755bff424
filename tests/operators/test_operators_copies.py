"""Lifetimes: stale operators after edits, node operators after new nodes, copies and pickles, threads."""

import concurrent.futures
import copy
import gc
import pickle

import numpy as np
import pytest

import pycraft as pc
from support.formulas import letters_of
from support.mechanisms import every_kind, uniform_batch
from support.random_formulas import draw, seeded


def mass_matrix(model):
    H, phi, M = model.soa("H phi M")
    return H @ phi @ M @ phi.T @ H.T


# ---------------------------------------------------------------------- structural edits (ruling 13)


EDITS = {
    "added": lambda m: m.add_body("extra", "body4", "slider", mass=1.0, inertia=np.eye(3)),
    "removed": lambda m: m.remove_body("body10"),
}


@pytest.mark.parametrize("edit", EDITS)
def test_operators_of_an_edited_model_are_stale(edit):
    model = every_kind()
    soa, MM = model.soa, mass_matrix(model)
    bound, trace, T = MM.at(model.q), MM.trace(), pc.vector("T", model.soa.Theta)
    x = np.ones(model.nv)
    MM @ x, bound @ x, float(trace), MM.plan()  # plans and values are cached by now
    name = {"added": "extra", "removed": "body10"}[edit]
    EDITS[edit](model)
    for ask in (
        lambda: MM @ x,
        lambda: x @ MM,
        lambda: MM.dense(),
        lambda: np.asarray(MM),
        lambda: bound @ x,
        lambda: float(trace),
        lambda: MM.diagonal(),
        lambda: (MM @ T).value(T=x),
        lambda: MM.at(model.q),
        lambda: MM.explain(),
        lambda: MM.plan("logdet"),
        lambda: MM.simplify(),
        lambda: (2 * MM.inv()) @ x,
        lambda: MM.blocks(),
        lambda: soa.Upsilon,
        lambda: soa.B("body1"),
        lambda: soa.check(),
        lambda: MM.check_current(),
        lambda: model.soa.H @ soa.phi,
        lambda: model.soa.H + soa.H,
    ):
        with pytest.raises(pc.StaleOperatorError, match=f"made before '{model.name}' changed \\(body '{name}' was {edit}\\)"):
            ask()
        with pytest.raises(RuntimeError):
            ask()
    assert not soa.is_current() and model.soa.is_current() and model.soa is not soa
    assert MM.text() == "H φ M φ* H*" and "H φ M" in repr(MM)  # to look at it is no use of it
    letters_of(model).MM.assert_close(mass_matrix(model).dense())
    assert np.allclose(model.mass_matrix(model.q), mass_matrix(model).dense(), rtol=0, atol=1e-9)


def test_edits_carry_the_state_by_hinge_name():
    model = every_kind()
    kept = {h: (model.q[model.hinges[h].q_slice].copy(), model.v[model.hinges[h].v_slice].copy()) for h in model.hinges}
    model.add_body("extra", "body1", "ball", mass=1.0, inertia=np.eye(3))
    assert list(model.bodies).index("extra") < list(model.bodies).index("body2")  # depth first, after the children there are
    model.remove_body("body3")
    gone = {"hinge3", "hinge8"}
    assert set(model.hinges) == set(kept) - gone | {"extra"}
    for h in model.hinges:
        q, v = kept.get(h, (np.array([1.0, 0, 0, 0]), np.zeros(3)))
        assert np.array_equal(model.q[model.hinges[h].q_slice], q) and np.array_equal(model.v[model.hinges[h].v_slice], v)
    assert "node3" not in model.nodes and "node4" in model.nodes
    letters_of(model).MM.assert_close(mass_matrix(model).dense())
    letters_of(model).Jacobian(["node4"]).assert_close(model.soa.Jacobian("node4").dense())


def test_new_nodes_invalidate_nothing():
    model = every_kind()
    letters = letters_of(model)
    MM, B, J, own = letters.MM, letters.B(["node10", "node2"]), letters.Jacobian(["node5"]), letters.B(["body7"])
    before = B.op.dense()
    model.add_node("tip", "node10", position=(0, 0, 1))
    model.add_body("sticker", "body7", "weld", position=(0, 1, 0)) if not model.keeps_welds else model.add_node("sticker", "body7")
    for formula in (MM, B, J, own):
        formula.assert_close(formula.op.dense())
    assert np.array_equal(before, B.op.dense()) and model.soa is letters.soa and B.op == model.soa.B(["node10", "node2"])
    letters_of(model).Jacobian(["tip"]).assert_close(model.soa.Jacobian("tip").dense())
    tip = model.nodes["tip"]
    assert tip.body.name == "body10" and np.allclose(
        tip.pose, model.nodes["node10"].pose @ [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]]
    )


def test_a_massive_welded_body_changes_values_and_no_structure():
    model = pc.tree([-1, 0, 1], "pin", seed=4)
    MM = mass_matrix(model)
    before = MM.dense()
    model.add_body("load", "body2", "weld", mass=2.0, com=(0.1, 0, 0), position=(0, 0.5, 0))
    assert "load" in model.nodes and model.nodes["load"].body.name == "body2"
    letters_of(model).MM.assert_close(MM.dense())
    assert np.abs(MM.dense() - before).max() > 0.1


def test_a_refused_edit_leaves_the_model_as_it_was():
    model = every_kind()
    MM, before = mass_matrix(model), model.description()
    for edit in (
        lambda: model.add_body("body1", "body2"),
        lambda: model.add_body("x", "nobody"),
        lambda: model.add_body("x", "body1", "hinge"),
        lambda: model.add_body("x", "body1", axis=(0, 0, 0)),
        lambda: model.add_body("x", "body1", mass=-1.0),
        lambda: model.remove_body("nobody"),
        lambda: model.add_body("x", "body1", mass=1, inertia=-np.eye(3)),
        lambda: model.add_body("x", "body1", rotation=2 * np.eye(3)),
        lambda: model.add_body("x", "body1", hinge_name="hinge3"),
        lambda: model.add_node("node3", "body1"),
        lambda: model.add_body("x", "body1", "pin", rotor_inertia=[1, 2]),
        lambda: setattr(model.bodies["body1"], "mass", np.nan),
    ):
        with pytest.raises(pc.ModelError):
            edit()
    after = model.description()
    assert repr(before) == repr(after)
    MM.check_current()


def test_operators_outlive_the_name_of_their_model():
    """`pc.chain(3).soa` keeps what it needs: nobody else holds the model."""
    soa = pc.chain(3).soa
    H = soa.H
    gc.collect()
    assert H.dense().shape == (3, 18) and pc.check("HψMψ*H* == D", soa)
    assert pickle.loads(pickle.dumps(H)).shape == (3, 18)
    assert pc.check("HψMψ*H* == D", pc.chain(2).soa)


# ---------------------------------------------------------------------- copies and pickles (ruling 17)


COPIES = {"copy": copy.copy, "deepcopy": copy.deepcopy, "pickle": lambda x: pickle.loads(pickle.dumps(x))}
each_copy = pytest.mark.parametrize("how", COPIES)


@each_copy
def test_models_copy(how):
    model = every_kind(rotor_inertia=True)
    model.add_body("arm", "body10", "pin", limits=([-1], [2]), mass=1.0, com=(1, 0, 0))
    twin = COPIES[how](model)
    assert type(twin) is pc.Multibody and repr(twin.description()) == repr(model.description()) and twin.hinges["arm"].limits[1] == [2]
    Q, V = uniform_batch(model, 2)
    assert np.array_equal(twin.forward_dynamics(Q, V, V), model.forward_dynamics(Q, V, V))
    assert np.array_equal(mass_matrix(twin).dense(), mass_matrix(model).dense())
    assert np.array_equal(twin.q, model.q) and np.array_equal(twin.v, model.v) and np.array_equal(twin.gravity, model.gravity)
    twin.bodies["body3"].mass = 99.0
    twin.remove_body("arm")
    assert model.bodies["body3"].mass != 99.0 and "arm" in model.bodies and model.soa.is_current()
    with pytest.raises(pc.SpaceError, match="two different models"):
        model.soa.phi @ COPIES[how](model).soa.phi


@each_copy
def test_states_copy(how):
    state = every_kind().random_state(1)
    twin = COPIES[how](state)
    assert np.array_equal(twin.q, state.q) and np.array_equal(twin.v, state.v)


@each_copy
def test_expressions_copy(how):
    model = every_kind(rotor_inertia=True)
    soa = model.soa
    letters = letters_of(model)
    Q, V = uniform_batch(model, 2)
    rng = np.random.default_rng(0)
    C = pc.constant(rng.normal(size=(len(soa.Theta),) * 2), soa.Theta, soa.Theta)
    U = pc.constant(rng.normal(size=(len(soa.Theta), 2)), 2, soa.Theta)
    MM = mass_matrix(model)
    whole = [
        MM,
        MM.inv(),
        -2 * MM + C,
        soa.Jacobian(["node10", "body3"]),
        soa.Delta("hinge3"),
        soa.V_tilde,
        MM.at(Q, V),
        soa.V_bar.at(Q[0], V[0]),
        (MM + U @ U.T).inv(),
        soa.M.sqrt(),
        pc.blockdiag(soa.phi @ soa.M @ soa.phi.T),
        pc.zero(soa.V, soa.F),
        soa.I + soa.phi,
        soa.theta_dot,
        *(draw(seeded(np.random.default_rng(i)), letters, "T", "T", 3).op for i in range(3)),
    ]
    for op in whole:
        twin = COPIES[how](op)
        assert np.array_equal(twin.dense(), op.dense()), op
        assert twin.text() == op.text() and twin.latex() == op.latex()
    vector = MM @ pc.vector("T", soa.Theta)
    x = rng.normal(size=model.nv)
    assert np.array_equal(COPIES[how](vector).value(T=x), vector.value(T=x))
    quad = MM.at(model.q, precision="quad")
    assert (COPIES[how](quad).dense(dtype=object) == quad.dense(dtype=object)).all()


@each_copy
def test_scalars_and_operator_sets_copy(how):
    model = every_kind()
    MM = mass_matrix(model)
    for scalar in (MM.trace(), 2 * MM.logdet() - MM.norm() / 3 + 1, MM.trace().at(model.random_state(2).q)):
        twin = COPIES[how](scalar)
        assert float(twin) == float(scalar) and twin.text() == scalar.text()
    twin = COPIES[how](model.soa)
    assert np.array_equal(twin.phi.dense(), model.soa.phi.dense())
    tree = pc.sko_model([-1, 0], [None, np.ones((2, 3))], [np.eye(1, 2), np.eye(2, 3)], [np.eye(2), 2 * np.eye(3)])
    assert np.array_equal(COPIES[how](tree.D).dense(), tree.D.dense()) and COPIES[how](tree.H.T @ tree.D.inv()).text() == "H* D⁻¹"


def test_what_is_pickled_together_stays_together():
    model = every_kind()
    soa = model.soa
    H, phi, again = pickle.loads(pickle.dumps((soa.H, soa.phi, model)))
    assert (H @ phi).dense().shape == (model.nv, 6 * len(model.bodies))
    again.q = model.random_state(8).q
    assert np.array_equal((H @ phi).dense(), (soa.H @ soa.phi).at(again.q).dense())


# ---------------------------------------------------------------------- threads (ruling 17)


def test_one_models_expressions_in_several_threads():
    """The same bits from eight threads at once as from one: expressions, bound states, batches, scalars, direct calls."""
    model = every_kind(rotor_inertia=True)
    letters = letters_of(model)
    MM, D = mass_matrix(model), model.soa.D
    Q, V = uniform_batch(model, 4)
    x = np.random.default_rng(0).normal(size=model.nv)
    ops = [draw(seeded(np.random.default_rng(i)), letters, "T", "T", 3).op for i in range(4)]
    tasks = [
        lambda: MM @ x,
        lambda: MM.inv() @ x,
        lambda: MM.dense(),
        lambda: MM.at(Q).dense(),
        lambda: MM.at(Q[1]).inv() @ x,
        lambda: float(MM.logdet()),
        lambda: (MM + 0.1 * D).inv() @ x,
        lambda: D.diagonal(),
        lambda: MM.at(Q[2], precision="quad") @ x,
        lambda: model.forward_dynamics(Q, V, V),
        lambda: model.mass_matrix(Q[3]),
        lambda: model.soa.Upsilon.dense(),
        lambda: np.asarray((MM.trace() + MM.logdet()).at(Q)),
        lambda: model.jacobian("node10", Q),
        *(lambda op=op: op.dense() for op in ops),
    ]
    expected = [task() for task in tasks]
    fresh = copy.deepcopy(model)  # nothing computed yet: the threads race for the first values as well
    del letters
    order = [(i + shift) % len(tasks) for shift in range(24) for i in range(len(tasks))]
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda i: (i, tasks[i]()), order))
        matrices = list(pool.map(lambda _: mass_matrix(fresh).dense(), range(32)))
    assert all(np.array_equal(value, expected[i]) for i, value in found)
    assert all(np.array_equal(value, MM.dense()) for value in matrices)


def test_evaluation_in_threads_while_the_state_moves():
    """Setting q while others read gives each reader one state or another, never a mixture."""
    model = pc.tree([-1, 0, 1, 1, 3], ["pin", "ball", "pin", "universal", "slider"], seed=3)
    Q, _ = uniform_batch(model, 2, 5)
    MM = mass_matrix(model)
    allowed = {MM.at(q).dense().tobytes() for q in Q}
    model.q = Q[0]
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        readers = [pool.submit(lambda: [MM.dense().tobytes() for _ in range(200)]) for _ in range(3)]
        for i in range(400):
            model.q = Q[i % 2]
        assert all(set(r.result()) <= allowed for r in readers)
