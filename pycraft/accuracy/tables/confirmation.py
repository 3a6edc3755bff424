"""Confirmation of the reference of an accuracy table by a method of another family."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import _core
from ...models.warning import warn

SECOND = "bulirsch-stoer"
"""The second method: extrapolation of the midpoint rule, with an estimate and coefficients unrelated to a Runge-Kutta pair."""
ENOUGH = 6
"""Least number of digits in which both must agree to confirm a reference."""


@dataclass(frozen=True)
class Confirmation:
    """Comparison of a reference with a second method.

    Attributes
    ----------
    by : the second method, in words
    distance : rad, m, between both motions, measured like errors; None if the second method gave no motion
    digits : number of digits to which both agree, relative to the largest displacement of the motion
    refused : why the second method gave no motion
    """

    by: str
    distance: float | None
    digits: int
    refused: str = ""

    @property
    def confirmed(self) -> bool:
        return self.digits >= ENOUGH

    @property
    def text(self) -> str:
        if self.distance is None:
            return f"NOT CONFIRMED: {self.by} gives no motion ({self.refused})"
        if self.confirmed:
            return f"confirmed to {self.digits} digits by {self.by}"
        return f"NOT CONFIRMED: {self.by} differs by {self.distance:.1e} rad or m, {self.digits} digits agree"


def confirmation(
    truth: np.ndarray, second: Callable[[], np.ndarray], distance: Callable[[np.ndarray, np.ndarray], float], by: str
) -> Confirmation:
    """Compare a reference with the motion of a second method; warn (ModelWarning) if they do not agree.

    Parameters
    ----------
    truth : (T, nq), the reference at the times of comparison, the start first
    second : function that computes the same by the second method
    distance : function that returns the distance of two such motions, rad, m
    """
    try:
        other = second()
    except (ArithmeticError, _core.Error) as reason:
        found = Confirmation(by, None, 0, str(reason))
    else:
        apart = distance(truth, other)
        size = distance(np.broadcast_to(truth[:1], truth.shape), truth)
        found = Confirmation(by, apart, _digits(apart, size))
    if not found.confirmed:
        warn(f"the reference is {found.text.replace('NOT CONFIRMED', 'not confirmed', 1)}: errors below that distance are meaningless")
    return found


def _digits(apart: float, size: float) -> int:
    """Return the number of decimal digits in which two motions agree, at most the digits of a double."""
    if not np.isfinite(apart):
        return 0
    most = 16
    return most if apart == 0 else int(np.clip(np.floor(-np.log10(apart / size)) if size > 0 else 0, 0, most))


def own_error(looser: float, found: Confirmation) -> float:
    """Return the error of the reference: the larger of its distances to a looser run and to the second method's."""
    return max(looser, found.distance or 0.0)


def about(found: Confirmation) -> dict[str, Any]:
    """Return the data for a table."""
    return {"confirmed_by": found.by, "confirmed_digits": found.digits if found.confirmed else 0, "confirmation": found.text}
