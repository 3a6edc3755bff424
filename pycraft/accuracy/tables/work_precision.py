"""Work and precision of integration: error of the trajectory and drift of the energy against time, over integrators and tolerances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ... import _core
from ...dynamics.by_realization import checked_forces
from ...dynamics.integrator_names import integrator_named, integrator_names, takes_one_size
from ...tidy import TidyTable, error_text, refusal_text, seconds_text
from ..checked_options import checked_model, checked_names, checked_positive, checked_seconds
from .confirmation import SECOND, about, confirmation, own_error

INTEGRATORS = ("dopri5", "dop853", "bulirsch-stoer", "rkmk4", "scipy:RK45", "scipy:DOP853", "scipy:LSODA")
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
STEPS = tuple(0.05 / 2**k for k in range(0, 10, 2))
"""Steps, s, of integrators with fixed steps."""
Run = tuple[np.ndarray, np.ndarray, int, float]
"""q and v at the sampled times, evaluations, seconds."""
Integrate = Callable[..., Run]
"""A run by the name of an integrator, with its options."""
SAMPLES = 8
"""Number of evenly spaced times at which trajectories are compared."""


class WorkPrecisionTable(TidyTable):
    """Rows of `work_precision`: one integrator at one tolerance each.

    Each row is a dictionary: "integrator", "tolerance" (rtol and atol, None for fixed steps), "step" (s, None for controlled steps),
    "error" (error of the configuration, on the group: root mean square over coordinates, rad and m, the largest over the sampled times),
    "drift" (drift of the energy, the largest over the sampled times relative to the largest kinetic energy of the reference; None if energy
    is not conserved or not given), "seconds" (of the whole run), "evaluations" (of the accelerations), "resolved" (True if the error
    exceeds the reference's own), "refused" (the reason, if the row is refused).

    `reference` describes the reference in words; `reference_error` is its own error, measured in the same way: the larger of its
    distances to a looser run and to the motion by a method of another family. `confirmation` gives the number of digits to which both
    methods agree, or that the reference is not confirmed.
    """

    columns: ClassVar[tuple[str, ...]] = (
        "integrator", "tolerance", "step", "error", "drift", "seconds", "evaluations", "resolved", "refused",
    )  # fmt: skip
    shown = {
        "integrator": "integrator", "tolerance": "tolerance or step", "error": "error (rad, m)", "drift": "energy drift", "seconds": "time",
        "evaluations": "evaluations", "refused": "",
    }  # fmt: skip
    short: ClassVar[dict[str, str]] = {"tolerance": "tol., step"}

    @property
    def reference(self) -> str:
        return self.about["reference"]

    @property
    def reference_error(self) -> float:
        return self.about["reference_error"]

    @property
    def confirmation(self) -> str:
        return self.about.get("confirmation", "")

    @property
    def note(self) -> str:
        return f"reference: {self.reference}, {self.confirmation}" if self.confirmation else ""

    def fastest(self, error: float) -> dict[str, Any]:
        """Return the cheapest row with an error of at most `error`. Raises ValueError if there is none."""
        answers = [row for row in self.rows if not row["refused"] and row["error"] <= error]
        if not answers:
            best = min((row for row in self.rows if not row["refused"]), key=lambda row: row["error"], default=None)
            found = "every row is refused" if best is None else f"the best is {self.label(best)}, {best['error']:.1e}"
            raise ValueError(f"no row of {self.title!r} has an error of at most {error:g}: {found}")
        return min(answers, key=lambda row: row["seconds"])

    def plot(self, axes: Any = None) -> Any:
        """Plot two panels, error and energy drift against run time, logarithmic; return the axes."""
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

    def label(self, row: dict[str, Any]) -> str:
        return f"{row['integrator']} at {self.cell('tolerance', row)}"


def work_precision(
    model: Any,
    q: Any,
    v: Any = None,
    tau: Any = None,
    *,
    duration: float = 1.0,
    integrators: str | Sequence[str] = INTEGRATORS,
    tolerances: float | Sequence[float] = TOLERANCES,
    steps: float | Sequence[float] = STEPS,
    right_hand_side: Callable[[float, np.ndarray, np.ndarray], np.ndarray] | None = None,
    energy: Callable[[np.ndarray, np.ndarray], float] | None = None,
    form: str = "fast",
    refine: int | str = 0,
    seconds: float = 0.05,
    progress: Callable[[str], None] | None = None,
) -> WorkPrecisionTable:
    """Integrate one motion by several integrators at several tolerances, and measure the cost and the error of each.

    Parameters
    ----------
    model : Multibody
    q, v, tau : (nq,) or a State, (nv,), (nv,)
        The initial state and constant generalized forces, default zero.
    duration : s
    integrators : names of `integrate_ode`
        The core's integrators run in C++; SciPy's and SUNDIALS' call from Python, which takes most of their time.
    tolerances : rtol and atol of integrators with controlled steps
    steps : s, for integrators with fixed steps ("rk4", "rkmk4", "variational2", ...)
    right_hand_side : callable (t, q, v) -> v̇ (nv,)
        Any other motion of the same coordinates: with contact, control, damping. It replaces forward dynamics under `tau`, for
        integrators that need only accelerations at states, and is called once at the initial state before measuring.
    energy : callable (q, v) -> J
        Conserved quantity; default: kinetic and potential energy of the model, without tau and right_hand_side. A row where it
        is not finite is refused.
    form, refine : options of forward dynamics
    seconds : time over which a run is repeated, at least once; the least time counts
    progress : called with "reference", then with each row's name before it is run

    A single name or number counts as a list of one. The reference comes first and takes two runs: for long or fast motions it may take
    longer than all rows, and can be interrupted.

    The reference is dop853 in extended precision at a tolerance of 1e-16 (with a right-hand side: DOP853 at 1e-13 in double). Its own
    error is its distance to a run at a hundred times that tolerance, which includes the motion's sensitivity, or to the motion by an
    extrapolation method (bulirsch-stoer), if that is larger; rows below it are not resolved. The table gives the number of digits to which
    both methods agree; below six the reference is not confirmed, as stated in the table and a ModelWarning.
    Trajectories are compared at eight times; integrators of other packages interpolate to them, the core's integrators end a step there.

    Raises
    ------
    TypeError
        The argument is not a model.
    ModelError
        A model without coordinates; states or forces of the wrong shape or not finite.
    EvaluationError
        An unknown integrator, form or refinement; tolerances, steps or a duration that are not positive and finite; a
        right_hand_side or energy with an invalid result at the initial state; a reference that cannot be computed, with the time.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.accuracy.tables.work_precision import work_precision
    >>> arm = pc.chain(2)
    >>> arm.gravity = (0, -9.81, 0)
    >>> table = work_precision(arm, [0.0, 0.0], duration=0.5, integrators=["dopri5"], tolerances=[1e-4, 1e-8], seconds=0)
    >>> [row["error"] < 1e-3 for row in table], table[1]["error"] < table[0]["error"]
    ([True, True], True)
    """
    checked_model(model, "work_precision")
    seconds, refine = checked_seconds(seconds), _core.checked_refinement(refine, "same", "double")
    q, v, tau = _initial(model, q, v, tau)
    if not isinstance(duration, (int, float, np.number)) or not 0 < duration < np.inf:
        raise _core.EvaluationError(f"duration={duration!r}: give a positive, finite number of seconds")
    integrators = checked_names(integrators, "integrators", "integrator", integrator_names())
    tolerances = checked_positive(tolerances, "tolerances", "a positive, finite tolerance")
    steps = checked_positive(steps, "steps", "a positive, finite number of seconds")
    checked_names([form], "form", "form", _core.forms())
    _probe(model, q, v, right_hand_side, energy)
    times = np.linspace(0.0, duration, SAMPLES + 1)
    if energy is None and right_hand_side is None and (tau is None or not np.any(tau)):
        energy = _mechanical_energy(model)

    integrate = _runs(model, q, v, times, tau, form, refine, right_hand_side)
    if progress is not None:
        progress("reference")
    name, wide, tolerance = ("dop853", "extended", 1e-16) if right_hand_side is None else ("scipy:DOP853", "double", 1e-13)
    truth = integrate(name, wide, rtol=tolerance, atol=tolerance)
    looser = integrate(name, wide, rtol=100 * tolerance, atol=100 * tolerance)
    tightest = tolerance if right_hand_side is None else 10 * tolerance  # a right-hand side is in double precision
    found = confirmation(
        truth[0],
        lambda: integrate(SECOND, wide, rtol=tightest, atol=tightest)[0],
        partial(trajectory_error, model),
        f"{SECOND} in {wide} precision",
    )
    own = own_error(trajectory_error(model, truth[0], looser[0]), found)
    scale = max((float(model.kinetic_energy(x, y)) for x, y in zip(truth[0], truth[1], strict=True)), default=0.0)

    rows = []
    for integrator in integrators:
        fixed = takes_one_size(integrator)
        for amount in steps if fixed else tolerances:
            if progress is not None:
                progress(f"{integrator}, {amount:g}")
            options = {"step": amount} if fixed else {"rtol": amount, "atol": amount}
            rows.append(measured_row(model, integrator, options, integrate, truth[0], own, energy, scale, seconds))
    gravity = "its own right-hand side" if right_hand_side is not None else f"gravity ({', '.join(f'{g:g}' for g in model.gravity)}) m/s²"
    return WorkPrecisionTable(
        f"Integration of {model.name}, {duration:g} s, {gravity}, from {'a moving state' if np.any(v) else 'rest'}",
        rows,
        {
            "model": model.name, "nv": model.nv, "duration": duration, "reference": f"{name} in {wide} precision, tolerance {tolerance:g}",
            "reference_error": own, **about(found), "gravity": [float(g) for g in model.gravity], "q": q.tolist(), "v": v.tolist(),
        },
    )  # fmt: skip


def _runs(model: Any, q: np.ndarray, v: np.ndarray, times: np.ndarray, tau: Any, form: str, refine: Any, right_hand_side: Any) -> Integrate:
    """Return runs of `integrate_ode`, with forward dynamics or with the user's right-hand side."""
    own: dict[str, Any] = {"tau": tau, "form": form, "refine": refine} if right_hand_side is None else {"right_hand_side": right_hand_side}

    def integrate(integrator: str, precision: str = "double", rtol: float = 1e-9, atol: float = 1e-12, step: float | None = None) -> Run:
        chosen = integrator_named(integrator)
        run = model._trajectory(chosen, q, v, times, precision=precision, rtol=rtol, atol=atol, step=step, **own)
        return run.q, run.v, run.evaluations, run.seconds

    return integrate


def measured_row(
    model: Any, integrator: str, options: dict[str, float], integrate: Integrate, truth: np.ndarray, own: float, energy: Any, scale: float,
    budget: float,
) -> dict[str, Any]:  # fmt: skip
    """Return one row: a run by an integrator at a tolerance or step, its error against `truth` (K, nq), its time.

    own : rad, m, the error of the truth itself. energy : a function of (q, v), or None; scale : J, the scale of its drift.
    budget : s, time over which the run is repeated.
    """
    row: dict[str, Any] = dict.fromkeys(WorkPrecisionTable.columns)
    row |= {"integrator": integrator, "tolerance": options.get("rtol"), "step": options.get("step"), "refused": ""}
    try:
        q, v, evaluations, taken = integrate(integrator, **options)
    except (ArithmeticError, _core.Error) as reason:
        return row | {"refused": str(reason)}
    if energy is not None and scale > 0:
        values = np.array([energy(x, y) for x, y in zip(q, v, strict=True)], float)
        if not np.isfinite(values).all():
            return row | {"refused": f"energy(q, v) is {values[~np.isfinite(values)][0]} along the motion, not a finite number of joules"}
        row["drift"] = float(np.abs(values - values[0]).max() / scale)
    error, spent = trajectory_error(model, truth, q), taken
    while spent < budget:
        again = integrate(integrator, **options)[3]
        taken, spent = min(taken, again), spent + again
    row |= {"error": error, "seconds": taken, "evaluations": int(evaluations), "resolved": error > own}
    return row


def trajectory_error(model: Any, truth: np.ndarray, q: np.ndarray) -> float:
    """Return the largest distance of two trajectories (T, nq) over their times: root mean square of `difference` over the coordinates."""
    distances = [np.sqrt(np.mean(np.square(model.difference(a, b)))) for a, b in zip(truth, q, strict=True)]
    return float(max(distances, default=0.0))


def _initial(model: Any, q: Any, v: Any, tau: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Return the checked initial state (nq,), (nv,) and forces (nv,) or None."""
    v = getattr(q, "v", None) if v is None else v
    q, v = getattr(q, "q", q), np.zeros(model.nv) if v is None else getattr(v, "v", v)
    model.configuration_rate(q, v)  # the core's own checks
    q, v = np.array(q, float), np.array(v, float)
    tau = None if tau is None else checked_forces(model, tau)
    if max(np.ndim(x) for x in (q, v, tau)) > 1:
        raise _core.ModelError(f"work_precision integrates from one state of {model.name!r}, not from a batch")
    return q, v, tau


def _probe(model: Any, q: np.ndarray, v: np.ndarray, right_hand_side: Any, energy: Any) -> None:
    """Call the user's functions once at the initial state, so that their errors appear before minutes of measuring."""
    for name, function in (("right_hand_side", right_hand_side), ("energy", energy)):
        if function is not None and not callable(function):
            raise _core.EvaluationError(f"{name} must be a function, not {function!r}")
    if right_hand_side is not None:
        rate = np.asarray(right_hand_side(0.0, q.copy(), v.copy()), float)
        if rate.shape != (model.nv,):
            raise _core.EvaluationError(f"right_hand_side(0, q, v) has shape {rate.shape}; it must return the accelerations, ({model.nv},)")
        if not np.isfinite(rate).all():
            at = int(np.argmin(np.isfinite(rate)))
            raise _core.EvaluationError(f"right_hand_side(0, q, v) is {rate[at]} at coordinate {model.coordinate_names[at]!r}")
    if energy is not None:
        value = np.asarray(energy(q.copy(), v.copy()), float)
        if value.shape != () or not np.isfinite(value):
            raise _core.EvaluationError(f"energy(q, v) is {value} at the initial state; it must return a finite number of joules")


def _mechanical_energy(model: Any) -> Callable[[np.ndarray, np.ndarray], float]:
    return lambda q, v: float(model.kinetic_energy(q, v) + model.potential_energy(q))
