"""Pictures of a film of sweeps, in SVG: the tree with its ellipses, and a table of blocks, each marked with the step that computes it."""

from __future__ import annotations

from html import escape

import numpy as np

from ..recursions import Step
from .plane_layout import PlaneLayout

WIDTH, HEIGHT, RADIUS = 480.0, 360.0, 7.0
_STRIP, _ROW, _LEFT = 900.0, 16.0, 44.0
_LARGEST_ELLIPSE = 45.0
_DECADES = 5.0
_LETTERS = 16  # of a column's name


class SweepPicture:
    """Pictures of steps over a tree. `figure` and `strip` show the state after the last step."""

    def __init__(self, layout: PlaneLayout, parents: list[int], names: list[str], steps: list[Step], tree: int):
        self._layout, self._parents, self._names = layout, parents, names
        self._steps = [(i, step) for i, step in enumerate(steps) if step.body >= 0 and step.tree == tree]

    @property
    def has_ellipses(self) -> bool:
        """True if `figure` shows an inertia."""
        return bool(self._ellipses())

    # ------------------------------------------------------------------ the tree
    def figure(self) -> str:
        """Return the tree: bodies as discs, lines to their parents, the model's sticks behind, ellipses of inertias."""
        at = self._layout
        x, y = at.base
        parts = [_line("bone", *ends) for ends in at.bones]
        parts += [_line("edge", at.bodies[k], at.bodies[p] if p >= 0 else at.base) for k, p in enumerate(self._parents)]
        parts += self._ellipses()
        parts.append(f"<rect x='{x - 6:.1f}' y='{y - 6:.1f}' width='12' height='12' fill='currentColor'><title>base</title></rect>")
        parts += [
            f"<circle class='body done' cx='{x:.1f}' cy='{y:.1f}' r='{RADIUS:g}'><title>{escape(name)}</title></circle>"
            for (x, y), name in zip(at.bodies, self._names, strict=True)
        ]
        return f"<svg viewBox='0 0 {WIDTH:g} {HEIGHT:g}' role='img' aria-label='the tree'>{''.join(parts)}</svg>"

    def _ellipses(self) -> list[str]:
        """Return ellipses of the bodies' inertias by direction: the linear block C of the first symmetric 6 × 6 quantity, half axes √."""
        axes = self._layout.axes
        if axes is None:
            return []
        inertias = [(i, step) for i, step in self._steps if step.value.shape == (6, 6) and np.array_equal(step.value, step.value.T)]
        seen = [
            (i, step, axes[step.body] @ step.value[3:, 3:] @ axes[step.body].T) for i, step in inertias if step.name == inertias[0][1].name
        ]
        largest = max((np.abs(C).max() for *_, C in seen), default=0.0)
        return [self._ellipse(i, step, C / largest) for i, step, C in seen] if 0 < largest < np.inf else []

    def _ellipse(self, i: int, step: Step, C: np.ndarray) -> str:
        sizes, directions = np.linalg.eigh(C)
        short, long = _LARGEST_ELLIPSE * np.sqrt(np.maximum(sizes, 0))
        angle = np.rad2deg(np.arctan2(directions[1, 1], directions[0, 1]))
        x, y = self._layout.bodies[step.body]
        title = f"{step.letter}({self._names[step.body]}): its linear block along each direction, half axes by the square root"
        where = f"transform='translate({x:.1f} {y:.1f}) rotate({angle:.1f})' rx='{long:.1f}' ry='{short:.1f}'"
        return f"<ellipse class='ellipse made' data-step='{i}' {where}><title>{escape(title)}</title></ellipse>"

    # ------------------------------------------------------------------ blocks
    def strip(self) -> str:
        """Return the blocks, a row per quantity and a column per body; colour by the logarithm of size, relative to the row's largest."""
        rows = {(step.number, step.name): step.letter for _, step in self._steps}
        if not rows:
            return ""
        n, index = len(self._names), {key: i for i, key in enumerate(rows)}
        largest = {key: max(_size(step) for _, step in self._steps if (step.number, step.name) == key) for key in rows}
        width = min(40.0, max(3.0, (_STRIP - _LEFT) / n))
        parts = [
            f"<text x='{_LEFT - 6:g}' y='{_ROW * i + 12:g}' text-anchor='end'>{escape(letter)}</text>"
            for i, letter in enumerate(rows.values())
        ]
        for i, step in self._steps:
            key = (step.number, step.name)
            where = f"x='{_LEFT + width * step.body:.1f}' y='{_ROW * index[key]:g}' width='{width - 1:.1f}' height='{_ROW - 1:g}'"
            colour = f"fill='rgba(0,114,178,{_depth(_size(step), largest[key]):.2f})' stroke='currentColor' stroke-opacity='0.2'"
            title = f"{step.letter}({self._names[step.body]})\n{told_value(step)}"
            parts.append(f"<rect class='made' data-step='{i}' {where} {colour}><title>{escape(title)}</title></rect>")
            if width >= 12 and _size(step) == 0:
                at = f"x='{_LEFT + width * (step.body + 0.5) - 0.5:.1f}' y='{_ROW * index[key] + 11:g}' text-anchor='middle'"
                parts.append(f"<text class='zero made' data-step='{i}' {at}>0</text>")
        foot = _ROW * len(rows)
        if width >= 12:
            parts += [
                f"<text transform='translate({_LEFT + width * (k + 0.5) - 4:.1f} {foot + 6:g}) rotate(90)'>{escape(_short(name))}</text>"
                for k, name in enumerate(self._names)
            ]
            foot += 6 + 6.8 * max(len(_short(name)) for name in self._names)
        w = _LEFT + width * n + 4
        size = f"viewBox='0 0 {w:g} {foot + 4:g}' style='max-width:{w:g}px'"
        return f"<svg {size} role='img' aria-label='blocks, body by body'>{''.join(parts)}</svg>"


def told_value(step: Step) -> str:
    """Return up to six numbers, else their shape and the largest; "= 0" if all are exactly zero."""
    if not step.value.size:
        return ""
    if not step.value.any():
        return "= 0"
    if step.value.size <= 6:
        return "= " + "  ".join(f"{x:.4g}" for x in step.value.ravel())
    return f"{step.value.shape[0]} × {step.value.shape[1]}, largest entry {_size(step):.4g}"


def _short(name: str) -> str:
    return name if len(name) <= _LETTERS else name[: _LETTERS - 1] + "…"


def _line(name: str, a: np.ndarray, b: np.ndarray) -> str:
    return f"<line class='{name}' x1='{a[0]:.1f}' y1='{a[1]:.1f}' x2='{b[0]:.1f}' y2='{b[1]:.1f}'/>"


def _size(step: Step) -> float:
    return float(np.abs(step.value).max(initial=0.0))


def _depth(size: float, largest: float) -> float:
    """Return the depth of a colour: zero for zero, else by the logarithm."""
    return 0.0 if size == 0 else 0.15 + 0.7 * max(0.0, 1 + np.log10(size / largest) / _DECADES)
