"""A scene as plain data, and as the TOML text that `pycraft.load_scene` reads back (docs/scenes.md, Files)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import _core
from ..models.writers.save import path_text, write_text
from ..models.writers.toml_text import Inline, document
from ..models.writers.toml_writer import model_data, model_text, state_data
from .effects.effect import plain
from .file_format import FORMAT, HOW, KINDS, referred_model

_HEAD = "# A scene of PyCraft: SI units and radians. docs/scenes.md, Files, says what the keys mean.\n\n"


def scene_data(scene: Any, model: Any = None, folder: Path | None = None) -> dict[str, Any]:
    """Return `Scene.to_dict`; a path to a model is relative to `folder`, default the present one."""
    data: dict[str, Any] = {"format": FORMAT}
    inline = model is None
    if not inline:
        data["model"] = _checked_reference(scene, model, folder or Path())
    data |= {key: value for (key, default), value in zip(HOW.items(), scene._how, strict=True) if value != default}
    if state := state_data(scene.model):
        data["state"] = plain(state)
    if scene.run_options:
        data["run"] = plain(scene.run_options)
    if written := _effects(scene):
        data["effects"] = written
    if inline:
        data["model"] = plain(model_data(scene.model, state=False))
    return data


def save(scene: Any, path: Any, model: Any) -> None:
    """`Scene.save`."""
    shown = path_text(path, "a scene")
    if not shown.lower().endswith(".toml"):
        raise _core.ModelError(f"{shown}: the file of a scene must end in .toml")
    data = scene_data(scene, model, Path(shown).parent)
    data |= {key: Inline(value) for key, value in data.items() if key == "model" and _is_reference(value)}
    data["effects"] = [{key: _on_one_line(value) for key, value in effect.items()} for effect in data.get("effects", [])]
    if "bodies" in data["model"] and not isinstance(data["model"], Inline):
        for body in data["model"]["bodies"]:
            body |= {key: _on_one_line(value) for key, value in body.items()}
    write_text(shown, f"{_HEAD}{document({key: value for key, value in data.items() if value != []})}\n")


def _is_reference(value: Any) -> bool:
    return isinstance(value, Mapping) and ("path" in value or "robot" in value)


def _on_one_line(value: Any) -> Any:
    """Write tables within an effect or a body on its own line."""
    if isinstance(value, Mapping):
        return Inline({key: _on_one_line(item) for key, item in value.items()})
    return [_on_one_line(item) for item in value] if isinstance(value, list) else value


def _checked_reference(scene: Any, reference: Any, folder: Path) -> Any:
    """Check that a model's path, a robot's name, or a table of either with options, refers to the scene's model."""
    if isinstance(reference, os.PathLike):
        reference = os.fspath(reference)
    found, _ = referred_model(reference, folder)
    if model_text(found, state=False) != model_text(scene.model, state=False):
        raise _core.ModelError(
            f"model={reference!r} is not the model of this scene, {scene.model.name!r}: they differ; without model= the file holds it"
        )
    return reference if isinstance(reference, str) else dict(reference)


def _effects(scene: Any) -> list[dict[str, Any]]:
    """Return the effects as plain data. Raises ModelError that names all effects that no file can hold."""
    written, refused = [], []
    for name, (effect, on) in scene._entries.items():
        try:
            if type(effect) is not KINDS.get(type(effect).__name__):
                raise _core.ModelError("it is not an effect of the library")
            data = effect.to_dict()
        except _core.ModelError:
            refused.append(f"{name!r} ({type(effect).__name__})")
            continue
        kind = data.pop("effect")
        entry = {"effect": kind, "name": name} | ({} if on else {"on": False})
        written.append(entry | {key: value for key, value in data.items() if value is not None})
    if refused:
        raise _core.ModelError(
            f"a file cannot hold Python functions or classes, as in {', '.join(refused)}: give values over time as pc.effects.Table, "
            "Spline or Harmonic; remove the other effects before saving, and add them again after loading"
        )
    return written
