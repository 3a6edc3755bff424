"""The bytes of a model's file in any format."""

from __future__ import annotations

import os

from ... import _core


def contents(path: str | os.PathLike[str]) -> tuple[str, bytes]:
    """Return the path as errors show it, and the contents of the file. ModelError if it cannot be read, or is not a path."""
    try:
        shown = os.fsdecode(path)
    except TypeError:
        raise _core.ModelError(f"a model is loaded from the path of a file, not from {path!r:.80}") from None
    if shown.lstrip().startswith("<"):
        begins = shown.strip()[:40]
        raise _core.ModelError(f"a model is loaded from the path of a file, not from its text: write {begins!r}... to a file")
    try:
        with open(shown, "rb") as file:
            return shown, file.read()
    except OSError as error:
        raise _core.ModelError(f"{shown}: cannot be read: {error.strerror or error}") from None
    except ValueError as error:  # a NUL in the path
        raise _core.ModelError(f"{shown!r}: cannot be read: {error}") from None
