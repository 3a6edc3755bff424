"""Intermediate results of a recursion: its Python source is run once, and every block is kept in the order of the passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from .formulas import Quantity
from .naming import total
from .passes import CompositeAssembly, Elimination, Item, Program, Selected, Solution, Sweep, writes
from .recursion import Line, Text


@dataclass(frozen=True)
class Step:
    """One equation at one body, or one computation of the whole.

    Attributes
    ----------
    line : index in `Algorithm.lines()`; for a computation of the whole, the first of several
    lines : number of lines
    number, direction : number of the pass and its direction, -1 tip to base, 1 base to tip, 0 in any order
    tree, body : the body's number in a tree of the plan; -1 for the whole
    letter, name : the quantity's letter in text and its name in source
    value : the block, (rows, columns); empty, (0, 0), for the whole
    """

    line: int
    lines: int
    number: int
    direction: int
    tree: int
    body: int
    letter: str
    name: str
    value: np.ndarray


@dataclass(frozen=True)
class Pass:
    """One pass of a recursion over a tree, or one computation of the whole.

    Attributes
    ----------
    ways : successive directions of the pass, -1 tip to base, 1 base to tip; empty if the order is free
    parents : parents of the tree's bodies, -1 the base; None for a computation of the whole
    lines : indentation and text of each line, as in `Algorithm.lines()`
    """

    ways: tuple[int, ...]
    parents: tuple[int, ...] | None
    lines: list[Line]


def told_passes(program: Program, trees: Sequence[Any]) -> list[Pass]:
    """`Algorithm.passes`."""
    return [Pass(*_passed(item, trees), Text().item(item)) for item in program.items]


def _passed(item: Item, trees: Sequence[Any]) -> tuple[tuple[int, ...], tuple[int, ...] | None]:
    """Ways and parents of a pass."""
    match item:
        case Sweep():
            return (item.direction,) if item.direction else (), tuple(trees[item.tree].parents)
        case Elimination():
            return (-1,), tuple(trees[item.system.tree].parents)
        case Solution():
            return (-1, 1), tuple(trees[item.system.tree].parents)
        case Selected():
            return (1,), tuple(trees[item.system.tree].parents)
        case CompositeAssembly():
            return (-1,), tuple(trees[item.tree].parents)
    return (), None


def taken_steps(program: Program, arguments: list[Quantity], source: str, data: dict[str, Any], x: Any) -> list[Step]:
    """Return `Algorithm.steps`; the source defines a function `algorithm(data, ...)` that returns everything by name."""
    names: dict[str, Any] = {}
    exec(compile(source, "<recursion>", "exec"), names)
    given = [] if program.identity_columns else [_given(quantity, x, quantity in program.inputs) for quantity in arguments]
    kept = names["algorithm"](data, *given)
    steps: list[Step] = []
    line = 0
    for number, item in enumerate(program.items):
        count = len(Text().item(item))
        steps += _of_sweep(item, number, line, kept) if isinstance(item, Sweep) else [_whole(item, number, line, count)]
        line += count
    return steps


def _of_sweep(sweep: Sweep, number: int, line: int, kept: dict[str, Any]) -> list[Step]:
    blocks = [kept[equation.target.name] for equation in sweep.equations]
    bodies = range(len(blocks[0]) if blocks else 0)
    words = [Text().letter(equation.target) for equation in sweep.equations]
    return [
        Step(line + 1 + i, 1, number, sweep.direction, sweep.tree, k, words[i], equation.target.name, np.asarray(blocks[i][k]))
        for k in (reversed(bodies) if sweep.direction < 0 else bodies)
        for i, equation in enumerate(sweep.equations)
    ]


def _whole(item: Item, number: int, line: int, count: int) -> Step:
    written = writes(item)
    return Step(
        line, count, number, 0, -1, -1, ", ".join(Text().letter(q) for q in written), ", ".join(q.name for q in written), np.zeros((0, 0))
    )


def _given(quantity: Quantity, x: Any, is_input: bool) -> np.ndarray:
    n = total(quantity.rows)
    if x is None or not is_input:
        return np.ones(n)
    given = np.asarray(_core.real_array(x, "x"), float)
    if given.ndim not in (1, 2) or given.shape[0] != n or not np.isfinite(given).all():
        raise _core.EvaluationError(f"x takes {n} finite values, or a matrix of such columns, not an array {given.shape}")
    return given
