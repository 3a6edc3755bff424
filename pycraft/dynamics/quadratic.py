"""Quadratic models of the equations of motion near states, and of steps of integrators: exact, on the group."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..arguments import first_not_finite
from ..closed import Closed
from ..linear.linear_model import LinearModel
from ..state import State, at_state
from .displacements import turning
from .linearization import LinearizationCalls
from .second_order import STEPS, Accelerations, Nominal, StateEquation, Step


class Hessian(NamedTuple):
    """Second derivatives by states and states, states and inputs, inputs and inputs.

    For one function (n, n), (n, k), (k, k); for the rates of states with one more axis before these, for a batch of states with one before
    all.
    """

    xx: np.ndarray
    xu: np.ndarray
    uu: np.ndarray


class QuadraticModel(Closed):
    """δẋ = A δx + B δu + ½ (δx, δu)*∂²ẋ(δx, δu) near a state; with `dt`, the same of δx⁺ after a step of an integrator.

    The states are x = (δq, v): δq are exponential coordinates about the motion through the state, q = q₀ exp(δq), as `integrate` takes them
    and `difference` returns them. For a batch of states all arrays have a leading axis. Second derivatives are computed from the model on
    demand: make a new quadratic model after an edit.

    Attributes
    ----------
    linear : LinearModel, the first order, with its names and arrays as `states`, `inputs`, `A`, `B`
    after : State, the end of a step; None for continuous time
    states_after : (own,), the effects' own states of a scene there; None for continuous time
    """

    def __init__(
        self, linear: LinearModel, curvature: Any, at: Nominal, after: State | None = None, states_after: np.ndarray | None = None
    ):
        self._linear, self._curvature, self._at, self._after, self._states_after = linear, curvature, at, after, states_after

    @property
    def linear(self) -> LinearModel:
        """The model to first order."""
        return self._linear

    @property
    def A(self) -> np.ndarray:
        """(n, n)"""
        return self._linear.A

    @property
    def B(self) -> np.ndarray:
        """(n, k)"""
        return self._linear.B

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return self._linear.states

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return self._linear.inputs

    @property
    def dt(self) -> float | None:
        """s, of a step; None for continuous time."""
        return self._linear.dt

    @property
    def after(self) -> State | None:
        """The end of the step."""
        return self._after

    @property
    def states_after(self) -> np.ndarray | None:
        """The effects' own states of a scene at the end of the step, (own,): empty for a model."""
        return self._states_after

    def contracted(self, costate: Any) -> Hessian:
        """Return the Hessian of costate*ẋ, or costate*x⁺, as differential dynamic programming needs it: no tensor is formed.

        costate : (n,), or (B, n) beside a batch of states. Cost O(N · nv), and products of matrices (n, n); for a step per stage. For a
        scene with effects that exert forces O(N · n²).

        ModelError for a costate of another size, or with entries that are not finite.
        """
        given, n = _core.real_array(costate, "costate"), len(self.states)
        batch = self.A.shape[:-2]
        if given.shape not in {(n,), (*batch, n)}:
            shapes = " or ".join(dict.fromkeys((f"({n},)", str((*batch, n)))))
            names = ", ".join(self.states[:12]) + (", ..." if n > 12 else "")
            raise _core.ModelError(f"costate of {self._linear.model.name!r} takes {shapes} values, of {names}; it has shape {given.shape}")
        if bad := first_not_finite(given):
            raise _core.ModelError(f"costate: entry {bad[0][0]} is not finite{bad[2]}")
        states = batch[0] if batch else 1
        found = self._curvature.hessians(np.broadcast_to(given, (states, n))[:, None, :])[:, 0]
        return self._cut(found if batch else found[0])

    def tensors(self) -> Hessian:
        """Return ∂²ẋ, or ∂²x⁺, whole: (n, n, n), (n, n, k), (n, k, k), the first index the rate's component. O(N · nv²) and products."""
        batch, n = self.A.shape[:-2], len(self.states)
        states = batch[0] if batch else 1
        found = self._curvature.hessians(np.broadcast_to(np.eye(n), (states, n, n)))
        return self._cut(found if batch else found[0])

    def _cut(self, whole: np.ndarray) -> Hessian:
        n = len(self.states)
        return Hessian(whole[..., :n, :n], whole[..., :n, n:], whole[..., n:, n:])

    def discrete(self, dt: float, integrator: str = "rkmk4") -> QuadraticModel:
        """Return the model of one step of dt seconds with inputs held, exact to second order, by the chain rule over the integrator's
        stages.

        Parameters
        ----------
        dt : s
        integrator : {"euler", "semi-implicit-euler", "rkmk4"}
            q⁺ = q exp(h v) and v⁺ = v + h v̇; q⁺ = q exp(h v⁺), the core's "semi-implicit-euler" without implicit effects; the classical
            method of order 4 in exponential coordinates, the core's "rkmk4", which equals its "rk4" without ball and free hinges.

        Returns
        -------
        QuadraticModel : of the step, with its end as `.after`

        Raises
        ------
        EvaluationError
            An unknown integrator, a step that is not a positive number, a model that is already discrete; "semi-implicit-euler" for a scene
            with effects that it would treat implicitly.
        SingularHingeError
            As `forward_dynamics`, at a stage.
        """
        h = self._linear.step_of(dt, "quadratic")
        if integrator not in tuple(STEPS):
            raise _core.EvaluationError(f"integrator={integrator!r}: steps to second order exist for {', '.join(map(repr, STEPS))}")
        if integrator == "semi-implicit-euler" and self._at.implicit:
            named = ", ".join(map(repr, self._at.implicit))
            raise _core.EvaluationError(f"integrator='semi-implicit-euler' takes {named} at the end of a step: 'rkmk4' and 'euler' do not")
        step, linear = Step(self._at, h, integrator), self._linear
        n, nv, batch = len(linear.states), self._at.model.nv, self.A.ndim == 3
        slopes, q, rest = (x if batch else x[0] for x in (step.slopes, step.q, step.rest))
        discrete = replace(linear, A=slopes[..., :n], B=slopes[..., n:], dt=h)
        return QuadraticModel(discrete, step, self._at, State(q, rest[..., :nv]), rest[..., nv:])

    def __repr__(self) -> str:
        return repr(self._linear).replace("linear", "quadratic", 1)


