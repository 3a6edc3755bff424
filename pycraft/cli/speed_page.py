"""What `pycraft bench --peers` shows of a run: tables for the terminal, docs/performance.md, plots."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..peers.speed import BATCH, BATCH_GOALS, GOALS, Measured, Row, exponents
from .bench import Figure

CALLS = {
    "forward_dynamics": "forward dynamics",
    "inverse_dynamics": "inverse dynamics",
    "mass_matrix": "ℳ, full",
    "mass_matrix_inverse": "ℳ⁻¹, full",
    "inverse_dynamics_derivatives": "derivatives of inverse dynamics",
    "forward_dynamics_derivatives": "derivatives of forward dynamics",
}


def _time(microseconds: float | None) -> str:
    return "" if microseconds is None else f"{microseconds:.3g}"


def _ratio(ratio: float | None, goal: float | None) -> str:
    """A ratio to two digits, marked where it is below its goal."""
    if ratio is None:
        return ""
    return f"{ratio:.2g}" + (" ✗" if goal is not None and ratio < goal else "")


def cells(row: Row) -> list[str]:
    """One line of the table: model, call, times in µs, ratios."""
    kernel, python = GOALS[row.call]
    others = [_time(row.peers.get(name)) for name in ("Pinocchio", "MuJoCo")]
    return [
        row.model, str(row.nv), CALLS[row.call], _time(row.kernel), _time(row.peer_kernel), _ratio(row.ratio, kernel),
        _time(row.python), *others, _ratio(row.python_ratio, python),
    ]  # fmt: skip


HEADINGS = ["model", "nv", "call", "C++ µs", "Pinocchio", "ratio", "Python µs", "Pinocchio", "MuJoCo", "ratio"]


def batch_cells(found: Measured) -> list[list[str]]:
    """Lines of the table of batches."""
    goals = BATCH_GOALS[found.machine["instruction set"]]
    lines = []
    for row in found.batches:
        ratios = row.ratios or (None, None)
        lines.append([row.model, _time(row.double), _ratio(ratios[0], goals[0]), _time(row.single), _ratio(ratios[1], goals[1])])
    return lines


BATCH_HEADINGS = ["model", "double µs a state", "ratio", "single µs a state", "ratio"]


def _markdown(headings: list[str], lines: list[list[str]]) -> str:
    rule = ["---" if i == 0 else "---:" for i in range(len(headings))]
    return "\n".join("| " + " | ".join(line) + " |" for line in (headings, rule, *lines)) + "\n"


def page(found: Measured, accuracy: list[Figure]) -> str:
    """docs/performance.md: everything on it is measured in the run that writes it."""
    machine = "; ".join(f"{name} {value}" for name, value in found.machine.items())
    fitted = [[CALLS[call], f"{p:.2f}"] for call, p in exponents(found.rows).items()]
    costs = [[f.name, f"{f.value:.3g}", "" if f.bound is None else f"{f.bound:g}" + ("" if f.passed else " ✗"), f.note] for f in accuracy]
    return f"""# Speed

Written by `pycraft bench --peers --page docs/performance.md`; no figure here is typed by hand. Measured on:
{machine}.

Times are microseconds, the least of several medians, of one pinned core; what a ratio compares is timed in turn. *C++* is the call in
the core, its checks included; Pinocchio's is its call from Python less the same call on a model without joints. Ratios are the other
package's time over ours: above one, ours is faster; ✗ marks a goal that is missed. Every result agrees with Pinocchio's to 1e-6 in the
run that times both. ℳ is full and symmetric here, the upper triangle there. MuJoCo's forward dynamics is `mj_forward` with its constraints.

{_markdown(HEADINGS, [cells(row) for row in found.rows])}
## Batches

A state of a batch of {BATCH}, forward dynamics from Python on one core, and Pinocchio's one call in C++ over it: no peer gains from a
batch.

{_markdown(BATCH_HEADINGS, batch_cells(found))}
## How cost grows

Fitted p of time ~ Nᵖ on chains of 100 links and more. ℳ and ℳ⁻¹ have N² entries, derivatives 2N² and 3N².

{_markdown(["call", "p"], fitted)}
## What accuracy costs

Forward dynamics in every form and precision, as a ratio to the plain one in double; ✗ marks a bound that is missed. The plain form runs
kernels of its own; the others the recursions that the operators share.

{_markdown(["way", "ratio", "bound", "time and error"], costs)}
Left out: {"; ".join(found.left_out) or "nothing"}.
"""


def plot(found: Measured, path: Path) -> None:
    """Cost against the number of links, log-log, ours and Pinocchio's, with the fitted exponents of ours."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    fitted = exponents(found.rows)
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    groups: tuple[tuple[str, ...], ...] = (tuple(CALLS)[:2], tuple(CALLS)[2:])
    for ax, calls in zip(axes, groups, strict=True):
        for colour, call in enumerate(calls):
            rows = [row for row in found.rows if row.call == call and row.model.startswith("chain")]
            sizes: list[Any] = [row.nv for row in rows]
            label = CALLS[call] + (f", p = {fitted[call]:.2f}" if call in fitted else "")
            ax.loglog(sizes, [row.kernel for row in rows], "o-", color=f"C{colour}", label=label)
            theirs = [(row.nv, row.peer_kernel) for row in rows if row.peer_kernel is not None]
            ax.loglog(*zip(*theirs, strict=True), "x:", color=f"C{colour}", label=f"{CALLS[call]}, Pinocchio")
        ax.set_xlabel("links of the chain")
        ax.set_ylabel("time (µs)")
        ax.grid(True, which="major", alpha=0.3)
        ax.legend(fontsize=8)
    figure.savefig(path, dpi=130)
    plt.close(figure)
