"""Refusals of loops, each by name and with the remedy; a refused loop leaves nothing behind."""

import numpy as np
import pytest
from scipy.interpolate import PPoly

import pycraft as pc


def bad_turn():
    X = np.eye(4)
    X[0, 0] = 2
    return X


LOOPS = [
    (dict(b="body1", a="body1"), r"loop 'body1 to body1' is of 'body1' with itself"),
    (dict(b="tip", a="body2", name="x"), r"loop 'x' is of 'body2' with itself: 'body2' and 'tip' stand on it both"),
    (dict(b=None), r"is of the base with itself"),
    (dict(b="wall"), r"is of the base with itself: the base and 'wall'"),
    (dict(b="bodi2"), r"no frame of 'chain of 3 rods' is called 'bodi2'; the nearest is 'body2'"),
    (dict(b="body2", a="nowhere at all"), r"no frame of 'chain of 3 rods' is called 'nowhere at all'"),
    (dict(b=7), r"an end of a loop is named by a string, not by 7"),
    (dict(b="body2", hinge="hinge"), r"hinge"),
    (dict(b="body2", axis=(0, 0, 0)), r"its axis has length 0"),
    (dict(b="body2", axis=(0, 0, np.nan)), r"loop|hinge 'base to body2'"),
    (dict(b="body2", axis=(0, 0, 1), axes=[(0, 0, 1)]), r"loop 'base to body2': give axis or axes, not both"),
    (dict(b="body2", position=(0, np.inf, 0)), r"the placement of hinge 'base to body2'"),
    (dict(b="body2", placement=bad_turn()), r"the placement of hinge 'base to body2'"),
    (dict(b="body2", placement=np.eye(3)), r"placement of loop 'base to body2' takes a \(4, 4\) pose"),
    (dict(b="body2", hinge="universal", axes=[(0, 0, 1), (0, 0, 2)]), r"axes of its universal hinge are parallel"),
    (
        dict(b="body2", hinge="gimbal", axes=[(0, 0, 1), (0, 1, 1), (0, 0, 1)], pitch=1.0, point=(0, 0, np.nan)),
        r"hinge 'base to body2'",
    ),
    (dict(b="body2", hinge="custom"), r"loop 'base to body2': a custom hinge takes subhinges=\[...\]"),
    (dict(b="body2", hinge="screw", pitch=np.nan), r"pitch|not finite"),
    (dict(b="body2", name=""), r"a loop of 'chain of 3 rods' has no name"),
    (dict(b="body2", name="taken"), r"'chain of 3 rods' has a loop called 'taken' already"),
]
COUPLINGS = [
    (dict(coordinates={}), r"coupling 'coupling' is of no coordinate"),
    (dict(coordinates={"hinge9": 1.0}), r"no hinge or coordinate of 'chain of 3 rods' is called 'hinge9'"),
    (dict(coordinates={"hinge0": 1.0, 0: 1.0}), r"names coordinate 'hinge0' twice"),
    (dict(coordinates={"hinge0": 0.0, "hinge1": [1.0]}), r"no coefficient but zeros"),
    (dict(coordinates={"hinge0": np.inf}), r"coefficient of 'hinge0' that is not a finite number"),
    (dict(coordinates={"hinge0": "two"}), r"coefficients of 'hinge0' in coupling 'coupling'"),
    (dict(coordinates={"hinge0": np.eye(2)}), r"one number, or those of 1, q, q²"),
    (dict(coordinates={"hinge0": 1.0}, constant=np.nan), r"constant that is not a finite number"),
    (dict(coordinates=["hinge0"]), r"coefficients by coordinate"),
    (dict(coordinates={"hinge0": 1.0}, function=abs), r"a list of coordinates beside a function"),
    (dict(coordinates=["hinge0"], function=3), r"a list of coordinates beside a function that can be called, not 3"),
    (dict(coordinates={"ball": 1.0}), r"hinge 'ball' has 3 coordinates; name one of them"),
    (dict(coordinates={4: 1.0}), r"hinge 'ball' of kind 'ball' has no coordinate 1 that is one number in q"),
]
LINE, RING = [[0, 0, 0], [1, 0, 0], [1, 1, 0]], np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [1.0, 0, 0]])
CURVES = [
    (dict(curve=LINE[:1]), r"points \(n, 3\), n at least 2, not \(1, 3\)"),
    (dict(curve=np.zeros((4, 2))), r"points \(n, 3\), n at least 2, not \(4, 2\)"),
    (dict(curve=[[0, 0, 0], [0, 0, 0]]), r"points 0 and 1 of its curve are the same"),
    (dict(curve=[[0, 0, 0], [1, np.nan, 0]]), r"one of their numbers is not finite"),
    (dict(curve=[[0, 0, 0], [1e200, 0, 0], [1e308, 1, 1]]), r"slopes too large for numbers"),
    (dict(curve="wire"), r"is not an array of numbers"),
    (dict(curve=LINE, closed=True), r"n at least 4, not \(3, 3\)"),
    (dict(curve=RING[:-1], closed=True), r"give its first point again as the last"),
    (dict(curve=RING, closed="yes"), r"closed is True or False, not 'yes'"),
    (dict(curve=LINE, parameters=[0, 1]), r"3 points have as many parameters, not 2"),
    (dict(curve=LINE, parameters=[0, 1, 1]), r"parameters are two numbers at least, finite, and ascend"),
    (dict(curve=[[0, 0, 0], [1, 0, 0], [0, 0, 0]]), r"stands still or turns back near parameter 1"),
    (dict(curve=lambda s: (s, s, s)), r"beside a function give parameters=\(first, last\)"),
    (dict(curve=lambda s: s, parameters=(0, 1)), r"gives three finite numbers, and at 0 it gives 0"),
    (dict(curve=lambda s: (s, s, np.inf), parameters=(0, 1)), r"gives three finite numbers, and at 0 it gives"),
    (dict(curve=lambda s: (s, abs(s - 0.3), 0), parameters=(0, 1)), r"not smooth near parameter 0.3"),
    (dict(curve=lambda s: (s**2, s**3, 0), parameters=(-1, 1)), r"corner at parameter 0"),
    (dict(curve=lambda s: (0, 0, 0), parameters=(-1, 1)), r"stands still or turns back near parameter -1"),
    (dict(curve=lambda s: (s, 0, 0), parameters=(0, 1), closed=True), r"jumps at parameter 1; a closed curve ends where it begins"),
    (dict(curve=PPoly([[[1.0, 2.0]]], [0, 1])), r"a piecewise polynomial gives points \(3,\), not \(2,\)"),
    (dict(curve=PPoly([[[1.0, 0, 0], [0, 1, 0]], [[0, 0, 0], [1, 0, 0]]], [0, 1, 2])), r"corner at parameter 1"),
    (dict(curve=PPoly([[[1.0, 0, 0], [0, 1, 0]], [[0, 0, 0], [1, 1, 0]]], [0, 1, 2])), r"jumps at parameter 1; a curve is continuous"),
    (dict(curve=PPoly([[[1.0, 0, 0]]], [0, 1]), parameters=(0, 1)), r"has its own parameters"),
    (dict(curve=LINE, on="tip"), r"is of 'body2' with itself: 'tip' and 'body2' stand on it both"),
]
OTHERS = [
    ("add_rolling", dict(b="body2", kind="cube"), r"kind='cube' of a rolling body: there are 'wheel', 'ball', 'blade'"),
    ("add_rolling", dict(b="body2"), r"a wheel rolls on its radius: give radius= in metres"),
    ("add_rolling", dict(b="body2", kind="blade", radius=1.0), r"a blade has no radius"),
    ("add_rolling", dict(b="body2", radius=-1.0), r"a radius is a positive number \(m\), not -1"),
    ("add_rolling", dict(b="body2", radius=np.nan), r"a radius is a positive number"),
    ("add_surface", dict(point="body2", c=1.0), r"with A and b zero is no surface"),
    ("add_surface", dict(point="body2", b=(0, np.nan, 0)), r"its surface has a number that is not finite"),
    ("add_surface", dict(point="body2", A=np.eye(2)), r"A of the surface of 'base to body2' takes a 3 x 3 matrix"),
    *(("add_curve", {"point": "body2", "name": "w"} | given, rf"loop 'w'.*{said}") for given, said in CURVES),
]


