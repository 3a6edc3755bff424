"""Models to files: `save` looks at how the file's name ends."""

from __future__ import annotations

import os
from pathlib import PurePath
from typing import TYPE_CHECKING

from ... import _core
from ..warning import warn
from . import mjcf_writer, toml_writer, urdf_writer

if TYPE_CHECKING:
    from ..multibody import Multibody


def save(model: Multibody, path: str | os.PathLike[str], state: bool = True) -> None:
    """`Multibody.save`."""
    shown = path_text(path, "a model")
    ending = PurePath(shown).suffix.lower()
    if ending == ".toml":
        text = toml_writer.model_text(model, state)
    elif ending == ".urdf":
        text = urdf_writer.model_text(model, shown)
    elif ending in (".xml", ".mjcf"):
        text = mjcf_writer.model_text(model, shown, state)
    else:
        kinds = ".toml, which holds every model, .urdf, for what URDF knows, or .xml, for what MJCF knows"
        raise _core.ModelError(f"{shown}: a model's file ends in {kinds}")
    if loose := model.frames._core.loose_names():
        warn(f"{shown}: a file does not hold loose frames: {', '.join(loose[:6])}{', ...' if len(loose) > 6 else ''}")
    if kept := [*model.locked, *model.coalesced]:
        warn(f"{shown}: a file does not hold what unlocks and splits: {', '.join(kept[:6])}{', ...' if len(kept) > 6 else ''}")
    if len(model.loops) and ending in (".xml", ".mjcf"):
        warn(f"{shown}: the file does not hold loops: {', '.join(map(repr, model.loops))}")
    functions = [loop["name"] for loop in model.loops._description() if loop.get("function") is not None]
    if functions and ending == ".toml":
        warn(f"{shown}: a file does not hold couplings by functions: {', '.join(functions[:6])}{', ...' if len(functions) > 6 else ''}")
    write_text(shown, text)


def path_text(path: str | os.PathLike[str], what: str) -> str:
    """A path as a text. ModelError where it is none."""
    try:
        return os.fsdecode(path)
    except TypeError:
        raise _core.ModelError(f"{what} is saved at the path of a file, not at {path!r:.80}") from None


def write_text(shown: str, text: str) -> None:
    """Write a file, which is replaced where it is there. ModelError where it cannot be written."""
    try:
        with open(shown, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except OSError as error:
        raise _core.ModelError(f"{shown}: cannot be written: {error.strerror or error}") from None
    except ValueError as error:  # a NUL in the path
        raise _core.ModelError(f"{shown!r}: cannot be written: {error}") from None
