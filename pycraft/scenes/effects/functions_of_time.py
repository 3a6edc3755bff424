"""Functions of time, for actuators, wrenches on nodes and prescribed motions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import _core
from ...arguments import Fixed
from .checked_arguments import Checked
from .effect import plain


class InTime(Fixed, metaclass=Checked):
    """A function of time in the core: a run calls no Python. Arrays are copied and read-only."""

    def in_core(self) -> _core.FunctionOfTime:
        raise NotImplementedError

    def __call__(self, t: float) -> np.ndarray:
        """Return its values at a time."""
        return self.in_core()(t)[0]

    def to_dict(self) -> dict[str, Any]:
        """Return its kind and values as plain data."""
        return {"in_time": type(self).__name__} | {name: plain(value) for name, value in vars(self).items()}


@dataclass(frozen=True)
class Table(InTime):
    """Linear interpolation of values over time, constant before the first and after the last point.

    Parameters
    ----------
    times : (K,) s, rising
    values : (K,) or (K, n)
    """

    _example = "pc.effects.Table([0, 1, 2], [0, 0, 1.0])"

    times: Any
    values: Any

    def in_core(self) -> _core.FunctionOfTime:
        t, y = _points(self.times, self.values, "a table")
        slopes = np.diff(y, axis=0) / np.diff(t)[:, None]
        return _core.piecewise_polynomial(t.tolist(), np.stack([slopes, y[:-1]]), y.shape[1])


@dataclass(frozen=True)
class Spline(InTime):
    """The cubic spline through values over time, twice differentiable, constant before the first and after the last point.

    Parameters
    ----------
    times : (K,) s, rising
    values : (K,) or (K, n)
    ends : {"not-a-knot", "natural", "clamped"}
        "not-a-knot": one cubic through the first two intervals, and one through the last two, as in SciPy's CubicSpline. With a
        function's own values at distance h the error is O(h⁴) everywhere. "natural": zero curvature at the ends, error O(h²) near
        them if the function is curved there. "clamped": zero slope at the ends, error O(h) near them if the function's slope is not zero.

    If the slope at an end is not zero, the rate jumps to zero there.

    Source: C. de Boor, A Practical Guide to Splines, Springer 2001, ch. IV.
    """

    _example = "pc.effects.Spline([0, 1, 2], [0, 0.5, 0])"

    times: Any
    values: Any
    ends: str = "not-a-knot"

    def in_core(self) -> _core.FunctionOfTime:
        from scipy.interpolate import CubicSpline

        if self.ends not in ("not-a-knot", "natural", "clamped"):
            raise _core.ModelError(f"a spline's ends are 'not-a-knot', 'natural' or 'clamped', not {self.ends!r}")
        t, y = _points(self.times, self.values, "a spline")
        return _core.piecewise_polynomial(t.tolist(), CubicSpline(t, y, bc_type=self.ends).c, y.shape[1])


@dataclass(frozen=True)
class Harmonic(InTime):
    """offset + amplitude sin(2π frequency t + phase).

    Parameters
    ----------
    amplitude, offset : in the unit of the driven quantity
    frequency : Hz
    phase : rad

    Each is one number, or (n,) for n functions.
    """

    _example = "pc.effects.Harmonic(amplitude=0.5, frequency=2.0)"

    amplitude: Any
    frequency: Any
    phase: Any = 0.0
    offset: Any = 0.0

    def in_core(self) -> _core.FunctionOfTime:
        names = ("amplitude", "frequency", "phase", "offset")
        parts = [_core.real_array(getattr(self, name), name) for name in names]
        counts = {name: part.shape[0] for name, part in zip(names, parts, strict=True) if part.ndim == 1}
        if any(part.ndim > 1 for part in parts) or len(set(counts.values())) > 1:
            shapes = ", ".join(f"{name} {part.shape}" for name, part in zip(names, parts, strict=True))
            raise _core.ModelError(f"a harmonic function takes one number for each parameter, or (n,), not {shapes}")
        return _core.harmonic(*(np.broadcast_to(part, next(iter(counts.values()), 1)).tolist() for part in parts))


def _points(times: Any, values: Any, what: str) -> tuple[np.ndarray, np.ndarray]:
    t, y = _core.real_array(times, f"times of {what}"), _core.real_array(values, f"values of {what}")
    if t.ndim != 1 or y.ndim not in (1, 2) or len(y) != len(t):
        raise _core.ModelError(f"{what} takes times (K,) and values (K,) or (K, n), not {t.shape} and {y.shape}")
    if len(t) < 2 or not (np.diff(t) > 0).all():
        raise _core.ModelError(f"{what} takes at least two times, in rising order")
    return t, y.reshape(len(t), -1)


def function_of_time(given: Any, what: str, size: int | None = None, derivatives: bool = False, step: float = 1e-3) -> _core.FunctionOfTime:
    """Return a function of time of the core from a user's argument.

    Parameters
    ----------
    given : number, array, InTime, a piecewise polynomial of SciPy's (CubicSpline, PPoly), or a callable of t
    what : its name in errors
    size : number of values of a callable; None: as at t = 0
    derivatives : True if its derivatives are needed
    step : s, step of the differences for a callable that returns only values
    """
    if isinstance(given, InTime):
        return given.in_core()
    if hasattr(given, "c") and hasattr(given, "x") and callable(given):  # a PPoly
        c, x = np.asarray(given.c, float), np.asarray(given.x, float)
        c = c.reshape(*c.shape[:2], -1)
        return _core.piecewise_polynomial(x.tolist(), c, c.shape[2])
    if callable(given):
        if size is None:
            size = int(np.size(_values(given(0.0), what)))
        return _core.python_function_of_time(_Differentiated(given, size, what, step) if derivatives else _Valued(given, what), size, what)
    numbers = _core.real_array(given, what)
    if numbers.ndim > 1:
        raise _core.ModelError(f"{what} takes numbers, a table, a spline or a function of time, not an array {numbers.shape}")
    return _core.constant_in_time(np.atleast_1d(numbers).tolist())


def _values(given: Any, what: str) -> np.ndarray:
    return np.atleast_1d(_core.real_array(given, what))


class _Valued:
    """A callable of t, adapted to the core."""

    def __init__(self, call: Callable[[float], Any], what: str):
        self.call, self.what = call, what

    def __call__(self, t: float, derivatives: bool) -> Any:
        values = _values(self.call(t), self.what)
        return (values, np.zeros_like(values), np.zeros_like(values)) if derivatives else values


class _Differentiated:
    """A callable that returns (value, rate, second derivative), or only values, which are differentiated by differences of order 6."""

    def __init__(self, call: Callable[[float], Any], size: int, what: str, step: float):
        self.call, self.size, self.what, self.step = call, size, what, step

    def _parts(self, given: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        if isinstance(given, tuple) and len(given) == 3 and all(np.size(part) == self.size for part in given):
            value, rate, second = (_values(part, self.what) for part in given)
            return value, rate, second
        return None

    def __call__(self, t: float, derivatives: bool) -> Any:
        given = self.call(t)
        parts = self._parts(given)
        if parts is not None:
            return parts if derivatives else parts[0]
        here = _values(given, self.what)
        if not derivatives:
            return here
        h = self.step
        pairs = [(_values(self.call(t + i * h), self.what), _values(self.call(t - i * h), self.what)) for i in (1, 2, 3)]
        rate = sum(w * (after - before) for w, (after, before) in zip((45, -9, 1), pairs, strict=True)) / (60 * h)
        second = sum(w * (after + before) for w, (after, before) in zip((270, -27, 2), pairs, strict=True)) - 490 * here
        return here, rate, second / (180 * h * h)
