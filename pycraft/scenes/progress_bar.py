"""How far a run has come, in a terminal or a notebook."""

from __future__ import annotations

from time import monotonic
from types import TracebackType
from typing import Any

SECONDS = 1.0
"""Runs that take no longer show nothing."""


class ProgressBar:
    """A bar with the simulated time, the rate and the time left, of runs that take longer than a second.

    Nothing is shown where standard error is neither a terminal nor a notebook.
    """

    def __init__(self, start: float, end: float, wanted: bool = True):
        self._start, self._end, self._wanted, self._began = start, end, wanted, monotonic()
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> ProgressBar:
        return self

    def __call__(self, t: float) -> None:
        """The run is at t."""
        if self._bar is None and self._wanted and monotonic() - self._began > SECONDS:
            self._open()
        if self._bar is not None:
            spent = max(monotonic() - self._began, 1e-9)
            rate, at = (t - self._start) / spent, f"{t:.4g} of {self._end:.4g} s"
            self._bar.update(self._task, completed=t - self._start, rate=f"{rate:.3g} s/s", at=at)

    def _open(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        console = Console(stderr=True)
        self._wanted = console.is_terminal or console.is_jupyter
        if not self._wanted:
            return
        columns = [TextColumn("{task.fields[at]}"), BarColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn()]
        self._bar = Progress(*columns, console=console, transient=True)
        self._task = self._bar.add_task("run", total=self._end - self._start, at="", rate="")
        self._bar.start()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None) -> None:
        if self._bar is not None:
            self._bar.stop()
