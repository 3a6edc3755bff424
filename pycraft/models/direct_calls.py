"""The direct calls of a model, for those who want numbers and no algebra: arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core


def cached(model: Any, name: str, make: Callable[[Any], Any]) -> Any:
    """What is made of a model at the first call and kept on it."""
    if name not in model.__dict__:
        setattr(model, name, make(model))
    return getattr(model, name)


class DirectCalls:
    """Forward and inverse dynamics, mass matrix, Jacobians, energies. Each takes one state or a leading batch axis."""

    nv: int

    def _calls(self) -> _core.Dynamics:
        return cached(self, "_direct", _core.Dynamics)

    def forward_dynamics(self, q, v, tau, *, form: str = "fast", refine: int = 0, precision: str = "double", out=None) -> np.ndarray:
        """Accelerations (nv,) or (B, nv) under generalized forces tau, gravity included: articulated-body algorithm, O(N).

        Each argument has one state or a leading batch axis. Raises SingularHingeError where D(k) is singular at the rounding bound.
        """
        return self._calls().forward_dynamics(q, v, tau, form, refine, precision, out)

    def inverse_dynamics(self, q, v, vdot, *, precision: str = "double", out=None) -> np.ndarray:
        """Generalized forces (nv,) or (B, nv) for the accelerations vdot, gravity and rotor inertia included: Newton-Euler, O(N)."""
        return self._calls().inverse_dynamics(q, v, vdot, precision, out)

    def bias_forces(self, q, v, *, precision: str = "double", out=None) -> np.ndarray:
        """Coriolis, gyroscopic and gravity forces 𝒞 (nv,) or (B, nv): inverse dynamics at zero acceleration. O(N)."""
        return self._calls().inverse_dynamics(q, v, None, precision, out)

    def mass_matrix(self, q, *, precision: str = "double", out=None) -> np.ndarray:
        """The mass matrix of the equations of motion, HφMφ*H* + J, full symmetric (nv, nv) or (B, nv, nv): composite bodies."""
        return self._calls().mass_matrix(q, False, precision, out)

    def mass_matrix_inverse(self, q, *, precision: str = "double", out=None) -> np.ndarray:
        """The inverse of mass_matrix, full symmetric, by the innovations factors: O(N) a column."""
        return self._calls().mass_matrix(q, True, precision, out)

    def jacobian(self, frame: str, q, *, precision: str = "double", out=None) -> np.ndarray:
        """Jacobian (6, nv) or (B, 6, nv) of a body's or node's spatial velocity: its own axes, about its origin, angular first."""
        return self._calls().jacobian(frame, q, precision, out)

    def pose(self, frame: str, q) -> np.ndarray:
        """Pose (4, 4) or (B, 4, 4) of a body or node in the world."""
        return self._calls().pose(frame, q)

    def kinetic_energy(self, q, v) -> np.ndarray:
        """½ v·(ℳ + J)v, in joules. O(N)."""
        return self._calls().energy(q, v)[..., 0]

    def potential_energy(self, q) -> np.ndarray:
        """Energy in the uniform gravity field, zero with the centre of mass at the world's origin, in joules. O(N)."""
        shape = np.shape(q)[:-1] + (self.nv,)
        return self._calls().energy(q, np.zeros(shape))[..., 1]
