"""Second derivatives of accelerations, of the state equation and of a step, contracted with costates: what quadratic models are made of."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import _core
from .direct_calls import cached
from .displacements import Moved, brackets, cobrackets, displaced


def transposed(A: np.ndarray) -> np.ndarray:
    """Of the last two axes."""
    return np.swapaxes(A, -1, -2)


def chained(first: np.ndarray, second: np.ndarray, of: np.ndarray) -> np.ndarray:
    """first* `of` second (..., m, n, n) of first, second (..., k, n) and `of` (..., m, k, k)."""
    return transposed(first)[..., None, :, :] @ of @ second[..., None, :, :]


def both_ways(A: np.ndarray) -> np.ndarray:
    """A + A*"""
    return A + transposed(A)


def taken_back(costate: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """slope* costate, for each of costates (..., m, k): (..., m, n)."""
    return costate @ slope


class Nominal(NamedTuple):
    """Where a model is expanded: states and forces (B, ...), which coordinates' forces are inputs, form and precision, what turns."""

    model: Any
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    inputs: list[int]
    how: dict[str, Any]
    turns: list[slice]


class Accelerations:
    """v̇ = FD(q, v, τ) at states (B, ...), its derivatives along z = (q, v, τ), and second ones contracted.

    With T = ID(q, v, v̇) = τ, μ = (ℳ + J)⁻¹λ and G = ∂v̇/∂z, derivatives of 0 = μ*(ID(q, v, FD) - τ) once more give

        λ*∂²v̇/∂z∂z = -(∂²p/∂z∂z + ∂²p/∂z∂v̇ G + (∂²p/∂z∂v̇ G)*),    p = μ*ID(q, v, v̇)

    symmetrised along q: derivatives along quasi-velocities do not commute, and those along exponential coordinates are their mean.
    Cost O(N · nv) for each λ, and the products of matrices.

    Source: S. Singh, R. Russell, P. Wensing, On second-order derivatives of rigid-body dynamics: theory and implementation, IEEE
    Transactions on Robotics 40 (2024); for contraction the source of cpp/dynamics/curvature.h.
    """

    def __init__(self, at: Nominal):
        model, q, v, tau, _, how, _ = at
        self._model, self._q, self._v, self._precision = model, q, v, how["precision"]
        self.value = model.forward_dynamics(q, v, tau, **how)
        self.slopes = np.concatenate(model.forward_dynamics_derivatives(q, v, tau, **how), axis=-1)

    def hessians(self, costate: np.ndarray) -> np.ndarray:
        """λ*∂²v̇/∂z∂z, (B, m, 3 nv, 3 nv), of λ (B, m, nv)."""
        n = self.slopes.shape[-2]
        inverse = self.slopes[..., 2 * n :]
        core = cached(self._model, "_curvature", _core.Curvature)
        mu = np.ascontiguousarray(costate @ inverse)
        along = core.inverse_dynamics(self._q, self._v, self.value, mu, self._precision)
        out = np.zeros((*costate.shape[:-1], 3 * n, 3 * n))
        qq, qv, with_vdot, vv = (along[..., i, :, :] for i in range(4))
        out[..., :n, :n], out[..., :n, n : 2 * n], out[..., n : 2 * n, n : 2 * n] = qq / 2, qv, vv / 2
        out[..., :n, :] += with_vdot @ self.slopes[..., None, :, :]
        return 0.0 - both_ways(out)  # no -0


