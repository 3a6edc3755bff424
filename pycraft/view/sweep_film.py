"""The sweeps of an expression's plan as a film on the model or its tree: the current line is lit, and blocks appear as they are computed.

A self-contained page or a notebook's cell: SVG pictures with some sixty lines of script. Where scripts do not run
(untrusted notebooks, static pages), it shows the last step, with everything computed.
"""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from .. import _core
from ..recursions import Step, algorithm
from .plane_layout import layout_of
from .sweep_picture import HEIGHT, RADIUS, WIDTH, SweepPicture, told_value

MOST = 250
"""Largest number of bodies of a film; each is a column of the picture."""


class SweepFilm:
    """`Operator.animate` and `Operator.play`: shows itself in a notebook; `save` writes a page that plays in any browser, offline.

    Parameters
    ----------
    expression : Operator or Scalar of a model, at its bound state (the first of a batch), else at the model's present state
    x : (n,) or (n, m), argument of an operator; default: ones
    on : {"robot", "tree"}
        The model at its state, with the linear blocks of its first symmetric 6 × 6 quantity (articulated inertias) as ellipses; or
        a diagram of the tree, which also works for trees without a model.
    request : as for `Operator.algorithm`

    Attributes
    ----------
    steps : list of Step, in the order in which they are shown
    title : str

    Raises
    ------
    EvaluationError
        An expression without a model, with more than 250 bodies, or without steps body by body; an x of the wrong shape; an unknown `on`.

    Examples
    --------
    >>> import pycraft as pc
    >>> H, phi, M = pc.chain(3).soa("H phi M")
    >>> (H @ phi @ M @ phi.T @ H.T).inv().animate()
    <film of y = (H φ M φ* H*)⁻¹ x: 33 steps over 3 bodies>
    """

    def __init__(self, expression: Any, x: Any = None, on: str = "robot", request: str = "apply"):
        if on not in ("robot", "tree"):
            raise _core.EvaluationError(f"on={on!r}: choose 'robot', the model at its state, or 'tree'")
        self._written = algorithm(expression, "text", request)
        models = self._written._book.models
        if not models:
            raise _core.EvaluationError(f"{expression.text()} has no model and so no tree to sweep over")
        self._parents, self._tree = list(models[0].source.parents), models[0].tree
        self._names = list(models[0].source.body_names)
        if len(self._names) > MOST:
            raise _core.EvaluationError(
                f"a film of {len(self._names)} bodies: at most {MOST} can be drawn; a part, model.subgraph(...), shows the same sweeps"
            )
        self.title = self._written.title
        self._given = x is not None
        self.steps: list[Step] = self._written.steps(x)
        if not self.steps:
            raise _core.EvaluationError(f"{expression.text()} has no steps to show: nothing is computed body by body")
        self._layout = layout_of(expression, models[0].source, on, WIDTH, HEIGHT, RADIUS)

    def save(self, path: str | Path) -> Path:
        """Write a page, ".html", 10 kB and some 300 bytes per block. Raises EvaluationError for another ending, or OSError."""
        target = Path(path)
        if target.suffix != ".html":
            raise _core.EvaluationError(f"output {str(path)!r}: a film of sweeps is written to '.html'")
        head = "<!DOCTYPE html>\n<html lang='en'><meta charset='utf-8'><meta name='color-scheme' content='light dark'>"
        page = f"{head}<title>{escape(self.title)}</title><body style='margin:16px'>{self._repr_html_()}</body></html>\n"
        target.write_text(page, encoding="utf-8")
        return target

    def __repr__(self) -> str:
        return f"<film of {self.title}: {len(self.steps)} steps over {len(self._names)} bodies>"

    def _repr_html_(self) -> str:
        code = {name: files(__package__).joinpath(f"sweep_film.{name}").read_text(encoding="utf-8") for name in ("html", "css", "js")}
        picture = SweepPicture(self._layout, self._parents, self._names, self.steps, self._tree)
        film = {"parents": self._parents, "steps": [self._told(step) for step in self.steps]}
        lines = (f"<div class='line'>{escape('  ' * depth + text)}</div>" for depth, text in self._written.lines())
        return Template(code["html"]).substitute(
            style=code["css"], script=code["js"], title=escape(self.title), figure=picture.figure(), strip=picture.strip(),
            lines="".join(lines), caption=escape(self._caption(picture.has_ellipses)),
            last=len(self.steps) - 1, data=json.dumps(film).replace("</", "<\\/"),
        )  # fmt: skip

    def _caption(self, ellipses: bool) -> str:
        """Return a caption for readers without this documentation."""
        applied = "" if self._given else "Applied to x = (1, ..., 1). "
        shown = "Ellipses: the linear block of the first symmetric 6 × 6 quantity. " if ellipses else ""
        below = "Below: a row for each quantity, a column for each body; deeper blue where its entries are larger, 0 where all are zero."
        return f"{applied}{shown}{below}"

    def _told(self, step: Step) -> list[Any]:
        """Return a step as the script reads it: line, lines, pass, direction, body, words."""
        text = self._written.lines()[step.line][1]
        if step.body < 0:
            return [step.line, step.lines, step.number, 0, -1, text]
        here = step.tree == self._tree  # plans may visit other trees, such as a model with another root
        words = f"{self._names[step.body] if here else f'body {step.body} of another tree'}:  {text}\n{told_value(step)}"
        return [step.line, step.lines, step.number, step.direction, step.body if here else -1, words]
