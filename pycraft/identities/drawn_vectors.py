"""Random values for the named vectors in statements."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core


def drawn_vectors(side: Any, rng: np.random.Generator, known: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return random values for the named vectors of an expression."""
    if isinstance(side, _core.Scalar):
        for operand in side.operands():
            drawn_vectors(operand, rng, known)
    elif isinstance(side, _core.Operator):
        if side.kind == "vector" and side.name not in known:
            known[side.name] = rng.uniform(-1, 1, side.codomain.dimension)
        for child in side.children:
            drawn_vectors(child, rng, known)
    return known
