"""Direct calls as straight-line code: what their kernels do for one model (cpp/kernels/tape.h), with its numbers folded in."""

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
_PLAIN = {4: "add", 5: "subtract", 6: "multiply", 7: "divide", 8: "negate", 9: "sine", 10: "cosine", 11: "magnitude", 12: "larger"}


def kernel_graph(model: Any, call: str) -> tuple[Graph, np.ndarray]:
    """The graph of a direct call, and the nodes of its result. ModelError where no kernel knows the model's hinges."""
    tape = _core.kernel_tape(model, call)
    if tape is None:
        raise _core.ModelError(
            f"{call} of {model.name!r} cannot be compiled: no kernel knows a rotor on a ball or free hinge, nor sliders behind other subhinges"
        )
    graph, third = Graph(), INPUTS[call][-1]
    does, first, second, number, results, sound = tape
    made: list[int] = []
    truths: dict[int, list[int]] = {}
    for at, (what, a, b, x) in enumerate(zip(does.tolist(), first.tolist(), second.tolist(), number.tolist(), strict=True)):
        node = -1
        match what:
            case 0:
                node = graph.number(x).index
            case 1 | 2 | 3:
                node = graph.input(("q", "v", third)[what - 1], a).index
            case 8 | 9 | 10 | 11:
                node = graph.put(_PLAIN[what], made[a])
            case 13:
                truths[at] = [graph.put("greater", made[a], made[b])]
            case 14:
                truths[at] = truths[a] + truths[b]
            case _:
                node = graph.put(_PLAIN[what], made[a], made[b])
        made.append(node)
    if sound >= 0:
        graph.guards = list(dict.fromkeys(truths[sound]))
    shape = (model.nv, model.nv) if call in ("mass_matrix", "mass_matrix_inverse") else (model.nv,)
    return graph, np.array([made[r] for r in results], int).reshape(shape)
