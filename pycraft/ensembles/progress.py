"""How far a sweep has come, in a terminal or a notebook, and how long it will take."""

from __future__ import annotations

from ..progress_bar import ProgressBar


class SweepProgress(ProgressBar):
    """Of a sweep, by its runs: those that are finished and failed; `before` of them were finished when it began."""

    def __init__(self, count: int, before: int, wanted: bool = True):
        super().__init__(count, wanted)
        self._count, self._before, self._done, self._failed = count, before, before, 0

    def add(self, finished: int, failed: int) -> None:
        """So many more are finished, and so many of them failed."""
        self._done, self._failed = self._done + finished, self._failed + failed
        at = f"{self._done} of {self._count} runs" + (f", {self._failed} failed" if self._failed else "")
        self.show(self._done, at, "runs/s", self._before)
