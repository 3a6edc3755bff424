"""Elements of recursions: quantities, and formulas of one body and its neighbours.

Everything here and in `passes` is data. `steps` builds it from a plan; `recursion`, `python_source` and `cpp_source` print it.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..formula_nodes import Node, Product, Suffixed, flat


# ---------------------------------------------------------------------- quantities
@dataclass(frozen=True)
class Letter:
    """Names of a quantity: in text, in LaTeX and as an identifier; `plus` appends ⁺ (and `_plus`)."""

    name: str
    text: str
    latex: str
    plus: bool = False


@dataclass(frozen=True, eq=False)
class Cut:
    """Division of a space among bodies. `rows[k]` are body k's entries of a vector; contiguous divisions are given by their sizes."""

    name: str
    key: str
    tree: int
    rows: tuple[tuple[int, ...], ...]
    contiguous: bool

    @property
    def total(self) -> int:
        """The dimension of the space."""
        return sum(map(len, self.rows))


COLUMNS = "m"  # as many columns as x has


@dataclass(frozen=True, eq=False)
class Quantity:
    """A letter with its shape.

    `kind` is "blocks" (one block per body), "matrix" (one for all), "scalar", or "function" (an external operator). `rows` and
    `columns` are a cut, a number, or `COLUMNS`. `indices` is the index notation of a block: "k", "pk" (edges up), "kp" (edges down), "kk".
    """

    name: str
    letter: Letter
    number: int
    kind: str
    tree: int = -1
    rows: Cut | int = 0
    columns: Cut | int | str = 0
    indices: str = "k"


# ---------------------------------------------------------------------- formulas
@dataclass(frozen=True)
class At(Node):
    """A quantity at body k, its parent p, its child c; "" for the whole of it."""

    quantity: Quantity
    at: str = "k"


@dataclass(frozen=True)
class Transposed(Suffixed):
    """X*."""


@dataclass(frozen=True)
class Inverse(Suffixed):
    """X⁻¹: a solve if a factor follows it."""


@dataclass(frozen=True)
class Identity(Node):
    """I, of the size of body k in this cut, or of R^n."""

    cut: Cut | int


@dataclass(frozen=True)
class Function(Node):
    """A named function of one matrix: crm, crf, cross_of_momentum, root, diagonal, trace, logdet, norm, square_root."""

    name: str
    inner: Node

    @property
    def children(self) -> tuple[Node, ...]:
        return (self.inner,)


@dataclass(frozen=True)
class HingeRow(Node):
    """Row j of H(k), as a column."""

    quantity: Quantity
    row: int


@dataclass(frozen=True)
class Part(Node):
    """The rows (axis 0) or columns (axis 1) of a dense matrix that belong to body k; of its transpose if `transposed`."""

    quantity: Quantity
    cut: Cut
    axis: int
    transposed: bool


@dataclass(frozen=True)
class DiagonalPart(Node):
    """The block of a dense matrix in the rows and columns of body k."""

    quantity: Quantity
    rows: Cut
    columns: Cut


@dataclass(frozen=True)
class Assembled(Node):
    """Blocks as one dense matrix, zero off the diagonal."""

    quantity: Quantity
    rows: Cut
    columns: Cut


def star(node: Node) -> Node:
    """Return the transpose; a double transpose cancels."""
    return node.inner if isinstance(node, Transposed) else Transposed(node)


def product(*factors: Node) -> Node:
    """Return a flat product without identities."""
    whole = flat(factors)
    kept = [factor for factor in whole if not isinstance(factor, Identity)] or whole[:1]
    return kept[0] if len(kept) == 1 else Product(tuple(kept))


def moved(node: Node, places: dict[str, str]) -> Node:
    """Return the same formula at another body: {"k": "c"} reads it at a child."""
    if isinstance(node, At):
        return At(node.quantity, places.get(node.at, node.at))
    if isinstance(node, Transposed):
        return Transposed(moved(node.inner, places))
    if isinstance(node, Inverse):
        return Inverse(moved(node.inner, places))
    if isinstance(node, Function):
        return Function(node.name, moved(node.inner, places))
    if isinstance(node, Product):
        return Product(tuple(moved(factor, places) for factor in node.factors))
    return node
