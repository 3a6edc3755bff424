"""What every effect has: fields that a person reads, a name of its kind, and its counterpart in the core."""

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
    """An effect: what acts on a model where a scene has it. Its fields can be set; a scene takes the change at its next call.

    What is given is copied: fields hold read-only arrays, and lists and mappings that stay as they are. A number in one of them is
    changed by setting the field anew.

    Subclasses are dataclasses whose fields are what a user gives, and say in `made_for` what they are in the core. A class attribute
    `_example` is the call that an error about its arguments shows.
    """

    _changes = 0
    _example = ""
    _several: tuple[str, ...] = ()  # fields whose items are values each

    @classmethod
    def kind(cls) -> str:
        """The name of its kind, which it has in a scene unless another is given: "coulomb_friction"."""
        return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        """The effect as the core has it, for a model. ModelError for names that are not there and numbers that make no sense."""
        raise NotImplementedError(f"{type(self).__name__} says in made_for what it is in the core")

    def completed_for(self, model: _core.Multibody) -> Effect:  # noqa: ARG002 - subclasses need it
        """Return the effect with every value that it takes from a model filled in: itself where it takes none."""
        return self

    def at_states(self, model: _core.Multibody) -> Effect:  # noqa: ARG002 - subclasses need it
        """What it comes to in small steps: itself, or for one that acts in steps the effect that acts at states."""
        return self

    def __setattr__(self, name: str, value: Any) -> None:
        super().__setattr__(name, fixed(value) if name in getattr(self, "__dataclass_fields__", ()) else value)
        if not name.startswith("_"):
            object.__setattr__(self, "_changes", self._changes + 1)

    def __setstate__(self, state: dict[str, Any]) -> None:
        own = {field.name for field in fields(self)}  # type: ignore[arg-type]  # subclasses are dataclasses
        self.__dict__.update({name: fixed(value) if name in own else value for name, value in state.items()})

    def named(self) -> set[str]:
        """What its fields name of a model: bodies, nodes, hinges, and of coordinates "hinge[j]" the hinge, too."""
        named = [name for field in fields(self) for name in _each_text(getattr(self, field.name))]  # type: ignore[arg-type]  # dataclasses
        return {*named, *(name.partition("[")[0] for name in named)}

    def by_coordinate(self) -> set[str]:
        """Hinges whose coordinates it takes one by one: "hinge[j]", and lists of numbers by hinge; "" where a list is of those of all."""
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
        """What its fields hold, besides these: each a value that may be of all coordinates or of each."""
        found: list[Any] = []
        for field in fields(self):  # type: ignore[arg-type]  # subclasses are dataclasses
            value = getattr(self, field.name)
            several = field.name in self._several and isinstance(value, (list, tuple))
            found += [] if field.name in besides else value if several else [value]
        return found

    def parameters(self) -> dict[str, Any]:
        """The fields that are not at their defaults, by name."""
        given = {}
        for field in fields(self):  # type: ignore[arg-type]  # subclasses are dataclasses
            default = field.default if field.default_factory is MISSING else field.default_factory()
            value = getattr(self, field.name)
            if default is MISSING or not _same(value, default):
                given[field.name] = value
        return given

    def to_dict(self) -> dict[str, Any]:
        """Its kind and its parameters as plain data: lists for arrays."""
        return {"effect": type(self).__name__} | {name: plain(value) for name, value in self.parameters().items()}

    def __repr__(self) -> str:
        shown = ", ".join(f"{name}={_shown(value)}" for name, value in self.parameters().items())
        return f"{type(self).__name__}({shown})"


def _each_text(value: Any) -> Iterator[str]:
    """Texts, and names of handles, in a value, its items and its keys."""
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
    """Arrays as lists, effects' functions of time as dictionaries, handles as their names; ModelError for what no file can hold."""
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
    raise _core.ModelError(f"{value!r:.80} is no plain data: a function is Python's, and no file holds it")


def names_of(given: Any, effect: str, what: str = "hinges") -> list[str] | None:
    """What an effect acts on, as a list of names: of a name, a handle, or a list of either; None is all."""
    if given is None:
        return None
    if isinstance(given, str) or hasattr(given, "name"):
        given = [given]
    return [text(getattr(one, "name", one), f"{effect}: one of its {what}") for one in listed(given, f"{effect}: {what}")]


def node_name(node: Any, effect: str) -> str:
    """The name of a node or body, of its handle or of None, the base."""
    return "" if node is None else text(getattr(node, "name", node), f"{effect}: a node")


def numbers_of(value: Any, what: str) -> list[float]:
    """One number, or a list of them."""
    made = _core.real_array(value, what)
    if made.ndim > 1:
        raise _core.ModelError(f"{what} takes a number or a list of numbers, not an array {made.shape}")
    return np.atleast_1d(made).tolist()


def by_hinge(value: Any, hinges: Any, model: _core.Multibody, effect: str, what: str) -> tuple[list[str] | None, list[float]]:
    """Names and numbers of a parameter: a number, one for each coordinate, or a dictionary by hinge, which then says the hinges."""
    names = names_of(hinges, effect)
    if not isinstance(value, Mapping):
        return names, numbers_of(value, f"{effect}: {what}")
    if names is not None:
        raise _core.ModelError(f"{effect}: {what} names its hinges itself; leave out hinges=")
    numbers: list[float] = []
    for name, each in value.items():
        count = len(_core.coordinates_named(model, [name], effect))
        given = numbers_of(each, f"{effect}: {what} of {name!r}")
        numbers += given * count if len(given) == 1 else given
    return list(value), numbers


def warn_of_negative(values: Sequence[float], effect: str, what: str, meaning: str) -> None:
    """A ModelWarning where one of these is negative: legal, and hardly meant."""
    from ...models.warning import warn

    if values and min(values) < 0:
        warn(f"{effect}: {what} is {min(values):g}, which is negative: {meaning}")
