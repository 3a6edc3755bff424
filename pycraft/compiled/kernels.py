"""Direct calls as straight-line code: the operations of their kernels for one model (cpp/kernels/taped_calls.h), with constants folded, and
of dynamics on loops (cpp/dynamics/recorded_on_loops.h)."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from .trace import Graph

BESIDE = 0.1
"""Displacement, radians and metres, from the model's own state to the state at which dynamics on loops is recorded."""

ON_LOOPS = "constrained_dynamics"
"""The only call without a kernel; it takes the inputs of forward dynamics."""
INPUTS = {
    "forward_dynamics": ("q", "v", "tau"),
    "inverse_dynamics": ("q", "v", "vdot"),
    "bias_forces": ("q", "v"),
    "mass_matrix": ("q",),
    "mass_matrix_inverse": ("q",),
}


def kernel_graph(model: Any, call: str) -> tuple[Graph, np.ndarray]:
    """Return the graph of a direct call, and the nodes of its result. Raises ModelError if no kernel supports the model's hinges."""
    tape = _core.kernel_tape(model, call)
    if tape is None:
        raise _core.ModelError(
            f"{call} of {model.name!r} cannot be compiled: kernels do not support rotors on ball or free hinges, nor some sliders after "
            "other subhinges; compile an expression of the model instead"
        )
    graph, results = _graph_of(tape, INPUTS[call][-1])
    shape = (model.nv, model.nv) if call in ("mass_matrix", "mass_matrix_inverse") else (model.nv,)
    return graph, results.reshape(shape)


def loops_graph(model: Any, most: int) -> tuple[Graph, np.ndarray]:
    """Return the graph of accelerations on loops, and the nodes of its result, recorded near the model's own state.

    The state is displaced a little, because branches at special states differ from all others. Raises ModelError if `most` operations are
    too few, or if the loops cannot be compiled or assembled.
    """
    generator = np.random.default_rng(0)
    beside = model.integrate(model.q, generator.uniform(-BESIDE, BESIDE, model.nv))
    state = model.assemble(beside, generator.uniform(-1, 1, model.nv))
    tape = model.loops._core.tape(state.q, state.v, generator.uniform(-1, 1, model.nv), most)
    return _graph_of(tape, "tau")


def _graph_of(tape: Any, third: str) -> tuple[Graph, np.ndarray]:
    """Return a tape (cpp/bindings/tapes.h) as a graph; `third` is the name of its third array."""
    graph = Graph()
    does, taken, number, results, guards = tape
    made: list[int] = []
    truths: dict[int, list[int]] = {}
    for at, (what, (a, b, c), x) in enumerate(zip(does, taken.tolist(), number.tolist(), strict=True)):
        node = -1
        match what:
            case "number":
                node = graph.number(x).index
            case "q" | "v" | "u":
                node = graph.input(third if what == "u" else what, a).index
            case "both":
                truths[at] = truths[a] + truths[b]
            case "equal":
                pass  # a comparison of a guard
            case "root" | "logarithm":
                node = graph.put("sqrt" if what == "root" else "log", made[a])
            case "negate" | "sine" | "cosine" | "magnitude":
                node = graph.put(what, made[a])
            case "fused":
                node = graph.put("add", graph.put("multiply", made[a], made[b]), made[c])
            case "choose":
                node = graph.put("choose", made[a], made[b], made[c])
            case _:
                node = graph.put(what, made[a], made[b])
        if what in ("greater", "at_least"):
            truths[at] = [node]
        made.append(node)
    for truth, holds in guards:
        a, b = (made[i] for i in taken[truth][:2].tolist())
        graph.guards += truths[truth] if holds and truth in truths else _instead(graph, does[truth], a, b, holds)
    graph.guards = list(dict.fromkeys(graph.guards))
    return graph, np.array([made[r] for r in results], int)


def _instead(graph: Graph, what: str, a: int, b: int, holds: bool) -> list[int]:
    """Add guards that hold where a comparison fails, or where an equality holds."""
    match what, holds:
        case "greater", False:
            return [graph.put("at_least", b, a)]
        case "at_least", False:
            return [graph.put("greater", b, a)]
        case "equal", True:
            return [graph.put("at_least", a, b), graph.put("at_least", b, a)]
        case "equal", False:
            return [graph.put("greater", graph.put("magnitude", graph.put("subtract", a, b)), graph.zero)]
    raise _core.EvaluationError(f"unknown kind of guard {what!r}")  # no tape contains one
