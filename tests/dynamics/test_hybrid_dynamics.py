"""Hybrid dynamics as a direct call and as operators: dense computations, the two extremes bit for bit, batches, derivatives."""

import copy
import pickle
import re

import numpy as np
import pytest

import pycraft as pc
from support.descriptions import KINDS
from support.differences import difference
from support.kernel_cases import MODELS, STATES, states
from support.mechanisms import SEQUENCES, every_kind, massless_inner_bodies, rotors_on_some, with_hinges
from support.oracle import ROUNDING, agree
from support.scenes import hybrid_dynamics, some_subhinges

FORMS = ["fast", "ud", "square-root"]
WAYS = [dict(form=form) for form in FORMS] + [
    dict(refine=1),
    dict(refine=2, residual="gather"),
    dict(refine="auto", residual="wider"),
    dict(form="ud", refine=1),
    *(dict(form=form, precision=precision) for form in FORMS for precision in ("extended", "quad")),
    dict(precision=50),
    dict(precision=100, form="ud"),
    dict(precision="single", refine=2, residual="wider"),
]
EXTREMES = [dict(), dict(form="ud"), dict(form="square-root"), dict(precision="single"), dict(precision="quad"), dict(precision="extended")]


def names_of(model, coordinates):
    return [model.coordinate_names[j] for j in coordinates]


def given_to(model, seed, count=None):
    rng = np.random.default_rng(seed)
    shape = (model.nv,) if count is None else (count, model.nv)
    return rng.uniform(-1, 1, (2, *shape))


def check(model, prescribed, seed=0, **how):
    state, (tau, vdot) = model.random_state(seed + 5), given_to(model, seed)
    found = model.hybrid_dynamics(state.q, state.v, tau, vdot, names_of(model, prescribed), **how)
    accelerations, forces, condition = hybrid_dynamics(model, state.q, state.v, tau, vdot, prescribed)
    last = 64 * np.finfo(np.float32).eps if how.get("precision") == "single" else 0.0  # forces are summed in it
    agree(found.vdot, accelerations, ROUNDING * condition + last)
    agree(found.tau, forces, ROUNDING * condition + last)
    free = np.setdiff1d(np.arange(model.nv), prescribed)
    assert np.array_equal(found.vdot[prescribed], vdot[prescribed]) and np.array_equal(found.tau[free], tau[free])


@pytest.mark.parametrize("kind", [k for k in [*KINDS, *SEQUENCES] if k != "weld"])
@pytest.mark.parametrize("shape", ["chain", "tree", "forest"])
def test_every_kind_of_hinge(kind, shape):
    model = with_hinges(kind, shape)
    model.gravity = (0.3, -2.0, -9.0)
    for seed in range(3):
        check(model, some_subhinges(model, np.random.default_rng(seed)), seed)


@pytest.mark.parametrize("how", WAYS, ids=str)
def test_every_form_and_precision(how):
    for seed, rotors in enumerate((False, True)):
        model = every_kind(rotor_inertia=rotors)
        check(model, some_subhinges(model, np.random.default_rng(seed)), seed, **how)
    for make in (massless_inner_bodies, rotors_on_some):
        model = pc.Multibody.from_description(make())
        check(model, some_subhinges(model, np.random.default_rng(3)), 3, **how)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("how", EXTREMES, ids=str)
def test_the_extremes_are_forward_and_inverse_dynamics_bit_for_bit(name, how):
    model = MODELS[name]
    Q, V, _ = states(model)
    tau, vdot = given_to(model, 3, STATES)
    precision = {k: x for k, x in how.items() if k == "precision"}
    for at in (slice(None), 0):
        none = model.hybrid_dynamics(Q[at], V[at], tau[at], vdot[at], [], **how)
        assert np.array_equal(none.vdot, model.forward_dynamics(Q[at], V[at], tau[at], **how)) and np.array_equal(none.tau, tau[at])
        every = model.hybrid_dynamics(Q[at], V[at], tau[at], vdot[at], list(model.hinges), **how)
        assert np.array_equal(every.tau, model.inverse_dynamics(Q[at], V[at], vdot[at], **precision))
        assert np.array_equal(every.vdot, vdot[at])


