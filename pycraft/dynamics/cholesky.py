"""Cholesky factors of matrices of a batch, with the state where there is none."""

from __future__ import annotations

import numpy as np

from .. import _core


def cholesky(matrix: np.ndarray, called: str, without: str) -> np.ndarray:
    """Return L with LL* = matrix, (..., n, n). SingularOperatorError names the state of a matrix that is not positive definite."""
    try:
        return np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        which = ""
        if matrix.ndim > 2 and len(matrix) > 1:
            bad = next(b for b, one in enumerate(matrix) if not _positive(one))
            which = f" (state {bad} of a batch of {len(matrix)})"
        raise _core.SingularOperatorError(f"{called} is not positive definite to rounding: {without}{which}") from None


def _positive(matrix: np.ndarray) -> bool:
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True
