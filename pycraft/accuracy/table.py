"""What accuracy costs: error, time and memory of every way of computing forward dynamics, and the Pareto front among them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .. import _core
from .exact import dynamics_error, exact_dynamics
from .rungs import LADDER, OTHER_METHODS, Rung, epsilon, precision_name, reference_of
from .tidy import TidyTable, error_text, refusal_text, seconds_text
from .timing import time_forward_dynamics, workspace_bytes

STATES = 5
"""Random states that a model is measured at where none is given."""


class AccuracyTable(TidyTable):
    """Rows of `accuracy`, cheapest first, refused ones last.

    Each row is a dictionary: "way" (form or method and refinement), "form", "refine", "residual", "precision", "method", "error" (relative,
    the largest over the states), "median_error", "reference" (what errors are measured against), "seconds" (per evaluation), "cost" (the
    time over that of `fast` in double, where that is not refused), "bytes" (of the workspace), "states" (how many), "pareto" (no other
    row is both faster and more accurate), "refused" (the reason, where there is one; then there is no error).
    """

    columns = (
        "way", "form", "refine", "residual", "precision", "method", "error", "median_error", "reference", "seconds", "cost", "bytes",
        "states", "pareto", "refused",
    )  # fmt: skip
    shown = {
        "way": "way", "precision": "precision", "error": "error", "seconds": "time", "cost": "of fast", "bytes": "bytes", "refused": "",
    }  # fmt: skip

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
        """Error against time per evaluation, both logarithmic, the Pareto front drawn and named; returns the axes."""
        from .plotting import accuracy_plot

        return accuracy_plot(self, ax)

    def cell(self, key: str, row: dict[str, Any]) -> str:
        if key == "error":
            return error_text(row["error"])
        if key == "seconds":
            return seconds_text(row["seconds"])
        if key == "cost":
            return "" if row["cost"] is None else f"{row['cost']:.3g} x"
        if key == "precision":
            return precision_name(row["precision"])
        if key == "refused":
            return refusal_text(row["refused"]) or ("Pareto front" if row["pareto"] else "")
        return super().cell(key, row)

    def style(self, row: dict[str, Any]) -> str:
        return "dim" if row["refused"] else "bold" if row["pareto"] else ""


def accuracy(
    model: Any,
    q: Any = None,
    v: Any = None,
    tau: Any = None,
    *,
    forms: Sequence[str] | None = None,
    refinements: Sequence[int | str | tuple[int | str, str]] | None = None,
    precisions: Sequence[Any] | None = None,
    methods: Sequence[str] | None = None,
    seed: int = 0,
    seconds: float = 0.1,
    progress: Callable[[str], None] | None = None,
) -> AccuracyTable:
    """Forward dynamics of a model in every form, refinement, precision and method: error, time and memory.

    Parameters
    ----------
    model : Multibody
    q, v, tau : (nq,), (nv,), (nv,), each with an optional leading batch axis
        The states. Left out: q five random states (v with them), v zero, tau drawn from a standard normal distribution.
    forms : of the articulated-inertia sweep; all that there are
    refinements : of 0, 1, ..., "auto", and pairs with the residual: (1, "wider")
        0, 1 and (1, "wider") in single and double precision, 0 beyond.
    precisions : "single", "double", "extended", "quad", 50, 100
        The first four; single and double for the other methods.
    methods : "articulated" and those of `forward_dynamics`; all of them
    seed : of the states and forces
    seconds : spent on the timing of each row
    progress : called with the label of each row before it is measured

    Every combination of what is given is a row; forms and refinements belong to the articulated method. Errors are relative, in the
    2-norm of the accelerations, against quad precision; those of quad itself, and of what is wider, against the next wider precision.
    In precisions wider than double results are rounded to double when they are returned: the error there is the correction that a residual
    in the next wider precision makes, but for refined values and other methods, which show their rounding to double.
    Times are the least of many calls of one state from C++, in rotation over the states. A way that raises at one of the states is
    refused as a whole.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.accuracy.table import accuracy
    >>> table = accuracy(pc.chain(5, seed=1), precisions=["double", "quad"], methods=["articulated"], forms=["fast"], seconds=0.001)
    >>> table.fastest(1e-10)["way"], table.fastest(1e-25)["precision"]
    ('fast', 'quad')
    """
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
    return AccuracyTable(title, rows, {"model": model.name, "nv": model.nv, "states": len(q), "seed": seed})


def _row(model: Any, q: Any, v: Any, tau: Any, rung: Rung, truth: Callable, seconds: float) -> dict[str, Any]:
    row: dict[str, Any] = dict.fromkeys(AccuracyTable.columns)
    articulated = rung.method == "articulated"
    row |= {"way": rung.way, "form": rung.form if articulated else "", "refine": rung.refine, "method": rung.method}
    row |= {"residual": rung.residual if rung.refine else "", "precision": str(rung.precision)}
    row |= {"states": len(q), "pareto": False, "refused": ""}
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
    states = zip(q, v, tau, values, truth(reference), strict=True)
    errors = [dynamics_error(model, at, rate, force, rung, value, exact) for at, rate, force, value, exact in states]
    return row | {"error": max(errors), "median_error": float(np.median(errors)), "reference": precision_name(reference)}


def mark_pareto(rows: list[dict[str, Any]]) -> None:
    """Mark the rows that no other is at once as fast as, and more accurate than; refused rows are out of it."""
    best = float("inf")
    for row in sorted((r for r in rows if not r["refused"]), key=lambda r: (r["seconds"], r["error"])):
        row["pareto"] = row["error"] < best
        best = min(best, row["error"])


def _product(forms: Any, refinements: Any, precisions: Any, methods: Any) -> list[Rung]:
    """The rows: what is given with everything, else the defaults that `accuracy` documents."""
    known = _core.forms()
    for form in forms or ():
        if form not in known:
            raise _core.EvaluationError(f"form {form!r} is not there; there are {', '.join(known)}")
    rungs: list[Rung] = []
    for method in methods if methods is not None else ("articulated", *OTHER_METHODS):
        articulated = method == "articulated"
        widths = precisions if precisions is not None else ("single", "double", "extended", "quad") if articulated else ("single", "double")
        for precision in widths:
            narrow = epsilon(precision) >= epsilon("double")
            steps = refinements if refinements is not None else (0, 1, (1, "wider")) if narrow and articulated else (0,)
            for form in (forms if forms is not None else known) if articulated else ("fast",):
                for step in steps:
                    refine, residual = step if isinstance(step, tuple) else (step, "same")
                    rungs.append(Rung(form, refine, residual, precision, method))
    return rungs


def _states(model: Any, q: Any, v: Any, tau: Any, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if v is None and hasattr(q, "v"):
        v = q.v
    q = getattr(q, "q", q)
    if q is None:
        drawn = [model.random_state(np.random.default_rng([seed, i])) for i in range(STATES)]
        q, v = np.array([s.q for s in drawn]), np.array([s.v for s in drawn]) if v is None else v
    q = np.atleast_2d(np.asarray(q, float))
    v = np.atleast_2d(np.zeros(model.nv) if v is None else np.asarray(v, float))
    tau = np.atleast_2d(np.random.default_rng(seed).normal(size=(len(q), model.nv)) if tau is None else np.asarray(tau, float))
    count = max(len(q), len(v), len(tau))
    for name, array, width in (("q", q, model.nq), ("v", v, model.nv), ("tau", tau, model.nv)):
        if array.shape not in ((1, width), (count, width)):
            takes = f"takes {width} numbers, or ({count}, {width}) as the others, not an array {array.shape}"
            raise _core.ModelError(f"{name} of {model.name!r} {takes}")
    return tuple(np.ascontiguousarray(np.broadcast_to(a, (count, a.shape[1]))) for a in (q, v, tau))  # type: ignore[return-value]


def ladder(table: AccuracyTable) -> list[dict[str, Any]]:
    """The rows of a table that are steps of the ladder (fast, fast + 1 refinement, ud, ud + 1 refinement, extended, quad), in its order."""
    found = []
    for step in LADDER:
        same = [replace(step, precision=str(step.precision)) == _rung_of(row) for row in table]
        found += [row for row, fits in zip(table, same, strict=True) if fits]
    return found


def _rung_of(row: dict[str, Any]) -> Rung:
    return Rung(row["form"] or "fast", row["refine"], row["residual"] or "same", row["precision"], row["method"])