def mechanism():
    model = pc.chain(3)
    model.add_body("shoulder", hinge="ball", hinge_name="ball", mass=1.0)
    model.add_node("tip", "body2", position=(1, 0, 0))
    model.add_node("wall", position=(1, 0, 0))
    model.add_loop("body2", hinge="ball", name="taken")
    return model


@pytest.mark.parametrize(
    ("call", "given", "said"),
    [*(("add_loop", *case) for case in LOOPS), *(("add_coupling", *case) for case in COUPLINGS), *OTHERS],
)
def test_refusals_name_what_is_wrong_and_leave_everything(call, given, said):
    model = mechanism()
    before = model.loops.jacobian()
    with pytest.raises(pc.ModelError, match=said):
        getattr(model, call)(**given)
    assert list(model.loops) == ["taken"] and np.array_equal(model.loops.jacobian(), before)
    assert [loop["name"] for loop in model.description()["loops"]] == ["taken"]


def test_frames_of_another_model():
    model, other = mechanism(), pc.chain(2)
    with pytest.raises(pc.ModelError, match="frame 'body1' belongs to another model, 'chain of 2 rods', not to"):
        model.add_loop(other.bodies["body1"])
    assert model.add_loop(model.bodies["body1"], model.nodes["tip"], "weld").name == "tip to body1"


