"""The search for equilibria on the loops (docs/loops.md), of models and scenes.

With g the unbalanced forces at rest and N a basis of Q N = 0, for all rows, including rows of velocities,

    N*g = 0,   g + Q*λ = 0,     and along y with δq = N y:   ∂(N*g) = N*(∂g + ∂(Q*λ)) N

The steps are Newton's, or follow the forces, (1/h + K) y = N*g with h growing as N*g shrinks (pseudo-transient continuation: C. T. Kelley,
D. E. Keyes, SIAM J. Numerical Analysis 35, 1998); after each step the state is projected onto the loops.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from .equilibrium import Balance, Equilibrium, checked_tolerance, hinge_limits, modes
from .loop_tangents import KeptRows, kept_rows

STEPS = 500
FARTHEST = 0.3
"""Largest step, radians and metres."""
ROUNDING = 1e-12
"""Radians and metres by which a coordinate at its limit may exceed it."""


@dataclass(frozen=True)
class _State:
    """A state at q: the balance of forces and of the rows, sizes of the forces, the rows, N of unit inertia, N*g, and λ."""

    q: np.ndarray
    balance: Balance
    sizes: np.ndarray
    rows: KeptRows
    basis: np.ndarray
    pushes: np.ndarray
    multipliers: np.ndarray

    @property
    def size(self) -> float:
        return float(np.linalg.norm(self.pushes))

    def stiffness(self) -> np.ndarray:
        return np.asarray(-self.basis.T @ self.balance.along_q @ self.basis)


def solved_on_loops(
    model: Any, at: Callable[[np.ndarray], Balance], q0: np.ndarray, loops: Iterable[str], held: Iterable[int], limits: bool, stable: bool,
    tolerance: Any,
) -> Equilibrium:  # fmt: skip
    """Return the equilibrium found from the state on the loops near q0. EvaluationError if there is none."""
    low, high, _ = hinge_limits(model, limits)
    stuck = np.flatnonzero(low == high).tolist()
    search = _Search(model, at, list(loops), sorted({*held, *stuck}), limits, checked_tolerance(tolerance))
    first = search.start(q0)
    found = None if stable else search.newton(first)
    if found is None or not search.balanced(found):
        found = search.follow(first)
    for _ in range(3 + len(first.pushes)):
        found = search.newton(found) or found
        if not search.balanced(found):
            search.refuse(found)
        made = search.equilibrium(found)
        if not stable or made.stability != "unstable":
            return made
        leaving = 0.1 * np.real(made.modes[0].shape)  # in its unstable direction
        away = search.tried(found, leaving) or search.tried(found, -leaving)
        if away is None:
            break
        found = search.follow(away)
    left = [mode.coordinates for mode in made.modes if mode.stability == "unstable"]
    raise _core.EvaluationError(
        f"{model.name!r}: no stable equilibrium was found on the loops; the last is unstable along "
        f"{' and along '.join(', '.join(one) for one in left)}: start elsewhere (q0=), hold these coordinates (hold=), or take what "
        "there is (stable=False)"
    )


class _Search:
    def __init__(self, model: Any, at: Callable[[np.ndarray], Balance], loops: list[str], held: list[int], limits: bool, tolerance: float):
        self.model, self._at, self.loops, self.held, self.tolerance = model, at, loops, held, tolerance
        self.limits = limits
        self.names = [model.coordinate_names[j] for j in held]
        self.closing = model if set(model.loops) == set(loops) else deepcopy(model)  # only the loops that are kept
        for name in set(self.closing.loops) - set(loops):
            self.closing.loops.remove(name)

        self.lower, self.upper, self.places = hinge_limits(model, limits)

    def start(self, q0: np.ndarray) -> _State:
        """Return the state on the loops near q0, moved within the limits. EvaluationError if it is not within them."""
        own = np.asarray(q0)[self.places]
        into = np.clip(own, self.lower, self.upper) - own
        within = self.model.integrate(q0, into)
        try:
            q = self.closed(within, [self.model.coordinate_names[j] for j in np.flatnonzero(into)])
        except _core.ModelError:
            q = self.closed(within)
        beyond = self.beyond(q)
        if beyond.any():
            j = int(np.argmax(beyond))
            raise _core.EvaluationError(
                f"{self.model.name!r}: the state on the loops near q0 has {self.model.coordinate_names[j]!r} beyond its limits by "
                f"{beyond[j]:.3g}: start elsewhere (q0=), or hold coordinates (hold=)"
            )
        return self.state(q)

    def beyond(self, q: np.ndarray) -> np.ndarray:
        """Return how far each coordinate exceeds its limits, by more than the rounding of a limit."""
        own = np.asarray(q)[self.places]
        off = np.maximum(np.maximum(self.lower - own, own - self.upper), 0.0)
        return np.where(off > ROUNDING, off, 0.0)

    def closed(self, q: np.ndarray, kept: Iterable[str] = ()) -> np.ndarray:
        """Return the state on the loops near q, with these coordinates and the held ones unchanged."""
        return np.asarray(self.closing.assemble(q, fix=[*self.names, *(name for name in kept if name not in self.names)]).q)

    def state(self, q: np.ndarray) -> _State:
        given, rows = self._at(q), kept_rows(self.model, q, self.loops, self.held)
        multipliers = rows.multipliers(-given.left)
        still = np.zeros(self.model.nv)
        bent = rows.derivatives(still, still, multipliers)[3]
        carried = rows.Q.T @ multipliers
        size = max(given.size, np.abs(carried).max(initial=0.0))
        sizes = given._replace(size=size).sizes  # without the curvature of loops: near singular states it would accept everything
        balance = Balance(given.left + carried, given.along_q + bent, given.mass, size)
        N = rows.null
        mass = N.T @ given.mass @ N
        values, vectors = np.linalg.eigh(mass) if N.size else (np.ones(0), np.zeros((0, 0)))
        if N.size and values[0] > len(values) * np.finfo(float).eps * values[-1]:
            N = N @ vectors / np.sqrt(values)
        return _State(q, balance, sizes, rows, N, N.T @ given.left, multipliers)

    def moved(self, state: _State, along: np.ndarray) -> _State:
        return self.state(self.closed(self.model.integrate(state.q, along)))

    def balanced(self, state: _State) -> bool:
        return bool((np.abs(state.balance.left) <= self.tolerance * state.sizes).all())

    def newton(self, state: _State) -> _State | None:
        """Take Newton steps, shortened until less is unbalanced, within limits, to rounding; None if they fail."""
        for _ in range(STEPS):
            step = state.basis @ np.linalg.lstsq(state.stiffness(), state.pushes, rcond=1e-12)[0]
            longest = np.abs(step).max(initial=0.0)
            step *= min(1.0, FARTHEST / longest) if longest else 1.0
            for _ in range(12):
                after = self.tried(state, step)
                if after is not None and after.size < state.size:
                    break
                step = step / 2
            else:
                return state if self.balanced(state) else None
            if after.size > 0.9 * state.size and self.balanced(after):
                return after
            state = after
        return None

    def tried(self, state: _State, step: np.ndarray) -> _State | None:
        """Return the state after a step; None if the loops do not reach it, or only at a singular state, or a limit prevents it."""
        try:
            q = self.closed(self.model.integrate(state.q, step))
            return None if self.beyond(q).any() else self.state(q)
        except (_core.ModelError, _core.EvaluationError):
            return None

    def follow(self, state: _State) -> _State:
        """Follow the forces until they are small."""
        first = state.size
        stiff = np.abs(np.linalg.eigvals(state.stiffness())).max(initial=0.0)
        h = 1.0 / stiff if stiff else 1.0
        for _ in range(STEPS):
            if state.size <= 1e-6 * first or self.balanced(state):
                return state
            step = state.basis @ np.linalg.lstsq(np.eye(len(state.pushes)) / h + state.stiffness(), state.pushes, rcond=None)[0]
            if (state.basis.T @ state.balance.mass @ step) @ state.pushes <= 0:  # if K is more negative than 1/h
                h = h / 4
                continue
            longest = np.abs(step).max(initial=0.0)
            after = self.tried(state, step * min(1.0, FARTHEST / longest))
            if after is None:
                h = h / 4
                continue
            h = h * min(4.0, max(0.25, state.size / after.size if after.size else 4.0))
            state = after
        return state

    def equilibrium(self, state: _State) -> Equilibrium:
        holding = np.zeros(self.model.nv)
        holding[self.held] = state.multipliers[len(state.rows.chosen) :]
        found = modes(self.model, state.balance, state.rows.null)
        return Equilibrium(state.q, state.balance.left, holding, -state.balance.along_q + 0.0, found)

    def refuse(self, state: _State) -> None:
        left, names = state.balance.left, self.model.coordinate_names
        worst = sorted((j for j in range(len(left)) if left[j] != 0), key=lambda j: -abs(left[j]))
        told = ", ".join(f"{names[j]!r} {left[j]:.3g}" for j in worst[:5]) + (", ..." if len(worst) > 5 else "")
        raise _core.EvaluationError(
            f"{self.model.name!r}: no equilibrium was found on its loops{' within limits' if self.limits else ''}. Where the "
            f"search ended there is left (N m and N) at {told}: "
            "balance it by tau, wrenches or effects, hold these coordinates (hold=), or start elsewhere (q0=)"
        )
