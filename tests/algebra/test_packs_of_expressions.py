"""Batches of expressions in packs: the bits of the states one by one, whatever is asked; where pivots are chosen once, their rounding."""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.mechanisms import build, every_kind, massless_inner_bodies, random_tree, rotors_on_some, uniform_batch, with_hinges
from support.packs import in_packs, one_by_one, packed

STATES = 11


def pins_askew():
    return pc.tree([-1, 0, 1, 1, 3], ["pin"] * 5, seed=6)


MODELS = {
    "every kind": every_kind,
    "rotors": lambda: every_kind(rotor_inertia=True, seed=3),
    "rotors on some": lambda: build(rotors_on_some()),
    "massless inner bodies": lambda: build(massless_inner_bodies()),
    "planar chain": lambda: pc.chain(7),
    "chain askew": lambda: pc.chain(9, seed=2),
    "tree of pins": pins_askew,
    "forest": lambda: with_hinges("ball-slider", "forest"),
    "arm": pc.robots.panda,
    "legs": pc.robots.a1,
    "welds alone": lambda: with_hinges("weld", "chain"),
}


@pytest.fixture(scope="module", params=MODELS)
def case(request):
    model = MODELS[request.param]()
    return model, *uniform_batch(model, STATES, 70)


def expressions(model):
    """Kernels, sweeps, compliance, derivatives, other frames, nodes: what is decided state by state."""
    soa = model.soa
    H, phi, psi, M, P, D, K, R, Upsilon, Omega = soa("H phi psi M P D K R Upsilon Omega")
    MM = H @ phi @ M @ phi.T @ H.T
    last = list(model.bodies)[-1]
    found = {
        "MM": MM,
        "MM + J": MM + soa.J,
        "phi": phi,
        "psi*": psi.T,
        "K": K,
        "R": R,
        "P": P,
        "D": D,
        "compliance": Upsilon @ M,
        "Omega": Omega,
        "node": soa.Jacobian(last),
        "block diagonal": pc.blockdiag(phi @ M @ phi.T) @ phi.T,
    }
    if model.nv:
        i = model.nv // 2
        found |= {
            "inverse": (MM + soa.J).inv(),
            "derivative": MM.diff(i),
            "of the inverse": (MM + soa.J).inv().diff(i),
            "rate": MM.dot(),
            "sweep's": P.diff(i),
        }
    return found


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_the_bits_of_each_state(case, form):
    model, Q, V = case
    rng = np.random.default_rng(1)
    done = 0
    for name, e in expressions(model).items():
        x, X, Y = (rng.normal(size=shape) for shape in (e.shape[1], (STATES, e.shape[1]), (STATES, e.shape[1], 3)))
        bound = e.at(Q, V, form=form)
        for ask in (lambda: bound @ x, lambda: bound @ X, lambda: bound @ Y, bound.dense):  # noqa: B023 - called at once
            together = in_packs(ask)
            done += bool(packed(bound) or packed(bound, "dense"))
            np.testing.assert_array_equal(together, one_by_one(ask), name)
    assert done >= 3 * len(expressions(model)) or not model.nv


def requests(model):
    """Requests besides products, as functions of the bound expression."""
    soa = model.soa
    MM, D = soa.MM + soa.J, soa.D
    tau = pc.vector("tau", soa.Theta)
    return {
        "diagonal": lambda at: at(MM.inv()).diagonal(),
        "trace": lambda at: at(MM).trace().value(),
        "trace of the inverse": lambda at: at(MM.inv()).trace().value(),
        "ln det of D": lambda at: at(D).logdet().value(),
        "ln det": lambda at: at(MM).logdet().value(),
        "norm": lambda at: at(soa.psi).norm().value(),
        "norm of columns": lambda at: at(MM.inv() @ soa.H @ soa.psi).norm().value(),
        "as it was typed": lambda at: at(MM).dense(rules=False),
        "transposed": lambda at: at(MM.inv() @ soa.H @ soa.psi).T @ np.ones(model.nv),
        "named vectors": lambda at: at(MM.inv() @ tau).value(tau=np.arange(1.0, model.nv + 1)),
        "scalars": lambda at: (2 * at(MM).trace() - at(MM).logdet() * at(D).trace()).value(),
        "velocities": lambda at: at(soa.H @ soa.phi @ (soa.M @ soa.a + soa.b)).value(),
        "second derivative": lambda at: at(MM).diff(0).diff(model.nv - 1).dense(),
    }


