"""Chains for the hard cases. Inertias are exactly symmetric: otherwise a rounding error of asymmetry would dominate the measurement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...models.multibody import Multibody

SHAPE = np.array([[0.2, 0.01, 0.0], [0.01, 0.18, 0.01], [0.0, 0.01, 0.08]])
"""A link's inertia about its centre of mass, in units of its mass times its length squared."""

OFFSET, CENTRE = np.array([0.2, 0.1, 1.0]), np.array([0.1, 0.05, 0.5])
"""Places of the next hinge and of the centre of mass, in units of the length."""


def links(masses: Sequence[float], lengths: Sequence[float], rng: np.random.Generator, axes: str = "random") -> Multibody:
    """A chain of solid links on pins: axes uniform on the sphere, "coordinate": along y, x, z in turn, "parallel": all along z."""
    model = Multibody(f"chain of {len(masses)} links")
    for k, (mass, length) in enumerate(zip(masses, lengths, strict=True)):
        axis = rng.normal(size=3) if axes == "random" else np.eye(3)[2 if axes == "parallel" else (1, 0, 2)[k % 3]]
        model.add_body(
            f"link{k}", f"link{k - 1}" if k else None, "pin", hinge_name=f"hinge{k}", axis=axis / np.linalg.norm(axis),
            position=OFFSET * lengths[k - 1] if k else (0, 0, 0), mass=mass, com=CENTRE * length, inertia=mass * length**2 * SHAPE,
        )  # fmt: skip
    return model


def rods(n: int, length: float = 1 / 3, mass: float = 0.7) -> Multibody:
    """n uniform cylinders along x, a hundredth as thick as they are long, on parallel pins: a planar chain."""
    model = Multibody(f"chain of {n} rods")
    across, along = mass * length**2 * (3 * 0.005**2 + 1) / 12, mass * (0.005 * length) ** 2 / 2
    for k in range(n):
        model.add_body(
            f"rod{k}", f"rod{k - 1}" if k else None, "pin", hinge_name=f"hinge{k}", position=(length, 0, 0) if k else (0, 0, 0),
            mass=mass, com=(length / 2, 0, 0), inertia=np.diag([along, across, across]),
        )  # fmt: skip
    return model


def solid(rng: np.random.Generator, mass: float = 1.0, size: float = 1.0) -> dict[str, Any]:
    """Mass, centre of mass and inertia of a random body of about that size."""
    points = size * rng.normal(size=(6, 3))
    points -= points.mean(axis=0)
    inertia = mass / 6 * (np.sum(points * points) * np.eye(3) - points.T @ points)
    return dict(mass=mass, com=0.3 * size * rng.normal(size=3), inertia=(inertia + inertia.T) / 2)


def direction(rng: np.random.Generator) -> np.ndarray:
    """A unit vector, uniform on the sphere."""
    x = rng.normal(size=3)
    return x / np.linalg.norm(x)


def wrist(mass: float, rng: np.random.Generator) -> Multibody:
    """Six pins, the last three axes through a point, the fourth and sixth in one line at q[4] = 0; that mass between them."""
    model = Multibody("arm with a spherical wrist")
    skew = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axes = [skew @ axis for axis in np.array([(0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0)], float)]
    offsets = [(0, 0, 0), (0, 0.1, 0.3), (0.1, 0, 0.4), (0, 0, 0.4), (0, 0, 0), (0, 0, 0)]
    masses = [5.0, 4.0, 3.0, 1.0, mass, 1.0]
    for k in range(6):
        model.add_body(f"link{k}", f"link{k - 1}" if k else None, axis=axes[k], position=offsets[k], **solid(rng, masses[k], 0.1))
    return model


def states(model: Multibody, rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """q (count, nq) and v (count, nv) of random states, see `Multibody.random_state`."""
    drawn = [model.random_state(rng) for _ in range(count)]
    return np.array([state.q for state in drawn]), np.array([state.v for state in drawn])
