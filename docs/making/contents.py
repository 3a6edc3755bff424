"""The pages of the site, as the table of contents in docs/index.md lists them, and the links between them."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
INDEX = ROOT / "docs" / "index.md"
# Pages generated with the site; docs/index.md lists them beside the committed ones.
GENERATED = ("docs/operators/index", "docs/theorems/index", "docs/api/index", "docs/gallery/index")


def listed() -> list[str]:
    """Return the pages that docs/index.md lists, in order, as paths from the root without their suffix."""
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
    """Return the files of the committed pages."""
    return [source(page) for page in listed() if page not in GENERATED]


def source(page: str) -> Path:
    """Return the file of a committed page."""
    for suffix in (".md", ".ipynb"):
        path = (ROOT / page).with_suffix(suffix)
        if path.is_file():
            return path
    raise FileNotFoundError(
        f"docs/index.md lists {page}, but neither {page}.md nor {page}.ipynb exists: write the page, or remove it from the list"
    )


def text(path: Path) -> str:
    """Return the Markdown of a page, without its blocks of code."""
    written = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        cells = json.loads(written)["cells"]
        written = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return re.sub(r"^```.*?^```$", "", written, flags=re.M | re.S)


def anchors(path: Path) -> set[str]:
    """Return the anchors of a page: its headings, as GitHub and MyST spell them."""
    headings = re.findall(r"^#+ +(.*?)#* *$", text(path), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def links(path: Path) -> Iterator[str]:
    """Yield the targets in the repository of a page's links and pictures."""
    for target in re.findall(r"(?<!\\)\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", "", text(path))):
        if not re.match(r"\w+:", target):
            yield target


def dead_links(path: Path) -> list[str]:
    """Return the link targets that do not exist in the repository; only docs/index.md may link to generated pages."""
    dead = []
    for target in links(path):
        file, _, anchor = target.partition("#")
        place = (path.parent / file).resolve() if file else path
        if not place.is_file() or (anchor and anchor not in anchors(place)):
            dead.append(target)
    return dead