def test_a_loop_whose_body_is_gone():
    model = mechanism()
    model.add_coupling({"hinge2": 1.0, "hinge0": 1.0}, name="gear")
    model._remove_body("body2")  # the core knows of no loops
    loop = model.loops["taken"]
    for ask in (model.loops.residual, model.loops.jacobian, model.loops.bias, loop.residual, lambda: model.loops.rows):
        with pytest.raises(
            pc.ModelError,
            match="loop 'taken' of 'chain of 3 rods' has lost what it was declared on: .*'body2'.*; remove it, or declare it anew",
        ):
            ask()
    assert "without the bodies that it was declared on" in repr(loop) and len(model.loops) == 2
    loop.remove()
    with pytest.raises(pc.ModelError, match="coupling 'gear' of 'chain of 3 rods' has lost what it was declared on"):
        model.loops.jacobian()
    model.loops.remove("gear")
    assert model.loops.rows == []
    with pytest.raises(pc.ModelError, match="no loop called 'taken'"):
        loop.jacobian()
    with pytest.raises(pc.ModelError, match="'chain of 3 rods' has no loop called 'taken'; it has none"):
        loop.remove()
    with pytest.raises(KeyError, match="there are none"):
        model.loops["taken"]


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda q: q[0], r"the function of coupling 'cam' returns \(r, gradient, second derivatives\)"),
        (lambda q: (q[0], [1.0]), r"returns \(r, gradient, second derivatives\)"),
        (lambda q: (q[0], [1.0, 2.0], [[0.0]]), r"the gradient of the function of coupling 'cam'"),
        (lambda q: (q[0], [1.0], [0.0]), r"the second derivatives of the function of coupling 'cam'"),
        (lambda q: (q[0], [1j], [[0.0]]), r"the gradient of the function of coupling 'cam' is complex"),
    ],
)
def test_functions_that_return_what_they_should_not(function, said):
    model = pc.chain(1)
    model.add_coupling(["hinge0"], function=function, name="cam")
    with pytest.raises(pc.ModelError, match=said):
        model.loops.jacobian()


def test_second_derivatives_of_one_triangle():
    """They are symmetric, to what differences leave: a bias by one triangle would be right, and a derivative of the row by it wrong."""
    model = pc.chain(2)
    model.add_coupling(["hinge0", "hinge1"], function=lambda q: (q[0] * q[1], [q[1], q[0]], [[0.0, 2.0], [0.0, 0.0]]), name="cam")
    with pytest.raises(
        pc.ModelError, match=r"of the function of coupling 'cam' are not symmetric: entries \(0, 1\) and \(1, 0\) are 2 and 0"
    ):
        model.loops.bias([0.1, 0.2], [1.0, 1.0])
    model.loops.remove("cam")
    model.add_coupling(["hinge0", "hinge1"], function=lambda q: (q[0] * q[1], [q[1], q[0]], [[0.0, 1.0], [1.0 + 1e-6, 0.0]]))
    assert abs(model.loops.bias([0.1, 0.2], [1.0, 1.0])[0] - 2) < 1e-5  # by differences


def test_states_and_precisions_that_are_none():
    model = mechanism()
    with pytest.raises(pc.ModelError, match="q of 'chain of 3 rods'"):
        model.loops.residual([0.0])
    with pytest.raises(pc.ModelError, match="q"):
        model.loops.jacobian(np.full(model.nq, np.nan))
    with pytest.raises(pc.EvaluationError, match="'single' to 'quad'"):
        model.loops.jacobian(precision=50)
    model.add_coupling(["hinge0"], function=lambda q: (q[0], [1.0], [[0.0]]), name="cam")
    with pytest.raises(pc.EvaluationError, match="coupling 'cam' is a function in double precision"):
        model.loops.residual(precision="quad")
    with pytest.raises(pc.ModelError, match="takes no 'rows'"):
        model.loops.rows = []


@pytest.mark.parametrize("size", [1e300, 1e-9])
def test_an_axis_of_any_length_is_a_direction(size):
    huge, unit = pc.chain(3), pc.chain(3)
    huge.add_loop("body2", axis=(size, -size, 0))
    unit.add_loop("body2", axis=(np.sqrt(0.5), -np.sqrt(0.5), 0))
    assert np.abs(huge.loops.residual([0.1, 0.2, 0.3]) - unit.loops.residual([0.1, 0.2, 0.3])).max() < 1e-15
