"""Values in more digits than a double has, and errors measured against them."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

from .. import _core
from .rungs import Rung, epsilon

EXACT = "ud"
"""The form for references: its error does not grow with the mass ratio."""

BITS = 400
"""Working precision of the differences below, more than that of 100 digits."""


def dynamics_expression(model: Any, tau: np.ndarray, v: np.ndarray) -> _core.Operator:
    """Return accelerations at velocities v as an expression, with gravity and Coriolis terms inside the sweeps.

    θ̈ = [I - HψK]* D⁻¹ (T - Hψ(KT + P𝔞 + b)) - K*ψ*𝔞, 𝔞 = a + a₀ [Jain 2011, articulated-body forward dynamics]; T = τ minus
    the inertial forces of rotors on balls and free hinges, v ×* (J v).
    """
    soa = model.soa
    H, psi, K, D, P, I, a, b, a0 = soa("H psi K D P I a b gravity_base")
    forces = _core.constant(np.asarray(tau, float)[:, None], _core.euclidean(1), soa.Theta, "τ")
    T = sum((_core.constant(part[:, None], _core.euclidean(1), soa.Theta, "c") for part in _rotor_forces(model, v)), forces)
    A = a + a0
    innovations = T - H @ psi @ (K @ T + P @ A + b)
    return (I - H @ psi @ K).T @ (D.inv() @ innovations) - K.T @ psi.T @ A


def _rotor_forces(model: Any, v: np.ndarray) -> list[np.ndarray]:
    """Return -v ×* (J v) of rotors on balls and free hinges, as a sum of doubles (nv,), each the remainder of the former."""
    if not model.rotor_forces(v).any():
        return []
    parts: list[np.ndarray] = []
    with mpmath.workprec(BITS):
        left = np.concatenate([np.zeros(0, object), *(_of_hinge(hinge, v) for hinge in model.hinges.values())])
        while any(left) and len(parts) < BITS // 53:
            parts.append(np.array([float(x) for x in left]))
            left = np.array([x - mpmath.mpf(part) for x, part in zip(left, parts[-1], strict=True)], object)
    return parts


def _of_hinge(hinge: Any, v: np.ndarray) -> np.ndarray:
    numbers = lambda x: np.array([mpmath.mpf(float(y)) for y in x], object)
    v, momentum = numbers(v[hinge.v_slice]), numbers(hinge.rotor_inertia) * numbers(v[hinge.v_slice])
    out, at = numbers(np.zeros(len(v))), 0
    for subhinge in hinge.subhinges:
        turns, moves = slice(at, at + 3), slice(at + 3, at + 6)
        if subhinge["kind"] in ("ball", "free"):
            out[turns] = -np.cross(v[turns], momentum[turns])
        if subhinge["kind"] == "free":
            out[turns] = out[turns] - np.cross(v[moves], momentum[moves])
            out[moves] = -np.cross(v[turns], momentum[moves])
        at += _core.subhinge_kinds[subhinge["kind"]].nv
    return out


def exact_dynamics(model: Any, q: np.ndarray, v: np.ndarray, tau: np.ndarray, precision: Any, form: str = EXACT) -> np.ndarray:
    """Return accelerations (nv,) as mpmath numbers in a wider precision, not rounded to double."""
    return dynamics_expression(model, tau, v).at(q, v, form=form, precision=precision).dense(dtype=object)[:, 0]


def dynamics_error(model: Any, q: np.ndarray, v: np.ndarray, tau: np.ndarray, rung: Rung, returned: np.ndarray, truth: np.ndarray) -> float:
    """Return the relative error of forward dynamics at one state, against the exact accelerations.

    In a precision wider than double, the returned array shows only its own rounding. There, for the unrefined articulated
    method, the error is the correction by a residual in the next wider precision, which equals the error except for a relative
    part of about its own size, in the largest norm. An error that the array shows to half its digits is measured on the array: if
    the accelerations are mostly rounding, it may have any size.
    """
    if epsilon(rung.precision) < epsilon("double") and not rung.refine and rung.method == "articulated":
        try:
            run = model.refinement(q, v, tau, form=rung.form, refine=1, residual="wider", precision=rung.precision)
        except _core.RefinementError:  # no digit is correct, and a double shows that
            return relative_error(returned, truth)
        correction = float(run["corrections"][0])
        if correction < epsilon("double") ** 0.5:
            return correction
    return relative_error(returned, truth)


def magnitude(value: Any) -> float:
    """Return the 2-norm (Frobenius for a matrix) of numbers, which may be mpmath's."""
    with mpmath.workprec(BITS):
        return float(mpmath.sqrt(mpmath.fsum(mpmath.mpf(x) ** 2 for x in np.asarray(value, dtype=object).ravel())))


def relative_error(value: Any, exact: Any) -> float:
    """Return the 2-norm of the difference over the 2-norm of the exact value (Frobenius for a matrix); both may be mpmath numbers."""
    value, exact = np.asarray(value, dtype=object).ravel(), np.asarray(exact, dtype=object).ravel()
    with mpmath.workprec(BITS):
        exact = [mpmath.mpf(e) for e in exact]
        off = mpmath.fsum((x - e) ** 2 for x, e in zip(value, exact, strict=True))
        size = mpmath.fsum(e * e for e in exact)
        if not size:
            return 0.0 if not off else float("inf")
        return float(mpmath.sqrt(off / size))
