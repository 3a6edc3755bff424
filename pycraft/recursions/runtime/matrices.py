"""Dense matrices, including matrices without rows."""

import numpy as np


def solve(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A⁻¹ b."""
    return np.linalg.solve(A, b) if A.size else b


def inverse(A: np.ndarray) -> np.ndarray:
    """A⁻¹."""
    return np.linalg.inv(A) if A.size else A


def symmetric(A: np.ndarray) -> np.ndarray:
    """A without the rounding that makes it unsymmetric."""
    return (A + A.T) / 2


def root(A: np.ndarray) -> np.ndarray:
    """L, lower triangular, with A = L L*; columns of zeros where A is singular."""
    L = np.zeros_like(A)
    bound = 16 * len(A) * np.finfo(float).eps * max(np.diag(A), default=0)
    for j in range(len(A)):
        pivot = A[j, j] - L[j, :j] @ L[j, :j]
        if pivot < -bound:
            raise ValueError("a block is not positive semidefinite: it has no square root")
        if pivot > bound:
            L[j, j] = np.sqrt(pivot)
            L[j + 1 :, j] = (A[j + 1 :, j] - L[j + 1 :, :j] @ L[j, :j]) / L[j, j]
    return L


def lower_half(A: np.ndarray) -> np.ndarray:
    """The lower triangle of A with half its diagonal."""
    return np.tril(A) - np.diag(np.diag(A)) / 2


def diagonal(A: np.ndarray) -> np.ndarray:
    """The diagonal, as a column."""
    return np.diag(A)[:, None]


def trace(A: np.ndarray) -> float:
    """The sum of the diagonal."""
    return float(np.trace(A))


def norm(A: np.ndarray) -> float:
    """The root of the sum of squares."""
    return float(np.linalg.norm(A))


def square_root(x: float) -> float:
    """√x; values that rounding made negative count as zero."""
    return float(np.sqrt(max(x, 0)))


def logdet(A: np.ndarray) -> float:
    """ln|det A|."""
    return float(np.linalg.slogdet(A)[1]) if A.size else 0.0
