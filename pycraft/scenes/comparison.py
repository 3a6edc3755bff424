"""Value of each effect: the error of leaving it out, against the time saved."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import numpy as np

from .. import _core
from ..accuracy.checked_options import checked_model, checked_seconds
from ..accuracy.tables.work_precision import trajectory_error
from ..arguments import one_number
from ..dynamics.integrator_names import integrator_named, takes_one_size
from ..state import at_state
from ..tidy import TidyTable, error_text, refusal_text, seconds_text, share_text
from .measuring import effects_on, evaluation_of, having_on, in_turn, mark_front, run_at, sampled_times, timed_run

LOOSER = 100.0
"""Factor of tolerances: the error of the whole scene's own run is its distance to a run at looser tolerances, as in
`pycraft.work_precision`; for fixed steps, twice its distance to a run with half the step."""


class ComparisonTable(TidyTable):
    """Rows of `Scene.compare`: the scene with everything, then without each effect or set of effects.

    Each row is a dictionary: "left out" (a list of names), "together" (True for the sets that matter least), "acceleration" (error of
    the accelerations, ‖δv̇‖ relative to the largest ‖v̇‖ along the run of the whole scene, the largest over its sampled states),
    "trajectory" (rad, m: the root mean square over coordinates, the largest over the times), "evaluation" and "run" (s), "saved" and
    "saved of run" (shares of the whole scene's times), "evaluations" (of the run), "resolved" (True if "trajectory" exceeds
    `own_error`), "pareto" (no other row has a faster run and a smaller error), "refused" (the reason, if the scene was refused).

    own_error : rad, m, error of the whole scene's run. noise : share of an evaluation by which two measurements of the same scene differed.
    """

    columns = (
        "left out", "together", "acceleration", "trajectory", "evaluation", "saved", "run", "saved of run", "evaluations", "resolved",
        "pareto", "refused",
    )  # fmt: skip
    shown = {
        "left out": "left out", "acceleration": "error of v̇", "trajectory": "error of q (rad, m)", "evaluation": "evaluation",
        "saved": "saved of it", "run": "run", "saved of run": "saved of run", "refused": "",
    }  # fmt: skip
    short: ClassVar[dict[str, str]] = {"acceleration": "of v̇", "trajectory": "of q"}
    legend: ClassVar[dict[str, str]] = {"*": "Pareto front"}
    measure = "trajectory"

    @property
    def own_error(self) -> float:
        return self.about["own_error"]

    @property
    def noise(self) -> float:
        return self.about["noise"]

    @property
    def front(self) -> list[dict[str, Any]]:
        """The rows of the Pareto front, fastest first."""
        return sorted((row for row in self.rows if row["pareto"]), key=lambda row: row["run"])

    def plot(self, axes: Any = None) -> Any:
        """Plot two panels, errors of trajectory and accelerations against the times of a run and of an evaluation; return the axes."""
        from .cost_pictures import comparison_plot

        return comparison_plot(self, axes)

    def stack(self, axes: Any = None) -> Any:
        """Plot the effects as a stack: the cost of each in an evaluation, and in the same colours the error of the run without it.

        Parameters
        ----------
        axes : two Axes of Matplotlib, side by side; default: new ones

        Returns
        -------
        The axes. Costs of a pass that several effects share belong to none of them: they are in "all the rest".
        """
        from .effect_stack import effect_stack

        return effect_stack(self, axes)

    def label(self, row: dict[str, Any]) -> str:
        names = row["left out"]
        if names and row["together"]:
            return f"the {len(names)} least: {', '.join(names)}"
        return " + ".join(names) or "nothing"

    def cell(self, key: str, row: dict[str, Any]) -> str:
        if key == "left out":
            return self.label(row)
        if key == "refused":
            return refusal_text(row["refused"], 40) or ("Pareto front" if row["pareto"] else "")
        if row[key] is None:
            return ""
        if key == "trajectory":
            return error_text(row[key]) if row["resolved"] else f"< {error_text(self.own_error)}"
        if key == "acceleration":
            return error_text(row[key]) if row[key] else "0"
        if key in ("evaluation", "run"):
            return seconds_text(row[key])
        if key == "saved" and abs(row[key]) < self.noise:
            return "none" if row["left out"] else ""
        if row["left out"] and row[key] < -1:  # a percentage is unclear for a run several times as long
            return f"takes {1 - row[key]:.2g} ×"
        return share_text(row[key]) if row["left out"] else ""

    def marks(self, row: dict[str, Any]) -> str:
        return "*" * bool(row["pareto"])

    def style(self, row: dict[str, Any]) -> str:
        return "dim" if row["refused"] else "bold" if row["pareto"] else ""


class Leaving:
    """A scene's run, and the errors of leaving effects out."""

    def __init__(self, scene: Any, T: Any, q: Any, v: Any, options: dict[str, Any]):
        checked_model(scene.model, "a comparison of a scene")
        self.scene, self.options, self.on = scene, options, effects_on(scene)
        self.q, self.v = at_state(scene.model, q, v)
        if not 0 < (length := one_number(T, "T")) < np.inf:
            raise _core.EvaluationError(f"T={length:g}: a run lasts a positive number of seconds")
        self.times = sampled_times(length)
        self.run = self.run_without(())
        own = scene._calls().states
        ends = np.cumsum([0, *own])
        self.own = {name: slice(a, b) for name, a, b in zip(self.on, ends[:-1], ends[1:], strict=True)}
        self.largest = float(np.linalg.norm(self.run.vdot, axis=1).max()) or 1.0

    def without(self, names: Iterable[str]) -> Any:
        """Return the scene without these effects."""
        return having_on(self.scene, set(self.on) - set(names))

    def run_without(self, names: Iterable[str], **other: Any) -> Any:
        """Its run."""
        return run_at(self.without(names), self.times, self.q, self.v, **self.options | other)

    def acceleration_error(self, names: Iterable[str]) -> float:
        """Return the error of the accelerations at the states of the whole scene's run."""
        left = set(names)
        kept = [self.run.states[:, self.own[name]] for name in self.on if name not in left]
        own = np.concatenate([np.zeros((len(self.times), 0)), *kept], axis=1)
        vdot = self.without(left)._calls().along(self.run.t, self.run.q, self.run.v, own)["vdot"]
        return float(np.linalg.norm(vdot - self.run.vdot, axis=1).max()) / self.largest

    def trajectory_error(self, run: Any) -> float:
        """Return the error of a run relative to the whole scene's run, rad, m."""
        return trajectory_error(self.scene.model, self.run.q, run.q)

    def own_error(self) -> float:
        """Return an estimate of the error of the whole scene's run, not too small, rad, m."""
        if takes_one_size(integrator_named(self.options["integrator"]).name):
            finer = self.run_without((), step=self.options["step"] / 2)
            return 2 * self.trajectory_error(finer)  # for order one and higher, they differ by at least half the error
        looser = {name: LOOSER * self.options[name] for name in ("rtol", "atol")}
        tighter = {name: self.options[name] / LOOSER for name in ("rtol", "atol")}
        found = []
        for tolerances in (looser, tighter):
            try:
                found.append(self.trajectory_error(self.run_without((), **tolerances)))
            except (ArithmeticError, _core.Error):  # the tolerance is too loose or too tight
                continue
            if found[-1] > 0:  # otherwise both runs took the same, largest steps
                break
        return max(found, default=float(np.inf))