@pytest.mark.parametrize("request_", requests(pc.chain(2)))
def test_requests(case, request_):
    model, Q, V = case
    if not model.nv:
        pytest.skip("nothing moves")
    ask = requests(model)[request_]
    np.testing.assert_array_equal(in_packs(lambda: ask(lambda e: e.at(Q, V))), one_by_one(lambda: ask(lambda e: e.at(Q, V))))


def test_gradients_of_ln_det(case):
    """By a recursion of their own, in packs from 64 states on."""
    model, *_ = case
    if not model.nv:
        pytest.skip("nothing moves")
    Q, _ = uniform_batch(model, 67, 5)
    for over in ("coordinates", "inertias", "geometry", "axes"):
        singly = [model.log_determinant_gradient(q, over) for q in Q]
        np.testing.assert_array_equal(model.log_determinant_gradient(Q, over), singly)
        np.testing.assert_array_equal((model.soa.MM + model.soa.J).logdet().at(Q).gradient(over), singly)


# ---------------------------------------------------------------------- what is decided once
def decided_once(model):
    """Eliminations, and inverses of blocks of several coordinates: an ordinary state decides the order."""
    soa = model.soa
    MM, I, D, rng = soa.MM + soa.J, soa.I, soa.D, np.random.default_rng(3)
    A, U = rng.normal(size=(model.nv, model.nv)), rng.normal(size=(model.nv, 2))
    low_rank = pc.constant(U @ U.T, soa.Theta, soa.Theta)
    return {
        "shifted": (MM + 0.1 * I).inv(),
        "nested": (MM.inv() + 0.01 * (D + MM).inv()).inv(),
        "blocks": (D + 0.1 * I).inv() @ MM,
        "blocks of the inverse": pc.blockdiag((MM + 0.5 * I).inv()),
        "low rank": (MM + low_rank).inv(),
        "dense": (MM + pc.constant(A @ A.T, soa.Theta, soa.Theta)).inv(),
        "derivative": (MM + 0.1 * I).inv().diff(0),
    }


def test_where_pivots_are_chosen_once(case):
    """Errors of both are bounded by the condition of what is inverted."""
    model, Q, V = case
    if not model.nv:
        pytest.skip("nothing moves")
    done = 0
    for name, e in decided_once(model).items():
        bound, x = e.at(Q, V), np.linspace(-1, 1, model.nv)
        exact = np.asarray(e.at(Q, V, precision="quad") @ x, float)
        allowed = 1e-9 * np.abs(exact).max(axis=1, keepdims=True)
        for ask in (lambda: bound @ x, lambda: bound.dense() @ x):  # noqa: B023 - called at once
            together = in_packs(ask)
            done += bool(packed(bound) or packed(bound, "dense"))
            assert (np.abs(together - exact) <= allowed).all(), name
            assert (np.abs(together - one_by_one(ask)) <= allowed).all(), name
        if name != "derivative":
            for ask in (lambda: bound.logdet().value(), lambda: bound.trace().value()):  # noqa: B023 - called at once
                np.testing.assert_allclose(in_packs(ask), one_by_one(ask), rtol=1e-9, atol=1e-9)
    gradient = (model.soa.MM + model.soa.J).at(Q, V).trace().gradient  # by a realization each
    np.testing.assert_allclose(in_packs(gradient), one_by_one(gradient), rtol=0, atol=1e-12 * np.abs(one_by_one(gradient)).max())
    assert done >= len(decided_once(model))


def test_what_is_decided_once_hangs_on_no_history():
    """The same bits, whatever was evaluated before, in however many states, on whichever x."""
    states = [uniform_batch(pins_askew(), 70, seed) for seed in (0, 500)]
    found = []
    for order in ([0], [1, 0], [1, 1, 0]):
        model = pins_askew()
        e = (model.soa.MM + 0.3 * model.soa.I).inv()
        for i in order:
            y = e.at(*states[i]) @ (np.ones(5) * 2.0 ** len(order))
        found.append(y / 2.0 ** len(order))
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])
    model = pins_askew()
    e = (model.soa.MM + 0.3 * model.soa.I).inv()
    first = e.at(*states[0]) @ np.ones(5)
    e.at(*states[1]) @ np.ones(5)
    np.testing.assert_array_equal(e.at(*states[0]) @ np.ones(5), first)


# ---------------------------------------------------------------------- lengths, places, threads
@pytest.mark.parametrize("count", [0, 1, 2, 7, 8, 9, 15, 16, 17, 31, 32, 33, 63, 64, 65, 130])
def test_lengths(count):
    """Lanes beyond the last state repeat it; a state has its bits wherever it stands."""
    model = every_kind(rotor_inertia=True)
    Q, V = uniform_batch(model, 130, 3)
    rng = np.random.default_rng(0)
    X, order = rng.normal(size=(130, model.nv)), rng.permutation(130)[:count]
    e = (model.soa.MM + model.soa.J).inv()
    whole = in_packs(lambda: e.at(Q, V) @ X)
    for threads in (1, 3):
        some = in_packs(lambda: e.at(Q[order], V[order], threads=threads) @ X[order])  # noqa: B023 - called at once
        np.testing.assert_array_equal(some, whole[order])
    assert some.shape == (count, model.nv)


