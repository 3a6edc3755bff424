"""A scene or a model in the viewer: the object returned by `scene.view()` and `model.view()`."""

from __future__ import annotations

import time
import warnings
from html import escape
from typing import Any

from .. import _core
from ..arguments import text, whole
from ..scenes import Scene
from ..state import at_state
from ..view.web_page import notes, web_page
from .server import ViewServer
from .session import Session

HEIGHT = 640
"""Height of the page in a notebook, pixels."""


class View:
    """A page that shows and plays a scene, at an address of this machine. A notebook shows it in its cell.

    It is served until `close`, the end of a `with` block, or the end of the process.

    Attributes
    ----------
    address : str, to open in a browser
    is_local : bool, True if only this machine can reach the page
    session : Session, the scene that the page acts on
    """

    def __init__(self, scene: Any, beside: Any, q: Any, v: Any, host: Any, port: Any):
        number = whole(port, "port")
        if not 0 <= number < 65536:
            raise _core.EvaluationError(f"port={number}: give a port from 1 to 65535, or 0 for a free one")
        name = text(host, "host")
        if beside is not None and not isinstance(beside, Scene):
            raise _core.ModelError(f"beside takes a second scene, not {beside!r:.80}")
        q, v = at_state(scene.model, q, v)
        self.session = Session(scene, beside, q, v)
        setup = self.session.setup()
        page = web_page("viewer", scene.model.name, setup, {"notes": notes(setup["figure"]["unshown"])}, asks=True)
        try:
            self._server = ViewServer(self.session, page, name, number)
        except BaseException:
            self.session.close()
            raise
        self.address, self.is_local = self._server.address, self._server.is_local
        self._closed = False
        if not self.is_local:
            warnings.warn(f"{self.said}: anyone who can reach this machine can watch and act", stacklevel=4)
        self._server.start()

    @property
    def said(self) -> str:
        """The address, and who can reach it."""
        return f"{self.address} ({'this machine only' if self.is_local else f'host {self._server.given_host}: open to other machines'})"

    # ------------------------------------------------------------------ drawings of a user's code
    def frame(self, name: str, pose: Any, on: Any = None, *, size: float | None = None) -> View:
        """Show axes x, y and z with a name, at a pose (4, 4) or a position (3,) in the world, or on a body or node; returns the view.

        A drawing of the same name is replaced. `size` is the length of the axes, m; default: a tenth of the model's reach. Invalid poses
        raise ModelError, here and in `label`, `line` and `shape`.

        Examples
        --------
        >>> import pycraft as pc
        >>> with pc.mechanisms.double_pendulum().view() as view:
        ...     view.frame("goal", (1.0, 0.5, 0.0)).label("tip", (1.0, 0, 0), on="lower").shown()
        ['goal', 'tip']
        """
        return self._shows(name, {"kind": "frame", "pose": pose, "size": size}, on, None)

    def label(self, text: str, at: Any, on: Any = None, *, name: str = "", colour: str | None = None) -> View:
        """Show a text at a point (3,) in the world, or on a body or node; returns the view. `name` is the text by default."""
        return self._shows(name or text, {"kind": "label", "text": text, "at": at}, on, colour)

    def line(self, name: str, points: Any, on: Any = None, *, colour: str | None = None) -> View:
        """Show a line through points (n, 3) in the world, or on a body or node, such as a target's path; returns the view."""
        return self._shows(name, {"kind": "line", "points": points}, on, colour)

    def shape(
        self, name: str, kind: str, size: Any, pose: Any = None, on: Any = None, *, file: str = "", colour: str | None = None
    ) -> View:
        """Show a shape at a pose (4, 4) or position (3,) in the world, or on a body or node; returns the view.

        A box (edges), sphere (radius), cylinder or capsule (radius, length along z), ellipsoid (half axes) or mesh (scales, and `file`).
        """
        return self._shows(name, {"kind": "shape", "shape": kind, "size": size, "pose": pose, "file": file}, on, colour)

    def look(self, direction: str = "from above", follow: Any = None, *, zoom: float = 1.0) -> View:
        """Turn the cameras of all pages; returns the view.

        Parameters
        ----------
        direction : {"from above", "side", "front", "back", "top"}
        follow : "robot", a body or its name, kept in the middle; None follows nothing
        zoom : 1 at first; 2 is twice as near

        Other values raise EvaluationError or ModelError.
        """
        self.session.look(direction, follow, zoom)
        return self

    def remove(self, name: str) -> View:
        """Remove the drawing of a name. Raises ModelError if there is none."""
        self.session.draw(None, text(name, "name"))
        return self

    def clear(self) -> View:
        """Remove all drawings."""
        self.session.draw(None)
        return self

    def shown(self) -> list[str]:
        """Return the names of all drawings."""
        return list(self.session.extras.given)

    def _shows(self, name: Any, extra: dict[str, Any], on: Any, colour: Any) -> View:
        self.session.draw({**extra, "on": on, "colour": colour}, text(name, "name"))
        return self

    # ------------------------------------------------------------------ waiting and closing
    def wait(self) -> None:
        """Wait until Ctrl-C, or until another thread closes the view."""
        while not self._closed:
            time.sleep(0.2)

    def close(self) -> None:
        """Stop serving the page."""
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
    """Return the view of a model (`Multibody.view`), under its own gravity if it has one."""
    from ..scenes.effects import Gravity

    scene = Scene(model)
    if any(model.gravity):
        scene.add(Gravity())
    return View(scene, None, q, v, host, port)
