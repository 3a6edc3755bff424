"""Find states on the loops of a model, from near and far, or explain why there are none (docs/loops.md)."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import clipped, one_number, seed_of
from ..state import State, at_state
from .coordinates import coordinate_numbers
from .limits import pin_coordinates

_ITERATIONS = 200
_LARGEST = 1e150  # of residuals and rows: squares are within doubles; larger ones are hopeless
_RANK = 1e-10  # relative: smaller singular values are rounding, of dependent rows
_STOPPED = 1e-13  # rad/s, m/s, and relative to the velocities given: smaller ones are rounding


class Assembler:
    """The positions of a model's loops as equations for the coordinates that are not fixed.

    Levenberg's method with the damping of Nielsen on the model's group: q moves along δ, (QᵀQ + μ)δ = -Qᵀr, and finally along the shortest
    δ with Qδ = -r in the least-squares sense, so that coordinates around no loop do not move. Source: K. Madsen, H. Nielsen, O. Tingleff,
    Methods for Non-Linear Least Squares Problems, 2004, 3.2.
    """

    def __init__(self, model: Any, q: Any, fix: Any, tolerance: Any):
        self.model, self.q = model, np.array(q, float)
        self.positions = model.loops.of_positions
        self.tolerance = one_number(tolerance, "tolerance")
        if not 0 < self.tolerance < np.inf:
            raise _core.ModelError(f"tolerance must be a positive number, not {tolerance!r}")
        if self.q.ndim != 1:
            raise _core.ModelError(f"assembly starts from one state, not from an array {self.q.shape}; give its rows one by one")
        self.kept = coordinate_numbers(model, [] if fix is None else fix) or []
        self._check_kept()
        self.free = np.setdiff1d(np.arange(model.nv), self.kept)
        model.configuration_rate(self.q, np.zeros(model.nv))  # the core reports faults of q
        elsewhere = model.random_state().q
        moves = sum((model.loops.jacobian(at) != 0).any(axis=0) for at in (self._with_rows(self.q), elsewhere))
        self.around = self.free[moves[self.free] > 0]
        self.sizes = np.maximum(model.loops.sizes(self._with_rows(self.q)), model.loops.sizes(elsewhere))

    def _with_rows(self, q: np.ndarray) -> np.ndarray:
        """Return q, or another state if the rows have no direction there, such as those of a wheel that lies flat."""
        try:
            self.model.loops.residual(q)
        except _core.EvaluationError:
            return np.asarray(self.model.random_state(1).q)
        return q

    def _check_kept(self) -> None:
        """Check that rotations are fixed as a whole or not at all: one of the three velocities alone does not determine a rotation."""
        for hinge in self.model.hinges.values():
            own = range(hinge.v_slice.start, hinge.v_slice.stop)
            some = set(own) & set(self.kept)
            if 0 < len(some) < len(own) and hinge.q_slice.stop - hinge.q_slice.start != len(own):
                raise _core.ModelError(
                    f"hinge {hinge.name!r} has a rotation, and its coordinates cannot be fixed one by one; fix the hinge: {hinge.name!r}"
                )

    def equations(self, q: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return r and Q of these rows, by the coordinates that may move."""
        return self.model.loops.residual(q)[rows], self.model.loops.jacobian(q)[rows][:, self.free]

    def moved(self, q: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return q moved along a step of the coordinates that may move; the others do not change in any bit."""
        whole = np.zeros(self.model.nv)
        whole[self.free] = step
        return self.model.integrate(q, whole)

    def solve(self, q: np.ndarray, rows: np.ndarray | None = None) -> tuple[np.ndarray, float]:
        """Return the state reached from q, and the largest residual there, relative to the sizes of the rows."""
        rows = np.flatnonzero(self.positions) if rows is None else rows
        r, Q = self.equations(q, rows)
        if not r.size or not Q.size or max(np.abs(r).max(), np.abs(Q).max()) > _LARGEST:
            return q, self.left(r, rows)
        mu, grow = 1e-3 * max((Q * Q).sum(axis=0).max(), 1e-300), 2.0
        for _ in range(_ITERATIONS):
            if self.left(r, rows) <= self.tolerance or np.abs(Q.T @ r).max() <= 1e-14 * np.abs(r).max():
                break
            damped = np.vstack([Q, np.sqrt(mu) * np.eye(Q.shape[1])])
            step = np.linalg.lstsq(damped, np.concatenate([-r, np.zeros(Q.shape[1])]), rcond=None)[0]
            onto = self.moved(q, step)
            r_onto, Q_onto = self.equations(onto, rows)
            gain = (r @ r - r_onto @ r_onto) / (step @ (mu * step - Q.T @ r))
            if gain > 0:
                q, r, Q = onto, r_onto, Q_onto
                mu, grow = mu * max(1 / 3, 1 - (2 * gain - 1) ** 3), 2.0
            else:
                mu, grow = mu * grow, 2 * grow
                if np.abs(step).max() < 1e-15:
                    break
        return self.refined(q, r, Q, rows)

    def left(self, r: np.ndarray, rows: np.ndarray) -> float:
        """Return the largest of these residuals, relative to how far the coordinates move each row."""
        return float((np.abs(r) / self.sizes[rows]).max(initial=0))

    def refined(self, q: np.ndarray, r: np.ndarray, Q: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, float]:
        """Refine to rounding a state that satisfies the rows to the tolerance: undamped steps as long as each halves the residual."""
        left = self.left(r, rows)
        while 0 < left <= self.tolerance:
            onto = self.moved(q, np.linalg.lstsq(Q, -r, rcond=_RANK)[0])
            r, Q = self.equations(onto, rows)
            if not self.left(r, rows) < left / 2:
                break
            q, left = onto, self.left(r, rows)
        return q, left

    def starts(self, count: int, rng: np.random.Generator) -> Any:
        """Yield q, then states around it at growing distances: a tenth of a radian or metre at first, π at last."""
        yield self.q
        for width in np.geomspace(0.1, np.pi, max(count - 1, 1))[: count - 1]:
            step = np.zeros(len(self.free))
            step[np.isin(self.free, self.around)] = width * rng.uniform(-1, 1, len(self.around))
            yield self.moved(self.q, step)

    # ------------------------------------------------------------------ velocities
    def velocities(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the velocities that keep all rows with the least change of those that may change. ModelError if there are none."""
        Q = self.model.loops.jacobian(q)
        v = np.array(v, float)
        asked = np.abs(v).max(initial=0)
        if Q.size and self.free.size:
            v[self.free] += np.linalg.lstsq(Q[:, self.free], -(Q @ v), rcond=_RANK)[0]
            if np.abs(v).max() <= _STOPPED * asked:
                v[self.free] = 0
        off = np.abs(Q @ v)
        if (off / self.sizes).max(initial=0) > self.tolerance * asked + _STOPPED:
            said = _worst(self.model.loops.rows, off)
            raise _core.ModelError(
                f"no velocities of {self.model.name!r} keep its loops{self.keeping()}: these remain: {said}; fix fewer, or give others"
            )
        return v

    # ------------------------------------------------------------------ messages
    def keeping(self) -> str:
        """Return in words which coordinates are fixed."""
        names = self.model.coordinate_names
        return f" with {', '.join(repr(names[i]) for i in self.kept[:6])}{', ...' if len(self.kept) > 6 else ''} kept" if self.kept else ""

    def refusal(self, q: np.ndarray, count: int) -> _core.ModelError:
        """Return an error with the reason, from the state with the smallest residual: loops that cannot be closed, or not together."""
        loops, rows = self.model.loops, self.model.loops.rows
        residual = np.abs(loops.residual(q))
        alone = []
        for loop in loops.values():
            own = np.arange(len(rows))[loop.slice]
            own = own[self.positions[own]]
            if own.size and self.solve(q, own)[1] > self.tolerance:
                alone.append(loop.name)
        open_ = [loop.name for loop in loops.values() if (residual / self.sizes)[loop.slice].max(initial=0) > self.tolerance]
        why = (
            f"{_named(alone)} cannot be closed even alone"
            if alone
            else f"each can be closed by itself, but {_named(open_)} not together with the others"
        )
        return _core.ModelError(
            f"{self.model.name!r} cannot be assembled{self.keeping()}, from {count} start{'s' if count > 1 else ''}: {why}. At the nearest "
            f"state found these remain: {_worst(rows, residual)}; change lengths or kept values, or start elsewhere (q0, starts=)"
        )


def _named(names: list[str]) -> str:
    return ", ".join(f"loop {name!r}" for name in names[:6]) + (", ..." if len(names) > 6 else "")


def _worst(rows: list[str], off: np.ndarray) -> str:
    """Return the rows with the largest residuals, in words."""
    order = [i for i in np.argsort(-off)[:4] if off[i] > 0.01 * off.max()]
    return ", ".join(f"{off[i]:.3g} of {rows[i]!r}" for i in order)


def _finite(model: Any, q: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return q and v of one state by the core's own rules: ModelError names the hinge of a value that is not finite."""
    model.configuration_rate(q, v)
    return q, v


def assembled(model: Any, q0: Any, v0: Any, fix: Any, starts: Any, seed: Any, tolerance: Any) -> State:
    """`Multibody.assemble`."""
    q, v = _finite(model, *at_state(model, q0, v0))
    if np.ndim(q) == np.ndim(v) == 1:
        return _assembled_one(model, q, v, fix, starts, seed_of(seed), tolerance)
    several = max(len(one) for one in (q, v) if np.ndim(one) == 2)
    Assembler(model, model.zero_q(), fix, tolerance)  # faults of these arguments belong to no state
    rng, states = seed_of(seed), State(np.zeros((several, model.nq)), np.zeros((several, model.nv)))
    for i, (one, along) in enumerate(zip(np.broadcast_to(q, states.q.shape), np.broadcast_to(v, states.v.shape), strict=True)):
        try:
            found = _assembled_one(model, one, along, fix, starts, rng, tolerance)
        except _core.ModelError as error:
            raise _core.ModelError(f"state {i} of {several}: {error}") from None
        states.q[i], states.v[i] = found.q, found.v
    return states


def _assembled_one(model: Any, q: Any, v: Any, fix: Any, starts: Any, rng: np.random.Generator, tolerance: Any) -> State:
    assembler, count = Assembler(model, q, fix, tolerance), clipped(starts, "starts")
    if count < 1:
        raise _core.ModelError(f"starts must be at least 1 (the number of starting states), not {starts!r}")
    best, smallest, no_rows = assembler.q, np.inf, None
    for start in assembler.starts(count, rng):
        try:
            found, left = assembler.solve(start)
        except _core.EvaluationError as error:  # rows without a direction on the way
            no_rows = error
            continue
        if left <= assembler.tolerance:
            return State(found, assembler.velocities(found, v))
        if left < smallest:
            best, smallest = found, left
    if no_rows is not None and smallest == np.inf:
        raise no_rows
    raise assembler.refusal(best, count)


def branches(model: Any, q0: Any, v0: Any, fix: Any, starts: Any, seed: Any, tolerance: Any) -> list[State]:
    """`Multibody.assembly_branches`."""
    q, v = _finite(model, *at_state(model, q0, v0))
    assembler, rng = Assembler(model, q, fix, tolerance), seed_of(seed)
    first = assembled(model, q, v, fix, starts, rng, tolerance)
    _, Q = assembler.equations(first.q, np.flatnonzero(assembler.positions))
    around = np.isin(assembler.free, assembler.around)
    freedoms = int(around.sum()) - (int(np.linalg.matrix_rank(Q[:, around], 1e-8)) if Q.size else 0)
    if freedoms:
        names = ", ".join(repr(model.coordinate_names[i]) for i in assembler.around[:6])
        degrees = f"{freedoms} degree{'s' if freedoms > 1 else ''} of freedom"
        raise _core.ModelError(
            f"the loops of {model.name!r} leave {degrees}{assembler.keeping()}, and a continuum of states: fix as many of the coordinates "
            f"around them, {names}{', ...' if len(assembler.around) > 6 else ''}"
        )
    found = [first.q]
    turns = turns_of(model)
    for start in assembler.starts(clipped(starts, "starts"), rng):
        try:
            onto, left = assembler.solve(start)
        except _core.EvaluationError:
            continue
        if left <= assembler.tolerance and all(np.abs(between(model, one, onto, turns)).max(initial=0) > 1e-5 for one in found):
            found.append(model.integrate(q, between(model, q, onto, turns)))
    found.sort(key=lambda one: float(np.linalg.norm(between(model, q, one, turns))))
    return [State(one, assembler.velocities(one, v)) for one in found]


def turns_of(model: Any) -> np.ndarray:
    """Return which coordinates are angles that may wind by whole turns: pins in no coupling."""
    turns = pin_coordinates(model)
    for loop in model.loops.values():
        if loop.kind == "coupling":
            turns[model.loops.coupled(loop.name)] = False
    return turns


def between(model: Any, p: np.ndarray, q: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return the displacement from p to q, by the shorter turn."""
    way = np.array(model.difference(p, q))
    way[turns] -= 2 * np.pi * np.round(way[turns] / (2 * np.pi))
    return way
