"""What rotors add to the equations of motion, as letters of proofs: of every model, whatever its hinges.

The Coriolis matrix of rotors is skew, C_J* = -C_J, and zero with J; b_J = C_J θ̇. Where J is regular it is ΓJ - JΓ*, with Γ = ½C_J J⁻¹.
What is proved of every Γ holds where J is singular as well: both sides are continuous in J as long as D is regular.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core

GYRATING = "Γ_J"
"""The name of Γ; it depends on θ̇."""


def rotors_of_any(operators: Any) -> dict[str, Any]:
    """b_J and C_J of a model of which no more is said than that it has rotors; none of operators without velocities."""
    try:
        J, theta_dot = operators.J, operators.theta_dot
    except (AttributeError, _core.Error):
        return {}
    n = operators.Theta.dimension
    gamma = _core.constant(np.random.default_rng(n).uniform(-1, 1, (n, n)), operators.Theta, operators.Theta, GYRATING)
    matrix = gamma @ J - J @ gamma.T
    return {"C_J": matrix, "b_J": matrix @ theta_dot}
