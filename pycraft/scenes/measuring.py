"""What measurements of scenes share: states, scenes with other effects on, runs, and times taken in turn."""

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
"""Everything that is compared is timed in turn, so many times over: what else the machine does falls on all alike."""
Timed = Callable[[float], float]
"""Seconds of one call of something, measured for so many seconds."""


def _drawn(scene: Any, rng: np.random.Generator) -> Any:
    """A random state; on the loops that the scene keeps, about the model's present one."""
    model = scene.model
    if not scene._keeps_loops():
        return model.random_state(rng)
    return model.assemble(model.integrate(model.q, 0.1 * rng.normal(size=model.nv)), rng.normal(size=model.nv))


def measured_states(scene: Any, q: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
    """States (K, nq), (K, nv): those given, one or several, or as many random ones as `pycraft.accuracy` draws."""
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
        raise _core.ModelError(f"no state given: q of {model.name!r} has no rows")
    v = np.array(np.broadcast_to(v, (len(q), v.shape[-1])))
    for one, rate in zip(q, v, strict=True):
        model.configuration_rate(one, rate)  # the core's own checks
    return q, v


def effects_on(scene: Any) -> list[str]:
    """The names of the effects that are on."""
    return [name for name in scene.effects if scene.is_on(name)]


def having_on(scene: Any, names: Iterable[str]) -> Any:
    """A scene of the same effects, of which these are on and no others. ModelError where two of them claim the same coordinate."""
    other, wanted = copy.copy(scene), set(names)
    other._limits_said = True  # one of many runs: the user's own say which limits they cross
    other.disable(*other.effects)
    return other.enable(*(name for name in scene.effects if name in wanted))


def evaluation_of(scene: Any, q: np.ndarray, v: np.ndarray, works: bool = False) -> Timed:
    """Times an evaluation of the accelerations at states in rotation; with `works`, of the powers of effects, too."""
    return partial(_evaluation_seconds, scene._calls(), q, v, works)


def _evaluation_seconds(calls: Any, q: np.ndarray, v: np.ndarray, works: bool, seconds: float) -> float:
    return _core.time_scene(calls, q, v, seconds, works)["minimum"]


def in_turn(seconds: float, timed: Sequence[Timed]) -> list[float]:
    """The least seconds of each, one after the other for several rounds, each for `seconds` in all."""
    rounds = [[each(seconds / ROUNDS) for each in timed] for _ in range(ROUNDS)]
    return [min(of_one) for of_one in zip(*rounds, strict=True)]


def sampled_times(T: float) -> np.ndarray:
    """Times at which motions are compared, as in `pycraft.work_precision`, from 0 to T."""
    return np.linspace(0.0, T, SAMPLES + 1)


def run_at(scene: Any, times: Sequence[float] | np.ndarray, q: Any, v: Any, **options: Any) -> Any:
    """A run that gives the states at these times alone, without an account of works."""
    return scene.simulate(times[-1], q, v, t_eval=times, energy=False, dense=False, progress=False, **options)


def timed_run(scene: Any, times: Sequence[float] | np.ndarray, q: Any, v: Any, **options: Any) -> tuple[Any, float]:
    """A run, and its seconds: by the clock, or by this thread's own where that is less, as the machine did something else meanwhile."""
    begin = time.thread_time()
    run = run_at(scene, times, q, v, **options)
    return run, min(run.statistics["seconds"], time.thread_time() - begin)


def mark_front(rows: Iterable[dict[str, Any]], time: str, error: str, resolved: float) -> None:
    """Mark the Pareto front of rows by two of their columns; errors below `resolved` are alike. Refused rows are out of it."""
    ranked = []
    for row in rows:
        row["pareto"] = False
        if not row["refused"]:
            ranked.append({"refused": "", "seconds": row[time], "error": max(row[error], resolved), "of": row})
    mark_pareto(ranked)
    for rank in ranked:
        rank["of"]["pareto"] = rank["pareto"]
