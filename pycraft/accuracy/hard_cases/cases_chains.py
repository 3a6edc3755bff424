"""Chains of N uniform rods: stretched, where cond ℳ grows as 4 N⁴, and curled; and under gravity."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from .case import SINGLE_MAY_REFUSE, Bound, Case, DynamicsCase, Rung, Sample
from .chains import rods
from .shared_bounds import FLOOR, ONE, ROUNDING, WITHIN_PEERS

FAMILY = "uniform chains"
TURN = 2.5
"""Radians between the rods of a curled chain: it stays within two rods of its base."""


def cases(sizes: Sequence[int]) -> list[Case]:
    out: list[Case] = []
    for n in sizes:
        out += [_chain(n, curled=False, first=False), _chain(n, curled=False, first=True), _chain(n, curled=True, first=False)]
    out += [_hanging(n) for n in sizes if n in (16, 64, 128, 1024)]
    return out


def _chain(n: int, curled: bool, first: bool) -> DynamicsCase:
    shape = "curled" if curled else "stretched"
    return DynamicsCase(
        name=f"{n} rods {shape}, " + ("T = ℳe₁" if first else "random T"),
        family=FAMILY,
        hard="all rods bend as one: cond ℳ ≈ 4N⁴" if not curled else "long, and coiled up within two rods of its base",
        parameters={"N": n, "shape": shape, "T": "ℳe₁" if first else "random"},
        draw=partial(_draw, n, curled, first),
        bounds=((ONE,) if curled else FLOOR) + WITHIN_PEERS,
        source="cond ℳ of uniform planar rods; floor of refinement",
        verdict=SINGLE_MAY_REFUSE,
        floor=True,
        models=4,
    )


def _draw(n: int, curled: bool, first: bool, rng: np.random.Generator, count: int) -> Sample:
    """One q for all states, the first angle random; T = ℳe₁ up to a random factor, rounded."""
    model = rods(n)
    q = np.full(n, TURN if curled else 0.0)
    q[0] = rng.uniform(-np.pi, np.pi)
    if first:
        column = model.inverse_dynamics(q, np.zeros(n), np.eye(n)[0], precision="quad")
        tau = rng.uniform(0.5, 2.0, (count, 1)) * column
    else:
        tau = rng.normal(size=(count, n))
    return Sample(model, np.tile(q, (count, 1)), np.zeros((count, n)), tau)


def _hanging(n: int) -> DynamicsCase:
    """Gravity as the base's acceleration, inside the sweep, against a solve of T - 𝒢: there two large numbers cancel."""
    return DynamicsCase(
        name=f"{n} rods stretched, released under gravity",
        family=FAMILY,
        hard="gravity forces grow as N² and must cancel in ℳ⁻¹(T - 𝒢)",
        parameters={"N": n, "shape": "stretched", "T": "0", "gravity": 9.81},
        draw=partial(_released, n),
        bounds=(
            *ROUNDING,
            Bound(("fast",), "p95", "ℳ⁻¹(T - 𝒢) / 100", lambda m: np.maximum(m.errors["ℳ⁻¹(T - 𝒢)"] / 100, 10 * m.eps)),
        ),
        rungs=(Rung("fast"), Rung("fast", refine=1), Rung("ud"), Rung("square-root"), Rung("fast", precision="extended")),
        extra={"ℳ⁻¹(T - 𝒢)": _outside},
        source="gravity inside the sweep",
        models=4,
    )


def _released(n: int, rng: np.random.Generator, count: int) -> Sample:
    model = rods(n)
    model.gravity = (0.0, -9.81, 0.0)
    q = np.zeros((count, n))
    q[:, 0] = rng.uniform(-1.0, 1.0, count)
    return Sample(model, q, np.zeros((count, n)), np.zeros((count, n)))


def _outside(sample: Sample) -> np.ndarray:
    """ℳ⁻¹(T - 𝒢) by two calls: forward dynamics without gravity, of the forces that gravity leaves."""
    model = sample.model
    tau = sample.tau - model.bias_forces(sample.q, sample.v)
    gravity = model.gravity
    try:
        model.gravity = (0.0, 0.0, 0.0)
        return model.forward_dynamics(sample.q, np.zeros_like(sample.v), tau)
    finally:
        model.gravity = gravity
