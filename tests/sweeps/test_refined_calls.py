"""Requests that are refined: solves with operators, realizations, batches, every precision; and requests that are not.

Errors and floors as in test_refinement.
"""

import numpy as np
import pytest

import pycraft as pc
from support.descriptions import body, model, random_inertia, subhinge
from support.exact_accelerations import chain, drawn, exact_accelerations, floor, heavy_tip, relative_error
from support.forms import FORMS
from support.formulas import EPS, amplification, letters_of
from support.mechanisms import every_kind, uniform_batch

each_form = pytest.mark.parametrize("form", FORMS)


# ---------------------------------------------------------------------- what is refined


@each_form
def test_solves_with_operators(form):
    """ℳ⁻¹x and its columns, by recognition and spelled out."""
    multibody = heavy_tip(1e9, gravity=(0, 0, 0))
    q, _, x = drawn(multibody, 4)
    exact = exact_accelerations(multibody, q, 0 * x, x)
    H, phi, M, J, D, K, psi, I = multibody.soa("H phi M J D K psi I")
    plain = H @ phi @ M @ phi.T @ H.T
    for op in (plain.inv(), (plain + J).inv()):
        assert relative_error(op.at(q, form=form, refine=1) @ x, exact) <= floor(10)
        assert relative_error(op.at(q, form=form, refine="auto", residual="wider") @ x, exact) <= floor(10)
        assert relative_error(op.at(q, form=form, refine=1).dense() @ x, exact) <= 10 * floor(10)
    both = plain.inv().at(q, form=form, refine=1) @ np.column_stack([x, 2 * x])
    assert relative_error(both[:, 0], exact) <= floor(10) and relative_error(both[:, 1] / 2, exact) <= floor(10)
    inverse = multibody.mass_matrix_inverse(q, form=form, refine=1)
    assert relative_error(inverse @ x, exact) <= 10 * floor(10) and np.array_equal(inverse, inverse.T)


@each_form
def test_realizations(form):
    """(ℳ + 0.1 I)⁻¹ has no theorem; it is ℳ⁻¹ of the same chain with rotors of 0.1."""
    multibody = heavy_tip(1e9, gravity=(0, 0, 0))
    q, _, x = drawn(multibody, 5)
    exact = exact_accelerations(heavy_tip(1e9, rotor=0.1, gravity=(0, 0, 0)), q, 0 * x, x)
    H, phi, M, I = multibody.soa("H phi M I")
    op = (H @ phi @ M @ phi.T @ H.T + 0.1 * I).inv()
    unrefined = relative_error(op.at(q, form=form) @ x, exact)
    assert unrefined < 1e-2
    for way in (dict(refine=1), dict(refine=2), dict(refine="auto"), dict(refine=2, residual="wider")):
        found = relative_error(op.at(q, form=form, **way) @ x, exact)
        assert found <= max(100 * unrefined**2, 100 * floor(10)), f"{way}: {found} of {unrefined}"
    assert relative_error(op.at(q, form=form, refine=2, residual="wider") @ x, exact) <= floor(10)


def test_single_precision_with_a_wider_residual():
    """Sweeps in single, residuals in double: the answer is right to the rounding of a single, whatever the sweeps lose."""
    single = 2.0**-23
    for multibody in (heavy_tip(1e3), heavy_tip(1e4), every_kind(True)):
        for seed in range(4):
            state = multibody.random_state(seed)
            draw = state.q, state.v, np.random.default_rng(seed).normal(size=multibody.nv)
            exact = multibody.forward_dynamics(*draw, precision="quad")
            error = lambda **way: np.linalg.norm(
                multibody.forward_dynamics(*draw, precision="single", **way) - exact) / np.linalg.norm(exact)  # noqa: B023 - called before the next  # fmt: skip
            assert error(refine="auto", residual="wider") <= single, (multibody.name, seed)
            assert error() <= 1e3 * single * amplification(letters_of(multibody, draw[0]).o)


