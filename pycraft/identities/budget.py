"""Time limit of a search in CPU seconds, so that it does the same work on a loaded machine."""

from __future__ import annotations

import time


class Budget:
    """CPU seconds of this process, from now on."""

    def __init__(self, seconds: float):
        self.seconds = seconds
        self._end = time.process_time() + seconds

    @property
    def left(self) -> float:
        return max(0.0, self._end - time.process_time())

    @property
    def over(self) -> bool:
        return time.process_time() >= self._end
