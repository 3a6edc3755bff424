"""Motions that are prescribed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ... import _core
from ...arguments import one_number
from .effect import Effect, names_of
from .functions_of_time import function_of_time


@dataclass(repr=False, eq=False)
class Prescribed(Effect):
    """A hinge that goes where a function of time says; the forces that this takes are found, and are the effect's.

    In a run the coordinates are the motion's, whatever state it starts from; `Scene.evaluate` takes the state as it is given, and of the
    motion its acceleration. A coordinate that two effects prescribe is an error.

    Parameters
    ----------
    hinge : name of a hinge or of a coordinate of one subhinge, or a list of them
    motion : as many numbers as these have in q (a quaternion for a ball, a quaternion and a position for a free hinge)
        Constant; a `Spline`, `Table` or `Harmonic`; a spline of SciPy's; or a function of t that gives the position, or the tuple
        (position, velocity, acceleration), by which those of q are meant.
    step : s
        Of the differences of order 6 by which a function that gives positions alone is differentiated twice: about 1e-9 is lost of
        accelerations at the default, for motions of seconds.
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
