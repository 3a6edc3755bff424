"""Colours, and the pictures of accuracy, with labels that avoid points and each other."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import fill
from typing import Any

import numpy as np

COLOURS = {"single": "#8a8a8a", "double": "#1f4e79", "extended": "#c55a11", "quad": "#4d7c2a"}
"""Colours of precisions; others use WIDE."""
WIDE = "#6b3fa0"
MARKERS = {"fast": "o", "ud": "s", "square-root": "D"}
OTHERS = {"cholesky": "^", "ldl": "v", "conjugate-gradients": "P", "inverse": "X", "divide-and-conquer": "d", "realization": "*"}
SERIES = ("#1f4e79", "#c55a11", "#4d7c2a", "#6b3fa0", "#8a8a8a", "#a8324a", "#2a9d8f", "#b8860b")
"""Colours of series without their own colour."""
WORTH = 3.0
"""Points of a Pareto front are labelled if the error falls by this factor: smaller changes are chance."""
RING: dict[str, Any] = {"marker": "o", "ls": "", "ms": 11, "mfc": "none", "mec": "k", "mew": 0.8}
"""Marker around the points of a Pareto front."""
BELOW = 0.5
"""Errors of zero are drawn at the smallest nonzero error times this factor."""


def axes_of(ax: Any, size: tuple[float, float] = (6.4, 4.0)) -> Any:
    """Return the given axes, or new ones."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=size, layout="constrained")[1]


def above_zero(errors: Iterable[float]) -> np.ndarray:
    """Return errors for a logarithmic axis: an exact zero is placed slightly below the smallest error."""
    errors = np.asarray(list(errors), float)
    positive = errors[errors > 0]
    return np.where(errors > 0, errors, BELOW * (positive.min() if positive.size else 1e-17))


def time_axis(axis: Any) -> None:
    """Set ticks of a time axis with their units."""
    from matplotlib.ticker import FuncFormatter

    def text(seconds: float, _: int) -> str:
        for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9)):
            if seconds >= 0.9999 * size:
                return f"{seconds / size:g} {unit}"
        return ""

    axis.set_major_formatter(FuncFormatter(text))
    axis.set_minor_formatter(FuncFormatter(lambda *_: ""))


def place_labels(
    ax: Any,
    labels: list[tuple[float, float, str]],
    keep_clear: Iterable[tuple[float, float]] = (),
    markers: Iterable[tuple[float, float]] = (),
    size: float = 7.5,
) -> None:
    """Write a label beside each point (x, y, text): at the nearest place that covers neither another label nor a point.

    A label away from its point gets a line to it, which avoids the other `markers`.
    """
    figure = ax.figure
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    points = [ax.transData.transform(p) for p in [*keep_clear, *((x, y) for x, y, _ in labels)]]
    others = np.array([ax.transData.transform(p) for p in markers]).reshape(-1, 2)
    frame = ax.get_window_extent(renderer)
    taken: list[Any] = []
    pixel = figure.dpi / 72
    for x, y, text in labels:
        best = None
        at = ax.transData.transform((x, y))
        rest = others[np.hypot(*(others - at).T) > 2 * pixel]
        for dx, dy, ha, va in _places():
            note = ax.annotate(text, (x, y), (dx, dy), textcoords="offset points", ha=ha, va=va, fontsize=size)
            box = note.get_window_extent(renderer)
            inside = frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1
            padded, clear, ring = _grown(box, 2 * pixel, pixel), _grown(box, 3 * pixel, 3 * pixel), _grown(box, 6 * pixel, 6 * pixel)
            covered = 100 * sum(padded.overlaps(other) for other in taken) + sum(clear.contains(*p) for p in points)
            covered += sum(ring.contains(*p) for p in rest)
            start = np.clip(at, (box.x0, box.y0), (box.x1, box.y1))
            crossed = sum(_between(start, at, p) < 5 * pixel for p in rest)
            crossed += sum(any(other.contains(*p) for p in np.linspace(start, at, 12)) for other in taken)
            score = covered + crossed + 50 * (not inside)
            note.remove()
            if best is None or score < best[0]:
                nearer = any(np.hypot(*(np.clip(p, (box.x0, box.y0), (box.x1, box.y1)) - p)) < np.hypot(*(start - at)) for p in rest)
                best = (score, (dx, dy, ha, va), padded, nearer, start)
            if score == 0:
                break
        assert best is not None
        dx, dy, ha, va = best[1]
        far = abs(dx) + abs(dy) > 14 or best[3]
        arrow = {"arrowstyle": "-", "lw": 0.6, "color": "0.35", "shrinkA": 0, "shrinkB": 5, "relpos": (float(ha == "right"), float(dy < 0))}
        ax.annotate(text, (x, y), (dx, dy), textcoords="offset points", ha=ha, va=va, fontsize=size, arrowprops=arrow if far else None)
        taken.append(best[2])
        if far:  # later labels avoid this line
            points += list(np.linspace(best[4], at, 12))


