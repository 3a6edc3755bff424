"""Rotation vectors: the logarithm of rotations, and its rate."""

from __future__ import annotations

import numpy as np


def rotation_vectors(R: np.ndarray) -> np.ndarray:
    """Return φ (B, 3) with exp(φ~) = R (B, 3, 3), |φ| ≤ π, rad."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_rotvec() if len(R) else np.zeros((0, 3))


def skew(x: np.ndarray) -> np.ndarray:
    """Return x~ (..., 3, 3), x~y = x × y."""
    out = np.zeros((*x.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -x[..., 2], x[..., 1], -x[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = x[..., 2], -x[..., 1], x[..., 0]
    return out


def rates_of_rotation_vectors(phi: np.ndarray) -> np.ndarray:
    """Return A(φ) (B, 3, 3) with φ̇ = A ω, ω the angular velocity in the axes that turn: the inverse of the right Jacobian.

        A(φ) = 1 + ½ φ~ + c(θ) φ~φ~,   c(θ) = (1 - (θ/2) cot(θ/2)) / θ²,   θ = |φ|

    c(0) = 1/12 and c(π) = 1/π²: it is smooth from no turn to half a turn. Below θ = 0.1 its series to θ⁶, with a truncation error below
    rounding.

    Source: G. Chirikjian, Stochastic Models, Information Theory, and Lie Groups, vol. 2, Birkhäuser 2012.
    """
    theta = np.linalg.norm(phi, axis=-1)
    square, large = theta**2, theta > 0.1
    half = np.where(large, theta, 1.0) / 2
    closed = (1 - half / np.tan(half)) / np.where(large, square, 1.0)
    series = 1 / 12 + square * (1 / 720 + square * (1 / 30240 + square / 1209600))
    turn = skew(phi)
    return np.eye(3) + turn / 2 + np.where(large, closed, series)[..., None, None] * (turn @ turn)
