"""The Kalman dictionary running: a smoother's recursion over time beside forward dynamics of a chain, one equation for both, step by step.

Both are y = (HφMφ*H* + J)⁻¹ x, by the same two sweeps: of measurements x the innovations ε and the adjoint variable α = λ, of which the
smoothed state is z + Pλ; of hinge forces x (at rest, without gravity) the hinge accelerations y and the bodies' accelerations α. Tip to
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
"""Time steps, and bodies: eleven equations each."""
BENT = 2 * np.pi / 3
"""rad: the angle between the first and the last rod of the chain beside the filter."""
ROTOR = 0.2
"""kg m², of each hinge of that chain: the measurement noise in the dictionary."""
WORDS = {
    "P": ("covariance of the predicted state", "articulated-body inertia: k and all outboard of it, hinges free"),
    "D": ("covariance of the innovation", "inertia that the hinge feels"),
    "G": ("Kalman gain", "force on the body for one of the hinge"),
    "P⁺": ("covariance of the filtered state", "what of P the hinge hands inward"),
    "z": ("predicted state, less its mean", "force on the body that the outboard hinges leave"),
    "ε": ("innovation: what the measurement tells that is new", "what of the hinge force is left to accelerate"),
    "ν": ("innovation, weighted by its covariance", "hinge acceleration as if the inboard body stood still"),
    "z⁺": ("filtered state, less its mean", "force that is handed inward"),
    "α⁺": ("adjoint variable, from the step after", "acceleration that comes from inboard"),
    "y": ("(ℳ + J)⁻¹ of the measurements", "hinge acceleration"),
    "α": ("adjoint variable λ; the smoothed state is z + Pλ", "acceleration of the body, spatial"),
}
"""Of each letter of the recursion, what it is of the filter and in mechanics."""


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
            raise _core.EvaluationError(f"{track.steps} time steps: {MOST} at most are played; a model of fewer shows the same recursion")
        self.track = track
        self.measurements, _, soa, x = track._given(y)
        self.model = _chain(track.steps) if model is None else _checked(model, track.steps)
        force = _core.real_array(np.ones(self.model.nv) if tau is None else tau, "tau")
        if force.shape != (self.model.nv,):
            raise _core.ModelError(f"tau {force.shape}: one number a coordinate of {self.model.name!r}, ({self.model.nv},)")
        self._estimates = track.filter(y), track.smooth(y)
        written, self.filter_steps = _played(soa, x)
        self.lines = ["  " * depth + text for depth, text in written.lines()]
        other, self.mechanics_steps = _played(self.model.soa, force)
        if _order(self.filter_steps) != _order(self.mechanics_steps):  # the lines differ by J alone, where there are no rotors
            raise _core.EvaluationError(f"{self.model.name!r} takes another recursion than the filter:\n{other}")

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
        """C x at every step."""
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
        raise _core.ModelError(f"model: a Multibody, not {model!r:.80}")
    parents = [model._body(k)["parent"] for k in range(model._size)]
    if parents != list(range(-1, count - 1)):
        raise _core.ModelError(f"{model.name!r} is no serial chain of {count} bodies, one for each time step")
    return model


def _size(a: Step, b: Step) -> float | None:
    """Of P, the mass that it is on the average: the figure's colours."""
    return float(np.trace(b.value[3:, 3:])) / 3 if b.letter == "P" else None


def _rows(x: np.ndarray) -> list[list[float | None]]:
    """A row for each of what is measured, over time."""
    return [[float(f"{value:.6g}") if np.isfinite(value) else None for value in row] for row in x.T]
