"""Interbody forces: the force of every hinge on the body that it moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ..arguments import chosen, switch, text
from ..state import at_state
from .direct_calls import cached

AXES = ("body", "aligned", "world")
PARTS = ("whole", "reaction")


class InterbodyDerivatives(NamedTuple):
    """Derivatives of the forces of all hinges, in the bodies' axes, by the arguments: (N, 6, nv) or (B, N, 6, nv) each.

    q : along coordinates, on ball and free hinges along quasi-velocities
    v : by velocities
    input : by generalized forces, or by accelerations if these were given
    """

    q: np.ndarray
    v: np.ndarray
    input: np.ndarray


class InterbodyCalls:
    """Forces that hinges carry."""

    nv: int
    mass_matrix_inverse: Callable[..., np.ndarray]

    def _interbody(self) -> _core.InterbodyForces:
        return cached(self, "_forces_of_hinges", _core.InterbodyForces)

    def interbody_forces(
        self, q=None, v=None, tau=None, *, vdot=None, hinges: Any = None, wrenches: Mapping[Any, Any] | None = None,
        wrench_axes: str = "world", axes: Any = "body", about: Any = None, part: str = "whole", loops: bool = False, form: str = "fast",
        refine: int | str = 0, residual: str = "same", precision: str = "double",
    ) -> np.ndarray:  # fmt: skip
        """Return the spatial forces (moment; force) of parents on their children through the hinges: O(N).

        f(k) = M(k) α(k) + b(k) - w(k) + Σ_{children c} E(k,c) f(c), by Newton-Euler from the tips, with the accelerations given, or found
        by forward dynamics under `tau`, of the tree: forces that close loops belong to `wrenches` (docs/interbody_forces.md). Along its own
        coordinates a hinge carries the driving force, H f + J v̇ + v ×* (J v) = τ with J of the rotors; across them, the force that holds
        the bodies together.

        Parameters
        ----------
        q, v : (nq,), (nv,), each with an optional leading batch axis
        tau : (nv,), N m and N; zero if neither it nor vdot is given
        vdot : (nv,), rad/s² and m/s², in place of tau
        hinges : a name or `Hinge`, or a list of them; None: all, in the model's order
        wrenches : by name of a body or node, (6,) or (B, 6), the moment first: external wrenches there, about its origin
        wrench_axes : {"world", "body"}, their axes: the world's, or the node's own
        axes : {"body", "aligned", "world"} or a frame
            The child's own, about its origin; the world's, about the child's origin; the world's, about the world's origin; any frame's,
            about its origin (`Frame`, or its name; moved frames at `arm.frames.t`).
        about : a frame, or (3,) in the world's axes: another point for the moments
        part : {"whole", "reaction"}
            "reaction" is the part that does no work along the hinge's coordinates, f - H⁺H f with H⁺ = H*(HH*)⁻¹ about the child's origin,
            in metres
        loops : bool
            Whether the loops' forces act as well, from `constrained_dynamics` under `tau`. Forces of a coupling act along its hinges, in
            Hf.
        form, refine, residual : as in `forward_dynamics`, for the accelerations
        precision : {"single", "double", "extended", "quad"}, of the whole computation

        Returns
        -------
        (N, 6) or (B, N, 6), N m and N; for one hinge (6,) or (B, 6)

        Raises
        ------
        ModelError
            An unknown hinge, node or frame; tau or loops beside vdot; wrenches of the wrong shape, not finite, or on the base.
        EvaluationError
            Unknown axes and parts.
        SingularHingeError
            As `forward_dynamics`.

        Source: the Newton-Euler inverse dynamics algorithm [Jain 2011].

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)  # two rods of 1 kg and 1 m along x
        >>> arm.gravity = (0, -10, 0)
        >>> arm.interbody_forces([0, 0], vdot=[0, 0])[:, [2, 4]].tolist()  # held level: moments and vertical forces
        [[20.0, 20.0], [5.0, 10.0]]
        """
        known, reaction = self._given(tau, vdot), is_reaction(part)
        q, v = at_state(self, q, v)
        pushes = pushed(wrenches, wrench_axes)
        rows = hinge_numbers(self, hinges)
        if switch(loops, "loops"):
            if known:
                raise _core.ModelError(
                    "interbody forces on the loops follow from tau: accelerations alone do not determine the loops' forces"
                )
            how: dict[str, Any] = {"form": form, "refine": refine, "residual": residual, "precision": precision}
            model: Any = self
            on_loops = model.constrained_dynamics(q, v, tau, wrenches=wrenches, wrench_axes=wrench_axes, **how)
            pushes = with_wrenches(pushes, loop_wrenches(self, on_loops.forces, q, pushes[1])[0])
            f, X, *_ = self._interbody().after(q, v, on_loops.vdot, *pushes, reaction, precision)
        elif known:
            f, X, *_ = self._interbody().after(q, v, vdot, *pushes, reaction, precision)
        else:
            tau = np.zeros(self.nv) if tau is None else tau
            f, X, *_ = self._interbody().under(q, v, tau, *pushes, reaction, form, refine, chosen(residual, "residual"), precision)
        return in_axes(self, q, f[..., rows, :], X[..., rows, :, :], axes, about)

    def base_reaction(self, q=None, v=None, tau=None, *, axes: Any = "world", about: Any = None, **options: Any) -> np.ndarray:
        """Return the force of the base on the model, (6,) or (B, 6): the sum of the forces of its hinges, by default about the world's
        origin; with loops=True, including the loops that end at the base.

        Arguments as in `interbody_forces`; axes "body" and "aligned" belong to one body and are refused here. For a floating model it is
        zero to rounding.

        Examples
        --------
        >>> import pycraft as pc
        >>> arm = pc.chain(2)
        >>> arm.gravity = (0, -10, 0)
        >>> arm.base_reaction([0, 0], vdot=[0, 0]).tolist()  # 2 kg, 1 m out
        [0.0, 0.0, 20.0, 0.0, 20.0, 0.0]
        """
        if isinstance(axes, str) and axes in ("body", "aligned"):
            raise _core.EvaluationError(f"axes={axes!r} of a base reaction: there are 'world', and those of a frame")
        if "hinges" in options:
            raise _core.EvaluationError("a base reaction sums all hinges on the base; interbody_forces takes hinges=")
        model: Any = self
        on_base = [name for name, hinge in model.hinges.items() if hinge.body.parent is None]
        reaction = self.interbody_forces(q, v, tau, hinges=on_base, axes=axes, about=about, **options).sum(axis=-2)
        if not options.pop("loops", False):
            return reaction
        of_hinges = {"part": options.pop("part", "whole")}
        if is_reaction(of_hinges["part"]):
            raise _core.EvaluationError("part='reaction' of a base reaction applies to hinges; with loops=True use part='whole'")
        q, v = at_state(self, q, v)
        on_base_by_loops = loop_wrenches(self, model.constrained_dynamics(q, v, tau, **options).forces, q, True)[1]
        return reaction - in_axes(self, q, on_base_by_loops, np.eye(4), axes, about)

    def interbody_forces_derivatives(
        self, q=None, v=None, tau=None, *, vdot=None, wrenches: Mapping[Any, Any] | None = None, wrench_axes: str = "world",
        form: str = "fast", refine: int | str = 0, residual: str = "same",
    ) -> InterbodyDerivatives:  # fmt: skip
        """Return exact derivatives of `interbody_forces` in the bodies' axes; arguments and errors are the same.

        For given accelerations ∂f/∂q, ∂f/∂v and ∂f/∂v̇, by automatic differentiation of the recursion; under generalized forces, with T =
        Hf + Jv̇ differentiated beside f,

            dv̇ = (ℳ + J)⁻¹ (dτ - ∂T/∂q dq - ∂T/∂v dv),   df = ∂f/∂q dq + ∂f/∂v dv + ∂f/∂v̇ dv̇.

        Wrenches keep their components in the axes in which they are given. O(N nv), in double precision.
        """
        known = self._given(tau, vdot)
        q, v = at_state(self, q, v)
        pushes = pushed(wrenches, wrench_axes)
        if not known:
            tau = np.zeros(self.nv) if tau is None else tau
            vdot = self._interbody().under(q, v, tau, *pushes, False, form, refine, chosen(residual, "residual"), "double")[3]
        (f_q, f_v, f_vdot), (T_q, T_v, _) = self._interbody().derivatives(q, v, vdot, *pushes, False)
        if known:
            return InterbodyDerivatives(f_q, f_v, f_vdot)
        inverse = self.mass_matrix_inverse(q, form=form, refine=refine, residual=residual)[..., None, :, :]
        by_tau = f_vdot @ inverse
        return InterbodyDerivatives(f_q - by_tau @ T_q[..., None, :, :], f_v - by_tau @ T_v[..., None, :, :], by_tau)

    def _given(self, tau: Any, vdot: Any) -> bool:
        """Check that accelerations are given."""
        if tau is not None and vdot is not None:
            raise _core.ModelError("interbody forces follow from tau or from vdot: give one of them")
        return vdot is not None


def pushed(wrenches: Mapping[Any, Any] | None, wrench_axes: str) -> tuple[list[str], bool, np.ndarray]:
    """Return names, whether in the world's axes, and values (..., L, 6) of the user's wrenches."""
    if not isinstance(wrench_axes, str) or wrench_axes not in ("world", "body"):
        raise _core.EvaluationError(f"wrench_axes={wrench_axes!r}: there are 'world' and 'body'")
    if wrenches is None:
        wrenches = {}
    if not isinstance(wrenches, Mapping):
        raise _core.ModelError(f"wrenches must be a dictionary of wrenches (6,) by the names of bodies or nodes, not {wrenches!r:.80}")
    names, each = [], []
    for of, given in wrenches.items():
        names.append(text(getattr(of, "name", of), "a body or node of wrenches"))
        each.append(np.asarray(_core.real_array(given, f"the wrench on {names[-1]!r}"), float))
        if each[-1].ndim not in (1, 2) or each[-1].shape[-1] != 6:
            raise _core.ModelError(f"the wrench on {names[-1]!r} takes (6,) or (B, 6), the moment first, not an array {each[-1].shape}")
    batches = {len(one) for one in each if one.ndim == 2}
    if len(batches) > 1:
        raise _core.ModelError(f"wrenches: batches of {' and '.join(map(str, sorted(batches)))} states in one call")
    if not names:
        return [], True, np.zeros((0, 6))
    shape = (*batches, 6)
    return names, wrench_axes == "world", np.stack([np.broadcast_to(one, shape) for one in each], axis=-2)


def with_wrenches(pushes: tuple[list[str], bool, np.ndarray], more: list[tuple[str, np.ndarray]]) -> tuple[list[str], bool, np.ndarray]:
    """Return the result of `pushed` with further wrenches (..., 6) by name in the same axes."""
    names, in_world, given = pushes
    each = [given[..., i, :] for i in range(len(names))] + [wrench for _, wrench in more]
    if not each:
        return pushes
    shape = np.broadcast_shapes(*(one.shape for one in each))
    return [*names, *(name for name, _ in more)], in_world, np.stack([np.broadcast_to(one, shape) for one in each], axis=-2)


def loop_wrenches(model: Any, forces: Mapping[str, Any], q: Any, in_world: bool) -> tuple[list[tuple[str, np.ndarray]], np.ndarray]:
    """Return the loops' forces by the names of the bodies and nodes on which they act, in the world's axes or the node's own; and the sum
    of the forces on the base and nodes on it, about the world's origin in its axes."""
    moved, on_base = [], np.zeros(6)
    for name, pair in forces.items():
        for frame, wrench in zip(model.loops.ends_of(name), pair, strict=True):
            held = not frame or (frame in model.nodes and model.nodes[frame].body is None)
            if held and not frame:
                on_base = on_base + wrench
                continue
            if held or in_world:
                X = model.frame(frame).pose(q)
                n, f = (np.einsum("...ij,...j->...i", X[..., :3, :3], part) for part in (wrench[..., :3], wrench[..., 3:]))
                wrench = np.concatenate([n + np.cross(X[..., :3, 3], f) if held else n, f], axis=-1)
            if held:
                on_base = on_base + wrench
            else:
                moved.append((frame, wrench))
    return moved, on_base


