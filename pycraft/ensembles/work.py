"""What a sweep does for one sample, and for a handful of them in one go."""

from __future__ import annotations

import copy
import pickle
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from time import perf_counter
from typing import Any

import numpy as np

from .. import _core
from ..scenes.scene import Scene
from ..scenes.simulation import RunOptions, alone, simulate_together
from ..state import at_state
from .targets import Targets

Values = Mapping[str, Any]
Rows = Sequence[tuple[int, Values]]

DEFAULTS: dict[str, Any] = {
    "integrator": "auto", "rtol": 1e-9, "atol": 1e-12, "step": None, "max_step": None, "normalise": "never", "energy": True,
}  # fmt: skip
"""Of `Scene.simulate`."""
PACKS = 32
"""Runs for each lane that are prepared, run and measured in one go: enough that lanes seldom wait for the last ones, few enough to keep."""


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
    _known: Any = field(default=None, init=False, repr=False, compare=False)  # calls that are for packs
    _lanes: int = field(default=0, init=False, repr=False, compare=False)

    def __call__(self, row: Values) -> Values:
        if self._targets is None:
            self._targets = Targets(self.scene, self.names)
        q, v = self._targets.set(row)
        self.scene._limits_said = True  # a sweep has thousands of runs; `crossed_limits` of each says them
        self.scene._doubts_said = {"energy", "atol"}  # the balance is among what each keeps
        return self.measure(self.scene.simulate(self.T, q, v, progress=False, **self.options))

    def __post_init__(self) -> None:
        self._run = RunOptions.checked(**{**DEFAULTS, **{name: value for name, value in self.options.items() if name in DEFAULTS}})

    def one_by_one(self) -> str:
        """Why runs are not side by side in packs of states, in words; "" if they are."""
        if self.options.get("events"):
            return "events are looked for"
        if edits := [name for name in self.names if name.partition(".")[0] in ("bodies", "hinges")]:
            return f"samples set {edits[0]!r}, and packs are of one model"
        return alone(self.scene._calls(), self._run)

    @property
    def lanes(self) -> int:
        """How many runs are side by side."""
        if self._lanes == 0:
            self._lanes = 1 if self.one_by_one() else _core.pack_width()
        return self._lanes

    def together(self, rows: Rows) -> list[Outcome]:
        """`run_rows`, in packs of states where a sample allows it."""
        each = PACKS * self.lanes
        return [outcome for i in range(0, len(rows), each) for outcome in self._some(rows[i : i + each])]

    def _some(self, rows: Rows) -> list[Outcome]:
        outcomes, ready = [], []
        for sample, row in rows:
            start, found = perf_counter(), None
            try:
                found = self._prepared(row)
            except Exception as error:
                outcomes.append(Outcome(sample, None, _told(error), perf_counter() - start))
                continue
            if found is None:
                outcomes.append(run_row(self, sample, row))
            else:
                ready.append((sample, perf_counter() - start, *found))
        if not ready:
            return outcomes
        _, _, calls, q, v = zip(*ready, strict=True)
        start = perf_counter()
        what = {"t_eval": self.options.get("t_eval"), "dense": self.options.get("dense", True)}
        runs = simulate_together(self.scene, self.T, list(calls), np.stack(q), np.stack(v), self._run, **what)
        each = (perf_counter() - start) / len(runs)
        for (sample, seconds, *_), run in zip(ready, runs, strict=True):
            outcomes.append(_outcome(sample, partial(self._measured, run), seconds + each))
        return outcomes

    def _prepared(self, row: Values) -> tuple[Any, np.ndarray, np.ndarray] | None:
        """The scene as a sample has it, compiled, with its state; None if the sample makes something of it that is not for packs."""
        if self._targets is None:
            self._targets = Targets(self.scene, self.names)
        q, v = at_state(self.scene.model, *self._targets.set(row))
        calls = self.scene._calls()
        if calls is not self._known:
            _core.check_pairing(calls, self._run.integrator.name, False, False)
            if alone(calls, self._run):
                return None
            self._known = calls
        return calls, q, v

    def _measured(self, run: Any) -> Values:
        if isinstance(run, Exception):
            raise run
        return self.measure(run)

    def own(self) -> SceneWork:
        """The same with a scene and a model of its own, as it sets them."""
        return SceneWork(copy.deepcopy(self.scene), self.names, self.T, self.options, self.measure)

    def __reduce__(self) -> tuple[Any, ...]:
        return SceneWork, (self.scene, self.names, self.T, self.options, self.measure)

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

    lanes = 1

    def one_by_one(self) -> str:
        """Why they are not side by side."""
        return "they are calls of a function"

    def own(self) -> FunctionWork:
        return self

    def parts(self) -> dict[str, Any]:
        return {"function": self.function}


def run_rows(work: Any, rows: Rows) -> list[Outcome]:
    """The outcomes of some samples, one after the other or side by side; an error of one is told of it and ends no other."""
    if len(rows) > 1 and work.lanes > 1:
        return work.together(rows)
    return [run_row(work, *row) for row in rows]


def run_row(work: Any, sample: int, row: Values) -> Outcome:
    """The outcome of one sample."""
    return _outcome(sample, lambda: work(row), 0.0)


def _outcome(sample: int, found: Callable[[], Any], seconds: float) -> Outcome:
    start, values, error = perf_counter(), None, None
    try:
        values = {str(name): _kept(name, value) for name, value in _named(found()).items()}
    except Exception as failure:
        error = _told(failure)
    return Outcome(sample, values, error, seconds + perf_counter() - start)


def _told(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


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


def run_in_thread(work: Any, rows: Rows) -> list[Outcome]:
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


def run_packed(bundle: bytes, rows: Rows) -> list[Outcome]:
    """`run_rows` of a work that came as bytes; kept, so that the next rows find it ready."""
    key = sha256(bundle).digest()
    if getattr(_own, "of", None) != key:
        _own.work = pickle.loads(bundle)
        _own.of = key
    return run_rows(_own.work, rows)