def _grown(box: Any, across: float, up: float) -> Any:
    """Return a box with a margin."""
    from matplotlib.transforms import Bbox

    return Bbox.from_extents(box.x0 - across, box.y0 - up, box.x1 + across, box.y1 + up)


def _between(start: np.ndarray, end: np.ndarray, point: np.ndarray) -> float:
    """Return the distance of a point from the line between two others."""
    along = end - start
    share = np.clip(np.dot(point - start, along) / max(float(np.dot(along, along)), 1e-12), 0.0, 1.0)
    return float(np.hypot(*(point - start - share * along)))


def no_picture(axes: Any, table: Any) -> None:
    """Write, instead of an empty frame, that everything is refused, and why."""
    reasons = [fill(reason, 70) for reason in list(table.refusals)[:3]]
    if len(table.refusals) > 3:
        reasons.append(f"and {len(table.refusals) - 3} more reasons: see .refusals")
    axes.set_axis_off()
    axes.set_title(table.title, fontsize="medium", loc="left")
    text = "\n\n".join(["every row is refused" if len(table) else "there are no rows", *reasons])
    axes.text(0.0, 0.95, text, transform=axes.transAxes, ha="left", va="top", fontsize=8)


def _places() -> list[tuple[float, float, str, str]]:
    """Yield offsets in points with their alignment, nearest first."""
    sides = [(6, "left"), (-6, "right")]
    places = [
        (float(x * across), float(up), align, "center")
        for reach in range(9)
        for across in (1, 3, 6, 9)
        for up in (9 * reach + 8, -9 * reach - 8)
        for x, align in sides
    ]
    return sorted(places, key=lambda place: abs(place[0]) + abs(place[1]))


