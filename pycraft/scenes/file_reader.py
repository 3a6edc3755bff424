"""Scenes from TOML files and from plain data. Errors name file, line, effect and key."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from .. import _core
from ..dynamics.integrator_names import integrator_names
from ..models.loaders.toml_file import TomlFile, TomlTable, nearest
from ..models.loaders.toml_reader import MODEL, read_table, set_state
from ..models.warning import warn
from .effects import Effect
from .file_format import FORMAT, HOW, IN_TIME, RUN, SCENE, effect_kind, field_names, referred_model

_OF_ENTRY = ("effect", "name", "on")
_BASE = ("node_a", "node_b")
"""Parameters that a file omits for the base."""
_RUN_UNITS = {"T": "in seconds", "rtol": "a tolerance", "atol": "a tolerance", "step": "in seconds", "every": "in seconds"}


class PlainData:
    """Plain data instead of a file: errors name the part of the data."""

    def __init__(self, path: str = "a scene's data"):
        self.path = path

    def at(self, place: tuple[str | int, ...]) -> str:
        """Return the place of a value: "a scene's data, effects[1].stiffness"."""
        parts = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place).lstrip(".")
        return f"{self.path}, {parts}" if parts else self.path

    def error(self, place: tuple[str | int, ...], text: str) -> Exception:
        """Return a ModelError to raise."""
        return _core.ModelError(f"{self.at(place)}: {text}")


def load_scene(path: str | os.PathLike[str]) -> Any:
    """Load the scene of a TOML file, written by `Scene.save` or by hand (docs/scenes.md, Files).

    Parameters
    ----------
    path : path of the file; the path of a model in the file is relative to the file's folder

    Returns
    -------
    Scene : its model is at the state in the file, or at zero if the file has none

    Warns
    -----
    ModelWarning
        Doubtful data of the model, and doubtful values of effects.

    Raises
    ------
    ModelError
        Any error in the file, with file, line, effect or key, and the remedy.

    Examples
    --------
    >>> import pycraft as pc
    >>> scene = pc.load_scene("scene.toml")  # doctest: +SKIP
    """
    file = TomlFile(path)
    return read_scene(file, file.data, Path(file.path).parent, Path(file.path).stem)


def read_scene(file: Any, data: Any, folder: Path, name: str) -> Any:
    """Return the scene in a file's tables or in plain data."""
    from .scene import Scene

    table = TomlTable(file, data, (), "a scene", SCENE)
    if (written := table.data.get("format", FORMAT)) != FORMAT or isinstance(written, bool):
        raise table.error("format", f"format = {written!r:.40} is not read by this version of pycraft, which reads {FORMAT}")
    model = _model(table, folder, name)
    if (state := table.table("state", ("q", "v"), "the state")) is not None:
        set_state(model, state)
    try:
        scene = Scene(model, **{key: table.data[key] for key in HOW if key in table})
    except (TypeError, _core.Error) as error:
        raise table.error(_spoken_of(str(error), table, HOW), f"a scene: {error}") from None
    if (run := table.table("run", RUN, "the run")) is not None:
        scene.run_options = _run(run)
    for entry in table.tables("effects", None, "effect", named=True) or []:  # type: ignore[arg-type]  # all keys, until its kind is known
        _add(scene, entry)
    return scene


def _model(table: TomlTable, folder: Path, name: str) -> Any:
    if "model" not in table:
        raise table.error(
            None, 'the scene has no model; name one: model = "panda", model = "arm.toml", or write it as tables, [[model.bodies]]'
        )
    given = table.data["model"]
    named = isinstance(given, str) or (isinstance(given, Mapping) and ("path" in given or "robot" in given))
    if isinstance(given, Mapping) and not named:
        inner = TomlTable(table.file, given, ("model",), "the model", MODEL)
        model, words = read_table(inner, name)
    else:
        try:
            model, words = referred_model(given, folder)
        except _core.ModelError as error:
            raise table.error("model", f"the model of a scene: {error}") from None
    for text in words:
        warn(text)
    return model


