"""An operator's blocks beside its robot: pointing at a block lights the path between its bodies, pointing at a body its row and column."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..file_targets import writable_target
from ..operators.block_picture import colour
from .plane_layout import PlaneLayout, layout_of
from .sweep_picture import HEIGHT, RADIUS, WIDTH

MOST = 60
"""Largest number of blocks per row or column, so that each square can be pointed at."""
NUMBERED = 38
"""Least size, pixels, of a square with room for its number."""
_LETTERS, _FONT = 16, 11.0


class LinkedBlocks:
    """`BlockView.on_robot`: shows itself in a notebook; `save` writes a page that works in any browser, offline.

    Parameters
    ----------
    view : BlockView, of an operator of one model between spaces of bodies, hinges or nodes
    on : {"robot", "tree"}, as of `Operator.play`

    Raises
    ------
    EvaluationError
        An operator without a model, or with rows or columns that belong to no body; more than 60 blocks per row or column; an unknown `on`.

    Examples
    --------
    >>> import pycraft as pc
    >>> pc.chain(3).soa.phi.blocks().on_robot()
    <blocks of φ : F → F beside their robot, 3 × 3>
    """

    def __init__(self, view: Any, on: str = "robot"):
        operator = view.operator
        if on not in ("robot", "tree"):
            raise _core.EvaluationError(f"on={on!r}: choose 'robot', the model at its state, or 'tree'")
        if not operator.sources:
            raise _core.EvaluationError(f"{operator.text()} has no model: only blocks() shows its blocks")
        source = operator.sources[0]
        if not view.rows or not view.columns:
            raise _core.EvaluationError(f"{operator.text()} has no blocks: there is nothing to point at")
        self._rows, self._columns = (_bodies_of(names, source, operator) for names in (view.rows, view.columns))
        if max(len(view.rows), len(view.columns)) > MOST:
            raise _core.EvaluationError(
                f"{len(view.rows)} × {len(view.columns)} blocks: at most {MOST} per row can be pointed at; blocks() shows all; blocks of "
                "model.subgraph(...) are fewer"
            )
        self._view, self._parents, self._names = view, list(source.parents), list(source.body_names)
        self._layout: PlaneLayout = layout_of(operator, source, on, WIDTH, HEIGHT, RADIUS)

    def __repr__(self) -> str:
        return f"<blocks of {self._view.title} beside their robot, {len(self._view.rows)} × {len(self._view.columns)}>"

    def save(self, path: str | Path) -> Path:
        """Write a page, ".html". Raises EvaluationError for another ending, OSError if the file cannot be written."""
        target = writable_target(path, (".html",), "a page")
        head = "<!DOCTYPE html>\n<html lang='en'><meta charset='utf-8'><meta name='color-scheme' content='light dark'>"
        page = f"{head}<title>{escape(self._view.title)}</title><body style='margin:16px'>{self._repr_html_()}</body></html>\n"
        target.write_text(page, encoding="utf-8")
        return target

    def _repr_html_(self) -> str:
        code = {name: files(__package__).joinpath(f"linked_blocks.{name}").read_text(encoding="utf-8") for name in ("css", "js")}
        data = json.dumps({"parents": self._parents, "names": self._names}).replace("<", "\\u003c")
        return (
            f'<div class="pycraft-linked"><style>{code["css"]}</style><p>{escape(self._view.title)}</p>'
            f'<div class="both"><div class="blocks">{self._picture()}</div><div class="figure">{self._figure()}</div></div>'
            f'<div class="told">{escape(self._caption())}</div>'
            f'<script type="application/json">{data}</script><script>{code["js"]}</script></div>'
        )

    def _caption(self) -> str:
        """Return the caption and instructions shown below until the user points at something."""
        numbers = "the number is its largest entry; " if self._size() >= NUMBERED else ""
        return (
            f"Each square is a block: {numbers}blue positive, orange negative, deeper where larger, blank an exact zero. Point at a block "
            "to see its numbers and the path between its two bodies, at a body to see its row and column; a click keeps them."
        )

    def _size(self) -> float:
        """Return the size of a square."""
        return float(np.clip(480 / max(len(self._view.rows), len(self._view.columns), 1), 9, 52))

    # ------------------------------------------------------------------ pictures
    def _picture(self) -> str:
        """The blocks, each a square with the numbers of its two bodies."""
        numbers, rows, columns = self._view.largest(), self._view.rows, self._view.columns
        size = self._size()
        left, top = (0.62 * _FONT * min(max(map(len, names), default=0), _LETTERS) + 8 for names in (rows, columns))
        scale = np.abs(numbers).max(initial=0.0)
        parts = []
        for i, row in enumerate(rows):
            for j, column in enumerate(columns):
                x = numbers[i, j]
                title = f"{row} × {column}: " + ("exactly zero" if x == 0 else f"largest entry {x:.4g}")
                fill = f"fill='{colour(x, scale, 0.9)}'" if x else "fill='transparent'"
                where = f"x='{left + size * j:.1f}' y='{top + size * i:.1f}' width='{size:.1f}' height='{size:.1f}'"
                to = f"data-row='{self._rows[i]}' data-column='{self._columns[j]}'{' data-zero' if x == 0 else ''}"
                parts.append(f"<rect class='block' {to} {where} {fill}><title>{escape(title)}</title></rect>")
                if x and size >= NUMBERED:
                    at = f"x='{left + size * (j + 0.5):.1f}' y='{top + size * (i + 0.5) + 4:.1f}'"
                    parts.append(f"<text class='entry' {at} text-anchor='middle'>{x:.2g}</text>")
        every = max(1, int(np.ceil(_FONT / size)))
        for i, name in list(enumerate(rows))[::every]:
            parts.append(f"<text x='{left - 4:.1f}' y='{top + size * (i + 0.5) + 4:.1f}' text-anchor='end'>{escape(_short(name))}</text>")
        for j, name in list(enumerate(columns))[::every]:
            at = f"translate({left + size * (j + 0.5) + 4:.1f} {top - 4:.1f}) rotate(-90)"
            parts.append(f"<text transform='{at}'>{escape(_short(name))}</text>")
        w, h = left + size * len(columns) + 2, top + size * len(rows) + 2
        about = f"role='img' aria-label='{len(rows)} × {len(columns)} blocks'"
        return f"<svg viewBox='0 0 {w:.0f} {h:.0f}' style='max-width:{w:.0f}px' {about}>{''.join(parts)}</svg>"

    def _figure(self) -> str:
        """The robot: sticks, lines from body to body, and the bodies."""
        at = self._layout
        x, y = at.base
        parts = [_line("bone", *ends) for ends in at.bones]
        parts += [_line("edge", at.bodies[k], at.bodies[p] if p >= 0 else at.base) for k, p in enumerate(self._parents)]
        parts.append(f"<rect x='{x - 6:.1f}' y='{y - 6:.1f}' width='12' height='12' fill='currentColor'><title>base</title></rect>")
        for (x, y), name in zip(at.bodies, self._names, strict=True):
            parts.append(f"<circle class='body' cx='{x:.1f}' cy='{y:.1f}' r='{RADIUS:g}'><title>{escape(name)}</title></circle>")
        return f"<svg viewBox='0 0 {WIDTH:g} {HEIGHT:g}' role='img' aria-label='the robot'>{''.join(parts)}</svg>"


def _bodies_of(labels: list[str], source: Any, operator: Any) -> list[int]:
    """Return the number of the body of each label: the label is the body, its hinge, or a node on it."""
    bodies = {name: k for k, name in enumerate(source.body_names)}
    hinges = {name: k for k, name in enumerate(getattr(source, "hinge_names", ()))}
    nodes = getattr(getattr(source, "model", None), "nodes", {})
    found = []
    for label in labels:
        body = bodies.get(label, hinges.get(label))
        if body is None and label in nodes:
            body = bodies.get(nodes[label].body.name)
        if body is None:
            raise _core.EvaluationError(
                f"{operator.text()} has a row or column {label!r} that is not a body, hinge or node; use blocks() instead"
            )
        found.append(body)
    return found


def _line(name: str, a: np.ndarray, b: np.ndarray) -> str:
    return f"<line class='{name}' x1='{a[0]:.1f}' y1='{a[1]:.1f}' x2='{b[0]:.1f}' y2='{b[1]:.1f}'/>"


def _short(name: str) -> str:
    return name if len(name) <= _LETTERS else name[: _LETTERS - 1] + "…"
