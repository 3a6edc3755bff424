"""Nodes of syntax trees of formulas, in statements (`identities.formula`) and in recursions (`algorithm.formulas`)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Node:
    """A part of a formula."""

    @property
    def children(self) -> tuple[Node, ...]:
        return ()


@dataclass(frozen=True)
class Suffixed(Node):
    """A formula with a suffix."""

    inner: Node

    @property
    def children(self) -> tuple[Node, ...]:
        return (self.inner,)


@dataclass(frozen=True)
class Product(Node):
    """Factors from left to right."""

    factors: tuple[Node, ...]

    @property
    def children(self) -> tuple[Node, ...]:
        return self.factors


def flat(factors: Iterable[Node]) -> list[Node]:
    """Return the factors, with nested products expanded in place."""
    return [f for factor in factors for f in (factor.factors if isinstance(factor, Product) else (factor,))]


def parts(node: Node) -> Iterator[Node]:
    """Yield the node and all nodes under it."""
    yield node
    for child in node.children:
        yield from parts(child)
