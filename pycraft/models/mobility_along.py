"""Mobility at many states of one motion, and the singular ones between them (docs/loops.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..closed import Closed
from ..state import at_state
from .assembly import Assembler, between, turns_of
from .mobility import check_closed, checked_tolerance, mobility, scaled, shares

_WIDTH = 1e-12  # of the last bracket, in samples
_FLAT = 1e-9  # distances over a bracket that differ by less need no search: for a single row, as of gears, it is 1 everywhere


@dataclass(frozen=True, eq=False)
class SingularState(Closed):
    """A state of a motion with dependent rows that are independent beside it.

    at : its position, in samples: 2.5 is halfway between the third and the fourth
    q : (nq,), on the loops
    distance : the singular value of Q, relative to its longest row, that vanishes; rounding
    lost : rows, by name, that are independent beside it but not here, with their share
    """

    at: float
    q: np.ndarray
    distance: float
    lost: dict[str, float]

    def __str__(self) -> str:
        said = ", ".join(f"{name!r} ({share:.2f})" for name, share in self.lost.items())
        return f"singular at sample {self.at:.6g}, distance {self.distance:.1e}: lost {said}"


@dataclass(frozen=True, eq=False)
class MobilityAlong(Closed):
    """Freedoms left by loops along a motion.

    generic_rank : the largest rank of Q at the samples and beside the first
    rank, degrees_of_freedom : (B,), at each sample
    singular_values : (B, rows), of Q over the length of its longest row, in descending order
    distance : (B,), the smallest of these if the rank is generic; zero at a singular sample, inf without rows
    singular_states : the states between or on the samples where it reaches zero, in order; of consecutive singular samples the first
    """

    generic_rank: int
    rank: np.ndarray
    degrees_of_freedom: np.ndarray
    singular_values: np.ndarray
    distance: np.ndarray
    singular_states: list[SingularState]

    def __str__(self) -> str:
        least = f"distance {self.distance.min():.3g} at the least" if len(self.distance) else "no samples"
        return "\n".join([f"generic rank {self.generic_rank}, {least}", *map(str, self.singular_states)])


class _Motion:
    """States on the loops between samples, and the singular value that vanishes."""

    def __init__(self, model: Any, q: np.ndarray, rank: int):
        self.model, self.q, self.rank, self.turns = model, q, rank, turns_of(model)
        self.assembler = Assembler(model, q[0], (), 1e-10)

    def at(self, s: float) -> np.ndarray:
        """Return the state at s, in samples: interpolated between neighbours, projected onto the loops. ModelError if that fails."""
        i = min(int(s), len(self.q) - 2)
        if s in (i, i + 1):
            return self.q[round(s)]
        way = between(self.model, self.q[i], self.q[i + 1], self.turns)
        found, left = self.assembler.solve(self.model.integrate(self.q[i], (s - i) * way))
        if left > self.assembler.tolerance:
            raise _core.ModelError(
                f"between samples {i} and {i + 1} no state of {self.model.name!r} on its loops was found; give samples closer to each other"
            )
        return found

    def distance(self, s: float) -> float:
        """Return the smallest singular value at s if the rank is generic."""
        return float(np.linalg.svd(scaled(self.model.loops.jacobian(self.at(s))), compute_uv=False)[self.rank - 1])

    def least(self, low: float, high: float) -> float:
        """Return the place of the least distance in a bracket, by golden sections: at zero it has a corner, which parabolas do not
        follow."""
        ratio = (np.sqrt(5) - 1) / 2
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        at_a, at_b = self.distance(a), self.distance(b)
        if np.ptp([self.distance(low), at_a, at_b, self.distance(high)]) < _FLAT:
            return low
        while high - low > _WIDTH * max(1.0, high):
            if at_a < at_b:
                high, b, at_b = b, a, at_a
                a = high - ratio * (high - low)
                at_a = self.distance(a)
            else:
                low, a, at_a = a, b, at_b
                b = low + ratio * (high - low)
                at_b = self.distance(b)
            if not low < a < b < high:
                break
        return a if at_a < at_b else b

    def singular(self, s: float, beside: np.ndarray) -> SingularState:
        """Return the singular state at s with the lost rows, relative to a state of generic rank."""
        q, rows = self.at(s), self.model.loops.rows
        left, values, _ = np.linalg.svd(scaled(self.model.loops.jacobian(q)))
        there, *_ = np.linalg.svd(scaled(self.model.loops.jacobian(beside)))
        value = float(values[self.rank - 1])
        rank = int((values > max(10 * value, 1e-7)).sum())
        lost = shares(left[:, rank:], there[:, self.rank :], self.rank - rank)
        return SingularState(float(s), q, value, {rows[i]: float(share) for i, share in enumerate(lost) if share > 0.01})


def mobility_along(model: Any, q: Any, tolerance: Any) -> MobilityAlong:
    """`Multibody.mobility_along`."""
    q = np.array(_core.real_array(at_state(model, q)[0], "q"))
    tolerance = checked_tolerance(tolerance)
    if q.ndim != 2:
        raise _core.ModelError(f"mobility along a motion takes its samples (B, {model.nq}), not an array {q.shape}")
    check_closed(model, q)
    rows = len(model.loops.rows)
    Q = model.loops.jacobian(q)
    values = np.zeros((len(q), rows))
    if Q.size:
        own = np.linalg.svd(np.stack([scaled(one) for one in Q]), compute_uv=False)
        values[:, : own.shape[1]] = own
    rank = (values > tolerance).sum(axis=1)
    first = mobility(model, q[0], tolerance) if len(q) else None
    generic = max(int(rank.max()), first.generic_rank) if first else 0
    distance = values[:, generic - 1] if generic else np.full(len(q), np.inf)
    found: list[SingularState] = []
    if first and generic and not (distance > tolerance).any():  # the whole motion is singular
        found = [SingularState(0.0, q[0], float(distance[0]), first.lost)]
    elif generic and len(q) > 1:
        found = _found(_Motion(model, q, generic), distance, tolerance)
    return MobilityAlong(generic, rank, model.nv - rank, values, distance, found)


def _found(motion: _Motion, distance: np.ndarray, tolerance: float) -> list[SingularState]:
    """Return the singular states in the brackets about the least samples."""
    found: list[SingularState] = []
    last, regular = len(distance) - 1, np.flatnonzero(distance > tolerance)
    for i in range(last + 1):
        low, high = max(i - 1, 0), min(i + 1, last)
        if distance[i] > min(distance[low], distance[high]):
            continue
        at = float(i) if distance[i] <= tolerance else motion.least(low, high)
        if motion.distance(at) > tolerance:
            continue
        known = found and (at - found[-1].at < 1e-6 or (distance[low] <= tolerance and distance[i] <= tolerance))
        if not known:
            found.append(motion.singular(at, motion.q[regular[np.abs(regular - at).argmin()]]))
    return found
