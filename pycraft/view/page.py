"""Pictures that are a page of their own: what a notebook shows in its cell, and what is written to a file that opens offline."""

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
    """Pixels of the page in a notebook."""

    @cached_property
    def html(self) -> str:
        raise NotImplementedError

    def save(self, path: Any) -> Path:
        """Write it to a path that ends in ".html". EvaluationError for another ending, OSError where it cannot be written."""
        target = writable_target(path, (".html",), "a page")
        target.write_text(self.html, encoding="utf-8")
        return target

    def _repr_html_(self) -> str:
        style = f"width: 100%; height: {self.HEIGHT}px; border: 0"
        return f'<iframe srcdoc="{escape(self.html)}" style="{style}" title="{escape(type(self).__name__)}"></iframe>'
