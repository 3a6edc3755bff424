"""Systems that travel fast or are far away: the motion common to all bodies must not cost digits of the relative motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from ...models.multibody import Multibody
from .case import Bound, Case, MeasuredCase
from .chains import links
from .shared_bounds import at_most

FAMILY = "motion"
SPEED, FAR, ORBIT = 7.7e3, 1e8, 5400.0
"""m/s, m, s: of a low orbit, and a quarter of the way to the Moon."""

WAYS: dict[str, dict[str, Any]] = {
    "fast": {},
    "fast, refine=1": {"refine": 1},
    "ud": {"form": "ud"},
    "ud, refine=1": {"form": "ud", "refine": 1},
    "square-root": {"form": "square-root"},
    "cholesky": {"method": "cholesky"},
    "ldl": {"method": "ldl"},
    "divide-and-conquer": {"method": "divide-and-conquer"},
}
FACTORED = ("ud", "square-root")


def cases() -> list[Case]:
    travels = "m|v|² is 10¹¹ J beside joints of a few N m: no velocity term may contain the common velocity"
    light = "forces of the tip, differentiated first, hide forces of the links"
    return [
        _case(
            f"2 t bus with links of 50 g at {SPEED:g} m/s",
            travels,
            "largest error of a joint's acceleration over the largest",
            _bus_accelerations,
            (at_most(tuple(WAYS), "worst", "1e-13", 1e-13),),
        ),
        _case(
            f"2 t bus with links of 50 g at {SPEED:g} m/s, 1e8 m away: derivatives",
            travels,
            "largest error of a row of ∂v̇/∂q, ∂v̇/∂v over its largest entry, joints",
            _bus_derivatives,
            (at_most(("fast", *FACTORED), "worst", "1e-12", 1e-12),),
        ),
        _case(
            "coasting body at 7500 m/s",
            "a body on which nothing acts",
            "angular acceleration, rad/s²",
            _coasting,
            (at_most(("fast", *FACTORED), "worst", "0", np.finfo(float).tiny),),
        ),
        _case(
            "coasting body at 7500 m/s for an orbit: attitude",
            "an error of the angular acceleration counts squared in time",
            "attitude after 5400 s, rad",
            _orbiting,
            (at_most(("rkmk4",), "worst", "1e-9", 1e-9),),
        ),
        _case(
            "10 links, tip 1e+09: derivatives of the inverse",
            light,
            "error of ∂(ℳ⁻¹)T/∂q over its size",
            _tip_derivatives,
            (at_most(FACTORED, "worst", "1e-11", 1e-11),),
        ),
    ]


def _case(name: str, hard: str, quantity: str, measure: Callable, bounds: tuple[Bound, ...]) -> MeasuredCase:
    return MeasuredCase(
        name, FAMILY, hard, {}, measure, quantity, "quad precision" if "coasting" not in name else "zero", bounds, "Galilean invariance"
    )


def bus(seed: int, heavy: float = 2000.0, light: float = 0.05) -> tuple[Multibody, np.ndarray, np.ndarray, np.ndarray]:
    """A heavy free body with two branches of light links, and a state at speed with forces of a few units."""
    rng = np.random.default_rng([11, seed])
    model = Multibody("bus")
    model.add_body("bus", hinge="free", mass=heavy, com=0.1 * rng.normal(size=3), inertia=heavy * np.diag(rng.uniform(1, 2, 3)))
    for k, kind in enumerate(("pin", "pin", "ball", "slider", "pin", "pin")):
        parent = "bus" if k % 3 == 0 else f"link{k - 1}"
        inertia = 0.05 * light * np.diag(rng.uniform(1, 2, 3))
        axis: dict[str, Any] = {} if kind == "ball" else {"axis": rng.normal(size=3)}
        model.add_body(
            f"link{k}", parent, kind, position=rng.normal(size=3), mass=light, com=0.2 * rng.normal(size=3), inertia=inertia, **axis
        )
    state = model.random_state(seed)
    q, v = np.array(state.q), np.array(state.v)
    along = rng.normal(size=3)
    v[3:6] = SPEED * along / np.linalg.norm(along)
    return model, q, v, rng.normal(size=model.nv)


def _bus_accelerations(seeds: Iterable[int], steps: int) -> Mapping[str, np.ndarray]:
    errors: dict[str, list[float]] = {way: [] for way in WAYS}
    for seed in seeds:
        model, q, v, tau = bus(seed)
        exact = model.forward_dynamics(q, v, tau, precision="quad")[6:]
        for way, options in WAYS.items():
            errors[way].append(np.abs(model.forward_dynamics(q, v, tau, **options)[6:] - exact).max() / np.abs(exact).max())
    return {way: np.array(found) for way, found in errors.items()}


def _bus_derivatives(seeds: Iterable[int], steps: int) -> Mapping[str, np.ndarray]:
    errors: dict[str, list[float]] = {form: [] for form in ("fast", *FACTORED)}
    for seed in seeds:
        model, q, v, tau = bus(seed)
        q[4:7] += FAR
        exact = np.concatenate(model.forward_dynamics_derivatives(q, v, tau, precision="quad")[:2], axis=1)[6:]
        for form, found in errors.items():
            got = np.concatenate(model.forward_dynamics_derivatives(q, v, tau, form=form)[:2], axis=1)[6:]
            found.append((np.abs(got - exact).max(axis=1) / np.abs(exact).max(axis=1)).max())
    return {form: np.array(found) for form, found in errors.items()}


def _coasting_body() -> tuple[Multibody, np.ndarray, np.ndarray]:
    model = Multibody("coasting body")
    model.add_body("body", hinge="free", mass=3.0, inertia=np.diag([1.0, 2.0, 3.0]))
    return model, np.array([1.0, 0, 0, 0, 0, 0, 0]), np.array([0, 0, 1e-3, 6e3, -4e3, 2e3])


def _coasting(seeds: Iterable[int], steps: int) -> Mapping[str, np.ndarray]:
    model, q, v = _coasting_body()
    return {form: np.array([np.abs(model.forward_dynamics(q, v, np.zeros(6), form=form)[:3]).max()]) for form in ("fast", *FACTORED)}


def _orbiting(seeds: Iterable[int], steps: int) -> Mapping[str, np.ndarray]:
    model, q, v = _coasting_body()
    motion = model.integrate_ode(q, v, [0.0, ORBIT], integrator="rkmk4", step=1.0)
    half = 0.5 * v[2] * ORBIT
    expected = np.array([np.cos(half), 0, 0, np.sin(half)])
    return {"rkmk4": np.array([2 * min(np.linalg.norm(motion.q[-1, :4] - sign * expected) for sign in (1, -1))])}


def _tip_derivatives(seeds: Iterable[int], steps: int) -> Mapping[str, np.ndarray]:
    errors: dict[str, list[float]] = {form: [] for form in ("fast", *FACTORED)}
    for seed in seeds:
        rng = np.random.default_rng([13, seed])
        model = links([1.0] * 9 + [1e9], [0.1] * 10, rng, "random")
        q, tau, rest = rng.uniform(-3, 3, 10), rng.normal(size=10), np.zeros(10)
        exact = model.forward_dynamics_derivatives(q, rest, tau, precision="quad").q
        for form, found in errors.items():
            found.append(np.abs(model.forward_dynamics_derivatives(q, rest, tau, form=form).q - exact).max() / np.abs(exact).max())
    return {form: np.array(found) for form, found in errors.items()}
