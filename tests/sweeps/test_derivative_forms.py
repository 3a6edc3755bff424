"""Derivatives of forward dynamics in every form, refinement and precision: they keep the digits that accelerations keep."""

import numpy as np
import pytest

import pycraft as pc
from support.forms import FACTORED, FORMS, KINDS, PARENTS, heavy_tip


def relative(got, truth):
    return max(np.abs(x - y).max() / max(np.abs(y).max(), 1e-3) for x, y in zip(got, truth, strict=True))


@pytest.mark.parametrize("form", FORMS)
def test_every_kind_of_hinge(form):
    """All forms against the derivatives in quad precision, rotor inertias and gravity included."""
    model = pc.tree(PARENTS, KINDS, seed=4)
    model.gravity = (1.0, -2.0, -9.81)
    model.hinges["hinge1"].rotor_inertia = [0.7]
    state = model.random_state(3)
    tau = np.random.default_rng(0).normal(size=model.nv)
    truth = model.forward_dynamics_derivatives(state.q, state.v, tau, precision="quad")
    for refine in (0, 1, "auto"):
        assert relative(model.forward_dynamics_derivatives(state.q, state.v, tau, form=form, refine=refine), truth) < 1e-11


def test_the_two_ways_agree_in_quad_precision():
    """-(ℳ+J)⁻¹∂T and the derivative of the sweep are written independently of each other."""
    model = pc.tree(PARENTS, KINDS, seed=5)
    model.gravity = (1.0, -2.0, -9.81)
    state = model.random_state(1)
    tau = np.random.default_rng(1).normal(size=model.nv)
    solved, *swept = (model.forward_dynamics_derivatives(state.q, state.v, tau, form=form, precision="quad") for form in FORMS)
    assert all(relative(one, solved) < 4 * np.finfo(float).eps for one in swept)


@pytest.mark.parametrize("form", FACTORED)
def test_light_links_before_a_heavy_tip(form):
    for seed in range(3):
        model, q, v, tau = heavy_tip(seed)
        truth = model.forward_dynamics_derivatives(q, v, tau, precision="quad")
        assert relative(model.forward_dynamics_derivatives(q, v, tau, form=form), truth) < 1e-10
        extended = model.forward_dynamics_derivatives(q, v, tau, form=form, precision="extended")
        assert relative(extended, truth) < 1e-12


def test_where_the_sweep_has_no_derivative_the_other_way_is_taken():
    """Point masses in a row on crossed axes: P⁺ has lost a direction at this configuration alone."""
    model = pc.Multibody("row")
    for k, axis in enumerate(([0, 0, 1.0], [0, 1.0, 0], [0, 0, 1.0], [0, 1.0, 0])):
        model.add_body(f"b{k}", f"b{k - 1}" if k else None, axis=axis, position=(1.0 if k else 0, 0, 0), mass=1.0, com=(0.5, 0, 0))
    q, v, tau = np.zeros(4), np.array([0.3, -0.2, 0.5, 0.1]), np.array([1.0, 2, 3, 4])
    truth = model.forward_dynamics_derivatives(q, v, tau, precision="quad")
    for form in FORMS:
        assert relative(model.forward_dynamics_derivatives(q, v, tau, form=form), truth) < 1e-12


def test_batches_and_options():
    model, q, v, tau = heavy_tip(0)
    one = model.forward_dynamics_derivatives(q, v, tau, form="ud")
    many = model.forward_dynamics_derivatives(np.tile(q, (3, 1)), v, tau, form="ud")
    assert all((y == x).all() and y.shape == (3, 10, 10) for x, y in zip(one, many, strict=True))
    for wrong in ({"form": "nothing"}, {"refine": -1}, {"residual": "narrow"}, {"precision": 50}):
        with pytest.raises(pc.EvaluationError):
            model.forward_dynamics_derivatives(q, v, tau, **wrong)
    refined = model.forward_dynamics_derivatives(q, v, tau, refine=2, residual="wider")
    truth = model.forward_dynamics_derivatives(q, v, tau, precision="quad")
    assert relative(refined[2:], truth[2:]) < 1e-13 < relative(model.forward_dynamics_derivatives(q, v, tau)[2:], truth[2:])


def test_energies_far_away():
    """Rounded once; differences near a datum keep their digits."""
    model = pc.Multibody("far")
    model.add_body("base", hinge="free", mass=2.0, com=(0.1, 0.2, 0.3), inertia=np.eye(3))
    model.add_body("arm", "base", axis=(0, 1.0, 0), position=(1, 2, 3), mass=0.7, com=(0.5, 0, 0), inertia=np.eye(3))
    model.gravity = (0.3, -0.1, -9.81)
    q, mass = np.array(model.random_state(0).q), 2.7
    far, shift = q.copy(), np.array([1e8, -2e8, 3e8])
    far[4:7] = shift
    q[4:7] = 0
    near = model.potential_energy(q)
    assert abs(model.potential_energy(far, datum=shift) - near) <= 4 * np.finfo(float).eps * abs(near)
    expected = near - mass * np.array(model.gravity) @ shift
    assert abs(model.potential_energy(far) - expected) <= 4 * np.finfo(float).eps * abs(expected)
    with pytest.raises(pc.ModelError, match="datum"):
        model.potential_energy(q, datum=(0, 1))
