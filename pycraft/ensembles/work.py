"""What a sweep does for one sample, and for a handful of them in one go."""

from __future__ import annotations

import copy
import pickle
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from hashlib import sha256
from time import perf_counter
from typing import Any

import numpy as np

from .. import _core
from ..scenes.scene import Scene
from .targets import Targets

Values = Mapping[str, Any]


@dataclass(frozen=True)
class Outcome:
    """What came of a sample: its values, or why there are none."""

    sample: int
    values: Values | None
    error: str | None
    seconds: float


def end_of_run(run: Any) -> dict[str, Any]:
    """What is kept of a run where nothing else is asked for: its end, its steps, and, where works were kept account of, how far the energy
    balance went from where it began, J."""
    kept: dict[str, Any] = {"end.t": run.t[-1], "end.q": run.q[-1], "end.v": run.v[-1], "steps": run.statistics["steps"]}
    with suppress(_core.EvaluationError):  # of a run without works
        kept["balance"] = run.balance[-1] - run.balance[0]
    return kept


def trajectory(run: Any) -> dict[str, Any]:
    """The end of a run, and "run.t" (K,), "run.q" (K, nq), "run.v" (K, nv) at all its times, which all runs share: those of t_eval."""
    return {**end_of_run(run), "run.t": run.t, "run.q": run.q, "run.v": run.v}


@dataclass
class SceneWork:
    """A run of a scene from each sample, and what is measured of it."""

    scene: Scene
    names: list[str]
    T: float
    options: dict[str, Any]
    measure: Callable[[Any], Values]
    _targets: Targets | None = field(default=None, init=False, repr=False, compare=False)

    def __call__(self, row: Values) -> Values:
        if self._targets is None:
            self._targets = Targets(self.scene, self.names)
        q, v = self._targets.set(row)
        return self.measure(self.scene.simulate(self.T, q, v, progress=False, **self.options))

    def own(self) -> SceneWork:
        """The same with a scene and a model of its own, as it sets them."""
        return SceneWork(copy.deepcopy(self.scene), self.names, self.T, self.options, self.measure)

    def parts(self) -> dict[str, Any]:
        """What makes two sweeps the same."""
        return {"scene": self.scene, "T": self.T, "options": self.options, "measure": self.measure}


@dataclass
class FunctionWork:
    """A function called with each sample's values by name."""

    function: Callable[..., Any]

    def __call__(self, row: Values) -> Values:
        found = self.function(**row)
        return found if isinstance(found, Mapping) else {"value": found}

    def own(self) -> FunctionWork:
        return self

    def parts(self) -> dict[str, Any]:
        return {"function": self.function}


def run_rows(work: Any, rows: Sequence[tuple[int, Values]]) -> list[Outcome]:
    """The outcomes of some samples, one after the other; an error of one is told of it and ends no other."""
    outcomes = []
    for sample, row in rows:
        start, values, error = perf_counter(), None, None
        try:
            values = {str(name): _kept(name, value) for name, value in _named(work(row)).items()}
        except Exception as failure:
            error = f"{type(failure).__name__}: {failure}"
        outcomes.append(Outcome(sample, values, error, perf_counter() - start))
    return outcomes


def _named(found: Any) -> Values:
    if isinstance(found, Mapping):
        return found
    raise _core.EvaluationError(f"a measure gives a dictionary of numbers by name, not {found!r:.60}")


def _kept(name: Any, value: Any) -> Any:
    """A number, a truth, a text, or an array of doubles."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, str):
        return value
    try:
        numbers = np.array(value, float)
    except (TypeError, ValueError):
        raise _core.EvaluationError(
            f"{name!r} of a measure is {value!r:.60}; what is kept are numbers, arrays of them, truths and texts"
        ) from None
    return float(numbers) if numbers.ndim == 0 else numbers


# ---------------------------------------------------------------------- in other threads and processes

_own = threading.local()
"""The work that a thread last did, as its own: scenes are set by samples, one at a time."""


def run_in_thread(work: Any, rows: Sequence[tuple[int, Values]]) -> list[Outcome]:
    """`run_rows` with this thread's own copy of the work."""
    if getattr(_own, "of", None) is not work:
        _own.of, _own.work = work, work.own()
    return run_rows(_own.work, rows)


def packed(work: Any) -> bytes:
    """The work as bytes for another process. EvaluationError where it holds what does not go there."""
    try:
        from cloudpickle import dumps  # comes with Dask; takes functions of a notebook along
    except ImportError:
        dumps = pickle.dumps
    try:
        return dumps(work)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise _core.EvaluationError(
            f"the sweep does not go to another process: {error}; define its functions in a module, "
            'or install cloudpickle (extra [dask]), or take on="threads"'
        ) from None


def run_packed(bundle: bytes, rows: Sequence[tuple[int, Values]]) -> list[Outcome]:
    """`run_rows` of a work that came as bytes; kept, so that the next rows find it ready."""
    key = sha256(bundle).digest()
    if getattr(_own, "of", None) != key:
        _own.work = pickle.loads(bundle)
        _own.of = key
    return run_rows(_own.work, rows)
