"""Lines of values in a TOML file: tomllib returns values without lines, and errors about values need both.

The file, which tomllib has read, is split into its statements (a key with its value, or the head of a table). tomllib itself reads the keys
of each statement: strings, escapes, dots and quotes are parsed nowhere else.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, TypeAlias

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Place: TypeAlias = "tuple[str | int, ...]"
"""The place of a value: names of keys, and numbers in lists: ("bodies", 2, "mass")."""

_TOKENS = re.compile(
    r"""(?P<skipped>\#[^\n]*|[^\S\n]+)
    |(?P<string>\"{3}(?:\\.|[^\\])*?\"{3,5}|'{3}.*?'{3,5}|"(?:\\.|[^"\\\n])*"|'[^'\n]*')
    |(?P<mark>[][{}=,\n])
    |(?P<word>[^][{}=,\#"'\s]+|.)""",
    re.VERBOSE | re.DOTALL,
)


@dataclass(slots=True)
class Statement:
    """One statement: its text, its first line, the start of its value in the text, the first lines of items of its list."""

    text: str
    line: int
    value: int = 0
    items: list[int] = field(default_factory=list)


def statements(text: str) -> Iterator[Statement]:
    """Yield the statements of a TOML text, in order, without comments and blank lines around them."""
    line, depth, begin, end = 1, 0, -1, 0
    now, listed, awaited = Statement("", 1), False, False
    for token in _TOKENS.finditer(text):
        kind, word = token.lastgroup, token[0]
        if kind == "skipped":
            continue
        if word == "\n" and depth == 0:
            if begin >= 0:
                now.text = text[begin:end]
                yield now
            line, begin = line + 1, -1
            continue
        if begin < 0:
            begin, now, listed, awaited = token.start(), Statement("", line), False, False
        end = token.end()
        if depth == 1 and listed and awaited and word not in "],\n":
            now.items.append(line)
            awaited = False
        if kind == "mark":
            if word == "=" and not depth and not now.value:
                now.value, listed = end - begin, True
            elif word in "[{":
                listed, awaited = listed and (depth > 0 or word == "["), awaited or depth == 0
                depth += 1
            elif word in "]}":
                depth = max(depth - 1, 0)
            elif word == "," and depth == 1:
                awaited = True
        line += word.count("\n")
    if begin >= 0:
        now.text = text[begin:end]
        yield now


def lines_of(text: str) -> dict[Place, int]:
    """Return the line of every key and table of a TOML text that tomllib reads, and of the items of lists written over several lines."""
    lines: dict[Place, int] = {}
    counts: dict[Place, int] = {}  # for each list of tables, the number of the last one
    table: Place = ()
    for statement in statements(text):
        data = tomllib.loads(statement.text)
        if not statement.value:
            table = _head(data, counts)
            for length in range(1, len(table) + 1):
                lines.setdefault(table[:length], statement.line)
            continue
        place = table
        while isinstance(data, dict) and len(data) == 1:  # dotted keys, or an inline table of one key: all on this line
            ((key, data),) = data.items()
            place += (key,)
            lines.setdefault(place, statement.line)
        if isinstance(data, dict):
            lines |= {(*place, key): statement.line for key in data}
        elif isinstance(data, list):
            lines |= {(*place, i): line for i, line in enumerate(statement.items)}
    return lines


def _head(data: Any, counts: dict[Place, int]) -> Place:
    """Return the place of the table that a head begins: [a.b], or [[a.b]], one more of a list."""
    names: list[str] = []
    while isinstance(data, dict) and data:
        ((name, data),) = data.items()
        names.append(name)
    place: Place = ()
    for i, name in enumerate(names, 1):
        place += (name,)
        if i == len(names) and isinstance(data, list):
            counts[place] = counts.get(place, -1) + 1
        if place in counts:
            place += (counts[place],)
    return place
