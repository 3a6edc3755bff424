"""Inverse dynamics on the loops: the forces of actuated coordinates that produce a motion, and the loops' forces (docs/loops.md).

The tree needs T = ℳ v̇ + 𝒞 along its coordinates. With S the columns of 1 at actuated coordinates and P the orthogonal projector onto
motions that keep every row, Q P = 0, loops carry everything in the range of Q*, which is the range of 1 - P:

    T = S τ + Q*λ + r        P S τ + r = P T        τ = (P S)⁺ P T,   r = P T - P S τ,   λ = (Q*)⁺ (T - S τ - r)

(..)⁺ the pseudo-inverse: of all forces with the least |r| those with the least |τ|, and then the least |λ|. r is zero along actuated
coordinates, S* r = 0, and along the rows, Q r = 0: a motion on the loops with the actuators at rest, which nothing drives.

Derivatives if r = 0: τ = S* m, m the motion that keeps the rows with S S* m + Q*λ = T, so that

    S S* δm + Q*δλ = δT - ∂(Q*λ)/∂q δq,   Q δm = -∂(Q m)/∂q δq
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..arguments import of_state
from ..state import at_state
from .constrained import LoopForce, by_loop
from .equilibrium import TOLERANCE, checked_tolerance
from .interbody import pushed
from .linearization import listed
from .loop_tangents import RANK

FAR, STOPPED = 1e-6, 1e-13
"""Bound for a state on the loops, as in mobility; rad/s, m/s: slower velocities are rounding of velocities that stopped."""


@dataclass(frozen=True)
class ConstrainedForces:
    """Generalized forces that produce a motion of a model on its loops, with a leading axis (B, ...) for batches.

    Attributes
    ----------
    tau : (nv,) N m and N, zero at coordinates that are not actuated; of several solutions the one of least Σ τ²
    multipliers : (rows,) in the order of `loops.rows`: ℳ v̇ + 𝒞 = τ + Q*λ + residual, the solution of least Σ λ²
    by_loop : the same by the names of loops, (rows of the loop,) each
    forces : `LoopForce` by the names of loops
    residual : (nv,) forces that these actuators cannot produce, the least possible: zero along actuated coordinates, and a motion on the
        loops
    unattained : names of coordinates with a residual beyond rounding, at any of the states
    rank : () rank of Q
    driven : () number of independent motions on the loops that the actuators drive, of nv - rank
    """

    tau: np.ndarray
    multipliers: np.ndarray
    by_loop: Mapping[str, np.ndarray]
    forces: Mapping[str, LoopForce]
    residual: np.ndarray
    unattained: tuple[str, ...]
    rank: np.ndarray
    driven: np.ndarray


class ConstrainedForceDerivatives(NamedTuple):
    """Derivatives of the forces of actuated coordinates, (nv, nv) or (B, nv, nv) each; rows of other coordinates are zero.

    q : along coordinates, on ball and free hinges along quasi-velocities; for motions on the loops
    v : by velocities
    vdot : by accelerations
    """

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray


class Carried(NamedTuple):
    """Split of forces T (..., nv) between actuators and loops: τ, r, λ, the rank of Q and the number of driven freedoms."""

    tau: np.ndarray
    residual: np.ndarray
    multipliers: np.ndarray
    rank: np.ndarray
    driven: np.ndarray


def actuated_coordinates(model: Any, actuated: Any) -> np.ndarray:
    """Return the driven coordinates (nv,), by names of hinges, coordinates or patterns; all for None. ModelError for an unknown name."""
    driven = np.ones(model.nv, bool)
    if actuated is not None:
        driven[:] = False
        driven[_core.coordinates_named(model, listed(actuated, "actuated"), "actuated")] = True
    return driven


def shared_out(Q: np.ndarray, T: np.ndarray, driven: np.ndarray) -> Carried:
    """Split forces T (..., nv) between actuators and rows Q (..., rows, nv)."""
    rows, nv = Q.shape[-2:]
    longest = np.linalg.norm(Q, axis=-1).max(axis=-1, initial=0.0)[..., None]
    longest = np.where(longest > 0, longest, 1.0)
    U, sigma, V = np.linalg.svd(Q / longest[..., None], full_matrices=False)
    kept = sigma > RANK
    V = V * kept[..., None]  # an orthonormal basis of the range of Q*
    free = T - _along(V, T)
    pushes = np.eye(nv)[:, driven] - np.swapaxes(V, -1, -2) @ V[..., driven]  # P S
    A, s, B = np.linalg.svd(pushes, full_matrices=False)
    counts = s > RANK
    inverse = np.where(counts, 1 / np.where(counts, s, 1.0), 0.0)
    own = np.einsum("...ji,...j->...i", B, inverse * np.einsum("...ij,...i->...j", A, free))
    tau = np.zeros_like(T)
    tau[..., driven] = own
    left = free - np.einsum("...ij,...j->...i", pushes, own)
    left = left - _along(V, left)
    left[..., driven] = 0.0
    along = np.einsum("...ij,...j->...i", V, T - tau - left)
    multipliers = np.einsum("...ij,...j->...i", U, np.where(kept, along / np.where(kept, sigma, 1.0), 0.0)) / longest
    return Carried(tau, left, multipliers.reshape(*T.shape[:-1], rows), kept.sum(axis=-1), counts.sum(axis=-1))


def _along(V: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.einsum("...ij,...i->...j", V, np.einsum("...ij,...j->...i", V, x))


def check_on_loops(model: Any, q: np.ndarray, v: np.ndarray | None = None, vdot: np.ndarray | None = None) -> None:
    """Raise ModelError for a state that is off the loops, moves or accelerates off them, with the row, and in a batch the state."""
    loops = model.loops
    if not loops.rows:
        return
    sizes = loops.sizes(q)
    found = [("is off", np.abs(loops.residual(q)) / sizes, "model.assemble(q, v) finds a state on the loops")]
    if v is not None:
        fastest = np.maximum(np.abs(v).max(axis=-1, initial=0.0), STOPPED / FAR)[..., None]
        found.append(("moves off", np.abs(loops.rates(q, v)) / (fastest * sizes), "model.assemble(q, v) finds velocities that keep it"))
        if vdot is not None:
            bias = loops.bias(q, v)
            size = sizes * np.maximum(np.abs(vdot).max(axis=-1, initial=0.0)[..., None], fastest**2) + np.abs(bias)
            off = np.abs(loops.rates(q, vdot) + bias) / np.maximum(size, STOPPED)
            found.append(("accelerates off", off, "model.loops.acceleration(q, v, vdot) finds accelerations that keep it"))
    for what, off, remedy in found:
        off = np.atleast_2d(off)
        if not (off <= FAR).all():
            b, worst = (int(i) for i in np.unravel_index(np.argmax(np.where(np.isfinite(off), off, np.inf)), off.shape))
            which = f" (state {b} of a batch of {len(off)})" if len(off) > 1 else ""
            raise _core.ModelError(
                f"{model.name!r}: the state given {what} row {loops.rows[worst]!r} by {off[b, worst]:.3g}{which}; {remedy}"
            )


def end_forces(model: Any, q: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
    """Return the forces of loops on b and on a (..., loops, 2, 6), each in its axes about its origin, for rows with λ: A*λ; zeros for
    couplings."""
    loops, ends = model.loops, model.loops.ends
    out = np.zeros((*multipliers.shape[:-1], len(loops), 2, 6))
    if not ends:
        return out
    A, places = model.soa.A.at(q).dense(), {name: 6 * i for i, name in enumerate(ends)}
    for number, name in enumerate(loops):
        own, both = loops[name].slice, loops.ends_of(name)
        for side, end in enumerate(both):
            if end in places:
                at = places[end]
                out[..., number, side, :] = np.einsum("...ri,...r->...i", A[..., own, at : at + 6], multipliers[..., own])
        for side, end in enumerate(both):
            other = both[1 - side]
            if end not in places and other in places:  # the base or a node on it, against the other
                X, held = model.frame(other).pose(q, wrt=end or None), out[..., number, 1 - side, :]
                n, f = (np.einsum("...ij,...j->...i", X[..., :3, :3], part) for part in (held[..., :3], held[..., 3:]))
                out[..., number, side, :] = -np.concatenate([n + np.cross(X[..., :3, 3], f), f], axis=-1)
    return out


class ConstrainedInverseCalls:
    """Inverse dynamics including the loops' forces."""

    nv: int
    loops: Any

    def constrained_inverse_dynamics(
        self, q=None, v=None, vdot=None, *, actuated: Any = None, wrenches: Mapping[Any, Any] | None = None, wrench_axes: str = "world",
        tolerance: float = TOLERANCE,
    ) -> ConstrainedForces:  # fmt: skip
        """Return the forces τ of the actuated coordinates that produce v̇ on the loops, the loops' forces λ, and the unattainable part.

        ℳ v̇ + 𝒞 = τ + Q*λ + r, S* r = 0, Q r = 0: with more actuators than freedoms τ has the least Σ τ² (N m and N), with fewer r is the
        least that any forces of these actuators leave. With exactly as many, at a state where they describe the motion, τ is unique, X*(ℳ
        v̇ + 𝒞) with `soa.embedded(actuated)`.

        Parameters
        ----------
        q, v, vdot : (nq,), (nv,), (nv,), each with an optional leading batch axis; on the loops
            `assemble(q, v)` finds q and v, `loops.acceleration(q, v, vdot)` v̇. Default: v and vdot zero.
        actuated : names of hinges, coordinates or patterns, or a list of them, of driven coordinates; None: all
        wrenches, wrench_axes : as in `interbody_forces`
        tolerance : largest residual, relative to the largest force

        Returns
        -------
        ConstrainedForces

        Raises
        ------
        ModelError
            A state that is off the loops, moves or accelerates off them, by the row; unknown names.
        EvaluationError
            An invalid tolerance.

        At a singular state loops carry what their rows carry there. Cost: O(N), and dense factors of Q, rows² · nv.
        Source: the equations of motion with loops, A. Jain, Robot and Multibody Dynamics, Springer 2011; minimum norm and
        projectors, G. Golub, C. Van Loan, Matrix Computations, 2013, 5.5.

        Examples
        --------
        >>> import pycraft as pc
        >>> bars = pc.chain(3)
        >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
        >>> bars.gravity = (0, -10, 0)
        >>> q = [1, -1, 1 - np.pi]  # a parallelogram, cranks at 1 rad
        >>> held = bars.constrained_inverse_dynamics(q, actuated="hinge0")
        >>> bool(abs(held.tau[0] - 2 * 10 * np.cos(1)) < 1e-12), held.unattained  # two cranks at half their length, a rod at its whole
        (True, ())
        >>> bars.constrained_inverse_dynamics(q, actuated=[]).unattained
        ('hinge0', 'hinge1', 'hinge2')
        """
        model: Any = self
        (q, v, vdot), _, pushes = _asked(model, q, v, vdot, wrenches, wrench_axes)
        f, _, needed, _ = model._interbody().after(q, v, vdot, *pushes, False, "double")
        driven = actuated_coordinates(model, actuated)
        found = shared_out(self.loops.jacobian(q), needed, driven)
        forces = end_forces(model, np.broadcast_to(q, (*needed.shape[:-1], q.shape[-1])), found.multipliers)
        unattained = beyond(model, found.residual, needed, f, pushes[2], tolerance)
        _, multipliers, own, of_loops, rank = by_loop(self.loops, found.tau, found.multipliers, forces, found.rank)
        return ConstrainedForces(found.tau, multipliers, own, of_loops, found.residual, unattained, rank, found.driven)

    def constrained_inverse_dynamics_derivatives(
        self, q=None, v=None, vdot=None, *, actuated: Any = None, wrenches: Mapping[Any, Any] | None = None, wrench_axes: str = "world",
    ) -> ConstrainedForceDerivatives:  # fmt: skip
        """Return exact derivatives of τ of `constrained_inverse_dynamics`; arguments and errors are the same.

        They apply to states on the loops: along q multiply by motions that keep the rows (`mobility(q).freedoms`), with δv and δv̇
        likewise, Q δv + ∂(Qv)/∂q δq = 0. Cost: nv times the rows, and dense factors of Q.

        EvaluationError if not all freedoms are driven: the rest is then a choice, and not a differentiable function.

        Examples
        --------
        >>> import pycraft as pc
        >>> bars = pc.chain(3)
        >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
        >>> bars.gravity = (0, -10, 0)
        >>> along = bars.constrained_inverse_dynamics_derivatives([1, -1, 1 - np.pi], actuated="hinge0").q @ [1, -1, 1]
        >>> bool(abs(along[0] + 2 * 10 * np.sin(1)) < 1e-12)  # of 2 g cos
        True
        """
        model: Any = self
        (q, v, vdot), batch, pushes = _asked(model, q, v, vdot, wrenches, wrench_axes)
        driven = actuated_coordinates(model, actuated)
        needed = model._interbody().after(q, v, vdot, *pushes, False, "double")[2]
        if pushes[0]:
            along = model._interbody().derivatives(q, v, vdot, *pushes, False)[1]
        else:
            along = model.inverse_dynamics_derivatives(q, v, vdot)
        Q = self.loops.jacobian(q)
        if not batch:
            return ConstrainedForceDerivatives(*_derivatives(model, q, Q, needed, along, driven))
        states = len(needed)
        given = [np.broadcast_to(x, (states, *x.shape[-axes:])) for x, axes in ((q, 1), (Q, 2), (needed, 1))]
        parts = [np.broadcast_to(x, (states, *x.shape[-2:])) for x in along]
        each = []
        for b, (own_q, own_Q, own) in enumerate(zip(*given, strict=True)):
            with of_state(b, states):
                each.append(_derivatives(model, own_q, own_Q, own, [part[b] for part in parts], driven))
        stacked = [np.stack(one) for one in zip(*each, strict=True)] if each else [np.zeros((0, self.nv, self.nv))] * 3
        return ConstrainedForceDerivatives(*stacked)


