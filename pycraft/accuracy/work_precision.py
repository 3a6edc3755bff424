"""Work and precision of integration: error of the trajectory and drift of the energy against time, over integrators and tolerances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from .. import _core
from .tidy import TidyTable, error_text, refusal_text, seconds_text
from .trajectory import SCIPY

INTEGRATORS = ("dopri5", "fehlberg78", "bulirsch-stoer", "rkmk4", "scipy:RK45", "scipy:DOP853", "scipy:LSODA")
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
STEPS = tuple(0.05 / 2**k for k in range(0, 10, 2))
"""Seconds: of integrators with steps of one size."""
ONE_SIZE = ("rk4", "rkmk4")
SAMPLES = 8
"""Times, evenly spaced, at which trajectories are compared."""


class WorkPrecisionTable(TidyTable):
    """Rows of `work_precision`: one integrator at one tolerance each.

    Each row is a dictionary: "integrator", "tolerance" (rtol and atol, None of steps of one size), "step" (s, None of controlled ones),
    "error" (of the configuration, on the group: the root mean square over coordinates, rad and m, the largest over the sampled times),
    "drift" (of the energy, the largest over the sampled times relative to the largest kinetic energy of the reference; None where energy
    is not conserved or not given), "seconds" (of the whole run), "evaluations" (of the accelerations), "resolved" (whether the error
    stands above the reference's own), "refused" (the reason, where there is one).

    `reference` is what errors are measured against, in words; `reference_error` its own error, measured as theirs.
    """

    columns = ("integrator", "tolerance", "step", "error", "drift", "seconds", "evaluations", "resolved", "refused")
    shown = {
        "integrator": "integrator", "tolerance": "tolerance or step", "error": "error (rad, m)", "drift": "energy drift", "seconds": "time",
        "evaluations": "evaluations", "refused": "",
    }  # fmt: skip

    @property
    def reference(self) -> str:
        return self.about["reference"]

    @property
    def reference_error(self) -> float:
        return self.about["reference_error"]

    def fastest(self, error: float) -> dict[str, Any]:
        """The cheapest row whose error is at most `error`. Raises ValueError where none is."""
        answers = [row for row in self.rows if not row["refused"] and row["error"] <= error]
        if not answers:
            raise ValueError(f"no row of {self.title!r} has an error of at most {error:g}")
        return min(answers, key=lambda row: row["seconds"])

    def plot(self, axes: Any = None) -> Any:
        """Two panels, error and energy drift against the time of a run, logarithmic; returns the axes."""
        from .plotting import work_precision_plot

        return work_precision_plot(self, axes)

    def cell(self, key: str, row: dict[str, Any]) -> str:
        if key == "tolerance":
            return f"{row['tolerance']:.0e}" if row["step"] is None else f"{row['step']:.2g} s"
        if key in ("error", "drift"):
            below = "< " if key == "error" and row["resolved"] is False else ""
            value = max(row[key], self.reference_error) if below else row[key]
            return below + error_text(value)
        if key == "seconds":
            return seconds_text(row["seconds"])
        if key == "refused":
            return refusal_text(row["refused"])
        return super().cell(key, row)

    def style(self, row: dict[str, Any]) -> str:
        return "dim" if row["refused"] else ""


def work_precision(
    model: Any,
    q: Any,
    v: Any = None,
    tau: Any = None,
    *,
    duration: float = 1.0,
    integrators: Sequence[str] = INTEGRATORS,
    tolerances: Sequence[float] = TOLERANCES,
    steps: Sequence[float] = STEPS,
    right_hand_side: Callable[[float, np.ndarray, np.ndarray], np.ndarray] | None = None,
    energy: Callable[[np.ndarray, np.ndarray], float] | None = None,
    form: str = "fast",
    refine: int | str = 0,
    seconds: float = 0.05,
    progress: Callable[[str], None] | None = None,
) -> WorkPrecisionTable:
    """Integrate one motion by several integrators at several tolerances, and measure what each costs and how far off it is.

    Parameters
    ----------
    model : Multibody
    q, v, tau : (nq,) or a State, (nv,), (nv,)
        The initial state and constant generalized forces, zero where left out.
    duration : s
    integrators : names that `integrate_ode` takes
        Boost.Odeint's run in C++; SciPy's ("scipy:...") call from Python, and their time is mostly that of Python.
    tolerances : rtol and atol of integrators with controlled steps
    steps : s, of those with steps of one size ("rk4", "rkmk4")
    right_hand_side : callable (t, q, v) -> v̇ (nv,)
        Any other motion of the same coordinates: with contact, control, damping. It takes the place of forward dynamics under `tau`, for
        SciPy's integrators alone. This is where a scene passes its own.
    energy : callable (q, v) -> J
        What the motion conserves; kinetic and potential energy of the model where neither tau nor right_hand_side is given.
    form, refine : of forward dynamics, as it takes them
    seconds : a run is repeated until this is spent, once at least; the least time counts
    progress : called with each row's name before it is run

    The reference is fehlberg78 in extended precision at a tolerance of 1e-16 (with a right-hand side: DOP853 at 1e-13 in double). Its own
    error is its distance to a run at a hundred times that tolerance, which the motion's sensitivity is in; rows below it are not resolved.
    Trajectories are compared at eight times; SciPy's integrators interpolate to them, Boost.Odeint's end a step there.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.accuracy.work_precision import work_precision
    >>> arm = pc.chain(2)
    >>> arm.gravity = (0, -9.81, 0)
    >>> table = work_precision(arm, [0.0, 0.0], duration=0.5, integrators=["dopri5"], tolerances=[1e-4, 1e-8], seconds=0)
    >>> [row["error"] < 1e-3 for row in table], table[1]["error"] < table[0]["error"]
    ([True, True], True)
    """
    v = getattr(q, "v", None) if v is None else v
    q = np.array(getattr(q, "q", q), float)
    v = np.zeros(model.nv) if v is None else np.array(v, float)
    if not duration > 0:
        raise _core.EvaluationError(f"duration={duration:g}: a positive number of seconds")
    times = np.linspace(0.0, duration, SAMPLES + 1)
    if energy is None and right_hand_side is None and (tau is None or not np.any(tau)):
        energy = _mechanical_energy(model)

    def integrate(integrator: str, precision: str = "double", **options: Any) -> tuple[np.ndarray, np.ndarray, int, float]:
        if right_hand_side is not None:
            return by_scipy(model, right_hand_side, q, v, times, integrator, options.get("rtol", 0.0))
        run = model.integrate_ode(q, v, times, tau=tau, integrator=integrator, precision=precision, form=form, refine=refine, **options)
        return run.q, run.v, run.evaluations, run.seconds

    if progress is not None:
        progress("reference")
    name, wide, tolerance = ("fehlberg78", "extended", 1e-16) if right_hand_side is None else ("scipy:DOP853", "double", 1e-13)
    truth = integrate(name, wide, rtol=tolerance, atol=tolerance)
    looser = integrate(name, wide, rtol=100 * tolerance, atol=100 * tolerance)
    own = trajectory_error(model, truth[0], looser[0])
    scale = max((float(model.kinetic_energy(x, y)) for x, y in zip(truth[0], truth[1], strict=True)), default=0.0)

    rows = []
    for integrator in integrators:
        fixed = integrator in ONE_SIZE
        for amount in steps if fixed else tolerances:
            if progress is not None:
                progress(f"{integrator}, {amount:g}")
            options = {"step": amount} if fixed else {"rtol": amount, "atol": amount}
            rows.append(_row(model, integrator, options, integrate, truth[0], own, energy, scale, seconds))
    return WorkPrecisionTable(
        f"Integration of {model.name}, {duration:g} s",
        rows,
        {
            "model": model.name, "nv": model.nv, "duration": duration, "reference": f"{name} in {wide} precision, tolerance {tolerance:g}",
            "reference_error": own,
        },
    )  # fmt: skip


def _row(
    model: Any, integrator: str, options: dict[str, float], integrate: Callable, truth: np.ndarray, own: float, energy: Any, scale: float,
    budget: float,
) -> dict[str, Any]:  # fmt: skip
    row: dict[str, Any] = dict.fromkeys(WorkPrecisionTable.columns)
    row |= {"integrator": integrator, "tolerance": options.get("rtol"), "step": options.get("step"), "refused": ""}
    try:
        q, v, evaluations, taken = integrate(integrator, **options)
    except (ArithmeticError, _core.Error) as reason:
        return row | {"refused": str(reason)}
    error, spent = trajectory_error(model, truth, q), taken
    while spent < budget:
        again = integrate(integrator, **options)[3]
        taken, spent = min(taken, again), spent + again
    row |= {"error": error, "seconds": taken, "evaluations": int(evaluations), "resolved": error > own}
    if energy is not None and scale > 0:
        values = np.array([energy(x, y) for x, y in zip(q, v, strict=True)])
        row["drift"] = float(np.abs(values - values[0]).max() / scale)
    return row


def trajectory_error(model: Any, truth: np.ndarray, q: np.ndarray) -> float:
    """The largest distance of two trajectories (T, nq) over their times: the root mean square of `difference` over the coordinates."""
    distances = [np.sqrt(np.mean(np.square(model.difference(a, b)))) for a, b in zip(truth, q, strict=True)]
    return float(max(distances, default=0.0))


def by_scipy(
    model: Any, right_hand_side: Callable, q: np.ndarray, v: np.ndarray, times: np.ndarray, integrator: str, tolerance: float
) -> tuple[np.ndarray, np.ndarray, int, float]:
    """A motion with its own right-hand side (t, q, v) -> v̇ by one of SciPy's solvers: q, v at the times, evaluations, seconds."""
    from scipy.integrate import solve_ivp

    method = integrator.removeprefix("scipy:")
    if method == integrator or method not in SCIPY:
        known = ", ".join(f"'scipy:{name}'" for name in SCIPY)
        raise _core.EvaluationError(f"integrator {integrator!r} takes no right-hand side of its own; there are {known}")
    nq = model.nq

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([model.configuration_rate(x[:nq], x[nq:]), right_hand_side(t, x[:nq], x[nq:])])

    begin = perf_counter()
    run = solve_ivp(rate, (times[0], times[-1]), np.concatenate([q, v]), method, times, rtol=tolerance, atol=tolerance)
    taken = perf_counter() - begin
    if not run.success:
        raise _core.EvaluationError(f"integrator {integrator!r}: {run.message}")
    return run.y.T[:, :nq], run.y.T[:, nq:], run.nfev, taken


def _mechanical_energy(model: Any) -> Callable[[np.ndarray, np.ndarray], float]:
    return lambda q, v: float(model.kinetic_energy(q, v) + model.potential_energy(q))
