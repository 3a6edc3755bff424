"""Steps on the group: `integrate` and `difference` of ball and free hinges, at small angles, near π and after many turns.

The translation of a free hinge under a screw is V(ω) v, V the derivative of the exponential: its small-angle limit is tested there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import mpmath
import numpy as np

from ...models.multibody import Multibody
from .case import Bound, Case, Measured, MeasuredCase

FAMILY = "steps on the group"
DIGITS = 60
SMALL = (1e-300, 1e-160, 1e-20, 1e-12, 1e-8, 1e-6, 1e-4, 1e-2)
LARGE = (1.0, 3.0, np.pi - 1e-8, np.pi, 2 * np.pi, 100.0, 2e6 * np.pi)

Quaternion = list
Errors = dict[str, np.ndarray]


def cases() -> list[Case]:
    return [
        _case(
            "exponential of a small angle",
            "sin(θ/2)/θ at θ → 0: every component keeps its relative accuracy",
            "rotation, component by component",
            partial(_over, SMALL, _exponential_small),
            4,
        ),
        _case(
            "exponential of a large angle",
            "the argument is exact and must be reduced as such",
            "quaternion",
            partial(_over, LARGE, _exponential_large),
            4,
        ),
        _case(
            "derivative of the exponential",
            "(1 - cos θ)/θ² and (θ - sin θ)/θ³ cancel at small angles",
            "translation of a free hinge",
            partial(_over, SMALL + LARGE[:-1], _translation),
            8,
        ),
        _case(
            "logarithm of a small angle", "θ / sin(θ/2) at θ → 0", "velocity, component by component", partial(_over, SMALL, _logarithm), 4
        ),
        _case(
            "logarithm near π",
            "w → 0: the angle comes from the vector part's side",
            "velocity",
            partial(_over, (1.0, 3.0, np.pi - 1e-4, np.pi - 1e-8, np.pi - 1e-12), _logarithm),
            4,
        ),
        _case(
            "derivative of the logarithm",
            "1/θ² - cot(θ/2)/(2θ) cancels at small angles",
            "twist of a free hinge",
            partial(_over, (*SMALL, 1.0, 3.0), _twist),
            8,
        ),
        _case(
            "there and back",
            "difference(q, integrate(q, dv)) = dv from arbitrary q",
            "velocity, absolute",
            partial(_over, (1e-8, 1e-4, 1.0, 3.0), _back),
            10,
        ),
        _case("the double cover", "q and -q are one configuration", "difference of q and -q", partial(_over, (0.0, 1.0), _cover), 8),
    ]


def _case(name: str, hard: str, quantity: str, measure: Callable[[Iterable[int], int], Errors], factor: float) -> MeasuredCase:
    """The length of a large rotation vector is also rounded: hence θ in the bound."""
    bounds = tuple(
        Bound((_label(angle),), "worst", f"{factor:g} (1 + θ) eps" if angle >= 1 else f"{factor:g} eps", partial(_limit, factor, angle))
        for angle in measure.args[0]  # type: ignore[attr-defined]  # a partial's
    )
    return MeasuredCase(name, FAMILY, hard, {}, measure, quantity, f"{DIGITS} digits, closed form", bounds, "exponential of SO(3), SE(3)")


def _limit(factor: float, angle: float, measured: Measured) -> float:
    return factor * (1 + angle if angle >= 1 else 1) * measured.eps


def _label(angle: float) -> str:
    return f"θ = π - {np.pi - angle:.0e}" if 0 < np.pi - angle < 1e-3 else f"θ = {angle:.9g}"


def _over(angles: Iterable[float], measure: Callable[[np.random.Generator, float], float], seeds: Iterable[int], steps: int) -> Errors:
    seeds = list(seeds)
    return {_label(angle): np.array([measure(np.random.default_rng(seed), angle) for seed in seeds]) for angle in angles}


# Measurements: one number of one seed ---------------------------------------------------------------------------------


def _exponential_small(rng: np.random.Generator, angle: float) -> float:
    w = angle * _unit(rng)
    step = _ball().integrate([1.0, 0.0, 0.0, 0.0], w)
    with mpmath.workdps(DIGITS):
        return _components(step, _exp(w))


def _exponential_large(rng: np.random.Generator, angle: float) -> float:
    w, q = angle * _unit(rng), _random_quaternion(rng)
    step = _ball().integrate(q, w)
    with mpmath.workdps(DIGITS):
        return _norm(step, _product(_exact_unit(q), _exp(w)))


def _translation(rng: np.random.Generator, angle: float) -> float:
    w, v = angle * _unit(rng), rng.normal(size=3)
    step = _free().integrate([1.0, 0, 0, 0, 0, 0, 0], np.r_[w, v])
    with mpmath.workdps(DIGITS):
        return _norm(step[4:], _moved(w, v), v)


def _logarithm(rng: np.random.Generator, angle: float) -> float:
    with mpmath.workdps(DIGITS):
        q = np.array([float(x) for x in _exp(angle * _unit(rng))])
        found = _ball().difference([1.0, 0.0, 0.0, 0.0], q)
        return _components(found, _log([mpmath.mpf(x) for x in q]))


def _twist(rng: np.random.Generator, angle: float) -> float:
    w, v = angle * _unit(rng), rng.normal(size=3)
    with mpmath.workdps(DIGITS):
        q = np.array([float(x) for x in [*_exp(w), *_moved(w, v)]])
        found = _free().difference([1.0, 0, 0, 0, 0, 0, 0], q)
        exact = _log([mpmath.mpf(x) for x in q[:4]])
        return max(_norm(found[:3], exact), _norm(found[3:], _unmoved(exact, q[4:])))


def _back(rng: np.random.Generator, angle: float) -> float:
    q = np.r_[_random_quaternion(rng), rng.uniform(-1, 1, 3)]
    dv = np.r_[angle * _unit(rng), angle * rng.normal(size=3)]
    model = _free()
    return float(np.abs(model.difference(q, model.integrate(q, dv)) - dv).max())


def _cover(rng: np.random.Generator, angle: float) -> float:
    q, model = _random_quaternion(rng), _ball()
    onward = model.integrate(q, angle * _unit(rng))
    return float(np.abs(model.difference(q, onward) - model.difference(-q, onward)).max())


# Models and closed forms ----------------------------------------------------------------------------------------------


def _ball() -> Multibody:
    model = Multibody("ball")
    model.add_body("body", None, "ball", mass=1.0, inertia=np.eye(3))
    return model


def _free() -> Multibody:
    model = Multibody("free body")
    model.add_body("body", None, "free", mass=1.0, inertia=np.eye(3))
    return model


def _unit(rng: np.random.Generator) -> np.ndarray:
    x = rng.normal(size=3)
    return x / np.linalg.norm(x)


def _random_quaternion(rng: np.random.Generator) -> np.ndarray:
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def _length(w) -> mpmath.mpf:
    return mpmath.sqrt(mpmath.fsum(mpmath.mpf(x) ** 2 for x in w))


def _exp(w) -> Quaternion:
    w = [mpmath.mpf(float(x)) for x in w]
    angle = _length(w)
    scale = mpmath.sin(angle / 2) / angle if angle else mpmath.mpf(1) / 2
    return [mpmath.cos(angle / 2), *(scale * x for x in w)]


def _log(q: Quaternion) -> list:
    """The velocity of at most π that turns by q, which need not have unit length."""
    s = _length(q[1:])
    w = q[0]
    angle = 2 * mpmath.atan2(s, abs(w))
    scale = (angle / s if s else 2 / abs(w)) * (1 if w >= 0 else -1)
    return [scale * x for x in q[1:]]


def _exact_unit(q) -> Quaternion:
    q = [mpmath.mpf(float(x)) for x in q]
    length = _length(q)
    return [x / length for x in q]


def _product(p: Quaternion, q: Quaternion) -> Quaternion:
    cross = _cross(p[1:], q[1:])
    return [
        p[0] * q[0] - mpmath.fsum(a * b for a, b in zip(p[1:], q[1:], strict=True)),
        *(p[0] * q[1 + i] + q[0] * p[1 + i] + cross[i] for i in range(3)),
    ]


def _cross(a, b) -> list:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _moved(w, v) -> list:
    """V(w) v = v + (1 - cos θ)/θ² w×v + (θ - sin θ)/θ³ w×(w×v)."""
    w, v = [mpmath.mpf(float(x)) for x in w], [mpmath.mpf(float(x)) for x in v]
    angle = _length(w)
    if angle < mpmath.mpf(10) ** (-DIGITS // 4):  # what is left out is below 1e-30
        first, second = mpmath.mpf(1) / 2, mpmath.mpf(1) / 6
    else:
        first, second = (1 - mpmath.cos(angle)) / angle**2, (angle - mpmath.sin(angle)) / angle**3
    once = _cross(w, v)
    twice = _cross(w, once)
    return [v[i] + first * once[i] + second * twice[i] for i in range(3)]


def _unmoved(w, p) -> list:
    """V(w)⁻¹ p = p - ½ w×p + (1/θ² - cot(θ/2)/(2θ)) w×(w×p)."""
    p = [mpmath.mpf(float(x)) for x in p]
    angle = _length(w)
    if angle < mpmath.mpf(10) ** (-DIGITS // 4):
        second = mpmath.mpf(1) / 12
    else:
        second = 1 / angle**2 - mpmath.cot(angle / 2) / (2 * angle)
    once = _cross(w, p)
    twice = _cross(w, once)
    return [p[i] - once[i] / 2 + second * twice[i] for i in range(3)]


def _norm(value, exact, size=None) -> float:
    """Error in the 2-norm, relative to the exact value, or to `size`."""
    return float(_length([mpmath.mpf(float(x)) - e for x, e in zip(value, exact, strict=True)]) / _length(exact if size is None else size))


def _components(value, exact) -> float:
    """The largest relative error of a component."""
    pairs = zip(value, exact, strict=True)
    return float(max(abs(mpmath.mpf(float(x)) - e) / abs(e) if e else mpmath.mpf(0 if x == 0 else mpmath.inf) for x, e in pairs))
