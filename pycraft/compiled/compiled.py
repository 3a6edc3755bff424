"""Functions compiled for one model: `arm.compile("forward_dynamics")` and `expression.compile()`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from .build import built
from .source import FUNCTION, written
from .trace import Graph

LARGEST = 200_000
"""Operations beyond which a compiler takes minutes over a function of straight lines."""


class Compiled:
    """What a compiled function tells of itself, and what answers where it does not: arguments of other kinds, states in doubt.

    Attributes
    ----------
    name : what it computes
    arguments : the names of its arrays
    source : the C++ that was compiled; it stands by itself
    library : path of the library that was built of it
    operations : how many a state takes: sums, products, quotients, a sine as one
    """

    def __init__(self, name: str, arguments: Sequence[tuple[str, int]], shape: tuple[int, ...], ordinary: Callable[..., Any]):
        self.name, self.arguments, self.shape = name, tuple(a for a, _ in arguments), shape
        self.source, self.library, self.operations = "", Path(), 0
        self._widths, self._ordinary = [n for _, n in arguments], ordinary
        self.__doc__ = f"{name}({', '.join(self.arguments)}, *, out=None), compiled; one state, or a leading batch axis."

    def __call__(self, *given: Any, out: Any = None) -> Any:
        """By the ordinary way, whose errors name what is wrong."""
        if len(given) != len(self.arguments):
            raise TypeError(f"compiled {self.name} takes {', '.join(self.arguments) or 'no arrays'}, and out=; it was given {len(given)} arguments")
        return self._ordinary(*given, out=out)

    def __repr__(self) -> str:
        return f"<compiled {self.name}({', '.join(self.arguments)}), {self.operations} operations>"


def compiled(behind: Compiled, graph: Graph, results: np.ndarray, title: str, widths: Sequence[tuple[str, int]]) -> Any:
    """The callable of a graph's results."""
    needed = len(graph.needed(results.ravel().tolist()))
    if needed > LARGEST:
        raise _core.EvaluationError(f"{behind.name} comes to {needed} operations in straight lines; beyond {LARGEST} a compiler takes minutes over them")
    behind.source, behind.operations = written(graph, results, widths, title)
    behind.library = built(behind.source)
    return _core.compiled_call(behind, str(behind.library), FUNCTION, behind._widths, list(behind.shape), behind.operations)
