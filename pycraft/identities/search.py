"""The smallest refutation of a false statement, and the hypothesis that would save it.

Models are tried in order of size: by bodies, then degrees of freedom. For a number of bodies every tree shape is tried with every
choice of hinge kinds, without and then with rotor inertia, `STATES` seeded states each, so that the first refutation found is smallest by
(bodies, degrees of freedom) among all that were tried. Welds count as kinds: they are kept, as bodies without a coordinate. Models of
welds alone are left out, as they have no state.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _core
from ..models.generators import tree
from .parse import Statement, Statements
from .report import CheckReport

STATES = 3
DOF = {
    "weld": 0,
    "pin": 1,
    "slider": 1,
    "screw": 1,
    "universal": 2,
    "cylindrical": 2,
    "gimbal": 3,
    "planar": 3,
    "ball": 3,
    "custom": 3,
    "free": 6,
}
KINDS = tuple(sorted(DOF, key=lambda kind: DOF[kind]))
MOVING = tuple(kind for kind in KINDS if DOF[kind])


@dataclass
class Counterexample:
    """The smallest model and state found at which a statement is false, and what was tried before."""

    parents: list[int]
    kinds: list[str]
    rotor_inertia: bool
    seed: int
    q: np.ndarray
    residual: float
    tried: int
    states: int
    hypotheses: list[str] = field(default_factory=list)
    saved_by: list[str] = field(default_factory=list)
    exhausted: bool = True

    @property
    def bodies(self) -> int:
        return len(self.parents)

    def model(self) -> Any:
        """The model, at the refuting state."""
        model = tree(self.parents, self.kinds, seed=self.seed, rotor_inertia=self.rotor_inertia, welds="keep")
        model.q = self.q
        return model

    def __repr__(self) -> str:
        shape = "one body" if self.bodies == 1 else f"{self.bodies} bodies, parents {self.parents}"
        text = f"  smallest counterexample: {shape}, hinges {', '.join(self.kinds)}{', with rotor inertia' if self.rotor_inertia else ''}"
        options = ", rotor_inertia=True" if self.rotor_inertia else ""
        options += ', welds="keep"' if "weld" in self.kinds else ""
        text += f"\n    pc.tree({self.parents}, {self.kinds}, seed={self.seed}{options})"
        text += f"\n    q = {np.array2string(self.q, precision=4, separator=', ')}, relative residual {self.residual:.1e}"
        text += f"\n    every smaller tree shape and choice of hinge kinds was tried, {self.states} states each ({self.tried} models)"
        if self.saved_by:
            text += f"\n    it holds where {' and '.join(self.saved_by)}"
        return text


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


def candidates(largest: int) -> Iterator[tuple[list[int], list[str], bool]]:
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
                        yield parents, list(kinds), rotor


def statement_text(read: Statement) -> str:
    """The statement in Python's spelling, to be read on another model."""
    sides = [
        side if isinstance(side, (int, float)) else side.python() if isinstance(side, _core.Operator) else side.text()
        for side in (read.lhs, read.rhs)
    ]
    return read.text if read.reading != "expressions" else f"{sides[0]} == {sides[1]}"


def named_vectors(read: Statement) -> dict[str, str]:
    """The names of a statement's vectors and of the spaces that they lie in: its text says of neither."""
    found: dict[str, str] = {}
    todo = [read.lhs, read.rhs]
    while todo:
        side = todo.pop()
        if isinstance(side, _core.Scalar):
            todo += side.operands()
        elif isinstance(side, _core.Operator):
            todo += side.children
            if side.kind == "vector":
                found[side.name] = side.codomain.name
    return found


def refutes(
    text: str,
    parents: list[int],
    kinds: list[str],
    rotor: bool,
    seed: int,
    precision: str | int,
    states: int = STATES,
    vectors: Mapping[str, str] | None = None,
) -> Any:
    """(q, residual) at the first refuting state, or None."""
    from .checker import BoundState, drawn_vectors, evaluate

    model = tree(parents, kinds, seed=seed, rotor_inertia=rotor, welds="keep")
    try:
        spaces = {space.name: space for space in (model.soa.Theta, model.soa.V, model.soa.F)}
        named = {name: _core.vector(name, spaces[space]) for name, space in (vectors or {}).items()}
        read = Statements(model.soa, named).read(text)
    except (_core.EvaluationError, _core.SpaceError, _core.ModelError):
        return None
    rng = np.random.default_rng(seed)
    for _ in range(states):
        state = model.random_state(rng)
        drawn = drawn_vectors(read.rhs, rng, drawn_vectors(read.lhs, rng, {}))
        try:
            residuals = evaluate(read.lhs, read.rhs, [BoundState(model.soa, state)], [drawn], precision)
        except ArithmeticError:
            continue
        if residuals.verdict == "fails":
            return state.q, residuals.residual
    return None


