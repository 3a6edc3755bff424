"""Runs as moving stick figures, with only Matplotlib: shown in a notebook, or written as a web page, a GIF or a film."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..arguments import one_number
from ..file_targets import writable_target
from ..view import StickFigure

ENDINGS = (".html", ".gif", ".mp4")
MOST = 2000
"""Largest number of frames: at a tenth of a second each, three minutes of drawing."""
LARGEST = 200.0
"""Largest size of the frames in one page, MB."""


class RunAnimation:
    """A run as a film. In a notebook it shows itself, with buttons to play it; `save` writes it.

    Attributes
    ----------
    times : (n,) s, times of the frames
    figure : Matplotlib's figure
    """

    def __init__(self, run: Any, fps: Any, speed: Any, trace: Any, options: dict[str, Any]):
        rate, faster = positive(fps, "fps"), positive(speed, "speed")
        self.fps = rate
        self.times = _frames(run, rate, faster)
        self._q = configurations(run, self.times)
        self._path = None if trace is None else run._unedited_model().pose(trace, self._q)[:, :3, 3]
        self._draw(run, options)

    def _draw(self, run: Any, options: dict[str, Any]) -> None:
        from matplotlib import pyplot

        self._stick = StickFigure(run._unedited_model(), self._q[0], **options)
        self.figure = self._stick.ax.figure
        self._stick.frame(self._q)
        self._way = None
        if self._path is not None:
            self._way = self._stick.canvas.lines(colors="#0072b2", lw=1.0, zorder=2, alpha=0.7)
        self._show(0)
        if options.get("ax") is None:
            pyplot.close(self.figure)  # otherwise notebooks would also show its first frame

    def _show(self, frame: int) -> list[Any]:
        moved = list(self._stick.update(self._q[frame]))
        self._stick.ax.set_title(f"{self._stick.model.name}, t = {self.times[frame]:.2f} s", fontsize="medium")
        if self._way is not None and self._path is not None:
            gone = self._path[: frame + 1]
            self._way.set(np.stack([gone[:-1], gone[1:]], axis=1))
            moved.append(self._way.artist)
        return moved

    @cached_property
    def animation(self) -> Any:
        """Matplotlib's `FuncAnimation`, for its other output formats."""
        from matplotlib.animation import FuncAnimation

        return FuncAnimation(self.figure, self._show, frames=len(self.times), interval=1000 / self.fps, blit=False, repeat=True)

    def save(self, path: str | Path) -> Path:
        """Write the animation, by the path's ending: ".html", a page that plays in any browser; ".gif"; ".mp4" if ffmpeg is installed.

        Raises
        ------
        EvaluationError
            Another ending; ".mp4" without ffmpeg.
        OSError
            A path that cannot be written.
        """
        target = checked_film(path)
        if target.suffix == ".html":
            title = _plain(self._stick.model.name)
            head = f"<!DOCTYPE html>\n<meta charset='utf-8'>\n<title>{title}</title>\n"
            target.write_text(head + self._page, encoding="utf-8")
        else:
            from matplotlib.animation import FFMpegWriter, PillowWriter

            fps: Any = self.fps  # fractions work, though its types allow only whole numbers
            self.animation.save(str(target), writer=(PillowWriter if target.suffix == ".gif" else FFMpegWriter)(fps=fps))
        return target

    @cached_property
    def _page(self) -> str:
        from matplotlib import rc_context

        with rc_context({"animation.embed_limit": LARGEST}):
            fps: Any = self.fps  # as above
            return self.animation.to_jshtml(fps=fps)

    def _repr_html_(self) -> str:
        return self._page

    def __repr__(self) -> str:
        return f"<animation of {self._stick.model.name!r}: {len(self.times)} frames, {self.times[0]:g} to {self.times[-1]:g} s>"


def checked_film(path: Any) -> Path:
    """Check, before a frame is drawn, that a film can be written to a path."""
    target = writable_target(path, ENDINGS, "a film")
    if target.suffix == ".mp4":
        from matplotlib.animation import FFMpegWriter

        if not FFMpegWriter.isAvailable():
            raise _core.EvaluationError(
                f"output {str(path)!r}: '.mp4' needs ffmpeg, which is not installed; '.html' and '.gif' need nothing"
            )
    return target


def positive(given: Any, name: str) -> float:
    """Return a positive number. Raises EvaluationError for any other."""
    value = one_number(given, name)
    if not 0 < value < np.inf:
        raise _core.EvaluationError(f"{name}={value:g}: give a positive number")
    return value


def _frames(run: Any, fps: float, speed: float) -> np.ndarray:
    """Return times of frames, from the run's first to its last."""
    first, last = float(run.t[0]), float(run.t[-1])
    count = int(np.floor((last - first) * fps / speed * (1 + 1e-12))) + 1
    if count > MOST:
        raise _core.EvaluationError(
            f"{last - first:g} s at fps={fps:g} and speed={speed:g} are {count} frames; at most {MOST} can be drawn; "
            f"use speed={speed * count / MOST:.2g} or more"
        )
    times = first + np.arange(count) * (speed / fps)
    return np.minimum(times, last)


def configurations(run: Any, times: np.ndarray) -> np.ndarray:
    """Return q (n, nq) at the times; for a run that kept no steps, at the last requested time before each."""
    if run._steps is not None:
        return run.at(times).q
    return run.q[np.searchsorted(run.t, times, side="right") - 1]


def _plain(name: str) -> str:
    from html import escape

    return escape(name)
