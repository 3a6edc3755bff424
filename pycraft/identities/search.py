"""The smallest refutation of a false statement.

A refutation that was found is made smaller as long as it refutes: bodies are left out, hinges made simpler, rotor inertias taken away. Then
everything that is smaller still is tried in order of (bodies, degrees of freedom): every tree shape with every choice of hinge kinds,
without and then with rotor inertia, `STATES` seeded states each, so that the first refutation is the smallest among all that were tried.
Welds count as kinds: they are kept, as bodies without a coordinate. Models of welds alone are left out, as they have no state. Models that
have not what the statement names say nothing, and are passed over.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .. import _core
from ..state import State
from .budget import Budget
from .drawn_vectors import drawn_vectors
from .family import DOF, HYPOTHESES, Spec, family, named_vectors, read_on
from .inequalities import judge_read
from .judge import FAILS, BoundState, Verdict, ladder
from .statement_text import telling_of
from .terminal_report import wrapped

__all__ = ["Counterexample", "named_vectors", "refutation", "smallest"]

STATES = 3
KINDS = tuple(sorted(DOF, key=lambda kind: DOF[kind]))
MOVING = tuple(kind for kind in KINDS if DOF[kind])
_BY_SPEED = {"theta_dot", "velocity", "a", "b", "V_tilde", "V_bar", "momentum_cross", "H_dot", "Delta_theta_dot"}
_BY_GRAVITY = {"a", "gravity_field", "gravity_base"}


@dataclass
class Counterexample:
    """The smallest model and state found at which a statement is false, and what was tried before."""

    spec: Spec
    state: State
    residual: float
    tried: int = 0
    """Smaller models that were tried."""
    states: int = STATES
    exhausted: bool = False
    """Whether all smaller ones were tried."""
    meets: frozenset[str] = frozenset()
    """Hypotheses that all models tried had to meet."""
    saved_by: list[str] = field(default_factory=list)
    letters: frozenset[str] = frozenset()

    @property
    def parents(self) -> list[int]:
        return list(self.spec.parents)

    @property
    def kinds(self) -> list[str]:
        return list(self.spec.kinds)

    @property
    def rotor_inertia(self) -> bool:
        return self.spec.rotor_inertia

    @property
    def bodies(self) -> int:
        return len(self.spec.parents)

    @property
    def q(self) -> np.ndarray:
        return self.state.q

    @property
    def v(self) -> np.ndarray:
        return self.state.v

    def model(self) -> Any:
        """The model, at the refuting state, with the gravity it was tried in."""
        model = self.spec.model()
        model.q, model.v = self.state.q, self.state.v
        return model

    def __repr__(self) -> str:
        options = ", rotor_inertia=True" if self.rotor_inertia else ""
        options += ', welds="keep"' if "weld" in self.kinds else ""
        shown = [("q", self.q)] + [("v", self.v)] * bool(self.letters & _BY_SPEED)
        shown += [("gravity", np.asarray(self.model().gravity))] * bool(self.letters & _BY_GRAVITY)
        numbers = [f"{name} = {np.array2string(x, precision=4, separator=', ', max_line_width=10**6)}" for name, x in shown]
        lines = [
            f"smallest counterexample: {self.spec}",
            f"  pc.tree({self.parents}, {self.kinds}, seed={self.spec.seed}{options})",
            *(f"  {line}" for line in numbers),
            f"  relative residual {self.residual:.1e}",
        ]
        that = f" that meets {', '.join(h for h in HYPOTHESES if h in self.meets)}" if self.meets else ""
        counted = f"{self.tried} models, {self.states} states each"
        if self.exhausted and not self.tried:
            lines.append(f"  no tree with a choice of hinge kinds{that} is smaller")
        elif self.exhausted:
            lines += [f"  every smaller tree shape and choice of hinge kinds{that} was tried:", f"  {counted}"]
        else:
            lines.append("  no body of it can be left out and no hinge made simpler;")
            lines += [f"  of what is smaller{that} not all was tried:", f"  {counted}"]
        return "\n".join(wrapped(f"  {line}") for line in lines)


def understood(text: str) -> str:
    """How a text reads on a small tree, in the package's own letters; empty where it reads on a model of its own alone."""
    spec = Spec((-1, 0), ("pin", "pin"), True, 1)
    try:
        read = read_on(text, spec, spec.model())
    except _core.Error:
        read = None
    return "" if read is None else read.understood


# ---------------------------------------------------------------------- one model
def judged(
    text: str, spec: Spec, states: int = 1, precision: str | int = "extended", vectors: Mapping[str, str] | None = None
) -> Verdict | None:
    """The verdict on a model: up to the first state that refutes. None where it has not what the statement names, or no inverse exists."""
    model = spec.model()
    read = read_on(text, spec, model, vectors)
    if read is None or read.rhs is None:
        return None
    rng = np.random.default_rng(spec.seed)
    options: dict[str, Any] = dict(precisions=ladder(precision), decides=telling_of(read))
    found = Verdict()
    for state in spec.states(model, states):
        drawn = drawn_vectors(read.rhs, rng, drawn_vectors(read.lhs, rng, {}))
        try:
            found.judgements.append(judge_read(read, BoundState(model.soa, state), drawn, **options))
        except ArithmeticError:
            continue
        if found.judgements[-1].verdict == FAILS:
            break
    return found if found.judgements else None


def refutation(
    text: str, spec: Spec, precision: str | int = "extended", states: int = STATES, vectors: Mapping[str, str] | None = None
) -> Counterexample | None:
    """The first state of a model that refutes, or None."""
    found = judged(text, spec, states, precision, vectors)
    if found is None or found.verdict != FAILS:
        return None
    return Counterexample(spec, found.shown.state, found.shown.decisive.residual, states=states)


