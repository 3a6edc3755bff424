"""Letters and their definitions: names that do not clash, the trees and divisions of a plan's spaces, the letters of each model at
each state, and the recursions that define P, D, G, R, Υ, V, ... from the blocks E, H, M, J.
"""

from __future__ import annotations

import keyword
import re
from typing import Any

from .. import _core
from .formulas import At, Cut, Function, HingeRow, Identity, Inverse, Letter, Node, Quantity, product, star
from .passes import Equation, Item, Leaf, Sweep, Term

_SYMBOLS = {s.name: (s.text, s.latex) for s in _core.symbols}
_SYMBOLS["E"] = ("E", "E")
_LETTERS = {
    "alpha": ("α", "\\alpha"),
    "eps": ("ε", "\\epsilon"),
    "nu": ("ν", "\\nu"),
    "beta": ("β", "\\beta"),
    "tau_bar": ("τ̄", "\\bar\\tau"),
    "theta_dot": ("θ̇", "\\dot\\theta"),
    "X_root": ("X₀", "X_{0}"),
    "dM": ("∂M", "\\partial M"),
    "Pi": ("Π", "\\Pi"),
}
_RESERVED = set(
    "algorithm data parent children n m k p c np solve inverse cut stack ranges blocks zeros symmetric crm crf "
    "cross_of_momentum lower_half root diagonal trace logdet norm square_root assembled Data Matrix Blocks Rows TreeSystem "
    "main run state int double float auto const for if else while return struct class namespace using template "
    "typename new delete this operator public private bool char void std Eigen size sum max min abs sqrt log "
    "present range list len reversed rows columns system short long signed unsigned switch case default do goto "
    "union enum static inline friend virtual true false and or not xor try throw catch matrix vector values d i j".split()
) | set(keyword.kwlist)


class Names:
    """Hands out names: the second alpha is alpha_2, α₂."""

    def __init__(self) -> None:
        self.taken = set(_RESERVED)
        for name in _SYMBOLS:  # the book's letters keep their meaning
            self.taken.add(name)
        self.chosen: set[str] = set()  # what the user named
        self._numbers: dict[str, int] = {}

    def letter(self, name: str) -> tuple[Letter, int, str]:
        """A fresh (letter, number, identifier) for a known name; number 0 is written without a subscript."""
        plus = name.endswith("_plus")
        base = name.removesuffix("_plus")
        text, latex = _LETTERS.get(base) or _SYMBOLS.get(base) or (base, base)
        letter = Letter(name, text, latex, plus)
        own = name in _SYMBOLS
        while True:
            number = self._numbers.get(name, 0) + 1
            self._numbers[name] = number
            made = (name if number == 1 else f"{base}_{number}") + ("_plus" if plus and number > 1 else "")
            if made not in self.taken or (own and number == 1):
                self.taken.add(made)
                return letter, (0 if number == 1 else number), made

    def given(self, name: str) -> tuple[Letter, int, str]:
        """The letter of something that the user named."""
        made = re.sub(r"\W", "_", name, flags=re.ASCII).strip("_") or "w"
        if made[0].isdigit():
            made = "w_" + made
        latex = name if re.fullmatch(r"[A-Za-z]", name) else "\\mathrm{" + re.sub(r"([_%&#$])", r"\\\1", name) + "}"
        letter = Letter(made, name, latex)
        self.chosen.add(name)
        number = 1
        while (made if number == 1 else f"{made}_{number}") in self.taken:
            number += 1
        identifier = made if number == 1 else f"{made}_{number}"
        self.taken.add(identifier)
        return letter, (0 if number == 1 else number), identifier


class Tree:
    """A tree of bodies; its arrays are called parent, children, n, with a number from the second tree on."""

    def __init__(self, index: int, parents: tuple[int, ...]):
        self.index, self.parents = index, parents
        self.suffix = "" if index == 0 else f"_{index + 1}"


