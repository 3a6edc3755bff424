"""Long trajectories: conserved quantities, and published and exact motions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache, partial
from typing import Any

import mpmath
import numpy as np

from ... import _core
from ...models.multibody import Multibody
from .case import Bound, Case, MeasuredCase
from .shared_bounds import at_most

FAMILY = "trajectories"
EPS = float(np.finfo(float).eps)
PERIOD = 2.367841947576
"""s, of a pendulum of 1 m released horizontally under 9.81 m/s²: 4 K(1/√2) √(l/g)."""

TIGHT: dict[str, Any] = {"rtol": 1e-13, "atol": 1e-13}
ADAPTIVE = ("dop853", "bulirsch-stoer", "dopri5")


def cases() -> list[Case]:
    return [*_tumbling_cases(), *_top_cases(), *_double_pendulum_cases(), _pendulum(), *_stiff()]


def _case(name: str, hard: str, quantity: str, reference: str, measure: Callable, bounds: tuple[Bound, ...], source: str) -> MeasuredCase:
    return MeasuredCase(name, FAMILY, hard, {}, measure, quantity, reference, bounds, source)


def _rounding_walk(methods: tuple[str, ...], factor: float) -> Bound:
    """Roundings of one step add up like a random walk."""
    return Bound(methods, "worst", f"{factor:g} eps √steps", lambda m: factor * EPS * np.sqrt(float(m.parameters["steps"])))


# Free tumbling --------------------------------------------------------------------------------------------------------

INERTIA = np.array([1.0, 2.0, 3.0])
SPIN = np.array([0.01, 2.0, 0.01])
"""Nearly about the middle axis: it turns over every few seconds (Dzhanibekov)."""

STEP = 1e-3
GROWTH = 5221.0
"""The most that a displacement of the angular velocity grows to after 20 s, from whichever moment on: by Euler's equations beside this
motion, at 6 s, where it leaves the middle axis."""


def _tumbling_cases() -> list[Case]:
    hard = "rotation about the middle axis turns over again and again; roundings of a million steps must not add up in one direction"
    both = ("rkmk4", "rk4")
    truncation = (np.linalg.norm(SPIN) * STEP) ** 4 / 20
    momentum = Bound(both, "worst", "5 eps √steps + (ωh)⁴/20", lambda m: 5 * EPS * np.sqrt(m.parameters["steps"]) + truncation)
    return [
        _case(
            "free tumbling: energy",
            hard,
            "largest relative drift",
            "conserved",
            partial(_tumbling, 0),
            (_rounding_walk(both, 5),),
            "Dzhanibekov; L. Euler",
        ),
        _case(
            "free tumbling: momentum",
            hard,
            "largest relative drift of the angular momentum",
            "conserved",
            partial(_tumbling, 1),
            (momentum,),
            "Dzhanibekov",
        ),
        _case(
            "free tumbling: length of the quaternion",
            hard,
            "largest | |q| - 1 |",
            "one",
            partial(_tumbling, 2),
            (at_most(("rkmk4",), "worst", "4 eps", 4 * EPS), _rounding_walk(("rk4",), 5)),
            "on the group it is kept by construction",
        ),
        _case(
            "free tumbling: angular velocity after 20 s",
            hard,
            "relative error",
            "Jacobi's elliptic functions, 30 digits",
            _elliptic,
            (at_most(("rkmk4", "dop853", "bulirsch-stoer", "dopri5"), "worst", "growth · rtol", GROWTH * TIGHT["rtol"]),),
            "C. G. J. Jacobi; L. D. Landau, E. M. Lifshitz, Mechanics, §37",
        ),
    ]


def _free_body() -> Multibody:
    model = Multibody("tumbling body")
    model.add_body("body", None, "free", mass=2.0, inertia=np.diag(INERTIA))
    return model


@lru_cache(maxsize=4)
def _tumbled(integrator: str, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """States at a hundred times, of free tumbling with a drift."""
    times = STEP * np.round(np.linspace(0, steps, 101))
    motion = _free_body().integrate_ode([1, 0, 0, 0, 0, 0, 0], [*SPIN, 0.1, 0.2, 0.3], times, integrator=integrator, step=STEP)
    return motion.q, motion.v


def _tumbling(which: int, seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    out = {}
    for integrator in ("rkmk4", "rk4"):
        q, v = _tumbled(integrator, steps)
        if which == 0:
            kinetic = _free_body().kinetic_energy(q, v)
            drift = np.abs(kinetic / kinetic[0] - 1)
        elif which == 1:
            momentum = np.array([_turned(x[:4], INERTIA * w[:3]) for x, w in zip(q, v, strict=True)])
            drift = np.linalg.norm(momentum - momentum[0], axis=1) / np.linalg.norm(momentum[0])
        else:
            drift = np.abs(np.linalg.norm(q[:, :4], axis=1) - 1)
        out[integrator] = np.array([drift.max()])
    return out


def _turned(q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """x in the body's axes, in the parent's: x + 2 w u×x + 2 u×(u×x), q made unit."""
    q = q / np.linalg.norm(q)
    once = np.cross(q[1:], x)
    return x + 2 * (q[0] * once + np.cross(q[1:], once))


def _elliptic(seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    end = 20.0
    exact = _euler_top(end)
    out = {}
    for integrator in ("rkmk4", *ADAPTIVE):
        options = {"step": 1e-3} if integrator == "rkmk4" else TIGHT
        motion = _free_body().integrate_ode([1, 0, 0, 0, 0, 0, 0], [*SPIN, 0, 0, 0], [0, end], integrator=integrator, **options)
        out[integrator] = np.array([np.linalg.norm(motion.v[-1, :3] - exact) / np.linalg.norm(exact)])
    return out


def _euler_top(t: float) -> np.ndarray:
    """ω(t) from SPIN, for J₁ < J₂ < J₃.

    With 2E = ΣJω², L² = ΣJ²ω² and L² > 2EJ₂: ω₁ = a₁ cn, ω₂ = a₂ sn, ω₃ = a₃ dn of τ = n (t - t₀); else the roles of 1 and 3 change.
    """
    with mpmath.workdps(30):
        J, w = [mpmath.mpf(float(x)) for x in INERTIA], [mpmath.mpf(float(x)) for x in SPIN]
        swap = sum(j * j * x * x for j, x in zip(J, w, strict=True)) < J[1] * sum(j * x * x for j, x in zip(J, w, strict=True))
        if swap:  # renamed, and mirrored to stay right-handed
            J, w = J[::-1], [-x for x in w[::-1]]
        T = sum(j * x * x for j, x in zip(J, w, strict=True))
        L = sum(j * j * x * x for j, x in zip(J, w, strict=True))
        a = [
            mpmath.sqrt(abs(x))
            for x in (
                (L - T * J[2]) / (J[0] * (J[0] - J[2])),
                (L - T * J[2]) / (J[1] * (J[1] - J[2])),
                (L - T * J[0]) / (J[2] * (J[2] - J[0])),
            )
        ]
        n = mpmath.sqrt(abs((J[2] - J[1]) * (L - T * J[0]) / (J[0] * J[1] * J[2])))
        m = abs((J[1] - J[0]) * (L - T * J[2]) / ((J[2] - J[1]) * (L - T * J[0])))
        # Signs: ω̇₂ = (J₃ - J₁)/J₂ ω₃ω₁ has the sign of ω₃ω₁ (J₃ - J₁); sn rises where cn and dn are positive.
        s1, s3 = mpmath.sign(w[0]), mpmath.sign(w[2])
        s2 = s1 * s3 * mpmath.sign(J[2] - J[0])
        start = mpmath.ellipf(mpmath.asin(s2 * w[1] / a[1]), m)
        tau = start + n * mpmath.mpf(t)
        sn, cn, dn = (mpmath.ellipfun(name, tau, m=m) for name in ("sn", "cn", "dn"))
        found = [s1 * a[0] * cn, s2 * a[1] * sn, s3 * a[2] * dn]
        if swap:
            found = [-x for x in found[::-1]]
        return np.array([float(x) for x in found])


# Heavy top ------------------------------------------------------------------------------------------------------------

TOP = "the heavy top of the IFToMM library of computational benchmark problems"
PLACE = np.array([0.1733439641, 0.6400885921, -0.7484907911])
"""Centre of mass after 1 s, as published."""

ENERGY = 5435.69679086
"""J, as published."""

TOP_STEPS = 200_000


def _top_cases() -> list[Case]:
    hard = "150 rad/s about the axis of symmetry, nutating and precessing; reference solutions differ in the tenth digit"
    methods = ("rkmk4", *ADAPTIVE)
    return [
        _case(
            "heavy top: place after 1 s",
            hard,
            "largest error of a coordinate, m",
            "published",
            partial(_top, 0),
            (at_most(methods, "worst", "2e-10", 2e-10),),
            TOP,
        ),
        _case(
            "heavy top: energy",
            hard,
            "relative difference at the start",
            "published",
            partial(_top, 1),
            (at_most(methods, "worst", "2e-12", 2e-12),),
            TOP,
        ),
        _case(
            "heavy top: drift of the energy over 1 s",
            hard,
            "relative drift",
            "conserved",
            partial(_top, 2),
            (at_most(methods, "worst", "5e-12", 5e-12),),
            TOP,
        ),
        _case(
            "heavy top: drift of the angular momentum about the vertical over 1 s",
            hard,
            "relative drift",
            "conserved",
            partial(_top, 3),
            (at_most(methods, "worst", "5e-12", 5e-12),),
            TOP,
        ),
    ]


def _top(which: int, seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    model = _heavy_top()
    out = {}
    for integrator in ("rkmk4", *ADAPTIVE):
        q, v = _top_motion(integrator)
        energy = model.kinetic_energy(q, v) + model.potential_energy(q)
        upward = np.array([_turned(at, ABOUT_ITS_POINT * rate)[2] for at, rate in zip(q, v, strict=True)])
        errors = (
            np.abs(_turned(q[-1], np.array([0.0, 1.0, 0.0])) - PLACE).max(),
            abs(energy[0] / ENERGY - 1),
            np.abs(energy / energy[0] - 1).max(),
            np.abs(upward / upward[0] - 1).max(),
        )
        out[integrator] = np.array([errors[which]])
    return out


ABOUT_ITS_POINT = np.array([15.234375, 0.46875, 15.234375])
"""Principal moments of the heavy top about its fixed point, kg m²."""


def _heavy_top() -> Multibody:
    model = Multibody("heavy top")
    model.add_body("top", None, "ball", mass=15.0, com=(0, 1, 0), inertia=np.diag([0.234375, 0.46875, 0.234375]))
    model.gravity = (0.0, 0.0, -9.81)
    return model


@lru_cache(maxsize=8)
def _top_motion(integrator: str) -> tuple[np.ndarray, np.ndarray]:
    options = {"step": 1 / TOP_STEPS} if integrator == "rkmk4" else TIGHT
    motion = _heavy_top().integrate_ode([1, 0, 0, 0], [0, 150, -4.61538], np.linspace(0, 1, 11), integrator=integrator, **options)
    return motion.q, motion.v


# Double pendulum ------------------------------------------------------------------------------------------------------

LEAST_STEPS = 400_000


def _double_pendulum_cases() -> list[Case]:
    return [
        _case(
            "double pendulum over 100 s: energy",
            "chaotic: states are lost after half a minute, the energy must not be",
            "largest drift over m g l",
            "conserved",
            _double_pendulum,
            (at_most(("rkmk4", "rkmk4, ud", "dop853"), "worst", "2e-11", 2e-11),),
            "",
        )
    ]


def _double_pendulum(seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    model = Multibody("double pendulum")
    for name, parent in (("upper", None), ("lower", "upper")):
        model.add_body(
            name,
            parent,
            axis=(0, 1, 0),
            position=(1, 0, 0) if parent else (0, 0, 0),
            mass=1.0,
            com=(0.5, 0, 0),
            inertia=np.diag([0, 1 / 12, 1 / 12]),
        )
    model.gravity = (0.0, 0.0, -9.81)
    ways = {
        "rkmk4": dict(integrator="rkmk4", step=100 / max(steps, LEAST_STEPS)),
        "rkmk4, ud": dict(integrator="rkmk4", step=100 / max(steps, LEAST_STEPS), form="ud"),
        "dop853": dict(integrator="dop853", **TIGHT),
    }
    out = {}
    for label, options in ways.items():
        motion = model.integrate_ode([0.0, 0.5], [0, 0], np.linspace(0, 100, 201), **options)
        energy = model.kinetic_energy(motion.q, motion.v) + model.potential_energy(motion.q)
        out[label] = np.array([np.abs(energy - energy[0]).max() / 9.81])
    return out


# Exact motions --------------------------------------------------------------------------------------------------------


def _pendulum() -> MeasuredCase:
    return _case(
        "simple pendulum: period",
        "released horizontally, back at rest after one period",
        "error of the period, s",
        f"{PERIOD} s, exact to its digits",
        _periods,
        (at_most(ADAPTIVE, "worst", "5e-12", 5e-12), at_most(("dop853, extended",), "worst", "half a unit of the last digit", 5.1e-13)),
        "IFToMM library of computational benchmark problems, simple pendulum",
    )


def _periods(seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    """At rest it falls with g: an error of the period shows as a velocity g times that."""
    model = Multibody("pendulum")
    model.add_body("bob", axis=(0, 1, 0), mass=1.0, com=(1, 0, 0))
    model.gravity = (0.0, 0.0, -9.81)
    out = {}
    for label in (*ADAPTIVE, "dop853, extended"):
        wide = {"precision": "extended", "rtol": 1e-17, "atol": 1e-17} if label.endswith("extended") else TIGHT
        motion = model.integrate_ode([0.0], [0.0], [0, PERIOD], integrator=label.split(",")[0], **wide)
        out[label] = np.array([abs(motion.v[-1, 0]) / 9.81])
    return out


def _stiff() -> list[Case]:
    methods = ("dopri5", "scipy:Radau", "scipy:BDF", "scipy:LSODA")
    return [
        _case(
            "stiff damping",
            "a wheel whose speed settles in a microsecond, followed for a second",
            "largest error of the velocity",
            "closed form",
            _wheel,
            (at_most(methods, "worst", "1e-8", 1e-8),),
            "exponential decay",
        ),
        _case(
            "stiff damping, steps a thousand times too long",
            "an explicit method with fixed steps blows up, and must raise",
            "0 where it raises",
            "an error that names the time",
            _blown_up,
            (at_most(("rkmk4", "rk4"), "worst", "0", 0.5),),
            "stability of explicit methods",
        ),
    ]


DAMPING, WHEEL = 5e5, 0.5


def _damped() -> Multibody:
    model = Multibody("wheel")
    model.add_body("wheel", mass=1.0, inertia=np.diag([1.0, 1.0, WHEEL]))
    return model


def _wheel(seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    """v = T/d + (v₀ - T/d) exp(-d t / J)."""
    times = np.array([0.0, 1e-6, 1e-3, 1.0])
    exact = 0.25 / DAMPING + (2 - 0.25 / DAMPING) * np.exp(-DAMPING / WHEEL * times)
    out = {}
    for integrator in ("dopri5", "scipy:Radau", "scipy:BDF", "scipy:LSODA"):
        end = times if integrator != "dopri5" else times[:3]  # it follows every microsecond
        motion = _damped().integrate_ode([0], [2], end, tau=[0.25], damping=[DAMPING], integrator=integrator, rtol=1e-10, atol=1e-12)
        out[integrator] = np.array([np.abs(motion.v[:, 0] - exact[: len(end)]).max()])
    return out


def _blown_up(seeds: Iterable[int], steps: int) -> dict[str, np.ndarray]:
    out = {}
    for integrator in ("rkmk4", "rk4"):
        try:
            _damped().integrate_ode([0], [2], [0, 1], damping=[DAMPING], integrator=integrator, step=1e-3)
            out[integrator] = np.array([np.inf])
        except _core.EvaluationError as error:
            out[integrator] = np.array([0.0 if " t = " in str(error) or " s" in str(error) else 1.0])
    return out
