"""The pages that follow from the code, all of them."""

import shutil
from pathlib import Path

from . import api, gallery, operators, theorems
from .contents import ROOT


def pages() -> dict[str, str]:
    """Each page's text by its place, from the root and without its suffix."""
    made: dict[str, str] = {}
    for source in (operators, theorems, api, gallery):
        made |= source.pages()
    return made


def pictures(folder: Path) -> None:
    """The pictures of all pages: those that are committed, and those of the gallery, drawn into the folder that they are in."""
    (folder / "docs" / "static").mkdir(parents=True, exist_ok=True)
    for picture in sorted((ROOT / "docs" / "static").glob("*.png")):
        shutil.copyfile(picture, folder / "docs" / "static" / picture.name)
    for script in gallery.SCRIPTS:
        gallery.draw(script, folder / "docs" / "gallery" / f"{script.stem}.png")


def playing(folder: Path) -> list[Path]:
    """The pages that were made beside them, which Sphinx does not copy: a frame shows each."""
    return [folder / "docs" / "gallery" / f"{script.stem}.html" for script in gallery.SCRIPTS if gallery.plays(script)]