class Workbook:
    """Data shared by the parts of one algorithm: names, trees, divisions, models at states, given data, passes that define letters."""

    def __init__(self) -> None:
        self.names = Names()
        self.trees: list[Tree] = []
        self.cuts: list[Cut] = []
        self.models: list[Model] = []
        self.leaves: list[Leaf] = []
        self.items: list[Item] = []
        self._owners: dict[int, Tree] = {}
        self._constants: dict[int, Quantity] = {}
        self._externals: dict[tuple[str, bool], Quantity] = {}

    # ------------------------------------------------------------------ quantities
    def new(self, name: str, kind: str = "blocks", **shape: Any) -> Quantity:
        """A fresh quantity of a known letter."""
        letter, number, identifier = self.names.letter(name)
        return Quantity(identifier, letter, number, kind, **shape)

    def named(self, name: str, kind: str, **shape: Any) -> Quantity:
        """A fresh quantity that the user named."""
        letter, number, identifier = self.names.given(name)
        return Quantity(identifier, letter, number, kind, **shape)

    # ------------------------------------------------------------------ trees and cuts
    def tree(self, parents: tuple[int, ...], *owners: int) -> Tree:
        """The tree with these parents."""
        for known in self.trees:
            if known.parents == parents:
                break
        else:
            known = Tree(len(self.trees), parents)
            self.trees.append(known)
        for owner in owners:
            self._owners.setdefault(owner, known)
        return known

    def tree_of(self, space: Any) -> Tree:
        """Return the tree of a space's bodies; if the plan has no model, bodies without a parent."""
        if space._owner in self._owners:
            return self._owners[space._owner]
        for known in self.trees:
            if len(known.parents) == space.bodies:
                return known
        return self.tree((-1,) * space.bodies, space._owner)

    def cut(self, space: Any) -> Cut | int:
        """The cut of a space; the dimension of R^n."""
        if space.name.startswith("R^"):
            return space.dimension
        tree = self.tree_of(space)
        rows: list[list[int]] = [[] for _ in range(space.bodies)]
        for _, where, body in space.blocks:
            rows[body] += range(where.start, where.stop)
        made = tuple(map(tuple, rows))
        for known in self.cuts:
            if known.tree == tree.index and known.rows == made:
                return known
        contiguous = [i for block in made for i in block] == list(range(space.dimension))
        kind = "T" if space.name == "Θ" else "N" if space.name.startswith("Nodes") else "V"
        contiguous &= kind != "N"
        base, key = f"rows_{kind}", {"T": "dof", "V": "size"}.get(kind, f"rows_{kind}")
        number = 1 + sum(known.name.startswith(base) for known in self.cuts)
        suffix = "" if number == 1 else f"_{number}"
        self.names.taken |= {base + suffix, key + suffix}
        self.cuts.append(Cut(base + suffix, key + suffix, tree.index, made, contiguous))
        return self.cuts[-1]

    # ------------------------------------------------------------------ what is given
    def constant(self, data: dict[str, Any], rows: Cut | int, columns: Cut | int) -> Quantity:
        """Return a user's constant: blocks if it is block diagonal over the bodies, else a matrix (rows, columns)."""
        if data["id"] not in self._constants:
            if len(data["blocks"]):
                assert isinstance(rows, Cut) and isinstance(columns, Cut)
                made = self.named(data["name"], "blocks", tree=rows.tree, rows=rows, columns=columns)
                shapes = zip(rows.rows, columns.rows, strict=True)
                numbers: Any = [b.reshape(len(r), len(c)) for b, (r, c) in zip(data["blocks"], shapes, strict=True)]
            else:
                made = self.named(data["name"], "matrix", rows=rows, columns=columns)
                numbers = data["dense"].reshape(total(rows), total(columns))
            self._constants[data["id"]] = made
            self.leaves.append(Leaf(made, "constant", numbers=numbers))
        return self._constants[data["id"]]

    def constant_vector(self, data: dict[str, Any], rows: Cut | int) -> Quantity:
        """A user's vector."""
        if data["id"] not in self._constants:
            shape = {"kind": "blocks", "tree": rows.tree} if isinstance(rows, Cut) else {"kind": "matrix"}
            made = self.named(data["name"], rows=rows, columns=1, **shape)
            self._constants[data["id"]] = made
            self.leaves.append(Leaf(made, "constant", numbers=data["dense"].reshape(-1, 1)))
        return self._constants[data["id"]]

    def external(self, name: str, transposed: bool, rows: Cut | int, columns: Cut | int) -> Quantity:
        """Return an external operator, or its transpose: a function of matrices."""
        if (name, transposed) not in self._externals:
            made = self.named(name + ("_transposed" if transposed else ""), "function", rows=rows, columns=columns)
            self._externals[name, transposed] = made
            self.leaves.append(Leaf(made, "external"))
        return self._externals[name, transposed]

    def sort_leaves(self) -> None:
        """Sort the given quantities in the order E, H, M, J, ..., model by model, with constants last."""
        order = {name: i for i, name in enumerate(_GIVEN)}
        self.leaves.sort(key=lambda leaf: (leaf.context < 0, leaf.context, order.get(leaf.symbol, len(order))))

    def model(self, source: Any, binding: int, hinge_diagonal: bool) -> Model:
        """The letters of a model at a state."""
        for known in self.models:
            if known.source is source and known.binding == binding:
                return known
        self.models.append(Model(self, len(self.models), source, binding, hinge_diagonal))
        return self.models[-1]


def total(cut: Cut | int) -> int:
    """The dimension of a space by its cut."""
    return cut if isinstance(cut, int) else cut.total


