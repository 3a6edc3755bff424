"""Equations from the steps of a plan: one short writer per kind of step, the source of all output in mathematics, Python and C++.

A register of the plan is a quantity, or, if one letter is applied to a register that is read once, the formula itself, so that
`H* x` appears where it is needed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from .formulas import COLUMNS, At, Cut, Function, Node, Product, Quantity, moved, product
from .naming import Model, Workbook, total
from .passes import Equation, MadeDense, Once, Operator, Program, Sweep, System, Term, fused, pruned, quantities_in

Step = dict[str, Any]
WRITERS: dict[str, Callable[[Recursion, Step], None]] = {}
_VECTOR_LETTERS = {"Θ": "u", "V": "alpha", "F": "f", "W": "w"}


def writer(*kinds: str) -> Callable[[Callable[[Recursion, Step], None]], Callable[[Recursion, Step], None]]:
    """Register a function as the writer of these kinds of steps."""

    def register(function: Callable[[Recursion, Step], None]) -> Callable[[Recursion, Step], None]:
        WRITERS.update(dict.fromkeys(kinds, function))
        return function

    return register


@dataclass
class Formula:
    """A register that is a formula at body k, not stored."""

    node: Node
    coefficient: float = 1.0


class Recursion:
    """The equations of one plan, written step by step into `program.items`."""

    def __init__(
        self, book: Workbook, plan: dict[str, Any], result: str = "y", vectors: dict[str, Quantity] | None = None, nested: bool = False
    ):
        self.book, self.plan = book, plan
        self.models: list[Model] = [book.model(c["source"], c["binding"], c["hinge_diagonal"]) for c in plan["contexts"]]
        self.program = Program()
        self.values: dict[int, Quantity | Formula] = {}
        self.result_letter = result
        self.vectors = {} if vectors is None else vectors
        self.uses = Counter(r for step in plan["steps"] for r in step["in"])
        for step in plan["steps"]:
            for realization in [step["realization"]] if step["realization"] else []:
                self.uses.update(t["right"] for t in realization["outputs"])
        self.nested = nested
        self.columns: int | str = COLUMNS
        # A vector expression: x is the number 1.
        readers = [step for step in plan["steps"] if plan["input"] in step["in"]]
        one = plan["request"] == "apply" and not nested and plan["input"] >= 0 and plan["domain"].name == "R^1"
        columns = readers and all(step["kind"] == "apply_column" and not step["transposed"] for step in readers)
        self.unit_input = bool(one and columns and plan["input"] != plan["output"])
        self.systems: dict[int, tuple[System, dict[str, Any]]] = {}
        self.matrices: dict[int, Quantity] = {}

    # ------------------------------------------------------------------ the whole plan
    def write(self) -> Program:
        """The program of the plan."""
        plan, program = self.plan, self.program
        for name, register in plan["vectors"].items():
            if name not in self.vectors:
                self.vectors[name] = self._shaped(self.book.named, name, plan["registers"][register]["space"], 1)
            self.values[register] = self.vectors[name]
        if plan["input"] >= 0 and not self.unit_input:
            x = self._shaped(self.book.new, "x", plan["domain"], COLUMNS)
            self.columns = COLUMNS + x.name.removeprefix("x")
            x = replace(x, columns=self.columns)
            self.values[plan["input"]] = x
            program.inputs.append(x)
            program.identity_columns = plan["columns_of_identity"]
        for step in plan["steps"]:
            WRITERS[step["kind"]](self, step)
        program.result = self._result()
        if not self.nested:
            program.items = fused(pruned(self.book.items + program.items, {program.result}))
        return program

    def _result(self) -> Quantity:
        """Return the result: y, or for a diagonal or a trace computed from columns, the quantity of the columns."""
        plan = self.plan
        register = plan["registers"][plan["output"]]
        request = plan["request"]
        if plan["columns_of_identity"] and request in ("trace", "diagonal"):
            whole = At(self.stored(plan["output"]), "")
            kind = "scalar" if request == "trace" else "matrix"
            made = self.book.new(self.result_letter, kind, rows=total(self.book.cut(plan["codomain"])), columns=1)
            self.once(made, Term(Function(request, whole)))
            return made
        value = self.values[plan["output"]]
        if isinstance(value, Quantity) and value.letter.name == self.result_letter and value not in self.vectors.values():
            return value
        if register["kind"] == "blocks":
            made = self.book.new(self.result_letter, **self._block_shape(register))
            self.sweep(0, Equation(made, (self.term(plan["output"]),)))
            return made
        if isinstance(value, Quantity) and value not in self.program.inputs and value not in self.vectors.values():
            given = value in [leaf.quantity for leaf in self.book.leaves]
            if not given and plan["request"] != "apply":
                return value
        columns = self.columns_of(plan["output"])
        made = self._shaped(self.book.new, self.result_letter, register["space"], columns)
        if isinstance(value, Quantity) and value.kind in ("matrix", "scalar"):
            self.once(made, Term(At(value, "")))
        else:
            self.define(made, self.term(plan["output"]))
        return made

    # ------------------------------------------------------------------ registers
    def _shaped(self, make: Callable[..., Quantity], name: str, space: Any, columns: int | str) -> Quantity:
        """A vector in a space: blocks over the bodies, or one matrix."""
        rows = self.book.cut(space)
        if isinstance(rows, Cut):
            return make(name, "blocks", tree=rows.tree, rows=rows, columns=columns)
        return make(name, "matrix", rows=rows, columns=columns)

    def _block_shape(self, register: dict[str, Any]) -> dict[str, Any]:
        rows, columns = self.book.cut(register["space"]), self.book.cut(register["columns"])
        assert isinstance(rows, Cut)
        return {"tree": rows.tree, "rows": rows, "columns": columns}

    def columns_of(self, register: int) -> int | str:
        """Return the number of columns of a vector register."""
        return self.columns if self.plan["registers"][register]["wide"] and not self.unit_input else 1

    def target(self, out: int, letter: str = "") -> Quantity:
        """The quantity that a step writes; the plan's output is y."""
        register = self.plan["registers"][out]
        if register["kind"] == "vector":
            space = register["space"]
            name = letter or _VECTOR_LETTERS.get(space.name, "f" if space.name.startswith("NodesF") else "w")
            if out == self.plan["output"] and self.plan["request"] == "apply":
                name = self.result_letter
            made = self._shaped(self.book.new, name, space, self.columns_of(out))
        elif register["kind"] == "blocks":
            made = self.book.new(letter or "W", **self._block_shape(register))
        elif register["kind"] == "dense":
            name = self.result_letter if out == self.plan["output"] else letter or "A"
            made = self.book.new(name, "matrix", rows=self.book.cut(register["space"]), columns=self.book.cut(register["columns"]))
        else:
            made = self.book.new(self.result_letter if out == self.plan["output"] else letter or "s", "scalar")
        self.values[out] = made
        return made

    def value(self, register: int) -> Formula:
        """A register as a formula at body k."""
        value = self.values[register]
        if isinstance(value, Quantity):
            return Formula(At(value, "k" if value.kind == "blocks" else ""))
        return value

    def stored(self, register: int) -> Quantity:
        """A register as a quantity."""
        value = self.values[register]
        if isinstance(value, Formula):
            value_was, made = value, self.target(register)
            self.define(made, Term(value_was.node, value_was.coefficient))
            return made
        return value

    def term(self, register: int, *left: Node, coefficient: float = 1.0, over: str = "") -> Term:
        """c · left factors · register, the register read at k, or at c or p if the term runs over them."""
        value = self.value(register)
        node = moved(value.node, {"k": over}) if over in ("c", "p") else value.node
        return Term(product(*left, node), coefficient * value.coefficient, over)

    def inline(self, step: Step, node: Node, coefficient: float = 1.0) -> bool:
        """Keep a short formula of body k that is read once, and write it where it is read."""
        out = step["out"]
        short = not isinstance(node, Product) or len(node.factors) <= 4
        local = all(q.kind == "blocks" for q in quantities_in(node))
        if self.uses[out] == 1 and out != self.plan["output"] and short and local:
            self.values[out] = Formula(node, coefficient)
            return True
        return False

    # ------------------------------------------------------------------ items
    def sweep(self, direction: int, *equations: Equation) -> None:
        """Equations of every body."""
        self.program.items.append(Sweep(equations[0].target.tree, direction, list(equations)))

    def once(self, target: Quantity, *terms: Term) -> None:
        """An equation of the whole."""
        self.program.items.append(Once(Equation(target, terms)))

    def define(self, target: Quantity, *terms: Term) -> None:
        """Add an equation in any order: of every body, or of the whole if the target is."""
        if target.kind == "blocks":
            self.sweep(0, Equation(target, terms))
        else:
            self.once(target, *terms)

    def symbol(self, step: Step) -> Quantity:
        """The quantity of a step's letter."""
        columns = None
        if step["symbol"]["name"] == "B":
            register = self.plan["registers"][step["out"]]
            columns = self.book.cut(register["columns"])
        symbol = step["symbol"]
        return self.models[step["context"]].letter(symbol["name"], tuple(symbol["arguments"]), columns)  # type: ignore[arg-type]  # JSON

    def inlined(self, step: Step) -> None:
        """Insert the equations of a step's operand in place of the step."""
        operand, out = step["operand"], step["out"]
        letter = self.result_letter if out == self.plan["output"] and self.plan["request"] == "apply" else "w"
        nested = Recursion(self.book, operand, letter, self.vectors, nested=True)
        nested.program, nested.columns = self.program, self.columns_of(step["in"][0])
        nested.values[operand["input"]] = self.values[step["in"][0]]
        for inner in operand["steps"]:
            WRITERS[inner["kind"]](nested, inner)
        self.values[out] = nested.values[operand["output"]]

    def operator(self, step: Step) -> Quantity:
        """The dense matrix of a step's operand."""
        quantity = self.book.new("X", "function")
        nested = Recursion(self.book, step["operand"], "w", self.vectors, nested=True)
        for i, register in enumerate(step["operand"]["registers"]):
            if register["shared"] >= 0:  # a matrix of the whole plan
                nested.values[i] = self.values[register["shared"]]
        program = nested.write()
        program.items = fused(program.items)
        operator = Operator(quantity, step["operand"]["text"], program)
        self.program.items.append(operator)
        operand = step["operand"]
        made = self.book.new("A", "matrix", rows=total(self.book.cut(operand["codomain"])), columns=total(self.book.cut(operand["domain"])))
        self.once(made, Term(MadeDense(operator)))
        return made
