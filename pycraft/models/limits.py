"""Limits of coordinates: their values, distances of a configuration from them, and clamping."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..closed import Closed
from ..state import at_state


class CoordinateLimits(NamedTuple):
    """Limits (nv,) of the coordinates of v, -inf and inf if absent, as for balls and free hinges; `q_index` (nv,): the place of the
    coordinate in q, -1 for one of several that make a quaternion or a pose."""

    lower: np.ndarray
    upper: np.ndarray
    q_index: np.ndarray


class Subhinge(NamedTuple):
    """A subhinge by its kind, its place in q and v, and its limits."""

    hinge: str
    kind: str
    q: slice
    v: slice
    lower: float
    upper: float


def subhinges(model: Any) -> Iterator[Subhinge]:
    """Yield the subhinges of a model, in the order of its coordinates."""
    q = v = 0
    for k in range(model._size):
        hinge = model._body(k)["hinge"]
        for i, subhinge in enumerate(hinge["subhinges"]):
            kind = _core.subhinge_kinds[subhinge["kind"]]
            lower, upper = (hinge["lower"][i], hinge["upper"][i]) if len(hinge["lower"]) and kind.nq == 1 else (-np.inf, np.inf)
            yield Subhinge(hinge["name"], subhinge["kind"], slice(q, q + kind.nq), slice(v, v + kind.nv), lower, upper)
            q, v = q + kind.nq, v + kind.nv


def pin_coordinates(model: Any) -> np.ndarray:
    """Return which coordinates (nv,) are angles of pins. O(N)."""
    return np.concatenate([np.zeros(0, bool), *(np.full(one.v.stop - one.v.start, one.kind == "pin") for one in subhinges(model))])


def coordinate_limits(model: Any) -> CoordinateLimits:
    """Return the limits of a model's coordinates. O(N)."""
    lower, upper, q_index = np.full(model.nv, -np.inf), np.full(model.nv, np.inf), np.full(model.nv, -1)
    for one in subhinges(model):
        if one.q.stop - one.q.start == 1:
            lower[one.v], upper[one.v], q_index[one.v] = one.lower, one.upper, one.q.start
    return CoordinateLimits(lower, upper, q_index)


def checked_q(model: Any, q: Any) -> np.ndarray:
    """Return q (nq,) or (B, nq) of an argument by the rule of states. ModelError of the core for a wrong size or values that are not
    finite."""
    q = np.asarray(_core.real_array(at_state(model, q)[0], "q"), float)
    model.configuration_rate(q, np.zeros(model.nv))  # the core's own checks
    return q


class LimitDistances(Closed):
    """Distances of coordinates from their limits, rad or m, negative outside, inf without a limit.

    `names` (nv), `lower` (nv,) = q - lower limit, `upper` (nv,) = upper limit - q, each with the batch's leading axis. Their derivatives by
    q are +1 and -1.
    """

    def __init__(self, names: tuple[str, ...], lower: np.ndarray, upper: np.ndarray):
        self._names, self._lower, self._upper = names, lower, upper

    @property
    def names(self) -> tuple[str, ...]:
        """The coordinates' names."""
        return self._names

    @property
    def lower(self) -> np.ndarray:
        """(nv,) or (B, nv), q minus the lower limit."""
        return self._lower

    @property
    def upper(self) -> np.ndarray:
        """(nv,) or (B, nv), the upper limit minus q."""
        return self._upper

    @property
    def smallest(self) -> Any:
        """The least of all distances, a number or (B,); inf without limits."""
        least = np.minimum(self._lower, self._upper).min(axis=-1, initial=np.inf)
        return float(least) if least.ndim == 0 else least

    @property
    def nearest(self) -> list:
        """(name, "lower" or "upper", distance) of every limit, the nearest first; for a batch a list of such lists."""
        if self._lower.ndim == 1:
            return self._sorted(self._lower, self._upper)
        return [self._sorted(*one) for one in zip(self._lower, self._upper, strict=True)]

    def _sorted(self, lower: np.ndarray, upper: np.ndarray) -> list[tuple[str, str, float]]:
        sides = (("lower", lower), ("upper", upper))
        found = [(name, side, float(x)) for side, values in sides for name, x in zip(self._names, values, strict=True) if np.isfinite(x)]
        return sorted(found, key=lambda one: one[2])

    def __repr__(self) -> str:
        if self._lower.ndim > 1:
            return f"<distances to limits of {self._lower.shape[-1]} coordinates at {len(self._lower)} states>"
        shown = ", ".join(f"{name} {side} {x:.3g}" for name, side, x in self.nearest[:4])
        return f"<distances to limits: {shown or 'no coordinate has one'}{', ...' if len(self.nearest) > 4 else ''}>"
