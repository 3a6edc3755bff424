"""Cost of expressions (`pycraft bench`): built, planned, applied beside the kernels; batches in packs beside their states one by one.

Each result is checked in the run that times it. Figures in microseconds are the least of several rounds.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from .. import _core
from ..models.generators import chain
from .bench import Figure, _elapsed, _states, in_turn

PLANNED, DERIVED, OVER_KERNEL = 100.0, 50000.0, 0.6
"""Bounds in µs: the first evaluation of ten operators, a third derivative of Υ and its value, `e @ x` in Python without the core's run."""
OVER_DIRECT = 1.15
"""Bound of ℳ⁻¹x at new states over the direct call."""
NEVER = 2**31 - 1
BATCH = 1024


def _ten_operators(soa: Any) -> _core.Operator:
    H, psi, K, D, I = soa("H psi K D I")
    return (I - H @ psi @ K).T @ D.inv() @ (I - H @ psi @ K)


def building(repeats: int = 2000) -> list[Figure]:
    """Time an expression of ten operators in Python: typed, and evaluated for the first time; also a third derivative."""
    model = chain(7, seed=1)
    soa = model.soa
    typed = min(_elapsed(lambda: _ten_operators(soa), repeats) for _ in range(5))
    x = np.ones(7)
    again = _ten_operators(soa) @ x
    first = []
    for _ in range(repeats // 10):
        e = _ten_operators(soa)
        first.append(_elapsed(lambda: e @ x, 1))  # noqa: B023 - called at once
        if not np.array_equal(e @ x, again):
            raise _core.EvaluationError("an expression that is typed anew has another value")
    third = min(_elapsed(lambda: _third_derivative(soa), 1) for _ in range(5))
    _check_third_derivative(model)
    return [
        Figure("building an expression of ten operators in Python", 1e6 * typed, "us", 50.0),
        Figure("its first evaluation", 1e6 * min(first), "us", PLANNED),
        Figure("a third derivative of Υ, built and evaluated for the first time", 1e6 * third, "us", DERIVED),
    ]


def _third_derivative(soa: Any) -> np.ndarray:
    return soa.Upsilon.diff(1).diff(2).diff(4) @ np.ones(42)


def _check_third_derivative(model: Any, step: float = 1e-4) -> None:
    """Check against a central difference of the second, with errors of step² of the fifth and eps / step of rounding."""
    second, along, x = model.soa.Upsilon.diff(1).diff(2), step * np.eye(7)[4], np.ones(42)
    difference = (second.at(model.q + along) @ x - second.at(model.q - along) @ x) / (2 * step)
    if not np.allclose(_third_derivative(model.soa), difference, rtol=0, atol=1e-6 * np.abs(difference).max()):
        raise _core.EvaluationError("a third derivative of Υ is wrong in the run that times it")


def _beside_kernels(name: str, model: Any, seconds: float) -> list[Figure]:
    """Time ℳ⁻¹x at states in rotation over forward dynamics at rest, which is ℳ⁻¹τ; and the Python part of `e @ x`."""
    q, v, u = _states(model)
    inverse, x = model.soa.MM.inv(), u[0]
    bound = inverse.at(q, v)
    model_at_rest = model.forward_dynamics(q, 0 * v, x) - model.forward_dynamics(q, 0 * v)
    before = _core.record_from(NEVER)
    try:
        if not np.allclose(bound @ x, model_at_rest, rtol=1e-6, atol=1e-6 * np.abs(model_at_rest).max()):
            raise _core.EvaluationError(f"ℳ⁻¹x of {name} is wrong in the run that times it")
        direct, own = in_turn(
            seconds, partial(_core.time_dynamics, model, "forward_dynamics", q, 0 * v, u), partial(_core.time_apply, bound, x)
        )
    finally:
        _core.record_from(before)
    own /= len(q)
    one = inverse.at(q[0])
    (kernel,) = in_turn(seconds, partial(_core.time_apply, one, x))
    python = min(_elapsed(lambda: one @ x, 2000) for _ in range(5))
    return [
        Figure(
            f"{name}: MM^-1 @ x at new states over forward dynamics",
            own / direct,
            "x",
            OVER_DIRECT,
            f"{1e6 * own:.2f} us and {1e6 * direct:.2f} us",
        ),
        Figure(
            f"{name}: MM^-1 @ x from Python beyond the core's run",
            1e6 * (python - kernel),
            "us",
            OVER_KERNEL,
            f"{1e6 * kernel:.2f} us there",
        ),
    ]


def _requests(model: Any) -> dict[str, Callable[[Any, Any], np.ndarray]]:
    """Return requests for batches: sweeps, kernels, realizations, derivatives, eliminations; each typed once."""
    soa, x, i = model.soa, np.ones(model.nv), model.nv - 1
    MM = soa.MM + soa.J
    applied = {
        "MM": MM,
        "MM^-1": MM.inv(),
        "H psi M psi* H*": soa.H @ soa.psi @ soa.M @ soa.psi.T @ soa.H.T,
        "(MM + 0.1 I)^-1": (soa.MM + 0.1 * soa.I).inv(),
        "MM.diff(i)": MM.diff(i),
        "MM^-1.diff(i)": MM.inv().diff(i),
    }
    matrices = {name: applied[name] for name in ("MM", "MM^-1", "MM.diff(i)")} if model.nv < 50 else {}
    requests: dict[str, Callable[[Any, Any], np.ndarray]] = {}
    for name, e in applied.items():
        requests[f"{name} @ x"] = lambda Q, V, e=e: e.at(Q, V) @ x  # type: ignore[misc]  # e of this turn
    for name, e in matrices.items():
        requests[f"{name} as a matrix"] = lambda Q, V, e=e: e.at(Q, V).dense()  # type: ignore[misc]  # e of this turn
    return requests


def _seconds(ask: Callable[[Any, Any], np.ndarray], q: np.ndarray, v: np.ndarray, record_from: int) -> float:
    """Return the time per state of a batch, in packs or one by one; the least of some calls."""
    before = _core.record_from(record_from)
    try:
        ask(q, v)
        return min(_elapsed(lambda: ask(q, v), 1) for _ in range(5)) / len(q)
    finally:
        _core.record_from(before)


def _in_packs(name: str, model: Any) -> list[Figure]:
    """Time a batch in packs over its states one by one, and over calls for one state each."""
    q, v, _ = _states(model, BATCH)
    few = slice(0, 64)
    figures = []
    for what, ask in _requests(model).items():
        before = _core.record_from(1)
        together = ask(q[few], v[few])
        _core.record_from(NEVER)
        singly = ask(q[few], v[few])
        _core.record_from(before)
        if not np.allclose(together, singly, rtol=1e-8, atol=1e-8 * np.abs(singly).max()):
            raise _core.EvaluationError(f"{what} of {name} in packs is wrong in the run that times it")
        packed, one = _seconds(ask, q, v, 1), _seconds(ask, q[few], v[few], NEVER)
        call = min(_elapsed(partial(ask, q[0], v[0]), 20) for _ in range(5))
        note = f"{1e6 * packed:.2f} us a state; {1e6 * one:.2f} one by one, {1e6 * call:.1f} a call"
        figures.append(Figure(f"{name}: {what} in packs over one by one", packed / one, "x", None, note))
    return figures


def expressions(seconds: float = 0.2) -> list[Figure]:
    """Return all of these figures, on two robots and a chain."""
    from ..models import robots

    figures = building()
    models = {"panda": robots.panda(), "g1": robots.g1(), "chain of 100": chain(100, seed=1)}
    for name, model in ({"ur5": robots.ur5(), "chain of 10": chain(10, seed=1)} | models).items():
        figures += _beside_kernels(name, model, seconds)
    for name, model in models.items():
        figures += _in_packs(name, model)
    return figures
