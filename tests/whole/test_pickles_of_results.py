"""Every kind of thing that calls give back copies and pickles, in the oldest protocol and the newest, and says the same then."""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc

E = pc.effects
HAND, QUIET = "wrist_3_link", {"progress": False}
WAYS = {
    "protocol 0": lambda thing: pickle.loads(pickle.dumps(thing, 0)),
    "newest": lambda thing: pickle.loads(pickle.dumps(thing, pickle.HIGHEST_PROTOCOL)),
    "copy": copy.copy,
    "deep copy": copy.deepcopy,
}


def rods():
    model = pc.chain(2)
    model.gravity = (0, -9.81, 0)
    return model


def bars():
    model = pc.chain(3)
    model.gravity = (0, -9.81, 0)
    model.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    state = model.assemble([1.0, -1.0, -1.0], [0, 0, 0], fix="hinge0")
    model.q, model.v = state.q, state.v
    return model


def arm():
    model = pc.robots.ur5()
    model.q = model.random_state(1).q
    return model


def scene():
    return pc.Scene(pc.chain(2)).add(E.Gravity(), E.Damping(0.1))


def run():
    return scene().simulate(0.5, [0, 0], [0, 0], **QUIET)


def swinging(t, state):
    return state.q[0] + 0.1


# What gives a thing, and what the thing says: numbers, or text.
THINGS = {
    "equilibrium": (lambda: rods().equilibrium(q0=[-1.4, 0.1]), lambda x: x.q),
    "counterbalance": (lambda: rods().counterbalance([0, 0]), lambda x: x.tau),
    "task space": (lambda: arm().task_space(HAND), lambda x: x.inertia),
    "linear model": (lambda: rods().linearize([-1.57, 0], [0, 0]), lambda x: x.A),
    "quadratic model": (lambda: rods().quadratic_model([-1.57, 0], [0, 0]), lambda x: repr(x)),
    "linear model of a scene": (lambda: scene().linearize([0, 0], [0, 0]), lambda x: x.A),
    "mobility": (lambda: bars().mobility(), lambda x: x.freedoms),
    "mobility along": (lambda: bars().mobility_along(np.stack([bars().q] * 2)), lambda x: x.distance),
    "constrained dynamics": (lambda: bars().constrained_dynamics(), lambda x: x.forces["closure"].b),
    "constrained velocities": (lambda: bars().constrained_velocities(), lambda x: x.v),
    "constrained inverse dynamics": (lambda: bars().constrained_inverse_dynamics(), lambda x: x.forces["closure"].b),
    "derivatives of it": (lambda: bars().constrained_inverse_dynamics_derivatives(), lambda x: x.q),
    "forces of loops by name": (lambda: bars().constrained_dynamics().forces, lambda x: x["closure"].a),
    "hybrid dynamics": (lambda: rods().hybrid_dynamics([0, 0], [0, 0], prescribed="hinge0"), lambda x: x.tau),
    "derivatives": (lambda: rods().forward_dynamics_derivatives([0, 0], [0, 0], [0, 0]), lambda x: np.stack(x)),
    "momentum": (lambda: arm().centroidal_momentum(), lambda x: repr(x)),
    "trajectory": (lambda: rods().integrate_ode([0, 0], [0, 0], [0, 0.1]), lambda x: x.q),
    "inverse kinematics": (lambda: arm().solve_ik({HAND: arm().pose(HAND)}, arm().q + 0.1), lambda x: (x.q, x.why, repr(x))),
    "inverse kinematics of a batch": (
        lambda: arm().solve_ik({HAND: arm().pose(HAND)}, np.stack([arm().q + 0.1, arm().q - 0.1])),
        lambda x: (x.q, x[1].q, x.missed),
    ),
    "frame": (lambda: arm().frame(HAND), lambda x: x.jacobian(wrt="upper_arm_link")),
    "frames": (lambda: arm().frames, lambda x: list(x)),
    "loop": (lambda: bars().loops["closure"], lambda x: x.jacobian()),
    "loops": (lambda: bars().loops, lambda x: x.jacobian()),
    "prepared": (lambda: arm().prepare("forward_dynamics", form="ud"), lambda f: f(*[np.full(6, 0.1)] * 3)),
    "prepared of a frame": (lambda: arm().prepare("jacobian", frame=HAND, batch=2), lambda f: f(np.full((2, 6), 0.1))),
    "prepared, three results": (lambda: arm().prepare("forward_dynamics_derivatives"), lambda f: np.stack(f(*[np.full(6, 0.1)] * 3))),
    "prepared, hybrid": (lambda: rods().prepare("hybrid_dynamics", prescribed="hinge0"), lambda f: np.stack(f(*[np.ones(2)] * 4))),
    "a method": (lambda: rods().mass_matrix, lambda f: f([0.1, 0.2])),
    "a method of the class": (lambda: pc.Multibody.mass_matrix, lambda f: f(rods(), [0.1, 0.2])),
    "proof": (lambda: pc.prove("HψMψ*H* == D", pc.chain(3)), lambda x: (str(x), bool(x), x.recheck(), x.hypotheses)),
    "proof by diagonal blocks": (lambda: pc.prove("blockdiag(psi) = I"), lambda x: (str(x), bool(x), x.recheck())),
    "proof by a trace": (lambda: pc.prove("tr(MM) = tr(H phi M phi* H*)"), lambda x: (str(x), bool(x), x.recheck())),
    "proof of nothing": (lambda: pc.prove("H psi == H phi"), lambda x: (str(x), bool(x), x.difference)),
    "check": (lambda: pc.check("H G == I"), lambda x: (str(x), bool(x))),
    "counterexample": (lambda: pc.check("H phi == H psi").counterexample, lambda x: str(x)),
    "repairs": (lambda: pc.repair("H psi P H* = D + 1"), lambda x: str(x)),
    "exercise": (lambda: pc.exercise("HψMψ*H* == D"), lambda x: str(x)),
    "algorithm": (lambda: rods().soa.MM.algorithm("python"), lambda x: str(x)),
    "explanation": (lambda: rods().soa.MM.explain(), lambda x: str(x)),
    "certificate": (lambda: rods().soa.MM.certify(np.ones(2)), lambda x: str(x)),
    "accuracy": (lambda: pc.accuracy(rods(), seconds=0), lambda x: [row["error"] for row in x]),
    "comparison": (lambda: pc.compare(rods(), rods()), lambda x: (str(x), bool(x))),
    "run": (run, lambda x: (x.q, repr(x))),
    "run with events": (lambda: scene().simulate(0.5, [0, 0], [0, 0], events=[swinging], **QUIET), lambda x: x.q),
    "evaluation": (lambda: scene().evaluate([0, 0], [1, 1]), lambda x: x.vdot),
    "checkpoint": (lambda: run().checkpoint(), repr),
    "scene": (scene, lambda x: x.evaluate([0, 0], [1, 1]).vdot),
    "tree": (lambda: rods().tree(), lambda x: str(x)),
    "spline": (lambda: pc.Spline([0, 1, 2.0], [0, 1, 0.0]), lambda f: f(np.array([0.3, 0.2]))[:2]),
    "operators of some coordinates": (lambda: rods().soa.free(["hinge0"]), lambda x: x.MM.at([0, 0]).dense()),
    "operators of groups": (lambda: rods().soa.grouped([["body0", "body1"]]), lambda x: x.MM.at([0, 0]).dense()),
    "operators of loops": (lambda: bars().soa.embedded(["hinge0"]), lambda x: x.MM.dense()),
}


