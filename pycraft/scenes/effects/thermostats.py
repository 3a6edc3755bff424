"""Thermostats, and the Fixman potential, which removes the bias of constraints on configurations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import _core
from ...arguments import clipped, one_number, thermal_energy, whole
from .effect import Effect, by_hinge, names_of


def _energy(effect: Any, kind: str, positive: bool = False) -> float:
    """kT, J."""
    return thermal_energy(effect.temperature, effect.boltzmann, _core.ModelError, f"{kind}: ", positive)


def _seconds(value: Any, what: str) -> float:
    number = one_number(value, what)
    if not 0 < number < np.inf:
        raise _core.ModelError(f"{what} is {number:g}; it is a positive number of seconds")
    return number


def _sampled(number: Any) -> Any:
    """Return a sample of a sweep, a float, as the whole number it was."""
    return int(number) if isinstance(number, float) and number.is_integer() else number


@dataclass(repr=False, eq=False)
class Langevin(Effect):
    """A Langevin thermostat: friction -friction v and the matching white noise, as an impulse every `period` seconds.

    The density √det(ℳ + J) exp(-H/kT) of coordinates and velocities is invariant for any period, except for the integrator's error
    between impulses. They act at (k + ½) period; integrators end a step there.

    Parameters
    ----------
    temperature : in units of energy over `boltzmann`
    friction : N m s/rad or N s/m
        One number, one for each coordinate, or a dictionary by hinge; not negative.
    period : s, time between impulses
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    seed : seed of the noise, which also depends on the number of the impulse and on the coordinate
    boltzmann : k, J/K; 1 if temperatures are energies
    """

    _example = "pc.effects.Langevin(temperature=1.0, friction=0.1, period=0.01)"

    temperature: float
    friction: Any
    period: float
    hinges: Any = None
    seed: int = 0
    boltzmann: float = 1.0

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        names, values = by_hinge(self.friction, self.hinges, model, "langevin", "friction")
        seed = whole(_sampled(self.seed), "langevin: seed")
        if not 0 <= seed < 2**53:
            raise _core.ModelError(f"langevin: seed is {seed}; it must be a whole number from 0 to 2⁵³ - 1")
        return _core.langevin_effect(model, names, _energy(self, "langevin"), values, _seconds(self.period, "langevin: period"), seed)


@dataclass(repr=False, eq=False)
class NoseHoover(Effect):
    """A chain of Nosé-Hoover thermostats on the momenta p = (ℳ + J)v of coordinates: T = -ξ₁ p, with ξ driven by Σ v p - n kT.

    Its potential is its stored energy, so `run.balance` is the extended energy, constant except for the integrator's error.

    Parameters
    ----------
    temperature : in units of energy over `boltzmann`
    time_constant : s
        τ; the masses of the chain are n kT τ², kT τ², ... Choose about the time in which the configuration changes.
    chain : number of thermostats in the chain; with 1, the motion may not reach all states
    hinges : names of hinges, coordinates, patterns, or a list of them; None: all
    boltzmann : k, J/K; 1 where temperatures are energies
    """

    _example = "pc.effects.NoseHoover(temperature=1.0, time_constant=0.5)"

    temperature: float
    time_constant: float
    chain: int = 3
    hinges: Any = None
    boltzmann: float = 1.0

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        chain = clipped(_sampled(self.chain), "nose_hoover: chain")
        if not 1 <= chain <= 100:
            raise _core.ModelError(f"nose_hoover: chain is {self.chain}; it must be a whole number from 1 to 100")
        kT, slow = _energy(self, "nose_hoover", positive=True), _seconds(self.time_constant, "nose_hoover: time_constant")
        if not all(np.finfo(float).tiny < square < np.inf for square in (slow * slow, kT * slow * slow)):
            raise _core.ModelError(
                f"nose_hoover: kT τ² of {kT:g} J and a time_constant of {slow:g} s exceeds the range of doubles: use other units"
            )
        return _core.nose_hoover_effect(model, names_of(self.hinges, "nose_hoover"), kT, slow, chain)


@dataclass(repr=False, eq=False)
class Fixman(Effect):
    """The Fixman potential ½ kT ln det(ℳ + J) and its force.

    Configurations then have the density exp(-U/kT), as if bonds were stiff springs, instead of √det(ℳ + J) exp(-U/kT).

    Parameters
    ----------
    temperature : in units of energy over `boltzmann`
    boltzmann : k, J/K; 1 where temperatures are energies
    """

    _example = "pc.effects.Fixman(temperature=1.0)"

    temperature: float
    boltzmann: float = 1.0

    def made_for(self, model: _core.Multibody) -> _core.Effect:
        return _core.fixman_effect(model, _energy(self, "fixman"))
