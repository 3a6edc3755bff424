"""ℳ⁻¹ on columns by links (cpp/kernels/link_columns.h): which plans take it, and what it gives beside NumPy and wider numbers.

Its bits from one number of columns, batch and instruction set to another: test_many_columns.py; where it declines:
cpp/tests/test_link_inverse.cpp.
"""

import numpy as np
import pytest

import pycraft as pc
from support.kernel_cases import LONG, MODELS, states
from support.mechanisms import random_tree
from support.packs import in_packs, one_by_one, packed
from support.singular_hinges import REGULAR, SINGULAR, at_random_state

EPS = np.finfo(float).eps
LINKS, BODIES = "ℳ⁻¹ over links", "P, D, G (Riccati sweep"


def inverse_of(model):
    return (model.soa.MM + model.soa.J).inv()


def steps_of(e, request="apply"):
    return [step["text"] for step in e.plan(request).steps]


def sweeps_of(e, request="apply"):
    """By links, by bodies: how often a plan eliminates hinges so."""
    return tuple(sum(text.startswith(kind) for text in steps_of(e, request)) for kind in (LINKS, BODIES))


@pytest.fixture
def arm():
    return pc.tree([-1, 0, 1, 1], ["free", "pin", "screw", "universal"], seed=3)


def test_what_goes_by_links(arm):
    e, q = inverse_of(arm), arm.random_state(1).q
    Q = np.array([arm.random_state(seed).q for seed in range(3)])
    for bound in (e, e.at(q), e.at(Q), e.at(q, form="fast"), 2 * e, arm.soa.M @ arm.soa.H.T @ e, e.diff(arm.nv - 1)):
        assert sweeps_of(bound) == (1, 0)
    assert sweeps_of(e, "dense") == (1, 0)
    assert sweeps_of(e.at(Q) @ e.at(Q)) == (1, 0)  # eliminated once for both
    assert sweeps_of(e.at(q) @ e.at(Q[2])) == (2, 0)


def test_what_goes_by_bodies(arm):
    """Other forms, precisions and refinement; what needs the letters of the sweep all the same; derived models; wholes of ℳ⁻¹."""
    e, soa, q = inverse_of(arm), arm.soa, arm.random_state(1).q
    for how in ({"form": "ud"}, {"form": "square-root"}, {"refine": 1}, {"precision": "quad"}, {"precision": "single"}):
        assert sweeps_of(e.at(q, **how)) == (0, 1)
    for whole in (e + soa.D, soa.D @ e, e @ soa.H @ soa.psi, e.diff(arm.nv - 1).at(q, form="ud")):
        assert sweeps_of(whole) == (0, 1)
    in_groups = soa.grouped([list(arm.bodies)[:2]])
    assert sweeps_of((in_groups.MM + in_groups.J).inv()) == (0, 1)
    assert LINKS not in str(steps_of(e.at(q), "logdet")) + str(steps_of(e.at(q), "diagonal"))


def test_both_ways_are_there():
    """By itself and beside a letter of the sweep: the same to rounding, and not to the bit, as links round otherwise."""
    arm = pc.chain(20, seed=2)
    soa, x, others = arm.soa, np.random.default_rng(1).normal(size=20), 0
    e = inverse_of(arm)
    for seed in range(5):
        q = arm.random_state(seed).q
        alone = e.at(q) @ x
        together = (e + soa.D).at(q) @ x - soa.D.at(q) @ x
        within = 40 * arm.nv * EPS * np.linalg.cond(arm.mass_matrix(q)) * np.abs(alone).max()
        assert np.abs(alone - together).max() <= within + 4 * EPS * np.abs(soa.D.at(q) @ x).max()
        others += not np.array_equal(alone, together)
    assert others


def assert_solves(model, Q, X):
    """To rounding of n sums of up to 6 products, times the condition of ℳ, as tests/dynamics/test_kernels.py has it."""
    e = inverse_of(model)
    for q in Q:
        MM = model.mass_matrix(q, precision="extended")
        wanted, found = np.linalg.solve(MM, X), e.at(q) @ X
        size = 40 * max(model.nv, 1) * EPS * np.linalg.cond(MM)
        assert np.abs(found - wanted).max(initial=0) <= size * np.abs(wanted).max(initial=0)
        np.testing.assert_array_equal(e.at(q) @ X[:, 0], found[:, 0])


@pytest.mark.parametrize("name", [*MODELS, *LONG])
def test_numpy_solves_the_same(name):
    model = (MODELS | LONG)[name]
    if not model.nv:
        pytest.skip("nothing moves")
    assert_solves(model, states(model, 3)[0], np.random.default_rng(4).uniform(-1, 1, (model.nv, 6)))


@pytest.mark.parametrize("seed", range(24))
def test_random_models(seed):
    rng = np.random.default_rng(seed)
    model = random_tree(rng, int(rng.integers(2, 9)))
    if not model.nv:
        pytest.skip("nothing moves")
    Q = np.array([model.random_state(i).q for i in range(3)])
    assert_solves(model, Q, rng.uniform(-1, 1, (model.nv, 9)))
    bound, x = inverse_of(model).at(np.repeat(Q, 4, axis=0)), rng.uniform(-1, 1, model.nv)
    together = in_packs(lambda: bound @ x)
    assert packed(bound)
    np.testing.assert_array_equal(together, one_by_one(lambda: bound @ x))


def test_recorded_states_decide_for_themselves():
    """A batch in packs, some of whose states the links leave in doubt: a folded arm with a tip that is a million times heavier."""
    model = at_random_state(REGULAR["tip 1e6 times heavier"]())
    Q = np.array([model.random_state(seed).q for seed in range(20)])
    Q[3] = Q[11] = 0
    bound, x = inverse_of(model).at(Q), np.ones(model.nv)
    together = in_packs(lambda: bound @ x)
    np.testing.assert_array_equal(together, one_by_one(lambda: bound @ x))
    for q, y in zip(Q, together, strict=True):
        np.testing.assert_array_equal(inverse_of(model).at(q) @ x, y)


@pytest.mark.parametrize("name", REGULAR)
def test_hostile_but_regular(name):
    """Cases that the general recursions solve are solved by either method, with at most ten times the error against quad precision."""
    model = at_random_state(REGULAR[name]())
    e, x, q = inverse_of(model), np.ones(model.nv), model.q
    exact = np.asarray(e.at(q, precision="quad") @ x, float)
    general = (e + model.soa.D).at(q) @ x - model.soa.D.at(q) @ x
    size = np.abs(exact).max()
    rounding = 40 * model.nv * EPS * np.abs(model.soa.D.at(q) @ x).max()  # of the difference
    assert np.abs(e.at(q) @ x - exact).max() <= 10 * np.abs(general - exact).max() + 100 * model.nv * EPS * size + rounding


@pytest.mark.parametrize("name", SINGULAR)
def test_singular_hinges_are_refused_in_the_same_words(name):
    model = at_random_state(SINGULAR[name][0]())
    e, x = inverse_of(model), np.ones(model.nv)
    said = []
    for whole in (e, e + model.soa.D):
        with pytest.raises(pc.SingularHingeError) as error:
            whole.at(model.q) @ x
        said.append(str(error.value))
    assert said[0] == said[1] and SINGULAR[name][1] in said[0]
