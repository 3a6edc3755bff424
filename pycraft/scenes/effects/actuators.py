"""Actuators of hinges, within limits of effort and speed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ... import _core
from ...arguments import one_number
from .effect import Effect, by_hinge, names_of, numbers_of
from .functions_of_time import function_of_time
from .stiffness_by_inertia import stiffness_by_inertia

FREQUENCY = 20.0
"""Default frequency of a servo, rad/s, if no stiffness is given."""


def _limits(effect: Any, kind: str) -> tuple[list[float], list[float], float]:
    """Return effort, speed and band for the core."""
    effort, speed = (numbers_of(getattr(effect, name), f"{kind}: {name}") for name in ("effort_limit", "speed_limit"))
    return effort, speed, one_number(effect.speed_band, f"{kind}: speed_band")


@dataclass(repr=False, eq=False)
class TorqueSource(Effect):
    """Torques or forces at coordinates, within limits.

    Parameters
    ----------
    torque : N m or N
        One number or one for each coordinate; a `Table`, `Spline` or `Harmonic`; or a function of t.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    effort_limit : N m or N, largest effort; inf: no limit
    speed_limit : rad/s or m/s, speed beyond which it does not drive further; inf: no limit
    speed_band : share of the speed limit over which the driving effort falls to zero
    """

    _example = "pc.effects.TorqueSource(1.0)"

    torque: Any
    hinges: Any = None
    effort_limit: Any = np.inf
    speed_limit: Any = np.inf
    speed_band: float = 0.05

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        torque = function_of_time(self.torque, "torque_source: torque")
        return _core.torque_source_effect(model, names_of(self.hinges, "torque_source"), torque, *_limits(self, "torque_source"))


@dataclass(repr=False, eq=False)
class Servo(Effect):
    """A servo on pins, sliders and screws, T = stiffness (target - q) + damping (d target/dt - v), within limits.

    Parameters
    ----------
    stiffness, damping : N m/rad or N/m, N m s/rad or N s/m
        One number or one for each coordinate. Stiffness None: ω² (ℳ + J)_jj at q = 0 with ω = 20 rad/s. Damping None: critical,
        2ω (ℳ + J)_jj, if stiffness is also None, else zero.
    target : rad or m
        One number or one for each coordinate; a `Table`, `Spline` or `Harmonic`; or a function of t, differentiated numerically
        unless it returns the tuple (position, velocity, acceleration).
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all pins, sliders and screws
    effort_limit, speed_limit, speed_band : as for `TorqueSource`
    """

    _example = "pc.effects.Servo(stiffness=100.0, damping=20.0)"

    stiffness: Any = None
    damping: Any = None
    target: Any = 0.0
    hinges: Any = None
    effort_limit: Any = np.inf
    speed_limit: Any = np.inf
    speed_band: float = 0.05

    def completed_for(self, model: _core.Multibody) -> Servo:
        if self.stiffness is not None:
            return self if self.damping is not None else replace(self, damping=0.0)
        coordinates = replace(self, stiffness=0.0, damping=0.0).made_for(model).coordinates
        stiffness = stiffness_by_inertia(model, coordinates, FREQUENCY, "servo")
        return replace(self, stiffness=stiffness, damping=2 * stiffness / FREQUENCY if self.damping is None else self.damping)

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        if self.stiffness is None or self.damping is None:
            return self.completed_for(model).made_for(model)
        kp, kd = numbers_of(self.stiffness, "servo: stiffness"), numbers_of(self.damping, "servo: damping")
        target = function_of_time(self.target, "servo: target", derivatives=True)
        effort, speed, band = _limits(self, "servo")
        return _core.servo_effect(model, names_of(self.hinges, "servo"), kp, kd, target, effort, speed, band)


@dataclass(repr=False, eq=False)
class Motor(Effect):
    """A motor with a straight speed-torque line behind a gear, T = n stall_torque (command - n v/no_load_speed), and its rotor's n² J in D.

    Parameters
    ----------
    command : from -1 to 1
        One number or one for each coordinate; a `Table`, `Spline` or `Harmonic`; or a function of t.
    stall_torque, no_load_speed : N m and rad/s at the motor's shaft (N and m/s for a linear motor)
    gear_ratio : n, turns of the motor for one of the hinge
    rotor_inertia : kg m² at the motor's shaft
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    effort_limit, speed_limit, speed_band : at the hinge, as for `TorqueSource`
    """

    _example = "pc.effects.Motor(0.5, stall_torque=2.0, no_load_speed=300.0, gear_ratio=50.0)"

    command: Any
    stall_torque: Any
    no_load_speed: Any
    gear_ratio: Any = 1.0
    rotor_inertia: Any = 0.0
    hinges: Any = None
    effort_limit: Any = np.inf
    speed_limit: Any = np.inf
    speed_band: float = 0.05

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        command = function_of_time(self.command, "motor: command")
        fields = ("stall_torque", "no_load_speed", "gear_ratio", "rotor_inertia")
        torque, speed, ratio, inertia = (numbers_of(getattr(self, name), f"motor: {name}") for name in fields)
        effort, fastest, band = _limits(self, "motor")
        return _core.motor_effect(model, names_of(self.hinges, "motor"), command, torque, speed, ratio, inertia, effort, fastest, band)


@dataclass(repr=False, eq=False)
class RotorInertia(Effect):
    """Rotors at hinges: n² inertia on the diagonal of D, ½ n² inertia v² of kinetic energy.

    Parameters
    ----------
    inertia : kg m² (or kg) at the rotor's shaft
        One number, one for each coordinate, or a dictionary by hinge; not negative.
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    gear_ratio : n, turns of the rotor for one of the hinge; one number or one for each coordinate
    """

    _example = "pc.effects.RotorInertia(0.01)"

    inertia: Any
    hinges: Any = None
    gear_ratio: Any = 1.0

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.inertia, self.hinges, model, "rotor_inertia", "inertia")
        return _core.rotor_inertia_effect(model, names, values, numbers_of(self.gear_ratio, "rotor_inertia: gear_ratio"))
