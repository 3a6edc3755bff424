"""Cost of accuracy of a scene: integrators and tolerances, forms, refinements and precisions, and effects, in one picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ClassVar

import numpy as np

from .. import _core
from ..accuracy.checked_options import (
    checked_model,
    checked_names,
    checked_positive,
    checked_precisions,
    checked_refinements,
    checked_seconds,
)
from ..accuracy.rungs import Rung, epsilon, precision_name
from ..accuracy.tables.confirmation import SECOND, about, confirmation, own_error
from ..accuracy.tables.work_precision import (
    STEPS,
    TOLERANCES,
    Integrate,
    Run,
    WorkPrecisionTable,
    measured_row,
    trajectory_error,
)
from ..arguments import one_number
from ..dynamics.integrator_names import integrator_names, takes_one_size
from ..state import at_state
from .measuring import effects_on, having_on, mark_front, sampled_times, timed_run

INTEGRATORS = ("dopri5", "dop853", "rkmk4")
PRECISIONS = ("double", "extended")
REFINEMENTS = ((0, "same"), (1, "wider"))
REFERENCE = ("dop853", 1e-16)
"""Integrator of high order, and its tolerance, for the reference in extended precision."""
FINE = ("dop853", 50.0)
"""Integrator that compares forms, refinements and precisions, and its tolerance relative to the precision's rounding."""
USUAL = ("dopri5", "rosenbrock4")
"""Integrators for scenes without an effect: the first suitable one is used."""
USUAL_TOLERANCE = 1e-9
"""Theirs."""


class SceneAccuracyTable(WorkPrecisionTable):
    """Rows of `Scene.accuracy`: one run each, grouped by the varied option.

    Each row is a dictionary with the columns of `WorkPrecisionTable`, of which "drift" is None, and: "varied" ("integrator", "arithmetic"
    or "effects"), "left out" (names of effects), "form", "refine", "residual", "precision", "pareto" (no other row is faster and more
    accurate).
    """

    columns = (
        "varied", "left out", "integrator", "tolerance", "step", "form", "refine", "residual", "precision", "error", "drift", "seconds",
        "evaluations", "resolved", "pareto", "refused",
    )  # fmt: skip
    shown = {
        "varied": "varied", "way": "", "integrator": "integrator", "tolerance": "tolerance or step", "error": "error (rad, m)",
        "seconds": "time", "evaluations": "evaluations", "refused": "",
    }  # fmt: skip
    short: ClassVar[dict[str, str]] = {"tolerance": "tol., step"}
    legend: ClassVar[dict[str, str]] = {"*": "Pareto front"}

    @property
    def front(self) -> list[dict[str, Any]]:
        """The rows of the Pareto front, fastest first."""
        return sorted((row for row in self.rows if row["pareto"]), key=lambda row: row["seconds"])

    def way(self, row: dict[str, Any]) -> str:
        """Return the differences of a row from the default, in words."""
        if row["varied"] == "effects":
            return f"without {' + '.join(row['left out'])}"
        if row["varied"] == "arithmetic":
            width = "" if row["precision"] == "double" else f", {precision_name(row['precision'])}"
            return Rung(row["form"], row["refine"], row["residual"], row["precision"]).way + width
        return ""

    def cell(self, key: str, row: dict[str, Any]) -> str:
        if key == "way":
            return self.way(row)
        if key == "refused" and not row["refused"]:
            return "Pareto front" if row["pareto"] else ""
        return super().cell(key, row)

    def marks(self, row: dict[str, Any]) -> str:
        return "*" * bool(row["pareto"])

    def style(self, row: dict[str, Any]) -> str:
        return "dim" if row["refused"] else "bold" if row["pareto"] else ""

    def label(self, row: dict[str, Any]) -> str:
        return self.way(row) or f"{row['integrator']} at {self.cell('tolerance', row)}"

    def plot(self, ax: Any = None) -> Any:
        """Plot the error of the trajectory against run time, both logarithmic, with the Pareto front; return the axes."""
        from .cost_pictures import scene_accuracy_plot

        return scene_accuracy_plot(self, ax)


