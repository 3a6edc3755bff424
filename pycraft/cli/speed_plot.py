"""Cost against length, drawn by `pycraft bench --peers --plot`: one panel per call, logarithmic axes, fitted exponents."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..peers.clock import Time
from ..peers.speed import FITTED_FROM, GOALS, Measured, Row, exponents
from .speed_page import CALLS, of_call, packages

STYLES = {"Pinocchio": ("C1", "s"), "MuJoCo": ("C2", "^"), "Drake": ("C4", "v")}


def plot(found: Measured, path: Path) -> None:
    """Draw a run's chains into a file (PNG, SVG or PDF)."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, -(-(len(GOALS) + 1) // 2), figsize=(18, 7.2), layout="constrained")
    own, theirs = exponents(found.rows), exponents(found.rows, peer=True)
    for ax, call in zip(axes.flat, GOALS, strict=False):
        rows = [row for row in of_call(found, call) if row.model.startswith("chain")]
        _line(ax, rows, [row.kernel for row in rows], "ours, C++", own.get(call), color="C0", marker="o")
        _line(ax, rows, [row.peer_kernel for row in rows], "Pinocchio, C++", theirs.get(call), color="C1", marker="s")
        for name in packages(found):
            if name != "Pinocchio" and any(name in row.peers for row in rows):
                colour, marker = STYLES[name]
                _line(ax, rows, [row.peers.get(name) for row in rows], f"{name}, Python", None, color=colour, marker=marker)
        ax.set(xscale="log", yscale="log", title=CALLS[call], xlabel="links of the chain, N", ylabel="time of a call (µs)")
        _finish(ax)
    _batches(axes.flat[len(GOALS)], found)
    machine = found.machine
    where = ", ".join(machine[name] for name in ("processor", "instruction set") if name in machine)
    figure.suptitle(f"Cost against length{f' on {where}' if where else ''}; p: fitted time ~ Nᵖ from {FITTED_FROM} links on", fontsize=12)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def _line(ax: Any, rows: list[Row], times: Sequence[Time | None], label: str, exponent: float | None, **style: str) -> None:
    points = [(row.nv, time.median) for row, time in zip(rows, times, strict=True) if time is not None]
    if points:
        fitted = "" if exponent is None else f", p = {exponent:.2f}"
        ax.plot(*zip(*points, strict=True), label=label + fitted, markersize=5, linewidth=1.4, **style)


def _batches(ax: Any, found: Measured) -> None:
    """Draw the time per state of a batch, and one call for comparison."""
    chains = [row for row in found.batches if row.model.startswith("chain")]
    one = [row for row in of_call(found, "forward_dynamics") if row.model.startswith("chain") and row.nv in {c.nv for c in chains}]
    for label, sizes, times, colour, marker in (
        ("Pinocchio, one call in C++", [r.nv for r in one if r.peer_kernel], [r.peer_kernel for r in one if r.peer_kernel], "C1", "s"),
        ("ours, one call in C++", [r.nv for r in one], [r.kernel for r in one], "C0", "o"),
        ("ours, batch in double", [r.nv for r in chains], [r.double for r in chains], "C3", "D"),
        ("ours, batch in single", [r.nv for r in chains], [r.single for r in chains], "C5", "P"),
    ):
        if sizes:
            ax.plot(sizes, [time.median for time in times], label=label, color=colour, marker=marker, markersize=5, linewidth=1.4)
    ax.set(xscale="log", yscale="log", title="forward dynamics in a batch", xlabel="links of the chain, N", ylabel="time of a state (µs)")
    _finish(ax)


def _finish(ax: Any) -> None:
    ax.grid(True, which="major", alpha=0.3)
    if ax.lines:
        ax.legend(fontsize=8, loc="upper left")
