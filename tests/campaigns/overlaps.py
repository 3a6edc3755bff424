"""Results written into the memory of their arguments: every direct call that takes out=, every way of overlapping.

`python tests/campaigns/overlaps.py --seeds 2000`. The oracle is the same call on copies, with a result of its own: equal bit for bit.
A round draws a model, a call with its options, one state or a batch (arguments of one state beside it), and places the result and some
of the arguments anywhere in one buffer, so that they are the same memory, shifted, inside each other, side by side or apart.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import pycraft as pc
from campaigns.command_line import listed, seeds
from support.mechanisms import random_tree

FORWARD = [
    {},
    {"refine": 1},
    {"refine": "auto"},
    {"form": "ud"},
    {"form": "ud", "refine": 2},
    {"form": "square-root", "refine": 1},
    {"refine": 1, "residual": "wider"},
    {"precision": "single"},
    {"precision": "extended", "refine": 1},
    {"precision": "quad"},
    {"on_singular": "minimum-norm"},
    {"method": "cholesky"},
    {"method": "ldl"},
    {"method": "conjugate-gradients"},
    {"method": "inverse"},
    {"method": "divide-and-conquer"},
    {"method": "realization"},
]
SOLVED = [o for o in FORWARD if "method" not in o]
PRECISIONS = [{}, {"precision": "single"}, {"precision": "quad"}]
Q, V, NONE = "q", "v", ()

# Call: its arguments (q or v shaped), the shape of a result by (nq, nv), its options.
CALLS = {
    "forward_dynamics": ((Q, V, V), lambda nq, nv: (nv,), FORWARD),
    "inverse_dynamics": ((Q, V, V), lambda nq, nv: (nv,), PRECISIONS),
    "bias_forces": ((Q, V), lambda nq, nv: (nv,), PRECISIONS),
    "mass_matrix": ((Q,), lambda nq, nv: (nv, nv), PRECISIONS),
    "mass_matrix_inverse": ((Q,), lambda nq, nv: (nv, nv), SOLVED),
    "mass_matrix_derivative": ((Q,), lambda nq, nv: (nv, nv, nv), PRECISIONS),
    "christoffel": ((Q,), lambda nq, nv: (nv, nv, nv), PRECISIONS),
    "coriolis_matrix": ((Q, V), lambda nq, nv: (nv, nv), [*PRECISIONS, {"form": "skew"}]),
    "operational_space_compliance": ((Q,), lambda nq, nv: (6, 6), PRECISIONS),
    "jacobian": ((Q,), lambda nq, nv: (6, nv), PRECISIONS),
    "configuration_rate": ((Q, V), lambda nq, nv: (nq,), PRECISIONS),
}


def models(rng):
    """A few models with as many coordinates as packs and batches make interesting."""
    return [pc.chain(3), *(random_tree(rng, int(rng.integers(2, 6)), kinds=["pin", "slider", "ball", "free", "gimbal"]) for _ in range(3))]


def one_round(rng, model, name):
    """None, or what is wrong with a call on overlapping memory."""
    arguments, shape_of, options = CALLS[name]
    option = options[int(rng.integers(len(options)))]
    nq, nv = model.nq, model.nv
    batch = int(rng.choice([0, 0, 1, 2, 7, 9, 16]))
    shape = ((batch,) if batch else ()) + shape_of(nq, nv)
    size = int(np.prod(shape))
    buffer = np.zeros(3 * size + 4 * max(batch, 1) * (nq + nv) + 8)
    start = int(rng.integers(0, len(buffer) - size + 1)) if rng.random() < 0.7 else 0
    given, placed = [], []
    for kind in arguments:
        shared = batch and rng.random() < 0.3  # one state stands for all
        count = 1 if shared or not batch else batch
        states = [model.random_state(rng) for _ in range(count)]
        values = np.array([getattr(s, kind) for s in states]).reshape(-1)
        if rng.random() < 0.75:
            first = start + int(rng.choice([0, 0, 1, -1, nv, -nv, int(rng.integers(-size, size + 1))]))
            first = min(max(first, 0), len(buffer) - values.size)
            buffer[first : first + values.size] = values
            values = buffer[first : first + values.size]
        view = values.reshape((count, -1) if batch and not shared else -1)
        if rng.random() < 0.15:
            view = view[::-1]  # not contiguous: backwards, states or numbers
        given.append(view)
        placed.append(view)
    if batch and all(x.ndim == 1 for x in given):
        return None  # no batch after all
    frame = ("body0",) if name in ("jacobian", "operational_space_compliance") else ()

    def call(arrays, out):
        return getattr(model, name)(*frame, *arrays, **option, out=out)

    try:
        expected = call([x.copy() for x in given], None)
    except pc.Error as error:
        expected = error
    out = buffer[start : start + size].reshape(shape)
    try:
        found = call(given, out)
    except pc.Error as error:
        return None if type(error) is type(expected) else f"{name} {option} {shape}: {error!r} for {expected!r}"
    if isinstance(expected, Exception):
        return f"{name} {option} {shape}: a result for {expected!r}"
    if not np.array_equal(out, expected, equal_nan=True) or not np.shares_memory(found, out):
        return f"{name} {option} {shape}: off by {np.abs(out - expected).max():.1e}"
    return None


def run(seeds, rounds=36):
    """Return the errors, one line each."""
    wrong = []
    for seed in seeds:
        rng = np.random.default_rng(seed)
        several = models(rng)
        for i in range(rounds):
            name = list(CALLS)[i % len(CALLS)]
            text = one_round(rng, several[int(rng.integers(len(several)))], name)
            if text:
                wrong.append(f"seed {seed}: {text}")
    return wrong


if __name__ == "__main__":
    sys.exit(listed(run(seeds(__doc__, 200, first=False))))
