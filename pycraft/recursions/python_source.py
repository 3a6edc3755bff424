"""Recursions as a Python module that needs only NumPy."""

from __future__ import annotations

import pprint
from collections.abc import Sequence
from typing import Any

from .copied_parts import copied, python_parts
from .formulas import Cut, DiagonalPart, HingeRow, Quantity
from .naming import total
from .passes import Equation, Operator, Program, System, Term
from .shared_passes import Passes
from .shared_source import tree_of_terms


class PythonSource(Passes):
    """Writes one program as a Python function and the helpers that it needs."""

    # ------------------------------------------------------------------ words
    def length(self, cut: Cut, k: str) -> str:
        return f"len({cut.name}[{k}])"

    def identity(self, n: int | str) -> str:
        return f"np.eye({n})"

    def zero_matrix(self, rows: int | str, columns: int | str) -> str:
        return f"np.zeros(({rows}, {columns}))"

    def hinge_row(self, node: HingeRow) -> str:
        return f"{node.quantity.name}[k][{node.row}][:, None]"

    def rows_of(self, matrix: str, rows: str) -> str:
        return f"{matrix}[{rows}]"

    def columns_of(self, matrix: str, columns: str) -> str:
        return f"{matrix}[:, {columns}]"

    def diagonal_part(self, node: DiagonalPart) -> str:
        return f"{node.quantity.name}[np.ix_({node.rows.name}[k], {node.columns.name}[k])]"

    # ------------------------------------------------------------------ statements
    def declared(self, kind: str, name: str, value: str) -> str:
        return f"{name} = {value}"

    def none_yet(self, names: Sequence[str], n: str) -> str:
        if len(names) == 1:
            return f"{names[0]} = [None] * {n}"
        return f"{', '.join(names)} = ([None] * {n} for _ in range({len(names)}))"

    def parent_here(self, tree: int) -> str:
        return f"p = parent{self.suffix(tree)}[k]"

    def loop(self, direction: int, tree: int) -> str:
        n = f"n{self.suffix(tree)}"
        return f"for k in reversed(range({n})):" if direction < 0 else f"for k in range({n}):"

    def only_if_a_parent(self, statement: str) -> list[str]:
        return ["if p >= 0:", *self.indented([statement])]

    def of_each_body(self, tree: int, statement: str) -> list[str]:
        return self.over_bodies(tree, [statement])

    def collected(self, name: str, value: str, tree: int) -> list[str]:
        return [f"{name} = [{value} for k in range(n{self.suffix(tree)})]"]

    def to_the_root(self, tree: int, lines: list[str]) -> list[str]:
        parent = f"parent{self.suffix(tree)}"
        return [f"c, p = k, {parent}[k]", "while p >= 0:", *self.indented([*lines, f"c, p = p, {parent}[p]"])]

    def added(self, block: str, sign: str, value: str) -> str:
        return f"{block}[...] {sign} {value}"

    def placed(self, matrix: str, rows: str, columns: str, value: str) -> str:
        return f"{matrix}[np.ix_({rows}, {columns})] = {value}"

    # ------------------------------------------------------------------ equations
    def total(self, equation: Equation) -> str:
        """The right side of an equation."""
        terms = sorted(equation.terms, key=lambda t: t.over in ("p", "c", "bodies"))
        plain = any(not t.over and t.body is None for t in terms)
        if len(terms) == 1 and terms[0].over == "p":
            return f"{self.scaled(terms[0], True)} if p >= 0 else {self.zeros(equation.target)}"
        if len(terms) == 1 and terms[0].body is not None:
            return f"{self.scaled(terms[0], True)} if k == {terms[0].body} else {self.zeros(equation.target)}"
        text = "" if plain else self.zeros(equation.target)
        for term in terms:
            if not term.over:
                text += self.scaled(term, not text)
                continue
            size = Term(term.node, abs(term.coefficient))
            sign = " - " if term.coefficient < 0 else " + "
            if term.over == "p":
                text += f"{sign}({self.scaled(size, True)} if p >= 0 else 0)"
            elif term.over == "c":
                text += f"{sign}sum({self.scaled(size, True)} for c in children{self.suffix(equation.target.tree)}[k])"
            else:
                text += f"{sign}sum({self.scaled(size, True)} for k in range(n{self.suffix(tree_of_terms(equation))}))"
        return self.call("symmetric", text) if equation.symmetric else text

    def assigned(self, equation: Equation) -> list[str]:
        return [f"{equation.target.name}[k] = {self.total(equation)}"]

    def assigned_whole(self, equation: Equation) -> list[str]:
        target, value = equation.target, self.total(equation)
        if target.kind == "blocks":
            assert isinstance(target.rows, Cut)
            value = self.call("cut", value, target.rows.name)
        return [f"{target.name} = {value}"]

    def system_made(self, system: System) -> list[str]:
        suffix = self.suffix(system.tree)
        bodies, border = self.extents(system)
        return [f"{system.quantity.name} = TreeSystem(parent{suffix}, [[{bodies}] for k in range(n{suffix})], [{border}])"]

    def operator(self, item: Operator) -> list[str]:
        x = item.program.inputs[0]
        inside = [f'"""{item.text}, applied to columns."""', *self.body(item.program), f"return {self.result(item.program)}"]
        return ["", f"def {item.quantity.name}({x.name}):", *self.indented(inside)]

    # ------------------------------------------------------------------ what is given
    def received(self, x: Quantity) -> list[str]:
        counted = f"{x.columns} = {x.name}.shape[1]"
        return [counted, f"{x.name} = {self.call('cut', x.name, x.rows.name)}"] if isinstance(x.rows, Cut) else [counted]

    def column(self, q: Quantity) -> list[str]:
        """A named vector as columns, cut."""
        line = f"{q.name} = np.asarray({q.name}, float).reshape(-1, 1)"
        return [line, f"{q.name} = {self.call('cut', q.name, q.rows.name)}"] if isinstance(q.rows, Cut) else [line]

    def tree_read(self, suffix: str) -> list[str]:
        return [
            f'parent{suffix} = data["parent{suffix}"]',
            f"n{suffix} = len(parent{suffix})",
            f"children{suffix} = [[c for c, p in enumerate(parent{suffix}) if p == k] for k in range(n{suffix})]",
        ]

    def rows_read(self, cut: Cut) -> str:
        given = f'data["{cut.key}"]'
        return self.call("ranges", given) if cut.contiguous else f"[np.array(r, int) for r in {given}]"

    def leaf_read(self, q: Quantity) -> list[str]:
        given = f'data["{q.name}"]'
        if q.kind == "function":
            value = given
        elif q.kind != "blocks":
            assert not isinstance(q.columns, str)
            value = f"np.asarray({given}, float).reshape({total(q.rows)}, {total(q.columns)})"
        elif q.columns == 1:
            assert isinstance(q.rows, Cut)
            value = self.call("cut", f"np.asarray({given}, float).reshape(-1, 1)", q.rows.name)
        else:
            assert isinstance(q.rows, Cut) and isinstance(q.columns, Cut)
            rows = f"[{q.rows.name}[p] for p in parent{self.suffix(q.tree)}]" if q.indices == "pk" else q.rows.name
            value = self.call("blocks", given, rows, q.columns.name)
        return [f"{q.name} = {value}"]

    # ------------------------------------------------------------------ the module
    def module(self, program: Program, title: str, shape: str, data: dict[str, Any] | None, name: str) -> str:
        """Return the source; `shape` is the kind of result: "vector", "matrix", "blocks", "scalar", or "everything" by name."""
        given = self.parameters(program)
        body = self.prologue()
        for q in self.inputs:
            if q not in program.inputs:
                body += self.column(q)
        for x in program.inputs:
            if program.identity_columns:
                body.append(f"{x.name} = {self.identity(total(x.rows))}")
            else:
                body += [f"{x.name} = np.asarray({x.name}, float)", f"single = {x.name}.ndim == 1"]
                body.append(f"{x.name} = {x.name}[:, None] if single else {x.name}")
        body += self.body(program) + self.returned(program, shape)
        head = [f'"""{title}', "", *self.documentation(program, shape), '"""', "", "import numpy as np", ""]
        function = [f"def {name}({', '.join(['data', *(q.name for q in given)])}):", *self.indented([f'"""{title}"""', *body])]
        text = "\n".join(head) + "".join("\n\n" + part for part in copied(python_parts(), self.used))
        text += "\n".join(["", "", *function]) + "\n"
        if data is not None:
            arguments = "".join(f", np.ones({total(q.rows)})" for q in given)
            text += f"\n\nDATA = {literal(data)}\n"
            text += f'\nif __name__ == "__main__":\n    print({name}(DATA{arguments}))\n'
        return text

    def returned(self, program: Program, shape: str) -> list[str]:
        """Return the function's last lines: one vector in, one vector out."""
        if shape == "everything":
            return ["return locals()"]
        if shape == "blocks":
            return [f"return {program.result.name}"]
        result = self.result(program)
        if shape == "scalar":
            return [f"return float({result})"]
        if shape != "vector":
            return [f"return {result}"]
        if not program.inputs or program.identity_columns:
            return [f"return {result}[:, 0]"]
        lines, y = ([], result) if result.isidentifier() else ([f"out = {result}"], "out")
        return [*lines, f"return {y}[:, 0] if single else {y}"]


def literal(data: dict[str, Any]) -> str:
    """Data as a Python literal."""
    return pprint.pformat(data, width=140, compact=True, sort_dicts=False)
