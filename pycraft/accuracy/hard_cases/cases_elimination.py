"""Elimination over the tree, and requests of ℳ⁻¹ as a whole, in units where no value of the model is near one."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

import mpmath
import numpy as np

from ... import _core
from ...models.multibody import Multibody
from .case import Case, MeasuredCase
from .chains import direction, solid
from .shared_bounds import at_most

FAMILY = "elimination in any units"
UNITS = {
    "SI": (1.0, 1.0),
    "milligrams and micrometres": (1e6, 1e6),
    "MEMS in SI": (1e-12, 1e-6),
    "molecules in SI": (3e-26, 1e-10),
    "a hair of a millimetre in SI": (1e-9, 1e-3),
    "gigatonnes and kilometres in SI": (1e12, 1e3),
}
"""Mass and length of a body, in the model's units."""
LINKS = 6
DAMPING = 0.1
"""Of the diagonal of ℳ."""
DIGITS = 50
"""Of the references."""


def cases() -> list[Case]:
    hard = "the ones of the resolvents stand beside inertias of any size: what a pivot is compared with must not depend on the units"
    *others, Lambda = REQUESTS
    bounds = (
        at_most(tuple(others), "worst", "1e-12", 1e-12),
        # Λ comes from triangular factors, whose condition is the root of its own: eps √κ, κ to 2·10¹⁰ among the postures of 200 seeds.
        at_most((Lambda,), "worst", "1e-10", 1e-10),
    )
    return [
        MeasuredCase(
            f"arm of pins and sliders: {name}",
            FAMILY,
            hard,
            {"N": LINKS, "mass": mass, "length": length},
            partial(_measure, mass, length),
            "relative error, largest entry",
            "the dense matrix, inverted in 50 digits",
            bounds,
        )
        for name, (mass, length) in UNITS.items()
    ]


REQUESTS = ("(ℳ+C)⁻¹x", "diagonal of (ℳ+C)⁻¹", "ln det (ℳ+C)", 'method="realization"', "diagonal of ℳ⁻¹", "tr ℳ⁻¹", "ln det ℳ", "Λ")


def _measure(mass: float, length: float, seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    errors: dict[str, list[float]] = {name: [] for name in REQUESTS}
    for seed in seeds:
        for name, error in zip(REQUESTS, _errors(mass, length, np.random.default_rng(seed)), strict=True):
            errors[name].append(error)
    return {name: np.array(values) for name, values in errors.items()}


def _arm(mass: float, length: float, rng: np.random.Generator) -> Multibody:
    arm = Multibody("arm")
    for k in range(LINKS):
        body = solid(rng, 1.0, 0.3)
        inertia, com = mass * length**2 * np.asarray(body["inertia"]), length * np.asarray(body["com"])
        kind, parent = ("slider" if k % 3 == 1 else "pin"), f"link{k - 1}" if k else None
        position = length * rng.uniform(-1, 1, 3) if k else (0, 0, 0)
        arm.add_body(f"link{k}", parent, kind, axis=direction(rng), position=position, mass=mass, com=com, inertia=inertia)
    arm.add_node("tool", f"link{LINKS - 1}", position=length * rng.uniform(-1, 1, 3))
    return arm


def _errors(mass: float, length: float, rng: np.random.Generator) -> list[float]:
    """In the order of REQUESTS.

    The dense ℳ and 𝒥 are those of 50 digits and are inverted in as many: rounded to doubles they would take the condition of Λ, up to
    2e10 here, with them. A determinant has units: its logarithm is judged against the size of its terms, ln of them and what is left.
    """
    arm = _arm(mass, length, rng)
    arm.take_warnings()
    angles = rng.uniform(-np.pi, np.pi, LINKS)
    sliders = np.arange(LINKS) % 3 == 1
    q = np.where(sliders, length * angles, angles)
    H, phi, M = arm.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    diagonal = MM.at(q).diagonal()
    unit, damping = np.sqrt(diagonal), DAMPING * diagonal
    damped = (MM + _core.constant(np.diag(damping), arm.soa.Theta, arm.soa.Theta, name="C")).at(q)
    x = rng.normal(size=LINKS)
    axes = np.repeat([1.0, length], 3)
    with mpmath.workdps(DIGITS):
        exact = mpmath.matrix(MM.at(q, precision=DIGITS).dense(dtype=object).tolist())
        J = mpmath.matrix(arm.soa.Jacobian("tool").at(q, precision=DIGITS).dense(dtype=object).tolist())
        A, A_damped = exact, exact + mpmath.diag(damping.tolist())
        Y, Y_damped = A**-1, A_damped**-1
        force = mpmath.matrix((unit * x).tolist())
        Lambda = (J * Y * J.T) ** -1
        diagonals = [[matrix[i, i] for i in range(LINKS)] for matrix in (Y, Y_damped)]
        true: list[Any] = [
            _numbers(unit, Y_damped * force),
            _numbers(unit**2, diagonals[1]),
            float(mpmath.log(mpmath.det(A_damped))),
            _numbers(unit, Y * force),
            _numbers(unit**2, diagonals[0]),
            float(mpmath.fsum(diagonals[0])),
            float(mpmath.log(mpmath.det(A))),
            np.array([[float(Lambda[i, j]) * axes[i] * axes[j] for j in range(6)] for i in range(6)]),
        ]
    MM, at_rest = MM.at(q), np.zeros(LINKS)
    found: list[Any] = [
        unit * (damped.inv() @ (unit * x)),
        unit**2 * damped.inv().diagonal(),
        float(damped.logdet()),
        unit * arm.forward_dynamics(q, at_rest, unit * x, method="realization"),
        unit**2 * MM.inv().diagonal(),
        float(MM.inv().trace()),
        float(MM.logdet()),
        np.outer(axes, axes) * np.asarray(arm.soa.Lambda("tool").at(q).dense()),
    ]
    sizes = [np.max(np.abs(value)) for value in true]
    for i in (2, 6):
        sizes[i] += 2 * np.abs(np.log(unit)).sum()
    return [float(np.max(np.abs(value - exactly)) / size) for value, exactly, size in zip(found, true, sizes, strict=True)]


def _numbers(units: np.ndarray, values: Iterable[mpmath.mpf]) -> np.ndarray:
    return np.array([float(unit * value) for unit, value in zip(units.tolist(), values, strict=True)])
