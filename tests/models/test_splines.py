"""Couplings through points: against cubics that splines are, differences, and motions that close.

A natural spline is a cubic in each piece: what it makes of one of zero curvature at both ends is that cubic, to rounding.
"""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc

EPS = float(np.finfo(float).eps)


def test_a_straight_line_is_one_everywhere():
    line = pc.Spline([0.0, 1.0, 3.0], [1.0, 3.0, 7.0])
    for x in (-2.0, 0.0, 0.4, 3.0, 9.0):
        r, gradient, second = line(np.array([x, 0.5]))
        assert (
            abs(r - (0.5 - (1 + 2 * x))) < 20 * EPS
            and np.abs(np.array(gradient) - [-2, 1]).max() < 20 * EPS
            and np.abs(second).max() < 50 * EPS
        )


def test_one_cubic():
    """Through (-1, 1), (0, 0), (1, 1): s = ³⁄₂x² - ½|x|³, with the curvature 3 - 3|x|, which vanishes at both ends."""
    x = np.array([-1.0, 0.0, 1.0])
    cubic = pc.Spline(x, [1.0, 0.0, 1.0], ends="natural")
    for at in np.linspace(-1, 1, 9):
        r, gradient, second = cubic(np.array([at, 0.0]))
        a = abs(at)
        expected = (-0.5 * a**3 + 1.5 * a**2, np.sign(at) * (-1.5 * a**2 + 3 * a), 3 - 3 * a)
        assert np.abs(np.array([-r, -gradient[0], -second[0][0]]) - expected).max() < 20 * EPS


@pytest.mark.parametrize("periodic", [False, True])
def test_two_derivatives_are_continuous(periodic):
    """At knots, at ends, and a period on."""
    rng = np.random.default_rng(0)
    x, y = np.cumsum(rng.uniform(0.3, 1, 8)), rng.normal(size=8)
    if periodic:
        y[-1] = y[0]
    spline = pc.Spline(x, y, periodic=True) if periodic else pc.Spline(x, y, ends="natural")
    for at in [*x, x[0] - 2.0, *(x + x[-1] - x[0])]:
        below, above = (spline(np.array([at + side * 1e-9, 0.0])) for side in (-1, 1))
        for a, b in zip(below, above, strict=True):
            assert np.abs(np.array(a) - b).max() < 1e-6  # third derivatives of a thousand times 2e-9


def test_ends():
    """By default those of a cubic are the cubic's own; "natural" has no curvature there, "clamped" no slope."""
    x = np.array([-1.0, -0.2, 0.3, 1.1, 2.0])
    cubic = np.polynomial.Polynomial([0.3, -0.7, 0.5, 0.2])
    spline = pc.Spline(x, cubic(x))
    for at in np.linspace(-1, 2, 31):
        r, gradient, second = spline(np.array([at, 0.0]))
        found = np.array([-r, -gradient[0], -second[0][0]])
        assert np.abs(found - [cubic.deriv(k)(at) for k in range(3)]).max() < 2000 * EPS  # slopes by differences over 0.5, twice
    for at in (-1.0, 2.0):
        assert abs(pc.Spline(x, cubic(x), ends="natural")(np.array([at, 0]))[2][0][0]) < 100 * EPS
        assert abs(pc.Spline(x, cubic(x), ends="clamped")(np.array([at, 0]))[1][0]) < 100 * EPS
    for beyond in (-3.0, 4.0):
        assert spline(np.array([beyond, 0.0]))[2][0][0] == 0.0


@pytest.mark.parametrize(("ends", "order"), [("not-a-knot", 4), ("natural", 2), ("clamped", 1)])
def test_orders_at_ends(ends, order):
    """Near the end of a function that has a slope and a curvature there, here and over time."""
    errors = []
    for n in (20, 40, 80):
        x = 0.4 + np.linspace(0, 1, n + 1)
        s, t = pc.Spline(x, np.sin(x), ends=ends), pc.effects.Spline(x, np.sin(x), ends=ends)
        at = 0.4 + 0.5 / n
        assert abs(-s(np.array([at, 0.0]))[0] - t(at)[0]) < 4 * EPS
        errors.append(abs(t(at)[0] - np.sin(at)))
    assert np.abs(np.log2(np.divide(errors[:-1], errors[1:])) - order).max() < 0.15


