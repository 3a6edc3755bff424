"""Elimination over the tree as passes of equations: the system of a realization, its solution, the diagonal blocks of its inverse."""

from __future__ import annotations

from .formulas import At, Inverse, Letter, Quantity, product
from .passes import Equation, Item, Once, Selected, Sweep, System, Term


class SystemLetters:
    """Letters of a system's blocks; one quantity per letter and index notation."""

    def __init__(self, system: System):
        self._number = system.quantity.number
        self._tree = system.tree

    def __call__(self, name: str, indices: str, number: int | None = None) -> Quantity:
        texts = {"s": ("σ", "\\sigma"), "s_b": ("σ_b", "\\sigma_{b}"), "b_b": ("b_b", "b_{b}")}
        text, latex = texts.get(name, (name, name))
        number = self._number if number is None else number
        return Quantity(name, Letter(name, text, latex), number, "blocks" if indices else "matrix", self._tree, indices=indices or "k")


def system_passes(system: System) -> list[Item]:
    """Block elimination of T s = b, leaves to root, as equations; with the border b if there is one."""
    L = SystemLetters(system)
    A, U, T, up, down = L("A", "k"), L("U", "k"), L("T", "kk"), L("T", "pk"), L("T", "kp")
    up_child = At(up, "c")
    passes: list[Item] = []
    equations = [
        Equation(A, (Term(At(T)), Term(product(up_child, At(U, "c")), -1.0, "c"))),
        Equation(U, (Term(product(Inverse(At(A)), At(down))),)),
    ]
    if not system.border:
        return [Sweep(system.tree, -1, equations)]
    X, Y, right, below, S = L("X", "k"), L("Y", "k"), L("T", "kb"), L("T", "bk"), L("S", "")
    equations += [
        Equation(X, (Term(product(Inverse(At(A)), At(right))), Term(product(Inverse(At(A)), up_child, At(X, "c")), -1.0, "c"))),
        Equation(Y, (Term(At(below)), Term(product(At(Y, "c"), At(U, "c")), -1.0, "c"))),
    ]
    passes.append(Sweep(system.tree, -1, equations))
    corner = Term(At(L("T", "bb"), ""))
    passes.append(Once(Equation(S, (corner, Term(product(At(Y), At(X)), -1.0, "bodies")))))
    return passes


def solution_passes(system: System) -> list[Item]:
    """T s = b by the factors: leaves to root, root to leaves."""
    L = SystemLetters(system)
    A, U, r, s, b, up = L("A", "k"), L("U", "k"), L("r", "k"), L("s", "k"), L("b", "k"), L("T", "pk")
    carried = Term(product(At(up, "c"), Inverse(At(A, "c")), At(r, "c")), -1.0, "c")
    own, parent = Term(product(Inverse(At(A)), At(r))), Term(product(At(U), At(s, "p")), -1.0, "p")
    gather = Sweep(system.tree, -1, [Equation(r, (Term(At(b)), carried))])
    if not system.border:
        return [gather, Sweep(system.tree, 1, [Equation(s, (own, parent))])]
    X, Y, S, edge, b_edge = L("X", "k"), L("Y", "k"), L("S", ""), L("s_b", ""), L("b_b", "")
    rest = Term(product(Inverse(At(S, "")), At(Y), Inverse(At(A)), At(r)), -1.0, "bodies")
    return [
        gather,
        Once(Equation(edge, (Term(product(Inverse(At(S, "")), At(b_edge, ""))), rest))),
        Sweep(system.tree, 1, [Equation(s, (own, Term(product(At(X), At(edge, "")), -1.0), parent))]),
    ]


def selected_passes(item: Selected) -> list[Item]:
    """The diagonal blocks of the inverse, base to tip."""
    system = item.system
    L = SystemLetters(system)
    A, U, N, Z, up = L("A", "k"), L("U", "k"), L("N", "k"), L("Z", "kk", number=item.quantity.number), L("T", "pk")
    shifted = Equation(N, (Term(product(At(up), Inverse(At(A))), over="p"),))
    own = [Term(Inverse(At(A))), Term(product(At(U), At(Z, "p"), At(N)), over="p")]
    if not system.border:
        return [Sweep(system.tree, 1, [shifted, Equation(Z, tuple(own))])]
    X, Y, F, S = L("X", "k"), L("Y", "k"), L("F", "k"), L("S", "")
    right, below = L("Z", "kb", number=item.quantity.number), L("Z", "bk", number=item.quantity.number)
    corner = Inverse(At(S, ""))
    equations = [
        shifted,
        Equation(F, (Term(product(At(U), At(right, "p")), over="p"), Term(product(At(X), corner)))),
        Equation(
            Z,
            (
                Term(Inverse(At(A))),
                Term(product(At(U), At(Z, "p"), At(N)), over="p"),
                Term(product(At(X), At(below, "p"), At(N)), over="p"),
                Term(product(At(F), At(Y), Inverse(At(A)))),
            ),
        ),
        Equation(right, (Term(At(F), -1.0),)),
        Equation(below, (Term(product(At(below, "p"), At(N)), -1.0, "p"), Term(product(corner, At(Y), Inverse(At(A))), -1.0))),
    ]
    return [Sweep(system.tree, 1, equations)]
