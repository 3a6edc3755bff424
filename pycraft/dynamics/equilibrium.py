"""The search for equilibria of models and scenes, and the stability of small displacements there."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..arguments import one_number
from .displacements import brackets, turning

INDIFFERENT = 1e-9
"""Eigenvalues of stiffness below this part of the largest count as zero."""
TOLERANCE = 1e-9
"""Largest residual force, relative to the largest of the forces that balance."""

ROUNDED = 2e-14
"""Residual of forces that balance to rounding: sums over some tens of bodies, relative to the largest."""

FAR = 1e4
"""Radians and metres beyond which a descent along the slope of the forces counts as endless."""

STEPS = 5000
"""Largest number of steps down the slope of the forces."""


class Mode(NamedTuple):
    """One motion in which a mechanism leaves an equilibrium, or swings about it.

    eigenvalue : rad²/s², μ of K φ = μ (ℳ + J) φ: swings with √μ if positive, leaves with √-μ if negative; complex if forces have no
        potential. If ℳ + J is not positive definite, the eigenvalue of K alone, N m and N.
    shape : (nv,), φ, its largest entry 1; zero at held coordinates
    coordinates : names of those that move at least half as much as the largest
    stability : "stable", "unstable" or "indifferent" (to second order)
    """

    eigenvalue: complex
    shape: np.ndarray
    coordinates: tuple[str, ...]
    stability: str


@dataclass(frozen=True)
class Equilibrium:
    """A configuration at which all forces balance.

    Attributes
    ----------
    q : (nq,)
    residual : (nv,) N m and N, at free coordinates: rounding
    holding : (nv,) N m and N, the forces that hold the held coordinates; zero at the others
    stiffness : (nv, nv), K = -∂(forces)/∂q along quasi-velocities: the forces that a displacement requires
    modes : of the free coordinates, in ascending order of eigenvalues
    stability : "unstable" if one mode is, "indifferent" if none is unstable and one is indifferent, else "stable"
    """

    q: np.ndarray
    residual: np.ndarray
    holding: np.ndarray
    stiffness: np.ndarray
    modes: tuple[Mode, ...] = field(repr=False)

    @property
    def stability(self) -> str:
        found = {mode.stability for mode in self.modes}
        return next((kind for kind in ("unstable", "indifferent") if kind in found), "stable")


class Balance(NamedTuple):
    """Forces at rest: `left` (nv,), the unbalanced part; `along_q` (nv, nv), its derivative; `mass`, ℳ + J; `size` of the balancing
    forces."""

    left: np.ndarray
    along_q: np.ndarray
    mass: np.ndarray
    size: float

    @property
    def sizes(self) -> np.ndarray:
        """Sizes (nv,) of the balancing forces at each coordinate: `size`, or the change by a radian or metre there, as for stiff
        springs."""
        return np.maximum(self.size, np.abs(self.along_q).max(axis=1, initial=0.0))


def hinge_limits(model: Any, asked: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return lower and upper limits (nv,), infinite if absent or not requested, and the places of limited coordinates in q."""
    lower, upper, places = np.full(model.nv, -np.inf), np.full(model.nv, np.inf), np.zeros(model.nv, int)
    for hinge in model.hinges.values() if asked else ():
        if hinge.limits is None:
            continue
        q, v = hinge.q_slice.start, hinge.v_slice.start
        for subhinge, low, high in zip(hinge.subhinges, *hinge.limits, strict=True):
            kind = _core.subhinge_kinds[subhinge["kind"]]
            if kind.nq == 1:
                lower[v], upper[v], places[v] = low, high, q
            q, v = q + kind.nq, v + kind.nv
    return lower, upper, places


def checked_tolerance(tolerance: Any) -> float:
    """Return a tolerance for unbalanced forces. EvaluationError unless it is between 0 and 1."""
    number = one_number(tolerance, "tolerance")
    if not 0 < number < 1:
        raise _core.EvaluationError(f"tolerance={number}: the unbalanced part relative to the largest force, between 0 and 1")
    return number


def solved(
    model: Any, at: Callable[[np.ndarray], Balance], q0: np.ndarray, held: Iterable[int], limits: bool, stable: bool, tolerance: Any
) -> Equilibrium:  # fmt: skip
    """Return the equilibrium found from q0, for the forces at rest given by `at`. EvaluationError if there is none."""
    tolerance = checked_tolerance(tolerance)
    free = np.setdiff1d(np.arange(model.nv), list(held))
    search = _Search(model, at, np.array(q0, float), free, limits)
    if not stable:
        return search.found(tolerance)
    for _ in range(2 + len(free)):
        search.go_down()
        found = search.found(tolerance)
        if found.stability != "unstable":
            return found
        search.push(found.modes[0].shape)  # away from it in its unstable direction
    left = [mode.coordinates for mode in found.modes if mode.stability == "unstable"]
    raise _core.EvaluationError(
        f"{model.name!r}: no stable equilibrium was found; the last is unstable along "
        f"{' and along '.join(', '.join(names) for names in left)}: start "
        "elsewhere (q0=), hold these coordinates (hold=), or take what there is (stable=False)"
    )


