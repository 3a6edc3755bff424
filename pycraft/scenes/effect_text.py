"""Effects in one line, as a command line has them: "gravity", "damping:0.1", "spring:2,rest=0.1,hinges=arm_*"."""

from __future__ import annotations

import re
from typing import Any

from .. import _core
from ..models.loaders.toml_lines import tomllib
from .file_format import effect_kind, field_names
from .file_reader import PlainData, enter

_OPEN, _CLOSE = "[{", "]}"


def add_from_text(scene: Any, text: str, label: str) -> None:
    """Add the effect that a text says to a scene.

    A kind, and after a colon its parameters: first those without names, in their order, then name=value; `name` is that of the effect.
    Values are as in TOML ("0.1", "[1, 2]", '{ in_time = "Harmonic", ... }'), and texts need no quotes.

    Parameters
    ----------
    text : "damping:0.1"
    label : what errors call it: "--effect damping:0.1"

    Raises
    ------
    ModelError
        What the text gets wrong, with the remedy.
    """
    kind, _, rest = text.partition(":")
    place = PlainData(label)
    try:
        names = field_names(effect_kind(kind.strip()))
    except _core.ModelError as error:
        raise place.error((), str(error)) from None
    data: dict[str, Any] = {"effect": kind.strip()}
    named = False
    for i, part in enumerate(_parts(rest)):
        found = re.match(r"\s*([A-Za-z_]\w*)\s*=(?!=)(.*)", part, re.DOTALL)
        if found is None and named:
            raise place.error(
                (), f"{part.strip()!r} has no name and stands behind one that has; write {names[min(i, len(names) - 1)]}={part.strip()}"
            )
        if found is None and i >= len(names):
            raise place.error((), f"{kind.strip()} has {len(names)} parameters, {', '.join(names)}; {part.strip()!r} is one more")
        name, value = (names[i], part) if found is None else found.groups()
        named = found is not None
        if name in data:
            raise place.error((), f"{name} is given twice")
        data[name] = _value(value.strip())
    enter(scene, data, place)


def _parts(text: str) -> list[str]:
    """What stands between commas that are in no bracket and no quotes."""
    parts, depth, quote, begin = [], 0, "", 0
    for i, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter in _OPEN or letter in _CLOSE:
            depth += 1 if letter in _OPEN else -1
        elif letter == "," and depth == 0:
            parts.append(text[begin:i])
            begin = i + 1
    return [*parts, text[begin:]] if text.strip() else []


def _value(text: str) -> Any:
    """As TOML has it; what is none is a text."""
    try:
        found = tomllib.loads(f"value = {text}")
        return found["value"] if len(found) == 1 else text
    except (ValueError, RecursionError):
        return text
