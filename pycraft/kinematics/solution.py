"""Results of inverse kinematics, with the reason where a target was not reached."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..closed import Closed
from ..dynamics.task_space import told
from .descent import Descents, Problem

WEAK = 1e-6
"""Relative to the largest singular value: smaller ones count as a lost motion."""


class Solution(Closed):
    """A configuration found by inverse kinematics, or one for every state of a batch (`len`, `solution[b]`).

    For a batch every value has a leading axis, or is a list.
    """

    def __init__(self, problem: Problem, ended: Descents, of: np.ndarray, descents: np.ndarray, stationary: float, batch: bool):
        self._problem, self._ended, self._of, self._descents = problem, ended, of, descents
        self._stationary, self._batch = stationary, batch
        self._q, self._r, self._slope = ended.q, ended.r, ended.slope

    def _shown(self, values: np.ndarray) -> Any:
        return values if self._batch else values[0].item() if values.ndim == 1 else values[0]

    @property
    def q(self) -> np.ndarray:
        """(nq,) or (B, nq): the configuration that reaches the targets, or the nearest one found."""
        return self._shown(self._q)

    @property
    def reached(self) -> Any:
        """True if every target is within its tolerance."""
        return self._shown(self._ended.reached)

    @property
    def errors(self) -> dict[str, tuple[Any, Any]]:
        """Remaining errors by target, (rad, m), along its directions; several targets of a frame are "hand", "hand (2)", ..."""
        found: dict[str, tuple[Any, Any]] = {}
        for rows, (angle, length) in zip(self._problem.rows, self._problem.errors(self._r), strict=True):
            count = sum(other.name == rows.name for other in self._problem.rows[: len(found)])
            found[rows.name if not count else f"{rows.name} ({count + 1})"] = (self._shown(angle), self._shown(length))
        return found

    @property
    def iterations(self) -> Any:
        """Steps of all descents together."""
        return self._shown(self._ended.iterations)

    @property
    def descents(self) -> Any:
        """Number of starting configurations: 1 if q0 led to a solution."""
        return self._shown(self._descents)

    @property
    def stationarity(self) -> Any:
        """The largest cosine between the residual and a coordinate's effect, within bounds: zero at a local minimum. 0 where reached."""
        return self._shown(np.where(self._ended.reached, 0.0, self._slope))

    @property
    def at_limits(self) -> list:
        """(name, "lower" or "upper") of every coordinate at a limit."""
        return self._each(self._at_limits_of)

    @property
    def missed(self) -> list:
        """Remaining errors by direction (rad, m) of targets that are not reached: a dictionary."""
        return self._each(self._missed_of)

    @property
    def lost(self) -> list:
        """Combinations of directions along which no coordinate that is free of limits can move, as `TaskSpace.lost` gives them."""
        return self._each(self._lost_of)

    @property
    def why(self) -> Any:
        """The reason in words why a target was not reached; empty if all are."""
        return self._each(self._why_of)

    def _each(self, of: Any) -> Any:
        return [of(b) for b in range(len(self._q))] if self._batch else of(0)

    # ------------------------------------------------------------------ one member
    def _at_limits_of(self, b: int) -> list[tuple[str, str]]:
        low, high = self._problem.bounds(self._q[b : b + 1])
        names = self._problem.model.coordinate_names
        return [(names[i], "lower" if low[0, i] >= 0 else "upper") for i in np.flatnonzero((low[0] >= 0) | (high[0] <= 0))]

    def _missed_of(self, b: int) -> dict[str, float]:
        at, found = 0, {}
        for rows, (angle, length) in zip(self._problem.rows, self._problem.errors(self._r[b : b + 1]), strict=True):
            for name, angular in zip(rows.names, rows.angular, strict=True):
                if (angle[0] > rows.tolerance[0]) if angular else (length[0] > rows.tolerance[1]):
                    found[name] = float(self._r[b, at])
                at += 1
        return found

    def _pressed_of(self, b: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the weighted Jacobian (m, nv), and which coordinates (nv,) a limit holds against the residual."""
        problem, e = self._problem, self._problem.weights * self._r[b]
        J = problem.evaluate(self._q[b : b + 1], self._of[b : b + 1])[1][0]
        gradient = J.T @ e
        low, high = problem.bounds(self._q[b : b + 1])
        matters = np.abs(gradient) > WEAK * np.linalg.norm(J, axis=0) * np.linalg.norm(e)
        return J, matters & (((low[0] >= 0) & (gradient > 0)) | ((high[0] <= 0) & (gradient < 0)))

    def _lost_of(self, b: int) -> list[dict[str, float]]:
        J, pressed = self._pressed_of(b)
        U, s, _ = np.linalg.svd(J * ~pressed)
        weak = np.r_[s, np.zeros(len(U) - len(s))] <= WEAK * s.max(initial=0.0)
        names = self._problem.names
        found = []
        for column in U[:, weak].T:
            shares = column * self._problem.weights  # a covector: this sum of directions does not move
            shares = shares / shares[np.abs(shares).argmax()]
            found.append({names[i]: float(shares[i]) for i in np.argsort(-np.abs(shares), kind="stable") if abs(shares[i]) >= 0.05})
        return found

    def _why_of(self, b: int) -> str:
        if self._ended.reached[b]:
            return ""
        r = self._r[b : b + 1]
        off = []
        for rows, (angle, length) in zip(self._problem.rows, self._problem.errors(r), strict=True):
            short = [f"{x[0]:.3g} {unit}" for x, unit, limit in ((angle, "rad", rows.tolerance[0]), (length, "m", rows.tolerance[1]))
                     if x[0] > limit]  # fmt: skip
            off += [f"{rows.name} is {' and '.join(short)} off"] if short else []
        begun = int(self._descents[b])
        return f"{', '.join(off)}: {self._reason(b)}{f', the best of {begun} descents' if begun > 1 else ''}"

    def _reason(self, b: int) -> str:
        pressed = self._pressed_of(b)[1]
        if self._slope[b] > self._stationary:
            return f"not yet stationary (cosine {self._slope[b]:.1e}); allow more iterations"
        if pressed.any():
            names, sides = self._problem.model.coordinate_names, dict(self._at_limits_of(b))
            return f"at limits are {', '.join(f'{names[i]} ({sides[names[i]]})' for i in np.flatnonzero(pressed))}"
        e = self._problem.weights * self._r[b]
        along = self._problem.weights * e
        shares = along / along[np.abs(along).argmax()]
        direction = {name: float(x) for name, x in zip(self._problem.names, shares, strict=True) if abs(x) >= 0.05}
        return f"no motion lessens it along {told([dict(sorted(direction.items(), key=lambda one: -abs(one[1])))])}"

    def __bool__(self) -> bool:
        """Check that it is reached: `if arm.solve_ik(...):`. ModelError for a batch, since its members may differ."""
        if self._batch:
            raise _core.ModelError(f"a batch of {len(self._q)} is neither reached nor not: use .reached.all() or .reached.any()")
        return bool(self.reached)

    # ------------------------------------------------------------------ a batch
    def __len__(self) -> int:
        if not self._batch:
            raise _core.ModelError("the solution of one state has no length; the solution of a batch has")
        return len(self._q)

    def __getitem__(self, b: int) -> Solution:
        if not self._batch or not isinstance(b, (int, np.integer)) or not -len(self._q) <= b < len(self._q):
            raise _core.ModelError(f"no state {b!r} of {f'a batch of {len(self._q)}' if self._batch else 'the solution of one state'}")
        own = slice(int(b) % len(self._q), int(b) % len(self._q) + 1)
        return Solution(self._problem, self._ended.of(own), self._of[own], self._descents[own], self._stationary, False)

    def __repr__(self) -> str:
        if self._batch:
            return f"<inverse kinematics: {int(np.count_nonzero(self.reached))} of {len(self._q)} reached>"
        return f"<inverse kinematics: {'reached' if self.reached else self.why}>"
