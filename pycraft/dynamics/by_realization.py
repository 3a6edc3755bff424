"""Forward dynamics by the equations of motion as typed: every operator realized, the mass matrix eliminated."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import first_not_finite


def by_realization(model: Any, q, v, tau, precision: str | int, out) -> np.ndarray:
    """Return accelerations (nv,) or (B, nv) as (HφMφ*H* + J)⁻¹ (T - Hφ(Mφ*(a + a₀) + b)) evaluated as typed, without theorems.

    Equations of motion [Jain 2011, forward dynamics by the mass matrix], realized and eliminated: O(N³). T excludes the rotor forces v ×*
    (J v) of balls and free hinges. Accepts and refuses the same arguments as the other direct calls; an error in a batch names the state.
    """
    q, v, tau, batch = motion_state(model, q, v, tau)
    result = output(out, (*batch, model.nv))  # filled at the end: it may lie in the memory of q, v or tau
    if not model.nv:
        return result
    H, phi, M, J, a, b, base = model.soa("H phi M J a b gravity_base")
    T = _core.vector("T", model.soa.Theta)
    formula = (H @ phi @ M @ phi.T @ H.T + J).inv() @ (T - H @ phi @ (M @ phi.T @ (a + base) + b))
    states = [x.reshape(-1, x.shape[-1]) for x in (q, v, tau - model.rotor_forces(v))]
    flat = np.empty((len(states[0]), model.nv))
    for i in range(len(flat)):
        try:
            flat[i] = formula.at(states[0][i], states[1][i], precision=precision).value(rules=False, T=states[2][i])
        except _core.Error as error:
            raise type(error)(f"{error} (state {i} of a batch of {len(flat)})" if batch else str(error)) from None
    result[...] = flat.reshape(result.shape)
    return result


def motion_state(model: Any, q: Any, v: Any, tau: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[int, ...]]:
    """Return q (nq,), v (nv,), tau (nv,), or (B, ...) all three if one of them is a batch, as arrays, and the batch shape: () or (B,).

    Arguments of one state are repeated for a batch: operators at one q would read v (nv, nv) as that many columns.

    Raises ModelError, in the words of the core's direct calls, for wrong shapes, batches that differ and entries that are not finite.
    """
    model._integration().configuration_rate(q, v, "double", None)  # the core's own checks of q and v
    q, v, tau = np.asarray(q, float), np.asarray(v, float), checked_forces(model, tau)
    sizes = [x.shape[0] for x in (q, v, tau) if x.ndim == 2]
    for size in sizes[1:]:
        if size != sizes[0]:
            raise _core.ModelError(f"batches of {sizes[0]} and {size} states in one call")
    batch = tuple(sizes[:1])
    q, v, tau = (np.broadcast_to(x, (*batch, x.shape[-1])) for x in (q, v, tau))
    return q, v, tau, batch


def checked_forces(model: Any, tau: Any, name: str = "tau") -> np.ndarray:
    """Return generalized forces or accelerations (nv,) or (B, nv) as an array; a ModelError names the fault."""
    nv = model.nv
    forces = _core.real_array(tau, name)
    if forces.ndim not in (1, 2) or forces.shape[-1] != nv:
        raise _core.ModelError(f"{name} of {model.name!r} takes {nv} numbers, or (B, {nv}) for a batch")
    if bad := first_not_finite(forces):
        (at,), value, state = bad
        hinge = next(h for h in model.hinges.values() if h.v_slice.start <= at < h.v_slice.stop)
        raise _core.ModelError(f"{name} of hinge {hinge.name!r}: entry {at - hinge.v_slice.start} is {value}{state}")
    return forces


def output(out: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return the array for a result: `out` if it fits, a new one if it is None."""
    if out is None:
        return np.empty(shape)
    fits = isinstance(out, np.ndarray) and out.dtype == np.float64 and out.flags.c_contiguous and out.flags.writeable
    if not fits or out.shape != shape:
        raise _core.ModelError(f"out= takes a writeable C-ordered float64 array of shape ({', '.join(map(str, shape))})")
    return out
