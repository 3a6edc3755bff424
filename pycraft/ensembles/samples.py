"""Samples of a sweep: the inputs that change from run to run, by name, one row per run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..arguments import listed, seed_of, whole


class Samples(Mapping[str, Any]):
    """Values by name, one for each run: arrays (n, ...) of numbers, or lists of other objects.

    In a sweep of a scene each name is the parameter or coordinate to set (docs/ensembles.md): "q", "v", "q.elbow", "bodies.hand.mass",
    "effects.damping.coefficient", "effects.gravity.g[2]". In a sweep of a function the names are its arguments.

    Parameters
    ----------
    values : mapping of names to n values each; the first axis of a NumPy array counts the runs

    Attributes
    ----------
    count : n

    Examples
    --------
    >>> import pycraft as pc
    >>> angles = pc.samples.grid({"q.rod0": [0.1, 0.2], "effects.damping.coefficient": [0, 1, 10]})
    >>> angles.count, angles["q.rod0"].tolist()
    (6, [0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
    """

    def __init__(self, values: Mapping[str, Any]):
        if not isinstance(values, Mapping) or not values:
            raise _core.ModelError('samples must map names to values, one for each run, such as {"q.elbow": [0.1, 0.2]}')
        self._values = {str(name): _values(name, given) for name, given in values.items()}
        counts = {name: len(given) for name, given in self._values.items()}
        if len(set(counts.values())) > 1:
            raise _core.ModelError(
                f"samples: every name needs the same number of values; got {', '.join(f'{n} of {name}' for name, n in counts.items())}"
            )
        self.count: int = next(iter(counts.values()))

    def row(self, i: int) -> dict[str, Any]:
        """Return the values of run i."""
        return {name: _item(values[i]) for name, values in self._values.items()}

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __or__(self, other: Mapping[str, Any]) -> Samples:
        """Return the samples of both; they must have the same count."""
        both = set(self) & set(other)
        if both:
            raise _core.ModelError(f"samples: {', '.join(sorted(both))} occurs in both sets of samples")
        return Samples({**self, **other})

    def __repr__(self) -> str:
        return f"<{self.count} samples of {', '.join(self)}>"


def grid(values: Mapping[str, Any]) -> Samples:
    """Return every combination of the values of each name; the last name changes fastest."""
    axes = [_values(name, given) for name, given in values.items()]
    places = np.indices([len(axis) for axis in axes]).reshape(len(axes), -1)
    return Samples({name: _taken(axis, at) for name, axis, at in zip(values, axes, places, strict=True)})


def random(count: int, ranges: Mapping[str, Any], *, seed: int | np.random.Generator = 0) -> Samples:
    """Return independent random draws.

    Parameters
    ----------
    count : n
    ranges : by name, a pair (low, high) for a uniform distribution between two numbers; a list of equally likely values; or a
        frozen distribution of SciPy, such as `scipy.stats.norm(2.0, 0.1)`
    seed : seed of the random draws
    """
    return _drawn(_count(count), ranges, seed_of(seed).random((_count(count), len(ranges))))


def sobol(count: int, ranges: Mapping[str, Any], *, seed: int | np.random.Generator = 0) -> Samples:
    """Return points of a scrambled Sobol sequence (`scipy.stats.qmc`), which fill a box more evenly than random draws: means of smooth
    functions converge about as 1/n, against 1/√n for random draws. The sequence is balanced when the count is a power of two.

    Parameters as for `random`.
    """
    from scipy.stats import qmc

    return _drawn(_count(count), ranges, qmc.Sobol(len(ranges), seed=seed_of(seed)).random(_count(count)))


def states(model: Any, count: int, *, seed: int | np.random.Generator = 0) -> Samples:
    """Return random states of a model, drawn as by `Multibody.random_state` (rotations included): "q" (n, nq) and "v" (n, nv)."""
    generator = seed_of(seed)
    drawn = [model.random_state(generator) for _ in range(_count(count))]
    return Samples({"q": np.stack([state.q for state in drawn]), "v": np.stack([state.v for state in drawn])})


# ---------------------------------------------------------------------- values


def _count(count: Any) -> int:
    if whole(count, "count") < 1:
        raise _core.ModelError(f"count={count}: at least one sample is needed")
    return int(count)


def _values(name: Any, given: Any) -> Any:
    """Return numbers as an array of doubles, anything else as a list."""
    if not isinstance(given, np.ndarray):
        given = listed(given, f"samples of {name!r}")
    if not len(given):
        raise _core.ModelError(f"samples of {name!r}: at least one value is needed")
    try:
        numbers = np.asarray(given)
    except ValueError:  # rows of different lengths
        return list(given)
    return numbers.astype(float) if numbers.dtype.kind in "fiu" else list(given)


def _item(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _taken(values: Any, places: np.ndarray) -> Any:
    return values[places] if isinstance(values, np.ndarray) else [values[i] for i in places]


def _drawn(count: int, ranges: Mapping[str, Any], uniform: np.ndarray) -> Samples:
    quantiles = [_quantile(name, given) for name, given in ranges.items()]
    return Samples({name: quantile(uniform[:, k]) for k, (name, quantile) in enumerate(zip(ranges, quantiles, strict=True))})


def _quantile(name: str, given: Any) -> Callable[[np.ndarray], Any]:
    if hasattr(given, "ppf"):
        return given.ppf
    if isinstance(given, tuple) and len(given) == 2:
        low, high = (float(_core.real_array(end, f"range of {name!r}")) for end in given)
        if not (-np.inf < low <= high < np.inf):
            raise _core.ModelError(f"range of {name!r}: give (low, high), two finite numbers with low <= high, not {given}")
        return lambda u: low + (high - low) * u
    if isinstance(given, Sequence) and not isinstance(given, (str, tuple)) and len(given):
        values = _values(name, given)
        return lambda u: _taken(values, np.minimum((u * len(values)).astype(int), len(values) - 1))
    raise _core.ModelError(
        f"range of {name!r}: give (low, high), a list of values, or a frozen distribution of scipy.stats, not {given!r:.60}"
    )