def test_all_prescribed_in_digits_beyond_those_of_inverse_dynamics():
    model = every_kind()
    state, (tau, vdot) = model.random_state(2), given_to(model, 2)
    found = model.hybrid_dynamics(state.q, state.v, tau, vdot, list(model.hinges), precision=50)
    agree(found.tau, model.inverse_dynamics(state.q, state.v, vdot, precision="quad"), 4 * np.finfo(float).eps)


@pytest.mark.parametrize("name", ["panda", "g1", "tree of ball", "tree of free", "tree of screw", "tree of universal"])
@pytest.mark.parametrize("how", [dict(), dict(precision="single"), dict(form="ud"), dict(refine=1), dict(precision="extended")], ids=str)
def test_batches_have_the_bits_of_each_state(name, how):
    model = MODELS[name]
    Q, V, _ = states(model)
    tau, vdot = given_to(model, 4, STATES)
    chosen = names_of(model, some_subhinges(model, np.random.default_rng(5)))
    whole = model.hybrid_dynamics(Q, V, tau, vdot, chosen, **how)
    single = [model.hybrid_dynamics(*one, chosen, **how) for one in zip(Q, V, tau, vdot, strict=True)]
    assert np.array_equal(whole.vdot, [one.vdot for one in single]) and np.array_equal(whole.tau, [one.tau for one in single])
    for missing in range(4):  # an argument of one state stands for all
        arguments = [x[0] if i == missing else x for i, x in enumerate((Q, V, tau, vdot))]
        rows = [np.broadcast_to(x, (STATES, x.shape[-1])).copy() for x in arguments]
        assert np.array_equal(model.hybrid_dynamics(*arguments, chosen, **how), model.hybrid_dynamics(*rows, chosen, **how))
    empty = model.hybrid_dynamics(Q[:0], V[:0], tau[:0], vdot[:0], chosen, **how)
    assert empty.vdot.shape == empty.tau.shape == (0, model.nv)


@pytest.mark.parametrize("prescribed", [[], "all"])
def test_a_batch_of_what_is_not_asked_for_still_is_a_batch(prescribed):
    model = pc.chain(3)
    chosen = list(model.hinges) if prescribed else []
    rows = np.tile([0.1, 0.2, 0.3], (5, 1))
    given = dict(tau=rows, vdot=None) if prescribed else dict(tau=None, vdot=rows)
    found = model.hybrid_dynamics([0.1, 0.2, 0.3], [1, 1, 1], given["tau"], given["vdot"], chosen)
    assert found.vdot.shape == found.tau.shape == (5, 3) and (found.vdot == found.vdot[0]).all()


def test_threads_share_a_batch():
    model = MODELS["panda"]
    Q, V, _ = states(model, 200)
    tau, vdot = given_to(model, 6, 200)
    one, two = (model.hybrid_dynamics(Q, V, tau, vdot, ["panda_joint3"], threads=n) for n in (1, 2))
    assert np.array_equal(one, two) and isinstance(two, type(one))


def test_sets_are_switched_on_the_fly_and_edits_are_followed():
    model = pc.tree([-1, 0, 1, 1], ["pin", "ball", "slider", "universal"], seed=4)
    model.gravity = (0, 0, -9.81)
    for _ in range(2):
        for chosen in ([0], [1, 2, 3], [4], [5], [0, 6], []):
            check(model, chosen, 1)
        model.bodies["body2"].mass *= 3
    model.add_body("more", "body3", "pin", mass=0.5, com=(0.1, 0, 0))
    check(model, [0, 7], 2)
    assert len(model._hybrid) <= 16
    for i in range(40):
        model.hybrid_dynamics(prescribed=["more"] if i % 2 else [f"hinge{i % 4}"])
        model.bodies["more"].mass = 0.5 + i
    assert len(model._hybrid) <= 16


