"""Bare trees of matrices: the algebra without mechanics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import _core
from ..arguments import parents_of
from ..operators.operator_set import OperatorSet


def sko_model(
    parents: Sequence[int],
    E: Sequence[np.ndarray | None],
    H: Sequence[np.ndarray],
    M: Sequence[np.ndarray],
    J: Sequence[np.ndarray] | None = None,
    *,
    names: Sequence[str] | None = None,
    name: str = "SKO model",
) -> OperatorSet:
    """Return the operators of a bare tree of matrices: the algebra without mechanics, blocks of any size per body.

    Parameters
    ----------
    parents : parents before children, -1 for the base
    E : (s_parent, s_k) block of each body, None for roots
    H, M, J : (n_k, s_k), symmetric (s_k, s_k), symmetric (n_k, n_k); default of J: zero
        A row of H alone may be (s_k,), a J of one coordinate a scalar.
    names : body names, all different; default: "body0", "body1", ...

    Raises
    ------
    ModelError
        A block of the wrong shape or transposed, an E of a root, an entry that is not finite, M or J that is not symmetric, different
        numbers of blocks and names: the error names operator, body and shapes.

    Examples
    --------
    >>> import numpy as np, pycraft as pc
    >>> soa = pc.sko_model([-1, 0], [None, np.eye(2)], [np.eye(1, 2)] * 2, [np.eye(2)] * 2)
    >>> (soa.H @ soa.phi @ soa.M @ soa.phi.T @ soa.H.T).dense()
    array([[2., 1.],
           [1., 1.]])
    """
    inboard = parents_of(parents, repr(name))
    n = len(inboard)
    bodies = [f"body{k}" for k in range(n)] if names is None else _listed("names", names, n, name)
    if not all(isinstance(body, str) for body in bodies) or len(set(bodies)) != n:
        raise _core.ModelError(f"names of {name!r} must be {n} different strings, not {bodies!r}")
    masses = [_square(f"M of body {body!r}", m) for body, m in zip(bodies, _listed("M", M, n, name), strict=True)]
    sizes = [len(m) for m in masses]
    maps = [_rows(f"H of body {body!r}", h, size) for body, h, size in zip(bodies, _listed("H", H, n, name), sizes, strict=True)]
    dof = [len(h) for h in maps]
    edges = [
        _edge(body, e, None if parent < 0 else (bodies[parent], sizes[parent]), size)
        for body, e, parent, size in zip(bodies, _listed("E", E, n, name), inboard, sizes, strict=True)
    ]
    diagonal = []
    for body, j, count in zip(bodies, _listed("J", J, n, name) if J is not None else (), dof, strict=J is not None):
        diagonal.append(_square(f"J of body {body!r}", j, count))

    def flat(blocks: Sequence[np.ndarray]) -> list[list[float]]:
        return [b.ravel().tolist() for b in blocks]

    source = _core.MatrixTree(inboard, sizes, dof, flat(edges), flat(maps), flat(masses), flat(diagonal), bodies, name)
    return OperatorSet(source)


def _listed(what: str, blocks: Any, count: int, name: str) -> list[Any]:
    """Return the blocks of one operator, one per body."""
    if isinstance(blocks, str) or not hasattr(blocks, "__len__"):
        raise _core.ModelError(f"{what} of {name!r} must be a list with one block per body, not {blocks!r}")
    if len(blocks) != count:
        raise _core.ModelError(f"{what} of {name!r}: {len(blocks)} for {count} bodies; give one per body")
    return list(blocks)


def _refuse(what: str, block: np.ndarray, wanted: str) -> _core.ModelError:
    return _core.ModelError(f"{what} has the shape {block.shape}; it takes {wanted}")


def _square(what: str, block: Any, size: int | None = None) -> np.ndarray:
    numbers = _core.real_array(block, what)
    if size == 1 and numbers.ndim == 0:
        numbers = numbers.reshape(1, 1)
    if numbers.ndim != 2 or numbers.shape[0] != numbers.shape[1] or size not in (None, len(numbers)):
        raise _refuse(what, numbers, "a square matrix" if size is None else f"({size}, {size}), one row per coordinate")
    return numbers


def _rows(what: str, block: Any, size: int) -> np.ndarray:
    numbers = _core.real_array(block, what)
    if numbers.ndim == 1 and numbers.size == size:
        numbers = numbers.reshape(1, size)
    if numbers.ndim != 2 or numbers.shape[1] != size:
        raise _refuse(what, numbers, f"(n, {size}): a row per coordinate, a column for each of the body's {size} rows of M")
    return numbers


def _edge(body: str, block: Any, parent: tuple[str, int] | None, size: int) -> np.ndarray:
    what = f"E of body {body!r}"
    if parent is None:
        if block is not None:
            raise _core.ModelError(f"{what}: it is on the base and has none; give None")
        return np.empty((0, size))
    if block is None:
        raise _core.ModelError(f"{what} is missing; it takes ({parent[1]}, {size}), from it to its parent {parent[0]!r}")
    numbers = _core.real_array(block, what)
    if numbers.shape != (parent[1], size):
        raise _refuse(what, numbers, f"({parent[1]}, {size}), from it to its parent {parent[0]!r}")
    return numbers
