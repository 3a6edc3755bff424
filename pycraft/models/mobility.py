"""Freedoms left by loops at a state, redundant rows, and the distance to singular states (docs/loops.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number
from ..closed import Closed
from ..state import at_state

_CLOSED = 1e-6  # of residuals relative to the sizes of rows: larger ones mean that a state is off the loops
_NEIGHBOURS, _STEP = 4, 1e-2


@dataclass(frozen=True, eq=False)
class Mobility(Closed):
    """Freedoms left by loops at a state.

    degrees_of_freedom : nv - rank
    rank : rank of Q, scaled by the length of its longest row
    generic_rank : the largest at neighbouring states on the loops; if it exceeds `rank` this state is `singular`
    redundant : rows that follow from the others, by name; the choice among several comes from a pivoted factorization
    dependencies : {redundant row: {row: c}}, with which Q[redundant] = Σ c Q[row]; none for a row that constrains nothing here
    lost : rows, by name, that are independent at neighbouring states but not here, with their share
    singular_values : singular values of the scaled Q, in descending order
    distance : the smallest of them above the tolerance; inf if there are none. It approaches zero near a singular state
    freedoms : (nv, degrees of freedom), orthonormal velocities that keep all rows
    """

    degrees_of_freedom: int
    rank: int
    generic_rank: int
    redundant: list[str]
    dependencies: dict[str, dict[str, float]]
    lost: dict[str, float]
    singular_values: np.ndarray
    distance: float
    freedoms: np.ndarray

    @property
    def singular(self) -> bool:
        """True if the rank is smaller here than at neighbouring states."""
        return self.generic_rank > self.rank

    def __str__(self) -> str:
        freedoms = f"{self.degrees_of_freedom} degree{'' if self.degrees_of_freedom == 1 else 's'} of freedom"
        lines = [f"{freedoms}, rank {self.rank} of {len(self.singular_values)}, distance {self.distance:.3g}"]
        if self.singular:
            said = ", ".join(f"{name!r} ({share:.2f})" for name, share in self.lost.items())
            lines.append(f"singular: rank {self.generic_rank} at neighbouring states; lost here {said}")
        for name in self.redundant:
            terms = " ".join(f"{c:+.3g} {row!r}" for row, c in self.dependencies.get(name, {}).items())
            lines.append(f"redundant: {name!r}" + (f" = {terms}" if terms else ", which asks nothing here"))
        return "\n".join(lines)


def scaled(Q: np.ndarray) -> np.ndarray:
    """Return Q over the length of its longest row: scaling each row by its own length would hide a row that is about to vanish."""
    longest = np.linalg.norm(Q, axis=1).max(initial=0)
    return Q / longest if longest else Q


def _rank(values: np.ndarray, tolerance: float) -> int:
    return int((values > tolerance).sum())


def check_closed(model: Any, q: np.ndarray) -> None:
    """Raise ModelError for a state, or one of a batch, that is not on the loops: with the worst row."""
    rows, residual = model.loops.rows, np.abs(model.loops.residual(q))
    off = residual / model.loops.sizes(q)
    if off.max(initial=0) > _CLOSED:
        *sample, worst = np.unravel_index(int(off.argmax()), off.shape)
        where = f" at sample {sample[0]}" if sample else ""
        said = f"{rows[worst]!r} is off by {residual.flat[off.argmax()]:.3g}; mobility needs a state on the loops (assemble())"
        raise _core.ModelError(f"{model.name!r} is not on its loops{where}: {said}")


def checked_tolerance(tolerance: Any) -> float:
    """Return a tolerance for singular values relative to the longest row. ModelError unless it is between 0 and 1."""
    checked = one_number(tolerance, "tolerance")
    if not 0 < checked < 1:
        raise _core.ModelError(f"tolerance must be between 0 and 1 (singular values relative to the longest row), not {checked!r}")
    return checked


def mobility(model: Any, q: Any, tolerance: Any) -> Mobility:
    """`Multibody.mobility`."""
    q = np.array(_core.real_array(at_state(model, q)[0], "q"))
    tolerance = checked_tolerance(tolerance)
    if q.ndim != 1:
        raise _core.ModelError(f"mobility takes one state, not an array {q.shape}; mobility_along takes many")
    check_closed(model, q)
    loops, rows = model.loops, model.loops.rows
    Q = scaled(loops.jacobian(q))
    left, values, right = np.linalg.svd(Q, full_matrices=True)
    values = np.concatenate([values, np.zeros(len(rows) - len(values))])
    rank = _rank(values, tolerance)
    redundant, dependencies = _dependencies(Q, rank, rows)
    generic, lost = _neighbours(model, q, rank, left[:, rank:], right[rank:].T, tolerance)
    return Mobility(
        degrees_of_freedom=model.nv - rank,
        rank=rank,
        generic_rank=generic,
        redundant=redundant,
        dependencies=dependencies,
        lost={rows[i]: float(share) for i, share in enumerate(lost) if share > 0.01},
        singular_values=values,
        distance=float(values[rank - 1]) if rank else np.inf,
        freedoms=_upward(right[rank:].T),
    )


def _upward(columns: np.ndarray) -> np.ndarray:
    """Return the columns, each with its largest entry positive, so that freedoms vary continuously between neighbouring states."""
    largest = np.take_along_axis(columns, np.abs(columns).argmax(axis=0)[None], axis=0) if columns.size else np.ones((1, columns.shape[1]))
    return columns * np.sign(largest)


def _dependencies(Q: np.ndarray, rank: int, rows: list[str]) -> tuple[list[str], dict[str, dict[str, float]]]:
    """Q*Π = q [R₁₁ R₁₂] by Householder reflections with column pivoting: a redundant row is R₁₁⁻¹R₁₂ of the pivot rows."""
    from scipy.linalg import qr, solve_triangular  # SciPy takes a quarter of a second to import

    if not Q.size:
        return list(rows), {}
    R, order = qr(Q.T, mode="r", pivoting=True)
    order = np.asarray(order)
    combined = solve_triangular(R[:rank, :rank], R[:rank, rank:]) if rank else np.zeros((0, len(rows)))
    dependencies = {}
    for place in np.argsort(order[rank:]):
        row = order[rank + place]
        terms = {rows[k]: float(c) for k, c in zip(order[:rank], combined[:, place], strict=True) if abs(c) > 1e-9}
        if terms:
            dependencies[rows[row]] = dict(sorted(terms.items(), key=lambda term: rows.index(term[0])))
    return [rows[i] for i in sorted(order[rank:])], dependencies


def _neighbours(model: Any, q: np.ndarray, rank: int, null: np.ndarray, freedoms: np.ndarray, tolerance: float) -> tuple[int, np.ndarray]:
    """Return the largest rank at states on the loops a step away, and each row's share in the combinations independent only there."""
    from .assembly import Assembler

    generic, lost = rank, np.zeros(len(null))
    if not freedoms.size or not null.size:
        return generic, lost
    assembler, rng = Assembler(model, q, (), 1e-10), np.random.default_rng(0)
    for _ in range(_NEIGHBOURS):
        along = freedoms @ rng.normal(size=freedoms.shape[1])
        near, residual = assembler.solve(model.integrate(q, _STEP * along / np.linalg.norm(along)))
        if residual > assembler.tolerance:
            continue
        left, values, _ = np.linalg.svd(scaled(model.loops.jacobian(near)))
        there = _rank(values, tolerance)
        if there > generic:
            generic, lost = there, shares(null, left[:, there:], there - rank)
    return generic, lost


def shares(null: np.ndarray, null_there: np.ndarray, count: int) -> np.ndarray:
    """Return each row's share in the `count` combinations of rows that vanish here and least there."""
    vectors, _, _ = np.linalg.svd(null - null_there @ (null_there.T @ null), full_matrices=False)
    return np.linalg.norm(vectors[:, :count], axis=1)
