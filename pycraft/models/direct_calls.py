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


def by_method(model: Any, method: str, q, v, tau, precision: str | int, out) -> np.ndarray:
    """Forward dynamics by another method than the articulated-body recursion."""
    if method == "realization":
        return by_realization(model, q, v, tau, precision, out)
    return cached(model, "_methods", _core.Methods).forward_dynamics(method, q, v, tau, precision, out)


def by_realization(model: Any, q, v, tau, precision: str | int, out) -> np.ndarray:
    """Forward dynamics as (HφMφ*H* + J)⁻¹ (T - Hφ(Mφ*(a + a₀) + b)) evaluated as typed, no theorem used: realization and elimination."""
    H, phi, M, J, a, b, base = model.soa("H phi M J a b gravity_base")
    T = _core.vector("T", model.soa.Theta)
    formula = (H @ phi @ M @ phi.T @ H.T + J).inv() @ (T - H @ phi @ (M @ phi.T @ (a + base) + b))
    shapes = [np.asarray(x, float) for x in (getattr(q, "q", q), getattr(v, "v", v), tau)]
    batch = np.broadcast_shapes(*(x.shape[:-1] for x in shapes))
    result = np.empty((*batch, model.nv)) if out is None else out
    states = [np.broadcast_to(x, (*batch, x.shape[-1])).reshape(-1, x.shape[-1]) for x in shapes]
    flat = result.reshape(-1, model.nv)
    for i in range(len(flat)):
        flat[i] = formula.at(states[0][i], states[1][i], precision=precision).value(rules=False, T=states[2][i])
    return result


class DirectCalls:
    """Forward and inverse dynamics, mass matrix, Jacobians, energies. Each takes one state or a leading batch axis."""

    nv: int

    def _calls(self) -> _core.Dynamics:
        return cached(self, "_direct", _core.Dynamics)

    def forward_dynamics(
        self,
        q,
        v,
        tau,
        *,
        form: str = "fast",
        refine: int | str = 0,
        residual: str = "same",
        precision: str | int = "double",
        method: str = "articulated",
        on_singular: str = "raise",
        out=None,
    ) -> np.ndarray:
        """Accelerations (nv,) or (B, nv) under generalized forces tau, gravity included: articulated-body algorithm, O(N).

        Each argument has one state or a leading batch axis; batches of the forms "fast" and "ud" run in packs.

        Parameters
        ----------
        form : {"fast", "ud", "square-root"}
            How the articulated inertia is carried: as P, as U diag(w) U*, as L L*. The factored forms keep the digits of light bodies
            beside heavy ones; they cost about three and five times as much.
        refine : int or "auto"
            Corrections by the residual of inverse dynamics, with gravity and Coriolis terms inside the sweep; "auto" takes them as long
            as they shrink.
        residual : {"same", "wider"}
            The residual at the precision itself, or in the next wider one.
        precision : {"single", "double", "extended", "quad", 50, 100}
            The scalar of the whole computation; results are rounded to double.
        method : {"articulated", "cholesky", "ldl", "conjugate-gradients", "inverse", "realization"}
            "articulated" is the O(N) recursion; the others solve the equations of motion by the mass matrix (see docs/accuracy.md)
            and take no form and no refinement.
        on_singular : {"raise", "minimum-norm"}
            What becomes of a hinge that feels no inertia: an error that names it, or the accelerations of least norm among those that
            fit the forces best.

        Raises
        ------
        SingularHingeError
            D(k) is singular at the rounding bound of the form in use.
        RefinementError
            The first correction is more than 0.3 of the solution.
        """
        if method == "articulated":
            return self._calls().forward_dynamics(q, v, tau, form, refine, residual, precision, on_singular, out)
        if form != "fast" or refine != 0 or residual != "same" or on_singular != "raise":
            raise _core.EvaluationError(
                f"method {method!r} has no form, no refinement and no other answer to singular hinges; those are the articulated method's"
            )
        return by_method(self, method, q, v, tau, precision, out)

    def refinement(
        self, q, v, tau, *, form: str = "fast", refine: int | str = "auto", residual: str = "same", precision: str | int = "double"
    ) -> dict[str, Any]:
        """Forward dynamics of one state with its corrections: `value` (nv,), `steps`, and `corrections`, the norm of each correction
        relative to the solution. The first estimates the error before, the last the error that is left."""
        value, corrections = self._calls().refinement(q, v, tau, form, refine, residual, precision)
        return {"value": value, "steps": len(corrections), "corrections": corrections}

    def inverse_dynamics(self, q, v, vdot, *, precision: str | int = "double", out=None) -> np.ndarray:
        """Generalized forces (nv,) or (B, nv) for the accelerations vdot, gravity and rotor inertia included: Newton-Euler, O(N)."""
        return self._calls().inverse_dynamics(q, v, vdot, precision, out)

    def bias_forces(self, q, v, *, precision: str | int = "double", out=None) -> np.ndarray:
        """Coriolis, gyroscopic and gravity forces 𝒞 (nv,) or (B, nv): inverse dynamics at zero acceleration. O(N)."""
        return self._calls().inverse_dynamics(q, v, None, precision, out)

    def mass_matrix(self, q, *, precision: str | int = "double", out=None) -> np.ndarray:
        """The mass matrix of the equations of motion, HφMφ*H* + J, full symmetric (nv, nv) or (B, nv, nv): composite bodies."""
        return self._calls().mass_matrix(q, precision, out)

    def mass_matrix_inverse(
        self,
        q,
        *,
        form: str = "fast",
        refine: int | str = 0,
        residual: str = "same",
        precision: str | int = "double",
        on_singular: str = "raise",
        out=None,
    ) -> np.ndarray:
        """The inverse of mass_matrix, full symmetric, by the innovations factors: O(N) a column. Options as in forward_dynamics;
        on_singular="minimum-norm" gives the pseudoinverse."""
        return self._calls().mass_matrix_inverse(q, form, refine, residual, precision, on_singular, out)

    def jacobian(self, frame: str, q, *, precision: str | int = "double", out=None) -> np.ndarray:
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
