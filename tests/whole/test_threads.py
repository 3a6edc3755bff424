"""Threads: edits beside evaluations, the GIL, forks while others evaluate, daemon threads when the interpreter ends."""

import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import pycraft as pc


def mass_matrix(model):
    H, phi, M = model.soa("H phi M")
    return H @ phi @ M @ phi.T @ H.T


def beside(work, edit, seconds=0.6):
    """Runs `work` in three threads while `edit` is called again and again; how often it was refused and made, and what went wrong."""
    end, wrong, made, refused = time.perf_counter() + seconds, [], 0, 0

    def run():
        while time.perf_counter() < end and not wrong:
            try:
                work()
            except pc.StaleOperatorError:
                pass
            except Exception as error:
                wrong.append(error)

    threads = [threading.Thread(target=run) for _ in range(3)]
    for t in threads:
        t.start()
    while any(t.is_alive() for t in threads):
        try:
            edit()
            made += 1
        except pc.ModelError as error:
            assert "is being evaluated" in str(error)
            refused += 1
        time.sleep(0)
    assert not wrong, wrong[0]
    return made, refused


def parameters():
    model = pc.chain(6, seed=1)
    masses, body = [1.0, 2.0], model.bodies["body3"]
    Q = np.zeros((200, 6))
    expected = []
    for mass in masses:
        body.mass = mass
        expected.append(model.forward_dynamics(Q, Q, Q + 1)[0])
    MM = mass_matrix(model)

    def work():
        found = model.forward_dynamics(Q, Q, Q + 1)
        assert any(np.array_equal(found, np.tile(e, (200, 1))) for e in expected)
        MM.inv().at(Q) @ np.ones(6)

    def edit():
        masses.reverse()
        body.mass = masses[0]

    return work, edit


def gravity():
    model = pc.chain(4, seed=2)
    q = np.zeros(4)

    def edit():
        model.gravity = (0, 0, -model.gravity[2] - 9.81)

    return lambda: model.inverse_dynamics(q, q, q), edit


def structure():
    model = pc.chain(4, seed=2)
    count = iter(range(10**9))

    def work():
        soa = model.soa
        (soa.H @ soa.phi).dense()
        q = model.zero_q() if hasattr(model, "zero_q") else np.asarray(model.q)
        try:
            model.mass_matrix(q)
        except pc.ModelError as error:
            assert "takes" in str(error)

    def edit():
        """One edit a call: what follows a refused one finds the model as it was."""
        new = [name for name in model.bodies if name.startswith("new")]
        if len(new) > 4:
            model.remove_body(new[0])
        else:
            model.add_body(f"new{next(count)}", "body0", mass=1.0, inertia=np.eye(3))

    return work, edit


def the_state():
    model = pc.chain(6, seed=1)
    states = [np.zeros(6), np.ones(6)]
    MM = mass_matrix(model)
    expected = [MM.at(q).dense() for q in states]

    def work():
        found = MM.dense()
        assert any(np.array_equal(found, e) for e in expected)

    def edit():
        states.reverse()
        model.q = states[0]

    model.q = states[0]
    return work, edit


@pytest.mark.parametrize("case", [parameters, gravity, structure, the_state])
def test_edits_beside_evaluations(case):
    """They are made between two evaluations or refused; setting the state is no edit."""
    made, refused = beside(*case())
    assert made + refused > 0
    assert case is not the_state or refused == 0


def test_an_edit_within_an_evaluation_is_refused():
    model = pc.chain(3, seed=1)
    body, edits = model.bodies["body1"], []

    def outside(x):
        for edit in (
            lambda: setattr(body, "mass", 3.0),
            lambda: setattr(model, "gravity", (0, 0, -1)),
            lambda: model.add_node("n", "body1"),
            lambda: model.remove_body("body2"),
            lambda: model.add_body("b", "body1", mass=1.0),
        ):
            with pytest.raises(pc.ModelError, match="is being evaluated"):
                edit()
            edits.append(None)
        model.q = model.q
        return x

    L = pc._core.external(outside, outside, model.soa.Theta, model.soa.Theta, "L")
    before = body.mass
    (L @ mass_matrix(model)) @ np.ones(3)
    assert len(edits) == 5 and body.mass == before
    body.mass = 3.0
    assert body.mass == 3.0


def longest_pause(work):
    """The longest time that another thread waits for the GIL while `work` runs."""
    thread = threading.Thread(target=work)
    thread.start()
    longest, last = 0.0, time.perf_counter()
    while thread.is_alive():
        time.sleep(0.001)
        now = time.perf_counter()
        longest, last = max(longest, now - last), now
    return longest


def test_the_gil_is_released():
    model = pc.chain(1500, seed=1)
    zero = np.zeros(1500)
    MM = mass_matrix(model)
    for work in (
        lambda: model.refinement(zero, zero, zero + 1, refine=1, precision=100),
        lambda: MM.at(zero, precision=100) @ zero,
        lambda: MM.inv().plan("dense"),
    ):
        start = time.perf_counter()
        pause = longest_pause(work)
        assert pause < 0.5 * (time.perf_counter() - start) + 0.1


def run(script, timeout=120):
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=timeout)


COMMON = """
import os, sys, threading, time
import numpy as np
import pycraft as pc
model = pc.chain(30, seed=1)
H, phi, M, D, I = model.soa("H phi M D I")
MM = H @ phi @ M @ phi.T @ H.T
x, Q = np.ones(30), np.zeros((20, 30))
e = (MM + 0.1 * I).inv()
def work():
    while True:
        try:
            e.at(Q) @ x
            e.at(Q, threads=2) @ x
            (2 * e) @ x
            model.q = model.q + 1e-9
            model.forward_dynamics(Q, Q, Q)
            model.forward_dynamics(x, x, x, precision=100)
        except pc.EvaluationError as error:
            if "about to end" not in str(error):
                raise
threads = [threading.Thread(target=work, daemon=True) for _ in range(3)]
for t in threads:
    t.start()
time.sleep(0.05)
"""

FORKS = (
    COMMON
    + """
for i in range({forks}):
    child = os.fork()
    if child == 0:
        for _ in range(3):
            e @ x
            e.at(Q, threads=2) @ x
            (3 * MM).inv() @ x
            model.q = model.q + 1e-6
            model.forward_dynamics(Q, Q, Q)
            model.forward_dynamics(x, x, x, precision=100)
        model.gravity = (0, 0, -1)
        os._exit(7)
    end = time.time() + 20
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        if time.time() > end:
            os.kill(child, 9)
            print("child", i, "hangs")
            os._exit(1)
        time.sleep(0.002)
    if os.waitstatus_to_exitcode(status) != 7:
        print("child", i, "ends with", os.waitstatus_to_exitcode(status))
        os._exit(1)
    time.sleep(0.003)
os._exit(0)
"""
)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing forks here")
@pytest.mark.parametrize("forks", [10, pytest.param(100, marks=pytest.mark.slow)])
def test_forks_while_threads_evaluate(forks):
    """The child evaluates the same expressions, sets the state and edits the model, whatever the others were doing."""
    result = run(FORKS.replace("{forks}", str(forks)))
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize("times", [2, pytest.param(15, marks=pytest.mark.slow)])
def test_daemon_threads_when_the_interpreter_ends(times):
    for _ in range(times):
        result = run(COMMON, 60)
        assert result.returncode == 0, result.stderr
        assert "Fatal" not in result.stderr and "terminate" not in result.stderr
