"""Numbers for what written programs bring along: matrices, rows of bodies, and systems over a tree with their dense matrices."""

import numpy as np

from pycraft.recursions.runtime.tree_system import TreeSystem

SIZES = [0, 1, 4]


def random(*shape):
    """The same numbers for the same shape."""
    return np.random.default_rng([7, *shape]).uniform(-1, 1, shape)


def well_posed(n):
    return random(n, n) + 3 * np.eye(n)


# ---------------------------------------------------------------------- body by body


ROWS = {
    "no body": [],
    "one body": [[0, 1]],
    "a body without coordinates": [[0], [], [1, 2]],
    "rows in disorder": [[3, 0], [1], [4, 2]],
}


# ---------------------------------------------------------------------- systems over a tree


TREES = {
    "no body": ([], [], [2, 0]),
    "one body": ([-1], [[2, 1]], [0, 0]),
    "one body and a border": ([-1], [[2, 0]], [0, 1]),
    "a chain": ([-1, 0, 1], [[1, 2], [2, 0], [0, 3]], [0, 0]),
    "a branched tree and a border": ([-1, 0, 0, 1, 1, 2], [[2, 1], [1, 1], [0, 2], [3, 0], [0, 0], [1, 1]], [2, 1]),
    "two roots": ([-1, -1, 1], [[1, 1]] * 3, [0, 2]),
}


def entries_of(parent, sizes, border, own=3.0):
    """(place, arguments, block) of every block that a system on the tree has; `own` is on the diagonal."""
    rng = np.random.default_rng(len(parent))
    entries = []
    for i in range(len(border)):
        for j in range(len(border)):
            diagonal = own if i == j else 0
            for k, p in enumerate(parent):
                entries.append(
                    ("own", (k, i, j), rng.uniform(-1, 1, (sizes[k][i], sizes[k][j])) + diagonal * np.eye(sizes[k][i], sizes[k][j]))
                )
                entries.append(("right", (k, i, j), rng.uniform(-1, 1, (sizes[k][i], border[j]))))
                entries.append(("below", (k, i, j), rng.uniform(-1, 1, (border[i], sizes[k][j]))))
                if p >= 0:
                    entries.append(("up", (k, i, j), rng.uniform(-1, 1, (sizes[p][i], sizes[k][j]))))
                    entries.append(("down", (k, i, j), rng.uniform(-1, 1, (sizes[k][i], sizes[p][j]))))
            entries.append(("corner", (i, j), rng.uniform(-1, 1, (border[i], border[j])) + 9 * diagonal * np.eye(border[i], border[j])))
    return entries


def built(parent, sizes, border, entries):
    """The system, and the same as a dense matrix put together here."""
    system = TreeSystem(parent, sizes, border)
    rows, end = {}, 0
    for k, of_body in enumerate([*sizes, border]):
        for i, size in enumerate(of_body):
            rows[k, i] = slice(end, end + size)
            end += size
    n, T = len(parent), np.zeros((end, end))
    for place, (*body, i, j), value in entries:
        getattr(system, place)(*body, i, j)[...] += value
        k = body[0] if body else n
        row = {"up": parent[k] if body else n, "below": n}.get(place, k)
        column = {"down": parent[k] if body else n, "right": n}.get(place, k)
        T[rows[row, i], rows[column, j]] += value
    return system, T, rows
