"""Cross products of motions and forces, each vector a column (angular; linear)."""

import numpy as np


def skew(w: np.ndarray) -> np.ndarray:
    """w̃: w̃ x = w × x."""
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def crm(V: np.ndarray) -> np.ndarray:
    """[[ω̃, 0], [ṽ, ω̃]]: the cross product of motions."""
    w, v = skew(V[:3, 0]), skew(V[3:, 0])
    return np.block([[w, np.zeros((3, 3))], [v, w]])


def crf(V: np.ndarray) -> np.ndarray:
    """[[ω̃, ṽ], [0, ω̃]]: the cross product of a motion with forces."""
    w, v = skew(V[:3, 0]), skew(V[3:, 0])
    return np.block([[w, v], [np.zeros((3, 3)), w]])


def cross_of_momentum(h: np.ndarray) -> np.ndarray:
    """-[[ñ, f̃], [f̃, 0]] of a momentum (n; f)."""
    n, f = skew(h[:3, 0]), skew(h[3:, 0])
    return -np.block([[n, f], [f, np.zeros((3, 3))]])
