"""Errors of a scene for unknown names and for invalid values and calls: each with its text."""

import numpy as np
import pytest

import pycraft as pc

E = pc.effects


@pytest.fixture
def arm():
    made = pc.Multibody("arm")
    rod = dict(mass=1.0, com=(0.5, 0, 0), inertia=np.diag([0.01, 0.1, 0.1]))
    made.add_body("upper", hinge_name="left_shoulder", axis=(0, 1, 0), limits=(-1, 1), **rod)
    made.add_body("lower", "upper", "universal", hinge_name="left_elbow", position=(1, 0, 0), **rod)
    made.add_body("hand", "lower", "ball", hinge_name="wrist", position=(1, 0, 0), **rod)
    made.add_node("tip", "hand", position=(1, 0, 0))
    made.add_node("mark", None, position=(0, 0, 1))
    return made


UNKNOWN = [
    (
        E.Damping(0.1, hinges="left_shoudler"),
        "damping: no hinge or coordinate of 'arm' is called 'left_shoudler'; did you mean 'left_shoulder'",
    ),
    (E.Spring(1.0, hinges=["wirst"]), "spring: no hinge .* 'wirst'; did you mean 'wrist'"),
    (E.Damping(0.1, hinges="right_*"), r"damping: no hinge or coordinate of 'arm' fits 'right_\*'; did you mean"),
    (E.Damping(0.1, hinges="upper"), "damping: no hinge of 'arm' is called 'upper'; body 'upper' is moved by hinge 'left_shoulder'"),
    (E.Prescribed("left_elbow[2]", 0.0), r"prescribed: no hinge .* 'left_elbow\[2\]'; did you mean 'left_elbow\[0\]'"),
    (E.Wrench("tipp", np.zeros(6)), "wrench: no node or body of 'arm' is called 'tipp'; did you mean 'tip'"),
    (E.Wrench("tip", np.zeros(6), axes="wold"), "wrench: no node or body .* 'wold'"),
    (E.NodeSpring("mark", "hnad", 1.0), "node_spring: no node or body .* 'hnad'; did you mean 'hand'"),
    (E.PointMassGravity(1.0, bodies="lowr"), "point_mass_gravity: no body of 'arm' is called 'lowr'; did you mean 'lower'"),
    (E.GravityCompensation(1.0, "lowr"), "gravity_compensation: no body of 'arm' is called 'lowr'; did you mean 'lower'"),
    (E.FluidDrag(1.0, bodies="lowr", sizes=[[1, 1, 1]], placements=[np.eye(4)]), "fluid_drag: no node or body .* 'lowr'"),
    (E.Motor(1.0, 1.0, 1.0, hinges="wrist2"), "motor: no hinge .* 'wrist2'; did you mean 'wrist'"),
]


@pytest.mark.parametrize(("effect", "text"), UNKNOWN, ids=lambda x: x if isinstance(x, str) else x.kind())
def test_names_that_are_not_there(arm, effect, text):
    scene = pc.Scene(arm).add(E.Gravity())
    with pytest.raises(pc.ModelError, match=text):
        scene.add(E.Damping(0.1), effect)
    assert list(scene.effects) == ["gravity"]  # as it was


