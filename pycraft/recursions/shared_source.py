"""Formulas as source of any language: the computation of products with inverses, and the helper functions needed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from .formulas import (
    Assembled,
    At,
    Cut,
    DiagonalPart,
    Function,
    HingeRow,
    Identity,
    Inverse,
    Node,
    Part,
    Product,
    Quantity,
    Transposed,
    star,
)
from .naming import Workbook, total
from .passes import Equation, InverseBlock, MadeDense, SystemLogdet, Term, tree_in


class Source(ABC):
    """A writer of formulas as source; subclasses give the language's words."""

    transpose = "{}.T"
    product = " @ "

    def __init__(self, book: Workbook, inputs: list[Quantity], needed: set[Quantity]):
        self.book, self.inputs = book, inputs
        self.leaves = [leaf for leaf in book.leaves if leaf.quantity in needed]
        self.used: set[str] = set()

    # ------------------------------------------------------------------ words of a language, given by subclasses
    @abstractmethod
    def length(self, cut: Cut, k: str) -> str:
        """The number of rows of body k in a space."""

    @abstractmethod
    def identity(self, n: int | str) -> str:
        """The identity matrix."""

    @abstractmethod
    def zero_matrix(self, rows: int | str, columns: int | str) -> str:
        """A matrix of zeros."""

    @abstractmethod
    def hinge_row(self, node: HingeRow) -> str:
        """A row of a block of H, as a column."""

    @abstractmethod
    def rows_of(self, matrix: str, rows: str) -> str:
        """Some rows of a matrix."""

    @abstractmethod
    def columns_of(self, matrix: str, columns: str) -> str:
        """Some columns of a matrix."""

    @abstractmethod
    def diagonal_part(self, node: DiagonalPart) -> str:
        """A(k,k) of a dense matrix."""

    # ------------------------------------------------------------------ formulas
    def call(self, name: str, *arguments: str) -> str:
        """A call of a helper function, which is then copied to the start."""
        self.used.add(name)
        return f"{name}({', '.join(arguments)})"

    def code(self, node: Node) -> str:
        """A formula as source."""
        if isinstance(node, At):
            return self.at(node)
        if isinstance(node, Transposed):
            inner = self.code(node.inner)
            return self.transpose.format(f"({inner})" if isinstance(node.inner, Product) else inner)
        if isinstance(node, Inverse):
            return self.call("inverse", self.code(node.inner))
        if isinstance(node, Product):
            return self.chain(list(node.factors))
        if isinstance(node, Function):
            return self.call(node.name, self.code(node.inner))
        return self.of_a_matrix_or_system(node)

    def of_a_matrix_or_system(self, node: Node) -> str:
        """A formula specific to dense matrices and systems."""
        if isinstance(node, Identity):
            return self.identity(self.extent(node.cut, "k"))
        if isinstance(node, HingeRow):
            return self.hinge_row(node)
        if isinstance(node, Part):
            picked = self.rows_of if (node.axis == 0) != node.transposed else self.columns_of
            made = picked(node.quantity.name, f"{node.cut.name}[k]")
            return self.transpose.format(made) if node.transposed else made
        if isinstance(node, DiagonalPart):
            return self.diagonal_part(node)
        if isinstance(node, Assembled):
            return self.call("assembled", node.quantity.name, node.rows.name, node.columns.name)
        if isinstance(node, SystemLogdet):
            return f"{node.system.quantity.name}.logdet()"
        if isinstance(node, InverseBlock):
            return f"{node.system.quantity.name}.block({node.quantity.name}, k, {node.state}, {node.equation})"
        assert isinstance(node, MadeDense)
        return f"{node.operator.quantity.name}({self.identity(total(node.operator.program.inputs[0].rows))})"

    def at(self, node: At) -> str:
        """A quantity at a body, or the whole of it."""
        q = node.quantity
        if node.at:
            return f"{q.name}[{node.at}]"
        if q.kind == "blocks":
            assert isinstance(q.rows, Cut)
            return self.call("stack", q.name, q.rows.name, self.extent(q.columns, "k"))
        return q.name

    def chain(self, factors: Sequence[Node]) -> str:
        """A product: inverses become solves, matrices act on vectors from the right."""
        if not factors:
            return "1"
        for i, factor in enumerate(factors):
            if not isinstance(factor, Inverse):
                continue
            left, right = list(factors[:i]), list(factors[i + 1 :])
            if right:
                made = self.call("solve", self.code(factor.inner), self.chain(right))
                return self.chained([*map(self.factor, left), made]) if left else made
            if left:  # X A⁻¹ = (A⁻* X*)*
                turned = self.chain([star(f) for f in reversed(left)])
                return self.transpose.format(self.call("solve", self.code(star(factor.inner)), turned))
        if isinstance(factors[0], At) and factors[0].quantity.kind == "function":
            return f"{self.code(factors[0])}({self.chain(factors[1:])})"
        if is_vector(factors[-1]) and len(factors) > 2:
            made = self.chained([self.factor(factors[-2]), self.factor(factors[-1])])
            for factor in reversed(factors[:-2]):
                made = self.chained([self.factor(factor), f"({made})"])
            return made
        return self.chained([self.factor(factor) for factor in factors])

    def factor(self, node: Node) -> str:
        """A factor of a product."""
        return f"({self.code(node)})" if isinstance(node, Product) else self.code(node)

    def chained(self, factors: Sequence[str]) -> str:
        """Factors with the language's sign between them."""
        return self.product.join(factors)

    def scaled(self, term: Term, first: bool) -> str:
        """A term with its sign and coefficient; `first` in a sum."""
        size, sign = float(abs(term.coefficient)), "-" if term.coefficient < 0 else ""
        if term.node == Product(()):
            body = repr(size)
        else:
            body = (f"{size!r} * " if size != 1 else "") + self.code(term.node)
            if size != 1 and isinstance(term.node, Product):
                body = f"{size!r} * ({self.code(term.node)})"
        if first:
            return sign + (f"({body})" if sign and isinstance(term.node, Product) and size == 1 else body)
        return (" - " if sign else " + ") + body

    # ------------------------------------------------------------------ shapes
    def suffix(self, tree: int) -> str:
        """The suffix of the names of a tree's arrays."""
        return self.book.trees[tree].suffix

    def extent(self, cut: Cut | int | str, k: str) -> str:
        """Rows of body k in a cut, or a number."""
        if isinstance(cut, Cut):
            return self.length(cut, k)
        return cut if isinstance(cut, str) else str(cut)

    def zeros(self, q: Quantity) -> str:
        """Zeros of a quantity's shape."""
        return "0.0" if q.kind == "scalar" else self.zero_matrix(self.extent(q.rows, "k"), self.extent(q.columns, "k"))


def is_vector(node: Node) -> bool:
    """Return True if a formula has the columns of x."""
    if isinstance(node, Transposed):
        return False
    if isinstance(node, Product):
        return bool(node.factors) and is_vector(node.factors[-1])
    return isinstance(node, At) and (node.quantity.columns == 1 or isinstance(node.quantity.columns, str))


def tree_of_terms(equation: Equation) -> int:
    """The tree that a sum over bodies runs over."""
    return max([0, *(tree_in(term.node) for term in equation.terms)])
