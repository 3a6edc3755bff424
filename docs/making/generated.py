"""The pages that follow from the code, all of them."""

from pathlib import Path

from . import api, gallery, operators, theorems


def pages() -> dict[str, str]:
    """Each page's text by its place, from the root and without its suffix."""
    made: dict[str, str] = {}
    for source in (operators, theorems, api, gallery):
        made |= source.pages()
    return made


def pictures(folder: Path) -> None:
    """The pictures of these pages, drawn into the folder that they are in."""
    for script in gallery.SCRIPTS:
        gallery.draw(script, folder / "docs" / "gallery" / f"{script.stem}.png")


def playing(folder: Path) -> list[Path]:
    """The pages that were made beside them, which Sphinx does not copy: a frame shows each."""
    return [folder / "docs" / "gallery" / f"{script.stem}.html" for script in gallery.SCRIPTS if gallery.plays(script)]
