"""Integrators by name: the core's own, SciPy's and SUNDIALS'."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .. import _core

SCIPY = ("RK45", "DOP853", "Radau", "BDF", "LSODA")
"""SciPy's solvers; as integrators their names are "scipy:RK45", or "RK45" or "rk45" for short; but "dop853" is the core's."""
SUNDIALS = ("BDF", "Adams")
"""The methods of SUNDIALS' CVODE; "sundials:BDF", "cvode" for short, and "sundials:Adams"."""
SHORT = {name.lower(): f"scipy:{name}" for name in SCIPY} | {"cvode": "sundials:BDF", "adams": "sundials:Adams"}
"""By lower-case names: no integrator of the core has one of them, except "dop853", which only SciPy's own spelling DOP853 distinguishes."""
SOLVE_FOR_STEPS = ("scipy:Radau", "scipy:BDF", "scipy:LSODA", "sundials:BDF")
"""External integrators with implicit steps, for stiff motion."""


@dataclass(frozen=True)
class IntegratorName:
    """The full name of an integrator, and whether it is external to the core."""

    name: str
    foreign: bool

    def solver(self, rtol: float, atol: float, max_step: float = 0.0) -> Any:
        """Return the solver that takes its steps, for the core; None for the core's own integrators."""
        if not self.foreign:
            return None
        for what, tolerance in (("rtol", rtol), ("atol", atol)):
            if not 0 <= tolerance < float("inf"):
                raise _core.EvaluationError(f"{what}={tolerance:g}: a tolerance is a positive number")
        from .foreign_solvers import ScipySteps, SundialsSteps

        package, _, method = self.name.partition(":")
        return (ScipySteps if package == "scipy" else SundialsSteps)(self.name, method, rtol, atol, max_step)


def integrator_names() -> list[str]:
    """Return the names of all integrators, of the core and of other packages."""
    return [*_core.integrators(), *(f"scipy:{name}" for name in SCIPY), *(f"sundials:{name}" for name in SUNDIALS)]


def integrator_named(name: Any) -> IntegratorName:
    """Return the integrator of a full or short name; the core's names have priority. EvaluationError lists the names."""
    given = SHORT.get(name.lower(), name) if isinstance(name, str) and name not in _core.integrators() else name
    if isinstance(given, str) and (instead := _core.retired_integrator(given)):
        raise _core.EvaluationError(instead)
    if not isinstance(given, str) or given not in integrator_names():
        raise _core.EvaluationError(f"no integrator is called {name!r}; there are {', '.join(map(repr, integrator_names()))}")
    return IntegratorName(given, ":" in given)


def takes_one_size(name: str) -> bool:
    """Check that an integrator takes steps of constant size, by its full name."""
    return any(row["name"] == name and not row["controlled"] for row in _core.integrator_table())