@each_form
@pytest.mark.parametrize("name", ["every kind", "every kind with rotors", "massless inner bodies"])
def test_refinement_of_what_needs_none(name, form):
    """Rotors, ball and free hinges, branches, gravity and velocities: the residual knows them all, or a correction would spoil a good
    answer."""
    if name == "massless inner bodies":
        rng = np.random.default_rng(8)
        pin = lambda: [subhinge("pin", rng.normal(size=3), 0.3 * rng.normal(size=3))]
        solid = dict(mass=2.0, com=[0.1, 0.2, 0.3], inertia=random_inertia(rng, 2.0))
        multibody = pc.Multibody.from_description(
            model([body("a", -1, pin(), mass=0.0), body("b", 0, pin(), mass=0.0), body("c", 1, pin(), **solid)], (1, 2, 3))
        )
        multibody.take_warnings()
        state = multibody.random_state(1)
        multibody.q, multibody.v = state.q, state.v
    else:
        multibody = every_kind(rotor_inertia="rotors" in name)
    tau = np.random.default_rng(1).normal(size=multibody.nv)
    exact = multibody.forward_dynamics(multibody.q, multibody.v, tau, precision="quad")
    o = letters_of(multibody).o
    floor_here = 1e3 * EPS * np.linalg.cond(o.mass_matrix + o.J)
    for way in (dict(refine=1), dict(refine=2, residual="wider"), dict(refine="auto")):
        got = multibody.forward_dynamics(multibody.q, multibody.v, tau, form=form, **way)
        assert np.linalg.norm(got - exact) <= floor_here * np.linalg.norm(exact)
    sharp = multibody.forward_dynamics(multibody.q, multibody.v, tau, form=form, refine=2, residual="wider")
    assert np.linalg.norm(sharp - exact) <= 4 * EPS * np.linalg.norm(exact)


@pytest.mark.parametrize("form", ["fast", "ud"])
def test_batches_are_refined_state_by_state(form):
    multibody = heavy_tip(1e9)
    draws = [drawn(multibody, seed) for seed in range(5)]
    Q, V, tau = (np.array(x) for x in zip(*draws, strict=True))
    exact = multibody.forward_dynamics(Q, V, tau, precision="quad")
    first = (np.linalg.norm(multibody.forward_dynamics(Q, V, tau, form=form) - exact, axis=1) / np.linalg.norm(exact, axis=1)).max()
    for way in (dict(refine=1), dict(refine="auto"), dict(refine=1, residual="wider")):
        got = multibody.forward_dynamics(Q, V, tau, form=form, **way)
        left = 0.0 if way["refine"] == "auto" else 10 * first**2  # one correction squares the error
        assert (np.linalg.norm(got - exact, axis=1) <= (floor(10) + left) * np.linalg.norm(exact, axis=1)).all()
    H, phi, M = multibody.soa("H phi M")
    op = (H @ phi @ M @ phi.T @ H.T).inv()
    whole = op.at(Q, form=form, refine=1) @ tau
    assert all(np.array_equal(whole[i], op.at(q, form=form, refine=1) @ t) for i, (q, t) in enumerate(zip(Q, tau, strict=True)))


# ---------------------------------------------------------------------- what is not


def test_nothing_is_refined_where_nothing_is_solved():
    multibody = every_kind(True)
    Q, _ = uniform_batch(multibody, 2, 1)
    H, phi, M, P, K, psi, Upsilon = multibody.soa("H phi M P K psi Upsilon")
    x = np.random.default_rng(0).normal(size=multibody.nv)
    for op in (H, phi, M, H @ phi @ M @ phi.T @ H.T, P, K, psi, Upsilon):
        assert np.array_equal(op.at(Q[0], refine=2, residual="wider").dense(), op.at(Q[0]).dense())
    MM = H @ phi @ M @ phi.T @ H.T
    assert np.array_equal(MM.at(Q[0], refine="auto") @ x, MM.at(Q[0]) @ x)
    assert float(MM.trace().at(Q[0], refine=1)) == float(MM.trace().at(Q[0]))


def test_no_correction_is_no_correction():
    multibody = heavy_tip(1e9)
    draw = drawn(multibody, 0)
    plain = multibody.forward_dynamics(*draw)
    assert np.array_equal(plain, multibody.forward_dynamics(*draw, refine=0))
    assert np.array_equal(plain, multibody.forward_dynamics(*draw, refine=0, residual="wider"))
    assert not np.array_equal(plain, multibody.forward_dynamics(*draw, refine=1))
    found = multibody.refinement(*draw, refine=0)
    assert found["steps"] == 0 and np.array_equal(found["value"], plain)


@pytest.mark.parametrize("refine", [-1, -2, 1.5, "twice", None])
def test_what_is_no_number_of_corrections_is_refused(refine):
    multibody = heavy_tip(1e3)
    draw = drawn(multibody, 0)
    for call in (
        lambda: multibody.forward_dynamics(*draw, refine=refine),
        lambda: multibody.mass_matrix_inverse(draw[0], refine=refine),
        lambda: multibody.refinement(*draw, refine=refine),
        lambda: multibody.soa.D.at(draw[0], refine=refine),
    ):
        with pytest.raises((pc.Error, TypeError), match="refine"):
            pytest.fail(str(call()))


def test_singular_hinges_are_named_before_anything_is_refined():
    multibody = chain([1.0, 1.0, 0.0], [0.1] * 3)
    multibody.take_warnings()
    draw = drawn(multibody, 0)
    for form in FORMS:
        with pytest.raises(pc.SingularHingeError, match="'link2_hinge' of body 'link2'"):
            multibody.forward_dynamics(*draw, form=form, refine="auto")
