"""Residuals less accurate than the value that they should correct; and factors with an accurate D but an inaccurate G.

A satellite's bus moves at kilometres per second with links of grams on it, and cancelling forces leave almost no acceleration:
refinement must not make the value worse. A thin rod askew on a ball hinge has an inertia about itself that vanishes
relative to mc²: the answer must be accurate, or refused.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ...models.multibody import Multibody
from .case import EITHER, FORMS, REFINEMENTS, RUNGS, Bound, Case, DynamicsCase, Measured, Rung, Sample
from .chains import direction, solid, states
from .shared_bounds import at_most

FAMILY = "refinement"
WORSE = 3.0
"""Times the unrefined error: as far as a refined value may be off."""


def cases() -> list[Case]:
    out: list[Case] = []
    for speed in (100.0, 7700.0):
        hard = "forces of mv²/r per metre cancel in the residual, and leave 16 digits less than they have"
        out.append(_case(f"links of 50 g on a bus of 2 t at {speed:g} m/s", hard, partial(_bus, speed), {"N": 4, "speed": speed}))
    out.append(_case("six links held still, or nearly", "forces leave accelerations of 1e-12", _held, {"N": 6}))
    for share in (1e-10, 1e-14, 1e-18, 1e-26):
        out.append(
            DynamicsCase(
                f"a rod askew on a ball hinge on a carriage, own inertia {share:.0e} mc²",
                FAMILY,
                "what the carriage's motion makes of the rod's spin is a difference of terms 1/share times larger",
                {"N": 2, "share": share},
                partial(_rod, share),
                (at_most(tuple(rung.label for rung in RUNGS if rung.precision != "single"), "worst", "0.5", 0.5),),
                "bound on G of a factored form",
                verdict={rung.label: EITHER for rung in RUNGS},
                models=4,
                peers=False,
            )
        )
    return out


def _case(name: str, hard: str, draw: Callable[[np.random.Generator, int], Sample], parameters: dict[str, float]) -> DynamicsCase:
    bounds = []
    for form in FORMS:
        ways = tuple(Rung(form, **options).label for options in REFINEMENTS if options)
        bounds.append(Bound(ways, "worst", "3 × unrefined, or 100 eps √N", partial(_not_worse, form)))
    return DynamicsCase(name, FAMILY, hard, parameters, draw, tuple(bounds), "refinement bounded along the correction",
                        verdict={rung.label: EITHER for rung in RUNGS if rung.precision == "single"}, models=4, peers=False)  # fmt: skip


def _not_worse(form: str, measured: Measured) -> np.ndarray:
    return np.maximum(WORSE * measured.errors[form], 100 * measured.eps * np.sqrt(measured.N))


def _bus(speed: float, rng: np.random.Generator, count: int) -> Sample:
    model = Multibody("bus with three light links")
    model.add_body("bus", None, "free", **solid(rng, 2000.0))
    for k in range(3):
        model.add_body(f"link{k}", f"link{k - 1}" if k else "bus", "pin", axis=direction(rng), position=0.5 * rng.normal(size=3),
                       **solid(rng, 0.05, 0.1))  # fmt: skip
    q, v = states(model, rng, count)
    v = 0.1 * v
    v[:, 3:6] = [speed * direction(rng) for _ in range(count)]
    return Sample(model, q, v, 0.01 * rng.normal(size=v.shape))


def _held(rng: np.random.Generator, count: int) -> Sample:
    model = Multibody("six links")
    model.gravity = (0.0, 0.0, -9.81)
    for k in range(6):
        model.add_body(f"link{k}", f"link{k - 1}" if k else None, "pin", axis=direction(rng), position=rng.normal(size=3), **solid(rng))
    q, v = states(model, rng, count)
    return Sample(model, q, v, model.inverse_dynamics(q, v, 1e-12 * rng.normal(size=v.shape), precision="quad"))


def _rod(share: float, rng: np.random.Generator, count: int) -> Sample:
    model = Multibody("rod on a carriage")
    axis = direction(rng)
    inertia = share * (0.5 * np.eye(3) + 0.5 * np.outer(axis, axis))
    model.gravity = (0.0, 0.0, -9.81)
    model.add_body("carriage", None, "free", **solid(rng))
    model.add_body("rod", "carriage", "ball", position=rng.normal(size=3), mass=1.0, com=axis, inertia=(inertia + inertia.T) / 2)
    q, v = states(model, rng, count)
    return Sample(model, q, 0 * v, rng.normal(size=v.shape))
