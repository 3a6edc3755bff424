"""Ctrl-C ends every long call within a second: a real SIGINT, sent while the call runs."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import pycraft as pc

pytestmark = pytest.mark.skipif(os.name == "nt", reason="SIGINT is sent in another way there")
AFTER, WITHIN = 0.3, 1.0


def mass_matrix(model):
    H, phi, M = model.soa("H phi M")
    return H @ phi @ M @ phi.T @ H.T


def seconds_to_stop(work, after=AFTER):
    """How long `work`, called again and again, goes on after a SIGINT that comes `after` some seconds."""
    sent = []

    def send():
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(after, send)
    timer.start()
    try:
        while not sent or time.perf_counter() - sent[0] < 30:
            work()
    except KeyboardInterrupt:
        return time.perf_counter() - sent[0]
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)
    raise AssertionError("no interrupt arrived")


def planning():
    soa = pc.chain(3, seed=1).soa
    e = soa.phi
    for _ in range(25):
        e = (0.1 * e + soa.I) @ (0.1 * e + soa.tau)
    return lambda: pytest.raises(pc.EvaluationError, e.plan, rules=False)


def planning_of_a_nest():
    soa = pc.chain(3, seed=1).soa
    e = soa.D
    for _ in range(3000):
        e = (e + soa.J).inv() + soa.I
    return lambda: (2 * e).plan()


def conjugate_gradients():
    model = pc.chain(3000)
    q, zero = np.linspace(-1, 1, model.nv), np.zeros(model.nv)
    return lambda: model.forward_dynamics(q, zero, zero + 1, method="conjugate-gradients")


def dense_method(name, bodies):
    def make():
        model = pc.chain(bodies)
        q, zero = np.linspace(-1, 1, model.nv), np.zeros(model.nv)
        return lambda: model.forward_dynamics(q, zero, zero, method=name)

    return make


def elimination():
    model = pc.chain(2000, seed=1)
    e = (mass_matrix(model) + 0.1 * model.soa.I).inv().at(precision=100)
    return lambda: e @ np.ones(model.nv)


def elimination_in_one_front():
    """States of many inner inverses: large pivot blocks."""
    model = pc.chain(6, seed=1)
    e = mass_matrix(model)
    for _ in range(40):
        e = (e + model.soa.I).inv() + mass_matrix(model)
    e = e.inv().at(precision=100)
    return lambda: e @ np.ones(6)


def sweeps():
    model = pc.chain(20_000)
    MM = mass_matrix(model).at(precision=100)
    return lambda: MM @ np.ones(model.nv)


def riccati_sweep():
    model = pc.chain(20_000)
    D = model.soa.D.at(precision=100, form="ud")
    return lambda: D.logdet().value()


def dense_form():
    MM = mass_matrix(pc.chain(2500))
    return lambda: MM.dense(rules=False)


def a_batch():
    model = pc.robots.panda()
    q, zero = np.tile(model.q, (3000, 1)), np.zeros((3000, model.nv))
    return lambda: model.forward_dynamics(q, zero, zero, precision=100)


def a_batch_in_threads():
    model = pc.robots.panda()
    e = mass_matrix(model).inv().at(np.tile(model.q, (3000, 1)), precision=100, threads=2)
    return lambda: e @ np.ones(model.nv)


def one_large_state():
    model = pc.chain(20_000)
    zero = np.zeros(model.nv)
    return lambda: model.forward_dynamics(model.q, zero, zero, form="ud", precision=100)


def divide_and_conquer(threads):
    def made():
        model = pc.chain(20_000)
        zero = np.zeros(model.nv)
        return lambda: model.forward_dynamics(model.q, zero, zero, method="divide-and-conquer", precision=100, threads=threads)

    return made


def sensitivities():
    model = pc.chain(800)
    zero = np.zeros(model.nv)
    return lambda: model.forward_dynamics_derivatives(model.q, zero, zero)


def a_trajectory():
    model = pc.chain(6, seed=1)
    state = model.random_state(0)
    return lambda: model.integrate_ode(state.q, state.v, [0.0, 1000.0], integrator="dop853", rtol=1e-13, precision="quad")


def an_operator_from_outside():
    theta = pc.chain(3, seed=1).soa.Theta
    L = pc._core.external(lambda x: (time.sleep(0.05), x)[1], None, theta, theta, "L")
    many = pc.constant(np.eye(3), theta, theta)
    for _ in range(200):
        many = L @ (0.5 * many + pc.identity(theta))
    return lambda: many @ np.ones(3)


def checking():
    soa = pc.robots.panda().soa
    return lambda: soa.check(precision=100)


def proving():
    H, phi, psi, K, I, M, D = pc.chain(2, seed=1).soa("H phi psi K I M D")
    left = H @ phi @ M @ psi.T @ H.T @ (I - H @ psi @ K).T
    return lambda: pc.prove(left @ left, D @ (I + H @ phi @ K) @ D)


CALLS = {
    "planning": planning,
    "planning of a nest": planning_of_a_nest,
    "conjugate gradients": conjugate_gradients,
    "Cholesky": dense_method("cholesky", 4000),
    "the explicit inverse": dense_method("inverse", 2500),
    "elimination in 100 digits": elimination,
    "elimination with large pivot blocks": elimination_in_one_front,
    "sweeps in 100 digits": sweeps,
    "a Riccati sweep in 100 digits": riccati_sweep,
    "a dense form": dense_form,
    "a batch in 100 digits": a_batch,
    "a batch in threads": a_batch_in_threads,
    "one large state in 100 digits": one_large_state,
    "divide and conquer": divide_and_conquer(1),
    "divide and conquer in threads": divide_and_conquer(2),
    "sensitivities": sensitivities,
    "a trajectory": a_trajectory,
    "an operator from outside": an_operator_from_outside,
    "checking": checking,
    "proving": proving,
}
QUICK = ("planning", "conjugate gradients", "elimination with large pivot blocks", "a trajectory")


@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in QUICK else [pytest.mark.slow]) for n in CALLS])
def test_ctrl_c_within_a_second(name):
    work = CALLS[name]()
    assert seconds_to_stop(work) < WITHIN


def test_after_an_interrupt_everything_works():
    model = pc.chain(2000, seed=1)
    MM = mass_matrix(model)
    e = (MM + 0.1 * model.soa.I).inv()
    right = e @ np.ones(model.nv)
    wide = e.at(precision=50)
    seconds_to_stop(lambda: wide @ np.ones(model.nv), 0.2)
    assert np.array_equal(e @ np.ones(model.nv), right)
    small = pc.chain(3, seed=1)
    e = small.soa.phi
    for _ in range(25):
        e = (0.1 * e + small.soa.I) @ (0.1 * e + small.soa.tau)
    seconds_to_stop(lambda: pytest.raises(pc.EvaluationError, e.plan, rules=False), 0.05)
    assert (small.soa.phi @ np.ones(18)).shape == (18,)
