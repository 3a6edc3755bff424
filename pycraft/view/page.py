"""Pictures that are self-contained pages: shown in a notebook's cell, or written to a file that opens offline."""

from __future__ import annotations

from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

from ..file_targets import writable_target


class Page:
    """A page of HTML. In a notebook it shows itself; `save` writes it.

    Attributes
    ----------
    html : str, the page
    """

    HEIGHT = 480
    """Height of the page in a notebook, pixels."""

    @cached_property
    def html(self) -> str:
        raise NotImplementedError

    def save(self, path: Any) -> Path:
        """Write it to a path that ends in ".html". Raises EvaluationError for another ending, OSError if it cannot be written."""
        target = writable_target(path, (".html",), "a page")
        target.write_text(self.html, encoding="utf-8")
        return target

    def _repr_html_(self) -> str:
        style = f"width: 100%; height: {self.HEIGHT}px; border: 0"
        return f'<iframe srcdoc="{escape(self.html)}" style="{style}" title="{escape(type(self).__name__)}"></iframe>'
