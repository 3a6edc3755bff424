"""Plots of runs: coordinates with names and units, energies and their balance, forces of effects."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import _core
from .coordinate_units import POWER, coordinate_units
from .effects.effect import names_of

WHAT = ("q", "v", "vdot", "energy", "balance", "forces")
COLOURS = ("#1f4e79", "#c55a11", "#4d7c2a", "#6b3fa0", "#8a8a8a", "#a8324a", "#2a9d8f", "#b8860b")
MARKS = 60
"""Largest number of vertical lines at events."""
NAMED = 8
"""Largest number of named lines in a panel; further lines have no names."""


@dataclass
class Panel:
    """One panel: lines by name over time, and the label of its axis."""

    title: str
    axis: str
    lines: dict[str, np.ndarray] = field(default_factory=dict)


def plot(run: Any, what: tuple[str, ...], coordinates: Any) -> Any:
    """Return the figure of `Run.plot`."""
    if not what:
        what = ("q", "v", *(("energy",) if run._about["energy"] else ()), "forces")
    return _figure(run, chosen_panels(run, what, coordinates))


def chosen_panels(run: Any, what: tuple[str, ...], coordinates: Any) -> list[Panel]:
    """Return panels of a run, as for `Run.plot`. Raises EvaluationError for unknown plots, and if there is nothing to plot."""
    unknown = [name for name in what if name not in WHAT]
    if unknown:
        raise _core.EvaluationError(f"plot: no plot is called {unknown[0]!r}; there are {', '.join(map(repr, WHAT))}")
    chosen = _core.coordinates_named(run._unedited_model(), names_of(coordinates, "plot"), "plot")
    panels = [panel for name in what for panel in _panels(run, name, chosen) if panel.lines]
    if not panels:
        raise _core.EvaluationError(f"plot: this run has no data for {', '.join(map(repr, what))}")
    return panels


def _panels(run: Any, name: str, chosen: list[int]) -> list[Panel]:
    names, q_units, v_units = coordinate_units(run.model)
    if name == "q":
        wanted = {i for j in chosen for i in _in_q(run.model, j)}
        of_units = {"rad": ("angles", "rad"), "m": ("travels", "m"), "": ("quaternions", "1")}
        rows = [(names[i], q_units[i], run.q[:, i]) for i in range(len(names)) if i in wanted]
        return _by_unit(rows, of_units)
    coordinate_names = run.model.coordinate_names
    if name in ("v", "vdot"):
        per, noun = ("s", "velocities") if name == "v" else ("s²", "accelerations")
        of_units = {unit: (noun, f"{unit}/{per}") for unit in ("rad", "m")}
        return _by_unit([(coordinate_names[j], v_units[j], getattr(run, name)[:, j]) for j in chosen], of_units)
    if name == "forces":
        return [panel for effect, forces in run.forces.items() for panel in _of_effect(effect, forces, chosen, coordinate_names, v_units)]
    energy = run.energy
    if name == "balance":
        return [Panel("kinetic + potential - work, minus its first value", "J", {"balance": run.balance - run.balance[0]})]
    works = {f"work of {worker}": energy["work"][:, i] for i, worker in enumerate(run.workers)}
    return [
        Panel(
            "energies",
            "J",
            {"kinetic": energy["kinetic"], "potential": energy["potential"], **works, "kinetic + potential - work": run.balance},
        )
    ]


def _of_effect(effect: str, forces: np.ndarray, chosen: list[int], names: list[str], units: list[str]) -> list[Panel]:
    """Return panels of the coordinates on which the effect acts."""
    of_units = {unit: (f"forces of {effect}", POWER[unit]) for unit in ("rad", "m")}
    return _by_unit([(names[j], units[j], forces[:, j]) for j in chosen if forces[:, j].any()], of_units)


def _by_unit(rows: list[tuple[str, str, np.ndarray]], of_units: dict[str, tuple[str, str]]) -> list[Panel]:
    panels = {unit: Panel(*said) for unit, said in of_units.items()}
    for name, unit, values in rows:
        panels[unit].lines[name] = values
    return list(panels.values())


def _in_q(model: Any, coordinate: int) -> list[int]:
    """Return the entries of q of a coordinate's hinge; only its own entry if the hinge has as many in q as in v."""
    for hinge in model.hinges.values():
        if hinge.v_slice.start <= coordinate < hinge.v_slice.stop:
            q, v = range(hinge.q_slice.start, hinge.q_slice.stop), range(hinge.v_slice.start, hinge.v_slice.stop)
            return [q[coordinate - v.start]] if len(q) == len(v) else list(q)
    return []


def _figure(run: Any, panels: list[Panel]) -> Any:
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(len(panels), 1, sharex=True, squeeze=False, figsize=(8.5, 1.0 + 1.9 * len(panels)), layout="constrained")
    marks, thinned = event_marks(run)
    for panel, ax in zip(panels, axes[:, 0], strict=True):
        for i, (name, values) in enumerate(panel.lines.items()):
            style = ":" if "- work" in name else "-" if i < len(COLOURS) else "--"
            ax.plot(run.t, values, style, color=COLOURS[i % len(COLOURS)], lw=1.3, label=name if i < NAMED else None)
        for t in marks:
            ax.axvline(t, color="0.75", lw=0.6, zorder=0)
        more = len(panel.lines) - NAMED
        ax.set_title(panel.title + (f" (and {more} more)" if more > 0 else ""), loc="left", fontsize=9)
        ax.set_ylabel(panel.axis)
        ax.margins(x=0)
        ax.grid(alpha=0.25)
        ax.spines[["top", "right"]].set_visible(False)
        ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=7.5, frameon=False, borderaxespad=0)
    axes[-1, 0].set_xlabel("time, s")
    heading = "; ".join([f"{run.model.name}, {', '.join(run.effects) or 'no effects'}", *([thinned] if thinned else [])])
    figure.suptitle(heading, fontsize=10, x=0.01, ha="left")
    return figure


def event_marks(run: Any) -> tuple[list[float], str]:
    """Return times of the lines that mark events, s, and a note if there are more events than lines.

    More than MARKS lines would fill a plot: then only the MARKS events nearest to evenly spaced times are marked.
    """
    times = np.sort([float(t) for event in run.events.values() for t in event.t])
    if len(times) <= MARKS:
        return times.tolist(), ""
    even = np.linspace(times[0], times[-1], MARKS)
    after = np.clip(np.searchsorted(times, even), 1, len(times) - 1)
    nearest = np.where(even - times[after - 1] <= times[after] - even, after - 1, after)
    shown = times[np.unique(nearest)]
    return shown.tolist(), f"vertical lines: {len(shown)} of {len(times):,} events"
