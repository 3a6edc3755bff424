"""What dynamics on loops costs (`pycraft bench`): how it grows with the number of loops, which stand apart or in one ladder."""

from __future__ import annotations

import math
import time

import numpy as np

from .. import _core
from ..models.linkages import n_four_bar, rod
from ..models.multibody import Multibody
from .bench import Figure

SIZES = (30, 300)
GROWTH = 1.1
"""Exponent of the time over a tenfold of loops: one, and what larger models lose in caches."""


def ladder(rungs: int) -> Multibody:
    """Cranks on the ground, each joined to the next by a rod: every loop shares its cranks with its neighbours."""
    model = n_four_bar(rungs)
    model.gravity = (0, -9.81, 0)
    return model


def apart(loops: int) -> Multibody:
    """Four-bars beside each other."""
    model = Multibody(f"{loops} four-bars")
    for i in range(loops):
        inboard = None
        for j in range(3):
            model.add_body(f"rod{i}.{j}", inboard, position=(0, 0, i) if j == 0 else (1, 0, 0), **rod())
            inboard = f"rod{i}.{j}"
        model.add_loop(model.add_node(f"end{i}", inboard, position=(1, 0, 0)), hinge="pin", position=(0, 0, i), name=f"loop{i}")
    model.gravity = (0, -9.81, 0)
    return model


def _seconds(model: Multibody, q: np.ndarray, expected: float, rounds: int) -> float:
    """The least of some rounds; the cranks' accelerations are known."""
    v, times = np.zeros(model.nv), []
    for _ in range(rounds):
        begin = time.perf_counter()
        vdot = model.constrained_dynamics(q, v).vdot
        times.append(time.perf_counter() - begin)
        if not abs(vdot[0] - expected) <= 1e-9 * abs(expected):
            raise _core.EvaluationError(f"'{model.name}' does not move as it should, in the run that times it")
    return min(times)


def loops(rounds: int = 10) -> list[Figure]:
    """Exponents of the time of `constrained_dynamics` from some loops to ten times as many."""
    angle, figures = 1.0, []
    for name, make in (("ladder", ladder), ("four-bars apart", apart)):
        times = []
        for n in SIZES:
            model = make(n)
            if make is ladder:  # cranks and rods of 1 kg and 1 m: (n+1)/3 + n of inertia, (n+1)/2 + n of weight
                q = np.array([angle, -angle] * n + [angle])
                expected = -9.81 * math.cos(angle) * ((n + 1) / 2 + n) / ((n + 1) / 3 + n)
            else:
                q, expected = np.tile([angle, -angle, angle - math.pi], n), -1.2 * 9.81 * math.cos(angle)
            times.append(_seconds(model, q, expected, rounds))
        growth = math.log(times[1] / times[0]) / math.log(SIZES[1] / SIZES[0])
        told = f"{1e6 * times[0]:.0f} to {1e6 * times[1]:.0f} µs"
        figures.append(Figure(f"dynamics on loops, {name}, {SIZES[0]} to {SIZES[1]}", growth, "", GROWTH, told))
    return figures
