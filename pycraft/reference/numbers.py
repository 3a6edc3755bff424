"""The numbers of the oracle: NumPy's own, or mpmath's of any number of digits. See `pycraft.reference`."""

import numpy as np
from scipy.linalg import expm


def mpmath_context(*arrays):
    """Return the mpmath context (its functions and precision) of the numbers in the arrays; None if they hold NumPy's own numbers."""
    objects = (x for array in arrays if array.dtype == object for x in array.flat)
    return next((x.context for x in objects if hasattr(x, "context")), None)


def converted(x, context):
    """Return the array x in numbers of an mpmath context, exactly; x itself if the context is None."""
    return x if context is None else np.vectorize(context.convert, otypes=[object])(x)


def in_doubles(x):
    """Return the array x rounded to doubles if it holds mpmath numbers."""
    return x.astype(float) if x.dtype == object else x


def epsilon(x):
    """Return the distance from one to the next number of the kind in the array x."""
    context = mpmath_context(x)
    return np.finfo(float).eps if context is None else context.eps


def inv(A):
    """A⁻¹; for mpmath numbers by Gauss–Jordan elimination, the largest entry of a column as pivot. ArithmeticError if singular."""
    if mpmath_context(A) is None:
        return np.linalg.inv(in_doubles(A))
    n, A = len(A), np.hstack([A, np.eye(len(A))])
    for j in range(n):
        i = j + np.argmax(abs(A[j:, j]))
        A[[i, j]] = A[[j, i]]
        A[j] = A[j] / A[j, j]
        filled = A[j] != 0
        for i in np.flatnonzero(A[:, j] != 0):
            if i != j:
                A[i, filled] = A[i, filled] - A[i, j] * A[j, filled]
    return A[:, n:]


def smallest_singular_value(A):
    """σ_min of the square matrix A; for mpmath numbers 1/‖A⁻¹‖_F, which is smaller by a factor √n at most."""
    if mpmath_context(A) is None:
        return np.linalg.svd(in_doubles(A), compute_uv=False).min()
    try:
        return 1 / (inv(A) ** 2).sum() ** 0.5
    except ZeroDivisionError:
        return 0


def exponential(A):
    """exp(A)."""
    context = mpmath_context(A)
    return expm(A) if context is None else np.array(context.expm(context.matrix(A.tolist())).tolist(), object)
