"""Where the runs of a sweep go: threads, processes, a Dask cluster; one after the other the outcomes come back."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any

from .. import _core
from ..arguments import whole
from .work import Outcome, packed, run_in_thread, run_packed

SECONDS = 0.25
"""How long a handful of runs takes that goes to a worker at once: what is lost with a worker that dies is no more."""
LARGEST = 4096
PATIENCE = 20
"""Seconds for a scheduler to answer."""
WAITING = 2
"""Handfuls for each worker: one that it has and one that waits."""

Rows = list[tuple[int, Mapping[str, Any]]]


class Workers(ABC):
    """An executor of `concurrent.futures`, made anew when a death has broken it.

    Parameters
    ----------
    count : how many runs go on at a time
    """

    deadly: tuple[type[BaseException], ...] = ()
    """What a future raises when the process that had it died."""
    die_together = False
    """Whether a death takes all futures with it."""

    def __init__(self, count: int):
        self.count = count
        self.executor = self.made()

    @abstractmethod
    def made(self) -> Executor:
        """A new executor."""

    @abstractmethod
    def submit(self, work: Any, rows: Rows) -> Future:
        """The outcomes of some rows, in time."""

    def renew(self) -> None:
        """Another executor in the place of one that a death has broken."""
        self.close()
        self.executor = self.made()

    def close(self) -> None:
        """Waits for what goes on; what waits is cancelled."""
        self.executor.shutdown(wait=True, cancel_futures=True)


class Threads(Workers):
    """In this process. A run is in the core, which lets other threads run; effects, events and measures in Python take turns."""

    def made(self) -> Executor:
        return ThreadPoolExecutor(self.count, thread_name_prefix="pycraft-sweep")

    def submit(self, work: Any, rows: Rows) -> Future:
        return self.executor.submit(run_in_thread, work, rows)


class Processes(Workers):
    """On this machine, each with its own interpreter."""

    deadly = (BrokenProcessPool,)
    die_together = True

    def __init__(self, count: int, bundle: bytes):
        self._bundle = bundle
        super().__init__(count)

    def made(self) -> Executor:
        return ProcessPoolExecutor(self.count, mp_context=get_context("spawn"))  # a fork would have threads' locks and none of the threads

    def submit(self, work: Any, rows: Rows) -> Future:
        return self.executor.submit(run_packed, self._bundle, rows)


class Dask(Workers):
    """A Dask cluster: one of this machine's, the one at an address, or a client's."""

    def __init__(self, where: Any, workers: int | None, bundle: bytes):
        try:
            from dask.distributed import Client, KilledWorker, LocalCluster
        except ImportError:
            raise ImportError("on=\"dask\" needs dask and distributed: pip install 'pycraft-soa[dask]'") from None
        self._bundle = bundle
        self._owned: list[Any] = []
        self.deadly = (KilledWorker,)
        if isinstance(where, Client):
            client = where
        elif where == "dask":
            cluster = LocalCluster(n_workers=workers or cores(), threads_per_worker=1, dashboard_address=":0")
            client = Client(cluster)
            self._owned = [client, cluster]
        else:
            try:
                client = Client(where, timeout=PATIENCE)
            except (OSError, ValueError) as error:
                raise _core.EvaluationError(f"on={where!r}: no Dask scheduler answers there: {error}") from None
            self._owned = [client]
        self._client = client
        super().__init__(sum(client.nthreads().values()) or 1)

    def made(self) -> Executor:
        return self._client.get_executor(pure=False)

    def submit(self, work: Any, rows: Rows) -> Future:
        return self.executor.submit(run_packed, self._bundle, rows)

    def close(self) -> None:
        self.executor.shutdown(wait=False)  # what is left is cancelled with it
        for each in self._owned:
            each.close()


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def workers_on(on: Any, count: Any, work: Any) -> Workers:
    """Workers of a kind: "threads", "processes", "dask", an address of a scheduler ("tcp://..."), or a Dask client."""
    if count is not None and whole(count, "workers") < 1:
        raise _core.EvaluationError(f"workers={count}: there is one at least")
    if on == "threads":
        return Threads(count or cores())
    if on == "processes":
        return Processes(count or cores(), packed(work))
    if isinstance(on, str) and on != "dask" and "://" not in on:
        raise _core.EvaluationError(
            f'on={on!r}: there are "threads", "processes", "dask", and the address of a Dask scheduler ("tcp://host:8786")'
        )
    return Dask(on, count, packed(work))


def outcomes(work: Any, rows: Iterator[tuple[int, Mapping[str, Any]]], count: int, workers: Workers) -> Iterator[list[Outcome]]:
    """Outcomes as they come, some at a time, of so many rows, which are taken as workers get free.

    Where a process died, what it and its kind had is run again, one row at a time: a row whose process then dies is told of as failed,
    and no other is lost.
    """
    waiting: dict[Future, Rows] = {}
    suspects: deque[Rows] = deque()
    least = min(work.lanes, -(-count // workers.count))  # runs side by side come together, but no worker stays idle for that
    size = least
    while True:
        alone = bool(suspects) and not waiting
        if alone:
            some = suspects.popleft()
            waiting[workers.submit(work, some)] = some
        while not suspects and not alone and len(waiting) < WAITING * workers.count and (some := _next(rows, size)):
            waiting[workers.submit(work, some)] = some
        if not waiting:
            return
        done, _ = wait(waiting, return_when=FIRST_COMPLETED)
        if any(isinstance(future.exception(), workers.deadly) for future in done) and workers.die_together:
            done, _ = wait(waiting)  # the others find their pool broken, or were done before
        died: list[Rows] = []
        for future in done:
            some = waiting.pop(future)
            error = future.exception()
            if error is None:
                found = future.result()
                size = _size(found, least)
                yield found
            elif not isinstance(error, workers.deadly):
                raise error
            elif alone:
                yield [Outcome(sample, None, "its process died", 0.0) for sample, _ in some]
                died.append([])
            else:
                died.append(some)
        if died:
            if workers.die_together:
                workers.renew()
            suspects.extend([row] for some in died for row in some)


def _next(rows: Iterator[tuple[int, Mapping[str, Any]]], size: int) -> Rows:
    return [row for _, row in zip(range(size), rows, strict=False)]


def _size(found: list[Outcome], least: int) -> int:
    """As many rows as take `SECONDS`."""
    each = sum(outcome.seconds for outcome in found) / len(found)
    return max(least, min(LARGEST, 8 * len(found), int(SECONDS / max(each, 1e-9))))
