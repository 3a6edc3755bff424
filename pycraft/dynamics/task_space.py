"""Task space: the equations of motion of nodes, along all or some of their directions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number, several, text
from ..closed import Closed
from ..state import at_state
from .cholesky import cholesky
from .direct_calls import cached

TWIST = ("rx", "ry", "rz", "x", "y", "z")
"""Directions of a frame in its own axes, angular first."""
SHARED = 2.0**-8
"""Least compliance of a direction on its own beside the others: below it two digits would be lost, which the decomposition keeps."""

LARGEST_ROW = 1e100
"""Largest row of directions, and one over the smallest: Λ⁻¹ contains squares, which overflow from 1e154 on."""


ON_SINGULAR = ("raise", "nan", "damped")
"""Treatment of states at which not all directions can move independently."""


def damping_of(on_singular: Any, damping: Any) -> float | None:
    """Return the least singular value, if damped. EvaluationError for unknown options."""
    if text(on_singular, "on_singular") not in ON_SINGULAR:
        raise _core.EvaluationError(f"on_singular={on_singular!r} of a task space: there are {', '.join(map(repr, ON_SINGULAR))}")
    number = one_number(damping, "damping")
    if not 0 < number < 1:
        raise _core.EvaluationError(f"damping={number}: the least singular value of the directions in their units, between 0 and 1")
    return number if on_singular == "damped" else None


class TaskSpace(Closed):
    """Motion of nodes along some directions at a state, or at each of a batch: ẍ = Λ⁻¹F + J v̇₀ + J̇v.

    ẋ = J v are the components of the nodes' velocities along the directions, each in its frame's own axes, F the forces on the nodes along
    them, and v̇₀ the accelerations due to gravity, velocities and hinge forces τ. By Ω's recursion, O(N + m depth) for m nodes, and O(N k)
    for Y,

        Λ⁻¹ = C B*ΩB C* = R⁻¹R⁻*,    Λ = R*R,    Y = (ℳ + J_rotors)⁻¹J*,    J̄ = YΛ,    N = 1 - J̄J

    C the directions in the nodes' motions, R from Λ⁻¹'s Cholesky factor in units in which each direction alone has unit compliance. If a
    pivot is less than `SHARED`, or kernels are unreliable, everything uses the singular value decomposition of W = J L⁻*, LL* = ℳ +
    J_rotors,

        Λ⁻¹ = WW*,    Λ = (W⁺)*W⁺,    J̄ = L⁻*W⁺

    so that near singular poses half as many digits are lost as by inverting Λ⁻¹; that costs O(nv³). For a batch all results have a leading
    axis.

    At a state where not all directions can move independently Λ does not exist. on_singular="raise" refuses it, in a batch with the number
    of the state; "nan" returns NaN there (`singular` marks these states), and other states have the values that they have alone, to
    rounding; "damped" uses at every state singular values of W/d, d the value of each direction alone, of at least `damping`: Λ = d⁻¹U σ₊⁻²
    U*d⁻¹, σ₊ = max(σ, damping), and accordingly J̄ = YΛ, τ = J*Λ(...), finite everywhere and unchanged where σ > damping. A direction that
    moves nothing at all carries no force.

    Attributes
    ----------
    names : names of the directions, "hand.x"
    jacobian : (k, nv), of the directions
    velocity : (k,), J v
    """

    def __init__(
        self, model: Any, q: Any, v: Any, directions: Mapping[str, tuple[np.ndarray, list[str]]], on_singular: str = "raise",
        damping: float = 0.02,
    ):  # fmt: skip
        self._model, self._directions = model, {frame: rows for frame, (rows, _) in directions.items()}
        self._damping, self._masked = damping_of(on_singular, damping), on_singular == "nan"
        self._names = tuple(name for _, called in directions.values() for name in called)
        whole = [model.jacobian(frame, q) for frame in self._directions]
        rates = [rows @ model.jacobian_dot(frame, q, v) for frame, rows in self._directions.items()]
        q, v = (np.asarray(getattr(x, name, x), float) for x, name in ((q, "q"), (v, "v")))
        self._batch = np.broadcast_shapes(whole[0].shape[:-2], rates[0].shape[:-2], v.shape[:-1])
        self._q, self._v = (np.broadcast_to(x, (*self._batch, x.shape[-1])) for x in (q, v))
        self._jacobian = self._stacked([rows @ J for rows, J in zip(self._directions.values(), whole, strict=True)])
        self._rate = self._stacked(rates)
        # size of the terms in the row of each direction, to distinguish rounding of no motion from motion
        halves = [np.abs(J).reshape(*J.shape[:-2], 2, 3 * model.nv).max(axis=-1, initial=0.0) for J in whole]  # angular, linear
        sizes = [np.repeat(half, 3, axis=-1)[..., None] for half in halves]
        self._size = self._stacked([np.abs(rows) @ size for rows, size in zip(self._directions.values(), sizes, strict=True)])[..., 0]

    def _stacked(self, parts: Sequence[np.ndarray]) -> np.ndarray:
        """Return the arrays of the frames stacked, for every state."""
        return np.concatenate([np.broadcast_to(x, (*self._batch, *x.shape[-2:])) for x in parts], axis=-2)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the directions."""
        return self._names

    @property
    def jacobian(self) -> np.ndarray:
        """(k, nv)"""
        return self._jacobian

    @property
    def velocity(self) -> np.ndarray:
        """(k,) J v, rad/s and m/s."""
        return np.einsum("...ij,...j->...i", self._jacobian, self._v)

    # ------------------------------------------------------------------ through the articulated bodies
    @cached_property
    def _by_recursion(self) -> np.ndarray | None:
        """Return C B*ΩB C* (..., k, k); None if kernels are unreliable."""
        found = self._model._calls().operational_space(False, list(self._directions), self._q)
        if found is None:
            return None
        C = np.zeros((len(self._names), found.shape[-1]))
        row = 0
        for i, rows in enumerate(self._directions.values()):
            C[row : row + len(rows), 6 * i : 6 * i + 6] = rows
            row += len(rows)
        return C @ found @ C.T

    @cached_property
    def _factor(self) -> np.ndarray | None:
        """Return R (..., k, k), Λ = R*R; None if the decomposition is needed, for all states of a batch."""
        compliance = None if self._damping else self._by_recursion
        if compliance is None or not self._moving.all():
            return None
        units = np.sqrt(np.diagonal(compliance, axis1=-2, axis2=-1))[..., None]
        with np.errstate(all="ignore"):
            scaled = compliance / (units * np.swapaxes(units, -1, -2))
        try:
            lower = np.linalg.cholesky(scaled)
        except np.linalg.LinAlgError:
            return None
        if not (np.diagonal(lower, axis1=-2, axis2=-1) ** 2 >= SHARED).all():
            return None
        return np.linalg.inv(lower) / np.swapaxes(units, -1, -2)

    @property
    def _moving(self) -> np.ndarray:
        """Directions that move at all, (..., k): rows of J above the rounding of the terms of their sums."""
        return np.abs(self._jacobian).max(axis=-1, initial=0.0) > 64 * max(self._model.nv, 6) * np.finfo(float).eps * self._size

    @cached_property
    def _answers(self) -> np.ndarray:
        """Return Y = (ℳ + J_rotors)⁻¹J* (..., nv, k)."""
        H, phi, M, J = self._model.soa("H phi M J")
        inverse = (H @ phi @ M @ phi.T @ H.T + J).inv()
        return np.asarray(inverse.at(self._q) @ np.swapaxes(self._jacobian, -1, -2))

    # ------------------------------------------------------------------ the decomposition
    @cached_property
    def _parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return L⁻* (..., nv, nv), units d (..., k), and U, σ, V* of W/d."""
        lower = cholesky(
            self._model.mass_matrix(self._q), f"the mass matrix of {self._model.name!r}", "the task space needs its Cholesky factor"
        )
        back = np.swapaxes(np.linalg.solve(lower, np.broadcast_to(np.eye(lower.shape[-1]), lower.shape)), -1, -2)
        W = self._jacobian @ back
        units = np.linalg.norm(W, axis=-1)
        size = np.abs(self._jacobian).max(axis=-1, initial=0.0) * np.abs(back).max(axis=(-1, -2), initial=0.0)[..., None]
        moving = self._moving & (units > 64 * W.shape[-1] * np.finfo(float).eps * size)
        units = np.where(moving, units, np.inf)  # a direction that does not move at all has no row
        U, sigma, Vt = np.linalg.svd(W / units[..., None], full_matrices=False)
        return back, units, U, sigma, Vt

    @cached_property
    def _kept(self) -> np.ndarray:
        """Singular values above rounding."""
        sigma = self._parts[3]
        return sigma > 16 * max(sigma.shape[-1], self._model.nv) * np.finfo(float).eps * sigma.max(axis=-1, initial=0.0)[..., None]

    @property
    def rank(self) -> Any:
        """Number of directions that can move independently: an integer, for a batch (B,)."""
        count = np.full(self._batch, len(self._names)) if self._factor is not None else self._kept.sum(axis=-1)
        return int(count) if count.ndim == 0 else count

    @property
    def lost(self) -> Any:
        """Lost directions: a list of combinations of directions, each a dictionary from names to shares; for a batch a list of such lists.

        Combinations are of the directions in their units: the mechanism cannot move along any of them.
        """
        if self._factor is not None:
            return [[] for _ in range(self._batch[0])] if self._batch else []
        if not self._batch:
            return self._lost_of(self._parts[1], self._parts[2], self._kept)
        return [self._lost_of(*one) for one in zip(self._parts[1], self._parts[2], self._kept, strict=True)]

    def _lost_of(self, units: np.ndarray, U: np.ndarray, kept: np.ndarray) -> list[dict[str, float]]:
        still = np.flatnonzero(np.isinf(units))
        found = [{self._names[i]: 1.0} for i in still]
        moving = np.flatnonzero(np.isfinite(units))
        basis = U[np.ix_(moving, np.flatnonzero(kept))]
        rest = np.linalg.svd(basis, full_matrices=True)[0][:, basis.shape[1] :] if basis.shape[1] else np.eye(len(moving))
        for column in rest.T:
            shares = column / units[moving]
            shares = shares / shares[np.abs(shares).argmax()]
            found.append({self._names[moving[i]]: float(shares[i]) for i in np.argsort(-np.abs(shares)) if abs(shares[i]) >= 0.05})
        return found

    @property
    def singular(self) -> Any:
        """True if some directions cannot move independently, to rounding: a bool, for a batch (B,)."""
        return self.rank < len(self._names)

    def _pseudo_inverse(self) -> np.ndarray:
        """Return W⁺ (..., nv, k); damped, V σ/σ₊² U*/d."""
        _, units, U, sigma, Vt = self._parts
        if self._damping:
            inverse = sigma / np.maximum(sigma, self._damping) ** 2
        else:
            inverse = np.where(self._kept, 1 / np.where(self._kept, sigma, 1.0), 0.0)
        return self._shown(np.swapaxes(Vt, -1, -2) * inverse[..., None, :] @ np.swapaxes(U, -1, -2) / units[..., None, :], 2)

    def _shown(self, of: np.ndarray, axes: int) -> np.ndarray:
        """Put NaN at singular states if requested."""
        if not self._masked or self._factor is not None:
            return of
        return np.where(np.reshape(self.singular, (*self._batch, *[1] * axes)), np.nan, of)

    def _inertia(self) -> np.ndarray:
        """Return Λ (..., k, k): by the factor, damped, or for the directions that move."""
        if (inverse := self._factor) is not None:
            return np.swapaxes(inverse, -1, -2) @ inverse
        if self._damping:
            _, units, U, sigma, _ = self._parts
            turned = U / (units[..., :, None] * np.maximum(sigma, self._damping)[..., None, :])
            inertia = turned @ np.swapaxes(turned, -1, -2)
            if U.shape[-1] < U.shape[-2]:  # more directions than coordinates: the remaining ones do not move
                rest = (np.eye(U.shape[-2]) - U @ np.swapaxes(U, -1, -2)) / self._damping**2
                inertia = inertia + rest / (units[..., :, None] * units[..., None, :])
            return inertia
        inverse = self._pseudo_inverse()
        return np.swapaxes(inverse, -1, -2) @ inverse

    # ------------------------------------------------------------------ results
    @property
    def compliance(self) -> np.ndarray:
        """Return Λ⁻¹ = J(ℳ + J)⁻¹J* (k, k): accelerations by forces."""
        if self._by_recursion is not None:
            return self._by_recursion
        W = self._jacobian @ self._parts[0]
        return W @ np.swapaxes(W, -1, -2)

    @property
    def inertia(self) -> np.ndarray:
        """Return Λ (k, k). SingularOperatorError with "raise" if not all directions can move independently, with the lost ones."""
        if self._factor is None:
            self._require_full("Λ")
        return self._inertia()

    def _require_full(self, what: str) -> None:
        if self._masked or self._damping:
            return
        short = np.atleast_1d(self.rank) < len(self._names)
        if short.any():
            b = int(short.argmax())
            lost, at = (self.lost, "this state") if not self._batch else (self.lost[b], f"state {b} of a batch of {len(short)}")
            more = "; on_singular='nan' or 'damped' keeps the other states" if self._batch else ""
            raise _core.SingularOperatorError(
                f"{what} does not exist at {at}: of {', '.join(self._names)} no motion along {told(lost)}{more}"
            )

    # ------------------------------------------------------------------ derivatives
    @property
    def jacobian_derivative(self) -> np.ndarray:
        """Return ∂J (k, nv, nv), the last axis the coordinate of the derivative, on ball and free hinges a quasi-velocity. O(N +
        depth²)."""
        parts = [
            np.einsum("ij,...jkl->...ikl", rows, self._model.jacobian_derivative(of, self._q)) for of, rows in self._directions.items()
        ]
        return np.concatenate(parts, axis=-3)

    @property
    def compliance_derivative(self) -> np.ndarray:
        """Return ∂(Λ⁻¹) = ∂J Y + (∂J Y)* - Y*∂ℳ Y (k, k, nv), the last axis the coordinate.

        Y*∂ℳ are second derivatives of inverse dynamics, by q and v̇, contracted with Y: O(N nv k).
        """
        Y, states = self._answers, self._batch or (1,)
        n, k = Y.shape[-2:]
        moved = np.einsum("...ijl,...jm->...iml", self.jacobian_derivative, Y)
        core, rest = cached(self._model, "_curvature", _core.Curvature), np.zeros((*states, n))
        along = core.inverse_dynamics(
            self._q.reshape(*states, self._q.shape[-1]), rest, rest, np.swapaxes(Y, -1, -2).reshape(*states, k, n).copy(), "double"
        )
        of_mass = np.einsum("...ilj,...jm->...iml", along[:, :, 2].reshape(*self._batch, k, n, n), Y)  # ∂ of Y*ℳ along l, times Y
        return moved + np.swapaxes(moved, -2, -3) - (of_mass + np.swapaxes(of_mass, -2, -3)) / 2

    @property
    def inertia_derivative(self) -> np.ndarray:
        """Return ∂Λ = -Λ ∂(Λ⁻¹) Λ (k, k, nv), the last axis the coordinate. SingularOperatorError as `inertia`; refused if damped."""
        if self._damping:
            raise _core.EvaluationError("a damped Λ has no derivative where singular values cross the damping; use on_singular='nan'")
        inertia = self.inertia
        return -np.einsum("...ij,...jkl,...km->...iml", inertia, self.compliance_derivative, inertia)

    @property
    def dynamically_consistent_inverse(self) -> np.ndarray:
        """Return J̄ (nv, k): the velocities of least kinetic energy that move the nodes so; if directions are lost, along the others."""
        if self._factor is not None:
            return self._answers @ self.inertia
        return self._parts[0] @ self._pseudo_inverse()

    @property
    def null_space(self) -> np.ndarray:
        """Return N = 1 - J̄J (nv, nv): velocities Nv do not move the nodes along any direction; hinge forces N*τ do not accelerate them."""
        return np.eye(self._model.nv) - self.dynamically_consistent_inverse @ self._jacobian

    def bias(self, tau: Any = None) -> np.ndarray:
        """Return J v̇₀ + J̇v (k,): accelerations without forces on the nodes, under hinge forces τ (default: zero) and gravity."""
        vdot = self._model.forward_dynamics(self._q, self._v, tau)
        return np.einsum("...ij,...j->...i", self._jacobian, vdot) + np.einsum("...ij,...j->...i", self._rate, self._v)

    def acceleration(self, force: Any, tau: Any = None) -> np.ndarray:
        """Return ẍ (k,) under forces F (k,) on the nodes, and τ: forward dynamics of the task."""
        return np.einsum("...ij,...j->...i", self.compliance, self._vector(force, "force")) + self.bias(tau)

    def force(self, acceleration: Any, tau: Any = None) -> np.ndarray:
        """Return the forces F (k,) on the nodes that produce ẍ: inverse dynamics of the task. SingularOperatorError as `inertia`."""
        return np.einsum("...ij,...j->...i", self.inertia, self._vector(acceleration, "acceleration") - self.bias(tau))

    def torques(self, acceleration: Any, tau: Any = None) -> np.ndarray:
        """Return hinge forces (nv,) that give the nodes ẍ and otherwise equal τ: N*τ + J*Λ(ẍ - J̇v + J(ℳ + J)⁻¹𝒞), with the bias forces 𝒞.

        SingularOperatorError for an acceleration along a lost direction.
        """
        wanted = self._vector(acceleration, "acceleration")
        short = wanted - self.bias(tau)
        force = np.einsum("...ij,...j->...i", self._inertia(), short)
        left = short - np.einsum("...ij,...j->...i", self.compliance, force)
        if not self._masked and np.any(np.abs(left) > 1e-8 * np.maximum(1.0, np.abs(wanted).max(initial=0.0))):
            self._require_full("an acceleration with parts along lost directions")
        given = np.zeros(self._model.nv) if tau is None else np.asarray(tau, float)
        return given + np.einsum("...ji,...j->...i", self._jacobian, force)

    def _vector(self, given: Any, what: str) -> np.ndarray:
        x = _core.real_array(given, what)
        if x.ndim == 0 or x.shape[-1] != len(self._names):
            raise _core.ModelError(f"{what} takes {len(self._names)} values, of {', '.join(self._names)}; it has shape {x.shape}")
        if not np.isfinite(x).all():
            raise _core.ModelError(f"{what}: entry {self._names[int(np.argwhere(~np.isfinite(x))[0, -1])]!r} is not finite")
        return x

    def __repr__(self) -> str:
        many = "" if self._jacobian.ndim == 2 else f", {len(self._jacobian)} states"
        return f"<task space of {self._model.name!r}: {', '.join(self._names[:12])}{', ...' if len(self._names) > 12 else ''}{many}>"


def told(lost: Iterable[Mapping[str, float]]) -> str:
    """Return directions in words: "hand.x", "hand.x - 0.5 hand.rz"."""
    each = []
    for named in lost:
        parts = [
            f"{'- ' if share < 0 else '+ '}{'' if abs(abs(share) - 1) < 5e-3 else f'{abs(share):.2g} '}{name}"
            for name, share in named.items()
        ]
        each.append(" ".join(parts).removeprefix("+ "))
    return "; ".join(each)


class TaskSpaceCalls:
    """The task space of nodes."""

    def task_space(self, frames: Any, q=None, v=None, *, on_singular: str = "raise", damping: float = 0.02) -> TaskSpace:
        """Return the motion of bodies and nodes along directions: inertia, inverse, null space, forward and inverse dynamics.

        Parameters
        ----------
        frames : a name, a list of names, or a dictionary from names to directions
            Directions are names among "rx", "ry", "rz", "x", "y", "z", or user-defined rows (k, 6), in the frame's axes, angular first.
        q, v : (nq,), (nv,), each with an optional leading batch axis
        on_singular : {"raise", "nan", "damped"}
            At states where not all directions can move independently: raise an error with the state's number, return NaN, or use singular
            values of at least `damping` (A. Maciejewski, C. Klein, J. Robotic Systems 5, 1988: numerical filtering).
        damping : the least singular value of W/d, 1 for directions that do not share their motion

        Returns
        -------
        TaskSpace

        Raises
        ------
        ModelError
            Unknown names, a frame named twice, invalid or dependent directions.

        Source: task (operational) space by the operator Ω [Jain 2011]; O. Khatib, A unified approach for motion and force control of robot
        manipulators: the operational space formulation, IEEE J. Robotics and Automation 3 (1987).

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(3)
        >>> tip = arm.task_space({"body2": ["x", "y"]}, [0.0, 0.5, 1.0])
        >>> tip.inertia.round(3).tolist()
        [[2.555, -1.597], [-1.597, 2.596]]
        >>> arm.task_space({"body2": ["x", "y", "z"]}, [0.0, 0.5, 1.0]).lost
        [{'body2.z': 1.0}]
        """
        model: Any = self
        q, v = at_state(model, q, v)
        return TaskSpace(model, q, v, {frame: _rows(frame, directions) for frame, directions in _listed(frames)}, on_singular, damping)


def _listed(frames: Any) -> list[tuple[str, Any]]:
    if isinstance(frames, Mapping):
        pairs = list(frames.items())
    else:
        pairs = [(one, TWIST) for one in several(frames)]
    named = [(text(getattr(frame, "name", frame), "a frame"), directions) for frame, directions in pairs]
    if not named:
        raise _core.ModelError("a task space needs frames: name at least one body or node")
    for i, (frame, _) in enumerate(named):
        if frame in [other for other, _ in named[:i]]:
            raise _core.ModelError(f"frame {frame!r} is named twice; give its directions together, as {{{frame!r}: ['x', 'y']}}")
    return named


def _rows(frame: str, directions: Any) -> tuple[np.ndarray, list[str]]:
    named = several(directions)
    if all(isinstance(one, str) for one in named):
        unknown = [one for one in named if one not in TWIST]
        if unknown or not named or len(set(named)) < len(named):
            raise _core.ModelError(
                f"directions of {frame!r} must be different ones of {', '.join(TWIST)}, or rows (k, 6); not {named!r:.80}"
            )
        return np.eye(6)[[TWIST.index(one) for one in named]], [f"{frame}.{one}" for one in named]
    rows = np.atleast_2d(_core.real_array(directions, f"directions of {frame!r}"))
    if rows.ndim != 2 or rows.shape[1] != 6 or not len(rows):
        raise _core.ModelError(f"directions of {frame!r} must be rows (k, 6), not {np.shape(directions)}")
    if not np.isfinite(rows).all():
        raise _core.ModelError(f"directions of {frame!r}: row {int(np.argwhere(~np.isfinite(rows))[0, 0])} is not finite")
    if np.linalg.matrix_rank(rows) < len(rows):
        raise _core.ModelError(f"directions of {frame!r}: the {len(rows)} rows are linearly dependent; omit the redundant ones")
    sizes = np.abs(rows).max(axis=1)
    if (out := (sizes < 1 / LARGEST_ROW) | (sizes > LARGEST_ROW)).any():
        row = int(out.argmax())
        raise _core.ModelError(f"directions of {frame!r}: row {row}, of size {sizes[row]:.3g}, overflows: use other units")
    return rows, [f"{frame}.{i}" for i in range(len(rows))]
