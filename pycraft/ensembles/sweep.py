"""Sweeps: run a scene or a function over samples, on threads, processes or a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .. import _core
from ..arguments import one_number
from ..scenes.scene import Scene
from ..scenes.simulation import RunOptions, run_times
from .backends import outcomes, workers_on
from .folder import Folder
from .progress import SweepProgress
from .result import SweepResult
from .samples import Samples
from .stores import Memory
from .targets import Targets
from .work import DEFAULTS, FunctionWork, SceneWork, end_of_run, trajectory


def sweep(
    work: Any,
    samples: Samples | Mapping[str, Any],
    T: float | None = None,
    *,
    measure: Callable[[Any], Mapping[str, Any]] | None = None,
    output: str | Path | None = None,
    on: Any = "threads",
    workers: int | None = None,
    overwrite: bool = False,
    progress: bool = True,
    **options: Any,
) -> SweepResult:
    """Run a scene for every sample, or call a function with every sample.

    Parameters
    ----------
    work : Scene, or a function of the samples' names that returns numbers, truths or texts by name, or one of them ("value")
    samples : by name, one value for each run (`pycraft.samples`)
        For a scene: "q", "v", "q.HINGE", "v.HINGE" at the start (or a coordinate's name), "bodies.BODY.mass" and the other parameters of
        bodies and hinges, "effects.EFFECT.PARAMETER", and components, "effects.gravity.g[2]". The rest is as in the scene.
    T : s, duration of each run of a scene
    measure : function of a `Run` that returns the values to keep: numbers and arrays by name, with the same shapes in all runs
        Default: "end.t", "end.q", "end.v", "steps" and "balance", and with t_eval also "run.t", "run.q", "run.v".
    output : folder for results that outlive the process and may be larger than memory (Parquet; extra [data]); None keeps them in memory
        Calling again continues a stopped sweep; finished runs are not repeated.
    on : {"threads", "processes", "dask"}, the address of a Dask scheduler ("tcp://host:8786"), or a `dask.distributed.Client`
    workers : number of workers; default: number of cores
    overwrite : bool, True deletes another sweep in the folder
    progress : bool, True shows progress and the time remaining for sweeps longer than a second
    options : options of `Scene.simulate`: integrator, rtol, atol, step, t_eval, events, ...

    Returns
    -------
    SweepResult
        `failures` has the reason of each failed run; the other runs continue. A worker that dies loses no finished run; its unfinished
        runs are repeated.
        After Ctrl-C or an error, the attribute `result` of the exception holds the finished runs.

    Raises
    ------
    ModelError
        A name of samples that nothing in the scene has; the message suggests the nearest.
    EvaluationError
        Invalid options; another sweep in the folder; functions that cannot be sent to another process.
    OSError
        The folder cannot be written.
    """
    samples = samples if isinstance(samples, Samples) else Samples(samples)
    doing = _work(work, samples, T, measure, options)
    store = Memory(samples) if output is None else Folder(output, samples, doing, overwrite)
    why = doing.one_by_one()
    result = SweepResult(store, f"one by one: {why}" if why else f"side by side in packs of {doing.lanes} states")
    rows = ((i, samples.row(i)) for i in range(samples.count) if not store.finished[i])
    left = samples.count - int(store.finished.sum())
    try:
        crew = workers_on(on, workers, doing) if left else None
    except BaseException:
        store.flush()
        raise
    try:
        if crew is not None:
            with SweepProgress(samples.count, samples.count - left, progress) as bar:
                for found in outcomes(doing, rows, left, crew):
                    store.add(found)
                    bar.add(len(found), sum(each.error is not None for each in found))
    except BaseException as error:
        error.result = result  # type: ignore[attr-defined]  # the finished runs
        raise
    finally:
        if crew is not None:
            crew.close()
        store.flush()
    return result


def load_sweep(folder: str | Path) -> SweepResult:
    """Return the sweep in a folder, finished or not. Models and other objects among its samples are replaced by their names."""
    return SweepResult(Folder(folder))


def _work(work: Any, samples: Samples, T: Any, measure: Any, options: dict[str, Any]) -> Any:
    """Return the work for each sample. Invalid work is refused here, before the first run."""
    if isinstance(work, Scene):
        if T is None:
            raise _core.EvaluationError("a sweep of a scene needs T, the duration of each run in seconds")
        run_times(0.0, T, options.get("t_eval"))
        RunOptions.checked(**{**DEFAULTS, **{name: value for name, value in options.items() if name in DEFAULTS}})
        known = [*DEFAULTS, "t_eval", "events", "dense"]
        if unknown := set(options) - set(known):
            raise _core.EvaluationError(f"Scene.simulate has no option {min(unknown)!r}; its options are {', '.join(known)}")
        if measure is None:
            measure = trajectory if "t_eval" in options else end_of_run
            options = {"t_eval": [0.0, one_number(T, "T")], "dense": False, **options}
        Targets(work, samples)
        work._warn_of_gravity()  # once here, not in every worker
        return SceneWork(work, list(samples), one_number(T, "T"), options, measure)
    if not callable(work):
        raise _core.ModelError(f"sweep takes a scene or a function, not {work!r:.60}")
    if T is not None or measure is not None or options:
        raise _core.EvaluationError("T, measure and options apply to sweeps of a scene; a function takes only its samples")
    return FunctionWork(work)
