"""Truth maps as pictures, in HTML and by Matplotlib: one tile per cell, with the smallest case drawn as a tree in false cells."""

from __future__ import annotations

from html import escape
from typing import Any

from ..models.tree_places import tree_places
from ..operators.formula_html import formula_html
from .verdict_html import BLUE, MARKS, ORANGE, verdict_html

_STEP, _ROW, _MARGIN, _RADIUS = 62.0, 34.0, 10.0, 6.0
"""Pixels from a body to its children, from leaf to leaf, of the margin, and of a body."""


def truth_html(found: Any) -> str:
    """Return a truth map as a table: verdicts, and the smallest cases as trees on their sides, with hinge names and rings for rotors."""
    rows, columns, cells = _grid(found)
    edge = "border:1px solid rgba(128,128,128,.4);padding:4px 8px;text-align:left;vertical-align:top"
    head = "".join(f'<th style="{edge}">{escape(c)}</th>' for c in ("tree, J, base", *columns))
    lines = []
    for row in rows:
        data = "".join(f'<td style="{edge}">{_cell(cells[row, column])}</td>' for column in columns)
        lines.append(f'<tr style="background:transparent"><th style="{edge}">{escape(", ".join(row))}</th>{data}</tr>')
    drawn = any(c.example is not None for c in found.cells)
    ring = any(c.example is not None and c.example.rotor_inertia for c in found.cells)
    legend = "in false cells the smallest case: its base ■, and each body ● with the hinge that carries it" if drawn else ""
    legend += f'; <span style="color:{ORANGE}">◯</span> around one with a rotor, J &gt; 0' if ring else ""
    return (
        f'<div style="font:13px/1.4 system-ui,sans-serif;color:inherit"><p>{formula_html(found.statement)}<br>'
        f'<b>{escape(found.verdict)}</b></p><div style="overflow-x:auto">'
        f'<table style="table-layout:auto;border-collapse:collapse;color:inherit;font-size:12px"><tr>{head}</tr>'
        f"{''.join(lines)}</table></div>"
        f'<div style="font-size:80%">{legend}</div></div>'
    )


def truth_page(found: Any) -> str:
    """Return a truth map as a self-contained page."""
    head = "<!DOCTYPE html>\n<html lang='en'><meta charset='utf-8'><meta name='color-scheme' content='light dark'>"
    return f"{head}<title>{escape(found.statement)}</title><body style='margin:16px'>{truth_html(found)}</body></html>\n"


def truth_size(found: Any) -> tuple[float, float]:
    """Return the size of the picture by `truth_plot`, inches."""
    rows, columns, _ = _grid(found)
    return 2.9 * len(columns) + 1.5, 0.72 * len(rows) + 1


def truth_plot(found: Any, ax: Any = None) -> Any:
    """Draw a truth map: one tile per cell, with the tree and the hinges of the smallest case in each false cell; return the axes."""
    import matplotlib.pyplot as plt

    rows, columns, cells = _grid(found)
    if ax is None:
        _, ax = plt.subplots(figsize=truth_size(found), layout="constrained")
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            cell = cells[row, column]
            sign, colour = MARKS[cell.verdict]
            ax.add_patch(plt.Rectangle((j, i), 1, 1, facecolor=colour, alpha=0.25, edgecolor="white", linewidth=2))
            if cell.example is None:
                ax.text(j + 0.5, i + 0.5, f"{sign} {cell.verdict}", ha="center", va="center", fontsize=8)
                continue
            ax.text(j + 0.03, i + 0.08, f"{sign} {cell.verdict}", ha="left", va="top", fontsize=7)
            _draw(ax, cell.example, j, i)
    ax.set(xlim=(0, len(columns)), ylim=(len(rows), 0), title=f"{found.statement}\n{found.verdict}")
    ax.set_xticks([j + 0.5 for j in range(len(columns))], columns)
    ax.set_yticks([i + 0.5 for i in range(len(rows))], [", ".join(row) for row in rows])
    ax.tick_params(length=0)
    for side in ax.spines.values():
        side.set_visible(False)
    return ax


