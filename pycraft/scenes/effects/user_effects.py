"""Effects written in Python: called at every evaluation, or sampled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import _core
from ...arguments import one_number
from .effect import Effect, names_of, numbers_of


class EffectState:
    """The state passed to a user's effect: `t`, `q` (nq,), `v` (nv,), its own `states`; poses, velocities and Jacobians of nodes."""

    __slots__ = ("_model", "q", "states", "t", "v")

    def __init__(self, model: Any, t: float, q: np.ndarray, v: np.ndarray, states: np.ndarray):
        self._model, self.t, self.q, self.v, self.states = model, t, q, v, states

    def pose(self, node: str) -> np.ndarray:
        """Return X_WN (4, 4) of a node or body."""
        return self._model.pose(node, self.q)

    def jacobian(self, node: str, axes: str = "body") -> np.ndarray:
        """Return 𝒥 (6, nv), as `Multibody.jacobian`; 𝒥* w are the generalized forces of a wrench w in the same axes."""
        return self._model.jacobian(node, self.q, axes=axes)

    def twist(self, node: str, axes: str = "body") -> np.ndarray:
        """Return the velocity (6,) of a node or body, angular first."""
        return self.jacobian(node, axes) @ self.v


class _Forces:
    """A user's function, adapted to the core: it returns forces of all coordinates as an array."""

    def __init__(self, model: _core.Multibody, function: Callable[..., Any], kind: str):
        self.model, self.function, self.kind = model, function, kind

    def __call__(self, t: float, q: np.ndarray, v: np.ndarray, states: np.ndarray) -> Any:
        given = self.function(t, EffectState(self.model, t, q, v, states))
        if not isinstance(given, Mapping):
            return given
        forces = np.zeros(self.model.nv)
        for name, each in given.items():
            those = _core.coordinates_named(self.model, [name], self.kind)
            what = f"effect {self.kind!r}: its force on {name!r}"
            numbers = _core.real_array(each, what)
            if numbers.ndim > 1 or numbers.size not in (1, len(those)):
                count = f"{len(those)} number{'s' * (len(those) > 1)}"
                raise _core.ModelError(f"{what} takes {count}, not {numbers.size if numbers.ndim < 2 else numbers.shape}")
            forces[those] += numbers
        return forces


class _Rates(_Forces):
    def __call__(self, t: float, q: np.ndarray, v: np.ndarray, states: np.ndarray) -> Any:
        return self.function(t, EffectState(self.model, t, q, v, states))


class _Sampled:
    def __init__(self, model: _core.Multibody, function: Callable[..., Any]):
        self.model, self.function = model, function

    def __call__(self, t: float, q: np.ndarray, v: np.ndarray) -> Any:
        return self.function(t, EffectState(self.model, t, q, v, np.zeros(0)))


@dataclass(repr=False, eq=False)
class UserEffect(Effect):
    """Forces from a Python function. `scene.add(function)` makes one from any callable that is not an effect.

    Parameters
    ----------
    function : callable (t, state) -> forces
        An array (nv,) of generalized forces, or a dictionary of them by hinge or coordinate; `state` is an `EffectState`. Values that are
        not finite raise an error that names the effect and the time.
    states : initial values of the effect's own states; default: the function's attribute `states`, if it has one
    rates : callable (t, state) -> rates of these states; default: the function's method `rates`
    """

    _example = "pc.effects.UserEffect(lambda t, state: -0.1 * state.v)"

    function: Any
    states: Any = None
    rates: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        kind = kind_of(self.function)
        if not callable(self.function):
            raise _core.ModelError(f"UserEffect takes a function (t, state) -> forces, not {self.function!r:.80}")
        states = numbers_of(self.states if self.states is not None else getattr(self.function, "states", ()), f"{kind}: states")
        rates = self.rates if self.rates is not None else getattr(self.function, "rates", None)
        if states and not callable(rates):
            raise _core.ModelError(
                f"effect {kind!r} has {len(states)} states of its own but no rates(t, state), which gives their derivatives"
            )
        forces, change = _Forces(model, self.function, kind), _Rates(model, rates, kind) if states and callable(rates) else None
        return _core.python_effect(model, kind, list(range(model.nv)), forces, change, states, None, 0.0)


def kind_of(function: Any) -> str:
    """Return the name of an effect of this callable."""
    import re

    name = getattr(function, "__name__", type(function).__name__)
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower().strip("<>") or "user_effect"


@dataclass(repr=False, eq=False)
class Sampled(Effect):
    """A controller called every `period` seconds; its forces are held until the next call (zero-order hold).

    It is called at the start of a run and at every whole multiple of the period; integrators end a step there.

    Parameters
    ----------
    function : callable (t, state) -> forces, one for each coordinate of `hinges`
    period : s
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    """

    _example = "pc.effects.Sampled(lambda t, state: -0.1 * state.v, period=0.01)"

    function: Any
    period: float
    hinges: Any = None

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        period = one_number(self.period, "sampled: period")
        if not 0 < period < np.inf:
            raise _core.ModelError(f"sampled: period is {period:g}; it is a positive number of seconds")
        if not callable(self.function):
            raise _core.ModelError(f"sampled: the controller must be a function (t, state) -> forces, not {self.function!r:.80}")
        coordinates = _core.coordinates_named(model, names_of(self.hinges, "sampled"), "sampled")
        return _core.python_effect(model, "sampled", coordinates, None, None, [], _Sampled(model, self.function), period)
