"""Curves for points on loops: piecewise polynomials from any representation of a user, and normals along them (cpp/model/curve.h)."""

from __future__ import annotations

from collections.abc import Callable
from math import comb
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from .. import _core

_DEGREE = 12  # of a function's pieces: at their ends two derivatives have 144²/3 times its error, 1e-10
_EPS = float(np.finfo(float).eps)
_HALVES = 24  # of a piece, until it is smooth enough
_TURN = 0.25  # rad, of the tangent over a quarter of a piece: normals between the ends of one are then close to the normals at the ends


class Curve(NamedTuple):
    """Pieces: coefficients (n, order, 3) of the powers of u, which goes from -1 to 1 between two of `parameters` (n + 1,)."""

    parameters: np.ndarray
    coefficients: np.ndarray
    closed: bool


def curve_of(given: Any, parameters: Any, closed: Any, what: str, ends: Any = "not-a-knot") -> Curve:
    """Return the curve through points, of a SciPy piecewise polynomial, or of a function: see `Multibody.add_curve`."""
    if not isinstance(closed, (bool, np.bool_)):
        raise _core.ModelError(f"{what}: closed is True or False, not {closed!r}")
    if ends not in ("not-a-knot", "natural"):
        raise _core.ModelError(f"{what}: the ends of a curve through points are 'not-a-knot' or 'natural', not {ends!r:.80}")
    if ends != "not-a-knot" and (closed or callable(given)):
        kind = "a closed curve has no ends" if closed else "a function and a piecewise polynomial have ends of their own"
        raise _core.ModelError(f"{what}: {kind}; leave out ends={ends!r}")
    s = None if parameters is None else np.array(_core.real_array(parameters, f"parameters of {what}"))
    if s is not None and (s.ndim != 1 or len(s) < 2 or not np.isfinite(s).all() or not (np.diff(s) > 0).all()):
        raise _core.ModelError(f"{what}: parameters are two numbers at least, finite, and ascend")
    if callable(given) and hasattr(given, "c") and hasattr(given, "x"):
        if s is not None:
            raise _core.ModelError(f"{what}: a piecewise polynomial has its own parameters; leave parameters out")
        found = _of_polynomials(given, what)
    elif callable(given):
        if s is None:
            raise _core.ModelError(f"{what}: beside a function give parameters=(first, last), between which it is the curve")
        found = _fitted(given, s, what)
    else:
        found = _through(given, s, "periodic" if closed else ends, what)
    return checked(Curve(*found, bool(closed)), what)


def checked(curve: Curve, what: str) -> Curve:
    """Return the curve itself. ModelError if it is not finite, jumps, or has a corner between two pieces."""
    s, c, closed = curve
    if c.ndim != 3 or c.shape[2] != 3 or len(c) < 1 or c.shape[1] < 2 or len(s) != len(c) + 1:
        raise _core.ModelError(f"{what}: coefficients are (pieces, order, 3), order at least 2, and parameters one more than pieces")
    if not (np.isfinite(s).all() and (np.diff(s) > 0).all()):
        raise _core.ModelError(f"{what}: parameters are finite and ascend")
    if not np.isfinite(c).all():
        raise _core.ModelError(f"{what}: its curve has a number that is not finite")
    with np.errstate(all="ignore"):
        ends, begins = _valued(c, 1.0), _valued(c, -1.0)
        leaves, enters = (_unit(_valued(_slope(c), u)) for u in (1.0, -1.0))
    size = np.abs(c).max()
    for i in range(len(c)) if closed else range(len(c) - 1):
        after, at = (i + 1) % len(c), s[i + 1]
        if not np.abs(ends[i] - begins[after]).max() <= 1e-9 * size:
            remedy = "a closed curve ends where it begins" if after == 0 else "a curve is continuous"
            raise _core.ModelError(f"{what}: its curve jumps at parameter {at:g}; {remedy}")
        if np.abs(leaves[i] - enters[after]).max() > 1e-6:  # NaN tangents are no corner; with_normals reports them
            raise _core.ModelError(f"{what}: its curve has a corner at parameter {at:g}, where it has no normals; round it off")
    return curve


