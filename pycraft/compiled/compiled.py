"""Functions compiled for one model: `arm.compile("forward_dynamics")` and `expression.compile()`."""

from __future__ import annotations

import copy
import copyreg
import pickle
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..arguments import text
from ..models.multibody import describe
from .build import built
from .expressions import ExpressionGraph
from .graph import Graph
from .kernels import INPUTS, ON_LOOPS, frame_graph, kernel_graph, loops_graph
from .source import FUNCTION, written

MOST_OPERATIONS, MOST_RESULTS = 100_000, 20_000
"""Limits beyond which a compiler takes minutes for straight-line code, and the results of a state overflow the stack."""

_OF_FRAMES = ("jacobian", "pose")


class Compiled:
    """A compiled function and its description. The ordinary call replaces it for other kinds of arguments and for doubtful states.

    Attributes
    ----------
    name : name of the result
    arguments : names of its arrays, each for one state or with a leading batch axis
    shape : shape of the result for one state
    source : the compiled C++, self-contained
    library : path of the built library
    operations : operations per state: sums, products, quotients; a sine counts as one
    """

    _again: Callable[[], tuple[Any, ...]]

    def __init__(self, name: str, graph: Graph, results: np.ndarray, arguments: Sequence[tuple[str, int]], ordinary: Callable[..., Any]):
        size = len(graph.needed(results.ravel().tolist()))
        if size > MOST_OPERATIONS or results.size > MOST_RESULTS:
            raise _core.EvaluationError(
                f"{name} needs {size} operations and {results.size} results in straight-line code; compile() allows {MOST_OPERATIONS} "
                f"and {MOST_RESULTS}. The ordinary call, prepare() and at(q) take models of any size"
            )
        self.name, self.arguments, self.shape = name, tuple(a for a, _ in arguments), results.shape
        title = f"{name}: {', '.join(f'{a} ({n})' for a, n in arguments) or 'no input'} -> {results.shape}"
        self.source, self.operations = written(graph, results, arguments, title)
        self.library: Path = built(self.source)
        self._ordinary = ordinary
        self.__doc__ = f"{name}({', '.join(self.arguments)}, *, out=None), compiled; one state, or a leading batch axis."

    def __call__(self, *given: Any, out: Any = None) -> Any:
        """Evaluate by the ordinary call, whose errors name the cause."""
        if len(given) != len(self.arguments):
            raise TypeError(f"compiled {self.name} takes {', '.join(self.arguments) or 'no arrays'}, and out=; got {len(given)} arguments")
        return self._ordinary(*given, out=out)

    def __reduce__(self):
        return self._again()

    def __repr__(self) -> str:
        return f"<compiled {self.name}({', '.join(self.arguments)}), {self.operations} operations>"


def _callable(behind: Compiled, arguments: Sequence[tuple[str, int]], again: Callable[[], tuple[Any, ...]]) -> Any:
    """Return the callable. `again` is the function and arguments used to copy and pickle it; a cached library is loaded, not rebuilt."""
    behind._again = again
    if 0 in behind.shape:
        return behind  # nothing to compute
    made = _core.compiled_call(behind, str(behind.library), FUNCTION, [n for _, n in arguments], list(behind.shape), behind.operations)
    copyreg.pickle(type(made), _told)
    return made


def _told(call: Any) -> Any:
    return call._again()


def compile_call(model: Any, call: str, frame: str | None = None) -> Any:
    """Return a compiled direct call (`Multibody.compile`)."""
    known = (*INPUTS, ON_LOOPS, *_OF_FRAMES)
    if not isinstance(call, str) or call not in known:
        raise _core.EvaluationError(f"compile takes {', '.join(map(repr, known))}, not {call!r}")
    if (frame is not None) != (call in _OF_FRAMES):
        raise _core.EvaluationError(f"{call} needs a frame: compile({call!r}, frame=...)" if frame is None else f"{call} takes no frame")
    held = copy.deepcopy(model)  # later edits change neither the compiled code nor its replacement
    if call == ON_LOOPS:
        graph, results = loops_graph(held, 4 * MOST_OPERATIONS)  # operations that no result needs are recorded as well
        ordinary, name = partial(_on_loops, held), call
    elif frame is None:
        graph, results = kernel_graph(held, call)
        ordinary, name = getattr(held, call), call
    else:
        frame = text(frame, "a frame")
        held.pose(frame)  # ModelError where no body or node has the name
        graph, results = frame_graph(held, call, frame, 4 * MOST_OPERATIONS)
        ordinary, name = partial(_of_frame, held, call, frame), f"{call} of {frame}"
    inputs = INPUTS["forward_dynamics"] if call == ON_LOOPS else INPUTS.get(call, ("q",))
    arguments = [(a, held.nq if a == "q" else held.nv) for a in inputs]
    return _callable(
        Compiled(f"{held.name}: {name}", graph, results, arguments, ordinary), arguments, lambda: (compile_call, (held, call, frame))
    )


