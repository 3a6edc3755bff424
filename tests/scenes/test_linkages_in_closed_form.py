"""Linkages on their loops, by either method, against what is known of them on paper: places, rates, accelerations, what loops carry.

Tolerances: rounding of lengths of some metres, 1e-13 where nothing else is said.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft.models import linkages
from support.linkages import close

E, M = pc.effects, pc.mechanisms
METHODS = ("augment", "embed")
by_each_method = pytest.mark.parametrize("method", METHODS)


@by_each_method
@pytest.mark.parametrize("N", [2, 40])
def test_four_bars_pass_the_line_ten_times(N, method):
    """IFToMM A02: within 10 s, each time through a state where the loops' rows hang together."""
    crank = M.n_four_bar(N, method).simulate(10.0, rtol=1e-8, atol=1e-8, progress=False, energy=False).q[:, 0]
    passed = np.abs(np.diff(np.floor(crank / np.pi))).sum()
    assert passed == 10 and crank[0] == np.pi / 2


# The slider-crank -----------------------------------------------------------------------------------------------------
R, L, BLOCK = 0.15, 0.2, 0.5


def slider_crank_forces(theta, rate, acceleration):
    """Newton and Euler body by body: (what drives the crank, the force of the rod on the block (x, y))."""
    bend = -np.arcsin(R / L * np.sin(theta))
    bend_rate = -R * np.cos(theta) * rate / (L * np.cos(bend))
    bend_acceleration = (R * (np.sin(theta) * rate**2 - np.cos(theta) * acceleration) + L * np.sin(bend) * bend_rate**2) / (
        L * np.cos(bend)
    )
    arm, bar = R * np.array([np.cos(theta), np.sin(theta)]), L * np.array([np.cos(bend), np.sin(bend)])

    def accelerated(vector, spin, spun):
        return spun * np.array([-vector[1], vector[0]]) - spin**2 * vector

    pin = accelerated(arm, rate, acceleration)
    middle, end = (pin + accelerated(part * bar, bend_rate, bend_acceleration) for part in (0.5, 1.0))
    along = BLOCK * end[0]
    # About the pin: the rod's own and what its middle takes, against the force -F at its end.
    turned = L * L**2 / 12 * bend_acceleration + L * (bar[0] * middle[1] - bar[1] * middle[0]) / 2
    across = (bar[1] * along - turned) / bar[0]
    on_rod = L * middle + np.array([along, across])  # by the crank
    torque = R * R**2 / 3 * acceleration + arm[0] * on_rod[1] - arm[1] * on_rod[0]
    return torque, np.array([along, across]), (bend, bend_rate, bend_acceleration, end[0])


@by_each_method
@pytest.mark.parametrize("theta", [0.0, 0.7, np.pi / 2, 2.0, np.pi, 4.5])
def test_a_slider_crank_s_accelerations_and_what_its_wrist_carries(theta, method):
    rate, torque = 20.0, 0.7
    at_rest, per_unit = (slider_crank_forces(theta, rate, a)[0] for a in (0.0, 1.0))
    expected = (torque - at_rest) / (per_unit - at_rest)
    _, force, (bend, bend_rate, bend_acceleration, slid) = slider_crank_forces(theta, rate, expected)
    model = linkages.slider_crank(R, L, BLOCK, theta)
    q = [theta, bend - theta, R * np.cos(theta) + L * np.cos(bend)]
    v = [rate, bend_rate - rate, -R * np.sin(theta) * rate - L * np.sin(bend) * bend_rate]
    close(model.q, q, 1e-15)
    close(model.assemble(q, [rate, 0, 0], fix="crank").v, v, 1e-13)
    found = model.constrained_dynamics(q, v, [torque, 0, 0], method=method)
    close(found.vdot, [expected, bend_acceleration - expected, slid], 1e-12)  # of some 1e3 rad/s² and 1e2 N
    close(found.forces["wrist"].a, [0, 0, 0, *force, 0], 1e-12)
    close(found.forces["wrist"].b[3:5], _turned(-force, -bend), 1e-12)  # in the rod's axes
    said = pc.Scene(model).add(E.TorqueSource([torque, 0, 0]), E.Loop(method=method)).evaluate(q, v)
    close(said.vdot, found.vdot, 1e-12)
    close(said.forces["loop"], model.loops.jacobian(q).T @ found.multipliers, 1e-12)


def _turned(vector, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]) @ vector