def same(a, b):
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b


@pytest.mark.parametrize("name", THINGS)
def test_every_kind_of_result(name):
    make, says = THINGS[name]
    thing = make()
    expected = says(thing)
    for way, again in WAYS.items():
        other = again(thing)
        assert type(other) is type(thing), way
        assert same(says(other), expected), way


@pytest.mark.parametrize("make", [lambda: rods().compile("forward_dynamics"), lambda: bars().compile("constrained_dynamics")])
def test_compiled_calls(make):
    """A compiled call became what it was compiled of, and a hundred times as slow."""
    f = make()
    state = [np.array(x, float) for x in ([1, -1, 1 - np.pi], [0.1, -0.1, 0.1], [1, 0, 0])]
    state = state if "constrained" in f.name else [x[:2] for x in state]
    for way, again in WAYS.items():
        other = again(f)
        assert type(other) is type(f) and np.array_equal(other(*state), f(*state)), way


def test_compiled_expressions_of_a_model_that_was_edited():
    model = rods()
    f = model.soa.MM.compile()
    assert np.array_equal(copy.deepcopy(f)([0.1, 0.2], [1.0, 0.0]), f([0.1, 0.2], [1.0, 0.0]))
    model.bodies["body0"].mass = 3.0
    for again in WAYS.values():
        with pytest.raises(pc.EvaluationError, match="was edited after .* was compiled: compile it again"):
            again(f)


def test_what_is_pickled_goes_its_own_way():
    """A copy has a model of its own: edits of the first are not its."""
    model = rods()
    frame, call = model.frame("body1"), model.prepare("mass_matrix")
    frames, calls = copy.deepcopy(frame), pickle.loads(pickle.dumps(call))
    before = call(np.zeros(2))
    model.bodies["body1"].mass = 5.0
    assert np.array_equal(calls(np.zeros(2)), before) and not np.array_equal(call(np.zeros(2)), before)
    assert copy.copy(frame)._model is model and frames._model is not model
