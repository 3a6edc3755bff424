"""Runs inside a run: an operator from outside, or a signal's handler, evaluates while the run that called it is not over yet."""

import gc
import signal
import threading

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind, uniform_batch
from support.packs import NEVER, packs_from


def mass_matrix(soa):
    H, phi, M = soa("H phi M")
    return H @ phi @ M @ phi.T @ H.T


def outside(space, product, name="L"):
    """An operator from outside that is the identity, and calls `product` each time."""

    def apply(x):
        product()
        return x

    return pc._core.external(apply, apply, space, space, name)


def another_state(model):
    MM, bound = mass_matrix(model.soa), model.random_state(7).q
    return lambda: MM.at(bound) @ np.ones(model.nv)


def present_state_moved(model):
    MM, q = mass_matrix(model.soa), model.random_state(8).q

    def run():
        before = model.q
        model.q = q
        MM @ np.ones(model.nv)
        model.q = before

    return run


def another_model(model):
    other = pc.chain(5)
    MM = mass_matrix(other.soa)
    return lambda: MM.inv() @ np.ones(5)


def dying_model(model):
    def run():
        other = pc.chain(3, seed=1)
        float(mass_matrix(other.soa).logdet()), mass_matrix(other.soa) @ np.ones(3)
        del other
        gc.collect()

    return run


def batch(model):
    Q, _ = uniform_batch(model, 3)
    MM = mass_matrix(model.soa)
    return lambda: MM.inv().at(Q).trace().value()


def same_expression(model):
    """The very expression that is being run; it ends at depth 3."""
    depth = []

    def run():
        if len(depth) < 3:
            depth.append(None)
            run.expression @ np.ones(model.nv)
            depth.pop()

    return run


INNER = [another_state, present_state_moved, another_model, dying_model, batch, same_expression]


EVERY_DAY = list(zip(INNER, [True, False] * 3, strict=True))


@pytest.mark.parametrize(
    ("inner", "bound"),
    [*EVERY_DAY, *(pytest.param(inner, not bound, marks=pytest.mark.slow) for inner, bound in EVERY_DAY)],
)
def test_a_run_within_an_operator_from_outside(inner, bound):
    """Σ of terms before and after the operator from outside, so that the run goes on with its values when it comes back."""
    model = every_kind()
    MM, D = mass_matrix(model.soa), model.soa.D
    run = inner(model)
    L = outside(model.soa.Theta, run)
    x = np.linspace(-1, 1, model.nv)
    e = MM @ L @ MM + D @ L @ (MM + D).inv() + L
    plain = MM @ MM + D @ (MM + D).inv() + pc.identity(MM.domain)
    if bound:
        q = model.random_state(3).q
        e, plain = e.at(q), plain.at(q)
    run.expression = e
    for _ in range(3):
        assert np.allclose(e @ x, plain @ x, rtol=1e-12, atol=1e-12 * np.abs(plain @ x).max())


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no interval timers here")
@pytest.mark.parametrize("inner", INNER[:-1])
@pytest.mark.parametrize("states", [1000, 8000], ids=["one by one", "in packs"])
def test_a_run_within_a_signals_handler(inner, states):
    model = every_kind()
    Q, V = uniform_batch(model, states)
    MM = mass_matrix(model.soa)
    e, run, calls = (MM + model.soa.D).inv().at(Q, V), inner(model), []

    def handler(*_):
        calls.append(None)
        run()

    before = signal.signal(signal.SIGALRM, handler)
    try:
        with packs_from(NEVER if states == 1000 else 1):
            alone = e @ np.ones(model.nv)
            for _ in range(20):
                signal.setitimer(signal.ITIMER_REAL, 0.02)
                assert np.array_equal(e @ np.ones(model.nv), alone)
                if calls:
                    break
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert calls


def test_nested_runs_in_several_threads():
    model = every_kind()
    MM = mass_matrix(model.soa)
    L = outside(model.soa.Theta, another_state(model))
    x, wrong = np.ones(model.nv), []
    plain = MM @ (MM @ x)

    def work():
        for _ in range(100):
            if not np.allclose((MM @ L @ MM) @ x, plain, rtol=1e-12):
                wrong.append(None)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert not wrong
