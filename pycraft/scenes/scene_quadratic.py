"""Quadratic models of scenes near states and along runs, including their effects."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import of_state
from ..dynamics.displacements import turning
from ..dynamics.quadratic import QuadraticModel
from ..dynamics.second_order import Nominal, StateEquation, curved
from ..state import moment_of
from .linearized import known_coordinates, linearize, solved


def quadratic_model(scene: Any, q: Any, v: Any, t: Any, *, states: Any, inputs: Any) -> QuadraticModel:
    """`Scene.quadratic_model`."""
    if scene._keeps_loops():
        raise _core.EvaluationError(
            f"scene of {scene.model.name!r}: it keeps loops, which quadratic models do not support; linearize gives the first order"
        )
    model, (t, states) = scene.model, moment_of(q, t, states)
    linear = linearize(scene, q, v, t, states=states, inputs=inputs, outputs=None, dt=None, method="zoh", independent=None)
    count = len(linear) if linear.A.ndim == 3 else 1
    q, v = (np.broadcast_to(x, (count, x.shape[-1])) for x in (linear.q, linear.v))
    own = np.zeros(0) if states is None else np.atleast_1d(_core.real_array(states, "states"))
    given = np.broadcast_to(own, (count, own.shape[-1]))
    begun = SceneRates(scene, q, np.hstack([v, given]), np.broadcast_to(np.asarray(linear.t, float), (count,)), between=False)
    chosen = [model.coordinate_names.index(name.removeprefix("tau.")) for name in linear.inputs]
    at = Nominal(model, begun.q, begun.rest, chosen, turning(model), begun.later, begun.known, begun.implicit, begun.placed)
    return QuadraticModel(linear, StateEquation(at), at)


class SceneRates:
    """(v̇, ẏ) of a scene at states (B, ...), their derivatives along z = (displacements, v, y, τ), and second ones contracted.

    With F = ID(q, v, v̇) - T(q, v, y) of the free coordinates, T the effects' forces, μ = (ℳ + J)⁻*λ and G = ∂(v̇, ẏ)/∂z

        λ*∂²(v̇, ẏ)/∂z∂z = -(∂²p/∂z∂z + ∂²p/∂z∂v̇ G + (∂²p/∂z∂v̇ G)*) + ∂²(μ*T + λ*ẏ)/∂z∂z,    p = μ*ID

    as in `pycraft.dynamics.second_order.Accelerations` for a model. Known coordinates follow their motion.

    Attributes
    ----------
    q, rest : (B, nq), (B, nv + own): the states, v and then y
    value, slopes : (B, nv + own), (B, nv + own, 3 nv + own)
    """

    def __init__(self, scene: Any, q: np.ndarray, rest: np.ndarray, t: np.ndarray, between: bool = True):
        """between : True between the ends of a step, where controllers take no samples; else `rest` may be only v, with the initial y."""
        self._scene, self._t, calls = scene, t, scene._calls()
        self._nv = nv = scene.model.nv
        states = zip(q, rest[:, :nv], t.tolist(), rest[:, nv:].tolist(), strict=True)
        self._found = []
        for b, state in enumerate(states):
            with of_state(b, len(q)):
                self._found.append(_core.scene_linearized(calls, *state, between))
        own = len(self._found[0]["own"]) if self._found else rest.shape[-1] - nv
        stacked = lambda name, *shape: np.array([one[name] for one in self._found]).reshape(len(q), *shape)
        self.q, self.value = stacked("q", q.shape[-1]), stacked("rates", nv + own)
        self.rest = np.hstack([stacked("v", nv), stacked("own", own)])
        self.slopes = np.zeros((len(q), nv + own, 3 * nv + own))
        for slopes, one in zip(self.slopes, self._found, strict=True):
            given = np.eye(nv + own, nv)
            given[known_coordinates(one)] = 0.0
            slopes[:] = solved(one, given)
        self._curvature(np.zeros((len(q), 0, nv + own)))  # refuses states without second derivatives

    @property
    def known(self) -> list[int]:
        """Prescribed coordinates."""
        return known_coordinates(self._found[0]) if self._found else []

    @property
    def implicit(self) -> list[str]:
        """Effects that steps may treat implicitly."""
        return self._found[0]["implicit"] if self._found else []

    def later(self, q: np.ndarray, rest: np.ndarray, seconds: float) -> SceneRates:
        """Return the same at other states, at a later time."""
        return SceneRates(self._scene, q, rest, self._t + seconds)

    def placed(self, q: np.ndarray, rest: np.ndarray, seconds: float) -> tuple[np.ndarray, np.ndarray]:
        """Return q and rest with known coordinates set by their motion at a later time."""
        if not self.known:
            return q, rest
        there = self.later(q, rest, seconds)
        return there.q, there.rest

    def hessians(self, costate: np.ndarray) -> np.ndarray:
        """Return λ*∂²(v̇, ẏ)/∂z∂z, (B, m, 3 nv + own, 3 nv + own), for λ (B, m, nv + own)."""
        mass = np.array([one["mass"] for one in self._found]).reshape(len(costate), *2 * costate.shape[-1:])
        along, forces = self._curvature(np.swapaxes(np.linalg.solve(np.swapaxes(mass, -1, -2), np.swapaxes(costate, -1, -2)), -1, -2))
        return curved(along, self.slopes, forces)

    def _curvature(self, mu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        (count, m, rows), nv, calls = mu.shape, self._nv, self._scene._calls()
        along, forces = np.zeros((count, m, 4, nv, nv)), np.zeros((count, m, nv + rows, nv + rows))
        for b in range(count):
            q, v, own, vdot = self.q[b], self.rest[b, :nv], self.rest[b, nv:].tolist(), self.value[b, :nv]
            forces[b], along[b] = _core.scene_curvature(calls, q, v, float(self._t[b]), own, vdot, np.ascontiguousarray(mu[b]))
        return along, forces