def curve_of_pieces(parameters: Any, rows: Any, closed: bool, what: str) -> Curve:
    """Return the curve of coefficients (pieces · order, 3), as files store them."""
    s, c = np.array([] if parameters is None else parameters, float), np.array([] if rows is None else rows, float)
    pieces = len(s) - 1
    if s.ndim != 1 or pieces < 1 or c.ndim != 2 or len(c) % pieces:
        raise _core.ModelError(f"{what}: a curve has parameters, two at least, and as many coefficients of each piece between them")
    return Curve(s, c.reshape(pieces, -1, 3), closed)


def with_normals(curve: Curve, what: str) -> np.ndarray:
    """Return coefficients (pieces, order, 6) of c and of m, a vector across c' that turns about it as little as possible, for the core.

    m is the cubic spline through normals of least rotation, for a closed curve with their total turn spread evenly.
    Source: W. Wang, B. Jüttler, D. Zheng, Y. Liu, Computation of rotation minimizing frames, ACM Trans. Graphics 27 (2008), by double
    reflection.
    ModelError if the curve stands still or turns back.
    """
    s, c = _until(curve.parameters, curve.coefficients, _turns_little, f"{what}: its curve stands still or turns back")
    for _ in range(8):
        m = _normals(s, c, curve.closed)
        far = ~_across(c, m)
        if not far.any():
            break
        s, c = _split(s, c, far)
    else:
        raise _core.ModelError(f"{what}: no normals of its curve were found; give parameters that are nearer to lengths along it")
    order = max(c.shape[1], m.shape[1])
    padded = [np.pad(x, ((0, 0), (0, order - x.shape[1]), (0, 0))) for x in (c, m)]
    return np.concatenate(padded, axis=2)


# ---------------------------------------------------------------------- representations of a user
def _through(given: Any, s: np.ndarray | None, ends: str, what: str) -> tuple[np.ndarray, np.ndarray]:
    from scipy.interpolate import CubicSpline

    closed = ends == "periodic"
    points = np.array(_core.real_array(given, f"points of {what}"))
    least = 4 if closed else 2
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < least:
        raise _core.ModelError(f"{what}: a curve goes through points (n, 3), n at least {least}, not {points.shape}")
    if not np.isfinite(points).all():
        raise _core.ModelError(f"{what}: a curve goes through points, and one of their numbers is not finite")
    with np.errstate(over="ignore"):
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if not (steps > 0).all():
        at = int(np.flatnonzero(~(steps > 0))[0])
        raise _core.ModelError(f"{what}: points {at} and {at + 1} of its curve are the same; give it once")
    if closed and not np.abs(points[-1] - points[0]).max() <= 64 * _EPS * np.abs(points).max():
        raise _core.ModelError(f"{what}: a closed curve ends where it begins; give its first point again as the last")
    points[-1] = points[0] if closed else points[-1]
    s = np.concatenate([[0.0], np.cumsum(steps)]) if s is None else s
    if len(s) != len(points):
        raise _core.ModelError(f"{what}: {len(points)} points have as many parameters, not {len(s)}")
    try:
        with np.errstate(all="ignore"):
            return _in_u(s, CubicSpline(s, points, bc_type=ends).c)
    except ValueError:  # of slopes that are not finite
        raise _core.ModelError(
            f"{what}: its curve has slopes too large for numbers; points are too far apart, or parameters too close"
        ) from None


def _of_polynomials(given: Any, what: str) -> tuple[np.ndarray, np.ndarray]:
    s, c = (np.array(_core.real_array(part, f"a piecewise polynomial of {what}")) for part in (given.x, given.c))
    if c.ndim != 3 or c.shape[2] != 3:
        raise _core.ModelError(f"{what}: a piecewise polynomial gives points (3,), not {c.shape[2:]}")
    return _in_u(s, c)


