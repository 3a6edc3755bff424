"""One state of a large tree: its subtrees in threads, with the bits of one thread."""

import numpy as np
import pytest

import pycraft as pc

KINDS = ["pin", "slider", "ball", "screw", "universal", "pin", "pin", "free", "weld", "cylindrical"]


def star(arms, length, stem=0):
    """Arms of so many links on a stem, or on the base."""
    parents = list(range(-1, stem - 1))
    for _ in range(arms):
        parents += [stem - 1, *range(len(parents), len(parents) + length - 1)]
    return parents


def comb(teeth, length):
    """A spine, each link of which carries a tooth; the first child of a link is now the tooth, now the spine."""
    parents, spine = [], -1
    for i in range(teeth):
        parents.append(spine)
        spine = len(parents) - 1
        if i % 2:
            parents += [spine, *range(len(parents), len(parents) + length - 1)]
        else:
            parents += [spine, *range(len(parents), len(parents) + length - 1)][: length // 2]
    return parents


def binary(depth):
    return [-1, *((k - 1) // 2 for k in range(1, 2**depth - 1))]


TREES = {
    "arms on the base": star(3, 700),
    "arms on one body": star(4, 600, stem=1),
    "arms on a long stem": star(2, 900, stem=40),
    "a comb": comb(6, 650),
    "a binary tree": binary(12),
    "arms and small things": [*star(2, 800, stem=3), *[2] * 50, *[-1] * 5],
}


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("pins", [True, False], ids=["pins", "every kind"])
def test_the_bits_of_one_thread(name, pins):
    parents = TREES[name]
    model = pc.tree(parents, ["pin"] * len(parents) if pins else [KINDS[k % len(KINDS)] for k in range(len(parents))], seed=3)
    model.gravity = (0.3, 0.2, -9.8)
    state = model.random_state(1)
    tau = np.random.default_rng(2).normal(size=model.nv)
    for call, third in ((model.forward_dynamics, tau), (model.inverse_dynamics, tau)):
        for threads in (2, 5):
            np.testing.assert_array_equal(call(state.q, state.v, third, threads=threads), call(state.q, state.v, third))
    np.testing.assert_array_equal(model.bias_forces(state.q, state.v, threads=3), model.bias_forces(state.q, state.v))


def test_errors_are_those_of_one_thread():
    parents = star(3, 600)
    model = pc.tree(parents, ["pin"] * len(parents), seed=1)
    model.bodies["body1799"].mass, model.bodies["body1799"].inertia = 0.0, np.zeros((3, 3))
    state, zero = model.random_state(0), np.zeros(model.nv)
    messages = []
    for threads in (1, 4):
        with pytest.raises(pc.SingularHingeError, match="'hinge1799'") as error:
            model.forward_dynamics(state.q, state.v, zero, threads=threads)
        messages.append(str(error.value))
    assert messages[0] == messages[1]
    with pytest.raises(pc.ModelError, match="entry 0 is nan"):
        model.inverse_dynamics(state.q, state.v * np.nan, zero, threads=2)


def test_doubt_is_decided_in_parts():
    """Chains that the estimate of pivots leaves in doubt, on one stem."""
    parents = star(2, 3000, stem=2)
    model = pc.tree(parents, ["pin"] * len(parents), seed=5)
    state, tau = model.random_state(0), np.zeros(model.nv)
    np.testing.assert_array_equal(model.forward_dynamics(state.q, state.v, tau, threads=3), model.forward_dynamics(state.q, state.v, tau))
