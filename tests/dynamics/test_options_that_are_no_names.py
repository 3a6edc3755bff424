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
    """Omitted options have their defaults; None is refused, also where options are read once."""
    if call not in ("interbody_forces", "interbody_forces_derivatives"):
        with pytest.raises(pc.EvaluationError, match=r"form=None|no form .* is called 'None'"):
            CALLS[call](pc.chain(2), form=None)
    with pytest.raises(pc.EvaluationError, match="refine=None"):
        CALLS[call](pc.chain(2), refine=None)
    if call == "interbody_forces_derivatives":  # in double alone
        return
    with pytest.raises(pc.EvaluationError, match="no precision is called 'None'"):
        CALLS[call](pc.chain(2), precision=None)


NO_NAMES = [None, 3.5, ["same"], np.zeros(3), np.zeros((0, 0)), np.array("quad")]


@pytest.mark.parametrize("given", NO_NAMES, ids=repr)
def test_what_is_no_name_is_refused_whatever_takes_it(given):
    arm = pc.chain(2)
    closure = arm.add_loop("body1", hinge="ball", point=(1, 0, 0), name="tip")
    arm.q = arm.assemble([0.5, -1.0]).q
    for what, call in {
        "form": arm.coriolis_matrix,
        "residual": arm.constrained_dynamics,
        "over": arm.log_determinant_gradient,
        "normalise": lambda **how: arm.integrate_ode(arm.q, arm.v, [0, 0.1], **how),
        "unreached": lambda **how: arm.solve_ik({"body1": (1, 0, 0)}, **how),
    }.items():
        with pytest.raises(pc.EvaluationError, match=f"^{what}="):
            call(**{what: given})
    closure.remove()
    with pytest.raises(pc.EvaluationError, match="no integrator is called"):
        arm.integrate_ode(arm.q, arm.v, [0, 0.1], integrator=given)
    for call in (arm.operational_space_inertia, arm.operational_space_compliance):
        with pytest.raises(pc.EvaluationError, match="^form="):
            call("body1", form=given)
    for call in (arm.subgraph, lambda **how: arm.path("body0", "body1", **how)):
        with pytest.raises(pc.ModelError, match="the base of a part is named by a string"):
            call(base=given)
    if not isinstance(given, np.ndarray):
        return
    for call in (arm.forward_dynamics, arm.mass_matrix_inverse, arm.constrained_dynamics, arm.refinement):
        with pytest.raises(pc.EvaluationError, match="^refine="):
            call(refine=given)
    for call in (arm.operational_space_inertia, arm.operational_space_compliance):
        with pytest.raises(pc.Error, match="precision"):
            call("body1", precision=np.atleast_1d(given))


@pytest.mark.parametrize("given", [None, 1, "no", np.zeros(3), np.array("yes")], ids=repr)
def test_what_is_on_or_off_is_true_or_false(given):
    """ "no" would be on, and an array is neither."""
    arm = pc.chain(2)
    frame = arm.add_frame("loose", "body1")
    for what, call in {
        "loops": arm.interbody_forces,
        "limits": arm.equilibrium,
        "stable": arm.equilibrium,
        "nodes": arm.tree,
        "impulsive": lambda **how: arm.lock("hinge1", **how),
        "keep_pose": lambda **how: frame.attach("body0", **how),
    }.items():
        with pytest.raises(pc.ModelError, match=f"^{what}=.*: give True or False"):
            call(**{what: given})
    for call in (arm.linearize, arm.equilibrium):
        with pytest.raises(pc.ModelError, match="^loops=.*: give True or False"):
            call(loops=given)
    assert arm.lock("hinge1", impulsive=np.bool_(False)).loss == 0


def test_arrays_without_axes_are_no_lists():
    """They count as what can be gone through, and cannot."""
    arm, name = pc.chain(2), np.array("hinge1")
    for call in (
        lambda: arm.lock(name),
        lambda: arm.unlock(name),
        lambda: arm.coalesce(name),
        lambda: arm.split(name),
        lambda: arm.assemble(fix=name),
        lambda: arm.linearize(inputs=name),
        lambda: arm.linearize(outputs=name),
        lambda: arm.linearize().place(name),
        lambda: arm.counterbalance(actuated=name),
        lambda: arm.hybrid_dynamics(prescribed=name),
        lambda: arm.soa.free(name),
        lambda: arm.task_space(name),
        lambda: arm.task_space({"body1": name}),
        lambda: arm.solve_ik({"body1": (1, 0, 0)}, coordinates=name),
        lambda: arm.operational_space_inertia(name),
        lambda: arm.subgraph(bodies=name),
        lambda: arm.soa.embedded(name),
    ):
        with pytest.raises(pc.ModelError):
            call()


def test_numbers_of_an_integration_and_poses_of_copies():
    arm = pc.chain(2)
    for what in ("rtol", "atol", "step"):
        for given in ("fine", [], np.zeros(3), 1j, object()):
            with pytest.raises(pc.ModelError, match=f"^{what}"):
                arm.integrate_ode(arm.q, arm.v, [0, 0.1], **{what: given})
    before = list(arm.bodies)
    for given in ("here", [], np.zeros((2, 2)), object(), 1j):
        for what in ("position", "rotation"):
            with pytest.raises(pc.ModelError, match=what):
                arm.copy_subtree("body1", suffix=" again", **{what: given})
            with pytest.raises(pc.ModelError, match=what):
                arm.merge(pc.chain(1), suffix=" again", **{what: given})
    assert list(arm.bodies) == before
    for given in ("here", {}, object(), 1j, (0.1,)):
        for call in (arm.dof_shares, arm.mobility, lambda q: arm.equilibrium(q0=q)):
            with pytest.raises(pc.ModelError, match="q"):
                call(given)
    for given in (None, "arm", [], 1):
        with pytest.raises(pc.ModelError, match="a description is a dictionary"):
            pc.Multibody.from_description(given)
    with pytest.raises(pc.ModelError, match="a set of operators is named by a string"):
        arm.soa(None)
    with pytest.raises(pc.ModelError, match="batch must be a number of states from 0 to"):
        arm.neutral(10**30)


def test_certificates_take_no_complex_numbers():
    """Their imaginary parts were left out."""
    arm = pc.chain(2)
    for given in ((np.array([0.1, 0.2j]),), ([0.1, 0.2], [1j, 0.0]), ([0.1, 0.2], [0.1, 0.2], [1.0, 1j])):
        with pytest.raises(pc.ModelError, match="takes 2 numbers"):
            arm.certify(*given)
