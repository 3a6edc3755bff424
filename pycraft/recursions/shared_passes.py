"""Passes over the bodies as source of any language: sweeps, assembly and solution of systems, reading of data, and return values."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from .formulas import At, Cut, Node, Quantity, moved
from .passes import CompositeAssembly, Elimination, Equation, Item, Once, Operator, Program, Selected, Solution, Sweep, System, Term
from .recursion import Text, pass_words
from .shared_source import Source

WORDS = Text()


class Passes(Source):
    """A writer of whole programs; subclasses give the language's statements."""

    remark_sign, end, step = "# ", "", "    "
    closing: tuple[str, ...] = ()  # of a loop

    # ------------------------------------------------------------------ statements of a language, given by subclasses
    @abstractmethod
    def declared(self, kind: str, name: str, value: str) -> str:
        """A variable with its value."""

    @abstractmethod
    def none_yet(self, names: Sequence[str], n: str) -> str:
        """Empty variables for a block of each of n bodies."""

    @abstractmethod
    def parent_here(self, tree: int) -> str:
        """p, the parent of body k."""

    @abstractmethod
    def loop(self, direction: int, tree: int) -> str:
        """The head of a loop over bodies."""

    @abstractmethod
    def only_if_a_parent(self, statement: str) -> list[str]:
        """A statement for bodies with a parent."""

    @abstractmethod
    def of_each_body(self, tree: int, statement: str) -> list[str]:
        """A loop of one statement."""

    @abstractmethod
    def collected(self, name: str, value: str, tree: int) -> list[str]:
        """A variable that holds a value of every body."""

    @abstractmethod
    def to_the_root(self, tree: int, lines: list[str]) -> list[str]:
        """A loop in which c is body k and then its ancestors, p the parent of c."""

    @abstractmethod
    def added(self, block: str, sign: str, value: str) -> str:
        """Addition to a block of a larger object."""

    @abstractmethod
    def placed(self, matrix: str, rows: str, columns: str, value: str) -> str:
        """Assignment to some rows and columns of a matrix."""

    @abstractmethod
    def assigned(self, equation: Equation) -> list[str]:
        """Computation of an equation of body k."""

    @abstractmethod
    def assigned_whole(self, equation: Equation) -> list[str]:
        """Computation of an equation of the whole."""

    @abstractmethod
    def system_made(self, system: System) -> list[str]:
        """A system with no entries yet."""

    @abstractmethod
    def received(self, x: Quantity) -> list[str]:
        """Number of columns of an input, and the input divided among bodies if its space is."""

    @abstractmethod
    def operator(self, item: Operator) -> list[str]:
        """A function inside the function."""

    @abstractmethod
    def tree_read(self, suffix: str) -> list[str]:
        """A tree read from the data: its parents, children and number of bodies."""

    @abstractmethod
    def rows_read(self, cut: Cut) -> str:
        """The rows of every body, built from the data."""

    @abstractmethod
    def leaf_read(self, q: Quantity) -> list[str]:
        """A given quantity read from the data."""

    # ------------------------------------------------------------------ lines
    def remark(self, text: str) -> str:
        """A comment line."""
        return self.remark_sign + text

    def indented(self, lines: Sequence[str]) -> list[str]:
        """Lines one step in."""
        return [self.step + line if line else "" for line in lines]

    def over_bodies(self, tree: int, lines: Sequence[str], direction: int = 1) -> list[str]:
        """A loop over bodies; nothing if its body is empty."""
        return [self.loop(direction, tree), *self.indented(lines), *self.closing] if lines else []

    # ------------------------------------------------------------------ passes
    def item(self, item: Item) -> list[str]:
        """The lines of one pass."""
        if isinstance(item, Sweep):
            return self.sweep(item)
        if isinstance(item, Once):
            return ["", self.remark(WORDS.whole(item.equation)), *self.assigned_whole(item.equation)]
        if isinstance(item, Elimination):
            return self.elimination(item.system)
        if isinstance(item, Solution):
            return self.solution(item)
        if isinstance(item, Selected):
            return self.selected(item)
        return self.composite(item) if isinstance(item, CompositeAssembly) else self.operator(item)

    def sweep(self, item: Sweep) -> list[str]:
        """A loop over bodies."""
        parent_is_read = any(term.over == "p" for equation in item.equations for term in equation.terms)
        inside = [self.parent_here(item.tree)] if parent_is_read else []
        for equation in item.equations:
            inside += [self.remark(WORDS.equation(equation)), *self.assigned(equation)]
        made = self.none_yet([equation.target.name for equation in item.equations], f"n{self.suffix(item.tree)}")
        return ["", made, self.remark(pass_words(item.direction)), *self.over_bodies(item.tree, inside, item.direction)]

    def elimination(self, system: System) -> list[str]:
        """The assembly of a system's blocks."""
        name = system.quantity.name
        self.used.add("TreeSystem")
        inside: list[str] = []
        after: list[str] = []
        for of_bodies, reading, entries in self.relations(system):
            (inside if of_bodies else after).append(self.remark(reading))
            for place, guarded, at, sign, value in entries:
                added = self.added(f"{name}.{place}({at if place == 'corner' else f'k, {at}'})", sign, value)
                if place == "corner":
                    after.append(added)
                elif place == "below":
                    after += self.of_each_body(system.tree, added)
                else:
                    inside += self.only_if_a_parent(added) if guarded else [added]
        if any(term.over in ("p", "c") for relation in system.relations for term, _ in relation):
            inside.insert(0, self.parent_here(system.tree))
        title = self.remark("the equations of the realization, T s = b, body by body")
        return ["", title, *self.system_made(system), *self.over_bodies(system.tree, inside), *after]

    def solution(self, item: Solution) -> list[str]:
        """A right-hand side and its solve."""
        name, tree = item.system.quantity.name, item.system.tree
        b = f"b_of_{next(iter(item.states.values())).name if item.states else name}"
        inside: list[str] = []
        after: list[str] = []
        for i, (of_bodies, reading, terms) in enumerate(self.right_sides(item)):
            lines, k = (inside, "k") if of_bodies else (after, "-1")
            lines += [self.remark(reading)] if terms else []
            lines += [self.added(f"{name}.part({b}, {k}, {i})", sign, value) for sign, value in terms]
        made = self.declared("Blocks", b, f"{name}.vector({item.columns})")
        lines = ["", made, *self.over_bodies(tree, inside), *after, f"{b} = {name}.solve({b}){self.end}"]
        for j, q in item.states.items():
            if q.kind == "blocks":
                lines += self.collected(q.name, f"{name}.part({b}, k, {j})", tree)
            else:
                lines.append(self.declared("const Matrix", q.name, f"{name}.part({b}, -1, {j})"))
        return lines

    def selected(self, item: Selected) -> list[str]:
        """The diagonal blocks of a system's inverse."""
        return [self.declared("const Blocks", item.quantity.name, f"{item.system.quantity.name}.inverse()")]

    def composite(self, item: CompositeAssembly) -> list[str]:
        """The composite-body assembly."""
        A, H, R, E, rows = item.target.name, item.H.name, item.R.name, item.E.name, item.rows.name
        at_k, at_p = f"{rows}[k]", f"{rows}[p]"
        own = f" + {item.J.name}[k]" if item.J else ""
        lines = [
            self.declared("Matrix", "f", self.chained([f"{R}[k]", self.transpose.format(f"{H}[k]")])),
            self.placed(A, at_k, at_k, self.chained([f"{H}[k]", "f"]) + own),
        ]
        carried = [
            self.remark("f = E(p,c) f"),
            f"f = {self.chained([f'{E}[c]', 'f'])}{self.end}",
            self.placed(A, at_p, at_k, self.chained([f"{H}[p]", "f"])),
            self.placed(A, at_k, at_p, self.chained([self.transpose.format("f"), self.transpose.format(f"{H}[p]")])),
        ]
        return [
            "",
            self.remark("the columns of body k carried to its ancestors"),
            self.declared("Matrix", A, self.zero_matrix(item.rows.total, item.rows.total)),
            *self.over_bodies(item.tree, [*lines, *self.to_the_root(item.tree, carried)]),
        ]

    # ------------------------------------------------------------------ systems, entry by entry
    def extents(self, system: System) -> tuple[str, str]:
        """Return the sizes of a body's states and of the border's states, zero for states of the other kind."""
        bodies = ", ".join(self.extent(c, "k") if isinstance(c, Cut) else "0" for c in system.cuts)
        return bodies, ", ".join("0" if isinstance(c, Cut) else str(c) for c in system.cuts)

    def relations(self, system: System) -> Iterator[tuple[bool, str, list[Entry]]]:
        """Return for each equation of T: True if every body has it, its text, and its entries."""
        for i, relation in enumerate(system.relations):
            entries = []
            for term, j in relation:
                node = at_child(term.node) if term.over == "c" else term.node
                entries.append(Entry(*place_of(system, i, j, term), f"{i}, {j}", *self.signed(node, term.coefficient)))
            yield isinstance(system.cuts[i], Cut), WORDS.relation(system, i), entries

    def right_sides(self, item: Solution) -> Iterator[tuple[bool, str, list[tuple[str, str]]]]:
        """Return for each equation: True if every body has it, the text of its right side, and (sign, value) of the added terms."""
        for i, terms in enumerate(item.inputs):
            added = [self.signed(term.node, term.coefficient) for term in terms]
            yield isinstance(item.system.cuts[i], Cut), WORDS.input_equation(item, i) if terms else "", added

    def signed(self, node: Node, coefficient: Any) -> tuple[str, str]:
        """Return the operator of the addition, and the value without its sign."""
        return "-=" if coefficient < 0 else "+=", self.scaled(Term(node, abs(coefficient)), True)

    # ------------------------------------------------------------------ the program
    def parameters(self, program: Program) -> list[Quantity]:
        """The vectors that the function takes."""
        return [q for q in self.inputs if not (q in program.inputs and program.identity_columns)]

    def prologue(self) -> list[str]:
        """Return the lines that read the data: the trees, the divisions and the given blocks."""
        lines = [line for tree in self.book.trees for line in self.tree_read(tree.suffix)]
        lines += [self.declared("[[maybe_unused]] const Rows", cut.name, self.rows_read(cut)) for cut in self.book.cuts]
        return lines + [line for leaf in self.leaves for line in self.leaf_read(leaf.quantity)]

    def body(self, program: Program) -> list[str]:
        """Return the body of a function up to its return: the divided inputs, and the passes."""
        lines = [line for x in program.inputs for line in self.received(x)]
        return [*lines, *(line for item in program.items for line in self.item(item)), ""]

    def result(self, program: Program) -> str:
        """Return the result of a function: blocks as one vector, other results unchanged."""
        return self.at(At(program.result, ""))

    def documentation(self, program: Program, shape: str) -> list[str]:
        """Return the documentation of the function's arguments and result."""
        lines = ["data: the tree and the blocks that are given,"]
        for tree in self.book.trees:
            lines.append(f"    parent{tree.suffix}: each body's parent, -1 for the base; parents come before their children")
        for cut in self.book.cuts:
            what = "how many rows each body has in V and F" if cut.key.startswith("size") else "how many coordinates each body has"
            lines.append(f"    {cut.key}: {what if cut.contiguous else 'the rows of a vector that belong to each body'}")
        for leaf in self.leaves:
            where = f" ({self.book.models[leaf.context].words})" if leaf.context > 0 else ""
            lines.append(f"    {leaf.quantity.name}: {meaning(leaf.quantity, where)}")
        shapes = {"vector": "a vector", "matrix": "a matrix", "blocks": "one block per body", "scalar": "a number"}
        returned = shapes.get(shape, "everything that is computed, by its name")
        if program.inputs and not program.identity_columns:
            lines.append(f"{program.inputs[0].name}: a vector, or the columns of a matrix.")
        lines += [f"{q.name}: the vector {WORDS.letter(q)}." for q in self.inputs if q not in program.inputs]
        return [*lines, f"Returns {returned}."]


