"""The Kalman dictionary in action: a smoother's recursion over time beside forward dynamics of a chain, the same equations step by step.

Both are y = (HφMφ*H* + J)⁻¹ x, by the same two sweeps. From measurements x: the innovations ε and the adjoint variable α = λ; the
smoothed state is z + Pλ. From hinge forces x (at rest, without gravity): the hinge accelerations y and the bodies' accelerations α. Tip to
base is forward in time. [G. Rodriguez, "Kalman filtering, smoothing and recursive robot arm forward and inverse dynamics", IEEE
J. Robotics and Automation 3(6), 1987; A. Jain, Robot and Multibody Dynamics, Springer 2011]
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from ..models.generators import chain
from ..recursions import Step, algorithm
from .figure_data import figure_data, number_text, pose_rows
from .page import Page
from .skeleton import Skeleton
from .sweep_picture import told_value
from .web_page import web_page

MOST = 60
"""Largest number of time steps, and of bodies; each has eleven equations."""
BENT = 2 * np.pi / 3
"""Angle, rad, between the first and the last rod of the chain beside the filter."""
ROTOR = 0.2
"""Rotor inertia, kg m², of each hinge of the chain: the measurement noise in the dictionary."""
WORDS = {
    "P": ("covariance of the predicted state", "articulated-body inertia: k and all outboard of it, hinges free"),
    "D": ("covariance of the innovation", "inertia that the hinge feels"),
    "G": ("Kalman gain", "force on the body for one of the hinge"),
    "P⁺": ("covariance of the filtered state", "part of P that the hinge passes inward"),
    "z": ("predicted state, less its mean", "force on the body from outboard, hinges free"),
    "ε": ("innovation: new information in the measurement", "part of the hinge force left to accelerate"),
    "ν": ("innovation, weighted by its covariance", "hinge acceleration as if the inboard body stood still"),
    "z⁺": ("filtered state, less its mean", "force passed inward"),
    "α⁺": ("adjoint variable, from the step after", "acceleration from inboard"),
    "y": ("(ℳ + J)⁻¹ of the measurements", "hinge acceleration"),
    "α": ("adjoint variable λ; the smoothed state is z + Pλ", "acceleration of the body, spatial"),
}
"""Meaning of each letter of the recursion, in the filter and in mechanics."""


class KalmanPage(Page):
    """`StateSpace.play`.

    Attributes
    ----------
    model : Multibody, the chain beside it
    lines : list of str, the recursion
    filter_steps, mechanics_steps : list of Step, of the same equations in the same order
    """

    HEIGHT = 760

    def __init__(self, track: Any, y: Any = None, model: Any = None, tau: Any = None):
        if track.steps > MOST:
            raise _core.EvaluationError(
                f"{track.steps} time steps: at most {MOST} can be played; a model with fewer shows the same recursion"
            )
        self.track = track
        self.measurements, _, soa, x = track._given(y)
        self.model = _chain(track.steps) if model is None else _checked(model, track.steps)
        force = _core.real_array(np.ones(self.model.nv) if tau is None else tau, "tau")
        if force.shape != (self.model.nv,):
            raise _core.ModelError(f"tau {force.shape}: give one value per coordinate of {self.model.name!r}, ({self.model.nv},)")
        self._estimates = track.filter(y), track.smooth(y)
        written, self.filter_steps = _played(soa, x)
        self.lines = ["  " * depth + text for depth, text in written.lines()]
        other, self.mechanics_steps = _played(self.model.soa, force)
        if _order(self.filter_steps) != _order(self.mechanics_steps):  # the recursions differ only in J, if there are no rotors
            raise _core.EvaluationError(f"{self.model.name!r} has another recursion than the filter:\n{other}")

    @cached_property
    def html(self) -> str:
        skeleton, q = Skeleton(self.model), np.asarray(self.model.q)
        filtered, smoothed = self._estimates
        seen = self._measured(filtered.predicted), self._measured(smoothed.states)
        steps = [
            [a.line, self.track.steps - 1 - a.body, b.body, a.letter, told_value(a), told_value(b), _size(a, b)]
            for a, b in zip(self.filter_steps, self.mechanics_steps, strict=True)
        ]
        data = {
            "lines": self.lines, "steps": steps, "words": [[letter, *words] for letter, words in WORDS.items()],
            "measured": _rows(self.measurements), "predicted": _rows(seen[0]), "smoothed": _rows(seen[1]),
            "deviation": _rows(np.sqrt(np.diagonal(filtered.innovation_covariance, axis1=1, axis2=2))),
            "figure": figure_data(skeleton, q), "poses": number_text(pose_rows(skeleton, q)), "names": [str(b) for b in self.model.bodies],
        }  # fmt: skip
        said = "one recursion, y = (HφMφ*H* + J)⁻¹ x: a smoother over time, and forward dynamics of a chain from tip to base and back"
        return web_page("kalman", "The Kalman dictionary", data, {"said": said})

    def _measured(self, states: np.ndarray) -> np.ndarray:
        """Return C x at every step."""
        return np.einsum("tmi,ti->tm", self.track._C, states)

    def __repr__(self) -> str:
        return f"<filter beside {self.model.name!r}: {len(self.filter_steps)} steps of {self.track.steps} times and bodies>"


def _played(soa: Any, x: np.ndarray) -> tuple[Any, list[Step]]:
    H, phi, M, J = soa("H phi M J")
    written = algorithm((H @ phi @ M @ phi.T @ H.T + J).inv(), "text", "apply")
    return written, written.steps(x)


def _order(steps: list[Step]) -> list[tuple[int, int, str]]:
    return [(step.line, step.body, step.letter) for step in steps]


def _chain(count: int) -> Any:
    """Equal rods in a plane, on pins with rotors, bent into an arc of a third of a circle: its tip is the first time step."""
    model = chain(count)
    for hinge in model.hinges.values():
        hinge.rotor_inertia = ROTOR
    model.q = np.full(count, BENT / count)
    return model


def _checked(model: Any, count: int) -> Any:
    if not isinstance(model, _core.Multibody):
        raise _core.ModelError(f"model must be a Multibody, not {model!r:.80}")
    parents = [model._body(k)["parent"] for k in range(model._size)]
    if parents != list(range(-1, count - 1)):
        raise _core.ModelError(f"{model.name!r} is not a serial chain of {count} bodies, one for each time step")
    return model


def _size(a: Step, b: Step) -> float | None:
    """Return the mean mass of P, which colours the figure."""
    return float(np.trace(b.value[3:, 3:])) / 3 if b.letter == "P" else None


def _rows(x: np.ndarray) -> list[list[float | None]]:
    """Return a row for each measured quantity, over time."""
    return [[float(f"{value:.6g}") if np.isfinite(value) else None for value in row] for row in x.T]
