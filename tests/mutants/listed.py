"""Small wrong changes that a saboteur thought of, one by one: caches, thresholds, bounds, verdicts, options. Each once survived the tests.

An expression of C++ becomes `(switch ? wrong : right)`, a statement `if (switch) { wrong } else { right }`.
"""

import ast
import pathlib
from dataclasses import dataclass

from . import of_cpp, of_files, of_integrators, of_loops, of_methods, of_pictures, of_python, of_scenes, of_view
from .mutant import Mutant, line_of, shown_line


@dataclass(frozen=True)
class Change:
    name: str
    file: str
    before: str
    after: str
    statement: bool = False


def table(changes):
    return [
        Change(name, file, before, after, bool(statement)) for file, rows in changes.items() for name, before, after, *statement in rows
    ]


CPP, PYTHON = (
    table(of_cpp.CHANGES | of_integrators.CHANGES | of_loops.CHANGES | of_methods.CHANGES | of_scenes.CHANGES),
    table(of_python.CHANGES | of_files.CHANGES | of_pictures.CHANGES | of_view.CHANGES),
)


def found(root, changes):
    """(mutants, names of changes whose text is no longer there exactly once). A name may have several texts, of which one is there."""
    mutants, stale = [], []
    for c in changes:
        path = pathlib.Path(root) / c.file
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        if text.count(c.before) != 1:
            stale.append(c.name)
            continue
        begin = text.index(c.before)
        after, functions = c.after, ()
        if c.file.endswith((".h", ".cpp")):
            after = f"if (PYCRAFT_MUTANT({{i}})) {{ {c.after} }} else {{ {c.before} }}" if c.statement else switched(c.before, c.after)
        else:
            functions = function_around(text, line_of(text, begin))
        mutants.append(
            Mutant(
                c.file,
                line_of(text, begin),
                c.name,
                begin,
                begin + len(c.before),
                c.before,
                after,
                shown_line(text, begin),
                c.name,
                c.name,
                functions,
            )
        )
    there = {m.name for m in mutants}
    return mutants, [name for name in stale if name not in there]


def function_around(text, line):
    """(first, last) line of the innermost function of Python there, as its code object counts them."""
    found = ()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and node.lineno <= line <= node.end_lineno:
            found = max(found, (min([node.lineno, *(d.lineno for d in node.decorator_list)]), node.end_lineno))
    return found


def switched(before, after):
    """Text that is one expression on either side, or an expression inside a common frame (`name = expression;`)."""
    head = 0
    while head < min(len(before), len(after)) and before[head] == after[head]:
        head += 1
    while head and before[head - 1] not in "=(":  # whole operands
        head -= 1
    prefix, right, wrong = before[:head], before[head:], after[head:]
    end = ";" if right.endswith(";") else ""
    if right.count("(") != right.count(")") or wrong.count("(") != wrong.count(")"):
        prefix, right, wrong, end = "", before, after, ""
    right, wrong = right.removesuffix(";"), wrong.removesuffix(";")
    tail = ""
    for suffix in (") terms",):
        if right.endswith(suffix):
            right, wrong, tail = right.removesuffix(suffix), wrong.removesuffix(suffix), suffix
    return f"{prefix} (PYCRAFT_MUTANT({{i}}) ? ({wrong.strip()}) : ({right.strip()})){tail}{end}"
