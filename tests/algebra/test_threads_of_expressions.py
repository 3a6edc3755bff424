"""`.at(Q, threads=k)`: the states of a batch of expressions shared out over threads, with the bits, the shapes and the errors of one."""

import os
import pickle
import threading
import time

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core


def arm():
    model = pc.tree([-1, 0, 1, 1], ["screw", "ball", "pin", "slider"], seed=3)
    model.gravity = (0.3, -9.0, 1.0)
    return model


def states(model, count):
    drawn = [model.random_state(seed) for seed in range(count)]
    return np.array([s.q for s in drawn]).reshape(count, model.nq), np.array([s.v for s in drawn]).reshape(count, model.nv)


def mass_matrix(model):
    H, phi, M = model.soa("H phi M")
    return H @ phi @ M @ phi.T @ H.T


def requests(model):
    """Every tier of the planner and every request, as functions of what binds an expression to a batch, and of its length."""
    MM, (phi, psi, H, M, I) = mass_matrix(model), model.soa("phi psi H M I")
    rng = np.random.default_rng(5)
    x, X, Y = rng.normal(size=model.nv), rng.normal(size=(40, model.nv, 3)), rng.normal(size=psi.shape[1])
    A = rng.normal(size=(model.nv, model.nv))
    dense = pc.constant(A @ A.T, model.soa.Theta, model.soa.Theta)
    tau = pc.vector("tau", model.soa.Theta)
    here = MM.at(model.random_state(99).q)
    return {
        "a kernel": lambda at, B: at(MM) @ x,
        "columns": lambda at, B: at(MM.inv()) @ X[:B],
        "sweeps": lambda at, B: at(psi @ M) @ Y,
        "from the left": lambda at, B: at(MM.inv() @ H @ psi).T @ x,
        "elimination": lambda at, B: at((MM + 0.1 * I).inv()) @ X[:B],
        "a dense constant": lambda at, B: at((MM + dense).inv()) @ x,
        "beside another state": lambda at, B: at(here.inv() @ MM) @ x,
        "dense": lambda at, B: at(psi).dense(),
        "as it was typed": lambda at, B: at(MM.inv()).dense(rules=False),
        "diagonal": lambda at, B: at(MM.inv()).diagonal(),
        "trace": lambda at, B: at(MM).trace().value(),
        "logdet": lambda at, B: at(MM + 0.1 * I).logdet().value(),
        "norm": lambda at, B: at(phi).norm().value(),
        "a scalar": lambda at, B: at(MM.trace() * MM.logdet()).value(),
        "named vectors": lambda at, B: at(MM.inv() @ tau).value(tau=x),
        "derivative": lambda at, B: at(MM.inv()).diff(1) @ x,
        "gradient of ln det": lambda at, B: at(MM).logdet().gradient(),
        "gradient": lambda at, B: at(MM).trace().gradient(),
        "nothing of a state": lambda at, B: at(pc.zero(model.soa.Theta, model.soa.Theta)) @ x,
    }


@pytest.mark.parametrize("request_", requests(arm()))
def test_the_bits_of_one_thread(request_):
    model = arm()
    evaluate = requests(model)[request_]
    for count in (37, 2, 1, 0):
        Q, V = states(model, count)
        wanted = evaluate(lambda e, Q=Q, V=V: e.at(Q, V), count)
        found = evaluate(lambda e, Q=Q, V=V: e.at(Q, V, threads=3), count)
        np.testing.assert_array_equal(found, wanted)
        assert np.shape(found)[0] == count


@pytest.mark.parametrize("how", [{"precision": "quad"}, {"form": "ud"}, {"refine": 2}, {"refine": "auto", "residual": "gather"}])
def test_every_way_to_compute(how):
    model = arm()
    (Q, V), X = states(model, 20), np.random.default_rng(1).normal(size=(20, model.nv, 2))
    for e in (mass_matrix(model).inv(), (mass_matrix(model) + model.soa.I).inv()):
        np.testing.assert_array_equal(e.at(Q, V, threads=4, **how) @ X, e.at(Q, V, **how) @ X)


def test_a_plan_serves_again():
    """Workspaces of the threads are kept: they remember nothing of the states before."""
    model = arm()
    (Q, V), x = states(model, 30), np.ones(model.nv)
    e = (mass_matrix(model) + 0.5 * model.soa.I).inv()
    bound, wanted = e.at(Q, V, threads=2), e.at(Q, V) @ x
    for _ in range(3):
        np.testing.assert_array_equal(bound @ x, wanted)
    assert bound.plan().passes.eliminations == 30


