"""Points on curves: rows against an oracle in 60 digits, motions against closed forms, splines against what they are of.

Rows: the tolerance of other loops' rows (tests/models/test_loops.py). Motions: rounding times the condition of small problems, 1e-11; of
curves that are functions the second derivatives of what fits them, 1e-10 (pycraft/models/curves.py), times squares of speeds.
"""

import copy
import pickle

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import pycraft as pc
from pycraft.models.curves import Curve, with_normals
from support.loop_oracle import LoopOracle, check_against
from support.mechanisms import every_kind

G = 9.81
RADIUS, RISE = 0.8, 0.3
"""Of the helix."""
METHODS = ("augment", "embed")


def helix(s):
    return (RADIUS * np.cos(s), RADIUS * np.sin(s), RISE * s)


def ring(n, radius=1.0):
    angles = np.linspace(0, 2 * np.pi, n + 1)
    points = radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    points[-1] = points[0]
    return points


def bead(mass=2.0, at=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0)):
    """A point of mass that moves along x, y and z."""
    mb = pc.Multibody("bead")
    mb.add_body("bead", hinge="custom", subhinges=[{"kind": "slider", "axis": axis} for axis in np.eye(3)], mass=mass)
    mb.gravity, mb.q, mb.v = (0, 0, -G), at, velocity
    return mb


def knot(s):
    """A trefoil."""
    return (np.sin(s) + 2 * np.sin(2 * s), np.cos(s) - 2 * np.cos(2 * s), -np.sin(3 * s))


WAVE = np.array([[0, 0, 0], [1, 0.2, 0.4], [1.5, 1, -0.3], [1, 2, 0]])
CURVES = {
    "function": {"curve": helix, "parameters": (-1.0, 4.0)},
    "closed function": {"curve": knot, "parameters": (0, 2 * np.pi), "closed": True},
    "open spline": {"curve": WAVE},
    "natural spline": {"curve": WAVE, "ends": "natural"},
    "closed spline": {"curve": [*WAVE, WAVE[0]], "closed": True},
    "parameters": {"curve": WAVE, "parameters": [-3.0, 0.0, 2.0, 9.0]},
    "polynomials": {"curve": CubicSpline([0, 1, 3, 4], WAVE)},
    "line": {"curve": WAVE[:2]},
}


def declared(model):
    of = model.loops._declared["wire"]
    return Curve(of["parameters"], of["coefficients"], of["closed"])


