"""Recursions as C++17 that needs Eigen alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from .cpp_helpers import HELPERS
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
from .recursion import pass_words
from .shared_source import Source, documentation, helpers, parent_is_read, tree_of_terms

_RESULT_TYPES = {"vector": "Matrix", "matrix": "Matrix", "blocks": "Blocks", "scalar": "double"}


class CppSource(Source):
    """Writes one program as a C++ function in a namespace of its own."""

    transpose = "{}.transpose()"
    product = " * "

    # ------------------------------------------------------------------ words
    def at(self, node: At) -> str:
        q = node.quantity
        if node.at:
            return f"{q.name}[{node.at}]"
        if q.kind == "blocks":
            assert isinstance(q.rows, Cut)
            return self.call("stack", q.name, q.rows.name, self.extent(q.columns, "k") if not isinstance(q.columns, Cut) else "0")
        return q.name

    def length(self, cut: Cut, k: str) -> str:
        return f"size({cut.name}[{k}])"

    def other(self, node: Node) -> str:
        if isinstance(node, Identity):
            n = self.extent(node.cut, "k")
            return f"Matrix::Identity({n}, {n})"
        if isinstance(node, HingeRow):
            return f"Matrix({node.quantity.name}[k].row({node.row}).transpose())"
        if isinstance(node, Part):
            rows, name = f"{node.cut.name}[k]", node.quantity.name
            by_rows = (node.axis == 0) != node.transposed
            made = self.call("pick_rows" if by_rows else "pick_columns", name, rows)
            return f"{made}.transpose()" if node.transposed else made
        if isinstance(node, DiagonalPart):
            inner = self.call("pick_columns", node.quantity.name, f"{node.columns.name}[k]")
            return self.call("pick_rows", inner, f"{node.rows.name}[k]")
        if isinstance(node, Assembled):
            return self.call("assembled", node.quantity.name, node.rows.name, node.columns.name)
        if isinstance(node, SystemLogdet):
            return f"{node.system.quantity.name}.logdet()"
        if isinstance(node, InverseBlock):
            return f"{node.system.quantity.name}.block({node.quantity.name}, k, {node.state}, {node.equation})"
        assert isinstance(node, MadeDense)
        size = total(node.operator.program.inputs[0].rows)
        return f"{node.operator.quantity.name}(Matrix::Identity({size}, {size}))"

    def factor(self, node: Node) -> str:
        text = super().factor(node)
        return f"Matrix({text})" if isinstance(node, Identity) else text

    def zeros(self, q: Quantity) -> str:
        """Zeros of a quantity's shape."""
        if q.kind == "scalar":
            return "0.0"
        return f"Matrix::Zero({self.extent(q.rows, 'k')}, {self.extent(q.columns, 'k')})"

    def assign(self, equation: Equation, target: str) -> list[str]:
        """The statements that compute an equation at body k, or of the whole."""
        plain = [t for t in equation.terms if not t.over and t.body is None]
        value = "".join(self.scaled(term, i == 0) for i, term in enumerate(plain)) or self.zeros(equation.target)
        lines = [f"{target} = {value};"]
        name = target.split()[-1]
        for term in equation.terms:
            if term in plain:
                continue
            value = self.scaled(Term(term.node, abs(term.coefficient)), True)
            sign = "-=" if term.coefficient < 0 else "+="
            if term.body is not None:
                head = f"if (k == {term.body}) "
            elif term.over == "p":
                head = "if (p >= 0) "
            elif term.over == "c":
                head = f"for (int c : children{self.suffix(equation.target.tree)}[k]) "
            else:
                head = f"for (int k = 0; k < n{self.suffix(tree_of_terms(equation))}; ++k) "
            lines.append(f"{head}{name} {sign} {value};")
        if equation.symmetric:
            lines.append(f"{name} = {self.call('symmetric', name)};")
        return lines

    # ------------------------------------------------------------------ passes
    def loop(self, direction: int, tree: int) -> str:
        n = f"n{self.suffix(tree)}"
        return f"for (int k = {n} - 1; k >= 0; --k) {{" if direction < 0 else f"for (int k = 0; k < {n}; ++k) {{"

    def sweep(self, item: Sweep) -> list[str]:
        n = f"n{self.suffix(item.tree)}"
        lines = ["", "Blocks " + ", ".join(f"{equation.target.name}({n})" for equation in item.equations) + ";"]
        lines += ["// " + pass_words(item.direction), self.loop(item.direction, item.tree)]
        if parent_is_read(item):
            lines.append(f"  const int p = parent{self.suffix(item.tree)}[k];")
        for equation in item.equations:
            lines.append("  // " + self.comment(equation))
            lines += ["  " + line for line in self.assign(equation, f"{equation.target.name}[k]")]
        return [*lines, "}"]

    def once(self, equation: Equation) -> list[str]:
        target = equation.target
        lines = ["", "// " + self.comment(equation, whole=True)]
        if target.kind == "blocks":
            assert isinstance(target.rows, Cut)
            made = Quantity(target.name + "_whole", target.letter, target.number, "matrix", rows=target.rows.total, columns=target.columns)
            whole = self.assign(Equation(made, equation.terms), f"Matrix {made.name}")
            return [*lines, *whole, f"const Blocks {target.name} = {self.call('cut', made.name, target.rows.name)};"]
        kind = "double" if target.kind == "scalar" else "Matrix"
        return lines + self.assign(equation, f"{kind} {target.name}")

    def elimination(self, system: System) -> list[str]:
        name, suffix = system.quantity.name, self.suffix(system.tree)
        self.used.add("TreeSystem")
        bodies, border = self.extents(system)
        lines = [
            "",
            "// the equations of the realization, T s = b, body by body",
            f"std::vector<std::vector<int>> sizes_of_{name};",
            f"for (int k = 0; k < n{suffix}; ++k) sizes_of_{name}.push_back({{{bodies}}});",
            f"TreeSystem {name}(parent{suffix}, sizes_of_{name}, {{{border}}});",
            f"for (int k = 0; k < n{suffix}; ++k) {{",
            f"  [[maybe_unused]] const int p = parent{suffix}[k];",
        ]
        corner: list[str] = []
        for of_bodies, reading, entries in self.relations(system):
            (lines if of_bodies else corner).append(f"{'  ' if of_bodies else ''}// {reading}")
            for place, guarded, at, sign, value in entries:
                if place == "corner":
                    corner.append(f"{name}.corner({at}) {sign} {value};")
                elif place == "below":
                    corner.append(f"for (int k = 0; k < n{suffix}; ++k) {name}.below(k, {at}) {sign} {value};")
                else:
                    lines.append(f"  {'if (p >= 0) ' if guarded else ''}{name}.{place}(k, {at}) {sign} {value};")
        return [*lines, "}", *corner]

    def solution(self, item: Solution) -> list[str]:
        name, suffix = item.system.quantity.name, self.suffix(item.system.tree)
        columns = item.columns if isinstance(item.columns, str) else str(item.columns)
        b = f"b_of_{next(iter(item.states.values())).name if item.states else name}"
        body: list[str] = []
        once: list[str] = []
        lines = ["", f"Blocks {b} = {name}.vector({columns});"]
        for i, (of_bodies, reading, terms) in enumerate(self.right_sides(item)):
            lines_of, indent, k = (body, "  ", "k") if of_bodies else (once, "", "-1")
            lines_of += [f"{indent}// {reading}"] if terms else []
            for sign, value in terms:
                lines_of.append(f"{indent}{name}.part({b}, {k}, {i}) {sign} {value};")
        if body:
            lines += [f"for (int k = 0; k < n{suffix}; ++k) {{", *body, "}"]
        lines += [*once, f"{b} = {name}.solve({b});"]
        for j, q in item.states.items():
            if q.kind == "blocks":
                lines.append(f"Blocks {q.name};")
                lines.append(f"for (int k = 0; k < n{suffix}; ++k) {q.name}.push_back({name}.part({b}, k, {j}));")
            else:
                lines.append(f"const Matrix {q.name} = {name}.part({b}, -1, {j});")
        return lines

    def selected(self, item: Selected) -> list[str]:
        return [f"const Blocks {item.quantity.name} = {item.system.quantity.name}.inverse();"]

    def composite(self, item: CompositeAssembly) -> list[str]:
        A, H, R, E, rows, suffix = item.target.name, item.H.name, item.R.name, item.E.name, item.rows.name, self.suffix(item.tree)
        total = item.rows.total
        self.used.add("put")
        own = f" + {item.J.name}[k]" if item.J else ""
        return [
            "",
            "// the columns of body k carried to its ancestors",
            f"Matrix {A} = Matrix::Zero({total}, {total});",
            f"for (int k = 0; k < n{suffix}; ++k) {{",
            f"  Matrix f = {R}[k] * {H}[k].transpose();",
            f"  put({A}, {rows}[k], {rows}[k], {H}[k] * f{own});",
            f"  for (int c = k, p = parent{suffix}[k]; p >= 0; c = p, p = parent{suffix}[p]) {{",
            "    // f = E(p,c) f",
            f"    f = ({E}[c] * f).eval();",
            f"    put({A}, {rows}[p], {rows}[k], {H}[p] * f);",
            f"    put({A}, {rows}[k], {rows}[p], f.transpose() * {H}[p].transpose());",
            "  }",
            "}",
        ]

    def operator(self, item: Operator) -> list[str]:
        x = item.program.inputs[0]
        lines = [
            "",
            f"// {item.text}, applied to columns",
            f"const auto {item.quantity.name} = [&](const Matrix& given_{x.name}) -> Matrix {{",
        ]
        return [*lines, *("  " + line if line else "" for line in self.body(item.program)), "};"]

    def body(self, program: Program) -> list[str]:
        """The inside of a function: cut what is given, pass over the tree, stack what is returned."""
        lines: list[str] = []
        for x in program.inputs:
            lines.append(f"[[maybe_unused]] const int {x.columns} = static_cast<int>(given_{x.name}.cols());")
            lines.append(self.given(x))
        for item in program.items:
            lines += self.item(item)
        result = program.result
        return [*lines, "", f"return {self.at(At(result, ''))};"]

    def given(self, q: Quantity) -> str:
        """An argument, cut where it lies in a space of bodies."""
        if isinstance(q.rows, Cut):
            return f"const Blocks {q.name} = {self.call('cut', 'given_' + q.name, q.rows.name)};"
        return f"const Matrix& {q.name} = given_{q.name};"

    # ------------------------------------------------------------------ the file
    def file(self, program: Program, title: str, shape: str, data: dict[str, Any] | None, name: str) -> str:
        """The source; `shape` says what is returned: "vector", "matrix", "blocks", "scalar"."""
        given = [q for q in self.inputs if not (q in program.inputs and program.identity_columns)]
        body = self.prologue()
        for q in self.inputs:
            if q not in program.inputs:
                body.append(self.given(q))
            elif program.identity_columns:
                body.append(f"const Matrix given_{q.name} = Matrix::Identity({total(q.rows)}, {total(q.rows)});")
        body += self.body(program)
        if shape == "blocks":
            body[-1] = f"return {program.result.name};"
        parameters = ", ".join(["[[maybe_unused]] const Data& data", *(f"const Matrix& given_{q.name}" for q in given)])
        words = [f"// {line}".rstrip() for line in [title, "", *documentation(self, program, shape)]]
        includes = ("Eigen/Dense", "algorithm", "cmath", "functional", "iostream", "limits", "stdexcept", "vector")
        text = "\n".join([*words, *(f"#include <{header}>" for header in includes), "", f"namespace {name} {{", "", ""])
        text += "using Matrix = Eigen::MatrixXd;\nusing Blocks = std::vector<Matrix>;\nusing Rows = std::vector<std::vector<int>>;\n\n"
        text += "struct Data {\n" + "".join(f"  {line}\n" for line in self.members()) + "};\n"
        if data is not None:
            self.used.add("matrix")
        self.used.add("children_of")
        text += helpers(HELPERS, self.used).replace("\n\n", "\n")
        text += f"\n// {title}\ninline {_RESULT_TYPES[shape]} run({parameters}) {{\n"
        text += "".join(f"  {line}\n" if line else "\n" for line in body) + "}\n"
        if data is not None:
            text += "\ninline Data present() {\n  Data data;\n" + "".join(f"  {line}\n" for line in self.literals(data))
            text += "  return data;\n}\n"
        text += f"\n}}  // namespace {name}\n"
        if data is not None:
            ones = "".join(f", Eigen::MatrixXd::Ones({total(q.rows)}, 1)" for q in given)
            call = f"{name}::run({name}::present(){ones})"
            shown = f"std::cout << {call} << '\\n';"
            if shape == "blocks":
                shown = f"for (const auto& block : {call}) std::cout << block << '\\n';"
            text += f"\n#ifndef NO_MAIN\nint main() {{\n  std::cout.precision(17);\n  {shown}\n}}\n#endif\n"
        return text

    def members(self) -> list[str]:
        """What Data holds."""
        lines = [f"std::vector<int> parent{tree.suffix};" for tree in self.book.trees]
        lines += [f"{'std::vector<int>' if cut.contiguous else 'Rows'} {cut.key};" for cut in self.book.cuts]
        for leaf in self.leaves:
            q = leaf.quantity
            if q.kind == "function":
                lines.append(f"std::function<Matrix(const Matrix&)> {q.name};")
            else:
                lines.append(f"{'Blocks' if q.kind == 'blocks' and q.columns != 1 else 'Matrix'} {q.name};")
        return lines

    def prologue(self) -> list[str]:
        """What is read from Data."""
        lines = []
        for tree in self.book.trees:
            s = tree.suffix
            lines.append(f"[[maybe_unused]] const std::vector<int>& parent{s} = data.parent{s};")
            lines.append(f"[[maybe_unused]] const int n{s} = static_cast<int>(parent{s}.size());")
            lines.append(f"[[maybe_unused]] const Rows children{s} = children_of(parent{s});")
        for cut in self.book.cuts:
            value = self.call("ranges", f"data.{cut.key}") if cut.contiguous else f"data.{cut.key}"
            lines.append(f"[[maybe_unused]] const Rows {cut.name} = {value};")
        for leaf in self.leaves:
            q = leaf.quantity
            if q.kind == "blocks" and q.columns == 1:
                assert isinstance(q.rows, Cut)
                lines.append(f"const Blocks {q.name} = {self.call('cut', 'data.' + q.name, q.rows.name)};")
            else:
                lines.append(f"const auto& {q.name} = data.{q.name};")
        return lines

    def literals(self, data: dict[str, Any]) -> list[str]:
        """The numbers as statements that fill Data."""
        lines = []
        for key, value in data.items():
            if isinstance(value, np.ndarray):
                lines.append(f"data.{key} = {matrix_literal(value)};")
            elif value and (value[0] is None or isinstance(value[0], np.ndarray)):
                lines.append(f"data.{key} = {{{', '.join('Matrix()' if b is None else matrix_literal(b) for b in value)}}};")
            else:
                lines.append(f"data.{key} = {str(value).replace('[', '{').replace(']', '}')};")
        return lines


def matrix_literal(array: np.ndarray) -> str:
    """A matrix, row after row."""
    columns = array.reshape(len(array), -1) if array.size else array.reshape(*(array.shape if array.ndim == 2 else (len(array), 1)))
    return f"matrix({columns.shape[0]}, {columns.shape[1]}, {{{', '.join(repr(float(x)) for x in columns.ravel())}}})"
