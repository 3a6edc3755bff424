"""Random models that between them meet and break every standard hypothesis: where statements without a model of their own are tried.

The models are sorted into cells: serial chains and trees, without and with rotor inertia, hinges of one coordinate, of several on a
constant H, of every kind, on a fixed and on a free base. In each cell there are small, bushy and deep ones: blocks of E_φ^k vanish on trees
of depth k, so some are deep. Every model moves and feels gravity; each body k has a node "node<k>" beside its own frame.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from .. import _core
from ..models.generators import tree
from ..state import State
from .parse import Statement, Statements
from .part_letters import VECTORS

_SIZES = {kind: row.nv for kind, row in _core.hinge_kinds.items()} | {"custom": 3}
DOF = dict(sorted(_SIZES.items(), key=lambda item: item[1]))
"""Degrees of freedom of the hinge kinds, fewest first; of the custom hinges of `pycraft.tree`."""
ONE_SUBHINGE = tuple(kind for kind, row in _core.hinge_kinds.items() if len(row.subhinges) < 2 and kind != "custom")
"""Kinds whose H is constant."""
HYPOTHESES = ("J = 0", "serial chain", "constant H", "single-DOF hinges", "free root")
"""The standard hypotheses, as the theorems name them."""
DEPTH = 12
"""Bodies on the longest path of the deep models."""


@dataclass(frozen=True)
class Spec:
    """A model by rule: what `pycraft.tree` is given, gravity and one state."""

    parents: tuple[int, ...]
    kinds: tuple[str, ...]
    rotor_inertia: bool
    seed: int = 0

    @property
    def size(self) -> tuple[int, int]:
        """Bodies, degrees of freedom."""
        return len(self.parents), sum(DOF[kind] for kind in self.kinds)

    @property
    def met(self) -> frozenset[str]:
        """The hypotheses that it meets."""
        n, roots = len(self.parents), [k for k, p in enumerate(self.parents) if p < 0]
        said = {
            "J = 0": not self.rotor_inertia,
            "serial chain": self.parents == tuple(range(-1, n - 1)),
            "constant H": all(kind in ONE_SUBHINGE for kind in self.kinds),
            "single-DOF hinges": all(DOF[kind] <= 1 for kind in self.kinds),
            "free root": len(roots) == 1 and self.kinds[roots[0]] == "free",
        }
        return frozenset(name for name, is_met in said.items() if is_met)

    def model(self) -> Any:
        """The model, with gravity and a node on every body."""
        model = tree(self.parents, self.kinds, seed=self.seed, rotor_inertia=self.rotor_inertia, welds="keep")
        rng = np.random.default_rng([self.seed, 1])
        model.gravity = rng.uniform(1, 10, 3) * rng.choice([-1, 1], 3)
        for k in range(len(self.parents)):
            turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            model.add_node(f"node{k}", f"body{k}", rotation=turn * np.linalg.det(turn), position=rng.uniform(-1, 1, 3))
        return model

    def states(self, model: Any, count: int) -> list[State]:
        """Seeded states of the model, velocities included."""
        rng = np.random.default_rng(self.seed)
        return [model.random_state(rng) for _ in range(count)]

    def __str__(self) -> str:
        shape = "one body" if len(self.parents) == 1 else f"{len(self.parents)} bodies, parents {list(self.parents)}"
        return f"{shape}, hinges {', '.join(self.kinds)}" + (", with rotor inertia" if self.rotor_inertia else "")


@dataclass(frozen=True)
class Cell:
    """A class of models: tree or chain, with or without J, which hinges, on which base."""

    shape: str
    J: str
    hinges: str
    base: str

    def __str__(self) -> str:
        return f"{self.shape}, {self.J}, {self.hinges}, {self.base}"

    def holds(self, spec: Spec) -> bool:
        """Whether a model belongs to the cell, or is one of the simpler models that it includes."""
        met = spec.met
        others = [kind for k, kind in enumerate(spec.kinds) if spec.parents[k] >= 0 or self.base == FIXED]
        return (
            (self.shape == TREE or "serial chain" in met)
            and (self.J == WITH_J or not spec.rotor_inertia)
            and all(kind in _KINDS[self.hinges] for kind in others)
            and (self.base == FIXED) == (spec.kinds[0] != "free")
        )

    @property
    def least(self) -> frozenset[str]:
        """The hypotheses that every model of the cell meets."""
        free = self.base == FREE
        said = {
            "J = 0": self.J != WITH_J,
            "serial chain": self.shape == CHAIN,
            "constant H": self.hinges != EVERY,
            "single-DOF hinges": self.hinges == ONE and not free,
            "free root": free,
        }
        return frozenset(name for name, is_met in said.items() if is_met)


CHAIN, TREE = "chain", "tree"
NO_J, WITH_J = "J = 0", "J > 0"
ONE, CONSTANT, EVERY = "single-DOF", "constant H", "every kind"
FIXED, FREE = "fixed base", "free base"
CELLS = tuple(Cell(*choice) for choice in itertools.product((CHAIN, TREE), (NO_J, WITH_J), (ONE, CONSTANT, EVERY), (FIXED, FREE)))
_KINDS = {ONE: ("weld", "pin", "slider", "screw"), CONSTANT: ONE_SUBHINGE, EVERY: tuple(DOF)}
_TELLING = {ONE: ("pin", "screw"), CONSTANT: ("ball", "free"), EVERY: ("universal", "custom", "gimbal", "planar", "cylindrical")}
_TREES = (
    (-1, 0, 0, 1),
    (-1, 0, 1, 1, 0, 3, 3),
    (-1, *range(DEPTH - 1), 0, 3, DEPTH),  # deep, with two branches
    (-1, *[0] * 8),  # wide
)
_CHAINS = tuple(tuple(range(-1, n - 1)) for n in (2, 4, DEPTH, 6))
VARIANTS = len(_TREES)


@cache
def specs(cell: Cell, depth: int = DEPTH) -> tuple[Spec, ...]:
    """The models of a cell: small, middle, deep, and wide or of every kind."""
    number = CELLS.index(cell)
    found = []
    for i, parents in enumerate(_TREES if cell.shape == TREE else _CHAINS):
        rng = np.random.default_rng([7, number, i])
        if i == 2 and depth > DEPTH:
            parents = tuple(range(-1, depth - 1)) + ((0, 3, depth) if cell.shape == TREE else ())
        kinds = [str(kind) for kind in rng.choice([kind for kind in _KINDS[cell.hinges] if kind not in ("weld", "free")], len(parents))]
        kinds[1] = _TELLING[cell.hinges][(number + i) % len(_TELLING[cell.hinges])]
        if i == 1:
            kinds[-2] = "weld"
        if cell.base == FREE:
            kinds[0] = "free"
        found.append(Spec(parents, tuple(kinds), cell.J == WITH_J, int(rng.integers(2**31))))
    return tuple(found)


def family(count: int, depth: int = DEPTH) -> list[Spec]:
    """At least `count` models (and one of each cell): small, middle, deep and wide ones in turn, so that every cell has each in the end."""
    rounds = -(-max(count, 1) // len(CELLS))
    return [
        specs(cell, depth)[(number + number // VARIANTS + turn) % VARIANTS]
        for turn in range(min(rounds, VARIANTS))
        for number, cell in enumerate(CELLS)
    ]


def respelled(text: str, spec: Spec) -> str:
    """The text as it is said of this model: the one coordinate of a hinge bears its name, of several each a number as well."""

    def coordinate(found: re.Match[str]) -> str:
        k, index = int(found[1]), found[2]
        if k >= len(spec.kinds):
            return found[0]
        single = DOF[spec.kinds[k]] == 1
        return f"hinge{k}" if single and index == "[0]" else f"hinge{k}[0]" if not single and not index else found[0]

    return re.sub(r"\bhinge(\d+)(\[\d+\])?", coordinate, text)


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
            if side.kind == "vector" and side.name not in VECTORS:
                found[side.name] = side.codomain.name
    return found


def read_on(text: str, spec: Spec, model: Any, vectors: Mapping[str, str] | None = None) -> Statement | None:
    """The statement on this model; None where it names what the model has not. `vectors` names the spaces of the vectors in the text."""
    spaces = {space.name: space for space in (model.soa.Theta, model.soa.V, model.soa.F)}
    if not spaces.keys() >= set((vectors or {}).values()):
        return None
    named = {name: _core.vector(name, spaces[space]) for name, space in (vectors or {}).items()}
    try:
        return Statements(model.soa, named).read(respelled(text, spec), inequalities=True)
    except (_core.EvaluationError, _core.SpaceError, _core.ModelError):
        return None


def nilpotency(side: Any) -> int:
    """The largest number of factors in a product: as deep a tree must be for none of them to vanish by its depth."""
    if isinstance(side, _core.Scalar):
        return max((nilpotency(e) for e in side.operands()), default=0)
    if not isinstance(side, _core.Operator):
        return 0
    if side.kind == "product":
        return sum(nilpotency(c) for c in side.children)
    return max((nilpotency(c) for c in side.children), default=1)
