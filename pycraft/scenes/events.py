"""Events: functions whose zeros are located along a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from ..arguments import text
from .effects.user_effects import EffectState, kind_of

DIRECTIONS = {"both": 0, "rising": 1, "falling": -1}


@dataclass(frozen=True)
class Event:
    """A function of a state whose zeros are events.

    Parameters
    ----------
    function : callable (t, state) -> float
        `state` is an `EffectState`, as for effects in Python.
    direction : {0, 1, -1} or {"both", "rising", "falling"}
        Direction of the zero crossings that count.
    terminal : bool
        True ends the run at the event.
    name : str
        Default: the function's name.

    Examples
    --------
    >>> import pycraft as pc
    >>> scene = pc.mechanisms.pendulum()
    >>> back = pc.Event(lambda t, state: state.v[0], direction="rising", name="back")
    >>> run = scene.simulate(3.0, events=back)
    >>> float(run.events["back"].t[0].round(4))
    2.3678
    """

    function: Callable[[float, EffectState], float]
    direction: int | str = 0
    terminal: bool = False
    name: str | None = None


@dataclass(frozen=True)
class EventStates:
    """The states at which an event happened, K of them: times `t` (K,), `q` (K, nq), `v` (K, nv), the effects' own `states` (K, n)."""

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    states: np.ndarray

    def __len__(self) -> int:
        return len(self.t)


def listed_events(given: Any) -> list[Event]:
    """Return a user's events as a list: None, one or several; functions, which may have SciPy's attributes `terminal`, `direction`; a
    dictionary by name. Raises EvaluationError for other objects, unknown directions and repeated names."""
    if given is None:
        return []
    if isinstance(given, Mapping):
        pairs = [(name, each) for name, each in given.items()]
    elif callable(given) or isinstance(given, Event) or not isinstance(given, Iterable):
        pairs = [(None, given)]
    else:
        pairs = [(None, each) for each in given]
    events: list[Event] = []
    for name, each in pairs:
        event = each if isinstance(each, Event) else Event(each, getattr(each, "direction", 0), bool(getattr(each, "terminal", False)))
        if not callable(event.function):
            raise _core.EvaluationError(f"events: an event must be a function (t, state) -> float, not {event.function!r:.80}")
        if not isinstance(event.direction, (str, int, float, np.integer)) or event.direction not in (*DIRECTIONS, *DIRECTIONS.values()):
            raise _core.EvaluationError(f"events: direction={event.direction!r:.80}; there are 0, 1, -1, 'both', 'rising' and 'falling'")
        called = name if name is not None else event.name if event.name is not None else unused(kind_of(event.function), events)
        if any(other.name == called for other in events):
            raise _core.EvaluationError(f"events: two events are called {called!r}; give each its own name")
        direction = int(DIRECTIONS.get(event.direction, event.direction))  # type: ignore[arg-type]  # checked above
        events.append(Event(event.function, direction, event.terminal, text(called, "an event")))
    return events


def unused(name: str, events: list[Event]) -> str:
    """Return the name, with a number if it is used already."""
    taken = {event.name for event in events}
    return next(n for n in (name, *(f"{name}_{i}" for i in range(2, len(events) + 3))) if n not in taken)


class CalledEvent:
    """An event, adapted to the core."""

    def __init__(self, model: Any, function: Callable[[float, EffectState], float]):
        self.model, self.function = model, function

    def __call__(self, t: float, q: np.ndarray, v: np.ndarray, states: np.ndarray) -> float:
        return self.function(t, EffectState(self.model, t, q, v, states))


def events_for_core(model: Any, events: list[Event]) -> list[tuple[str, CalledEvent, int, bool]]:
    """Return (name, call, direction, terminal) of each event."""
    return [(str(e.name), CalledEvent(model, e.function), int(e.direction), e.terminal) for e in events]
