"""Requests that a built page would send to the network; the build fails if there are any."""

import re
from html.parser import HTMLParser
from pathlib import Path

ELSEWHERE = re.compile(r"^\s*(?:https?:)?//", re.I)
# Attributes that a browser fetches by itself; an <a href> is followed only by its reader.
FETCHED = {"src", "srcset", "data", "poster"}
IN_STYLE = re.compile(r"(?:url\(\s*['\"]?|@import\s+['\"])\s*((?:https?:)?//[^'\")]+)", re.I)


class _Fetched(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.in_style = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.in_style = tag == "style"
        of_link = tag == "link" and not {"canonical", "license", "author"} & set((dict(attrs).get("rel") or "").split())
        for name, value in attrs:
            fetched = name in FETCHED or (name in ("href", "xlink:href") and (of_link or tag in ("use", "image")))
            if value and fetched and ELSEWHERE.match(value):
                self.found.append(f"<{tag} {name}={value}>")
            if value and name == "style":
                self.found += IN_STYLE.findall(value)

    def handle_data(self, data: str) -> None:
        if self.in_style:
            self.found += IN_STYLE.findall(data)
        self.in_style = False


def asked_of_others(page: str) -> list[str]:
    """Return the external resources that a browser would fetch for this page of HTML."""
    parser = _Fetched()
    parser.feed(page)
    return parser.found


def not_offline(site: Path) -> list[str]:
    """Return the external resources of all pages and style sheets of a site, each with its file."""
    found = [(path, what) for path in sorted(site.rglob("*.html")) for what in asked_of_others(path.read_text(encoding="utf-8"))]
    found += [(path, what) for path in sorted(site.rglob("*.css")) for what in IN_STYLE.findall(path.read_text(encoding="utf-8"))]
    return [f"{path.relative_to(site)}: {what}" for path, what in found]