def accuracy(
    scene: Any, T: Any, q: Any, v: Any, *, integrators: Any, tolerances: Any, steps: Any, forms: Any, refinements: Any, precisions: Any,
    without: Any, seconds: Any, progress: Callable[[str], None] | None,
) -> SceneAccuracyTable:  # fmt: skip
    """`Scene.accuracy`."""
    model, seconds = scene.model, checked_seconds(seconds)
    checked_model(model, "the accuracy of a scene")
    q, v = at_state(model, q, v)
    if not 0 < (length := one_number(T, "T")) < np.inf:
        raise _core.EvaluationError(f"T={length:g}: a run lasts a positive number of seconds")
    times = sampled_times(length)
    tell = progress or (lambda _: None)
    ways = [
        *_integrators(scene, integrators, tolerances, steps),
        *_arithmetic(scene, forms, refinements, precisions),
        *_effects(scene, without),
    ]

    tell("reference")
    wide = _as(_at_states(scene), (*scene._how[:3], "extended"))
    tolerance = REFERENCE[1]
    run = _by(wide, times, q, v)
    truth, looser = (run(REFERENCE[0], rtol=r, atol=r)[0] for r in (tolerance, 100 * tolerance))
    found = confirmation(
        truth, lambda: run(SECOND, rtol=tolerance, atol=tolerance)[0], partial(trajectory_error, model), f"{SECOND} in extended precision"
    )
    own = own_error(trajectory_error(model, truth, looser), found)
    rows = []
    for way, other, integrator, options in ways:
        tell(f"{way['varied']}: {', '.join(map(str, (integrator, *options.values())))}")
        rows.append(measured_row(model, integrator, options, _by(other, times, q, v), truth, own, None, 0.0, seconds) | way)
    mark_front(rows, "seconds", "error", own)
    return SceneAccuracyTable(
        f"What accuracy costs in the scene of {model.name}, a run of {length:g} s",
        rows,
        {
            "model": model.name, "nv": model.nv, "T": length, "reference": f"{REFERENCE[0]} in extended precision, tolerance {tolerance:g}",
            "reference_error": own, **about(found), "q": np.asarray(q).tolist(), "v": np.asarray(v).tolist(), "effects": effects_on(scene),
        },
    )  # fmt: skip


Way = tuple[dict[str, Any], Any, str, dict[str, float]]
"""Columns of a row, the scene to run, the integrator and its options."""


def _way(scene: Any, varied: str, left_out: Sequence[str] = ()) -> dict[str, Any]:
    form, refine, residual, precision = scene._how
    return {
        "varied": varied, "left out": list(left_out), "form": form, "refine": refine, "residual": residual if refine else "same",
        "precision": precision,
    }  # fmt: skip


def _integrators(scene: Any, integrators: Any, tolerances: Any, steps: Any) -> list[Way]:
    """Yield the unchanged scene with integrators at tolerances or steps."""
    names = checked_names(INTEGRATORS if integrators is None else integrators, "integrators", "integrator", integrator_names())
    controlled = checked_positive(TOLERANCES if tolerances is None else tolerances, "tolerances", "a positive, finite tolerance")
    sizes = checked_positive(STEPS if steps is None else steps, "steps", "a positive, finite number of seconds")
    ways: list[Way] = []
    for name in names:
        for amount in sizes if takes_one_size(name) else controlled:
            ways.append((_way(scene, "integrator"), scene, name, _options(name, amount)))
    return ways


def _arithmetic(scene: Any, forms: Any, refinements: Any, precisions: Any) -> list[Way]:
    """Yield forms and refinements in the scene's precision, and other precisions, with an integrator of high order at a fine tolerance."""
    form, refine, residual, precision = scene._how
    shapes = checked_names(_core.forms() if forms is None else forms, "forms", "form", _core.forms())
    refined = checked_refinements(list(REFINEMENTS) if refinements is None else refinements)
    widths = checked_precisions(PRECISIONS if precisions is None else precisions)
    hows = [(shape, *way, precision) for shape in shapes for way in refined]
    hows += [(form, refine, residual, width) for width in widths]
    ways: list[Way] = []
    plain = _at_states(scene)
    for how in dict.fromkeys(hows):
        other = _as(plain, how)
        ways.append((_way(other, "arithmetic"), other, FINE[0], _options(FINE[0], max(FINE[1] * epsilon(how[3]), REFERENCE[1]))))
    return ways


def _effects(scene: Any, without: Any) -> list[Way]:
    from .comparison import _checked_set, _listed

    sets = [[name] for name in effects_on(scene)] if without is None else [_checked_set(scene, one) for one in _listed(without)]
    on = effects_on(scene)
    others = [(names, having_on(scene, set(on) - set(names))) for names in sets]
    return [(_way(other, "effects", names), other, _fitting(other), _options(USUAL[0], USUAL_TOLERANCE)) for names, other in others]


def _fitting(scene: Any) -> str:
    """Return the first suitable integrator of `USUAL`; if none is suitable, the first, which raises the error."""
    for name in USUAL:
        try:
            _core.check_pairing(scene._calls(), name, False, False)
        except _core.EvaluationError:
            continue
        return name
    return USUAL[0]


def _at_states(scene: Any) -> Any:
    """Return the scene with effects that all act at states, with the same equations of motion: implicit effects become their limits."""
    other = _as(scene, scene._how)
    other._entries.update({name: (effect.at_states(scene.model), on) for name, (effect, on) in scene._entries.items()})
    return other


def _options(integrator: str, amount: float) -> dict[str, float]:
    return {"step": amount} if takes_one_size(integrator) else {"rtol": amount, "atol": amount}


def _as(scene: Any, how: Sequence[Any]) -> Any:
    """Return the scene with another form, refinement, residual or precision."""
    form, refine, residual, precision = how
    other = type(scene)(scene.model, form=form, refine=refine, residual=residual if refine else "same", precision=precision)
    other._entries.update(scene._entries)
    return other


def _by(scene: Any, times: np.ndarray, q: Any, v: Any) -> Integrate:
    """Return a function that runs a scene, for `measured_row`."""

    def integrate(integrator: str, **options: Any) -> Run:
        run, took = timed_run(scene, times, q, v, integrator=integrator, **options)
        return run.q, run.v, run.statistics["evaluations"], took

    return integrate
