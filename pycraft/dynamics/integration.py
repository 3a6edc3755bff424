"""Rates of configurations, and integration in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..state import at_state
from .by_realization import checked_forces
from .direct_calls import cached
from .sensitivities import SensitivityCalls

if TYPE_CHECKING:
    from .trajectory import Trajectory


class IntegrationCalls(SensitivityCalls):
    """q̇ of (q, v), and trajectories under constant generalized forces."""

    nq: int
    name: str

    def _integration(self) -> _core.Integration:
        return cached(self, "_trajectories", _core.Integration)

    def configuration_rate(self, q=None, v=None, *, precision: str = "double", out=None) -> np.ndarray:
        """Rates q̇ (nq,) or (B, nq) of the coordinates at the velocities v. O(N).

        Pins, sliders, screws: v itself. Ball: ½ q⊗(0, ω), ω in the body's axes. Free: that, and the linear velocity turned into the axes of
        the position, R(q/|q|) v. A quaternion's rate is orthogonal to it: its length stays, and is not pulled to one.
        """
        q, v = at_state(self, q, v)
        return self._integration().configuration_rate(q, v, precision, out)

    def integrate_ode(
        self,
        q,
        v,
        times,
        *,
        tau=None,
        damping=None,
        integrator: str = "dopri5",
        rtol: float = 1e-9,
        atol: float = 1e-12,
        step: float | None = None,
        normalise: str = "never",
        precision: Any = "double",
        form: str = "fast",
        refine: Any = 0,
    ) -> Trajectory:
        """The motion from (q, v) at times[0], by forward dynamics under the generalized forces tau - damping * v.

        Parameters
        ----------
        q, v : (nq,), (nv,) at times[0]; q may be a State, which brings its v where v is None; None for the model's present state
        times : (T,) s, strictly increasing or strictly decreasing
        tau, damping : (nv,) constant generalized forces, and viscous damping coefficients; zero by default
        integrator : {"dopri5", "cash-karp54", "fehlberg78", "bulirsch-stoer", "rk4", "rkmk4", "scipy:RK45", "scipy:DOP853", ...}
            The first four (Boost.Odeint) control their steps; "rk4" and "rkmk4" (Runge-Kutta-Munthe-Kaas, on the model's group: quaternions
            keep their length by construction) take steps of one size. All of these end a step at every time asked for. SciPy's ("RK45",
            "DOP853", "Radau", "BDF", "LSODA"; Radau and BDF for stiff motion) interpolate, and call from Python.
        rtol, atol : tolerances on the error of one step, per component of (q, v)
        step : s
            Of one-size steps (the largest that divides the interval and is at most this); the first step of the others, chosen if left out.
        normalise : {"never", "each step"}
            Whether quaternions are set to unit length after each step. Their drift is an integrator's own error.
        precision : {"double", "extended", "quad"}
            Of everything inside; results are float64. SciPy's solvers keep the state in double and take it for forward dynamics alone.
        form, refine : as forward_dynamics takes them

        Raises
        ------
        EvaluationError
            An unknown name (lists the names there are), times out of order, tolerances below the precision; the time where the step size
            falls to rounding or the state is no longer finite.
        SingularHingeError
            Of forward dynamics, with the time.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.gravity = (0, 0, -9.81)
        >>> motion = arm.integrate_ode(arm.q, arm.v, [0, 0.5, 1], integrator="fehlberg78")
        >>> motion.q.shape
        (3, 2)
        """
        from .trajectory import Trajectory, integrate_by_scipy, integrator_names

        if integrator not in integrator_names():
            raise _core.EvaluationError(f"no integrator is called {integrator!r}; there are {', '.join(map(repr, integrator_names()))}")
        refine = _core.checked_refinement(refine, "same", precision)
        if normalise not in ("never", "each step"):
            raise _core.EvaluationError(f"normalise={normalise!r}: there are 'never' and 'each step'")
        q, v = at_state(self, q, v)
        times = _checked_times(times)
        if step is not None and not step > 0:
            raise _core.EvaluationError(f"step={step}: a step is a positive number of seconds")
        if not integrator.startswith("scipy:"):
            first, unit = float(step or 0), normalise != "never"
            run = self._integration().trajectory(
                q, v, times, tau, damping, integrator, float(rtol), float(atol), first, unit, precision, form, refine
            )
            return Trajectory(times, run["q"], run["v"], run["evaluations"], run["seconds"], run["steps"], run["rejected"])
        if normalise != "never":
            raise _core.EvaluationError(f"integrator {integrator!r} has no normalise={normalise!r}; there is 'never'")
        for name, tolerance in (("rtol", rtol), ("atol", atol)):
            if not 0 <= tolerance < np.inf:
                raise _core.EvaluationError(f"{name}={tolerance:g}: a tolerance is a positive number")
        increments = np.diff(times)
        if not ((increments > 0).all() or (increments < 0).all()):
            raise _core.EvaluationError("times are strictly increasing, or strictly decreasing")
        self._integration().configuration_rate(q, v, "double", None)  # checks both
        q, v = np.array(q, float), np.array(v, float)
        given = {name: np.zeros(self.nv) if x is None else _core.real_array(x, name) for name, x in (("tau", tau), ("damping", damping))}
        for name, x in given.items():
            if x.shape != (self.nv,):
                raise _core.ModelError(f"{name} of {self.name!r} takes {self.nv} numbers, not an array of shape {x.shape}")
            checked_forces(self, x, name)
        forces, friction = given.values()

        def accelerations(_: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
            return self.forward_dynamics(q, v, forces - friction * v, form=form, refine=refine, precision=precision)

        return integrate_by_scipy(accelerations, self.configuration_rate, q, v, times, integrator.removeprefix("scipy:"), rtol, atol, step)


def _checked_times(times: Any) -> np.ndarray:
    """Times as an array of their own (T,). EvaluationError where there is none, or one is not finite."""
    made = np.atleast_1d(np.array(_core.real_array(times, "times")))
    if made.ndim != 1 or not made.size:
        raise _core.EvaluationError(f"times: a list of times in seconds, not an array of shape {made.shape}")
    if not np.isfinite(made).all():
        at = int(np.argmin(np.isfinite(made)))
        raise _core.EvaluationError(f"times: entry {at} is {made[at]:g}; times are finite numbers of seconds")
    return made
