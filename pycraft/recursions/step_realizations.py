"""Steps of realizations: the equations T s = b, their elimination over the tree, solutions, diagonal blocks, determinants."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from .formulas import At, Cut, Identity, Node, Part, Quantity, moved, product, star
from .passes import Elimination, InverseBlock, Selected, Solution, System, SystemLogdet, Term
from .steps import Recursion, Step, writer


# ---------------------------------------------------------------------- realizations
@writer("factor")
def _factor(r: Recursion, step: Step) -> None:
    """The equations T s = b of a realization, assembled and eliminated leaves to root."""
    data = step["realization"]
    book = r.book
    tree = book.tree(tuple(data["parents"])).index
    cuts = tuple(book.cut(space) for space in data["states"])
    states = [r._shaped(book.new, "s", space, 1) for space in data["states"]]
    relations: list[list[tuple[Term, int]]] = [[] for _ in data["equations"]]
    for t in data["terms"]:
        relations[t["row"]].append((_relation_term(r, t, cuts[t["column"]]), t["column"]))
    for t in data["border"]:
        rows, columns = book.cut(data["equations"][t["row"]]), cuts[t["column"]]
        C = book.constant(t["constant"], *((columns, rows) if t["transposed"] else (rows, columns)))
        node: Node
        if isinstance(rows, Cut):
            node = Part(C, rows, 0, t["transposed"])
        elif isinstance(columns, Cut):
            node = Part(C, columns, 1, t["transposed"])
        else:
            node = star(At(C, "")) if t["transposed"] else At(C, "")
        over = "bodies" if isinstance(node, Part) and node.axis else ""
        relations[t["row"]].append((Term(node, t["coefficient"], over), t["column"]))
    quantity = book.new("T", "function", tree=tree)
    if not quantity.number and book.names.chosen & set("AUXYSNFZ"):  # letters of the elimination that the user already uses
        quantity = book.new("T", "function", tree=tree)
    system = System(quantity, tree, tuple(states), cuts, tuple(map(tuple, relations)))
    r.systems[step["out"]] = system, data
    r.program.items.append(Elimination(system))


def _relation_term(r: Recursion, t: dict[str, Any], cut: Cut | int) -> Term:
    """c · L · (E or E*) · R of a realization, as equation `row` at body k reads it."""
    if isinstance(cut, int):
        return Term(Identity(cut), t["coefficient"])
    coefficient = t["coefficient"]
    factors: list[Node] = []
    over = {"none": "", "up": "c", "down": "p"}[t["shift"]]
    if t["left"] >= 0:
        left = r.value(t["left"])
        factors.append(left.node)
        coefficient *= left.coefficient
    if over:
        model = r.models[t["context"]]
        factors.append(model.at("E", "c") if over == "c" else star(model.at("E")))
    if t["right"] >= 0:
        right = r.value(t["right"])
        factors.append(moved(right.node, {"k": over}) if over else right.node)
        coefficient *= right.coefficient
    return Term(product(*factors) if factors else Identity(cut), coefficient, over)


@writer("solve")
def _solve(r: Recursion, step: Step) -> None:
    """T s = B x solved, y = C s."""
    system, data = r.systems[step["in"][0]]
    x = step["in"][1]
    r.stored(x)
    inputs: list[list[Term]] = [[] for _ in data["equations"]]

    def local(register: int, t: dict[str, Any]) -> Term:
        if t["right"] < 0:
            return r.term(register, coefficient=t["coefficient"])
        right = r.value(t["right"])
        return r.term(register, right.node, coefficient=t["coefficient"] * right.coefficient)

    for t in data["inputs"]:
        inputs[t["row"]].append(local(x, t))
    y = r.target(step["out"])
    columns = r.columns_of(step["out"])
    fresh: dict[int, Quantity] = {}
    terms = []
    for t in data["outputs"]:
        if t["column"] < 0:
            terms.append(local(x, t))
            continue
        if t["column"] not in fresh:
            like = replace(system.states[t["column"]], columns=columns)
            used = any(isinstance(item, Solution) and item.system is system for item in r.program.items)
            shape = {"tree": like.tree, "rows": like.rows, "columns": columns}
            fresh[t["column"]] = r.book.new("s", like.kind, **shape) if used else like
        s = fresh[t["column"]]
        node: Node = At(s, "k" if s.kind == "blocks" else "")
        coefficient = t["coefficient"]
        if t["right"] >= 0:
            right = r.value(t["right"])
            node, coefficient = product(right.node, node), coefficient * right.coefficient
        terms.append(Term(node, coefficient))
    r.program.items.append(Solution(system, tuple(map(tuple, inputs)), fresh, columns))
    r.define(y, *terms)


@writer("selected_blocks")
def _selected_blocks(r: Recursion, step: Step) -> None:
    """The diagonal blocks of C T⁻¹ B, both ends local."""
    system, data = r.systems[step["in"][0]]
    Z = r.book.new("Z", "function", tree=system.tree)
    r.program.items.append(Selected(system, Z))
    terms = [
        Term(InverseBlock(system, Z, o["column"], i["row"]), o["coefficient"] * i["coefficient"])
        for o in data["outputs"]
        for i in data["inputs"]
    ]
    r.define(r.target(step["out"]), *terms)


@writer("logdet_of_factor")
def _logdet_of_factor(r: Recursion, step: Step) -> None:
    """ln|det T| from the pivots."""
    r.once(r.target(step["out"]), Term(SystemLogdet(r.systems[step["in"][0]][0])))