def smallest(
    text: str,
    *,
    seed: int = 0,
    precision: str | int = "extended",
    budget: float = 20.0,
    largest: int = 4,
    vectors: Mapping[str, str] | None = None,
) -> Counterexample | None:
    """The smallest refutation by (bodies, degrees of freedom), or None if the budget (seconds) ran out first.

    `vectors` names the spaces of the vectors in the text. One in a space that no other model has (of nodes, of a user's own) is on its
    own model alone: None at once.
    """
    if not {"Θ", "V", "F"}.issuperset((vectors or {}).values()):
        return None
    begin = time.perf_counter()
    for tried, (parents, kinds, rotor) in enumerate(candidates(largest)):
        found = refutes(text, parents, kinds, rotor, seed, precision, vectors=vectors)
        if found is not None:
            q, residual = found
            example = Counterexample(parents, kinds, rotor, seed, q, residual, tried, STATES)
            example.saved_by = saving_hypotheses(text, example, seed, precision, vectors)
            return example
        if time.perf_counter() - begin > budget:
            return None
    return None


_CLASSES: list[tuple[str, list[tuple[list[int], list[str], bool]]]] = [
    ("J = 0", [([-1, 0, 0, 1], ["pin", "slider", "ball", "universal"], False), ([-1, 0, 1], ["free", "pin", "custom"], False)]),
    (
        "the tree is a serial chain",
        [([-1, 0, 1, 2], ["pin", "slider", "ball", "universal"], True), ([-1, 0, 1], ["free", "pin", "custom"], True)],
    ),
    (
        "every hinge has one degree of freedom",
        [([-1, 0, 0, 1], ["pin", "slider", "screw", "pin"], True), ([-1, 0, 1, 1], ["slider", "pin", "pin", "pin"], True)],
    ),
    (
        "H is constant",
        [([-1, 0, 0, 1], ["pin", "ball", "free", "slider"], True), ([-1, 0, 1, 1], ["free", "pin", "ball", "pin"], True)],
    ),
    (
        "the tree is a serial chain and J = 0",
        [([-1, 0, 1, 2], ["pin", "slider", "ball", "universal"], False), ([-1, 0, 1], ["free", "pin", "custom"], False)],
    ),
    (
        "every hinge has one degree of freedom and J = 0",
        [([-1, 0, 0, 1], ["pin", "slider", "screw", "pin"], False), ([-1, 0, 1, 1], ["slider", "pin", "pin", "pin"], False)],
    ),
]


def saving_hypotheses(
    text: str, example: Counterexample, seed: int, precision: str | int, vectors: Mapping[str, str] | None = None
) -> list[str]:
    """Hypotheses under which no refutation was found on trees that meet only them; the weakest first, one is enough."""
    for name, models in _CLASSES:
        if all(refutes(text, parents, kinds, rotor, seed + 1, precision, vectors=vectors) is None for parents, kinds, rotor in models):
            return [name]
    return []


def check_on_trees(text: str, *, states: int, seed: int, search: bool, precision: str | int, budget: float) -> CheckReport:
    """A statement on a family of random trees that between them meet and break every hypothesis."""
    from .checker import run

    rng = np.random.default_rng(seed)
    worst, bound, count, names = 0.0, 0.0, 0, []
    held, undecided = True, False
    for n in (1, 2, 3, 5, 8):
        for rotor in (False, True):
            parents = [-1] + [int(rng.integers(-1, k)) for k in range(1, n)]
            kinds = [str(k) for k in rng.choice(MOVING, n)]
            model = tree(parents, kinds, seed=int(rng.integers(2**31)), rotor_inertia=rotor)
            read = Statements(model.soa).read(text)
            if read.rhs is None:
                raise _core.EvaluationError(f"{text!r} has one side; a statement is lhs == rhs")
            residuals = run(read, model.soa, max(1, states // 10), seed, precision)
            names.append(f"parents {parents}, {', '.join(kinds)}" + (", with rotor inertia" if rotor else ""))
            count += residuals.states
            if residuals.residual >= worst:
                worst, bound = residuals.residual, residuals.bound
            held &= residuals.verdict != "fails"
            undecided |= residuals.verdict == "undecided"
    report = CheckReport(text, held, worst, bound, count, names, undecided=undecided and held)
    if not held and search:
        report.counterexample = smallest(text, seed=seed, precision=precision, budget=budget)
    return report
