"""Massless bodies on hinges, and pivots that come close to nothing: what is solved, what must be refused, by which form.

A pivot of D(k) is compared with the rounding bound of the form that made it: the verdict never depends on luck. Axes are skew, so that
nothing cancels exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ... import _core
from ...models.multibody import Multibody
from ..rungs import epsilon
from .case import (
    DIVIDED,
    EITHER,
    EVERY_DOUBLE,
    FORMS,
    REFUSED,
    RUNGS,
    SINGLE_MAY_REFUSE,
    SOLVED,
    Bound,
    Case,
    DynamicsCase,
    MeasuredCase,
    Sample,
)
from .chains import direction, solid, states
from .shared_bounds import WITHIN_PEERS, at_most

FAMILY = "massless bodies and vanishing pivots"
RULING = "legal where mass outboard makes D(k) regular, else refused by name"

Build = Callable[[np.random.Generator], Multibody]


def cases() -> list[Case]:
    out: list[Case] = []
    for name, hard, build in (
        ("an inner massless link", "D of the massless link comes from outboard alone", partial(_inner, 1)),
        ("two inner massless links in a row", "a gimbal built of pins: three axes, one mass", partial(_inner, 2)),
        ("a massless tip with a rotor", "D of the tip is the rotor's inertia alone", _rotor),
    ):
        out.append(_legal(name, hard, build))
    for name, hard, build, fault in (
        ("a massless tip", "D of the tip is exactly zero", partial(_tip, 1), "last"),
        ("two massless bodies in a row at the tip", "both feel nothing; the outer one is found first", partial(_tip, 2), "last"),
        ("a massless link under a coaxial pin", "the pin outboard takes all inertia about their common axis", _coaxial, "inner"),
        ("a massless ball under a pin", "one direction of three feels nothing, and it moves with q", _ball, "inner"),
        ("sliders in line, masses 0 and 1e9", "noise of P at 1e9 must not pass for a mass", partial(_sliders, 0.0, 1e9), "inner"),
    ):
        out.append(_refused(name, hard, build, fault))
    # Where the rounding of its entries happens to be an inertia well above theirs, there is an answer.
    rod = _refused("a thin rod on a pin along it, askew", "D is the rounding of the rod's inertia, of any sign", _rod, "last")
    out.append(replace(rod, verdict=EITHER))
    for light, heavy in ((1e-3, 1e9), (1e-6, 1e9), (1e-3, 1e16), (1e-9, 1e16)):
        out.append(_prismatic(light, heavy))
    out += [_minimum_norm(name, build) for name, build in SINGULAR]
    return out


# Cases ----------------------------------------------------------------------------------------------------------------


WITH_DIVIDED = (*RUNGS, DIVIDED)
"""Segments that end in a massless link are singular by themselves."""


def _legal(name: str, hard: str, build: Build) -> DynamicsCase:
    """Solved. Axes start across each other and turn by at most 0.3 rad: no pivot comes close to nothing."""
    return DynamicsCase(
        name,
        FAMILY,
        hard,
        {"N": 4},
        partial(_draw, build, 0.1),
        (
            Bound((*EVERY_DOUBLE, DIVIDED.label), "p95", "100 eps √N", lambda m: 100 * m.eps * np.sqrt(m.N)),
            at_most((*EVERY_DOUBLE, DIVIDED.label), "worst", "1e-11", 1e-11),
            *WITHIN_PEERS,
        ),
        RULING,
        verdict=SINGLE_MAY_REFUSE,
        rungs=WITH_DIVIDED,
    )


def _refused(name: str, hard: str, build: Build, fault: str) -> DynamicsCase:
    draw = partial(_draw, build, 1.0)
    return DynamicsCase(name, FAMILY, hard, {"N": 3}, draw, (), RULING, verdict=REFUSED, fault=fault, rungs=WITH_DIVIDED)


def _prismatic(light: float, heavy: float) -> DynamicsCase:
    """Two sliders in line: D inboard is `light`, a difference of numbers at `heavy`.

    `fast` knows it to 8 eps heavy; `ud` works as with twice the digits, as long as G has one: light above 4 eps heavy.
    """
    verdict: dict[str, str] = {}
    for rung in (rung for rung in RUNGS if rung.precision in _core.epsilons()):
        noise = 8 * epsilon(rung.precision) * heavy
        if rung.form == "fast":
            verdict[rung.label] = REFUSED if light < noise / 10 else SOLVED if light > 10 * noise else EITHER
        elif rung.form == "square-root" or rung.precision == "single":
            verdict[rung.label] = EITHER
        else:
            verdict[rung.label] = REFUSED if light < noise / 20 else SOLVED if light > 10 * noise else EITHER
    squared = Bound(("ud",), "worst", "1000 eps + 10 eps² heavy / light", lambda m: 1000 * m.eps + 10 * m.eps**2 * heavy / light)
    bounds: tuple[Bound, ...] = (squared, *WITHIN_PEERS)
    if light > 80 * epsilon("double") * heavy:
        bounds += (
            Bound(("fast",), "worst", "10 eps heavy / light", lambda m: 10 * m.eps * heavy / light),
            at_most(("fast + refinement",), "worst", "1e-11", 1e-11),
        )
    return DynamicsCase(
        f"sliders in line, masses {light:g} and {heavy:g}",
        FAMILY,
        "D inboard is what is left of a large mass",
        {"N": 2, "light": light, "heavy": heavy},
        partial(_draw, partial(_sliders, light, heavy), 1.0),
        bounds,
        RULING,
        verdict=verdict,
        fault="inner",
    )


def _minimum_norm(name: str, build: Build) -> MeasuredCase:
    """With on_singular="minimum-norm": what the pseudo-inverse of ℳ gives, whether the forces fit or not."""
    bounds = (at_most(FORMS, "worst", "1e-12", 1e-12),)
    hard = "many accelerations fit the forces, or none does: the least of the best is meant"
    return MeasuredCase(
        f'{name}, on_singular="minimum-norm"',
        FAMILY,
        hard,
        {"N": 3},
        partial(_pseudo_inverse, build),
        "accelerations",
        "ℳ⁺T by singular values, those below 1e-11 left out",
        bounds,
        RULING,
    )


def _pseudo_inverse(build: Build, seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    errors: dict[str, list[float]] = {form: [] for form in FORMS}
    for seed in seeds:
        sample = _draw(build, 1.0, np.random.default_rng(seed), 1)
        sample.model.take_warnings()
        q, tau = sample.q[0], sample.tau[0]
        exact = np.linalg.pinv(sample.model.mass_matrix(q, precision="quad"), rcond=1e-11, hermitian=True) @ tau
        for form in FORMS:
            found = sample.model.forward_dynamics(q, 0 * tau, tau, form=form, on_singular="minimum-norm")
            errors[form].append(float(np.linalg.norm(found - exact) / np.linalg.norm(exact)))
    return {form: np.array(values) for form, values in errors.items()}


# Models ---------------------------------------------------------------------------------------------------------------


def _draw(build: Build, share: float, rng: np.random.Generator, count: int) -> Sample:
    """Random states, angles within `share` of ±π, and random torques."""
    model = build(rng)
    q, v = states(model, rng, count)
    return Sample(model, q if share == 1 else share * q, v, rng.normal(size=v.shape))


def _add(
    model: Multibody, name: str, parent: str | None, rng: np.random.Generator, hinge: str = "pin", mass: float = 1.0, **options: Any
) -> None:
    body = solid(rng, mass, 0.3) if mass else {}
    options = {"position": rng.uniform(-1, 1, 3) if parent else (0, 0, 0), "axis": direction(rng)} | options
    if hinge == "ball":
        del options["axis"]
    model.add_body(name, parent, hinge, **(body | options))


def _inner(count: int, rng: np.random.Generator) -> Multibody:
    """A link, `count` massless ones on axes across each other, and links again: four pins."""
    model = Multibody("inner massless links")
    _add(model, "first", None, rng)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
    parent = "first"
    for i in range(count):
        _add(model, f"massless{i}", parent, rng, mass=0.0, axis=axes[i])
        parent = f"massless{i}"
    for i in range(3 - count):
        _add(model, f"link{i}", parent, rng, axis=axes[2] if i == 0 else direction(rng))
        parent = f"link{i}"
    return model


def _rotor(rng: np.random.Generator) -> Multibody:
    model = Multibody("massless tip with a rotor")
    for i, parent in enumerate((None, "link0", "link1")):
        _add(model, f"link{i}", parent, rng)
    _add(model, "tip", "link2", rng, mass=0.0, rotor_inertia=0.01)
    return model


def _tip(count: int, rng: np.random.Generator) -> Multibody:
    """A chain whose last `count` links are massless; the very last is called "last"."""
    model = Multibody("massless tip")
    names = ["first", "second", "last"]
    for i, name in enumerate(names):
        _add(model, name, names[i - 1] if i else None, rng, mass=0.0 if i >= 3 - count else 1.0)
    return model


def _coaxial(rng: np.random.Generator) -> Multibody:
    model = Multibody("coaxial pins")
    axis, point = direction(rng), rng.uniform(-2, 2, 3)
    _add(model, "first", None, rng)
    _add(model, "inner", "first", rng, mass=0.0, axis=axis, point=point)
    _add(model, "outer", "inner", rng, axis=axis, point=point, position=(0, 0, 0))
    return model


def _ball(rng: np.random.Generator) -> Multibody:
    """A ball carries no inertia about the axis of the pin outboard, which goes through its centre."""
    model = Multibody("massless ball")
    _add(model, "first", None, rng)
    _add(model, "inner", "first", rng, "ball", mass=0.0)
    _add(model, "outer", "inner", rng, position=(0, 0, 0))
    return model


def _rod(rng: np.random.Generator) -> Multibody:
    model = Multibody("rod on its axis")
    axis = direction(rng)
    axis = axis / np.linalg.norm(axis)
    across = np.eye(3) - np.outer(axis, axis)
    _add(model, "first", None, rng)
    _add(model, "last", "first", rng, axis=axis, com=0.5 * axis, inertia=(across + across.T) / 24)
    return model


def _sliders(light: float, heavy: float, rng: np.random.Generator) -> Multibody:
    model = Multibody("sliders in line")
    axis = direction(rng)
    _add(model, "inner", None, rng, "slider", mass=light, axis=axis)
    _add(model, "outer", "inner", rng, "slider", mass=heavy, axis=axis)
    return model


SINGULAR: tuple[tuple[str, Build], ...] = (
    ("a massless tip", partial(_tip, 1)),
    ("two massless bodies in a row", partial(_tip, 2)),
    ("coaxial pins", _coaxial),
    ("a massless ball under a pin", _ball),
)