class _Search:
    """A search over displacements x of free coordinates from q0: with q = q0 exp(x), δq = J(x) δx, J = (1 - e^-ad)/ad."""

    def __init__(self, model: Any, at: Callable[[np.ndarray], Balance], q0: np.ndarray, free: np.ndarray, limits: bool):
        self.model, self.q, self.free, self._at = model, q0, free, at
        self._last: tuple[np.ndarray, Balance] | None = None
        self.curved = bool(brackets(turning(model), np.ones(model.nv)).any())
        self.limits = limits
        if limits:  # start within them; coordinates with equal limits are fixed
            lower, upper = self.bounds()
            self.q = self.moved(np.clip(0.0, lower, upper))[1]
            self.free = free[lower < upper]

    def at(self, q: np.ndarray) -> Balance:
        """Return the balance of forces at q, cached for the next request."""
        if self._last is None or not np.array_equal(self._last[0], q):
            self._last = (q, self._at(q))
        return self._last[1]

    def moved(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all components of x, and q there."""
        whole = np.zeros(self.model.nv)
        whole[self.free] = x
        if not np.isfinite(whole).all():
            raise _core.EvaluationError(
                f"{self.model.name!r}: the search for an equilibrium leaves the range of numbers at "
                f"{self.model.coordinate_names[np.argmin(np.isfinite(whole))]!r}: take other units, or start elsewhere (q0=)"
            )
        return whole, self.model.integrate(self.q, whole)

    def left(self, x: np.ndarray) -> np.ndarray:
        """Return the unbalanced forces at free coordinates."""
        return self.at(self.moved(x)[1]).left[self.free]

    def slope(self, x: np.ndarray) -> np.ndarray:
        """Return the derivative of the unbalanced forces by x."""
        whole, q = self.moved(x)
        along = self.at(q).along_q[self.free]
        return along[:, self.free] if not self.curved else along @ self._turns(whole)[:, self.free]

    def _turns(self, whole: np.ndarray) -> np.ndarray:
        """Return J(x), from the exponential of [[-ad, 1], [0, 0]]."""
        from scipy.linalg import expm

        n = len(whole)
        block = np.zeros((2 * n, 2 * n))
        block[:n, :n], block[:n, n:] = -brackets(turning(self.model), whole), np.eye(n)
        return np.asarray(expm(block)[:n, n:])

    def found(self, tolerance: float) -> Equilibrium:
        """Search by SciPy's solvers, then by Newton steps to rounding."""
        from scipy.optimize import least_squares, root

        if len(self.free) and not self.balanced(ROUNDED):  # steps from there would follow rounding, far along indifferent directions
            start = np.zeros(len(self.free))
            if not np.isfinite(self.bounds()).any():
                self.take(root(self.left, start, jac=self.slope, method="hybr", options={"xtol": 1e-13, "factor": 0.5}).x)
            if not self.balanced(tolerance):
                lower, upper = self.bounds()
                tight = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15}
                self.take(least_squares(self.left, np.clip(start, lower, upper), jac=self.slope, bounds=(lower, upper), **tight).x)
            self.sharpen()
        now = self.at(self.q)
        if not self.balanced(tolerance):
            self.refuse(now)
        residual, holding = np.zeros(self.model.nv), -now.left
        residual[self.free], holding[self.free] = now.left[self.free], 0.0
        return Equilibrium(self.q, residual, holding + 0.0, -now.along_q + 0.0, modes(self.model, now, np.eye(self.model.nv)[:, self.free]))

    def take(self, x: np.ndarray) -> None:
        """Continue from x if less is unbalanced there."""
        _, q = self.moved(x)
        if self.size_of(q) <= self.size_of(self.q):
            self.q = q

    def size_of(self, q: np.ndarray) -> float:
        return float(np.linalg.norm(self.at(q).left[self.free]))

    def sharpen(self) -> None:
        """Take Newton steps as long as the residual falls: at x = 0, J is the identity."""
        lower, upper = self.bounds()
        for _ in range(5):
            now, before = self.at(self.q), self.q
            step = -np.linalg.lstsq(now.along_q[np.ix_(self.free, self.free)], now.left[self.free], rcond=INDIFFERENT)[0]
            if not (np.isfinite(step).all() and (step >= lower).all() and (step <= upper).all()):
                return
            self.take(step)
            if self.size_of(self.q) >= self.size_of(before):
                return

    def balanced(self, tolerance: float) -> bool:
        now = self.at(self.q)
        return bool((np.abs(now.left) <= tolerance * now.sizes)[self.free].all())

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the bounds of x: the distances to the limits of hinges, infinite if absent or not requested."""
        lower, upper, places = hinge_limits(self.model, self.limits)
        return (lower - self.q[places])[self.free], (upper - self.q[places])[self.free]

    def go_down(self) -> None:
        """Follow ẋ = W J* (unbalanced forces), W the inverse diagonal of ℳ + J: downhill if forces have a potential."""
        from scipy.integrate import solve_ivp

        if not len(self.free):
            return
        first = self.at(self.q)
        weight = np.diag(first.mass)[self.free]
        weight = 1 / np.where(weight > 0, weight, 1.0)

        def turned(x: np.ndarray) -> np.ndarray:
            return self._turns(self.moved(x)[0])[np.ix_(self.free, self.free)] if self.curved else np.eye(len(x))

        def rate(_: float, x: np.ndarray) -> np.ndarray:
            return weight * (turned(x).T @ self.left(x))

        def jacobian(_: float, x: np.ndarray) -> np.ndarray:
            return weight[:, None] * (turned(x).T @ self.slope(x))

        steps = iter(range(STEPS))

        def settled(_: float, x: np.ndarray) -> float:
            if next(steps, None) is None:
                raise _core.EvaluationError(
                    f"{self.model.name!r}: no stable equilibrium was found in {STEPS} steps down the slope of its forces: where they have "
                    "no potential it may go round; start elsewhere (q0=), or take what there is (stable=False)"
                )
            now = self.at(self.moved(x)[1])
            return float((np.abs(now.left) - 1e-6 * now.sizes)[self.free].max())

        def gone(_: float, x: np.ndarray) -> float:
            return float(FAR - np.abs(x).max())

        settled.terminal = gone.terminal = True  # type: ignore[attr-defined]  # as SciPy's events say it
        if settled(0.0, np.zeros(len(self.free))) <= 0:
            return
        slowest = 1e6 / max(np.abs(weight[:, None] * first.along_q[np.ix_(self.free, self.free)]).max(), 1e-300)
        still = np.zeros(len(self.free))
        way = solve_ivp(rate, (0.0, slowest), still, method="BDF", jac=jacobian, events=(settled, gone), rtol=1e-3, atol=1e-6)
        end = way.y[:, -1]
        if len(way.t_events[1]):
            name = self.model.coordinate_names[self.free[np.argmax(np.abs(end))]]
            raise _core.EvaluationError(
                f"{self.model.name!r}: no stable equilibrium was found: down the slope of its forces {name!r} goes on without end; hold it "
                "(hold=), or balance it by tau, wrenches or effects"
            )
        self.q = self.moved(np.clip(end, *self.bounds()))[1]

    def push(self, shape: np.ndarray) -> None:
        """Move a tenth of a radian or metre along a mode."""
        self.q = self.moved(0.1 * np.real(shape)[self.free])[1]

    def refuse(self, now: Balance) -> None:
        names, left = self.model.coordinate_names, now.left
        worst = sorted((j for j in self.free if left[j] != 0), key=lambda j: -abs(left[j]))
        told = ", ".join(f"{names[j]!r} {left[j]:.3g}" for j in worst[:5]) + (", ..." if len(worst) > 5 else "")
        lower, upper = self.bounds()
        at_limit = [repr(names[j]) for j, low, high in zip(self.free, lower, upper, strict=True) if min(-low, high) < 1e-9]
        stops = f"; {', '.join(at_limit)} is at its limit" if at_limit else ""
        raise _core.EvaluationError(
            f"{self.model.name!r}: no equilibrium was found. Where the search ended there is left (N m and N) at {told}{stops}: balance it "
            "by tau, wrenches or effects, hold these coordinates (hold=), or start elsewhere (q0=)"
        )


def modes(model: Any, at: Balance, basis: np.ndarray) -> tuple[Mode, ...]:
    """Return how displacements along the columns of a basis (nv, k) leave an equilibrium, or swing about it, by ascending eigenvalue."""
    from scipy.linalg import eig, eigh

    count = basis.shape[1]
    if not count:
        return ()
    stiffness, mass = -basis.T @ at.along_q @ basis, basis.T @ at.mass @ basis
    lightest, heaviest = np.linalg.eigvalsh(mass)[[0, -1]]
    if lightest <= count * np.finfo(float).eps * heaviest:
        mass, lightest = np.eye(count), 1.0  # the signs of eigenvalues are the same
    rounding = 1e3 * np.finfo(float).eps * at.size  # of forces, sums over the bodies
    if np.abs(stiffness - stiffness.T).max() <= max(INDIFFERENT * np.abs(stiffness).max(), rounding):
        values, shapes = eigh((stiffness + stiffness.T) / 2, mass)
    else:
        values, shapes = eig(stiffness, mass)
    zero = max(INDIFFERENT * np.abs(values).max(), rounding / lightest)
    found = []
    for i in np.argsort(np.real(values), kind="stable"):
        value = values[i]
        kind = "indifferent" if abs(value) <= zero else "unstable" if np.real(value) < 0 or abs(np.imag(value)) > zero else "stable"
        shape = basis @ shapes[:, i]
        shape = shape / shape[np.argmax(np.abs(shape))]
        moving = tuple(model.coordinate_names[j] for j in np.flatnonzero(np.abs(shape) >= 0.5))
        found.append(Mode(complex(value) if np.iscomplexobj(values) else float(value), shape, moving, kind))
    return tuple(found)
