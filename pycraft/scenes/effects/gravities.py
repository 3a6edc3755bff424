"""Fields of gravity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from .effect import Effect


@dataclass(repr=False, eq=False)
class Gravity(Effect):
    """Uniform gravity: the force m g at every body's centre of mass. Potential -Σ m g·c.

    It costs nothing: accelerations are found with the base accelerated by -g.

    Parameters
    ----------
    g : (3,) m/s², in the world's axes
    """

    g: Any = (0.0, 0.0, -9.81)

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        return _core.gravity_effect(self.g)
