"""Default stiffness of effects, from the inertia at each coordinate and a frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import _core


def stiffness_by_inertia(model: Any, coordinates: Sequence[int], frequency: float, effect: str) -> np.ndarray:
    """Return ω² (ℳ + J)_jj of coordinates, at the model's zero configuration: each alone then oscillates with ω.

    Under an acceleration of free fall α it deflects by about α/ω², for any size and mass of the model.

    Parameters
    ----------
    coordinates : indices of v
    frequency : ω in rad/s
    effect : its name in errors

    Returns
    -------
    (n,) N m/rad or N/m

    Raises
    ------
    ModelError
        A coordinate that moves no mass at the zero configuration, by name.

    Cost: one mass matrix, O(N d).
    """
    inertia = np.diag(np.asarray(model.mass_matrix(model.zero_q())))[list(coordinates)]
    for j, each in zip(coordinates, inertia, strict=True):
        if not each > 0:
            name = model.coordinate_names[j]
            raise _core.ModelError(
                f"{effect}: coordinate {name!r} of {model.name!r} moves no mass at q = 0, so there is no default stiffness; give stiffness="
            )
    return frequency**2 * inertia
