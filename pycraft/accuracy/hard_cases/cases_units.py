"""Extreme magnitudes: far from the origin, tiny and huge units, denormal numbers, odd inertias."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ...models.multibody import Multibody
from .case import EITHER, EVERY_DOUBLE, RUNGS, SINGLE_MAY_REFUSE, Bound, Case, DynamicsCase, Sample
from .chains import SHAPE, direction, links, solid, states
from .shared_bounds import ROUNDING, WITHIN_PEERS

FAMILY = "magnitudes and inertias"
NOT_SINGLE = tuple(rung for rung in RUNGS if rung.precision != "single")
"""Seven digits and 38 decades hold none of these."""


def cases() -> list[Case]:
    far = "only differences of positions matter: packages that work in world axes lose eight digits"
    out: list[Case] = [
        _case("arm on a base 1e8 m away", far, 6, partial(_far, False), ROUNDING),
        _case("free body with an arm, 1e8 m away", far, 6, partial(_far, True), ROUNDING),
        _case("grams and micrometres", "no number of the model is near one", 6, partial(_scaled, 1e-12, 1e-6), ROUNDING),
        _case("earths and megametres", "no number of the model is near one", 6, partial(_scaled, 6e24, 1e6), ROUNDING),
        _case(
            "masses of 1e-150 kg, lengths of 1e-30 m",
            "inertias at 1e-210, and torques to match",
            6,
            partial(_scaled, 1e-150, 1e-30),
            ROUNDING,
        ),
    ]
    for name, which in (("torques", "tau"), ("velocities", "v"), ("angles", "q")):
        hard = f"{name} of 1e-310: below the normal numbers, where rounding is absolute"
        out.append(_case(f"denormal {name}", hard, 6, partial(_denormal, which), _denormal_bounds(which)))
    for lever in (1e3, 1e6):
        out.append(_lever(lever, "pin"))
        out.append(_lever(lever, "free"))
    for thin in (1e-6, 1e-12):
        out.append(_needle(thin))
    out += [_flat(slack) for slack in (0.0, 1e-12, -1e-3)]
    return out


def _case(name: str, hard: str, n: int, draw: Callable[..., Sample], bounds: tuple[Bound, ...], **parameters: Any) -> DynamicsCase:
    return DynamicsCase(name, FAMILY, hard, {"N": n} | parameters, draw, bounds, "", rungs=NOT_SINGLE, verdict=SINGLE_MAY_REFUSE)


def _far(free: bool, rng: np.random.Generator, count: int) -> Sample:
    model = Multibody("far away")
    away = 1e8 * direction(rng)
    if free:
        model.add_body("base", None, "free", **solid(rng))
    for k in range(5 if free else 6):
        parent = f"link{k - 1}" if k else "base" if free else None
        model.add_body(f"link{k}", parent, axis=direction(rng), position=rng.uniform(-1, 1, 3) if parent else away, **solid(rng, 1.0, 0.3))
    model.gravity = 9.81 * direction(rng)
    q, v = states(model, rng, count)
    if free:
        q[:, 4:7] += away
    return Sample(model, q, v, rng.normal(size=v.shape))


def _scaled(mass: float, length: float, rng: np.random.Generator, count: int) -> Sample:
    model = links([mass] * 6, [length] * 6, rng)
    q, v = states(model, rng, count)
    return Sample(model, q, v, mass * length**2 * rng.normal(size=v.shape))


def _denormal(which: str, rng: np.random.Generator, count: int) -> Sample:
    model = links([1.0] * 6, [0.5] * 6, rng)
    q, v = states(model, rng, count)
    tau = rng.normal(size=v.shape)
    if which == "tau":
        v[:] = 0
        tau *= 1e-310
    elif which == "v":
        v *= 1e-310
    else:
        q *= 1e-310
    return Sample(model, q, v, tau)


def _denormal_bounds(which: str) -> tuple[Bound, ...]:
    """A denormal torque of 1e-310 has 1e13 units: that is the rounding there is."""
    if which != "tau":
        return ROUNDING
    unit = 5e-324 / 1e-310
    return (Bound(EVERY_DOUBLE, "p95", "100 √N units of 1e-310", lambda m: 100 * unit * np.sqrt(m.N)),)


def _lever(lever: float, hinge: str) -> DynamicsCase:
    """The inertia about the centre of mass is 1/lever² of the one about the hinge.

    A pin feels the large one, and the links at the far end are carried over the lever; a free hinge feels the small one. Factors of the
    inertia keep both apart; a residual, by inverse dynamics, does not.
    """
    bounds = (
        Bound(EVERY_DOUBLE, "p95", "20 eps lever √N", lambda m: 20 * m.eps * lever * np.sqrt(m.N)),
        Bound(("ud", "square-root"), "p95", "100 eps √N", lambda m: 100 * m.eps * np.sqrt(m.N)),
    )
    if hinge == "free":
        bounds = (
            Bound(EVERY_DOUBLE, "p95", "20 eps lever²", lambda m: 20 * m.eps * lever**2),
            Bound(("ud", "square-root"), "p95", "10 eps lever", lambda m: 10 * m.eps * lever),
        )
    return DynamicsCase(
        f"{hinge} hinge, centre of mass {lever:g} lengths away",
        FAMILY,
        "the inertia about the centre of mass is a rounding error, or nearly, of the one about the hinge",
        {"N": 3, "lever": lever},
        partial(_draw_lever, lever, hinge),
        (*bounds, *WITHIN_PEERS),
        "parallel axes",
        rungs=NOT_SINGLE,
        verdict={r.label: EITHER for r in RUNGS if lever > 1e5},
    )


def _draw_lever(lever: float, hinge: str, rng: np.random.Generator, count: int) -> Sample:
    model = Multibody("long lever")
    options: dict[str, Any] = {} if hinge == "free" else {"axis": direction(rng)}
    body = solid(rng)
    body["com"] = lever * direction(rng)
    model.add_body("far", None, hinge, **options, **body)
    for k in range(2):
        model.add_body(
            f"link{k}", f"link{k - 1}" if k else "far", axis=direction(rng), position=body["com"] if not k else (1, 0, 0), **solid(rng)
        )
    q, v = states(model, rng, count)
    return Sample(model, q, v, rng.normal(size=v.shape))


def _needle(thin: float) -> DynamicsCase:
    """A needle on a ball: its axis in the body's axes is arbitrary, so that cond D = 1 / thin."""
    return _case(
        f"needle with {thin:g} of its inertia about its axis",
        "almost a line of mass: a torque along it is nearly free",
        2,
        partial(_draw_inertia, np.array([thin, 1.0, 1.0])),
        (Bound(EVERY_DOUBLE, "p95", "20 eps / thin", lambda m: 20 * m.eps / thin), *WITHIN_PEERS),
        thin=thin,
    )


def _flat(slack: float) -> DynamicsCase:
    """A plate: J₃ = J₁ + J₂, the limit of the triangle inequality."""
    side, hard = ("inside", "the limit of what a body can be") if slack >= 0 else ("outside", "no body can be so; legal, with a warning")
    return _case(
        f"flat plate, {abs(slack):g} {side} the triangle inequality",
        hard,
        2,
        partial(_draw_inertia, np.array([0.4, 0.6, 1.0 - slack])),
        ROUNDING,
        slack=slack,
    )


def _draw_inertia(principal: np.ndarray, rng: np.random.Generator, count: int) -> Sample:
    """A body of these principal moments on a ball hinge at the end of a link, its principal axes arbitrary."""
    model = Multibody("odd inertia")
    model.add_body("link", axis=direction(rng), mass=1.0, com=(0.1, 0.2, 0.3), inertia=SHAPE)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    inertia = axes * principal @ axes.T
    model.add_body("odd", "link", "ball", position=(0, 0, 1), mass=1.0, inertia=(inertia + inertia.T) / 2)
    q, v = states(model, rng, count)
    return Sample(model, q, v, rng.normal(size=v.shape))
