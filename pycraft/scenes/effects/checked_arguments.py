"""Arguments of effects and functions of time, checked before construction."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from ... import _core


class Checked(type):
    """A metaclass whose classes refuse wrong arguments with a ModelError that shows their `_example`."""

    _example = ""

    def __call__(cls, *given: Any, **named: Any) -> Any:
        """Make an object. Raises ModelError for a missing, unknown or surplus argument."""
        try:
            inspect.signature(cls.__init__).bind(None, *given, **named)  # type: ignore[misc]  # the class's own, as type.__call__ takes it
        except TypeError as error:
            raise _core.ModelError(_misfit(cls, len(given), named)) from error
        return super().__call__(*given, **named)


def _misfit(cls: Any, given: int, named: Mapping[str, Any]) -> str:
    """Return a message that names the missing, unknown or surplus argument, with an example."""
    known = list(inspect.signature(cls.__init__).parameters.values())[1:]
    names = [parameter.name for parameter in known]
    example = f", for example {cls._example}" if cls._example else ""
    takes = f"{cls.__name__} takes {', '.join(names)}" if names else f"{cls.__name__} takes no arguments"
    for name in named:
        if name not in names:
            near = get_close_matches(name, names, 1)
            return f"{cls.__name__} has no argument {name!r}" + (f"; did you mean {near[0]!r}?" if near else f"; {takes}")
    if given > len(names):
        return f"{takes}: {given} arguments were given"
    if twice := [name for name in names[:given] if name in named]:
        return f"{cls.__name__}: {twice[0]} is given twice, by place and by name"
    missing = [parameter.name for parameter in known[given:] if parameter.default is parameter.empty and parameter.name not in named]
    return f"{cls.__name__} needs {' and '.join(missing)}{example}"
