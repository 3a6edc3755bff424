"""Operational-space inertia and compliance of nodes: by kernels, and where those are not sure by the operators.

Oracles: 𝒥(ℳ + J)⁻¹𝒥* of the mass matrix in extended precision, `pycraft.reference`, Λ of the operators. Tolerance: 40 n eps of the
largest entry, times the condition of what is solved.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft import reference
from support.kernel_cases import LONG, MODELS, states
from support.plain_calls import by_the_method

EPS = np.finfo(float).eps
MOVABLE = {name: m for name, m in {**MODELS, **LONG}.items() if m.nv}


def moving(model):
    """Bodies that are not fixed to the base."""
    q = model.random_state(0).q
    return [name for name in model.bodies if model.jacobian(name, q).any()]


def of_mass_matrix(model, names, q):
    """𝒥(ℳ + J)⁻¹𝒥* in extended precision, and how far off a double's may be."""
    J = np.concatenate([model.jacobian(name, q, precision="extended") for name in names])
    exact = J @ model.mass_matrix_inverse(q, precision="extended") @ J.T
    return exact, 40 * model.nv * EPS * np.linalg.cond(model.mass_matrix(q)) * np.abs(exact).max()


@pytest.mark.parametrize("name", MOVABLE)
def test_every_kind_of_hinge(name):
    model = MOVABLE[name]
    Q, names, rng = states(model, 5)[0], moving(model), np.random.default_rng(1)
    for of in ([names[-1]], [names[len(names) // 2]], [names[0], names[-1], names[0]], list(rng.permutation(names)[:4])):
        found = model.operational_space_compliance(of, Q)
        assert found.shape == (5, 6 * len(of), 6 * len(of))
        np.testing.assert_array_equal(found, found.transpose(0, 2, 1))
        for q, one in zip(Q, found, strict=True):
            exact, bound = of_mass_matrix(model, of, q)
            assert np.abs(one - exact).max() <= bound
            np.testing.assert_array_equal(model.operational_space_compliance(of, q), one)
        for count in (0, 1, 3):
            np.testing.assert_array_equal(model.operational_space_compliance(of, Q[:count]), found[:count])


REGULAR = [
    ("panda", MODELS["panda"], 1),
    ("g1", MODELS["g1"], 1),
    ("tree of free", MODELS["tree of free"], 1),
    ("chain of 30", MODELS["chain of 30"], 3),
    ("every kind", LONG["every kind"], 3),
]


@pytest.mark.parametrize("name, model, count", REGULAR, ids=[name for name, *_ in REGULAR])
def test_inertia(name, model, count):
    """Λ is the inverse, and equals the operators'."""
    names = moving(model)
    of = [names[-1], names[len(names) // 2], names[0 if name == "every kind" else len(names) // 4]][:count]
    Q = states(model, 5)[0]
    found = model.operational_space_inertia(of, Q)
    compliance = model.operational_space_compliance(of, Q)
    for b in range(5):
        condition = np.linalg.cond(compliance[b])
        known = model.soa.Lambda(of).at(Q[b], precision="quad").dense()
        assert np.abs(found[b] - known).max() <= 40 * model.nv * EPS * condition * np.abs(known).max()
        np.testing.assert_array_equal(model.operational_space_inertia(of, Q[b]), found[b])
        np.testing.assert_array_equal(found[b], found[b].T)
        assert np.abs(found[b] @ compliance[b] - np.eye(6 * count)).max() <= 40 * model.nv * EPS * condition
    one = model.operational_space_inertia(of[0], Q)
    if count == 1:
        np.testing.assert_array_equal(one, found)
    wider = model.operational_space_inertia(of, Q[0], precision="extended")
    assert np.abs(wider - found[0]).max() <= 40 * model.nv * EPS * np.linalg.cond(compliance[0]) * np.abs(wider).max()


def test_a_node_off_its_body_and_a_rotated_one():
    turned = np.array([[0, -1, 0], [0.6, 0, -0.8], [0.8, 0, 0.6]])
    for name in ("tree of ball", "tree of screw", "panda", "g1"):
        model = MODELS[name]
        if "tool" not in model.nodes:
            model.add_node("tool", moving(model)[-1], position=(0.3, -0.2, 0.5), rotation=turned)
        q = model.random_state(2).q
        description = model.description()
        J = reference.node_jacobian(description, "tool", q)
        known = J @ reference.mass_matrix_inverse(description, q) @ J.T
        bound = 40 * model.nv * EPS * np.linalg.cond(model.mass_matrix(q)) * np.abs(known).max()
        for _ in range(2):  # the second goes to the core
            assert np.abs(model.operational_space_compliance("tool", q) - known).max() <= bound
        exact, bound = of_mass_matrix(model, ["tool", moving(model)[0]], q)
        assert np.abs(model.operational_space_compliance(["tool", moving(model)[0]], q) - exact).max() <= bound


def test_a_long_chain():
    model = pc.chain(300, seed=4)
    names, Q = list(model.bodies), states(model, 2)[0]
    for of in (["body299"], ["body10", "body299", "body150"]):
        for q, found in zip(Q, model.operational_space_compliance(of, Q), strict=True):
            exact, bound = of_mass_matrix(model, of, q)
            assert np.abs(found - exact).max() <= bound
    assert model.operational_space_inertia(names[-1], Q).shape == (2, 6, 6)


def test_singular_and_hardly_regular():
    """Fewer than six hinges, the same node twice: the error of Λ. A stretched arm is left to the operators, and keeps their digits."""
    arm = pc.chain(3)
    q = arm.random_state(1).q
    for _ in range(2):
        with pytest.raises(pc.SingularOperatorError, match=r"Λ\(body2\) is singular.*directions="):
            arm.operational_space_inertia("body2", q)
        assert np.linalg.matrix_rank(arm.operational_space_compliance("body2", q), tol=1e-10) == 3
    ur5 = pc.robots.ur5()
    tip, q = list(ur5.bodies)[-1], ur5.random_state(1).q
    with pytest.raises(pc.SingularOperatorError, match="Λ"):
        ur5.operational_space_inertia([tip, tip], q)
    Q = np.array([ur5.random_state(seed).q for seed in range(6)])
    Q[4, 4] = 1e-4  # wrist nearly stretched
    found = ur5.operational_space_inertia(tip, Q)
    known = ur5.soa.Lambda([tip]).at(Q[4], precision="quad").dense()
    condition = np.linalg.cond(ur5.operational_space_compliance(tip, Q[4]))
    assert condition > 1e8 and np.abs(found[4] - known).max() <= 40 * 6 * EPS * np.sqrt(condition) * 1e3 * np.abs(known).max()
    Q[4, 4] = 0
    with pytest.raises(pc.SingularOperatorError, match="Λ"):
        ur5.operational_space_inertia(tip, Q)
    ghost = pc.Multibody("ghost")
    ghost.add_body("link", hinge="free", mass=1.0, com=(1, 0, 0), inertia=np.eye(3))
    ghost.add_body("tip", "link", axis=(1, 0, 0), position=(1, 0, 0))
    ghost.take_warnings()
    for call in ("operational_space_inertia", "operational_space_compliance"):
        for _ in range(2):
            with pytest.raises(pc.SingularHingeError, match="'tip'"):
                getattr(ghost, call)("link", np.r_[1, np.zeros(7)])


def test_units_of_a_body_do_not_count():
    """A body that flies alone: its own inertia, whatever its size."""
    for mass, length in ((1.0, 1.0), (1e-20, 1e-9), (1e25, 1e7)):
        body = pc.Multibody("flying")
        body.add_body("body", hinge="free", mass=mass, inertia=mass * length**2 * np.diag([1.0, 2, 3]))
        found = body.operational_space_inertia("body", body.random_state(1).q)
        np.testing.assert_allclose(found, mass * np.diag([length**2, 2 * length**2, 3 * length**2, 1, 1, 1]), rtol=1e-14, atol=0)


def test_what_is_asked_wrongly():
    model = MODELS["panda"]
    q = model.random_state(1).q
    fixed = pc.tree([-1, 0], ["weld", "pin"], seed=1, welds="keep")
    for call in ("operational_space_inertia", "operational_space_compliance"):
        for names, error, words in (
            ("nose", pc.ModelError, "nose"),
            (["panda_link7", "nose"], pc.ModelError, "nose"),
            (3, pc.ModelError, "string, not by 3"),
            (["panda_link7", 3], pc.ModelError, "string, not by 3"),
            ([], pc.ModelError, "at least one node"),
        ):
            with pytest.raises(error, match=words):
                getattr(model, call)(names, q)
        with pytest.raises(pc.ModelError, match="takes 7"):
            getattr(model, call)("panda_link7", q[:3])
        with pytest.raises(pc.ModelError, match="out= takes"):
            getattr(model, call)("panda_link7", q, out=np.empty((6, 7)))
        with pytest.raises(pc.EvaluationError, match="precision"):
            getattr(model, call)("panda_link7", q, precision="half")
    with pytest.raises(pc.SingularOperatorError, match="'panda_link7' is named twice, whose rows are the same"):
        model.operational_space_inertia(["panda_link7", "panda_link7"], q)
    model.add_node("stand", None)
    with pytest.raises(pc.ModelError, match="stand"):
        model.operational_space_compliance("stand", q)
    assert not fixed.operational_space_compliance("body0", [0.1]).any()


def test_places_of_results_and_other_numbers():
    model = MODELS["g1"]
    Q = states(model, 3)[0]
    tip = moving(model)[-1]
    known = by_the_method(model, "operational_space_compliance", tip, Q)
    out = np.full((3, 6, 6), np.nan)
    assert model.operational_space_compliance(tip, Q, out=out) is out
    np.testing.assert_array_equal(out, known)
    np.testing.assert_array_equal(model.operational_space_compliance((tip,), Q.tolist()), known)
    np.testing.assert_array_equal(model.operational_space_compliance(iter([tip]), Q), known)
    model.q = Q[1]
    np.testing.assert_array_equal(model.operational_space_compliance(tip), known[1])
    single = model.operational_space_compliance(tip, Q[0], precision="single")
    assert 0 < np.abs(single - known[0]).max() <= 1e-2 * np.abs(known[0]).max()


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_forms(form):
    """Of the sweep that Ω takes; one that is not there is named."""
    model = MODELS["g1"]
    q, tip = model.random_state(2).q, moving(model)[-1]
    exact, bound = of_mass_matrix(model, [tip], q)
    assert np.abs(model.operational_space_compliance(tip, q, form=form) - exact).max() <= bound
    known = np.linalg.inv(exact)
    assert np.abs(model.operational_space_inertia(tip, q, form=form) - known).max() <= bound * np.linalg.cond(exact) * np.abs(known).max()
    with pytest.raises(pc.EvaluationError, match="form"):
        model.operational_space_inertia(tip, q, form="slow")


def near_gimbal_lock(size, at):
    """A gimbal whose middle axis is 1e-5 from lock in some states of a batch: there kernels are not sure, and elsewhere they are."""
    model = pc.tree([-1, 0], ["gimbal", "pin"], seed=2)
    Q = np.array([model.random_state(i).q for i in range(size)])
    Q[at, 1] = np.pi / 2 - 1e-5
    return model, Q


@pytest.mark.parametrize("size", [2, 37, 70])
def test_a_state_has_the_bits_that_it_has_alone_beside_states_where_kernels_are_not_sure(size):
    model, Q = near_gimbal_lock(size, [1, size - 1])
    kernel = model._calls().operational_space
    assert kernel(False, ["body1"], Q[0]) is not None and kernel(False, ["body1"], Q[1]) is None
    alone = np.stack([model.operational_space_compliance("body1", q) for q in Q])
    for threads in (1, 3):
        np.testing.assert_array_equal(model.operational_space_compliance("body1", Q, threads=threads), alone)


def test_the_state_without_an_inertia_is_named_beside_states_where_kernels_are_sure():
    model = pc.tree([-1, 0], ["free", "gimbal"], seed=2)
    Q = np.array([model.random_state(i).q for i in range(5)])
    Q[3, 8] = np.pi / 2  # locked: seven numbers of the free hinge come first
    with pytest.raises(pc.Error, match=r"state 3 of a batch of 5"):
        model.operational_space_inertia("body1", Q)
