"""Expressions as straight-line code: the tape of the core's own run of the plan (cpp/algebra/engine/taped_plan.h).

Decisions by value become guards: where a guard fails, the expression is evaluated in the ordinary way.
"""

from __future__ import annotations

from typing import Any

from .. import _core
from .graph import INPUT
from .kernels import states_to_record
from .tapes import graph_of

REQUESTS = ("apply", "dense", "diagonal", "trace", "logdet", "norm")


class ExpressionGraph:
    """The graph of a request of an expression, of at most `most` operations.

    Attributes
    ----------
    graph, results : the nodes of the result, in its shape
    arguments : names and widths of the inputs: q and v of the model whose state is free, x, named vectors
    model : the model whose state is free; None where everything is bound
    on_loops : True where letters have values on the loops of the model alone
    vectors : the names of named vectors
    """

    def __init__(self, expression: Any, request: str, most: int):
        if request not in REQUESTS:
            raise _core.EvaluationError(f"compile() makes {', '.join(map(repr, REQUESTS))}, not {request!r}")
        scalar = isinstance(expression, _core.Scalar)
        operands = expression.operands() if scalar else [expression]
        _check_unbatched(expression, operands)
        sources = _core.unbound_sources(operands)
        self.model = _model_of(sources)
        self.on_loops = any((source.derived_from or ("",))[0] == "embedded loops" for source in sources)
        tape, arrays, rows, columns = self._recorded(expression, request, most)
        self.graph, results = graph_of(tape, [_argument(what, name) for what, name, _ in arrays])
        self.results = results.reshape(self._shape(expression, request, rows, columns))
        operations = self.graph.operations
        read = {operations[node][1] for node in self.graph.needed(results.tolist()) if operations[node][0] == INPUT}
        self.vectors = [name for what, name, _ in arrays if what == "vector"]
        self.arguments: list[tuple[str, int]] = []
        if self.model is not None:
            self.arguments = [("q", self.model.nq), *([("v", self.model.nv)] if "v" in read else [])]
        if not scalar and request == "apply" and not _is_vector(expression):
            self.arguments.append(("x", expression.shape[1]))
        self.arguments += [(name, width) for what, name, width in arrays if what == "vector"]
        names = [name for name, _ in self.arguments]
        for name in names:
            if names.count(name) > 1 or (name in self.vectors and name in ("q", "v", "x")):
                raise _core.EvaluationError(f"a vector called {name!r} has the name of another argument of what compile() makes; rename it")

    def _recorded(self, expression: Any, request: str, most: int) -> Any:
        """Return the tape recorded near the model's own state, or at another where no tape can be recorded there."""
        if self.model is None:
            return _tape(expression, request, most)
        refusal: Exception
        for state in states_to_record(self.model, self.on_loops):
            try:
                return _tape(expression.at(state.q[None], state.v[None]), request, most)
            except _core.Error as error:
                refusal = error
        raise refusal

    @staticmethod
    def _shape(expression: Any, request: str, rows: int, columns: int) -> tuple[int, ...]:
        if isinstance(expression, _core.Scalar) or request in ("trace", "logdet", "norm"):
            return ()
        return (rows, columns) if request == "dense" else (rows,)


def _check_unbatched(expression: Any, operands: list[Any]) -> None:
    for operand in operands:
        if operand.batch is not None:
            raise _core.EvaluationError(
                f"compile() takes an expression that is free, or bound to one state; {expression.text()} is bound to a batch, q of shape "
                f"({operand.batch}, nq). Compile it before at(q), and call the compiled function with the batch"
            )


def _tape(bound: Any, request: str, most: int) -> Any:
    return _core.scalar_tape(bound, most) if isinstance(bound, _core.Scalar) else bound.plan(request).tape(most)


def _argument(what: str, name: str) -> str:
    return name if what == "vector" else what


def _is_vector(expression: Any) -> bool:
    return expression.domain == _core.euclidean(1)


def _model_of(sources: list[Any]) -> Any:
    """Return the model of the sources, None where no source moves. EvaluationError where there are two."""
    models: list[Any] = []
    for model in (source.model for source in sources):
        if model is not None and not any(model is known for known in models):
            models.append(model)
    if len(models) > 1:
        raise _core.EvaluationError("compile() takes expressions of one model; bind the others by at(q)")
    return models[0] if models else None
