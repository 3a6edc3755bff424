"""Common parts of measurements of scenes: states, scenes with other effects on, runs, and times measured in turn."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np

from .. import _core
from ..accuracy.checked_options import checked_model
from ..accuracy.tables.table import STATES, mark_pareto
from ..accuracy.tables.work_precision import SAMPLES

ROUNDS = 5
"""Number of rounds of timing: all compared items are timed in turn, so other load of the machine affects all alike."""
Timed = Callable[[float], float]
"""Returns the seconds of one call, measured for a given number of seconds."""


def _drawn(scene: Any, rng: np.random.Generator) -> Any:
    """Return a random state; if the scene keeps loops, one on them near the model's present state."""
    model = scene.model
    if not scene._keeps_loops():
        return model.random_state(rng)
    return model.assemble(model.integrate(model.q, 0.1 * rng.normal(size=model.nv)), rng.normal(size=model.nv))


def measured_states(scene: Any, q: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return states (K, nq), (K, nv): the given ones, or as many random states as in `pycraft.accuracy`."""
    model = scene.model
    checked_model(model, "a measurement of a scene")
    if q is None and v is None:
        drawn = [_drawn(scene, np.random.default_rng([0, i])) for i in range(STATES)]
        return np.array([s.q for s in drawn]), np.array([s.v for s in drawn])
    if q is None:
        raise _core.ModelError("v is given without q; give both, or neither for random states")
    v = getattr(q, "v", None) if v is None else v
    q = np.atleast_2d(_core.real_array(getattr(q, "q", q), "q"))
    v = np.zeros(model.nv) if v is None else np.atleast_2d(_core.real_array(getattr(v, "v", v), "v"))
    if not len(q):
        raise _core.ModelError(f"no state given: q for {model.name!r} has no rows")
    v = np.array(np.broadcast_to(v, (len(q), v.shape[-1])))
    for one, rate in zip(q, v, strict=True):
        model.configuration_rate(one, rate)  # the core's own checks
    return q, v


def effects_on(scene: Any) -> list[str]:
    """Return the names of the effects that are on."""
    return [name for name in scene.effects if scene.is_on(name)]


def having_on(scene: Any, names: Iterable[str]) -> Any:
    """Return a scene of the same effects, with only these on. Raises ModelError if two of them claim the same coordinate."""
    other, wanted = copy.copy(scene), set(names)
    other._limits_said = True  # one of many runs: only the user's own runs warn of crossed limits
    other.disable(*other.effects)
    return other.enable(*(name for name in scene.effects if name in wanted))


def evaluation_of(scene: Any, q: np.ndarray, v: np.ndarray, works: bool = False) -> Timed:
    """Return a timer of an evaluation of the accelerations at states in rotation; with `works`, also of the effects' powers."""
    return partial(_evaluation_seconds, scene._calls(), q, v, works)


def _evaluation_seconds(calls: Any, q: np.ndarray, v: np.ndarray, works: bool, seconds: float) -> float:
    return _core.time_scene(calls, q, v, seconds, works)["minimum"]


def in_turn(seconds: float, timed: Sequence[Timed]) -> list[float]:
    """Return the least seconds of each, measured in turn for several rounds, each for `seconds` in total."""
    rounds = [[each(seconds / ROUNDS) for each in timed] for _ in range(ROUNDS)]
    return [min(of_one) for of_one in zip(*rounds, strict=True)]


def sampled_times(T: float) -> np.ndarray:
    """Return times at which motions are compared, as in `pycraft.work_precision`, from 0 to T."""
    return np.linspace(0.0, T, SAMPLES + 1)


def run_at(scene: Any, times: Sequence[float] | np.ndarray, q: Any, v: Any, **options: Any) -> Any:
    """Return a run with only the states at these times, without recording works."""
    return scene.simulate(times[-1], q, v, t_eval=times, energy=False, dense=False, progress=False, **options)


def timed_run(scene: Any, times: Sequence[float] | np.ndarray, q: Any, v: Any, **options: Any) -> tuple[Any, float]:
    """Return a run and its seconds: the lesser of wall time and this thread's CPU time, because the machine may be busy otherwise."""
    begin = time.thread_time()
    run = run_at(scene, times, q, v, **options)
    return run, min(run.statistics["seconds"], time.thread_time() - begin)


def mark_front(rows: Iterable[dict[str, Any]], time: str, error: str, resolved: float) -> None:
    """Mark the Pareto front of rows by two of their columns; errors below `resolved` are alike. Refused rows are excluded."""
    ranked = []
    for row in rows:
        row["pareto"] = False
        if not row["refused"]:
            ranked.append({"refused": "", "seconds": row[time], "error": max(row[error], resolved), "of": row})
    mark_pareto(ranked)
    for rank in ranked:
        rank["of"]["pareto"] = rank["pareto"]
