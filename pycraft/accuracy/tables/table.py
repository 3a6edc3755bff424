"""Cost of accuracy: error, time and memory of every way of computing forward dynamics, and the Pareto front."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import mpmath
import numpy as np

from ... import _core
from ...dynamics.by_realization import motion_state
from ...tidy import TidyTable, bytes_text, error_text, refusal_text, seconds_text
from ..checked_options import METHODS, checked_model, checked_names, checked_precisions, checked_refinements, checked_seconds
from ..exact import BITS, dynamics_error, exact_dynamics
from ..rungs import LADDER, Rung, epsilon, precision_name, reference_of
from .timing import time_forward_dynamics, workspace_bytes

STATES = 5
"""Default number of random states."""


class AccuracyTable(TidyTable):
    """Rows of `accuracy`, cheapest first, refused rows last.

    Each row is a dictionary: "way" (form or method and refinement), "form", "refine", "residual", "precision", "method", "error" (relative,
    2-norm, the largest over the states), "median_error", "component" (the largest relative error of one acceleration, |δ_i| / |x_i|, as
    returned in double), "rounded" (True if "error" includes the rounding to double of a wider precision), "reference"
    (precision of the reference), "seconds" (per evaluation), "cost" (the time over the time of `fast` in double, if that is not
    refused), "bytes" (of the workspace), "states" (how many), "pareto" (no other row is both faster and more accurate), "refused" (the
    reason, if the row is refused; then there is no error).
    """

    columns = (
        "way", "form", "refine", "residual", "precision", "method", "error", "median_error", "component", "rounded", "reference", "seconds",
        "cost", "bytes", "states", "pareto", "refused",
    )  # fmt: skip
    shown = {
        "way": "way", "precision": "precision", "error": "error", "component": "component", "seconds": "time",
        "cost": "time / fast", "bytes": "workspace", "refused": "",
    }  # fmt: skip
    short: ClassVar[dict[str, str]] = {"cost": "/ fast"}
    legend: ClassVar[dict[str, str]] = {"*": "Pareto front", "°": "rounded to double"}

    @property
    def front(self) -> list[dict[str, Any]]:
        """The rows of the Pareto front, fastest first."""
        return [row for row in self.rows if row["pareto"]]

    def fastest(self, error: float) -> dict[str, Any]:
        """The cheapest row whose error is at most `error`. Raises ValueError where none is, and says what the best is."""
        answers = [row for row in self.rows if not row["refused"] and row["error"] <= error]
        if not answers:
            best = min((row for row in self.rows if not row["refused"]), key=lambda row: row["error"], default=None)
            found = "every way is refused" if best is None else f"the best is {best['way']} in {best['precision']}, {best['error']:.1e}"
            raise ValueError(f"no row of {self.title!r} has an error of at most {error:g}: {found}")
        return min(answers, key=lambda row: row["seconds"])

    def plot(self, ax: Any = None) -> Any:
        """Plot error against time per evaluation, both logarithmic, with the labelled Pareto front; return the axes."""
        from .plotting import accuracy_plot

        return accuracy_plot(self, ax)

    def cell(self, key: str, row: dict[str, Any]) -> str:
        if key in ("error", "component"):
            return error_text(row[key])
        if key == "bytes":
            return bytes_text(row["bytes"])
        if key == "seconds":
            return seconds_text(row["seconds"])
        if key == "cost":
            return "" if row["cost"] is None else f"{row['cost']:.3g} x"
        if key == "precision":
            return precision_name(row["precision"])
        if key == "refused":
            notes = ["Pareto front"] * bool(row["pareto"]) + ["rounded to double"] * bool(row["rounded"])
            return refusal_text(row["refused"], 32) or ", ".join(notes)
        return super().cell(key, row)

    def marks(self, row: dict[str, Any]) -> str:
        return "*" * bool(row["pareto"]) + "°" * bool(row["rounded"])

    def label(self, row: dict[str, Any]) -> str:
        return row["way"] + ("" if row["precision"] == "double" else f", {precision_name(row['precision'])}")

    def style(self, row: dict[str, Any]) -> str:
        return "dim" if row["refused"] else "bold" if row["pareto"] else ""


def accuracy(
    model: Any,
    q: Any = None,
    v: Any = None,
    tau: Any = None,
    *,
    forms: str | Sequence[str] | None = None,
    refinements: int | str | tuple[int | str, str] | Sequence[int | str | tuple[int | str, str]] | None = None,
    precisions: str | int | Sequence[str | int] | None = None,
    methods: str | Sequence[str] | None = None,
    seed: int = 0,
    seconds: float = 0.1,
    progress: Callable[[str], None] | None = None,
) -> AccuracyTable:
    """Measure forward dynamics of a model in every form, refinement, precision and method: error, time and memory.

    Parameters
    ----------
    model : Multibody
    q, v, tau : (nq,), (nv,), (nv,), each with an optional leading batch axis
        The states: rad, m and their rates; N m, N. Default: five random states for q (with v), zero for v, tau drawn from a standard normal
        distribution.
    forms : forms of the articulated-inertia sweep; default: all
    refinements : some of 0, 1, ..., "auto", and pairs with the residual: (1, "gather"), (1, "wider")
        Default: 0, 1, (1, "gather") and (1, "wider") in single and double precision, 0 and 1 in extended, 0 beyond.
    precisions : "single", "double", "extended", "quad", 50, 100
        Default: the first four; single and double for the other methods.
    methods : "articulated" and the methods of `forward_dynamics`; default: all
    seed : seed of the random states and forces
    seconds : time spent on each row
    progress : called with the label of each row before it is measured

    Every combination of the arguments is a row (a single name or number counts as a list of one); forms and refinements belong to the
    articulated method. Errors are relative, in the 2-norm of the accelerations, against quad precision; errors of quad and wider
    precisions against the next wider precision. A 2-norm over rad/s² and m/s² hides errors of small components; "component" shows
    them.
    In precisions wider than double, results are rounded to double when returned: the error there is the correction by a residual
    in the next wider precision, except for refined values and other methods, whose rows include the rounding to double and are marked.
    Times are the least of many calls for one state from C++, in rotation over the states. A way that raises at one of the states is
    refused as a whole.

    Raises
    ------
    TypeError
        The argument is not a model.
    ModelError
        A model without coordinates, no state, states of the wrong shape or not finite.
    EvaluationError
        An unknown form, refinement, precision or method; an empty list; seconds or seed below zero.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.accuracy.tables.table import accuracy
    >>> table = accuracy(pc.chain(5, seed=1), precisions=["double", "quad"], methods=["articulated"], forms=["fast"], seconds=0.001)
    >>> table.fastest(1e-10)["precision"], table.fastest(1e-25)["precision"]
    ('double', 'quad')
    """
    checked_model(model, "accuracy")
    seconds = checked_seconds(seconds)
    q, v, tau = _states(model, q, v, tau, seed)
    rungs = _product(forms, refinements, precisions, methods)
    exact: dict[Any, list[np.ndarray]] = {}

    def truth(reference: Any) -> list[np.ndarray]:
        if reference not in exact:
            exact[reference] = [exact_dynamics(model, *state, reference) for state in zip(q, v, tau, strict=True)]
        return exact[reference]

    rows = []
    for rung in rungs:
        if progress is not None:
            progress(rung.label)
        rows.append(_row(model, q, v, tau, rung, truth, seconds))
    own = rows[rungs.index(Rung())] if Rung() in rungs else _row(model, q, v, tau, Rung(), truth, seconds)
    for row in rows:
        if not row["refused"] and own["seconds"]:
            row["cost"] = row["seconds"] / own["seconds"]
    mark_pareto(rows)
    rows.sort(key=lambda row: (bool(row["refused"]), row["seconds"] or 0.0))
    which = f"{len(q)} states" if len(q) > 1 else "one state"
    title = f"Forward dynamics of {model.name}, {model.nv} degrees of freedom, {which}"
    return AccuracyTable(
        title, rows, {"model": model.name, "nv": model.nv, "states": len(q), "seed": seed, "gravity": [float(g) for g in model.gravity]}
    )


def _row(model: Any, q: Any, v: Any, tau: Any, rung: Rung, truth: Callable, seconds: float) -> dict[str, Any]:
    row: dict[str, Any] = dict.fromkeys(AccuracyTable.columns)
    articulated = rung.method == "articulated"
    row |= {"way": rung.way, "form": rung.form if articulated else "", "refine": rung.refine, "method": rung.method}
    row |= {"residual": rung.residual if rung.refine else "", "precision": str(rung.precision)}
    row |= {"states": len(q), "pareto": False, "rounded": False, "refused": ""}
    reference = reference_of(rung.precision)
    try:
        values = [model.forward_dynamics(*state, **rung.options) for state in zip(q, v, tau, strict=True)]
        row["seconds"] = time_forward_dynamics(model, q, v, tau, seconds, **rung.options)["minimum"]
        row["bytes"] = workspace_bytes(model, precision=rung.precision, form=rung.form, method=rung.method)
    except (ArithmeticError, _core.Error) as error:
        return row | {"refused": str(error), "seconds": None, "bytes": None}
    if reference is None:
        reason = f"nothing is wider than {precision_name(rung.precision)} to measure it against"
        return row | {"refused": reason, "seconds": None, "bytes": None}
    states = list(zip(q, v, tau, values, truth(reference), strict=True))
    errors = [dynamics_error(model, at, rate, force, rung, value, exact) for at, rate, force, value, exact in states]
    row |= {"error": max(errors), "median_error": float(np.median(errors)), "reference": precision_name(reference)}
    row["component"] = max(largest_component(value, exact) for *_, value, exact in states)
    row["rounded"] = epsilon(rung.precision) < epsilon("double") and bool(rung.refine or not articulated)
    return row


def largest_component(value: np.ndarray, exact: np.ndarray) -> float:
    """Return max |δ_i| / |x_i| of values (n,) against exact ones, mpmath numbers; infinite if a nonzero value should be zero."""
    with mpmath.workprec(BITS):
        off = [abs(mpmath.mpf(float(x)) - e) for x, e in zip(value, exact, strict=True)]
        return max(float(d / abs(e)) if e else float("inf") if d else 0.0 for d, e in zip(off, exact, strict=True))


def mark_pareto(rows: list[dict[str, Any]]) -> None:
    """Mark the rows for which no other row is both as fast and more accurate; refused rows are excluded."""
    best = float("inf")
    for row in sorted((r for r in rows if not r["refused"]), key=lambda r: (r["seconds"], r["error"])):
        row["pareto"] = row["error"] < best
        best = min(best, row["error"])


def _product(forms: Any, refinements: Any, precisions: Any, methods: Any) -> list[Rung]:
    """Return the rows: all combinations of the arguments, with the defaults documented in `accuracy`. All names are checked here."""
    ways = list(METHODS) if methods is None else checked_names(methods, "methods", "method", METHODS)
    shapes = list(_core.forms()) if forms is None else checked_names(forms, "forms", "form", _core.forms())
    widths = None if precisions is None else checked_precisions(precisions)
    steps = None if refinements is None else checked_refinements(refinements)
    rungs: list[Rung] = []
    for method in ways:
        if method != "articulated":
            rungs += [Rung(precision=precision, method=method) for precision in widths or ("single", "double")]
            continue
        for precision in widths or ("single", "double", "extended", "quad"):
            usual = _usual_refinements(precision) if steps is None else steps
            rungs += [Rung(form, refine, residual, precision) for form in shapes for refine, residual in usual]
    return list(dict.fromkeys(rungs))


def _usual_refinements(precision: Any) -> list[tuple[int | str, str]]:
    """Return the default refinements."""
    if epsilon(precision) >= epsilon("double"):
        return [(0, "same"), (1, "same"), (1, "gather"), (1, "wider")]
    return [(0, "same"), (1, "same")] if str(precision) == "extended" else [(0, "same")]


def _states(model: Any, q: Any, v: Any, tau: Any, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return checked states (B, nq), (B, nv), (B, nv), random by default."""
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise _core.EvaluationError(f"seed={seed!r}: give a whole number, zero or more")
    if v is None and hasattr(q, "v"):
        v = q.v
    if q is None:
        drawn = [model.random_state(np.random.default_rng([seed, i])) for i in range(STATES)]
        q, v = np.array([s.q for s in drawn]), np.array([s.v for s in drawn]) if v is None else v
    v = np.zeros(model.nv) if v is None else v
    q, v = (x[0] if np.ndim(x) == 2 and len(x) == 1 else x for x in (getattr(q, "q", q), getattr(v, "v", v)))
    *_, drawn_for = motion_state(model, q, v, np.zeros(model.nv))
    if tau is None:
        tau = np.random.default_rng(seed).normal(size=(*(drawn_for or (1,)), model.nv))
    q, v, tau, batch = motion_state(model, q, v, tau[0] if np.ndim(tau) == 2 and len(tau) == 1 else tau)
    if batch == (0,):
        raise _core.ModelError(f"no state given: the arrays for {model.name!r} have no rows")
    q, v, tau = (np.ascontiguousarray(np.broadcast_to(a, (*(batch or (1,)), a.shape[-1]))) for a in (q, v, tau))
    return q, v, tau


def ladder(table: AccuracyTable) -> list[dict[str, Any]]:
    """Return the rows that are steps of the ladder (fast, fast + 1 refinement, ud, ud + 1 refinement, extended, quad), in its order."""
    found = []
    for step in LADDER:
        same = [replace(step, precision=str(step.precision)) == _rung_of(row) for row in table]
        found += [row for row, fits in zip(table, same, strict=True) if fits]
    return found


def _rung_of(row: dict[str, Any]) -> Rung:
    return Rung(row["form"] or "fast", row["refine"], row["residual"] or "same", row["precision"], row["method"])
