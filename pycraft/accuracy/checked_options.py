"""Arguments of measurements, checked once before measuring: every error names the argument and the valid values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .. import _core
from .rungs import OTHER_METHODS, RESIDUALS, epsilon

METHODS = ("articulated", *OTHER_METHODS)


def checked_model(model: Any, caller: str) -> None:
    """Check a model. Raises TypeError for other objects; ModelError for a model without coordinates."""
    if not isinstance(model, _core.Multibody):
        what = f"{model!r}" if isinstance(model, str) else f"an object of type {type(model).__name__}"
        takes = "takes a model: pc.load(path) of a file, or a robot such as pc.robots.panda()"
        raise TypeError(f"{caller} {takes}; got {what}")
    if not model.nv:
        raise _core.ModelError(f"{model.name!r} has no coordinates: nothing to measure")


def listed(given: Any, name: str, single: tuple[type, ...] = (str, int, float, np.number)) -> list[Any]:
    """Return the argument as a list; a single string or number is a list of one. Raises EvaluationError for an empty list."""
    if isinstance(given, single):
        return [given]
    if not isinstance(given, Iterable):
        raise _core.EvaluationError(f"{name}={given!r}: give a list or a single entry")
    found = list(given)
    if not found:
        raise _core.EvaluationError(f"{name} is empty: nothing to measure; leave it out for the defaults")
    return found


def checked_names(given: Any, name: str, what: str, known: Iterable[str]) -> list[str]:
    """Return names, each checked."""
    found, known = listed(given, name), list(known)
    for one in found:
        if one not in known:
            raise _core.EvaluationError(f"{what} {one!r} is not there; there are {', '.join(map(repr, known))}")
    return found


def checked_precisions(given: Any) -> list[Any]:
    """Return precisions, each checked."""
    found = listed(given, "precisions")
    for precision in found:
        if not isinstance(precision, (str, int)):
            raise _core.EvaluationError(f"precision {precision!r} is not there; there are {', '.join(map(repr, _core.epsilons()))}")
        epsilon(precision)
    return found


def checked_refinements(given: Any) -> list[tuple[int | str, str]]:
    """Return pairs of refinement and residual; a single number, "auto" or pair is a list of one."""
    pair = isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], str) and given[1] != "auto"
    found = []
    for one in [given] if pair else listed(given, "refinements"):
        if isinstance(one, (tuple, list)) and len(one) != 2:
            raise _core.EvaluationError(f"refinements: {one!r} is neither a number of corrections nor a pair of number and residual")
        refine, residual = one if isinstance(one, (tuple, list)) else (one, "same")
        if residual not in RESIDUALS:
            raise _core.EvaluationError(
                f"refinements: residual {residual!r} of {one!r} is not there; there are 'same', 'gather' and 'wider'"
            )
        found.append((_core.checked_refinement(refine, residual, "double"), residual))
    return found


def checked_positive(given: Any, name: str, what: str) -> list[float]:
    """Return positive finite numbers, checked."""
    found = listed(given, name)
    for one in found:
        if not isinstance(one, (int, float, np.number)) or not 0 < one < np.inf:
            raise _core.EvaluationError(f"{name}: {one!r} is not {what}")
    return [float(one) for one in found]


def checked_seconds(seconds: Any) -> float:
    """Return the time for a measurement, checked: finite, not negative."""
    if not isinstance(seconds, (int, float, np.number)) or not 0 <= seconds < np.inf:
        raise _core.EvaluationError(f"seconds={seconds!r}: give a finite number of seconds, zero or more")
    return float(seconds)
