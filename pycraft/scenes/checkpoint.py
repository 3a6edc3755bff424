"""Checkpoints, from which a run can be resumed."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from .. import _core

FORMAT = "pycraft checkpoint 2"


@dataclass(frozen=True)
class Checkpoint:
    """State from which a run can be resumed: `scene.resume(checkpoint, T)`.

    Values are exact sums of doubles, so that nothing is lost in any precision. It can be pickled, and `save` writes it as text.

    Attributes
    ----------
    t : s, start of the resumed run: the start of the last step if the end of the run cut that step short
    model, effects : name of the scene's model, names of the effects that were on
    coordinates : coordinates of the state: "elbow of forearm", a coordinate of the hinge of that body
    integrator, options : arguments of the run
    state : state of the core
    """

    t: float
    model: str
    effects: tuple[str, ...]
    coordinates: tuple[str, ...]
    precision: str
    integrator: str
    options: dict[str, Any]
    state: dict[str, Any]

    def save(self, path: str | Path) -> None:
        """Write the checkpoint as JSON. Raises OSError if the path cannot be written."""
        Path(path).write_text(json.dumps({"format": FORMAT, **asdict(self)}, indent=1) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | Path) -> Checkpoint:
        """Read a checkpoint written by `save`. Raises EvaluationError for other files and invalid values."""
        try:
            data = json.loads(Path(path).read_text(encoding="utf-8"))
            _check(isinstance(data, dict) and data.pop("format", None) == FORMAT, f"its format is not {FORMAT!r}")
            _check_entries(data)
        except ValueError as error:
            raise _core.EvaluationError(f"{str(path)!r} holds no checkpoint ({error}); `run.checkpoint().save(path)` writes one") from None
        return cls(**data | {name: tuple(data[name]) for name in ("effects", "coordinates")})

    def __repr__(self) -> str:
        return f"<checkpoint of {self.model!r} at {self.t:g} s, integrator {self.integrator!r}>"


def coordinates_of(model: Any) -> tuple[str, ...]:
    """Return the body and coordinate of each entry of v. Edits that move bodies or the root may keep their number but not their meaning."""
    bodies, hinges = model._names()[:2]
    moved = dict(zip(hinges, bodies, strict=True))
    return tuple(f"{name} of {moved[name if name in moved else name[: name.rindex('[')]]}" for name in model.coordinate_names)


# ---------------------------------------------------------------------- what a file may say


def _check(condition: bool, otherwise: str) -> None:
    if not condition:
        raise ValueError(otherwise)


def _keys(given: Any, names: tuple[str, ...], what: str) -> None:
    _check(isinstance(given, dict) and set(given) == set(names), f"{what} takes {', '.join(names)}")


def _number(x: Any) -> bool:
    return isinstance(x, (int, float)) and not isinstance(x, bool) and math.isfinite(x)


def _sums(given: Any) -> bool:
    """Return True for a list of exact sums."""
    return isinstance(given, list) and all(isinstance(parts, list) and parts and all(map(_number, parts)) for parts in given)


def _check_entries(data: dict[str, Any]) -> None:
    _keys(data, tuple(field.name for field in fields(Checkpoint)), "a checkpoint")
    for name in ("model", "precision", "integrator"):
        _check(isinstance(data[name], str), f"{name} is a name, not {data[name]!r:.40}")
    options, state = data["options"], data["state"]
    for what in ("effects", "coordinates"):
        _check(isinstance(data[what], list) and all(isinstance(name, str) for name in data[what]), f"{what} is a list of names")
    sizes, switches = ("rtol", "atol", "step", "max_step"), ("normalise", "energy")
    _keys(options, (*sizes, *switches), "options")
    for name in sizes:
        _check(_number(options[name]) and options[name] >= 0, f"{name} is a positive number or zero, not {options[name]!r:.40}")
    for name in switches:
        _check(isinstance(options[name], bool), f"{name} is true or false, not {options[name]!r:.40}")
    _keys(state, ("t", "x", "size", "origin", "taken", "signs", "lengths"), "state")
    for name in ("t", "size", "origin"):
        _check(_sums([state[name]]), f"{name} of the state is a list of finite numbers that are added up, not {state[name]!r:.40}")
    for name in ("x", "lengths"):
        _check(_sums(state[name]), f"{name} of the state is a list of lists of finite numbers that are added up")
    _check(_number(data["t"]) and data["t"] == sum(state["t"]), f"t is {data['t']!r:.40}, but the state has {sum(state['t']):g}")
    _check(sum(state["size"]) > 0, f"size of the state is {sum(state['size']):g}; a step is a positive number of seconds")
    taken = state["taken"]
    _check(type(taken) is int and 0 <= taken < 2**62, f"taken of the state is a count of steps, not {taken!r:.40}")
    _check(isinstance(state["signs"], list) and all(sign in (-1, 0, 1) for sign in state["signs"]), "signs of the state are -1, 0 or 1")
