"""What syntax trees of formulas are made of, those of statements (`identities.formula`) and those of recursions (`algorithm.formulas`)."""

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
    """What a suffix makes of one formula."""

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
    """Factors with those of products among them in their place."""
    return [f for factor in factors for f in (factor.factors if isinstance(factor, Product) else (factor,))]


def parts(node: Node) -> Iterator[Node]:
    """The node and all under it."""
    yield node
    for child in node.children:
        yield from parts(child)
