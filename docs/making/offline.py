"""What a built page would ask the network for: nothing, or the site is not made."""

import re
from html.parser import HTMLParser
from pathlib import Path

ELSEWHERE = re.compile(r"^\s*(?:https?:)?//", re.I)
# What a browser fetches by itself: an <a href> is followed by its reader alone, and asks nobody.
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
    """What a browser would fetch from elsewhere for this page of HTML."""
    parser = _Fetched()
    parser.feed(page)
    return parser.found


def not_offline(site: Path) -> list[str]:
    """Of all pages and style sheets of a site: what each would fetch, with its file."""
    found = [(path, what) for path in sorted(site.rglob("*.html")) for what in asked_of_others(path.read_text(encoding="utf-8"))]
    found += [(path, what) for path in sorted(site.rglob("*.css")) for what in IN_STYLE.findall(path.read_text(encoding="utf-8"))]
    return [f"{path.relative_to(site)}: {what}" for path, what in found]
