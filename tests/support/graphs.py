"""Graphs (pycraft/compiled/graph.py): written by arithmetic, and evaluated by NumPy, states side by side, with no compiler."""

import operator

import numpy as np

from pycraft.compiled.graph import LARGEST

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
    "fraction": lambda x: np.frexp(x)[0],
    "exponent": lambda x: np.frexp(x)[1].astype(float),
}


class Node:
    """A node of a graph with operators of Python."""

    def __init__(self, graph, index):
        self.graph, self.index = graph, index

    @property
    def value(self):
        return self.graph.constant_of(self.index)

    def put(self, name, *others):
        return Node(self.graph, self.graph.put(name, self.index, *(self.of(x).index for x in others)))

    def of(self, x):
        return x if isinstance(x, Node) else Node(self.graph, self.graph.number(x))

    def __add__(self, x):
        return self.put("add", x)

    def __sub__(self, x):
        return self.put("subtract", x)

    def __mul__(self, x):
        return self.put("multiply", x)

    def __truediv__(self, x):
        return self.put("divide", x)

    def __radd__(self, x):
        return self.of(x) + self

    def __rsub__(self, x):
        return self.of(x) - self

    def __rmul__(self, x):
        return self.of(x) * self

    def __rtruediv__(self, x):
        return self.of(x) / self

    def __neg__(self):
        return self.put("negate")

    def __abs__(self):
        return self.put("magnitude")


def inputs(graph, array, count):
    """Return the first entries of an input as nodes."""
    return [Node(graph, graph.input(array, i)) for i in range(count)]


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
    """Results (B, ...) and which states hold all guards and checks."""
    found = values(graph, inputs)
    states = len(next(iter(inputs.values())))
    out = np.empty((states, *results.shape))
    for place, node in np.ndenumerate(results):
        out[(slice(None), *place)] = found[node]
    sound = np.full(states, True)
    for node in graph.guards:
        sound &= np.asarray(found[node], bool)
    for node in graph.checked(results.ravel().tolist()):
        sound &= np.abs(found[node]) < LARGEST
    return out, sound
