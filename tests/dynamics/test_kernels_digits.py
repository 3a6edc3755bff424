"""Digits that kernels lost once: small entries beside large ones, points on the axis of a spin, rotors far heavier than what they carry,
pivots that are what others left behind, angles beyond all digits. Each to a few roundings of the entry itself, not of the largest."""

import math

import mpmath
import numpy as np
import pytest

import pycraft as pc

EPS = np.finfo(float).eps


@pytest.mark.parametrize("length", [1.0, 1e4, 1e6])
def test_a_body_far_along_the_axis_of_a_pin(length):
    """Its inertia about that axis is of its distance from it alone."""
    arm = pc.Multibody("far along")
    arm.add_body("a", axis=(1, 0, 0))
    arm.add_body("b", "a", axis=(0, 1, 0), position=(length, 1e-3, 0), mass=1, inertia=1e-8 * np.eye(3))
    q = [0.3, 0.2]
    for call in (arm.mass_matrix, lambda q, **how: np.linalg.inv(arm.mass_matrix_inverse(q, **how))):
        found = call(q)[0, 0]
        assert abs(found - (1e-6 + 1e-8)) <= 40 * EPS * found
    assert abs(arm.mass_matrix(q, precision="single")[0, 0] - 1.01e-6) <= 40 * 2.0**-23 * 1.01e-6


def test_a_slider_far_along_the_axis_of_a_pin():
    arm = pc.Multibody("far slider")
    arm.add_body("a", axis=(0, 0, 1))
    arm.add_body("b", "a", hinge="slider", axis=(0, 0, 1), position=(0.3, 0, 0), mass=2.0)
    for z in (1.0, 1e6):
        np.testing.assert_allclose(arm.mass_matrix([0.4, z]), np.diag([0.18, 2.0]), rtol=0, atol=40 * EPS * 2)


@pytest.mark.parametrize("small", [1e-8, 1e-12, 1e-16])
def test_a_rod_turned_into_the_place_of_its_small_moment(small):
    """By π/2 about y, x and z change places; the cosine of the double nearest π/2 is 6e-17."""
    arm = pc.Multibody("rod")
    arm.add_body("a", axis=(0, 1, 0))
    arm.add_body("b", "a", mass=1, com=(0.5, 0, 0), inertia=np.diag([small, 1 / 12, 1 / 12]))
    q = [0.3, math.pi / 2]
    exact = arm.mass_matrix(q, precision="quad")
    np.testing.assert_allclose(arm.mass_matrix(q), exact, rtol=0, atol=40 * EPS * np.abs(exact).max())
    turned = pc.Multibody("rod on its end")
    turned.add_body("a", axis=(0, 0, 1))
    turned.add_body("b", "a", axis=(0, 1, 0), mass=1, com=(0.5, 0, 0), inertia=np.diag([small, 1 / 12, 1 / 12]))
    exact = turned.mass_matrix(q, precision="quad")[0, 0]
    assert abs(turned.mass_matrix(q)[0, 0] - exact) <= 40 * EPS * exact


@pytest.mark.parametrize("J", [0.0, 1.0, 1e3, 1e9, 1e15])
def test_a_rotor_heavier_than_what_it_carries(J):
    arm = pc.Multibody("geared")
    arm.gravity = (0, -9.8, 0)
    arm.add_body("a", mass=1, com=(0.5, 0.1, 0), inertia=0.1 * np.eye(3))
    arm.add_body("b", "a", position=(1, 0, 0), mass=1, com=(0.2, 0.3, 0.1), inertia=0.1 * np.eye(3), rotor_inertia=J)
    given = [0.3, 0.4], [0.1, 0.2], [1.0, 0.0]
    exact = arm.forward_dynamics(*given, precision="quad")
    np.testing.assert_allclose(arm.forward_dynamics(*given), exact, rtol=400 * EPS)
    np.testing.assert_allclose(arm.forward_dynamics(*given, precision="single"), exact, rtol=400 * 2.0**-23)


def test_a_spin_moves_nothing_along_its_axis():
    top = pc.Multibody("top")
    top.add_body("t", hinge="free", mass=1, com=(0, 0, 0.1274), inertia=np.eye(3))
    for precision in ("double", "single"):
        found = top.forward_dynamics([1, 0, 0, 0, 0, 0, 0], [0, 0, 1014.62, 0, 0, 0], np.zeros(6), precision=precision)
        assert not found.any()
    drill = pc.Multibody("drill")
    drill.gravity = (0, 0, -9.8)
    drill.add_body("spindle", axis=(0, 0, 1), mass=1, inertia=np.eye(3))
    drill.add_body("bit", "spindle", hinge="slider", axis=(0, 0, 1), position=(0, 0, 0.3), mass=1.0)
    assert drill.bias_forces([0.2, 0.1], [1e6, 0.0])[1] == 9.8


def test_what_pivots_outboard_have_taken_up_is_refused():
    """Three oblique pins carry all of a far mass; what they leave a slider to feel is below what they are sure of."""
    arm = pc.Multibody("taken up")
    arm.add_body("a", hinge="slider", axis=(1, 1, 0))
    arm.add_body("b", "a", axis=(1, 1, 1), position=(0.2, 0.2, 0.1))
    arm.add_body("c", "b", axis=(-3, 1, 2), position=(0.4, -0.1, 0.1), mass=1e-5, com=(0.1, -0.1, 0.2), inertia=1e-6 * np.eye(3))
    arm.add_body("d", "c", axis=(-1, -1, 0.3), position=(0.1, 0.3, 0.4), mass=1e6, com=(2000, -0.1, 3000))
    q, none, ones = [-0.8, 1, -0.1, 0.2], np.zeros(4), np.ones(4)
    with pytest.raises(pc.SingularHingeError, match="'a'"):
        arm.forward_dynamics(q, none, ones)
    exact = arm.forward_dynamics(q, none, ones, precision="quad")
    np.testing.assert_allclose(arm.forward_dynamics(q, none, ones, form="ud"), exact, rtol=1e-3)


@pytest.mark.parametrize(("precision", "angle"), [(50, 1e60), (100, 1e110), (50, 1e300), (100, 1.7e308), (50, -12345.678), (100, 7.0)])
def test_angles_of_any_size_in_many_digits(precision, angle):
    """Gravity on a level arm is the cosine of its angle."""
    arm = pc.Multibody("pendulum")
    arm.gravity = (0, -1, 0)
    arm.add_body("a", mass=1, com=(1, 0, 0))
    with mpmath.workdps(500):
        exact = float(mpmath.cos(mpmath.mpf(angle)))
    assert arm.inverse_dynamics([angle], [0], [0], precision=precision)[0] == exact
