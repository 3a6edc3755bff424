"""A hard case, as data: the difficulty, random instances, the measured error and its reference, and the bounds.

A case draws its models, states and forces from a seed; nothing in it runs anything. `stability.py` runs the catalogue.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..rungs import Rung

if TYPE_CHECKING:
    from ...models.multibody import Multibody

Accelerations = Callable[["Sample"], np.ndarray]

FORMS = ("fast", "ud", "square-root")
REFINEMENTS: tuple[dict[str, Any], ...] = (
    {},
    {"refine": 1},
    {"refine": "auto"},
    {"refine": "auto", "residual": "wider"},
)
GATHERED = tuple(Rung(form, refine="auto", residual="gather") for form in ("fast", "ud"))
DOUBLE = tuple(Rung(form, **refinement) for form in FORMS for refinement in REFINEMENTS) + GATHERED
OTHER_PRECISIONS = (
    Rung("fast", precision="single"),
    Rung("fast", refine="auto", residual="wider", precision="single"),
    Rung("ud", precision="single"),
    Rung("fast", precision="extended"),
    Rung("ud", precision="extended"),
)
RUNGS = DOUBLE + OTHER_PRECISIONS
DIVIDED = Rung(method="divide-and-conquer")
UNREFINED = tuple(rung.label for rung in DOUBLE if not rung.refine)
EVERY_DOUBLE = tuple(rung.label for rung in DOUBLE)
REFINED_WIDER = {form: Rung(form, refine="auto", residual="wider").label for form in FORMS}

SOLVED, REFUSED, EITHER = "solved", "refused", "either"
SINGLE_MAY_REFUSE = {rung.label: EITHER for rung in RUNGS if rung.precision == "single"}
"""Seven digits are too few: single precision may refuse a hard case, but must not return wild values."""


@dataclass(frozen=True)
class Sample:
    """A model and a batch of its states: q (B, nq), v (B, nv), generalized forces tau (B, nv)."""

    model: Multibody
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray


@dataclass(frozen=True)
class Measured:
    """Data available to a bound: errors (seeds,) of every method by its label, floors (seeds,) in units of u
    (none if a case has no floor), the case's parameters, eps."""

    parameters: Mapping[str, Any]
    eps: float
    errors: Mapping[str, np.ndarray]
    floors: np.ndarray
    peers: tuple[str, ...]

    @property
    def N(self) -> float:
        return float(self.parameters["N"])

    def best_peer(self, share: float) -> float | None:
        """Return the least of the peers' quantiles; None if no peer answered."""
        found = [quantile(self.errors[peer], share) for peer in self.peers if len(self.errors[peer])]
        return min(found) if found else None


@dataclass(frozen=True)
class Bound:
    """A bound on the errors of some methods.

    `methods` are labels; `statistic` is "median", "p95" or "worst"; `limit(measured)` gives a number, one per seed, or None if the
    bound does not apply; the bound holds if the statistic of error / limit is at most 1. `formula` states it in words.
    """

    methods: tuple[str, ...]
    statistic: str
    formula: str
    limit: Callable[[Measured], Any]


@dataclass(frozen=True)
class DynamicsCase:
    """Forward dynamics of random instances: relative error of the accelerations, 2-norm, against quad precision.

    Attributes
    ----------
    name, family, hard, source : str
    parameters : dict, N the number of links
    draw : `draw(rng, states)` makes a Sample
    bounds : tuple of Bound
    verdict : "solved" | "refused" | "either", for every method or by its label; default "solved"
    fault : hinge that a refusal must name
    floor : True if the floor of refinement is computed; the states must be at rest, without gravity
    rungs, extra : methods beyond the forms: further rungs, and functions of the sample by label
    models : number of models per run, among which the seeds are divided
    peers : True if other packages are measured
    """

    name: str
    family: str
    hard: str
    parameters: Mapping[str, Any]
    draw: Callable[[np.random.Generator, int], Sample]
    bounds: tuple[Bound, ...] = ()
    source: str = ""
    verdict: str | Mapping[str, str] = SOLVED
    fault: str = ""
    floor: bool = False
    rungs: tuple[Rung, ...] = RUNGS
    extra: Mapping[str, Accelerations] = field(default_factory=dict)
    models: int = 20
    peers: bool = True
    quantity: str = "accelerations"
    reference: str = "quad"

    def expected(self, rung: Rung) -> str:
        """Return the verdict for one rung."""
        return self.verdict if isinstance(self.verdict, str) else self.verdict.get(rung.label, SOLVED)


@dataclass(frozen=True)
class MeasuredCase:
    """Any other quantity: `measure(seeds, steps)` gives the errors, one array per method."""

    name: str
    family: str
    hard: str
    parameters: Mapping[str, Any]
    measure: Callable[[Iterable[int], int], Mapping[str, np.ndarray]]
    quantity: str
    reference: str
    bounds: tuple[Bound, ...] = ()
    source: str = ""


Case = DynamicsCase | MeasuredCase


def quantile(errors: np.ndarray, share: float) -> float:
    """Return a quantile that is one of the errors (the next larger one); infinite if it falls on a NaN."""
    if not len(errors):
        return float("nan")
    ordered = np.sort(np.where(np.isnan(errors), np.inf, errors))
    return float(ordered[min(len(ordered) - 1, int(np.ceil(share * len(ordered))) - 1 if share else 0)])
