"""Write TOML in a readable form: a vector on one line, tables as sections, every number to the last bit.

No package does this: tomli-w writes each number of a vector on its own line, and tomlkit is for editing files in place.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

_LINE = 100
"""Characters of a list of lists or tables that fit on one line; a longer one has a line per item."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")


class Inline(dict):
    """A table that is written on one line: { xx = 1, yy = 2 }."""


def document(data: Mapping[str, Any], place: tuple[str, ...] = ()) -> str:
    """Return a table as TOML: values first, then tables as [place.key] and lists of tables as [[place.key]]."""
    lines = [f"{key_text(key)} = {value_text(value)}" for key, value in data.items() if not _is_section(value)]
    parts = ["\n".join(lines)] if lines else []
    for key, value in data.items():
        if not _is_section(value):
            continue
        here = (*place, key)
        head = ".".join(map(key_text, here))
        for table, title in [(value, f"[{head}]")] if isinstance(value, Mapping) else [(item, f"[[{head}]]") for item in value]:
            text = document(table, here)
            only_sections = text.startswith("[") and isinstance(value, Mapping)
            parts.append(text if only_sections else f"{title}\n{text}".rstrip("\n"))
    return "\n\n".join(parts)


def _is_section(value: Any) -> bool:
    if isinstance(value, list):
        return bool(value) and all(isinstance(item, Mapping) and not isinstance(item, Inline) for item in value)
    return isinstance(value, Mapping) and not isinstance(value, Inline)


def key_text(key: str) -> str:
    """Return a key, in quotes if necessary."""
    return key if _BARE.fullmatch(key) else value_text(key)


def value_text(value: Any) -> str:
    """Return a text, a truth value, a number, a list or an inline table."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # JSON's escapes are TOML's, except for this one
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key_text(key)} = {value_text(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple, np.ndarray)):
        items = [value_text(item) for item in value]
        line = "[" + ", ".join(items) + "]"
        of_parts = bool(items) and items[0].startswith(("[", "{"))
        return "[\n" + "".join(f"  {item},\n" for item in items) + "]" if of_parts and len(line) > _LINE else line
    return _number_text(float(value))


def _number_text(number: float) -> str:
    """Return the shortest text that reads back as this double; integers without a point, except for -0.0."""
    text = repr(number)
    return text.removesuffix(".0") if text != "-0.0" else text
