"""Limits of coordinates that a run crossed and no effect held."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..models.limits import CoordinateLimits, coordinate_limits
from ..models.warning import warn
from .effects import Limits

SLACK = 1e-9
"""Tolerance beyond a limit, rad or m, times the larger of 1 and the limit."""

SHOWN = 4
"""Largest number of coordinates named in a warning or a line of text."""


@dataclass(frozen=True)
class CrossedLimit:
    """A coordinate beyond its limit.

    Attributes
    ----------
    coordinate : its name
    limit : rad or m, the limit that was crossed
    upper : True for an upper limit
    first : s, the first time among the run's states beyond it
    farthest : rad or m, the value farthest beyond it
    """

    coordinate: str
    limit: float
    upper: bool
    first: float
    farthest: float

    def __str__(self) -> str:
        return f"{self.coordinate} reached {self.farthest:.4g} (limit {self.limit:.4g}, left at {self.first:.3g} s)"


def unheld_limits(model: Any, stops: Iterable[Limits]) -> CoordinateLimits | None:
    """Return the limits of a model that none of these effects holds, or None if there are none. Cost: O(N)."""
    limits = coordinate_limits(model)
    for effect in stops:
        held = effect.made_for(model).coordinates
        limits.lower[held], limits.upper[held] = -np.inf, np.inf
    return limits if np.isfinite(limits.lower).any() or np.isfinite(limits.upper).any() else None


def crossed_limits(limits: CoordinateLimits | None, names: list[str], t: np.ndarray, q: np.ndarray) -> list[CrossedLimit]:
    """Return the limits that states q (K, nq) at times t (K,) are beyond, in the order of the coordinates. Cost: O(K N)."""
    found: list[CrossedLimit] = []
    if limits is None or not len(t):
        return found
    there = np.flatnonzero(limits.q_index >= 0)
    values = q[:, limits.q_index[there]]
    for upper, bounds in ((False, limits.lower[there]), (True, limits.upper[there])):
        slack = SLACK * np.maximum(1.0, np.abs(bounds), where=np.isfinite(bounds), out=np.ones_like(bounds))
        beyond = values > bounds + slack if upper else values < bounds - slack
        for i in np.flatnonzero(beyond.any(axis=0)):
            first = int(np.argmax(beyond[:, i]))
            farthest = float(values[:, i].max() if upper else values[:, i].min())
            found.append(CrossedLimit(names[there[i]], float(bounds[i]), upper, float(t[first]), farthest))
    return sorted(found, key=lambda one: names.index(one.coordinate))


def crossed_text(crossed: list[CrossedLimit]) -> str:
    """Name the first of these limits and count the rest."""
    shown = "; ".join(str(one) for one in crossed[:SHOWN])
    return shown + (f"; and {len(crossed) - SHOWN} more" if len(crossed) > SHOWN else "")


def crossed_names(crossed: list[CrossedLimit]) -> str:
    """Name the first of these coordinates and count the rest."""
    names = list(dict.fromkeys(one.coordinate for one in crossed))
    return ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")


def warn_of_crossed_limits(model: str, crossed: list[CrossedLimit]) -> None:
    """Warn of coordinates that left limits which no effect holds."""
    if crossed:
        warn(
            f"coordinates of {model!r} left their limits, and no effect of this scene holds them: {crossed_text(crossed)}. Add "
            "pc.effects.Limits() to hold them; run.crossed_limits lists all"
        )
