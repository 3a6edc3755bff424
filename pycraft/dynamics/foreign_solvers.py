"""Steps of other packages' solvers, in the form that the core's run expects: SciPy's, and SUNDIALS' CVODE by scikit-sundae.

Each has begin(rates, t, x, end, first_step), where rates(t, x) returns ẋ; step() -> (t, x), one step of the solver; and at(t) -> x within
the last step, by the solver's own dense output.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core

Rates = Callable[[float, np.ndarray], np.ndarray]


class ScipySteps:
    """One of SciPy's solvers (`scipy.integrate.DOP853`, ...)."""

    def __init__(self, name: str, method: str, rtol: float, atol: float, max_step: float):
        from scipy import integrate

        self._name, self._solver = name, getattr(integrate, method)
        self._options: dict[str, Any] = {"rtol": rtol, "atol": atol}
        if max_step > 0:
            self._options["max_step"] = max_step

    def begin(self, rates: Rates, t: float, x: np.ndarray, end: float, first_step: float | None) -> None:
        options = dict(self._options)
        if first_step is not None:
            options["first_step"] = min(first_step, abs(end - t))
        self._run = self._solver(rates, t, x, end, **options)
        self._dense: Any = None

    def step(self) -> tuple[float, np.ndarray]:
        message = self._run.step()
        if self._run.status == "failed" or not np.isfinite(self._run.y).all():
            raise _core.EvaluationError(
                f"integrator {self._name!r} gives up at t = {self._run.t:.6g} s: {message or 'the state is not finite'}"
            )
        self._dense = None
        return self._run.t, self._run.y

    def at(self, t: float) -> np.ndarray:
        if self._dense is None:
            self._dense = self._run.dense_output()
        return self._dense(t)


class SundialsSteps:
    """CVODE of SUNDIALS (Hindmarsh et al., ACM Transactions on Mathematical Software 31, 2005), by the package scikit-sundae."""

    def __init__(self, name: str, method: str, rtol: float, atol: float, max_step: float):
        try:
            from sksundae.cvode import CVODE
        except ImportError:
            raise ImportError(f"integrator {name!r} needs scikit-sundae: pip install 'pycraft-soa[sundials]'") from None
        self._name, self._solver = name, CVODE
        self._options: dict[str, Any] = {"method": method, "rtol": rtol, "atol": atol, "max_step": max_step}

    def begin(self, rates: Rates, t: float, x: np.ndarray, end: float, first_step: float | None) -> None:
        def fill(t: float, x: np.ndarray, out: np.ndarray) -> None:
            out[:] = rates(t, x)

        self._end, self._last = end, t
        self._run = self._solver(fill, first_step=min(first_step or 0.0, abs(end - t)), **self._options)
        self._run.init_step(t, x)

    def step(self) -> tuple[float, np.ndarray]:
        for _ in range(2):  # after interpolation, CVODE returns the end of the step again
            found = self._run.step(self._end, method="onestep", tstop=self._end)
            if not found.success or not np.isfinite(found.y).all():
                why = found.message if not found.success else "the state is not finite"
                raise _core.EvaluationError(f"integrator {self._name!r} gives up at t = {self._last:.6g} s: {why}")
            if found.t != self._last:
                break
        self._last = float(found.t)
        return self._last, np.array(found.y)

    def at(self, t: float) -> np.ndarray:
        return np.array(self._run.step(t, tstop=self._end).y)
