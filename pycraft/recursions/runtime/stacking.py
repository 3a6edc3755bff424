"""Vectors and blocks body by body, and as a whole."""

import numpy as np


def ranges(sizes: list[int]) -> list[np.ndarray]:
    """The rows of each body when bodies are contiguous."""
    ends = np.cumsum(sizes).astype(int)
    return [np.arange(end - size, end) for end, size in zip(ends, sizes, strict=True)]


def cut(x: np.ndarray, rows: list[np.ndarray]) -> list[np.ndarray]:
    """A vector (or columns) body by body."""
    return [x[r] for r in rows]


def stack(y: list[np.ndarray], rows: list[np.ndarray], columns: int) -> np.ndarray:
    """Blocks body by body as one vector (or columns)."""
    out = np.zeros((sum(map(len, rows)), columns))
    for block, r in zip(y, rows, strict=True):
        out[r] = block
    return out


def assembled(B: list[np.ndarray], rows: list[np.ndarray], columns: list[np.ndarray]) -> np.ndarray:
    """Blocks on the diagonal of a matrix."""
    out = np.zeros((sum(map(len, rows)), sum(map(len, columns))))
    for block, r, c in zip(B, rows, columns, strict=True):
        out[np.ix_(r, c)] = block
    return out


def blocks(given: list, rows: list[np.ndarray], columns: list[np.ndarray]) -> list:
    """Blocks as arrays of their shapes; None for a missing block."""
    shaped = zip(given, rows, columns, strict=True)
    return [None if b is None else np.asarray(b, float).reshape(len(r), len(c)) for b, r, c in shaped]