def test_rows_bias_and_operators():
    cam = pc.chain(3)
    angles = np.linspace(0, 2 * np.pi, 9)
    cam.add_coupling(["hinge0", "hinge2"], function=pc.Spline(angles, 0.3 * np.sin(angles) ** 2, periodic=True), name="rise")
    q, v, h = np.array([7.3, 0.2, 0.4]), np.array([1.5, 0.3, -0.7]), 1e-6
    expected = [(cam.loops.residual(q + h * e) - cam.loops.residual(q - h * e))[0] / (2 * h) for e in np.eye(3)]
    assert np.abs(cam.loops.jacobian(q)[0] - expected).max() < 1e-9
    rate = (cam.loops.jacobian(q + h * v) - cam.loops.jacobian(q - h * v)) / (2 * h)
    assert abs((rate @ v - cam.loops.bias(q, v))[0]) < 1e-8
    assert np.abs(cam.soa.Q.dot().at(q, v).dense() - rate).max() < 1e-8
    state = cam.assemble([0.7, 0.1, 0.0], [2.0, 0, 0], fix=["hinge0", "hinge1"])
    again = pickle.loads(pickle.dumps(cam))
    assert np.abs(again.loops.residual(state)).max() < 20 * EPS and np.abs(again.loops.jacobian(state) @ state.v).max() < 100 * EPS


@pytest.mark.parametrize(
    ("points", "options", "said"),
    [
        (([0.0], [1.0]), {}, r"at least 2, not \(1,\) and \(1,\)"),
        (([0.0, 1.0], [1.0, 1.0]), dict(periodic=True), "at least 3"),
        (([0.0, 1.0], [1.0]), {}, "of one length"),
        (([[0.0, 1.0]], [[1.0, 1.0]]), {}, "of one length"),
        (([0.0, np.nan], [1.0, 2.0]), {}, "not finite"),
        (([0.0, 1.0], [1.0, np.inf]), {}, "not finite"),
        (([0.0, 2.0, 2.0], [1.0, 2.0, 3.0]), {}, "ascends, and 2 comes after 2"),
        (([0.0, 1.0, 2.0], [1.0, 2.0, 3.0]), dict(periodic=True), "ends as it begins, and 3 is not 1"),
        (("ab", [1.0, 2.0]), {}, "driver of a spline"),
        (([0.0, 1.0], [1.0, 1.0]), dict(ends="loose"), "ends are 'not-a-knot', 'natural' or 'clamped', not 'loose'"),
        (([0.0, 1.0, 2.0], [1.0, 2.0, 1.0]), dict(periodic=True, ends="natural"), "a periodic spline has no ends"),
        (([0.0, 1e-300, 1.0], [0.0, 1e300, 0.0]), {}, "too large for numbers"),
    ],
)
def test_refused(points, options, said):
    with pytest.raises(pc.ModelError, match=said):
        pc.Spline(*points, **options)


def test_of_two_coordinates():
    model = pc.chain(3)
    model.add_coupling(["hinge0"], function=pc.Spline([0, 1], [0, 1]), name="cam")
    with pytest.raises(pc.ModelError, match=r"two coordinates, \[driver, follower\], not 1"):
        model.loops.jacobian()


@pytest.mark.parametrize("options", [{}, {"ends": "natural"}, {"ends": "clamped"}])
def test_copies_keep_their_ends(options):
    spline = pc.Spline([0.0, 1.0, 2.0, 4.0], [0.0, 1.0, -1.0, 2.0], **options)
    at = np.array([0.3, 0.0])
    for again in [
        copy.deepcopy(spline),
        *(pickle.loads(pickle.dumps(spline, protocol)) for protocol in range(pickle.HIGHEST_PROTOCOL + 1)),
    ]:
        assert again(at) == spline(at)
