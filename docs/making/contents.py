"""The pages of the site, as the table of contents in docs/index.md lists them, and the links between them."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
INDEX = ROOT / "docs" / "index.md"
# What follows from the code is written when the site is made; docs/index.md names it beside what is committed.
GENERATED = ("docs/operators/index", "docs/theorems/index", "docs/api/index", "docs/gallery/index")


def listed() -> list[str]:
    """The pages that docs/index.md lists, in order, as paths from the root without their suffix."""
    pages = [INDEX.relative_to(ROOT).with_suffix("").as_posix()]
    for options, entries in re.findall(r"```\{toctree\}\n((?::[^\n]*\n)*)(.*?)```", INDEX.read_text(encoding="utf-8"), re.S):
        for entry in entries.split():
            place = (INDEX.parent / entry).resolve().relative_to(ROOT)
            if ":glob:" not in options:
                pages.append(place.as_posix())
            else:
                found = [p for p in (ROOT / place.parent).glob(place.name) if p.suffix in (".md", ".ipynb")]
                pages += sorted(p.relative_to(ROOT).with_suffix("").as_posix() for p in found)
    return pages


def committed() -> list[Path]:
    """The files of the pages that are in the repository."""
    return [source(page) for page in listed() if page not in GENERATED]


def source(page: str) -> Path:
    """The file of a page that is in the repository."""
    for suffix in (".md", ".ipynb"):
        path = (ROOT / page).with_suffix(suffix)
        if path.is_file():
            return path
    raise FileNotFoundError(
        f"docs/index.md lists {page}, and there is no {page}.md and no {page}.ipynb: write it, or take it from the list"
    )


def text(path: Path) -> str:
    """The Markdown of a page, without its blocks of code."""
    written = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        cells = json.loads(written)["cells"]
        written = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return re.sub(r"^```.*?^```$", "", written, flags=re.M | re.S)


def anchors(path: Path) -> set[str]:
    """What a link may name behind its #: the headings, as GitHub and MyST spell them."""
    headings = re.findall(r"^#+ +(.*?)#* *$", text(path), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def links(path: Path) -> Iterator[str]:
    """The targets of a page's links and pictures that lie in the repository."""
    for target in re.findall(r"(?<!\\)\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", "", text(path))):
        if not re.match(r"\w+:", target):
            yield target


def dead_links(path: Path) -> list[str]:
    """Of these, those that lead nowhere in the repository: pages that are generated are reached by docs/index.md alone."""
    dead = []
    for target in links(path):
        file, _, anchor = target.partition("#")
        place = (path.parent / file).resolve() if file else path
        if not place.is_file() or (anchor and anchor not in anchors(place)):
            dead.append(target)
    return dead