class Entry(NamedTuple):
    """A term added to one block of T: the block, True if it needs a parent, the place, and the value."""

    place: str
    guarded: bool
    at: str
    sign: str
    value: str


def meaning(q: Quantity, where: str) -> str:
    """Return a given quantity in words; `where` names its model, except for the first model."""
    letter = WORDS.letter(q)
    if q.kind == "function":
        return f"a function that applies {letter} to the columns of a matrix"
    if q.kind == "matrix":
        return f"the matrix {letter}"
    if q.columns == 1:
        return f"the vector {letter}{where}"
    at_a_body = {"pk": f"{letter}(p,k)", "k": f"{letter}(k)"}.get(q.indices, letter)
    return f"the blocks {at_a_body}" + (", none for roots" if q.indices == "pk" else "") + where


def place_of(system: System, i: int, j: int, term: Term) -> tuple[str, bool]:
    """Return the block of T for a term of equation i on state j, and True if the term needs a parent."""
    row, column = isinstance(system.cuts[i], Cut), isinstance(system.cuts[j], Cut)
    if row and column:
        place = {"": "own", "c": "up", "p": "down"}[term.over]
        return place, term.over in ("c", "p")
    return ("right" if row else "below" if column else "corner"), False


def at_child(node: Node) -> Node:
    """Return a parent's sum over children as read at the child: c becomes k, k becomes p."""
    return moved(node, {"c": "k", "k": "p"})
