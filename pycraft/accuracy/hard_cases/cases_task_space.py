"""Operational-space inertias near singular poses: a wrist whose fourth and sixth axis nearly coincide."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

import mpmath
import numpy as np

from .case import Bound, Case, Measured, MeasuredCase
from .chains import wrist

FAMILY = "task space near singular poses"
DISTANCES = (1e-1, 1e-3, 1e-5)
"""Of the fifth angle from where the wrist loses a direction, rad. Much nearer Λ⁻¹ has no digit along it."""
TIP = "link5"
DIGITS = 50
"""Of the references."""
FAST, FACTORED = "fast", ("ud", "square-root")
EXTENDED, DIRECTIONS, INVERTED = "fast, extended", "task_space(...).inertia", "Λ⁻¹, inverted"


def cases() -> list[Case]:
    """Λ grows as distance⁻² along what is nearly lost.

    Axes are rounded by eps, which moves the distance by eps / distance of it: no way can keep more than that leaves. By inverting Λ⁻¹,
    whose smallest part is rounded beside its largest, it is eps / distance². The factor is the condition that is left, of the arm beside
    its wrist. "fast" is that inverse, too, where no direction is short of its own compliance by more than 2⁻¹⁴.
    """
    least, inverse = lambda m: 1000 * m.eps / m.parameters["distance"], lambda m: 1000 * m.eps / m.parameters["distance"] ** 2
    bounds = (
        Bound((*FACTORED, DIRECTIONS), "worst", "1000 eps / distance", least),
        Bound((FAST,), "worst", "2¹⁴ eps / distance", lambda m: 2**14 * m.eps / m.parameters["distance"]),
        Bound((INVERTED,), "p95", "1000 eps / distance²", inverse),
        Bound((EXTENDED,), "worst", "eps, or 1000 eps of extended / distance", _of_extended),
    )
    return [
        MeasuredCase(
            f"Λ of a wrist {distance:g} rad from its singularity",
            FAMILY,
            "Λ grows as distance⁻² along the direction that is nearly lost",
            {"N": 6, "distance": distance},
            partial(_measure, distance),
            "relative error of Λ, largest entry",
            f"the dense matrix, inverted in {DIGITS} digits",
            bounds,
            "operational space near singular poses",
        )
        for distance in DISTANCES
    ]


def _of_extended(measured: Measured) -> float:
    return max(measured.eps, 1000 * float(np.finfo(np.longdouble).eps) / measured.parameters["distance"])


def _measure(distance: float, seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    errors: dict[str, list[float]] = {}
    for seed in seeds:
        for name, error in _errors(distance, np.random.default_rng(seed)).items():
            errors.setdefault(name, []).append(error)
    return {name: np.array(values) for name, values in errors.items()}


def _errors(distance: float, rng: np.random.Generator) -> dict[str, float]:
    arm = wrist(1.0, rng)
    q = rng.uniform(-np.pi, np.pi, 6)
    q[2], q[4] = rng.choice([-1, 1]) * rng.uniform(0.5, 2.5), distance  # the elbow is bent
    with mpmath.workdps(DIGITS):
        M = mpmath.matrix(arm.soa.MM.at(q, precision=DIGITS).dense(dtype=object).tolist())
        J = mpmath.matrix(arm.soa.Jacobian(TIP).at(q, precision=DIGITS).dense(dtype=object).tolist())
        exact = np.array(((J * M**-1 * J.T) ** -1).tolist(), float)
    found: dict[str, Any] = {form: arm.operational_space_inertia(TIP, q, form=form) for form in (FAST, *FACTORED)}
    found[EXTENDED] = arm.operational_space_inertia(TIP, q, precision="extended")
    found[DIRECTIONS] = arm.task_space(TIP, q).inertia
    found[INVERTED] = np.linalg.inv(arm.operational_space_compliance(TIP, q))
    return {name: float(np.abs(value - exact).max() / np.abs(exact).max()) for name, value in found.items()}
