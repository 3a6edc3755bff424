"""States on the loops near one of them: their tangent space, in coordinates that are independent there (docs/loops.md).

A state is (q, v) with r(q) = 0 and Q v = 0. Along displacements δq on the group and δv,

    Q_p δq = 0,   Q δv + ∂(Qv)/∂q δq = 0                 Q_p the rows of positions, Q all of them, including rows of velocities (rolling)

so that with independent coordinates i of displacements and j of velocities (j = i without rows of velocities),

    δq = X δq_i,   δv = Y δq_i + Z δv_j,    Q_p X = 0,   Q Z = 0,   Q Y = -∂(Qv)/∂q X

Everything is computed by orthogonal factors of Q, which may have redundant rows.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core

RANK = 1e-8
"""Least singular value of Q that counts, relative to its longest row, as in mobility."""
CLEAR = 1e-6
"""Between RANK and this a rank is doubtful: ∂λ grows with the inverse square of the singular value, and loses digits accordingly."""
SMOOTH = 1e-6
"""Tolerance for the test of a different rank beside a state, relative to the terms of its sum."""


@dataclass(frozen=True)
class KeptRows:
    """Rows that are kept at a state: of some loops, then of coordinates that are held or prescribed.

    Q : (m, nv)
    chosen : numbers of the loops' rows among all rows of the model
    of_positions : (m,)
    names : of rows
    null, displacements : N (nv, f) orthonormal with Q N = 0; the same (nv, g) of the rows of positions alone
    """

    model: Any
    q: np.ndarray
    Q: np.ndarray
    chosen: np.ndarray
    of_positions: np.ndarray
    names: list[str]
    null: np.ndarray
    displacements: np.ndarray

    def multipliers(self, forces: np.ndarray) -> np.ndarray:
        """Return the least multipliers λ (m,) with Q*λ nearest to these forces."""
        return np.linalg.lstsq(self.Q.T, forces, rcond=RANK)[0] if self.Q.size else np.zeros(len(self.Q))

    def derivatives(self, v: np.ndarray, vdot: np.ndarray, multipliers: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return ∂(Qv)/∂q, ∂(Q v̇ + Q̇v)/∂q, ∂(Q̇v)/∂v, (m, nv) each, and ∂(Q*λ)/∂q (nv, nv), at constant v̇ and λ."""
        loops, nv, count = self.model.loops._core, self.model.nv, len(self.chosen)
        whole = np.zeros(len(self.model.loops.rows))
        whole[self.chosen] = multipliers[:count]
        found = loops.derivatives(self.q, v, vdot, whole, "double")
        of_rows = found[: 3 * len(whole)].reshape(3, len(whole), nv)[:, self.chosen]
        held = np.zeros((len(self.Q) - count, nv))
        return (*(np.vstack([rows, held]) for rows in of_rows), found[3 * len(whole) :])


def kept_rows(model: Any, q: np.ndarray, loops: Iterable[str], held: Iterable[int] = ()) -> KeptRows:
    """Return the rows of these loops and coordinates. EvaluationError at a singular state: rows that are dependent only there."""
    of_loop = [model.loops[name].slice for name in loops]
    chosen = np.concatenate([np.zeros(0, int), *(np.arange(one.start, one.stop) for one in of_loop)])
    fixed = list(held)
    Q = np.vstack([model.loops.jacobian(q)[chosen], np.eye(model.nv)[fixed]])
    of_positions = np.concatenate([np.asarray(model.loops.of_positions, bool)[chosen], np.ones(len(fixed), bool)])
    names = [model.loops.rows[i] for i in chosen] + [f"{model.coordinate_names[j]!r} as it is held" for j in fixed]
    left, null, least = _null_spaces(Q)
    left_of_positions, displacements, _ = (left, null, least) if of_positions.all() else _null_spaces(Q[of_positions])
    if least < CLEAR:
        raise _core.EvaluationError(
            f"{model.name!r} is within {least:.1e} of a singular state of its loops (the smallest singular value of Q over its longest "
            "row): derivatives are unreliable there; move the state away from it"
        )
    rows = KeptRows(model, np.asarray(q, float), Q, chosen, of_positions, names, null, displacements)
    _refuse_singular(rows, left)
    if not of_positions.all():
        whole = np.zeros((len(Q), left_of_positions.shape[1]))
        whole[of_positions] = left_of_positions
        _refuse_singular(rows, whole)
    return rows


