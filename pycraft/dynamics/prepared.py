"""Direct calls for loops: the options are read once, and calls take arrays alone."""

from __future__ import annotations

import operator
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

import numpy as np

from .. import _core
from ..arguments import LARGEST, text
from .by_realization import output

F = TypeVar("F", bound=Callable[..., Any])

_CALLS = _core.direct_calls()
_MADE: dict[str, type] = {}
"""By name of a call with three results, the kind of tuple that holds them."""


def direct(function: F) -> F:
    """Marks the method of a direct call: contiguous float64 arrays go from CPython to the core, everything else through the method."""
    return _core.direct_call(function)


def direct_of(made: type) -> Callable[[F], F]:
    """The same of a call with three results, which this kind of tuple holds."""

    def mark(function: F) -> F:
        _MADE[function.__name__] = made
        return _core.direct_call(function, made)

    return mark


def _states_of(batch: Any) -> int | None:
    """How many states each call takes, None for one. EvaluationError where that is no number of states."""
    if batch is None:
        return None
    states = -1
    if not isinstance(batch, (bool, np.bool_)):
        with suppress(TypeError):
            states = operator.index(batch)
    if not 0 <= states <= LARGEST:
        raise _core.EvaluationError(f"batch={batch!r}: how many states each call takes, up to {LARGEST}, or None for one state")
    return states


def prepared(model: Any, call: str, batch: int | None, options: dict[str, Any]) -> Callable[..., Any]:
    """What `Multibody.prepare` gives."""
    if not isinstance(call, str) or call not in _CALLS:
        raise _core.EvaluationError(f"prepare takes {', '.join(map(repr, _CALLS))}, not {call!r}")
    arrays, known = _CALLS[call]
    for name in options:
        if name not in known:
            raise _core.EvaluationError(f"a prepared {call} has no option {name!r}; there are {', '.join(known)}")
    batch = _states_of(batch)
    frame = []
    if "frame" in known:
        if "frame" not in options:
            raise _core.EvaluationError(f"a prepared {call} is that of a frame: prepare({call!r}, frame=...)")
        frame = [text(options["frame"], "a frame")]
        model.pose(*frame)  # ModelError where no body or node has the name
    ordinary = partial(getattr(model, call), *frame, **{name: value for name, value in options.items() if name != "frame"})

    def call_with_other_arguments(*given: Any, out: Any = None) -> Any:
        if len(given) != len(arrays):
            raise TypeError(
                f"a prepared {call} takes {', '.join(arrays)}{'' if call in _MADE else ', and out='}; it was given {len(given)} arguments"
            )
        states = {np.shape(x)[0] for x in given if np.ndim(x) == 2}
        if states != (set() if batch is None else {batch}):
            asked, found = ("one state" if n is None else f"{n} states" for n in (batch, min(states, default=None)))
            raise _core.ModelError(f"{call} was prepared for {asked} and is given {found}")
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
    return _core.prepared_call(call_with_other_arguments, call, model._calls(), batch, _MADE.get(call), **options)
