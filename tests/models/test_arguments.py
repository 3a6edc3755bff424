"""User input of models: setters check as constructors do. A part of `campaigns.arguments` runs here."""

import numpy as np
import pytest

import pycraft as pc
from campaigns import arguments


def test_a_part_of_the_campaign():
    assert not arguments.run(range(12))


@pytest.mark.slow
def test_the_campaign():
    assert not arguments.run(range(1000, 1400))


def pose(R=None, p=(0, 0, 0)):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = np.eye(3) if R is None else R, p
    return X


def shear():
    X = pose()
    X[0, 1] = 1e-3
    return X


def last_row():
    X = pose()
    X[3, 0] = 1
    return X


NO_POSE = {
    "scaling": (2 * np.eye(3), "not orthogonal .off by 3"),
    "reflection": (np.diag([1.0, 1, -1]), "is a reflection"),
    "inversion": (-np.eye(3), "is a reflection"),
    "shear": (shear()[:3, :3], "not orthogonal .off by 0.001"),
    "nan": (np.full((3, 3), np.nan), "an entry that is not a number"),
    "infinite": (np.diag([np.inf, 1, 1]), "an entry that is not a number"),
    "complex": (np.eye(3) * 1j, "is complex"),
    "text": (np.eye(3).astype(str), "not an array of numbers"),
    "shape": (np.eye(4), "takes a 3 x 3 matrix, not an array .4, 4."),
    "one row": (np.eye(3)[:1], "takes a 3 x 3 matrix, not an array .1, 3."),
}


@pytest.mark.parametrize("case", NO_POSE)
def test_a_pose_is_checked_wherever_it_is_taken(case):
    R, says = NO_POSE[case]
    arm = pc.chain(2)
    before = str(arm.description())
    takes = {
        "rotation of a body": lambda: arm.add_body("new", "body1", rotation=R, mass=1.0),
        "rotation of a node": lambda: arm.add_node("tip", "body1", rotation=R),
    }
    if R.shape == (3, 3):
        X = np.eye(4, dtype=R.dtype) if R.dtype.kind != "U" else np.eye(4).astype(str)
        X[:3, :3] = R
        if R.dtype.kind == "U":
            says = "last row of a pose|not an array of numbers"
        takes["placement of a body"] = lambda: arm.add_body("new", "body1", placement=X, mass=1.0)
        takes["placement of a node"] = lambda: arm.add_node("tip", "body1", placement=X)
        takes["placement of a hinge"] = lambda: setattr(arm.hinges["hinge1"], "placement", X)
        description = arm.description()
        description["bodies"][1]["hinge"]["placement"]["rotation"] = R
        takes["description"] = lambda: pc.Multibody.from_description(description)
        if "reflection" in says:  # a lump goes the same way
            takes["weld"] = lambda: arm.add_body("new", "body1", "weld", rotation=R, mass=1.0)
    for name, take in takes.items():
        with pytest.raises(pc.ModelError, match=says):
            take()
        assert str(arm.description()) == before, name


@pytest.mark.parametrize(
    ("placement", "says"),
    [
        (np.eye(3), r"takes a \(4, 4\) pose, not an array \(3, 3\)"),
        (np.eye(4)[None], r"takes a \(4, 4\) pose"),
        (last_row(), r"the last row of a pose is \(0, 0, 0, 1\), not \(1.0, 0.0, 0.0, 1.0\)"),
        (pose(p=(np.nan, 0, 0)), "an entry that is not a number"),
    ],
)
def test_placements(placement, says):
    arm = pc.chain(2)
    for take in (
        lambda: setattr(arm.hinges["hinge1"], "placement", placement),
        lambda: arm.add_body("new", placement=placement, mass=1.0),
        lambda: arm.add_node("tip", placement=placement),
    ):
        with pytest.raises(pc.ModelError, match=says):
            take()
    with pytest.raises(pc.ModelError, match="placement, or rotation and position, not both"):
        arm.add_node("tip", placement=np.eye(4), position=(0, 0, 1))


