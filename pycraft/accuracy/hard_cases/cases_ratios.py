"""Mass ratios: heavy tips, masses that grow, shrink or alternate along the chain, tiny last links.

The problem itself is well conditioned in the norm of ℳ at any ratio: what is lost, the algorithm loses. Links are solid and the axes
uniform on the sphere, or along coordinate axes, where downdates cancel exactly and every form does better.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from .case import DIVIDED, EITHER, SINGLE_MAY_REFUSE, Bound, Case, DynamicsCase, Measured, Rung, Sample, quantile
from .chains import links, states
from .shared_bounds import FAST_REFINED, REFINED_FLOOR, UD_FLOOR, UD_UNREFINED, WITHIN_PEERS

FAMILY = "mass ratios"
SOURCE = "forms of the articulated-inertia sweep at large mass ratios; soa: ‖δθ̈‖_ℳ ≤ max‖M^-½ δM M^-½‖ ‖θ̈‖_ℳ"
REFINABLE, BOUNDED = 1e9, 1e12
"""Ratios up to which one refinement repairs `fast`, and up to which unrefined `ud` has a bound."""

DENSE = tuple(Rung(method=method) for method in ("cholesky", "ldl"))
"""Dense factorizations of ℳ for comparison, without bounds."""


def _as_fast(measured: Measured) -> float | None:
    """Divide and conquer eliminates rows from inertias as `fast` does, but of segments, which see the ratios of all that they join: two
    digits more may go (measured: a factor of 20)."""
    worst = quantile(measured.errors["fast"], 1.0)
    return float(np.maximum(100 * worst, 100 * measured.eps * np.sqrt(measured.N))) if np.isfinite(worst) else None


AS_FAST = (Bound((DIVIDED.label,), "worst", "100 × the worst of fast, or 100 eps √N", _as_fast),)

Masses = Callable[[], tuple[Sequence[float], Sequence[float]]]


def cases() -> list[Case]:
    out: list[Case] = []
    for n in (10, 30, 100):
        for ratio in (1e3, 1e6, 1e9, 1e12, 1e15):
            hard = "a tip so much heavier: P of the inner links is a small difference of large numbers"
            out.append(_case(f"{n} links, tip {ratio:.0e}", hard, n, ratio, partial(_tip, n, ratio)))
    out.append(
        _case("10 links, tip 1e+12, coordinate axes", "the same, axes along y, x, z", 10, 1e12, partial(_tip, 10, 1e12), "coordinate")
    )
    across = "across the plane of the pins nothing lets the tip go: all of it beside a light link"
    for n in (10, 100):
        out.append(_case(f"{n} links, tip 1e+12, parallel axes", across, n, 1e12, partial(_tip, n, 1e12), "parallel"))
    straight = _case("100 links straight, tip 1e+09", "straight and heavy at the tip", 100, 1e9, partial(_tip, 100, 1e9))
    out.append(replace(straight, draw=partial(_draw, partial(_tip, 100, 1e9), "random", 0.0, False)))
    for n in (7, 10, 13, 16):
        for stretch in (1.0, 2.0, 10.0) if n == 7 else (1.0, 2.0):  # tenfold lengths and masses: inertias of seven links span 18 decades
            out += _geometric_cases(n, stretch)
    for n in (10, 100):
        for ratio in (1e3, 1e6, 1e9, 1e12, 1e15):
            hard = "light links between heavy ones: each light one is a nearly free hinge"
            out.append(_case(f"{n} links, alternating 1 and {ratio:.0e}", hard, n, ratio, partial(_alternating, n, ratio)))
    for ratio in (1e3, 1e6, 1e9, 1e12):
        hard = "three last links as small as a fingertip on a crane"
        out += _both(f"10 links, the last three {ratio:.0e} times lighter", hard, 10, ratio, partial(_fingertip, 10, ratio))
    return out


def _geometric_cases(n: int, stretch: float) -> list[DynamicsCase]:
    """Masses tenfold and lengths `stretch` times larger, or smaller, a link."""
    hard, lengths = "every hinge sees its own ratio, and they add up", f", lengths ×{stretch:g}" if stretch > 1 else ""
    ratio = 10.0 ** (n - 1)
    growing = _case(f"{n} links, masses growing tenfold{lengths}", hard, n, ratio, partial(_geometric, n, 10.0, stretch))
    return [growing, *_both(f"{n} links, masses shrinking tenfold{lengths}", hard, n, ratio, partial(_geometric, n, 0.1, 1 / stretch))]


def _both(name: str, hard: str, n: int, ratio: float, masses: Masses) -> list[DynamicsCase]:
    """Under random torques, which move the smallest links alone, and under those that move all links alike."""
    alike = _case(f"{name}, all moving alike", f"{hard}; torques that move all links alike", n, ratio, masses, alike=True)
    return [_case(name, hard, n, ratio, masses), alike]


def _case(name: str, hard: str, n: int, ratio: float, masses: Masses, axes: str = "random", alike: bool = False) -> DynamicsCase:
    """Where all links move alike, short links are carried by long ones: rounding of the long ones' motion is inherent, hence the floor."""
    bounds: tuple[Bound, ...] = WITHIN_PEERS
    if ratio <= BOUNDED:
        bounds += UD_FLOOR if alike else UD_UNREFINED
    if ratio <= REFINABLE:
        bounds += REFINED_FLOOR if alike else FAST_REFINED
    if ratio < REFINABLE:
        bounds += AS_FAST
    extreme = {rung.label: EITHER for rung in DynamicsCase.rungs if rung.form == "fast" and rung.precision != "extended"}
    extreme |= {rung.label: EITHER for rung in DynamicsCase.rungs if rung.precision == "single"}
    divided = {DIVIDED.label: EITHER} if ratio >= REFINABLE else {}  # from there on fewer than six digits may be left
    return DynamicsCase(
        name,
        FAMILY,
        hard,
        {"N": n, "ratio": ratio, "axes": axes, "T": "ℳ times random" if alike else "random"},
        partial(_draw, masses, axes, np.pi, alike),
        bounds,
        SOURCE,
        verdict={rung.label: EITHER for rung in DENSE} | divided | (extreme if ratio > BOUNDED else SINGLE_MAY_REFUSE),
        floor=alike,
        rungs=(*DynamicsCase.rungs, *DENSE, DIVIDED),
    )


def _draw(masses: Masses, axes: str, fold: float, alike: bool, rng: np.random.Generator, count: int) -> Sample:
    """A chain with random axes, angles within ±fold, at rest; T normal, or what moves the links with normal accelerations."""
    model = links(*masses(), rng, axes)
    q, v = states(model, rng, count)
    q, v = q * (fold / np.pi), np.zeros_like(v)
    tau = rng.normal(size=v.shape)
    return Sample(model, q, v, model.inverse_dynamics(q, v, tau) if alike else tau)


def _tip(n: int, ratio: float):
    return [1.0] * (n - 1) + [ratio], [0.1] * n


def _geometric(n: int, growth: float, stretch: float):
    return [growth**k for k in range(n)], [0.1 * stretch**k for k in range(n)]


def _alternating(n: int, ratio: float):
    return [1.0 if k % 2 else ratio for k in range(n)], [0.1] * n


def _fingertip(n: int, ratio: float):
    return [1.0] * (n - 3) + [1 / ratio] * 3, [0.1] * (n - 3) + [0.1 * ratio ** (-1 / 3)] * 3
