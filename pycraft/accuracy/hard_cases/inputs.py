"""Inputs of a certificate: coordinates, velocities, forces and vectors, checked, and moved in their last place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ... import _core
from ..exact import relative_error
from ..rungs import epsilon

DRAWS = 4
"""Number of random signs for the effect of rounded data; the largest effect counts."""

ARTICULATED = {"method": "articulated", "on_singular": "raise"}
"""Keywords of `forward_dynamics` that a certificate does not change."""

Data = dict[str, np.ndarray]
"""Arrays by name: q (nq,), v (nv,), tau (nv,), x (n,) or (n, m)."""


def vector(model: Any, name: str, value: Any, size: int) -> np.ndarray:
    """Return `value` as an array (size,). Raises ModelError for another shape, or values that are not finite."""
    out = _numbers(name, f"{model.name!r}", value, f"{size} numbers")
    if out.shape != (size,):
        takes = f"takes {size} numbers, not an array {out.shape}"
        raise _core.ModelError(f"a certificate takes one state: {name} of {model.name!r} {takes}")
    return out


def applied_to(expr: Any, x: Any) -> np.ndarray:
    """Return `x` as an array (n,) or (n, m) for the operator. Raises ModelError for another shape."""
    n = expr.shape[1]
    takes = f"({n},), or ({n}, m) for m columns"
    out = _numbers("x", expr.text(), x, takes)
    if out.ndim not in (1, 2) or len(out) != n:
        raise _core.ModelError(f"x: {expr.text()} is applied to an array {takes}, not to one of shape {out.shape}")
    return out


def check(seed: Any, **others: Any) -> None:
    """Raise EvaluationError for an invalid seed, or for a method without certificates."""
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise _core.EvaluationError(f"seed={seed!r}: the seed must be a whole number, 0 or above")
    for name, value in others.items():
        if value != ARTICULATED[name]:
            instead = "pc.accuracy(model, methods=[...]) measures the others" if name == "method" else "a refused value has no certificate"
            raise _core.EvaluationError(f"{name}={value!r}: certificates support only the articulated method; {instead}")


def check_coordinates(model: Any) -> None:
    """Raise ModelError for a model without coordinates."""
    if not model.nv:
        raise _core.ModelError(f"model {model.name!r} has no coordinates: nothing to certify")


def input_errors(data: Data, seed: int, truth: Any, exact: Callable[[Data], Any]) -> dict[str, float]:
    """Return for each array the value's relative change when all its entries move by half a unit in their last place.

    Half a unit is not representable: entries move by a whole unit, and the change, small against the value, is halved. A coordinate of 0
    has no last place, and an angle or a travel is rarely exact there: it moves by half an epsilon of 1 rad or 1 m. A zero of v, tau or x
    does not change: it means that nothing moves and nothing pushes.

    Parameters
    ----------
    data : the arrays by name
    seed : seed of the signs
    truth : the value at `data`, as computed by `exact`
    exact : function that computes the value at other data
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
