"""The clock for timing beside other packages: one core, a warm-up, several rounds in turn, minimum and median."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from .. import _core

Clock: TypeAlias = Callable[[float], Mapping[str, float]]
"""Times a call for that many seconds: seconds per call, "minimum" and "median"."""


class Time(NamedTuple):
    """Time of one call, microseconds: the least of all, and the least median of several rounds."""

    minimum: float
    median: float

    def less(self, microseconds: float) -> Time:
        """Return the time minus microseconds that are not the call's own; never below a nanosecond."""
        return Time(*(max(t - microseconds, 1e-3) for t in self))

    def shared(self, count: int) -> Time:
        """Return the time of one of `count` calls that were timed together."""
        return Time(self.minimum / count, self.median / count)


def elapsed(f: Callable[[], Any], seconds: float) -> dict[str, float]:
    """Return seconds per call from Python: groups of calls that are long enough for the clock, after two calls to warm up."""
    f()
    begin = time.perf_counter()
    f()
    count = max(1, int(2e-4 / max(time.perf_counter() - begin, 1e-8)))
    groups: list[float] = []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or not groups:
        begin = time.perf_counter()
        for _ in range(count):
            f()
        groups.append((time.perf_counter() - begin) / count)
    return {"minimum": min(groups), "median": float(np.median(groups))}


def in_turn(seconds: float, *clocks: Clock, rounds: int = 20) -> list[Time]:
    """Time several calls, one after the other for many short rounds: a machine's speed changes from one moment to the next."""
    found = [[clock(seconds / rounds) for clock in clocks] for _ in range(rounds)]
    of_each = zip(*found, strict=True)
    return [Time(*(1e6 * min(t[which] for t in times) for which in ("minimum", "median"))) for times in of_each]


def pin_to_one_core() -> str:
    """Pin this process to one of its cores, if the system permits; return the result in words."""
    if not hasattr(os, "sched_setaffinity"):
        return "not pinned: the system has no way to"
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    return "one, pinned"


def machine() -> dict[str, str]:
    """Return the machine of the measurement: processor, its instruction set here, versions."""
    model = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as info:
            model = next((line.split(":", 1)[1].strip() for line in info if line.startswith("model name")), model)
    except OSError:
        pass
    return {
        "processor": model,
        "instruction set": _core.instruction_set(),
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
        "NumPy": np.__version__,
    }
