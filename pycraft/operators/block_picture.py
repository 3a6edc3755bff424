"""Pictures of many blocks: each cell stands for several, blue if the largest entry is positive, orange if it is negative."""

from __future__ import annotations

from html import escape

import numpy as np

CELLS = 48
"""Cells per row or column of the picture."""
_CELL, _FONT = 11.0, 10.0
_LETTERS = 18  # of a label
_DECADES = 8.0


def colour(x: float, scale: float, deepest: float = 0.45) -> str:
    """Return blue or orange over any background, deeper for larger |x|: up to 0.45 text in the page's own colour is legible on it."""
    depth = deepest * min(1.0, max(0.15, 1 + np.log10(abs(x) / scale) / _DECADES))
    return f"rgba({'60,130,220' if x > 0 else '230,120,30'},{depth:.2f})"


def block_picture(numbers: np.ndarray, rows: list[str], columns: list[str]) -> str:
    """Return an SVG of `numbers` (rows, columns), one per block, as at most 48 × 48 cells; hovering shows a cell's blocks and largest
    entry."""
    (tops, lefts), cells = _gathered(numbers)
    scale = np.abs(cells).max(initial=0.0)
    edge = _FONT * 0.62 * min(max((len(name) for name in rows), default=0), _LETTERS) + 8
    head = _FONT * 0.62 * min(max((len(name) for name in columns), default=0), _LETTERS) + 8
    height, width = _CELL * len(tops), _CELL * len(lefts)
    frame = f"x='{edge:.0f}' y='{head:.0f}' width='{width:.0f}' height='{height:.0f}'"
    parts = [f"<rect {frame} fill='none' stroke='currentColor' stroke-opacity='0.4'/>"]
    for i, j in zip(*np.nonzero(cells), strict=True):
        title = f"{_names(rows, tops, i)} × {_names(columns, lefts, j)}: {cells[i, j]:.3g}"
        where = f"x='{edge + _CELL * j:.0f}' y='{head + _CELL * i:.0f}' width='{_CELL:.0f}' height='{_CELL:.0f}'"
        parts.append(f"<rect {where} fill='{colour(cells[i, j], scale, 0.9)}'><title>{escape(title)}</title></rect>")
    every = max(1, round(24 / _CELL))
    for i in range(0, len(tops), every):
        parts.append(f"<text x='{edge - 4:.0f}' y='{head + _CELL * i + 9:.0f}' text-anchor='end'>{escape(_short(rows[tops[i]]))}</text>")
    for j in range(0, len(lefts), every):
        at = f"translate({edge + _CELL * j + 9:.0f} {head - 4:.0f}) rotate(-90)"
        parts.append(f"<text transform='{at}'>{escape(_short(columns[lefts[j]]))}</text>")
    size = f"width='{edge + width + 2:.0f}' height='{head + height + 2:.0f}'"
    style = f"style='max-width:100%;height:auto;color:inherit;font-size:{_FONT:g}px' fill='currentColor'"
    box = f"viewBox='0 0 {edge + width + 2:.0f} {head + height + 2:.0f}'"
    most = -(-max(numbers.shape) // CELLS)
    several = f"{numbers.shape[0]} × {numbers.shape[1]} blocks" + f", up to {most} × {most} a cell" * (most > 1)
    return f"<svg {size} {box} {style} role='img' aria-label='{several}'>{''.join(parts)}</svg><div style='font-size:80%'>{several}</div>"


def _gathered(numbers: np.ndarray) -> tuple[tuple[list[int], list[int]], np.ndarray]:
    """Return the first block of each cell's rows and columns, and for each cell the number of largest magnitude."""
    begins = tuple(list(range(0, n, max(1, -(-n // CELLS)))) for n in numbers.shape)
    most = np.maximum.reduceat(np.maximum.reduceat(numbers, begins[0], axis=0), begins[1], axis=1)
    least = np.minimum.reduceat(np.minimum.reduceat(numbers, begins[0], axis=0), begins[1], axis=1)
    return (begins[0], begins[1]), np.where(most >= -least, most, least)


def _names(names: list[str], begins: list[int], i: int) -> str:
    last = (begins[i + 1] if i + 1 < len(begins) else len(names)) - 1
    return names[begins[i]] if last == begins[i] else f"{names[begins[i]]} … {names[last]}"


def _short(name: str) -> str:
    return name if len(name) <= _LETTERS else name[: _LETTERS - 1] + "…"
