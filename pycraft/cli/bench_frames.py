"""Cost of frames (`pycraft bench`): a query costs the hinges between its frames, a repeated one a look-up, none costs nothing."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core
from ..models.multibody import Multibody
from .bench import Figure

SMALL, GREAT = 1000, 100_000
QUESTIONS = 64
ASKED, KEPT, NOTHING = 4.0, 2.0, 1.1
"""Bounds. The data of a hinge in a large model are in no cache: they are a few times slower to reach than in a small one."""


def branched(size: int) -> Multibody:
    """Return a tree with two bodies on every body: depth log₂ of the size."""
    model = Multibody(f"tree of {size}")
    for k in range(size):
        parent = f"b{(k - 1) // 2}" if k else None
        model.add_body(f"b{k}", parent, position=(0.1, 0.2, 0.3), axis=(0, 0.6, 0.8), mass=1.0, inertia=np.eye(3))
    return model


def _least(call: Callable[[int], Any], rounds: int) -> float:
    """Return the least time of a call in seconds; its argument is the number of the round."""
    times = []
    for i in range(rounds):
        begin = time.perf_counter()
        call(i)
        times.append(time.perf_counter() - begin)
    return min(times)


class _Asked:
    """A model, some leaves, and states that are set in turn."""

    def __init__(self, size: int):
        self.model, rng = branched(size), np.random.default_rng(1)
        self.states = rng.uniform(-1, 1, (4, size))
        self.before = _least(self.set, 200)  # before there is any frame, and on the same pages of memory as afterwards
        leaves = rng.integers(size // 2, size, QUESTIONS)
        self.frames = [self.model.frame(f"b{k}") for k in leaves]
        self.depth = float(np.mean(np.floor(np.log2(leaves + 1)) + 1))

    def set(self, i: int) -> None:
        self.model.q = self.states[i % 4]

    def ask(self, i: int = 0) -> None:
        for frame in self.frames:
            frame.velocity()

    def new(self, rounds: int) -> float:
        """Return seconds per query at a new state, without the cost of setting it."""
        times = []
        for i in range(rounds):
            self.set(i)
            times.append(_least(self.ask, 1))
        return min(times) / QUESTIONS

    def check(self) -> None:
        for frame in self.frames[:3]:
            if not np.abs(frame.pose() - self.model.pose(frame.name)).max() <= 1e-12:
                raise _core.EvaluationError(f"the pose of {frame.name} is wrong in the run that times it")


def frames(seconds: float = 0.2) -> list[Figure]:
    """Time queries at new and known states on 10⁵ bodies over 10³, and setting a state without a query."""
    rounds = max(20, int(200 * seconds))
    small, great = _Asked(SMALL), _Asked(GREAT)
    for asked in (small, great):
        asked.new(2)
        asked.check()
    new = [asked.new(rounds) for asked in (small, great)]
    kept = [_least(asked.ask, rounds) / QUESTIONS for asked in (small, great)]
    idle = _least(great.set, 200)
    per_hinge = [t / asked.depth for t, asked in zip(new, (small, great), strict=True)]
    note = f"{1e6 * new[1]:.1f} us a question over {great.depth:.0f} hinges, {1e6 * new[0]:.1f} over {small.depth:.0f}"
    return [
        Figure(f"velocity at a new state, per hinge: {GREAT} bodies over {SMALL}", per_hinge[1] / per_hinge[0], "x", ASKED, note),
        Figure(f"velocity asked again: {GREAT} bodies over {SMALL}", kept[1] / kept[0], "x", KEPT, f"{1e6 * kept[1]:.2f} us"),
        Figure(f"q set, no frame asked for, {GREAT} bodies: over none made", idle / great.before, "x", NOTHING, f"{1e6 * idle:.0f} us"),
    ]
