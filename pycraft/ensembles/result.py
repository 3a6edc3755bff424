"""Result of a sweep: the values of its runs by sample, and the reasons of failed runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .samples import Samples


@dataclass(frozen=True)
class Failure:
    """A run that failed: the number of its sample, its inputs, and the reason."""

    sample: int
    inputs: dict[str, Any]
    reason: str


class SweepResult(Mapping[str, np.ndarray]):
    """Values of all runs by name, in the order of samples: arrays (n, ...), NaN where a run failed or is not finished.

    Values of a sweep in a folder are read on demand, one name at a time.

    Attributes
    ----------
    samples : Samples
    finished : (n,) bool, True for runs with an outcome, failures included
    seconds : (n,) s, duration of each run

    Examples
    --------
    >>> import pycraft as pc
    >>> scene = pc.mechanisms.pendulum()
    >>> found = pc.sweep(scene, pc.samples.grid({"v": [0.0, 1.0]}), 1.0, progress=False)
    >>> found, found["end.q"].shape
    (<sweep of 2 samples: all finished>, (2, 1))
    """

    def __init__(self, store: Any, how: str = "read from a folder"):
        self._store, self._how = store, how
        self.samples: Samples = store.samples
        self.finished: np.ndarray = store.finished
        self.seconds: np.ndarray = store.seconds

    @property
    def failures(self) -> list[Failure]:
        """Failed runs, in the order of samples."""
        return [Failure(i, self.samples.row(i), self._store.errors[i]) for i in sorted(self._store.errors)]

    def __getitem__(self, name: str) -> np.ndarray:
        if name in self.samples and name not in self._store.shapes.known:
            return self.samples[name]
        if name not in self._store.shapes.known:
            raise KeyError(f"the sweep has no value {name!r}; its values are {', '.join([*self.samples, *self])}")
        return self._store.column(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._store.shapes.known)

    def __len__(self) -> int:
        return len(self._store.shapes.known)

    def explain(self) -> str:
        """Return how the runs are executed, side by side in packs of states or one by one, and why."""
        return f"{self.samples.count} runs, {self._how}"

    def to_dataframe(self) -> Any:
        """Return a DataFrame, one row per sample: inputs, values (arrays by component), error, seconds.

        Raises ImportError if pandas is missing (extra [data]).
        """
        from pandas import DataFrame

        columns: dict[str, Any] = {}
        for name, values in [*self.samples.items(), *self.items()]:
            if not isinstance(values, np.ndarray) or values.ndim == 1:
                columns[name] = values
                continue
            flat = values.reshape(len(values), -1)
            columns |= {f"{name}{list(index)}": flat[:, k] for k, index in enumerate(np.ndindex(values.shape[1:]))}
        errors = [self._store.errors.get(i) for i in range(self.samples.count)]
        return DataFrame({**columns, "error": errors, "seconds": self.seconds}).rename_axis("sample")

    def to_xarray(self) -> Any:
        """Return an xarray Dataset over "sample". Raises ImportError if xarray is missing (extra [data])."""
        from xarray import Dataset

        def axes(name: str, values: Any) -> tuple[Any, ...]:
            return (("sample", *(f"{name}_axis{i}" for i in range(1, np.ndim(values)))), values)

        inputs = {name: axes(name, np.asarray(values)) for name, values in self.samples.items() if np.asarray(values).dtype.kind in "fUb"}
        return Dataset({name: axes(name, values) for name, values in self.items()}, coords=inputs)

    def close(self) -> None:
        """Close the folder's journal, if there is one."""
        self._store.close()

    def __repr__(self) -> str:
        finished, failed = int(self.finished.sum()), len(self._store.errors)
        done = "all finished" if finished == self.samples.count else f"{finished} finished"
        return f"<sweep of {self.samples.count} samples: {done}{f', {failed} of them failed' if failed else ''}>"
