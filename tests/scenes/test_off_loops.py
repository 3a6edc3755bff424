"""A scene that is evaluated off its kept loops warns and names the row; states on them, and loops with gains, give no warning."""

import warnings

import numpy as np
import pytest

import pycraft as pc
from support.linkages import four_bar

E = pc.effects


@pytest.mark.parametrize("method", ["augment", "embed"])
def test_positions_and_velocities(method):
    bars, state = four_bar()
    scene = pc.Scene(bars).add(E.Gravity((0, -9.81, 0)), E.Loop(method=method))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        said = scene.evaluate(state.q, state.v)
        scene.evaluate(state.q)
    off = np.array(state.q) + [0.0, 0.01, 0.0]
    with pytest.warns(
        pc.ModelWarning,
        match=r"the state is off row 'closure: along [xy]' of 'chain of 3 rods' by 0.0\d+: accelerations do not correct that",
    ):
        scene.evaluate(off, state.v)
    with pytest.warns(pc.ModelWarning, match=r"the state is off row 'closure: along [xy]'"):
        scene.evaluate(off)
    with pytest.warns(pc.ModelWarning, match=r"the state moves off row 'closure: along [xy]' of 'chain of 3 rods' by 0.841: accelerations"):
        scene.evaluate(state.q, np.array(state.v) + [0, 1.0, 0])
    assert np.abs(bars.loops.jacobian(state.q) @ said.vdot + bars.loops.bias(state.q, state.v)).max() < 1e-10


def test_what_keeps_no_loops_says_nothing():
    """The tree alone, an effect that is off, other loops than those that are missed, and gains or springs, which draw the state back."""
    bars, state = four_bar()
    bars.add_coupling({"hinge0": 1.0, "hinge1": 1.0}, name="parallel")
    off = np.array(state.q) + [0.0, 0.0, 0.3]
    scenes = [
        pc.Scene(bars).add(E.Gravity()),
        pc.Scene(bars).add(E.Gravity(), E.Loop()).disable("loop"),
        pc.Scene(bars).add(E.Gravity(), E.Loop("parallel")),
        pc.Scene(bars).add(E.Gravity(), E.Loop(alpha=10.0, beta=10.0)),
        pc.Scene(bars).add(E.Gravity(), E.Loop("closure", method="penalty", frequency=100.0)),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for scene in scenes:
            scene.evaluate(off)
    with pytest.warns(pc.ModelWarning, match="closure"):
        pc.Scene(bars).add(E.Loop()).evaluate(off)
