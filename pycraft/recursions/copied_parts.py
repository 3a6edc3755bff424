"""Parts of the sources in `runtime/`, copied into written programs: the parts that a program calls, and the parts that these call.

A part of a Python file is a function or a class; a part of a C++ header is the text between two blank lines at namespace level.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Sequence
from functools import cache
from importlib.resources import files
from typing import NamedTuple

TOPICS = ("matrices", "stacking", "cross_products", "tree_system")  # in the order in which they are copied


class Part(NamedTuple):
    """A piece of source: the names that it defines, the names that it reads or calls, and its text, which ends in a newline."""

    names: tuple[str, ...]
    uses: frozenset[str]
    text: str


def source_of(file: str) -> str:
    """The text of a file of `runtime/`."""
    return files(f"{__package__}.runtime").joinpath(file).read_text(encoding="utf-8")


@cache
def python_parts() -> tuple[Part, ...]:
    """The functions and classes of every topic, file after file."""
    return tuple(part for topic in TOPICS for part in parts_of_python(source_of(f"{topic}.py")))


@cache
def cpp_parts() -> tuple[Part, ...]:
    """The functions and classes of every topic, header after header."""
    return tuple(part for topic in TOPICS for part in parts_of_cpp(source_of(f"{topic}.h")))


@cache
def cpp_letters() -> str:
    """Return the type aliases of every C++ program."""
    return "\n".join(part.text for part in parts_of_cpp(source_of("letters.h")))


@cache
def cpp_includes() -> frozenset[str]:
    """Return the external includes of the headers."""
    texts = [source_of(f"{name}.h") for name in ("letters", *TOPICS)]
    return frozenset(header for text in texts for header in re.findall(r"^#include <(.+)>", text, re.M))


def parts_of_python(text: str) -> list[Part]:
    """Return the functions and classes of a module, without its imports."""
    lines, parts = text.splitlines(keepends=True), []
    for node in ast.parse(text).body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            uses = {inner.id for inner in ast.walk(node) if isinstance(inner, ast.Name)}
            parts.append(Part((node.name,), frozenset(uses), "".join(lines[node.lineno - 1 : node.end_lineno])))
    return parts


def parts_of_cpp(text: str) -> list[Part]:
    """Return the content of a header's namespace, split at blank lines outside braces."""
    inside = re.search(r"^namespace [\w:]+ \{\n(.*)^\}  // namespace", text, re.M | re.S)
    assert inside
    parts, lines, depth = [], [], 0
    for line in [*inside[1].splitlines(), ""]:
        if line or depth:
            lines.append(line)
            depth += line.count("{") - line.count("}")
        elif lines:
            parts.append(part_of_cpp("\n".join(lines) + "\n"))
            lines = []
    return parts


def part_of_cpp(text: str) -> Part:
    """Return a piece of C++ with the names that it defines at its left margin, and the names of the non-member functions that it calls."""
    names = re.findall(r"^(?:inline [\w:]+|class|using) (\w+)", text, re.M)
    code = re.sub(r"//.*", "", text)
    return Part(tuple(names), frozenset(re.findall(r"(?<![\w.>:])\w+(?=\()", code)), text)


def copied(parts: Sequence[Part], called: Iterable[str]) -> list[str]:
    """Return the texts of the called parts and of the parts that these use, in order."""
    defined_in = {name: part for part in parts for name in part.names}
    needed: set[Part] = set()
    to_do = [defined_in[name] for name in called]
    while to_do:
        part = to_do.pop()
        if part not in needed:
            needed.add(part)
            to_do += [defined_in[name] for name in part.uses if name in defined_in]
    return [part.text for part in parts if part in needed]
