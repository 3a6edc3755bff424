"""Forces and moments on nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from .effect import Effect, node_name
from .functions_of_time import function_of_time


@dataclass(repr=False, eq=False)
class Wrench(Effect):
    """A wrench (moment; force) on a node or body, about its origin.

    Parameters
    ----------
    node : name of a node or body
    wrench : (6,) N m and N, the moment first
        Constant, a `Table`, `Spline` or `Harmonic`, or a function of t.
    axes : {"world", "body"} or the name of a node or body
        Axes of the wrench: the world's, the axes of the body that carries the node, or any node's.
    """

    _example = 'pc.effects.Wrench("hand", [0, 0, 0, 0, 0, 1.0])'

    node: Any
    wrench: Any
    axes: str = "world"

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        return _core.wrench_effect(
            model, node_name(self.node, "wrench"), function_of_time(self.wrench, "wrench: wrench", 6), node_name(self.axes, "wrench")
        )