def test_one_program_for_all_batches():
    """Recorded once for an expression, whatever it is bound to afterwards; x of all states or of each."""
    model = pc.robots.panda()
    (Q, V), (Q2, V2) = uniform_batch(model, 9, 0), uniform_batch(model, 40, 50)
    e, rng = model.soa.MM.inv(), np.random.default_rng(4)
    x, X = rng.normal(size=7), rng.normal(size=(40, 7))
    for q, v, given in ((Q, V, x), (Q2, V2, x), (Q2, V2, X), (Q2[:3], V2[:3], X[:3]), (Q2, V2, X[:, :, None] * np.ones(2)), (Q, None, x)):
        np.testing.assert_array_equal(in_packs(lambda: e.at(q, v) @ given), one_by_one(lambda: e.at(q, v) @ given))  # noqa: B023 - called at once


# ---------------------------------------------------------------------- numbers of the model that change
EDITS = {
    "mass": lambda m: setattr(m.bodies[list(m.bodies)[2]], "mass", 7.5),
    "com": lambda m: setattr(m.bodies[list(m.bodies)[2]], "com", (0.1, 0.2, -0.3)),
    "gravity": lambda m: setattr(m, "gravity", (1.0, 2.0, -3.0)),
    "state": lambda m: setattr(m, "q", m.random_state(77).q),
}


@pytest.mark.parametrize("edit", EDITS)
def test_edits_show(edit):
    model = pc.tree([-1, 0, 1, 2], ["pin", "screw", "ball", "pin"], seed=8)
    model.gravity = (0, 0, -9.81)
    Q, V = uniform_batch(model, 9)
    soa = model.soa
    falling = soa.H @ soa.phi @ soa.M @ soa.gravity_field
    before = {}
    for turn in range(2):
        for name, bound in {"inverse": soa.MM.inv().at(Q, V), "falling": falling.at(Q, V), "beside": soa.MM.at(Q, V) @ soa.MM}.items():
            found = in_packs(bound.dense)
            np.testing.assert_array_equal(found, one_by_one(bound.dense))
            if turn:
                changed = {"mass": True, "com": True, "gravity": name == "falling", "state": name == "beside"}[edit]
                assert np.array_equal(found, before[name]) != changed
            before[name] = found
        EDITS[edit](model)


def test_rotors_that_come_and_go():
    model = pc.chain(4, seed=1)
    Q, V = uniform_batch(model, 9)
    e = model.soa.MM + model.soa.J
    for rotor in (0.0, 0.7, 0.0, 0.2):
        model.hinges[list(model.hinges)[1]].rotor_inertia = rotor
        for of in (e, e.inv()):
            np.testing.assert_array_equal(in_packs(lambda: of.at(Q, V).dense()), one_by_one(lambda: of.at(Q, V).dense()))  # noqa: B023 - called at once


def test_beside_other_states_and_models():
    """Parts bound to one state, or to the model's present one, and a second model's batch."""
    a, b = pc.chain(3, seed=1), pc.chain(3, seed=2)
    (Qa, Va), (Qb, Vb) = uniform_batch(a, 9), uniform_batch(b, 9, 30)
    a.q = a.random_state(99).q
    across = pc.constant(np.eye(3), a.soa.Theta, b.soa.Theta)
    here = a.soa.MM.at(a.random_state(5).q)
    for e in (
        here.inv() @ a.soa.MM.at(Qa, Va),
        a.soa.MM @ a.soa.MM.at(Qa, Va).inv(),
        b.soa.MM.at(Qb, Vb) @ across @ a.soa.MM.inv().at(Qa, Va),
    ):
        for turn in range(3):
            together = in_packs(lambda: e @ np.ones(3))  # noqa: B023 - called at once
            assert packed(e)
            np.testing.assert_array_equal(together, one_by_one(lambda: e @ np.ones(3)))  # noqa: B023 - called at once
            a.q = a.random_state(90 + turn).q  # another one each time


def test_copies_and_pickles():
    model = pc.robots.panda()
    Q, V = uniform_batch(model, 20)
    bound = model.soa.MM.inv().at(Q, V)
    wanted = in_packs(lambda: bound @ np.ones(7))
    for again in (copy.copy(bound), copy.deepcopy(bound), pickle.loads(pickle.dumps(bound))):
        np.testing.assert_array_equal(in_packs(lambda: again @ np.ones(7)), wanted)  # noqa: B023 - called at once


