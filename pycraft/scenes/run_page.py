"""Runs as self-contained pages: the figure drawn in the browser from the bodies' poses, a time slider, and plots."""

from __future__ import annotations

from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..file_targets import writable_target
from ..models.limits import coordinate_limits
from ..view.figure_data import figure_data, number_text, pose_rows
from ..view.page import Page
from ..view.skeleton import Skeleton
from ..view.web_page import notes, web_page
from .crossed_limits import SLACK, crossed_names
from .run_animation import configurations, positive
from .run_plots import chosen_panels, event_marks

LARGEST = 100.0
"""Largest size of the poses in one page, MB."""
POINTS = 1000
"""Largest number of points of a line in a plot; of more times, every nth is shown."""
FAR = 3.0
"""The camera initially follows a free model that moves farther than this many times its size."""
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5, 10)


class RunPage(Page):
    """A run as a page of HTML. In a notebook it shows itself; `save` writes it.

    Attributes
    ----------
    times : (n,) s, times of the frames
    html : str, the page
    """

    def __init__(self, run: Any, fps: Any, speed: Any, trace: str | None, what: tuple[str, ...], coordinates: Any):
        rate, self.speed = positive(fps, "fps"), positive(speed, "speed")
        self._run = run
        self.times = frame_times(run, rate / self.speed)
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
        marks, thinned = event_marks(run)
        figure = figure_data(self._skeleton, self._q)
        data: dict[str, Any] = {
            "figure": figure, "times": number_text(self.times),
            "poses": number_text(pose_rows(self._skeleton, self._q)), "panels": panels,
            "way": None if self._way is None else number_text(self._way),
            "marks": marks, "beyond": self._beyond(), "follow": self._follow(figure),
        }  # fmt: skip
        speeds = "".join(
            f'<option value="{speed:g}"{" selected" if speed == self.speed else ""}>×{speed:g}</option>'
            for speed in sorted({*SPEEDS, self.speed})
        )
        crossed = self._crossed()
        told = [f"{', '.join(run.effects) or 'no effects'}; {first:g} to {last:g} s", *([thinned] if thinned else [])]
        texts = {"said": escape("; ".join(told)), "speeds": speeds, "notes": notes(data["figure"]["unshown"]), "crossed": crossed}
        return web_page("film", run.model.name, data, texts)

    def _follow(self, figure: dict[str, Any]) -> str:
        """Return the initial target of the camera: a free model that moves far beyond its own size; else nothing."""
        return "robot" if self._skeleton.is_loose() and max(figure["half"]) > FAR * max(figure["near"]) else ""

    def _beyond(self) -> list[dict[str, Any]]:
        """Return for each coordinate beyond a limit that no effect holds: its body, and the first and last frame of each violation."""
        model, found = self._run.model, []
        owners = {j: k for k, hinge in enumerate(model.hinges.values()) for j in range(hinge.v_slice.start, hinge.v_slice.stop)}
        q_index = coordinate_limits(model).q_index
        for one in self._crossed_limits():
            j = model.coordinate_names.index(one.coordinate)
            value = self._q[:, q_index[j]]
            slack = SLACK * max(1.0, abs(one.limit))
            beyond = value > one.limit + slack if one.upper else value < one.limit - slack
            edges = np.flatnonzero(np.diff(np.concatenate([[False], beyond, [False]]).astype(int))).reshape(-1, 2)
            found.append({"body": owners[j], "spans": [[int(first), int(last) - 1] for first, last in edges]})
        return found

    def _crossed_limits(self) -> list[Any]:
        return [] if self._run._edited else self._run.crossed_limits

    def _crossed(self) -> str:
        """Return the coordinates beyond their limits, for the heading; "" if there are none."""
        crossed = self._crossed_limits()
        if not crossed:
            return ""
        every = "; ".join(str(one) for one in crossed)
        return f'<span class="crossed" title="{escape(every)}">beyond limits: {escape(crossed_names(crossed))}</span>'

    def save(self, path: str | Path) -> Path:
        """Write the page to a path that ends in ".html". Raises EvaluationError for another ending, OSError if it cannot be written."""
        target = checked_page(path)
        target.write_text(self.html, encoding="utf-8")
        return target

    def __repr__(self) -> str:
        times = f"{len(self.times)} frames, {self.times[0]:g} to {self.times[-1]:g} s"
        return f"<page of {self._run.model.name!r}: {times}, {len(self.html.encode()) / 1e3:.0f} kB>"


def checked_page(path: Any) -> Path:
    """Check that a page can be written to a path."""
    return writable_target(path, (".html",), "a page")


def frame_times(run: Any, rate: float) -> np.ndarray:
    """Return times of frames, `rate` per second of the run, from its first to its last time, both included."""
    first, last = float(run.t[0]), float(run.t[-1])
    count = (last - first) * rate
    size = count * max(run.model._size, 1) * 64 / 1e6
    if size > LARGEST:
        raise _core.EvaluationError(
            f"{last - first:g} s in {count:.3g} frames of {run.model._size} bodies are {size:.3g} MB of poses; a page holds at most "
            f"{LARGEST:g} MB: use a lower fps, or speed={size / LARGEST:.2g} times the present one"
        )
    whole = int(np.floor(count * (1 + 1e-12)))
    times = first + np.arange(whole + 1) / rate
    return np.append(times, last) if times[-1] < last - 1e-6 / rate else np.minimum(times, last)


def _offered(run: Any, what: tuple[str, ...]) -> list[Any]:
    """Return the default plots; none for a model without coordinates."""
    return chosen_panels(run, what, None) if run.model.nv else []
