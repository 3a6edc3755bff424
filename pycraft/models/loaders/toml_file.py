"""Read a TOML file: its tables, and errors with file, line, table and key."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from functools import cached_property
from typing import Any

from ... import _core
from .file_contents import contents
from .toml_lines import Place, lines_of, statements, tomllib

_MOST_PARTS = 100
"""Limit for one key: the memory of tomllib grows with the square."""
_MANY_DOTS = re.compile(rf"(?:\.[^.\n]*){{{_MOST_PARTS}}}")


class TomlFile:
    """One TOML file.

    Parameters
    ----------
    path : path of the file; shown in errors as it was given

    Attributes
    ----------
    path : str
    data : the result of tomllib

    Raises
    ------
    ModelError
        A missing or unreadable file, a file that is not UTF-8, or not TOML: with the line.
    """

    def __init__(self, path: str | os.PathLike[str]):
        self.path, data = contents(path)
        try:
            self.text = data.decode("utf-8-sig").replace("\r\n", "\n")  # as in tomllib
        except UnicodeDecodeError as error:
            line = data.count(b"\n", 0, error.start) + 1
            raise _core.ModelError(f"{self.path}:{line}: a byte that is not UTF-8 ({error.reason}); save the file in UTF-8") from None
        self._refuse_long_keys()
        try:
            self.data: dict[str, Any] = tomllib.loads(self.text)
        except RecursionError:
            raise _core.ModelError(f"{self.path}: lists or tables within each other, too deep to be read") from None
        except ValueError as error:  # TOMLDecodeError is a ValueError, and so are numbers of too many digits
            found = re.search(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)$", str(error))
            what, at_line, column = found.groups() if found else (str(error), None, None)
            at = f":{at_line or self.text.count(chr(10)) + 1}" if found else ""
            where = f" (column {column})" if column else " (at the end)" if found else ""
            if not found and (long := re.search("[0-9_]{4300}", self.text)):
                what, at = "a whole number of thousands of digits", f":{self.text.count(chr(10), 0, long.start()) + 1}"
            raise _core.ModelError(f"{self.path}{at}: not well-formed TOML: {what}{where}") from None

    def _refuse_long_keys(self) -> None:
        if not _MANY_DOTS.search(self.text):
            return
        for statement in statements(self.text):
            key = statement.text[: statement.value] if statement.value else statement.text
            if key.count(".") > _MOST_PARTS:
                raise _core.ModelError(f"{self.path}:{statement.line}: a key of {key.count('.') + 1} parts; {_MOST_PARTS} are read at most")

    @cached_property
    def _lines(self) -> dict[Place, int]:
        return lines_of(self.text)

    def at(self, place: Place) -> str:
        """Return the location of a value: file:line, the line of the statement that contains it."""
        while place and place not in self._lines:
            place = place[:-1]
        return f"{self.path}:{self._lines.get(place, 1)}"

    def error(self, place: Place, text: str) -> Exception:
        """Return a ModelError to raise: "file:line: text"."""
        return _core.ModelError(f"{self.at(place)}: {text}")


class TomlTable:
    """One table of a file, with values that are checked when they are read.

    Parameters
    ----------
    file : TomlFile
    data : the table as in tomllib
    place : its place in the file
    label : its name in errors, such as "body 'upper'"
    keys : the allowed keys; None: any

    Raises
    ------
    ModelError
        An unknown key, with the nearest known one; a value of the wrong type or size.
    """

    def __init__(self, file: TomlFile, data: Any, place: Place, label: str, keys: Sequence[str] | None):
        self.file, self.data, self.place, self.label = file, data, place, label
        if not isinstance(data, Mapping):
            raise file.error(place, f"{label} is a table, not {_shown(data)}")
        if unknown := [key for key in data if keys is not None and key not in keys]:
            raise self.error(unknown[0], f"{label} has no key {unknown[0]!r}; {nearest(unknown[0], keys or ())}")

    def __contains__(self, key: str) -> bool:
        return key in self.data

    def at(self, key: str | None = None) -> str:
        """Return file:line of a key, or of the table."""
        return self.file.at((*self.place, key) if key is not None else self.place)

    def error(self, key: str | None, text: str) -> Exception:
        """Return a ModelError to raise, with the line of a key of this table, or of the table."""
        return self.file.error((*self.place, key) if key is not None else self.place, text)

    def _wrong(self, key: str, wanted: str) -> Exception:
        value = self.data[key]
        return self.error(key, f"{self.label}: {key} {'is' if isinstance(value, Mapping) else '='} {_shown(value)}; write {wanted}")

    # ------------------------------------------------------------------ values
    def text(self, key: str, default: str | None = None, empty: bool = False) -> str:
        """Return a text, which may be empty if `empty`; ModelError if it is missing without a default."""
        if key not in self.data and default is not None:
            return default
        if key not in self.data:
            raise self.error(None, f'{self.label} has no {key}; give it one: {key} = "..."')
        if not isinstance(self.data[key], str) or not (self.data[key] or empty):
            raise self._wrong(key, 'a name in quotes: "..."')
        return self.data[key]

    def texts(self, key: str) -> list[str]:
        """Return a list of texts; empty if the key is missing."""
        value = self.data.get(key, [])
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self._wrong(key, 'a list of texts: ["...", "..."]')
        return list(value)

    def choice(self, key: str, among: Sequence[str], default: str) -> str:
        """Return one of several words."""
        word = self.data.get(key, default)
        if word not in among:
            near = f"; did you mean {near[0]!r}?" if isinstance(word, str) and (near := get_close_matches(word, among, 1)) else ""
            raise self.error(key, f"{self.label}: {key} = {_shown(word)}{near or f'; there are {_listed(among)}'}")
        return word

    def flag(self, key: str) -> bool:
        """Return true or false; false if it is missing."""
        value = self.data.get(key, False)
        if not isinstance(value, bool):
            raise self._wrong(key, "true or false")
        return value

    def number(self, key: str, default: float, unit: str, infinite: bool = False) -> float:
        """Return a finite number; with `infinite`, also inf and -inf."""
        if key not in self.data:
            return default
        number = _number(self.data[key], infinite)
        if number is None:
            raise self._wrong(key, f"a {'' if infinite else 'finite '}number, {unit}")
        return number

    def vector(self, key: str, count: int | None, what: str, infinite: bool = False) -> list[float] | None:
        """Return that many numbers, for None one or more; None if the key is missing."""
        if key not in self.data:
            return None
        numbers = _vector(self.data[key], count, infinite)
        if numbers is None:
            raise self._wrong(key, what)
        return numbers

    def vectors(self, key: str, count: int | None, what: str, size: int | None = 3, infinite: bool = False) -> list[list[float]] | None:
        """Return that many lists of `size` numbers, for None any count of them; None if the key is missing."""
        if key not in self.data:
            return None
        value = self.data[key]
        rows = [_vector(row, size, infinite) for row in value] if isinstance(value, list) else []
        if not rows or None in rows or count not in (None, len(rows)):
            raise self._wrong(key, what)
        return rows  # type: ignore[return-value]  # no None is among them

    # ------------------------------------------------------------------ tables within
    def table(self, key: str, keys: Sequence[str] | None, label: str) -> TomlTable | None:
        """Return a table within this table; None if it is missing."""
        return TomlTable(self.file, self.data[key], (*self.place, key), label, keys) if key in self.data else None

    def tables(self, key: str, keys: Sequence[str], label: str, named: bool = False) -> list[TomlTable] | None:
        """Return a list of tables, labelled by `label` and number, or by their names. None if the key is missing."""
        if key not in self.data:
            return None
        items = self.data[key]
        if not isinstance(items, list):
            raise self._wrong(key, f"a list of tables: [[{key}]]" if named else "a list of tables: [{...}, {...}]")
        return [
            TomlTable(self.file, item, (*self.place, key, i), _called(label, item, i) if named else f"{label} {i}", keys)
            for i, item in enumerate(items)
        ]


def nearest(name: str, names: Iterable[str]) -> str:
    """Return the remedy for an unknown name: the nearest name, or all of a few."""
    names = list(names)
    near = get_close_matches(name[:200], names, 1) or get_close_matches(name[:200].lower(), names, 1)
    if near:
        return f"did you mean {near[0]!r}?"
    return f"there are {_listed(names[:24])}{', ...' if len(names) > 24 else ''}" if names else "there are none"


def _called(kind: str, item: Any, i: int) -> str:
    name = item.get("name") if isinstance(item, Mapping) else None
    return f"{kind} {name!r}" if isinstance(name, str) else f"{kind} number {i + 1}"


def _number(value: Any, infinite: bool) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) or (infinite and not math.isnan(number)) else None


def _vector(value: Any, count: int | None, infinite: bool) -> list[float] | None:
    if not isinstance(value, list) or not value or count not in (None, len(value)):
        return None
    numbers = [_number(x, infinite) for x in value]
    return None if None in numbers else numbers  # type: ignore[return-value]  # no None is among them


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


def _shown(value: Any) -> str:
    """Return a value as in the file, shortened."""
    if isinstance(value, Mapping):
        return "a table"
    try:
        text = ("false", "true")[value] if isinstance(value, bool) else repr(value) if isinstance(value, (str, list)) else str(value)
    except ValueError:  # Python writes numbers of thousands of digits only on request
        return "a number of too many digits"
    return text if len(text) <= 60 else text[:57] + "..."
