"""What Python and C++ source share: how products with inverses are computed, which helpers are needed, where numbers come from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from .formulas import (
    At,
    CompositeAssembly,
    Cut,
    Elimination,
    Equation,
    Function,
    Inverse,
    Item,
    Node,
    Once,
    Operator,
    Product,
    Program,
    Quantity,
    Selected,
    Solution,
    Sweep,
    System,
    Term,
    Transposed,
    moved,
    star,
    tree_in,
)
from .naming import Workbook
from .recursion import Text

WORDS = Text()


class Source(ABC):
    """A writer of source; subclasses give the language's words."""

    transpose = "{}.T"
    product = " @ "

    def __init__(self, book: Workbook, inputs: list[Quantity], needed: set[Quantity]):
        self.book, self.inputs = book, inputs
        self.leaves = [leaf for leaf in book.leaves if leaf.quantity in needed]
        self.used: set[str] = set()

    # ------------------------------------------------------------------ words of a language, given by subclasses
    @abstractmethod
    def at(self, node: At) -> str:
        """A quantity at a body, or the whole of it."""

    @abstractmethod
    def other(self, node: Node) -> str:
        """A formula that is special to dense matrices and systems."""

    @abstractmethod
    def sweep(self, item: Sweep) -> list[str]:
        """A loop over bodies."""

    @abstractmethod
    def once(self, equation: Equation) -> list[str]:
        """An equation of the whole."""

    @abstractmethod
    def elimination(self, system: System) -> list[str]:
        """The assembly of a system's blocks."""

    @abstractmethod
    def solution(self, item: Solution) -> list[str]:
        """A right-hand side and its solve."""

    @abstractmethod
    def selected(self, item: Selected) -> list[str]:
        """The diagonal blocks of a system's inverse."""

    @abstractmethod
    def composite(self, item: CompositeAssembly) -> list[str]:
        """The composite-body assembly."""

    @abstractmethod
    def operator(self, item: Operator) -> list[str]:
        """A function inside the function."""

    def item(self, item: Item) -> list[str]:
        """The lines of one pass."""
        if isinstance(item, Sweep):
            return self.sweep(item)
        if isinstance(item, Once):
            return self.once(item.equation)
        if isinstance(item, Elimination):
            return self.elimination(item.system)
        if isinstance(item, Solution):
            return self.solution(item)
        if isinstance(item, Selected):
            return self.selected(item)
        return self.composite(item) if isinstance(item, CompositeAssembly) else self.operator(item)

    # ------------------------------------------------------------------ formulas
    def call(self, name: str, *arguments: str) -> str:
        """A helper called; it will be written in front."""
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
        return self.other(node)

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
        """Of the arrays of a tree."""
        return self.book.trees[tree].suffix

    def extent(self, cut: Cut | int | str, k: str) -> str:
        """Rows of body k in a cut, or a number."""
        if isinstance(cut, Cut):
            return self.length(cut, k)
        return cut if isinstance(cut, str) else str(cut)

    @abstractmethod
    def length(self, cut: Cut, k: str) -> str:
        """How many rows of a space belong to body k."""

    # ------------------------------------------------------------------ systems, entry by entry
    def extents(self, system: System) -> tuple[str, str]:
        """(the sizes of a body's states, those of the border's), zero for what lies in the other."""
        bodies = ", ".join(self.extent(c, "k") if isinstance(c, Cut) else "0" for c in system.cuts)
        return bodies, ", ".join("0" if isinstance(c, Cut) else str(c) for c in system.cuts)

    def relations(self, system: System) -> Iterator[tuple[bool, str, list[Entry]]]:
        """Of each equation of T: whether it is one of every body, how it reads, and its entries."""
        for i, relation in enumerate(system.relations):
            entries = []
            for term, j in relation:
                node = at_child(term).node if term.over == "c" else term.node
                entries.append(Entry(*place_of(system, i, j, term), f"{i}, {j}", *self.signed(node, term.coefficient)))
            yield isinstance(system.cuts[i], Cut), WORDS.relation(system, i), entries

    def right_sides(self, item: Solution) -> Iterator[tuple[bool, str, list[tuple[str, str]]]]:
        """Of each equation: whether it is one of every body, how its right side reads, and (sign, value) of what is added to it."""
        for i, terms in enumerate(item.inputs):
            added = [self.signed(term.node, term.coefficient) for term in terms]
            yield isinstance(item.system.cuts[i], Cut), WORDS.input_equation(item, i) if terms else "", added

    def signed(self, node: Node, coefficient: Any) -> tuple[str, str]:
        """(the operator that adds, the value without its sign)."""
        return "-=" if coefficient < 0 else "+=", self.scaled(Term(node, abs(coefficient)), True)

    def comment(self, equation: Equation, whole: bool = False) -> str:
        """The equation as the book writes it."""
        return WORDS.whole(equation) if whole else WORDS.equation(equation)


