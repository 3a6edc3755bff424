"""Loops that are declared between bodies: what they see of an unfinished model, and that building it costs what it has."""

import copy
import time

import pytest

import pycraft as pc
from pycraft.models.linkages import n_four_bar


def seconds(build, size):
    """The least of three, of this thread's own time."""
    times = []
    for _ in range(3):
        begin = time.thread_time()
        build(size)
        times.append(time.thread_time() - begin)
    return min(times)


def geared(count):
    model = pc.Multibody("gears")
    for i in range(count):
        model.add_body(f"wheel{i}", mass=1.0, inertia=[[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    for i in range(1, count):
        model.add_coupling({f"wheel{i - 1}": 1.0, f"wheel{i}": -2.0}, name=f"gear{i}")
    return model


def test_building_is_linear():
    """Of eight times the size at most sixteen times the time: twice, for caches and the clock, of what linear is; quadratic is 64."""
    assert seconds(n_four_bar, 1600) < 16 * seconds(n_four_bar, 200)


def test_couplings_find_their_coordinates():
    model = pc.Multibody("mixed", welds="keep")
    for name, hinge in (("a", "pin"), ("b", "weld"), ("c", "planar"), ("d", "weld"), ("e", "pin"), ("f", "slider"), ("g", "weld")):
        model.add_body(name, hinge=hinge, mass=1.0)
    names = model.coordinate_names
    for i, name in enumerate(names):
        model.add_coupling({names[0]: 1.0, name: 2.0} if i else {name: 2.0}, name=f"gear{i}")
    for i in range(len(names)):
        row = model.loops[f"gear{i}"].jacobian(model.q)[0]
        assert row[i] == 2.0 and model.loops.coupled(f"gear{i}")[-1] == i
    assert len(geared(3).loops.rows) == 2


def test_loops_see_what_is_there_when_they_are_declared():
    model = pc.Multibody("unfinished")
    model.add_body("a", mass=1.0)
    model.add_body("link", "a", hinge="weld", position=(1, 0, 0), mass=1.0)  # a node of a
    model.add_node("tip", "link", position=(1, 0, 0))
    model.add_body("b", mass=1.0)
    with pytest.raises(pc.ModelError, match="loop 'itself' is of 'a' with itself: 'link' and 'tip' stand on it both"):
        model.add_loop("tip", "link", hinge="ball", name="itself")
    with pytest.raises(pc.ModelError, match="with itself"):
        model.add_loop(None, "world", hinge="ball", name="ground")
    with pytest.raises(pc.ModelError, match="no frame of 'unfinished' is called 'tipp'; the nearest is 'tip'"):
        model.add_loop("tipp", "b", hinge="ball")
    model.add_loop("tip", "b", hinge="ball", position=(0, 0, 1), name="closed")
    with pytest.raises(pc.ModelError, match="has a loop called 'closed' already"):
        model.add_loop("b", hinge="ball", name="closed")
    model.add_body("outboard", "a", mass=1.0)  # before b in the order of bodies
    model.add_loop("outboard", "b", hinge="ball", name="second")
    assert list(model.bodies) == ["a", "outboard", "b"] and list(model.loops) == ["closed", "second"]
    model.loops.remove("closed")
    assert "closed" not in model.loops and model.add_loop("b", hinge="ball", name="closed").name == "closed"
    model.add_node("world", "b", position=(0, 0, 1))
    with pytest.raises(pc.ModelError, match="loop 'named' is of 'b' with itself"):
        model.add_loop("b", "world", hinge="ball", name="named")


def test_nodes_that_were_added_are_of_each_model_by_itself():
    arm = pc.chain(2)
    arm.add_node("eye", "body1")
    twin = copy.deepcopy(arm)
    twin.remove_body("body1", with_uses=True)
    with pytest.raises(pc.ModelError, match="node 'eye' is on 'body1'"):
        arm.remove_body("body1")
