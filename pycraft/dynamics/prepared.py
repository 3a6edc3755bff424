"""Direct calls for loops: options are read once, and calls take only arrays."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

from .. import _core
from ..arguments import chosen, text
from .by_realization import output
from .hybrid import HYBRID_OPTIONS, PreparedHybrid
from .prepared_states import refuse_other_states, states_of

F = TypeVar("F", bound=Callable[..., Any])

_CALLS = _core.direct_calls()
_MADE: dict[str, type] = {}
"""Named tuple of the results, by name of a call with three results."""


def direct(function: F) -> F:
    """Mark the method of a direct call: contiguous float64 arrays go from CPython to the core, everything else through the method."""
    return _core.direct_call(function)


def direct_of(made: type) -> Callable[[F], F]:
    """Mark a call with three results, returned as this named tuple."""

    def mark(function: F) -> F:
        _MADE[function.__name__] = made
        return _core.direct_call(function, made)

    return mark


def prepared(model: Any, call: str, batch: int | None, options: dict[str, Any]) -> Callable[..., Any]:
    """Implement `Multibody.prepare`."""
    if not isinstance(call, str) or call not in (*_CALLS, "hybrid_dynamics"):
        raise _core.EvaluationError(f"prepare takes {', '.join(map(repr, _CALLS))}, 'hybrid_dynamics', not {call!r}")
    arrays, known = _CALLS.get(call, ((), HYBRID_OPTIONS))
    for name in options:
        if name not in known:
            raise _core.EvaluationError(f"a prepared {call} has no option {name!r}; there are {', '.join(known)}")
        if name in ("form", "residual", "on_singular"):
            chosen(options[name], name)
    batch = states_of(batch)
    if call == "hybrid_dynamics":
        return PreparedHybrid(model, batch, options)
    frame = []
    if "frame" in known:
        if "frame" not in options:
            raise _core.EvaluationError(f"a prepared {call} needs a frame: prepare({call!r}, frame=...)")
        frame = [text(options["frame"], "a frame")]
        model.pose(*frame)  # ModelError for an unknown body or node
    ordinary = partial(getattr(model, call), *frame, **{name: value for name, value in options.items() if name != "frame"})

    def call_with_other_arguments(*given: Any, out: Any = None) -> Any:
        if len(given) != len(arrays):
            raise TypeError(
                f"a prepared {call} takes {', '.join(arrays)}{'' if call in _MADE else ', and out='}; it was given {len(given)} arguments"
            )
        refuse_other_states(call, batch, given)
        if out is None:
            return ordinary(*given)
        if call in _MADE:
            raise TypeError(f"{call} has three results and takes no out=")
        if call != "pose":
            return ordinary(*given, out=out)
        result = ordinary(*given)
        out = output(out, result.shape)
        out[...] = result
        return out

    call_with_other_arguments.__name__ = call_with_other_arguments.__qualname__ = f"prepared_{call}"
    takes = ", ".join(arrays) + ("" if call in _MADE else ", *, out=None")
    each = "one state" if batch is None else f"{batch} states"
    call_with_other_arguments.__doc__ = f"{call}({takes}) of '{model.name}', {each} a call."
    vars(call_with_other_arguments)["prepared"] = model, call, batch, dict(options)
    return _core.prepared_call(call_with_other_arguments, call, model._calls(), batch, _MADE.get(call), **options)


def told(call: Any) -> Any:
    """Return how a direct call is pickled and copied: a prepared call by its options, a method by its name."""
    made = vars(call.__wrapped__).get("prepared")
    return call.__qualname__ if made is None else (_again, made)


def _again(model: Any, call: str, batch: int | None, options: dict[str, Any]) -> Callable[..., Any]:
    return model.prepare(call, batch=batch, **options)
