"""The bounds that several hard cases share."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..rungs import epsilon, wider
from .case import EVERY_DOUBLE, GATHERED, REFINED_WIDER, UNREFINED, Bound, Measured


def _times_root(factor: float):
    return lambda m: factor * m.eps * np.sqrt(m.N)


UD_UNREFINED = (
    Bound(("ud",), "p95", "100 eps √N", _times_root(100)),
    Bound(("ud",), "worst", "1e-12", lambda m: 1e-12),
)
"""Unrefined `ud` is independent of mass ratios."""

REFINED_FLOOR = (Bound(("fast + 1 refinement",), "worst", "10 × the floor, or 1e-11", lambda m: np.maximum(5 * m.floors * m.eps, 1e-11)),)
"""The same if the floor of refinement is larger."""

UD_FLOOR = (Bound(("ud",), "worst", "10 × the floor, or 100 eps √N", lambda m: np.maximum(5 * m.floors * m.eps, _times_root(100)(m))),)
"""Unrefined `ud` if the floor of refinement is above rounding."""

FAST_REFINED = (Bound(("fast + 1 refinement",), "worst", "1e-11", lambda m: 1e-11),)
"""One refinement of `fast` repairs ratios up to 1e9."""

WITHIN_PEERS = (
    Bound(("fast",), "median", "2 × the best peer", lambda m: _of_peers(m, 0.5)),
    Bound(("fast",), "p95", "2 × the best peer", lambda m: _of_peers(m, 0.95)),
)
"""`fast` alone is as good as other packages."""


def _of_peers(measured: Measured, share: float) -> float | None:
    best = measured.best_peer(share)
    return None if best is None else 2 * best


ROUNDING = (
    Bound(EVERY_DOUBLE, "p95", "100 eps √N", _times_root(100)),
    Bound(EVERY_DOUBLE, "worst", "1e-12", lambda m: 1e-12),
    *WITHIN_PEERS,
)
"""Cases that are not hard for any form stay at rounding level."""


def _three_hundredth(form: str, measured: Measured) -> np.ndarray | None:
    if form not in measured.errors:
        return None
    unrefined = measured.errors[form]
    return np.where(unrefined > 1e-12, unrefined / 300, np.inf)


ONE = Bound(EVERY_DOUBLE, "worst", "10 × the floor", lambda m: 10 * np.maximum(m.floors * m.eps / 2, m.eps / 2))

WIDER = Bound(
    tuple(REFINED_WIDER.values()),
    "worst",
    "10 × the floor of the wider residual",
    lambda m: 10 * np.maximum(m.floors * epsilon(wider("double")) / 2, m.eps / 2),
)

GATHER = Bound(
    tuple(rung.label for rung in GATHERED),
    "worst",
    "unrefined / 300, where that exceeds 1e-12, or 100 eps √N",
    lambda m: np.maximum(np.where(m.errors["fast"] > 1e-12, m.errors["fast"] / 300, np.inf), 100 * m.eps * np.sqrt(m.N)),
)

FLOOR = (ONE, WIDER, GATHER) + tuple(
    Bound((REFINED_WIDER[form],), "worst", "unrefined / 300, where that exceeds 1e-12", partial(_three_hundredth, form))
    for form in UNREFINED
)
"""On a stretched chain every form ends at the floor of its residual's precision, so that a wider residual gains at least 300."""


def at_most(methods: tuple[str, ...], statistic: str, formula: str, value: float) -> Bound:
    """Return a bound with a fixed limit."""
    return Bound(methods, statistic, formula, lambda m: value)
