"""Output of commands: results on stdout, everything else on stderr, every failure one line and an exit status."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn, TextIO

import typer
from rich.console import Console
from typer.core import TyperGroup

from .. import _core
from ..tidy import terminal_width

REFUSED, INTERRUPTED, UNEXPECTED = 2, 130, 70  # exit statuses beside 0, and 1 for a check that does not pass

console = Console()
if not console.is_terminal:
    console = Console(width=terminal_width())  # a file or a pipe has no width of its own
diagnostics = Console(stderr=True)


def note(text: str) -> None:
    """Write a line to stderr."""
    diagnostics.print(text, markup=False, highlight=False, soft_wrap=True)


def fail(text: str, status: int = REFUSED) -> NoReturn:
    """End a command with an error message in one line."""
    note(f"error: {' '.join(text.split())}")
    raise typer.Exit(status)


class Commands(TyperGroup):
    """Commands that fail with one line instead of a traceback. PYCRAFT_TRACEBACK=1 in the environment shows the origin of an unexpected
    one."""

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        if sys.stdout is None:
            fail("the output is closed")
        return _guarded(lambda: super(Commands, self).make_context(*arguments, **options))

    def invoke(self, ctx: Any) -> Any:
        # Letters that a terminal cannot show are escaped, so that they never prevent a result.
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="backslashreplace")
        with warnings_as_notes():
            return _guarded(lambda: super(Commands, self).invoke(ctx))


@contextmanager
def warnings_as_notes() -> Iterator[None]:
    """Show each ModelWarning as a line on stderr, without its place in the code."""
    from ..models.warning import ModelWarning

    with warnings.catch_warnings():
        others = warnings.showwarning
        warnings.simplefilter("always", ModelWarning)

        def show(message: Warning | str, category: type[Warning], filename: str, lineno: int, *further: Any, **named: Any) -> None:
            if issubclass(category, ModelWarning):
                note(f"warning: {message}")
            else:
                others(message, category, filename, lineno, *further, **named)

        warnings.showwarning = show
        yield


def _guarded(run: Callable[[], Any]) -> Any:
    try:
        result = _flushed(run)
    except (typer.Exit, typer.Abort):
        raise
    except _core.Error as error:
        fail(str(error))
    except BrokenPipeError:  # the reader closed the pipe
        _let_go(sys.stdout)
        raise typer.Exit(1) from None
    except OSError as error:
        _let_go(sys.stdout)
        fail(f"{error.filename or 'the output'}: {error.strerror or error}")
    except KeyboardInterrupt:
        fail("interrupted", INTERRUPTED)
    except Exception as error:  # unexpected errors are also one line
        _tell_usage(error)
        if os.environ.get("PYCRAFT_TRACEBACK") or type(error).__module__.startswith(("click", "typer")):
            raise
        fail(f"unexpected {type(error).__name__}: {error}; PYCRAFT_TRACEBACK=1 shows where", UNEXPECTED)
    return result


def _tell_usage(error: Exception) -> None:
    """End with typer's message on invalid arguments, in one line. Without arguments it shows the help instead."""
    message = getattr(error, "format_message", None)
    if message is None or type(error).__name__ == "NoArgsIsHelpError":
        return
    command = getattr(getattr(error, "ctx", None), "command_path", "pycraft")
    fail(f"{message().rstrip('.')}; {command} --help says what there is")


def _flushed(run: Callable[[], Any]) -> Any:
    """Flush the output, so that a full disk is noticed here at the latest."""
    try:
        result = run()
    except typer.Exit:
        sys.stdout.flush()
        raise
    sys.stdout.flush()
    return result


def _let_go(stream: TextIO) -> None:
    """Drop the rest of a stream that cannot be written: the interpreter would try again at its end."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    except (OSError, ValueError):  # not a file: a test's, a notebook's
        pass
