"""Effects, one class each, which act on the model of a scene to which they are added. docs/scenes.md lists all in one table."""

from .actuators import Motor, RotorInertia, Servo, TorqueSource
from .effect import Effect
from .fluids import FluidDrag
from .frictions import CoulombFriction, Damping, ImplicitDamping, QuadraticDamping
from .from_model import Offered, from_model
from .functions_of_time import Harmonic, Spline, Table
from .gravities import Gravity, GravityCompensation, GravityGradient, PointMassGravity
from .loops import Loop
from .motions import Prescribed
from .springs import Bushing, ImplicitSpring, NodeDamper, NodeSpring, Spring
from .stops import Limits
from .thermostats import Fixman, Langevin, NoseHoover
from .user_effects import EffectState, Sampled, UserEffect
from .wrenches import Wrench

__all__ = [
    "Bushing",
    "CoulombFriction",
    "Damping",
    "Effect",
    "EffectState",
    "Fixman",
    "FluidDrag",
    "Gravity",
    "GravityCompensation",
    "GravityGradient",
    "Harmonic",
    "ImplicitDamping",
    "ImplicitSpring",
    "Langevin",
    "Limits",
    "Loop",
    "Motor",
    "NodeDamper",
    "NodeSpring",
    "NoseHoover",
    "Offered",
    "PointMassGravity",
    "Prescribed",
    "QuadraticDamping",
    "RotorInertia",
    "Sampled",
    "Servo",
    "Spline",
    "Spring",
    "Table",
    "TorqueSource",
    "UserEffect",
    "Wrench",
    "from_model",
]
