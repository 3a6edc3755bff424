"""Verdicts in HTML: a sign and a word in the page's own ink beside a colour bar, distinguishable without colour, on white and on black."""

from __future__ import annotations

from html import escape

BLUE, GREEN, ORANGE, RED, SKY, GREY = "#0072b2", "#009e73", "#e69f00", "#d55e00", "#56b4e9", "#999999"
"""Colours for colour-blind readers [Okabe and Ito 2008]."""
MARKS = {
    "holds": ("✓", GREEN),
    "true": ("✓", GREEN),
    "proved": ("✓", GREEN),
    "holds anyway": ("✓", SKY),
    "true where": ("◐", BLUE),
    "fails": ("✗", RED),
    "FALSE": ("✗", RED),
    "no proof found": ("?", ORANGE),
    "undecided": ("?", ORANGE),
    "undefined": ("∅", ORANGE),
    "expected to fail": ("✗", SKY),
    "waiting": ("…", GREY),
    "not said": ("…", GREY),
}
"""The sign of each verdict and its colour."""


def verdict_html(verdict: str, words: str = "") -> str:
    """Return a verdict with its sign; `words` replace the verdict's own."""
    sign, colour = MARKS[verdict]
    return f'<span style="border-left:4px solid {colour};padding-left:6px;white-space:nowrap">{sign} {escape(words or verdict)}</span>'
