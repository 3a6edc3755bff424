"""`e.at(q)` in a loop is planned once: the plan of one state serves at every other, and is what would have been made there."""

import numpy as np
import pytest

import pycraft as pc


def robot():
    model = pc.tree([-1, 0, 1, 1], ["pin", "ball", "screw", "slider"], seed=3)
    model.gravity = (0.3, -9.0, 1.0)
    return model


def expressions(model):
    H, phi, M, psi, K, D, I, J = model.soa("H phi M psi K D I J")
    MM = H @ phi @ M @ phi.T @ H.T
    C = pc.constant(np.diag(np.arange(1.0, model.nv + 1)) + 0.1, model.soa.Theta, model.soa.Theta)
    return {
        "a letter": D,
        "a kernel": MM,
        "its inverse": (MM + J).inv(),
        "typed factors": (I - H @ psi @ K).T @ D.inv() @ (I - H @ psi @ K),
        "elimination": (MM + 0.1 * I).inv(),
        "a dense constant": (MM + C).inv(),
        "derivative of an inverse": MM.inv().diff(2),
        "nothing of a state": pc.zero(model.soa.Theta, model.soa.Theta),
    }


def values(e, x):
    scalars = [np.asarray(s.value()) for s in (e.trace(), e.norm())]
    return [e @ x, e.dense(), e.dense(rules=False), e.diagonal(), *scalars]


WAYS = [{}, {"form": "ud"}, {"form": "ud", "refine": 1}, {"precision": "quad"}, {"refine": "auto", "residual": "wider"}]


@pytest.mark.parametrize("name", expressions(robot()))
def test_the_plan_and_the_bits_that_it_would_have_had(name):
    model = robot()
    drawn = [model.random_state(seed) for seed in range(6)]
    Q, V, x = np.array([s.q for s in drawn]), np.array([s.v for s in drawn]), np.linspace(-1, 1, model.nv)
    e = expressions(model)[name]
    for how in WAYS:
        for q, v in ((Q[0], V[0]), (Q[1], V[1]), (Q[:4], V[:4]), (Q[1:3], V[1:3]), (Q[5], V[5])):
            fresh = expressions(model)[name].at(q, v, **how)
            for found, wanted in zip(values(e.at(q, v, **how), x), values(fresh, x), strict=True):
                np.testing.assert_array_equal(found, wanted)
            for request in ("apply", "dense", "trace"):
                assert said(e.at(q, v, **how), request) == said(fresh, request)


def said(bound, request):
    """Return a plan as text, except the report of its last run in packs: a plan that served before has a program."""
    return [line for line in str(bound.plan(request)).splitlines() if "in the last run: packs" not in line]


def test_a_state_within_stays():
    model = robot()
    e, x = expressions(model)["a kernel"] @ model.soa.D.at(model.random_state(77).q), np.ones(model.nv)
    for seed in range(3):
        q = model.random_state(seed).q
        np.testing.assert_array_equal(e.at(q) @ x, expressions(model)["a kernel"].at(q) @ (model.soa.D.at(model.random_state(77).q) @ x))


def test_inverses_of_what_is_bound():
    model = robot()
    e, x = expressions(model)["a kernel"], np.ones(model.nv)
    for seed in range(3):
        q = model.random_state(seed).q
        np.testing.assert_array_equal(e.at(q).inv() @ x, expressions(model)["a kernel"].inv().at(q) @ x)
        np.testing.assert_array_equal(e.inv().at(q) @ x, e.at(q).inv() @ x)


def test_plans_follow_the_model():
    """ℳ is ℳ + J where there are no rotors, until there are some; nothing of an old structure is left."""
    model = robot()
    e, x = expressions(model)["its inverse"], np.ones(model.nv)
    q = model.random_state(1).q
    before = e.at(q) @ x
    model.hinges[next(iter(model.hinges))].rotor_inertia = 0.5
    q = model.random_state(2).q
    np.testing.assert_array_equal(e.at(q) @ x, expressions(model)["its inverse"].at(q) @ x)
    after = e.at(model.random_state(1).q) @ x
    assert np.abs(after - before).max() > 1e-3 * np.abs(before).max()
    model.add_body("more", "body1", mass=1.0, inertia=np.eye(3))
    with pytest.raises(pc.StaleOperatorError):
        e.at(q) @ x


def test_two_models_at_one_state():
    a, b = robot(), robot()
    q, x = a.random_state(1).q, np.ones(a.nv)
    e = expressions(a)["a kernel"]
    e.at(q) @ x
    b.bodies["body2"].mass = 9.0
    other = expressions(b)["a kernel"]
    np.testing.assert_array_equal(other.at(q) @ x, expressions(b)["a kernel"].at(q) @ x)
    assert not np.array_equal(other.at(q) @ x, e.at(q) @ x)


@pytest.mark.parametrize("first", [False, True])
def test_what_is_known_of_one_model_is_not_taken_for_another(first):
    """Normal forms are kept by spelling: HφMφ*H* has another inverse where there are rotors."""
    for with_rotors in (first, not first):
        model = robot()
        if with_rotors:
            model.hinges[next(iter(model.hinges))].rotor_inertia = 0.5
        model.q = model.random_state(3).q
        H, phi, M, J, D = model.soa("H phi M J D")
        x = np.linspace(-1, 1, model.nv)
        MM = H @ phi @ M @ phi.T @ H.T
        for e in (MM, MM + J, MM - 2 * J, 3 * MM, MM + MM, D - J + J):
            dense = e.dense(rules=False)
            within = 1e3 * np.finfo(float).eps * np.linalg.cond(dense)  # of a solve; small dense factors beside sweeps of four bodies
            wanted = np.linalg.solve(dense, x)
            assert np.abs(e.inv() @ x - wanted).max() <= within * np.abs(wanted).max()
            assert np.abs(e @ x - dense @ x).max() <= 1e3 * np.finfo(float).eps * np.abs(dense).max()
