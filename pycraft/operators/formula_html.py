"""Formulas in HTML without a script: exponents and indices are raised and lowered, the rest is unchanged."""

from __future__ import annotations

import re
from html import escape

_STAR = re.compile("(?<=[^\\W\\d]|[)\\]}⁻⁺¹½]|[\u0300-\u036f])\\*")
_EXPONENT = re.compile(r"\^(-?½|-?\d+|[^\W\d_])")
_INDEX = re.compile(r"_(ff|fp|pf|pp|[^\W\d_]|\d+)(?![A-Za-z]{2})")
"""For one letter, or for the parts of a partition; not the tail of a word such as phi_tilde."""
STYLE = "font-family:'STIX Two Math','Cambria Math','DejaVu Serif',serif;font-size:1.08em;overflow-wrap:anywhere"


def formula_html(text: str) -> str:
    """Return a formula in Unicode letters as HTML, a span that wraps at the end of its line.

    Untrusted notebooks, editors without MathJax and static pages all show it the same way.

    Examples
    --------
    >>> from pycraft.operators.formula_html import formula_html
    >>> formula_html("E_φ* D⁻¹ < 1").split(">", 1)[1]
    'E<sub>φ</sub><sup>*</sup> D⁻¹ &lt; 1</span>'
    """
    shown = _STAR.sub("<sup>*</sup>", escape(text, quote=False))
    shown = _INDEX.sub(r"<sub>\1</sub>", _EXPONENT.sub(r"<sup>\1</sup>", shown))
    return f'<span style="{STYLE}">{shown}</span>'
