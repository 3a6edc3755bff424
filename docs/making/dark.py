"""Figures for dark pages: backgrounds, texts, axes and dark lines are exchanged with light ones; meaningful colours are kept."""

from typing import Any

import numpy as np

GROUND, INK = "#131416", "#cfd0d0"
"""Colours of the page in dark mode."""


def darken(figure: Any) -> None:
    """Adapt a Matplotlib figure in place to a dark background: invert greys, and lighten colours that are too dark."""
    import matplotlib.collections
    import matplotlib.patches
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.lines import Line2D
    from matplotlib.text import Text

    figure.set_facecolor(GROUND)
    for axes in figure.findobj(Axes):
        axes.set_facecolor(GROUND)
        for axis in (getattr(axes, f"{name}axis", None) for name in "xyz"):
            if hasattr(axis, "pane"):  # of three dimensions
                axis.pane.set_facecolor(GROUND)
                axis.pane.set_edgecolor(INK)
                axis.line.set_color(INK)
    for text in figure.findobj(Text):
        text.set_color(turned(text.get_color()))
        if (box := text.get_bbox_patch()) is not None:
            box.set_facecolor(turned(box.get_facecolor()))
    for line in figure.findobj(Line2D):
        line.set_color(turned(line.get_color()))
        line.set_markeredgecolor(turned(line.get_markeredgecolor()))
        line.set_markerfacecolor(turned(line.get_markerfacecolor()))
    for patch in figure.findobj(matplotlib.patches.Patch):
        if patch is not figure.patch and not any(patch is axes.patch for axes in figure.findobj(Axes)):
            patch.set_edgecolor(turned(patch.get_edgecolor()))
            patch.set_facecolor(turned(patch.get_facecolor()))
    for collection in figure.findobj(matplotlib.collections.Collection):
        if collection.get_array() is None:
            for name in ("facecolor", "edgecolor"):
                colors = getattr(collection, f"get_{name}")()
                if len(colors):
                    getattr(collection, f"set_{name}")([turned(color) for color in colors])
    for axis in figure.findobj(Axis):
        axis.set_tick_params(which="both", color=INK, labelcolor=INK)


def turned(color: Any) -> Any:
    """Return a colour for a dark background: greys are inverted, dark colours are mixed with the ink, others are kept."""
    from matplotlib.colors import to_rgba

    if isinstance(color, str) and color == "none":
        return color
    rgba = np.array(to_rgba(color))
    lightness, spread = rgba[:3] @ (0.299, 0.587, 0.114), np.ptp(rgba[:3])
    ground, ink = np.array(to_rgba(GROUND)[:3]), np.array(to_rgba(INK)[:3])
    if spread < 0.08:
        rgba[:3] = ink + lightness * (ground - ink)
    elif lightness < 0.3:
        rgba[:3] = 0.55 * rgba[:3] + 0.45 * ink
    return tuple(float(x) for x in rgba)
