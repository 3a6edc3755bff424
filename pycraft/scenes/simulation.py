"""Runs of scenes: calls of the core, and the treatment of errors and interrupts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number
from ..dynamics.integrator_names import IntegratorName, integrator_named
from ..progress_bar import RunProgress
from ..state import at_state
from .checkpoint import Checkpoint, coordinates_of
from .doubtful_runs import warn_of_doubts, warn_of_stiffness
from .events import Event, events_for_core, listed_events
from .run import Run
from .runs_on_disk import checked_output


@dataclass
class RunOptions:
    """Checked options of a run; `told` are the options kept in a checkpoint."""

    integrator: IntegratorName
    rtol: float
    atol: float
    step: float
    max_step: float
    normalise: bool
    energy: bool

    @classmethod
    def checked(cls, integrator: Any, rtol: Any, atol: Any, step: Any, max_step: Any, normalise: Any, energy: Any) -> RunOptions:
        """Check the options. Raises EvaluationError for invalid ones."""
        chosen = integrator_named(integrator)
        if normalise not in ("never", "each step"):
            raise _core.EvaluationError(f"normalise={normalise!r}: there are 'never' and 'each step'")
        if chosen.foreign and normalise != "never":
            raise _core.EvaluationError(f"integrator {chosen.name!r} does not support normalise={normalise!r}; use 'never'")
        sizes = []
        for name, value in (("step", step), ("max_step", max_step)):
            sizes.append(0.0 if value is None else one_number(value, name))
            if value is not None and not 0 < sizes[-1] < np.inf:
                raise _core.EvaluationError(f"{name}={value}: a step is a positive number of seconds")
        return cls(chosen, one_number(rtol, "rtol"), one_number(atol, "atol"), sizes[0], sizes[1], normalise == "each step", bool(energy))

    @property
    def told(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("rtol", "atol", "step", "max_step", "normalise", "energy")}


def run_times(start: float, T: Any, t_eval: Any) -> tuple[list[float], slice]:
    """Return times for the core, and the indices of the requested results."""
    end = one_number(T, "T")
    if not (start < end < np.inf):
        raise _core.EvaluationError(
            f"T={end:g}: a run lasts a positive number of seconds" if start == 0 else f"T={end:g}: the checkpoint is at {start:g} s already"
        )
    if t_eval is None:
        return [start, end], slice(None)
    times = np.atleast_1d(_core.real_array(t_eval, "t_eval"))
    if times.ndim != 1 or not times.size:
        raise _core.EvaluationError(f"t_eval must be at least one time, (K,) in seconds, not an array {times.shape}")
    if not np.isfinite(times).all():
        at = int(np.flatnonzero(~np.isfinite(times))[0])
        raise _core.EvaluationError(f"t_eval: entry {at} is {times[at]:g}; times must be finite numbers of seconds")
    if not (np.diff(times) > 0).all():
        at = int(np.flatnonzero(~(np.diff(times) > 0))[0])
        raise _core.EvaluationError(
            f"t_eval: entry {at + 1} is {times[at + 1]:g} s after {times[at]:g} s; times must rise: np.unique(t_eval) sorts them"
        )
    if times[0] < start or times[-1] > end:
        raise _core.EvaluationError(f"t_eval goes from {times[0]:g} to {times[-1]:g} s; the run lasts from {start:g} to T = {end:g} s")
    before, after = times[0] > start, times[-1] < end
    return [*([start] if before else []), *times.tolist(), *([end] if after else [])], slice(int(before), len(times) + int(before))


def simulate(
    scene: Any, T: Any, q: Any, v: Any, options: RunOptions, *, t_eval: Any, events: Any, progress: bool, dense: bool, output: Any
) -> Run:
    """Simulate the motion of a scene from a state at t = 0 to T; see `Scene.simulate`."""
    times, keep = run_times(0.0, T, t_eval)
    q, v = at_state(scene.model, q, v)
    run = _run(scene, options, times, keep, t_eval, events, progress, dense, output, q, v, None)
    scene._warn_of_limits(run)
    warn_of_doubts(scene, run)
    return run


def continued(scene: Any, t: float, T: float, q: Any, v: Any, states: Any, options: RunOptions) -> Run:
    """Continue the motion from any state at any time to T, keeping only its ends, without a checkpoint. A viewer advances its scene so.

    Parameters
    ----------
    t, T : s
    q, v : (nq,), (nv,)
    states : the own states of the effects that are on; empty: the initial ones
    """
    times, keep = run_times(t, T, [t, T])
    return _run(scene, options, times, keep, times, None, False, False, None, q, v, None, states)


def resume(scene: Any, checkpoint: Any, T: Any, *, t_eval: Any, events: Any, progress: bool, dense: bool, output: Any) -> Run:
    """Resume the motion from a checkpoint to T; see `Scene.resume`."""
    if isinstance(checkpoint, Run):
        checkpoint = checkpoint.checkpoint()
    if not isinstance(checkpoint, Checkpoint):
        checkpoint = Checkpoint.load(checkpoint)
    on = tuple(scene._names_on())
    here = {"model": scene.model.name, "effects": on, "precision": scene._how[3]}
    for what, now in here.items():
        if getattr(checkpoint, what) != now:
            raise _core.ModelError(f"the checkpoint is of {what} {_told(getattr(checkpoint, what))}; this scene has {_told(now)}")
    were, are = checkpoint.coordinates, coordinates_of(scene.model)
    if were != are:
        first = next((pair for pair in zip(were, are, strict=False) if pair[0] != pair[1]), None)
        but = f"{len(were)}, and there are {len(are)}" if first is None else f"{first[0]!r} where this model has {first[1]!r}"
        raise _core.ModelError(
            f"the checkpoint is of {scene.model.name!r} before an edit of its structure: among the coordinates {but}; simulate again"
        )
    told = checkpoint.options
    options = RunOptions(integrator_named(checkpoint.integrator), **told)
    times, keep = run_times(checkpoint.t, T, t_eval)
    zero = scene.model.zero_q(), np.zeros(scene.model.nv)  # the checkpoint has the state
    run = _run(scene, options, times, keep, t_eval, events, progress, dense, output, *zero, checkpoint.state)
    scene._warn_of_limits(run)
    warn_of_doubts(scene, run)
    return run


def _told(what: Any) -> str:
    return ", ".join(what) or "none" if isinstance(what, tuple) else repr(what)


def _run(
    scene: Any, options: RunOptions, times: list[float], keep: slice, t_eval: Any, events: Any, progress: bool, dense: bool, output: Any,
    q: Any, v: Any, checkpoint: dict[str, Any] | None, states: Any = (),
) -> Run:  # fmt: skip
    scene._warn_of_gravity()
    wanted: list[Event] = listed_events(events)
    written = None if output is None else checked_output(output)
    calls, chosen = scene._calls(), options.integrator
    _core.check_pairing(calls, chosen.name, chosen.foreign, chosen.name in _implicit())
    solver = chosen.solver(options.rtol, options.atol, options.max_step)
    tolerances = (1.0, 1.0) if chosen.foreign else (options.rtol, options.atol)
    record = _core.RunRecord(t_eval is None or dense)

    def made() -> Run:
        return Run.of_record(scene, calls, record, options, wanted, keep if t_eval is not None else None)

    with RunProgress(times[0], times[-1], progress) as bar:
        try:
            _core.run_scene(
                calls, record, q, v, times, [*states], options.energy, chosen.name, *tolerances, options.step, options.max_step,
                options.normalise, events_for_core(scene.model, wanted), bar if progress else None, checkpoint, solver,
                partial(warn_of_stiffness, scene, chosen.name),
            )  # fmt: skip
        except (Exception, KeyboardInterrupt) as error:
            if len(record.samples["t"]):
                scene._last_run = error.run = made()  # type: ignore[union-attr]  # the run computed so far
            raise
    scene._last_run = run = made()
    if written is not None:
        run.save(written)
    return run


def simulate_together(
    scene: Any, T: Any, calls: list[Any], q: np.ndarray, v: np.ndarray, options: RunOptions, *, t_eval: Any, dense: bool
) -> list[Run | Exception]:
    """Run simulations of one model side by side in packs of states; return for each the result of `simulate`, bit for bit, or its error.

    Parameters
    ----------
    calls : the compiled scene of each run, for runs suited to packs by `alone`
    q, v : (n, nq), (n, nv) at t = 0
    """
    times, keep = run_times(0.0, T, t_eval)
    records = [_core.RunRecord(t_eval is None or dense) for _ in calls]
    how = (options.integrator.name, options.rtol, options.atol, options.step, options.max_step, options.normalise)
    _core.run_scenes(calls, records, q, v, times, options.energy, *how)
    return [_found(scene, *each, options, keep if t_eval is not None else None) for each in zip(calls, records, strict=True)]


def _found(scene: Any, calls: Any, record: Any, options: RunOptions, keep: slice | None) -> Run | Exception:
    try:
        record.raise_error()
    except Exception as error:
        return error
    if record.stiffness is not None:
        warn_of_stiffness(scene, options.integrator.name, record.stiffness)
    return Run.of_record(scene, calls, record, options, [], keep)


def alone(calls: Any, options: RunOptions) -> str:
    """Return why runs are not suited to packs; "" if they are."""
    if options.integrator.foreign:
        return f"integrator {options.integrator.name!r} belongs to another package"
    return str(_core.alone(calls, options.integrator.name))


def _implicit() -> tuple[str, ...]:
    from ..dynamics.integrator_names import SOLVE_FOR_STEPS

    return SOLVE_FOR_STEPS
