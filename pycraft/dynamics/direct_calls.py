"""The direct calls of a model, values without algebra: arrays in, arrays out."""

from __future__ import annotations

import copyreg
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core
from ..arguments import chosen, text
from ..state import at_state
from .by_realization import by_realization, output
from .jacobians import resolved_jacobian
from .prepared import direct, prepared, told
from .threads import over_threads


def cached(model: Any, name: str, make: Callable[[Any], Any]) -> Any:
    """Return an object that is built at the first call and cached on the model."""
    if name not in model.__dict__:
        setattr(model, name, make(model))
    return getattr(model, name)


def by_method(model: Any, method: str, q, v, tau, precision: str | int, out, threads: int) -> np.ndarray:
    """Return forward dynamics by another method than the articulated-body recursion."""
    if method == "realization":
        return by_realization(model, q, v, tau, precision, out)
    return cached(model, "_methods", _core.Methods).forward_dynamics(method, q, v, tau, precision, out, threads)


class DirectCalls:
    """Forward and inverse dynamics, mass matrix, Jacobians, energies.

    Each takes one state or a leading batch axis (B, ...); an argument of one state beside a batch applies to all states. q may be a State,
    which brings its v; without q the call uses the model's present state, `arm.q` and `arm.v`, as expressions do; beside an array q,
    omitted velocities, forces and accelerations are zero. SI units and radians. Generalized velocities of ball and free hinges are in the
    axes of the body that the hinge moves, angular first. Results are float64, in `out` (writeable, C-ordered) if given. `threads`
    distributes the states of a batch over that many threads, for a single state of a large tree its subtrees (forward and inverse dynamics,
    bias forces, double precision), or the pieces of "divide-and-conquer"; every state has the same bits as with one thread.
    Every call raises a ModelError that names an argument of the wrong shape or with an entry that is not finite, and an EvaluationError for
    an unknown option or a result that overflows; in a batch the error names the state.
    """

    nv: int

    def _calls(self) -> _core.Dynamics:
        return cached(self, "_direct", _core.Dynamics)

    @direct
    @over_threads
    def forward_dynamics(
        self,
        q=None,
        v=None,
        tau=None,
        *,
        form: str = "fast",
        refine: int | str = 0,
        residual: str = "same",
        precision: str | int = "double",
        method: str = "articulated",
        on_singular: str = "raise",
        threads: int = 1,
        out=None,
    ) -> np.ndarray:
        """Return accelerations v̇ under generalized forces, gravity included: articulated-body algorithm, O(N).

        Parameters
        ----------
        q, v, tau : (nq,), (nv,), (nv,), each with an optional leading batch axis
            Coordinates (rad, m), velocities (rad/s, m/s), generalized forces (N m, N). Batches of the forms "fast" and "ud" run in packs.
        form : {"fast", "ud", "square-root"}
            Representation of the articulated inertia: P, U diag(w) U*, or L L*. The factored forms keep the digits of light bodies beside
            heavy ones; they cost about three and four times as much.
        refine : int or "auto"
            Corrections by the residual of inverse dynamics, with gravity and Coriolis terms inside the sweep; "auto" applies them as long
            as they shrink. A correction at the level of its residual's rounding is left out.
        residual : {"same", "gather", "wider"}
            The residual of a refinement at the same precision; with the forces gathered in the next wider one, where stretched chains lose
            their digits; or entirely in the next wider one. Ignored without refinement.
        precision : {"single", "double", "extended", "quad", 50, 100}
            The scalar of the whole computation; results are rounded to double.
        method : {"articulated", "cholesky", "ldl", "conjugate-gradients", "inverse", "divide-and-conquer", "realization"}
            "articulated" is the O(N) recursion; "divide-and-conquer" joins pieces of the tree in pairs, O(N) on a critical path of O(log
            N), in threads (see docs/divide_and_conquer.md); the others solve the equations of motion by the mass matrix (see
            docs/accuracy.md). Only "articulated" accepts a form and a refinement.
        on_singular : {"raise", "minimum-norm"}
            At a hinge that feels no inertia: raise an error that names it, or return the accelerations of least norm among those that fit
            the forces best.

        Returns
        -------
        (nv,) or (B, nv), rad/s² and m/s²

        Raises
        ------
        SingularHingeError
            D(k) is singular at the rounding bound of the form in use.
        SingularOperatorError
            With the other methods: the mass matrix is not positive definite to rounding; "divide-and-conquer" has lost its digits.
        RefinementError
            The first correction exceeds 0.3 of the solution, or the corrections do not shrink.

        Source: articulated-body forward dynamics by the operator factorization of the mass matrix [Jain 2011].

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.forward_dynamics([0, 0], [0, 0], [1, 0]).round(3).tolist()
        [1.714, -4.286]
        """
        q, v = at_state(self, q, v)
        tau = np.zeros(self.nv) if tau is None else tau
        if isinstance(method, str) and method == "articulated":
            how = form, refine, chosen(residual, "residual"), precision, chosen(on_singular, "on_singular")
            return self._calls().forward_dynamics(q, v, tau, *how, out, threads)
        if not isinstance(method, str):
            raise _core.EvaluationError(f"method={method!r}: give a name, 'articulated', 'cholesky', ...")
        if form != "fast" or refine != 0 or residual != "same" or on_singular != "raise":
            raise _core.EvaluationError(f"method {method!r} takes no form=, refine=, residual= or on_singular=; only 'articulated' does")
        return by_method(self, method, q, v, tau, precision, out, threads)

    def prepare(self, call: str, *, batch: int | None = None, **options: Any) -> Callable[..., Any]:
        """Return a direct call for use in loops, with its options read once: it takes positional arrays, and `out=`.

        Parameters
        ----------
        call : {"forward_dynamics", "inverse_dynamics", "bias_forces", "mass_matrix", "mass_matrix_inverse", "jacobian", "pose", \
"coriolis_matrix", "operational_space_inertia", "operational_space_compliance", "inverse_dynamics_derivatives", \
"forward_dynamics_derivatives", "hybrid_dynamics"}
        batch : int, optional
            Number of states in every call; each argument then has a leading axis of that length or applies to all. Default: one state per
            call.
        options
            Options of the call itself: form, refine, residual, precision, on_singular; frame=, a name, for calls of a frame; prescribed=,
            names, for hybrid dynamics.

        Returns
        -------
        callable
            Its arguments are q, v, tau for forward dynamics and its derivatives; q, v, vdot for inverse dynamics and its derivatives; q, v
            for bias forces and Coriolis matrices; q, v, tau, vdot for hybrid dynamics; q for the others; each except derivatives and hybrid
            dynamics accepts out=. Contiguous float64 arrays cost least. It follows later edits of the model. It raises ModelError for a
            different number of states, and the errors of the call itself.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> accelerations = arm.prepare("forward_dynamics", form="ud")
        >>> accelerations(np.zeros(2), np.zeros(2), np.array([1.0, 0.0])).round(3).tolist()
        [1.714, -4.286]
        """
        return prepared(self, call, batch, options)

    def refinement(
        self,
        q=None,
        v=None,
        tau=None,
        *,
        form: str = "fast",
        refine: int | str = "auto",
        residual: str = "same",
        precision: str | int = "double",
    ) -> dict[str, Any]:
        """Return forward dynamics of one state with its corrections; arguments and errors as in `forward_dynamics`.

        `value` (nv,), rad/s² and m/s²; `steps`, the number of corrections computed; `corrections`, the largest entry of each over the
        largest of the solution, or over its own if larger, so at most 1; `error`, None without a correction: the estimate of ‖value -
        exact‖ / ‖value‖, 2-norms. It is the last correction, applied or left out, or the floor if that is larger: the most that the
        rounding of velocities, poses, motions and forces in the residual can make of a correction. It may be far above the true error, for
        instance if the value is better than any residual in this precision can tell; if accelerations cancel to nothing it exceeds 1. O(N)
        per correction. ModelError for a batch, since each state has its own corrections.

        Examples
        --------
        >>> import pycraft as pc
        >>> found = pc.chain(2).refinement([0, 0], [0, 0], [1, 0], refine=1)
        >>> found["steps"], found["corrections"][0] < 1e-14
        (1, True)
        """
        q, v = at_state(self, q, v)
        tau = np.zeros(self.nv) if tau is None else tau
        value, corrections, error = self._calls().refinement(q, v, tau, form, refine, chosen(residual, "residual"), precision)
        return {"value": value, "steps": len(corrections), "corrections": corrections, "error": error}

    @direct
    @over_threads
    def inverse_dynamics(self, q=None, v=None, vdot=None, *, precision: str | int = "double", threads: int = 1, out=None) -> np.ndarray:
        """Return generalized forces (nv,) or (B, nv), N m and N, for the accelerations vdot, gravity and rotor inertia included.

        Newton-Euler, O(N) [Jain 2011, inverse dynamics]. In precision "single" to "quad".
        """
        q, v = at_state(self, q, v)
        return self._calls().inverse_dynamics(q, v, vdot, precision, out, threads)

    @direct
    @over_threads
    def bias_forces(self, q=None, v=None, *, precision: str | int = "double", threads: int = 1, out=None) -> np.ndarray:
        """Return Coriolis, gyroscopic and gravity forces 𝒞 (nv,) or (B, nv), N m and N: inverse dynamics at zero acceleration. O(N).

        The equations of motion are ℳ(q) v̇ + 𝒞(q, v) = τ [Jain 2011]. In precision "single" to "quad".

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.bias_forces([0, 0], [1, 1]).tolist()  # no gravity, stretched: nothing
        [0.0, 0.0]
        """
        q, v = at_state(self, q, v)
        return self._calls().inverse_dynamics(q, v, None, precision, out, threads)

    @direct
    @over_threads
    def mass_matrix(self, q=None, *, precision: str | int = "double", threads: int = 1, out=None) -> np.ndarray:
        """Return the mass matrix ℳ + J = HφMφ*H* + J of the equations of motion, full symmetric (nv, nv) or (B, nv, nv).

        Rotor inertia J included. kg m² between angles, kg m and kg for entries of travels. Composite bodies, O(N²) [Jain 2011]. Precisions
        "single" to "quad".

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).mass_matrix([0, 0]).round(4).tolist()
        [[2.6667, 0.8333], [0.8333, 0.3333]]
        """
        return self._calls().mass_matrix(at_state(self, q)[0], precision, out)

    @direct
    @over_threads
    def mass_matrix_inverse(
        self,
        q=None,
        *,
        form: str = "fast",
        refine: int | str = 0,
        residual: str = "same",
        precision: str | int = "double",
        on_singular: str = "raise",
        threads: int = 1,
        out=None,
    ) -> np.ndarray:
        """Return the inverse of `mass_matrix`, full symmetric (nv, nv) or (B, nv, nv), by the innovations factors: O(N) per column.

        (ℳ + J)⁻¹ = [I - HψK]* D⁻¹ [I - HψK] [Jain 2011]. Options and errors as in forward_dynamics; on_singular="minimum-norm" gives the
        pseudoinverse.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).mass_matrix_inverse([0, 0]).round(3).tolist()
        [[1.714, -4.286], [-4.286, 13.714]]
        """
        how = form, refine, chosen(residual, "residual"), precision, chosen(on_singular, "on_singular")
        return self._calls().mass_matrix_inverse(at_state(self, q)[0], *how, out)

    @direct
    @over_threads
    def jacobian(
        self,
        frame: str,
        q=None,
        *,
        axes: str = "body",
        relative_to: str | None = None,
        precision: str | int = "double",
        threads: int = 1,
        out=None,
    ) -> np.ndarray:
        """Return the Jacobian (6, nv) or (B, 6, nv) of the spatial velocity of a body or node, by its name: O(N).

        J v is the velocity (angular rad/s, then linear m/s) of the frame relative to `relative_to`, a body or node by name, default: the
        world. `axes` selects the axes and the point of the linear velocity:

        "body"     the frame's own axes, its origin
        "aligned"  the axes of `relative_to`, the frame's origin
        "world"    the axes of `relative_to`, the point of the frame that is at its origin

        ModelError for an unknown body or node, EvaluationError for unknown axes. Precisions "single" to "quad".

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.jacobian("body1", [0, 0])[[2, 4]].tolist()  # the second body: turning about z, moving along y
        [[1.0, 1.0], [1.0, 0.0]]
        >>> arm.jacobian("body1", [0, 0], relative_to="body0")[[2, 4]].tolist()  # against the first body: turning alone
        [[0.0, 1.0], [0.0, 0.0]]
        """
        frame, q = text(frame, "a frame"), at_state(self, q)[0]
        if relative_to is None and isinstance(axes, str) and axes == "body":
            return self._calls().jacobian(frame, q, precision, out)
        result = resolved_jacobian(self, frame, q, axes, relative_to, precision)
        if out is None:
            return result
        out = output(out, result.shape)
        out[...] = result
        return out

    @direct
    @over_threads
    def pose(self, frame: str, q=None, *, threads: int = 1) -> np.ndarray:
        """Return the pose (4, 4) or (B, 4, 4) of a body or node, by its name, in the world: its axes as columns, its origin in metres.
        O(N).

        ModelError for an unknown body or node.

        Examples
        --------
        >>> import pycraft as pc
        >>> pc.chain(2).pose("body1", [0, 0])[:3, 3].tolist()
        [1.0, 0.0, 0.0]
        """
        return self._calls().pose(text(frame, "a frame"), at_state(self, q)[0])

    @over_threads
    def kinetic_energy(self, q=None, v=None, *, threads: int = 1) -> np.ndarray:
        """Return ½ v·(ℳ + J)v, in joules, a number or (B,). O(N).

        Examples
        --------
        >>> import pycraft as pc
        >>> round(float(pc.chain(2).kinetic_energy([0, 0], [1, 0])), 4)
        1.3333
        """
        return self._calls().energy(*at_state(self, q, v), (0.0, 0.0, 0.0))[..., 0]

    @over_threads
    def potential_energy(self, q=None, *, datum=(0.0, 0.0, 0.0), threads: int = 1) -> np.ndarray:
        """Return the energy -m g·(c - datum) in the uniform gravity field, c the centre of mass. Joules, a number or (B,).

        Summed outboard to inboard and rounded once, so that its error is the rounding of a double of its size. Far from the datum, (3,) in
        the world's axes, m, differences of energies fall below that: choose a datum near the system. O(N).

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(1)
        >>> arm.gravity = (-9.81, 0, 0)
        >>> round(float(arm.potential_energy([0])), 4)  # 1 kg, 0.5 m up
        4.905
        """
        q = _core.real_array(at_state(self, q)[0], "q")
        return self._calls().energy(q, np.zeros((*q.shape[:-1], self.nv)), datum)[..., 1]


copyreg.pickle(type(vars(DirectCalls)["forward_dynamics"]), told)
