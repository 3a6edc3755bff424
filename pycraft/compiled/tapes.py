"""Tapes of the core (cpp/lanes/tape.h) as graphs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import _core
from .graph import Graph


def graph_of(tape: Any, arrays: Sequence[str]) -> tuple[Graph, np.ndarray]:
    """Return a tape (cpp/bindings/tapes.h) as a graph and the nodes of its results; `arrays` are the names of the arrays that it reads."""
    graph = Graph()
    does, taken, number, results, guards, finite = tape
    made: list[int] = []
    truths: dict[int, list[int]] = {}
    for at, (what, (a, b, c), x) in enumerate(zip(does, taken.tolist(), number.tolist(), strict=True)):
        node = -1
        match what:
            case "number":
                node = graph.number(x)
            case "input":
                node = graph.input(arrays[b], a)
            case "both":
                truths[at] = truths[a] + truths[b]
            case "equal":
                pass  # a guard, of what is compared
            case "root" | "logarithm":
                node = graph.put("sqrt" if what == "root" else "log", made[a])
            case "negate" | "sine" | "cosine" | "magnitude" | "fraction" | "exponent":
                node = graph.put(what, made[a])
            case "fused":
                node = graph.put("add", graph.put("multiply", made[a], made[b]), made[c])
            case "choose":
                node = graph.put("choose", made[a], made[b], made[c])
            case _:
                node = graph.put(what, made[a], made[b])
        if what in ("greater", "at_least"):
            truths[at] = [node]
        made.append(node)
    for truth, holds in guards:
        a, b = (made[i] for i in taken[truth][:2].tolist())
        graph.guards += truths[truth] if holds and truth in truths else _instead(graph, does[truth], a, b, holds)
    graph.guards = list(dict.fromkeys(graph.guards))
    for at in finite:
        graph.require_finite(made[at])
    return graph, np.array([made[r] for r in results], int)


def _instead(graph: Graph, what: str, a: int, b: int, holds: bool) -> list[int]:
    """Guards that hold where a comparison does not, or where it is an equality that does."""
    match what, holds:
        case "greater", False:
            return [graph.put("at_least", b, a)]
        case "at_least", False:
            return [graph.put("greater", b, a)]
        case "equal", True:
            return [graph.put("at_least", a, b), graph.put("at_least", b, a)]
        case "equal", False:
            return [graph.put("greater", graph.put("magnitude", graph.put("subtract", a, b)), graph.zero)]
    raise _core.EvaluationError(f"a guard of kind {what!r} is not known")  # no tape leaves one
