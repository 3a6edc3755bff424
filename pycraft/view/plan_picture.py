"""A plan in HTML: its steps with their tiers and costs, and its sweeps, each drawn on the tree beside its equations."""

from __future__ import annotations

from html import escape
from typing import Any

from .. import _core
from ..models.tree_places import tree_places
from ..operators.shown_expression import cost_words, flops_text
from ..recursions import Pass, algorithm
from ..tidy import bytes_text

MOST = 120
"""Largest number of bodies of a tree that is drawn."""
_STEP, _ROW, _MARGIN, _WIDEST = 34.0, 24.0, 12.0, 400.0
"""Pixels from a body to its children, from leaf to leaf, of the margin, and of the widest tree."""
_CELL = "padding:3px 10px 3px 0;text-align:left;vertical-align:top"
_NUMBER = "padding:3px 0 3px 14px;text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums"
_INWARD, _OUTWARD = "#d55e00", "#0072b2"
_WORDS = {(-1,): "tip to base", (1,): "base to tip", (-1, 1): "tip to base, then base to tip", (): "each body separately"}


def plan_html(explanation: Any) -> str:
    """Return the plan of an expression as a table, and its sweeps on the tree with the equations of each (`Explanation._repr_html_`)."""
    expression, request = explanation.expression, explanation.request
    plan = expression.plan(request)
    order, flops = cost_words(plan)
    head = f"<b>{escape(expression.text())}</b>, {escape(_asked(explanation))}: {order}, {flops}"
    notes = "".join(f"<div>by {escape(note)}</div>" for note in plan.notes)
    rows = "".join(
        f'<tr style="background:transparent"><td style="{_NUMBER}">{i}</td>'
        f'<td style="{_CELL};padding-left:12px">{escape(step["text"])}</td>'
        f'<td style="{_CELL}">{escape(step["tier"])}</td><td style="{_NUMBER}">{flops_text(step["flops"])}</td>'
        f'<td style="{_NUMBER}">{bytes_text(round(step["memory"]))}</td></tr>'
        for i, step in enumerate(plan.steps, 1)
    )
    titles = "".join(
        f'<th style="{_NUMBER if i in (0, 3, 4) else _CELL}">{t}</th>' for i, t in enumerate(("", "step", "tier", "cost", "memory"))
    )
    table = f'<table style="table-layout:auto;border-collapse:collapse;color:inherit;font-size:12px"><tr>{titles}</tr>{rows}</table>'
    return (
        f'<div style="font:13px/1.4 system-ui,sans-serif;color:inherit"><div>{head}</div>{notes}<div style="overflow-x:auto">{table}</div>'
        f"{_sweeps(expression, request)}</div>"
    )


def _asked(explanation: str) -> str:
    """Return the request, as given in the second line of the plan."""
    lines = explanation.split("\n")
    return lines[1] if len(lines) > 1 else ""


def _sweeps(expression: Any, request: str) -> str:
    try:
        passes = algorithm(expression, "text", request).passes()
    except (_core.Error, ValueError) as reason:
        return f"<div>its sweeps are not available: {escape(str(reason))}</div>"
    cards = "".join(_card(i, one) for i, one in enumerate(passes, 1))
    return f'<div style="display:flex;flex-wrap:wrap;gap:10px;margin-top:8px">{cards}</div>' if cards else ""


def _card(number: int, one: Pass) -> str:
    """Return a pass: its number and direction, the tree with arrows, the equations."""
    way = _WORDS[one.ways] if one.parents is not None else "as a whole"
    lines = "\n".join("  " * depth + text for depth, text in one.lines)
    picture = ""
    if one.parents is not None and len(one.parents) > MOST:
        picture = f"<div>{len(one.parents)} bodies, too many to draw</div>"
    elif one.parents:
        picture = _tree(one, way)
    style = "border:1px solid rgba(128,128,128,.4);border-radius:4px;padding:6px 8px;max-width:100%;box-sizing:border-box"
    code = "margin:0;overflow-x:auto;background:transparent;color:inherit;font:11.5px/1.4 'DejaVu Sans Mono',ui-monospace,monospace"
    return f'<div style="{style}"><b>{number}. {way}</b>{picture}<pre style="{code}">{escape(lines)}</pre></div>'


def _tree(one: Pass, way: str) -> str:
    """Return the tree on its side, its base to the left, with an arrow along every link: orange to the base, blue to the tips, or both."""
    assert one.parents is not None
    n, places = len(one.parents), tree_places(one.parents)
    depth = round(1 / places[:-1, 1].min())  # a root's place is one over the depth
    leaves = len(set(range(n)) - set(one.parents))
    width, height = min(_STEP * depth, _WIDEST), min(_ROW * leaves, _WIDEST)
    x, y = _MARGIN + places[:, 1] * width, _MARGIN / 2 + places[:, 0] * height
    radius = max(1.5, min(6.0, 0.18 * width / depth, 0.3 * height / leaves))
    parts = [
        f'<line x1="{x[p]:.1f}" y1="{y[p]:.1f}" x2="{x[k]:.1f}" y2="{y[k]:.1f}" stroke="currentColor" stroke-opacity=".4"/>'
        for k, p in enumerate(one.parents)
    ]
    for along, direction in zip((0.0,) if len(one.ways) < 2 else (-0.2, 0.2), one.ways, strict=False):
        for k, p in enumerate(one.parents):
            begin, end = ((x[k], y[k]), (x[p], y[p])) if direction < 0 else ((x[p], y[p]), (x[k], y[k]))
            parts.append(_arrow(begin, end, along, _INWARD if direction < 0 else _OUTWARD, radius))
    parts.append(f'<rect x="{x[-1] - 5:.1f}" y="{y[-1] - 5:.1f}" width="10" height="10" fill="currentColor"/>')
    parts += [f'<circle cx="{x[k]:.1f}" cy="{y[k]:.1f}" r="{radius:.1f}" fill="#56b4e9" stroke="currentColor"/>' for k in range(n)]
    w, h = width + 2 * _MARGIN, height + _MARGIN
    box = f'viewBox="0 0 {w:.0f} {h:.0f}" width="{w:.0f}" height="{h:.0f}"'
    about = f'style="display:block;max-width:100%;color:inherit" role="img" aria-label="{way}, over {n} bodies"'
    return f"<svg {box} {about}>{''.join(parts)}</svg>"


def _arrow(begin: Any, end: Any, along: float, colour: str, radius: float) -> str:
    """Return an arrow's head at the middle of a link, or shifted along it."""
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    length = max((dx * dx + dy * dy) ** 0.5, 1e-9)
    ex, ey = dx / length, dy / length
    mx, my = begin[0] + (0.5 + along) * dx, begin[1] + (0.5 + along) * dy
    size = min(radius + 0.5, 0.3 * length, length if not along else 0.18 * length)
    tip, left, right = (
        (mx + size * ex, my + size * ey), (mx - size * ex - size * ey, my - size * ey + size * ex),
        (mx - size * ex + size * ey, my - size * ey - size * ex),
    )  # fmt: skip
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in (tip, left, right))
    return f'<polygon points="{points}" fill="{colour}"/>'
