"""Accelerations of a model on its loops, by the tree in which the loops are embedded (docs/loops.md)."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..arguments import first_not_finite
from ..state import at_state


def embedded_accelerations(model: Any, q: Any = None, v: Any = None, tau: Any = None, independent: Any = None, **how: Any) -> np.ndarray:
    """Return accelerations (nv,) or (B, nv) of the model that keep its loops, with loop forces that do no work.

    With the letters of `soa.embedded(independent)`, X its coordinate map, f = X*(τ - v ×* (J v)) with the rotors' J:

        (ℳ + J)θ̈_r = f - Hφ(Mφ*(a + a₀) + b) - X*J Ẋθ̇_r,        θ̈ = Xθ̈_r + Ẋθ̇_r

    Parameters
    ----------
    q, v : one state on the loops, a batch of them, a `State`; default: the model's present state
    tau : (nv,) or (B, nv), N or N m; default: zero
    independent : as in `soa.embedded`; default: chosen at the first state
    how : form, precision, as in `Operator.at`

    Raises
    ------
    ModelError, EvaluationError
        States that are off the loops or singular, velocities that violate a row, by name.

    Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapter on constraint embedding. Cost: as the embedded tree.

    Examples
    --------
    >>> import numpy as np, pycraft as pc
    >>> from pycraft.dynamics.embedding import embedded_accelerations
    >>> bars = pc.chain(3)
    >>> closure = bars.add_loop("body2", hinge="pin", point=(1, 0, 0))
    >>> state = bars.assemble([1.0, -1.4, -1.5], [1.0, 0, 0], fix="hinge0")
    >>> vdot = embedded_accelerations(bars, state)
    >>> bool(np.abs(bars.loops.jacobian(state) @ vdot + bars.loops.bias(state)).max() < 1e-12)
    True
    """
    q, v = at_state(model, q, v)
    given = {"q": (q, model.nq), "v": (v, model.nv), "tau": (np.zeros(model.nv) if tau is None else tau, model.nv)}
    arrays = {name: np.asarray(_core.real_array(part, name), float) for name, (part, _) in given.items()}
    for name, (_, width) in given.items():
        if arrays[name].ndim not in (1, 2) or arrays[name].shape[-1] != width:
            raise _core.ModelError(f"{name} of {model.name!r} takes {width} numbers a state, not an array {arrays[name].shape}")
    q, v, tau = arrays.values()
    if bad := first_not_finite(tau):
        raise _core.ModelError(f"tau of {model.name!r} is {bad[1]} at {model.coordinate_names[bad[0][0]]!r}{bad[2]}")
    try:
        batch = np.broadcast_shapes(q.shape[:-1], v.shape[:-1], tau.shape[:-1])
    except ValueError:
        raise _core.ModelError(f"q, v and tau are of as many states, not arrays {q.shape}, {v.shape} and {tau.shape}") from None
    if 0 in batch or model.nv == 0:
        return np.zeros((*batch, model.nv))
    if batch:
        q, v = np.broadcast_to(q, (*batch, model.nq)), np.broadcast_to(v, (*batch, model.nv))
    return EmbeddedDynamics(model.soa.embedded(independent, q if q.ndim == 1 else q[0])).accelerations(
        q, v, tau - model.rotor_forces(v), **how
    )


class EmbeddedDynamics:
    """The expressions of θ̈ for one choice of independent coordinates, built once for many states. `soa` : from `soa.embedded`."""

    def __init__(self, soa: Any):
        self.soa = soa
        self._rate = soa.X_r_dot @ soa.theta_dot
        bias = soa.H @ soa.phi @ (soa.M @ soa.phi.T @ (soa.a + soa.gravity_base) + soa.b)
        self._felt = bias + soa.X_r.T @ soa.unconstrained.J @ self._rate
        self._inverse = (soa.MM + soa.J).inv()

    def accelerations(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, **how: Any) -> np.ndarray:
        """Return θ̈ (nv,) or (B, nv), as `embedded_accelerations`; q and v have the same number of states, tau the same or one."""

        def at(expression: Any) -> np.ndarray:
            return expression.at(q, v, **how).dense()

        X, inverse = at(self.soa.X_r), at(self._inverse)
        forces = np.swapaxes(X, -1, -2) @ np.broadcast_to(tau, (*q.shape[:-1], tau.shape[-1]))[..., None] - _column(at(self._felt))
        return (X @ (inverse @ forces) + _column(at(self._rate)))[..., 0]


def _column(x: np.ndarray) -> np.ndarray:
    return x if x.shape[-1] == 1 else x[..., None]
