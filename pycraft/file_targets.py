"""Output paths of long computations, checked before the work begins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from . import _core


def writable_target(path: Any, endings: tuple[str, ...], what: str) -> Path:
    """Return the path. EvaluationError unless it has one of these endings, OSError if it cannot be written; an existing file is not
    touched."""
    try:
        target = Path(path)
    except TypeError:
        raise _core.EvaluationError(f"output {path!r:.80}: {what} is written to a path that ends in {', '.join(endings)}") from None
    if "\0" in str(target):
        raise _core.EvaluationError(f"output {str(path)!r:.80}: no path has a zero in it")
    if target.suffix not in endings:
        raise _core.EvaluationError(f"output {str(path)!r}: {what} is written to a file that ends in {', '.join(endings)}")
    if not target.parent.is_dir():
        raise FileNotFoundError(f"output {str(path)!r}: there is no folder {str(target.parent)!r}")
    if target.is_dir():
        raise IsADirectoryError(f"output {str(path)!r} is a folder")
    there = target.exists()
    try:
        with target.open("ab"):
            pass
    except OSError as error:
        raise type(error)(f"output {str(path)!r} cannot be written: {error.strerror}") from None
    if not there:
        target.unlink()
    return target