class Entry(NamedTuple):
    """A term added to one block of T: which block, whether it is there only where there is a parent, where, and what."""

    place: str
    guarded: bool
    at: str
    sign: str
    value: str


def is_vector(node: Node) -> bool:
    """Whether a formula has the columns of x."""
    if isinstance(node, Transposed):
        return False
    if isinstance(node, Product):
        return bool(node.factors) and is_vector(node.factors[-1])
    return isinstance(node, At) and (node.quantity.columns == 1 or isinstance(node.quantity.columns, str))


def parent_is_read(sweep: Sweep) -> bool:
    """Whether an equation reads the parent."""
    return any(term.over == "p" for equation in sweep.equations for term in equation.terms)


def tree_of_terms(equation: Equation) -> int:
    """The tree that a sum over bodies runs over."""
    return max([0, *(tree_in(term.node) for term in equation.terms)])


def documentation(source: Source, program: Program, shape: str) -> list[str]:
    """What the function takes and returns, in words."""
    lines = ["data: the tree and the blocks that are given,"]
    for tree in source.book.trees:
        lines.append(f"    parent{tree.suffix}: each body's parent, -1 for the base; parents come before their children")
    for cut in source.book.cuts:
        what = "how many rows each body has in V and F" if cut.key.startswith("size") else "how many coordinates each body has"
        lines.append(f"    {cut.key}: {what if cut.contiguous else 'the rows of a vector that belong to each body'}")
    for leaf in source.leaves:
        q = leaf.quantity
        letter = WORDS.letter(q)
        where = f" ({source.book.models[leaf.context].words})" if leaf.context > 0 else ""
        word = {"pk": f"{letter}(p,k)", "k": f"{letter}(k)"}.get(q.indices, letter)
        if q.kind == "function":
            lines.append(f"    {q.name}: a function that applies {letter} to the columns of a matrix")
        elif q.kind == "matrix":
            lines.append(f"    {q.name}: the matrix {letter}")
        elif q.columns == 1:
            lines.append(f"    {q.name}: the vector {letter}{where}")
        else:
            lines.append(f"    {q.name}: the blocks {word}" + (", none for roots" if q.indices == "pk" else "") + where)
    returned = {"vector": "a vector", "matrix": "a matrix", "blocks": "one block per body", "scalar": "a number"}[shape]
    if program.inputs and not program.identity_columns:
        lines.append(f"{program.inputs[0].name}: a vector, or the columns of a matrix.")
    for q in source.inputs:
        if q not in program.inputs:
            lines.append(f"{q.name}: the vector {WORDS.letter(q)}.")
    return [*lines, f"Returns {returned}."]


def helpers(available: dict[str, tuple[tuple[str, ...], str]], used: set[str]) -> str:
    """The helpers that are used, with those that they use."""
    needed: set[str] = set()

    def add(name: str) -> None:
        needed.add(name)
        for other in available[name][0]:
            add(other)

    for name in used:
        add(name)
    return "".join("\n" + text for name, (_, text) in available.items() if name in needed)


def place_of(system: System, i: int, j: int, term: Term) -> tuple[str, bool]:
    """Which block of T a term of equation i on state j belongs to, and whether it is there only where there is a parent."""
    row, column = isinstance(system.cuts[i], Cut), isinstance(system.cuts[j], Cut)
    if row and column:
        place = {"": "own", "c": "up", "p": "down"}[term.over]
        return place, term.over in ("c", "p")
    return ("right" if row else "below" if column else "corner"), False


def at_child(term: Term) -> Term:
    """A term that a parent sums over its children, read at the child: k is the child, p its parent."""
    return Term(place_moved(term.node), term.coefficient, "c")


def place_moved(node: Node) -> Node:
    """c becomes k, k becomes p."""
    return moved(node, {"c": "k", "k": "p"})
