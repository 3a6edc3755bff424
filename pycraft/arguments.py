"""Read what users give to models, poses, limits, names and lists, before the core checks the values."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from typing import Any

import numpy as np

from . import _core

LARGEST = 2**31 - 1
"""The range of the core's integers."""


@contextmanager
def of_state(state: int, states: int) -> Iterator[None]:
    """Add the number of the state in a batch to errors raised inside, as the core's own batches do."""
    try:
        yield
    except _core.Error as error:
        if states < 2:
            raise
        told = type(error)(f"{error} (state {state} of a batch of {states})")
        vars(told).update(vars(error))
        raise told from None


def text(name: Any, what: str) -> str:
    """Return a name. ModelError if it is not a string."""
    if not isinstance(name, str):
        raise _core.ModelError(f"{what} is named by a string, not by {name!r}")
    if any("\ud800" <= c <= "\udfff" for c in name):
        raise _core.ModelError(f"{what} is named by a string, and {name!r} has half a surrogate pair, which no file can store")
    return name


def listed(items: Any, what: str) -> list[Any]:
    """Return the items of a list. ModelError if it is not one."""
    if isinstance(items, (str, bytes, dict)) or not isinstance(items, Iterable) or getattr(items, "shape", None) == ():
        raise _core.ModelError(f"{what} must be a list, not {items!r}")
    return list(items)


def several(given: Any, alone: type | tuple[type, ...] = str) -> list[Any]:
    """Return one item, or several in a list, as a list. `alone`: types that count as one item although they are iterable."""
    return [given] if isinstance(given, alone) or not isinstance(given, Iterable) or getattr(given, "shape", None) == () else list(given)


def switch(value: Any, what: str) -> bool:
    """Return a switch, on or off. ModelError unless it is True or False: the string "no" would count as on."""
    if not isinstance(value, (bool, np.bool_)):
        raise _core.ModelError(f"{what}={value!r:.80}: give True or False")
    return bool(value)


def whole(value: Any, what: str) -> int:
    """Return an integer of any integer type; 2.0 and True are refused. ModelError if it is not one."""
    try:
        if not isinstance(value, bool):
            return operator.index(value)
    except TypeError:
        pass
    raise _core.ModelError(f"{what} must be a whole number, not {value!r}")


def one_number(value: Any, what: str) -> float:
    """Return a real number. ModelError if it is not one."""
    number = _core.real_array(value, what)
    if number.ndim:
        raise _core.ModelError(f"{what} takes one number, not an array {number.shape}")
    return float(number)


def moment(t: Any) -> float:
    """Return a time, s. EvaluationError if it is not finite."""
    number = one_number(t, "t")
    if not np.isfinite(number):
        raise _core.EvaluationError(f"t is {number:g}; a time is a finite number of seconds")
    return number


def thermal_energy(temperature: Any, boltzmann: Any, refusal: type[Exception], of: str = "", positive: bool = False) -> float:
    """Return kT, J. Raises `refusal` unless kT is finite and not negative, or positive if `positive`. `of`: the owner, for errors."""
    numbers = {name: one_number(x, f"{of}{name}") for name, x in (("temperature", temperature), ("boltzmann", boltzmann))}
    for name, x in numbers.items():
        if not 0 <= x < np.inf or (positive and x == 0):
            raise refusal(f"{of}{name}={x:g}: it is a finite number, {'positive' if positive else 'not negative'}")
    T, k = numbers.values()
    kT = T * k
    if not np.isfinite(kT) or (positive and kT == 0):
        raise refusal(f"{of}temperature={T:g} by boltzmann={k:g} is {kT:g} J: take other units")
    return kT


def chosen(name: Any, what: str) -> str:
    """Return the name given for an option; the core checks that it exists. EvaluationError if it is not a string."""
    if not isinstance(name, str):
        raise _core.EvaluationError(f"{what}={name!r:.80}: give a name")
    return name


def clipped(value: Any, what: str) -> int:
    """Return an integer, clipped to the range of the core's integers: the core reports one that is too large."""
    return max(-LARGEST, min(whole(value, what), LARGEST))


def name_of(name: Any, what: str, otherwise: str) -> str:
    """Return a name, or `otherwise` if it is None."""
    return otherwise if name is None else text(name, what)


def seed_of(seed: Any) -> np.random.Generator:
    """Return the random generator of a seed, or the generator given. ModelError if it is neither."""
    if not isinstance(seed, np.random.Generator) and whole(seed, "seed") < 0:
        raise _core.ModelError(f"seed must be a whole number from 0 on, or a numpy.random.Generator, not {seed!r}")
    return np.random.default_rng(seed)


