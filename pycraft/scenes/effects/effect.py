"""Base of all effects: readable fields, a name of the kind, and the counterpart in the core."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from ... import _core
from ...arguments import fixed, listed, text
from ...closed import Closed
from .checked_arguments import Checked


class Effect(Closed, metaclass=Checked):
    """An effect, which acts on the model of a scene to which it is added. Its fields can be set; a scene uses the change at its next call.

    Arguments are copied: fields hold read-only arrays, and immutable lists and mappings. To change one of their numbers, set
    the field again.

    Subclasses are dataclasses whose fields are the user's arguments; `made_for` returns their counterpart in the core. A class attribute
    `_example` is the call shown in errors about arguments.
    """

    _changes = 0
    _example = ""
    _several: tuple[str, ...] = ()  # fields whose items are separate values

    @classmethod
    def kind(cls) -> str:
        """Return the name of its kind, its default name in a scene: "coulomb_friction"."""
        return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        """Return the effect of the core for a model. Raises ModelError for unknown names and invalid values."""
        raise NotImplementedError(f"{type(self).__name__} must define made_for, which returns the effect of the core")

    def completed_for(self, model: _core.Multibody) -> Effect:  # noqa: ARG002 - subclasses need it
        """Return the effect with all values filled in that it takes from a model; itself if it takes none."""
        return self

    def at_states(self, model: _core.Multibody) -> Effect:  # noqa: ARG002 - subclasses need it
        """Return its limit for small steps: itself, or for an effect that acts in steps the effect that acts at states."""
        return self

    def __setattr__(self, name: str, value: Any) -> None:
        super().__setattr__(name, fixed(value) if name in getattr(self, "__dataclass_fields__", ()) else value)
        if not name.startswith("_"):
            object.__setattr__(self, "_changes", self._changes + 1)

    def __setstate__(self, state: dict[str, Any]) -> None:
        own = {field.name for field in fields(self)}  # type: ignore[arg-type]  # subclasses are dataclasses
        self.__dict__.update({name: fixed(value) if name in own else value for name, value in state.items()})

    def named(self) -> set[str]:
        """Return the names of a model in its fields: bodies, nodes, hinges, and for coordinates "hinge[j]" also the hinge."""
        named = [name for field in fields(self) for name in _each_text(getattr(self, field.name))]  # type: ignore[arg-type]  # dataclasses
        return {*named, *(name.partition("[")[0] for name in named)}

    def by_coordinate(self) -> set[str]:
        """Return hinges whose coordinates have separate values: "hinge[j]", and lists of values by hinge; "" for a list for all."""
        found: set[str] = set()
        values = self.values()
        for value in values:
            for name in _each_text(value):
                hinge, bracket, _ = name.partition("[")
                found.update({hinge} if bracket else ())
            if isinstance(value, Mapping):
                found.update(str(getattr(key, "name", key)) for key, each in value.items() if np.size(each) > 1)
        listed = any(isinstance(value, (list, tuple, np.ndarray)) and not set(_each_text(value)) for value in values)
        if listed and hasattr(self, "hinges"):
            chosen = self.hinges
            found.update({""} if chosen is None else ("" if set(name) & set("*?") else name for name in _each_text(chosen)))
        return found

    def values(self, besides: tuple[str, ...] = ()) -> list[Any]:
        """Return the values of its other fields: each may apply to all coordinates or to one."""
        found: list[Any] = []
        for field in fields(self):  # type: ignore[arg-type]  # subclasses are dataclasses
            value = getattr(self, field.name)
            several = field.name in self._several and isinstance(value, (list, tuple))
            found += [] if field.name in besides else value if several else [value]
        return found

    def parameters(self) -> dict[str, Any]:
        """Return the fields that differ from their defaults, by name."""
        given = {}
        for field in fields(self):  # type: ignore[arg-type]  # subclasses are dataclasses
            default = field.default if field.default_factory is MISSING else field.default_factory()
            value = getattr(self, field.name)
            if default is MISSING or not _same(value, default):
                given[field.name] = value
        return given

    def to_dict(self) -> dict[str, Any]:
        """Return its kind and its parameters as plain data, with lists for arrays."""
        return {"effect": type(self).__name__} | {name: plain(value) for name, value in self.parameters().items()}

    def __repr__(self) -> str:
        shown = ", ".join(f"{name}={_shown(value)}" for name, value in self.parameters().items())
        return f"{type(self).__name__}({shown})"


def _each_text(value: Any) -> Iterator[str]:
    """Yield texts, and names of handles, in a value, its items and its keys."""
    if isinstance(value, Mapping):
        value = [*value, *value.values()]
    if isinstance(value, (list, tuple, set, frozenset)):
        for item in value:
            yield from _each_text(item)
    elif isinstance(name := getattr(value, "name", value), str):
        yield name


def _same(value: Any, default: Any) -> bool:
    if value is default:
        return True
    try:
        return bool(np.all(np.asarray(value) == np.asarray(default))) and np.shape(value) == np.shape(default)
    except (TypeError, ValueError):
        return False


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return np.array2string(value, separator=", ", threshold=12).replace("\n", " ")
    if callable(value) and hasattr(value, "__name__"):
        return value.__name__
    written = repr(value)
    return written if len(written) < 120 else written[:100] + "..."


def plain(value: Any) -> Any:
    """Return arrays as lists, functions of time as dictionaries, handles as names. Raises ModelError for values that no file can hold."""
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(name := getattr(value, "name", None), str):
        return name
    raise _core.ModelError(f"{value!r:.80} is not plain data: a file cannot hold a Python function")


def names_of(given: Any, effect: str, what: str = "hinges") -> list[str] | None:
    """Return the names on which an effect acts, from a name, a handle, or a list of either; None means all."""
    if given is None:
        return None
    if isinstance(given, str) or hasattr(given, "name"):
        given = [given]
    return [text(getattr(one, "name", one), f"{effect}: one of its {what}") for one in listed(given, f"{effect}: {what}")]


def node_name(node: Any, effect: str) -> str:
    """Return the name of a node or body, from its name, its handle or None (the base)."""
    return "" if node is None else text(getattr(node, "name", node), f"{effect}: a node")


def numbers_of(value: Any, what: str) -> list[float]:
    """Return one number as a list, or a list of numbers."""
    made = _core.real_array(value, what)
    if made.ndim > 1:
        raise _core.ModelError(f"{what} takes a number or a list of numbers, not an array {made.shape}")
    return np.atleast_1d(made).tolist()


def by_hinge(value: Any, hinges: Any, model: _core.Multibody, effect: str, what: str) -> tuple[list[str] | None, list[float]]:
    """Return names and values of a parameter: a number, one for each coordinate, or a dictionary by hinge, which names the hinges."""
    names = names_of(hinges, effect)
    if not isinstance(value, Mapping):
        return names, numbers_of(value, f"{effect}: {what}")
    if names is not None:
        raise _core.ModelError(f"{effect}: {what} is a dictionary by hinge and names the hinges; leave out hinges=")
    numbers: list[float] = []
    for name, each in value.items():
        count = len(_core.coordinates_named(model, [name], effect))
        given = numbers_of(each, f"{effect}: {what} of {name!r}")
        numbers += given * count if len(given) == 1 else given
    return list(value), numbers


def warn_of_negative(values: Sequence[float], effect: str, what: str, meaning: str) -> None:
    """Warn (ModelWarning) if one of these is negative: legal, but probably not intended."""
    from ...models.warning import warn

    if values and min(values) < 0:
        warn(f"{effect}: {what} is negative, {min(values):g}: {meaning}")
