"""Lines, points and labels of a picture in the plane or in space; their places can be updated without redrawing the rest."""

from __future__ import annotations

from typing import Any

import numpy as np


class Canvas:
    """Axes and the coordinates that they show: `columns` are the two coordinates of a plane, None for all three."""

    def __init__(self, ax: Any, columns: tuple[int, int] | None):
        self.ax, self.columns = ax, columns
        self._shared = bool(ax.has_data())  # with earlier drawings

    def _seen(self, places: np.ndarray) -> np.ndarray:
        return places if self.columns is None else places[..., self.columns]

    def lines(self, **style: Any) -> Lines:
        """Return an empty set of lines of one style."""
        return Lines(self, **style)

    def points(self, **style: Any) -> Points:
        """Return an empty set of markers of one style."""
        return Points(self, **style)

    def discs(self, colours: list[str], size: float, **style: Any) -> Discs:
        """Return discs with a colour each, `size` points wide."""
        return Discs(self, colours, size, **style)

    def labels(self, texts: list[str], **style: Any) -> Labels:
        """Return texts beside points."""
        return Labels(self, texts, **style)

    def frame(self, low: np.ndarray, high: np.ndarray) -> None:
        """Show the box from `low` to `high`, (3,) each, with equal scales; earlier drawings stay in view."""
        names = "xyz" if self.columns is None else "xy"
        low, high = self._seen(low), self._seen(high)
        if self._shared:
            shown = np.array([getattr(self.ax, f"get_{name}lim")() for name in names])
            low, high = np.minimum(low, shown.min(axis=1)), np.maximum(high, shown.max(axis=1))
        for name, a, b in zip(names, low, high, strict=True):
            getattr(self.ax, f"set_{name}lim")(a, b)
        if self.columns is None:
            from matplotlib.ticker import MaxNLocator

            self.ax.set_box_aspect(high - low, zoom=0.9)
            for axis, share in zip((self.ax.xaxis, self.ax.yaxis, self.ax.zaxis), (high - low) / (high - low).max(), strict=True):
                axis.set_major_locator(MaxNLocator(max(2, round(6 * share)), min_n_ticks=2))
        else:
            self.ax.set_aspect("equal", adjustable="box")


class Lines:
    """Straight lines of one style: `artist`, and `set` with the ends (n, 2, 3)."""

    def __init__(self, canvas: Canvas, **style: Any):
        from matplotlib.collections import LineCollection
        from mpl_toolkits.mplot3d.art3d import Line3DCollection

        self._canvas = canvas
        if canvas.columns is None:
            self.artist: Any = Line3DCollection(np.zeros((1, 2, 3)), **style)
            canvas.ax.add_collection3d(self.artist)
        else:
            self.artist = LineCollection([], **style)
            canvas.ax.add_collection(self.artist, autolim=False)

    def set(self, ends: np.ndarray) -> None:
        self.artist.set_segments(self._canvas._seen(ends))


class Points:
    """Markers of one style: `artist`, and `set` with the places (n, 3)."""

    def __init__(self, canvas: Canvas, **style: Any):
        self._canvas = canvas
        (self.artist,) = canvas.ax.plot(*np.empty((2 if canvas.columns else 3, 0)), linestyle="none", **style)

    def set(self, places: np.ndarray) -> None:
        columns = self._canvas._seen(places).T
        if self._canvas.columns is None:
            self.artist.set_data_3d(*columns)
        else:
            self.artist.set_data(*columns)


class Discs:
    """Discs with a colour each: `artist`, and `set` with the places (n, 3)."""

    def __init__(self, canvas: Canvas, colours: list[str], size: float, **style: Any):
        self._canvas = canvas
        at = np.zeros((2 if canvas.columns else 3, len(colours)))
        in_depth: dict[str, Any] = {} if canvas.columns else {"depthshade": False}
        self.artist = canvas.ax.scatter(*at, s=size**2, c=colours, **in_depth, **style)

    def set(self, places: np.ndarray) -> None:
        seen = self._canvas._seen(places)
        if self._canvas.columns is None:
            self.artist._offsets3d = tuple(seen.T)
        else:
            self.artist.set_offsets(seen)


class Labels:
    """A text beside each of several points: `artists`, and `set` with the places (n, 3)."""

    def __init__(self, canvas: Canvas, texts: list[str], **style: Any):
        self._canvas = canvas
        at = (0.0,) * (2 if canvas.columns else 3)
        self.artists = [canvas.ax.text(*at, text, **style) for text in texts]

    def set(self, places: np.ndarray) -> None:
        for artist, place in zip(self.artists, self._canvas._seen(places), strict=True):
            if self._canvas.columns is None:
                artist.set_position_3d(place)
            else:
                artist.set_position(place)
