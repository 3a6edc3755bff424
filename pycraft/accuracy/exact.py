"""Values in more digits than a double has, and errors measured against them."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

from .. import _core
from .rungs import Rung, epsilon

EXACT = "ud"
"""The form that references are computed in: its error does not grow with the mass ratio."""

BITS = 400
"""Working precision of the differences below, more than that of 100 digits."""


def dynamics_expression(model: Any, tau: np.ndarray) -> _core.Operator:
    """Accelerations as an expression, with gravity and Coriolis terms inside the sweeps.

    θ̈ = [I - HψK]* D⁻¹ (τ - Hψ(Kτ + P𝔞 + b)) - K*ψ*𝔞, 𝔞 = a + a₀ [Jain 2011, articulated-body forward dynamics].
    """
    soa = model.soa
    H, psi, K, D, P, I, a, b, a0 = soa("H psi K D P I a b gravity_base")
    T = _core.constant(np.asarray(tau, float)[:, None], _core.euclidean(1), soa.Theta, "τ")
    A = a + a0
    innovations = T - H @ psi @ (K @ T + P @ A + b)
    return (I - H @ psi @ K).T @ (D.inv() @ innovations) - K.T @ psi.T @ A


def exact_dynamics(model: Any, q: np.ndarray, v: np.ndarray, tau: np.ndarray, precision: Any, form: str = EXACT) -> np.ndarray:
    """Accelerations (nv,) as mpmath numbers in a wider precision, not rounded to double."""
    return dynamics_expression(model, tau).at(q, v, form=form, precision=precision).dense(dtype=object)[:, 0]


def dynamics_error(model: Any, q: np.ndarray, v: np.ndarray, tau: np.ndarray, rung: Rung, returned: np.ndarray, truth: np.ndarray) -> float:
    """Relative error of forward dynamics at one state, against the exact accelerations.

    Of a precision wider than double the array that is returned shows its own rounding and no more. There, for the unrefined articulated
    method, the error is the correction that a residual in the next wider precision makes, which is the error itself but for a relative
    part of about its own size, in the largest norm. An error that the array shows to half its digits is measured on the array: where
    little but rounding is left of the accelerations, that is any size.
    """
    if epsilon(rung.precision) < epsilon("double") and not rung.refine and rung.method == "articulated":
        try:
            run = model.refinement(q, v, tau, form=rung.form, refine=1, residual="wider", precision=rung.precision)
        except _core.RefinementError:  # no digit is right, and a double can show that
            return relative_error(returned, truth)
        correction = float(run["corrections"][0])
        if correction < epsilon("double") ** 0.5:
            return correction
    return relative_error(returned, truth)


def magnitude(value: Any) -> float:
    """2-norm (Frobenius of a matrix) of numbers that may be mpmath's."""
    with mpmath.workprec(BITS):
        return float(mpmath.sqrt(mpmath.fsum(mpmath.mpf(x) ** 2 for x in np.asarray(value, dtype=object).ravel())))


def relative_error(value: Any, exact: Any) -> float:
    """2-norm of the difference over that of the exact value (Frobenius of a matrix); both may be mpmath numbers."""
    value, exact = np.asarray(value, dtype=object).ravel(), np.asarray(exact, dtype=object).ravel()
    with mpmath.workprec(BITS):
        exact = [mpmath.mpf(e) for e in exact]
        off = mpmath.fsum((x - e) ** 2 for x, e in zip(value, exact, strict=True))
        size = mpmath.fsum(e * e for e in exact)
        if not size:
            return 0.0 if not off else float("inf")
        return float(mpmath.sqrt(off / size))