def _fitted(f: Callable[[float], Any], s: np.ndarray, what: str) -> tuple[np.ndarray, np.ndarray]:
    """Fit f to its rounding by polynomials at Chebyshev's points, halving pieces until the last coefficients are that small."""
    nodes, beside = chebyshev.chebpts1(_DEGREE + 1), np.array([-0.97, 0.05, 0.83])
    fit, there = np.linalg.inv(chebyshev.chebvander(nodes, _DEGREE)), chebyshev.chebvander(beside, _DEGREE)

    def values(u: np.ndarray, first: float, last: float) -> np.ndarray:
        return np.array([_point(f, first + (last - first) * (1 + x) / 2, what) for x in u])

    edges = [first + (last - first) * i / 4 for first, last in zip(s[:-1], s[1:], strict=True) for i in range(4)] + [s[-1]]
    waiting = [(edges[i], edges[i + 1], 0) for i in reversed(range(len(edges) - 1))]
    tolerance = 64 * _EPS * max(np.abs(_point(f, x, what)).max() for x in edges)
    breaks, pieces = [s[0]], []
    while waiting:
        first, last, halves = waiting.pop()
        found = fit @ values(nodes, first, last)
        tolerance = max(tolerance, 64 * _EPS * np.abs(found).max())
        off = max(np.abs(found[-2:]).max(), np.abs(there @ found - values(beside, first, last)).max())
        if off <= tolerance:
            breaks.append(last)
            pieces.append(np.stack([np.pad(p := chebyshev.cheb2poly(x), (0, _DEGREE + 1 - len(p))) for x in found.T], axis=1))
        elif halves == _HALVES or len(pieces) > 4096:
            raise _core.ModelError(
                f"{what}: the function of its curve is not smooth near parameter {first:g}; round it off, or give a spline"
            )
        else:
            middle = (first + last) / 2
            waiting += [(middle, last, halves + 1), (first, middle, halves + 1)]
    return np.array(breaks), np.array(pieces)


def _point(f: Callable[[float], Any], s: float, what: str) -> np.ndarray:
    try:
        given = f(float(s))
    except Exception as error:
        raise _core.ModelError(f"{what}: the function of its curve fails at {s:g}: {type(error).__name__}: {error}") from error
    point = _core.real_array(given, f"the function of {what}")
    if point.shape != (3,) or not np.isfinite(point).all():
        raise _core.ModelError(
            f"{what}: the function of its curve gives three finite numbers, and at {s:g} it gives {np.asarray(point)!s:.80}"
        )
    return np.array(point)


# ---------------------------------------------------------------------- pieces
def _moved(c: np.ndarray, shift: Any, scale: Any) -> np.ndarray:
    """Return coefficients of f(shift + scale u) from those of f (pieces, order, ...)."""
    order = c.shape[1]
    shift, scale = (np.broadcast_to(np.asarray(x, float), len(c)) for x in (shift, scale))
    to = np.zeros((len(c), order, order))
    for k in range(order):
        for j in range(k, order):
            to[:, k, j] = comb(j, k) * shift ** (j - k) * scale**k
    return np.asarray(np.einsum("pkj,pj...->pk...", to, c))


