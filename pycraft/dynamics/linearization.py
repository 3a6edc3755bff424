"""Linear models of the equations of motion near states: exact, on the group."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..arguments import several, switch
from ..linear.linear_model import LinearModel, names_of_states
from ..state import at_state
from .displacements import brackets, turning

OUTPUTS = ("q", "v", "vdot", "position", "rotation", "velocity")
"""Kinds of outputs: of coordinates, then of bodies and nodes."""
AXES = {"position": ("x", "y", "z"), "rotation": ("rx", "ry", "rz"), "velocity": ("rx", "ry", "rz", "x", "y", "z")}


class LinearizationCalls:
    """Linear models of a model's equations of motion."""

    nv: int
    forward_dynamics: Callable[..., Any]
    forward_dynamics_derivatives: Callable[..., Any]

    def linearize(
        self, q=None, v=None, tau=None, *, inputs: Any = None, outputs: Any = None, form: str = "fast", precision: str = "double",
        dt: float | None = None, method: str = "zoh", loops: bool = False, independent: Any = None,
    ) -> LinearModel:  # fmt: skip
        """Return the linear model of v̇ = forward_dynamics(q, v, τ) near a state, or near each of a batch: δẋ = A δx + B δu, x = (q, v).

        δq are displacements on the group, as `integrate` takes them, from the motion through the state: with v₀ the velocity there, δq̇ =
        δv - ad(v₀) δq, where ad is nonzero only on ball and free hinges (the bracket of their twists). So

            A = [[-ad(v₀), 1], [∂v̇/∂q, ∂v̇/∂v]],   B = [[0], [(ℳ + J)⁻¹]],

        exact by the derivatives of forward dynamics, gravity and rotor inertia included. O(nv²) entries in O(N · depth).

        Parameters
        ----------
        q, v, tau : (nq,), (nv,), (nv,), each with an optional leading batch axis; defaults as in `forward_dynamics`
        inputs : names of hinges, coordinates or patterns, or a list of them, whose generalized forces are inputs; None: all
        outputs : list of names; None: the states themselves
            "q.elbow", "v.elbow", "vdot.elbow" of coordinates; "position.hand" (3 rows, world axes), "rotation.hand" (3, a small rotation,
            the frame's axes), "velocity.hand" (6, the frame's axes, angular first) of bodies and nodes.
        form, precision : as in `forward_dynamics`
        dt, method : s, for a discrete model, and its method (`LinearModel.discrete`)
        loops : whether to keep the loops: linearize `constrained_dynamics`, at a state on them, in independent coordinates (docs/loops.md)
            States are then the displacements and velocities of as many coordinates as there are freedoms; if some rows are of velocities
            (rolling), there are more displacements than velocities.
        independent : names of the coordinates with displacements as states, with loops=True; None or an empty list: those that determine
            the others best

        Returns
        -------
        LinearModel : A (2 nv, 2 nv), B (2 nv, m), C, D; `.rate` is ẋ at the state, zero at an equilibrium; on loops fewer states,
            and `.tangent` (2 nv, n)

        Raises
        ------
        ModelError
            Unknown names; with loops a state off them, coordinates that do not determine the others.
        EvaluationError
            With loops: a singular state; a coupling by a function of coordinates that move.
        SingularHingeError
            As `forward_dynamics`.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(1)
        >>> arm.gravity = (9.81, 0, 0)  # along the rod: it hangs
        >>> hanging = arm.linearize([0.0], [0.0])
        >>> hanging.A.round(4).tolist(), hanging.B.round(4).tolist()
        ([[0.0, 1.0], [-14.715, 0.0]], [[0.0], [3.0]])
        >>> round(hanging.modes()[0]["natural"], 4)  # √(3g/2)/2π Hz
        0.6105
        """
        model: Any = self
        q, v = at_state(model, q, v)
        tau = np.zeros(self.nv) if tau is None else tau
        how = {"form": form, "precision": precision}
        chosen = list(range(self.nv)) if inputs is None else _core.coordinates_named(model, listed(inputs, "inputs"), "inputs")
        names = model.coordinate_names
        named = tuple(f"tau.{names[j]}" for j in chosen)
        if switch(loops, "loops"):
            from .linear_on_loops import linearize_on_loops

            made = linearize_on_loops(model, q, v, tau, chosen, named, outputs, independent, how)
            return made if dt is None else made.discrete(dt, method)
        if independent is not None:
            raise _core.ModelError("independent: coordinates of a tree are all independent; use loops=True to keep its loops")
        dq, dv, inverse = self.forward_dynamics_derivatives(q, v, tau, **how)
        vdot = self.forward_dynamics(q, v, tau, **how)
        v = np.asarray(getattr(v, "v", v), float)
        made = linear_model(model, q, v, vdot, dq, dv, inverse[..., chosen], named, outputs, names_of_states(names))
        return made if dt is None else made.discrete(dt, method)


