"""Numbers of mpmath as long doubles."""

from __future__ import annotations

from typing import Any

import numpy as np


def as_extended(array: Any) -> Any:
    """mpmath numbers as long doubles: each the sum of a double and the rest."""
    high = np.asarray(array, float)
    low = np.asarray(array - high, float)
    return high.astype(np.longdouble) + low.astype(np.longdouble)