class StateEquation:
    """ẋ = (δq̇, v̇) of displacements δq from the motion that passes through the state, and v, at states (B, ...).

        δq̇ = δv - ad(v₀) δq + ½ [δq, δv] + (third order),    v̇ as `Accelerations`

    since q = q₀(t) exp(δq) moves with J(δq) δq̇ = v - exp(-ad δq) v₀, of which the terms in δq and δq cancel.
    """

    def __init__(self, at: Nominal):
        n = at.model.nv
        self._turns, self._kept = at.turns, [*range(2 * n), *(2 * n + j for j in at.inputs)]
        self.accelerations = Accelerations(at)

    def hessians(self, costate: np.ndarray) -> np.ndarray:
        """costate*∂²ẋ/∂(x, u)∂(x, u), (B, m, n + k, n + k), of costates (B, m, n) and k inputs."""
        n = costate.shape[-1] // 2
        out = self.accelerations.hessians(costate[..., n:])
        turned = cobrackets(self._turns, costate[..., :n]) / 2
        out[..., :n, n : 2 * n] += turned
        out[..., n : 2 * n, :n] += transposed(turned)
        return out[..., self._kept, :][..., self._kept]


STEPS: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "euler": ((0.0,), (1.0,)),
    "semi-implicit-euler": ((0.0,), (1.0,)),
    "rkmk4": ((0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
}
"""Of each way to take a step: how far each stage goes along the one before, and weights."""


class Step:
    """One step of an integrator from states (B, ...), exact to second order: x = (δq, v) and inputs held over it to (δq⁺, v⁺).

    With q = q₀ exp(u), u = 0 at first, stage s goes a part pₛ of the step h along the stage before, and

        rₛ = vₛ + ½ [uₛ, vₛ] + 1/12 [uₛ, [uₛ, vₛ]],    v̇ₛ = FD(q₀ exp(uₛ), vₛ, τ),    u⁺ = h Σ wₛ rₛ,    v⁺ = v + h Σ wₛ v̇ₛ

    or u⁺ = h v⁺, semi-implicit. Each of these maps has its first and second derivatives by rule; first ones are chained forward, costates
    backward, and the second ones of all are summed between first ones: λ*∂²x⁺ = Σ (∂zₛ)* (λₛ*∂²zₛ₊₁) (∂zₛ). Nothing is differenced.
    """

    def __init__(self, at: Nominal, dt: float, method: str):
        model, v = at.model, at.v
        self._dt = dt
        self._parts, self._weights = STEPS[method]
        self._implicit = method == "semi-implicit-euler"
        states, n, k = len(v), model.nv, len(at.inputs)
        start = np.broadcast_to(np.eye(2 * n, 2 * n + k), (states, 2 * n, 2 * n + k))
        given = np.zeros((states, n, 2 * n + k))
        given[:, at.inputs, range(2 * n, 2 * n + k)] = 1.0
        self._stages: list[Stage] = []
        u, after, along_u, along_v = np.zeros_like(v), v, np.zeros((states, n, 2 * n + k)), start[:, n:]
        for part, weight in zip(self._parts, self._weights, strict=True):
            stage_u, stage_v, along = np.zeros_like(v), v, (np.zeros_like(given), start[:, n:])
            if part:
                last, h = self._stages[-1], part * dt
                stage_u, stage_v = h * last.rate, v + h * last.accelerations.value
                along = (h * last.along_rate, start[:, n:] + h * last.along_vdot)
            stage = Stage(at, stage_u, stage_v, start[:, :n], *along, given)
            self._stages.append(stage)
            u, along_u = u + weight * dt * stage.rate, along_u + weight * dt * stage.along_rate
            after, along_v = after + weight * dt * stage.accelerations.value, along_v + weight * dt * stage.along_vdot
        if self._implicit:
            u, along_u = dt * after, dt * along_v
        self._start, self._along_u = start[:, :n], along_u
        self._moved = Moved(at.turns, u)
        self.q, self.v = displaced(model, at.q, u), after
        self.slopes = np.concatenate([self._moved.adjoint @ self._start + self._moved.differential @ along_u, along_v], axis=-2)

    def hessians(self, costate: np.ndarray) -> np.ndarray:
        """costate*∂²x⁺/∂(x, u)∂(x, u), (B, m, n + k, n + k), of costates (B, m, n) and k inputs."""
        n, h = costate.shape[-1] // 2, self._dt
        of_q, of_v = costate[..., :n], costate[..., n:]
        out = weighed(self._moved, of_q, self._start, self._along_u)
        of_u = taken_back(of_q, self._moved.differential)
        if self._implicit:
            of_u, of_v = np.zeros_like(of_u), of_v + h * of_u
        later_rate, later_vdot = np.zeros_like(of_u), np.zeros_like(of_v)
        for s in reversed(range(len(self._stages))):
            stage, weight = self._stages[s], self._weights[s] * h
            more, at_u, at_v = stage.back(weight * of_u + later_rate, weight * of_v + later_vdot)
            out = out + more
            later_rate, later_vdot = self._parts[s] * h * at_u, self._parts[s] * h * at_v
        return out


class Stage:
    """Of a step: u and v there, the rate of u and v̇, and the derivatives of all along (x, inputs), (B, nv, n + k)."""

    def __init__(
        self, at: Nominal, u: np.ndarray, v: np.ndarray, along_q: np.ndarray, along_u: np.ndarray, along_v: np.ndarray, given: np.ndarray
    ):
        self._turns, self._v, self._u = at.turns, v, u
        self._along_q, self._along_u, self._along_v = along_q, along_u, along_v
        self._moved = Moved(at.turns, u)
        self.accelerations = Accelerations(at._replace(q=displaced(at.model, at.q, u), v=v))
        here = self._moved.adjoint @ along_q + self._moved.differential @ along_u
        self._along_all = np.concatenate([here, along_v, given], axis=-2)
        self.along_vdot = self.accelerations.slopes @ self._along_all
        by_u, by_v, ones = brackets(at.turns, u), brackets(at.turns, v), np.eye(v.shape[-1])
        self._rate_by_v = ones + by_u / 2 + by_u @ by_u / 12
        twice = brackets(at.turns, np.einsum("...ij,...j->...i", by_u, v))
        self._rate_by_u = -by_v / 2 - (twice + by_u @ by_v) / 12
        self.rate = np.einsum("...ij,...j->...i", self._rate_by_v, v)
        self.along_rate = self._rate_by_u @ along_u + self._rate_by_v @ along_v

    def back(self, of_rate: np.ndarray, of_vdot: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of costates (B, m, nv) of the rate and of v̇ what second derivatives they weigh, and the costates of u and v."""
        n = of_rate.shape[-1]
        out = chained(self._along_all, self._along_all, self.accelerations.hessians(of_vdot))
        through = taken_back(of_vdot, self.accelerations.slopes)
        of_q = through[..., :n]
        out = out + weighed(self._moved, of_q, self._along_q, self._along_u) + self._of_rate(of_rate)
        of_u = taken_back(of_q, self._moved.differential) + taken_back(of_rate, self._rate_by_u)
        return out, of_u, through[..., n : 2 * n] + taken_back(of_rate, self._rate_by_v)

    def _of_rate(self, costate: np.ndarray) -> np.ndarray:
        """λ*∂²r of r = v + ½ [u, v] + 1/12 [u, [u, v]]."""
        by_u = brackets(self._turns, self._u)
        C = cobrackets(self._turns, costate)
        carried = cobrackets(self._turns, taken_back(costate, by_u))
        u_and_v = C / 2 + (C @ by_u[..., None, :, :] + carried) / 12
        u_and_u = -both_ways(C @ brackets(self._turns, self._v)[..., None, :, :]) / 12
        mixed = chained(self._along_u, self._along_v, u_and_v)
        return both_ways(mixed) + chained(self._along_u, self._along_u, u_and_u)


def weighed(moved: Moved, costate: np.ndarray, along_q: np.ndarray, along_u: np.ndarray) -> np.ndarray:
    """What the second derivatives of a motion's end on the group weigh, chained with the first ones of where it starts and goes."""
    mixed, own = moved.curvature(costate)
    return both_ways(chained(along_q, along_u, mixed)) + chained(along_u, along_u, own)
