"""Rates of configurations, and integration in time."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..arguments import chosen, one_number
from ..state import at_state
from .centroidal import CentroidalCalls
from .constrained import ConstrainedCalls
from .direct_calls import cached
from .hybrid import HybridCalls
from .identification import IdentificationCalls
from .integrator_names import IntegratorName, integrator_named
from .interbody import InterbodyCalls
from .inverse_on_loops import ConstrainedInverseCalls
from .quadratic import QuadraticCalls
from .statics import StaticsCalls
from .statistical import StatisticalCalls
from .stiff_motion import SHORTER, TAKE, TAKE_DOUBLE, stiffness_text
from .task_space import TaskSpaceCalls

if TYPE_CHECKING:
    from .trajectory import Trajectory


class IntegrationCalls(
    CentroidalCalls,
    ConstrainedCalls,
    ConstrainedInverseCalls,
    HybridCalls,
    IdentificationCalls,
    InterbodyCalls,
    QuadraticCalls,
    StaticsCalls,
    StatisticalCalls,
    TaskSpaceCalls,
):
    """q̇ of (q, v), and trajectories under constant generalized forces."""

    nq: int
    name: str

    if TYPE_CHECKING:

        def _say(self, text: str) -> None:
            """Issue a warning at the line outside the package."""

    def _integration(self) -> _core.Integration:
        return cached(self, "_trajectories", _core.Integration)

    def configuration_rate(self, q=None, v=None, *, precision: str = "double", out=None) -> np.ndarray:
        """Return the rates q̇ (nq,) or (B, nq) of the coordinates at the velocities v. O(N).

        Pins, sliders, screws: v itself. Ball: ½ q⊗(0, ω), ω in the body's axes. Free: the same, and the linear velocity in the axes of the
        position, R(q/|q|) v. The rate of a quaternion is orthogonal to it: its length is constant, but is not normalised to one."""
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
        """Integrate the motion from (q, v) at times[0], by forward dynamics under the generalized forces tau - damping * v.

        Parameters
        ----------
        q, v : (nq,), (nv,) at times[0]; q may be a State, which brings its v if v is None; None: the model's present state
        times : (T,) s, strictly increasing or strictly decreasing
        tau, damping : (nv,) constant generalized forces, and viscous damping coefficients; zero by default
        integrator : {"dopri5", "dop853", "rosenbrock4", "rkmk4", "variational2", "scipy:DOP853", "radau", "cvode", ...}
            `pycraft.dynamics.integrator_names.integrator_names()` lists them, docs/simulation.md explains the choice. The core's
            integrators end a step at every time requested. SciPy's ("scipy:RK45", "scipy:DOP853", "scipy:Radau", "scipy:BDF",
            "scipy:LSODA", or the last part alone, where "dop853" is the core's and "DOP853" SciPy's) and those of SUNDIALS ("sundials:BDF"
            or "cvode", "sundials:Adams"; extra [sundials]) interpolate, and run through Python.
        rtol, atol : tolerances on the error of one step, per component of (q, v)
        step : s
            For constant steps: the largest that divides the interval and is at most this; for the others the first step. Default: chosen.
        normalise : {"never", "each step"}
            Whether to normalise quaternions after each step. Their drift is an integrator's own error.
        precision : {"double", "extended", "quad"}
            Of the whole computation; results are float64. Solvers of other packages keep the state in double and use it for forward
            dynamics only; "rosenbrock4" accepts "double".
        form, refine : as in `forward_dynamics`

        Raises
        ------
        EvaluationError
            An unknown name (lists the known ones), times out of order, tolerances below the precision; the time at which the step size
            falls to rounding or the state is no longer finite.
        SingularHingeError
            From forward dynamics, with the time.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.gravity = (0, 0, -9.81)
        >>> motion = arm.integrate_ode(arm.q, arm.v, [0, 0.5, 1], integrator="dop853")
        >>> motion.q.shape
        (3, 2)
        """
        integrates = integrator_named(integrator)
        refine = _core.checked_refinement(refine, "same", precision)
        if chosen(normalise, "normalise") not in ("never", "each step"):
            raise _core.EvaluationError(f"normalise={normalise!r}: there are 'never' and 'each step'")
        if integrates.foreign and normalise != "never":
            raise _core.EvaluationError(f"integrator {integrates.name!r} has no normalise={normalise!r}; there is 'never'")
        step, rtol, atol = None if step is None else one_number(step, "step"), one_number(rtol, "rtol"), one_number(atol, "atol")
        if step is not None and not step > 0:
            raise _core.EvaluationError(f"step={step}: a step is a positive number of seconds")
        q, v = at_state(self, q, v)
        return self._trajectory(
            integrates, q, v, _checked_times(times), tau=tau, damping=damping, rtol=rtol, atol=atol, step=step,
            normalise=normalise != "never", precision=precision, form=form, refine=refine, told=True,
        )  # fmt: skip

    def _stiff(self, integrator: str, precision: Any, found: Mapping[str, Any]) -> None:
        remedy = SHORTER if found["longest"] else TAKE if precision == "double" else TAKE_DOUBLE
        self._say(stiffness_text(f"the motion of {self.name!r}", integrator, found, remedy))

    def _trajectory(
        self,
        chosen: IntegratorName,
        q,
        v,
        times: np.ndarray,
        *,
        tau=None,
        damping=None,
        rtol: float,
        atol: float,
        step: float | None = None,
        normalise: bool = False,
        precision: Any = "double",
        form: str = "fast",
        refine: Any = 0,
        right_hand_side=None,
        told: bool = False,
    ) -> Trajectory:
        """Integrate with checked arguments. right_hand_side: (t, q, v) -> v̇ in place of forward dynamics, for explicit methods.

        told : whether a ModelWarning reports stiff motion
        """
        from .trajectory import Trajectory

        solver = chosen.solver(float(rtol), float(atol))
        tolerances = (1.0, 1.0) if chosen.foreign else (float(rtol), float(atol))
        run = self._integration().trajectory(
            q, v, times.tolist(), tau, damping, chosen.name, *tolerances, float(step or 0), normalise, precision, form, refine, solver,
            right_hand_side, partial(self._stiff, chosen.name, precision) if told else None,
        )  # fmt: skip
        return Trajectory(times, run["q"], run["v"], run["evaluations"], run["seconds"], run["steps"], run["rejected"])


def _checked_times(times: Any) -> np.ndarray:
    """Return a copy of the times as an array (T,). EvaluationError if it is empty or has values that are not finite."""
    made = np.atleast_1d(np.array(_core.real_array(times, "times")))
    if made.ndim != 1 or not made.size:
        raise _core.EvaluationError(f"times must be a list of times in seconds, not an array of shape {made.shape}")
    if not np.isfinite(made).all():
        at = int(np.argmin(np.isfinite(made)))
        raise _core.EvaluationError(f"times: entry {at} is {made[at]:g}; times are finite numbers of seconds")
    return made
