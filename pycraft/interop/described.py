"""The part of a model that conversions to other tools need, for models of any class."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from .. import _core


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


def described(model: Any, by: str) -> Described:
    """Return the model itself. ModelError, which names the call, if it is not a model."""
    if not callable(getattr(model, "description", None)):
        hint = "; a scene's model is scene.model" if hasattr(model, "simulate") else ""
        raise _core.ModelError(f"{by} takes a model, not {model!r:.60}{hint}")
    return model


def theirs(given: Any, attribute: str, by: str, what: str) -> Any:
    """Return another tool's model, recognised by this attribute. ModelError, which names the call, if it is not one."""
    if not hasattr(given, attribute):
        raise _core.ModelError(f"{by} takes {what}, not {given!r:.60}")
    return given