# ---------------------------------------------------------------------- rows
@pytest.mark.parametrize(
    ("kind", "on"), [("function", "body3"), ("closed function", None), ("open spline", None), ("closed spline", "body3")]
)
def test_rows(kind, on):
    """Off the curve, between frames that move both; residual, Q and Q̇θ̇ are of one function."""
    model, alone = every_kind(seed=7), bead()
    alone.add_curve("bead", **CURVES[kind], name="wire")
    middle = declared(alone).coefficients[len(declared(alone).coefficients) // 2][0]
    away = model.frame("body9").pose(wrt=on or "base")[:3, 3]
    model.add_node("stand", on, position=away - middle + [0.1, -0.15, 0.1])
    loop = model.add_curve("body9", "stand", **CURVES[kind], name="wire")
    check_against(LoopOracle(model, "body9", "stand", "curve", {"pieces": with_normals(declared(model), "wire")}), loop)
    assert loop.rows == ["wire: across 1", "wire: across 2"] and loop.kind == "curve" and model.loops.of_positions.all()
    assert 0.01 < np.linalg.norm(loop.residual()) < 0.3


@pytest.mark.parametrize("kind", CURVES)
def test_distance_is_the_least(kind):
    """|r| is the least distance from 20 000 places of the curve, to half the square of half a step of theirs by the distance."""
    model, rng = bead(), np.random.default_rng(1)
    wire = model.add_curve("bead", **CURVES[kind], name="wire")
    pieces = declared(model).coefficients
    powers = np.vander(np.linspace(-1, 1, 20_000 // len(pieces)), pieces.shape[1], increasing=True)
    places = np.concatenate([powers @ piece for piece in pieces])
    step = np.linalg.norm(np.diff(places, axis=0), axis=1).max()
    for p in places[rng.integers(len(places), size=40)] + 0.3 * rng.normal(size=(40, 3)):
        least = np.linalg.norm(places - p, axis=1)
        if declared(model).closed or 0 < np.argmin(least) < len(places) - 1:
            assert -(step**2) / least.min() <= np.linalg.norm(wire.residual(p)) - least.min() <= 1e-14, p


def test_an_open_curve_goes_on_straight():
    model = bead()
    wire = model.add_curve("bead", curve=lambda s: (s, s**2, 0), parameters=(0, 1), name="wire")
    along = np.array([1, 2, 0]) / np.sqrt(5)
    for far in (1e-9, 0.5, 100.0):
        off = np.abs(wire.residual([1, 1, 0] + far * along)).max()
        assert off < 144 * 2.3e-16 / 0.28 * max(
            1, far
        )  # rounding of the slope by u at the end of what fits, of degree 12, beside the slope
        assert np.abs(wire.jacobian([1, 1, 0] + far * along) @ along).max() < 1e-12
    assert np.abs(wire.residual([-2.0, 0, 0.5])) @ [1, 1] == pytest.approx(0.5, abs=1e-14)
    assert not wire.bias([-2.0, 0, 0], [1.0, 0, 0]).any()


def test_normals_of_a_plane_curve_are_the_plane_s():
    model = bead()
    wire = model.add_curve("bead", curve=ring(8), closed=True, name="wire")
    at = np.array([[0.9, 0.3, 0.2], [-0.5, 0.7, 0.2]])
    assert np.abs(wire.residual(at)[:, 1] - 0.2).max() < 1e-15
    assert np.abs(wire.jacobian(at)[:, 1] - [0, 0, 1]).max() < 1e-15


def test_a_spline_nears_its_circle():
    """As the fourth power of its points' distance, 16 for two: and a function to rounding."""
    far = np.linspace(0, 2 * np.pi, 101)
    circle = np.stack([np.cos(far), np.sin(far), 0 * far], axis=1)
    off = []
    for n in (16, 32, 64):
        model = bead()
        off.append(np.abs(model.add_curve("bead", curve=ring(n), closed=True).residual(circle)).max())
    assert 14 < off[0] / off[1] < 18 and 14 < off[1] / off[2] < 18
    exact = bead().add_curve("bead", curve=lambda s: (np.cos(s), np.sin(s), 0), parameters=(0, 2 * np.pi), closed=True)
    assert np.abs(exact.residual(circle)).max() < 1e-14


def test_an_open_spline_nears_its_arc_up_to_its_ends():
    """As the fourth power of its points' distance, 16 for two, also beside the ends; natural ones as the second, 4."""
    far = np.linspace(0, 1.5, 101)
    arc = np.stack([np.cos(far), np.sin(far), 0 * far], axis=1)
    for ends, ratio in (({}, 16), ({"ends": "not-a-knot"}, 16), ({"ends": "natural"}, 4)):
        off = []
        for n in (9, 17, 33):
            at = np.linspace(0, 1.5, n)
            points = np.stack([np.cos(at), np.sin(at), 0 * at], axis=1)
            off.append(np.abs(bead().add_curve("bead", curve=points, **ends).residual(arc)).max())
        assert 0.85 * ratio < off[0] / off[1] < 1.25 * ratio and 0.85 * ratio < off[1] / off[2] < 1.25 * ratio, (ends, off)


def test_ends_that_a_curve_has_not_are_refused():
    with pytest.raises(
        pc.ModelError, match=r"loop 'wire': the ends of a curve through points are 'not-a-knot' or 'natural', not 'clamped'"
    ):
        bead().add_curve("bead", curve=WAVE, ends="clamped", name="wire")
    with pytest.raises(pc.ModelError, match=r"a closed curve has no ends; leave out ends='natural'"):
        bead().add_curve("bead", curve=ring(8), closed=True, ends="natural")
    with pytest.raises(pc.ModelError, match=r"a function and a piecewise polynomial have ends of their own; leave out ends='natural'"):
        bead().add_curve("bead", curve=helix, parameters=(0, 1), ends="natural")


def test_at_a_centre_of_curvature_rows_are_numbers():
    """All places of a ring are as near to its middle: one of them is taken, and is taken to stay."""
    model = bead()
    wire = model.add_curve("bead", curve=lambda s: (np.cos(s), np.sin(s), 0), parameters=(0, 2 * np.pi), closed=True)
    Q = wire.jacobian([0, 0, 0.0])
    assert np.linalg.norm(wire.residual([0, 0, 0.0])) == pytest.approx(1) and np.abs(Q @ Q.T - np.eye(2)).max() < 1e-12
    assert np.isfinite(wire.bias([0, 0, 0.0], [1.0, 2, 3])).all()
    assert np.linalg.norm(model.assemble([0.0, 0.0, 0.0]).q) == pytest.approx(1)


# ---------------------------------------------------------------------- motions
@pytest.mark.parametrize("method", METHODS)
def test_a_bead_on_a_helix(method):
    """(R² + h²) s̈ = -g h; the wire holds what is left of m (p̈ - g)."""
    s, speed, mass = 1.3, 2.1, 2.0
    first = np.array([-RADIUS * np.sin(s), RADIUS * np.cos(s), RISE])
    second = -np.array([RADIUS * np.cos(s), RADIUS * np.sin(s), 0])
    model = bead(mass, helix(s), speed * first)
    model.add_curve("bead", curve=helix, parameters=(-1, 4), name="wire")
    found = model.constrained_dynamics(method=method)
    expected = first * -G * RISE / (RADIUS**2 + RISE**2) + second * speed**2
    assert np.abs(found.vdot - expected).max() < 1e-9
    assert np.linalg.norm(found.multipliers) == pytest.approx(mass * np.linalg.norm(expected + [0, 0, G]), rel=1e-9)
    assert np.abs(found.forces["wire"].b[3:] - mass * (expected + [0, 0, G])).max() < 1e-8


@pytest.mark.parametrize("precision", ["single", "double", "quad"])
@pytest.mark.parametrize("method", METHODS)
def test_a_bead_on_a_parabola(method, precision):
    """z = x²/2, which a polynomial is exactly: (1 + x²) ẍ + x ẋ² + g x = 0. A batch, in three precisions."""
    x, speed = np.array([-0.7, 0.2, 1.1]), np.array([0.5, -2.0, 1.0])
    model, zero = bead(), 0 * x
    model.add_curve("bead", curve=lambda s: (s, 0, s**2 / 2), parameters=(-2, 2))
    q, v = np.stack([x, zero, x**2 / 2], axis=1), np.stack([speed, zero, x * speed], axis=1)
    found = model.constrained_dynamics(q, v, method=method, precision=precision).vdot.astype(float)
    along = -(x * speed**2 + G * x) / (1 + x**2)
    expected = np.stack([along, zero, x * along + speed**2], axis=1)
    assert np.abs(found - expected).max() < (1e-4 if precision == "single" else 1e-11)


@pytest.mark.parametrize("method", METHODS)
def test_a_ring_is_a_sphere_and_a_plane(method):
    """The tip of a spatial arm on a circle, and on two surfaces through it: the same accelerations and the same force."""
    found = []
    for kind in ("curve", "surfaces"):
        model = pc.tree([-1, 0, 1], ["ball", "universal", "pin"], seed=3)
        model.add_node("tip", "body2", position=(0.3, 0.1, 0.2))
        model.gravity, model.q = (0, 0, -G), model.random_state(2).q
        centre = model.frame("tip").pose()[:3, 3] - [1.0, 0, 0]
        if kind == "curve":
            model.add_node("centre", position=centre)
            wire = model.add_curve("tip", "centre", curve=lambda s: (np.cos(s), np.sin(s), 0), parameters=(0, 2 * np.pi), closed=True)
            assert np.abs(wire.residual()).max() < 1e-14
        else:
            model.add_surface("tip", A=np.eye(3), b=-2 * centre, c=centre @ centre - 1, name="sphere")
            model.add_surface("tip", b=(0, 0, 1), c=-centre[2], name="plane")
        v = model.assemble(model.q, np.random.default_rng(3).normal(size=model.nv), starts=1).v
        dynamics = model.constrained_dynamics(model.q, v, method=method)
        found.append((dynamics.vdot, sum(np.asarray(force.b) for force in dynamics.forces.values())))
    for one, other in zip(*found, strict=True):
        assert np.abs(one - other).max() < 1e-9 * (1 + np.abs(other).max())


@pytest.mark.parametrize("method", METHODS)
def test_energy_stays_along_a_knot(method):
    model = bead()
    wire = model.add_curve("bead", curve=knot, parameters=(0, 2 * np.pi), closed=True, name="wire")
    scene = pc.Scene(model).add(pc.effects.Gravity((0, 0, -G)), pc.effects.Loop(method=method))
    s = 0.4
    start = np.array([np.cos(s) + 4 * np.cos(2 * s), -np.sin(s) + 4 * np.sin(2 * s), -3 * np.cos(3 * s)])
    run = scene.simulate(2.0, knot(s), 1.5 * start, rtol=1e-10, atol=1e-10, progress=False)
    energy = 0.5 * 2.0 * (run.v**2).sum(axis=1) + 2.0 * G * run.q[:, 2]
    assert np.abs(energy - energy[0]).max() < 1e-7 * abs(energy[0])
    assert np.abs(wire.residual(run.q)).max() < 1e-11
    assert np.abs(run.q - run.q[0]).max() > 1


def test_a_linear_model():
    """A linear model at the bottom of a circle is the pendulum's, ω² = g/R."""
    model = bead()
    model.add_curve("bead", curve=lambda s: (0, 0.5 * np.sin(s), -0.5 * np.cos(s)), parameters=(-2, 2))
    bottom = model.linearize([0, 0, -0.5], [0, 0, 0], loops=True)
    assert np.abs(np.sort(np.linalg.eigvals(bottom.A).imag) - np.sqrt(G / 0.5) * np.array([-1, 1])).max() < 1e-9


def test_copies_and_what_is_compiled():
    model = bead(at=helix(1.0))
    model.add_curve("bead", curve=helix, parameters=(-1, 4), name="wire")
    for again in (copy.deepcopy(model), pickle.loads(pickle.dumps(model)), pc.Multibody.from_description(model.description())):
        assert again.loops.jacobian(model.q).tobytes() == model.loops.jacobian(model.q).tobytes()
    with pytest.raises(pc.ModelError, match="loop 'wire' cannot be compiled: the nearest place of its curve is sought"):
        model.compile("constrained_dynamics")
    assert model.loops.residual(np.zeros((0, 3))).shape == (0, 2)
