"""Hybrid dynamics: motion prescribed at some coordinates, forces given at the others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..arguments import chosen, several, text
from ..state import at_state
from .cholesky import cholesky
from .prepared_states import refuse_other_states
from .threads import over_threads

KEPT = 16
"""Number of sets of prescribed hinges with cached workspaces: switching back to a cached set is free."""


HYBRID_OPTIONS = ("prescribed", "form", "refine", "residual", "precision")
"""Options of a prepared call."""


class HybridMotion(NamedTuple):
    """Accelerations and generalized forces of all coordinates, (nv,) or (B, nv) each."""

    vdot: np.ndarray
    tau: np.ndarray


class HybridDerivatives(NamedTuple):
    """Derivatives of the results of hybrid dynamics by its arguments, each (nv, nv) or (B, nv, nv), rows and columns by coordinate.

    Columns by tau are zero at prescribed coordinates, and columns by vdot at free ones.

    vdot_q, vdot_v, vdot_tau, vdot_vdot : of the accelerations; rows of prescribed coordinates are zero, except unit rows of vdot_vdot
    tau_q, tau_v, tau_tau, tau_vdot : of the forces; rows of free coordinates are zero, except unit rows of tau_tau
    """

    vdot_q: np.ndarray
    vdot_v: np.ndarray
    vdot_tau: np.ndarray
    vdot_vdot: np.ndarray
    tau_q: np.ndarray
    tau_v: np.ndarray
    tau_tau: np.ndarray
    tau_vdot: np.ndarray


def prescribed_names(prescribed: Any, option: str = "prescribed") -> tuple[str, ...]:
    """Return names of hinges or coordinates, given as one or several names or handles; `option`: its name, for errors."""
    names = tuple(getattr(one, "name", one) for one in several(prescribed))
    for name in names:
        if not isinstance(name, str):
            raise _core.ModelError(f"{option} takes names of hinges or coordinates, or a list of them, not {name!r:.80}")
        text(name, "what is prescribed" if option == "prescribed" else option)
    return names


def hybrid_of(model: Any, prescribed: Any) -> _core.HybridDynamics:
    """Return the solver for these prescribed coordinates, cached until the model is edited or others displace it."""
    names = prescribed_names(prescribed)
    kept = model.__dict__.setdefault("_hybrid", {})
    key = (names, model._parameters)
    if key not in kept:
        made = _core.HybridDynamics(model, names)
        while kept and (len(kept) >= KEPT or next(iter(kept))[1] != model._parameters):
            del kept[next(iter(kept))]
        kept[key] = made
    return kept[key]


class PreparedHybrid:
    """The prepared call of hybrid dynamics, from `Multibody.prepare`, with the options of the call. It copies and pickles with its
    model."""

    def __init__(self, model: Any, states: int | None, options: dict[str, Any]):
        defaults: dict[str, Any] = {"prescribed": (), "form": "fast", "refine": 0, "residual": "same", "precision": "double"}
        self._model, self._states, self._options = model, states, defaults | options
        self._options["prescribed"] = prescribed_names(self._options["prescribed"])  # once, as the listed objects may be gone later
        self._ready = self._made()
        self.__name__ = self.__qualname__ = "prepared_hybrid_dynamics"
        each = "one state" if states is None else f"{states} states"
        self.__doc__ = f"hybrid_dynamics(q, v, tau, vdot) of '{model.name}', {each} a call."

    def _made(self) -> _core.PreparedHybridDynamics:
        how = {name: self._options[name] for name in HYBRID_OPTIONS[1:]}
        return hybrid_of(self._model, self._options["prescribed"]).prepared(**how, states=-1 if self._states is None else self._states)

    def __call__(self, *given: Any) -> HybridMotion:
        if len(given) != 4:
            raise TypeError(f"a prepared hybrid_dynamics takes q, v, tau, vdot; it was given {len(given)} arguments")
        found = self._ready(*given)
        if found is None:
            refuse_other_states("hybrid_dynamics", self._states, given)
            self._ready = self._made()  # for the model as it is now
            return self._model.hybrid_dynamics(*given, **self._options)
        return HybridMotion._make(found)

    def __reduce__(self):
        return PreparedHybrid, (self._model, self._states, self._options)


class HybridCalls:
    """Hybrid dynamics and its derivatives."""

    nv: int
    inverse_dynamics_derivatives: Callable[..., Any]

    @over_threads
    def hybrid_dynamics(
        self, q=None, v=None, tau=None, vdot=None, prescribed: Any = (), *, form: str = "fast", refine: int | str = 0,
        residual: str = "same", precision: str | int = "double", threads: int = 1,
    ) -> HybridMotion:  # fmt: skip
        """Return accelerations where forces are given, forces where accelerations are: O(N).

        ℳ(q) v̇ + 𝒞(q, v) = τ with v̇ given at the prescribed coordinates and τ at the free ones, gravity and rotor inertia included. With
        no prescribed coordinate it equals `forward_dynamics`, with all of them `inverse_dynamics`, bit for bit. The set may change from
        call to call.

        Parameters
        ----------
        q, v : (nq,), (nv,), each with an optional leading batch axis; v of all coordinates, including prescribed ones
        tau : (nv,), N m and N; entries of prescribed coordinates are ignored, but must be finite. Default: zero.
        vdot : (nv,), rad/s² and m/s²; entries of free coordinates are ignored, but must be finite. Default: zero.
        prescribed : names of hinges, coordinates or patterns, or a list of them
            A subhinge of several coordinates (a ball) is prescribed as a whole. Locked hinges and welds, which have no coordinates, may be
            among them.
        form, refine, residual, precision : as in `forward_dynamics`, for the solution of the free coordinates

        Returns
        -------
        HybridMotion : vdot and tau complete

        Raises
        ------
        ModelError
            An unknown name, a coordinate that is prescribed twice, part of a ball or free subhinge.
        SingularHingeError, RefinementError
            As `forward_dynamics`, for free coordinates: a coordinate that feels no inertia may be prescribed.

        Source: hybrid (prescribed motion) dynamics [Jain 2011]; as operators `arm.soa.free(...)` and `arm.soa.prescribed(...)`.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> motion = arm.hybrid_dynamics([0, 0], [0, 0], tau=[1, 0], vdot=[0, 2], prescribed="hinge1")
        >>> motion.vdot.round(3).tolist(), motion.tau.round(3).tolist()
        ([-0.25, 2.0], [1.0, 0.458])
        """
        q, v = at_state(self, q, v)
        tau, vdot = (np.zeros(self.nv) if x is None else x for x in (tau, vdot))
        return HybridMotion(*hybrid_of(self, prescribed)(q, v, tau, vdot, form, refine, chosen(residual, "residual"), precision, threads))

    @over_threads
    def hybrid_dynamics_derivatives(
        self, q=None, v=None, tau=None, vdot=None, prescribed: Any = (), *, form: str = "fast", refine: int | str = 0,
        residual: str = "same", precision: str = "double", threads: int = 1,
    ) -> HybridDerivatives:  # fmt: skip
        """Return derivatives of `hybrid_dynamics`; arguments and errors are the same.

        With T_q and T_v the derivatives of inverse dynamics at the accelerations found, and rows and columns f free and p prescribed,

            δv̇_f = ℳ_ff⁻¹ (δτ_f - T_q,f δq - T_v,f δv - ℳ_fp δv̇_p),   δτ_p = T_q,p δq + T_v,p δv + ℳ_pf δv̇_f + ℳ_pp δv̇_p

        Derivatives by q are along quasi-velocities, as everywhere. O(N · depth + nv³), the last term by a Cholesky factor of ℳ_ff.
        """
        prescribed = prescribed_names(prescribed)  # once, as the listed objects may be gone later
        motion = self.hybrid_dynamics(
            q, v, tau, vdot, prescribed, form=form, refine=refine, residual=residual, precision=precision, threads=threads
        )
        q, v = at_state(self, q, v)
        T_q, T_v, mass = self.inverse_dynamics_derivatives(q, v, motion.vdot, precision=precision)
        return _derivatives(T_q, T_v, mass, np.array(hybrid_of(self, prescribed).prescribed, bool))


def _derivatives(T_q: np.ndarray, T_v: np.ndarray, mass: np.ndarray, held: np.ndarray) -> HybridDerivatives:
    """Return the derivatives, with C-contiguous matrices in every product: BLAS multiplies others differently, and a state has the bits
    that it has alone."""
    f, p = np.flatnonzero(~held), np.flatnonzero(held)
    shape = np.broadcast_shapes(T_q.shape, mass.shape)
    found = {name: np.zeros(shape) for name in HybridDerivatives._fields}
    rows, columns = (..., f[:, None], f), (..., f[:, None], p)
    if len(f):
        all_coordinates = np.arange(shape[-1])
        sides = [T_q[..., f[:, None], all_coordinates], T_v[..., f[:, None], all_coordinates], mass[columns]]
        unit = np.broadcast_to(-np.eye(len(f)), (*shape[:-2], len(f), len(f)))
        lower = cholesky(mass[rows], "the mass matrix of the free coordinates", "its Cholesky factor does not exist")
        solved = -np.linalg.solve(np.swapaxes(lower, -1, -2), np.linalg.solve(lower, np.concatenate([*sides, unit], axis=-1)))
        n = shape[-1]
        found["vdot_q"][..., f, :] = solved[..., :n]
        found["vdot_v"][..., f, :] = solved[..., n : 2 * n]
        found["vdot_vdot"][columns] = solved[..., 2 * n : 2 * n + len(p)]
        found["vdot_tau"][rows] = solved[..., 2 * n + len(p) :]
        found["tau_tau"][..., f, f] = 1.0
    if len(p):
        pf = np.ascontiguousarray(mass[..., p[:, None], f])

        def carried(block: np.ndarray) -> np.ndarray:
            return pf @ np.ascontiguousarray(block)

        found["vdot_vdot"][..., p, p] = 1.0
        found["tau_q"][..., p, :] = T_q[..., p, :] + carried(found["vdot_q"][..., f, :])
        found["tau_v"][..., p, :] = T_v[..., p, :] + carried(found["vdot_v"][..., f, :])
        found["tau_tau"][..., p[:, None], f] = carried(found["vdot_tau"][rows])
        found["tau_vdot"][..., p[:, None], p] = mass[..., p[:, None], p] + carried(found["vdot_vdot"][columns])
    return HybridDerivatives(**found)