def sliding():
    """A pin that carries a slider: far out, ℳ is beyond the range of double."""
    model = pc.tree([-1, 0], ["pin", "slider"], seed=4)
    Q = np.zeros((100, model.nq))
    return model, Q, mass_matrix(model)


def test_the_error_of_the_first_state_that_has_one():
    model, Q, MM = sliding()
    for wrong in ([70, 33, 34, 99], [99], [0, 50]):
        R = Q.copy()
        R[wrong, 1] = 1e200
        said = []
        for threads in (1, 4):
            with pytest.raises(pc.EvaluationError, match="beyond the range") as error:
                MM.at(R, threads=threads) @ np.ones(model.nv)
            said.append(str(error.value))
        assert said[0] == said[1] and f"(state {min(wrong)} of a batch of 100)" in said[0]
    np.testing.assert_array_equal(MM.at(Q, threads=4) @ np.ones(model.nv), MM.at(Q) @ np.ones(model.nv))


def test_the_first_of_errors_at_one_time():
    """States that take some time, and all but one fail: the second has company."""
    model, Q, MM = sliding()
    Q[1:, 1] = 1e200
    for _ in range(60):
        with pytest.raises(pc.EvaluationError, match=r"\(state 1 of a batch of 100\)"):
            (MM @ MM @ MM).at(Q, threads=4, precision=100) @ np.ones(model.nv)


def test_singular_states():
    """ℳ less what it is at one state has no inverse there."""
    model = arm()
    (Q, V), MM = states(model, 60), mass_matrix(model)
    Q[52] = Q[31]
    e = (MM - MM.at(Q[31])).inv()
    said = []
    for threads in (1, 3):
        with pytest.raises(pc.SingularOperatorError) as error:
            e.at(Q, V, threads=threads) @ np.ones(model.nv)
        said.append(str(error.value))
    assert said[0] == said[1] and "(state 31 of a batch of 60)" in said[0]


@pytest.mark.parametrize("threads", [0, -1, 2.0, True, None, "2", 5000, np.bool_(True), 10**30])
def test_how_many_threads(threads):
    model = arm()
    Q, _ = states(model, 4)
    with pytest.raises(pc.EvaluationError) as direct:
        model.mass_matrix(Q, threads=threads)
    for bind in (mass_matrix(model).at, mass_matrix(model).trace().at):
        for q in (Q, Q[0], None):
            with pytest.raises(pc.EvaluationError) as error:
                bind(q, threads=threads)
            assert str(error.value) == str(direct.value)
    assert mass_matrix(model).at(Q, threads=np.int64(2)) == mass_matrix(model).at(Q, threads=2)


def test_bindings_keep_it():
    model = arm()
    (Q, V), MM = states(model, 4), mass_matrix(model)
    bound = MM.at(Q, V, threads=3)
    assert bound == MM.at(Q, V, threads=3) and bound != MM.at(Q, V)
    assert MM.at(Q[0], threads=3) == MM.at(Q[0])  # nothing to share
    assert _core._binding(bound).threads == 3 and _core._binding(bound.diff(1)).threads == 3
    again = pickle.loads(pickle.dumps(bound))
    assert _core._binding(again).threads == 3
    np.testing.assert_array_equal(again.dense(), MM.at(Q, V).dense())


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="threads are counted by Linux")
def test_threads_work():
    model = pc.chain(20, seed=1)
    Q, _ = states(model, 60)
    e = mass_matrix(model).inv().at(Q, threads=3, precision=50)
    most, over = [0], threading.Event()

    def watch():
        while not over.is_set():
            most[0] = max(most[0], len(os.listdir("/proc/self/task")))
            time.sleep(0.0005)

    watcher = threading.Thread(target=watch)
    watcher.start()
    time.sleep(0.01)
    before, most[0] = most[0], 0
    e @ np.ones(20)
    over.set()
    watcher.join()
    assert most[0] == before + 3


def test_an_operator_from_outside_is_called_by_the_caller():
    model = arm()
    (Q, V), seen = states(model, 20), set()

    def outside(x):
        seen.add(threading.get_native_id())
        return 2 * x

    L = _core.external(outside, outside, model.soa.Theta, model.soa.Theta, "L")
    e = (L @ mass_matrix(model)).at(Q, V, threads=4)
    np.testing.assert_array_equal(e @ np.ones(model.nv), 2 * (mass_matrix(model).at(Q, V) @ np.ones(model.nv)))
    assert seen == {threading.get_native_id()}
