"""Operators as labelled blocks: rows and columns by body, hinge or node name, for indexing and display."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from html import escape
from typing import Any

import numpy as np

from .. import _core
from .block_picture import block_picture, colour

ENTRIES = 12
"""Up to this many rows and columns every entry is shown; beyond, one number per block."""
BLOCKS = 40
"""Largest number of blocks per row or column of the HTML table; larger ones are a picture; the text shows as many columns as fit."""
_COLUMNS = 256
"""Columns to which an operator is applied at a time if its blocks are displayed but not stored."""
_KEPT = 4_000_000
"""Largest number of entries of a dense form that is formed to display its blocks."""
WIDTH = 80
LEGEND = "largest entry of each block, with its sign"


class BlockView:
    """A dense operator cut into labelled blocks: rows and columns by body, hinge or node name.

    `view["link2", "link3"]` is the block in that row and column; `view.rows`, `view.columns` are the labels. With
    `order="tip-to-base"` the last body comes first, so that φ is lower triangular as in the book. Up to 12 rows and columns every entry is
    shown, lines separate the blocks; beyond, each block shows its largest entry with its sign. In a notebook blue cells are positive,
    orange ones negative, deeper for a larger logarithm of their size; beyond 40 blocks it is a picture of all of them, several per cell.

    `view.values` are the dense values, formed on first use; the display of large operators does not need them, and uses 256 columns at a
    time: for n blocks it takes O(n²) time and n² numbers of memory.
    """

    def __init__(self, operator: _core.Operator, rows: list[tuple[str, slice]], columns: list[tuple[str, slice]], title: str):
        self.title, self.operator = title, operator
        self._rows, self._columns = dict(rows), dict(columns)

    @cached_property
    def values(self) -> np.ndarray:
        return self.operator.dense()

    @property
    def rows(self) -> list[str]:
        return list(self._rows)

    @property
    def columns(self) -> list[str]:
        return list(self._columns)

    def __getitem__(self, key: tuple[str, str]) -> np.ndarray:
        row, column = key
        for name, known in ((row, self._rows), (column, self._columns)):
            if name not in known:
                raise KeyError(f"no block row or column is called {name!r}; there are {', '.join(known)}")
        return self.values[self._rows[row], self._columns[column]]

    def __iter__(self) -> Iterator[tuple[str, str]]:
        return ((r, c) for r in self._rows for c in self._columns)

    def largest(self) -> np.ndarray:
        """The entry of largest magnitude of each block, with its sign, (rows, columns); zero for blocks without entries."""
        return self._largest.copy()

    @cached_property
    def _largest(self) -> np.ndarray:
        rows, columns = list(self._rows.values()), list(self._columns.values())
        if np.prod(self._shape) <= _KEPT:
            return _signed(_signed(self.values, rows, 0), columns, 1)
        out = np.zeros((len(rows), len(columns)))
        count = max((where.stop for where in columns), default=0)
        ordered = sorted(range(len(columns)), key=lambda j: columns[j].start)
        while ordered:
            first = columns[ordered[0]].start
            taken = [j for j in ordered if columns[j].stop <= max(first + _COLUMNS, columns[ordered[0]].stop)]
            ordered = ordered[len(taken) :]
            slab = np.zeros((count, columns[taken[-1]].stop - first))
            slab[first : columns[taken[-1]].stop] = np.eye(slab.shape[1])
            if not slab.size:
                continue
            numbers = self.operator @ slab
            out[:, taken] = _signed(_signed(numbers, rows, 0), [slice(columns[j].start - first, columns[j].stop - first) for j in taken], 1)
        return out

    def norms(self) -> np.ndarray:
        """The magnitude of the largest entry of each block, (rows, columns)."""
        return np.abs(self.largest())

    def on_robot(self, on: str = "robot") -> Any:
        """Return the blocks beside the model at its state, or its tree: hovering over a block highlights the path between its bodies.

        A `LinkedBlocks`, which a notebook displays and which can be saved as a page; see there for the options.
        """
        return _core._face["linked_blocks"](self, on)

    # ------------------------------------------------------------------ display
    @property
    def _shape(self) -> tuple[int, int]:
        height, width = (max((where.stop for where in blocks.values()), default=0) for blocks in (self._rows, self._columns))
        return height, width

    def _cells(self) -> tuple[np.ndarray, list[str], list[str], list[bool], list[bool]]:
        """Return numbers, labels of rows and columns, and the first of each block: entries of small operators, else one number per
        block."""
        if max(self._shape) > ENTRIES:
            return self._largest, self.rows, self.columns, [False] * len(self.rows), [False] * len(self.columns)
        (of_row, rows, top), (of_column, columns, left) = (_entries(blocks) for blocks in (self._rows, self._columns))
        return self.values[np.ix_(of_row, of_column)], rows, columns, top, left

    def __repr__(self) -> str:
        numbers, rows, columns, *_ = self._cells()
        texts = [["·" if x == 0 else f"{x:.3g}" for x in row] for row in numbers]
        edge = max([len(r) for r in rows] + [0]) + 2
        widths = [max(len(c), *(len(row[j]) for row in texts), 1) + 2 if texts else len(c) + 2 for j, c in enumerate(columns)]
        shown = int(np.searchsorted(np.cumsum(widths), WIDTH - edge, side="right"))
        lines = [self.title, " " * edge + "".join(f"{c:>{w}}" for c, w in zip(columns[:shown], widths, strict=False))]
        lines += [
            f"{r:<{edge}}" + "".join(f"{t:>{w}}" for t, w in zip(row[:shown], widths, strict=False))
            for r, row in list(zip(rows, texts, strict=True))[:BLOCKS]
        ]
        counts = ((len(rows) - BLOCKS, "rows"), (len(columns) - shown, "columns"))
        left_out = [f"{more} more {what}" for more, what in counts if more > 0]
        if max(self._shape) > ENTRIES:
            left_out.insert(0, f"{LEGEND}; · is an exact zero")
        return "\n".join([*lines, "; ".join(left_out)] if left_out else lines)

    def _repr_html_(self) -> str:
        if max(len(self._rows), len(self._columns)) > BLOCKS:
            picture = block_picture(self._largest, self.rows, self.columns)
            return f"<p>{escape(self.title)}</p>{picture}<div style='font-size:80%'>{escape(LEGEND)}; blank is an exact zero</div>"
        numbers, rows, columns, top, left = self._cells()
        scale = np.abs(numbers).max(initial=0.0)
        head = "".join(f"<th style='writing-mode:vertical-rl;text-align:left;padding:4px'>{escape(c)}</th>" for c in columns)
        body = "".join(
            f"<tr><th style='text-align:left;position:sticky;left:0;white-space:nowrap'>{escape(r)}</th>"
            + "".join(_cell(x, scale, top[i], left[j]) for j, x in enumerate(numbers[i]))
            + "</tr>"
            for i, r in enumerate(rows)
        )
        notes = [f"{LEGEND}; blank is an exact zero"] if max(self._shape) > ENTRIES else []
        caption = f"<div style='font-size:80%'>{escape('; '.join(notes))}</div>" if notes else ""
        table = (
            f"<table style='table-layout:auto;border-collapse:collapse;font-size:80%;color:inherit'><tr><th></th>{head}</tr>{body}</table>"
        )
        return f"<p>{escape(self.title)}</p><div style='overflow-x:auto;max-width:100%'>{table}</div>{caption}"


def _signed(numbers: np.ndarray, parts: list[slice], axis: int) -> np.ndarray:
    """Return, for each part of an axis, the entry of largest magnitude, with its sign; 0 for an empty part."""
    shape = [*numbers.shape]
    shape[axis] = len(parts)
    out = np.zeros(shape)
    filled = sorted((i for i, part in enumerate(parts) if part.stop > part.start), key=lambda i: parts[i].start)
    if not filled:
        return out
    begins = [parts[i].start for i in filled]
    most, least = (of.reduceat(numbers, begins, axis=axis) for of in (np.maximum, np.minimum))
    found = np.where(most >= -least, most, least)
    if axis == 0:
        out[filled] = found
    else:
        out[:, filled] = found
    return out


def _entries(blocks: dict[str, slice]) -> tuple[list[int], list[str], list[bool]]:
    """Return the entries of labelled blocks in their order: number, label (with the number in its block), whether a block begins there."""
    index: list[int] = []
    labels: list[str] = []
    begins: list[bool] = []
    for name, where in blocks.items():
        size = where.stop - where.start
        index += range(where.start, where.stop)
        labels += [name] if size == 1 else [f"{name}[{k}]" for k in range(size)]
        begins += [k == 0 and bool(index[:-size]) for k in range(size)]
    return index, labels, begins


def _cell(x: float, scale: float, top: bool, left: bool) -> str:
    """Return a cell: blue or orange over any background, with text in the page's own colour, so that it is legible on white and on
    black."""
    lines = "".join(f"border-{side}:1px solid;" for side, there in (("top", top), ("left", left)) if there)
    if x == 0:
        return f"<td style='{lines}text-align:center;padding:2px 6px'></td>"
    return f"<td style='{lines}background:{colour(x, scale)};text-align:right;padding:2px 6px;white-space:nowrap'>{x:.3g}</td>"


def block_view(operator: _core.Operator, order: str = "base-to-tip") -> BlockView:
    """Return the operator's dense form as labelled blocks.

    Raises
    ------
    EvaluationError
        An unknown order; a bound batch of states.
    """
    if order not in ("base-to-tip", "tip-to-base"):
        raise _core.EvaluationError(f"order={order!r}: there are 'base-to-tip' and 'tip-to-base'")
    operator.check_current()
    if operator.batch is not None:
        raise _core.EvaluationError("blocks() shows one state; bind one with .at(q)")

    def labels(space: _core.Space) -> list[tuple[str, slice]]:
        blocks = [(label or str(i), where) for i, (label, where, _) in enumerate(space.blocks)]
        return blocks if order == "base-to-tip" else blocks[::-1]

    title = f"{operator.text()} : {operator.domain.name} → {operator.codomain.name}"
    return BlockView(operator, labels(operator.codomain), labels(operator.domain), title)