def test_a_rotation_of_seven_digits_becomes_the_nearest_one():
    """Orthogonal to the last bits, within what it was off; one that is orthogonal to rounding is left to the bit."""
    angle = 0.7
    exact = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    arm = pc.chain(1)
    arm.hinges["hinge0"].placement = pose(exact)
    assert np.array_equal(arm.hinges["hinge0"].placement[:3, :3], exact)
    arm.hinges["hinge0"].placement = pose(np.round(exact, 7))
    found = arm.hinges["hinge0"].placement[:3, :3]
    assert np.abs(found @ found.T - np.eye(3)).max() <= 4 * np.finfo(float).eps
    assert np.abs(found - exact).max() <= 1e-7
    again = pc.Multibody.from_description(arm.description())
    assert np.array_equal(again.hinges["hinge0"].placement[:3, :3], found)


LIMITS = [
    ("pin", (1, -1), r"limits \(1, -1\) are the wrong way round"),
    ("pin", (np.nan, 1), r"leave no position"),
    ("pin", (np.inf, np.inf), r"leave no position"),
    ("pin", (-np.inf, -np.inf), r"leave no position"),
    ("pin", ([0, 0], [1, 1]), r"takes 1 lower and 1 upper limits, one a subhinge .pin., not 2 and 2"),
    ("pin", ([0], [1, 1]), r"not 1 and 2"),
    ("universal", (-1, 1), r"takes 2 lower and 2 upper"),
    ("ball", (-1, 1), r"of a ball subhinge; only one coordinate has limits"),
    ("weld", (-1, 1), r"takes 0 lower and 0 upper|has 0"),
    ("pin", 3, r"a pair \(lower, upper\)"),
    ("pin", ("a", "b"), "not an array of numbers"),
]


@pytest.mark.parametrize(("kind", "limits", "says"), LIMITS)
def test_limits_are_checked_wherever_they_are_taken(kind, limits, says):
    arm = pc.Multibody("arm", welds="keep")
    with pytest.raises(pc.ModelError, match=says):
        arm.add_body("link", hinge=kind, mass=1.0, inertia=np.eye(3), limits=limits)
    assert not len(arm.bodies)
    arm.add_body("link", hinge=kind, mass=1.0, inertia=np.eye(3))
    with pytest.raises(pc.ModelError, match=says):
        arm.hinges["link"].limits = limits
    assert arm.hinges["link"].limits is None


