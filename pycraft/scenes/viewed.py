"""The face of a scene that leads to the live viewer, a room above."""

from __future__ import annotations

from typing import Any

from .. import _core


class Viewed:
    """A scene to look at while it plays."""

    def view(self, q=None, v=None, *, beside: Any = None, host: str = "127.0.0.1", port: int = 0) -> Any:
        """The scene in a live viewer: a page with the figure, sliders, effects that are turned on and off and changed while it plays, plots
        (docs/viewing.md).

        Parameters
        ----------
        q, v : (nq,), (nv,) or a State, where it begins; the model's own where left out
        beside : a second scene
            Drawn as a ghost, which plays with this one; from the same state, if it has the same coordinates.
        host : the address that is listened at: this machine alone, unless told otherwise
        port : of that address; 0 is a free one

        Returns
        -------
        View
            A notebook shows it in its cell; `address` is what a browser opens, `close()` ends it. It goes on by `run_options` of the scene
            ("integrator", "rtol", "atol", "step"), by "auto" with rtol 1e-7 where they say nothing.

        Raises
        ------
        ModelError
            A q or v that is none of this model's.
        EvaluationError
            A port that is taken, a host that is none.

        Examples
        --------
        >>> import pycraft as pc
        >>> view = pc.mechanisms.double_pendulum().view()
        >>> view.is_local
        True
        >>> view.close()
        """
        return _core._face["view_scene"](self, q, v, beside=beside, host=host, port=port)
