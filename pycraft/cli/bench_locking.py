"""Cost of locked hinges and coalesced bodies (`pycraft bench`): edits of a large model over preparing it again, which each edit of the
structure requires, and forward dynamics of a locked model."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core
from ..models.generators import chain
from .bench import Figure, _states, in_turn

GREAT, FEW = 100_000, 10
BOUND = 1.0
"""An edit over the first forward dynamics after it, which prepares the model."""


def _seconds(call: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def locking(seconds: float = 0.2) -> list[Figure]:
    """Time, on a chain of 100 000 links: ten of its hinges locked, coalesced, split and unlocked, and stopped by an impulse."""
    model, hinges = chain(GREAT, seed=1), [f"hinge{k * GREAT // FEW + 5}" for k in range(FEW)]
    rest = np.zeros(GREAT)
    model.forward_dynamics(rest, rest, rest)
    model.lock(hinges), model.unlock()  # requests energy and momentum, which prepares the model
    edits: dict[str, Callable[[], Any]] = {
        "ten hinges locked": lambda: model.lock(hinges),
        "ten bodies coalesced": model.coalesce,
        "ten bodies split": model.split,
        "ten hinges unlocked": model.unlock,
    }
    figures = []
    for name, edit in edits.items():
        taken = _seconds(edit)
        ready = _seconds(lambda: model.forward_dynamics(tau=np.zeros(model.nv)))
        figures.append(Figure(f"{GREAT} links: {name}, over the first call after it", taken / ready, "x", BOUND, f"{1e3 * taken:.0f} ms"))
    model.v = np.full(GREAT, 1e-6)
    model.kinetic_energy()
    taken = _seconds(lambda: model.lock(hinges, impulsive=True))
    ready = _seconds(lambda: model.forward_dynamics(tau=np.zeros(model.nv)))
    name = f"{GREAT} links: ten hinges stopped and locked, over the same"
    figures.append(Figure(name, taken / ready, "x", 2 * BOUND, f"{1e3 * taken:.0f} ms"))
    return figures + _evaluations(seconds)


def _evaluations(seconds: float) -> list[Figure]:
    """Time forward dynamics of 200 links with every second hinge locked, and coalesced, over all free."""
    free, locked, coalesced = (chain(200, seed=1) for _ in range(3))
    for model in (locked, coalesced):
        model.lock([f"hinge{k}" for k in range(1, 200, 2)])
    coalesced.coalesce()
    calls = [_timed(model) for model in (free, locked, coalesced)]
    all_free, *others = in_turn(seconds, *calls, rounds=9)
    names = ("every second hinge of 200 locked", "and coalesced")
    return [
        Figure(f"forward_dynamics, {name}, over all free", own / all_free, "x", 1.05, f"{1e6 * own:.1f} us")
        for name, own in zip(names, others, strict=True)
    ]


def _timed(model: Any) -> Callable[[float], dict[str, float]]:
    q, v, u = _states(model)
    return lambda seconds: _core.time_dynamics(model, "forward_dynamics", q, v, u, seconds)
