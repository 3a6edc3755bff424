"""Recursions as a Python module that needs NumPy alone."""

from __future__ import annotations

import pprint
from typing import Any

from .formulas import (
    Assembled,
    At,
    CompositeAssembly,
    Cut,
    DiagonalPart,
    Equation,
    HingeRow,
    Identity,
    InverseBlock,
    MadeDense,
    Node,
    Operator,
    Part,
    Program,
    Quantity,
    Selected,
    Solution,
    Sweep,
    System,
    SystemLogdet,
    Term,
)
from .naming import total
from .python_helpers import HELPERS
from .recursion import pass_words
from .shared_source import Source, documentation, helpers, parent_is_read, tree_of_terms


class PythonSource(Source):
    """Writes one program as a Python function and the helpers that it needs."""

    # ------------------------------------------------------------------ words
    def at(self, node: At) -> str:
        q = node.quantity
        if node.at:
            return f"{q.name}[{node.at}]"
        if q.kind == "blocks":
            assert isinstance(q.rows, Cut)
            return self.call("stack", q.name, q.rows.name, self.extent(q.columns, "k"))
        return q.name

    def length(self, cut: Cut, k: str) -> str:
        return f"len({cut.name}[{k}])"

    def other(self, node: Node) -> str:
        if isinstance(node, Identity):
            return f"np.eye({self.extent(node.cut, 'k')})"
        if isinstance(node, HingeRow):
            return f"{node.quantity.name}[k][{node.row}][:, None]"
        if isinstance(node, Part):
            rows, name = f"{node.cut.name}[k]", node.quantity.name
            straight, turned = f"{name}[{rows}]", f"{name}[:, {rows}]"
            if node.transposed:
                straight, turned = f"{turned}.T", f"{straight}.T"
            return straight if node.axis == 0 else turned
        if isinstance(node, DiagonalPart):
            return f"{node.quantity.name}[np.ix_({node.rows.name}[k], {node.columns.name}[k])]"
        if isinstance(node, Assembled):
            return self.call("assembled", node.quantity.name, node.rows.name, node.columns.name)
        if isinstance(node, SystemLogdet):
            return f"{node.system.quantity.name}.logdet()"
        if isinstance(node, InverseBlock):
            return f"{node.system.quantity.name}.block({node.quantity.name}, k, {node.state}, {node.equation})"
        assert isinstance(node, MadeDense)
        return f"{node.operator.quantity.name}(np.eye({total(node.operator.program.inputs[0].rows)}))"

    def zeros(self, q: Quantity) -> str:
        """Zeros of a quantity's shape."""
        if q.kind == "scalar":
            return "0.0"
        return f"np.zeros(({self.extent(q.rows, 'k')}, {self.extent(q.columns, 'k')}))"

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

    # ------------------------------------------------------------------ passes
    def loop(self, direction: int, tree: int) -> str:
        """The head of a loop over bodies."""
        n = f"n{self.suffix(tree)}"
        return f"for k in reversed(range({n})):" if direction < 0 else f"for k in range({n}):"

    def sweep(self, item: Sweep) -> list[str]:
        names = [equation.target.name for equation in item.equations]
        n = f"n{self.suffix(item.tree)}"
        many = f"{', '.join(names)} = ([None] * {n} for _ in range({len(names)}))"
        lines = ["", many if len(names) > 1 else f"{names[0]} = [None] * {n}", "# " + pass_words(item.direction)]
        lines.append(self.loop(item.direction, item.tree))
        if parent_is_read(item):
            lines.append(f"    p = parent{self.suffix(item.tree)}[k]")
        for equation in item.equations:
            lines.append("    # " + self.comment(equation))
            lines.append(f"    {equation.target.name}[k] = {self.total(equation)}")
        return lines

    def once(self, equation: Equation) -> list[str]:
        target = equation.target
        value = self.total(equation)
        if target.kind == "blocks":
            assert isinstance(target.rows, Cut)
            value = self.call("cut", value, target.rows.name)
        return ["", "# " + self.comment(equation, whole=True), f"{target.name} = {value}"]

    def elimination(self, system: System) -> list[str]:
        name, suffix = system.quantity.name, self.suffix(system.tree)
        self.used.add("TreeSystem")
        bodies, border = self.extents(system)
        lines = [
            "",
            "# the equations of the realization, T s = b, body by body",
            f"{name} = TreeSystem(parent{suffix}, [[{bodies}] for k in range(n{suffix})], [{border}])",
            f"for k in range(n{suffix}):",
            f"    p = parent{suffix}[k]",
        ]
        corner: list[str] = []
        for of_bodies, reading, entries in self.relations(system):
            (lines if of_bodies else corner).append(f"{'    ' if of_bodies else ''}# {reading}")
            for place, guarded, at, sign, value in entries:
                if place == "corner":
                    corner.append(f"{name}.corner({at})[...] {sign} {value}")
                elif place == "below":
                    corner += [f"for k in range(n{suffix}):", f"    {name}.below(k, {at})[...] {sign} {value}"]
                else:
                    lines += ["    if p >= 0:"] if guarded else []
                    lines.append(f"{'        ' if guarded else '    '}{name}.{place}(k, {at})[...] {sign} {value}")
        return lines + corner

    def solution(self, item: Solution) -> list[str]:
        name, suffix = item.system.quantity.name, self.suffix(item.system.tree)
        columns = item.columns if isinstance(item.columns, str) else str(item.columns)
        b = f"b_of_{name}"
        body: list[str] = []
        once: list[str] = []
        lines = ["", f"{b} = {name}.vector({columns})"]
        for i, (of_bodies, reading, terms) in enumerate(self.right_sides(item)):
            lines_of, indent, k = (body, "    ", "k") if of_bodies else (once, "", "-1")
            lines_of += [f"{indent}# {reading}"] if terms else []
            for sign, value in terms:
                lines_of.append(f"{indent}{name}.part({b}, {k}, {i})[...] {sign} {value}")
        if body:
            lines += [f"for k in range(n{suffix}):", *body]
        lines += [*once, f"{b} = {name}.solve({b})"]
        for j, q in item.states.items():
            if q.kind == "blocks":
                lines.append(f"{q.name} = [{name}.part({b}, k, {j}) for k in range(n{suffix})]")
            else:
                lines.append(f"{q.name} = {name}.part({b}, -1, {j})")
        return lines

    def selected(self, item: Selected) -> list[str]:
        return [f"{item.quantity.name} = {item.system.quantity.name}.inverse()"]

    def composite(self, item: CompositeAssembly) -> list[str]:
        A, H, R, E, rows, suffix = item.target.name, item.H.name, item.R.name, item.E.name, item.rows.name, self.suffix(item.tree)
        total = item.rows.total
        own = f" + {item.J.name}[k]" if item.J else ""
        return [
            "",
            "# the columns of body k carried to its ancestors",
            f"{A} = np.zeros(({total}, {total}))",
            f"for k in range(n{suffix}):",
            f"    f = {R}[k] @ {H}[k].T",
            f"    {A}[np.ix_({rows}[k], {rows}[k])] = {H}[k] @ f{own}",
            f"    c, p = k, parent{suffix}[k]",
            "    while p >= 0:",
            "        # f = E(p,c) f",
            f"        f = {E}[c] @ f",
            f"        {A}[np.ix_({rows}[p], {rows}[k])] = {H}[p] @ f",
            f"        {A}[np.ix_({rows}[k], {rows}[p])] = f.T @ {H}[p].T",
            f"        c, p = p, parent{suffix}[p]",
        ]

    def operator(self, item: Operator) -> list[str]:
        x = item.program.inputs[0]
        lines = ["", f"def {item.quantity.name}({x.name}):", f'    """{item.text}, applied to columns."""']
        return lines + ["    " + line if line else "" for line in self.body(item.program)]

    def body(self, program: Program) -> list[str]:
        """The inside of a function: cut what is given, pass over the tree, stack what is returned."""
        lines: list[str] = []
        for x in program.inputs:
            lines.append(f"{x.columns} = {x.name}.shape[1]")
            if isinstance(x.rows, Cut):
                lines.append(f"{x.name} = {self.call('cut', x.name, x.rows.name)}")
        for item in program.items:
            lines += self.item(item)
        lines.append("")
        result = program.result
        lines.append(f"return {self.at(At(result, '')) if result.kind == 'blocks' else result.name}")
        return lines

    # ------------------------------------------------------------------ the module
    def module(self, program: Program, title: str, shape: str, data: dict[str, Any] | None, name: str) -> str:
        """The source; `shape` says what is returned: "vector", "matrix", "blocks", "scalar"."""
        vectors = [q for q in self.inputs if q not in program.inputs]
        given = [q for q in self.inputs if not (q in program.inputs and program.identity_columns)]
        parameters = ", ".join(["data", *(q.name for q in given)])
        body: list[str] = self.prologue(program)
        for q in vectors:
            body += self.column(q)
        for x in program.inputs:
            if program.identity_columns:
                body.append(f"{x.name} = np.eye({total(x.rows)})")
            else:
                body += [f"{x.name} = np.asarray({x.name}, float)", f"single = {x.name}.ndim == 1"]
                body.append(f"{x.name} = {x.name}[:, None] if single else {x.name}")
        inside = self.body(program)
        returned = inside.pop().removeprefix("return ")
        body += inside
        single = bool(program.inputs) and not program.identity_columns
        if shape == "vector" and single:
            body.append(f"{'y' if returned == 'y' else 'out'} = {returned}")
            returned = f"{'y' if returned == 'y' else 'out'}"
            body.append(f"return {returned}[:, 0] if single else {returned}")
        elif shape == "vector":
            body.append(f"return {returned}[:, 0]")
        elif shape == "scalar":
            body.append(f"return float({returned})")
        elif shape == "blocks":
            body.append(f"return {program.result.name}")
        else:
            body.append(f"return {returned}")
        head = [f'"""{title}', "", *documentation(self, program, shape), '"""', "", "import numpy as np", ""]
        function = ["", f"def {name}({parameters}):", f'    """{title}"""', *("    " + line if line else "" for line in body)]
        text = "\n".join(head) + helpers(HELPERS, self.used) + "\n".join(["", *function]) + "\n"
        if data is not None:
            arguments = "".join(f", np.ones({total(q.rows)})" for q in given)
            text += f"\n\nDATA = {literal(data)}\n"
            text += f'\nif __name__ == "__main__":\n    print({name}(DATA{arguments}))\n'
        return text

    def column(self, q: Quantity) -> list[str]:
        """A named vector as columns, cut."""
        line = f"{q.name} = np.asarray({q.name}, float).reshape(-1, 1)"
        return [line, f"{q.name} = {self.call('cut', q.name, q.rows.name)}"] if isinstance(q.rows, Cut) else [line]

    def prologue(self, program: Program) -> list[str]:
        """What is read from `data`: the trees, the cuts and the given blocks."""
        lines = []
        for tree in self.book.trees:
            s = tree.suffix
            lines += [f'parent{s} = data["parent{s}"]', f"n{s} = len(parent{s})"]
            lines.append(f"children{s} = [[c for c, p in enumerate(parent{s}) if p == k] for k in range(n{s})]")
        for cut in self.book.cuts:
            given = f'data["{cut.key}"]'
            lines.append(
                f"{cut.name} = {self.call('ranges', given)}" if cut.contiguous else f"{cut.name} = [np.array(r, int) for r in {given}]"
            )
        for leaf in self.leaves:
            q = leaf.quantity
            if q.kind == "function":
                lines.append(f'{q.name} = data["{q.name}"]')
            elif q.kind == "blocks" and q.columns == 1:
                assert isinstance(q.rows, Cut)
                column = f'np.asarray(data["{q.name}"], float).reshape(-1, 1)'
                lines.append(f"{q.name} = {self.call('cut', column, q.rows.name)}")
            elif q.kind == "blocks":
                assert isinstance(q.rows, Cut) and isinstance(q.columns, Cut)
                rows, s = q.rows.name, self.suffix(q.tree)
                if q.indices == "pk":
                    rows = f"[{rows}[p] for p in parent{s}]"
                given = f'data["{q.name}"]'
                lines.append(f"{q.name} = {self.call('blocks', given, rows, q.columns.name)}")
            else:
                assert not isinstance(q.columns, str)
                lines.append(f'{q.name} = np.asarray(data["{q.name}"], float).reshape({total(q.rows)}, {total(q.columns)})')
        return lines


def literal(data: dict[str, Any]) -> str:
    """Data as a Python literal."""
    return pprint.pformat(data, width=140, compact=True, sort_dicts=False)
