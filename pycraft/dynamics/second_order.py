"""Second derivatives of accelerations, of the state equation and of a step, contracted with costates: the parts of quadratic models."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from .direct_calls import cached
from .displacements import Moved, brackets, cobrackets, displaced


def transposed(A: np.ndarray) -> np.ndarray:
    """Return the transposes over the last two axes."""
    return np.swapaxes(A, -1, -2)


def chained(first: np.ndarray, second: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Return first* `of` second (..., m, n, n) of first, second (..., k, n) and `of` (..., m, k, k)."""
    return transposed(first)[..., None, :, :] @ of @ second[..., None, :, :]


def both_ways(A: np.ndarray) -> np.ndarray:
    """Return A + A*."""
    return A + transposed(A)


def taken_back(costate: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Return slope* costate, for each of the costates (..., m, k): (..., m, n)."""
    return costate @ slope


def as_they_are(q: np.ndarray, rest: np.ndarray, _: float) -> tuple[np.ndarray, np.ndarray]:
    """Return q and rest unchanged: no motion is prescribed."""
    return q, rest


class Nominal(NamedTuple):
    """The state at which a model or scene is expanded.

    Attributes
    ----------
    q, rest : (B, nq), (B, m): states, `rest` the velocities and the effects' own states
    inputs : the coordinates whose generalized forces are inputs
    turns : slices of v with ball and free subhinges
    known : coordinates with prescribed motion
    implicit : names of effects that "semi-implicit-euler" treats implicitly
    rates : `Accelerations` as a function of q, rest and the elapsed seconds, or the counterpart of a scene
    placed : function of the same arguments, returns q and rest with prescribed coordinates placed
    """

    model: Any
    q: np.ndarray
    rest: np.ndarray
    inputs: list[int]
    turns: list[slice]
    rates: Callable[[np.ndarray, np.ndarray, float], Any]
    known: Sequence[int] = ()
    implicit: Sequence[str] = ()
    placed: Callable[[np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]] = as_they_are


class Accelerations:
    """v̇ = FD(q, v, τ) at states (B, ...), its derivatives along z = (q, v, τ), and contracted second derivatives.

    With T = ID(q, v, v̇) = τ, μ = (ℳ + J)⁻¹λ and G = ∂v̇/∂z, differentiating 0 = μ*(ID(q, v, FD) - τ) once more gives

        λ*∂²v̇/∂z∂z = -(∂²p/∂z∂z + ∂²p/∂z∂v̇ G + (∂²p/∂z∂v̇ G)*),    p = μ*ID(q, v, v̇)

    symmetrised along q: derivatives along quasi-velocities do not commute, and derivatives along exponential coordinates are their mean.
    Cost O(N · nv) per λ, and products of matrices.

    Source: S. Singh, R. Russell, P. Wensing, On second-order derivatives of rigid-body dynamics: theory and implementation, IEEE
    Transactions on Robotics 40 (2024); contraction as in cpp/dynamics/curvature.h.
    """

    def __init__(self, model: Any, how: dict[str, Any], tau: np.ndarray, q: np.ndarray, v: np.ndarray, _: float = 0.0):
        self._model, self._q, self._precision = model, q, how["precision"]
        self.rest = self._v = v
        self.value = model.forward_dynamics(q, v, tau, **how)
        self.slopes = np.concatenate(model.forward_dynamics_derivatives(q, v, tau, **how), axis=-1)

    def hessians(self, costate: np.ndarray) -> np.ndarray:
        """Return λ*∂²v̇/∂z∂z, (B, m, 3 nv, 3 nv), for λ (B, m, nv)."""
        n = self.slopes.shape[-2]
        inverse = self.slopes[..., 2 * n :]
        core = cached(self._model, "_curvature", _core.Curvature)
        mu = np.ascontiguousarray(costate @ inverse)
        return curved(core.inverse_dynamics(self._q, self._v, self.value, mu, self._precision), self.slopes)


def curved(along: np.ndarray, slopes: np.ndarray, forces: np.ndarray | None = None) -> np.ndarray:
    """Return λ*∂²/∂z∂z of rates, from blocks (B, m, 4, nv, nv) of p, first derivatives, v̇'s first, and forces missing in p (B, m, n,
    n)."""
    nv = along.shape[-1]
    out = np.zeros((*along.shape[:2], slopes.shape[-1], slopes.shape[-1]))
    qq, qv, with_vdot, vv = (along[..., i, :, :] for i in range(4))
    out[..., :nv, :nv], out[..., :nv, nv : 2 * nv], out[..., nv : 2 * nv, nv : 2 * nv] = qq / 2, qv, vv / 2
    out[..., :nv, :] += with_vdot @ slopes[..., None, :nv, :]
    if forces is not None:
        n = forces.shape[-1]
        out[..., :n, :n] -= forces / 2
    return 0.0 - both_ways(out)  # no -0


class StateEquation:
    """ẋ = (δq̇, v̇, ẏ) of displacements δq from the motion through the state, v, and effects' own states y, at states (B, ...).

        δq̇ = δv - ad(v₀) δq + ½ [δq, δv] + (third order),    v̇ as `Accelerations`

    since q = q₀(t) exp(δq) moves with J(δq) δq̇ = v - exp(-ad δq) v₀, where the terms in δq and δq cancel.
    """

    def __init__(self, at: Nominal):
        self._nv = at.model.nv
        states = self._nv + at.rest.shape[-1]
        self._turns, self._known, self._kept = at.turns, list(at.known), [*range(states), *(states + j for j in at.inputs)]
        self.rates = at.rates(at.q, at.rest, 0.0)

    def hessians(self, costate: np.ndarray) -> np.ndarray:
        """Return costate*∂²ẋ/∂(x, u)∂(x, u), (B, m, n + k, n + k), for costates (B, m, n) and k inputs."""
        n, of_q = self._nv, np.array(costate[..., : self._nv])
        of_q[..., self._known] = 0.0
        out = self.rates.hessians(costate[..., n:])
        turned = cobrackets(self._turns, of_q) / 2
        out[..., :n, n : 2 * n] += turned
        out[..., n : 2 * n, :n] += transposed(turned)
        return out[..., self._kept, :][..., self._kept]


STEPS: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "euler": ((0.0,), (1.0,)),
    "semi-implicit-euler": ((0.0,), (1.0,)),
    "rkmk4": ((0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
}
"""For each method of steps: the distance of each stage along the one before, and the weights."""


class Step:
    """One step of an integrator from states (B, ...), exact to second order: x = (δq, v) and inputs held over it to (δq⁺, v⁺).

    With q = q₀ exp(u), u = 0 at first, stage s advances by a part pₛ of the step h along the stage before, and

        rₛ = vₛ + ½ [uₛ, vₛ] + 1/12 [uₛ, [uₛ, vₛ]],    v̇ₛ = FD(q₀ exp(uₛ), vₛ, τ),    u⁺ = h Σ wₛ rₛ,    v⁺ = v + h Σ wₛ v̇ₛ

    or u⁺ = h v⁺, semi-implicit; the effects' own states advance as v does, prescribed coordinates are placed at every stage and at the end.
    Each of these maps has its first and second derivatives in closed form; first derivatives are chained forward, costates backward, and
    the second derivatives of all are summed between first ones: λ*∂²x⁺ = Σ (∂zₛ)* (λₛ*∂²zₛ₊₁) (∂zₛ). No finite differences.
    """

    def __init__(self, at: Nominal, dt: float, method: str):
        model, rest = at.model, at.rest
        self._dt, self._nv = dt, at.model.nv
        self._parts, self._weights = STEPS[method]
        self._implicit = method == "semi-implicit-euler"
        (states, m), n, k = rest.shape, model.nv, len(at.inputs)
        start = np.tile(np.eye(n + m, n + m + k), (states, 1, 1))
        for j in at.known:
            start[:, [j, n + j]] = 0.0
        given = np.zeros((states, n, n + m + k))
        given[:, at.inputs, range(n + m, n + m + k)] = 1.0
        self._stages: list[Stage] = []
        u, after, along_u, along_rest = np.zeros((states, n)), rest, np.zeros_like(given), start[:, n:]
        for part, weight in zip(self._parts, self._weights, strict=True):
            stage_u, stage_rest, along = np.zeros_like(u), rest, (np.zeros_like(given), start[:, n:])
            if part:
                last, h = self._stages[-1], part * dt
                stage_u, stage_rest = h * last.rate, rest + h * last.rates.value
                along = (h * last.along_rate, start[:, n:] + h * last.along_rates)
            stage = Stage(at, part * dt, stage_u, stage_rest, start[:, :n], *along, given)
            self._stages.append(stage)
            u, along_u = u + weight * dt * stage.rate, along_u + weight * dt * stage.along_rate
            after, along_rest = after + weight * dt * stage.rates.value, along_rest + weight * dt * stage.along_rates
        if self._implicit:
            u, along_u = dt * after[:, :n], dt * along_rest[:, :n]
        self._start, self._along_u = start[:, :n], along_u
        self._moved = Moved(at.turns, u)
        self.q, self.rest = at.placed(displaced(model, at.q, u), after, dt)
        self.slopes = np.concatenate([self._moved.adjoint @ self._start + self._moved.differential @ along_u, along_rest], axis=-2)

    def hessians(self, costate: np.ndarray) -> np.ndarray:
        """Return costate*∂²x⁺/∂(x, u)∂(x, u), (B, m, n + k, n + k), for costates (B, m, n) and k inputs."""
        n, h = self._nv, self._dt
        of_q, of_rest = costate[..., :n], np.array(costate[..., n:])
        out = weighed(self._moved, of_q, self._start, self._along_u)
        of_u = taken_back(of_q, self._moved.differential)
        if self._implicit:
            of_rest[..., :n] += h * of_u
            of_u = np.zeros_like(of_u)
        later_rate, later_rates = np.zeros_like(of_u), np.zeros_like(of_rest)
        for s in reversed(range(len(self._stages))):
            stage, weight = self._stages[s], self._weights[s] * h
            more, at_u, at_rest = stage.back(weight * of_u + later_rate, weight * of_rest + later_rates)
            out = out + more
            later_rate, later_rates = self._parts[s] * h * at_u, self._parts[s] * h * at_rest
        return out


class Stage:
    """A stage of a step: u and the rest there, the rates of both, and the derivatives of all along (x, inputs), (B, ..., n + k)."""

    def __init__(
        self, at: Nominal, later: float, u: np.ndarray, rest: np.ndarray, along_q: np.ndarray, along_u: np.ndarray, along_rest: np.ndarray,
        given: np.ndarray,
    ):  # fmt: skip
        self._moved = Moved(at.turns, u)
        self.rates = at.rates(displaced(at.model, at.q, u), rest, later)
        v = self.rates.rest[:, : u.shape[-1]]
        self._turns, self._v, self._u = at.turns, v, u
        self._along_q, self._along_u, self._along_v = along_q, along_u, along_rest[:, : u.shape[-1]]
        here = self._moved.adjoint @ along_q + self._moved.differential @ along_u
        self._along_all = np.concatenate([here, along_rest, given], axis=-2)
        self.along_rates = self.rates.slopes @ self._along_all
        by_u, by_v, ones = brackets(at.turns, u), brackets(at.turns, v), np.eye(v.shape[-1])
        self._rate_by_v = ones + by_u / 2 + by_u @ by_u / 12
        twice = brackets(at.turns, np.einsum("...ij,...j->...i", by_u, v))
        self._rate_by_u = -by_v / 2 - (twice + by_u @ by_v) / 12
        self.rate = np.einsum("...ij,...j->...i", self._rate_by_v, v)
        self.along_rate = self._rate_by_u @ along_u + self._rate_by_v @ self._along_v

    def back(self, of_rate: np.ndarray, of_rates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """From costates of the rates of u (B, m, nv) and of the rest, return the weighted second derivatives, and the costates of u and the
        rest."""
        n = of_rate.shape[-1]
        out = chained(self._along_all, self._along_all, self.rates.hessians(of_rates))
        through = taken_back(of_rates, self.rates.slopes)
        of_q, of_rest = through[..., :n], through[..., n : n + of_rates.shape[-1]]
        of_rest[..., :n] += taken_back(of_rate, self._rate_by_v)
        out = out + weighed(self._moved, of_q, self._along_q, self._along_u) + self._of_rate(of_rate)
        of_u = taken_back(of_q, self._moved.differential) + taken_back(of_rate, self._rate_by_u)
        return out, of_u, of_rest

    def _of_rate(self, costate: np.ndarray) -> np.ndarray:
        """Return λ*∂²r of r = v + ½ [u, v] + 1/12 [u, [u, v]]."""
        by_u = brackets(self._turns, self._u)
        C = cobrackets(self._turns, costate)
        carried = cobrackets(self._turns, taken_back(costate, by_u))
        u_and_v = C / 2 + (C @ by_u[..., None, :, :] + carried) / 12
        u_and_u = -both_ways(C @ brackets(self._turns, self._v)[..., None, :, :]) / 12
        mixed = chained(self._along_u, self._along_v, u_and_v)
        return both_ways(mixed) + chained(self._along_u, self._along_u, u_and_u)


def weighed(moved: Moved, costate: np.ndarray, along_q: np.ndarray, along_u: np.ndarray) -> np.ndarray:
    """Return the weighted second derivatives of a motion's end on the group, chained with the first derivatives of its start and
    direction."""
    mixed, own = moved.curvature(costate)
    return both_ways(chained(along_q, along_u, mixed)) + chained(along_u, along_u, own)
