"""Lost digits along a run, as colour on the robot: where its forward dynamics loses them, and the cost of the next rung."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..accuracy.certificates.certify import certify_dynamics
from ..arguments import one_number
from ..file_targets import writable_target
from ..tidy import error_text
from ..view.plane_layout import PlaneLayout, model_layouts

MOST = 200
"""Largest number of examined states of a run, each with its own certificate."""
_WIDTH, _HEIGHT, _RADIUS = 420.0, 320.0, 7.0
_PLOT_WIDTH, _PLOT_HEIGHT, _LEFT, _FOOT = 420.0, 150.0, 34.0, 30.0
_NONE, _ALL = np.array([222, 235, 247]), np.array([165, 60, 0])
"""Colours for no digits lost and all digits lost; they differ in lightness, for all readers."""
_DIGITS = 16.0


class LostDigits:
    """`Run.lost_digits`: at some states of a run, the decimal digits lost in D(k) at each hinge, and a certificate.

    Attributes
    ----------
    t : (n,) s
    hinges : names of the hinges with coordinates
    digits : (n, hinges)
    certificates : list of Certificate, for the accelerations at each state

    Examples
    --------
    >>> import pycraft as pc
    >>> lost = pc.mechanisms.double_pendulum().simulate(1.0).lost_digits(3)
    >>> lost.digits.shape, float(lost.digits.max()) < 2
    ((3, 2), True)
    """

    def __init__(self, run: Any, states: Any, options: dict[str, Any]):
        count = one_number(states, "states")
        if not 1 <= count <= MOST or count != int(count):
            raise _core.EvaluationError(f"states={states!r}: give the number of examined states, a whole number from 1 to {MOST}")
        model = run._unedited_model()
        rows = np.unique(np.linspace(0, len(run.t) - 1, int(count)).round().astype(int))
        self.t, q, v, vdot = (x[rows] for x in (run.t, run.q, run.v, run.vdot))
        self.certificates = []
        for state in zip(q, v, vdot, strict=True):
            tau = model.inverse_dynamics(*state)
            self.certificates.append(certify_dynamics(model, *state[:2], tau, **{"precision": run._about["precision"], **options}))
        source = model.soa._source
        self.hinges = [name for name, n in zip(source.hinge_names, source.dof, strict=True) if n]
        known = [{loss.hinge: loss.digits for loss in one.locator} for one in self.certificates]
        self.digits = np.array([[one.get(name, 0.0) for name in self.hinges] for one in known]).reshape(len(rows), len(self.hinges))
        described = model.description()["bodies"]
        self._model, self._parents = model, [body["parent"] for body in described]
        self._bodies = [self.hinges.index(name) if (name := body["hinge"]["name"]) in self.hinges else -1 for body in described]
        self._layouts: list[PlaneLayout] = model_layouts(model, q, _WIDTH, _HEIGHT, 4 * _RADIUS, _RADIUS)

    @property
    def worst(self) -> int:
        """Index of the state with the largest error."""
        return int(np.argmax([one.error for one in self.certificates]))

    def told(self, i: int) -> str:
        """Return a sentence or two on one state: the error, where digits were lost, the next rung and its cost."""
        one = self.certificates[i]
        lost = ""
        if len(self.hinges) and self.digits[i].max() >= 1:
            hinge = int(np.argmax(self.digits[i]))
            lost = f"; D({self.hinges[hinge]}) lost {self.digits[i, hinge]:.1f} digits"
        step = one.next_rung
        up = f"next rung: {step.rung.label}, error {error_text(step.error)} at {step.cost:.2g} times the time" if step else one.verdict()
        error = f"error of the accelerations by {one.rung.label} {error_text(one.error)}"
        return f"t = {self.t[i]:.4g} s: {error}{lost}. {up[:1].upper()}{up[1:]}."

    def __repr__(self) -> str:
        return f"<lost digits of {self._model.name!r} at {len(self.t)} states; worst at {self.told(self.worst)[4:]}>"

    def save(self, path: str | Path) -> Path:
        """Write a page, ".html". Raises EvaluationError for another ending, OSError if it cannot be written."""
        target = writable_target(path, (".html",), "a page of lost digits")
        head = "<!DOCTYPE html>\n<html lang='en'><meta charset='utf-8'><meta name='color-scheme' content='light dark'>"
        title = escape(f"lost digits of {self._model.name}")
        target.write_text(f"{head}<title>{title}</title><body style='margin:16px'>{self._repr_html_()}</body></html>\n", encoding="utf-8")
        return target

    # ------------------------------------------------------------------ pictures
    def _repr_html_(self) -> str:
        code = {name: files(__package__).joinpath(f"lost_digits.{name}").read_text(encoding="utf-8") for name in ("css", "js")}
        frames = "".join(self._frame(i) for i in range(len(self.t)))
        told = json.dumps([self.told(i) for i in range(len(self.t))]).replace("</", "<\\/")
        figure = f"<svg class='figure' viewBox='0 0 {_WIDTH:g} {_HEIGHT:g}' role='img' aria-label='the robot'>{frames}</svg>"
        slider = f'<input type="range" min="0" max="{len(self.t) - 1}" value="{self.worst}" aria-label="time" hidden>'
        return (
            f'<div class="pycraft-digits"><style>{code["css"]}</style><p>Digits lost in D(k) along a run of {escape(self._model.name)}</p>'
            f'<div class="both">{figure}<div class="side">{self._plot()}{_legend()}</div></div>{slider}'
            f'<div class="told">{escape(self.told(self.worst))}</div>'
            f'<script type="application/json">{told}</script><script>{code["js"]}</script></div>'
        )

    def _frame(self, i: int) -> str:
        """Return the robot at one state: discs are darker and larger where more digits are lost. The worst state is shown first."""
        at = self._layouts[i]
        parts = [_line("bone", *ends) for ends in at.bones]
        parts += [_line("edge", at.bodies[k], at.bodies[p] if p >= 0 else at.base) for k, p in enumerate(self._parents)]
        x, y = at.base
        parts.append(f"<rect x='{x - 5:.1f}' y='{y - 5:.1f}' width='10' height='10' fill='currentColor'/>")
        for (x, y), hinge in zip(at.bodies, self._bodies, strict=True):
            digits = self.digits[i, hinge] if hinge >= 0 else 0.0
            title = f"{self.hinges[hinge]}: {digits:.1f} digits lost" if hinge >= 0 else "no coordinates"
            disc = f"cx='{x:.1f}' cy='{y:.1f}' r='{_RADIUS * (0.8 + 0.6 * min(digits / _DIGITS, 1)):.1f}' fill='{_colour(digits)}'"
            parts.append(f"<circle class='body' {disc}><title>{escape(title)}</title></circle>")
        return f"<g class='frame'{'' if i == self.worst else ' style=display:none'}>{''.join(parts)}</g>"

    def _plot(self) -> str:
        """Return the plot of the most digits lost at any hinge, against seconds."""
        top = self.digits.max(axis=1, initial=0.0)
        span = float(self.t[-1] - self.t[0]) or 1.0
        x = _LEFT + (self.t - self.t[0]) / span * (_PLOT_WIDTH - _LEFT - 12)
        height = _PLOT_HEIGHT - _FOOT - 8
        y = 8 + height * (1 - np.minimum(top, _DIGITS) / _DIGITS)
        foot = 8 + height
        parts = [f"<polyline class='axis' points='{_LEFT:g},8 {_LEFT:g},{foot:g} {_PLOT_WIDTH - 8:g},{foot:g}'/>"]
        for digits in (0, 4, 8, 12, 16):
            at = 8 + height * (1 - digits / _DIGITS)
            parts.append(f"<text x='{_LEFT - 5:g}' y='{at + 4:.1f}' text-anchor='end'>{digits}</text>")
        for time, at, anchor in ((self.t[0], _LEFT, "start"), (self.t[-1], _PLOT_WIDTH - 12, "end")):
            parts.append(f"<text x='{at:.1f}' y='{foot + 14:.1f}' text-anchor='{anchor}'>{time:.4g}</text>")
        parts.append(
            f"<text x='{(_LEFT + _PLOT_WIDTH) / 2:.1f}' y='{foot + 26:.1f}' text-anchor='middle'>t (s); digits lost, at most</text>"
        )
        parts.append(f"<polyline class='line' points='{' '.join(f'{a:.1f},{b:.1f}' for a, b in zip(x, y, strict=True))}'/>")
        parts += [
            f"<circle class='at{' now' if i == self.worst else ''}' cx='{a:.1f}' cy='{b:.1f}' r='4'>"
            f"<title>{escape(self.told(i))}</title></circle>"
            for i, (a, b) in enumerate(zip(x, y, strict=True))
        ]
        return f"<svg viewBox='0 0 {_PLOT_WIDTH:g} {_PLOT_HEIGHT:g}' role='img' aria-label='digits lost over time'>{''.join(parts)}</svg>"


def _colour(digits: float) -> str:
    r, g, b = (_NONE + (_ALL - _NONE) * min(max(digits, 0.0) / _DIGITS, 1.0)).round().astype(int)
    return f"rgb({r},{g},{b})"


def _legend() -> str:
    """Return discs from no digits to all digits of a double."""
    marks = (0, 4, 8, 12, 16)
    parts = [
        f"<circle class='body' cx='{30 + 70 * i}' cy='12' r='{_RADIUS * (0.8 + 0.6 * d / _DIGITS):.1f}' fill='{_colour(d)}'/>"
        f"<text x='{42 + 70 * i}' y='16'>{d}</text>"
        for i, d in enumerate(marks)
    ]
    return f"<svg viewBox='0 0 {_PLOT_WIDTH:g} 26' role='img' aria-label='digits lost by colour'>{''.join(parts)}</svg>"


def _line(name: str, a: np.ndarray, b: np.ndarray) -> str:
    return f"<line class='{name}' x1='{a[0]:.1f}' y1='{a[1]:.1f}' x2='{b[0]:.1f}' y2='{b[1]:.1f}'/>"
