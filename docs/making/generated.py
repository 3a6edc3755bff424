"""The pages that follow from the code, all of them."""

from . import api, operators, theorems


def pages() -> dict[str, str]:
    """Each page's text by its place, from the root and without its suffix."""
    made: dict[str, str] = {}
    for source in (operators, theorems, api):
        made |= source.pages()
    return made
