"""Motions of models on their loops by independent coordinates, which are replaced where they degrade (docs/loops.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number
from ..state import at_state
from .embedding import EmbeddedDynamics

INTEGRATORS = ("DOP853", "RK45", "RK23", "Radau", "BDF")
_WORST, _GOOD = 10.0, 2.0  # entries of X_r in units of energy: bound at which a choice is given up, and bound of a new one
_NEWTON = 20
_LEAST_RTOL = 100 * np.finfo(float).eps  # SciPy's
_STEP = 2.0**-26  # √ε: rounding and second derivatives contribute equally


@dataclass(frozen=True)
class EmbeddedMotion:
    """A motion on the loops.

    Attributes
    ----------
    times : (T,) s
    q, v : (T, nq), (T, nv), on the loops to rounding at every time
    choices : the independent coordinates by name, each with the time from which they were used
    evaluations : number of evaluations of accelerations
    """

    times: np.ndarray
    q: np.ndarray
    v: np.ndarray
    choices: list[tuple[float, list[str]]]
    evaluations: int


def embedded_motion(
    model: Any, times: Any, q: Any = None, v: Any = None, tau: Any = None, *, independent: Any = None,
    integrator: str = "DOP853", rtol: float = 1e-9, atol: float = 1e-12,
) -> EmbeddedMotion:  # fmt: skip
    """Integrate the motion of a model on its loops by constraint embedding, from (q, v) at times[0].

    The integrated coordinates are independent: q_r and θ̇_r, with q̇ of θ̇ = X_r θ̇_r and θ̈_r of `embedded_accelerations`. Dependent
    coordinates are carried along as a start for Newton's method on the rows, Q_d δ_d = -r: they stay on their branch, without drift.

    After each step X_r is checked in units of energy, X_r[d,r] √(ℳ_dd/ℳ_rr): the factor by which |det Q_d| would grow if d and r were
    exchanged. If an entry exceeds 10, pairs are exchanged until all are below 2 (the criterion of strong rank-revealing factors), and the
    motion continues with θ̇_r of the new coordinates. If a state within a step is singular or off its loops, the step is shortened.

    Parameters
    ----------
    times : (T,) s, increasing
    q, v : (nq,), (nv,), a state on the loops; default: the model's present state
    tau : (nv,), N m or N, or a function of (t, q, v) that returns it; default: zero
    independent : initial choice, as in `soa.embedded`
    integrator : {"DOP853", "RK45", "RK23", "Radau", "BDF"}, SciPy's, also as "scipy:DOP853"
    rtol, atol : on the error of one step, by components of (q, θ̇_r)

    Raises
    ------
    ModelError, EvaluationError
        As `embedded_accelerations` at the first state; invalid times, tolerances or integrator name; if no step is short enough, the time
        and the reason.

    Cost: one evaluation of the embedded tree per stage, and one of the rows per Newton step, 1 or 2.
    Source: M. Gu, S. Eisenstat, Efficient algorithms for computing a strong rank-revealing QR factorization, SIAM J. Sci. Comput. 17, 1996.

    Examples
    --------
    >>> import numpy as np, pycraft as pc
    >>> from pycraft.dynamics.embedded_motion import embedded_motion
    >>> bars = pc.chain(3)
    >>> bars.gravity = (0, -9.81, 0)
    >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0))
    >>> start = bars.assemble([1.5, -1.5, -1.5], fix="hinge0")
    >>> motion = embedded_motion(bars, [0, 0.5], start.q, start.v)
    >>> bool(np.abs(bars.loops.residual(motion.q[-1])).max() < 1e-14)
    True
    """
    _check_model(model)
    q, v = (np.array(_core.real_array(part, name), float) for name, part in zip("qv", at_state(model, q, v), strict=True))
    model.configuration_rate(q, v)  # the core's own checks
    if q.ndim != 1:
        raise _core.ModelError(f"a motion of {model.name!r} begins at one state, not at an array {q.shape}")
    times = np.array(_core.real_array(times, "times"), float)
    if times.ndim != 1 or not times.size or not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        raise _core.EvaluationError("times must be finite and increasing, at least one")
    rtol, atol = one_number(rtol, "rtol"), one_number(atol, "atol")
    if not (_LEAST_RTOL <= rtol < np.inf and 0 < atol < np.inf):
        raise _core.EvaluationError(f"rtol={rtol}, atol={atol}: positive numbers, and rtol at least {_LEAST_RTOL:.2g}, what doubles have")
    known = integrator.removeprefix("scipy:") if isinstance(integrator, str) else integrator
    if known not in INTEGRATORS:
        raise _core.EvaluationError(f"integrator {integrator!r} of motions by embedding: there are {', '.join(INTEGRATORS)}")
    run = _Run(model, tau, independent, q)
    run.accelerations(times[0], q, v)  # errors at the first state are raised unchanged
    return run.along(times, q, v, known, rtol, atol)


def _check_model(model: Any) -> None:
    if not isinstance(model, _core.Multibody):
        raise _core.ModelError(f"a motion is of a model, not of {model!r:.80}")


class _Run:
    """One motion: the present choice, and earlier ones."""

    def __init__(self, model: Any, tau: Any, independent: Any, q: np.ndarray):
        self.model, self.evaluations = model, 0
        self.wrong: Exception | None = None  # why rates are not finite
        self.raised: Exception | None = None  # by the user's function
        self.tau: Callable[..., Any] = tau if callable(tau) else lambda t, q, v: np.zeros(model.nv) if tau is None else tau
        self.choices: list[tuple[float, list[str]]] = []
        self.choose(independent, q)

    def choose(self, independent: Any, q: np.ndarray) -> None:
        soa = self.model.soa.embedded(independent, q)
        self.dynamics, self.soa, self.independent = EmbeddedDynamics(soa), soa, list(soa.independent)
        self.dependent = np.setdiff1d(np.arange(self.model.nv), self.independent)
        chosen = np.array([row for _, rows, _ in soa.sets for row in rows], int)
        self.rows = chosen[self.model.loops.of_positions[chosen]] if chosen.size else chosen

    def accelerations(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        try:
            given = self.tau(t, q, v)
        except Exception as error:  # of the user's function, raised again after SciPy returns
            self.raised = error
            raise
        tau = np.asarray(_core.real_array(given, "tau"), float)
        if tau.shape != (self.model.nv,) or not np.isfinite(tau).all():
            raise _core.ModelError(f"tau of {self.model.name!r} takes {self.model.nv} finite numbers, at {t} s it has shape {tau.shape}")
        self.evaluations += 1
        return self.dynamics.accelerations(q, v, tau) if self.model.nv else np.zeros(0)

    def onto_loops(self, q: np.ndarray) -> np.ndarray:
        """Return q with nearby dependent coordinates that keep the rows: Newton's method, as long as it halves the residual."""
        if not self.rows.size:
            return q
        left = np.inf
        for _ in range(_NEWTON):
            r = self.model.loops.residual(q)[self.rows]
            if not np.abs(r).max() < left / 2:
                break
            best, left = q, np.abs(r).max()
            if left == 0:
                break
            step = np.zeros(self.model.nv)
            step[self.dependent] = np.linalg.lstsq(self.model.loops.jacobian(q)[np.ix_(self.rows, self.dependent)], -r, rcond=None)[0]
            q = self.model.integrate(q, step)
        if not np.isfinite(left):
            raise _core.EvaluationError(f"rows of {self.model.name!r} are no numbers at a state within a step")
        return best

    def state(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if not np.isfinite(y).all():
            raise _core.EvaluationError(f"a state of {self.model.name!r} within a step is not finite")
        q = self.onto_loops(y[: self.model.nq])
        return q, self.soa.X_r.at(q).dense() @ y[self.model.nq :]

    def rates(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return (q̇, θ̈_r); not finite where they do not exist, so that integrators step back."""
        try:
            q, v = self.state(y)
            return np.concatenate([self.model.configuration_rate(q, v), self.accelerations(t, q, v)[self.independent]])
        except (_core.EvaluationError, _core.SingularHingeError, np.linalg.LinAlgError) as error:
            self.wrong = error
            return np.full(len(y), np.nan)

    def jacobian(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return ∂rates/∂y for implicit integrators, by differences of one size: SciPy's own grow without bound where Newton undoes a
        change."""
        at, columns = self.rates(t, y), []
        for i in range(len(y)):
            moved = np.array(y)
            moved[i] += _STEP * max(1.0, abs(y[i]))
            columns.append((self.rates(t, moved) - at) / (moved[i] - y[i]))
        return np.array(columns).T

    def along(self, times: np.ndarray, q: np.ndarray, v: np.ndarray, integrator: str, rtol: float, atol: float) -> EmbeddedMotion:
        import scipy.integrate  # SciPy takes a quarter of a second to import

        names, nq = self.model.coordinate_names, self.model.nq
        stepper, tolerances = getattr(scipy.integrate, integrator), {"rtol": rtol, "atol": atol}
        qs, vs, done = [q], [v], 1

        def begun(t: float, q: np.ndarray, v: np.ndarray, **first: Any) -> Any:
            self.choices.append((float(t), [names[i] for i in self.independent]))
            self.wrong = None
            if integrator in ("Radau", "BDF"):
                first["jac"] = self.jacobian
            return stepper(self.rates, t, np.concatenate([q, v[self.independent]]), times[-1], **first, **tolerances)

        if not self.independent:
            self.choices.append((float(times[0]), []))
            return EmbeddedMotion(times, np.tile(q, (len(times), 1)), np.tile(v, (len(times), 1)), self.choices, self.evaluations)
        solver = begun(times[0], q, v)
        while done < len(times):
            if message := self.failed(solver):
                if self.chosen_anew(q, _GOOD):
                    solver = begun(solver.t, q, v)
                    continue
                why = self.wrong or message
                raise _core.EvaluationError(f"motion of {self.model.name!r} at {solver.t:.9g} s: no step is short enough; {why}")
            between = solver.dense_output()
            try:
                while done < len(times) and times[done] <= solver.t:
                    q, v = self.state(between(times[done]) if times[done] < solver.t else solver.y)
                    qs, vs, done = [*qs, q], [*vs, v], done + 1
                q, v = self.state(solver.y)
            except (_core.EvaluationError, np.linalg.LinAlgError) as error:
                raise _core.EvaluationError(f"motion of {self.model.name!r} at {solver.t:.9g} s: {error}") from None
            if isinstance(solver, scipy.integrate._ivp.rk.RungeKutta):
                solver.y[:nq] = q  # starts of Newton do not drift either; rates are of states on the loops as they were
            if done < len(times) and self.chosen_anew(q, _WORST):
                solver = begun(solver.t, q, v, first_step=min(abs(solver.step_size), times[-1] - solver.t))
        return EmbeddedMotion(times, np.array(qs), np.array(vs), self.choices, self.evaluations)

    def failed(self, solver: Any) -> str | None:
        """Take a step; return the reason if it fails."""
        if not np.isfinite(getattr(solver, "h_abs", 0.0)):
            return "no first step"
        try:
            return solver.step()
        except ValueError as error:  # implicit integrators: matrices are not finite where rates are not
            if error is self.raised or isinstance(error, _core.ModelError):
                raise
            return str(error)

    def chosen_anew(self, q: np.ndarray, worst: float) -> bool:
        """Exchange independent coordinates if an entry of X_r exceeds `worst`; return whether they changed."""
        if not self.dependent.size or not self.independent:
            return False
        X = self.soa.X_r.at(q).dense()
        felt = np.sqrt(np.diag(self.model.mass_matrix(q)))
        unit = np.where(felt > 0, felt, 1.0)
        X, independent = unit[:, None] * X / unit[self.independent], list(self.independent)
        if np.abs(X[self.dependent]).max() <= worst:
            return False
        while True:
            i, j = np.unravel_index(np.argmax(np.abs(np.where(np.isin(np.arange(len(X)), independent)[:, None], 0, X))), X.shape)
            if abs(X[i, j]) <= _GOOD:
                break
            independent[j] = int(i)
            X = X @ np.linalg.inv(X[independent])
        try:
            self.choose([self.model.coordinate_names[i] for i in independent], q)
        except _core.ModelError:  # at a singular state no choice is better than the present one
            return False
        return True
