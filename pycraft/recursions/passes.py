"""Equations, the passes over the tree that they form, and the programs formed of passes.

An equation gives one block of a quantity at body k from quantities at k, at its children c or at its parent p. So its operands determine
the direction of the pass over the tree: tip to base if a child is read, base to tip if the parent is read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from ..formula_nodes import Node
from .formulas import COLUMNS, Assembled, At, Cut, DiagonalPart, HingeRow, Identity, Part, Quantity


# ---------------------------------------------------------------------- equations and passes
@dataclass(frozen=True)
class Term:
    """c · formula; `over` "c": summed over the children, "p": only if there is a parent, "bodies": summed over all bodies k.

    With `body`, the term exists only at this body.
    """

    node: Node
    coefficient: float = 1.0
    over: str = ""
    body: int | None = None


@dataclass(frozen=True)
class Equation:
    """target(k) = Σ terms; no terms: zero. `symmetric`: symmetric in exact arithmetic, and kept symmetric."""

    target: Quantity
    terms: tuple[Term, ...]
    symmetric: bool = False


@dataclass
class Sweep:
    """Equations of body k, for all bodies: direction -1 tip to base, 1 base to tip, 0 in any order."""

    tree: int
    direction: int
    equations: list[Equation]
    title: str = ""


@dataclass
class Once:
    """An equation for the whole: its target is a matrix, a number, or all blocks of a quantity at once."""

    equation: Equation


@dataclass(frozen=True, eq=False)
class System:
    """T s = b: the equations of a realization. Relation i: Σ terms[i] over states s_j = inputs[i].

    A term of a relation is (term, j): it multiplies state j. States and equations of body spaces are cut by `cuts[j]`; a number
    there means that state j belongs to no body (the border).
    """

    quantity: Quantity
    tree: int
    states: tuple[Quantity, ...]
    cuts: tuple[Cut | int, ...]
    relations: tuple[tuple[tuple[Term, int], ...], ...]

    @property
    def border(self) -> bool:
        """True if some states belong to no body."""
        return any(isinstance(cut, int) for cut in self.cuts)


@dataclass
class Elimination:
    """The system's blocks are assembled and eliminated, leaves to root."""

    system: System


@dataclass
class Solution:
    """The system solved for one right-hand side: inputs[i] are the terms of equation i, `wanted` the requested states."""

    system: System
    inputs: tuple[tuple[Term, ...], ...]
    states: dict[int, Quantity]
    columns: str | int = COLUMNS


@dataclass
class Selected:
    """The diagonal blocks Z(k,k) of the inverse of an eliminated system, base to tip."""

    system: System
    quantity: Quantity


@dataclass
class CompositeAssembly:
    """ℳ from the composite-body inertias R: the columns of body k carried to its ancestors."""

    target: Quantity
    tree: int
    H: Quantity
    R: Quantity
    E: Quantity
    J: Quantity | None
    rows: Cut


@dataclass
class Operator:
    """A recursion inside a recursion: w = X x of an operator formed as a dense matrix; `quantity` is X."""

    quantity: Quantity
    text: str
    program: Program


Item = Sweep | Once | Elimination | Solution | Selected | CompositeAssembly | Operator


# ---------------------------------------------------------------------- formulas that read a system or an operator
@dataclass(frozen=True)
class SystemLogdet(Node):
    """ln|det T| of an eliminated system."""

    system: System


@dataclass(frozen=True)
class InverseBlock(Node):
    """The block (state j, equation i) of Z(k,k), the inverse of an eliminated system."""

    system: System
    quantity: Quantity
    state: int
    equation: int


@dataclass(frozen=True)
class MadeDense(Node):
    """The matrix of an operator given by its recursion, applied to the columns of the identity."""

    operator: Operator


# ---------------------------------------------------------------------- what is read and written
def quantities_in(node: Node) -> Iterator[Quantity]:
    """Every quantity that a formula reads."""
    if isinstance(node, (At, HingeRow, Part, DiagonalPart, Assembled, InverseBlock)):
        yield node.quantity
    if isinstance(node, SystemLogdet):
        yield node.system.quantity
    if isinstance(node, MadeDense):
        yield from reads(node.operator)
    for inner in node.children:
        yield from quantities_in(inner)