# The hexapod ----------------------------------------------------------------------------------------------------------
PAIRS = np.repeat(np.arange(3), 2) * 2 * np.pi / 3
FEET = np.column_stack([f(PAIRS + np.tile([-0.25, 0.25], 3)) for f in (np.cos, np.sin, np.zeros_like)])
HEADS = 0.6 * np.column_stack([f(PAIRS + np.tile([-np.pi / 3 + 0.25, np.pi / 3 - 0.25], 3)) for f in (np.cos, np.sin, np.zeros_like)])
LEGS = [f"upper{i}" for i in range(6)]


def turn(x, y, z):
    """By Rodrigues' formula."""
    angle = np.linalg.norm([x, y, z])
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / angle
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@pytest.mark.parametrize(
    ("turned", "place"), [((0.1, 0, 0), (0, 0, 1.0)), ((0.2, -0.1, 0.3), (0.1, 0.15, 1.1)), ((-0.1, 0.2, -0.4), (-0.2, 0, 0.9))]
)
def test_a_hexapod_s_legs_and_plate_are_where_both_kinematics_have_them(turned, place):
    """Inverse: leg i is as long as p + R b_i - a_i, its rate the plate's along it. Direct: six lengths say where the plate is."""
    model = linkages.stewart()
    angle = np.linalg.norm(turned)
    pose = [np.cos(angle / 2), *(np.sin(angle / 2) * np.array(turned) / angle), *place]
    twist = np.array([0.3, -0.5, 0.2, 0.1, 0.4, -0.3])
    q0, v0 = model.q.copy(), np.zeros(model.nv)
    q0[:7], v0[:6] = pose, twist
    state = model.assemble(q0, v0, fix="platform")
    Rot = turn(*turned)
    ways = np.array(place) + HEADS @ Rot.T - FEET
    lengths = np.linalg.norm(ways, axis=1)
    slides_q, slides_v = (np.array([getattr(model.hinges[leg], which).start for leg in LEGS]) for which in ("q_slice", "v_slice"))
    close(state.q[slides_q], lengths, 1e-14)
    heads = (twist[3:] + np.cross(twist[:3], HEADS)) @ Rot.T  # the twist is in the plate's axes
    close(state.v[slides_v], (heads * ways).sum(axis=1) / lengths, 1e-13)
    start = model.q.copy()
    start[slides_q] = lengths
    found = model.assemble(start, fix=LEGS)
    assert np.array_equal(found.q[slides_q], lengths)
    assert np.abs(model.difference(found.q, state.q)).max() < 1e-12  # rounding of lengths, by the legs' Jacobian
    assert model.mobility(state).degrees_of_freedom == 6


# The five-bar ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("angles", [(2.0, 1.1), (2.4, 0.9), (1.6, 1.4)])
def test_a_five_bar_s_tip_is_where_two_circles_meet(angles):
    model = linkages.five_bar(angles=(2.0, 1.1))
    first, second = (np.array([x, 0]) + 0.2 * np.array([np.cos(a), np.sin(a)]) for x, a in zip((-0.15, 0.15), angles, strict=True))
    between = (second - first) / 2
    height = np.sqrt(0.3**2 - between @ between) * np.array([-between[1], between[0]]) / np.linalg.norm(between)
    tips = first + between + np.array([height, -height])
    start = model.q.copy()
    start[[model.hinges[name].q_slice.start for name in ("inner0", "inner1")]] = angles
    branches = model.assembly_branches(start, fix=["inner0", "inner1"])
    found = np.array([model.frame("tip").pose(state.q)[:2, 3] for state in branches])
    assert len(branches) == 2
    close(found[np.argsort(-found[:, 1])], tips[np.argsort(-tips[:, 1])], 1e-14)
    rates = np.array([0.7, -0.4])  # of the motors: the tip moves across no rod but as its elbow does
    state = model.assemble(branches[0].q, [0.7, 0, -0.4, 0], fix=["inner0", "inner1"])
    tip = found[0]
    elbows = [np.array([-s, c]) * 0.2 * rate for s, c, rate in ((np.sin(a), np.cos(a), r) for a, r in zip(angles, rates, strict=True))]
    along = np.array([tip - first, tip - second])
    expected = np.linalg.solve(along, [along[0] @ elbows[0], along[1] @ elbows[1]])
    h = 1e-6
    moved = [model.frame("tip").pose(model.integrate(state.q, step * state.v))[:2, 3] for step in (h, -h)]
    close((moved[0] - moved[1]) / (2 * h), expected, 1e-9)  # differences of the second order, rounding over h