def _draw(ax: Any, case: Any, left: float, top: float) -> None:
    """Draw the tree of a smallest case in the unit tile at (left, top), root to the left."""
    places = tree_places(case.parents)
    x, y = left + 0.3 + 0.58 * places[:, 1], top + 0.22 + 0.5 * places[:, 0]
    if len(set(case.parents)) < len(case.parents):  # a branch, with names to its right
        x -= 0.14
    for k, p in enumerate(case.parents):  # -1, the base, is the last place
        ax.plot([x[p], x[k]], [y[p], y[k]], color="0.35", lw=1.2, zorder=2)
    ax.plot(x[-1:], y[-1:], "s", color="k", ms=4, zorder=3)
    ring = dict(mec=ORANGE, mew=1.6) if case.rotor_inertia else dict(mec="white", mew=0.5)
    ax.plot(x[:-1], y[:-1], "o", color=BLUE, ms=6, zorder=3, **ring)
    leaves = set(range(len(case.parents))) - set(case.parents)
    for k, kind in enumerate(case.kinds):
        if k in leaves and len(leaves) > 1:  # others are above and below
            ax.text(x[k] + 0.03, y[k], kind, ha="left", va="center", fontsize=6)
        else:
            ax.text(x[k], y[k] + 0.1, kind, ha="center", va="top", fontsize=6)


def _grid(found: Any) -> tuple[list[tuple[str, str, str]], list[str], dict[Any, Any]]:
    """Return rows (shape, J, base), columns (hinges), and cells by row and column of a truth map."""
    rows = list(dict.fromkeys((c.cell.shape, c.cell.J, c.cell.base) for c in found.cells))
    columns = list(dict.fromkeys(c.cell.hinges for c in found.cells))
    return rows, columns, {((c.cell.shape, c.cell.J, c.cell.base), c.cell.hinges): c for c in found.cells}


def _cell(cell: Any) -> str:
    told = f'title="{escape(cell.word)}; {cell.models} model{"s" * (cell.models != 1)} tried"'
    drawn = "" if cell.example is None else _case_svg(cell.example, cell.word)
    return f"<div {told}>{verdict_html(cell.verdict)} {drawn}</div>"  # a notebook that is not trusted shows the drawing's words


def _case_svg(case: Any, words: str) -> str:
    """Return the tree of a smallest case on its side."""
    places = tree_places(case.parents)
    depth = round(1 / min(places[:-1, 1], default=1.0))  # a root's place is one over the depth
    leaves = len(set(range(len(case.parents))) - set(case.parents)) or 1
    width, height = _STEP * depth + 3.5 * _MARGIN + 18, _ROW * leaves + 4
    x, y = _MARGIN + places[:, 1] * _STEP * depth, places[:, 0] * (height - 4) - 3
    parts = [
        f'<line x1="{x[p]:.0f}" y1="{y[p]:.0f}" x2="{x[k]:.0f}" y2="{y[k]:.0f}" stroke="currentColor" stroke-opacity=".6"/>'
        for k, p in enumerate(case.parents)
    ]
    parts.append(f'<rect x="{x[-1] - 5:.0f}" y="{y[-1] - 5:.0f}" width="10" height="10" fill="currentColor"/>')
    ring = f'stroke="{ORANGE}" stroke-width="3"' if case.rotor_inertia else ""
    for k, kind in enumerate(case.kinds):
        parts.append(f'<circle cx="{x[k]:.0f}" cy="{y[k]:.0f}" r="{_RADIUS:g}" fill="{BLUE}" {ring}/>')
        parts.append(
            f'<text x="{x[k]:.0f}" y="{y[k] + 18:.0f}" text-anchor="middle" font-size="10" fill="currentColor">{escape(kind)}</text>'
        )
    size = f'width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}"'
    style = "display:block;color:inherit;margin-top:4px"
    return f'<svg {size} style="{style}" role="img" aria-label="{escape(words)}">{"".join(parts)}</svg>'
