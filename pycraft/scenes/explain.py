"""The plan of a scene as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def plan_text(model: str, passes: Sequence[tuple[str, str, list[str]]], off: Sequence[str], how: Sequence[Any]) -> str:
    """Return the passes with the work and the reason of each; then the effects that are off."""
    form, refine, _, precision = how
    rows = [("pass", "what", "because of"), *((name, what, ", ".join(because) or "always") for name, what, because in passes)]
    widths = [max(len(row[i]) for row in rows) for i in range(2)]
    lines = [f"an evaluation of the scene of {model!r}, form {form}, refine {refine}, precision {precision}"]
    lines += [f"  {name:<{widths[0]}}  {what:<{widths[1]}}  {because}".rstrip() for name, what, because in rows]
    if off:
        lines.append(f"  off, and in no pass: {', '.join(off)}")
    return "\n".join(lines)
