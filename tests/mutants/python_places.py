"""Where Python is mutated: sums, comparisons and conditions of the modules that carry mathematics, verdicts and files."""

import ast
import pathlib
import re

from .mutant import Mutant, line_of, shown_line

TARGETS = [
    "pycraft/models/**/*.py",
    "pycraft/view/*.py",
    "pycraft/dynamics/*.py",
    "pycraft/identities/*.py",
    "pycraft/interop/*.py",
    "pycraft/peers/*.py",
    "pycraft/proofs/*.py",
    "pycraft/closed_forms/*.py",
    "pycraft/sympy_bridge/*.py",
    "pycraft/state.py",
    "pycraft/kalman/*.py",
    "pycraft/operators/operator_set.py",
    "pycraft/accuracy/certificates/certify.py",
    "pycraft/accuracy/tables/table.py",
    "pycraft/accuracy/hard_cases/shared_bounds.py",
    "pycraft/recursions/steps.py",
    "pycraft/recursions/copied_parts.py",
    "pycraft/recursions/runtime/*.py",
]
LEFT_OUT = {"pycraft/peers/peers.py", "pycraft/interop/pinocchio.py", "pycraft/interop/drake.py"}  # tested by `make test-peers`
OTHER = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
}


class Places(ast.NodeVisitor):
    def __init__(self, file, text):
        self.file, self.text, self.found, self.functions = file, text, [], []
        lines = text.encode().splitlines(keepends=True)
        self.starts = [0]
        for line in lines:
            self.starts.append(self.starts[-1] + len(line))
        self.raw = text.encode()

    def at(self, line, column):
        """Offset in characters of a position that `ast` gives in bytes."""
        return len(self.raw[: self.starts[line - 1] + column].decode())

    def visit_FunctionDef(self, node):
        self.functions.append((node.decorator_list[0].lineno if node.decorator_list else node.lineno, node.end_lineno))
        self.generic_visit(node)
        self.functions.pop()

    def between(self, left, right, kind):
        known = OTHER.get(type(kind))
        if (
            not known
            or not self.functions
            or isinstance(left, (ast.Constant, ast.JoinedStr))
            and isinstance(getattr(left, "value", ""), str)
        ):
            return
        begin, end = self.at(left.end_lineno, left.end_col_offset), self.at(right.lineno, right.col_offset)
        if not re.fullmatch(rf"[\s)]*{re.escape(known[0])}[\s(]*", self.text[begin:end]):
            return
        begin += self.text[begin:end].index(known[0])
        end = begin + len(known[0])
        name = f"line {self.functions[-1][0]}"
        self.found.append(
            Mutant(
                self.file,
                line_of(self.text, begin),
                name,
                begin,
                end,
                known[0],
                known[1],
                shown_line(self.text, begin),
                f"`{known[0]}` as `{known[1]}`",
                functions=self.functions[-1],
            )
        )

    def visit_BinOp(self, node):
        self.between(node.left, node.right, node.op)
        self.generic_visit(node)

    def visit_Compare(self, node):
        for left, kind, right in zip([node.left, *node.comparators], node.ops, node.comparators, strict=False):
            self.between(left, right, kind)
        self.generic_visit(node)

    def visit_BoolOp(self, node):
        for left, right in zip(node.values, node.values[1:], strict=False):
            self.between(left, right, node.op)
        self.generic_visit(node)


def everything(root):
    """All mutants of Python, file by file."""
    root, found = pathlib.Path(root), []
    for pattern in TARGETS:
        for path in sorted(root.glob(pattern)):
            file = path.relative_to(root).as_posix()
            if file in LEFT_OUT:
                continue
            text = path.read_text(encoding="utf-8")
            places = Places(file, text)
            places.visit(ast.parse(text))
            found += places.found
    return found