def test_limits_that_are_set_are_drawn_from():
    arm = pc.Multibody("arm")
    arm.add_body("link", hinge="cylindrical", mass=1.0, inertia=np.eye(3))
    hinge = arm.hinges["link"]
    hinge.limits = ([5, -np.inf], [np.inf, -3])  # beyond ±π and ±1 m, and open
    drawn = np.array([arm.random_state(i).q for i in range(50)])
    assert (drawn[:, 0] >= 5).all() and (drawn[:, 1] <= -3).all() and np.isfinite(drawn).all() and np.ptp(drawn, axis=0).min() > 0.5
    hinge.limits = None
    assert hinge.limits is None


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (dict(hinge="custom", subhinges=[{}]), "a subhinge says its kind"),
        (dict(hinge="custom", subhinges=[{"kind": 3}]), "a subhinge says its kind"),
        (dict(hinge="custom", subhinges=[{"kind": "knee"}]), "no subhinge kind is called 'knee'"),
        (dict(hinge="custom", subhinges=["pin"]), "a subhinge is a dict"),
        (dict(hinge="custom", subhinges=[{"kind": "pin", "axes": (0, 0, 1)}]), "a subhinge has no 'axes'; there are kind, axis"),
        (dict(hinge="custom", subhinges=[{"kind": "pin", "pitch": 1}]), "of kind 'pin' has no pitch"),
        (dict(hinge="custom"), "a custom hinge takes subhinges"),
        (dict(hinge="custom", subhinges=[{"kind": "pin"}], axis=(0, 0, 1)), "and nothing else"),
        (dict(hinge="pin", subhinges=[{"kind": "pin"}]), "subhinges belong to a hinge of kind 'custom', not 'pin'"),
        (dict(hinge="weld", axis=(0, 0, 1)), "of kind 'weld' takes 0 axes, not 1"),
        (dict(hinge="free", point=(0, 0, 1)), "of kind 'free' has no point"),
        (dict(hinge="slider", pitch=0.1), "of kind 'slider' has no pitch"),
        (dict(hinge="pin", rotor_inertia=[1, 2]), "has 1 coordinates and 2 rotor inertias"),
        (dict(hinge="ball", rotor_inertia=[[1, 2, 3]]), "takes a number or a list of numbers"),
        (dict(hinge="pin", mass="3"), "mass of body 'link' is not an array of numbers"),
        (dict(hinge="pin", mass=[1.0]), "mass of body 'link' takes one number"),
        (dict(hinge="pin", com=[[0, 0, 1]]), "takes 3 numbers, not an array .1, 3."),
        (dict(hinge="pin", com=np.array([1, 2, 3], "timedelta64[s]")), "not an array of numbers"),
        (dict(hinge="pin", com=np.ma.masked_array([1.0, 2, 3], [0, 1, 0])), "has masked entries"),
    ],
)  # fmt: skip
def test_hinges_and_bodies(options, says):
    arm = pc.Multibody("arm")
    with pytest.raises(pc.ModelError, match=says):
        arm.add_body("link", **({"mass": 1.0} | options))
    assert not len(arm.bodies) and not len(arm.nodes)


def test_rotor_inertias_are_set_as_they_are_given():
    arm = pc.Multibody("arm")
    arm.add_body("link", hinge="ball", mass=1.0, inertia=np.eye(3), rotor_inertia=2.0)
    hinge = arm.hinges["link"]
    assert hinge.rotor_inertia.tolist() == [2, 2, 2]
    for value, says in (
        ([1, 2], "has 3 coordinates and 2 rotor inertias"),
        (-1, "is not a nonnegative number"),
        ("2", "not an array of numbers"),
    ):
        with pytest.raises(pc.ModelError, match=says):
            hinge.rotor_inertia = value
    hinge.rotor_inertia = [1, 2, 3]
    assert hinge.rotor_inertia.tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    "q",
    [[[0.1, 0.2]], 0.1, ["1", "2"], np.array(["2020", "2021"], "datetime64[Y]"), np.array([1, "2"], object), [0.1, None], "ab", [1j, 0]],
)
def test_a_state_is_a_list_of_numbers(q):
    arm = pc.chain(2)
    for take in (
        lambda: setattr(arm, "q", q), lambda: setattr(arm, "v", q), lambda: arm.integrate(q, [0, 0]), lambda: arm.integrate([0, 0], q),
        lambda: arm.difference([0, 0], q),
    ):  # fmt: skip
        with pytest.raises(pc.ModelError):
            take()
    assert not arm.q.any() and not arm.v.any()


def test_numbers_of_any_real_kind_are_taken():
    from decimal import Decimal
    from fractions import Fraction

    arm = pc.chain(2)
    for q in ((0.5, 1), [np.float32(0.5), True], np.array([0.5, 1], object), [Fraction(1, 2), Decimal(1)], np.matrix([[0.5, 1]]).A1):
        arm.q = q
        assert arm.q.tolist() == [0.5, 1.0]


def test_none_is_no_number():
    """NumPy reads None among numbers as NaN; a matrix of velocities for one state is none either."""
    arm = pc.chain(2)
    with pytest.raises(pc.ModelError, match="q is not an array of numbers"):
        arm.mass_matrix([0.1, None])
    with pytest.raises(pc.ModelError, match="v of 'chain of 2 rods' takes 2 numbers"):
        arm.coriolis_matrix([0, 0], [0, 0, 0])
    with pytest.raises(pc.ModelError, match="a chain of -1 bodies"):
        pc.chain(-1)


