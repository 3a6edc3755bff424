"""Pictures of the cost of scenes, of the time saved without effects, and of the cost of accuracy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..accuracy.tables.plotting import (
    COLOURS,
    MARKERS,
    RING,
    SERIES,
    WIDE,
    above_zero,
    along_front,
    axes_of,
    no_picture,
    place_labels,
    time_axis,
)
from ..tidy import seconds_text

PASS, BESIDE, OFF = "#1f4e79", "#8a8a8a", "#c55a11"
"""Colours of passes and effects that are on, of the rest of a step, and of effects that are off."""
WIDE_SPREAD = 5.0
"""Ratio of times beyond which the axis is logarithmic."""
BAR = 0.3
"""Height of a bar with its gap, inches."""


def cost_plot(table: Any, axes: Any = None) -> Any:
    """Plot two panels of bars: the parts of a step, and the cost of each effect, or the cost it would have if on."""
    parts, effects = table.of("pass", "between", "integrator"), table.of("on", "off", "works")
    if axes is None:
        import matplotlib.pyplot as plt

        heights = [max(len(parts), 1), max(len(effects), 1)]
        size = (7.0, 1.9 + BAR * sum(heights))
        axes = plt.subplots(2, 1, figsize=size, layout="constrained", height_ratios=[h + 1 for h in heights])[1]
    colours = [PASS if row["kind"] == "pass" else BESIDE for row in parts]
    names = [row["what"] + (f"  ({row['because']})" if row["because"] and row["because"] != row["what"] else "") for row in parts]
    _bars(
        axes[0],
        names,
        [row["seconds"] for row in parts],
        [table.cell("seconds", row) + f", {table.cell('share', row)}" for row in parts],
        colours,
    )
    total = table.of("step")[0]["seconds"]
    axes[0].set_title(f"{table.title}\n{seconds_text(total)} of a step per evaluation, by its parts", fontsize="medium", loc="left")
    measured = [row for row in effects if row["seconds"] is not None]
    if measured:
        texts = [", ".join(filter(None, (table.cell("seconds", row), table.cell("share", row)))) for row in measured]
        names = [row["what"] + (f"  ({row['because']})" if row["because"] else "") for row in measured]
        colours = [PASS if row["kind"] == "on" else OFF for row in measured]
        _bars(axes[1], names, [max(row["seconds"], 0.0) for row in measured], texts, colours, [row["kind"] != "on" for row in measured])
        axes[1].set_title("cost of each effect; hollow: effects that are off", fontsize="medium", loc="left")
    else:
        axes[1].set_axis_off()
        axes[1].text(0.0, 0.5, "the scene has no effects", transform=axes[1].transAxes, color="0.4")
    return axes


def _bars(ax: Any, names: Sequence[str], values: Sequence[float], texts: Sequence[str], colours: Sequence[str], hollow: Any = None) -> None:
    """Draw bars with their values beside them, the first on top."""
    from matplotlib.ticker import MaxNLocator

    hollow = hollow or [False] * len(names)
    places = np.arange(len(names))[::-1]
    faces = ["white" if empty else colour for empty, colour in zip(hollow, colours, strict=True)]
    ax.barh(places, values, color=faces, edgecolor=colours, height=0.62, lw=1.1)
    most = max(values, default=0.0) or 1e-9
    for place, value, text in zip(places, values, texts, strict=True):
        ax.text(value + 0.012 * most, place, text, va="center", fontsize=8)
    ax.set_yticks(places, names, fontsize=8)
    ax.set_xlim(0, 1.28 * most)
    ax.set_ylim(-0.6, len(names) - 0.4)
    ax.xaxis.set_major_locator(MaxNLocator(6))
    time_axis(ax.xaxis)
    ax.tick_params(axis="y", length=0)
    ax.spines[["top", "right"]].set_visible(False)


def comparison_plot(table: Any, axes: Any = None) -> Any:
    """Plot two panels: error of the trajectory against run time with the Pareto front, error of v̇ against evaluation time."""
    from matplotlib.ticker import MaxNLocator

    if axes is None:
        import matplotlib.pyplot as plt

        axes = plt.subplots(1, 2, figsize=(10.5, 4.2), layout="constrained")[1]
    rows = [row for row in table if not row["refused"]]
    if not any(row["left out"] for row in rows):
        no_picture(axes[0], table)
        axes[1].set_axis_off()
        return axes
    floor = table.own_error
    for ax, time, error, x, y in (
        (axes[0], "run", "trajectory", "time of a run", "error of the trajectory (rad, m; rms)"),
        (axes[1], "evaluation", "acceleration", "time of an evaluation", "error of the accelerations, relative"),
    ):
        errors = [max(row[error], floor) if error == "trajectory" else row[error] for row in rows]
        heights, times = above_zero(errors), np.array([row[time] for row in rows])
        for row, a, b in zip(rows, times, heights, strict=True):
            several = len(row["left out"])
            colour = "k" if not several else PASS if several == 1 else OFF
            ax.plot(a, b, "osD"[min(several, 2)], color=colour, ms=6, mew=1.2, mfc="none" if several > 1 else colour, zorder=3)
        ax.set(yscale="log", xlabel=x, ylabel=y)
        _room(ax, times, heights)
        if times.max() < WIDE_SPREAD * times.min():
            ax.xaxis.set_major_locator(MaxNLocator(6))
        time_axis(ax.xaxis)
        points = list(zip(times, heights, strict=True))
        place_labels(ax, [(*point, _left_out(row)) for row, point in zip(rows, points, strict=True)], points, points)
    front = [(row["run"], max(row["trajectory"], floor)) for row in table.front]
    if front and floor > 0:
        axes[0].plot(*zip(*front, strict=True), **RING, zorder=4)
        axes[0].step(*zip(*front, strict=True), where="post", color="k", lw=0.8, alpha=0.6, zorder=2, label="Pareto front")
        axes[0].axhspan(axes[0].get_ylim()[0], floor, color="0.9", zorder=0, label="below the run's own error")
        axes[0].legend(frameon=False, fontsize=7.5, loc="upper right")
    axes[0].set_title(f"{table.title}; labels: what is left out", fontsize="medium", loc="left")
    return axes


def _left_out(row: dict[str, Any]) -> str:
    """Return the effects left out, in the shortest form."""
    names = row["left out"]
    return "everything on" if not names else f"the {len(names)} least" if row["together"] else " + ".join(names)


def _room(ax: Any, times: np.ndarray, heights: np.ndarray) -> None:
    """Set limits of the axes that leave space for labels."""
    spread = float(np.ptp(times)) or 0.2 * float(times.max())
    if times.max() >= WIDE_SPREAD * times.min():
        ax.set(xscale="log", xlim=(times.min() / 1.6, times.max() * 2.0))
    else:
        ax.set_xlim(max(times.min() - 0.25 * spread, 0.0), times.max() + 0.45 * spread)
    decades = float(np.log10(heights.max() / heights.min())) or 1.0
    ax.set_ylim(heights.min() / 10 ** (0.15 * decades), heights.max() * 10 ** (0.25 * decades))


def scene_accuracy_plot(table: Any, ax: Any = None) -> Any:
    """Plot the error of the trajectory against run time: lines of integrators, forms and precisions, and the scene without each effect."""
    from matplotlib.lines import Line2D

    ax = axes_of(ax, (8.2, 4.8))
    rows = [row for row in table if not row["refused"]]
    if not rows:
        no_picture(ax, table)
        return ax
    errors, times = dict(zip(map(id, rows), above_zero(row["error"] for row in rows), strict=True)), [row["seconds"] for row in rows]
    handles: list[Any] = []
    for i, name in enumerate(dict.fromkeys(row["integrator"] for row in rows if row["varied"] == "integrator")):
        line = [row for row in rows if row["integrator"] == name and row["varied"] == "integrator"]
        style = dict(color=SERIES[i % len(SERIES)], marker="os^vPX"[i % 6], ms=4.5, lw=1.1)
        handles += ax.plot([row["seconds"] for row in line], [errors[id(row)] for row in line], label=name, zorder=3, **style)
    labels: list[tuple[float, float, str]] = []
    for row in rows:
        at = (row["seconds"], errors[id(row)])
        if row["varied"] == "arithmetic":
            colour = COLOURS.get(row["precision"], WIDE)
            ax.plot(*at, MARKERS.get(row["form"], "p"), color=colour, mfc=colour if row["refine"] else "none", ms=6, mew=1.2, zorder=4)
        elif row["varied"] == "effects":
            ax.plot(*at, "x", color="#a8324a", ms=7, mew=1.6, zorder=4)
            labels.append((*at, table.way(row)))
    ax.set(xscale="log", yscale="log", xlabel="time of a run", ylabel="error of the trajectory (rad, m; rms)")
    low, high = min(errors.values()), max(errors.values())
    span = np.log10(10 * high / low)
    ax.set_xlim(min(times) / 1.5, max(times) * 1.8)
    ax.set_ylim(low / 10 ** (0.05 * span), high * 10 ** (0.12 * span))
    time_axis(ax.xaxis)
    band = []
    if table.reference_error > ax.get_ylim()[0]:
        band.append(ax.axhspan(ax.get_ylim()[0], table.reference_error, color="0.9", zorder=0, label="below the reference's own error"))
    front = [(row["seconds"], errors[id(row)], row) for row in table.front]
    ax.plot([x for x, *_ in front], [y for _, y, _ in front], **RING, zorder=5)
    ax.step([x for x, *_ in front], [y for _, y, _ in front], where="post", color="k", lw=0.8, alpha=0.6, zorder=2)
    handles += [*_legend_of_points(rows, Line2D), *band]
    ax.legend(handles=handles, frameon=False, fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
    ax.set_title(table.title, fontsize="medium", loc="left")
    points = [(row["seconds"], errors[id(row)]) for row in rows]
    place_labels(ax, labels, [*points, *along_front(front)], points)
    return ax


def _legend_of_points(rows: list[dict[str, Any]], line: Any) -> list[Any]:
    """Return the legend of forms, precisions, scenes without an effect, and the front."""
    arithmetic = [row for row in rows if row["varied"] == "arithmetic"]
    handles = []
    for form in dict.fromkeys(row["form"] for row in arithmetic):
        handles.append(line([], [], marker=MARKERS.get(form, "p"), ls="", color="k", mfc="none", label=f"{form}, a fine tolerance"))
    if any(row["refine"] for row in arithmetic):
        handles.append(line([], [], marker="o", ls="", color="k", label="filled: refined"))
    for precision in dict.fromkeys(row["precision"] for row in arithmetic if row["precision"] != "double"):
        handles.append(line([], [], marker="o", ls="", color=COLOURS.get(precision, WIDE), mfc="none", label=str(precision)))
    if any(row["varied"] == "effects" for row in rows):
        handles.append(line([], [], marker="x", ls="", color="#a8324a", mew=1.6, label="without an effect"))
    return [*handles, line([], [], **{**RING, "ls": "-", "ms": 9}, color="k", lw=0.8, alpha=0.6, label="Pareto front")]


METHOD_STYLES = {"augment": ("#1f4e79", "o"), "embed": ("#c55a11", "s"), "penalty": ("#4d7c2a", "^")}
"""Colour and marker of the methods that keep loops; either one identifies the method."""


def loops_plot(table: Any, axes: Any = None) -> Any:
    """Plot three panels against run time: error of the trajectory, drift of the rows, energy error; a line per method and integrator."""
    if axes is None:
        import matplotlib.pyplot as plt

        axes = plt.subplots(1, 3, figsize=(12.5, 4.0), layout="constrained")[1]
    rows = [row for row in table if not row["refused"]]
    if not rows:
        no_picture(axes[0], table)
        for ax in axes[1:]:
            ax.set_axis_off()
        return axes
    ways = list(dict.fromkeys((row["method"], row["integrator"]) for row in rows))
    several = list(dict.fromkeys(integrator for _, integrator in ways))
    labels = {
        "error": "error of the trajectory (rad, m; rms)", "drift": "drift of the loops' rows (rad, m)",
        "energy error": "energy error, relative",
    }  # fmt: skip
    for ax, (key, label) in zip(axes, labels.items(), strict=True):
        there = [row for row in rows if row[key] is not None]
        heights = dict(zip(map(id, there), above_zero(row[key] for row in there), strict=True))
        for method, integrator in ways:
            line = [row for row in there if (row["method"], row["integrator"]) == (method, integrator)]
            colour, marker = METHOD_STYLES[method]
            place = several.index(integrator)
            style = dict(
                color=colour, marker=marker, ms=5.5, lw=1.1, mfc="white" if place else colour, ls=("-", "--", ":", "-.")[place % 4]
            )
            points = [row["seconds"] for row in line], [heights[id(row)] for row in line]
            ax.plot(*points, label=f"{method}, {integrator}", zorder=3, **style)
        ax.set(xscale="log", yscale="log", xlabel="time of a run", ylabel=label)
        time_axis(ax.xaxis)
        if not there:
            ax.set_axis_off()
            ax.text(0.5, 0.5, "nothing moves here", transform=ax.transAxes, ha="center", color="0.4")
    floor, bottom = table.reference_error, min(row["error"] for row in rows)
    if floor > 0:
        axes[0].set_ylim(bottom=min(floor, bottom or floor) / 4)
        axes[0].axhspan(axes[0].get_ylim()[0], floor, color="0.9", zorder=0, label="below the reference's own error")
    axes[0].set_title(table.title, fontsize="medium", loc="left")
    axes[2].legend(*axes[0].get_legend_handles_labels(), frameon=False, fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return axes