WRONG = [
    (lambda: E.Damping([0.1, 0.2]), "damping: coefficient takes one number, or one for each of its 6 coordinates, not 2"),
    (lambda: E.Damping(np.zeros((2, 3))), r"damping: coefficient takes a number or a list of numbers, not an array \(2, 3\)"),
    (lambda: E.Damping(np.nan), "damping: coefficient has an entry that is nan"),
    (lambda: E.Damping("0.1"), "damping: coefficient is not an array of numbers"),
    (
        lambda: E.Damping({"wrist": 1.0}, hinges="wrist"),
        "damping: coefficient is a dictionary by hinge and names the hinges; leave out hinges=",
    ),
    (lambda: E.Damping(0.1, hinges=3), "damping: hinges must be a list, not 3"),
    (lambda: E.Damping(0.1, hinges=[3]), "damping: one of its hinges is named by a string, not by 3"),
    (lambda: E.Gravity((0, 0)), "gravity: g takes 3 numbers"),
    (lambda: E.Gravity((0, 0, np.inf)), "gravity: g has an entry that is inf"),
    (lambda: E.CoulombFriction(-1.0), "coulomb_friction: level is -1; it is not negative"),
    (lambda: E.CoulombFriction(1.0, smoothing=0.0), "coulomb_friction: smoothing is 0; it is a positive speed"),
    (lambda: E.ImplicitDamping(-1.0), "implicit_damping: coefficient is -1; it is not negative"),
    (lambda: E.RotorInertia(-1.0), "rotor_inertia: inertia is -1"),
    (lambda: E.Spring([1, 2, 3], hinges="wrist"), r"spring: coordinate 'wrist\[0\]' is one of a ball, whose spring has one stiffness"),
    (lambda: E.Spring(1.0, hinges="wrist[1]"), r"spring: coordinate 'wrist\[1\]' is one of three of a ball, which a spring takes together"),
    (lambda: E.Spring(1.0, rest=[1, 2], hinges="wrist"), "spring: rest takes one number, or one for each of its 4"),
    (lambda: E.Spring(1.0, rest=[0, 0, 0, 0], hinges="wrist"), "spring: rest has a quaternion of no length"),
    (lambda: E.ImplicitSpring(1.0, hinges="wrist"), r"implicit_spring: coordinate 'wrist\[0\]' is one of a ball subhinge; it acts on pins"),
    (lambda: E.Limits(1.0, lower=1.0, upper=-1.0), "limits: of coordinate 'left_shoulder' the lower one, 1, lies above the upper one, -1"),
    (lambda: E.Limits(1.0, hinges="left_elbow"), r"limits: coordinate 'left_elbow\[0\]' of 'arm' has none; give lower= and upper="),
    (lambda: E.Limits(-1.0), "limits: stiffness is -1"),
    (lambda: E.TorqueSource([1, 2]), "torque_source: torque has 2 numbers; one for all, or one for each of its 6 coordinates"),
    (lambda: E.TorqueSource(1.0, effort_limit=-2), "torque_source: effort_limit is -2; a limit is positive, inf for none"),
    (lambda: E.TorqueSource(1.0, speed_limit=1, speed_band=2), "torque_source: speed_band is 2; it is a share"),
    (lambda: E.TorqueSource(lambda t: "x"), "torque_source: torque is not an array of numbers"),
    (lambda: E.TorqueSource(E.Table([0, 1, 1], [1, 2, 3])), "a table takes at least two times, in rising order"),
    (lambda: E.TorqueSource(E.Table([0, 1], [1, 2, 3])), r"a table takes times \(K,\) and values"),
    (
        lambda: E.TorqueSource(E.Spline([0, 1], [1, 2], ends="loose")),
        "a spline's ends are 'not-a-knot', 'natural' or 'clamped', not 'loose'",
    ),
    (lambda: E.Servo(1.0, [1, 2]), "servo: damping takes one number, or one for each of its 3"),
    (lambda: E.Motor(1.0, 0.0, 1.0), "motor: stall_torque is 0; it is positive"),
    (lambda: E.Motor(1.0, 1.0, 1.0, gear_ratio=0), "motor: gear_ratio is 0"),
    (lambda: E.Prescribed("wrist", 0.0), r"prescribed: the motion gives 1 numbers; the coordinates from 'wrist\[0\]' on take 4"),
    (
        lambda: E.Prescribed("wrist[0]", 0.0),
        r"prescribed: coordinate 'wrist\[0\]' is one of 3 of a ball subhinge, which are prescribed together",
    ),
    (lambda: E.Prescribed("left_elbow", lambda t: 0.0), "prescribed: motion gives 1 number where 2 are expected"),
    (lambda: E.Wrench("tip", (1, 2, 3)), "wrench: on 'tip' it has 3 numbers; a wrench has six, the moment first"),
    (lambda: E.Wrench("mark", np.zeros(6)), "wrench: node 'mark' is on the base, which no wrench moves"),
    (lambda: E.NodeSpring("tip", "hand", 1.0), "node_spring: 'tip' and 'hand' are on one body, where it does nothing"),
    (lambda: E.NodeSpring(None, "mark", 1.0), "node_spring: 'the base' and 'mark' are on one body"),
    (lambda: E.NodeSpring("tip", "upper", 1.0, -1.0), "node_spring: length is -1"),
    (lambda: E.Bushing("tip", "upper", np.ones(5)), r"bushing: stiffness takes six numbers or a \(6, 6\) matrix, not an array \(5,\)"),
    (lambda: E.Bushing("tip", "upper", np.triu(np.ones((6, 6)))), r"bushing: stiffness is not symmetric at entries \(1, 0\) and \(0, 1\)"),
    (lambda: E.Bushing("tip", "upper", 1.0, rest=2 * np.eye(4)), "bushing"),
    (lambda: E.Sampled(len, 0.0), "sampled: period is 0; it is a positive number of seconds"),
    (lambda: E.Sampled(3, 0.1), "sampled: the controller must be a function"),
    (lambda: 3, r"add\(\) takes an effect, .*; got 3"),
]


