"""Cost of prescribed motion (`pycraft bench`): hybrid dynamics over forward dynamics, in C++, ratios within one run."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .. import _core
from ..models.generators import chain
from .bench import Figure, _states, in_turn

HYBRID = 1.10
"""Bound: hybrid dynamics over forward dynamics."""
WRONG = 1e-9
"""Relative tolerance of forces against inverse dynamics at the accelerations found; kernels' rounding is far below."""


def _checked(name: str, model: Any, chosen: list[str], q: np.ndarray, v: np.ndarray, u: np.ndarray) -> None:
    found = model.hybrid_dynamics(q[0], v[0], u[0], u[0], chosen)
    forces = model.inverse_dynamics(q[0], v[0], found.vdot)
    if np.abs(forces - found.tau).max() > WRONG * np.abs(forces).max():
        raise _core.EvaluationError(f"hybrid dynamics of {name} with {', '.join(chosen)} prescribed is wrong in the run that times it")


def hybrid(seconds: float = 0.2) -> list[Figure]:
    """Measure with the first hinge prescribed, the last, and every third, on three robots and a chain."""
    from ..models import robots

    figures = []
    models = {"ur5": robots.ur5(), "panda": robots.panda(), "g1": robots.g1(), "chain of 100": chain(100, seed=1)}
    for name, model in models.items():
        q, v, u = _states(model)
        hinges = list(model.hinges)
        sets = {"first hinge": hinges[:1], "last hinge": hinges[-1:], "every third hinge": hinges[::3]}
        for chosen in sets.values():
            _checked(name, model, chosen, q, v, u)
        held = [_core.prescribed_by(model, chosen) for chosen in sets.values()]
        timed = [partial(_core.time_hybrid, model, mask, q, v, u) for mask in held]
        plain, *each = in_turn(seconds, partial(_core.time_forward, model, q, v, u), *timed, rounds=9)
        for what, taken in zip(sets, each, strict=True):
            text = f"{name}: hybrid dynamics over forward dynamics, {what} prescribed"
            figures.append(Figure(text, taken / plain, "x", HYBRID, f"{1e9 * taken:.0f} ns and {1e9 * plain:.0f} ns"))
    return figures