def _run(table: TomlTable) -> dict[str, Any]:
    options: dict[str, Any] = {}
    for key in table.data:
        if key == "integrator":
            options[key] = table.choice(key, integrator_names(), "")
        elif not (number := table.number(key, 0.0, _RUN_UNITS[key])) > 0:
            raise table.error(key, f"the run: {key} = {number:g}; it must be positive, {_RUN_UNITS[key]}")
        else:
            options[key] = number
    return options


def enter(scene: Any, data: Mapping[str, Any], place: PlainData) -> None:
    """Add one effect to a scene, from the data of an entry of `effects`."""
    _add(scene, TomlTable(place, data, (), "the effect", None))  # type: ignore[arg-type]  # gives the place, as a file does


# Effects --------------------------------------------------------------------------------------------------------------


def _add(scene: Any, entry: TomlTable) -> None:
    """Add one effect, on or off."""
    called = entry.text("effect", "")
    if not called:
        raise entry.error(None, f'{entry.label} names no effect; add its kind, such as effect = "Damping"')
    try:
        kind = effect_kind(called)
    except _core.ModelError as error:
        raise entry.error("effect", f"{entry.label}: {error}") from None
    label = f"effect {entry.data.get('name', kind.kind())!r}"
    known = [*_OF_ENTRY, *field_names(kind)]
    if unknown := [key for key in entry.data if key not in known]:
        raise entry.error(unknown[0], f"{label} ({kind.__name__}) has no key {unknown[0]!r}; {nearest(unknown[0], known)}")
    name = entry.text("name") if "name" in entry else None
    on = entry.flag("on") if "on" in entry else True
    effect = _made(kind, entry, label)
    try:
        scene._enter(name, effect, on)
    except _core.Error as error:
        raise entry.error(_spoken_of(str(error), entry, known), f"{label}: {error}") from None


def _made(kind: type[Effect], entry: TomlTable, label: str) -> Effect:
    given: dict[str, Any] = {}
    for field in fields(kind):  # type: ignore[arg-type]  # effects are dataclasses
        if field.name in entry:
            given[field.name] = _value(entry.file, entry.data[field.name], (*entry.place, field.name), f"{label}: {field.name}")
        elif field.name in _BASE:
            given[field.name] = None
        elif field.default is MISSING and field.default_factory is MISSING:
            raise entry.error(None, f"{label} ({kind.__name__}) needs {field.name}; write {field.name} = ...")
    return kind(**given)


def _value(file: Any, value: Any, place: tuple[str | int, ...], label: str) -> Any:
    """Return a parameter as in the file, except functions of time, which are tables with `in_time`."""
    if not isinstance(value, Mapping) or "in_time" not in value:
        return value
    table = TomlTable(file, value, place, label, None)
    kind = IN_TIME[table.choice("in_time", tuple(IN_TIME), "")]
    table = TomlTable(file, value, place, label, ("in_time", *field_names(kind)))
    for field in fields(kind):  # type: ignore[arg-type]  # functions of time are dataclasses
        if field.name not in table and field.default is MISSING:
            raise table.error(None, f"{label}, a {kind.__name__}, needs {field.name}; write {field.name} = ...")
    return kind(**{key: item for key, item in value.items() if key != "in_time"})


def _spoken_of(text: str, table: TomlTable, known: Any) -> str | None:
    """Return the key of a table to which an error refers, by its own name or by a name in its value."""
    there = [key for key in known if key in table]
    for key in there:
        if key not in _OF_ENTRY and f" {key}" in f" {text}".replace("(", " ").replace("=", " "):
            return key
    for key in there:
        if any(f"'{held}'" in text for held in _texts(table.data[key])):
            return key
    in_time = [key for key in there if isinstance(table.data[key], Mapping) and "in_time" in table.data[key]]
    return in_time[0] if in_time and ("table" in text or "spline" in text) else None


def _texts(value: Any) -> list[str]:
    """Yield the texts within a value."""
    if isinstance(value, str):
        return [value]
    items = [*value, *value.values()] if isinstance(value, Mapping) else value if isinstance(value, list) else []
    return [found for item in items for found in _texts(item)]
