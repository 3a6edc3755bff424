"""Options of direct calls that take a name and are given something else."""

import numpy as np
import pytest

import pycraft as pc

CALLS = {
    "forward_dynamics": lambda m, **how: m.forward_dynamics(m.q, m.v, np.zeros(2), **how),
    "mass_matrix_inverse": lambda m, **how: m.mass_matrix_inverse(m.q, **how),
    "prepare": lambda m, **how: m.prepare("forward_dynamics", **how),
    "prepared mass_matrix_inverse": lambda m, **how: m.prepare("mass_matrix_inverse", **how),
    "refinement": lambda m, **how: m.refinement(m.q, m.v, np.zeros(2), **how),
    "hybrid_dynamics": lambda m, **how: m.hybrid_dynamics(m.q, m.v, prescribed=["hinge0"], **how),
    "prepared hybrid_dynamics": lambda m, **how: m.prepare("hybrid_dynamics", **how),
    "interbody_forces": lambda m, **how: m.interbody_forces(m.q, m.v, **how),
    "interbody_forces_derivatives": lambda m, **how: m.interbody_forces_derivatives(m.q, m.v, **how),
    "forward_dynamics_derivatives": lambda m, **how: m.forward_dynamics_derivatives(m.q, m.v, np.zeros(2), **how),
    "scene": lambda m, **how: pc.Scene(m, **how),
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("given", [None, 3.5, ["same"]], ids=repr)
def test_what_is_no_name_is_refused_by_the_option(call, given):
    """Not a TypeError that lists the signatures of the core."""
    for option in ("residual", "on_singular") if call in list(CALLS)[:4] else ("residual",):
        with pytest.raises(pc.EvaluationError, match=f"^{option}="):
            CALLS[call](pc.chain(2), **{option: given})


@pytest.mark.parametrize("call", CALLS)
def test_none_is_no_default(call):
    """What is left out has its default; None is refused, also where options are read once."""
    if call not in ("interbody_forces", "interbody_forces_derivatives"):
        with pytest.raises(pc.EvaluationError, match=r"form=None|no form .* is called 'None'"):
            CALLS[call](pc.chain(2), form=None)
    with pytest.raises(pc.EvaluationError, match="refine=None"):
        CALLS[call](pc.chain(2), refine=None)
    if call == "interbody_forces_derivatives":  # in double alone
        return
    with pytest.raises(pc.EvaluationError, match="no precision is called 'None'"):
        CALLS[call](pc.chain(2), precision=None)