def test_a_hinge_without_inertia_may_be_prescribed():
    model = pc.Multibody("tip")
    model.add_body("a", mass=1.0, com=(1, 0, 0))
    model.add_body("b", "a", mass=0.0, position=(1, 0, 0))
    model.take_warnings()
    with pytest.raises(pc.SingularHingeError, match="'b'"):
        model.hybrid_dynamics([0.1, 0.2], [0.3, 0.4], [1.0, 0.0], [0.0, 3.0], ["a"])
    found = model.hybrid_dynamics([0.1, 0.2], [0.3, 0.4], [1.0, 5.0], [7.0, 3.0], ["b"])
    assert found.vdot.tolist() == [1.0, 3.0] and found.tau.tolist() == [1.0, 0.0]
    batch = [[0.1, 0.2]] * 3
    with pytest.raises(pc.SingularHingeError, match=r"coordinate 'b'.*state 0 of a batch of 3"):
        model.hybrid_dynamics(batch, batch, batch, batch, ["a"])


def test_an_underactuated_arm_and_a_base_whose_momentum_stays_fixed():
    """Acrobot: the elbow moved as given, the shoulder free. A free-flying robot: no force at its base, and momentum keeps its rate."""
    arm = pc.chain(2)
    arm.gravity = (0, -9.81, 0)
    found = arm.hybrid_dynamics([0.3, -0.5], [0.1, 0.2], vdot=[0.0, 1.5], prescribed="hinge1")
    assert found.tau[0] == 0.0 and found.vdot[1] == 1.5
    agree(arm.forward_dynamics([0.3, -0.5], [0.1, 0.2], found.tau), found.vdot)
    robot = pc.tree([-1, 0, 1, 0], ["free", "pin", "ball", "slider"], seed=2)
    state, vdot = robot.random_state(3), np.random.default_rng(1).normal(size=robot.nv)
    found = robot.hybrid_dynamics(state.q, state.v, None, vdot, [name for name in robot.hinges if name != "hinge0"])
    assert not found.tau[:6].any()

    def momentum(h):
        q = robot.integrate(state.q, h * state.v + h * h / 2 * found.vdot)
        return robot.momentum(q, state.v + h * found.vdot).value

    assert np.abs(difference(momentum)).max() < 1e-8  # of a motion to second order, at the step of `differences`


# Derivatives ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["panda", "tree of ball", "tree of free", "tree of universal", "tree of screw"])
def test_derivatives(name):
    model = MODELS[name]
    state, (tau, vdot) = model.random_state(7), given_to(model, 8)
    for chosen in ([], some_subhinges(model, np.random.default_rng(2)), list(range(model.nv))):
        names = names_of(model, chosen)
        exact = model.hybrid_dynamics_derivatives(state.q, state.v, tau, vdot, names)
        moved_to = lambda given, names=names: model.hybrid_dynamics(*given, names, precision="quad")
        moved = {
            "q": lambda h, e: (model.integrate(state.q, h * e), state.v, tau, vdot),
            "v": lambda h, e: (state.q, state.v + h * e, tau, vdot),
            "tau": lambda h, e: (state.q, state.v, tau + h * e, vdot),
            "vdot": lambda h, e: (state.q, state.v, tau, vdot + h * e),
        }
        for by, at in moved.items():
            for i, e in enumerate(np.eye(model.nv)):
                for what in ("vdot", "tau"):
                    found = difference(lambda h, at=at, e=e, what=what, to=moved_to: getattr(to(at(h, e)), what))
                    agree(getattr(exact, f"{what}_{by}")[:, i], found, 1e-8)


