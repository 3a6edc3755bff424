"""Stick figures: a model at a state as bones, hinges and nodes, which moves to another state without redrawing."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..state import at_state
from .artists import Canvas, Discs, Labels, Lines, Points
from .colour_scale import ramp, shade
from .skeleton import Skeleton, placed, turned

VIEWS = {"3d": None, "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
_FLAT_VIEWS = {1: "xz", 2: "xy", 0: "yz"}
"""View of a plane by its normal; the first applies if there are several."""
HINGES = {
    "pin": ("o", "#0072b2"),
    "slider": ("s", "#d55e00"),
    "screw": ("D", "#e69f00"),
    "universal": ("P", "#56b4e9"),
    "gimbal": ("X", "#56b4e9"),
    "cylindrical": ("d", "#d55e00"),
    "planar": ("h", "#e69f00"),
    "ball": ("8", "#009e73"),
    "free": ("*", "#cc79a7"),
    "weld": (".", "#7f7f7f"),
    "custom": ("p", "#000000"),
}
"""Marker and colour of a hinge; both distinguish the kinds, with colours for colour-blind readers [Okabe and Ito 2008]."""
_LARGER = {"ball": 1.25, "free": 1.9, "planar": 1.2, "universal": 1.2, "gimbal": 1.2}
_BONE, _TIE, _FLOOR = "#404040", "#8c8c8c", "#d9d9d9"


class StickFigure:
    """A stick figure of a model in Matplotlib axes.

    Parameters
    ----------
    model : Multibody
    q : (nq,) or a State; default: the model's own
    ax : Axes
        In space (projection "3d") or in the plane; default: axes of a new figure.
    view : {"auto", "3d", "xy", "xz", "yz"}
        View. "auto": the plane that a flat model can never leave, space for any other model.
    com : bool
        Show the centre of mass of each body, with an area proportional to its mass, and of the model.
    names : bool
        Show the names of the hinges.
    legend : bool
        Show the meaning and the count of each marker.
    shadow : bool
        In space, show the bones' shadow on the floor of the box, which indicates depth.
    alpha : float
        Opacity, for several figures in the same axes.

    Attributes
    ----------
    ax : Axes
    artists : list
        Matplotlib artists that move with the state.
    skeleton : Skeleton
    canvas : Canvas
        For additional lines and points in the same view.

    Raises
    ------
    EvaluationError
        An unknown view; a plane's view for axes in space, or the reverse.
    ModelError
        A q of the wrong size for the model.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.view import StickFigure
    >>> arm = pc.chain(3)
    >>> figure = StickFigure(arm, [0, 0, 0])
    >>> moved = figure.update([0.1, 0.2, 0.3])  # the moved artists, for Matplotlib's animations
    """

    def __init__(
        self,
        model: Any,
        q: Any = None,
        ax: Any = None,
        *,
        view: str = "auto",
        com: bool = False,
        names: bool = False,
        legend: bool = True,
        shadow: bool = True,
        alpha: float = 1.0,
    ):
        q = self._checked(model, q)
        self.model, self.skeleton = model, Skeleton(model)
        view = self._view(view, ax)
        self.ax = _axes(view, model) if ax is None else ax
        self.canvas = Canvas(self.ax, VIEWS[view])
        self._size, self._up, self._floor = 0.0, 2, 0.0
        self._painted: Discs | None = None
        self._bar: Any = None  # of the colours
        self._grounded = self.skeleton.is_grounded()
        self._draw(com, names, shadow and view == "3d", alpha)
        self.frame(q)
        self.update(q)
        if names:
            self._spread_names()
        self._label(view)
        if ax is None:
            self.ax.set_title(model.name, fontsize="medium")
        if legend:
            self._legend(ax is None)

    @staticmethod
    def _checked(model: Any, q: Any) -> np.ndarray:
        q = at_state(model, q)[0]
        model.check_q(q)
        return np.asarray(q, float)

    def _view(self, view: Any, ax: Any) -> str:
        if not isinstance(view, str) or view not in ("auto", *VIEWS):
            raise _core.EvaluationError(f"view={view!r}: there are 'auto', {', '.join(map(repr, VIEWS))}")
        in_space = None if ax is None else ax.name == "3d"
        if view == "auto":
            flat = self.skeleton.normals() if not in_space else ()
            view = "3d" if in_space else next((_FLAT_VIEWS[n] for n in _FLAT_VIEWS if n in flat), "3d" if ax is None else "xz")
        if in_space is not None and in_space != (view == "3d"):
            raise _core.EvaluationError(f"view={view!r} in axes {'in space' if in_space else 'of a plane'}: leave one of the two out")
        return view

    # ------------------------------------------------------------------ artists
    def _draw(self, com: bool, names: bool, shadow: bool, alpha: float) -> None:
        """Create all artists, without places."""
        canvas, skeleton = self.canvas, self.skeleton
        count = max(len(skeleton.names), 1)
        size = float(np.clip(7.5 * (20 / count) ** 0.4, 2.0, 7.5))
        width = float(np.clip(3.0 * (20 / count) ** 0.4, 0.8, 3.0))
        self._shadow = canvas.lines(colors=_FLOOR, lw=width, zorder=1, alpha=alpha) if shadow else None
        self._lines: dict[str, Lines] = {
            "ground": canvas.lines(colors="k", lw=0.5 * width, linestyles=":", zorder=2, alpha=alpha),
            "tie": canvas.lines(colors=_TIE, lw=0.9, zorder=2, alpha=alpha),
            "slide": canvas.lines(colors=HINGES["slider"][1], lw=0.7 * width, linestyles=(0, (1.2, 0.8)), zorder=3, alpha=alpha),
            "bone": canvas.lines(colors=_BONE, lw=width, capstyle="round", zorder=3, alpha=alpha),
        }
        colours = [HINGES[skeleton.kinds[k]][1] for k in skeleton.axes[0]]
        self._ticks = canvas.lines(colors=colours, lw=0.55 * width, zorder=4, alpha=alpha) if colours else None
        self._joints: dict[str, tuple[Points, np.ndarray]] = {}
        for kind in dict.fromkeys(skeleton.kinds):
            marker, colour = HINGES[kind]
            own = np.array([k for k, other in enumerate(skeleton.kinds) if other == kind])
            face = colour if kind in ("weld", "free", "ball") else "white"
            style = dict(marker=marker, ms=size * _LARGER.get(kind, 1.0), mfc=face, mec=colour, mew=0.2 * size, alpha=alpha, zorder=5)
            self._joints[kind] = canvas.points(**style), own
        self._nodes = canvas.points(marker="^", ms=0.6 * size, mfc=_TIE, mec=_TIE, alpha=alpha, zorder=4)
        self._base = canvas.points(marker="s", ms=size, mfc="k", mec="k", alpha=alpha, zorder=4)
        self._masses = self._mass_markers(size, alpha) if com else None
        style = dict(fontsize=7.5, ha="left", va="top", zorder=7)
        self._texts: Labels | None = canvas.labels([f"  {name}" for name in skeleton.names], **style) if names else None
        parts = (self._shadow, *self._lines.values(), self._ticks, *(points for points, _ in self._joints.values()))
        kept = [part for part in (*parts, self._nodes, self._base, *(self._masses or [])) if part is not None]
        self.artists: list[Any] = [part.artist for part in kept] + (self._texts.artists if self._texts else [])

    def _mass_markers(self, size: float, alpha: float) -> list[Points]:
        """Create a marker for each body, with an area proportional to its mass, and one for the model."""
        style = dict(marker="o", mfc="#f0e442", mec="k", mew=0.6, alpha=alpha, zorder=6)
        largest = self.skeleton.masses.max(initial=0.0)
        each = [self.canvas.points(ms=max(1.6 * size * np.sqrt(mass / largest), 1.5), **style) for mass in self.skeleton.masses]
        return [*each, self.canvas.points(marker="P", ms=1.9 * size, mfc="#f0e442", mec="k", mew=1.0, alpha=alpha, zorder=7)]

    def update(self, q: Any = None) -> list[Any]:
        """Move the figure to q (nq,), default the model's own; return the artists. A wrong size raises ModelError. O(N · depth)."""
        poses = self._poses = self.skeleton.poses(self._checked(self.model, q))
        ends = {kind: placed(poses, *lines) for kind, lines in self.skeleton.lines.items()}
        points = {kind: placed(poses, *at) for kind, at in self.skeleton.points.items()}
        for kind, lines in self._lines.items():
            lines.set(ends[kind] if kind != "ground" or self._grounded else ends[kind][:0])
        if self._shadow is not None:
            fallen = ends["bone"].copy()
            fallen[..., self._up] = self._floor
            self._shadow.set(fallen)
        if self._ticks is not None:
            _, owner, point, direction = self.skeleton.axes
            middle, along = placed(poses, owner, point), self._size * turned(poses, owner, direction)
            self._ticks.set(np.stack([middle - along, middle + along], axis=-2))
        for part, own in self._joints.values():
            part.set(points["joint"][own])
        self._nodes.set(points["node"])
        self._base.set(self._base_points(ends["ground"]))
        if self._masses is not None:
            masses = self.skeleton.masses
            for part, place in zip(self._masses, points["mass"], strict=False):
                part.set(place[None])
            self._masses[-1].set(np.average(points["mass"], axis=0, weights=masses)[None] if len(masses) else np.empty((0, 3)))
        if self._painted is not None:
            self._painted.set(points["joint"])
        if self._texts is not None:
            self._texts.set(points["joint"])
        return self.artists

    def paint(self, values: Any, label: str, low: float = 0.0, high: float | None = None) -> None:
        """Colour the bodies by one value each, with a colour bar from `low` to `high` (default: the largest); grey means not finite."""
        numbers = _core.real_array(values, "values")
        if numbers.shape != (len(self.skeleton.bodies),):
            raise _core.EvaluationError(
                f"values {numbers.shape}: give one value per body of {self.model.name!r}, ({len(self.skeleton.bodies)},)"
            )
        high = float(np.max(numbers[np.isfinite(numbers)], initial=low)) if high is None else high
        colours = [shade(x, low, high) for x in numbers]
        owners = self.skeleton.lines["bone"][0][:, 0]
        self._lines["bone"].artist.set_color([colours[k] if k >= 0 else _BONE for k in owners])
        for part, _ in self._joints.values():
            part.artist.set_visible(False)
        if self._painted is None:
            size = 1.5 * float(self._base.artist.get_markersize())
            self._painted = self.canvas.discs(colours, size, edgecolors="k", linewidths=0.6, zorder=5)
            self.artists.append(self._painted.artist)
        self._painted.artist.set_facecolor(colours)
        self._painted.set(placed(self._poses, *self.skeleton.points["joint"]))
        self._colour_bar(label, low, high)

    def _colour_bar(self, label: str, low: float, high: float) -> None:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LinearSegmentedColormap, Normalize

        scale = ScalarMappable(Normalize(low, high), LinearSegmentedColormap.from_list("bodies", ramp()))
        if self._bar is not None:
            self._bar.remove()
        self._bar = self.ax.figure.colorbar(scale, ax=self.ax, label=label, shrink=0.7, pad=0.12 if self.canvas.columns is None else 0.03)

    def _base_points(self, ground: np.ndarray) -> np.ndarray:
        """Return the base's origin, or its hinges if they are far away; nothing if the whole model is free."""
        if not len(ground) and self.skeleton.names:
            return ground[:, 0]
        return np.zeros((1, 3)) if self._grounded else ground[:, 1]

    # ------------------------------------------------------------------ limits of the view
    def frame(self, q: Any) -> None:
        """Set the axes' limits so that the figure is in view at q, (nq,) or (n, nq): all states of a motion, before it is shown."""
        poses = self.skeleton.poses(np.asarray(q, float))
        ground = placed(poses, *self.skeleton.lines["ground"]).reshape(-1, 2, 3)
        shown = [at for kind, at in self.skeleton.lines.items() if kind != "ground"]
        places = [placed(poses, *at).reshape(-1, 3) for at in (*self.skeleton.points.values(), *shown)]
        everything = np.concatenate([*places, ground[:, 1], self._base_points(ground)])
        low, high = everything.min(axis=0), everything.max(axis=0)
        reach = (high - low).max() or 1.0
        middle, half = (low + high) / 2, np.maximum((high - low) / 2, 0.18 * reach) + 0.06 * reach
        self.canvas.frame(middle - half, middle + half)
        bones = np.linalg.norm(np.diff(placed(poses, *self.skeleton.lines["bone"]), axis=-2), axis=-1)
        typical = np.median(bones[bones > 1e-9 * reach]) if np.any(bones > 1e-9 * reach) else reach
        self._size = float(min(0.045 * reach, 0.4 * typical))
        if self.canvas.columns is None:
            self._up = int(getattr(self.ax, "_vertical_axis", 2))
            self._floor = float((self.ax.get_xlim3d, self.ax.get_ylim3d, self.ax.get_zlim3d)[self._up]()[0])

    def _label(self, view: str) -> None:
        for name, shown in zip("xyz", "xyz" if view == "3d" else view, strict=False):
            if not getattr(self.ax, f"get_{name}label")():
                getattr(self.ax, f"set_{name}label")(f"{shown} (m)", labelpad=9 if view == "3d" else None)

    def _spread_names(self) -> None:
        """Place names of coinciding hinges below each other."""
        assert self._texts is not None
        places = placed(self.skeleton.poses(np.asarray(self.model.zero_q())), *self.skeleton.points["joint"])
        seen: dict[tuple[float, ...], int] = {}
        for artist, place in zip(self._texts.artists, np.round(places / max(self._size, 1e-300)), strict=True):
            above = seen.get(tuple(place), 0)
            artist.set_text("\n" * above + artist.get_text())
            seen[tuple(place)] = above + 1

    def _legend(self, own_figure: bool) -> None:
        based = bool(len(self.skeleton.lines["ground"][0])) or not self.skeleton.names
        entries = [(self._base.artist, "base")] if based else []
        entries += [(part.artist, f"{kind} ({len(own)})") for kind, (part, own) in self._joints.items()]
        nodes = len(self.skeleton.points["node"][0])
        entries += [(self._nodes.artist, f"node ({nodes})")] if nodes else []
        entries += [(self._masses[-1].artist, "centre of mass")] if self._masses else []
        handles, texts = [artist for artist, _ in entries], [text for _, text in entries]
        if own_figure and self.canvas.columns is None:
            self.ax.figure.legend(handles, texts, frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(0.82, 0.5))
        else:
            self.ax.legend(handles, texts, frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _axes(view: str, model: Any) -> Any:
    """Return axes of a new figure; in space, the axis nearest to gravity is upright."""
    import matplotlib.pyplot as plt

    if view != "3d":
        return plt.subplots(figsize=(6.4, 4.8), layout="constrained")[1]
    figure = plt.figure(figsize=(7.2, 5.6))
    ax: Any = figure.add_axes((-0.02, 0.08, 0.83, 0.87), projection="3d", computed_zorder=False)
    ax.set_proj_type("ortho")
    gravity = np.abs(model.gravity)
    ax.view_init(elev=20, azim=-60, vertical_axis="xyz"[int(np.argmax(gravity))] if gravity.any() else "z")
    return ax


def plot_model(model: Any, q: Any = None, ax: Any = None, **options: Any) -> Any:
    """`Multibody.plot`."""
    return StickFigure(model, q, ax, **options).ax
