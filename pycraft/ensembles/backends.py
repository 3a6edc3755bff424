"""Backends of a sweep: runs go to threads, processes or a Dask cluster, and their outcomes come back one after another."""

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
"""Target duration, s, of the batch of runs sent to a worker at once; a worker that dies loses no more than one batch."""
LARGEST = 4096
PATIENCE = 20
"""Seconds to wait for a scheduler's answer."""
WAITING = 2
"""Batches for each worker: one running and one waiting."""

Rows = list[tuple[int, Mapping[str, Any]]]


class Workers(ABC):
    """An executor of `concurrent.futures`, replaced when a process that dies has broken it.

    Parameters
    ----------
    count : number of runs at a time
    """

    deadly: tuple[type[BaseException], ...] = ()
    """Exceptions that a future raises when its process has died."""
    die_together = False
    """True where one dead process breaks all futures."""

    def __init__(self, count: int):
        self.count = count
        self.executor = self.made()

    @abstractmethod
    def made(self) -> Executor:
        """Return a new executor."""

    @abstractmethod
    def submit(self, work: Any, rows: Rows) -> Future:
        """Submit some rows; return the future of their outcomes."""

    def renew(self) -> None:
        """Replace an executor that a dead process has broken."""
        self.close()
        self.executor = self.made()

    def close(self) -> None:
        """Wait for the running batches and cancel the waiting ones."""
        self.executor.shutdown(wait=True, cancel_futures=True)


class Threads(Workers):
    """Threads of this process. The core runs without the GIL; effects, events and measures in Python take turns."""

    def made(self) -> Executor:
        return ThreadPoolExecutor(self.count, thread_name_prefix="pycraft-sweep")

    def submit(self, work: Any, rows: Rows) -> Future:
        return self.executor.submit(run_in_thread, work, rows)


class Processes(Workers):
    """Processes on this machine, each with its own interpreter."""

    deadly = (BrokenProcessPool,)
    die_together = True

    def __init__(self, count: int, bundle: bytes):
        self._bundle = bundle
        super().__init__(count)

    def made(self) -> Executor:
        return ProcessPoolExecutor(self.count, mp_context=get_context("spawn"))  # a fork would copy the threads' locks without the threads

    def submit(self, work: Any, rows: Rows) -> Future:
        return self.executor.submit(run_packed, self._bundle, rows)


class Dask(Workers):
    """A Dask cluster: a local one, the one at an address, or the cluster of a client."""

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
                raise _core.EvaluationError(f"on={where!r}: no Dask scheduler answers at this address: {error}") from None
            self._owned = [client]
        self._client = client
        super().__init__(sum(client.nthreads().values()) or 1)

    def made(self) -> Executor:
        return self._client.get_executor(pure=False)

    def submit(self, work: Any, rows: Rows) -> Future:
        return self.executor.submit(run_packed, self._bundle, rows)

    def close(self) -> None:
        self.executor.shutdown(wait=False)  # this cancels the remaining futures
        for each in self._owned:
            each.close()


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def workers_on(on: Any, count: Any, work: Any) -> Workers:
    """Return workers of a kind: "threads", "processes", "dask", a scheduler's address ("tcp://..."), or a Dask client."""
    if count is not None and whole(count, "workers") < 1:
        raise _core.EvaluationError(f"workers={count}: at least one worker is needed")
    if on == "threads":
        return Threads(count or cores())
    if on == "processes":
        return Processes(count or cores(), packed(work))
    if isinstance(on, str) and on != "dask" and "://" not in on:
        raise _core.EvaluationError(
            f'on={on!r}: choose "threads", "processes", "dask", or the address of a Dask scheduler ("tcp://host:8786")'
        )
    return Dask(on, count, packed(work))


def outcomes(work: Any, rows: Iterator[tuple[int, Mapping[str, Any]]], count: int, workers: Workers) -> Iterator[list[Outcome]]:
    """Yield the outcomes of `count` rows in batches, as they finish; rows are sent out as workers become free.

    After a process has died, the rows of the broken batches are run again one at a time. A row whose process dies again is reported as
    failed; no other row is lost.
    """
    waiting: dict[Future, Rows] = {}
    suspects: deque[Rows] = deque()
    least = min(work.lanes, -(-count // workers.count))  # full packs where possible, but no worker stays idle for them
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
            done, _ = wait(waiting)  # the others raise the same error, or have finished
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
                yield [Outcome(sample, None, "the worker process died", 0.0) for sample, _ in some]
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
    """Return the number of rows that take about `SECONDS`."""
    each = sum(outcome.seconds for outcome in found) / len(found)
    return max(least, min(LARGEST, 8 * len(found), int(SECONDS / max(each, 1e-9))))
