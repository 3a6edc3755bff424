"""The method of a scene that opens the live viewer, which is in a higher layer."""

from __future__ import annotations

from typing import Any

from .. import _core


class Viewed:
    """Live view of a scene."""

    def view(self, q=None, v=None, *, beside: Any = None, host: str = "127.0.0.1", port: int = 0) -> Any:
        """Open the scene in a live viewer: a page with the figure, sliders, plots, and effects that can be switched and changed while it
        plays (docs/viewing.md).

        Parameters
        ----------
        q, v : (nq,), (nv,) or a State, initial state; default: the model's own
        beside : a second scene
            Drawn as a ghost that plays along, from the same state if its coordinates are the same.
        host : address to listen on; default: this machine only
        port : port; 0 picks a free one

        Returns
        -------
        View
            A notebook shows it in its cell; open `address` in a browser; `close()` ends it. It uses `run_options` of the scene
            ("integrator", "rtol", "atol", "step"); default: "auto" with rtol 1e-7.

        Raises
        ------
        ModelError
            A q or v of the wrong size.
        EvaluationError
            The port is taken, or the host is not an address of this machine.

        Examples
        --------
        >>> import pycraft as pc
        >>> view = pc.mechanisms.double_pendulum().view()
        >>> view.is_local
        True
        >>> view.close()
        """
        return _core._face["view_scene"](self, q, v, beside=beside, host=host, port=port)