def beyond(model: Any, left: np.ndarray, needed: np.ndarray, f: np.ndarray, pushes: np.ndarray, tolerance: Any) -> tuple[str, ...]:
    """Return names of coordinates with a residual beyond a part of the largest force: f of hinges, weights, wrenches."""
    weight = model.mass * float(np.linalg.norm(model.gravity))  # the balancing force, if hinges carry nothing
    pushed_by = np.abs(pushes).max(initial=0.0, axis=(-2, -1))
    carried = np.maximum(np.abs(f).max(initial=0.0, axis=(-2, -1)), np.abs(needed).max(initial=0.0, axis=-1))
    size = np.maximum(carried, np.maximum(weight, pushed_by))[..., None]
    over = np.abs(left) > checked_tolerance(tolerance) * size
    over = over.any(axis=tuple(range(over.ndim - 1)))
    return tuple(model.coordinate_names[j] for j in np.flatnonzero(over))


def _asked(
    model: Any, q: Any, v: Any, vdot: Any, wrenches: Any, wrench_axes: Any
) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], tuple[int, ...], tuple[Any, Any, np.ndarray]]:  # fmt: skip
    """Return a checked motion on the loops, the batch's shape, and wrenches: nodes, whether in world axes, values."""
    q, v = at_state(model, q, v)
    vdot = np.zeros(model.nv) if vdot is None else vdot
    q, v, vdot = (np.asarray(_core.real_array(x, name), float) for name, x in (("q", q), ("v", v), ("vdot", vdot)))
    model.inverse_dynamics(q, v, vdot)  # refuses arguments that do not fit
    pushes = pushed(wrenches, wrench_axes)
    check_on_loops(model, q, v, vdot)
    return (q, v, vdot), np.broadcast_shapes(q.shape[:-1], v.shape[:-1], vdot.shape[:-1]), pushes