@pytest.mark.parametrize(("make", "text"), WRONG, ids=lambda x: x if isinstance(x, str) else None)
def test_what_makes_no_sense(arm, make, text):
    scene = pc.Scene(arm)
    with pytest.raises(pc.ModelError, match=text):
        scene.add(make()).evaluate(arm.zero_q(), np.zeros(arm.nv))


@pytest.mark.parametrize(
    "effect",
    [
        E.Damping(-0.1),
        E.QuadraticDamping([1, 1, 1, -2, 1, 1]),
        E.Spring(-3.0, hinges="left_*"),
        E.NodeDamper("tip", None, -1.0),
        E.NodeSpring("tip", None, -1.0),
    ],
    ids=lambda e: e.kind(),
)
def test_what_drives_instead_of_braking_is_warned_of(arm, effect):
    with pytest.warns(pc.ModelWarning, match=rf"{effect.kind()}: (coefficient|stiffness) is negative, -.*: it drives"):
        pc.Scene(arm).add(effect)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (dict(integrator="euler"), "no integrator is called 'euler'; there are 'dopri5', .*'semi-implicit-euler'"),
        (dict(integrator="rk4"), "integrator 'rk4' takes steps of one size: give step="),
        (dict(step=-1.0), "step=-1.0: a step is a positive number"),
        (dict(rtol=0, atol=1e-20), "are below what the precision holds"),
        (dict(t_eval=[0.5, 0.2]), r"t_eval: entry 1 is 0.2 s after 0.5 s; times must rise"),
        (dict(t_eval=[0.5, 2.0]), "t_eval goes from 0.5 to 2 s; the run lasts from 0 to T = 1 s"),
        (dict(t_eval=[]), r"t_eval must be at least one time"),
        (dict(normalise="often"), "normalise='often': there are 'never' and 'each step'"),
    ],
)
def test_runs_that_make_no_sense(arm, options, text):
    with pytest.raises(pc.EvaluationError, match=text):
        pc.Scene(arm).simulate(1.0, **options)


def test_a_run_lasts_a_positive_time(arm):
    for T in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(pc.EvaluationError, match="a run lasts a positive number of seconds"):
            pc.Scene(arm).simulate(T)


def test_precisions_that_are_not_there(arm):
    for precision in ("single", 50):
        with pytest.raises(pc.EvaluationError, match="trajectories and scenes are computed in precision 'double', 'extended' or 'quad'"):
            pc.Scene(arm, precision=precision)
    with pytest.raises(pc.EvaluationError, match="fast"):
        pc.Scene(arm, form="slow")


@pytest.mark.parametrize(
    ("effect", "text"),
    [
        (E.GravityCompensation([1.0, 2.0]), "gravity_compensation: share"),
        (E.GravityCompensation(np.nan), "gravity_compensation: share"),
        (E.GravityCompensation(1.0, "lower", points=[1.0, 2.0]), "points has 2 numbers; it takes three for each of 1 bodies"),
        (E.GravityCompensation(1.0, "lower", points=[1.0, 2.0, np.inf]), "points has an entry that is inf"),
        (E.GravityCompensation(g=(0, 0, np.nan)), "gravity_compensation: g has an entry that is"),
        (E.FluidDrag(-1.0), "fluid_drag: density is -1; it is zero or more"),
        (E.FluidDrag(viscosity=np.nan), "fluid_drag: viscosity is"),
        (E.FluidDrag(1.0, wind=(0, np.inf, 0)), "fluid_drag: wind has an entry that is inf"),
        (E.FluidDrag(1.0, bodies="lower", sizes=[[1, 1, 1]]), "sizes and placements belong together"),
        (E.FluidDrag(1.0, bodies="lower", sizes=[[1, 1]], placements=[np.eye(4)]), r"sizes \(1, 2\) and placements \(1, 4, 4\) must be"),
        (E.FluidDrag(1.0, bodies="lower", sizes=[[1, 1, -1]], placements=[np.eye(4)]), "an edge of a box is -1"),
        (E.FluidDrag(1.0, bodies="mark", sizes=[[1, 1, 1]], placements=[np.eye(4)]), "'mark' is on the base, which no fluid moves"),
    ],
)
def test_fields_and_fluids_that_make_no_sense(arm, effect, text):
    with pytest.raises(pc.ModelError, match=text):
        pc.Scene(arm).add(effect)
