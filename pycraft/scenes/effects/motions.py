"""Prescribed motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from ...arguments import one_number
from .effect import Effect, names_of
from .functions_of_time import function_of_time


@dataclass(repr=False, eq=False)
class Prescribed(Effect):
    """A hinge that follows a function of time; the required forces are computed, and are the forces of the effect.

    In a run the coordinates follow the motion, whatever the initial state; `Scene.evaluate` uses the given state, and only the acceleration
    of the motion. Two effects that prescribe the same coordinate are an error.

    Parameters
    ----------
    hinge : name of a hinge or of a coordinate of one subhinge, or a list of them
    motion : as many values as these hinges have in q (a quaternion for a ball, a quaternion and a position for a free hinge)
        Constant; a `Spline`, `Table` or `Harmonic`; a spline of SciPy's; or a function of t that returns the position, or the tuple
        (position, velocity, acceleration), the derivatives of q.
    step : s
        Step of the differences of order 6 for a function that returns only positions: the error of accelerations is about 1e-9 at the
        default, for motions over seconds.
    """

    _example = 'pc.effects.Prescribed("elbow", pc.effects.Harmonic(0.5, 2.0))'

    hinge: Any
    motion: Any
    step: float = 1e-3

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names = names_of(self.hinge, "prescribed")
        size = _core.numbers_in_q(model, _core.coordinates_named(model, names, "prescribed"))
        motion = function_of_time(self.motion, "prescribed: motion", size, derivatives=True, step=one_number(self.step, "prescribed: step"))
        return _core.prescribed_effect(model, names, motion)
