"""Direct calls as straight-line code: what their kernels do for one model (cpp/kernels/taped_calls.h), with its numbers folded in."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from .trace import Graph

INPUTS = {
    "forward_dynamics": ("q", "v", "tau"),
    "inverse_dynamics": ("q", "v", "vdot"),
    "bias_forces": ("q", "v"),
    "mass_matrix": ("q",),
    "mass_matrix_inverse": ("q",),
}


def kernel_graph(model: Any, call: str) -> tuple[Graph, np.ndarray]:
    """The graph of a direct call, and the nodes of its result. ModelError where no kernel knows the model's hinges."""
    tape = _core.kernel_tape(model, call)
    if tape is None:
        raise _core.ModelError(
            f"{call} of {model.name!r} cannot be compiled: no kernel knows a rotor on a ball or free hinge, nor some sliders behind "
            "other subhinges; its expressions can be"
        )
    graph, third = Graph(), INPUTS[call][-1]
    does, first, second, number, results, sound = tape
    made: list[int] = []
    truths: dict[int, list[int]] = {}
    for at, (what, a, b, x) in enumerate(zip(does, first.tolist(), second.tolist(), number.tolist(), strict=True)):
        node = -1
        match what:
            case "number":
                node = graph.number(x).index
            case "q" | "v" | "u":
                node = graph.input(third if what == "u" else what, a).index
            case "greater":
                truths[at] = [graph.put("greater", made[a], made[b])]
            case "both":
                truths[at] = truths[a] + truths[b]
            case "negate" | "sine" | "cosine" | "magnitude":
                node = graph.put(what, made[a])
            case _:
                node = graph.put(what, made[a], made[b])
        made.append(node)
    if sound >= 0:
        graph.guards = list(dict.fromkeys(truths[sound]))
    shape = (model.nv, model.nv) if call in ("mass_matrix", "mass_matrix_inverse") else (model.nv,)
    return graph, np.array([made[r] for r in results], int).reshape(shape)
