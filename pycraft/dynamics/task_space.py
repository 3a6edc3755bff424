"""Task space: the equations of motion of nodes, along all of their directions or some."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from ..arguments import text
from ..closed import Closed
from ..state import at_state

TWIST = ("rx", "ry", "rz", "x", "y", "z")
"""Directions of a frame in its own axes, angular first."""


class TaskSpace(Closed):
    """The motion of nodes along some directions at a state, or at each of a batch: ẍ = Λ⁻¹F + J v̇₀ + J̇v.

    ẋ = J v are the components of the nodes' velocities along the directions, each in its frame's own axes, F the forces on the nodes along
    them, and v̇₀ what gravity, velocities and hinge forces τ make of the accelerations by themselves. With ℳ + J_rotors = LL* and W = J L⁻*
    all is W's singular value decomposition, rows in units in which each direction alone has unit compliance:

        Λ⁻¹ = WW*,    Λ = (W⁺)*W⁺,    J̄ = L⁻*W⁺ = ℳ⁻¹J*Λ,    N = 1 - J̄J

    so that near singular poses half as many digits are lost as by inverting Λ⁻¹. Everything has a leading axis for a batch. Cost O(nv³) a
    state; Λ alone costs O(N + m² depth), by `Multibody.operational_space_inertia`.

    Attributes
    ----------
    names : of the directions, "hand.x"
    jacobian : (k, nv), of the directions
    velocity : (k,), J v
    """

    def __init__(self, model: Any, q: Any, v: Any, names: Sequence[str], jacobian: np.ndarray, rate: np.ndarray):
        self._model, self._q, self._v = model, q, v
        self._names, self._jacobian, self._rate = tuple(names), jacobian, rate

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

    # ------------------------------------------------------------------ the decomposition
    @cached_property
    def _parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """L⁻* (..., nv, nv), units d (..., k), and U, σ, V* of W/d."""
        mass = self._model.mass_matrix(self._q)
        try:
            lower = np.linalg.cholesky(mass)
        except np.linalg.LinAlgError:
            raise _core.SingularOperatorError(
                f"the mass matrix of {self._model.name!r} is not positive definite to rounding: no task space by its Cholesky factor"
            ) from None
        back = np.swapaxes(np.linalg.solve(lower, np.broadcast_to(np.eye(mass.shape[-1]), mass.shape)), -1, -2)
        W = self._jacobian @ back
        units = np.linalg.norm(W, axis=-1)
        size = np.abs(self._jacobian).max(axis=-1, initial=0.0) * np.abs(back).max(axis=(-1, -2), initial=0.0)[..., None]
        units = np.where(units > 64 * W.shape[-1] * np.finfo(float).eps * size, units, np.inf)  # of what does not move at all: no row
        U, sigma, Vt = np.linalg.svd(W / units[..., None], full_matrices=False)
        return back, units, U, sigma, Vt

    @cached_property
    def _kept(self) -> np.ndarray:
        """Which singular values are more than rounding."""
        sigma = self._parts[3]
        return sigma > 16 * max(sigma.shape[-1], self._model.nv) * np.finfo(float).eps * sigma.max(axis=-1, initial=0.0)[..., None]

    @property
    def rank(self) -> Any:
        """How many directions can move independently: an integer, of a batch (B,)."""
        count = self._kept.sum(axis=-1)
        return int(count) if count.ndim == 0 else count

    @property
    def lost(self) -> Any:
        """What cannot move: a list of combinations of directions, each a dictionary from names to shares; of a batch a list of such lists.

        Combinations are those of the directions in their units: a motion along one of them is no motion of the mechanism.
        """
        if self._jacobian.ndim == 2:
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

    def _pseudo_inverse(self) -> np.ndarray:
        """W⁺ (..., nv, k)."""
        _, units, U, sigma, Vt = self._parts
        inverse = np.where(self._kept, 1 / np.where(self._kept, sigma, 1.0), 0.0)
        return np.swapaxes(Vt, -1, -2) * inverse[..., None, :] @ np.swapaxes(U, -1, -2) / units[..., None, :]

    # ------------------------------------------------------------------ what follows
    @property
    def compliance(self) -> np.ndarray:
        """Λ⁻¹ = J(ℳ + J)⁻¹J* (k, k): accelerations by forces."""
        W = self._jacobian @ self._parts[0]
        return W @ np.swapaxes(W, -1, -2)

    @property
    def inertia(self) -> np.ndarray:
        """Λ (k, k). SingularOperatorError where not all directions can move independently, with those that cannot."""
        self._require_full("Λ")
        inverse = self._pseudo_inverse()
        return np.swapaxes(inverse, -1, -2) @ inverse

    def _require_full(self, what: str) -> None:
        short = np.atleast_1d(self.rank) < len(self._names)
        if short.any():
            b = int(short.argmax())
            lost, at = (self.lost, "this state") if self._jacobian.ndim == 2 else (self.lost[b], f"state {b} of a batch of {len(short)}")
            raise _core.SingularOperatorError(f"{what} does not exist at {at}: of {', '.join(self._names)} no motion along {told(lost)}")

    @property
    def dynamically_consistent_inverse(self) -> np.ndarray:
        """J̄ (nv, k): the velocities of least kinetic energy that move the nodes so; where directions are lost, along the others."""
        return self._parts[0] @ self._pseudo_inverse()

    @property
    def null_space(self) -> np.ndarray:
        """N = 1 - J̄J (nv, nv): velocities that move the nodes along no direction are Nv; N*τ are hinge forces that accelerate none."""
        return np.eye(self._model.nv) - self.dynamically_consistent_inverse @ self._jacobian

    def bias(self, tau: Any = None) -> np.ndarray:
        """J v̇₀ + J̇v (k,): accelerations without forces on the nodes, under hinge forces τ (zero where left out) and gravity."""
        vdot = self._model.forward_dynamics(self._q, self._v, tau)
        return np.einsum("...ij,...j->...i", self._jacobian, vdot) + np.einsum("...ij,...j->...i", self._rate, self._v)

    def acceleration(self, force: Any, tau: Any = None) -> np.ndarray:
        """ẍ (k,) under forces F (k,) on the nodes, and τ: forward dynamics of the task."""
        return np.einsum("...ij,...j->...i", self.compliance, self._vector(force, "force")) + self.bias(tau)

    def force(self, acceleration: Any, tau: Any = None) -> np.ndarray:
        """F (k,) on the nodes that gives them ẍ: inverse dynamics of the task. SingularOperatorError as `inertia`."""
        return np.einsum("...ij,...j->...i", self.inertia, self._vector(acceleration, "acceleration") - self.bias(tau))

    def torques(self, acceleration: Any, tau: Any = None) -> np.ndarray:
        """Hinge forces (nv,) that give the nodes ẍ and are τ else: N*τ + J*Λ(ẍ - J̇v + J(ℳ + J)⁻¹𝒞), with the bias forces 𝒞.

        SingularOperatorError where an acceleration is asked for along what cannot move.
        """
        wanted = self._vector(acceleration, "acceleration")
        short = wanted - self.bias(tau)
        inverse = self._pseudo_inverse()
        force = np.einsum("...ji,...j->...i", inverse, np.einsum("...ij,...j->...i", inverse, short))
        left = short - np.einsum("...ij,...j->...i", self.compliance, force)
        if np.any(np.abs(left) > 1e-8 * np.maximum(1.0, np.abs(wanted).max(initial=0.0))):
            self._require_full("an acceleration with parts along what cannot move")
        given = np.zeros(self._model.nv) if tau is None else np.asarray(tau, float)
        return given + np.einsum("...ji,...j->...i", self._jacobian, force)

    def _vector(self, given: Any, what: str) -> np.ndarray:
        x = _core.real_array(given, what)
        if x.ndim == 0 or x.shape[-1] != len(self._names):
            raise _core.ModelError(f"{what} takes {len(self._names)} numbers, of {', '.join(self._names)}; it has shape {x.shape}")
        return x

    def __repr__(self) -> str:
        many = "" if self._jacobian.ndim == 2 else f", {len(self._jacobian)} states"
        return f"<task space of {self._model.name!r}: {', '.join(self._names[:12])}{', ...' if len(self._names) > 12 else ''}{many}>"


def told(lost: Iterable[Mapping[str, float]]) -> str:
    """Directions in words: "hand.x", "hand.x - 0.5 hand.rz"."""
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

    jacobian: Callable[..., Any]
    jacobian_dot: Callable[..., Any]

    def task_space(self, frames: Any, q=None, v=None) -> TaskSpace:
        """The motion of bodies and nodes along directions: inertia, inverse, null space, forward and inverse dynamics.

        Parameters
        ----------
        frames : a name, a list of names, or a dictionary from names to directions
            Directions are names among "rx", "ry", "rz", "x", "y", "z", or rows (k, 6) of their own, in the frame's axes, angular first.
        q, v : (nq,), (nv,), each with an optional leading batch axis

        Returns
        -------
        TaskSpace

        Raises
        ------
        ModelError
            Names that are not there, a frame named twice, directions that are none, or dependent ones.

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
        names: list[str] = []
        jacobians: list[np.ndarray] = []
        rates: list[np.ndarray] = []
        for frame, directions in _listed(frames):
            rows, called = _rows(frame, directions)
            names += called
            jacobians.append(rows @ self.jacobian(frame, q))
            rates.append(rows @ self.jacobian_dot(frame, q, v))
        v = np.asarray(getattr(v, "v", v), float)
        batch = np.broadcast_shapes(jacobians[0].shape[:-2], rates[0].shape[:-2], v.shape[:-1])
        whole = [np.concatenate([np.broadcast_to(x, (*batch, *x.shape[-2:])) for x in parts], axis=-2) for parts in (jacobians, rates)]
        q = np.asarray(getattr(q, "q", q), float)
        return TaskSpace(model, np.broadcast_to(q, (*batch, q.shape[-1])), np.broadcast_to(v, (*batch, v.shape[-1])), names, *whole)


