"""Effects as one line of text, for the command line: "gravity", "damping:0.1", "spring:2,rest=0.1,hinges=arm_*"."""

from __future__ import annotations

import re
from typing import Any

from .. import _core
from ..models.loaders.toml_lines import tomllib
from .file_format import effect_kind, field_names
from .file_reader import PlainData, enter

_OPEN, _CLOSE = "[{", "]}"


def add_from_text(scene: Any, text: str, label: str) -> None:
    """Add an effect given as text to a scene.

    The text is a kind and, after a colon, its parameters: first values in order, then name=value; `name` is the name of the effect.
    Values as in TOML ("0.1", "[1, 2]", '{ in_time = "Harmonic", ... }'); texts need no quotes.

    Parameters
    ----------
    text : "damping:0.1"
    label : its name in errors: "--effect damping:0.1"

    Raises
    ------
    ModelError
        The text is invalid; the message gives the remedy.
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
                (), f"{part.strip()!r} has no name but follows a named parameter; write {names[min(i, len(names) - 1)]}={part.strip()}"
            )
        if found is None and i >= len(names):
            raise place.error((), f"{kind.strip()} has only {len(names)} parameters, {', '.join(names)}; remove {part.strip()!r}")
        name, value = (names[i], part) if found is None else found.groups()
        named = found is not None
        if name in data:
            raise place.error((), f"{name} is given twice")
        data[name] = _value(value.strip())
    enter(scene, data, place)


def _parts(text: str) -> list[str]:
    """Split at commas outside brackets and quotes."""
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
    """Return a TOML value; anything else is a text."""
    try:
        found = tomllib.loads(f"value = {text}")
        return found["value"] if len(found) == 1 else text
    except (ValueError, RecursionError):
        return text
