"""Cost of keeping loops, by tree augmentation, by constraint embedding, and by springs: drift, energy and error against time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from .. import _core
from ..accuracy.checked_options import checked_model, checked_names, checked_positive, checked_seconds
from ..accuracy.tables.confirmation import SECOND, Confirmation, about, confirmation, own_error
from ..accuracy.tables.work_precision import STEPS, WorkPrecisionTable, measured_row, trajectory_error
from ..arguments import one_number
from ..dynamics.integrator_names import integrator_names, takes_one_size
from ..state import at_state
from ..tidy import error_text, refusal_text
from .effects import Loop
from .measuring import effects_on, mark_front, run_at, sampled_times
from .scene import Scene
from .scene_accuracy import _as, _at_states, _by, _options

METHODS = ("augment", "embed", "penalty")
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
KEPT, HELD = ("dopri5", "dop853"), ("dopri5", "rosenbrock4")
"""Default integrators for kept loops, and for springs, which are stiff."""
STIFFER = (10.0, 30.0, 100.0, 300.0, 1000.0)
"""Frequencies of springs, as multiples of the rate of the motion."""
REFERENCE = ("dop853", 1e-13)
LEAST = 1e-12
"""Least tolerance of runs with springs."""


class LoopsTable(WorkPrecisionTable):
    """Rows of `pycraft.loops_compared`: one run each.

    Each row is a dictionary with the columns of `WorkPrecisionTable`, of which "drift" is the largest residual of the loops' rows (m, rad)
    at the sampled times, and: "method" ("augment", "embed", "penalty"), "frequency" (rad/s, of penalties), "velocity drift" (the largest
    |Q v|, m/s and rad/s), "energy error" (the largest change of kinetic and potential energy less works, without the energy in springs and
    dampers of loops, over the largest kinetic energy of the reference; None if nothing moves), "pareto" (no other row is faster and more
    accurate).
    """

    columns = (
        "method", "integrator", "tolerance", "step", "frequency", "error", "drift", "velocity drift", "energy error", "seconds",
        "evaluations", "resolved", "pareto", "refused",
    )  # fmt: skip
    shown = {
        "way": "method, integrator", "tolerance": "tolerance or step", "frequency": "frequency (rad/s)", "error": "error (rad, m)",
        "drift": "drift of rows", "velocity drift": "of Q v", "energy error": "energy error", "seconds": "time",
        "evaluations": "evaluations", "refused": "",
    }  # fmt: skip
    short: ClassVar[dict[str, str]] = {
        "tolerance": "tol., step", "frequency": "rad/s", "error": "error", "drift": "drift", "energy error": "energy",
        "evaluations": "eval.",
    }  # fmt: skip
    legend: ClassVar[dict[str, str]] = {"*": "Pareto front"}
    common: ClassVar[str] = "way"

    @property
    def front(self) -> list[dict[str, Any]]:
        """The rows of the Pareto front, fastest first."""
        return sorted((row for row in self.rows if row["pareto"]), key=lambda row: row["seconds"])

    def cell(self, key: str, row: dict[str, Any]) -> str:
        if key == "way":
            return f"{row['method']}, {row['integrator']}"
        if key == "frequency":
            return "" if row["frequency"] is None else f"{row['frequency']:.3g}"
        if key in ("drift", "velocity drift", "energy error"):
            return "0" if row[key] == 0 else error_text(row[key])
        if key == "refused" and not row["refused"]:
            return "Pareto front" if row["pareto"] else ""
        return refusal_text(row["refused"], 40) if key == "refused" else super().cell(key, row)

    def marks(self, row: dict[str, Any]) -> str:
        return "*" * bool(row["pareto"])

    def style(self, row: dict[str, Any]) -> str:
        return "dim" if row["refused"] else "bold" if row["pareto"] else ""

    def label(self, row: dict[str, Any]) -> str:
        springs = "" if row["frequency"] is None else f", {self.cell('frequency', row)} rad/s"
        return f"{self.cell('way', row)} at {self.cell('tolerance', row)}{springs}"

    def plot(self, axes: Any = None) -> Any:
        """Plot three panels, error of the trajectory, drift of the rows and energy error, each against run time; return the axes."""
        from .cost_pictures import loops_plot

        return loops_plot(self, axes)


def loops_compared(
    scene: Scene,
    q: Any = None,
    v: Any = None,
    *,
    T: float = 1.0,
    methods: str | Sequence[str] = METHODS,
    integrators: str | Sequence[str] | None = None,
    tolerances: float | Sequence[float] = TOLERANCES,
    steps: float | Sequence[float] = STEPS,
    frequencies: float | Sequence[float] | None = None,
    damping_ratio: float = 1.0,
    seconds: float = 0.05,
    progress: Callable[[str], None] | None = None,
) -> LoopsTable:
    """Compare the methods that keep the loops of a scene, augmentation, embedding and springs: cost and accuracy of each.

    The scene's `effects.Loop` use each method in turn; everything else is unchanged. Rows are runs: for kept loops one
    per integrator and tolerance; for springs one per integrator and frequency ω, at a tolerance of a tenth of the springs' error,
    (rate/ω)²/10, where rate is the rate of the motion, the largest ‖v̇‖/‖v‖ in kinetic energy.

    The reference is augmentation by dop853 in extended precision at a tolerance of 1e-13 (embedding if that refuses, double if
    Python functions require it). Its own error is its distance to a run at a hundred times that tolerance, to the same by the other
    method, and to the motion by an extrapolation method; rows below it are not resolved. The table gives the number of digits to which the
    last agrees with the reference.

    Parameters
    ----------
    scene : with an `effects.Loop` that is on; couplings and rows of velocities count as loops
    q, v : (nq,), (nv,) at t = 0 on the loops, by the rule of direct calls
    T : s, duration of the run
    methods : some of "augment", "embed", "penalty"
    integrators : as in `simulate`; default: "dopri5" and "dop853" for kept loops, "dopri5" and "rosenbrock4" for springs
    tolerances, steps : rtol and atol of controlled integrators, for kept loops; steps, s, of integrators with fixed steps
    frequencies, damping_ratio : rad/s, for `effects.Loop(method="penalty")`; default: 10, 30, 100, 300 and 1000 times the rate of the
        motion
    seconds : time over which a run is repeated, at least once; the least time counts
    progress : called with the name of the next run

    A single name or number counts as a list of one.

    Returns
    -------
    LoopsTable : `.front`, `.fastest(error)`, `.plot()`

    Raises
    ------
    ModelError
        A scene that keeps no loops; a state off the loops.
    EvaluationError
        Unknown names, values that are not positive; no reference by either method, with the reasons.

    Examples
    --------
    >>> import pycraft as pc
    >>> table = pc.loops_compared(pc.mechanisms.slider_crank(), T=0.1, integrators="dopri5", tolerances=1e-8, frequencies=1e4, seconds=0)
    >>> [row["method"] for row in table], [row["drift"] < 1e-14 for row in table]
    (['augment', 'embed', 'penalty'], [True, True, False])
    """
    if not isinstance(scene, Scene):
        raise _core.ModelError(f"loops_compared takes a scene, not {scene!r:.80}")
    model, seconds = scene.model, checked_seconds(seconds)
    checked_model(model, "a comparison of loops")
    if not scene._keeps_loops():
        raise _core.ModelError(f"the scene of {model.name!r} keeps no loops: add effects.Loop()")
    methods = checked_names(methods, "methods", "method", METHODS)
    known = None if integrators is None else checked_names(integrators, "integrators", "integrator", integrator_names())
    controlled = checked_positive(tolerances, "tolerances", "a positive, finite tolerance")
    sizes = checked_positive(steps, "steps", "a positive, finite number of seconds")
    if not 0 < (length := one_number(T, "T")) < np.inf:
        raise _core.EvaluationError(f"T={length:g}: a run lasts a positive number of seconds")
    if frequencies is not None:
        frequencies = checked_positive(frequencies, "frequencies", "a positive, finite number of rad/s")
    if not 0 <= (ratio := one_number(damping_ratio, "damping_ratio")) < np.inf:
        raise _core.EvaluationError(f"damping_ratio={ratio:g}: give a finite number, zero or more")
    comparison = _Comparison(scene, *at_state(model, q, v), sampled_times(length), seconds, progress or (lambda _: None))
    comparison.find_reference()
    rows = []
    for method in methods:
        for integrator in known or (HELD if method == "penalty" else KEPT):
            amounts = sizes if takes_one_size(integrator) else controlled
            if method != "penalty":
                rows += [comparison.row(method, integrator, _options(integrator, amount)) for amount in amounts]
                continue
            for ω in frequencies or [times * comparison.rate for times in STIFFER]:
                if not takes_one_size(integrator):
                    amounts = [max(LEAST, 0.1 * (comparison.rate / ω) ** 2)]
                found = {"frequency": ω, "damping_ratio": ratio}
                rows += [comparison.row(method, integrator, _options(integrator, amount), **found) for amount in amounts]
    mark_front(rows, "seconds", "error", comparison.own)
    return LoopsTable(
        f"Loops of {model.name} three ways, a run of {length:g} s",
        rows,
        {
            "model": model.name, "nv": model.nv, "T": length, "loops": comparison.names, "rows": len(comparison.rows),
            "reference": comparison.reference, "reference_error": comparison.own, **about(comparison.confirmation), "rate": comparison.rate,
            "q": np.asarray(comparison.q).tolist(), "v": np.asarray(comparison.v).tolist(), "effects": effects_on(scene),
        },
    )  # fmt: skip


class _Comparison:
    """One scene from one state, its reference, and rows."""

    def __init__(self, scene: Any, q: Any, v: Any, times: np.ndarray, seconds: float, tell: Callable[[str], None]):
        self.scene, self.model, self.q, self.v, self.times, self.seconds, self.tell = scene, scene.model, q, v, times, seconds, tell
        self.names = scene._kept_loops()
        loops, rows = self.model.loops, range(len(self.model.loops.rows))
        self.rows = [i for name in self.names for i in rows[loops[name].slice]]

    def by(self, method: str, of: Any, **springs: Any) -> tuple[Any, list[str]]:
        """Return the scene with its loops kept by a method, and the names of the effects that keep them."""
        other = _as(of, of._how)
        own = [name for name, (effect, on) in of._entries.items() if on and isinstance(effect, Loop) and effect.keeps]
        for name in own:
            effect = of._entries[name][0]
            gains = {} if method == "augment" else {"alpha": 0.0, "beta": 0.0}
            other._entries[name] = (replace(effect, method=method, **gains, **springs), True)
        return other, own

    # ------------------------------------------------------------------ the reference
    def find_reference(self) -> None:
        """Find the tightest run, its error, the rate of its motion and its kinetic energy."""
        self.tell("reference")
        plain, refused = _at_states(self.scene), []
        for precision in ("extended", "double"):
            form, refine, residual, _ = plain._how
            runs = {}
            for method in ("augment", "embed"):
                other, _ = self.by(method, _as(plain, (form, refine, residual, precision)))
                try:
                    runs[method] = self._tight(other, 1.0)
                    runs.setdefault("looser", self._tight(other, 100.0))
                except _core.ModelError:  # a state off the loops, or removed names
                    raise
                except (ArithmeticError, _core.Error) as reason:
                    refused.append(f"{method} in {precision} precision: {reason}")
            if runs:
                break
        else:
            raise _core.EvaluationError(f"no reference for the loops of {self.model.name!r}: {'; '.join(refused)}")
        method = next(iter(runs))
        self.truth = runs.pop(method)
        other, _ = self.by(method, _as(plain, (*plain._how[:3], precision)))
        self.confirmation: Confirmation = confirmation(
            self.truth.q,
            lambda: self._tight(other, 1.0, SECOND).q,
            partial(trajectory_error, self.model),
            f"{SECOND} in {precision} precision",
        )
        self.own = own_error(max(trajectory_error(self.model, self.truth.q, run.q) for run in runs.values()), self.confirmation)
        self.reference = f"{method} by {REFERENCE[0]} in {precision} precision, tolerance {REFERENCE[1]:g}"
        M, v, vdot = (np.asarray(x, float) for x in (self.model.mass_matrix(self.truth.q), self.truth.v, self.truth.vdot))
        speed, turned = (float(np.sqrt(max(np.einsum("ti,tij,tj->t", x, M, x).max(), 0.0))) for x in (v, vdot))
        self.rate = max(turned / speed if speed > 0 else 0.0, 1 / self.times[-1])
        self.kinetic = speed**2 / 2

    def _tight(self, scene: Any, times: float, integrator: str = REFERENCE[0]) -> Any:
        tolerance = times * REFERENCE[1]
        return run_at(scene, self.times, self.q, self.v, integrator=integrator, rtol=tolerance, atol=tolerance)

    # ------------------------------------------------------------------ a row
    def row(self, method: str, integrator: str, options: dict[str, float], **springs: Any) -> dict[str, Any]:
        """Return the row of one measured run."""
        self.tell(", ".join(map(str, (method, integrator, *options.values(), *springs.values()))))
        about = {"method": method, "frequency": springs.get("frequency"), "velocity drift": None, "energy error": None}
        scene, own = self.by(method, self.scene, **springs)
        row = measured_row(
            self.model, integrator, options, _by(scene, self.times, self.q, self.v), self.truth.q, self.own, None, 0.0, self.seconds
        )
        if not row["refused"]:
            run = scene.simulate(
                self.times[-1], self.q, self.v, t_eval=self.times, integrator=integrator, dense=False, progress=False, **options
            )
            about |= {"drift": self._drift(run.q), "velocity drift": self._velocity_drift(run), "energy error": self._energy(run, own)}
        return row | about

    def _drift(self, q: np.ndarray) -> float:
        loops = self.model.loops
        rows = [i for i in self.rows if loops.of_positions[i]]
        return float(np.abs(loops.residual(q)[:, rows]).max(initial=0.0))

    def _velocity_drift(self, run: Any) -> float:
        Q = self.model.loops.jacobian(run.q)[:, self.rows]
        return float(np.abs(np.einsum("trj,tj->tr", Q, run.v)).max(initial=0.0))

    def _energy(self, run: Any, own: list[str]) -> float | None:
        """Return the largest change of the energy without the springs."""
        if not self.kinetic > 0:
            return None
        others = [i for i, name in enumerate(run.effects) if name not in own]
        workers = [i for i, name in enumerate(run.workers) if name not in own]
        energy = run.energy["kinetic"] + run._along["potential"][:, others].sum(axis=1) - run.energy["work"][:, workers].sum(axis=1)
        return float(np.abs(energy - energy[0]).max() / self.kinetic)