def linear_model(
    model: Any, q: Any, v: np.ndarray, rates: np.ndarray, along_q: np.ndarray, along_rest: np.ndarray, along_inputs: np.ndarray,
    inputs: tuple[str, ...], outputs: Any, states: tuple[str, ...], t: float = 0.0, known: Sequence[int] = (),
) -> LinearModel:  # fmt: skip
    """Return the model from the rates of (v, y), y other states (..., k), and their derivatives along displacements, (v, y) and inputs.

    known : coordinates with prescribed motion; their displacements stay constant
    """
    q = np.asarray(getattr(q, "q", q), float)
    nv, k = model.nv, rates.shape[-1]
    batch = np.broadcast_shapes(rates.shape[:-1], along_q.shape[:-2])
    A = np.zeros((*batch, nv + k, nv + k))
    B = np.zeros((*batch, nv + k, along_inputs.shape[-1]))
    A[..., :nv, :nv] = -brackets(turning(model), v)
    A[..., :nv, nv : 2 * nv] = np.eye(nv)
    for j in known:
        A[..., j, :] = 0.0
    A[..., nv:, :nv], A[..., nv:, nv:], B[..., nv:, :] = along_q, along_rest, along_inputs
    A += 0.0  # no -0
    rate = np.concatenate([np.broadcast_to(v, (*batch, nv)), np.broadcast_to(rates, (*batch, k))], axis=-1)
    C, D, named = rows_of(model, q, v, A, B, outputs, states)
    units = dict(zip(states, units_of(model, k - nv), strict=True))
    return LinearModel(A, B, C, D, rate, states, inputs, named, units, model, q, v, t)


def listed(names: Any, what: str) -> list[str]:
    """Return one name or several, handles included, as a list. ModelError for an invalid name."""
    found = [getattr(one, "name", one) for one in several(names)]
    for name in found:
        if not isinstance(name, str):
            raise _core.ModelError(f"{what} takes names, or a list of them, not {name!r:.80}")
    return found


def units_of(model: Any, own: int) -> list[str]:
    """Return the units of the states: displacements, velocities, and the effects' own states, of unknown units."""
    along = []
    for hinge in model.hinges.values():
        for subhinge in hinge.subhinges:
            kind = _core.subhinge_kinds[subhinge["kind"]]
            along += ["rad" if kind.angle else "m"] if kind.nv == 1 else ["rad"] * 3 + ["m"] * (kind.nv - 3)
    return [*along, *(f"{unit}/s" for unit in along), *([""] * own)]


def rows_of(
    model: Any, q: np.ndarray, v: np.ndarray, A: np.ndarray, B: np.ndarray, outputs: Any, states: tuple[str, ...]
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Return C, D and the names of the requested outputs."""
    n, m, batch = A.shape[-1], B.shape[-1], A.shape[:-2]
    if outputs is None:
        return np.broadcast_to(np.eye(n), (*batch, n, n)).copy(), np.zeros((*batch, n, m)), states
    rows: list[tuple[np.ndarray, np.ndarray]] = []
    names: list[str] = []
    for name in listed(outputs, "outputs"):
        what, _, of = name.partition(".")
        if what not in (*OUTPUTS, "state") or not of:
            raise _core.ModelError(f"outputs: unknown output {name!r}; there are {', '.join(f'{w}.<name>' for w in OUTPUTS)}")
        C, D = np.zeros((*batch, 1, n)), np.zeros((*batch, 1, m))
        if what == "state" or what in ("q", "v", "vdot"):
            row = _row_of(model, name, what, of, states)
            if what == "vdot":
                C, D = A[..., [row], :], B[..., [row], :]
            else:
                C[..., 0, row] = 1.0
            names.append(name)
        else:
            C = _of_frame(model, what, of, q, v, batch, n)
            D = np.zeros((*batch, C.shape[-2], m))
            names += [f"{name}.{axis}" for axis in AXES[what]]
        rows.append((C, D))
    if twice := [name for name in dict.fromkeys(names) if names.count(name) > 1]:
        raise _core.ModelError(f"outputs: {twice[0]!r} is named twice")
    if not rows:
        return np.zeros((*batch, 0, n)), np.zeros((*batch, 0, m)), ()
    return np.concatenate([C for C, _ in rows], axis=-2), np.concatenate([D for _, D in rows], axis=-2), tuple(names)


def _row_of(model: Any, name: str, what: str, of: str, states: tuple[str, ...]) -> int:
    wanted = f"v.{of}" if what == "vdot" else name
    if wanted not in states:
        known = [state.partition(".")[2] for state in states if state.startswith(wanted.partition(".")[0] + ".")]
        raise _core.ModelError(f"outputs: {model.name!r} has no {what}.{of}; after {what!r} there are {', '.join(known[:20])}")
    return states.index(wanted)


def _of_frame(model: Any, what: str, of: str, q: np.ndarray, v: np.ndarray, batch: tuple[int, ...], n: int) -> np.ndarray:
    nv = model.nv
    if what == "position":
        J = model.jacobian(of, q, axes="aligned")[..., 3:, :]
    else:
        J = model.jacobian(of, q)
    C = np.zeros((*batch, 6 if what == "velocity" else 3, n))
    if what == "velocity":
        C[..., :nv] = np.einsum("...ijk,...j->...ik", model.jacobian_derivative(of, q), np.broadcast_to(v, (*batch, nv)))
        C[..., nv : 2 * nv] = J
    else:
        C[..., :nv] = J[..., :3, :]
    return C