# ---------------------------------------------------------------------- other trees, other ways to compute
def test_bare_trees_and_groups():
    """Trees of matrices have one state, and a batch of x; bodies in groups have dense blocks beside rigid ones."""
    model = pc.tree([-1, 0, 0, 1, 1], ["free", "pin", "ball", "universal", "slider"], seed=2, rotor_inertia=True)
    Q, V = uniform_batch(model, 9)
    theorem = next(t for t in model.soa.theorems() if t.name == "bodies grouped in pairs: the same mass matrix")
    for form in ("fast", "ud", "square-root"):
        for e in (theorem.lhs, theorem.lhs.sources[0].symbol("psi"), theorem.lhs.sources[0].symbol("D")):
            ask = lambda: e.at(Q, V, form=form) @ np.ones(e.shape[1])  # noqa: B023, E731 - called at once
            np.testing.assert_array_equal(in_packs(ask), one_by_one(ask))
    groups = model.soa.grouped([list(model.bodies)[:2]])
    for e in (groups.psi, groups.P, groups.D):
        np.testing.assert_array_equal(in_packs(lambda: e.at(Q, V).dense()), one_by_one(lambda: e.at(Q, V).dense()))  # noqa: B023 - called at once
    rng = np.random.default_rng(0)
    bare = pc.sko_model(
        [-1, 0, 0],
        [None, rng.normal(size=(3, 2)), rng.normal(size=(3, 4))],
        [rng.normal(size=(1, n)) for n in (3, 2, 4)],
        [np.eye(n) for n in (3, 2, 4)],
    )
    at = bare.MM.inv().at(np.zeros((9, 0)))
    X = rng.normal(size=(9, 3))
    np.testing.assert_array_equal(in_packs(lambda: at @ X), one_by_one(lambda: at @ X))


def test_what_is_not_recorded():
    """Other precisions, refinement, operators from outside, rows that are sorted: state after state, with the same numbers."""
    model = pins_askew()
    Q, V = uniform_batch(model, 9)
    soa, x = model.soa, np.ones(5)
    L = _core.external(lambda y: 2 * y, lambda y: 2 * y, soa.Theta, soa.Theta, "L")
    for bound in (
        soa.MM.inv().at(Q, V, precision="extended"),
        soa.MM.inv().at(Q, V, precision="single"),
        soa.MM.inv().at(Q, V, refine=1),
        (L @ soa.MM).at(Q, V),
    ):
        np.testing.assert_array_equal(in_packs(lambda: bound @ x), one_by_one(lambda: bound @ x))  # noqa: B023 - called at once
        in_packs(lambda: bound @ x)  # noqa: B023 - called at once
        assert not packed(bound)


def test_both_sides_of_every_theorem():
    """World frame, locked hinges, groups, nodes, two velocities: letters of all kinds."""
    model = pc.tree([-1, 0, 0, 2], ["screw", "universal", "ball", "pin"], seed=4, rotor_inertia=True)
    model.gravity = (0.5, -1, -9)
    Q, V = uniform_batch(model, 5, 3)
    done = 0
    for theorem in model.soa.theorems():
        for side in (theorem.lhs, theorem.rhs):
            if not isinstance(side, _core.Operator) or side.domain is None:
                continue
            bound = side.at(Q, V)
            try:
                singly = one_by_one(bound.dense)
            except pc.Error as refused:  # vectors that are to be given, inverses that are not there
                with pytest.raises(type(refused)) as error:
                    in_packs(bound.dense)
                assert str(error.value) == str(refused)
                continue
            together = in_packs(bound.dense)
            done += bool(packed(bound, "dense"))
            np.testing.assert_allclose(together, singly, rtol=0, atol=1e-9 if eliminates(bound) else 0, err_msg=theorem.name)
    assert done > 100


def eliminates(bound):
    return any(step["kind"] in ("factor", "dense_factor", "invert_blocks") for step in bound.plan("dense").program["steps"])


def test_random_trees():
    for seed in range(30):
        rng = np.random.default_rng(seed)
        model = random_tree(rng, int(rng.integers(1, 7)))
        Q, V = uniform_batch(model, 5, seed)
        for name, e in expressions(model).items():
            for form in ("fast", "ud", "square-root"):
                bound = e.at(Q, V, form=form)
                np.testing.assert_array_equal(in_packs(bound.dense), one_by_one(bound.dense), f"seed {seed}, {name}, {form}")
