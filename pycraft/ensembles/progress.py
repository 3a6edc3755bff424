"""Progress of a sweep in a terminal or a notebook, with the time remaining."""

from __future__ import annotations

from ..progress_bar import ProgressBar


class SweepProgress(ProgressBar):
    """Progress of a sweep in runs finished and failed; `before` is the number already finished when it began."""

    def __init__(self, count: int, before: int, wanted: bool = True):
        super().__init__(count, wanted)
        self._count, self._before, self._done, self._failed = count, before, before, 0

    def add(self, finished: int, failed: int) -> None:
        """Add finished runs, and the number of failures among them."""
        self._done, self._failed = self._done + finished, self._failed + failed
        at = f"{self._done} of {self._count} runs" + (f", {self._failed} failed" if self._failed else "")
        self.show(self._done, at, "runs/s", self._before)