def test_derivatives_at_the_extremes_and_of_batches():
    model = MODELS["panda"]
    Q, V, _ = states(model)
    tau, vdot = given_to(model, 9, STATES)
    none = model.hybrid_dynamics_derivatives(Q, V, tau, vdot, [])
    forward = model.forward_dynamics_derivatives(Q, V, tau)
    for one, other in zip((none.vdot_q, none.vdot_v, none.vdot_tau), forward, strict=True):
        agree(one, other, 1e-10)
    every = model.hybrid_dynamics_derivatives(Q, V, tau, vdot, list(model.hinges))
    inverse = model.inverse_dynamics_derivatives(Q, V, vdot)
    assert all(np.array_equal(a, b) for a, b in zip((every.tau_q, every.tau_v, every.tau_vdot), inverse, strict=True))
    some = model.hybrid_dynamics_derivatives(Q, V, tau, vdot, ["panda_joint2"])
    single = [model.hybrid_dynamics_derivatives(*one, ["panda_joint2"]) for one in zip(Q, V, tau, vdot, strict=True)]
    for name in some._fields:
        agree(getattr(some, name), np.array([getattr(one, name) for one in single]), 1e-12)
    assert model.hybrid_dynamics_derivatives(Q[:0], V[:0], tau[:0], vdot[:0], ["panda_joint2"]).tau_q.shape == (0, 7, 7)


# Operators ------------------------------------------------------------------------------------------------------------


def test_names_that_are_listed_once_and_models_without_coordinates():
    arm, rng = pc.chain(3), np.random.default_rng(2)
    q, v, tau, vdot = rng.normal(size=(4, 8, 3))
    for x, y in zip(
        arm.hybrid_dynamics_derivatives(q, v, tau, vdot, iter(["hinge0"])), arm.hybrid_dynamics_derivatives(q, v, tau, vdot, "hinge0"),
        strict=True,
    ):  # fmt: skip
        assert np.array_equal(x, y)
    shared = arm.hybrid_dynamics(q, v, tau, vdot, iter(["hinge0"]), threads=2)
    assert np.array_equal(shared.tau, arm.hybrid_dynamics(q, v, tau, vdot, "hinge0").tau)
    post = pc.Multibody("post", welds="keep")
    post.add_body("post", hinge="weld", mass=1.0)
    for model in (pc.Multibody("nothing"), post):
        assert {x.shape for x in model.hybrid_dynamics_derivatives()} == {(0, 0)}


@pytest.mark.parametrize("name", ["panda", "tree of ball", "tree of universal"])
def test_operators(name):
    model = MODELS[name]
    state, soa = model.random_state(1), model.soa
    chosen = some_subhinges(model, np.random.default_rng(3))
    names, left = names_of(model, chosen), np.setdiff1d(np.arange(model.nv), chosen)
    free, held = soa.free(names), soa.prescribed(names)
    M = model.mass_matrix(state.q)
    ff, fp, pp = M[np.ix_(left, left)], M[np.ix_(left, chosen)], M[np.ix_(chosen, chosen)]
    at = lambda op: op.at(state.q).dense()
    condition = np.linalg.cond(ff)
    agree(at(soa.H)[left], at(free.H))
    agree(at(soa.H)[chosen], at(held.H))
    agree(at(free.H @ soa.phi @ soa.M @ soa.phi.T @ held.H.T), fp)
    agree(at((free.MM + free.J).inv()), np.linalg.inv(ff), ROUNDING * condition)
    agree(at(free.Schur_complement), pp - fp.T @ np.linalg.solve(ff, fp), ROUNDING * condition)
    tip = list(model.bodies)[-1]
    whole = model.jacobian(tip, state.q)
    following = whole[:, chosen] - whole[:, left] @ np.linalg.solve(ff, fp)
    agree(at(free.generalized_Jacobian(tip)), following, ROUNDING * condition)
    agree(at(free.of_prescribed.H), at(held.H))
    for made in (pickle.loads(pickle.dumps(free)), copy.deepcopy(free)):
        agree(made.Schur_complement.at(state.q).dense(), at(free.Schur_complement))