def forces_of_scene(
    calls: _core.SceneCalls, model: Any, t: np.ndarray, q: np.ndarray, v: np.ndarray, own: np.ndarray, hinges: Any, axes: Any, about: Any,
    part: str,
) -> np.ndarray:  # fmt: skip
    """Return the forces of a scene at K states: t (K,), q (K, nq), v (K, nv), its effects' own states (K, n)."""
    rows, reaction = hinge_numbers(model, hinges), is_reaction(part)
    f, X = _core.scene_interbody_forces(calls, t, q, v, own, reaction)
    return in_axes(model, q, f[..., rows, :], X[..., rows, :, :], axes, about, t)


def is_reaction(part: Any) -> bool:
    """Check that the requested part is the reaction. EvaluationError for an unknown part."""
    if not isinstance(part, str) or part not in PARTS:
        raise _core.EvaluationError(f"part={part!r} of interbody forces: there are {', '.join(map(repr, PARTS))}")
    return part == "reaction"


def refuse_state(hinges: Any) -> None:
    """Raise ModelError for a state in place of names of hinges."""
    if (
        hasattr(hinges, "q")
        or isinstance(hinges, np.ndarray)
        or (isinstance(hinges, Sequence) and any(isinstance(x, (int, float)) for x in hinges))
    ):
        raise _core.ModelError("the first argument names hinges, but values of a state are given: write interbody_forces(q=q, v=v)")


