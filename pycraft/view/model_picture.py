"""A model in HTML: a one-line summary, its tree, and its stick figure, without further packages."""

from __future__ import annotations

from collections import Counter
from html import escape
from typing import Any

import numpy as np

from .plane_layout import MOST, PlaneLayout, model_layout
from .stick_figure import HINGES

LISTED = 80
"""Largest number of bodies of a tree that is printed."""
_WIDTH, _HEIGHT, _SIZE = 420.0, 320.0, 5.5
_SHAPES = {
    "pin": "circle", "slider": "square", "cylindrical": "square", "screw": "diamond", "planar": "diamond", "free": "triangle",
    "ball": "disc", "universal": "disc", "gimbal": "disc", "weld": "dot", "custom": "diamond",
}  # fmt: skip
"""Shape and colour of the mark of each kind of hinge; pointing at a mark shows the hinge's name."""


def model_html(model: Any) -> str:
    """`Multibody._repr_html_`."""
    described = model.description()["bodies"]
    mass = sum(body["mass"] for body in described)
    gravity = np.array(model.gravity)
    facts = [f"{len(described)} bodies", f"{model.nv} degrees of freedom (nq = {model.nq})", f"{mass:.4g} kg"]
    facts += [f"gravity ({', '.join(f'{x:g}' for x in gravity)}) m/s²" if gravity.any() else "no gravity"]
    facts += [f"{count} loop{'s' * (count > 1)}"] if (count := len(model.loops)) else []
    small = (
        "margin:0;overflow:auto;max-height:340px;white-space:pre;overflow-wrap:normal;word-break:normal;background:transparent;color:inherit;"
        "font:12px/1.35 'DejaVu Sans Mono',ui-monospace,monospace"
    )
    tree = f'<pre style="{small}">{escape(str(model.tree(LISTED)))}</pre>'
    figure = _figure(model, described) if described and len(described) <= MOST else ""
    return (
        f'<div style="font:13px/1.45 system-ui,sans-serif;color:inherit"><div><b>{escape(model.name)}</b>: {escape("; ".join(facts))}</div>'
        f'<div style="display:flex;flex-wrap:wrap;gap:16px;align-items:flex-start;margin-top:6px">'
        f'<div style="flex:1 1 260px;max-width:100%;min-width:0">{tree}</div>{figure}</div></div>'
    )


def _figure(model: Any, bodies: list[dict[str, Any]]) -> str:
    """Return the sticks at the model's present state, a mark for each hinge, and the legend."""
    at: PlaneLayout = model_layout(model, np.asarray(model.q, float), _WIDTH, _HEIGHT, 24.0, _SIZE)
    parts = [
        f"<line x1='{a[0]:.1f}' y1='{a[1]:.1f}' x2='{b[0]:.1f}' y2='{b[1]:.1f}' stroke='currentColor' stroke-opacity='.55' "
        f"stroke-width='{3 if len(bodies) < 60 else 1.2}' stroke-linecap='round'/>"
        for a, b in at.bones
    ]
    x, y = at.base
    parts.append(f"<rect x='{x - 5:.1f}' y='{y - 5:.1f}' width='10' height='10' fill='currentColor'><title>base </title></rect>")
    size = _SIZE if len(bodies) < 60 else 3.0
    for (x, y), body in zip(at.bodies, bodies, strict=True):
        title = f"{body['name']}, on {body['hinge']['kind']} {body['hinge']['name']} "  # keeps words apart when the drawing is removed
        parts.append(_mark(body["hinge"]["kind"], x, y, size, title))
    kinds = Counter(body["hinge"]["kind"] for body in bodies)
    for i, (kind, count) in enumerate(kinds.items()):
        left, top = 12 + 105 * (i % 4), _HEIGHT + 12 + 18 * (i // 4)
        parts.append(_mark(kind, left, top, _SIZE, kind))
        parts.append(f"<text x='{left + 11:.0f}' y='{top + 4:.0f}' font-size='11' fill='currentColor'>{kind} ({count})</text>")
    height = _HEIGHT + 24 + 18 * ((len(kinds) - 1) // 4)
    style = "flex:1 1 300px;max-width:460px;height:auto;color:inherit"
    return f"<svg viewBox='0 0 {_WIDTH:g} {height:g}' style='{style}' role='img' aria-label='stick figure'>{''.join(parts)}</svg>"


def _mark(kind: str, x: float, y: float, size: float, title: str) -> str:
    colour = "currentColor" if kind == "custom" else HINGES[kind][1]
    shape = _SHAPES[kind]
    told = f"<title>{escape(title)}</title>"
    if shape in ("circle", "disc", "dot"):
        fill, r = ("none" if shape == "circle" else colour), size * {"circle": 1.0, "disc": 1.15, "dot": 0.5}[shape]
        return f"<circle cx='{x:.1f}' cy='{y:.1f}' r='{r:.1f}' fill='{fill}' stroke='{colour}' stroke-width='2'>{told}</circle>"
    around = {
        "square": ((-1, -1), (1, -1), (1, 1), (-1, 1)), "diamond": ((0, -1.3), (1.3, 0), (0, 1.3), (-1.3, 0)),
        "triangle": ((0, -1.5), (1.4, 1), (-1.4, 1)),
    }[shape]  # fmt: skip
    points = " ".join(f"{x + size * a:.1f},{y + size * b:.1f}" for a, b in around)
    return f"<polygon points='{points}' fill='{colour}' stroke='{colour}'>{told}</polygon>"
