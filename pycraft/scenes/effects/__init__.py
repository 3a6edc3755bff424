"""Effects, each a class: what acts on a model where a scene has it. docs/scenes.md has them all in one table."""

from .actuators import TorqueSource
from .effect import Effect
from .frictions import Damping
from .functions_of_time import Harmonic, Spline, Table
from .gravities import Gravity
from .motions import Prescribed
from .springs import Spring
from .user_effects import EffectState, Sampled, UserEffect
from .wrenches import Wrench

__all__ = [
    "Damping",
    "Effect",
    "EffectState",
    "Gravity",
    "Harmonic",
    "Prescribed",
    "Sampled",
    "Spline",
    "Spring",
    "Table",
    "TorqueSource",
    "UserEffect",
    "Wrench",
]
