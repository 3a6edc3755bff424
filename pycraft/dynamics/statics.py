"""Statics: equilibria of a model, and the forces that hold it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..arguments import first_not_finite, of_state, switch
from ..state import at_state
from .equilibrium import TOLERANCE, Balance, Equilibrium, solved
from .equilibrium_on_loops import solved_on_loops
from .hybrid import prescribed_names
from .interbody import pushed
from .inverse_on_loops import actuated_coordinates, beyond, check_on_loops, shared_out


class Counterbalance(NamedTuple):
    """Forces that hold a model at rest.

    tau : (nv,) or (B, nv) N m and N, zero at coordinates that are not actuated
    residual : likewise, the unbalanced part: the least that any forces of these actuators and of the loops leave
    unbalanced : names of coordinates with a residual beyond rounding, at any of the states
    """

    tau: np.ndarray
    residual: np.ndarray
    unbalanced: tuple[str, ...]


def held_by(model: Any, hold: Any) -> list[int]:
    """Return the numbers of held coordinates, by the rule for prescribed ones in hybrid dynamics."""
    return np.flatnonzero(_core.prescribed_by(model, prescribed_names(hold, "hold"), "hold")).tolist()


class StaticsCalls:
    """Equilibria of a model and forces that hold it."""

    nv: int

    def equilibrium(
        self, tau: Any = None, q0: Any = None, *, wrenches: Mapping[Any, Any] | None = None, wrench_axes: str = "world", hold: Any = (),
        limits: bool = False, stable: bool = False, tolerance: float = TOLERANCE, loops: bool = False,
    ) -> Any:  # fmt: skip
        """Return a configuration at which the model stays at rest: τ = T(q, 0, 0), gravity and wrenches included.

        The search starts at q0 and uses SciPy's `root` and `least_squares` with the exact derivative of T, on displacements of the group
        (including ball and free hinges). Of several equilibria it returns the one that the solver reaches, usually one near q0; with
        stable=True the model first descends along the slope of its forces, and returns to the equilibrium after small displacements.

        Parameters
        ----------
        tau : (nv,) N m and N, or (B, nv), or one value for all: constant generalized forces; default: zero
        q0 : (nq,) or a State, the start of the search, or (B, nq); default: the model's present state
        wrenches, wrench_axes : as in `interbody_forces`; in the world's axes they keep their direction as the model moves
        hold : names of hinges, coordinates or patterns, or a list of them, that keep their values in q0, each once
            Locked hinges and welds stay as they are, named or not; the rule is the same as for `hybrid_dynamics(prescribed=)`.
        limits : whether q must be within the hinges' limits
        stable : whether to accept only a stable or indifferent equilibrium
        tolerance : largest residual, relative to the largest force
        loops : whether to keep the loops: the search starts at the state on them near q0, and their forces are included in the balance

        Returns
        -------
        Equilibrium, or a list of them for a batch: with its stability and modes

        Raises
        ------
        EvaluationError
            No equilibrium was found, with the residual by coordinate; no stable one.
        ModelError
            Unknown names; values that are not finite.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(1)
        >>> arm.gravity = (0, -10, 0)
        >>> found = arm.equilibrium(tau=[2.5], q0=[-1.0])  # half the torque that holds it level
        >>> found.q.round(6).tolist(), found.stability  # π/3 below
        ([-1.047198], 'stable')
        """
        model: Any = self
        limits, stable, loops = switch(limits, "limits"), switch(stable, "stable"), switch(loops, "loops")
        q0, _ = at_state(model, q0)
        tau = np.zeros(self.nv) if tau is None else tau
        given = np.asarray(_core.real_array(tau, "tau"), float)
        given = np.full(self.nv, given) if given.ndim == 0 else given
        names, in_world, numbers = pushed(wrenches, wrench_axes)
        held = held_by(model, hold)
        starts = np.asarray(_core.real_array(q0, "q"), float)
        if starts.ndim not in (1, 2) or starts.shape[-1] != model.nq:
            raise _core.ModelError(
                f"q of {model.name!r} takes {model.nq} numbers, or (B, {model.nq}) for a batch, not an array {starts.shape}"
            )
        if given.ndim not in (1, 2) or given.shape[-1] != self.nv:
            raise _core.ModelError(
                f"tau of {model.name!r} takes {self.nv} numbers, or (B, {self.nv}) for a batch, not an array {given.shape}"
            )
        if bad := first_not_finite(given):
            raise _core.ModelError(f"tau of {model.name!r} is not finite at {model.coordinate_names[bad[0][0]]!r}{bad[2]}")
        states = [x.shape[0] for x, axes in ((starts, 2), (given, 2), (numbers, 3)) if x.ndim == axes]
        if len(set(states)) > 1:
            raise _core.ModelError(f"batches of {' and '.join(map(str, sorted(set(states))))} states in one call")

        def one(q: np.ndarray, force: np.ndarray, pushes: np.ndarray) -> Equilibrium:
            weight = model.mass * float(np.linalg.norm(model.gravity))
            size = max(weight, np.abs(force).max(initial=0.0), np.abs(pushes).max(initial=0.0))

            def at(q: np.ndarray) -> Balance:
                return _at_rest(model, q, force, names, in_world, pushes, size)

            if loops:
                return solved_on_loops(model, at, q, model.loops, held, bool(limits), bool(stable), tolerance)
            return solved(model, at, q, held, bool(limits), bool(stable), tolerance)

        if not states:
            return one(starts, given, numbers)
        rows = [np.broadcast_to(x, (states[0], *x.shape[-axes:])) for x, axes in ((starts, 1), (given, 1), (numbers, 2))]
        found = []
        for b, each in enumerate(zip(*rows, strict=True)):
            with of_state(b, states[0]):
                found.append(one(*each))
        return found

    def counterbalance(
        self, q=None, *, wrenches: Mapping[Any, Any] | None = None, wrench_axes: str = "world", actuated: Any = None,
        tolerance: float = TOLERANCE, loops: bool | None = None,
    ) -> Counterbalance:  # fmt: skip
        """Return the generalized forces that hold the model at rest against gravity and wrenches, T(q, 0, 0): O(N).

        For a model with loops τ + Q*λ = T: the loops carry what they can, and τ has the least Σ τ² if several forces hold the model.
        `constrained_inverse_dynamics` at rest also returns λ.

        Parameters
        ----------
        q : (nq,) or (B, nq), or a State; default: the model's present state
        wrenches, wrench_axes : as in `interbody_forces`
        actuated : names of hinges, coordinates or patterns, or a list of them, of driven coordinates; None: all
            A force at one coordinate balances another only through loops, so forces needed at other coordinates remain as the residual.
        tolerance : largest residual, relative to the largest force
        loops : whether the loops carry their part, at a q on them; None: if the model has loops. False: forces of the tree alone.

        Raises ModelError for unknown names and a q that is off the loops, by the row, EvaluationError for an invalid tolerance, and the
        errors of `interbody_forces`.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.gravity = (0, -10, 0)
        >>> arm.counterbalance([0, 0]).tau.tolist()
        [20.0, 5.0]
        >>> arm.counterbalance([0, 0], actuated="hinge0").unbalanced
        ('hinge1',)
        """
        model: Any = self
        q, _ = at_state(model, q)
        still, (names, in_world, numbers) = np.zeros(self.nv), pushed(wrenches, wrench_axes)
        f, _, needed, _ = model._interbody().after(q, still, still, names, in_world, numbers, False, "double")
        driven = actuated_coordinates(model, actuated)
        keep = bool(model.loops.rows) if loops is None else switch(loops, "loops")
        if keep:
            check_on_loops(model, np.asarray(_core.real_array(q, "q"), float))
            tau, left = shared_out(model.loops.jacobian(q), needed, driven)[:2]
        else:
            tau, left = np.where(driven, needed, 0.0), np.where(driven, 0.0, needed)
        return Counterbalance(tau, left, beyond(model, left, needed, f, numbers, tolerance))


def _at_rest(
    model: Any, q: np.ndarray, tau: np.ndarray, names: list[str], in_world: bool, wrenches: np.ndarray, size: float
) -> Balance:  # fmt: skip
    still = np.zeros(model.nv)
    if names:
        needed = model._interbody().after(q, still, still, names, in_world, wrenches, False, "double")[2]
        along_q, mass = model._interbody().derivatives(q, still, still, names, in_world, wrenches, True)[1][0], model.mass_matrix(q)
    else:
        needed, (along_q, _, mass) = model.inverse_dynamics(q, still, still), model.inverse_dynamics_derivatives(q, still, still)
    return Balance(tau - needed, -along_q, mass, max(size, np.abs(needed).max(initial=0.0)))