def _in_u(s: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Convert SciPy's coefficients, of powers of s - s_i, the highest first, to powers of u, the lowest first."""
    half = np.diff(s) / 2
    return s, _moved(np.swapaxes(c[::-1], 0, 1), half, half)


def _split(s: np.ndarray, c: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split these pieces in halves."""
    lower, upper = _moved(c, -0.5, 0.5), _moved(c, 0.5, 0.5)
    pieces = [part for i, halve in enumerate(which) for part in ((lower[i], upper[i]) if halve else (c[i],))]
    middles = [(s[i] + s[i + 1]) / 2 for i in np.flatnonzero(which)]
    return np.sort(np.concatenate([s, middles])), np.array(pieces)


def _until(s: np.ndarray, c: np.ndarray, enough: Callable[[np.ndarray], np.ndarray], refusal: str) -> tuple[np.ndarray, np.ndarray]:
    for _ in range(_HALVES):
        wanting = ~enough(c)
        if not wanting.any():
            return s, c
        if len(c) > 1e5:
            break
        s, c = _split(s, c, wanting)
    raise _core.ModelError(f"{refusal} near parameter {s[np.flatnonzero(~enough(c))[0]]:g}")


def _slope(c: np.ndarray) -> np.ndarray:
    return c[:, 1:] * np.arange(1, c.shape[1])[None, :, None]


def _valued(c: np.ndarray, u: float) -> np.ndarray:
    return np.asarray(np.einsum("k,pkj->pj", u ** np.arange(c.shape[1]), c))


def _unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _tangents(c: np.ndarray) -> np.ndarray:
    """Return tangents at five places of each piece: (pieces, 5, 3), zero where the curve stands still."""
    slopes = np.stack([_valued(_slope(c), u) for u in np.linspace(-1, 1, 5)], axis=1)
    sizes = np.linalg.norm(slopes, axis=2, keepdims=True)
    return np.where(sizes > 1e-3 * sizes.max(axis=1, keepdims=True), slopes / np.where(sizes > 0, sizes, 1.0), 0.0)


def _turns_little(c: np.ndarray) -> np.ndarray:
    t = _tangents(c)
    return np.asarray((np.einsum("pij,pij->pi", t[:, 1:], t[:, :-1]) >= np.cos(_TURN)).all(axis=1))


def _across(c: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Check that m keeps half of a unit across the tangent all along each piece."""
    normals = np.stack([_valued(m, u) for u in np.linspace(-1, 1, 5)], axis=1)
    return np.asarray((np.linalg.norm(np.cross(normals, _tangents(c)), axis=2) > 0.5).all(axis=1))


def _normals(s: np.ndarray, c: np.ndarray, closed: bool) -> np.ndarray:
    """Return m in powers of u, from normals at the ends of the pieces."""
    from scipy.interpolate import CubicSpline

    points = np.concatenate([_valued(c, -1.0), _valued(c[-1:], 1.0)])
    t = _unit(np.concatenate([_valued(_slope(c), -1.0), _valued(_slope(c[-1:]), 1.0)]))
    normals = [_first_normal(t)]
    for i in range(len(c)):
        v = points[i + 1] - points[i]
        r, turned = (x - 2 * (v @ x) / (v @ v) * v for x in (normals[-1], t[i]))
        w = t[i + 1] - turned
        r = r - 2 * (w @ r) / (w @ w) * w
        normals.append(_unit(r - (r @ t[i + 1]) * t[i + 1]))
    if closed:
        angle = np.arctan2(np.cross(normals[-1], normals[0]) @ t[0], normals[-1] @ normals[0])
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        shares = angle * way / way[-1]
        normals = [np.cos(a) * n + np.sin(a) * np.cross(u, n) for a, n, u in zip(shares, normals, t, strict=True)]
        normals[-1] = normals[0]
    return _in_u(s, CubicSpline(s, np.array(normals), bc_type="periodic" if closed else "not-a-knot").c)[1]


def _first_normal(t: np.ndarray) -> np.ndarray:
    """Return a unit vector across the first tangent: the plane's normal for a plane curve; else the direction least along the curve."""
    axis = np.linalg.svd(t)[2][-1]
    axis = axis * np.sign(axis[np.argmax(np.abs(axis))])
    if abs(axis @ t[0]) > 0.9:
        axis = np.eye(3)[np.argmin(np.abs(t[0]))]
    return _unit(axis - (axis @ t[0]) * t[0])
