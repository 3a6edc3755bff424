"""Closures that open and close in a motion, by augmentation and by embedding: a falling chain is caught on a floor and let go."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from ...models import linkages
from ...models.multibody import Multibody
from .case import Bound, Case, MeasuredCase

G, FLOOR = 9.81, 1.6
SLIDES, FALLS = 0.2, 0.3
"""s, held on the floor and after it."""
TOLERANCE = 1e-12
METHODS = ("augment", "embed")
CONFIRMED = 1e-8
"""To which two methods agree on a reference, relative: a multistep method of SciPy leaves some thousand times its tolerance."""
Rates = Callable[[float, np.ndarray], np.ndarray]


def cases() -> list[Case]:
    """The catalogue's own."""
    return [
        MeasuredCase(
            f"a chain is caught on a floor and let go, second rod {ratio:g} times the first",
            "loops",
            "a loop closes in a motion by an impulse, is kept, and opens again",
            {"N": 2, "ratio": ratio},
            partial(_measure, ratio),
            "error of the last state, beside 1 rad or the fastest rate",
            "two angles by hand, DOP853 at 1e-13",
            (Bound(METHODS, "worst", f"1e3 tolerances of a step, {1e3 * TOLERANCE:g}", lambda m: 1e3 * TOLERANCE),),
            "docs/loops.md",
        )
        for ratio in (1e-6, 1.0, 1e6)
    ]


def drawn(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Angles of both rods from x, and their rates: the tip starts above the floor and falls through it."""
    return np.array([-0.6, -0.4]) + rng.uniform(-0.1, 0.1, 2), rng.uniform(-0.5, 0.5, 2)


def chain(ratio: float) -> Multibody:
    """Two rods of 1 m, the first of 1 kg, in gravity along -y, the tip a node."""
    model = Multibody("chain")
    model.add_body("first", axis=(0, 0, 1), **linkages.rod())
    model.add_body("second", "first", axis=(0, 0, 1), position=(1, 0, 0), **linkages.rod(mass=ratio))
    model.add_node("tip", "second", position=(1, 0, 0))
    model.gravity = (0, -G, 0)
    return model


def close_on_floor(model: Multibody) -> Any:
    """The tip stays on y = -FLOOR."""
    return model.add_surface("tip", b=(0, 1, 0), c=FLOOR, name="floor")


def _measure(ratio: float, seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:  # noqa: ARG001 - as all cases are called
    found: dict[str, list[float]] = {method: [] for method in METHODS}
    for seed in seeds:
        start = drawn(np.random.default_rng(seed))
        exact = by_hand(ratio, *start)
        for method in METHODS:
            found[method].append(float(np.abs(_by_model(ratio, *start, method) - exact).max() / max(1.0, np.abs(exact).max())))
    return {method: np.array(errors) for method, errors in found.items()}


def _by_model(ratio: float, angles: np.ndarray, rates: np.ndarray, method: str) -> np.ndarray:
    """The loop is declared where the tip meets the floor, and taken away after SLIDES."""
    model = chain(ratio)
    to_hinges, back = np.array([[1, 0], [-1, 1]]), np.array([[1, 0], [1, 1]])

    def free(t: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[2:], model.forward_dynamics(x[:2], x[2:], np.zeros(2))])

    def kept(t: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[2:], model.constrained_dynamics(x[:2], x[2:], method=method).vdot])

    def over(t: float, x: np.ndarray) -> float:
        return float(np.sin(x[0]) + np.sin(x[0] + x[1]) + FLOOR)

    x = _run(free, np.concatenate([to_hinges @ angles, to_hinges @ rates]), until=over, tolerance=TOLERANCE)
    close_on_floor(model)
    x[2:] = model.constrained_velocities(x[:2], x[2:]).v
    x = _run(kept, x, SLIDES, tolerance=TOLERANCE)
    model.loops.remove("floor")
    x = _run(free, x, FALLS, tolerance=TOLERANCE)
    return np.concatenate([back @ x[:2], back @ x[2:]])


def by_hand(ratio: float, angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """The same motion by the equations of two angles from x: angles and rates at its end. Nothing of it is the package's.

    T = ½ (1/3 + m) α̇² + ½ m/3 β̇² + ½ m cos(α - β) α̇β̇,   V = g (½ sin α + m (sin α + ½ sin β)),   r = sin α + sin β + h
    """
    m = ratio

    def mass(x: np.ndarray) -> np.ndarray:
        mixed = m / 2 * np.cos(x[0] - x[1])
        return np.array([[1 / 3 + m, mixed], [mixed, m / 3]])

    def force(x: np.ndarray) -> np.ndarray:
        s = m / 2 * np.sin(x[0] - x[1])
        return -np.array([s * x[3] ** 2 + G * (0.5 + m) * np.cos(x[0]), -s * x[2] ** 2 + G * m / 2 * np.cos(x[1])])

    def row(x: np.ndarray) -> np.ndarray:
        return np.cos(x[:2])

    def free(t: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[2:], np.linalg.solve(mass(x), force(x))])

    def kept(t: float, x: np.ndarray) -> np.ndarray:
        A, Q = np.linalg.inv(mass(x)), row(x)
        bias = -np.sin(x[:2]) @ x[2:] ** 2
        pull = -(Q @ A @ force(x) + bias) / (Q @ A @ Q)
        return np.concatenate([x[2:], A @ (force(x) + Q * pull)])

    def over(t: float, x: np.ndarray) -> float:
        return float(np.sin(x[:2]).sum() + FLOOR)

    x = _run(free, np.concatenate([angles, rates]), until=over)
    A, Q = np.linalg.inv(mass(x)), row(x)
    x[2:] -= A @ Q * (Q @ x[2:]) / (Q @ A @ Q)
    return _run(free, _run(kept, x, SLIDES), FALLS)


def _run(rates: Rates, x: np.ndarray, T: float = 5.0, until: Any = None, tolerance: float = 1e-13) -> np.ndarray:
    """The state after T, or where `until` is first zero, by a Runge-Kutta method. RuntimeError where a multistep method differs."""
    from scipy.integrate import solve_ivp

    if until is not None:
        until.terminal = True
    ends = []
    for method, allowed in (("DOP853", tolerance), ("LSODA", 10 * tolerance)):
        run = solve_ivp(rates, (0.0, T), x, method=method, rtol=allowed, atol=allowed, events=until)
        if until is not None and not len(run.t_events[0]):
            raise RuntimeError(f"the tip does not meet the floor within {T:g} s")
        ends.append(np.array(run.y[:, -1]))
    apart = np.abs(ends[1] - ends[0]).max() / max(1.0, np.abs(ends[0]).max())
    if not apart < CONFIRMED:
        raise RuntimeError(f"the reference is not confirmed: DOP853 and LSODA differ by {apart:.1e}")
    return ends[0]
