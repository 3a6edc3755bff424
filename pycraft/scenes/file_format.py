"""Common parts of reading and writing files of scenes: keys, kinds of effects, referenced models."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from .. import _core
from ..models.loaders.load import read
from ..models.loaders.toml_file import nearest
from . import effects
from .effects.functions_of_time import InTime

FORMAT = 1
"""Version of the format; raised when the meaning of a file changes."""
HOW: dict[str, Any] = {"form": "fast", "refine": 0, "residual": "same", "precision": "double"}
"""Options of the solution for accelerations, with defaults, in the order of `Scene`'s arguments."""
SCENE = ("format", "model", *HOW, "state", "run", "effects")
RUN = ("T", "integrator", "rtol", "atol", "step", "every")
"""Options of a run: T in s, the integrator with its tolerances or step, and the seconds between kept states."""
REFERENCE = ("path", "robot", "root", "mimic", "welds")
ENDINGS = (".toml", ".urdf", ".xml", ".mjcf")

_PYTHONS = (effects.Effect, effects.UserEffect, effects.Sampled)
KINDS: dict[str, type[effects.Effect]] = {
    name: kind
    for name in effects.__all__
    if isinstance(kind := getattr(effects, name), type) and issubclass(kind, effects.Effect) and kind not in _PYTHONS
}
"""Effects that a file can hold, by the names of their classes."""
SHORT = {kind.kind(): kind for kind in KINDS.values()}
"""The same by their names in a scene: "coulomb_friction"."""
IN_TIME: dict[str, type[InTime]] = {kind.__name__: kind for kind in (effects.Table, effects.Spline, effects.Harmonic)}


def field_names(kind: type) -> list[str]:
    """Return the parameters of an effect or function of time, in order."""
    return [field.name for field in fields(kind)]


def effect_kind(name: str) -> type[effects.Effect]:
    """Return the effect of a name, spelt as its class or as in scenes. Raises ModelError with the nearest names."""
    found = KINDS.get(name) or SHORT.get(name)
    if found is not None:
        return found
    if name in ("UserEffect", "Sampled", "user_effect", "sampled"):
        raise _core.ModelError(f"effect {name!r} calls a Python function, which a file cannot hold; add it after loading the scene")
    known = SHORT if name == name.lower() else KINDS
    raise _core.ModelError(f"no effect is called {name!r}; {nearest(name, known)}")


def referred_model(reference: Any, folder: Path) -> tuple[Any, list[str]]:
    """Return the model that a scene refers to, and warnings about it.

    reference : a path, relative to `folder`; the name of a robot of the package; or a table {path or robot, root, mimic, welds}
    Raises ModelError for an invalid reference.
    """
    from ..models import robots

    options = {"path": reference} if isinstance(reference, str) else dict(reference) if isinstance(reference, Mapping) else {}
    if unknown := [key for key in options if key not in REFERENCE]:
        raise _core.ModelError(f"a reference to a model has no key {unknown[0]!r}; {nearest(str(unknown[0]), REFERENCE)}")
    path, robot = options.pop("path", None), options.pop("robot", None)
    if isinstance(reference, str) and not _is_path(reference):
        path, robot = None, reference
    given = robot if path is None else path
    if not isinstance(given, str) or (path is not None and robot is not None):
        raise _core.ModelError('a scene names its model by a path, "arm.toml", or a robot of the package, "panda"')
    if path is not None:
        how: dict[str, Any] = {"root": "fixed", "mimic": "couple", "welds": None, **options}
        return read(folder / path, **how)
    if robot not in robots.names():
        remedy = nearest(given, robots.names())
        raise _core.ModelError(f"no robot of the package is called {robot!r}; {remedy} A path to a file ends in {', '.join(ENDINGS)}")
    if "mimic" in options:
        raise _core.ModelError("mimic applies only to files; no robot of the package has a joint that follows another")
    try:
        return getattr(robots, given)(**options), []
    except TypeError as error:
        raise _core.ModelError(f"robot {robot!r}: {error}") from None


def _is_path(text: str) -> bool:
    return text.lower().endswith(ENDINGS) or "/" in text or "\\" in text
