"""Relations of coordinates through points, for couplings: cams, cables on drums of any shape, measurements (docs/loops.md)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .. import _core


class Spline:
    """``follower = s(driver)``, s the cubic spline through points: the `function` of a coupling of two coordinates, [driver, follower].

    s has two continuous derivatives between its ends. Beyond them it continues straight; a periodic one repeats.

    Parameters
    ----------
    driver : (n,), ascending, n at least 2
        Coordinates of the driver: radians, or metres.
    follower : (n,)
        Coordinates of the follower at these points.
    periodic : bool
        The last point equals the first one, one period later: for a cam, driver[-1] - driver[0] = 2π. At least three points.
    ends : {"not-a-knot", "natural", "clamped"}; not for a periodic one
        "not-a-knot": one cubic through the first two intervals, and one through the last two, as in SciPy's CubicSpline. For values of a
        function at distance h, the error of s is O(h⁴) everywhere; its curvature stops at the ends, so that accelerations jump there.
        "natural": without curvature at the ends, so that nothing jumps there; with an error of O(h²) near them if the function has
        curvature there. "clamped": without slope, with an error of O(h).

    Raises
    ------
    ModelError
        Arrays of the wrong shape, values that are not finite, drivers that do not ascend, ends of a periodic spline that differ.

    Source: C. de Boor, A Practical Guide to Splines, Springer 2001, ch. IV, by SciPy's CubicSpline.

    Examples
    --------
    >>> import numpy as np, pycraft as pc
    >>> cam = pc.chain(2)
    >>> lift = pc.Spline(np.linspace(0, 2 * np.pi, 5), [0.0, 0.02, 0.05, 0.02, 0.0], periodic=True)
    >>> rise = cam.add_coupling(["hinge0", "hinge1"], function=lift, name="rise")
    >>> cam.assemble([np.pi + 6 * np.pi, 0.0], fix="hinge0").q.round(12).tolist()[1]
    0.05
    """

    def __init__(self, driver: Any, follower: Any, *, periodic: bool = False, ends: str = "not-a-knot"):
        from scipy.interpolate import CubicSpline

        if ends not in ("not-a-knot", "natural", "clamped"):
            raise _core.ModelError(f"a spline's ends are 'not-a-knot', 'natural' or 'clamped', not {ends!r:.80}")
        if periodic and ends != "not-a-knot":
            raise _core.ModelError(f"a periodic spline has no ends; leave out ends={ends!r}")
        x, y = (np.array(_core.real_array(given, f"{what} of a spline")) for given, what in ((driver, "driver"), (follower, "follower")))
        least = 3 if periodic else 2
        if x.ndim != 1 or x.shape != y.shape or len(x) < least:
            shapes = f"of one length, at least {least}, not {x.shape} and {y.shape}"
            raise _core.ModelError(f"a spline goes through points: driver and follower {shapes}")
        if not (np.isfinite(x).all() and np.isfinite(y).all()):
            raise _core.ModelError("a spline goes through points, and one of its numbers is not finite")
        if not (np.diff(x) > 0).all():
            at = int(np.flatnonzero(~(np.diff(x) > 0))[0])
            raise _core.ModelError(f"driver of a spline ascends, and {x[at + 1]:g} comes after {x[at]:g}")
        if periodic and not abs(y[-1] - y[0]) <= 64 * np.finfo(float).eps * np.abs(y).max():
            raise _core.ModelError(f"a periodic spline ends as it begins, and {y[-1]:g} is not {y[0]:g}")
        y[-1] = y[0] if periodic else y[-1]
        try:
            with np.errstate(all="ignore"):
                spline = CubicSpline(x, y, bc_type="periodic" if periodic else ends)
        except ValueError:  # of slopes that are not finite
            spline = None
        if spline is None or not np.isfinite(spline.c).all():
            raise _core.ModelError("a spline's slopes are too large for numbers: its points are too close for their differences")
        self._s, self._periodic, self._kind, self._ends = spline, periodic, ends, (float(x[0]), float(x[-1]))
        self._points = x, y

    def __reduce__(self):
        return partial(Spline, periodic=self._periodic, ends=self._kind), self._points  # in every protocol, unlike SciPy's own

    def __call__(self, q: np.ndarray) -> tuple[float, list[float], list[list[float]]]:
        """Return (r, gradient, second derivatives) of r = follower - s(driver), in the form of `Multibody.add_coupling`."""
        if len(q) != 2:
            raise _core.ModelError(f"a spline couples two coordinates, [driver, follower], not {len(q)}")
        first, last = self._ends
        x = q[0] if self._periodic else min(max(q[0], first), last)
        s, slope, bend = (float(self._s(x, nu)) for nu in range(3))
        if x != q[0]:
            s, bend = s + slope * (q[0] - x), 0.0
        return float(q[1]) - s, [-slope, 1.0], [[-bend, 0.0], [0.0, 0.0]]