def tree_in(node: Node) -> int:
    """The tree whose bodies a formula runs over; -1 for none."""
    if isinstance(node, Identity) and isinstance(node.cut, Cut):
        return node.cut.tree
    own = [q.tree for q in quantities_in(node) if q.tree >= 0]
    inner = [tree_in(child) for child in node.children]
    return max([-1, *own, *inner])


def reads(item: Item) -> Iterator[Quantity]:
    """Every quantity that an item reads."""
    if isinstance(item, (Sweep, Once)):
        for equation in item.equations if isinstance(item, Sweep) else [item.equation]:
            yield from (q for term in equation.terms for q in quantities_in(term.node))
    elif isinstance(item, Elimination):
        for relation in item.system.relations:
            yield from (q for term, _ in relation for q in quantities_in(term.node))
    elif isinstance(item, Solution):
        yield item.system.quantity
        yield from (q for terms in item.inputs for term in terms for q in quantities_in(term.node))
    elif isinstance(item, Selected):
        yield item.system.quantity
    elif isinstance(item, CompositeAssembly):
        yield from (q for q in (item.H, item.R, item.E, item.J) if q is not None)
    else:
        yield from (q for inner in item.program.items for q in reads(inner))
        yield item.program.result


def writes(item: Item) -> list[Quantity]:
    """Every quantity that an item defines."""
    if isinstance(item, Sweep):
        return [equation.target for equation in item.equations]
    if isinstance(item, Once):
        return [item.equation.target]
    if isinstance(item, Elimination):
        return [item.system.quantity]
    if isinstance(item, Solution):
        return list(item.states.values())
    if isinstance(item, Selected):
        return [item.quantity]
    return [item.target] if isinstance(item, CompositeAssembly) else []


# ---------------------------------------------------------------------- programs
@dataclass
class Leaf:
    """A quantity that is given: a symbol's blocks at a context's state, a user's constant, or an external operator."""

    quantity: Quantity
    source: str  # "symbol", "root frame", "constant", "external"
    context: int = -1
    symbol: str = ""
    arguments: tuple[Any, ...] = ()
    numbers: Any = None


@dataclass
class Program:
    """A recursion: its inputs, its passes in order, and its result."""

    inputs: list[Quantity] = field(default_factory=list)
    items: list[Item] = field(default_factory=list)
    result: Quantity = None  # type: ignore[assignment]  # set when the recursion is written
    identity_columns: bool = False  # x is the identity


def fused(items: list[Item]) -> list[Item]:
    """Fuse neighbouring passes over one tree in the same direction: every equation still reads final values."""
    made: list[Item] = []
    for item in items:
        last = made[-1] if made else None
        if isinstance(item, Sweep) and isinstance(last, Sweep) and item.tree == last.tree:
            if item.direction == last.direction or 0 in (item.direction, last.direction):
                made[-1] = Sweep(item.tree, item.direction or last.direction, last.equations + item.equations)
                continue
        made.append(item)
    return made


def pruned(items: list[Item], needed: set[Quantity]) -> list[Item]:
    """Return the passes without equations that nobody reads; `needed` grows by the operands of the others."""
    kept: list[Item] = []
    for item in reversed(items):
        if isinstance(item, Sweep):
            before = -1
            while before != len(needed):  # an earlier equation may read this one at a child or a parent
                before = len(needed)
                for equation in reversed(item.equations):
                    if equation.target in needed:
                        needed.update(q for term in equation.terms for q in quantities_in(term.node))
            equations = [equation for equation in item.equations if equation.target in needed]
            if equations:
                kept.append(Sweep(item.tree, item.direction, equations, item.title))
        elif isinstance(item, Operator) or needed.intersection(writes(item)):
            if isinstance(item, Operator):
                item.program.items = pruned(item.program.items, needed | {item.program.result})
            needed.update(reads(item))
            kept.append(item)
    return kept[::-1]