def compare(
    scene: Any, without: Any, T: Any, q: Any, v: Any, options: dict[str, Any], seconds: Any, progress: Callable[[str], None] | None
) -> ComparisonTable:
    """`Scene.compare`."""
    seconds = checked_seconds(seconds)
    tell = progress or (lambda _: None)
    sets = None if without is None else [_checked_set(scene, one) for one in _listed(without)]
    tell("everything")
    whole = Leaving(scene, T, q, v, options)
    own = whole.own_error()
    if sets is None:
        sets = [[name] for name in whole.on]
    rows = [_errors(whole, names, own, tell) for names in [[], *sets]]
    if without is None and len(sets) > 2:
        rows += _together(whole, rows, own, tell)
    tell("times")
    there = [row for row in rows if not row["refused"]]
    timed = [evaluation_of(whole.without(row["left out"]), whole.run.q, whole.run.v) for row in there]
    first, *times, again = in_turn(seconds, [*timed, timed[0]])
    evaluations = [min(first, again), *times]
    runs = in_turn(seconds, [_timed_run(whole, row["left out"]) for row in there])
    for row, evaluation, run in zip(there, evaluations, runs, strict=True):
        row |= {"evaluation": evaluation, "saved": 1 - evaluation / evaluations[0], "run": run, "saved of run": 1 - run / runs[0]}
    mark_front(rows, "run", "trajectory", own)
    model = scene.model
    about = {
        "model": model.name,
        "nv": model.nv,
        "T": whole.times[-1],
        "own_error": own,
        "noise": abs(first - again) / evaluations[0],
        **options,
    }
    return ComparisonTable(f"Effects left out of the scene of {model.name}, a run of {whole.times[-1]:g} s", rows, about)


