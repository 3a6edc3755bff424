"""Storage of the outcomes of a sweep while it runs: in memory, or in a folder (`folder.py`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import _core
from .samples import Samples
from .work import Outcome


class Shapes:
    """Kinds of the values of a sweep by name: the shape of numbers and arrays, else "truth" or "text". They are the same in all runs."""

    def __init__(self, known: Mapping[str, Any] | None = None):
        self.known: dict[str, Any] = dict(known or {})

    def checked(self, outcome: Outcome, taken: Samples) -> Outcome:
        """Return the outcome, or a failure if its values do not have the kinds of the earlier runs."""
        if outcome.values is None:
            return outcome
        shapes = {name: _shape(value) for name, value in outcome.values.items()}
        if not self.known:
            if doubled := set(shapes) & {*taken, *RESERVED}:
                raise _core.EvaluationError(f"a measure names a value {min(doubled)!r}, a reserved name; choose another name")
            self.known = shapes
        if shapes == self.known:
            return outcome
        names = [name for name in {**self.known, **shapes} if shapes.get(name) != self.known.get(name)]
        told = ", ".join(f"{name} is {_told(shapes.get(name))}, not {_told(self.known.get(name))}" for name in names)
        return Outcome(outcome.sample, None, f"values of another kind than in the first run: {told}", outcome.seconds)


RESERVED = ("sample", "error", "seconds")
"""Columns present in every sweep."""


def _shape(value: Any) -> Any:
    return "truth" if isinstance(value, bool) else "text" if isinstance(value, str) else list(np.shape(value))


def _told(shape: Any) -> str:
    return "missing" if shape is None else f"a {shape}" if isinstance(shape, str) else f"of shape {tuple(shape)}" if shape else "a number"


def empty_column(shape: Any, count: int) -> np.ndarray:
    """Return a column before any run is finished: NaN for numbers, None for other values."""
    return np.full((count, *shape), np.nan) if isinstance(shape, list) else np.full(count, None, object)


class Memory:
    """Outcomes as arrays, in the order of samples."""

    def __init__(self, samples: Samples):
        self.samples, self.shapes = samples, Shapes()
        self.finished = np.zeros(samples.count, bool)
        self.seconds = np.full(samples.count, np.nan)
        self.errors: dict[int, str] = {}
        self._columns: dict[str, np.ndarray] = {}

    def add(self, outcomes: list[Outcome]) -> None:
        """Store some outcomes."""
        for outcome in (self.shapes.checked(each, self.samples) for each in outcomes):
            self.finished[outcome.sample], self.seconds[outcome.sample] = True, outcome.seconds
            if outcome.values is None:
                self.errors[outcome.sample] = str(outcome.error)
                continue
            for name, value in outcome.values.items():
                if name not in self._columns:
                    self._columns[name] = empty_column(self.shapes.known[name], self.samples.count)
                self._columns[name][outcome.sample] = value

    def column(self, name: str) -> np.ndarray:
        """Return one value of all runs."""
        return self._columns[name]

    def flush(self) -> None:
        """Nothing waits."""

    def close(self) -> None:
        """Do nothing: no file is open."""