# ---------------------------------------------------------------------- smaller
def _without(spec: Spec, k: int) -> Spec:
    """The model without body k, its children moved to its parent."""
    parents = [spec.parents[k] if p == k else p for i, p in enumerate(spec.parents) if i != k]
    kinds = tuple(kind for i, kind in enumerate(spec.kinds) if i != k)
    return replace(spec, parents=tuple(p - (p > k) for p in parents), kinds=kinds)


def _smaller(spec: Spec) -> Iterator[Spec]:
    """One step smaller: halves first, then a body less, then a simpler hinge, then no rotor inertia."""
    n = len(spec.parents)
    if n > 3:
        half = spec
        for _ in range(n // 2):
            half = _without(half, len(half.parents) - 1)
        yield half
    if n > 1:
        yield from (_without(spec, k) for k in reversed(range(n)))
    for k, kind in enumerate(spec.kinds):
        yield from (replace(spec, kinds=(*spec.kinds[:k], simpler, *spec.kinds[k + 1 :])) for simpler in KINDS[: KINDS.index(kind)])
    if spec.rotor_inertia:
        yield replace(spec, rotor_inertia=False)


def shrunk(
    text: str,
    found: Counterexample,
    allowed: Callable[[Spec], bool],
    precision: str | int,
    budget: Budget,
    states: int = STATES,
    vectors: Mapping[str, str] | None = None,
) -> Counterexample:
    """A refutation of which nothing can be taken away, among the models that are allowed."""
    smaller = True
    while smaller and not budget.over:
        smaller = False
        for spec in _smaller(found.spec):
            if not any(map(DOF.get, spec.kinds)) or not allowed(spec):
                continue
            again = refutation(text, spec, precision, states, vectors)
            if again is not None:
                found, smaller = again, True
                break
            if budget.over:
                break
    return found


def shapes(n: int) -> Iterator[list[int]]:
    """All rooted forests of n bodies with depth-first parents, up to relabelling of siblings."""
    seen = set()
    for parents in itertools.product(*[range(-1, k) for k in range(n)]):
        form = _canonical(list(parents))
        if form not in seen:
            seen.add(form)
            yield list(parents)


def _canonical(parents: list[int]) -> Any:
    children: dict[int, list[int]] = {k: [] for k in range(-1, len(parents))}
    for k, p in enumerate(parents):
        children[p].append(k)

    def form(k: int) -> tuple:
        return tuple(sorted(form(c) for c in children[k]))

    return form(-1)


def candidates(largest: int) -> Iterator[Spec]:
    """Models by bodies, then degrees of freedom, then without before with rotor inertia."""
    for n in range(1, largest + 1):
        moving = (kinds for kinds in itertools.product(KINDS, repeat=n) if any(DOF[k] for k in kinds))
        choices = sorted(moving, key=lambda kinds: sum(DOF[k] for k in kinds))
        forests = list(shapes(n))
        for _, group in itertools.groupby(choices, key=lambda kinds: sum(DOF[k] for k in kinds)):
            same_size = list(group)
            for rotor in (False, True):
                for parents in forests:
                    for kinds in same_size:
                        yield Spec(tuple(parents), kinds, rotor)


def smallest(
    text: str,
    *,
    seed: int = 0,
    precision: str | int = "extended",
    budget: float = 5.0,
    found: Counterexample | None = None,
    meets: frozenset[str] = frozenset(),
    allowed: Callable[[Spec], bool] | None = None,
    vectors: Mapping[str, str] | None = None,
) -> Counterexample | None:
    """The smallest refutation by (bodies, degrees of freedom), or None if none was found within the budget (CPU seconds).

    Parameters
    ----------
    found : a refutation to start from; one is looked for in the family of random trees if left out
    meets : hypotheses that the models must meet
    allowed : says of a model whether it may be tried, besides
    vectors : the spaces of the vectors that the text names. One in a space that no other model has (of nodes, of a user's own)
        is on its own model alone: None at once.
    """
    if not {"Θ", "V", "F"}.issuperset((vectors or {}).values()):
        return None
    whole = Budget(budget)

    def fits(spec: Spec) -> bool:
        return meets <= spec.met and (allowed is None or allowed(spec))

    if found is None:
        tries = (spec for spec in family(1) if not whole.over and fits(spec))
        found = next((r for spec in tries if (r := refutation(text, spec, precision, vectors=vectors)) is not None), None)
    if found is not None:
        found = shrunk(text, found, fits, precision, Budget(budget / 2), vectors=vectors)
    limit = (4, 24) if found is None else found.spec.size
    tried, first, complete = 0, None, True
    for spec in candidates(limit[0]):
        if (*spec.size, spec.rotor_inertia) >= (*limit, found is not None and found.rotor_inertia):
            break
        if whole.over:
            complete = False
            break
        if not fits(spec):
            continue
        first = refutation(text, replace(spec, seed=seed), precision, vectors=vectors)
        if first is not None:
            break
        tried += 1
    result = first or found
    if result is not None:
        result.tried, result.exhausted, result.meets = tried, complete, meets
        read = read_on(text, result.spec, result.model(), vectors)
        result.letters = frozenset() if read is None else _letters(read.lhs) | _letters(read.rhs)
    return result


def _letters(side: Any) -> frozenset[str]:
    """Names of the letters of a side."""
    if isinstance(side, _core.Scalar):
        return frozenset().union(*(_letters(e) for e in side.operands()))
    if not isinstance(side, _core.Operator):
        return frozenset()
    return frozenset({side.name}).union(*(_letters(c) for c in side.children))
