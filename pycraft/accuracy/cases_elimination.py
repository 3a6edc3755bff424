"""What is eliminated over the tree, or asked of ℳ⁻¹ as a whole, in units where no number of the model is near one."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

import numpy as np

from .. import _core
from ..models.multibody import Multibody
from .bounds import at_most
from .catalogue import Case, MeasuredCase
from .chains import direction, solid

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


def cases() -> list[Case]:
    hard = "the ones of the resolvents stand beside inertias of any size: what a pivot is compared with must not hang on the units"
    bounds = (at_most(tuple(REQUESTS), "worst", "1e-12", 1e-12),)
    return [
        MeasuredCase(
            f"arm of pins and sliders: {name}",
            FAMILY,
            hard,
            {"N": LINKS, "mass": mass, "length": length},
            partial(_measure, mass, length),
            "relative error, largest entry",
            "the dense matrix in quad precision, equilibrated",
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
    """In the order of REQUESTS."""
    arm = _arm(mass, length, rng)
    arm.take_warnings()
    angles = rng.uniform(-np.pi, np.pi, LINKS)
    sliders = np.arange(LINKS) % 3 == 1
    q = np.where(sliders, length * angles, angles)
    H, phi, M = arm.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    exact = arm.mass_matrix(q, precision="quad")
    unit = np.sqrt(np.diag(exact))
    A = exact / np.outer(unit, unit)
    damping = DAMPING * np.diag(exact)
    damped = (MM + _core.constant(np.diag(damping), arm.soa.Theta, arm.soa.Theta, name="C")).at(q)
    Y, Y_damped = np.linalg.inv(A), np.linalg.inv(A + np.diag(damping / unit**2))
    x = rng.normal(size=LINKS)
    MM, at_rest, volume = MM.at(q), np.zeros(LINKS), 2 * np.log(unit).sum()
    J = np.asarray(arm.soa.Jacobian("tool").at(q).dense()) / unit  # of coordinates in their units; lengths come out below
    axes = np.repeat([1.0, length], 3)
    J /= axes[:, None]
    Lambda = np.linalg.inv(J @ Y @ J.T)
    pairs = [
        (unit * (damped.inv() @ (unit * x)), Y_damped @ x),
        (unit**2 * damped.inv().diagonal(), np.diag(Y_damped)),
        (float(damped.logdet()) - volume, np.linalg.slogdet(A + np.diag(damping / unit**2))[1]),
        (unit * arm.forward_dynamics(q, at_rest, unit * x, method="realization"), Y @ x),
        (unit**2 * MM.inv().diagonal(), np.diag(Y)),
        (float(MM.inv().trace()) / np.max(1 / unit**2), float(np.sum(np.diag(Y) / unit**2) / np.max(1 / unit**2))),
        (float(MM.logdet()) - volume, np.linalg.slogdet(A)[1]),
        (np.outer(axes, axes) * np.asarray(arm.soa.Lambda("tool").at(q).dense()), Lambda),
    ]
    return [float(np.max(np.abs(found - true)) / np.max(np.abs(true))) for found, true in pairs]
