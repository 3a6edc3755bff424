"""How large the forces of the direct calls are, and what rounding does to them."""

import numpy as np

from support.formulas import EPS, depth, norm


def roundings(o):
    """Roundings of one sweep, both evaluations counted, grown by ‖φ‖ per body."""
    return 200 * depth(o.parents) * EPS * max(1.0, norm(o.phi) / np.sqrt(max(1, len(o.phi))))


def force_size(o, description, vdot):
    """Size of the summands of generalized forces: ‖Hφ‖ (‖M‖ (‖φ*H*θ̈‖ + ‖φ*a‖) + ‖b‖) + ‖Jθ̈‖, without the cancellation in a and b."""
    V = norm(o.V)
    a = V * (norm(o.H.T @ o.v) + norm(o.v)) + norm(o.a_gravity) + norm(o.H_dot.T @ o.v)
    return norm(o.H @ o.phi) * (norm(o.M) * norm(o.phi) * (norm(o.H.T @ vdot) + a) + norm(o.M) * V**2) + norm(o.J @ vdot)
