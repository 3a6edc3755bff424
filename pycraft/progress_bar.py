"""Progress of long computations, in a terminal or a notebook."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic
from types import TracebackType
from typing import Any

SECONDS = 1.0
"""Seconds; shorter work shows nothing."""
WIDEST = 40
"""Characters shown of a step's name."""


class ProgressBar:
    """A progress bar with the work done, the rate and the time left, for work longer than a second.

    It shows nothing if standard error is neither a terminal nor a notebook.

    Parameters
    ----------
    total : how much there is to do
    wanted : bool, False: show nothing
    """

    def __init__(self, total: float, wanted: bool = True):
        self._total, self._wanted, self._began = total, wanted, monotonic()
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Any:
        return self

    def show(self, done: float, at: str, unit: str, before: float = 0.0) -> None:
        """Show the work done: `at` describes it in words; the rate is in `unit`, excluding work done `before`."""
        spent = monotonic() - self._began
        if self._bar is None and self._wanted and spent > SECONDS:
            self._open()
        if self._bar is not None:
            self._bar.update(self._task, completed=done, rate=f"{(done - before) / max(spent, 1e-9):.3g} {unit}", at=at)

    def _open(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        console = Console(stderr=True)
        self._wanted = console.is_terminal or console.is_jupyter
        if not self._wanted:
            return
        if console.is_jupyter:
            self._bar = _NotebookLine(self._total)
            return
        columns = [TextColumn("{task.fields[at]}"), BarColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn()]
        self._bar = Progress(*columns, console=console, transient=True)
        self._task = self._bar.add_task("", total=self._total, at="", rate="")
        self._bar.start()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None) -> None:
        if self._bar is not None:
            self._bar.stop()


class StepProgress(ProgressBar):
    """Progress of named steps, such as theorems or meshes: call it with the name of each before it begins.

    Parameters
    ----------
    total : how many steps there are
    unit : their name, such as "theorems"
    progress : True or None: show the bar; False: show nothing; a function: call it with each name instead
    """

    def __init__(self, total: int, unit: str, progress: Callable[[str], None] | bool | None = True):
        super().__init__(total, progress is not False and not callable(progress))
        self._call = progress if callable(progress) else None
        self._unit, self._done = unit, 0

    def __call__(self, name: str) -> None:
        """Report that this step begins; the steps before it are done."""
        if self._call is not None:
            self._call(name)
        self.show(self._done, f"{self._done} of {self._total} {self._unit}: {name[:WIDEST]}", f"{self._unit}/s")
        self._done += 1


class _NotebookLine:
    """A line of text in a notebook's cell, replaced as the work goes on and empty when it ends."""

    def __init__(self, total: float):
        from IPython.display import display

        self._total = total
        self._shown = display({"text/plain": ""}, raw=True, display_id=True)

    def update(self, _: Any, completed: float, rate: str, at: str) -> None:
        share = 100 * completed / self._total if self._total else 100.0
        self._shown.update({"text/plain": f"{at} ({share:.0f} %, {rate})"}, raw=True)

    def stop(self) -> None:
        self._shown.update({"text/plain": ""}, raw=True)


class RunProgress(ProgressBar):
    """Progress of a run, by its time."""

    def __init__(self, start: float, end: float, wanted: bool = True):
        super().__init__(end - start, wanted)
        self._start, self._end = start, end

    def __call__(self, t: float) -> None:
        """Report that the run is at t."""
        self.show(t - self._start, f"{t:.4g} of {self._end:.4g} s", "s/s")
