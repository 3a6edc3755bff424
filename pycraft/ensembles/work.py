"""Work of a sweep for one sample, or for a batch of samples at once."""

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
"""Runs per lane that are prepared, run and measured at once: enough that lanes seldom idle at the end, few enough to keep in memory."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of a sample: its values, or the reason of its failure."""

    sample: int
    values: Values | None
    error: str | None
    seconds: float


def end_of_run(run: Any) -> dict[str, Any]:
    """Return the default values of a run: its end, its number of steps and, where works were recorded, the largest drift of the energy
    balance, J."""
    kept: dict[str, Any] = {"end.t": run.t[-1], "end.q": run.q[-1], "end.v": run.v[-1], "steps": run.statistics["steps"]}
    with suppress(_core.EvaluationError):  # a run without works
        kept["balance"] = run.balance[-1] - run.balance[0]
    return kept


def trajectory(run: Any) -> dict[str, Any]:
    """Return the end of a run, and "run.t" (K,), "run.q" (K, nq), "run.v" (K, nv) at the times t_eval, which all runs share."""
    return {**end_of_run(run), "run.t": run.t, "run.q": run.q, "run.v": run.v}


@dataclass
class SceneWork:
    """A run of a scene for each sample, and the values measured from it."""

    scene: Scene
    names: list[str]
    T: float
    options: dict[str, Any]
    measure: Callable[[Any], Values]
    _targets: Targets | None = field(default=None, init=False, repr=False, compare=False)
    _known: Any = field(default=None, init=False, repr=False, compare=False)  # calls suited to packs
    _lanes: int = field(default=0, init=False, repr=False, compare=False)

    def __call__(self, row: Values) -> Values:
        if self._targets is None:
            self._targets = Targets(self.scene, self.names)
        q, v = self._targets.set(row)
        self.scene._limits_said = True  # a sweep has thousands of runs; `crossed_limits` of each run lists them
        self.scene._doubts_said = {"energy", "atol"}  # the balance is among the default values
        return self.measure(self.scene.simulate(self.T, q, v, progress=False, **self.options))

    def __post_init__(self) -> None:
        self._run = RunOptions.checked(**{**DEFAULTS, **{name: value for name, value in self.options.items() if name in DEFAULTS}})

    def one_by_one(self) -> str:
        """Return why runs are not executed side by side in packs of states; "" if they are."""
        if self.options.get("events"):
            return "the runs look for events"
        if edits := [name for name in self.names if name.partition(".")[0] in ("bodies", "hinges")]:
            return f"samples set {edits[0]!r}, and a pack shares one model"
        return alone(self.scene._calls(), self._run)

    @property
    def lanes(self) -> int:
        """Number of runs side by side."""
        if self._lanes == 0:
            self._lanes = 1 if self.one_by_one() else _core.pack_width()
        return self._lanes

    def together(self, rows: Rows) -> list[Outcome]:
        """Do `run_rows`, in packs of states where the samples allow it."""
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
        """Return the scene of a sample, compiled, and its state; None if the sample's scene is not suited to packs."""
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
        """Return a copy with its own scene and model, because samples modify them."""
        return SceneWork(copy.deepcopy(self.scene), self.names, self.T, self.options, self.measure)

    def __reduce__(self) -> tuple[Any, ...]:
        return SceneWork, (self.scene, self.names, self.T, self.options, self.measure)

    def parts(self) -> dict[str, Any]:
        """Return the parts that identify a sweep."""
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
        """Return why calls are not executed side by side."""
        return "they call a function"

    def own(self) -> FunctionWork:
        return self

    def parts(self) -> dict[str, Any]:
        return {"function": self.function}


def run_rows(work: Any, rows: Rows) -> list[Outcome]:
    """Yield the outcomes of some samples, run one after another or side by side; an error of one stops no other."""
    if len(rows) > 1 and work.lanes > 1:
        return work.together(rows)
    return [run_row(work, *row) for row in rows]


def run_row(work: Any, sample: int, row: Values) -> Outcome:
    """Return the outcome of one sample."""
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
    raise _core.EvaluationError(f"measure must return a dictionary of values by name, not {found!r:.60}")


def _kept(name: Any, value: Any) -> Any:
    """Return a number, a truth, a text, or an array of doubles."""
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, str):
        return value
    try:
        numbers = np.array(value, float)
    except (TypeError, ValueError):
        raise _core.EvaluationError(
            f"{name!r} of a measure is {value!r:.60}; a sweep keeps numbers, arrays of numbers, truths and texts"
        ) from None
    return float(numbers) if numbers.ndim == 0 else numbers


# ---------------------------------------------------------------------- in other threads and processes

_own = threading.local()
"""Each thread's own copy of its last work: samples modify the scene, one at a time."""


def run_in_thread(work: Any, rows: Rows) -> list[Outcome]:
    """Do `run_rows` with this thread's own copy of the work."""
    if getattr(_own, "of", None) is not work:
        _own.of, _own.work = work, work.own()
    return run_rows(_own.work, rows)


def packed(work: Any) -> bytes:
    """Return the work as bytes for another process. Raises EvaluationError if it holds objects that cannot be sent."""
    try:
        from cloudpickle import dumps  # comes with Dask; sends functions of a notebook
    except ImportError:
        dumps = pickle.dumps
    try:
        return dumps(work)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise _core.EvaluationError(
            f"the sweep cannot be sent to another process: {error}; define its functions in a module, "
            'install cloudpickle (extra [dask]), or use on="threads"'
        ) from None


def run_packed(bundle: bytes, rows: Rows) -> list[Outcome]:
    """Do `run_rows` of a work received as bytes, and cache it for the next rows."""
    key = sha256(bundle).digest()
    if getattr(_own, "of", None) != key:
        _own.work = pickle.loads(bundle)
        _own.of = key
    return run_rows(_own.work, rows)