def _null_spaces(Q: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return orthonormal bases of μ with Q*μ = 0 and of x with Qx = 0, and the least singular value that counts, over the longest row."""
    longest = np.linalg.norm(Q, axis=1).max(initial=0)
    left, values, right = np.linalg.svd(Q / longest if longest else Q)
    rank = int((values > RANK).sum())
    return left[:, rank:], right[rank:].T, float(values[rank - 1]) if rank else 1.0


def _refuse_singular(rows: KeptRows, left: np.ndarray) -> None:
    """Check that rows with Q*μ = 0 stay dependent beside the state: μ*∂Q N = 0 along displacements, for one μ drawn at random."""
    if not left.size or not rows.displacements.size:
        return
    rng = np.random.default_rng(0)
    mu, still = left @ rng.normal(size=left.shape[1]), np.zeros(rows.model.nv)
    bend = rows.derivatives(still, still, mu)[3]
    asked = np.abs(rows.null.T @ bend @ rows.displacements).max(initial=0.0)
    if asked > SMOOTH * max(np.abs(bend).max(initial=0.0), np.abs(rows.Q).max()):
        change = rows.derivatives(still, rows.null @ rng.normal(size=rows.null.shape[1]), mu)[1] @ rows.displacements
        part = np.abs(mu) * np.abs(change).max(axis=1)
        named = ", ".join(repr(rows.names[i]) for i in np.flatnonzero(part > 1e-6 * part.max()))
        raise _core.EvaluationError(
            f"{rows.model.name!r} is at a singular state of its loops, where {named} are dependent, but not beside it: "
            "derivatives are there; take a state beside it, or hold a coordinate that tells its branches apart"
        )


# ------------------------------------------------------------------ independent coordinates


@dataclass(frozen=True)
class LoopTangents:
    """The tangent space of states on the loops: X, Y, Z in the equations of this module.

    displacements, velocities : numbers of the coordinates i and j, in the order given, else in the order of the model
    """

    displacements: list[int]
    velocities: list[int]
    X: np.ndarray
    Y: np.ndarray
    Z: np.ndarray


def loop_tangents(rows: KeptRows, slip: np.ndarray, independent: list[int] | None) -> LoopTangents:
    """Return the tangent space for rows with ∂(Qv)/∂q = slip, in these coordinates or chosen ones; velocities in the first that suffice."""
    N, P = rows.null, rows.displacements
    if independent is None:
        j = _pivots(N)
        rest = P - P @ np.linalg.lstsq(P[j], P[j], rcond=None)[0] if j else P  # the part that does not move those
        i = sorted({*j, *_pivots(rest, P.shape[1] - len(j))})
    else:
        i = _checked(rows, independent)
        j = _first_of(i, N)
    X, Z = _by(P, i), _by(N, j)
    Y = -np.linalg.pinv(rows.Q, rcond=RANK) @ (slip @ X) if rows.Q.size else np.zeros_like(X)
    Y -= Z @ Y[j]
    return LoopTangents(i, j, X, Y, Z)


def _by(basis: np.ndarray, chosen: list[int]) -> np.ndarray:
    """Return the basis of the same space that is 1 at these coordinates."""
    out = np.linalg.solve(basis[chosen].T, basis.T).T if chosen else basis[:, :0]
    out[chosen] = np.eye(len(chosen))
    return out


def _pivots(basis: np.ndarray, count: int | None = None) -> list[int]:
    """Return the coordinates that determine a basis (nv, f) best, by a factorization with column pivoting."""
    from scipy.linalg import qr  # SciPy takes a quarter of a second to import

    if not basis.size:
        return []
    count = basis.shape[1] if count is None else count
    return sorted(int(k) for k in qr(basis.T, mode="r", pivoting=True)[1][:count])


def _first_of(chosen: list[int], basis: np.ndarray) -> list[int]:
    """Return the first of these coordinates that determine the whole basis."""
    found: list[int] = []
    for i in chosen:
        if len(found) < basis.shape[1] and np.linalg.matrix_rank(basis[[*found, i]], tol=RANK) > len(found):
            found.append(i)
    return found


def _checked(rows: KeptRows, found: list[int]) -> list[int]:
    P, names = rows.displacements, rows.model.coordinate_names
    if len(found) != P.shape[1] or np.linalg.matrix_rank(P[found], tol=RANK) < len(found):
        good = [names[i] for i in _pivots(P)]
        raise _core.ModelError(
            f"independent: displacements of {rows.model.name!r} on its loops have {P.shape[1]} coordinate(s), and "
            f"{[names[i] for i in found]} do not determine the others at this state; {good} do"
        )
    return found


# ------------------------------------------------------------------ the motion


@dataclass(frozen=True)
class TreeDerivatives:
    """Derivatives of A ż = g + (Q*λ, 0), z = (v, other states): A (k, k), ∂g along displacements, along z and along inputs, at this z and
    ż."""

    mass: np.ndarray
    along_q: np.ndarray
    along_rest: np.ndarray
    along_inputs: np.ndarray
    v: np.ndarray
    rates: np.ndarray
    forces: np.ndarray


def on_loops(rows: KeptRows, tree: TreeDerivatives, independent: list[int] | None) -> tuple[LoopTangents, list[np.ndarray]]:
    """Return the tangent space and ∂ż along δq_i, along (δv_j, the rest) and along inputs.

    ℳ δv̇ - Q*δλ = ∂g + ∂(Q*λ)/∂q δq,   Q δv̇ = -∂(Q v̇ + Q̇v)/∂q δq - ∂(Q̇v)/∂v δv:   with the null space N of Q

        δv̇ = p + N (N*ℳN)⁻¹ N* (right side - ℳ p),    p = Q⁺ (right side of the rows)
    """
    nv = rows.model.nv
    Q, N, v, vdot = rows.Q, rows.null, tree.v, tree.rates[:nv]
    slip, rows_q, rows_v, bent = rows.derivatives(v, vdot, rows.multipliers(tree.forces))
    tangents = loop_tangents(rows, slip, independent)
    X, Y, Z = tangents.X, tangents.Y, tangents.Z
    own = np.zeros((len(Q), len(tree.rates) - nv))
    states = np.hstack([tree.along_rest[:, :nv] @ Z, tree.along_rest[:, nv:]])
    sides = [tree.along_q @ X + tree.along_rest[:, :nv] @ Y, states, tree.along_inputs]
    sides[0][:nv] += bent @ X
    asked = [-(rows_q @ X + rows_v @ Y), np.hstack([-(rows_v @ Z), own]), np.zeros((len(Q), tree.along_inputs.shape[1]))]
    mass = tree.mass[:nv, :nv]
    inner = N.T @ mass @ N
    inverse = np.linalg.pinv(Q, rcond=RANK) if Q.size else np.zeros((nv, len(Q)))
    found = []
    for side, row in zip(sides, asked, strict=True):
        part = inverse @ row
        out = side.copy()
        out[:nv] = part + (N @ np.linalg.solve(inner, N.T @ (side[:nv] - mass @ part)) if N.size else 0.0)
        found.append(out)
    return tangents, found
