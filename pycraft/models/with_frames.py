"""A model with its frames, created on first use."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from .frame_tree import Frame, Frames, Motion
from .handles import Vector
from .with_operators import WithOperators


class WithFrames(WithOperators):
    """The core's model with its operators and its frames."""

    _kept_frames: Frames | None = None

    @property
    def frames(self) -> Frames:
        """All frames by name; their present time and accelerations; counts of computations (docs/frames.md)."""
        if self._kept_frames is None:
            self._kept_frames = Frames(self)
        return self._kept_frames

    def frame(self, name: Any = None) -> Frame:
        """Return a frame by its name: a body, a node, a loose frame, or the base.

        The base is None, and also "base" and "world" unless something else has the name. Nothing is computed before it is requested.
        ModelError for an unknown name, with the nearest one.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.q, arm.v = [0, 0], [1, 2]
        >>> arm.frame("body1").pose(wrt="body0")[:3, 3].tolist()
        [1.0, 0.0, 0.0]
        >>> arm.frame("base").velocity(wrt="body1", axes="aligned")[[2, 4]].tolist()
        [-3.0, 2.0]
        """
        name = self.frames._named(name)
        return Frame(self.frames, "" if self.frames._core.number(name) == -1 else name)

    def add_frame(
        self,
        name: str,
        on: Any = None,
        *,
        position: Vector | None = None,
        rotation: np.ndarray | None = None,
        placement: np.ndarray | None = None,
        motion: Motion | None = None,
    ) -> Frame:
        """Add a loose frame on a body, a node, the base (None) or another loose frame. It does not affect the model and its operators.

        Parameters
        ----------
        name : str
        on : name, Frame, Body, Node, or None
        position, rotation, or placement : (3,), (3, 3), (4, 4)
            Its pose on that frame, as for `add_body`.
        motion : function of time
            In place of a pose: t (s) → the pose (4, 4), or (pose, twist), or (pose, twist, acceleration); the twist (ω; v) in the frame's
            own axes about its origin, (X⁻¹Ẋ)^∨, the acceleration its rate. Velocities need the second form, accelerations the third:
            nothing is differentiated numerically. It is called when a result depends on the frame, once per time, and its values are
            checked.

        Raises
        ------
        ModelError
            A duplicate or unknown name, an invalid pose, a motion that cannot be called.

        Examples
        --------
        >>> import numpy as np, pycraft as pc
        >>> arm = pc.chain(2)
        >>> lens = arm.add_frame("lens", on="body1", position=(1, 0, 0))
        >>> arm.frame("lens").pose([0, 0])[:3, 3].tolist()
        [2.0, 0.0, 0.0]
        """
        return self.frames.add(name, on, position=position, rotation=rotation, placement=placement, motion=motion)

    def _check_not_a_frame(self, name: Any, what: str) -> None:
        """Check that a body or node does not have the name of a loose frame."""
        if self._kept_frames is not None and isinstance(name, str) and self._kept_frames._core.is_loose(name):
            raise _core.ModelError(f"{self.name!r} has a frame called {name!r} already; give every {what} a name of its own")
