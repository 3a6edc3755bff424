"""Hard configurations: coincident axes, rotations far from identity, quaternions of any length, many turns."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...models.generators import tree
from ...models.multibody import Multibody
from .case import EITHER, EVERY_DOUBLE, REFUSED, RUNGS, SINGLE_MAY_REFUSE, Bound, Case, DynamicsCase, Rung, Sample
from .chains import direction, links, solid, states, wrist
from .shared_bounds import ROUNDING, WITHIN_PEERS

FAMILY = "configurations"
KINDS = ("ball", "free", "pin", "ball", "universal", "free")
"""Hinges of the trees whose rotations are drawn uniformly."""


def cases() -> list[Case]:
    out: list[Case] = [_gimbal(0.0)]
    out += [_gimbal(off) for off in (1e-2, 1e-4, 1e-6)]
    out += [_wrist(mass) for mass in (1.0, 1e-3, 1e-6)]
    out += [_parallel(mass) for mass in (1.0, 1e-3, 1e-6, 1e-9)]
    out.append(_rotations("ball and free hinges, rotations uniform", "half of them turned by more than 2 rad", 1.0, 0.0))
    out.append(_rotations("ball and free hinges, turned by π", "w = 0: the far side of the double cover", 1.0, np.pi))
    for length in (1e-7, 1e-3, 3.7, 1e6, 1e150):
        out.append(_rotations(f"quaternions of length {length:g}", "a quaternion means its direction: it is used as q/|q|", length, 0.0))
    out.append(_rotations("quaternions of length 1e+200", "|q|² overflows", 1e200, 0.0))
    for turns, name in ((1e6, "1e6 turns"), (1e8 / (2 * np.pi), "angles of 1e8 rad")):
        out.append(_turned(name, turns))
    return out


# Coincident axes ------------------------------------------------------------------------------------------------------


def _gimbal(off: float) -> DynamicsCase:
    """Outer and inner axis coincide at ±90 degrees: one pivot of D goes with the square of the distance."""
    singular = off == 0
    bounds: tuple[Bound, ...] = ()
    if not singular:
        bounds = (
            Bound(EVERY_DOUBLE, "p95", "20 eps / distance²", lambda m: 20 * m.eps / off**2),
            Bound(("ud", "square-root"), "p95", "20 eps / distance", lambda m: 20 * m.eps / off),
            *WITHIN_PEERS,
        )
    verdict: str | dict[str, str] = dict(SINGLE_MAY_REFUSE)
    if singular:
        # π/2 as a double is 6e-17 away from the singularity: too near for all but `ud` in extended precision.
        verdict = {rung.label: REFUSED for rung in RUNGS} | {Rung("ud", precision="extended").label: EITHER}
    elif off < 1e-5:
        verdict = {rung.label: EITHER for rung in RUNGS if rung.precision in ("single",)}
    return DynamicsCase(
        "gimbal at its singularity" if singular else f"gimbal {off:g} rad from its singularity",
        FAMILY,
        "outer and inner axis coincide: a direction without a coordinate, and a pivot that goes with the square of the distance",
        {"N": 2, "distance": off},
        partial(_draw_gimbal, off),
        bounds,
        "Euler angles at 90 degrees",
        verdict=verdict,
        fault="gimbal" if singular else "",
    )


def _draw_gimbal(off: float, rng: np.random.Generator, count: int) -> Sample:
    model = Multibody("body on a gimbal")
    model.add_body("arm", axis=direction(rng), **solid(rng))
    model.add_body("body", "arm", "gimbal", hinge_name="gimbal", position=(0.3, 0.2, 1.0), **solid(rng))
    q, v = states(model, rng, count)
    q[:, 2] = np.where(rng.random(count) < 0.5, 1, -1) * (np.pi / 2 - off)
    return Sample(model, q, v, rng.normal(size=v.shape))


def _wrist(mass: float) -> DynamicsCase:
    """Axes 4 and 6 coincide; the link between them has the given mass, and that of its size."""
    return DynamicsCase(
        f"wrist at its singularity, middle link {mass:g} kg",
        FAMILY,
        "the fourth and the sixth axis coincide, with a small link between them",
        {"N": 6, "mass": mass},
        partial(_draw_wrist, mass),
        ROUNDING,
        "spherical wrists",
        verdict=SINGLE_MAY_REFUSE,
    )


def _draw_wrist(mass: float, rng: np.random.Generator, count: int) -> Sample:
    model = wrist(mass, rng)
    q, v = states(model, rng, count)
    q[:, 4] = 0.0
    return Sample(model, q, v, rng.normal(size=v.shape))


def _parallel(mass: float) -> DynamicsCase:
    """Two pins on one line: one acceleration for the link between them and one for their sum."""
    return DynamicsCase(
        f"two parallel pins at one point, link between them {mass:g} kg",
        FAMILY,
        "two pins on one line with next to nothing between them",
        {"N": 3, "mass": mass},
        partial(_draw_parallel, mass),
        (
            Bound(EVERY_DOUBLE, "p95", "20 eps / mass", lambda m: 20 * m.eps / mass),
            Bound(("ud",), "worst", "1e-12", lambda m: 1e-12),
            *WITHIN_PEERS,
        ),
        "coaxial pins",
        verdict=SINGLE_MAY_REFUSE,
    )


def _draw_parallel(mass: float, rng: np.random.Generator, count: int) -> Sample:
    model = Multibody("coaxial pins")
    axis, point = direction(rng), rng.uniform(-0.5, 0.5, 3)
    model.add_body("arm", axis=direction(rng), **solid(rng))
    model.add_body("between", "arm", axis=axis, point=point, position=(0.5, 0.2, 0), **solid(rng, mass))
    model.add_body("outer", "between", axis=axis, point=point, **solid(rng))
    q, v = states(model, rng, count)
    return Sample(model, q, v, rng.normal(size=v.shape))


# Rotations ------------------------------------------------------------------------------------------------------------


def _rotations(name: str, hard: str, length: float, turned: float) -> DynamicsCase:
    """A tree of balls and free hinges, with quaternions of that length, and turned by that angle where it is not zero."""
    return DynamicsCase(
        name,
        FAMILY,
        hard,
        {"N": len(KINDS), "length": length},
        partial(_draw_rotations, length, turned),
        ROUNDING,
        "ruling on quaternions: used as q/|q|, never rewritten",
        verdict={rung.label: EITHER for rung in RUNGS if rung.precision == "single" or length > 1e150},
    )


def _draw_rotations(length: float, turned: float, rng: np.random.Generator, count: int) -> Sample:
    model = tree([-1, 0, 0, 1, 2, 3], KINDS, seed=int(rng.integers(2**31)))
    q, v = states(model, rng, count)
    for hinge in model.hinges.values():
        if hinge.kind in ("ball", "free"):
            at = slice(hinge.q_slice.start, hinge.q_slice.start + 4)
            if turned:
                axes = rng.normal(size=(count, 3))
                axes /= np.linalg.norm(axes, axis=1, keepdims=True)
                q[:, at] = np.c_[np.full(count, np.cos(turned / 2)), np.sin(turned / 2) * axes]
            q[:, at] *= length
    return Sample(model, q, v, rng.normal(size=v.shape))


def _turned(name: str, turns: float) -> DynamicsCase:
    """Sine and cosine of large arguments: the angle is the double it is, so nothing may be lost."""
    return DynamicsCase(
        f"10 links after {name}",
        FAMILY,
        "sine and cosine of large arguments; the angle is the double it is, and no digit may go",
        {"N": 10, "turns": turns},
        partial(_draw_turned, turns),
        ROUNDING,
        "argument reduction",
        verdict={rung.label: EITHER for rung in RUNGS if rung.precision == "single"},
        rungs=tuple(r for r in RUNGS if r.precision != "single"),
    )


def _draw_turned(turns: float, rng: np.random.Generator, count: int) -> Sample:
    model = links([1.0] * 10, [0.3] * 10, rng)
    q, v = states(model, rng, count)
    return Sample(model, q + 2 * np.pi * turns, v, rng.normal(size=v.shape))
