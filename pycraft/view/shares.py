"""Each body's share of the degrees of freedom, as colour on the robot.

share of body k          tr(Υ(k) M(k))
share of hinge k's rotor tr(ℳ⁻¹(k,k) J(k)),  ℳ⁻¹ of the mass matrix with J in it
together                 Σ tr(Υ(k) M(k)) + Σ tr(ℳ⁻¹(k,k) J(k)) = tr(ℳ⁻¹ (HφMφ*H* + J)) = N

Υ(k) maps a force on body k to its acceleration, so Υ(k) M(k) is the fraction of its own inertia that is felt there: a body that is free
of all others has share 6 (or the rank of its inertia), a body that cannot move has share 0. [A. Jain, Robot and Multibody
Dynamics, Springer 2011, operational space inertias; the sum is the catalogue's "the bodies' shares add up to N"]
"""

from __future__ import annotations

import copy
from html import escape
from typing import Any

import numpy as np

from .. import _core
from ..state import at_state
from .colour_scale import colour_bar, shade
from .plane_layout import MOST, model_layout
from .stick_figure import StickFigure
from .sweep_picture import HEIGHT, RADIUS, WIDTH

LABEL = "share of the degrees of freedom, tr Υ(k)M(k)"
_SHOWN = 24
"""Largest number of bodies listed; of more, the bodies with the largest shares."""
_COLUMNS = 256
"""Columns of I to which ℳ⁻¹J is applied at once, to avoid an N × N matrix for a large model."""


class Shares:
    """`Multibody.dof_shares`: prints as a table, shows as a picture in a notebook; `plot` draws it with Matplotlib.

    Attributes
    ----------
    by_body : dict, name of the body to tr(Υ(k)M(k)), between 0 and 6
    of_bodies, of_rotors, total : float; their sums, and both together, which is N
    coordinates : N
    """

    def __init__(self, model: Any, q: Any = None):
        self.model, self.q = copy.copy(model), np.array(_core.real_array(at_state(model, q)[0], "q"))
        model.check_q(self.q)
        self.values = share_values(model, self.q)
        self.by_body = dict(zip(model.bodies, self.values.tolist(), strict=True))
        self.coordinates = int(model.nv)
        self.of_bodies, self.of_rotors = float(self.values.sum()), rotor_shares(model, self.q)
        self.total = self.of_bodies + self.of_rotors

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw the stick figure with coloured bodies and a colour bar; return the axes. Options as for `Multibody.plot`."""
        figure = StickFigure(self.model, self.q, ax, **{"legend": False, **options})
        figure.paint(self.values, LABEL)
        figure.ax.set_title(f"{self.model.name}: {self.said}", fontsize="medium")
        return figure.ax

    @property
    def said(self) -> str:
        """The sum in words."""
        parts = f"bodies {self.of_bodies:.6g} and rotors {self.of_rotors:.6g}, " if self.of_rotors else ""
        return f"{parts}together {self.total:.6g} of N = {self.coordinates}"

    def _largest(self) -> list[tuple[str, float]]:
        return sorted(self.by_body.items(), key=lambda item: -item[1])[:_SHOWN]

    def __repr__(self) -> str:
        rows = list(self.by_body.items()) if len(self.by_body) <= _SHOWN else self._largest()
        width = max((len(name) for name, _ in rows), default=0)
        high = max((x for _, x in rows), default=0.0) or 1.0
        lines = [f"  {name:<{width}}  {x:7.4f}  {'█' * round(24 * x / high)}".rstrip() for name, x in rows]
        more = len(self.by_body) - len(rows)
        lines += [f"  and {more} more with smaller shares"] if more else []
        return "\n".join([f"shares of the degrees of freedom of {self.model.name!r}, tr Υ(k)M(k)", *lines, f"  {self.said}"])

    def _repr_html_(self) -> str:
        if len(self.values) > MOST:
            return f"<pre>{escape(repr(self))}</pre>"
        layout = model_layout(self.model, self.q, WIDTH, HEIGHT - 50, 4 * RADIUS, RADIUS)
        high = max(self.by_body.values(), default=0.0) or 1.0
        colours = [shade(x, 0, high) for x in self.values]
        parts = [
            f"<line x1='{a[0]:.1f}' y1='{a[1]:.1f}' x2='{b[0]:.1f}' y2='{b[1]:.1f}' stroke='{colours[k] if k >= 0 else 'currentColor'}'"
            f" stroke-width='{5 if k >= 0 else 1.5}' stroke-linecap='round'/>"
            for (a, b), k in zip(layout.bones, layout.owners, strict=True)
        ]
        x, y = layout.base
        parts.append(f"<rect x='{x - 6:.1f}' y='{y - 6:.1f}' width='12' height='12' fill='currentColor'><title>base</title></rect>")
        parts += [
            f"<circle cx='{x:.1f}' cy='{y:.1f}' r='{RADIUS:g}' fill='{colour}' stroke='currentColor'>"
            f"<title>{escape(name)}: {value:.4g}</title></circle>"
            for (x, y), colour, (name, value) in zip(layout.bodies, colours, self.by_body.items(), strict=True)
        ]
        bar = colour_bar(4 * RADIUS, HEIGHT - 28, 220, 0.0, high, LABEL)
        style = f"max-width:{WIDTH:g}px;width:100%;height:auto;color:inherit;font:12px system-ui,sans-serif"
        svg = (
            f"<svg viewBox='0 0 {WIDTH:g} {HEIGHT:g}' style='{style}' fill='currentColor' role='img' "
            f"aria-label='shares of the bodies'>{''.join(parts)}{bar}</svg>"
        )
        return f"<div><div>{escape(self.model.name)}: {escape(self.said)}</div>{svg}</div>"


def share_values(model: Any, q: np.ndarray) -> np.ndarray:
    """Return tr(Υ(k)M(k)) of every body, (n,). O(N). Raises SingularHingeError if a D(k) is singular."""
    n = len(model.bodies)
    if not n or not model.nv:
        return np.zeros(n)
    soa = model.soa
    blocks = (soa.Upsilon @ soa.M).at(q) @ np.tile(np.eye(6), (n, 1))
    return np.trace(blocks.reshape(n, 6, 6), axis1=1, axis2=2)


def rotor_shares(model: Any, q: np.ndarray) -> float:
    """Return Σ tr(ℳ⁻¹(k,k) J(k)) over all rotors; zero for a model without rotors. Some columns at once, O(N²)."""
    if not model.nv:
        return 0.0
    soa = model.soa
    if not model.has_rotor_inertia:
        return 0.0
    H, phi, M, J, I = soa("H phi M J I")
    product = (H @ phi @ M @ phi.T @ H.T + J).inv() @ J
    bound, total = product.at(q), 0.0
    for first in range(0, model.nv, _COLUMNS):
        columns = np.eye(model.nv, min(_COLUMNS, model.nv - first), -first)
        total += float(np.sum(columns * (bound @ columns)))
    return total