def test_two_coordinates_never_have_one_name():
    arm = pc.Multibody("arm")
    arm.add_body("a", hinge="universal", mass=1.0, inertia=np.eye(3), hinge_name="wrist")
    with pytest.raises(pc.ModelError, match=r"would be called 'wrist\[1\]', as one of hinge 'wrist'"):
        arm.add_body("b", "a", mass=1.0, hinge_name="wrist[1]")
    arm.add_body("b", "a", mass=1.0, hinge_name="wrist[2]")
    with pytest.raises(pc.ModelError, match=r"would be called 'elbow\[0\]', as one of hinge 'elbow\[0\]'"):
        arm.add_body("c", "a", mass=1.0, hinge_name="elbow[0]")
        arm.add_body("d", "a", hinge="ball", mass=1.0, inertia=np.eye(3), hinge_name="elbow")
    assert len(set(arm.coordinate_names)) == arm.nv


class Outside:
    """A linear operator as SciPy has them, with a given product."""

    def __init__(self, result):
        self.result, self.shape, self.dtype = result, (3, 3), np.dtype(float)


@pytest.mark.parametrize(
    ("result", "says"),
    [
        (np.zeros(3) * 1j, "is complex"),
        (np.zeros((1, 3)), r"is an array \(1, 3\); of an array \(3, 1\) it is \(3, 1\)"),
        (np.zeros(4), r"is 4; of an array \(3, 1\) it is \(3, 1\)"),
        ("three", "is not an array of numbers"),
        (None, "is not an array of numbers"),
    ],
)
def test_results_of_operators_from_outside(result, says):
    from pycraft import _core

    arm = pc.chain(3)
    A = _core.external(lambda x: result, None, arm.soa.Theta, arm.soa.Theta, "A")
    with pytest.raises(pc.Error, match="result of 'A', an operator from outside, " + says):
        (arm.soa.I + A) @ np.ones(3)


def test_descriptions_are_checked():
    good = pc.chain(2, "universal").description()
    for change, says in (
        (lambda d: d.pop("bodies"), "'bodies' is missing"),
        (lambda d: d["bodies"][1].pop("hinge"), "'hinge' is missing"),
        (lambda d: d["bodies"][1].update(parent=7), "refers to number 7"),
        (
            lambda d: d["bodies"][1]["hinge"].update(kind="ball"),
            "has the subhinges ball, not pin, pin; a hinge of your own is of kind 'custom'",
        ),
        (lambda d: d["bodies"][1]["hinge"].update(lower=[1], upper=[0]), "takes 2 lower"),
        (lambda d: d.update(q=[[0, 0, 0, 0]]), "q is a list of numbers"),
    ):
        import copy

        bad = copy.deepcopy(good)
        change(bad)
        with pytest.raises(pc.ModelError, match=says):
            pc.Multibody.from_description(bad)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: pc.tree([-1, 1], "pin"), "body 1 of a tree has parent 1; parents come before their children"),
        (lambda: pc.tree([-1, -2], "pin"), "body 1 of a tree has parent -2"),
        (lambda: pc.chain(2, seed=-1), "seed must be a whole number from 0 on, or a numpy.random.Generator, not -1"),
        (lambda: pc.chain(2, seed=True), "seed must be a whole number, not True"),
        (lambda: pc.chain(True), "the number of bodies of a chain must be a whole number, not True"),
        (lambda: pc.chain(2.0), "the number of bodies of a chain must be a whole number, not 2.0"),
        (lambda: pc.chain(2, mass=[1.0]), "mass of a rod takes one number, not an array"),
    ],
)
def test_counts_seeds_parents_and_single_numbers(call, words):
    with pytest.raises(pc.ModelError, match=words):
        call()
