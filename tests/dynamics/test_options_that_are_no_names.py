"""Options of direct calls that take a name and are given something else."""

import numpy as np
import pytest

import pycraft as pc

CALLS = {
    "forward_dynamics": lambda m, **how: m.forward_dynamics(m.q, m.v, np.zeros(2), **how),
    "mass_matrix_inverse": lambda m, **how: m.mass_matrix_inverse(m.q, **how),
    "prepare": lambda m, **how: m.prepare("forward_dynamics", **how),
    "refinement": lambda m, **how: m.refinement(m.q, m.v, np.zeros(2), **how),
    "hybrid_dynamics": lambda m, **how: m.hybrid_dynamics(m.q, m.v, prescribed=["hinge0"], **how),
    "prepared hybrid_dynamics": lambda m, **how: m.prepare("hybrid_dynamics", **how),
    "interbody_forces": lambda m, **how: m.interbody_forces(m.q, m.v, **how),
    "interbody_forces_derivatives": lambda m, **how: m.interbody_forces_derivatives(m.q, m.v, **how),
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("given", [None, 3.5, ["same"]], ids=repr)
def test_what_is_no_name_is_refused_by_the_option(call, given):
    """Not a TypeError that lists the signatures of the core."""
    for option in ("residual", "on_singular") if call in list(CALLS)[:3] else ("residual",):
        with pytest.raises(pc.EvaluationError, match=f"^{option}="):
            CALLS[call](pc.chain(2), **{option: given})
