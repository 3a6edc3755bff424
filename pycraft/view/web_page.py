"""Self-contained pages: they send no requests, and their content policy forbids any except to their own server."""

from __future__ import annotations

import json
from functools import cache
from html import escape
from pathlib import Path
from string import Template
from typing import Any

WEB = Path(__file__).parent / "web"


def web_page(name: str, title: str, data: dict[str, Any], texts: dict[str, str], *, asks: bool = False) -> str:
    """Return a page made from `web/NAME.html` and `web/NAME.js`, with styles, scripts and data inside.

    Parameters
    ----------
    name : name of the page: "film" of a run, "viewer", "switches" of hypotheses, "bases" of a motion, "kalman"
    title : shown in the page and its tab
    data : plain data, for the script
    texts : HTML by placeholder name
    asks : True lets the page send requests to its own server; otherwise it can send none

    Examples
    --------
    >>> from pycraft.view.web_page import web_page
    >>> texts = dict.fromkeys(("said", "speeds", "notes", "crossed"), "")
    >>> "<script>" in web_page("film", "a < b", {"key": "</script>"}, texts).split("</script>")[0]
    False
    """
    own = "'self'" if asks else "'none'"
    policy = f"default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; connect-src {own}"
    body = Template(_text(f"{name}.html")).substitute({"title": escape(title), **texts})
    held = json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
    scripts = "\n".join(_text(f"{script}.js") for script in ("theme", "figure", "camera", "plots", name)).replace('"use strict";\n', "")
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        f'<meta name="viewport" content="width=device-width">\n<link rel="icon" href="data:,">\n<title>{escape(title)}</title>\n'
        f'<style>\n{_text("style.css")}</style>\n</head>\n<body>\n{body}<script type="application/json" id="data">{held}</script>\n'
        f'<script>\n"use strict";\n{scripts}</script>\n</body>\n</html>\n'
    )


def notes(unshown: list[str]) -> str:
    """Return why shapes are not shown, as a line that opens; "" if all are shown."""
    if not unshown:
        return ""
    lines = "".join(f"<li>{escape(line)}</li>" for line in unshown)
    what = "1 shape is not shown" if len(unshown) == 1 else f"{len(unshown)} shapes are not shown"
    return f'<details class="notes"><summary>{what} (why?)</summary><ul>{lines}</ul></details>'


@cache
def _text(name: str) -> str:
    return (WEB / name).read_text(encoding="utf-8")
