"""A scene or a model in the viewer: what `scene.view()` and `model.view()` return."""

from __future__ import annotations

import time
import warnings
from html import escape
from typing import Any

from .. import _core
from ..arguments import text, whole
from ..scenes import Scene
from ..state import at_state
from ..view.web_page import web_page
from .server import ViewServer
from .session import Session

HEIGHT = 640
"""Pixels of the page in a notebook."""


class View:
    """A page that shows a scene and plays it, at an address of this machine. A notebook shows it in its cell.

    It is served until `close`, the end of a `with` block, or the end of the process.

    Attributes
    ----------
    address : str, to open in a browser
    is_local : bool, whether this machine alone can reach it
    session : Session, what the page acts on
    """

    def __init__(self, scene: Any, beside: Any, q: Any, v: Any, host: Any, port: Any):
        number = whole(port, "port")
        if not 0 <= number < 65536:
            raise _core.EvaluationError(f"port={number}: from 1 to 65535, or 0 for a free one")
        name = text(host, "host")
        if beside is not None and not isinstance(beside, Scene):
            raise _core.ModelError(f"beside: a second scene, not {beside!r:.80}")
        q, v = at_state(scene.model, q, v)
        self.session = Session(scene, beside, q, v)
        page = web_page("viewer", scene.model.name, self.session.setup(), {}, asks=True)
        try:
            self._server = ViewServer(self.session, page, name, number)
        except BaseException:
            self.session.close()
            raise
        self.address, self.is_local = self._server.address, self._server.is_local
        self._closed = False
        if not self.is_local:
            warnings.warn(f"{self.said}: whoever reaches this machine can look and act", stacklevel=4)
        self._server.start()

    @property
    def said(self) -> str:
        """Where it is, and who reaches it."""
        return f"{self.address} ({'this machine alone' if self.is_local else f'host {self._server.given_host}: other machines, too'})"

    def wait(self) -> None:
        """Until Ctrl-C, or until it is closed from elsewhere."""
        while not self._closed:
            time.sleep(0.2)

    def close(self) -> None:
        """The page is served no more."""
        if not self._closed:
            self._closed = True
            self._server.close()

    def __enter__(self) -> View:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _repr_html_(self) -> str:
        if self._closed:
            return escape(repr(self))
        return f'<iframe src="{escape(self.address)}" style="width: 100%; height: {HEIGHT}px; border: 0" title="viewer"></iframe>'

    def __repr__(self) -> str:
        name = self.session.live.model.name
        return f"<view of {name!r}, closed>" if self._closed else f"<view of {name!r} at {self.said}>"


def view_scene(scene: Any, q: Any, v: Any, *, beside: Any, host: Any, port: Any) -> View:
    """`Scene.view`."""
    return View(scene, beside, q, v, host, port)


def view_model(model: Any, q: Any, v: Any, *, host: Any, port: Any) -> View:
    """`Multibody.view`: under its own gravity, if it has one."""
    from ..scenes.effects import Gravity

    scene = Scene(model)
    if any(model.gravity):
        scene.add(Gravity())
    return View(scene, None, q, v, host, port)
