"""Subhinges of a custom hinge in a TOML file, for bodies and loops."""

from __future__ import annotations

from typing import Any

from ... import _core
from .toml_file import TomlTable

SUBHINGE = ("kind", "axis", "point", "pitch")
_VECTOR = "three finite numbers: [x, y, z]"


def subhinges_of(table: TomlTable) -> list[dict[str, Any]] | None:
    """Return the entries of `subhinges = [...]` of a table; None if it has none. ModelError with file, line and key."""
    given = table.tables("subhinges", SUBHINGE, f"{table.label}: subhinge")
    return None if given is None else [_subhinge(one) for one in given]


def _subhinge(table: TomlTable) -> dict[str, Any]:
    if "kind" not in table:
        raise table.error(None, f'{table.label} has no kind; give it one: kind = "pin"')
    made: dict[str, Any] = {"kind": table.choice("kind", tuple(_core.subhinge_kinds), "")}
    for key in ("axis", "point"):
        if (numbers := table.vector(key, 3, _VECTOR)) is not None:
            made[key] = numbers
    if "pitch" in table:
        made["pitch"] = table.number("pitch", 0.0, "in metres per radian")
    return made