def test_the_generalized_jacobian_moves_the_tip_with_no_momentum():
    """A free-flying arm that starts from rest: velocities of its joints alone, the base following so that no momentum arises."""
    robot = pc.tree([-1, 0, 1, 2], ["free", "pin", "pin", "pin"], seed=6)
    state, rates = robot.random_state(2), np.array([0.3, -0.7, 1.1])
    free = robot.soa.free(["hinge1", "hinge2", "hinge3"])
    M = robot.mass_matrix(state.q)
    v = np.concatenate([-np.linalg.solve(M[:6, :6], M[:6, 6:] @ rates), rates])
    assert np.abs(robot.momentum(state.q, v).value).max() < 1e-12
    agree(free.generalized_Jacobian("body3").at(state.q) @ rates, robot.jacobian("body3", state.q) @ v, ROUNDING * np.linalg.cond(M))


# What is refused ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("prescribed", "text"),
    [
        (["hinge9"], "prescribed: no hinge or coordinate"),
        (["hinge0", "hinge0"], "coordinate 'hinge0' is prescribed twice, the second time as 'hinge0'"),
        (["hinge*", "hinge2"], "coordinate 'hinge2' is prescribed twice, the second time as 'hinge2'"),
        (["hinge1[0]"], "hinge 'hinge1' moves by a ball subhinge, whose coordinates are prescribed together: name the hinge"),
        ([3], "prescribed takes names of hinges or coordinates, or a list of them, not 3"),
        (None, "prescribed takes names of hinges or coordinates, or a list of them, not None"),
    ],
)
def test_refusals(prescribed, text):
    model = pc.tree([-1, 0, 1], ["pin", "ball", "pin"], seed=1)
    with pytest.raises(pc.ModelError, match=re.escape(text)):
        model.hybrid_dynamics(prescribed=prescribed)


def test_refusals_of_numbers_and_of_operators():
    model = pc.chain(3)
    with pytest.raises(pc.ModelError, match="vdot of hinge 'hinge1': entry 0 is nan"):
        model.hybrid_dynamics([0, 0, 0], [0, 0, 0], [0, 0, 0], [0, np.nan, 0], ["hinge0"])
    with pytest.raises(pc.ModelError, match="tau of 'chain of 3 rods' takes 3 numbers"):
        model.hybrid_dynamics([0, 0, 0], [0, 0, 0], [0, 0], [0, 0, 0], ["hinge0"])
    with pytest.raises(pc.EvaluationError, match="form"):
        model.hybrid_dynamics(prescribed="hinge0", form="slow")
    with pytest.raises(pc.ModelError, match="it is not a complete multibody model"):
        model.soa.grouped([["body0", "body1"]]).free(["hinge0"])
    with pytest.raises(pc.ModelError, match="prescribed twice"):
        model.soa.free(["hinge0", "hinge[0-1]"])
    operators = model.soa.free(["hinge0"])
    model.add_body("more", "body2", mass=1.0, com=(1, 0, 0))
    with pytest.raises(pc.StaleOperatorError):
        operators.H.dense()
    nothing = pc.tree([-1, 0], ["weld", "weld"], seed=1)
    found = nothing.hybrid_dynamics(prescribed=[])
    assert found.vdot.shape == found.tau.shape == (0,)


@pytest.mark.parametrize("name", ["panda", "every"])
def test_derivatives_of_a_state_have_the_bits_that_they_have_alone(name):
    """In a batch of any size, and shared out over threads: blocks of a batch lie otherwise than those of one state."""
    model = pc.robots.panda() if name == "panda" else every_kind()
    rng = np.random.default_rng(3)
    given = np.array([model.random_state(i).q for i in range(37)]), *rng.normal(size=(3, 37, model.nv))
    for prescribed in (list(model.hinges)[:1], list(model.hinges)[1::2]):
        alone = [model.hybrid_dynamics_derivatives(*(x[i] for x in given), prescribed) for i in range(37)]
        for threads in (1, 3):
            whole = model.hybrid_dynamics_derivatives(*given, prescribed, threads=threads)
            for field, found in zip(whole._fields, whole, strict=True):
                np.testing.assert_array_equal(found, np.stack([getattr(one, field) for one in alone]))
