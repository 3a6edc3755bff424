"""Run the catalogue of hard cases over forms, refinements and precisions, alongside the installed peers.

An error is relative, in the 2-norm, against quad precision. A method that raises has refused: it has no error, but the refusal must be
expected. None of our own methods may return a NaN in any case, nor an error above one in double precision or wider.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from typing import Any
from zlib import crc32

import numpy as np

from ... import _core
from ...models.generators import chain
from ..certificates.floor import floors
from ..exact import EXACT
from ..rungs import Rung, epsilon
from .case import EITHER, REFUSED, SOLVED, Bound, Case, DynamicsCase, Measured, MeasuredCase, Sample, quantile
from .catalogue import SIZES, catalogue
from .stability_table import Stability, row

WILD = 1.0
"""Relative error above which a value is wild."""


@dataclass
class Outcome:
    """Outcome of one method: errors (seeds,), NaN where it refused and infinite where it returned a NaN; texts of refusals."""

    errors: np.ndarray
    refusals: list[str] = field(default_factory=list)
    returned: float = 0.0

    @property
    def answered(self) -> np.ndarray:
        """Errors of the answered seeds."""
        return self.errors[~np.isnan(self.errors)]


def run(
    seeds: int = 200,
    steps: int = 1_000_000,
    sizes: Iterable[int] = SIZES,
    cases: Iterable[Case] | None = None,
    peers: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Stability:
    """Run the catalogue, or the given cases.

    Parameters
    ----------
    seeds : random instances per case
    steps : largest number of steps of each trajectory
    sizes : numbers of links of the uniform chains; see `catalogue`
    peers : True also measures installed packages
    progress : called with the name of each case

    Returns
    -------
    Stability
        Tidy rows, one per case and method; true if every bound holds.
    """
    makers = _makers() if peers else {}
    rows: list[dict[str, Any]] = []
    for case in catalogue(sizes) if cases is None else cases:
        if progress:
            progress(case.name)
        rows += _dynamics(case, seeds, makers) if isinstance(case, DynamicsCase) else _measured(case, seeds, steps)
    return Stability(rows, {"seeds": seeds, "steps": steps})


def _makers() -> dict[str, Any]:
    """Return constructors of peers from a model, by name and version."""
    from ...interop.export import installed

    benign = chain(1, seed=0)
    return {make(benign).name: make for make in installed().values()}


# Forward dynamics -----------------------------------------------------------------------------------------------------


def _dynamics(case: DynamicsCase, seeds: int, makers: dict[str, Any]) -> list[dict[str, Any]]:
    samples = list(_samples(case, seeds))
    exact = [_reference(sample) for sample in samples]
    ways: dict[str, Callable[[Sample], np.ndarray]] = {}
    rungs = {rung.label: rung for rung in case.rungs if exists(rung)}
    for label, rung in rungs.items():
        ways[label] = partial(_accelerations, rung)
    ways |= case.extra
    outcomes = {label: _collect(samples, exact, way) for label, way in ways.items()}
    names = []
    if case.peers:
        for name, make in makers.items():
            outcomes[name] = _peer(make, samples, exact)
            names.append(name)
    measured = {label: outcome.errors for label, outcome in outcomes.items()}
    answered = tuple(name for name in names if len(outcomes[name].answered))
    floor = np.concatenate([floors(s.model, s.q, e) for s, e in zip(samples, exact, strict=True)]) if case.floor else np.empty(0)
    rows = []
    for label, outcome in outcomes.items():
        own = rungs.get(label)
        context = Measured(case.parameters, epsilon(own.precision if own else "double"), measured, floor, answered)
        rows.append(_judge(case, label, own, outcome, context, peer=label in names))
    return rows


def _accelerations(rung: Rung, sample: Sample) -> np.ndarray:
    return sample.model.forward_dynamics(sample.q, sample.v, sample.tau, **_options(rung))


def _samples(case: DynamicsCase, seeds: int) -> Iterable[Sample]:
    count = min(case.models, seeds)
    for i in range(count):
        rng = np.random.default_rng([crc32(case.name.encode()), i])
        sample = case.draw(rng, seeds // count + (i < seeds % count))
        sample.model.take_warnings()
        yield sample


def _options(rung: Rung) -> dict[str, Any]:
    """Return the keywords of a rung that differ from the defaults."""
    return {name: value for name, value in rung.options.items() if value != getattr(Rung(), name)}


def exists(rung: Rung) -> bool:
    """Return True if this build has a rung: precisions depend on the platform."""
    try:
        chain(1).forward_dynamics(np.zeros(1), np.zeros(1), np.ones(1), **_options(rung))
    except (TypeError, _core.EvaluationError):
        return False
    return True


def _reference(sample: Sample) -> np.ndarray:
    """Return accelerations (B, nv) in quad precision, in 100 digits where quad refuses, NaN where both do; by the form with an error that
    does not grow
    with the mass ratio."""
    exact = _each(sample, lambda s: s.model.forward_dynamics(s.q, s.v, s.tau, form=EXACT, precision="quad"), [])
    for i in np.flatnonzero(np.isnan(exact).any(axis=1)):
        state = Sample(sample.model, sample.q[i : i + 1], sample.v[i : i + 1], sample.tau[i : i + 1])
        exact[i] = _each(state, lambda s: s.model.forward_dynamics(s.q, s.v, s.tau, form=EXACT, precision=100), [])[0]
    return exact


def _each(sample: Sample, way: Callable[[Sample], np.ndarray], refusals: list[str]) -> np.ndarray:
    """Compute all states in one call; if that refuses, state by state, with NaN and a text for each refused state."""
    try:
        return way(sample)
    except _core.Error:
        out = np.full(sample.tau.shape, np.nan)
    for i in range(len(out)):
        try:
            out[i] = way(Sample(sample.model, sample.q[i : i + 1], sample.v[i : i + 1], sample.tau[i : i + 1]))[0]
        except _core.Error as error:
            out[i] = np.nan
            refusals.append(f"{type(error).__name__}: {error}")
    return out


def _collect(samples: list[Sample], exact: list[np.ndarray], way: Callable[[Sample], np.ndarray]) -> Outcome:
    """Measure one of our methods on all samples."""
    refusals: list[str] = []
    parts, returned = [], 0.0
    for sample, expected in zip(samples, exact, strict=True):
        before = len(refusals)
        value = _each(sample, way, refusals)
        refused = np.isnan(value).all(axis=1) if len(refusals) > before else np.zeros(len(value), bool)
        parts.append(np.where(refused, np.nan, relative(value, expected)))
        returned = max(returned, _largest(value[~refused]))
    return Outcome(np.concatenate(parts), refusals, returned)


def relative(value: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Return relative errors (B,) in the 2-norm of rows; infinite where a value or the reference is not finite."""
    scale = np.abs(exact).max(axis=-1, keepdims=True, initial=0.0)
    scale = np.where((scale > 0) & np.isfinite(scale), scale, 1.0)
    with np.errstate(all="ignore"):
        size = np.linalg.norm(exact / scale, axis=-1)
        off = np.linalg.norm((value - exact) / scale, axis=-1)
    return np.where(np.isfinite(off), off / np.where(size > 0, size, 1.0), np.inf)


