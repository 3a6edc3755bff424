"""What a certificate is of: the coordinates, velocities, forces and vectors that are given, checked, and moved in their last place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ... import _core
from ..exact import relative_error
from ..rungs import epsilon

DRAWS = 4
"""Draws of signs for the error that rounded data make; the largest counts."""

ARTICULATED = {"method": "articulated", "on_singular": "raise"}
"""Keywords of `forward_dynamics` that a certificate leaves as they are."""

Data = dict[str, np.ndarray]
"""Arrays by name: q (nq,), v (nv,), tau (nv,), x (n,) or (n, m)."""


def vector(model: Any, name: str, value: Any, size: int) -> np.ndarray:
    """`value` as an array (size,); ModelError where it has another shape, or is no array of finite numbers."""
    out = _numbers(name, f"{model.name!r}", value, f"{size} numbers")
    if out.shape != (size,):
        takes = f"takes {size} numbers, not an array {out.shape}"
        raise _core.ModelError(f"a certificate is of one state: {name} of {model.name!r} {takes}")
    return out


def applied_to(expr: Any, x: Any) -> np.ndarray:
    """`x` as an array (n,) or (n, m) that the operator takes; ModelError where it has another shape."""
    n = expr.shape[1]
    takes = f"({n},), or ({n}, m) for m columns"
    out = _numbers("x", expr.text(), x, takes)
    if out.ndim not in (1, 2) or len(out) != n:
        raise _core.ModelError(f"x: {expr.text()} is applied to an array {takes}, not to one of shape {out.shape}")
    return out


def check(seed: Any, **others: Any) -> None:
    """EvaluationError where the seed is no seed, or a keyword asks for a method that has no certificate."""
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise _core.EvaluationError(f"seed={seed!r}: the seed of the signs is a whole number, 0 or above")
    for name, value in others.items():
        if value != ARTICULATED[name]:
            instead = "pc.accuracy(model, methods=[...]) measures the others" if name == "method" else "a value that it refuses has none"
            raise _core.EvaluationError(f"{name}={value!r}: certificates are of the articulated method; {instead}")


def check_coordinates(model: Any) -> None:
    """ModelError where a model has no coordinates."""
    if not model.nv:
        raise _core.ModelError(f"model {model.name!r} has no coordinates: nothing to certify")


def input_errors(data: Data, seed: int, truth: Any, exact: Callable[[Data], Any]) -> dict[str, float]:
    """The value's relative change when all numbers of one array move by half a unit in their last place, of each array.

    Half a unit is no double: numbers move by a whole one, and the change, small against the value, is halved. A coordinate that is 0 has
    no last place, and an angle or a travel is rarely exact there: it moves by half an epsilon of 1 rad or 1 m. A zero of v, tau or x
    stays: it says that nothing moves and nothing pushes.

    Parameters
    ----------
    data : the arrays by name
    seed : of the signs
    truth : the value at `data`, as `exact` gives it
    exact : the value of other data
    """
    rng = np.random.default_rng(seed)
    found = {}
    for name, array in data.items():
        signs = rng.choice([-1.0, 1.0], (DRAWS, *array.shape))
        unit = epsilon("double") if name == "q" else 0.0
        if not unit and not array.any():
            found[name] = 0.0
            continue
        moved = [np.where(array == 0, unit * s, np.nextafter(array, np.copysign(np.inf, s))) for s in signs]
        found[name] = max(relative_error(exact({**data, name: m}), truth) for m in moved) / 2
    return found


def _numbers(name: str, what: str, value: Any, takes: str) -> np.ndarray:
    try:
        out = np.array(_core.real_array(value, name))
    except _core.ModelError:
        raise _core.ModelError(f"{name} of {what} takes {takes}, not {type(value).__name__} {value!r:.60}") from None
    if not np.isfinite(out).all():
        raise _core.ModelError(f"{name} of {what} has an entry that is not finite")
    return out
