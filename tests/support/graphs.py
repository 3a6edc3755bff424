"""Graphs of traced numbers (pycraft/compiled/trace.py) evaluated by NumPy, states side by side, with no compiler."""

import operator

import numpy as np

FUNCTIONS = {
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": operator.truediv,
    "negate": operator.neg,
    "sine": np.sin,
    "cosine": np.cos,
    "sqrt": np.sqrt,
    "log": np.log,
    "magnitude": np.abs,
    "larger": np.maximum,
    "greater": operator.gt,
    "at_least": operator.ge,
    "choose": np.where,
}


def values(graph, inputs):
    """Return the value of every node, at inputs {name: (B, n)}; constants are scalars. Inputs that no result reads may be omitted."""
    found = []
    with np.errstate(all="ignore"):
        for name, *taken in graph.operations:
            match name:
                case "constant":
                    found.append(np.float64(taken[0]))
                case "input":
                    found.append(inputs[taken[0]][..., taken[1]] if taken[0] in inputs else np.nan)
                case _:
                    found.append(FUNCTIONS[name](*(found[x] for x in taken)))
    return found


def evaluated(graph, results, inputs):
    """Results (B, ...) and which states hold all guards."""
    found = values(graph, inputs)
    states = len(next(iter(inputs.values())))
    out = np.empty((states, *results.shape))
    for place, node in np.ndenumerate(results):
        out[(slice(None), *place)] = found[node]
    sound = np.full(states, True)
    for node in graph.guards:
        sound &= np.asarray(found[node], bool)
    return out, sound
