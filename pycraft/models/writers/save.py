"""Models to files: `save` looks at how the file's name ends."""

from __future__ import annotations

import os
import shutil
import tempfile
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
    unseen = len([shape for shape in model.shapes if shape.triangles is not None or ending != ".toml"])
    if unseen:
        what = "meshes that were in the model's own file" if ending == ".toml" else "shapes to be seen by, which .toml does"
        warn(f"{shown}: a file does not hold {what}: {unseen}")
    functions = [loop["name"] for loop in model.loops._description() if loop.get("function") is not None]
    if functions and ending in (".toml", ".urdf"):
        warn(f"{shown}: a file does not hold couplings by functions: {', '.join(functions[:6])}{', ...' if len(functions) > 6 else ''}")
    write_text(shown, text)


def path_text(path: str | os.PathLike[str], what: str) -> str:
    """A path as a text. ModelError where it is none."""
    try:
        return os.fsdecode(path)
    except TypeError:
        raise _core.ModelError(f"{what} is saved at the path of a file, not at {path!r:.80}") from None


def write_text(shown: str, text: str) -> None:
    """Write a file, which is replaced where it is there, whole or not at all. ModelError where it cannot be written."""
    try:
        content, path = text.encode("utf-8"), os.path.realpath(shown)  # a symbolic link stays one
        new = not os.path.exists(path)
        beside = (new or os.path.isfile(path)) and os.access(os.path.dirname(path), os.W_OK)
        with open(path, "ab" if beside else "wb") as file:  # what may not be written is not replaced either
            if not beside:  # a pipe, a device, or a folder that takes no file
                file.write(content)
        if beside:
            _replace(path, content, new)
    except OSError as error:
        raise _core.ModelError(f"{shown}: cannot be written: {error.strerror or error}") from None
    except ValueError as error:  # a NUL in the path, half a character in the text
        raise _core.ModelError(f"{shown!r}: cannot be written: {error}") from None


def _replace(path: str, content: bytes, new: bool) -> None:
    """By a file beside it that takes its place once it is written, with its permissions; a new one that fails is taken away."""
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
