"""All pages generated from the code."""

import shutil
from pathlib import Path

from . import api, gallery, operators, theorems
from .contents import ROOT


def pages() -> dict[str, str]:
    """Return each page's text by its path from the root, without its suffix."""
    made: dict[str, str] = {}
    for source in (operators, theorems, api, gallery):
        made |= source.pages()
    return made


def pictures(folder: Path) -> None:
    """Copy the committed pictures, and draw the pictures of the gallery, into the folder of the site's sources."""
    (folder / "docs" / "static").mkdir(parents=True, exist_ok=True)
    for picture in sorted(path for path in (ROOT / "docs" / "static").iterdir() if path.suffix in (".png", ".svg")):
        shutil.copyfile(picture, folder / "docs" / "static" / picture.name)
    for script in gallery.SCRIPTS:
        gallery.draw(script, folder / "docs" / "gallery" / f"{script.stem}.png")


def playing(folder: Path) -> list[Path]:
    """Return the animated pages of the gallery, which Sphinx does not copy: each is shown in a frame."""
    return [folder / "docs" / "gallery" / f"{script.stem}.html" for script in gallery.SCRIPTS if gallery.plays(script)]