def _on_loops(model: Any, q: Any, v: Any, tau: Any, out: Any = None) -> Any:
    """Evaluate by the ordinary call, whose errors name the cause."""
    vdot = model.constrained_dynamics(q, v, tau).vdot
    if out is None:
        return vdot
    _check_out(out, vdot.shape)
    out[...] = vdot
    return out


def _of_frame(model: Any, call: str, frame: str, q: Any, out: Any = None) -> Any:
    if call == "jacobian" or out is None:
        return getattr(model, call)(frame, q, **({} if out is None else {"out": out}))
    return model.prepare(call, frame=frame, batch=len(q) if np.ndim(q) == 2 else None)(q, out=out)


def compile_expression(expression: Any, request: str = "apply") -> Any:
    """Return a compiled expression (`Operator.compile` and `Scalar.compile`)."""
    made = ExpressionGraph(expression, request, 4 * MOST_OPERATIONS)
    numbers = _numbers_of(made.model)
    ordinary = partial(_evaluated, expression, request, made, numbers)

    def again() -> tuple[Any, ...]:
        _check_edits(expression, made, numbers)
        return compile_expression, (expression, request)

    name = expression.text() if request == "apply" else f"{request} of {expression.text()}"
    return _callable(Compiled(name, made.graph, made.results, made.arguments, ordinary), made.arguments, again)


def _numbers_of(model: Any) -> bytes:
    """Return the values that an edit changes."""
    return b"" if model is None else pickle.dumps({k: v for k, v in describe(model).items() if k not in ("q", "v")})


def _check_edits(expression: Any, made: ExpressionGraph, numbers: bytes) -> None:
    if made.model is not None and _numbers_of(made.model) != numbers:
        raise _core.EvaluationError(f"{made.model.name!r} was edited after {expression.text()} was compiled: compile it again")


def _evaluated(expression: Any, request: str, made: ExpressionGraph, numbers: bytes, *given: Any, out: Any = None) -> Any:
    """Evaluate the expression by its plan, state after state."""
    _check_edits(expression, made, numbers)
    names, shape = [name for name, _ in made.arguments], made.results.shape
    arrays = dict(zip(names, (np.asarray(a, float) for a in given), strict=True))
    batches = {len(a) for a in arrays.values() if a.ndim == 2}
    if len(batches) > 1 or any(a.ndim not in (1, 2) for a in arrays.values()):
        shapes = ", ".join(f"{name} {a.shape}" for name, a in arrays.items())
        raise _core.ModelError(f"each argument needs one state, or as many as the others; got {shapes}")
    count = batches.pop() if batches else None
    result = np.empty(shape if count is None else (count, *shape))
    for b in range(1 if count is None else count):
        state = {name: a[b] if a.ndim == 2 else a for name, a in arrays.items()}
        q, v = (state.pop(name, None) if made.model is not None else None for name in "qv")
        vectors = {name: state.pop(name) for name in made.vectors}
        bound = expression if q is None else expression.at(q, v) if v is not None else expression.at(q)
        x = next(iter(state.values()), None)
        result[... if count is None else b] = bound.value(**vectors) if vectors else _requested(bound, request, x)
    if out is None:
        return result
    _check_out(out, result.shape)
    out[...] = result
    return out


def _check_out(out: Any, shape: tuple[int, ...]) -> None:
    if not isinstance(out, np.ndarray) or out.shape != shape or out.dtype != float or not out.flags.writeable:
        raise _core.ModelError(f"out= must be a writeable float64 array of shape {shape}")


def _requested(bound: Any, request: str, x: np.ndarray | None) -> Any:
    if isinstance(bound, _core.Scalar):
        return float(bound)
    if request == "apply":
        return bound @ x if x is not None else bound.dense().ravel()
    value = getattr(bound, request)()
    return float(value) if request in ("trace", "logdet", "norm") else value