def _listed(without: Any) -> list[Any]:
    if isinstance(without, str) or not isinstance(without, Iterable):
        return [without]
    if not (found := list(without)):
        raise _core.EvaluationError("without is empty: name effects, or leave it out to compare every effect that is on")
    return found


def _checked_set(scene: Any, given: Any) -> list[str]:
    """Return the names of one effect or a set of effects, and check that they are on."""
    several = isinstance(given, (list, tuple, set, frozenset))
    names = list(dict.fromkeys(scene._name(one) for one in (given if several else [given])))
    for name in names:
        if not scene.is_on(name):
            raise _core.ModelError(f"effect {name!r} is off already; enable it to see what leaving it out does")
    if not names:
        raise _core.EvaluationError("without contains an empty set of effects; the whole scene always has its own row")
    return names


def _errors(whole: Leaving, names: list[str], own: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return a row without its times."""
    row: dict[str, Any] = dict.fromkeys(ComparisonTable.columns) | {"left out": names, "together": False, "pareto": False, "refused": ""}
    if not names:
        return row | {"acceleration": 0.0, "trajectory": 0.0, "resolved": False, "evaluations": whole.run.statistics["evaluations"]}
    tell(f"without {', '.join(names)}")
    try:
        run = whole.run_without(names)
        error = whole.trajectory_error(run)
        row |= {"acceleration": whole.acceleration_error(names), "trajectory": error, "resolved": error > own}
    except (ArithmeticError, _core.Error) as reason:
        return row | {"acceleration": None, "refused": str(reason)}
    return row | {"evaluations": run.statistics["evaluations"]}


def _together(whole: Leaving, rows: list[dict[str, Any]], own: float, tell: Callable[[str], None]) -> list[dict[str, Any]]:
    """Yield the sets of effects that matter least: two effects, three, and so on, except all."""
    ranked = sorted((row for row in rows[1:] if not row["refused"]), key=lambda row: (row["trajectory"], row["acceleration"]))
    names = [row["left out"][0] for row in ranked]
    return [_errors(whole, names[:count], own, tell) | {"together": True} for count in range(2, len(whole.on))]


def _timed_run(whole: Leaving, names: list[str]) -> Callable[[float], float]:
    scene = whole.without(names)

    def timed(seconds: float) -> float:
        best, spent = np.inf, 0.0
        while True:
            run, took = timed_run(scene, whole.times, whole.q, whole.v, **whole.options)
            best, spent = min(best, took), spent + run.statistics["seconds"]
            if spent >= seconds:
                return best

    return timed