_SQUARE = (
    *("M", "P", "P_plus", "R", "Upsilon", "V_tilde", "V_bar", "Delta_theta_dot", "momentum_cross", "X_world", "Delta", "tau_bar", "dM"),
    "phi_S",
)
_GIVEN = ("E", "H", "M", "J", "H_dot", "B", "theta_dot", "gravity_base", "dM", "Pi", "phi_S", "H_S", "X_r", "X_r_dot", "dX_r")
_GIVEN_OF_GROUPS = ("V_tilde", "V_bar", "Delta_theta_dot", "momentum_cross", "X_world", "Delta", "h", "a", "b", "gravity_field")
"""Quantities of groups of bodies that are built body by body within a group."""


class Model:
    """The letters of one model at one state: given blocks, and the recursions for the others, each written once, before its first use."""

    def __init__(self, book: Workbook, index: int, source: Any, binding: int, hinge_diagonal: bool):
        self.book, self.index, self.source, self.binding = book, index, source, binding
        self.hinge_diagonal = hinge_diagonal
        self.tree = book.tree(tuple(source.parents), source.Theta._owner, source.V._owner).index
        theta, bodies = book.cut(source.Theta), book.cut(source.V)
        assert isinstance(theta, Cut) and isinstance(bodies, Cut)
        self.theta, self.bodies = theta, bodies
        self._made: dict[tuple[str, tuple[int, ...]], Quantity] = {}

    @property
    def words(self) -> str:
        """The model, and its bound state, in words."""
        return f"of '{self.source.name}'" + (" at a bound state" if self.binding else "")

    # ------------------------------------------------------------------ shapes and places
    def _new(self, name: str, arguments: tuple[Any, ...] = (), **shape: Any) -> Quantity:
        square = {"rows": self.bodies, "columns": self.bodies}
        shapes: dict[str, dict[str, Any]] = {
            "E": square | {"indices": "pk"},
            "H": {"rows": self.theta, "columns": self.bodies},
            "H_dot": {"rows": self.theta, "columns": self.bodies},
            "H_S": {"rows": self.theta, "columns": self.bodies},
            "G": {"rows": self.bodies, "columns": self.theta},
            "D": {"rows": self.theta, "columns": self.theta},
            "J": {"rows": self.theta, "columns": self.theta},
            "Pi": {"rows": self.theta, "columns": self.theta},
            "theta_dot": {"rows": self.theta, "columns": 1},
        }
        if name in ("X_r", "X_r_dot", "dX_r"):  # from Θ_r of embedded loops to Θ of the tree
            shapes[name] = {"rows": self.book.cut(self.source.grouped.Theta), "columns": self.theta}
        vector = {"rows": self.bodies, "columns": 1}
        chosen = shape or shapes.get(name) or (square if name in _SQUARE else vector)
        made = self.book.new(name, tree=self.tree, **chosen)
        self._made[name, arguments] = made
        return made

    def at(self, name: str, at: str = "k") -> At:
        """A letter at body k, c or p."""
        return At(self.letter(name), at)

    def sweep(self, direction: int, *equations: Equation) -> None:
        """Equations of this model's bodies, among the passes that define letters."""
        self.book.items.append(Sweep(self.tree, direction, list(equations)))

    def letter(self, name: str, arguments: tuple[Any, ...] = (), columns: Cut | None = None) -> Quantity:
        """Return the quantity of a letter; the first use writes its recursion."""
        if (name, arguments) in self._made:
            return self._made[name, arguments]
        if (self.source.derived_from or ("",))[0] == "loops":
            raise _core.EvaluationError(
                f"no recursion is written for {name}, the rows of loops: write out the other factors, and insert model.loops.jacobian"
            )
        inserted = name == "h" and arguments[0] == "twist"  # within a hinge: given
        if name in _GIVEN or inserted or (self.source.groups is not None and name in _GIVEN_OF_GROUPS):
            shape: dict[str, Any] = {"rows": self.bodies, "columns": columns} if name == "B" else {}
            made = self._new(name, arguments, **shape)
            self.book.leaves.append(Leaf(made, "symbol", self.index, name, arguments))
            return made
        if name in ("P", "D", "G", "P_plus"):
            self.articulated_inertia()
        elif name in ("Delta", "h"):
            self._direction(name, arguments)
        else:
            getattr(self, "_" + name)()
        return self._made[name, arguments]

    # ------------------------------------------------------------------ inertias
    def articulated_inertia(self) -> None:
        """P, D, G, P⁺: the Riccati sweep, tip to base."""
        if ("P", ()) in self._made:
            return
        H, M, at = self.at("H"), self.at("M"), self.at
        new = {name: self._new(name) for name in ("P", "D", "G", "P_plus")}
        P, D, G = At(new["P"]), At(new["D"]), At(new["G"])
        carried = product(at("E", "c"), At(new["P_plus"], "c"), star(at("E", "c")))
        J = (Term(at("J")),) if self.hinge_diagonal else ()
        self.sweep(
            -1,
            Equation(new["P"], (Term(M), Term(carried, over="c")), symmetric=True),
            Equation(new["D"], (Term(product(H, P, star(H))), *J), symmetric=True),
            Equation(new["G"], (Term(product(P, star(H), Inverse(D))),)),
            Equation(new["P_plus"], (Term(P), Term(product(G, D, star(G)), -1.0)), symmetric=True),
        )

    def _R(self) -> None:
        M, E = self.at("M"), self.at("E", "c")
        R = self._new("R")
        self.sweep(-1, Equation(R, (Term(M), Term(product(E, At(R, "c"), star(E)), over="c")), symmetric=True))

    def _tau_bar(self) -> None:
        G, H = self.at("G"), self.at("H")
        self.sweep(0, Equation(self._new("tau_bar"), (Term(Identity(self.bodies)), Term(product(G, H), -1.0))))

    def _Upsilon(self) -> None:
        H, D, bar, E = self.at("H"), self.at("D"), self.at("tau_bar"), self.at("E")
        Y = self._new("Upsilon")
        carried = product(star(bar), star(E), At(Y, "p"), E, bar)
        self.sweep(1, Equation(Y, (Term(product(star(H), Inverse(D), H)), Term(carried, over="p")), symmetric=True))

    # ------------------------------------------------------------------ velocities
    def _beta(self) -> None:
        H, rate = self.at("H"), self.at("theta_dot")
        self.sweep(0, Equation(self._new("beta"), (Term(product(star(H), rate)),)))

    def _velocity(self) -> None:
        E, beta = self.at("E"), self.at("beta")
        V = self._new("velocity")
        self.sweep(1, Equation(V, (Term(product(star(E), At(V, "p")), over="p"), Term(beta))))

    def _a(self) -> None:
        V, beta, rate, theta_dot = self.at("velocity"), self.at("beta"), self.at("H_dot"), self.at("theta_dot")
        terms = (Term(product(Function("crm", V), beta)), Term(product(star(rate), theta_dot)))
        self.sweep(0, Equation(self._new("a"), terms))

    def _b(self) -> None:
        V, M = self.at("velocity"), self.at("M")
        self.sweep(0, Equation(self._new("b"), (Term(product(Function("crf", V), M, V)),)))

    def _V_tilde(self) -> None:
        V = self.at("velocity")
        self.sweep(0, Equation(self._new("V_tilde"), (Term(Function("crm", V)),)))

    def _V_bar(self) -> None:
        V = self.at("velocity")
        self.sweep(0, Equation(self._new("V_bar"), (Term(Function("crf", V)),)))

    def _Delta_theta_dot(self) -> None:
        beta = self.at("beta")
        self.sweep(0, Equation(self._new("Delta_theta_dot"), (Term(Function("crf", beta)),)))

    def _momentum_cross(self) -> None:
        M, V = self.at("M"), self.at("velocity")
        self.sweep(0, Equation(self._new("momentum_cross"), (Term(Function("cross_of_momentum", product(M, V))),)))

    def _direction(self, name: str, arguments: tuple[Any, ...]) -> None:
        """Δ = crf(h) at the body of a direction: a coordinate, with twist h a row of H, or a twist given within a hinge."""
        twist: Node
        if arguments[0] == "coordinate":
            body, row = 0, arguments[1]
            while row >= len(self.theta.rows[body]):
                row -= len(self.theta.rows[body])
                body += 1
            twist = HingeRow(self.letter("H"), row)
        else:
            body, twist = arguments[1], At(self.letter("h", arguments))
        node = twist if name == "h" else Function("crf", twist)
        self.sweep(0, Equation(self._new(name, arguments), (Term(node, body=body),)))

    # ------------------------------------------------------------------ frames and gravity
    def _X_world(self) -> None:
        root = self.book.new("X_root", tree=self.tree, rows=self.bodies, columns=self.bodies)
        self.book.leaves.append(Leaf(root, "root frame", self.index, "X_world"))
        E = self.at("E")
        X = self._new("X_world")
        self.sweep(1, Equation(X, (Term(At(root)), Term(product(At(X, "p"), E), over="p"))))

    def _gravity_field(self) -> None:
        base, E = self.at("gravity_base"), self.at("E")
        field = self._new("gravity_field")
        self.sweep(1, Equation(field, (Term(product(star(E), At(field, "p")), over="p"), Term(base, -1.0))))
