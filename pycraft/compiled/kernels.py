"""Direct calls as straight-line code: what their kernels do for one model (cpp/kernels/taped_calls.h), with its numbers folded in, and what
dynamics on loops does at a state on them (cpp/dynamics/recorded_on_loops.h)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from .. import _core
from ..state import State
from .graph import Graph
from .tapes import graph_of

BESIDE = 0.1
"""How far, in radians and metres, the state at which dynamics on loops is written down is moved from the model's own."""

ON_LOOPS = "constrained_dynamics"
"""The call whose tape is written by no kernel, of the inputs of forward dynamics."""
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
    graph, results = graph_of(tape, ["q", "v", INPUTS[call][-1]])
    shape = (model.nv, model.nv) if call in ("mass_matrix", "mass_matrix_inverse") else (model.nv,)
    return graph, results.reshape(shape)


def frame_graph(model: Any, call: str, frame: str, most: int) -> tuple[Graph, np.ndarray]:
    """The graph of "pose" or "jacobian" of a frame that the model has, and the nodes of its result.

    EvaluationError where `most` operations are not enough.
    """
    graph, results = graph_of(_core.frame_tape(model, call, frame, most), ["q"])
    return graph, results.reshape((4, 4) if call == "pose" else (6, model.nv))


def states_to_record(model: Any, on_loops: bool) -> Iterator[Any]:
    """Yield states to record at: near the model's own, then others; special states decide as no others do."""
    rng = np.random.default_rng(0)
    starts = [State(model.integrate(model.q, rng.uniform(-BESIDE, BESIDE, model.nv)), rng.uniform(-1, 1, model.nv))]
    for start in (*starts, *(model.random_state(k) for k in (1, 2))):
        yield model.assemble(start.q, start.v) if on_loops else start


def loops_graph(model: Any, most: int) -> tuple[Graph, np.ndarray]:
    """The graph of accelerations on loops, and the nodes of its result, as they are decided beside the model's own state.

    EvaluationError where `most` operations are not enough; ModelError where the loops have what cannot be compiled, or cannot be assembled.
    """
    state = next(states_to_record(model, on_loops=True))
    return graph_of(model.loops._core.tape(state.q, state.v, np.random.default_rng(1).uniform(-1, 1, model.nv), most), ["q", "v", "tau"])