def _listed(frames: Any) -> list[tuple[str, Any]]:
    if isinstance(frames, Mapping):
        pairs = list(frames.items())
    else:
        several = [frames] if isinstance(frames, str) or not isinstance(frames, Iterable) else list(frames)
        pairs = [(one, TWIST) for one in several]
    named = [(text(getattr(frame, "name", frame), "a frame"), directions) for frame, directions in pairs]
    if not named:
        raise _core.ModelError("a task space of no frames: name one body or node at least")
    for i, (frame, _) in enumerate(named):
        if frame in [other for other, _ in named[:i]]:
            raise _core.ModelError(f"frame {frame!r} is named twice; give its directions together, as {{{frame!r}: ['x', 'y']}}")
    return named


def _rows(frame: str, directions: Any) -> tuple[np.ndarray, list[str]]:
    several = [directions] if isinstance(directions, str) or not isinstance(directions, Iterable) else list(directions)
    if all(isinstance(one, str) for one in several):
        unknown = [one for one in several if one not in TWIST]
        if unknown or not several or len(set(several)) < len(several):
            raise _core.ModelError(f"directions of {frame!r}: different ones of {', '.join(TWIST)}, or rows (k, 6); not {several!r:.80}")
        return np.eye(6)[[TWIST.index(one) for one in several]], [f"{frame}.{one}" for one in several]
    rows = np.atleast_2d(_core.real_array(directions, f"directions of {frame!r}"))
    if rows.ndim != 2 or rows.shape[1] != 6 or not len(rows):
        raise _core.ModelError(f"directions of {frame!r}: rows (k, 6), not {np.shape(directions)}")
    if np.linalg.matrix_rank(rows) < len(rows):
        raise _core.ModelError(f"directions of {frame!r}: the {len(rows)} rows are linearly dependent; leave out what the others say")
    return rows, [f"{frame}.{i}" for i in range(len(rows))]
