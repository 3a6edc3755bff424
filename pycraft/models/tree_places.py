"""Places of the bodies of a tree in a diagram."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def tree_places(parents: Sequence[int]) -> np.ndarray:
    """Return (n + 1, 2) places of the bodies and, last, of the base: leaves side by side, a body above the middle of its children.

    Parameters
    ----------
    parents : number of the carrier of each body, -1 for the base, each carrier before its children

    Returns
    -------
    numpy.ndarray
        x from 0 to 1 (0.5 without branches), y from 0, the base, to 1, the body farthest from it by hinges. O(N).

    Examples
    --------
    >>> from pycraft.models.tree_places import tree_places
    >>> tree_places([-1, 0, 0]).tolist()
    [[0.5, 0.5], [0.25, 1.0], [0.75, 1.0], [0.5, 0.0]]
    """
    n = len(parents)
    children: list[list[int]] = [[] for _ in range(n + 1)]
    for k, p in enumerate(parents):
        children[p].append(k)  # -1: the base, last
    depth = np.zeros(n + 1)
    for k, p in enumerate(parents):
        depth[k] = depth[p] + 1 if p >= 0 else 1
    x, leaves, stack = np.zeros(n + 1), 0, [-1]
    order: list[int] = []
    while stack:
        k = stack.pop()
        order.append(k)
        if not children[k]:
            x[k], leaves = leaves, leaves + 1
        stack += reversed(children[k])
    for k in reversed(order):
        if children[k]:
            x[k] = np.mean(x[children[k]])
    return np.column_stack([(x + 0.5) / max(leaves, 1), depth / max(depth.max(), 1)])