class QuadraticCalls(LinearizationCalls):
    """Quadratic models of a model's equations of motion."""

    def quadratic_model(
        self, q=None, v=None, tau=None, *, inputs: Any = None, form: str = "fast", precision: str = "double"
    ) -> QuadraticModel:
        """Return the model of v̇ = forward_dynamics(q, v, τ) to second order near a state, or near each of a batch, as iLQR and DDP need
        it.

        `linearize` is its first order. To second order

            δq̇ = δv - ad(v₀) δq + ½ [δq, δv],    δv̇ = G z + ½ z*∂²v̇ z,    z = (δq, δv, δτ),

        with the bracket of ball and free hinges, zero elsewhere, and ∂²v̇ along exponential coordinates, exact by derivatives of the closed
        forms of inverse dynamics. For the model with generalized forces τ and gravity; `Scene.quadratic_model` includes effects.

        Parameters
        ----------
        q, v, tau : (nq,), (nv,), (nv,), each with an optional leading batch axis; defaults as in `forward_dynamics`
        inputs : names of hinges, coordinates or patterns, or a list of them, whose generalized forces are inputs; None: all
        form, precision : as in `forward_dynamics`, for accelerations and first derivatives; up to "quad". Intermediate results are rounded
            to double.

        Returns
        -------
        QuadraticModel : A (2 nv, 2 nv), B (2 nv, k); `contracted(costate)`, `tensors()`, `discrete(dt, integrator)`

        Raises
        ------
        ModelError
            Unknown names.
        SingularHingeError
            As `forward_dynamics`.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(1)
        >>> arm.gravity = (9.81, 0, 0)  # along the rod at q = 0: v̇ = 3 τ - 14.715 sin q
        >>> near = arm.quadratic_model([0.5], [0.0])
        >>> near.contracted([0.0, 1.0]).xx.round(4).tolist()  # 14.715 sin(0.5)
        [[7.0547, 0.0], [0.0, 0.0]]
        >>> near.discrete(0.01)
        <quadratic model: 'chain of 1 rods', 2 states, 1 inputs, 2 outputs, step 0.01 s>
        """
        model: Any = self
        q, v = at_state(model, q, v)
        tau = np.zeros(self.nv) if tau is None else tau
        linear = self.linearize(q, v, tau, inputs=inputs, form=form, precision=precision)
        given = [np.asarray(x, float) for x in (getattr(q, "q", q), v, tau)]
        states = len(linear.A) if linear.A.ndim == 3 else 1
        q, v, tau = (np.broadcast_to(x, (states, x.shape[-1])) for x in given)
        chosen = [model.coordinate_names.index(name.removeprefix("tau.")) for name in linear.inputs]
        rates = partial(Accelerations, model, {"form": form, "precision": precision}, tau)
        at = Nominal(model, q, v, chosen, turning(model), rates)
        return QuadraticModel(linear, StateEquation(at), at)
