"""Uses of couplings: gears, mimics, racks, differentials and cables, each against its closed form, by both methods.

Drums on the base turn about z and carriages slide along x, each with an inertia of its own: in closed form what is felt at one of
them is written out. Tolerance: rounding of numbers of order ten over inertias of order one, 1e-13.
"""

import numpy as np
import pytest

import pycraft as pc

METHODS = ("augment", "embed")
TOLERANCE = 1e-13


def shop(**inertias):
    """Bodies on the base: carriages, whose names begin with x, of a mass, and drums of a moment of inertia about their axis."""
    mb = pc.Multibody("shop")
    for name, inertia in inertias.items():
        if name.startswith("x"):
            mb.add_body(name, hinge="slider", axis=(1, 0, 0), mass=inertia, hinge_name=name)
        else:
            mb.add_body(name, hinge="pin", axis=(0, 0, 1), mass=1.0, inertia=np.diag([inertia, inertia, inertia]), hinge_name=name)
    return mb


def solved(mb, q, v, tau, method):
    q, v = np.asarray(q, float), np.asarray(v, float)
    assert np.abs(mb.loops.residual(q)).max() < TOLERANCE and np.abs(mb.loops.jacobian(q) @ v).max() < TOLERANCE
    found = mb.constrained_dynamics(q, v, tau, method=method)
    return found.vdot, found.multipliers


@pytest.mark.parametrize("method", METHODS)
def test_gear(method):
    """motor = 3 wheel: the wheel feels 9 of the motor's inertia and 3 of its torque."""
    mb = shop(motor=0.2, wheel=1.5)
    mb.add_coupling({"motor": 1.0, "wheel": -3.0}, name="gear")
    vdot, force = solved(mb, [0.9, 0.3], [6.0, 2.0], [2.0, -1.0], method)
    wheel = (3 * 2.0 - 1.0) / (9 * 0.2 + 1.5)
    assert np.abs(vdot - [3 * wheel, wheel]).max() < TOLERANCE
    assert abs(force[0] - (0.2 * 3 * wheel - 2.0)) < TOLERANCE


@pytest.mark.parametrize("method", METHODS)
def test_mimic(method):
    """follower = -2 leader + 0.3, as URDF has it: multiplier and offset."""
    mb = shop(leader=0.7, follower=0.4)
    mb.add_coupling({"follower": 1.0, "leader": 2.0}, constant=-0.3, name="mimic")
    vdot, _ = solved(mb, [0.5, -0.7], [1.0, -2.0], [1.5, 0.25], method)
    leader = (1.5 - 2 * 0.25) / (0.7 + 4 * 0.4)
    assert np.abs(vdot - [leader, -2 * leader]).max() < TOLERANCE


@pytest.mark.parametrize("method", METHODS)
def test_rack_and_pinion(method):
    """x = ρ angle: m + I/ρ² along the rack, and between the teeth what is left of the force on it."""
    mass, inertia, radius, push, torque = 3.0, 0.08, 0.2, 4.0, 0.5
    mb = shop(pinion=inertia, x_rack=mass)
    mb.add_coupling({"x_rack": 1.0, "pinion": -radius}, name="teeth")
    vdot, force = solved(mb, [0.5, 0.1], [10.0, 2.0], [torque, push], method)
    along = (push + torque / radius) / (mass + inertia / radius**2)
    assert np.abs(vdot - [along / radius, along]).max() < TOLERANCE
    assert abs(force[0] - (mass * along - push)) < TOLERANCE


@pytest.mark.parametrize("method", METHODS)
def test_differential(method):
    """left + right = 2 cage: half of the cage's torque to either side, whatever turns; of both sides' mean and difference."""
    left, right, cage = 0.5, 0.9, 1.2
    mb = shop(left=left, right=right, cage=cage)
    mb.add_coupling({"left": 1.0, "right": 1.0, "cage": -2.0}, name="differential")
    torque = np.array([0.4, -0.3, 5.0])
    vdot, force = solved(mb, [1.0, 0.2, 0.6], [2.0, 4.0, 3.0], torque, method)
    # λ by what the three ask: (t_l + λ)/I_l + (t_r + λ)/I_r = 2 (t_c - 2 λ)/I_c
    by = 2 * torque[2] / cage - torque[0] / left - torque[1] / right
    teeth = by / (1 / left + 1 / right + 4 / cage)
    assert abs(force[0] - teeth) < TOLERANCE
    assert np.abs(vdot - [(0.4 + teeth) / left, (-0.3 + teeth) / right, (5.0 - 2 * teeth) / cage]).max() < TOLERANCE
    assert mb.mobility([1.0, 0.2, 0.6]).degrees_of_freedom == 2


@pytest.mark.parametrize("method", METHODS)
def test_a_cable_over_pulleys(method):
    """A carriage on either end, one in a bight of the cable, and a drum: x1 + 2 x2 + x3 + ρ angle stays; one tension in it all."""
    masses, inertia, radius = np.array([2.0, 5.0, 3.0]), 0.06, 0.15
    mb = shop(x1=masses[0], x2=masses[1], x3=masses[2], drum=inertia)
    mb.add_coupling({"x1": 1.0, "x2": 2.0, "x3": 1.0, "drum": radius}, constant=-1.7, name="cable")
    force = np.array([1.0, 9.0, -2.0, 0.1])
    q, v = np.array([0.2, 0.5, 0.35, 1.0]), np.array([1.0, -0.5, 0.3, -2.0])
    vdot, tension = solved(mb, q, v, force, method)
    slack = force[0] / masses[0] + 2 * force[1] / masses[1] + force[2] / masses[2] + radius * force[3] / inertia
    expected = -slack / (1 / masses[0] + 4 / masses[1] + 1 / masses[2] + radius**2 / inertia)
    assert abs(tension[0] - expected) < TOLERANCE * 10
    pulled = (force[:3] + expected * np.array([1, 2, 1])) / masses
    assert np.abs(vdot - [*pulled, (force[3] + radius * expected) / inertia]).max() < TOLERANCE * 10


@pytest.mark.parametrize("method", METHODS)
def test_a_crank_and_a_carriage_by_a_function(method):
    """x = r cos a + √(l² - r² sin² a), any smooth relation: I ä + m x' (x' ä + x'' ȧ²) = t + x' F."""
    r, length, mass, inertia, a, speed, torque, push = 0.3, 0.9, 2.0, 0.5, 0.8, 3.0, 1.0, -4.0
    root = np.sqrt(length**2 - (r * np.sin(a)) ** 2)
    sine, cosine = r * np.sin(a), r * np.cos(a)
    first = -sine - sine * cosine / root
    second = -cosine - (cosine**2 - sine**2) / root - (sine * cosine) ** 2 / root**3
    mb = shop(crank=inertia, x_piston=mass)

    def rod(q):
        s, c = r * np.sin(q[0]), r * np.cos(q[0])
        w = np.sqrt(length**2 - s**2)
        slope, bend = s + s * c / w, c + (c**2 - s**2) / w + (s * c) ** 2 / w**3
        return q[1] - c - w, [slope, 1.0], [[bend, 0], [0, 0]]

    mb.add_coupling(["crank", "x_piston"], function=rod, name="rod")
    vdot, _ = solved(mb, [a, cosine + root], [speed, first * speed], [torque, push], method)
    turn = (torque + first * push - mass * first * second * speed**2) / (inertia + mass * first**2)
    assert np.abs(vdot - [turn, first * turn + second * speed**2]).max() < 1e-12
