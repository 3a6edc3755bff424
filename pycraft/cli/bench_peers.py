"""`pycraft bench --peers`: one run beside other packages, shown as a table and written as JSON, a plot or docs/performance.md.

A separate process measures: NumPy's matrix product, which is part of a peer's call, sets its thread count when NumPy is imported, and the
process is pinned to a core, which is released with it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from json import dumps
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from .. import _core
from ..peers.peer_calls import other_packages
from ..peers.speed import BATCH, GOALS, Measured, measure
from . import speed_page
from .bench import Figure
from .bench import accuracy as costs_of_accuracy
from .terminal import console, diagnostics, note

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def _one_thread() -> Iterator[None]:
    """Provide the environment of a process with single-threaded matrix products."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _measure_and_send(sender: Any, seconds: float, quick: bool) -> None:
    """Run the measuring process: send progress, then the figures or the error."""
    try:
        found = measure(seconds, quick, lambda text: sender.send(("progress", text)))
        sender.send(("progress", "what accuracy costs"))
        sender.send(("measured", (found, costs_of_accuracy(seconds))))
    except Exception as error:  # any error: raised again in the calling process
        sender.send(("failed", error))
    finally:
        sender.close()


def measured_apart(seconds: float, quick: bool, progress: Callable[[str], None]) -> tuple[Measured, list[Figure]]:
    """Return calls beside other packages' and the cost of accuracy, measured in a separate process on one core."""
    context = get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_measure_and_send, args=(sender, seconds, quick), daemon=True)
    with _one_thread():
        process.start()
    sender.close()
    try:
        while True:
            what, value = receiver.recv()
            if what == "measured":
                return value
            if what == "failed":
                raise value
            progress(value)
    except EOFError:
        process.join()
        raise _core.EvaluationError(f"the process that measures ended with status {process.exitcode} before it was done") from None
    finally:
        process.terminate()
        process.join()


def show(found: Measured, costs: list[Figure]) -> None:
    """Show the run on the terminal."""
    head, others = speed_page.headings(found), speed_page.packages(found)
    table = Table(title="Microseconds a call; ratio: the other package's time over ours, ✓ meets its goal, ✗ misses it", box=None)
    for i, heading in enumerate(head):
        table.add_column(heading, justify="left" if i == 0 else "right")
    for call in GOALS:
        table.add_row(f"[bold]{speed_page.CALLS[call]}[/]")
        for row in speed_page.of_call(found, call):
            table.add_row(*(escape(cell) for cell in speed_page.cells(row, others)))
    _print(table)
    for title, headings, lines in (
        ("Goals", speed_page.GOAL_HEADINGS, speed_page.goals(found)),
        (
            f"Forward dynamics of {BATCH} states, microseconds a state; ratio: one call of Pinocchio's in C++ over it",
            speed_page.BATCH_HEADINGS,
            speed_page.batch_cells(found),
        ),
        ("How cost grows with the length N of a chain: p of time ~ Nᵖ", ["call", "p, ours", "p, Pinocchio"], speed_page.fitted(found)),
        ("What accuracy costs", speed_page.COST_HEADINGS, speed_page.cost_cells(costs)),
    ):
        table = Table(title=title, box=None)
        for i, heading in enumerate(headings):
            table.add_column(heading, justify="left" if i == 0 else "right")
        for line in lines:
            table.add_row(*(escape(cell) for cell in line))
        _print(table)
    for text in found.left_out:
        console.print(f"left out: {text}", markup=False, highlight=False)


def _print(table: Table) -> None:
    table.title_justify, table.header_style = "left", "bold"
    console.print(table)


def bench_peers(seconds: float, quick: bool, json: Path | None, plot: Path | None, page: Path | None) -> None:
    """Measure, show and write. MissingPackageError, before any measurement, if Pinocchio is not installed."""
    other_packages(lambda text: None)
    with diagnostics.status("measuring") as status:
        found, costs = measured_apart(seconds, quick, lambda text: status.update(escape(f"measuring {text}")))
    show(found, costs)
    if json:
        data = {**found.as_json(), "accuracy": [{**asdict(f), "passed": f.passed} for f in costs]}
        json.write_text(dumps(data, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    if plot:
        from .speed_plot import plot as draw

        draw(found, plot)
    if page:
        page.write_text(speed_page.page(found, costs), encoding="utf-8")
    for path in (json, plot, page):
        if path:
            note(f"wrote {path}")