def hinge_numbers(model: Any, hinges: Any) -> Any:
    """Return the index of the rows of these hinges: a number for one, a list for several."""
    if hinges is None:
        return slice(None)
    if isinstance(hinges, str) or not isinstance(hinges, Sequence):
        return model._hinge_index(text(getattr(hinges, "name", hinges), "a hinge"))
    return [model._hinge_index(text(getattr(hinge, "name", hinge), "a hinge")) for hinge in hinges]


def in_axes(model: Any, q: Any, f: np.ndarray, X: np.ndarray, axes: Any, about: Any, t: Any = None) -> np.ndarray:
    """Return forces f (..., 6) of bodies in their axes about their origins, X (..., 4, 4) their poses, in other axes, about another point.

    With R, p of X, the requested axes A and the point c:  (R_WA* (R n + (p - c) × R f);  R_WA* R f)
    """
    if isinstance(axes, str) and axes == "body" and about is None:
        return f
    per_hinge = f.ndim - np.ndim(q)  # 1: an axis of hinges, 0: one hinge

    def pose_of(frame: Any) -> np.ndarray:
        pose = model.frame(frame).pose(q, t=t)
        return pose[..., None, :, :] if per_hinge and pose.ndim > 2 else pose

    R, p = X[..., :3, :3], X[..., :3, 3]
    force = np.einsum("...ij,...j->...i", R, f[..., 3:])
    moment = np.einsum("...ij,...j->...i", R, f[..., :3])
    turn, point = np.eye(3), p
    if isinstance(axes, str) and axes in AXES:
        if axes == "body":
            turn = R
        elif axes == "world":
            point = np.zeros(3)
    else:
        try:
            pose = pose_of(axes)
        except _core.ModelError as error:
            if not isinstance(axes, str):
                raise
            known = ", ".join(map(repr, AXES))
            raise _core.EvaluationError(f"axes={axes!r}: there are {known}, and those of a frame; {error}") from None
        turn, point = pose[..., :3, :3], pose[..., :3, 3]
    if about is not None:
        if isinstance(about, str) or hasattr(about, "name"):
            point = pose_of(about)[..., :3, 3]
        else:
            point = np.asarray(_core.real_array(about, "about"), float)
            if point.shape != (3,) or not np.isfinite(point).all():
                raise _core.ModelError(f"about must be a frame, or three finite numbers in the world's axes, not {about!r:.80}")
    with np.errstate(over="ignore", invalid="ignore"):
        moment = moment + np.cross(p - point, force)
        made = np.concatenate([np.einsum("...ji,...j->...i", turn, moment), np.einsum("...ji,...j->...i", turn, force)], axis=-1)
    if not np.isfinite(made).all():
        count = len(q) if np.ndim(q) == 2 else 0
        first = int(np.argmin(np.isfinite(made).reshape(count, -1).all(axis=1))) if count > 1 else 0
        state = f" (state {first} of a batch of {count})" if count > 1 else ""
        raise _core.EvaluationError(
            f"moments of {model.name!r} about that point are beyond the range of numbers: it is too far from the hinges{state}"
        )
    return made
