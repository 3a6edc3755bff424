"""Objects that accept only their own attributes: a misspelt one is an error, not a value that nothing reads."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

from . import _core


class UnknownAttributeError(_core.ModelError, AttributeError):
    """A value was set under a name that the object does not have."""


class Closed:
    """Only settable properties and names that begin with an underscore can be set; a user's own subclass may add attributes."""

    def __setattr__(self, name: str, value: Any) -> None:
        kind = type(self)
        if not name.startswith("_") and kind.__module__.startswith("pycraft.") and not settable(kind, name):
            names = {*dir(kind), *getattr(kind, "__dataclass_fields__", ())}
            known = sorted(n for n in names if not n.startswith("_") and settable(kind, n))
            raise UnknownAttributeError(f"{_called(self)} takes no {name!r}{_remedy(kind, name, known)}")
        super().__setattr__(name, value)


def settable(kind: type, name: str) -> bool:
    """Check that objects of a class have a value of this name that can be set."""
    found = getattr(kind, name, None)
    return isinstance(found, property) and found.fset is not None or name in getattr(kind, "__dataclass_fields__", ())


def _called(thing: Any) -> str:
    name = getattr(thing, "name", None)
    return f"{type(thing).__name__} {name!r}" if name else f"a {type(thing).__name__}"


def _remedy(kind: type, name: str, known: list[str]) -> str:
    if hasattr(kind, name):
        return ", which cannot be set" + (f"; settable: {', '.join(known)}" if known else "")
    near = get_close_matches(name.lower(), known, 1) or get_close_matches(name.lower(), [n for n in dir(kind) if not n.startswith("_")], 1)
    return f"; did you mean {near[0]!r}?" if near else f"; settable: {', '.join(known)}" if known else "; none of its attributes can be set"
