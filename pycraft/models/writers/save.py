"""Write models to files: the ending of the file's name selects the format."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import PurePath
from typing import TYPE_CHECKING

from ... import _core
from ..warning import warn
from . import mjcf_writer, toml_writer, urdf_writer
from .shape_elements import lost_text

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
    functions = [loop["name"] for loop in model.loops._description() if loop.get("function") is not None]
    for names, what in (
        (model.frames._core.loose_names(), "loose frames"),
        ([*model.locked, *model.coalesced], "what unlocks hinges and splits bodies"),
        (functions if ending in (".toml", ".urdf") else [], "couplings by functions"),
    ):
        if names:
            warn(f"{shown}: no file holds {what}, and these were not written: {', '.join(names[:6])}{', ...' if len(names) > 6 else ''}")
    if ending == ".toml" and (unsaved := len([shape for shape in model._shapes if shape.triangles is not None])):
        warn(f"{shown}: shapes that were not written: {lost_text(['mesh without a file of its own'] * unsaved)}")
    write_text(shown, text)


def path_text(path: str | os.PathLike[str], what: str) -> str:
    """Return a path as a text. ModelError if it is not a path."""
    try:
        return os.fsdecode(path)
    except TypeError:
        raise _core.ModelError(f"{what} is saved at the path of a file, not at {path!r:.80}") from None


def write_text(shown: str, text: str) -> None:
    """Write a file, replacing an existing one, whole or not at all. ModelError if it cannot be written."""
    try:
        content, path = text.encode("utf-8"), os.path.realpath(shown)  # a symbolic link stays one
        new = not os.path.exists(path)
        beside = (new or os.path.isfile(path)) and os.access(os.path.dirname(path), os.W_OK)
        with open(path, "ab" if beside else "wb") as file:  # a file without write permission is not replaced either
            if not beside:  # a pipe, a device, or a folder that accepts no new file
                file.write(content)
        if beside:
            _replace(path, content, new)
    except OSError as error:
        raise _core.ModelError(f"{shown}: cannot be written: {error.strerror or error}") from None
    except ValueError as error:  # a NUL in the path, half a character in the text
        raise _core.ModelError(f"{shown!r}: cannot be written: {error}") from None


def _replace(path: str, content: bytes, new: bool) -> None:
    """Write a file beside it and move it into place, with its permissions; a new file that fails is removed."""
    number, beside = tempfile.mkstemp(dir=os.path.dirname(path), prefix=".saving-")
    try:
        with os.fdopen(number, "wb") as file:
            file.write(content)
        shutil.copymode(path, beside)
        os.replace(beside, path)
    except BaseException:
        for left in (beside, path) if new else (beside,):
            os.unlink(left)
        raise
