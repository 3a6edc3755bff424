"""The forms of the articulated-inertia sweep, and models on which they round apart."""

from functools import cache

import numpy as np

from pycraft import _core
from pycraft.accuracy.hard_cases.chains import links

FORMS = ("fast", "ud", "square-root")
FACTORED = FORMS[1:]
RICCATI = "P P_plus D G K tau tau_bar E_psi psi psi_tilde Upsilon Omega".split()
PARENTS = [-1, 0, 1, 1, 3, 0, 5, 6, 2, 8]
KINDS = ["free", "pin", "ball", "slider", "universal", "screw", "custom", "planar", "free", "gimbal"]


def heavy_tip(seed, ratio=1e9, n=10):
    rng = np.random.default_rng([13, seed])
    model = links([1.0] * (n - 1) + [ratio], [0.1] * n, rng, "random")
    return model, rng.uniform(-3, 3, n), rng.normal(size=n), rng.normal(size=n)


def largest(x):
    """The largest entry of an array of mpmath numbers, as a double."""
    return float(max((abs(e) for e in np.asarray(x).flat), default=0.0))


@cache
def epsilon(precision):
    """Epsilon of a precision by its name or number of digits."""
    return float({str(name): value for name, value in _core.epsilons().items()}[str(precision)])
