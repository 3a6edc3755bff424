"""Direct calls for loops: the options are read once, and calls take arrays alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

import numpy as np

from .. import _core
from ..arguments import text

F = TypeVar("F", bound=Callable[..., Any])

_DEFAULTS = {"form": "fast", "refine": 0, "residual": "same", "on_singular": "raise", "precision": "double"}
# By name: the arrays, and the options.
_CALLS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "forward_dynamics": (("q", "v", "tau"), tuple(_DEFAULTS)),
    "inverse_dynamics": (("q", "v", "vdot"), ("precision",)),
    "bias_forces": (("q", "v"), ("precision",)),
    "mass_matrix": (("q",), ("precision",)),
    "mass_matrix_inverse": (("q",), tuple(_DEFAULTS)),
    "jacobian": (("q",), ("frame", "precision")),
    "pose": (("q",), ("frame",)),
}


def direct(function: F) -> F:
    """Marks the method of a direct call: contiguous float64 arrays go from CPython to the core, everything else through the method."""
    return _core.direct_call(function)


def prepared(model: Any, call: str, batch: int | None, options: dict[str, Any]) -> Callable[..., np.ndarray]:
    """What `Multibody.prepare` gives."""
    if call not in _CALLS:
        raise _core.EvaluationError(f"prepare takes {', '.join(map(repr, _CALLS))}, not {call!r}")
    arrays, known = _CALLS[call]
    for name in options:
        if name not in known:
            raise _core.EvaluationError(f"a prepared {call} has no option {name!r}; there are {', '.join(known)}")
    if batch is not None and (not isinstance(batch, int) or isinstance(batch, bool) or batch < 0):
        raise _core.EvaluationError(f"batch={batch!r}: how many states each call takes, or None for one state")
    frame = ""
    if "frame" in known:
        if "frame" not in options:
            raise _core.EvaluationError(f"a prepared {call} is that of a frame: prepare({call!r}, frame=...)")
        frame = text(options["frame"], "a frame")
        model.pose(frame)  # ModelError where no body or node has the name
    how = {name: value for name, value in options.items() if name != "frame"}
    ordinary = partial(getattr(model, call), *([frame] if frame else []), **how)

    def call_with_other_arguments(*given: Any, out: Any = None) -> np.ndarray:
        if len(given) != len(arrays):
            raise TypeError(f"a prepared {call} takes {', '.join(arrays)}, and out=; it was given {len(given)} arguments")
        states = {np.shape(x)[0] for x in given if np.ndim(x) == 2}
        if states != (set() if batch is None else {batch}):
            asked, found = ("one state" if n is None else f"{n} states" for n in (batch, min(states, default=None)))
            raise _core.ModelError(f"{call} was prepared for {asked} and is given {found}")
        result = ordinary(*given) if call == "pose" else ordinary(*given, out=out)
        if call == "pose" and out is not None:
            out[...] = result
            return out
        return result

    call_with_other_arguments.__name__ = call_with_other_arguments.__qualname__ = f"prepared_{call}"
    call_with_other_arguments.__doc__ = (
        f"{call}({', '.join(arrays)}, *, out=None) of '{model.name}', {'one state' if batch is None else f'{batch} states'} a call."
    )
    return _core.prepared_call(call_with_other_arguments, call, model._calls(), batch, frame, **{**_DEFAULTS, **how})
