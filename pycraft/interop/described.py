"""What the other tools' conventions ask of a model, whichever class it has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol


class Described(Protocol):
    """A model by its sizes, its hinges (with `q_slice`, `v_slice`, `kind`, `subhinges`) and its description as plain data."""

    @property
    def name(self) -> str: ...
    @property
    def nq(self) -> int: ...
    @property
    def nv(self) -> int: ...
    @property
    def gravity(self) -> Any: ...
    @property
    def hinges(self) -> Mapping[str, Any]: ...
    def description(self) -> dict[str, Any]: ...
