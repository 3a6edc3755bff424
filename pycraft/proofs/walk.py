"""Walks through expressions of any depth: generators that yield a walk for each part and are sent its result."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

NODES = 200_000
"""Number of nodes at which a walk gives up: an expression with shared parts is larger than it looks."""
Walk = Generator[Any, Any, Any]


class GaveUp(Exception):
    """A derivation outgrew its limits."""


def carried_out(walk: Walk) -> Any:
    """Return the result of a walk. Raises GaveUp beyond `NODES` parts."""
    stack, sent, taken = [walk], None, 0
    while stack:
        try:
            stack.append(stack[-1].send(sent))
            sent, taken = None, taken + 1
        except StopIteration as end:
            stack.pop()
            sent = end.value
        if taken > NODES:
            raise GaveUp
    return sent
