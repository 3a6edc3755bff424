"""Recursions as C++17 that needs only Eigen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .copied_parts import copied, cpp_includes, cpp_letters, cpp_parts
from .formulas import Cut, DiagonalPart, HingeRow, Identity, Node, Quantity
from .naming import total
from .passes import Equation, Operator, Program, System, Term
from .shared_passes import Passes
from .shared_source import tree_of_terms

_RESULT_TYPES = {"vector": "Matrix", "matrix": "Matrix", "blocks": "Blocks", "scalar": "double"}


class CppSource(Passes):
    """Writes one program as a C++ function in a namespace of its own."""

    transpose = "{}.transpose()"
    product = " * "
    remark_sign, end, step = "// ", ";", "  "
    closing = ("}",)

    # ------------------------------------------------------------------ words
    def length(self, cut: Cut, k: str) -> str:
        return self.call("size", f"{cut.name}[{k}]")

    def identity(self, n: int | str) -> str:
        return f"Matrix::Identity({n}, {n})"

    def zero_matrix(self, rows: int | str, columns: int | str) -> str:
        return f"Matrix::Zero({rows}, {columns})"

    def hinge_row(self, node: HingeRow) -> str:
        return f"Matrix({node.quantity.name}[k].row({node.row}).transpose())"

    def rows_of(self, matrix: str, rows: str) -> str:
        return self.call("pick_rows", matrix, rows)

    def columns_of(self, matrix: str, columns: str) -> str:
        return self.call("pick_columns", matrix, columns)

    def diagonal_part(self, node: DiagonalPart) -> str:
        return self.rows_of(self.columns_of(node.quantity.name, f"{node.columns.name}[k]"), f"{node.rows.name}[k]")

    def factor(self, node: Node) -> str:
        text = super().factor(node)
        return f"Matrix({text})" if isinstance(node, Identity) else text

    # ------------------------------------------------------------------ statements
    def declared(self, kind: str, name: str, value: str) -> str:
        return f"{kind} {name} = {value};"

    def none_yet(self, names: Sequence[str], n: str) -> str:
        return f"Blocks {', '.join(f'{name}({n})' for name in names)};"

    def parent_here(self, tree: int) -> str:
        return f"const int p = parent{self.suffix(tree)}[k];"

    def every_body(self, tree: int) -> str:
        """The head of a loop over bodies, base to tip."""
        return f"for (int k = 0; k < n{self.suffix(tree)}; ++k)"

    def loop(self, direction: int, tree: int) -> str:
        return f"for (int k = n{self.suffix(tree)} - 1; k >= 0; --k) {{" if direction < 0 else f"{self.every_body(tree)} {{"

    def only_if_a_parent(self, statement: str) -> list[str]:
        return [f"if (p >= 0) {statement}"]

    def of_each_body(self, tree: int, statement: str) -> list[str]:
        return [f"{self.every_body(tree)} {statement}"]

    def collected(self, name: str, value: str, tree: int) -> list[str]:
        return [f"Blocks {name};", *self.of_each_body(tree, f"{name}.push_back({value});")]

    def to_the_root(self, tree: int, lines: list[str]) -> list[str]:
        parent = f"parent{self.suffix(tree)}"
        return [f"for (int c = k, p = {parent}[k]; p >= 0; c = p, p = {parent}[p]) {{", *self.indented(lines), "}"]

    def added(self, block: str, sign: str, value: str) -> str:
        return f"{block} {sign} {value};"

    def placed(self, matrix: str, rows: str, columns: str, value: str) -> str:
        return f"{self.call('put', matrix, rows, columns, value)};"

    # ------------------------------------------------------------------ equations
    def summed(self, equation: Equation, target: str) -> list[str]:
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
                head = f"if (k == {term.body})"
            elif term.over == "p":
                head = "if (p >= 0)"
            elif term.over == "c":
                head = f"for (int c : children{self.suffix(equation.target.tree)}[k])"
            else:
                head = self.every_body(tree_of_terms(equation))
            lines.append(f"{head} {name} {sign} {value};")
        if equation.symmetric:
            lines.append(f"{name} = {self.call('symmetric', name)};")
        return lines

    def assigned(self, equation: Equation) -> list[str]:
        return self.summed(equation, f"{equation.target.name}[k]")

    def assigned_whole(self, equation: Equation) -> list[str]:
        target = equation.target
        if target.kind != "blocks":
            return self.summed(equation, f"{'double' if target.kind == 'scalar' else 'Matrix'} {target.name}")
        assert isinstance(target.rows, Cut)
        made = Quantity(target.name + "_whole", target.letter, target.number, "matrix", rows=target.rows.total, columns=target.columns)
        whole = self.summed(Equation(made, equation.terms), f"Matrix {made.name}")
        return [*whole, self.declared("const Blocks", target.name, self.call("cut", made.name, target.rows.name))]

    def system_made(self, system: System) -> list[str]:
        name, suffix = system.quantity.name, self.suffix(system.tree)
        bodies, border = self.extents(system)
        return [
            f"std::vector<std::vector<int>> sizes_of_{name};",
            *self.of_each_body(system.tree, f"sizes_of_{name}.push_back({{{bodies}}});"),
            f"TreeSystem {name}(parent{suffix}, sizes_of_{name}, {{{border}}});",
        ]

    def operator(self, item: Operator) -> list[str]:
        x = item.program.inputs[0]
        head = f"const auto {item.quantity.name} = [&](const Matrix& given_{x.name}) -> Matrix {{"
        inside = [*self.body(item.program), f"return {self.result(item.program)};"]
        return ["", self.remark(f"{item.text}, applied to columns"), head, *self.indented(inside), "};"]

    # ------------------------------------------------------------------ what is given
    def received(self, x: Quantity) -> list[str]:
        return [f"[[maybe_unused]] const int {x.columns} = static_cast<int>(given_{x.name}.cols());", self.given(x)]

    def given(self, q: Quantity) -> str:
        """Return an argument, divided among bodies if its space is."""
        if isinstance(q.rows, Cut):
            return self.declared("const Blocks", q.name, self.call("cut", f"given_{q.name}", q.rows.name))
        return f"const Matrix& {q.name} = given_{q.name};"

    def tree_read(self, suffix: str) -> list[str]:
        return [
            f"[[maybe_unused]] const std::vector<int>& parent{suffix} = data.parent{suffix};",
            f"[[maybe_unused]] const int n{suffix} = static_cast<int>(parent{suffix}.size());",
            f"[[maybe_unused]] const Rows children{suffix} = {self.call('children_of', f'parent{suffix}')};",
        ]

    def rows_read(self, cut: Cut) -> str:
        return self.call("ranges", f"data.{cut.key}") if cut.contiguous else f"data.{cut.key}"

    def leaf_read(self, q: Quantity) -> list[str]:
        if q.kind == "blocks" and q.columns == 1:
            assert isinstance(q.rows, Cut)
            return [self.declared("const Blocks", q.name, self.call("cut", f"data.{q.name}", q.rows.name))]
        return [f"const auto& {q.name} = data.{q.name};"]

    # ------------------------------------------------------------------ the file
    def file(self, program: Program, title: str, shape: str, data: dict[str, Any] | None, name: str) -> str:
        """Return the source; `shape` is the kind of result: "vector", "matrix", "blocks", "scalar"."""
        given = self.parameters(program)
        run = self.run(program, title, shape)
        present = self.present(data) if data is not None else []
        words = [f"// {line}".rstrip() for line in [title, "", *self.documentation(program, shape)]]
        includes = [f"#include <{header}>" for header in sorted(cpp_includes() | {"functional", "iostream"})]
        text = "\n".join([*words, *includes, "", f"namespace {name} {{", "", cpp_letters()])
        text += "\n".join(["", "struct Data {", *self.indented(self.members()), "};", ""])
        text += "".join("\n" + part for part in copied(cpp_parts(), self.used))
        text += "\n".join(["", *run, *present, "", f"}}  // namespace {name}", ""])
        if data is not None:
            ones = "".join(f", Eigen::MatrixXd::Ones({total(q.rows)}, 1)" for q in given)
            call = f"{name}::run({name}::present(){ones})"
            shown = f"std::cout << {call} << '\\n';"
            if shape == "blocks":
                shown = f"for (const auto& block : {call}) std::cout << block << '\\n';"
            text += f"\n#ifndef NO_MAIN\nint main() {{\n  std::cout.precision(17);\n  {shown}\n}}\n#endif\n"
        return text

    def run(self, program: Program, title: str, shape: str) -> list[str]:
        """The function."""
        body = self.prologue()
        for q in self.inputs:
            if q not in program.inputs:
                body.append(self.given(q))
            elif program.identity_columns:
                body.append(self.declared("const Matrix", f"given_{q.name}", self.identity(total(q.rows))))
        body += [*self.body(program), f"return {program.result.name if shape == 'blocks' else self.result(program)};"]
        arguments = [f"const Matrix& given_{q.name}" for q in self.parameters(program)]
        parameters = ", ".join(["[[maybe_unused]] const Data& data", *arguments])
        return [self.remark(title), f"inline {_RESULT_TYPES[shape]} run({parameters}) {{", *self.indented(body), "}"]

    def members(self) -> list[str]:
        """Return the members of Data."""
        lines = [f"std::vector<int> parent{tree.suffix};" for tree in self.book.trees]
        lines += [f"{'std::vector<int>' if cut.contiguous else 'Rows'} {cut.key};" for cut in self.book.cuts]
        for leaf in self.leaves:
            q = leaf.quantity
            if q.kind == "function":
                lines.append(f"std::function<Matrix(const Matrix&)> {q.name};")
            else:
                lines.append(f"{'Blocks' if q.kind == 'blocks' and q.columns != 1 else 'Matrix'} {q.name};")
        return lines

    def present(self, data: dict[str, Any]) -> list[str]:
        """Return a function that returns Data filled with values."""
        return ["", "inline Data present() {", *self.indented(["Data data;", *self.literals(data), "return data;"]), "}"]

    def literals(self, data: dict[str, Any]) -> list[str]:
        """Return statements that fill Data with values."""
        lines = []
        for key, value in data.items():
            if isinstance(value, np.ndarray):
                lines.append(f"data.{key} = {self.matrix_literal(value)};")
            elif value and (value[0] is None or isinstance(value[0], np.ndarray)):
                blocks = ("Matrix()" if b is None else self.matrix_literal(b) for b in value)
                lines.append(f"data.{key} = {{{', '.join(blocks)}}};")
            else:
                lines.append(f"data.{key} = {str(value).replace('[', '{').replace(']', '}')};")
        return lines

    def matrix_literal(self, array: np.ndarray) -> str:
        """A matrix, row after row."""
        columns = array.reshape(len(array), -1) if array.size else array.reshape(*(array.shape if array.ndim == 2 else (len(array), 1)))
        numbers = ", ".join(repr(float(x)) for x in columns.ravel())
        return self.call("matrix", str(columns.shape[0]), str(columns.shape[1]), f"{{{numbers}}}")