def _largest(value: np.ndarray) -> float:
    """Return the largest returned magnitude, NaN if any is NaN."""
    return float(np.abs(value).max()) if value.size else 0.0


def _peer(make: Any, samples: list[Sample], exact: list[np.ndarray]) -> Outcome:
    """Measure another package on the same samples; its refusals keep their own text."""
    from ...interop.peer import PeerRefusal

    parts, refusals, returned = [], [], 0.0
    for sample, expected in zip(samples, exact, strict=True):
        try:
            peer = make(sample.model)
        except PeerRefusal as error:
            refusals += [str(error)] * len(expected)
            parts.append(np.full(len(expected), np.nan))
            continue
        errors = np.full(len(expected), np.nan)
        for i in range(len(expected)):
            try:
                with np.errstate(all="ignore"):
                    value = peer.forward_dynamics(sample.q[i], sample.v[i], sample.tau[i])
            except RuntimeError as error:
                refusals.append(" ".join(str(error).split()))
                continue
            errors[i] = relative(value[None], expected[i : i + 1])[0]
            returned = np.maximum(returned, _largest(value))
        refusals += [text for text in peer.said if text not in refusals]
        parts.append(errors)
    return Outcome(np.concatenate(parts), refusals, float(returned))


# Other quantities -----------------------------------------------------------------------------------------------------


