"""Cost of one forward dynamics in every way of computing: seconds and bytes, measured in the core."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import _core


def time_forward_dynamics(
    model: Any,
    q: np.ndarray,
    v: np.ndarray,
    tau: np.ndarray,
    seconds: float = 0.1,
    *,
    form: str = "fast",
    refine: int | str = 0,
    residual: str = "same",
    precision: str | int = "double",
    method: str = "articulated",
) -> dict[str, float]:
    """Return seconds per call over the states q (K, nq), v (K, nv), tau (K, nv) in rotation: `minimum`, `median`, `calls`.

    `seconds` is the time for the measurement; options and errors as for `forward_dynamics`. Raises ModelError without a state.
    """
    q, v, tau = (np.atleast_2d(x) for x in (q, v, tau))
    if not len(q):
        raise _core.ModelError(f"no state given: timing {model.name!r} needs at least one")
    if method == "articulated":
        return _core.time_forward(model, q, v, tau, seconds, form, refine, residual, precision)
    if method != "realization":
        return _core.time_method(model, method, q, v, tau, seconds, precision)
    # Factored again at every state of a batch, after the bias forces.
    timed = _core.time_apply(_mass_matrix(model).inv().at(q, precision=precision), np.ones(model.nv), seconds, rules=False)
    bias = _core.time_dynamics(model, "inverse_dynamics", q, v, tau, seconds / 4)["median"]
    return {"minimum": timed["minimum"] / len(q) + bias, "median": timed["median"] / len(q) + bias, "calls": timed["calls"] * len(q)}


def workspace_bytes(model: Any, *, precision: str | int = "double", form: str = "fast", method: str = "articulated") -> int:
    """Return the bytes of the workspace of one forward dynamics.

    As reported by the core, except for "realization", which is planned in doubles and scaled by the size of the precision's scalar over a
    double's, the ratio of the articulated method's workspaces.
    """
    if method == "articulated":
        return model._calls().memory(form, precision)
    if method != "realization":
        return _core.Methods(model).memory(method, precision)
    calls = model._calls()
    scalar = calls.memory(form, precision) / calls.memory(form, "double")
    return round(int(_mass_matrix(model).inv().plan(rules=False).memory) * scalar)


def _mass_matrix(model: Any) -> _core.Operator:
    H, phi, M, J = model.soa("H phi M J")
    return H @ phi @ M @ phi.T @ H.T + J
