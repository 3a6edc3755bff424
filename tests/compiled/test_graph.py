"""Graphs of operations: folding changes no value, and what is left out is not there."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pycraft.compiled.graph import Graph
from support.graphs import Node, evaluated, inputs

ANGLES = [0.3, -1.7, 2.5]
CONSTANTS = [0.0, 1.0, -1.0, 2.0, 0.5, -4.0, 0.1, -3.7]


def recipes():
    """Expressions as nested tuples of inputs, constants and operations."""
    leaves = st.one_of(st.integers(0, 2).map(lambda i: ("x", i)), st.sampled_from(CONSTANTS).map(lambda c: ("c", c)))
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            st.tuples(st.sampled_from(["add", "subtract", "multiply"]), inner, inner),
            st.tuples(st.sampled_from(["negate", "magnitude"]), inner),
        ),
        max_leaves=25,
    )


def cooked(recipe, x, of_function):
    match recipe:
        case ("x", i):
            return x[i]
        case ("c", c):
            return c
        case ("negate", a):
            return -cooked(a, x, of_function)
        case ("magnitude", a):
            return abs(cooked(a, x, of_function))
        case (name, a, b):
            first, second = cooked(a, x, of_function), cooked(b, x, of_function)
            return {"add": lambda: first + second, "subtract": lambda: first - second, "multiply": lambda: first * second}[name]()


@given(recipes())
def test_folding_changes_no_bit(recipe):
    """Order of two terms, signs moved outward and powers of two are exact; 0 x is 0 and x - x is 0 for finite x."""
    graph = Graph()
    made = cooked(recipe, inputs(graph, "x", 3), None)
    node = made.index if isinstance(made, Node) else graph.number(made)
    (found,), _ = evaluated(graph, np.array(node), {"x": np.array([ANGLES])})
    assert found == cooked(recipe, ANGLES, None)


def test_what_is_zero_or_one_is_left_out():
    graph = Graph()
    x, y = inputs(graph, "x", 2)
    before = len(graph.operations)
    assert {made.index for made in (x + 0, 0 + x, x - 0, x * 1, 1 * x, x / 1, x + (y - y))} == {x.index}
    assert (x * 0).value == 0 and (0 / x).value == 0 and (x - x).value == 0
    assert len(graph.operations) == before + 2  # the constant one, and 1/x, which must be finite
    assert (-(0 - x)).index == x.index


def test_equal_operations_are_one():
    graph = Graph()
    x, y = inputs(graph, "x", 2)
    assert (x * y).index == (y * x).index and (x + y).index == (y + x).index
    assert ((-x) * (-y)).index == (x * y).index and (x - (-y)).index == (x + y).index
    assert (2.0 * (0.1 * x)).index == (0.2 * x).index
    (twice,), _ = evaluated(graph, np.array((3.0 * (0.1 * x)).index), {"x": np.array([[0.7, 0.0]])})
    assert twice == 3.0 * (0.1 * 0.7) != (3.0 * 0.1) * 0.7  # rounded in the order that was written


def test_differences_the_other_way_round_are_the_same_but_for_a_sign():
    graph = Graph()
    x, y, z = inputs(graph, "x", 3)
    assert (z + (y - x)).index == (z - (x - y)).index
    assert (-(x - y)).index == (y - x).index
    assert ((x - y) * (y - x)).index == (-((x - y) * (x - y))).index


def test_a_turn_is_one_along_its_axis():
    graph = Graph()
    x, y = inputs(graph, "x", 2)
    half = (x * 0.5).put("sine")
    assert (x.put("cosine") + 2 * half * half).value == 1 and (2 * half * half + x.put("cosine")).value == 1
    assert (y.put("cosine") + 2 * half * half).value is None  # of another angle
    assert (x.put("cosine") + 3 * half * half).value is None


def test_the_root_of_a_square_is_a_magnitude():
    graph = Graph()
    x, y = inputs(graph, "x", 2)
    assert (x * x).put("sqrt").index == abs(x).index
    made = (x * y).put("sqrt")
    (found,), _ = evaluated(graph, np.array(made.index), {"x": np.array([[2.0, 8.0]])})
    assert found == 4.0


def test_what_is_divided_by_one_number_has_its_one_reciprocal():
    graph = Graph()
    x, y, z = inputs(graph, "x", 3)
    made = [x / z, y / z, 1 / z]
    assert sum(operation[0] == "divide" for operation in graph.operations) == 1
    (found,), _ = evaluated(graph, np.array([m.index for m in made]), {"x": np.array([[3.0, -5.0, 7.0]])})
    np.testing.assert_allclose(found, [3 / 7, -5 / 7, 1 / 7], rtol=2 * np.finfo(float).eps)  # of the reciprocal and of the product
    assert (x / 4).index == (x * 0.25).index


def test_fraction_and_exponent():
    graph = Graph()
    (x,) = inputs(graph, "x", 1)
    nodes = np.array([x.put("fraction").index, x.put("exponent").index])
    (found,), _ = evaluated(graph, nodes, {"x": np.array([[-12.0]])})
    assert found.tolist() == [-0.75, 4.0]
    assert graph.constant_of(graph.put("exponent", graph.number(12.0))) == 4


def test_guards_are_decided_at_each_state():
    graph = Graph()
    (x,) = inputs(graph, "x", 1)
    graph.guards.append(x.put("greater", 1.0).index)
    assert [evaluated(graph, np.array(x.index), {"x": np.array([[v]])})[1][0] for v in (0.5, 2.0)] == [False, True]


def test_only_what_is_needed_is_written():
    graph = Graph()
    x, y = inputs(graph, "x", 2)
    wanted, _ = x * y, x + y
    graph.guards.append(y.put("greater", 0.25).index)
    assert len(graph.needed([wanted.index])) == 5  # x, y, x y, 0.25, y > 0.25


def test_values_that_were_dropped_are_checked():
    """0 x is NaN where x is not finite. The code checks x, or its factors where x is computed for nothing else."""
    graph = Graph()
    x, y, z = inputs(graph, "x", 3)
    inverse = 1 / x
    dropped = [0 * (inverse * y), inverse * y - inverse * y, 0 * (x * y * z), 0 * Node(graph, graph.put("sine", y.index))]
    assert [made.value for made in dropped] == [0.0] * 4
    shown = np.array([(inverse + y).index])
    assert graph.checked(shown.tolist()) == [inverse.index]  # inverse may be finite and inverse · y not
    results = np.array([(y / (y + inverse)).index])
    found, sound = evaluated(graph, results, {"x": np.array([[2.0, 1.0, 1.0], [0.0, 1.0, 1.0], [1e-70, 1.0, 1.0]])})
    assert np.isfinite(found).all() and sound.tolist() == [True, False, False]


def test_a_dropped_value_that_shows_needs_no_check():
    graph = Graph()
    x, y = inputs(graph, "x", 2)
    root = x.put("sqrt")
    assert (0 * root).value == 0 and graph.finite
    assert graph.checked([(2 * root - y).index]) == []
    assert graph.checked([(1 / root).index]) == [root.index]
    assert np.isnan(graph.constant_of(graph.put("multiply", graph.zero, graph.number(np.inf))))
