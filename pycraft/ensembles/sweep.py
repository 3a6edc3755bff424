"""Many runs: a scene or a function over samples, on threads, processes or a Dask cluster."""

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
    """Run a scene from every sample, or call a function with it.

    Parameters
    ----------
    work : Scene, or a function of the samples' names that returns numbers, truths or texts by name, or one of them ("value")
    samples : by name, one value for each run (`pycraft.samples`)
        Of a scene: "q", "v", "q.HINGE", "v.HINGE" at the start (or a coordinate's name), "bodies.BODY.mass" and what else of bodies and
        hinges can be set, "effects.EFFECT.PARAMETER", and components, "effects.gravity.g[2]". What no sample names is as the scene has it.
    T : s, how long each run of a scene is
    measure : what of a `Run` is kept: a function that gives numbers and arrays by name, of one shape in all runs
        Left out: "end.t", "end.q", "end.v", "steps" and "balance", and with t_eval "run.t", "run.q", "run.v" too.
    output : a folder, for results that outlive the process and may be larger than memory (Parquet; extra [data])
        A sweep that was stopped goes on there when it is called again; what is finished is not run again. None: in memory.
    on : {"threads", "processes", "dask"}, the address of a Dask scheduler ("tcp://host:8786"), or a `dask.distributed.Client`
    workers : how many; as many as cores where left out
    overwrite : bool, whether another sweep in the folder is thrown away
    progress : bool, whether a sweep of more than a second shows how far it is and how long it will take
    options : of `Scene.simulate`: integrator, rtol, atol, step, t_eval, events, ...

    Returns
    -------
    SweepResult
        A run that failed has its reason in `failures`; the others go on. A worker that dies loses no finished run; what it had is run
        again.
        Ctrl-C and errors keep what is finished: it is the error's attribute `result`.

    Raises
    ------
    ModelError
        A name of samples that nothing has, with the nearest.
    EvaluationError
        Options that make no sense; another sweep in the folder; functions that do not go to another process.
    OSError
        A folder that cannot be written.
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
        error.result = result  # type: ignore[attr-defined]  # what is finished
        raise
    finally:
        if crew is not None:
            crew.close()
        store.flush()
    return result


def load_sweep(folder: str | Path) -> SweepResult:
    """The sweep in a folder, finished or not. Its models and other objects among the samples are their names."""
    return SweepResult(Folder(folder))


def _work(work: Any, samples: Samples, T: Any, measure: Any, options: dict[str, Any]) -> Any:
    """What is done for each sample; refused here, before the first, if it makes no sense."""
    if isinstance(work, Scene):
        if T is None:
            raise _core.EvaluationError("a sweep of a scene takes T, how long each run is, in seconds")
        run_times(0.0, T, options.get("t_eval"))
        RunOptions.checked(**{**DEFAULTS, **{name: value for name, value in options.items() if name in DEFAULTS}})
        known = [*DEFAULTS, "t_eval", "events", "dense"]
        if unknown := set(options) - set(known):
            raise _core.EvaluationError(f"Scene.simulate has no {min(unknown)!r}; there are {', '.join(known)}")
        if measure is None:
            measure = trajectory if "t_eval" in options else end_of_run
            options = {"t_eval": [0.0, one_number(T, "T")], "dense": False, **options}
        Targets(work, samples)
        work._warn_of_gravity()  # here, and not by every worker
        return SceneWork(work, list(samples), one_number(T, "T"), options, measure)
    if not callable(work):
        raise _core.ModelError(f"a sweep is of a scene or of a function, not of {work!r:.60}")
    if T is not None or measure is not None or options:
        raise _core.EvaluationError("T, measure and options are of a sweep of a scene; a function has its samples alone")
    return FunctionWork(work)
