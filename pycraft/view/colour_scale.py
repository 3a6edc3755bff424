"""Colours of values: one scale from dark to light, suited to colour-blind readers, legible on light and on dark pages."""

from __future__ import annotations

from functools import cache
from html import escape

import numpy as np

STOPS = 9
_DARKEST, _LIGHTEST = 0.12, 0.9  # of viridis: both ends differ from white and from black


@cache
def ramp() -> tuple[str, ...]:
    """Nine colours of Matplotlib's viridis, "#rrggbb"; colours between them are interpolated."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return tuple(to_hex(colormaps["viridis"](x)) for x in np.linspace(_DARKEST, _LIGHTEST, STOPS))


def shade(value: float, low: float, high: float) -> str:
    """Return the colour of a value between `low` and `high`, "#rrggbb"; grey if it is not finite."""
    if not np.isfinite(value):
        return "#9a9a9a"
    share = (value - low) / (high - low) if high > low else 0.0
    place = float(np.clip(share, 0, 1)) * (STOPS - 1)
    k = min(int(place), STOPS - 2)
    ends = [np.array([int(stop[i : i + 2], 16) for i in (1, 3, 5)]) for stop in ramp()[k : k + 2]]
    mixed = ends[0] + (place - k) * (ends[1] - ends[0])
    return "#" + "".join(f"{round(x):02x}" for x in mixed)


def colour_bar(x: float, y: float, width: float, low: float, high: float, label: str) -> str:
    """Return the scale in SVG: a strip 10 high, with the label above and the end values below, down to y + 28."""
    steps = 48
    size = f"y='{y:g}' width='{width / steps + 0.3:.2f}' height='10'"
    parts = [f"<rect x='{x + width * i / steps:.2f}' {size} fill='{shade(i / (steps - 1), 0, 1)}'/>" for i in range(steps)]
    parts += [
        f"<text x='{x + share * width:g}' y='{y + 24:g}' text-anchor='{anchor}'>{number:.3g}</text>"
        for share, anchor, number in ((0, "start", low), (0.5, "middle", (low + high) / 2), (1, "end", high))
    ]
    return f"<text x='{x:g}' y='{y - 6:g}'>{escape(label)}</text>{''.join(parts)}"
