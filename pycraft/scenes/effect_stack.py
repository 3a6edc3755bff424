"""A scene's effects as a stack: the share of each in an evaluation, and beside it, in the same colours, the change by each."""

from __future__ import annotations

from typing import Any

from ..accuracy.tables.plotting import above_zero, no_picture
from ..tidy import seconds_text, share_text

COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442")
"""Colours for colour-blind readers [Okabe and Ito 2008]; beyond seven they repeat, hatched, and every bar has its name."""
HATCHES = ("", "///", "...", "xxx")
_REST = "#d9d9d9"


def effect_stack(table: Any, axes: Any = None) -> Any:
    """Plot `ComparisonTable.stack`: two panels with a row per effect; the first divides one evaluation among the effects."""
    rows = [row for row in table if len(row["left out"]) == 1 and not row["together"]]
    if axes is None:
        import matplotlib.pyplot as plt

        size = (10.5, 1.7 + 0.42 * max(len(rows) + 1, 3))
        axes = plt.subplots(1, 2, figsize=size, layout="constrained", sharey=True)[1]
    if not rows:
        no_picture(axes[0], table)
        axes[1].set_axis_off()
        return axes
    _costs(axes[0], table, rows)
    _changes(axes[1], table, rows)
    names = [row["left out"][0] for row in rows]
    axes[0].set_yticks(range(len(rows) + 1), [*names, "all the rest"], fontsize=9)
    axes[0].set_ylim(len(rows) + 0.6, -0.7)
    axes[1].tick_params(axis="y", length=0)
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
    return axes


def _style(i: int) -> dict[str, Any]:
    return {"color": COLOURS[i % len(COLOURS)], "hatch": HATCHES[i // len(COLOURS) % len(HATCHES)], "edgecolor": "white", "lw": 0.8}


def _costs(ax: Any, table: Any, rows: list[dict[str, Any]]) -> None:
    """Draw bars, each beginning where the one above ends: the time saved in an evaluation without each effect, then the rest."""
    end = 0.0
    whole = next(row["evaluation"] for row in table if not row["left out"])
    for i, row in enumerate(rows):
        if row["refused"]:
            ax.text(end, i, "  refused", va="center", fontsize=8, style="italic")
            continue
        share = row["saved"] if row["saved"] >= table.noise else 0.0
        ax.barh(i, 100 * share, left=100 * end, height=0.7, **_style(i))
        text = share_text(share) if share else f"below {share_text(table.noise)}" if table.noise else "nothing"
        ax.text(100 * (end + share), i, f" {text}", va="center", fontsize=8)
        end += share
    rest = max(1.0 - end, 0.0)
    ax.barh(len(rows), 100 * rest, left=100 * end, height=0.7, color=_REST, edgecolor="white", lw=0.8)
    place = (100 * (end + rest), " ", "left") if rest < 0.5 else (100 * (end + rest / 2), "", "center")
    ax.text(place[0], len(rows), place[1] + share_text(rest), va="center", ha=place[2], fontsize=8, color="k")
    ax.set_xlim(0, 100 * max(1.0, end) * 1.14)
    ax.set_xlabel(f"share of an evaluation, {seconds_text(whole)} (%)")
    ax.set_title(f"{table.title}\ncost of each effect", fontsize="medium", loc="left")


def _changes(ax: Any, table: Any, rows: list[dict[str, Any]]) -> None:
    """Draw bars on a logarithmic axis: the error of the trajectory without each effect; hollow if below the run's own error."""
    floor = table.own_error
    there = [(i, row) for i, row in enumerate(rows) if not row["refused"]]
    errors = above_zero(max(row["trajectory"], floor) for _, row in there)
    for (i, row), error in zip(there, errors, strict=True):
        style = _style(i)
        if not row["resolved"]:
            style |= {"color": "white", "edgecolor": style["color"]}
        ax.barh(i, error, height=0.7, **style)
        ax.text(error, i, f" {table.cell('trajectory', row)};  v̇ by {table.cell('acceleration', row)}", va="center", fontsize=8)
    for i, row in enumerate(rows):
        if row["refused"]:
            ax.text(0.01, i, "does not run without it", va="center", fontsize=8, style="italic", transform=ax.get_yaxis_transform())
    low, high = (min(errors), max(errors)) if len(errors) else (1.0, 1.0)
    ax.set(xscale="log", xlim=(low / 30, high * 10 ** (1.5 + 0.6 * float(high > 100 * low))))
    ax.set_xlabel("change of the trajectory without it (rad, m; rms)")
    ax.set_title("change by each effect; hollow: less than the run's own error", fontsize="medium", loc="left")
