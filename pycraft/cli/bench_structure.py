"""Cost of edits of a structure (`pycraft bench`): an edit of a model of 10⁵ bodies over its forward dynamics, ratios within one run."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core
from ..models.multibody import Multibody
from .bench import Figure
from .bench_frames import branched

SIZE = 100_000
EDIT, IMPULSE = 10.0, 250.0
"""Bounds. Each body is moved in memory and looked up by its hinge's name, a few times the nanoseconds that it takes in forward dynamics. An
impulse also compiles a copy of the model."""


def _took(call: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def _edits(model: Multibody, leaf: str, inner: str) -> dict[str, tuple[Callable[[], Any], float]]:
    """Return edits in a possible order, with their bounds."""
    return {
        "detach a leaf": (lambda: model.detach(leaf), EDIT),
        "attach it elsewhere by a pin": (lambda: model.attach(leaf, "b7", "pin"), EDIT),
        "detach it again": (lambda: model.detach(leaf), EDIT),
        "have a pin catch it": (lambda: model.attach(leaf, "b7", "pin", velocity="impulse"), IMPULSE),
        "copy a branch": (lambda: model.copy_subtree(inner, "b3", prefix="copy "), EDIT),
        "remove the copy": (lambda: model.remove_body(f"copy {inner}"), EDIT),
        "move the root": (lambda: model.reroot("b500"), EDIT),
        "take all into an empty model": (lambda: Multibody("empty").merge(model), 4 * EDIT),
    }


def structure(rounds: int = 3) -> list[Figure]:
    """Time edits of a tree of 10⁵ bodies, each the least of some rounds, over one forward dynamics."""
    model = branched(SIZE)
    model.detach("b0")
    rng = np.random.default_rng(1)
    model.q = np.r_[1.0, np.zeros(6), rng.uniform(-1, 1, SIZE - 1)]
    q, v, tau = model.q, model.v, np.zeros(model.nv)
    dynamics = min(_took(lambda: model.forward_dynamics(q, v, tau)) for _ in range(5))
    times: dict[str, list[float]] = {}
    pose = model.pose(f"b{SIZE - 1}")
    for _ in range(rounds):
        edits = _edits(model, f"b{SIZE - 1}", "b1000")
        for name, (edit, _bound) in edits.items():
            times.setdefault(name, []).append(_took(edit))
        model.reroot("b0")
    if not np.abs(model.pose(f"b{SIZE - 1}") - pose).max() <= 1e-9:
        raise _core.EvaluationError("a body was moved by edits, in the run that times them")
    return [
        Figure(f"{name}, over forward dynamics", min(times[name]) / dynamics, "x", bound, f"{1e3 * min(times[name]):.0f} ms")
        for name, (_, bound) in edits.items()
    ]
