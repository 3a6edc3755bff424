"""`check` of a statement by block: for every choice of bodies that satisfies its relations, on a model or on random trees."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from typing import Any

import mpmath
import numpy as np

from .. import _core
from ..operators.operator_set import OperatorSet
from .block_reading import BlockStatement, read_by_block
from .block_relations import Relation, choices, standard
from .block_values import ANY, Blocks, place_text, value
from .family import HYPOTHESES, Spec, family
from .judge import FAILS, HOLDS, UNDECIDED, BoundState, Judgement, Taken, Verdict, decided, ladder
from .report import CheckReport
from .statement_text import telling
from .vocabulary import ParseError

WORST = 8
"""Number of the worst choices of bodies, which are evaluated first in wider scalars: if one fails, the statement fails."""
_DIGITS = 120
"""Digits of the operations on blocks of wide numbers: more than the numbers have."""


@dataclass
class BlockRefutation:
    """A model, a state and bodies for which a statement by block is false."""

    model: str
    state: Any
    bodies: dict[str, str]
    residual: float
    spec: Spec | None = None
    meets: frozenset[str] = frozenset()

    def __repr__(self) -> str:
        chosen = ", ".join(f"{letter} = {name}" for letter, name in self.bodies.items())
        return f"  false for {chosen or 'all bodies'}\n  on {self.model}, off by {self.residual:.1e} of the largest block"


@dataclass
class _OnModel:
    """Findings on one model."""

    verdict: Verdict = field(default_factory=Verdict)
    counted: int = 0
    bad: list[dict[str, int]] = field(default_factory=list)
    good: list[dict[str, int]] = field(default_factory=list)
    refutation: tuple[Any, dict[str, int], float] | None = None


def check_by_block(text: str, given: OperatorSet | None, *, states: int, seed: int, precision: str | int) -> CheckReport:
    """Return the report of a statement by block on these operators, or on random trees; see `pycraft.check`."""
    found: dict[str, tuple[Spec | None, Any, _OnModel]] = {}
    if given is not None:
        own = given._model
        read = read_by_block(text, _names(given))
        rng = np.random.default_rng(seed)
        drawn = [None] if own is None else [own.random_state(rng) for _ in range(states)]
        found[given._source.name] = None, given, _on_model(read, given, drawn, precision)
    else:
        read = read_by_block(text)
        for spec in family(states):
            spec = replace(spec, seed=spec.seed + seed)
            operators = spec.model().soa
            found[str(spec)] = (spec, operators, _on_model(read, operators, spec.states(operators._model, 1), precision))
    said = {name: entry for name, entry in found.items() if entry[2].counted}
    if not said:
        where = "the random trees" if given is None else "the model"
        chains = "; k+1 and k-1 are bodies of serial chains: write ℘(k) and Σ_{j∈C(k)} for a tree" if read.of_chains else ""
        raise _core.EvaluationError(f"{text!r}: no bodies on {where} satisfy its relations{chains}")
    whole = Verdict([j for _, _, on in said.values() for j in on.verdict.judgements])
    report = CheckReport.of(text, whole, [*said], read.understood)
    count = sum(on.counted for _, _, on in said.values())
    report.notes.append(f"checked by block, for {count} choices of bodies")
    if whole.verdict == FAILS:
        _explain(report, read, said)
    return report


def _names(operators: Any) -> list[str]:
    return [name for name, *_ in operators.V.blocks]


def _on_model(read: BlockStatement, operators: Any, states: list[Any], precision: str | int) -> _OnModel:
    """Check the statement on one model, at these states."""
    found = _OnModel()
    parents, names = operators._source.parents, _names(operators)
    fixed = {name: body for name, _, body in operators.V.blocks}
    if read.of_chains and any(p != k - 1 for k, p in enumerate(parents)):
        return found
    unknown = [x for x in read.indices if len(x) > 2]
    if unknown:
        raise ParseError(f"no body is called {unknown[0]!r}; there are {', '.join(names[:12])}")
    chosen = [
        bodies
        for bodies in choices(read.indices, parents, read.relations, fixed)
        if all(parents[bodies[x]] >= 0 for x in read.beside("parent") if x in bodies)
        and all(bodies[x] in parents for x in read.beside("child") if x in bodies)
    ]
    if not chosen:
        return found
    for state in states:
        try:
            judgement, apart = _judged(read, operators, BoundState(operators, state), chosen, precision)
        except (_core.SingularOperatorError, _core.SingularHingeError):
            continue
        found.counted = len(chosen)
        found.verdict.judgements.append(judgement)
        wrong = [i for i, far in enumerate(apart) if far]
        found.bad += [chosen[i] for i in wrong]
        found.good += [bodies for i, bodies in enumerate(chosen) if not apart[i]]
        if judgement.verdict == FAILS:
            found.refutation = state, chosen[max(wrong, key=lambda i: apart[i])] if wrong else chosen[0], judgement.decisive.residual
            break
    return found


def _judged(
    read: BlockStatement, operators: Any, at: BoundState, chosen: list[dict[str, int]], precision: str | int
) -> tuple[Judgement, list[float]]:
    """Return the verdict at a state, and the error of each choice of bodies in the second scalar, 0 for possible rounding."""
    found = Judgement(state=at.state)
    apart: list[float] = []
    among = list(range(len(chosen)))
    decides = telling(read.text)
    for step, name in enumerate(ladder(precision)):
        blocks = Blocks(at, operators, name, read.definitions)
        with mpmath.workdps(_DIGITS):
            if step == 2 and any(apart):  # if it is false, some bodies suffice
                among = sorted(among, key=lambda i: -apart[i])[:WORST]
            both = [_both(read, blocks, chosen[i]) for i in among]
        scale = max((size for _, _, size in both), default=0.0)
        found.zero = scale == 0
        far = [difference / scale if scale else difference for difference, _, _ in both]
        bounds = [error / scale if scale else 0.0 for _, error, _ in both]
        found.taken.append(Taken(name, max(far), max(bounds)))
        if step == 1:
            narrow = found.taken[0]
            falls = max(narrow.residual / narrow.epsilon, 1.0) * found.taken[1].epsilon
            apart = [x if x > max(b, 64 * falls) or x > 1e-9 else 0.0 for x, b in zip(far, bounds, strict=True)]
        found.verdict = decided(found.taken, blocks.growth, decides=decides)
        if found.verdict != UNDECIDED and (found.verdict == FAILS or len(among) == len(chosen)):
            break
    if found.verdict == UNDECIDED:
        found.verdict = decided(found.taken, blocks.growth, last=True, decides=decides)
    return found, apart


def _both(read: BlockStatement, blocks: Blocks, bodies: dict[str, int]) -> tuple[float, float, float]:
    """Return the largest entry of lhs - rhs, its bound, and the largest entry of both."""
    left, right = (value(side, blocks, bodies) for side in read.formula)
    places = [(x.codomain, x.domain) for x in (left, right)]
    zero = [x.array.ndim == 0 and not x.array for x in (left, right)]
    if ANY not in places[0] + places[1] and places[0] != places[1] and not any(zero):
        led = [f"from {place_text(domain)} to {place_text(codomain)}" for codomain, domain in places]
        raise _core.SpaceError(f"the left side leads {led[0]}, the right side {led[1]}")
    arrays = [left.array, right.array]
    for i, x in enumerate((left, right)):
        if x.codomain == ANY and places[1 - i][0] != ANY:
            arrays[i] = x.array[0, 0] * np.eye(*arrays[1 - i].shape)
    difference = arrays[0] - arrays[1]
    sizes = [_largest(a) for a in arrays]
    return _largest(difference), left.error + right.error + blocks.epsilon * max(sizes), max(sizes)


def _largest(array: Any) -> float:
    return max((abs(float(x)) for x in np.ravel(array)), default=0.0)


def _explain(report: CheckReport, read: BlockStatement, said: dict[str, Any]) -> None:
    """Add the smallest refuting model tried, and the hypotheses and relations of bodies under which it was true on all models."""
    refuted = [(entry[0], name, entry[1], entry[2].refutation) for name, entry in said.items() if entry[2].refutation is not None]
    spec, name, operators, (state, bodies, residual) = min(refuted, key=lambda r: r[0].size if r[0] is not None else (0, 0))
    names = _names(operators)
    chosen = {letter: names[bodies[letter]] for letter in read.indices}
    report.counterexample = BlockRefutation(name, state, chosen, residual, spec)
    if spec is not None:
        report.true_where = _saving([(entry[0].met, entry[2].verdict.verdict == HOLDS) for entry in said.values()])
    saved = [r for r in standard(read.indices) if r not in read.relations and _saves(r, said)]
    if saved and not report.true_where:
        report.notes.append(f"true on {'all models tried' if spec is not None else 'it'} where {saved[0]}")


def _saving(found: list[tuple[frozenset[str], bool]]) -> list[frozenset[str]]:
    """Return the fewest hypotheses under which it held on every model, of at least two."""
    for size in range(1, len(HYPOTHESES)):
        sets = [frozenset(h) for h in itertools.combinations(HYPOTHESES, size)]
        held = [h for h in sets if len(m := [holds for met, holds in found if h <= met]) > 1 and all(m)]
        if held:
            return held
    return []


def _saves(relation: Relation, said: dict[str, Any]) -> bool:
    """Return True if all choices of bodies that satisfy the relation were right, some exist, and others fail the relation."""
    on = [(entry[1]._source.parents, entry[2]) for entry in said.values()]
    if any(relation.holds(parents, bodies) for parents, found in on for bodies in found.bad):
        return False
    return any(relation.holds(parents, bodies) for parents, found in on for bodies in found.good)
