"""Impulses that change a model's motion to one that its hinges permit: velocities, energies, momenta."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from .grafting import roots_of


@dataclass(frozen=True)
class Impulse:
    """Velocities after an impulse that changes bodies' motions to those that the hinges of a model permit (see `impulse_into`).

    Attributes
    ----------
    v : (nv,) velocities after the impulse, of all hinges
    energy_before, energy_after : J, kinetic, including the rotors of the hinges
    loss : J, ½ δ*Mδ of the lost velocities of bodies (and rates of rotors); energy_before - energy_after, and never negative
    momentum_before, momentum_after : (6,) of all bodies about the world's origin in its axes, angular first. They are equal in every
        direction in which the base does not hold the model.
    """

    v: np.ndarray
    energy_before: float
    energy_after: float
    loss: float
    momentum_before: np.ndarray
    momentum_after: np.ndarray

    def __repr__(self) -> str:
        return f"<impulse: kinetic energy from {self.energy_before:.6g} J to {self.energy_after:.6g} J>"


def impulse_into(model: Any, V: np.ndarray) -> Impulse:
    """Return the impulse that changes velocities V of bodies to motions of a model: a plastic impact, hinges without friction.

        (ℳ + J) v⁺ = HφM V⁻ + J v⁻

    Impulses of hinges do no work on the motions of the model: along every coordinate they only transfer between bodies and rotors. v⁺ is
    the projection of the earlier motion onto the motions of the model, orthogonal in kinetic energy, so that no energy is gained.

    Parameters
    ----------
    model : at the configuration q of the impulse, with v the rates of its hinges' rotors before it
    V : (6n,) twists of its bodies before, in their own axes, angular first, in the model's order

    Raises SingularHingeError as forward dynamics. Cost: O(n).
    """
    H, phi, M, J = model.soa("H phi M J")
    rotors, q = np.array(model.v), model.q
    gravity, still = np.array(model.gravity), np.zeros(model.nv)
    if gravity.any():
        raise _core.ModelError("an impulse is instantaneous: set gravity to zero for it")
    v = model.forward_dynamics(q, still, H @ (phi @ (M @ V)) + J @ rotors, refine=1) if model.nv else still
    after = phi.T @ (H.T @ v)
    before_energy, after_energy, lost = (
        float(W @ (M @ W) + r @ (J @ r)) / 2 for W, r in ((V, rotors), (after, v), (V - after, rotors - v))
    )
    return Impulse(v, before_energy, after_energy, lost, *(_momentum(model, phi @ (M @ W)) for W in (V, after)))


def twists_of(model: Any) -> np.ndarray:
    """Return the twists of all bodies at the present state, (6n,) in their own axes: φ*H*v."""
    phi, H = model.soa("phi H")
    return phi.T @ (H.T @ np.array(model.v))


def _momentum(model: Any, gathered: np.ndarray) -> np.ndarray:
    """Return the momentum of everything on the base: φ's sums at the roots, moved to the world's origin."""
    total = np.zeros(6)
    for k in roots_of(model):
        X = model.pose(model._body(k)["name"], model.q)
        angular, linear = X[:3, :3] @ gathered[6 * k : 6 * k + 3], X[:3, :3] @ gathered[6 * k + 3 : 6 * k + 6]
        total += np.r_[angular + np.cross(X[:3, 3], linear), linear]
    return total
