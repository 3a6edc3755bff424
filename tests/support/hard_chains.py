"""Chains that cost digits."""

import numpy as np

from pycraft.accuracy.hard_cases.chains import links


def hard(name, seed=0):
    """A chain that costs digits, a state of it and forces."""
    masses, lengths = HARD[name]
    rng = np.random.default_rng(seed)
    model = links(masses, lengths, rng, axes="coordinate")
    return model, rng.uniform(-3, 3, model.nv), rng.uniform(-1, 1, model.nv), rng.normal(size=model.nv)


HARD = {
    "even": ([1.0] * 8, [0.3] * 8),
    "tip 1e3": ([1.0] * 7 + [1e3], [0.1] * 8),
    "tip 1e6": ([1.0] * 7 + [1e6], [0.1] * 8),
    "tip 1e9": ([1.0] * 7 + [1e9], [0.1] * 8),
    "tip 1e12": ([1.0] * 7 + [1e12], [0.1] * 8),
    "growing": ([10.0**k for k in range(8)], [0.1] * 8),
    "growing, longer": ([10.0**k for k in range(8)], [0.1 * 2**k for k in range(8)]),
    "massless tip": ([1.0, 1.0, 0.0], [0.1] * 3),
    "alternating": ([1.0, 1e6] * 4, [0.1] * 8),
}