def _measured(case: MeasuredCase, seeds: int, steps: int) -> list[dict[str, Any]]:
    measured = {label: np.asarray(errors, float) for label, errors in case.measure(range(seeds), steps).items()}
    outcomes = {label: Outcome(np.where(np.isnan(errors), np.inf, errors)) for label, errors in measured.items()}
    context = Measured({**case.parameters, "steps": steps}, epsilon("double"), measured, np.empty(0), ())
    return [_judge(case, label, None, outcome, context, peer=False) for label, outcome in outcomes.items()]


# Verdicts -------------------------------------------------------------------------------------------------------------


def _judge(case: Case, label: str, rung: Rung | None, outcome: Outcome, measured: Measured, peer: bool) -> dict[str, Any]:
    """Return the row of one method: statistics, the bounds that apply, and failures."""
    formulas, failed, ratio = [], [], 0.0
    for bound in case.bounds:
        if peer or label not in bound.methods:
            continue
        found = ratio_to(bound, outcome.errors, measured)
        if found is None:
            continue
        formulas.append(f"{bound.statistic} ≤ {bound.formula}")
        ratio = max(ratio, found)
        if not found <= 1:
            failed.append(formulas[-1])
    own = not peer and label not in getattr(case, "extra", {})
    if own and isinstance(case, DynamicsCase):
        failed += _unexpected(case, rung, outcome)
    text = outcome.refusals[0] if outcome.refusals else ""
    if np.isinf(outcome.answered).any():
        text = "returns NaN" if np.isnan(outcome.returned) else f"returns {outcome.returned:.1e}"
    return row(case, label, rung, outcome, formulas, ratio, failed, text, peer)


def ratio_to(bound: Bound, errors: np.ndarray, measured: Measured) -> float | None:
    """Return the statistic of error over limit; None if the bound does not apply or nothing was answered."""
    limit = bound.limit(measured)
    if limit is None:
        return None
    with np.errstate(all="ignore"):
        ratios = errors / limit
    ratios = ratios[~np.isnan(errors)]
    if not len(ratios):
        return None
    return quantile(ratios, {"median": 0.5, "p95": 0.95, "worst": 1.0}[bound.statistic])


def _unexpected(case: DynamicsCase, rung: Rung | None, outcome: Outcome) -> list[str]:
    """Return violations: a value instead of a refusal, a refusal instead of a value, the wrong hinge, a wild value.

    Seven digits are too few for some of these problems; in single precision a wild value is allowed, and a NaN is not.
    """
    expected = case.expected(rung) if rung else EITHER
    found = []
    if expected == REFUSED and len(outcome.answered):
        found.append(f"must be refused, {len(outcome.answered)} were not")
    if expected == SOLVED and outcome.refusals:
        found.append(f"must be solved, {len(outcome.refusals)} were not")
    if case.fault and expected == REFUSED and any(f"hinge '{case.fault}'" not in text for text in outcome.refusals):
        found.append(f"a refusal must name hinge {case.fault!r}")
    least = WILD if rung and epsilon(rung.precision) <= epsilon("double") else np.finfo(float).max
    wild = int(np.count_nonzero(outcome.answered > least))
    if wild and expected != REFUSED:
        found.append(f"{wild} wild values in silence")
    return found