def parents_of(parents: Any, what: str) -> list[int]:
    """Return the number of each body's parent, smaller than the body's own, -1 for the base. `what`: the owner, for errors."""
    if isinstance(parents, np.ndarray) and parents.ndim != 1:
        raise _core.ModelError(f"parents of {what} must be a list of whole numbers, not an array {parents.shape}")
    inboard = [whole(p, f"parents of {what}") for p in listed(parents, f"parents of {what}")]
    for k, parent in enumerate(inboard):
        if not -1 <= parent < k:
            raise _core.ModelError(f"body {k} of {what} has parent {parent}; parents come before their children, -1 is the base")
    return inboard


def pose_parts(what: str, rotation: Any, position: Any, placement: Any) -> tuple[Any, Any]:
    """Return rotation and position of a pose, given as these two (None if absent) or as a (4, 4) matrix. `what`: the owner, for errors."""
    if placement is None:
        return rotation, position
    if rotation is not None or position is not None:
        raise _core.ModelError(f"{what}: give placement, or rotation and position, not both")
    pose = _core.real_array(placement, f"placement of {what}")
    if pose.shape != (4, 4):
        raise _core.ModelError(f"placement of {what} takes a (4, 4) pose, not an array {pose.shape}")
    if not np.array_equal(pose[3], (0, 0, 0, 1)):
        raise _core.ModelError(f"placement of {what}: the last row of a pose is (0, 0, 0, 1), not {tuple(pose[3].tolist())}")
    return pose[:3, :3], pose[:3, 3]


def limit_pair(what: str, limits: Any) -> tuple[Any, Any]:
    """Return the lower and upper limits of a pair, None if absent. `what`: the owner, for errors."""
    if limits is None:
        return None, None
    try:
        lower, upper = limits
    except (TypeError, ValueError):
        raise _core.ModelError(f"limits of {what} are a pair (lower, upper), not {limits!r}") from None
    return lower, upper


def _refuse(self: Any, *_: Any, **__: Any) -> Any:
    raise TypeError(f"this {type(self).__mro__[1].__name__} stays as it is: set the field that holds it anew")


class FixedList(list[Any]):
    """A list that cannot be changed."""

    def __init__(self, items: Iterable[Any]):
        super().__init__(map(fixed, items))

    __setitem__ = __delitem__ = __iadd__ = __imul__ = append = extend = insert = pop = remove = clear = sort = reverse = _refuse  # type: ignore[assignment]  # none of them changes anything

    def __reduce__(self) -> tuple[type, tuple[list[Any]]]:
        return type(self), (list(self),)


class FixedMapping(dict[Any, Any]):
    """A mapping that cannot be changed."""

    def __init__(self, items: Mapping[Any, Any]):
        super().__init__({key: fixed(value) for key, value in items.items()})

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse  # type: ignore[assignment]  # none of them changes anything

    def __reduce__(self) -> tuple[type, tuple[dict[Any, Any]]]:
        return type(self), (dict(self),)


def fixed(value: Any) -> Any:
    """Return an immutable copy of a user's value: read-only arrays, and lists, mappings and sets that cannot be changed.

    A piecewise polynomial of SciPy is copied with its arrays; any other value is returned as it is, and so is a read-only array that owns
    its data.
    """
    if type(value) is np.ndarray and value.base is None and not value.flags.writeable:
        return value
    if isinstance(value, np.ndarray) or (hasattr(value, "__array__") and not isinstance(value, np.generic)):
        return read_only(np.array(value))
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return type(value)(*map(fixed, value))
    if isinstance(value, tuple):
        return tuple(map(fixed, value))
    if isinstance(value, list):
        return FixedList(value)
    if isinstance(value, Mapping):
        return FixedMapping(value)
    if isinstance(value, set):
        return frozenset(value)
    if callable(value) and isinstance(getattr(value, "c", None), np.ndarray) and isinstance(getattr(value, "x", None), np.ndarray):
        own = copy(value)
        own.c, own.x = read_only(np.array(value.c)), read_only(np.array(value.x))
        return own
    return value


def read_only(array: np.ndarray) -> np.ndarray:
    """Return the array itself, made read-only."""
    array.setflags(write=False)
    return array


class Fixed:
    """A frozen dataclass that copies the values it is given and returns immutable ones."""

    def __post_init__(self) -> None:
        self.__setstate__(dict(vars(self)))

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update({name: fixed(value) for name, value in state.items()})
