"""Runs as pages that play by themselves: the figure drawn in the browser from the bodies' poses, a slider of time, and plots."""

from __future__ import annotations

from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..file_targets import writable_target
from ..view.figure_data import figure_data, number_text, pose_rows
from ..view.page import Page
from ..view.skeleton import Skeleton
from ..view.web_page import web_page
from .run_animation import configurations, positive
from .run_plots import chosen_panels

LARGEST = 100.0
"""MB of poses in one page."""
POINTS = 1000
"""Of a line of a plot: of more of the run's own times, so many are shown, evenly by their number."""
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5, 10)


class RunPage(Page):
    """A run as a page of HTML. In a notebook it shows itself; `save` writes it.

    Attributes
    ----------
    times : (n,) s, of the frames
    html : str, the page
    """

    def __init__(self, run: Any, fps: Any, speed: Any, trace: str | None, what: tuple[str, ...], coordinates: Any):
        rate, self.speed = positive(fps, "fps"), positive(speed, "speed")
        self._run = run
        self.times = _times(run, rate / self.speed)
        self._q = configurations(run, self.times)
        self._skeleton = Skeleton(run._unedited_model())
        self._way = None if trace is None else run.model.pose(trace, self._q)[:, :3, 3]
        kept = ("energy",) if run._about["energy"] else ("q",)
        self._panels = chosen_panels(run, what or kept, coordinates) if what or coordinates is not None else _offered(run, kept)

    @cached_property
    def html(self) -> str:
        run, first, last = self._run, self.times[0], self.times[-1]
        shown = np.unique(np.linspace(0, len(run.t) - 1, POINTS).round().astype(int))
        panels = [
            {"title": panel.title, "axis": panel.axis, "names": list(panel.lines), "t": number_text(run.t[shown]),
             "lines": [number_text(values[shown]) for values in panel.lines.values()]}
            for panel in self._panels
        ]  # fmt: skip
        data: dict[str, Any] = {
            "figure": figure_data(self._skeleton, self._q), "times": number_text(self.times),
            "poses": number_text(pose_rows(self._skeleton, self._q)), "panels": panels,
            "way": None if self._way is None else number_text(self._way),
            "marks": [float(t) for event in run.events.values() for t in event.t],
        }  # fmt: skip
        speeds = "".join(
            f'<option value="{speed:g}"{" selected" if speed == self.speed else ""}>×{speed:g}</option>'
            for speed in sorted({*SPEEDS, self.speed})
        )
        told = [f"{', '.join(run.effects) or 'no effects'}; {first:g} to {last:g} s", *data["figure"]["unshown"]]
        said = escape("; ".join(told))
        return web_page("film", run.model.name, data, {"said": said, "speeds": speeds})

    def save(self, path: str | Path) -> Path:
        """Write it to a path that ends in ".html". EvaluationError for another ending, OSError where it cannot be written."""
        target = checked_page(path)
        target.write_text(self.html, encoding="utf-8")
        return target

    def __repr__(self) -> str:
        times = f"{len(self.times)} frames, {self.times[0]:g} to {self.times[-1]:g} s"
        return f"<page of {self._run.model.name!r}: {times}, {len(self.html.encode()) / 1e3:.0f} kB>"


def checked_page(path: Any) -> Path:
    """A path that a page can be written to."""
    return writable_target(path, (".html",), "a page")


def _times(run: Any, rate: float) -> np.ndarray:
    """Times of frames, `rate` a second of the run: from its first to its last, which is one."""
    first, last = float(run.t[0]), float(run.t[-1])
    count = (last - first) * rate
    size = count * max(run.model._size, 1) * 64 / 1e6
    if size > LARGEST:
        raise _core.EvaluationError(
            f"{last - first:g} s in {count:.3g} frames of {run.model._size} bodies are {size:.3g} MB of poses, and {LARGEST:g} at most go "
            f"into a page; a lower fps, or speed={size / LARGEST:.2g} times what it is, shows the same in less"
        )
    whole = int(np.floor(count * (1 + 1e-12)))
    times = first + np.arange(whole + 1) / rate
    return np.append(times, last) if times[-1] < last - 1e-6 / rate else np.minimum(times, last)


def _offered(run: Any, what: tuple[str, ...]) -> list[Any]:
    """What is shown where nothing was asked for; nothing of a model without coordinates."""
    return chosen_panels(run, what, None) if run.model.nv else []