def _derivatives(
    model: Any, q: np.ndarray, Q: np.ndarray, needed: np.ndarray, along: Any, driven: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    nv = model.nv
    found = shared_out(Q, needed, driven)
    free = nv - int(found.rank)
    if int(found.driven) < free:
        names = [model.coordinate_names[j] for j in np.flatnonzero(driven)]
        raise _core.EvaluationError(
            f"{model.name!r}: forces at {', '.join(map(repr, names)) or 'no coordinate'} drive {int(found.driven)} of {free} freedoms "
            f"on its loops, and have no derivatives; actuate {free - int(found.driven)} more (mobility(q) has the freedoms)"
        )
    _, sigma, V = np.linalg.svd(Q / (np.linalg.norm(Q, axis=1).max(initial=0.0) or 1.0)) if Q.size else (None, np.zeros(0), np.eye(nv))
    N = V[int((sigma > RANK).sum()) :].T
    S = driven.astype(float)[:, None]
    inner = N.T @ (S * N)  # N*S S*N
    m = N @ np.linalg.solve(inner, N.T @ needed) if N.size else np.zeros(nv)
    still = np.zeros(nv)
    parts = model.loops._core.derivatives(q, still, m, found.multipliers, "double") if len(Q) else np.zeros((nv, nv))
    slip, bent = parts[len(Q) : 2 * len(Q)], parts[3 * len(Q) :]
    forced = -np.linalg.pinv(Q, rcond=RANK) @ slip if len(Q) else np.zeros((nv, nv))
    out = []
    for side, own in ((along[0] - bent, forced), (along[1], 0 * forced), (along[2], 0 * forced)):
        moved = own + (N @ np.linalg.solve(inner, N.T @ (side - S * own)) if N.size else 0.0)
        out.append(S * moved)
    return out[0], out[1], out[2]
