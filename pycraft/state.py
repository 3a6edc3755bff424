"""States: q and v of one model, and random states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _core
from .arguments import seed_of
from .closed import Closed


@dataclass
class State(Closed):
    """Generalized coordinates `q` (nq,) and velocities `v` (nv,) of a model.

    Every argument q accepts a State, and then uses its v as well.
    """

    q: np.ndarray
    v: np.ndarray


def at_state(model: Any, q: Any = None, v: Any = None) -> tuple[Any, Any]:
    """Return the q and v of a call, by the one rule of direct calls and of `Operator.at`.

    Without q: the model's present state, with its v unless v is given. With a State: its q, and its v unless v is given. With an array q:
    zero velocities unless v is given.
    """
    if q is None:
        return model.q, model.v if v is None else getattr(v, "v", v)
    if not isinstance(q, np.ndarray) and hasattr(q, "q") and hasattr(q, "v"):
        return q.q, q.v if v is None else getattr(v, "v", v)
    return q, np.zeros(model.nv) if v is None else getattr(v, "v", v)


def moment_of(q: Any, t: Any, states: Any) -> tuple[Any, Any]:
    """Return the t and the effects' own states of a call. Defaults: those of a run, else 0 and None, their initial values."""
    of_run = getattr(q, "states", np.zeros(0))
    if states is None and of_run.shape[-1]:
        states = of_run
    return getattr(q, "t", 0.0) if t is None else t, states


def names_of_q(model: Any) -> list[str]:
    """Return the names of the entries of q: names of hinges, numbered for hinges with several entries."""
    names: list[str] = []
    for name, hinge in model.hinges.items():
        count = hinge.q_slice.stop - hinge.q_slice.start
        names += [name] if count == 1 else [f"{name}[{i}]" for i in range(count)]
    return names


def random_state(model: _core.Multibody, seed: int | np.random.Generator = 0) -> State:
    """Return a random state of `model`, the same for the same seed.

    One-coordinate subhinges: uniform within the limits, else ±π for angles and ±1 m for travels. Ball and free: rotations uniform on
    the group (a normalised Gaussian quaternion), positions in ±1 m. Velocities uniform in ±1.
    """
    rng = seed_of(seed)
    q, at = np.array(model.zero_q()), 0
    for k in range(model._size):
        hinge = model._body(k)["hinge"]
        lower, upper = hinge["lower"], hinge["upper"]
        for i, subhinge in enumerate(hinge["subhinges"]):
            kind = _core.subhinge_kinds[subhinge["kind"]]
            if kind.nq == 1:
                span = np.pi if kind.angle else 1.0
                q[at] = rng.uniform(*_interval(span, lower[i], upper[i]) if len(lower) else (-span, span))
            else:
                free = np.arange(at, at + kind.nq)
                if kind.quaternion is not None:
                    turned = at + kind.quaternion
                    quaternion = rng.normal(size=4)
                    q[turned : turned + 4] = quaternion / np.linalg.norm(quaternion)
                    free = free[(free < turned) | (free >= turned + 4)]
                q[free] = rng.uniform(-1, 1, len(free))
            at += kind.nq
    return State(q, rng.uniform(-1, 1, model.nv))


def _interval(span: float, lower: float, upper: float) -> tuple[float, float]:
    """Return the part of ±span within the limits; if empty, the part of the limits nearest to zero, as wide as they and ±span allow."""
    low, high = max(-span, lower), min(span, upper)
    if low <= high:
        return low, high
    return (lower, min(upper, lower + 2 * span)) if lower > 0 else (max(lower, upper - 2 * span), upper)