def accuracy_plot(table: Any, ax: Any = None) -> Any:
    """Plot error against time: colour for precision, marker for form or method, filled if refined, half filled with a wider residual or
    gather.

    The Pareto front is drawn, with rings around its points and labels at its steps.
    """
    from matplotlib.lines import Line2D

    ax = axes_of(ax)
    rows = [row for row in table if not row["refused"]]
    if not rows:
        no_picture(ax, table)
        return ax
    times, errors = np.array([row["seconds"] for row in rows]), above_zero(row["error"] for row in rows)
    for row, x, y in zip(rows, times, errors, strict=True):
        colour = COLOURS.get(row["precision"], WIDE)
        marker = MARKERS.get(row["form"]) or OTHERS.get(row["method"], "p")
        ax.plot(x, y, marker, color=colour, ms=6, mew=1.2, zorder=3, **_filling(row["refine"], row["residual"], colour))
    front = sorted(((x, y, row) for row, x, y in zip(rows, times, errors, strict=True) if row["pareto"]), key=lambda point: point[:2])
    ax.set(xscale="log", yscale="log", xlabel="time per evaluation", ylabel="relative error of the accelerations")
    low, high = errors.min(), errors.max()
    ax.set_xlim(times.min() / 1.6, times.max() * 2.2)
    ax.set_ylim(low / 10 ** (0.06 * np.log10(10 * high / low)), high * 10 ** (0.10 * np.log10(10 * high / low)))
    ax.plot([x for x, _, _ in front], [y for _, y, _ in front], **RING, zorder=4)
    ax.step([x for x, _, _ in front], [y for _, y, _ in front], where="post", color="k", lw=0.8, alpha=0.6, zorder=2)
    time_axis(ax.xaxis)
    ax.set_title(table.title, fontsize="medium")
    used: dict[str, list[Any]] = {"precision": [], "way": []}
    for precision in dict.fromkeys(row["precision"] for row in sorted(rows, key=lambda r: -_width(r["precision"]))):
        used["precision"].append(Line2D([], [], marker="o", ls="", color=COLOURS.get(precision, WIDE), label=_named(precision)))
    for name, marker in {**MARKERS, **OTHERS}.items():
        if any(name in (row["form"], row["method"]) for row in rows):
            used["way"].append(Line2D([], [], marker=marker, ls="", color="k", mfc="none", label=name))
    for residual, text in (
        ("same", "filled: refined"),
        ("gather", "left half: refined, wide gather"),
        ("wider", "half: refined, wider residual"),
    ):
        if any(row["refine"] and (row["residual"] or "same") == residual for row in rows):
            used["way"].append(Line2D([], [], marker="o", ls="", color="k", **_filling(1, residual, "k"), label=text))
    used["way"].append(Line2D([], [], **{**RING, "ls": "-", "ms": 9}, color="k", lw=0.8, alpha=0.6, label="Pareto front"))
    if len(rows) < len(table):
        used["way"].append(Line2D([], [], ls="", label=f"refused: {len(table) - len(rows)} of {len(table)}"))
    ax.legend(handles=[*used["precision"], *used["way"]], frameon=False, fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
    points = list(zip(times, errors, strict=True))
    place_labels(ax, [(x, y, _label(row)) for x, y, row in _steps(front)], [*points, *along_front(front)], points)
    return ax


def _filling(refine: Any, residual: str, colour: str) -> dict[str, Any]:
    """Return the filling of a marker: hollow unrefined, filled refined, half filled with a wider residual, left half with a wide gather."""
    if not refine:
        return {"mfc": "none"}
    half = {"gather": "left", "wider": "bottom"}.get(residual)
    return {"mfc": colour, "mfcalt": "white", "fillstyle": half} if half else {"mfc": colour}


def _steps(front: list[tuple[float, float, dict[str, Any]]]) -> list[tuple[float, float, dict[str, Any]]]:
    """Return the points of a front, fastest first, to label: where the error has fallen by WORTH since the last label."""
    named: list[tuple[float, float, dict[str, Any]]] = []
    for point in front:
        if not named or WORTH * point[1] <= named[-1][1]:
            named.append(point)
    return named


def along_front(front: list[tuple[float, float, dict[str, Any]]], count: int = 24) -> list[tuple[float, float]]:
    """Return points along the line of a front, which labels avoid."""
    points: list[tuple[float, float]] = []
    for (x, y, _), (next_x, next_y, _) in zip(front, front[1:], strict=False):
        points += [(float(t), y) for t in np.geomspace(x, next_x, count)] + [(next_x, float(e)) for e in np.geomspace(y, next_y, count)]
    return points


def _width(precision: str) -> float:
    from ..rungs import epsilon

    return epsilon(precision)


def _named(precision: str) -> str:
    from ..rungs import precision_name

    return precision_name(precision)


def _label(row: dict[str, Any]) -> str:
    return row["way"] + ("" if row["precision"] == "double" else f", {_named(row['precision'])}")


def work_precision_plot(table: Any, axes: Any = None) -> Any:
    """Plot two panels: error of the trajectory and drift of the energy against run time, one line per integrator."""
    if axes is None:
        import matplotlib.pyplot as plt

        axes = plt.subplots(1, 2, figsize=(9.0, 3.8), layout="constrained")[1]
    rows = [row for row in table if not row["refused"]]
    if not rows:
        no_picture(axes[0], table)
        axes[1].set_axis_off()
        return axes
    names = list(dict.fromkeys(row["integrator"] for row in rows))
    for ax, key, label in ((axes[0], "error", "trajectory error (rad, m; rms)"), (axes[1], "drift", "energy drift, relative")):
        for i, name in enumerate(names):
            line = [row for row in rows if row["integrator"] == name and row[key] is not None]
            if line:
                dashes = "--" if name.startswith("scipy:") else "-"
                style = dict(color=SERIES[i % len(SERIES)], marker="osD^vPX*"[i % 8], ls=dashes, ms=5, lw=1.1)
                ax.plot([row["seconds"] for row in line], above_zero(row[key] for row in line), label=name, **style)
        ax.set(xscale="log", yscale="log", xlabel="time of a run", ylabel=label)
        time_axis(ax.xaxis)
        if not any(row[key] is not None for row in rows):
            ax.set_axis_off()
            ax.text(0.5, 0.5, "energy is not conserved here", transform=ax.transAxes, ha="center", color="0.4")
    errors = [row["error"] for row in rows if row["error"]]
    if table.reference_error > 0 and errors:
        low, high = min(errors), max(errors)
        bottom = min(low, table.reference_error) / 4
        axes[0].axhspan(bottom, table.reference_error, color="0.9", zorder=0, label="below the reference's own error")
        axes[0].set_ylim(bottom, 4 * high)
    axes[0].set_title(table.title, fontsize="medium", loc="left")
    handles, labels = axes[0].get_legend_handles_labels()
    axes[1].legend(handles, labels, frameon=False, fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return axes
