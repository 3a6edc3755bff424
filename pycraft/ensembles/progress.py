"""How far a sweep has come, in a terminal or a notebook, and how long it will take."""

from __future__ import annotations

from time import monotonic
from types import TracebackType
from typing import Any

from ..scenes.progress_bar import SECONDS, visible_console


class SweepProgress:
    """A bar with the runs that are finished and failed, their rate and the time left, of sweeps that take longer than a second."""

    def __init__(self, count: int, before: int, wanted: bool = True):
        self._count, self._before, self._wanted = count, before, wanted
        self._began, self._done, self._failed = monotonic(), before, 0
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> SweepProgress:
        return self

    def add(self, finished: int, failed: int) -> None:
        """So many more are finished, and so many of them failed."""
        self._done, self._failed = self._done + finished, self._failed + failed
        spent = monotonic() - self._began
        if self._bar is None and self._wanted and spent > SECONDS:
            self._open()
        if self._bar is not None:
            rate = f"{(self._done - self._before) / max(spent, 1e-9):.3g} runs/s"
            at = f"{self._done} of {self._count} runs" + (f", {self._failed} failed" if self._failed else "")
            self._bar.update(self._task, completed=self._done, rate=rate, at=at)

    def _open(self) -> None:
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        if (console := visible_console()) is None:
            self._wanted = False
            return
        columns = [TextColumn("{task.fields[at]}"), BarColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn()]
        self._bar = Progress(*columns, console=console, transient=True)
        self._task = self._bar.add_task("sweep", total=self._count, completed=self._before, at="", rate="")
        self._bar.start()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None) -> None:
        if self._bar is not None:
            self._bar.stop()
