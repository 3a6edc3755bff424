"""Trajectories of a model, and SciPy's solvers for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from .. import _core

SCIPY = ("RK45", "DOP853", "Radau", "BDF", "LSODA")
"""SciPy's solvers; as integrators they are called "scipy:RK45" and so on."""


@dataclass(frozen=True)
class Trajectory:
    """States of a model over time, and what they cost.

    Attributes
    ----------
    t : (T,) s, the times asked for
    q, v : (T, nq), (T, nv), the states at them; the first is the initial one
    evaluations : evaluations of forward dynamics
    seconds : wall time
    steps, rejected : steps taken, and steps tried in vain (0 for SciPy's solvers, which do not tell)
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    evaluations: int
    seconds: float
    steps: int
    rejected: int = 0


def integrator_names() -> list[str]:
    """All integrators, the core's and SciPy's."""
    return [*_core.integrators(), *(f"scipy:{name}" for name in SCIPY)]


def integrate_by_scipy(
    accelerations: Callable[[float, np.ndarray, np.ndarray], np.ndarray],
    rate: Callable[[np.ndarray, np.ndarray], np.ndarray],
    q: np.ndarray,
    v: np.ndarray,
    times: np.ndarray,
    solver: str,
    rtol: float,
    atol: float,
    step: float | None,
) -> Trajectory:
    """q̇ = rate(q, v), v̇ = accelerations(t, q, v) by one of SciPy's solvers (a name of SCIPY), interpolated by it to the times.

    q (nq,), v (nv,) at times[0]; times (T,) s; rtol, atol per component of the error of a step; step s, the first one, chosen by the solver
    where it is None. Raises EvaluationError that names the time where the solver gives up or the state is no longer finite.
    """
    from scipy import integrate

    began, nq = perf_counter(), len(q)
    count, steps = 0, 0

    def right_side(t: float, x: np.ndarray) -> np.ndarray:
        nonlocal count
        count += 1
        try:
            return np.concatenate([rate(x[:nq], x[nq:]), accelerations(t, x[:nq], x[nq:])])
        except _core.Error as error:
            raise type(error)(f"{error}; integrating, at t = {t:.6g} s") from error

    states = np.empty((len(times), nq + len(v)))
    states[0] = np.concatenate([q, v])
    done = 1
    if len(times) > 1:
        options: dict[str, Any] = {"rtol": rtol, "atol": atol}
        if step is not None:
            options["first_step"] = step
        run = getattr(integrate, solver)(right_side, times[0], states[0].copy(), times[-1], **options)
        direction = np.sign(times[-1] - times[0])
        while done < len(times):
            message = run.step()
            if run.status == "failed" or not np.isfinite(run.y).all():
                why = message or "the state is not finite"
                raise _core.EvaluationError(f"integrator 'scipy:{solver}' gives up at t = {run.t:.6g} s: {why}")
            steps += 1
            reached = int(np.searchsorted(direction * times, direction * run.t, side="right"))
            if reached > done:
                states[done:reached] = run.dense_output()(times[done:reached]).T
                done = reached
        states[-1] = run.y
    return Trajectory(times, states[:, :nq].copy(), states[:, nq:].copy(), count, perf_counter() - began, steps)