# Andrews' squeezer ----------------------------------------------------------------------------------------------------
@by_each_method
def test_andrews_squeezer_starts_as_the_test_set_has_it(method):
    """Its consistent initial values, 30 digits of two accelerations and two multipliers, those of point B along x and y of the world.

    F. Mazzia, C. Magherini, Test set for initial value problem solvers, 2008. What is computed adds up to 1e5 rad/s² of terms.
    """
    scene = M.andrews(method)
    model = scene.model
    q, still = model.q, np.zeros(7)
    said = scene.evaluate(q, still)
    published = [14222.4439199541138705911625887, -10666.8329399655854029433719415, 0, 0, 0, 0, 0]
    assert np.abs(said.vdot - published).max() < 1e-9
    load = said.forces["torque_source"] + said.forces["node_spring"]
    found = model.constrained_dynamics(q, still, load, method=method)
    assert np.abs(found.vdot - published).max() < 1e-9
    gamma = q[2]  # of K3, in whose axes the force on it is
    close(_turned(found.forces["BE"].b[3:5], gamma), [98.5668703962410896057654982170, -6.12268834425566265503114393122], 1e-12)
    for other in ("K4E", "K6E"):
        assert np.abs(found.forces[other].b).max() < 1e-11


# Peaucellier ----------------------------------------------------------------------------------------------------------
def test_a_peaucellier_is_straight_over_its_whole_range():
    """The crank turns from one end to the other, 0.7 cos(a/2) > 0.6, where the rhombus folds; the nearest states are 1e-3 rad off."""
    model = linkages.peaucellier()
    end = 2 * np.arccos(0.6 / 0.7) - 1e-3
    line, q, heights = (1.0 - 0.4**2) / (2 * 0.35), model.q, []
    for angle in np.concatenate([np.linspace(0.3, -end, 40), np.linspace(-end, end, 80)]):
        start = q.copy()
        start[0] = angle
        q = model.assemble(start, fix="crank").q
        x, y, z = model.frame("pen").pose(q)[:3, 3]
        # Newton leaves rounding in the rows; near the fold far corners move as 1/√(way to it) of it.
        assert abs(x - line) < 1e-14 / np.sqrt(end + 1e-3 - abs(angle)) and z == 0
        assert abs(y - line * np.tan(angle / 2)) < 1e-13
        heights.append(y)
    assert np.ptp(heights) > 1.44  # 2 line tan(a/2)


@by_each_method
def test_a_peaucellier_moves_straight(method):
    run = M.peaucellier(method=method).simulate(0.7, rtol=1e-9, progress=False)
    pen = run.frame("pen").position
    assert np.abs(pen[:, 0] - (1.0 - 0.4**2) / (2 * 0.35)).max() < 1e-13 and np.ptp(pen[:, 1]) > 0.4


# All of them ----------------------------------------------------------------------------------------------------------
MOTIONS = {
    "n_four_bar": (lambda method: M.n_four_bar(3, method), 0.8),
    "andrews": (M.andrews, 0.01),
    "bricard": (M.bricard, 1.0),
    "slider_crank": (lambda method: M.slider_crank(method=method), 1.0),
    "peaucellier": (lambda method: M.peaucellier(method=method), 0.5),
    "five_bar": (M.five_bar, 0.3),
    "stewart": (M.stewart, 0.3),
    "delta": (M.delta, 0.3),
    "flyball_governor": (lambda method: M.flyball_governor(rigid=True, method=method), 1.0),
    "bicycle": (lambda method: M.bicycle(lean_rate=0.3, method=method), 1.0),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_both_methods_lead_to_one_motion(name):
    """States, accelerations at them and what the loops put on coordinates; multipliers where none depends on others."""
    make, T = MOTIONS[name]
    scenes = [make(method) for method in METHODS]
    runs = [scene.simulate(T, integrator="dop853", rtol=1e-11, atol=1e-12, progress=False) for scene in scenes]
    model, state = scenes[0].model, runs[0]
    way = np.abs(model.difference(runs[0].q[-1], runs[1].q[-1])).max()
    assert way < 1e-8 * max(1.0, np.abs(runs[0].q[-1]).max())  # a thousand tolerances of steps
    assert np.abs(model.difference(runs[0].q[0], runs[0].q[-1])).max() > 0.05
    q, v = state.q[-1], state.v[-1]
    said = [scene.evaluate(q, v, t=T) for scene in scenes]
    close(said[1].vdot, said[0].vdot, 1e-10)
    close(said[1].forces["loop"], said[0].forces["loop"], 1e-10)
